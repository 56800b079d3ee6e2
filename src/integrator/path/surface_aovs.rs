//! AOVs of surfaces: of the first one, and for denoisers of the first that is no mirror and no clear glass.

use super::Context;
use super::block::Vertices;
use super::radiance::Output;
use super::wave::Wave;
use crate::color::Rgb;
use crate::film::SurfaceSample;
use crate::geometry::SurfaceInteraction;
use crate::id::MediumId;
use crate::integrator::surface::{geometry_aovs, medium_aovs, set_features};
use crate::math::rows::BATCH;
use crate::math::{Frame, Vec3};

/// Writes the AOVs of a block's vertices.
pub(super) fn write(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    if context.bounce == 0 {
        for lane in (0..wave.vertices.count.min(BATCH)).filter(|&lane| !wave.vertices.is_miss(lane)) {
            let slot = wave.paths[block].slot[wave.vertices.path(lane)];
            out.batch.pixels[slot as usize].alpha = 1.0;
        }
    }
    if context.needs_surface_aovs() {
        write_surfaces(context, wave, block, out);
    }
}

#[inline(never)]
fn write_surfaces(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let Wave { vertices, paths, hits, light_aovs, .. } = &*wave;
    let surface_aovs = context.config.surface_aovs;
    for lane in (0..vertices.count).filter(|&lane| !vertices.is_miss(lane)) {
        let i = vertices.path(lane);
        let features = light_aovs.feature_throughput(block * BATCH + i);
        if context.bounce > 0 && features.is_none() {
            continue;
        }
        let at = vertices.interaction(lane);
        let surface = &mut out.batch.surfaces[paths[block].slot[i] as usize];
        if vertices.is_medium(lane) {
            set_medium(context, surface, &at, features);
            continue;
        }
        if context.bounce == 0 {
            *surface = geometry_aovs(context.pass, surface_aovs, &at, hits[block].get(i).as_ref());
        }
        if features.is_some() || surface_aovs.albedo {
            let albedo = albedo(context, vertices, lane, &at);
            if context.bounce == 0 {
                surface.albedo = albedo;
            }
            if let Some(throughput) = features {
                set_features(surface, throughput, albedo, at.n_s);
            }
        }
    }
}

/// Sets the AOVs of a point where a medium scatters: it has no normal, no shape and no parameters.
fn set_medium(context: &Context, surface: &mut SurfaceSample, at: &SurfaceInteraction, features: Option<Rgb>) {
    let albedo = context.scene.media.albedo(MediumId(at.shape.0), at.p);
    if context.bounce == 0 {
        *surface = medium_aovs(context.pass, context.config.surface_aovs, at);
        surface.albedo = albedo;
    }
    if let Some(throughput) = features {
        set_features(surface, throughput, albedo, Vec3::ZERO);
    }
}

fn albedo(context: &Context, vertices: &Vertices, lane: usize, at: &SurfaceInteraction) -> Rgb {
    match vertices.bsdfs.get(context.scene, lane) {
        None => vertices.albedo(lane),
        Some(bsdf) => bsdf.albedo(Frame::from_normal(at.n_s).to_local(-vertices.rows.direction.get(lane))),
    }
}

/// Writes the AOVs of a sample whose path leaves the scene: to denoisers, the radiance of what is there, as far as it
/// is not brighter than white.
#[inline(never)]
pub(super) fn write_miss(
    context: &Context,
    features: Option<Rgb>,
    direction: Vec3,
    radiance: Rgb,
    surface: &mut SurfaceSample,
) {
    if context.bounce == 0 && context.config.surface_aovs.motion {
        surface.motion = context.pass.render.motion_at_infinity(direction).to_array();
    }
    if let Some(throughput) = features {
        set_features(surface, throughput, radiance.map(|value| value.min(1.0)), Vec3::ZERO);
    }
}
