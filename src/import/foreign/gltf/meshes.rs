//! Meshes: shapes where a mesh is seen once, objects and instances where it is seen more often.

use std::collections::BTreeMap;

use gltf::json::Index;
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mesh, Primitive, Semantic};

use super::GltfSource;
use super::accessors::{AccessorUse, Column};
use super::extensions::Instancing;
use super::geometry::{self, Deformation};
use super::materials::MaterialSet;
use super::nodes::{Pose, Tree, label, unit};
use super::skins;
use crate::desc::{InstanceDesc, MeshDesc, ShapeDesc, TransformDesc, TransformStepDesc};
use crate::error::Result;
use crate::import::Draft;
use crate::math::{DAffine3, DQuat, DVec3, Transform};

/// What has been placed.
#[derive(Debug)]
pub(crate) struct Placed {
    /// The corners of a box around each mesh.
    pub corners: Vec<DVec3>,
    /// Whether a surface emits more light than a white one reflects in the default light.
    pub gives_light: bool,
}

/// A mesh as it is seen: where two nodes show the same, it is made once.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Form {
    mesh: usize,
    /// Bits of the weights of its morph targets.
    weights: Vec<u32>,
    /// The node, if a skin bends the mesh there.
    skinned_node: Option<usize>,
}

/// The shapes of a form in its own space.
struct Shapes {
    list: Vec<(String, ShapeDesc)>,
    bounds: Option<[DVec3; 2]>,
}

struct Builder<'a, 'b> {
    source: GltfSource<'a>,
    draft: &'b mut Draft,
    materials: MaterialSet,
    /// Bytes that meshes may still take.
    budget: usize,
    gives_light: bool,
}

/// Bytes of meshes for each byte of the file's buffers, and what any file may have: parts of buffers may be used more
/// than once.
const EXPANSION: usize = 64;
const LEAST_BUDGET: usize = 1 << 28;

/// Adds the meshes of the scene's nodes.
pub fn add(source: GltfSource, tree: &Tree, pose: &Pose, draft: &mut Draft) -> Result<Placed> {
    let mut forms: Vec<(Form, Vec<(usize, DAffine3)>)> = Vec::new();
    let mut places: BTreeMap<Form, usize> = BTreeMap::new();
    for &i in &tree.shown {
        let Some(node) = source.root.nodes.get(i) else { continue };
        let (path, element) = (format!("nodes[{i}]"), label(node, i));
        let Some(mesh) = node.mesh else { continue };
        let form = form(source, i, mesh, pose)?;
        let mut maps = if node.skin.is_some() {
            draft.mapped(&path, &element, "skin");
            vec![DAffine3::IDENTITY]
        } else {
            placements(source, &path, i, pose.world[i], draft)?
        };
        let before = maps.len();
        maps.retain(|map| Transform::new(*map).is_some());
        if maps.len() < before {
            draft.ignored(&path, &element, "mesh", "scaled to nothing");
        } else {
            draft.mapped(&path, &element, "mesh");
        }
        let at = *places.entry(form.clone()).or_insert_with(|| {
            forms.push((form, Vec::new()));
            forms.len() - 1
        });
        forms[at].1.extend(maps.into_iter().map(|map| (i, map)));
    }

    let budget = source.buffers.total().saturating_mul(EXPANSION).max(LEAST_BUDGET);
    let mut builder = Builder { source, draft, materials: MaterialSet::default(), budget, gives_light: false };
    let mut all_corners = Vec::new();
    for (form, maps) in forms.into_iter().filter(|(_, maps)| !maps.is_empty()) {
        let shapes = builder.shapes(&form, pose)?;
        for (_, map) in &maps {
            all_corners.extend(shapes.bounds.iter().flat_map(corners).map(|p| map.transform_point3(p)));
        }
        builder.place(&form, shapes, &maps);
    }
    Ok(Placed { corners: all_corners, gives_light: builder.gives_light })
}

