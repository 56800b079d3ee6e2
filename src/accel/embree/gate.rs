//! Which rays may be handed to Embree. Debian's build has assertions on: a ray that is not valid aborts the process, also when it only
//! becomes invalid in the space of an instance.

use crate::error::{Error, Result};
use crate::geometry::Instance;
use crate::math::float::EMBREE_LARGE;
use crate::math::{Ray, Vec3};

/// The limits on rays of one accelerator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    /// Largest magnitude of a coordinate of the origin; infinite if there are no instances, where [`Ray::is_valid`] is enough.
    origin: f32,
    /// Largest magnitude of a component of the direction.
    direction: f32,
}

impl Gate {
    /// The gate of a scene without instances.
    pub(super) const OPEN: Self = Self { origin: f32::INFINITY, direction: f32::INFINITY };

    /// The gate for these instances: a ray that passes stays valid in the space of each.
    ///
    /// # Errors
    /// If a transform has no finite inverse in `f32`, the precision in which Embree inverts it.
    pub(super) fn for_instances(instances: &[Instance]) -> Result<Self> {
        // Half the limit leaves room for rounding.
        const LIMIT: f32 = 0.5 * EMBREE_LARGE;
        let mut gate = Self::OPEN;
        // Instances that move look at each ray themselves.
        for (i, instance) in instances.iter().enumerate().filter(|(_, instance)| instance.motion.is_none()) {
            let Inverse { reach, offset } = invert_as_embree(instance)
                .ok_or_else(|| Error::Embree(format!("instance {i}: its transform is too small or too large to be inverted in f32")))?;
            gate.origin = gate.origin.min((LIMIT - offset) / reach);
            gate.direction = gate.direction.min(LIMIT / reach);
        }
        Ok(gate)
    }

    /// Whether `ray` may be handed to Embree. Every other ray hits nothing; so does one with `t_max = 0`, which Embree's closest-hit query
    /// passes over and its any-hit query does not.
    #[inline(always)]
    pub(super) fn admits(&self, ray: &Ray) -> bool {
        let within = |v: Vec3, limit: f32| (v.x.abs() <= limit) & (v.y.abs() <= limit) & (v.z.abs() <= limit);
        ray.is_valid() & (ray.t_max > 0.0) & within(ray.origin, self.origin) & within(ray.direction, self.direction)
    }

    /// Whether `ray` may be traced side by side with others. Embree sorts the rays of a packet by the signs of their directions but takes
    /// the reciprocal of any component below [`SMALLEST_RECIPROCAL`] as positive; a small negative one spoils the common frustum: nodes
    /// are missed, and empty ones entered, which ends in an assertion. An interval of one point goes alone too: any-hit packets pass over it.
    #[inline(always)]
    pub(super) fn admits_to_packet(&self, ray: &Ray) -> bool {
        let tame = |x: f32| (x == 0.0) | (x.abs() >= SMALLEST_RECIPROCAL);
        self.admits(ray) & (ray.t_min < ray.t_max) & tame(ray.direction.x) & tame(ray.direction.y) & tame(ray.direction.z)
    }
}

/// Embree's `min_rcp_input`, rounded up.
const SMALLEST_RECIPROCAL: f32 = 1.0001e-18;

/// How far a map to object space can move a ray.
struct Inverse {
    /// Largest sum of magnitudes of a row of the linear part.
    reach: f32,
    /// Largest magnitude of a component of the translation.
    offset: f32,
}

/// The inverse by cofactors in `f32`; `None` if it is not finite, leaves no room for any ray, or its determinant is denormal.
fn invert_as_embree(instance: &Instance) -> Option<Inverse> {
    let m = &instance.transform.world_from_object;
    let (x, y, z) = (m.matrix3.x_axis.as_vec3(), m.matrix3.y_axis.as_vec3(), m.matrix3.z_axis.as_vec3());
    let rows = [y.cross(z), z.cross(x), x.cross(y)];
    let determinant = x.dot(rows[0]);
    if !determinant.is_normal() {
        return None;
    }
    let rows = rows.map(|row| row / determinant);
    let translation = m.translation.as_vec3();
    let offsets = rows.map(|row| row.abs().dot(translation.abs()));
    let reach = rows.iter().map(|row| row.abs().element_sum()).fold(0.0, f32::max);
    let offset = offsets.into_iter().fold(0.0, f32::max);
    // A NaN row would be lost in the maxima, so each is looked at.
    let finite = rows.iter().all(|row| row.is_finite()) && offsets.iter().all(|o| *o < 0.25 * EMBREE_LARGE);
    (finite && reach.is_normal()).then_some(Inverse { reach, offset })
}
