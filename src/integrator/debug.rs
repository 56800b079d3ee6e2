//! Views of a scene without light transport, and ambient occlusion.

use super::light_events::add_emission;
use super::surface::{FirstSurface, surface_sample};
use super::{CameraBatch, CameraSample, Integrator, PassContext, SurfaceAovs, Workspace, World, dimensions};
use crate::accel::Coherence;
use crate::color::Rgb;
use crate::film::{LightAovRequest, PixelSample};
use crate::geometry::SurfaceInteraction;
use crate::math::random::mix_32;
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
    let h = mix_32(id);
    let channel = |shift: u32| 0.1 + 0.9 * ((h >> shift) & 0xff) as f32 / 255.0;
    Rgb::new(channel(0), channel(8), channel(16))
}

/// Shows one property of the first surface.
pub struct DebugView {
    /// What to show.
    pub view: View,
    /// What the layers need.
    pub surface_aovs: SurfaceAovs,
    /// Which parts of the radiance layers need.
    pub light_aovs: LightAovRequest,
}

impl Integrator for DebugView {
    fn render_batch(&self, pass: &PassContext, samples: &CameraBatch, workspace: &mut Workspace) {
        let request = AovRequest { surface: self.surface_aovs, light: self.light_aovs };
        let shade = |_: &CameraSample, _: &Ray, at: &SurfaceInteraction| self.view.color(pass.world, at);
        for_each_first_surface(pass, samples, request, workspace, shade);
    }
}

/// The fraction of a cosine-weighted hemisphere from which nothing blocks the light.
pub struct AmbientOcclusion {
    /// Only what is nearer counts, in world units.
    pub distance: f32,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// What the layers need.
    pub surface_aovs: SurfaceAovs,
    /// Which parts of the radiance layers need.
    pub light_aovs: LightAovRequest,
}

impl Integrator for AmbientOcclusion {
    fn render_batch(&self, pass: &PassContext, samples: &CameraBatch, workspace: &mut Workspace) {
        let world = pass.world;
        let mut shadow_rays = 0;
        let distance = (f64::from(self.distance) * world.scene.camera.render_space().scale()) as f32;
        let request = AovRequest { surface: self.surface_aovs, light: self.light_aovs };
        for_each_first_surface(pass, samples, request, workspace, |sample, ray, at| {
            let u = self.sampler.sample_4d(sample.seed, sample.sample, dimensions::bsdf(0));
            let side = if at.n_g.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
            let direction = Frame::from_normal(at.n_s * side).to_world(warp::cosine_hemisphere([u[1], u[2]]));
            // Below the surface is its own inside.
            let above = direction.dot(at.n_g) * side > 0.0;
            shadow_rays += u64::from(above);
            let free = above && !world.accel.occluded(&Ray { t_max: distance, ..at.spawn(direction) });
            Rgb::splat(f32::from(u8::from(free)))
        });
        workspace.counts.shadow += shadow_rays;
    }
}

/// What layers need beside the radiance of pixels.
#[derive(Clone, Copy)]
struct AovRequest {
    surface: SurfaceAovs,
    light: LightAovRequest,
}

/// Traces all camera rays of a batch and sets its values from `shade`, with nothing where a ray leaves the scene.
fn for_each_first_surface(
    pass: &PassContext,
    samples: &CameraBatch,
    AovRequest { surface: surface_aovs, light: light_aovs }: AovRequest,
    Workspace { out, counts, .. }: &mut Workspace,
    mut shade: impl FnMut(&CameraSample, &Ray, &SurfaceInteraction) -> Rgb,
) {
    let world = pass.world;
    let rays: Vec<Ray> = samples.iter().map(|sample| sample.ray).collect();
    let mut hits = vec![None; rays.len()];
    world.accel.intersect_batch(&rays, &mut hits, Coherence::Coherent);
    counts.camera += rays.len() as u64;
    let needs_surface = surface_aovs != SurfaceAovs::default();
    out.reset(samples.len(), needs_surface, light_aovs);
    for (i, ((sample, ray), hit)) in samples.iter().zip(&rays).zip(hits).enumerate() {
        let sample = &sample;
        let Some(at) = world.resolve(ray, hit) else {
            if surface_aovs.motion {
                out.surfaces[i].motion = pass.render.motion_at_infinity(ray.direction).to_array();
            }
            continue;
        };
        let radiance = shade(sample, ray, &at);
        out.pixels[i] = PixelSample { radiance, alpha: 1.0 };
        add_emission(&mut out.light_aovs, i, radiance);
        if needs_surface {
            out.surfaces[i] =
                surface_sample(pass, surface_aovs, FirstSurface { ray, hit: hit.as_ref(), at: &at }, || {
                    world.scene.texture_point(&at)
                });
        }
    }
}