/// What a node shows of a mesh.
fn form(source: GltfSource, node: usize, mesh: Index<Mesh>, pose: &Pose) -> Result<Form> {
    let (index, json) = (mesh.value(), source.root.nodes.get(node));
    let targets = |primitive: &Primitive| primitive.targets.as_ref().map_or(0, Vec::len);
    let mesh = source.root.get(mesh).ok_or_else(|| source.fault(&format!("nodes[{node}].mesh"), "no such mesh"))?;
    let count = mesh.primitives.iter().map(targets).max().unwrap_or(0);
    let given = pose
        .weights
        .get(node)
        .and_then(Option::as_ref)
        .or(json.and_then(|json| json.weights.as_ref()))
        .or(mesh.weights.as_ref());
    if let Some(weights) = given.filter(|weights| weights.len() != count) {
        return Err(
            source.fault(&format!("nodes[{node}]"), format!("has {} weights for {count} morph targets", weights.len()))
        );
    }
    let weights = given.map(|weights| weights.iter().map(|weight| weight.to_bits()).collect()).unwrap_or_default();
    let is_skinned = json.is_some_and(|json| json.skin.is_some());
    Ok(Form { mesh: index, weights, skinned_node: is_skinned.then_some(node) })
}

/// Where a node's mesh stands: once, unless an extension instances it.
fn placements(
    source: GltfSource,
    path: &str,
    node: usize,
    world: DAffine3,
    draft: &mut Draft,
) -> Result<Vec<DAffine3>> {
    const NAME: &str = "EXT_mesh_gpu_instancing";
    let json = source.root.nodes.get(node);
    let extensions = json.and_then(|json| json.extensions.as_ref()).map(|extensions| &extensions.others);
    let Some(instancing) = source.extension::<Instancing>(path, extensions, NAME)? else { return Ok(vec![world]) };
    let column = |name: &str, type_: Type| match instancing.attributes.get(name) {
        Some(&index) => {
            let place = format!("{path}.extensions.{NAME}.attributes.{name}");
            let index = u32::try_from(index).map_err(|_| source.fault(&place, "no such accessor"))?;
            source.column(&place, Index::new(index), &[type_], AccessorUse::Floats).map(Some)
        }
        None => Ok(None),
    };
    let (translations, rotations, scales) =
        (column("TRANSLATION", Type::Vec3)?, column("ROTATION", Type::Vec4)?, column("SCALE", Type::Vec3)?);
    let columns = [&translations, &rotations, &scales];
    let count = columns.iter().find_map(|column| column.as_ref().map(Column::count)).unwrap_or(0);
    if columns.iter().any(|column| column.as_ref().is_some_and(|column| column.count() != count)) {
        return Err(source.fault(&format!("{path}.extensions.{NAME}"), "the attributes differ in their count"));
    }
    draft.mapped(path, "node", NAME);
    let instance = |i: usize| {
        let vector = |floats: [f32; 3]| DVec3::from(floats.map(f64::from));
        let translation = translations.as_ref().map_or(DVec3::ZERO, |column| vector(column.floats(i)));
        let rotation =
            rotations.as_ref().and_then(|column| unit(DQuat::from_array(column.floats::<4>(i).map(f64::from))));
        let scale = scales.as_ref().map_or(DVec3::ONE, |column| vector(column.floats(i)));
        world * DAffine3::from_scale_rotation_translation(scale, rotation.unwrap_or(DQuat::IDENTITY), translation)
    };
    Ok((0..count).map(instance).collect())
}

