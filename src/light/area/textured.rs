//! Textures and holes of surfaces that emit.

use crate::geometry::Shape;
use crate::id::PrimId;
use crate::math::{DVec3, Vec2};
use crate::sampling::{Piecewise2d, warp};
use crate::texture::Footprint;

/// Cells of a density along each side, and lookups along each side of a cell.
const CELLS: usize = 64;
const LOOKUPS: usize = 3;

/// Lookups along each side for the mean over a triangle.
const TRIANGLE_LOOKUPS: usize = 4;

/// What a texture counts at least: lookups may all meet black and miss a bright spot, and a light that counts nothing
/// is never chosen.
pub(super) const LEAST_MEAN: f32 = 1e-3;

/// What textures take at the point `p` of a shape that its sampling found with `u`.
pub(super) fn point(shape: &Shape, prim: PrimId, p: DVec3, u: [f32; 2]) -> Footprint<'_> {
    match shape {
        Shape::Mesh(mesh) => {
            let [b, c] = warp::uniform_triangle(u).map(|b| b as f32);
            Footprint { attributes: mesh.attributes_at(prim, b, c), ..Footprint::point(mesh.uv(prim, b, c)) }
        }
        Shape::Analytic(placed) => Footprint::point(placed.uv(p, u)),
        Shape::Curves(_) | Shape::Points(_) => Footprint::point(Vec2::ZERO),
    }
}

/// Mean of a function of a surface's points over a primitive, about.
pub(super) fn mean(shape: &Shape, prim: PrimId, function: impl Fn(&Footprint) -> f32) -> f32 {
    let side = if matches!(shape, Shape::Mesh(_)) { TRIANGLE_LOOKUPS } else { CELLS };
    let middle = |i: usize| (i as f32 + 0.5) / side as f32;
    let at = |i: usize| {
        let u = [middle(i % side), middle(i / side)];
        let p = match shape {
            Shape::Mesh(_) | Shape::Curves(_) | Shape::Points(_) => DVec3::ZERO,
            Shape::Analytic(placed) => placed.sample_area(u).p,
        };
        function(&point(shape, prim, p, u))
    };
    (0..side * side).map(at).sum::<f32>() / (side * side) as f32
}

/// The density over the unit square that follows a brightness; `None` if it is black.
pub(super) fn density(brightness: impl Fn(&Footprint) -> f32) -> Option<Piecewise2d> {
    let n = CELLS * LOOKUPS;
    let middle = |i: usize| (i as f32 + 0.5) / n as f32;
    let mut weights = vec![0.0; CELLS * CELLS];
    for y in 0..n {
        for x in 0..n {
            weights[y / LOOKUPS * CELLS + x / LOOKUPS] +=
                brightness(&Footprint::point(Vec2::new(middle(x), middle(y))));
        }
    }
    Piecewise2d::new(CELLS, CELLS, &weights)
}
