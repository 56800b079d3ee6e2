//! Smooth normals for meshes that have none: averaged over the triangles around a position, up to creases.

use std::collections::HashMap;
use std::hash::Hash;

use crate::desc::{NormalWeightDesc, SmoothByDesc};
use crate::math::DVec3;

/// How normals are averaged.
#[derive(Clone, Copy, Debug, Default)]
pub struct Smoothing {
    pub weight: NormalWeightDesc,
    /// Cosine of the largest angle between two triangles that are smoothed together; `None` smooths all.
    pub crease_cosine: Option<f64>,
    pub by: SmoothByDesc,
}

/// A mesh with its vertices split at creases.
pub struct Split {
    /// For each vertex, the one that it was.
    pub vertices: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
    /// Normals of the vertices, for each time.
    pub normals: Vec<Vec<[f32; 3]>>,
}

/// A triangle as smoothing sees it.
struct Facet {
    /// Unit normal; zero without an area.
    n: DVec3,
    /// Weight at each corner.
    weights: [f64; 3],
}

impl Facet {
    /// By the angle at the corner (Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets"), by area, or
    /// all the same (Gouraud, "Continuous Shading of Curved Surfaces").
    fn new(corners: [DVec3; 3], weight: NormalWeightDesc) -> Self {
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let Some(n) = cross.try_normalize() else {
            return Self { n: DVec3::ZERO, weights: [0.0; 3] };
        };
        let weights = match weight {
            NormalWeightDesc::Area => [cross.length(); 3],
            NormalWeightDesc::Uniform => [1.0; 3],
            NormalWeightDesc::Angle => {
                [0, 1, 2].map(|k| (corners[(k + 1) % 3] - corners[k]).angle_between(corners[(k + 2) % 3] - corners[k]))
            }
        };
        Self { n, weights }
    }
}

fn facets(positions: &[[f32; 3]], triangles: &[[u32; 3]], weight: NormalWeightDesc) -> Vec<Facet> {
    let at = |i: u32| DVec3::from(positions[i as usize].map(f64::from));
    triangles.iter().map(|triangle| Facet::new(triangle.map(at), weight)).collect()
}

/// For each vertex the first one that counts as the same, at all times.
pub fn shared_vertices(steps: &[&[[f32; 3]]], by: SmoothByDesc) -> Vec<usize> {
    let count = steps.first().map_or(0, |positions| positions.len());
    if by == SmoothByDesc::Index {
        return (0..count).collect();
    }
    // Adding zero makes -0 and 0 the same.
    let key = |p: &[f32; 3]| p.map(|x| (x + 0.0).to_bits());
    let mut shared = vec![0; count];
    for positions in steps {
        shared = first_of(shared.iter().copied().zip(positions.iter().map(key)));
    }
    shared
}

/// For each key, the place of the first that is equal.
pub fn first_of<T: Eq + Hash>(keys: impl ExactSizeIterator<Item = T>) -> Vec<usize> {
    let mut first_at = HashMap::with_capacity(keys.len());
    keys.enumerate().map(|(i, key)| *first_at.entry(key).or_insert(i)).collect()
}

/// Normals of the vertices, without creases. Vertices that count as the same share their normal.
pub fn smooth(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    weight: NormalWeightDesc,
    by: SmoothByDesc,
) -> Vec<[f32; 3]> {
    smooth_shared(positions, triangles, weight, &shared_vertices(&[positions], by))
}

/// As [`smooth`], where the vertices that share a normal are given by the first of them.
pub fn smooth_shared(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    weight: NormalWeightDesc,
    shared: &[usize],
) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for (triangle, facet) in triangles.iter().zip(facets(positions, triangles, weight)) {
        for k in 0..3 {
            sums[shared[triangle[k] as usize]] += facet.n * facet.weights[k];
        }
    }
    shared.iter().map(|&i| sums[i].normalize_or_zero().as_vec3().to_array()).collect()
}

