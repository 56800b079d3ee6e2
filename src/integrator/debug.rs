//! Views of a scene without light transport, and ambient occlusion.

use super::parts::add_undivided;
use super::surface::surface_sample;
use super::{CameraBatch, CameraSample, Integrator, RayCounts, SurfaceNeeds, World, dimensions};
use crate::accel::Coherence;
use crate::color::Rgb;
use crate::film::{PartNeeds, PixelSample, SampleBatch};
use crate::geometry::SurfaceInteraction;
use crate::math::{Frame, Ray, Vec3};
use crate::sampling::{Sampler, warp};

/// What a [`DebugView`] shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The geometric normal, `(n + 1) / 2`.
    Normal,
    /// The shading normal, `(n + 1) / 2`.
    ShadingNormal,
    /// Surface parameters as red and green.
    Uv,
    /// Depth along the view axis.
    Depth,
    /// A colour for each primitive.
    PrimitiveId,
}

impl View {
    fn color(self, world: &World, at: &SurfaceInteraction) -> Rgb {
        let from_normal = |n: Vec3| Rgb::new(0.5 * n.x + 0.5, 0.5 * n.y + 0.5, 0.5 * n.z + 0.5);
        match self {
            Self::Normal => from_normal(at.n_g),
            Self::ShadingNormal => from_normal(at.n_s),
            Self::Uv => Rgb::new(at.uv.x, at.uv.y, 0.0),
            Self::Depth => Rgb::splat(world.scene.camera.depth(at.p, at.time)),
            Self::PrimitiveId => {
                let (instance, shape, prim) = at.ids();
                color_of(instance.0 ^ shape.0.wrapping_mul(0x9e37_79b9) ^ prim.0.wrapping_mul(0x85eb_ca6b))
            }
        }
    }
}

/// A bright colour that differs between neighbouring ids.
fn color_of(id: u32) -> Rgb {
    let mut h = id.wrapping_add(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    let channel = |shift: u32| 0.1 + 0.9 * ((h >> shift) & 0xff) as f32 / 255.0;
    Rgb::new(channel(0), channel(8), channel(16))
}

/// Shows one property of the first surface.
pub struct DebugView {
    /// What to show.
    pub view: View,
    /// What the layers need.
    pub needs: SurfaceNeeds,
    /// Which parts of the radiance layers need.
    pub parts: PartNeeds,
}

impl Integrator for DebugView {
    fn render_batch(&self, world: &World, samples: &CameraBatch, out: &mut SampleBatch, counts: &mut RayCounts) {
        for_each_first_surface(world, samples, (self.needs, self.parts), out, counts, |_, _, at| self.view.color(world, at));
    }
}

/// The fraction of a cosine-weighted hemisphere from which nothing blocks the light.
pub struct AmbientOcclusion {
    /// Only what is nearer counts, in world units.
    pub distance: f32,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// What the layers need.
    pub needs: SurfaceNeeds,
    /// Which parts of the radiance layers need.
    pub parts: PartNeeds,
}

impl Integrator for AmbientOcclusion {
    fn render_batch(&self, world: &World, samples: &CameraBatch, out: &mut SampleBatch, counts: &mut RayCounts) {
        let mut shadow_rays = 0;
        let distance = (f64::from(self.distance) * world.scene.camera.render_space().scale()) as f32;
        for_each_first_surface(world, samples, (self.needs, self.parts), out, counts, |sample, ray, at| {
            let u = self.sampler.sample_4d(sample.seed, sample.sample, dimensions::bsdf(0));
            let side = if at.n_g.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
            let direction = Frame::from_normal(at.n_s * side).to_world(warp::cosine_hemisphere([u[1], u[2]]));
            // Below the surface is its own inside.
            let above = direction.dot(at.n_g) * side > 0.0;
            shadow_rays += u64::from(above);
            let free = above && !world.accel.occluded(&Ray { t_max: distance, ..at.spawn(direction) });
            Rgb::splat(f32::from(u8::from(free)))
        });
        counts.shadow += shadow_rays;
    }
}

/// Traces all camera rays side by side and fills `out` from `shade`, with nothing where a ray leaves the scene.
fn for_each_first_surface(
    world: &World,
    samples: &CameraBatch,
    (needs, parts): (SurfaceNeeds, PartNeeds),
    out: &mut SampleBatch,
    counts: &mut RayCounts,
    mut shade: impl FnMut(&CameraSample, &Ray, &SurfaceInteraction) -> Rgb,
) {
    let rays: Vec<Ray> = samples.iter().map(|sample| sample.ray).collect();
    let mut hits = vec![None; rays.len()];
    world.accel.intersect_batch(&rays, &mut hits, Coherence::Coherent);
    counts.camera += rays.len() as u64;
    let wants_surface = needs != SurfaceNeeds::default();
    out.reset(samples.len(), wants_surface, parts);
    for (i, ((sample, ray), hit)) in samples.iter().zip(&rays).zip(hits).enumerate() {
        let sample = &sample;
        let Some(at) = world.resolve(ray, hit) else {
            if needs.motion {
                out.surfaces[i].motion = world.motion_at_infinity(ray.direction).to_array();
            }
            continue;
        };
        let radiance = shade(sample, ray, &at);
        out.pixels[i] = PixelSample { radiance, alpha: 1.0 };
        add_undivided(parts, out.parts_mut(i), radiance);
        if wants_surface {
            out.surfaces[i] = surface_sample(world, needs, &at, (ray, hit.as_ref()), || world.scene.texture_point(&at));
        }
    }
}
