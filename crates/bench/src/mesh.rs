//! Meshes made by formulas, with a given number of triangles.

use std::f64::consts::{PI, TAU};

use crate::assets::MeshData;
use crate::geometry::{Geometry, Mesh, Shape};
use crate::id::ShapeId;
use crate::math::DVec3;

/// A sphere of radius about 1 with bumps of several sizes, of `triangles` triangles if that number is even and has a
/// factor near its square root, else of about as many.
pub fn bumpy_sphere(triangles: usize) -> Mesh {
    checked(bumpy_sphere_data(triangles))
}

/// The buffers of a [`bumpy_sphere`].
pub fn bumpy_sphere_data(triangles: usize) -> MeshData {
    radial(triangles, |direction| {
        let waves = [(3.0, 0.10), (7.0, 0.05), (17.0, 0.02), (41.0, 0.008), (97.0, 0.003)];
        let bump = |(frequency, height): (f64, f64)| {
            let phase = direction * frequency;
            height * (phase.x + 1.3).sin() * (phase.y + 2.1).sin() * (phase.z + 0.7).sin()
        };
        direction * (1.0 + waves.into_iter().map(bump).sum::<f64>())
    })
}

/// A [`bumpy_sphere`] alone in its world.
pub fn sphere_geometry(triangles: usize) -> Geometry {
    Geometry { shapes: vec![Shape::Mesh(bumpy_sphere(triangles))], world: vec![ShapeId(0)], ..Geometry::default() }
}

/// A head with nose, chin, ears and eye sockets, looking along -y, about 2 high along z.
pub fn head(triangles: usize) -> Mesh {
    checked(radial(triangles, |direction| {
        // Each feature is a bell around a direction: height, width, and where it is.
        let features = [
            (0.30, 0.16, DVec3::new(0.0, -1.0, -0.05)),
            (0.14, 0.30, DVec3::new(0.0, -0.75, -0.75)),
            (0.40, 0.13, DVec3::new(1.0, 0.05, 0.05)),
            (0.40, 0.13, DVec3::new(-1.0, 0.05, 0.05)),
            (-0.14, 0.17, DVec3::new(0.36, -0.9, 0.2)),
            (-0.14, 0.17, DVec3::new(-0.36, -0.9, 0.2)),
            (0.10, 0.45, DVec3::new(0.0, 0.8, 0.4)),
        ];
        let bell = |(height, width, center): (f64, f64, DVec3)| {
            let distance = direction.distance(center.normalize());
            height * (-0.5 * (distance / width).powi(2)).exp()
        };
        let radius = 1.0 + features.into_iter().map(bell).sum::<f64>();
        direction * radius * DVec3::new(0.78, 0.9, 1.0)
    }))
}

/// A sphere of latitude rings with every vertex moved from its unit direction by `place`.
fn radial(triangles: usize, place: impl Fn(DVec3) -> DVec3) -> MeshData {
    let [slices, bands] = slices_and_bands(triangles);
    let mut positions = Vec::with_capacity(slices * bands + 2);
    let mut add = |direction: DVec3| positions.push(place(direction).as_vec3().to_array());
    add(DVec3::Z);
    for ring in 1..=bands {
        let (sin_theta, cos_theta) = (PI * ring as f64 / (bands + 1) as f64).sin_cos();
        for slice in 0..slices {
            let (sin, cos) = (TAU * slice as f64 / slices as f64).sin_cos();
            add(DVec3::new(sin_theta * cos, sin_theta * sin, cos_theta));
        }
    }
    add(-DVec3::Z);

    let (slices, bands) = (slices as u32, bands as u32);
    let last = 1 + bands * slices;
    let at = |ring: u32, slice: u32| 1 + (ring - 1) * slices + slice % slices;
    let mut corners = Vec::with_capacity(2 * (slices * bands) as usize);
    corners.extend((0..slices).map(|slice| [0, at(1, slice), at(1, slice + 1)]));
    for ring in 1..bands {
        for slice in 0..slices {
            let [a, b, c, d] = [at(ring, slice), at(ring, slice + 1), at(ring + 1, slice), at(ring + 1, slice + 1)];
            corners.extend([[a, c, d], [a, d, b]]);
        }
    }
    corners.extend((0..slices).map(|slice| [at(bands, slice), last, at(bands, slice + 1)]));
    MeshData { positions, triangles: corners, ..MeshData::default() }
}

/// As a mesh.
fn checked(data: MeshData) -> Mesh {
    // Formulas give finite positions, and all corners name one of them.
    Mesh::new(data.positions, data.triangles, None, None).unwrap_or_else(|e| unreachable!("{e}"))
}

/// Slices and bands with `2 * slices * bands` equal or near to `triangles`, the first no more than four times the
/// second.
fn slices_and_bands(triangles: usize) -> [usize; 2] {
    let cells = (triangles / 2).max(9);
    let root = cells.isqrt();
    match (root.div_ceil(2)..=root).rev().find(|bands| cells.is_multiple_of(*bands)) {
        Some(bands) => [cells / bands, bands],
        None => [cells.div_ceil(root), root],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_have_the_requested_number_of_triangles() {
        for count in [968, 1_000, 10_000, 70_000, 100_000] {
            assert_eq!(bumpy_sphere(count).triangles().len(), count);
        }
        assert_eq!(head(968).triangles().len(), 968);
        assert_eq!([1_000_000, 10_000_000].map(slices_and_bands), [[800, 625], [2500, 2000]]);
        // A prime number of cells has no factors.
        let [slices, bands] = slices_and_bands(2 * 10_007);
        assert!((2 * slices * bands).abs_diff(2 * 10_007) < 300, "{slices} {bands}");
    }

    #[test]
    fn meshes_are_closed_with_the_front_outside() {
        for mesh in [bumpy_sphere(1_000), head(968)] {
            let points = |prim| mesh.triangle_points(crate::id::PrimId::new(prim));
            let volume: f64 = (0..mesh.triangles().len())
                .map(points)
                .map(|p| p.a.as_dvec3().dot(p.b.as_dvec3().cross(p.c.as_dvec3())) / 6.0)
                .sum();
            assert!(volume > 2.0 && volume < 6.0, "{volume}");
            let mut edges = std::collections::HashMap::new();
            for &[a, b, c] in mesh.triangles() {
                for edge in [[a, b], [b, c], [c, a]] {
                    *edges.entry([edge[0].min(edge[1]), edge[0].max(edge[1])]).or_insert(0) +=
                        if edge[0] < edge[1] { 1 } else { -1 };
                }
            }
            assert!(edges.values().all(|balance| *balance == 0));
        }
    }
}
