//! Light paths from lights at infinity. Most rays from a sky miss what the camera sees, so those that paths of a pilot
//! have found are what rays are importance sampled by ("On-line Learning of Parametric Mixture Models for Light
//! Transport Simulation", Vorba et al. 2014, guides light paths by importance as well; here by trees of piecewise
//! constant densities).

use crate::geometry::SpawnPoint;
use crate::id::LightId;
use crate::light::{EmittedRay, Light, MisCompensation};
use crate::math::{Aabb, DVec3, Vec3};
use crate::scene::Scene;

/// A ray of a light at infinity that a path from the camera has found.
#[derive(Clone, Copy, Debug)]
pub struct DistantRay {
    /// The light.
    pub light: LightId,
    /// A point of it.
    pub p: Vec3,
    /// Unit direction to the light.
    pub wi: Vec3,
    /// The largest channel of what the path added to its pixel.
    pub contribution: f32,
}

/// The most rays that a tree is made from.
const MAX_RAYS: usize = 1 << 15;

/// Rays that a leaf has at most, unless it is too small to be split.
const LEAF_RAYS: usize = 16;

/// A ray counts with this many times the mean contribution at most.
const MAX_CONTRIBUTION: f32 = 20.0;

/// The smallest side of a node.
const LEAST_SIDE: f32 = 1.0 / 8192.0;

/// By which rays enter a box: two coordinates of the point of its face, and two of the direction to the light projected
/// to the face, all in `[0, 1]`. Uniform in them is uniform over area perpendicular to the rays and solid angle.
type RayCoordinates = [f32; 4];

/// A box that rays enter.
#[derive(Clone, Debug)]
struct EntryBox {
    bounds: Aabb,
    /// Of all of the scene, where rays start.
    scene: Aabb,
}

/// Where a ray enters a box.
#[derive(Clone, Copy, Debug)]
struct Entry {
    face: usize,
    at: RayCoordinates,
    /// Cosine of the ray and the face.
    cos: f32,
}

/// The axes along a face.
#[inline(always)]
fn face_axes(face: usize) -> [usize; 2] {
    [(face / 2 + 1) % 3, (face / 2 + 2) % 3]
}

impl EntryBox {
    /// Where the line through a point enters that travels away from the unit direction `wi`, if it does.
    #[inline]
    fn entry(&self, p: Vec3, wi: Vec3) -> Option<Entry> {
        let Aabb { min, max } = self.bounds;
        let (mut enters, mut leaves, mut axis) = (f32::NEG_INFINITY, f32::INFINITY, 0);
        for k in 0..3 {
            let inverse = -1.0 / wi[k];
            let (near, far) = if wi[k] < 0.0 { (min[k], max[k]) } else { (max[k], min[k]) };
            let (near, far) = ((near - p[k]) * inverse, (far - p[k]) * inverse);
            if near > enters {
                (enters, axis) = (near, k);
            }
            leaves = leaves.min(far);
        }
        if !(enters <= leaves && enters.is_finite()) {
            return None;
        }
        let size = self.bounds.size();
        let point = p - wi * enters;
        let [a, b] = face_axes(2 * axis);
        let place = |k: usize| ((point[k] - min[k]) / size[k]).clamp(0.0, 1.0);
        let at = [place(a), place(b), 0.5 + 0.5 * wi[a], 0.5 + 0.5 * wi[b]];
        Some(Entry { face: 2 * axis + usize::from(wi[axis] >= 0.0), at, cos: wi[axis].abs() })
    }