impl Builder<'_, '_> {
    /// The shapes of a form, one for each primitive with triangles.
    fn shapes(&mut self, form: &Form, pose: &Pose) -> Result<Shapes> {
        let source = self.source;
        let mut shapes = Shapes { list: Vec::new(), bounds: None };
        let path = format!("meshes[{}]", form.mesh);
        let Some(mesh) = source.root.meshes.get(form.mesh) else { return Ok(shapes) };
        let skin = form.skinned_node.and_then(|node| source.root.nodes.get(node)).and_then(|node| node.skin);
        let joints = skin.map(|skin| skins::joints(source, skin, pose)).transpose()?;
        let weights: Vec<f32> = form.weights.iter().map(|bits| f32::from_bits(*bits)).collect();
        let deformation = Deformation { weights: &weights, joints: joints.as_deref() };
        let name = mesh.name.clone().unwrap_or_else(|| format!("mesh {}", form.mesh));
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let path = format!("{path}.primitives[{k}]");
            if !geometry::has_triangles(primitive) {
                self.draft.ignored(&path, "primitive", "mode", "points and lines have no surface");
                continue;
            }
            self.add_shape(&path, &name, primitive, deformation, &mut shapes)?;
        }
        Ok(shapes)
    }

    /// Adds the triangles of a primitive to the shapes of its form.
    fn add_shape(
        &mut self,
        path: &str,
        name: &str,
        primitive: &Primitive,
        deformation: Deformation,
        shapes: &mut Shapes,
    ) -> Result<()> {
        let source = self.source;
        let Some(mut triangles) = geometry::triangles(source, path, primitive, deformation)? else {
            self.draft.ignored(path, "primitive", "", "has no triangles");
            return Ok(());
        };
        let material = self.materials.convert(source, self.draft, primitive.material, triangles.colors)?;
        if let Some(set) = material.uv_set {
            triangles.read_uvs(source, path, primitive, set)?;
        }
        let mut data = triangles.data;
        data.attributes.retain(|_, _| material.vertex_colors);
        if material.uv_set.is_some() && data.uvs.is_none() {
            self.draft.approximated(
                path,
                "primitive",
                "TEXCOORD",
                "no uv for the textures: they show the colour of one corner",
            );
            data.uvs = Some(vec![[0.0, 1.0]; data.positions.len()]);
        }
        self.report(path, primitive);
        self.gives_light |=
            material.emission.as_ref().is_some_and(|emission| emission.radiance.iter().any(|r| *r > 1.0));

        for p in data.positions.iter().filter(|p| p.iter().all(|x| x.is_finite())) {
            shapes.grow(DVec3::from(p.map(f64::from)));
        }
        let bytes =
            data.positions.len() * (32 + if material.vertex_colors { 12 } else { 0 }) + data.triangles.len() * 12;
        self.budget = self.budget.checked_sub(bytes).ok_or_else(|| {
            source.fault(
                path,
                "the meshes of the file are far larger than its buffers: the same data is used again and again",
            )
        })?;
        let mut desc = MeshDesc::from_file(self.draft.keep_mesh(name, data));
        desc.name = Some(name.into());
        desc.material = material.material;
        desc.opacity = material.opacity;
        desc.emission = material.emission;
        shapes.list.push((path.into(), ShapeDesc::Mesh(desc)));
        Ok(())
    }

    /// Reports what became of the attributes.
    fn report(&mut self, path: &str, primitive: &Primitive) {
        self.draft.mapped(path, "primitive", "attributes");
        let material = primitive.material.and_then(|index| self.source.root.get(index));
        let has_normal_map = material.is_some_and(|material| material.normal_texture.is_some());
        if has_normal_map && geometry::attribute(primitive, Semantic::Tangents).is_some() {
            self.draft.ignored(
                path,
                "primitive",
                "TANGENT",
                "tangents are MikkTSpace's, from positions, normals and uv",
            );
        }
    }

    /// Places shapes in the world: by themselves if once, else as an object.
    fn place(&mut self, form: &Form, shapes: Shapes, maps: &[(usize, DAffine3)]) {
        if shapes.list.is_empty() {
            return;
        }
        let name_of = |node: usize| self.source.root.nodes.get(node).and_then(|json| json.name.clone());
        if let [(node, map)] = maps {
            for (path, mut shape) in shapes.list {
                if let Some(name) = name_of(*node) {
                    *shape.common_mut().name = Some(name);
                }
                *shape.common_mut().transform = transform(map);
                self.draft.add_shape(&format!("nodes[{node}]: {path}"), shape);
            }
            return;
        }
        let mesh = self.source.root.meshes.get(form.mesh);
        let name = mesh.and_then(|mesh| mesh.name.clone()).unwrap_or_else(|| format!("mesh {}", form.mesh));
        let object = self.draft.add_object(&name, &format!("meshes[{}]", form.mesh), shapes.list, Vec::new());
        let mut count = BTreeMap::new();
        maps.iter().for_each(|(node, _)| *count.entry(*node).or_insert(0) += 1);
        for (node, map) in maps {
            // A node that places many has no name for each.
            let name = if count[node] == 1 { name_of(*node) } else { None };
            let instance = InstanceDesc { object: object.clone(), name, transform: transform(map), motion: Vec::new() };
            self.draft.add_instance(&format!("nodes[{node}]"), instance);
        }
    }
}

/// A map as a step of a transform.
pub fn transform(map: &DAffine3) -> TransformDesc {
    let m = &map.matrix3;
    let row = |k: usize| [m.x_axis[k], m.y_axis[k], m.z_axis[k], map.translation[k]];
    TransformDesc(vec![TransformStepDesc::Matrix([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])])
}

impl Shapes {
    fn grow(&mut self, p: DVec3) {
        self.bounds = Some(self.bounds.map_or([p, p], |[min, max]| [min.min(p), max.max(p)]));
    }
}

/// The corners of a box.
fn corners([min, max]: &[DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
        DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    })
}
