//! Whitted's ray tracing: mirror reflection, refraction, direct light of every light and an ambient term ("An Improved
//! Illumination Model for Shaded Display").

use std::borrow::Cow;

use super::light_events::{LightEvent, LobeWeights, add_by_group, add_by_scattering, group_of};
use super::media::MediaState;
use super::surface::{FirstSurface, surface_sample};
use super::vertex::Vertex;
use super::{CameraBatch, CameraSample, Integrator, PassContext, RayCounts, SurfaceAovs, Workspace, World, dimensions};
use crate::bsdf::{Bsdf, BsdfSample};
use crate::color::Rgb;
use crate::film::{LightAovRequest, LightAovRows, PixelSample, SurfaceSample};
use crate::geometry::{Hit, SurfaceInteraction};
use crate::id::LightId;
use crate::light::MisCompensation;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Ray, RayCone, Vec3};
use crate::medium::MediumStack;
use crate::sampling::Sampler;
use crate::texture::Footprint;

/// Whitted's ray tracing. At every surface each light is sampled once, with a direction of its own for each camera
/// sample: the mean over the samples of a pixel is the direct illumination, with hard shadows of point lights and soft
/// ones of area lights and environments. Scattering that is neither mirror-like nor lit by a light contributes only
/// through the ambient term.
pub struct Whitted {
    /// Largest number of segments from the camera.
    pub max_depth: u32,
    /// Radiance of the ambient light.
    pub ambient: Rgb,
    /// Whether the camera does not see what emits light.
    pub hide_emitters: bool,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// What the layers need.
    pub surface_aovs: SurfaceAovs,
    /// Which parts of the radiance layers need.
    pub light_aovs: LightAovRequest,
}

impl Integrator for Whitted {
    fn render_batch(&self, pass: &PassContext, samples: &CameraBatch, workspace: &mut Workspace) {
        let (world, Workspace { out, counts, .. }) = (pass.world, workspace);
        counts.camera += samples.len() as u64;
        let needs_surface = self.surface_aovs != SurfaceAovs::default();
        out.reset(samples.len(), needs_surface, self.light_aovs);
        for (i, sample) in samples.iter().enumerate() {
            let sample = &sample;
            let in_media = world.scene.features.media;
            let current = if in_media { world.media_at_start(&sample.ray) } else { MediumStack::default() };
            let mut ray = sample.ray;
            if world.skips_emitters(self.hide_emitters) {
                let hit = world.accel.intersect(&ray);
                counts.camera += 1 + world.skip_emitters(&mut ray, hit, self.hide_emitters).1;
            }
            let segment = Segment::trace(world, ray, pass.render.camera_cone(&ray), current, counts);
            if needs_surface {
                out.surfaces[i] = match &segment.end {
                    Some(at) => {
                        let first = FirstSurface { ray: &segment.ray, hit: segment.hit.as_ref(), at };
                        surface_sample(pass, self.surface_aovs, first, || segment.footprint(world, at))
                    }
                    None if self.surface_aovs.motion => SurfaceSample {
                        motion: pass.render.motion_at_infinity(segment.ray.direction).to_array(),
                        ..SurfaceSample::default()
                    },
                    None => SurfaceSample::default(),
                };
            }
            let mut tally = Tally { light_aovs: &mut out.light_aovs, index: i, rays: counts, sample, light_samples: 0 };
            let view = View { depth: 1, throughput: segment.transmittance, lobes: None };
            out.pixels[i] = match &segment.end {
                Some(at) => PixelSample {
                    radiance: self.shade(pass, &segment, at, view, &mut tally) * segment.transmittance,
                    alpha: 1.0,
                },
                None if self.hide_emitters || !pass.render.shows_background => PixelSample::default(),
                None => PixelSample {
                    radiance: segment.environment_radiance(world, View { throughput: Rgb::WHITE, ..view }, &mut tally),
                    alpha: pass.render.background_alpha(),
                },
            };
        }
    }
}

/// A segment of a path as the camera sees it.
#[derive(Clone, Copy)]
struct View {
    /// Its number.
    depth: u32,
    /// What is left at the camera of the light that leaves its end.
    throughput: Rgb,
    /// How light left the first surface, if this is behind it.
    lobes: Option<LobeWeights>,
}