    /// The point where a ray enters, and the direction to its light.
    fn ray(&self, face: usize, at: RayCoordinates) -> Option<(DVec3, Vec3)> {
        let axis = face / 2;
        let [a, b] = face_axes(face);
        let (mut point, mut wi) = (DVec3::ZERO, Vec3::ZERO);
        let (min, size) = (self.bounds.min.as_dvec3(), self.bounds.size().as_dvec3());
        point[axis] = f64::from(if face.is_multiple_of(2) { self.bounds.min[axis] } else { self.bounds.max[axis] });
        point[a] = min[a] + size[a] * f64::from(at[0]);
        point[b] = min[b] + size[b] * f64::from(at[1]);
        (wi[a], wi[b]) = (2.0 * at[2] - 1.0, 2.0 * at[3] - 1.0);
        let square = 1.0 - wi[a] * wi[a] - wi[b] * wi[b];
        wi[axis] = if face.is_multiple_of(2) { -square.sqrt() } else { square.sqrt() };
        (square > 0.0).then_some((point, wi))
    }

    /// The point on the way to the light from which rays start, outside of the scene.
    fn start(&self, p: DVec3, wi: Vec3) -> DVec3 {
        let (center, half) = (self.scene.center().as_dvec3(), 0.5 * self.scene.size().as_dvec3());
        let wi = wi.as_dvec3();
        p + wi * ((center - p).dot(wi) + 1.01 * half.length()).max(0.0)
    }

    fn face_area(&self, face: usize) -> f32 {
        let size = self.bounds.size();
        let [a, b] = face_axes(face);
        size[a] * size[b]
    }
}

/// A node of a tree.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The coordinate that is split, or [`LEAF`].
    axis: u32,
    /// The first of its two children.
    child: u32,
    split: f32,
    /// The part of the first child; of leaves the density.
    value: f32,
}

const LEAF: u32 = 4;

/// A density of rays.
#[derive(Clone, Debug)]
struct RayTree {
    nodes: Vec<Node>,
}

/// Part of a tree that is being built.
struct Region {
    min: RayCoordinates,
    max: RayCoordinates,
    node: usize,
}

impl RayTree {
    /// From rays with their weights, in the first `dimensions` coordinates.
    fn new(rays: &mut [(RayCoordinates, f32)], dimensions: usize) -> Self {
        let total = rays.iter().map(|ray| ray.1).sum();
        let mut tree = Self { nodes: vec![Node { axis: LEAF, child: 0, split: 0.0, value: 1.0 }] };
        tree.split(rays, dimensions, total, Region { min: [0.0; 4], max: [1.0; 4], node: 0 });
        tree
    }

