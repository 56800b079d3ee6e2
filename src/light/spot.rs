//! Spot lights.

use std::f64::consts::{PI, TAU};

use super::bounds::{EmissionCone, LightBounds};
use super::{LightSample, PointLight, TextureProjection};
use crate::color::Rgb;
use crate::math::{DVec3, Vec3};
use crate::texture::Texture;

/// Light from a point within a cone.
///
/// The intensity at the angle theta from the axis is that of the axis up to the beam's half-angle, zero from the cutoff
/// half-angle on, and falls linearly with the angle between: `intensity * (cutoff - theta) / (cutoff - beam)`, as
/// Mitsuba has it.
#[derive(Clone, Debug)]
pub struct SpotLight {
    source: PointLight,
    axis: Vec3,
    beam: f64,
    cutoff: f64,
    cos_beam: f32,
    cos_cutoff: f32,
    /// `1 / (cutoff - beam)`.
    slope: f32,
    /// What multiplies the intensity, and the power with it.
    texture: Option<(TextureProjection, f64)>,
}

impl SpotLight {
    /// A light at `position` that shines along `axis` (any length but zero). `beam` and `cutoff` are half-angles in
    /// radians, taken into `0 <= beam <= cutoff <= pi`.
    pub fn new(position: DVec3, axis: DVec3, intensity: Rgb, beam: f64, cutoff: f64) -> Self {
        let cutoff = cutoff.clamp(0.0, PI);
        let beam = beam.clamp(0.0, cutoff);
        Self {
            source: PointLight { position, intensity },
            axis: axis.normalize_or_zero().as_vec3(),
            beam,
            cutoff,
            cos_beam: beam.cos() as f32,
            cos_cutoff: cutoff.cos() as f32,
            slope: (1.0 / (cutoff - beam)) as f32,
            texture: None,
        }
    }

    /// This light with a texture that multiplies its intensity.
    #[must_use]
    pub fn with_texture(mut self, projection: TextureProjection, textures: &[Texture]) -> Self {
        let share = projection.integral(textures, |w, _| f64::from(self.falloff(w)));
        self.texture = Some((projection, share * f64::from(self.source.intensity.luminance())));
        self
    }

    /// Where it stands.
    pub fn position(&self) -> DVec3 {
        self.source.position
    }

    /// The light that arrives at `p`; `None` outside the cone.
    #[inline]
    pub fn sample(&self, textures: &[Texture], p: DVec3) -> Option<LightSample> {
        let mut sample = self.source.sample(p)?;
        let factor = self.falloff(-sample.wi);
        sample.radiance *= factor;
        if let Some((projection, _)) = &self.texture {
            sample.radiance *= projection.color(textures, -sample.wi);
        }
        (factor > 0.0).then_some(sample)
    }

    /// Share of the full intensity along the unit direction `w` away from the light.
    #[inline]
    fn falloff(&self, w: Vec3) -> f32 {
        let cos = w.dot(self.axis);
        if cos >= self.cos_beam {
            return 1.0;
        }
        if cos <= self.cos_cutoff {
            return 0.0;
        }
        // The arctangent keeps its digits where the arccosine loses them.
        let angle = w.cross(self.axis).length().atan2(cos);
        ((self.cutoff as f32 - angle) * self.slope).clamp(0.0, 1.0)
    }

    /// For the choice of a light.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        // Of a texture, the mean.
        let intensity =
            f64::from(self.source.intensity.luminance()) * self.power() / self.even_power().max(f64::MIN_POSITIVE);
        let cone = EmissionCone { axis: self.axis, spread: self.beam as f32, reach: (self.cutoff - self.beam) as f32 };
        (intensity > 0.0).then(|| LightBounds::at_point(self.source.position, cone, intensity))
    }

    /// Emitted power, as luminance.
    pub fn power(&self) -> f64 {
        self.texture.map_or_else(|| self.even_power(), |(_, power)| power)
    }

    /// Power without a texture.
    fn even_power(&self) -> f64 {
        let (beam, cutoff) = (self.beam, self.cutoff);
        // The integral of falloff(theta) sin(theta) dtheta.
        let share = if cutoff - beam > 1e-6 * cutoff {
            1.0 - (cutoff.sin() - beam.sin()) / (cutoff - beam)
        } else {
            2.0 * (0.5 * cutoff).sin().powi(2)
        };
        TAU * share * f64::from(self.source.intensity.luminance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(beam: f64, cutoff: f64) -> SpotLight {
        SpotLight::new(DVec3::ZERO, DVec3::new(0.0, 0.0, -2.0), Rgb::splat(2.0), beam.to_radians(), cutoff.to_radians())
    }

    fn intensity(light: &SpotLight, theta: f64) -> f64 {
        light.sample(&[], DVec3::new(theta.sin(), 0.0, -theta.cos())).map_or(0.0, |s| f64::from(s.radiance.g))
    }

    #[test]
    fn the_intensity_is_full_in_the_beam_and_zero_outside() {
        let light = light(15.0, 20.0);
        assert_eq!(intensity(&light, 0.0), 2.0);
        assert!((intensity(&light, 14.99f64.to_radians()) - 2.0).abs() < 1e-5);
        assert!((intensity(&light, 17.5f64.to_radians()) - 1.0).abs() < 1e-5);
        assert_eq!(intensity(&light, 20.01f64.to_radians()), 0.0);
        assert_eq!(intensity(&light, 3.0), 0.0);
    }
}
