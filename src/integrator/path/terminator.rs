//! Rays that the shading normal sees and the facet hides: they start above the facet, on the smooth surface that it
//! approximates (Hanika, "Hacking the Shadow Terminator"), if nothing lies between.

use super::Context;
use super::block::{Vertices, spawn};
use crate::accel::{AnyHitRays, Coherence};
use crate::geometry::SurfaceInteraction;
use crate::integrator::shading::terminator_start;
use crate::math::rows::{BATCH, Row};
use crate::math::{Ray, RayRows};

/// Buffers of one block.
#[derive(Default)]
pub(super) struct TerminatorRays {
    lanes: Vec<u8>,
    starts: Vec<SurfaceInteraction>,
    rays: RayRows,
}

/// Starts the rays of vertices above their facets whose `status` is [`spawn::BELOW_FACET`]: `respawn` sets such a ray.
/// The result is how many rays this took.
pub(super) fn offset(
    context: &Context,
    vertices: &mut Vertices,
    buffers: &mut TerminatorRays,
    status: impl Fn(&mut Vertices) -> &mut Row<u32>,
    mut respawn: impl FnMut(&mut Vertices, usize, &SurfaceInteraction),
) -> u64 {
    let TerminatorRays { lanes, starts, rays } = buffers;
    lanes.clear();
    starts.clear();
    for lane in 0..vertices.count {
        if status(vertices)[lane] == spawn::BELOW_FACET {
            status(vertices)[lane] = spawn::NONE;
            if let Some((start, way)) =
                terminator_start(context.world, &vertices.interaction(lane), vertices.facing_normal(lane))
            {
                rays.set(lanes.len(), &way);
                lanes.push(lane as u8);
                starts.push(start);
            }
        }
    }
    if lanes.is_empty() {
        return 0;
    }
    let mut occluded = [false; BATCH];
    let rays = AnyHitRays::new(rays, lanes.len());
    context.world.accel.occluded_rows(rays, &mut occluded, Coherence::Incoherent);
    for ((&lane, start), _) in lanes.iter().zip(starts.iter()).zip(&occluded).filter(|(_, occluded)| !**occluded) {
        respawn(vertices, usize::from(lane), start);
        status(vertices)[usize::from(lane)] = spawn::SPAWNED;
    }
    lanes.len() as u64
}

/// Sets the shadow ray of a vertex.
pub(super) fn set_shadow_ray(vertices: &mut Vertices, lane: usize, ray: &Ray) {
    vertices.direct.shadow_origin.set(lane, ray.origin);
    vertices.direct.shadow_direction.set(lane, ray.direction);
    vertices.direct.shadow_end[lane] = ray.t_max;
}
