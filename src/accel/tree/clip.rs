//! Which part of an item lies in a box, and whether any does: exact up to `f64`, and never too little.

use super::Items;
use crate::geometry::TrianglePoints;
use crate::math::float::{F64_CHAIN_ERROR, round_down, round_up};
use crate::math::{Aabb, Bounds, DVec3, Vec3};

/// A triangle cut by six planes has at most nine corners; with rounding, a few more.
const MAX_CORNERS: usize = 12;

impl Items<'_> {
    /// Bounds of the part of an item in a box: exact for triangles at rest, except that they are rounded outward; for
    /// all else the intersection with its bounds. Empty if no part is there.
    pub fn clipped_bounds(&self, index: usize, cell: &Aabb) -> Aabb {
        let common = intersection(&self.bounds[index], cell);
        if common.is_empty() {
            return Aabb::EMPTY;
        }
        match self.triangle(index) {
            // Wholly inside: there is nothing to cut.
            Some(_) if common == self.bounds[index] => common,
            Some(triangle) => clip_triangle(&triangle, &common),
            None => common,
        }
    }

    /// Whether some part of an item lies in a box or touches it: exact for triangles at rest, for all else a test of
    /// its bounds.
    pub fn overlaps(&self, index: usize, cell: &Aabb) -> bool {
        let common = intersection(&self.bounds[index], cell);
        if common.is_empty() {
            return false;
        }
        match self.triangle(index) {
            Some(_) if common == self.bounds[index] => true,
            Some(triangle) => triangle_overlaps(&triangle, cell),
            None => true,
        }
    }
}

fn intersection(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb { min: a.min.max(b.min), max: a.max.min(b.max) }
}

fn corners(triangle: &TrianglePoints) -> [DVec3; 3] {
    [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3)
}

/// A bound of the error of a corner after all cuts, relative to which the largest coordinate at hand is given.
fn margin(corners: &[DVec3; 3], cell: &Aabb) -> f64 {
    let size = cell.min.abs().max(cell.max.abs()).as_dvec3();
    let size = corners.iter().fold(size, |size, p| size.max(p.abs()));
    F64_CHAIN_ERROR * size.max_element()
}

/// Bounds of the part of a triangle in a box (Sutherland and Hodgman, "Reentrant Polygon Clipping").
///
/// A cut computes its corners with an error of at most 8 roundings of the largest coordinate, as the two differences it
/// divides are those of the numbers at hand. So if the planes stand off by the error of all six cuts, each point of the
/// exact part is within that error of a point that is kept.
fn clip_triangle(triangle: &TrianglePoints, cell: &Aabb) -> Aabb {
    let points = corners(triangle);
    let margin = margin(&points, cell);
    let mut polygon = Polygon { corners: [DVec3::ZERO; MAX_CORNERS], count: 3 };
    polygon.corners[..3].copy_from_slice(&points);
    for axis in 0..3 {
        let (min, max) = (f64::from(cell.min[axis]) - margin, f64::from(cell.max[axis]) + margin);
        let cut = polygon.cut(|p| p[axis] - min).and_then(|polygon| polygon.cut(|p| max - p[axis]));
        match cut {
            Some(cut) if cut.count > 0 => polygon = cut,
            Some(_) => return Aabb::EMPTY,
            None => return *cell,
        }
    }
    let bounds =
        polygon.corners[..polygon.count].iter().fold(Bounds::EMPTY, |bounds, &p| bounds.extended(p)).grown(margin);
    let part = Aabb {
        min: Vec3::from(bounds.min.to_array().map(round_down)),
        max: Vec3::from(bounds.max.to_array().map(round_up)),
    };
    intersection(&part, cell)
}

struct Polygon {
    corners: [DVec3; MAX_CORNERS],
    count: usize,
}

impl Polygon {
    /// The part where `height`, linear in the point, is not negative. `None` if it has too many corners, as rounding
    /// may make a polygon cross a plane more than twice.
    fn cut(&self, height: impl Fn(DVec3) -> f64) -> Option<Self> {
        let mut kept = Self { corners: [DVec3::ZERO; MAX_CORNERS], count: 0 };
        for i in 0..self.count {
            let (a, b) = (self.corners[i], self.corners[if i + 1 == self.count { 0 } else { i + 1 }]);
            let (height_a, height_b) = (height(a), height(b));
            if height_a >= 0.0 {
                kept.keep(a)?;
            }
            if (height_a < 0.0) != (height_b < 0.0) {
                kept.keep(a + (b - a) * (height_a / (height_a - height_b)))?;
            }
        }
        Some(kept)
    }

