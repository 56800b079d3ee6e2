//! Triangles of different materials in one place: which of them a ray meets is left to the accelerator.

use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelExtend, ParallelIterator};

use super::Builder;
use crate::geometry::{Geometry, Mesh, Shape};
use crate::id::{PrimId, ShapeId};
use crate::math::random::hash64;

/// Meshes of fewer triangles are not worth more than one thread.
const MANY: usize = 1 << 13;

/// Triangles in the places of others that differ from them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Coincident {
    /// How many, the first of each place not counted.
    count: usize,
    /// The shapes of the first pair.
    shapes: [ShapeId; 2],
}

impl Builder {
    /// One warning of all triangles that lie exactly where others do and differ from them in orientation or material.
    pub(super) fn warn_of_coincident(&self) {
        let materials = &self.materials.materials;
        let look_alike = |a: ShapeId, b: ShapeId| {
            let [x, y] = [a, b].map(|id| &self.surfaces[id.index()]);
            let same_material =
                x.material == y.material || materials[x.material.index()] == materials[y.material.index()];
            let same_opacity = self.opacities[a.index()] == self.opacities[b.index()];
            same_material
                && same_opacity
                && (x.normal_perturbation, x.medium, x.first_light) == (y.normal_perturbation, y.medium, y.first_light)
        };
        let Some(Coincident { count, shapes }) = find(&self.geometry, look_alike) else { return };
        let [first, second] = shapes.map(|shape| self.paths[shape.index()].as_str());
        let what = if count == 1 { "1 triangle coincides".to_owned() } else { format!("{count} triangles coincide") };
        let whose = if shapes[0] == shapes[1] { "the same mesh".to_owned() } else { self.files.source.place(second) };
        self.files.warn(
            first,
            format_args!(
                "{what} with others of another orientation or material (the first with one of {whose}): which of them \
                 a ray meets, and so the picture, depends on the accelerator; remove one of each pair or move it"
            ),
        );
    }
}

/// Looks for triangles with the same three corners, among the shapes of the world and among those of each object, that
/// differ in orientation or, where they belong to different shapes, do not `look_alike`.
fn find(geometry: &Geometry, look_alike: impl Fn(ShapeId, ShapeId) -> bool) -> Option<Coincident> {
    let groups = std::iter::once(&geometry.world).chain(geometry.objects.iter().map(|object| &object.shapes));
    let meshes = groups.enumerate().flat_map(|(group, shapes)| shapes.iter().map(move |&id| (group, id)));
    let meshes: Vec<(u64, ShapeId, &Mesh)> = meshes
        .filter_map(|(group, id)| match geometry.shape(id) {
            Shape::Mesh(mesh) => Some((hash64(group as u64), id, mesh)),
            Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => None,
        })
        .collect();
    let keys = keys(&meshes);
    let repeated = repeated(&keys);
    if repeated.is_empty() {
        return None;
    }
    let prims = meshes.iter().flat_map(|mesh| (0..mesh.2.triangles().len()).map(move |prim| (mesh, PrimId::new(prim))));
    let mut places: Vec<Place> = keys
        .iter()
        .zip(prims)
        .filter(|(key, _)| repeated.binary_search(key).is_ok())
        .map(|(_, (&(group, shape, mesh), prim))| Place::new(group, shape, mesh, prim))
        .collect();
    // The sort is stable: of equals the first of the scene.
    places.sort_by(|a, b| (a.group, &a.corners).cmp(&(b.group, &b.corners)));
    let mut found: Option<(Coincident, (ShapeId, PrimId))> = None;
    for same in places.chunk_by(|a, b| (a.group, &a.corners) == (b.group, &b.corners)) {
        let first = &same[0];
        let differs = |other: &&Place| {
            first.is_even != other.is_even || (first.shape != other.shape && !look_alike(first.shape, other.shape))
        };
        let others: Vec<&Place> = same[1..].iter().filter(differs).collect();
        let Some(other) = others.first() else { continue };
        let at = (first.shape, first.prim);
        let count = others.len() + found.map_or(0, |(found, _)| found.count);
        found = match found {
            Some((before, place)) if place < at => Some((Coincident { count, ..before }, place)),
            _ => Some((Coincident { count, shapes: [first.shape, other.shape] }, at)),
        };
    }
    found.map(|(found, _)| found)
}

