//! Point lights.

use std::f64::consts::PI;

use super::bounds::{EmissionCone, LightBounds};
use super::{LightSample, ShadowTarget};
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::math::{DVec3, Vec3};

/// Light from a point, the same in every direction: the irradiance at distance d is `intensity / d²`.
#[derive(Clone, Debug)]
pub struct PointLight {
    /// Where it stands.
    pub position: DVec3,
    /// Radiant intensity.
    pub intensity: Rgb,
}

impl PointLight {
    /// The light that arrives at `p`; `None` at the light itself.
    #[inline]
    pub fn sample(&self, p: DVec3) -> Option<LightSample> {
        let toward = self.position - p;
        let distance_squared = toward.length_squared();
        let wi = (toward / distance_squared.sqrt()).as_vec3();
        // Written so that a NaN (a distance of zero) gives nothing too.
        if !(distance_squared > 0.0 && distance_squared < f64::INFINITY) {
            return None;
        }
        Some(LightSample {
            wi,
            radiance: self.intensity * (1.0 / distance_squared) as f32,
            pdf: 1.0,
            is_delta: true,
            target: ShadowTarget::Point(SpawnPoint { p: self.position, n: Vec3::ZERO, error: 0.0 }),
        })
    }

    /// For the choice of a light.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        let intensity = f64::from(self.intensity.luminance());
        (intensity > 0.0).then(|| LightBounds::at_point(self.position, EmissionCone::SPHERE, intensity))
    }

    /// Emitted power, as luminance.
    pub fn power(&self) -> f64 {
        4.0 * PI * f64::from(self.intensity.luminance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn irradiance_falls_with_the_square_of_distance() {
        let light = PointLight { position: DVec3::new(1.0, 2.0, 3.0), intensity: Rgb::new(8.0, 4.0, 2.0) };
        for d in [1e-3, 1.0, 1e4] {
            let s = light.sample(DVec3::new(1.0, 2.0 - d, 3.0)).unwrap();
            assert!((f64::from(s.radiance.r) * d * d - 8.0).abs() < 1e-5 && s.is_delta && s.pdf == 1.0);
            assert!((s.wi - Vec3::Y).length() < 1e-6);
        }
        assert!(light.sample(light.position).is_none());
    }
}
