//! Which rays may be handed to Embree. Debian's build has assertions on: a ray that is not valid aborts the process,
//! also when it only becomes invalid in the space of an instance.

use crate::error::{Error, Result};
use crate::geometry::{Instance, InverseReach};
use crate::math::float::EMBREE_LARGE;
use crate::math::{Ray, Vec3, Vec4};

/// The limits on rays of one accelerator.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayLimits {
    /// Largest magnitude of a coordinate of the origin; without instances, that of [`Ray::is_valid`].
    origin: f32,
    /// Largest magnitude of a component of the direction.
    direction: f32,
    low_o: Vec4,
    high_o: Vec4,
    low_d: Vec4,
    high_d: Vec4,
}

impl RayLimits {
    /// The gate of a scene without instances.
    pub(super) const OPEN: Self = Self::new(EMBREE_LARGE.next_down(), EMBREE_LARGE.next_down());

    const fn new(origin: f32, direction: f32) -> Self {
        Self {
            origin,
            direction,
            low_o: Vec4::new(-origin, -origin, -origin, 0.0),
            high_o: Vec4::new(origin, origin, origin, f32::MAX),
            low_d: Vec4::new(-direction, -direction, -direction, 0.0),
            high_d: Vec4::new(direction, direction, direction, 1.0),
        }
    }

    /// The gate for these instances: a ray that passes stays valid in the space of each.
    ///
    /// # Errors
    /// If a transform has no finite inverse in `f32`, the precision in which Embree inverts it.
    pub(super) fn for_instances(instances: &[Instance]) -> Result<Self> {
        // Half the limit leaves room for rounding.
        const LIMIT: f32 = 0.5 * EMBREE_LARGE;
        let mut gate = Self::OPEN;
        // Instances that move test each ray themselves.
        for (i, instance) in instances.iter().enumerate().filter(|(_, instance)| instance.motion.is_none()) {
            let InverseReach { reach, offset } = instance.inverse_reach().ok_or_else(|| {
                Error::Embree(format!("instance {i}: its transform is too small or too large to be inverted in f32"))
            })?;
            gate = Self::new(gate.origin.min((LIMIT - offset) / reach), gate.direction.min(LIMIT / reach));
        }
        Ok(gate)
    }

    /// Whether `ray` may be handed to Embree: it is [valid](Ray::is_valid) and within the limits. Every other ray hits
    /// nothing; so does one with `t_max = 0`, which Embree's closest-hit query passes over and its any-hit query does
    /// not.
    #[inline(always)]
    pub(super) fn accepts(&self, ray: &RayWords) -> bool {
        let RayWords { origin_t_min: o, direction_time: d, t_max } = *ray;
        // Every comparison with a NaN is false.
        let within = o.cmpge(self.low_o) & o.cmple(self.high_o) & d.cmpge(self.low_d) & d.cmple(self.high_d);
        let still = d.cmpeq(Vec4::ZERO).bitmask() & 0b111 == 0b111;
        within.all() && !still && o.w <= t_max && t_max > 0.0
    }

    /// Whether `ray` may be traced side by side with others. Embree sorts the rays of a packet by the signs of their
    /// directions but takes the reciprocal of any component below [`SMALLEST_RECIPROCAL`] as positive; a small negative
    /// one spoils the common frustum: nodes are missed, and empty ones entered, which ends in an assertion. An interval
    /// of one point goes alone too: any-hit packets pass over it.
    #[inline(always)]
    pub(super) fn admits_to_packet(&self, ray: &Ray) -> bool {
        let tame = |x: f32| (x == 0.0) | (x.abs() >= SMALLEST_RECIPROCAL);
        let within = |v: Vec3, limit: f32| (v.x.abs() <= limit) & (v.y.abs() <= limit) & (v.z.abs() <= limit);
        let admitted = ray.is_valid()
            & (ray.t_max > 0.0)
            & within(ray.origin, self.origin)
            & within(ray.direction, self.direction);
        admitted & (ray.t_min < ray.t_max) & tame(ray.direction.x) & tame(ray.direction.y) & tame(ray.direction.z)
    }
}

/// A ray in registers, in the order in which Embree reads it.
#[derive(Clone, Copy)]
pub(super) struct RayWords {
    pub(super) origin_t_min: Vec4,
    pub(super) direction_time: Vec4,
    pub(super) t_max: f32,
}

impl RayWords {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let [o, d] = [ray.origin, ray.direction];
        Self {
            origin_t_min: Vec4::new(o.x, o.y, o.z, ray.t_min),
            direction_time: Vec4::new(d.x, d.y, d.z, ray.time),
            t_max: ray.t_max,
        }
    }
}

/// Embree's `min_rcp_input`, rounded up.
const SMALLEST_RECIPROCAL: f32 = 1.0001e-18;