/// A number for each triangle, mesh by mesh: the same for the same corners in any order, and for few others.
fn keys(meshes: &[(u64, ShapeId, &Mesh)]) -> Vec<u32> {
    let mut keys = Vec::with_capacity(meshes.iter().map(|(.., mesh)| mesh.triangles().len()).sum());
    let mut vertices: Vec<u32> = Vec::new();
    for (group, _, mesh) in meshes {
        let steps: Vec<&[[f32; 3]]> = mesh.padded_steps().collect();
        let count = mesh.positions().len();
        let hash = |vertex: usize| {
            (steps.iter().fold(*group, |hash, positions| hash_of(hash, bits(positions[vertex]))) >> 32) as u32
        };
        let key = |vertices: &[u32], corners: &[u32; 3]| {
            corners.iter().fold(0u32, |sum, &i| sum.wrapping_add(vertices[i as usize]))
        };
        vertices.clear();
        if mesh.triangles().len() < MANY {
            vertices.extend((0..count).map(hash));
            keys.extend(mesh.triangles().iter().map(|corners| key(&vertices, corners)));
        } else {
            vertices.par_extend(
                steps[0][..count].par_iter().enumerate().with_min_len(MANY).map(|(vertex, _)| hash(vertex)),
            );
            keys.par_extend(mesh.triangles().par_iter().with_min_len(MANY).map(|corners| key(&vertices, corners)));
        }
    }
    keys
}

