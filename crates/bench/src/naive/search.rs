//! One ray on its way through naive trees.

use crate::geometry::{Geometry, Hit};
use crate::id::{PrimId, ShapeId};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{Aabb, DVec3, Ray};

/// The ray with its best hit.
pub struct Search<'g> {
    geometry: &'g Geometry,
    /// The mesh that is being searched.
    pub shape: ShapeId,
    /// The closest hit so far.
    pub best: Option<Hit>,
    /// The ray, which ends one float beyond the best hit, so that a hit which rounds to the same distance is compared
    /// as a tie.
    pub ray: Ray,
    /// Triangles tested.
    pub tests: u64,
}

impl<'g> Search<'g> {
    /// Nothing found yet.
    pub fn new(geometry: &'g Geometry, ray: &Ray) -> Self {
        Self { geometry, shape: ShapeId(0), best: None, ray: *ray, tests: 0 }
    }

    /// Tests one triangle.
    pub fn test(&mut self, prim: u32) {
        self.tests += 1;
        let key = self.geometry.cutouts.key(&self.ray);
        let Some(hit) = self.geometry.intersect_prim(&self.ray, key, self.shape, PrimId(prim), Hit::NO_INSTANCE) else {
            return;
        };
        if self.best.is_none_or(|best| hit.is_before(&best)) {
            self.best = Some(hit);
            self.ray.t_max = hit.t.next_up().min(self.ray.t_max);
        }
    }

    /// Whether the ray meets the box, by the plain slab test with divisions.
    pub fn meets(&self, bounds: &Aabb) -> bool {
        let (origin, direction) = (self.ray.origin.as_dvec3(), self.ray.direction.as_dvec3());
        // A float's roundoff of the largest coordinate hides the f64 roundings of this test and of the triangle's.
        let slack = UNIT_ROUNDOFF
            * (origin.abs().max_element() + bounds.min.abs().max(bounds.max.abs()).as_dvec3().max_element());
        let (low, high) = (bounds.min.as_dvec3() - slack, bounds.max.as_dvec3() + slack);
        let (mut enter, mut leave) = (f64::from(self.ray.t_min), f64::from(self.ray.t_max));
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if origin[axis] < low[axis] || origin[axis] > high[axis] {
                    return false;
                }
                continue;
            }
            let a = (low[axis] - origin[axis]) / direction[axis];
            let b = (high[axis] - origin[axis]) / direction[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// Bounds of a list of triangles.
pub fn bounds_of(bounds: &[Aabb], list: &[u32]) -> Aabb {
    list.iter().fold(Aabb::EMPTY, |all, prim| all.union(&bounds[*prim as usize]))
}

/// Whether two boxes have a point in common.
pub fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// Bounds of every triangle of a mesh.
pub fn triangle_bounds(mesh: &crate::geometry::Mesh) -> Vec<Aabb> {
    (0..mesh.triangles().len()).map(|prim| mesh.triangle_bounds(PrimId::new(prim))).collect()
}

/// The centre of a box in `f64`.
pub fn center(bounds: &Aabb) -> DVec3 {
    0.5 * (bounds.min.as_dvec3() + bounds.max.as_dvec3())
}