    fn split(&mut self, rays: &mut [(RayCoordinates, f32)], dimensions: usize, total: f32, region: Region) {
        let Region { min, max, node } = region;
        let weight: f32 = rays.iter().map(|ray| ray.1).sum();
        let side = |k: usize| max[k] - min[k];
        let middle = |k: usize| 0.5 * (min[k] + max[k]);
        let is_first = |ray: &(RayCoordinates, f32), k: usize| ray.0[k] < middle(k);
        let wide: Vec<usize> = (0..dimensions).filter(|&k| side(k) > LEAST_SIDE).collect();
        let longest = wide.iter().copied().max_by(|&a, &b| side(a).total_cmp(&side(b)));
        let Some(longest) = longest.filter(|_| rays.len() > LEAF_RAYS) else {
            let volume: f32 = (0..4).map(side).product();
            self.nodes[node].value = weight / (total * volume);
            return;
        };
        // The most uneven halves, unless all could be by chance.
        let count = rays.len() as f32;
        let unevenness = |k: usize| {
            let first = rays.iter().filter(|ray| is_first(ray, k)).count() as f32;
            (first / count - 0.5).abs()
        };
        let uneven = wide.iter().map(|&k| (unevenness(k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
        let axis = uneven.filter(|(value, _)| *value > 1.0 / count.sqrt()).map_or(longest, |(_, k)| k);
        let mut first = 0;
        for i in 0..rays.len() {
            if is_first(&rays[i], axis) {
                rays.swap(i, first);
                first += 1;
            }
        }
        let (below, above) = rays.split_at_mut(first);
        let child = self.nodes.len();
        let leaf = Node { axis: LEAF, child: 0, split: 0.0, value: 0.0 };
        self.nodes.extend([leaf; 2]);
        let part = below.iter().map(|ray| ray.1).sum::<f32>() / weight;
        self.nodes[node] = Node { axis: axis as u32, child: child as u32, split: middle(axis), value: part };
        let (mut first_max, mut second_min) = (max, min);
        (first_max[axis], second_min[axis]) = (middle(axis), middle(axis));
        self.split(below, dimensions, total, Region { min, max: first_max, node: child });
        self.split(above, dimensions, total, Region { min: second_min, max, node: child + 1 });
    }

    /// Coordinates from numbers in `[0, 1)`, with their density.
    fn sample(&self, mut u: RayCoordinates) -> (RayCoordinates, f32) {
        let (mut min, mut max) = ([0.0; 4], [1.0; 4]);
        let mut node = self.nodes[0];
        while node.axis != LEAF {
            let k = node.axis as usize;
            let is_first = u[k] < node.value;
            if is_first {
                u[k] /= node.value;
                max[k] = node.split;
            } else {
                u[k] = (u[k] - node.value) / (1.0 - node.value);
                min[k] = node.split;
            }
            node = self.nodes[node.child as usize + usize::from(!is_first)];
        }
        // Not in the next leaf by rounding.
        let at = |k: usize| (min[k] + (max[k] - min[k]) * u[k]).min(max[k].next_down());
        (std::array::from_fn(at), node.value)
    }

    /// The density of coordinates.
    #[inline]
    fn pdf(&self, at: RayCoordinates) -> f32 {
        let mut node = self.nodes[0];
        while node.axis != LEAF {
            node = self.nodes[node.child as usize + usize::from(at[node.axis as usize] >= node.split)];
        }
        node.value
    }
}

/// Rays of a light that enter a box by one of its faces.
#[derive(Clone, Debug)]
struct FaceRays {
    light: LightId,
    face: usize,
    density: RayTree,
}

/// Where light paths from lights at infinity start.
#[derive(Clone, Debug)]
pub struct DistantEmitters {
    entry_box: EntryBox,
    faces: Vec<FaceRays>,
    /// By light and face, one more than the index in `faces`, or 0.
    indices: Vec<[u32; 6]>,
}

impl DistantEmitters {
    /// From the rays of a pilot that enter the box `bounds`, with what those by each face contribute; `None` if there
    /// are no rays.
    pub fn new(scene: &Scene, rays: &[DistantRay], bounds: Aabb) -> Option<(Self, Vec<f64>)> {
        if rays.is_empty() || bounds.is_empty() {
            return None;
        }
        let margin = Vec3::splat(0.01 * bounds.size().max_element());
        let bounds = Aabb { min: bounds.min - margin, max: bounds.max + margin };
        let lights = scene.lights.lights();
        let mut emitters = Self {
            entry_box: EntryBox { bounds, scene: scene.geometry.bounds() },
            faces: Vec::new(),
            indices: vec![[0; 6]; lights.len()],
        };
        let mean = rays.iter().map(|ray| f64::from(ray.contribution)).sum::<f64>() / rays.len() as f64;
        let limit = MAX_CONTRIBUTION * mean as f32;
        let mut entries: Vec<((LightId, usize), (RayCoordinates, f32))> = rays
            .iter()
            .step_by(rays.len().div_ceil(MAX_RAYS))
            .filter_map(|ray| {
                let entry = emitters.entry_box.entry(ray.p, ray.wi)?;
                Some(((ray.light, entry.face), (entry.at, ray.contribution.min(limit))))
            })
            .collect();
        entries.sort_by_key(|entry| entry.0);
        let mut contributions = Vec::new();
        for of_face in entries.chunk_by(|a, b| a.0 == b.0) {
            let (light, face) = of_face[0].0;
            let mut rays: Vec<_> = of_face.iter().map(|entry| entry.1).collect();
            let dimensions = if lights[light.index()].is_delta() { 2 } else { 4 };
            contributions.push(rays.iter().map(|ray| f64::from(ray.1)).sum());
            emitters.faces.push(FaceRays { light, face, density: RayTree::new(&mut rays, dimensions) });
            emitters.indices[light.index()][face] = emitters.faces.len() as u32;
        }
        (!contributions.is_empty()).then_some((emitters, contributions))
    }

    /// The light and a ray that enters by the face with this index, from numbers in `[0, 1)`; it starts outside of the
    /// scene.
    pub fn sample(&self, scene: &Scene, index: usize, u: [f32; 4]) -> Option<(LightId, EmittedRay)> {
        let FaceRays { light, face, ref density } = self.faces[index];
        let (mut at, density) = density.sample(u);
        let delta = match scene.lights.get(light) {
            Light::Directional(distant) if distant.is_delta() => Some(distant),
            _ => None,
        };
        if let Some(distant) = delta {
            let (wi, [a, b]) = (distant.axis(), face_axes(face));
            (at[2], at[3]) = (0.5 + 0.5 * wi[a], 0.5 + 0.5 * wi[b]);
        }
        let (p, wi) = self.entry_box.ray(face, at)?;
        let radiance = || scene.lights.get(light).eval_infinite(wi, MisCompensation::Off).radiance;
        let ray = EmittedRay {
            point: SpawnPoint { p: self.entry_box.start(p, wi), n: -wi, error: 0.0 },
            direction: -wi,
            radiance: delta.map_or_else(radiance, |distant| distant.irradiance()),
            pdf_per_cos: self.pdf_of(scene, light, face, density, wi[face / 2].abs()),
        };
        Some((light, ray))
    }

    /// The index of the face that a ray towards `p` from the unit direction `wi` enters by, and the density of the ray:
    /// per area perpendicular to it and solid angle, or per area alone from a single direction.
    #[inline]
    pub fn pdf(&self, scene: &Scene, light: LightId, p: Vec3, wi: Vec3) -> Option<(usize, f32)> {
        let Entry { face, at, cos } = self.entry_box.entry(p, wi)?;
        let index = self.indices[light.index()][face].checked_sub(1)? as usize;
        let density = self.faces[index].density.pdf(at);
        Some((index, self.pdf_of(scene, light, face, density, cos)))
    }

    #[inline]
    fn pdf_of(&self, scene: &Scene, light: LightId, face: usize, density: f32, cos: f32) -> f32 {
        // The square around the hemisphere's projection, whose area is solid angle times cosine, has an area of 4.
        let per_direction = if scene.lights.get(light).is_delta() { 1.0 / cos } else { 0.25 };
        density * per_direction / self.entry_box.face_area(face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::hash64;

    fn numbers(i: u64) -> [f32; 4] {
        std::array::from_fn(|k| (hash64(4 * i + k as u64) >> 40) as f32 / (1 << 24) as f32)
    }

    fn entry_box() -> EntryBox {
        let bounds = Aabb { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(1.0, 3.0, 4.0) };
        EntryBox { bounds, scene: Aabb { min: Vec3::splat(-9.0), max: Vec3::splat(9.0) } }
    }

    /// Most in a tenth of each coordinate.
    fn uneven() -> RayTree {
        let at = |i: u64| numbers(i).map(|u| if i.is_multiple_of(4) { u } else { 0.3 + 0.1 * u });
        let mut rays: Vec<_> = (0..4096).map(|i| (at(i), 1.0 + numbers(i)[0])).collect();
        RayTree::new(&mut rays, 4)
    }

    #[test]
    fn rays_enter_where_they_are_found() {
        let entry_box = entry_box();
        for (i, face) in (0..600).map(|i| (i, (i % 6) as usize)) {
            let at = numbers(i);
            let Some((p, wi)) = entry_box.ray(face, at) else { continue };
            assert!((wi.length() - 1.0).abs() < 1e-6);
            let start = entry_box.start(p, wi);
            assert!(!entry_box.scene.contains(start.as_vec3()));
            for p in [start.as_vec3(), p.as_vec3(), (p - 0.5 * wi.as_dvec3()).as_vec3()] {
                let Entry { face: found_face, at: found, cos } = entry_box.entry(p, wi).unwrap();
                // Rays along an edge may be found beside it.
                if cos > 0.05 && at[..2].iter().all(|x| (x - 0.5).abs() < 0.49) {
                    assert_eq!(face, found_face, "{at:?}");
                    assert!(at.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-4), "{at:?} {found:?}");
                }
            }
        }
        for (p, wi) in [([5.0, 1.0, 3.0], [0.0, 1.0, 0.0]), ([0.0, 1.0, 9.0], [1.0, 0.0, 0.0])] {
            assert!(entry_box.entry(Vec3::from(p), Vec3::from(wi)).is_none());
        }
        assert!(entry_box.entry(Vec3::splat(f32::NAN), Vec3::Y).is_none());
    }

    /// Chi-squared over 8 cells of each pair of coordinates: with 63 degrees of freedom it exceeds 150 with a
    /// probability of 6e-9.
    #[test]
    fn coordinates_have_their_density() {
        const SAMPLES: u64 = 1 << 16;
        let tree = uneven();
        let mut samples = Vec::new();
        for i in 0..SAMPLES {
            let (at, density) = tree.sample(numbers(i + 99_999));
            assert!((tree.pdf(at) / density - 1.0).abs() < 1e-6, "{at:?}");
            samples.push(at);
        }
        for [a, b] in [[0, 1], [1, 2], [2, 3], [3, 0]] {
            let cell = |at: RayCoordinates| {
                let index = |x: f32| ((x * 8.0) as usize).min(7);
                8 * index(at[a]) + index(at[b])
            };
            let (mut found, mut expected) = ([0.0; 64], [0.0; 64]);
            for at in &samples {
                found[cell(*at)] += 1.0;
            }
            for (min, max, density) in &leaves(&tree) {
                for (i, expected) in expected.iter_mut().enumerate() {
                    let overlap = |k: usize, index: usize| {
                        let (from, to) = (index as f32 / 8.0, (index + 1) as f32 / 8.0);
                        f64::from((max[k].min(to) - min[k].max(from)).max(0.0))
                    };
                    let others: f32 = (0..4).filter(|k| *k != a && *k != b).map(|k| max[k] - min[k]).product();
                    *expected += SAMPLES as f64 * f64::from(density * others) * overlap(a, i / 8) * overlap(b, i % 8);
                }
            }
            assert!((expected.iter().sum::<f64>() / SAMPLES as f64 - 1.0).abs() < 1e-4);
            let chi_squared: f64 = found.iter().zip(expected).map(|(f, e): (&f64, f64)| (f - e).powi(2) / e).sum();
            assert!(chi_squared < 150.0, "{chi_squared}");
        }
        // Three quarters of the rays are in a ten-thousandth of the space.
        let inside = samples.iter().filter(|at| at.iter().all(|x| (0.28..0.42).contains(x))).count();
        assert!(inside as f64 > 0.5 * SAMPLES as f64, "{inside}");
    }

    /// The boxes of the leaves of a tree with their densities.
    fn leaves(tree: &RayTree) -> Vec<(RayCoordinates, RayCoordinates, f32)> {
        let (mut open, mut leaves) = (vec![(0, [0.0; 4], [1.0; 4])], Vec::new());
        while let Some((node, min, max)) = open.pop() {
            let Node { axis, child, split, value } = tree.nodes[node];
            if axis == LEAF {
                leaves.push((min, max, value));
                continue;
            }
            let (mut first_max, mut second_min) = (max, min);
            (first_max[axis as usize], second_min[axis as usize]) = (split, split);
            open.extend([(child as usize, min, first_max), (child as usize + 1, second_min, max)]);
        }
        leaves
    }
}