impl View {
    /// How light came that comes along the segment, after `scatterings` at its end.
    fn event(self, scatterings: u32, straight: LightEvent) -> LightEvent {
        match (self.lobes, self.depth - 1 + scatterings) {
            (Some(lobes), 1) => LightEvent::Direct(lobes),
            (Some(lobes), _) => LightEvent::Indirect(lobes),
            (None, _) => straight,
        }
    }
}

/// A camera sample, and what is counted of it beside its radiance.
struct Tally<'a> {
    light_aovs: &'a mut LightAovRows,
    /// Index of the sample in its batch.
    index: usize,
    rays: &'a mut RayCounts,
    sample: &'a CameraSample,
    /// How many times a light was sampled.
    light_samples: u32,
}

impl Tally<'_> {
    fn needs_light_aovs(&self) -> bool {
        self.light_aovs.request().count() > 0
    }

    /// Adds light at the camera; that of no light is in the last group.
    fn add(&mut self, world: &World, light: Rgb, event: LightEvent, source: Option<LightId>) {
        add_by_scattering(self.light_aovs, self.index, light, event);
        let last = self.light_aovs.request().light_groups.saturating_sub(1) as usize;
        add_by_group(self.light_aovs, self.index, light, source.map_or(last, |id| group_of(world.scene, id)));
    }
}

/// A ray with what it meets.
struct Segment {
    /// From the last surface that it passed, if media lie on its way.
    ray: Ray,
    /// Around the ray, where textures are filtered.
    cone: Option<RayCone>,
    hit: Option<Hit>,
    end: Option<SurfaceInteraction>,
    /// The media that contain its end.
    media: MediaState,
    /// What is left of light on the way.
    transmittance: Rgb,
}

impl Segment {
    /// Traces a ray that starts within the media `current`.
    fn trace(world: &World, mut ray: Ray, cone: Option<RayCone>, current: MediumStack, counts: &mut RayCounts) -> Self {
        let mut media = MediaState { current, ..MediaState::default() };
        let hit = world.accel.intersect(&ray);
        if !world.scene.features.media {
            return Self { ray, cone, hit, end: world.resolve(&ray, hit), media, transmittance: Rgb::WHITE };
        }
        let start = ray.origin;
        let segment = world.trace_through_null_boundaries(&mut ray, hit, &mut media);
        counts.indirect += u64::from(segment.passed);
        media.ior = segment.ior.map(|ior| ior.of(None));
        let cone = cone.map(|cone| cone.moved((ray.origin - start).length()));
        let hit = segment.hit;
        Self { ray, cone, hit, end: world.resolve(&ray, hit), media, transmittance: segment.transmittance }
    }

    /// The footprint of the ray on the surface at its end.
    fn footprint<'a>(&self, world: &'a World, at: &SurfaceInteraction) -> Footprint<'a> {
        world.footprint(self.cone.as_ref(), &self.ray, self.hit.as_ref(), at)
    }

    /// The surface at its end, with the scattering of the boundary between media if it is one.
    #[inline]
    fn vertex<'a>(&self, world: &'a World, at: &'a SurfaceInteraction) -> Vertex<'a> {
        let boundary = world.boundary_bsdf(at, self.ray.direction, &self.media);
        let mut vertex = Vertex::new(world, at, &self.ray, || self.footprint(world, at));
        if let Some(boundary) = boundary {
            vertex.bsdf = Cow::Owned(boundary);
        }
        if let Bsdf::Principled(bsdf) = &*vertex.bsdf
            && bsdf.has_walk()
        {
            vertex.bsdf = Cow::Owned(Bsdf::Principled(bsdf.without_walk()));
        }
        vertex
    }

    /// What arrives from infinity.
    fn environment_radiance(&self, world: &World, view: View, tally: &mut Tally) -> Rgb {
        if tally.needs_light_aovs() {
            for &id in world.scene.lights.at_infinity() {
                let light = world.scene.lights.get(id).eval_infinite(self.ray.direction, MisCompensation::Off).radiance;
                let event = view.event(0, LightEvent::Environment);
                tally.add(world, view.throughput * light * self.transmittance, event, Some(id));
            }
        }
        world.radiance_at_infinity(self.ray.direction) * self.transmittance
    }
}

/// Reflection and refraction: random numbers at either end of [0, 1) choose them.
#[inline]
fn delta_lobes(vertex: &Vertex) -> [Option<BsdfSample>; 2] {
    let lobe = |u: f32| vertex.bsdf.sample(vertex.wo, u, [0.5; 2]).filter(|s| s.is_delta);
    let first = lobe(0.0);
    let second = lobe(ONE_MINUS_EPSILON).filter(|s| Some(s.wi) != first.map(|f| f.wi));
    [first, second]
}

