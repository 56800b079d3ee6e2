//! A ray prepared for boxes, so that no box is missed that the exact ray meets.

use crate::math::rows::soa;
use crate::math::{Aabb, Ray, Vec3, vec3};

/// Relative slack of a distance to a plane: three roundings on each side and the scaling itself, twice over (Ize,
/// "Robust BVH Ray Traversal").
const RELATIVE: f32 = 4.0 * f32::EPSILON;

/// What tests of primitives in `f64` can err by, relative to the magnitudes of origin and bounds; a few thousand of
/// their roundings.
const TRACE: f32 = 1e-12;

/// Largest reciprocal of a direction's component on the near side; smaller ones only open more boxes.
const LARGEST_RECIPROCAL: f32 = 1e30;

soa! {
    /// A ray prepared for conservative slab tests.
    ///
    /// A box is entered at `max((near plane - near_origin) * near_reciprocal)` and left at
    /// `min((far plane - far_origin) * far_reciprocal)` over the axes. Origins stand one float (or the given slack)
    /// outside, reciprocals are scaled by a few roundings, so entries are never late and exits never early. A far
    /// product is NaN where a plane holds the origin and the direction has no component; it then does not count.
    pub(in crate::accel) struct SlabRows of SlabRay {
        /// Origin to subtract from near planes.
        near_origin: Vec3,
        /// Origin to subtract from far planes.
        far_origin: Vec3,
        /// Finite.
        near_reciprocal: Vec3,
        /// May be infinite.
        far_reciprocal: Vec3,
        /// A bit for each axis along which the maximum is the near plane.
        negative: u32,
    }
}

impl SlabRay {
    /// Prepares a ray for boxes within `bounds`, with positions uncertain by `slack`.
    #[inline(always)]
    pub fn new(ray: &Ray, bounds: &Aabb, slack: f32) -> Self {
        let extent = bounds.min.abs().max(bounds.max.abs());
        let size = ray.origin.abs().max_element() + extent.max_element();
        // A float of the origin, and for f64 tests of primitives a trace of the whole size.
        let shift = ray.origin.abs() * f32::EPSILON + Vec3::splat(size * TRACE + slack);
        let reciprocal = ray.direction.recip();
        let outward = vec3(
            shift.x.copysign(ray.direction.x),
            shift.y.copysign(ray.direction.y),
            shift.z.copysign(ray.direction.z),
        );
        let sign = |component: f32| component.to_bits() >> 31;
        Self {
            near_origin: ray.origin + outward,
            far_origin: ray.origin - outward,
            near_reciprocal: reciprocal.clamp(Vec3::splat(-LARGEST_RECIPROCAL), Vec3::splat(LARGEST_RECIPROCAL))
                * (1.0 - RELATIVE),
            far_reciprocal: reciprocal * (1.0 + RELATIVE),
            negative: sign(ray.direction.x) | sign(ray.direction.y) << 1 | sign(ray.direction.z) << 2,
        }
    }

    /// Whether the maximum is the near plane along an axis.
    #[inline(always)]
    pub fn is_negative(&self, axis: usize) -> bool {
        self.negative >> axis & 1 != 0
    }

    /// Where the ray may be inside the box within `[t_min, t_max]`.
    #[inline(always)]
    pub fn interval(&self, bounds: &Aabb, t_min: f32, t_max: f32) -> Option<(f32, f32)> {
        let (mut enter, mut leave) = (t_min, t_max);
        for axis in 0..3 {
            let (near, far) = if self.is_negative(axis) {
                (bounds.max[axis], bounds.min[axis])
            } else {
                (bounds.min[axis], bounds.max[axis])
            };
            let near = (near - self.near_origin[axis]) * self.near_reciprocal[axis];
            let far = (far - self.far_origin[axis]) * self.far_reciprocal[axis];
            enter = if near > enter { near } else { enter };
            leave = if far < leave { far } else { leave };
        }
        (enter <= leave).then_some((enter, leave))
    }
}
