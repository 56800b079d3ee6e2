//! Whitted's ray tracing: mirror reflection, refraction, hard shadows and an ambient term ("An Improved Illumination Model for Shaded
//! Display").

use super::path::Vertex;
use super::{CameraSample, Integrator, RayCounts, SurfaceNeeds, World, surface_sample};
use crate::color::Rgb;
use crate::film::PixelSample;
use crate::geometry::SurfaceInteraction;
use crate::light::{Light, ShadowTarget};
use crate::math::Ray;
use crate::math::float::ONE_MINUS_EPSILON;

/// Whitted's ray tracing. Area lights shine from their middle, so shadows are hard; scattering that is neither mirror-like nor lit by a
/// light contributes only through the ambient term.
pub struct Whitted {
    /// Largest number of segments from the camera.
    pub max_depth: u32,
    /// Radiance of the ambient light.
    pub ambient: Rgb,
    /// What the layers need.
    pub needs: SurfaceNeeds,
}

impl Integrator for Whitted {
    fn render_batch(&self, world: &World, samples: &[CameraSample], out: &mut [PixelSample], counts: &mut RayCounts) {
        counts.camera += samples.len() as u64;
        for (sample, out) in samples.iter().zip(out) {
            *out = match world.closest(&sample.ray) {
                Some(at) => PixelSample {
                    radiance: self.shade(world, &sample.ray, &at, 1, counts),
                    alpha: 1.0,
                    surface: surface_sample(world, self.needs, &at, sample.ray.direction),
                },
                None => PixelSample { radiance: world.radiance_at_infinity(sample.ray.direction), ..PixelSample::default() },
            };
        }
    }
}

impl Whitted {
    /// Radiance leaving `at` against `ray`, which is the segment number `depth` of its path.
    fn shade(&self, world: &World, ray: &Ray, at: &SurfaceInteraction, depth: u32, counts: &mut RayCounts) -> Rgb {
        let mut radiance = world.emitted(at, -ray.direction);
        if depth >= self.max_depth {
            return radiance;
        }
        let mut bsdf = None;
        let vertex = Vertex::new(world, at, ray, &mut bsdf);
        if !vertex.bsdf.is_delta() {
            radiance += self.ambient * vertex.bsdf.albedo(vertex.wo);
            for light in world.scene.lights.lights() {
                radiance += direct_light(world, &vertex, light, counts);
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
            let next = at.spawn(direction);
            counts.indirect += 1;
            let arriving = match world.closest(&next) {
                Some(hit) => self.shade(world, &next, &hit, depth + 1, counts),
                None => world.radiance_at_infinity(next.direction),
            };
            radiance += arriving * lobe.weight * lobe.pdf;
        }
        radiance
    }
}

/// Light that arrives from the middle of one light and is scattered back.
fn direct_light(world: &World, vertex: &Vertex, light: &Light, counts: &mut RayCounts) -> Rgb {
    let at = vertex.at;
    let Some(sample) = light.sample(&world.scene.geometry, &world.scene.textures, at.p, [0.5; 2]) else {
        return Rgb::BLACK;
    };
    let Some(eval) = vertex.eval(sample.wi) else {
        return Rgb::BLACK;
    };
    let scattered = eval.value * sample.radiance / sample.pdf;
    if scattered.is_black() {
        return scattered;
    }
    counts.shadow += 1;
    let shadow = match &sample.target {
        ShadowTarget::Point(target) => at.spawn_to(target),
        ShadowTarget::Infinity => at.spawn(sample.wi),
    };
    if world.accel.occluded(&shadow) { Rgb::BLACK } else { scattered }
}
