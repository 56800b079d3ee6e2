//! Light from far away.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{InfiniteLightEval, LightSample, ShadowTarget};
use crate::color::Rgb;
use crate::math::{DVec3, Frame, Vec3, unit_circle};

/// Light that arrives from one direction, or from a cone of directions around it with the same radiance along each.
#[derive(Clone, Debug)]
pub struct DirectionalLight {
    irradiance: Rgb,
    /// Around the direction towards the light.
    frame: Frame,
    disk: Option<Disk>,
}

/// The cone of directions of a light with an angle.
#[derive(Clone, Copy, Debug)]
struct Disk {
    radiance: Rgb,
    /// `1 - cos` of the half-angle.
    one_minus_cos: f32,
    /// Square of the distance on the unit sphere between the axis and the cone's rim.
    chord_squared: f32,
    pdf: f32,
}

/// Half-angles below this many radians cannot be distinguished from zero with directions in `f32`.
const SMALLEST_HALF_ANGLE: f64 = 1e-6;

impl DirectionalLight {
    /// Light that travels along `direction` (any length but zero) and gives `irradiance` on a surface that faces it.
    /// `angular_diameter` is the full angle it subtends, in radians, from 0 to below pi.
    pub fn new(direction: DVec3, irradiance: Rgb, angular_diameter: f64) -> Self {
        let half_angle = (0.5 * angular_diameter).min(FRAC_PI_2);
        let disk = (half_angle > SMALLEST_HALF_ANGLE).then(|| {
            let one_minus_cos = 2.0 * (0.5 * half_angle).sin().powi(2);
            Disk {
                radiance: irradiance * (1.0 / (PI * half_angle.sin().powi(2))) as f32,
                one_minus_cos: one_minus_cos as f32,
                chord_squared: (2.0 * one_minus_cos) as f32,
                pdf: (1.0 / (TAU * one_minus_cos)) as f32,
            }
        });
        Self { irradiance, frame: Frame::from_normal(-direction.normalize_or_zero().as_vec3()), disk }
    }

    /// Whether the light comes from a single direction, which no ray finds by chance.
    pub fn is_delta(&self) -> bool {
        self.disk.is_none()
    }

    /// Unit direction to the light, or to the middle of its cone.
    pub fn axis(&self) -> Vec3 {
        self.frame.z
    }

    /// Irradiance on a surface that faces it.
    pub fn irradiance(&self) -> Rgb {
        self.irradiance
    }

    /// Light from a chosen direction, `u` in the unit square.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let target = ShadowTarget::Infinity;
        let Some(disk) = &self.disk else {
            return Some(LightSample { wi: self.frame.z, radiance: self.irradiance, pdf: 1.0, is_delta: true, target });
        };
        // Uniform by solid angle, without the cancellation of 1 - cos.
        let one_minus_cos = u[0] * disk.one_minus_cos;
        let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
        let around = unit_circle(u[1]);
        let wi = self.frame.to_world(Vec3::new(sin * around.x as f32, sin * around.y as f32, 1.0 - one_minus_cos));
        Some(LightSample { wi: wi.normalize(), radiance: disk.radiance, pdf: disk.pdf, is_delta: false, target })
    }

    /// Radiance arriving along the unit direction `wi` at a ray that leaves the scene, with the density of `sample`;
    /// zero for a delta.
    #[inline]
    pub fn eval(&self, wi: Vec3) -> InfiniteLightEval {
        match &self.disk {
            // A chord keeps its digits where the cosine of a small angle has none left.
            Some(disk) if (wi - self.frame.z).length_squared() <= disk.chord_squared => {
                InfiniteLightEval { radiance: disk.radiance, pdf: disk.pdf }
            }
            _ => InfiniteLightEval::default(),
        }
    }

    /// Power that falls on a scene of the given radius, as luminance.
    pub fn power(&self, scene_radius: f64) -> f64 {
        PI * scene_radius * scene_radius * f64::from(self.irradiance.luminance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sharp_light_is_a_delta() {
        let light = DirectionalLight::new(DVec3::new(0.0, -3.0, 0.0), Rgb::WHITE, 0.0);
        let s = light.sample([0.3, 0.7]).unwrap();
        assert!(light.is_delta() && s.is_delta && s.pdf == 1.0 && s.wi == Vec3::Y && s.radiance == Rgb::WHITE);
        assert_eq!(light.eval(Vec3::Y), InfiniteLightEval::default());
    }

    #[test]
    fn the_irradiance_does_not_depend_on_the_angle() {
        let direction = DVec3::new(0.3, -0.8, 0.2);
        for degrees in [0.01, 0.53, 10.0, 120.0] {
            let light = DirectionalLight::new(direction, Rgb::splat(2.0), f64::to_radians(degrees));
            let n = 256;
            let (mut irradiance, mut inside) = (0.0, 0);
            for i in 0..n * n {
                let s = light.sample([((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32]).unwrap();
                let cos = s.wi.as_dvec3().dot(-direction.normalize());
                irradiance += f64::from(s.radiance.g) * cos / f64::from(s.pdf);
                inside += usize::from(light.eval(s.wi) == InfiniteLightEval { radiance: s.radiance, pdf: s.pdf });
            }
            irradiance /= f64::from(n * n);
            assert!((irradiance / 2.0 - 1.0).abs() < 1e-4, "{degrees}: {irradiance}");
            // Rounding moves directions over the rim of the smallest disk.
            assert!(inside as f64 > 0.999 * f64::from(n * n), "{degrees}: {inside}");
        }
    }

    #[test]
    fn nothing_arrives_from_outside_the_disk() {
        let light = DirectionalLight::new(-DVec3::Z, Rgb::WHITE, 0.02);
        for (angle, lit) in [(0.0f32, true), (0.0099, true), (0.0101, false), (1.0, false), (3.1, false)] {
            let InfiniteLightEval { radiance, pdf } = light.eval(Vec3::new(0.0, angle.sin(), angle.cos()));
            assert!((pdf > 0.0) == lit && radiance.is_black() != lit, "{angle}");
        }
    }
}