impl Whitted {
    /// Radiance leaving `at`, the end of the segment, against that.
    fn shade(
        &self,
        pass: &PassContext,
        segment: &Segment,
        at: &SurfaceInteraction,
        view: View,
        tally: &mut Tally,
    ) -> Rgb {
        let (world, Segment { ray, cone, media, .. }) = (pass.world, segment);
        let mut radiance = world.emitted(at, -ray.direction);
        if tally.needs_light_aovs() {
            let source = world.scene.surface(at.shape).light(at.prim);
            tally.add(world, view.throughput * radiance, view.event(0, LightEvent::Emission), source);
        }
        if view.depth >= self.max_depth || pass.render.is_cancel_due() {
            return radiance;
        }
        let vertex = segment.vertex(world, at);
        if !vertex.bsdf.flags().is_delta() {
            let ambient = self.ambient * vertex.bsdf.albedo(vertex.wo);
            radiance += ambient;
            if tally.needs_light_aovs() {
                let event = view.event(2, LightEvent::Indirect(LobeWeights::DIFFUSE));
                tally.add(world, view.throughput * ambient, event, None);
            }
            for id in (0..world.scene.lights.lights().len()).map(LightId::new) {
                let Some((light, wi)) = self.direct_light(world, segment, &vertex, id, tally) else { continue };
                radiance += light;
                if tally.needs_light_aovs() {
                    let lobes = LobeWeights::between(&vertex.bsdf, vertex.wo, vertex.frame.to_local(wi));
                    tally.add(world, view.throughput * light, view.event(1, LightEvent::Direct(lobes)), Some(id));
                }
            }
        }

        // Both delta lobes, each without the division by its probability.
        for lobe in delta_lobes(&vertex).into_iter().flatten() {
            let direction = vertex.frame.to_world(lobe.wi);
            if vertex.shadowing(lobe.wi, direction) == 0.0 {
                continue;
            }
            tally.rays.indirect += 1;
            let current = world.media_toward(at, ray.direction, direction, &media.current);
            let next =
                Segment::trace(world, at.spawn(direction), cone.map(|cone| cone.moved(at.t)), current, tally.rays);
            let lobes = view.lobes.unwrap_or_else(|| LobeWeights::of_sample(&vertex.bsdf, vertex.wo, &lobe));
            let throughput = view.throughput * lobe.weight * lobe.pdf;
            let behind = View { depth: view.depth + 1, throughput, lobes: Some(lobes) };
            let arriving = match &next.end {
                Some(end) => {
                    let behind = View { throughput: behind.throughput * next.transmittance, ..behind };
                    self.shade(pass, &next, end, behind, tally) * next.transmittance
                }
                None => next.environment_radiance(world, behind, tally),
            };
            radiance += arriving * lobe.weight * lobe.pdf;
        }
        radiance
    }

    /// Light that arrives from one light along a sampled direction and is scattered back, with that direction.
    fn direct_light(
        &self,
        world: &World,
        segment: &Segment,
        vertex: &Vertex,
        id: LightId,
        tally: &mut Tally,
    ) -> Option<(Rgb, Vec3)> {
        let set = dimensions::light(0).wrapping_add(tally.light_samples);
        tally.light_samples = tally.light_samples.wrapping_add(1);
        let [u, v, ..] = self.sampler.sample_4d(tally.sample.seed, tally.sample.sample, set);
        let (at, light) = (vertex.at, world.scene.lights.get(id));
        let sample = light.sample(
            &world.scene.geometry,
            &world.scene.textures,
            &vertex.light_context(),
            [u, v],
            MisCompensation::Off,
        )?;
        let (eval, start) = vertex.eval_toward(world, sample.wi)?;
        let scattered = eval.value * sample.radiance / sample.pdf;
        if scattered.is_black() {
            return None;
        }
        tally.rays.shadow += 1;
        let shadow = sample.shadow_ray(&start);
        if world.accel.occluded(&shadow) {
            return None;
        }
        let current = world.media_toward(at, segment.ray.direction, shadow.direction, &segment.media.current);
        Some((scattered * world.transmittance(&current, &shadow), sample.wi))
    }
}