fn hash_of(seed: u64, [x, y, z]: [u32; 3]) -> u64 {
    hash64(seed ^ (u64::from(x) | u64::from(y) << 32) ^ u64::from(z).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Equal for equal positions: adding zero makes a negative zero positive.
fn bits(position: [f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

/// What occurs more than once, in order. Sorting all would take as long again as all the rest.
fn repeated(keys: &[u32]) -> Vec<u32> {
    // All but the first of equal keys, and of others some: one in 32, about.
    let mut first = Marks::new(keys.len(), 16);
    let suspects: Vec<u32> = keys.iter().copied().filter(|key| first.insert(*key)).collect();
    // All equal keys, the suspects, and of others one in 256 or fewer.
    let mut second = Marks::new(suspects.len(), 256);
    for key in suspects {
        second.insert(key);
    }
    let mut candidates: Vec<u32> =
        keys.par_iter().with_min_len(MANY).copied().filter(|key| second.contains(*key)).collect();
    candidates.sort_unstable();
    let mut repeated: Vec<u32> = candidates.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect();
    repeated.dedup();
    repeated
}

/// A set of keys, which takes some others for its own: a bit for each value of their first bits.
struct Marks {
    words: Vec<u64>,
    shift: u32,
}

impl Marks {
    /// For a number of keys, with a number of bits for each.
    fn new(keys: usize, bits: usize) -> Self {
        let log = (keys * bits).next_power_of_two().trailing_zeros().clamp(6, 32);
        Self { words: vec![0; 1 << (log - 6)], shift: 32 - log }
    }

    /// Adds a key; whether it, or one that is taken for it, was there.
    #[inline]
    fn insert(&mut self, key: u32) -> bool {
        let (place, there) = (u64::from(key) >> self.shift, self.contains(key));
        self.words[(place >> 6) as usize] |= 1 << (place & 63);
        there
    }

    #[inline]
    fn contains(&self, key: u32) -> bool {
        let place = u64::from(key) >> self.shift;
        self.words[(place >> 6) as usize] >> (place & 63) & 1 != 0
    }
}

/// A triangle that may coincide with another.
struct Place {
    group: u64,
    shape: ShapeId,
    prim: PrimId,
    /// In order, at each of the mesh's times.
    corners: [Vec<[u32; 3]>; 3],
    /// Whether the corners in order go round as they do in the mesh.
    is_even: bool,
}

impl Place {
    fn new(group: u64, shape: ShapeId, mesh: &Mesh, prim: PrimId) -> Self {
        let vertices = mesh.triangles()[prim.index()];
        let at =
            |i: usize| mesh.padded_steps().map(|positions| bits(positions[vertices[i] as usize])).collect::<Vec<_>>();
        let mut corners = [0, 1, 2].map(|i| (at(i), i));
        corners.sort_unstable();
        let order = [0, 1, 2].map(|i: usize| corners[i].1);
        let is_even = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].contains(&order);
        Self { group, shape, prim, corners: corners.map(|(corner, _)| corner), is_even }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{MeshStep, Object};

    const POSITIONS: [[f32; 3]; 5] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 1.0, -0.0], [1.0, 1.0, 0.0]];

    fn mesh(triangles: &[[u32; 3]]) -> Shape {
        Shape::Mesh(Mesh::new(POSITIONS.to_vec(), triangles.to_vec(), None, None).unwrap())
    }

    fn world(shapes: Vec<Shape>) -> Geometry {
        let world = (0..shapes.len()).map(ShapeId::new).collect();
        Geometry { shapes, world, ..Geometry::default() }
    }

    fn found(count: usize, [a, b]: [usize; 2]) -> Option<Coincident> {
        Some(Coincident { count, shapes: [ShapeId::new(a), ShapeId::new(b)] })
    }

    #[test]
    fn triangles_in_one_place_count_if_they_differ() {
        let [alike, unlike] = [true, false].map(|alike| move |_: ShapeId, _: ShapeId| alike);
        // Turned, and with another vertex in the same place; turned over; sharing an edge alone.
        let one = world(vec![mesh(&[[0, 1, 2], [1, 2, 0], [3, 0, 1]])]);
        assert_eq!((find(&one, alike), find(&one, unlike)), (None, None));
        let over = world(vec![mesh(&[[0, 1, 2], [1, 4, 2], [2, 1, 0], [1, 0, 3]])]);
        assert_eq!(find(&over, alike), found(2, [0, 0]));
        let two = world(vec![mesh(&[[1, 4, 2]]), mesh(&[[0, 1, 2]]), mesh(&[[4, 2, 1], [1, 2, 0]])]);
        assert_eq!((find(&two, alike), find(&two, unlike)), (None, found(2, [0, 2])));
        let disjoint = world(vec![mesh(&[[0, 1, 2]]), mesh(&[[1, 4, 2]])]);
        assert_eq!(find(&disjoint, unlike), None);
    }

    #[test]
    fn shapes_of_objects_are_compared_with_one_another_and_moving_ones_at_all_times() {
        let unlike = |_: ShapeId, _: ShapeId| false;
        let shapes = vec![mesh(&[[0, 1, 2]]), mesh(&[[0, 1, 2]]), mesh(&[[2, 0, 1]])];
        let object = |shapes: &[usize]| Object { shapes: shapes.iter().map(|&i| ShapeId::new(i)).collect() };
        let apart =
            Geometry { shapes: shapes.clone(), objects: vec![object(&[0]), object(&[1])], ..Geometry::default() };
        assert_eq!(find(&apart, unlike), None);
        let together =
            Geometry { shapes, world: vec![ShapeId::new(0)], objects: vec![object(&[1, 2])], ..Geometry::default() };
        assert_eq!(find(&together, unlike), found(1, [1, 2]));
        let deforming = |z: f32| {
            let Shape::Mesh(mesh) = mesh(&[[0, 1, 2]]) else { unreachable!() };
            let positions = POSITIONS.map(|[x, y, _]| [x, y, z]).to_vec();
            Shape::Mesh(mesh.deforming(vec![MeshStep { positions, normals: None }]).unwrap())
        };
        assert_eq!(find(&world(vec![deforming(1.0), deforming(2.0), mesh(&[[0, 1, 2]])]), unlike), None);
        assert_eq!(find(&world(vec![deforming(1.0), deforming(2.0), deforming(1.0)]), unlike), found(1, [0, 2]));
    }

    #[test]
    fn large_meshes_are_searched_by_all_threads() {
        let n = 100u32;
        let positions: Vec<[f32; 3]> = (0..n * n).map(|i| [(i % n) as f32, (i / n) as f32, 0.0]).collect();
        let corners = (0..n * (n - 1)).filter(|i| i % n + 1 < n);
        let mut triangles: Vec<[u32; 3]> =
            corners.flat_map(|i| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]).collect();
        assert!(triangles.len() > 2 * MANY);
        let shape =
            |triangles: &[[u32; 3]]| Shape::Mesh(Mesh::new(positions.clone(), triangles.to_vec(), None, None).unwrap());
        let alike = |_: ShapeId, _: ShapeId| true;
        assert_eq!(find(&world(vec![shape(&triangles), shape(&triangles)]), alike), None);
        let whole = shape(&triangles);
        triangles[5].swap(0, 2);
        triangles.push([n, n + 1, 1]);
        assert_eq!(find(&world(vec![whole, shape(&triangles)]), alike), found(2, [0, 1]));
    }
}