/// Splits a mesh at creases: at each corner the normal is averaged over the triangles around its vertex that differ
/// from the corner's own by no more than the crease. `steps` has the positions at each time; the first ones decide
/// where creases are.
pub fn split(
    steps: &[&[[f32; 3]]],
    triangles: &[[u32; 3]],
    weight: NormalWeightDesc,
    by: SmoothByDesc,
    crease_cosine: f64,
) -> Split {
    let shared = shared_vertices(&steps[..1], by);
    let by_step: Vec<Vec<Facet>> = steps.iter().map(|positions| facets(positions, triangles, weight)).collect();
    let mut around: HashMap<usize, Vec<(usize, usize)>> = HashMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            around.entry(shared[triangle[k] as usize]).or_default().push((t, k));
        }
    }

    let mut split = Split {
        vertices: Vec::new(),
        triangles: Vec::with_capacity(triangles.len()),
        normals: vec![Vec::new(); steps.len()],
    };
    let mut known: HashMap<(u32, Vec<[u32; 3]>), u32> = HashMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        let corners = triangle.map(|vertex| {
            let own = by_step[0][t].n;
            let joined: Vec<_> = around[&shared[vertex as usize]]
                .iter()
                .filter(|&&(other, _)| other == t || by_step[0][other].n.dot(own) >= crease_cosine)
                .collect();
            let normal = |facets: &Vec<Facet>| {
                let sum: DVec3 = joined.iter().map(|&&(other, k)| facets[other].n * facets[other].weights[k]).sum();
                sum.normalize_or_zero().as_vec3().to_array()
            };
            let normals: Vec<[f32; 3]> = by_step.iter().map(normal).collect();
            let key = (vertex, normals.iter().map(|n| n.map(f32::to_bits)).collect());
            *known.entry(key).or_insert_with(|| {
                split.vertices.push(vertex);
                split.normals.iter_mut().zip(&normals).for_each(|(all, n)| all.push(*n));
                (split.vertices.len() - 1) as u32
            })
        });
        split.triangles.push(corners);
    }
    split
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::meshes::cube;
    use crate::math::Vec3;

    #[test]
    fn smooth_normals_of_a_cube_point_along_its_diagonals() {
        let cube = cube();
        for weight in [NormalWeightDesc::Angle, NormalWeightDesc::Area] {
            let normals = smooth(&cube.positions, &cube.triangles, weight, SmoothByDesc::Position);
            // By angle the two triangles of a face count as one; by area a face with both at a corner counts twice.
            let exact = weight == NormalWeightDesc::Angle;
            for (p, n) in cube.positions.iter().zip(normals) {
                let cos = Vec3::from(*p).normalize().dot(Vec3::from(n));
                assert!(cos > if exact { 1.0 - 1e-6 } else { 0.8 }, "{cos}");
            }
        }
    }

    #[test]
    fn weights_say_how_much_each_triangle_counts() {
        // About the origin: a right angle in the plane z = 0, of area 2, and half a right angle in the plane x = 0, of
        // area 1/2.
        let positions = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]];
        let triangles = [[0, 1, 2], [0, 3, 4]];
        for (weight, [of_z, of_x]) in [
            (NormalWeightDesc::Angle, [2.0, 1.0]),
            (NormalWeightDesc::Area, [4.0, 1.0]),
            (NormalWeightDesc::Uniform, [1.0, 1.0]),
        ] {
            let expected = Vec3::new(of_x, 0.0, of_z).normalize();
            let creased = split(&[&positions], &triangles, weight, SmoothByDesc::Position, -1.0);
            assert_eq!(creased.vertices[0], 0);
            for n in [smooth(&positions, &triangles, weight, SmoothByDesc::Position)[0], creased.normals[0][0]] {
                assert!((Vec3::from(n) - expected).length() < 1e-6, "{weight:?}: {n:?}");
            }
        }
    }

    #[test]
    fn by_index_the_faces_of_a_cube_whose_corners_are_three_vertices_stay_flat() {
        let cube = cube();
        let normals = smooth(&cube.positions, &cube.triangles, NormalWeightDesc::Angle, SmoothByDesc::Index);
        for triangle in &cube.triangles {
            let [a, b, c] = triangle.map(|i| Vec3::from(cube.positions[i as usize]));
            let n = (b - a).cross(c - a).normalize();
            assert!(triangle.iter().all(|&i| (Vec3::from(normals[i as usize]) - n).length() < 1e-6));
        }
    }

    #[test]
    fn a_crease_keeps_the_edges_of_a_cube_and_not_those_within_its_faces() {
        let cube = cube();
        let flat = split(
            &[&cube.positions],
            &cube.triangles,
            NormalWeightDesc::Angle,
            SmoothByDesc::Position,
            60f64.to_radians().cos(),
        );
        assert_eq!((flat.vertices.len(), flat.triangles.len()), (24, 12));
        for triangle in &flat.triangles {
            let corners = triangle.map(|i| Vec3::from(cube.positions[flat.vertices[i as usize] as usize]));
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            assert!(triangle.iter().all(|&i| (Vec3::from(flat.normals[0][i as usize]) - n).length() < 1e-6));
        }
        let round = split(
            &[&cube.positions],
            &cube.triangles,
            NormalWeightDesc::Angle,
            SmoothByDesc::Position,
            100f64.to_radians().cos(),
        );
        let smooth = smooth(&cube.positions, &cube.triangles, NormalWeightDesc::Angle, SmoothByDesc::Position);
        for (vertex, n) in round.vertices.iter().zip(&round.normals[0]) {
            assert!((Vec3::from(*n) - Vec3::from(smooth[*vertex as usize])).length() < 1e-6);
        }
    }

    #[test]
    fn creases_stay_where_they_were_while_a_mesh_deforms() {
        // A roof that opens from flat to steep: without a crease at first, so without one later.
        let roof = |height: f32| vec![[-1.0, 0.0, 0.0], [0.0, height, 1.0], [0.0, height, -1.0], [1.0, 0.0, 0.0]];
        let (open, steep) = (roof(0.1), roof(2.0));
        let triangles = [[0, 1, 2], [3, 2, 1]];
        let cos = 30f64.to_radians().cos();
        let split_roof = split(&[&open, &steep], &triangles, NormalWeightDesc::Angle, SmoothByDesc::Position, cos);
        assert_eq!((split_roof.vertices.len(), split_roof.normals.len()), (4, 2));
        assert_eq!(
            split(&[&steep], &triangles, NormalWeightDesc::Angle, SmoothByDesc::Position, cos).vertices.len(),
            6
        );
    }
}