    fn keep(&mut self, p: DVec3) -> Option<()> {
        *self.corners.get_mut(self.count)? = p;
        self.count += 1;
        Some(())
    }
}

/// Whether a triangle and a box have a point in common, by thirteen separating axes (Akenine-Moeller, "Fast 3D
/// Triangle-Box Overlap Testing"). The box is grown by more than the roundings of all terms, so that what touches
/// overlaps.
fn triangle_overlaps(triangle: &TrianglePoints, cell: &Aabb) -> bool {
    let points = corners(triangle);
    let margin = 2.0 * margin(&points, cell);
    let (min, max) = (cell.min.as_dvec3(), cell.max.as_dvec3());
    let (center, half) = (0.5 * (min + max), 0.5 * (max - min) + margin);
    let [a, b, c] = points.map(|p| p - center);
    let edges = [b - a, c - b, a - c];

    // The box's own axes.
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if low.cmpgt(half).any() || high.cmplt(-half).any() {
        return false;
    }

    // Each edge with each axis of the box: both ends of the edge project to one point, the third corner to another.
    for (edge, end, other) in [(edges[0], a, c), (edges[1], b, a), (edges[2], c, b)] {
        for (i, j) in [(1, 2), (2, 0), (0, 1)] {
            let project = |p: DVec3| edge[i] * p[j] - edge[j] * p[i];
            let (p, q) = (project(end), project(other));
            let radius = half[j] * edge[i].abs() + half[i] * edge[j].abs();
            if p.min(q) > radius || p.max(q) < -radius {
                return false;
            }
        }
    }

    // The triangle's plane. The error of a sliver's normal is relative to the products it is the difference of.
    let normal = edges[0].cross(edges[1]);
    let products = edges[0].abs().max_element() * edges[1].abs().max_element();
    let error = F64_CHAIN_ERROR * products * a.abs().max_element();
    normal.dot(a).abs() <= normal.abs().dot(half) + error
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tree::testing::{items_of, mesh_geometry};
    use crate::math::Rng;

    /// Triangles of many sizes, some degenerate, with boxes that they touch or nearly touch.
    fn cases(count: usize, mut visit: impl FnMut(&TrianglePoints, &Aabb)) {
        let mut rng = Rng::new(1);
        for i in 0..count {
            let offset = rng.cube() * [0.0, 1.0, 100.0][i % 3];
            let size = 2f64.powi((rng.unit() * 12.0) as i32 - 9);
            let a = offset + rng.cube();
            let [b, c] = match i % 5 {
                0 => [a, a],
                1 => {
                    let d = rng.cube();
                    [a + d * size, a - d * (0.3 * size)]
                }
                2 => [a + DVec3::X * size, a + DVec3::Y * size],
                _ => [a + rng.cube() * size, a + rng.cube() * size],
            };
            let triangle = TrianglePoints { a: a.as_vec3(), b: b.as_vec3(), c: c.as_vec3() };
            let p = offset + rng.cube();
            let q = p + rng.cube() * if i % 2 == 0 { 1.0 } else { 0.1 };
            let cell = Aabb { min: p.min(q).as_vec3(), max: p.max(q).as_vec3() };
            visit(&triangle, &cell);
            // A box with a corner of the triangle in its own corner.
            visit(&triangle, &Aabb { min: triangle.a, max: triangle.a + cell.size() });
        }
    }

    fn random_point(triangle: &TrianglePoints, rng: &mut Rng) -> DVec3 {
        let [a, b, c] = corners(triangle);
        let (s, t) = (rng.unit(), rng.unit());
        let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        a + (b - a) * s + (c - a) * t
    }

    fn holds(bounds: &Aabb, p: DVec3) -> bool {
        bounds.min.as_dvec3().cmple(p).all() && p.cmple(bounds.max.as_dvec3()).all()
    }

    #[test]
    fn the_clipped_box_holds_every_point_of_the_part_and_stays_in_the_cell() {
        let mut rng = Rng::new(2);
        let (mut inside, mut tight) = (0, 0);
        cases(20_000, |triangle, cell| {
            let geometry = mesh_geometry(&[*triangle]);
            let items = items_of(&geometry);
            let clipped = items.clipped_bounds(0, cell);
            let overlaps = items.overlaps(0, cell);
            assert!(clipped.is_empty() || overlaps, "{triangle:?} {cell:?}");
            assert!(clipped.is_empty() || clipped == intersection(&clipped, cell));
            for _ in 0..20 {
                let p = random_point(triangle, &mut rng);
                if holds(cell, p) {
                    inside += 1;
                    // The point itself is rounded; what it may miss is far below a float.
                    let slack = 1e-13 * p.abs().max_element().max(1.0);
                    let grown = Bounds { min: clipped.min.as_dvec3() - slack, max: clipped.max.as_dvec3() + slack };
                    assert!(
                        overlaps && grown.min.cmple(p).all() && p.cmple(grown.max).all(),
                        "{triangle:?} {cell:?} {p}"
                    );
                }
            }
            let simple = intersection(&triangle.bounds(), cell);
            tight += usize::from(!simple.is_empty() && clipped.area() < 0.9 * simple.area());
        });
        assert!(inside > 20_000 && tight > 2_000, "{inside} {tight}");
    }

    #[test]
    fn the_parts_on_both_sides_of_a_plane_make_up_the_whole() {
        cases(20_000, |triangle, cell| {
            let geometry = mesh_geometry(&[*triangle]);
            let items = items_of(&geometry);
            let whole = items.clipped_bounds(0, cell);
            for axis in 0..3 {
                let plane = cell.center()[axis];
                let (mut below, mut above) = (*cell, *cell);
                below.max[axis] = plane;
                above.min[axis] = plane;
                let union = items.clipped_bounds(0, &below).union(&items.clipped_bounds(0, &above));
                // Each cut rounds outward by two floats.
                let size = whole.min.abs().max(whole.max.abs()).max(Vec3::splat(1e-3));
                let near = |a: Vec3, b: Vec3| ((a - b).abs()).cmple(size * (8.0 * f32::EPSILON)).all();
                assert_eq!(union.is_empty(), whole.is_empty(), "{triangle:?} {cell:?}");
                assert!(
                    whole.is_empty() || (near(union.min, whole.min) && near(union.max, whole.max)),
                    "{union:?} {whole:?}"
                );
                if items.overlaps(0, cell) {
                    assert!(items.overlaps(0, &below) || items.overlaps(0, &above), "{triangle:?} {cell:?}");
                }
            }
        });
    }

    #[test]
    fn overlap_is_exact_where_the_box_of_the_triangle_is_not() {
        let triangle = TrianglePoints { a: Vec3::ZERO, b: Vec3::new(4.0, 0.0, 4.0), c: Vec3::new(0.0, 4.0, 4.0) };
        let geometry = mesh_geometry(&[triangle]);
        let items = items_of(&geometry);
        let cell = |x: f32, y: f32, z: f32| Aabb { min: Vec3::new(x, y, z), max: Vec3::new(x + 1.0, y + 1.0, z + 1.0) };
        // The plane is z = x + y, the third edge x + y = 4.
        for (cell, overlaps) in [
            (cell(0.0, 0.0, 0.0), true),
            (cell(0.0, 0.0, 2.0), true),
            (cell(0.0, 0.0, 2.001), false),
            (cell(2.0, 2.0, 3.0), true),
            (cell(2.001, 2.0, 3.0), false),
            (cell(2.0, 0.0, 0.999), false),
            (cell(2.0, 0.0, 1.0), true),
            (cell(-1.0, -1.0, -1.0), true),
            (cell(-1.0, 4.0, 4.0), true),
            (cell(-1.0, 4.001, 4.0), false),
        ] {
            assert_eq!(items.overlaps(0, &cell), overlaps, "{cell:?}");
            assert_eq!(!items.clipped_bounds(0, &cell).is_empty(), overlaps, "{cell:?}");
        }
        let clipped = items.clipped_bounds(0, &cell(0.5, 0.5, 1.0));
        let exact = Aabb { min: Vec3::new(0.5, 0.5, 1.0), max: Vec3::new(1.5, 1.5, 2.0) };
        assert!(
            (clipped.min - exact.min).abs().max_element() < 1e-6
                && (clipped.max - exact.max).abs().max_element() < 1e-6,
            "{clipped:?}"
        );
    }
}
