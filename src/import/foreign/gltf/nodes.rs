//! Nodes: the forest they form, and where each stands.

use gltf::json::{Index, scene};

use super::GltfSource;
use super::animation::Motion;
use crate::error::Result;
use crate::import::Draft;
use crate::math::{DAffine3, DMat3, DQuat, DVec3};

/// The nodes in an order in which parents come before their children.
#[derive(Debug)]
pub struct Tree {
    parents: Vec<Option<usize>>,
    order: Vec<usize>,
    /// Nodes of the scene that is shown, in the same order.
    pub shown: Vec<usize>,
}

/// Where nodes stand at a moment.
#[derive(Debug)]
pub struct Pose {
    /// World from node, for every node.
    pub world: Vec<DAffine3>,
    /// Weights of morph targets that an animation gives a node.
    pub weights: Vec<Option<Vec<f32>>>,
}

impl Tree {
    /// Finds the nodes of the scene to show.
    ///
    /// # Errors
    /// If a node has two parents or is below itself.
    pub fn new(source: GltfSource, draft: &mut Draft) -> Result<Self> {
        let nodes = &source.root.nodes;
        let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            for (k, child) in children(node).enumerate() {
                let place = format!("nodes[{i}].children[{k}]");
                match parents.get_mut(child) {
                    Some(Some(other)) => {
                        return Err(source.fault(
                            &place,
                            format!("nodes[{child}] is below nodes[{other}] too: a node has one parent"),
                        ));
                    }
                    Some(parent) => *parent = Some(i),
                    None => return Err(source.fault(&place, "no such node")),
                }
            }
        }

        let roots: Vec<usize> = (0..nodes.len()).filter(|&i| parents[i].is_none()).collect();
        let order = below(nodes, &roots);
        if order.len() < nodes.len() {
            let mut reached = vec![false; nodes.len()];
            order.iter().for_each(|&i| reached[i] = true);
            let lost = reached.iter().position(|reached| !reached).unwrap_or_default();
            return Err(source.fault(
                &format!("nodes[{lost}]"),
                "is below itself, or below a node that is: nodes must not form a cycle",
            ));
        }
        let shown = below(nodes, &shown_roots(source, &parents, roots, draft)?);
        Ok(Self { parents, order, shown })
    }

    /// Where all nodes stand.
    pub fn pose(&self, source: GltfSource, motion: &Motion) -> Result<Pose> {
        let nodes = &source.root.nodes;
        let mut world = vec![DAffine3::IDENTITY; nodes.len()];
        for &i in &self.order {
            let path = format!("nodes[{i}]");
            let outer = self.parents[i].map_or(DAffine3::IDENTITY, |parent| world[parent]);
            world[i] = outer * local(source, &path, &nodes[i], motion, i)?;
            if !world[i].is_finite() {
                return Err(source.fault(&path, "the transform is not finite"));
            }
        }
        Ok(Pose { world, weights: (0..nodes.len()).map(|i| motion.weights.get(&i).cloned()).collect() })
    }
}

/// The roots of the scene that the file means.
fn shown_roots(
    source: GltfSource,
    parents: &[Option<usize>],
    roots: Vec<usize>,
    draft: &mut Draft,
) -> Result<Vec<usize>> {
    let scenes = &source.root.scenes;
    let chosen = source.root.scene.map_or(0, |index| index.value());
    let Some(scene) = scenes.get(chosen) else {
        draft.approximated("scenes", "file", "scenes", "no scene: all nodes are shown");
        return Ok(roots);
    };
    for (i, _) in scenes.iter().enumerate().filter(|(i, _)| *i != chosen) {
        draft.ignored(&format!("scenes[{i}]"), "scene", "", "another scene of the file is shown");
    }
    let mut listed = Vec::with_capacity(scene.nodes.len());
    for (k, node) in scene.nodes.iter().enumerate() {
        let (place, node) = (format!("scenes[{chosen}].nodes[{k}]"), node.value());
        if let Some(Some(parent)) = parents.get(node) {
            return Err(source.fault(&place, format!("nodes[{node}] is below nodes[{parent}]: a scene lists roots")));
        }
        listed.push(node);
    }
    let count = listed.len();
    listed.sort_unstable();
    listed.dedup();
    if listed.len() < count {
        return Err(source.fault(&format!("scenes[{chosen}].nodes"), "a node is listed twice"));
    }
    // In the order of the file's own list.
    Ok(scene.nodes.iter().map(Index::value).collect())
}

fn children(node: &scene::Node) -> impl DoubleEndedIterator<Item = usize> + '_ {
    node.children.iter().flatten().map(Index::value)
}

/// These nodes and all below them, parents first, each with what is below it before its siblings.
fn below(nodes: &[scene::Node], roots: &[usize]) -> Vec<usize> {
    let mut order = Vec::new();
    let mut open: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(i) = open.pop() {
        order.push(i);
        if let Some(node) = nodes.get(i) {
            open.extend(children(node).rev());
        }
    }
    order
}

/// Parent from node.
fn local(source: GltfSource, path: &str, node: &scene::Node, motion: &Motion, index: usize) -> Result<DAffine3> {
    let given = match &node.matrix {
        Some(m) => {
            let column = |k: usize| DVec3::new(f64::from(m[k]), f64::from(m[k + 1]), f64::from(m[k + 2]));
            if [m[3], m[7], m[11], m[15] - 1.0].iter().any(|x| !(x.abs() <= 1e-4)) {
                return Err(source.fault(&format!("{path}.matrix"), "the last row must be 0 0 0 1"));
            }
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(4), column(8)), translation: column(12) }
        }
        None => {
            let [x, y, z, w] =
                node.rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0).map(f64::from);
            let rotation = unit(DQuat::from_xyzw(x, y, z, w))
                .ok_or_else(|| source.fault(&format!("{path}.rotation"), "is not a rotation"))?;
            DAffine3::from_scale_rotation_translation(vector(node.scale, 1.0), rotation, vector(node.translation, 0.0))
        }
    };
    if !given.is_finite() {
        return Err(source.fault(path, "the transform is not finite"));
    }
    let (translation, rotation, scale) =
        (motion.translations.get(&index), motion.rotations.get(&index), motion.scales.get(&index));
    if translation.is_none() && rotation.is_none() && scale.is_none() {
        return Ok(given);
    }
    // What moves may not have a matrix; one that can be taken apart does no harm.
    let (s, r, t) = match node.matrix {
        Some(_) => given.to_scale_rotation_translation(),
        None => {
            let [x, y, z, w] =
                node.rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0).map(f64::from);
            (vector(node.scale, 1.0), unit(DQuat::from_xyzw(x, y, z, w)).unwrap_or(DQuat::IDENTITY), given.translation)
        }
    };
    Ok(DAffine3::from_scale_rotation_translation(
        scale.copied().unwrap_or(s),
        rotation.copied().unwrap_or(r),
        translation.copied().unwrap_or(t),
    ))
}

fn vector(given: Option<[f32; 3]>, default: f64) -> DVec3 {
    given.map_or(DVec3::splat(default), |v| DVec3::from(v.map(f64::from)))
}

/// A quaternion of length 1, unless it has no direction.
pub fn unit(q: DQuat) -> Option<DQuat> {
    let length = q.length();
    (length > 0.0 && length.is_finite()).then(|| q / length)
}

/// How messages name a node.
pub fn label(node: &scene::Node, index: usize) -> String {
    match &node.name {
        Some(name) => format!("node \"{name}\""),
        None => format!("node \"{index}\""),
    }
}
