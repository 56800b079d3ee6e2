//! Closest hits of all paths, and what shadow rays add.

use super::Context;
use super::radiance::Output;
use super::wave::Wave;
use crate::accel::{AnyHitRays, Coherence};
use crate::integrator::RayCounts;
use crate::math::rows::BATCH;

/// Finds the closest hits of all rays.
pub(super) fn closest(context: &Context, wave: &mut Wave, counts: &mut RayCounts) {
    let is_camera = context.bounce == 0 && wave.light_paths.is_empty();
    *(if is_camera { &mut counts.camera } else { &mut counts.indirect }) += wave.count as u64;
    let coherence = if is_camera { Coherence::Coherent } else { Coherence::Incoherent };
    for block in 0..wave.blocks() {
        let count = wave.block_len(block);
        let (rays, hits) = (&mut wave.rays[block], &mut wave.hits[block]);
        context.world.accel.intersect_rows(rays, count, hits, coherence);
        if is_camera && context.world.skips_emitters(context.config.hide_emitters) {
            for lane in 0..count {
                let mut ray = rays.get(lane);
                let (hit, traced) = context.world.skip_emitters(&mut ray, hits.get(lane), context.config.hide_emitters);
                counts.camera += traced;
                rays.set(lane, &ray);
                hits.set(lane, hit);
            }
        }
    }
}

/// Traces the shadow rays of the wave and adds the light of those that nothing blocks.
pub(super) fn shadow(context: &Context, wave: &mut Wave, out: &mut Output, counts: &mut RayCounts) {
    let shadows = &mut wave.shadows;
    if !context.scene.features.participating_media {
        counts.shadow += shadows.count as u64;
    }
    let toward_one_place = context.bounce == 0 && !context.scene.features.environment && wave.connections.is_empty();
    let coherence = if toward_one_place { Coherence::Coherent } else { Coherence::Incoherent };
    let mut occluded = [false; BATCH];
    for (block, rays) in shadows.rays.iter().enumerate().take(shadows.count.div_ceil(BATCH)) {
        let first = block * BATCH;
        let count = BATCH.min(shadows.count - first);
        // In media they have been traced already.
        if !context.scene.features.participating_media {
            let rays = AnyHitRays { rays, count, end_shapes: shadows.end_shapes.get(block) };
            context.world.accel.occluded_rows(rays, &mut occluded, coherence);
        }
        let blocked = occluded[..count].iter().filter(|&&occluded| occluded).count();
        wave.continuations.count_unoccluded(count - blocked);
        for (i, _) in (first..).zip(&occluded[..count]).filter(|(_, occluded)| !**occluded) {
            let rows = &shadows.rows[block];
            let (slot, light) = (rows.slot[i % BATCH], rows.contribution.get(i % BATCH));
            out.add(slot, light);
            wave.moments.add_shadow_ray(i, slot, light);
            if wave.continuations.is_enabled() {
                wave.continuations.add_shadow_ray(i, &rays.get(i % BATCH), light);
            }
            if context.bounce == 0 {
                wave.continuations.add_direct(i, slot, light);
            }
            if let Some(&(event, id)) = wave.light_aovs.shadow_sources.get(i) {
                out.add_to_light_aovs(context, slot, light, event, id);
            }
        }
    }
    shadows.count = 0;
    wave.moments.ratios.clear();
    wave.moments.shadow_factors.clear();
    wave.light_aovs.shadow_sources.clear();
}
