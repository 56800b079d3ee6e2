//! Whitted's ray tracing: mirror reflection, refraction, hard shadows and an ambient term ("An Improved Illumination Model for Shaded
//! Display").

use super::media::MediaState;
use super::vertex::Vertex;
use super::{CameraSample, Integrator, RayCounts, SurfaceNeeds, World, surface_sample};
use crate::color::Rgb;
use crate::film::{PartNeeds, PixelSample, SampleBatch};
use crate::geometry::{Hit, SurfaceInteraction};
use crate::light::{FoundBy, Light};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Ray, RayCone};
use crate::medium::Interior;
use crate::texture::Footprint;

/// Whitted's ray tracing. Area lights shine from their middle, so shadows are hard; scattering that is neither mirror-like nor lit by a
/// light contributes only through the ambient term.
pub struct Whitted {
    /// Largest number of segments from the camera.
    pub max_depth: u32,
    /// Radiance of the ambient light.
    pub ambient: Rgb,
    /// Whether the camera does not see what gives off light.
    pub hide_emitters: bool,
    /// What the layers need.
    pub needs: SurfaceNeeds,
    /// Which parts of the radiance layers need.
    pub parts: PartNeeds,
}

impl Integrator for Whitted {
    fn render_batch(&self, world: &World, samples: &[CameraSample], out: &mut SampleBatch, counts: &mut RayCounts) {
        counts.camera += samples.len() as u64;
        let wants_surface = self.needs != SurfaceNeeds::default();
        out.reset(samples.len(), wants_surface, self.parts);
        for (i, sample) in samples.iter().enumerate() {
            let in_media = world.scene.features.media;
            let here = if in_media { world.media_at_start(&sample.ray) } else { Interior::default() };
            let mut ray = sample.ray;
            if self.hide_emitters {
                let mut hit = world.accel.intersect(&ray);
                counts.camera += 1 + world.pass_emitters(&mut ray, &mut hit);
            }
            let segment = Segment::trace(world, ray, world.camera_cone(&ray), here, counts);
            out.pixels[i] = match &segment.end {
                Some(at) => {
                    if wants_surface {
                        out.surfaces[i] = surface_sample(world, self.needs, at, segment.ray.direction, || segment.footprint(world, at));
                    }
                    PixelSample { radiance: self.shade(world, &segment, at, 1, counts) * segment.transmittance, alpha: 1.0 }
                }
                None if self.hide_emitters => PixelSample::default(),
                None => PixelSample { radiance: segment.escaped(world), alpha: 0.0 },
            };
        }
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
    /// Traces a ray that starts within the media `here`.
    fn trace(world: &World, mut ray: Ray, cone: Option<RayCone>, here: Interior, counts: &mut RayCounts) -> Self {
        let mut media = MediaState { here, ..MediaState::default() };
        let hit = world.accel.intersect(&ray);
        if !world.scene.features.media {
            return Self { ray, cone, hit, end: world.resolve(&ray, hit), media, transmittance: Rgb::WHITE };
        }
        let start = ray.origin;
        let arrival = world.arrive(&mut ray, hit, &mut media);
        counts.indirect += u64::from(arrival.passed);
        media.ior = arrival.ior.map(|ior| ior.of(None));
        let cone = cone.map(|cone| cone.moved((ray.origin - start).length()));
        let hit = arrival.hit;
        Self { ray, cone, hit, end: world.resolve(&ray, hit), media, transmittance: arrival.transmittance }
    }

    /// What the ray stands for on the surface at its end.
    fn footprint(&self, world: &World, at: &SurfaceInteraction) -> Footprint {
        world.footprint(self.cone.as_ref(), &self.ray, self.hit.as_ref(), at)
    }

    /// What arrives from infinity.
    fn escaped(&self, world: &World) -> Rgb {
        world.radiance_at_infinity(self.ray.direction) * self.transmittance
    }
}

impl Whitted {
    /// Radiance leaving `at`, the end of the segment number `depth` of its path, against that.
    fn shade(&self, world: &World, segment: &Segment, at: &SurfaceInteraction, depth: u32, counts: &mut RayCounts) -> Rgb {
        let Segment { ray, cone, media, .. } = segment;
        let mut radiance = world.emitted(at, -ray.direction);
        if depth >= self.max_depth {
            return radiance;
        }
        let mut bsdf = None;
        let boundary = world.boundary_bsdf(at, ray.direction, media);
        let mut vertex = Vertex::new(world, at, ray, || segment.footprint(world, at), &mut bsdf);
        if let Some(boundary) = &boundary {
            vertex.bsdf = boundary;
        }
        if !vertex.bsdf.is_delta() {
            radiance += self.ambient * vertex.bsdf.albedo(vertex.wo);
            for light in world.scene.lights.lights() {
                radiance += direct_light(world, segment, &vertex, light, counts);
            }
        }

        // Both delta lobes, each without the division by its probability: u at either end of [0, 1) chooses reflection and refraction.
        let lobe = |u: f32| vertex.bsdf.sample(vertex.wo, u, [0.5; 2]).filter(|s| s.is_delta);
        let first = lobe(0.0);
        let second = lobe(ONE_MINUS_EPSILON).filter(|s| Some(s.wi) != first.map(|f| f.wi));
        for lobe in [first, second].into_iter().flatten() {
            let direction = vertex.frame.to_world(lobe.wi);
            if vertex.shadowing(lobe.wi, direction) == 0.0 {
                continue;
            }
            counts.indirect += 1;
            let here = world.media_toward(at, ray.direction, direction, &media.here);
            let next = Segment::trace(world, at.spawn(direction), cone.map(|cone| cone.moved(at.t)), here, counts);
            let arriving = match &next.end {
                Some(end) => self.shade(world, &next, end, depth + 1, counts) * next.transmittance,
                None => next.escaped(world),
            };
            radiance += arriving * lobe.weight * lobe.pdf;
        }
        radiance
    }
}

/// Light that arrives from the middle of one light and is scattered back.
fn direct_light(world: &World, segment: &Segment, vertex: &Vertex, light: &Light, counts: &mut RayCounts) -> Rgb {
    let at = vertex.at;
    let Some(sample) = light.sample(&world.scene.geometry, &world.scene.textures, at.p, [0.5; 2], FoundBy::Lights) else {
        return Rgb::BLACK;
    };
    let mut raised = None;
    let Some((eval, start)) = vertex.eval_toward(world, sample.wi, &mut raised) else {
        return Rgb::BLACK;
    };
    let scattered = eval.value * sample.radiance / sample.pdf;
    if scattered.is_black() {
        return scattered;
    }
    counts.shadow += 1;
    let shadow = sample.shadow_ray(start);
    if world.accel.occluded(&shadow) {
        return Rgb::BLACK;
    }
    let here = world.media_toward(at, segment.ray.direction, shadow.direction, &segment.media.here);
    scattered * world.transmittance(&here, &shadow)
}
