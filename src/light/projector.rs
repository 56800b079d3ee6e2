//! Pictures that lights throw.

use super::bounds::{EmissionCone, LightBounds};
use super::{LightSample, PointLight};
use crate::color::Rgb;
use crate::id::TextureId;
use crate::math::{DVec3, Vec2, Vec3};
use crate::texture::Texture;

/// Lookups along each side of a picture for its mean.
const LOOKUPS: u32 = 192;

/// A texture in perspective: uv are those of a rectangle across an axis.
#[derive(Clone, Copy, Debug)]
pub struct TextureProjection {
    /// The texture; white without one.
    texture: Option<TextureId>,
    /// Unit vectors along u and along v, perpendicular to the axis.
    along: [Vec3; 2],
    axis: Vec3,
    /// Tangents of half the angles along u and along v.
    half: Vec2,
}

impl TextureProjection {
    /// The texture over angles whose halves have the tangents `half` (above 0), about `axis` (any length but zero). u
    /// grows to the right and v upward for one who looks along the axis; `up` is any direction but those of the axis.
    pub fn new(texture: Option<TextureId>, axis: DVec3, up: DVec3, half: Vec2) -> Self {
        let axis = axis.normalize_or_zero();
        let right = axis.cross(up).try_normalize().unwrap_or_else(|| axis.any_orthonormal_vector());
        Self { texture, along: [right.as_vec3(), right.cross(axis).as_vec3()], axis: axis.as_vec3(), half }
    }

    /// Where in uv the unit direction `w` away from the light leads, which may be beyond the unit square, and its
    /// cosine with the axis; `None` behind the light.
    #[inline]
    fn place(&self, w: Vec3) -> Option<(Vec2, f32)> {
        let cos = w.dot(self.axis);
        let [u, v] = self.along.map(|along| along.dot(w) / cos);
        (cos > 0.0).then(|| (Vec2::new(0.5 + 0.5 * u / self.half.x, 0.5 + 0.5 * v / self.half.y), cos))
    }

    /// The colour at a point of uv.
    fn at(&self, textures: &[Texture], uv: Vec2) -> Rgb {
        self.texture.map_or(Rgb::WHITE, |id| textures[id.index()].color(uv))
    }

    /// The colour along the unit direction `w` away from the light, whether or not that leads into the unit square;
    /// black behind the light.
    pub(super) fn color(&self, textures: &[Texture], w: Vec3) -> Rgb {
        self.place(w).map_or(Rgb::BLACK, |(uv, _)| self.at(textures, uv))
    }

    /// The integral over all directions within the unit square of the texture's luminance times `factor`, which is of
    /// the direction away from the light and its cosine with the axis.
    pub(super) fn integral(&self, textures: &[Texture], factor: impl Fn(Vec3, f64) -> f64) -> f64 {
        let middle = |i: u32| (i as f32 + 0.5) / LOOKUPS as f32;
        let mut sum = 0.0;
        for i in 0..LOOKUPS * LOOKUPS {
            let uv = Vec2::new(middle(i % LOOKUPS), middle(i / LOOKUPS));
            let at = (uv * 2.0 - 1.0) * self.half;
            let w = (self.axis + self.along[0] * at.x + self.along[1] * at.y).normalize();
            let cos = f64::from(w.dot(self.axis));
            // On a plane at distance 1 an area has the solid angle cos³.
            sum += f64::from(self.at(textures, uv).luminance()) * factor(w, cos) * cos.powi(3);
        }
        sum * 4.0 * f64::from(self.half.x * self.half.y) / f64::from(LOOKUPS * LOOKUPS)
    }
}

/// A light that throws a picture: the irradiance on a plane across its axis at distance 1 is that of the picture.
#[derive(Clone, Debug)]
pub struct Projector {
    source: PointLight,
    projection: TextureProjection,
    /// Of the irradiance over the picture, by area on the plane at distance 1: the emitted power.
    flux: f64,
}

impl Projector {
    /// A light at `position`. `irradiance` multiplies the texture.
    pub fn new(position: DVec3, irradiance: Rgb, projection: TextureProjection, textures: &[Texture]) -> Self {
        let flux = projection.integral(textures, |_, cos| cos.powi(-3)) * f64::from(irradiance.luminance());
        Self { source: PointLight { position, intensity: irradiance }, projection, flux }
    }

    /// Where it stands.
    pub fn position(&self) -> DVec3 {
        self.source.position
    }

    /// The light that arrives at `p`; `None` outside the picture.
    pub fn sample(&self, textures: &[Texture], p: DVec3) -> Option<LightSample> {
        let mut sample = self.source.sample(p)?;
        let (uv, cos) = self.projection.place(-sample.wi)?;
        if uv.min_element() < 0.0 || uv.max_element() > 1.0 {
            return None;
        }
        // The plane is 1 / cos away, and sees the light at this cosine.
        sample.radiance *= self.projection.at(textures, uv) * (1.0 / (cos * cos * cos));
        (!sample.radiance.is_black()).then_some(sample)
    }

    /// For the choice of a light.
    pub(super) fn bounds(&self) -> Option<LightBounds> {
        let half = self.projection.half.as_dvec2();
        let cone = EmissionCone { axis: self.projection.axis, spread: half.length().atan() as f32, reach: 0.0 };
        let solid_angle = 4.0 * (half.x * half.y / (1.0 + half.length_squared()).sqrt()).atan();
        (self.flux > 0.0).then(|| LightBounds::at_point(self.source.position, cone, self.flux / solid_angle))
    }

    /// Emitted power, as luminance.
    pub fn power(&self) -> f64 {
        self.flux
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::SpotLight;
    use crate::math::vec2;
    use crate::texture::Checker;
    use std::f64::consts::PI;

    /// Red right of the middle below it and left of it above it, else green.
    fn textures() -> [Texture; 1] {
        [Texture::Checker(Checker {
            colors: [Rgb::new(0.0, 1.0, 0.0), Rgb::new(1.0, 0.0, 0.0)],
            scale: vec2(1.0, 1.0),
        })]
    }

    fn projection(half: Vec2) -> TextureProjection {
        TextureProjection::new(Some(TextureId(0)), DVec3::NEG_Z, DVec3::Y, half)
    }

    #[test]
    fn a_picture_is_upright_and_its_irradiance_that_of_a_plane() {
        let textures = textures();
        let light = Projector::new(DVec3::new(1.0, 2.0, 3.0), Rgb::splat(2.0), projection(vec2(1.0, 0.5)), &textures);
        let at = |x: f64, y: f64, distance: f64| {
            let p = DVec3::new(1.0 + x * distance, 2.0 + y * distance, 3.0 - distance);
            // The irradiance on a plane across the axis.
            light.sample(&textures, p).map(|sample| sample.radiance * sample.wi.z * (distance * distance) as f32)
        };
        let near = |a: Option<Rgb>, b: Rgb| {
            a.is_some_and(|a| (a - b).max_channel().abs() + (b - a).max_channel().abs() < 1e-5)
        };
        let (red, green) = (Rgb::new(2.0, 0.0, 0.0), Rgb::new(0.0, 2.0, 0.0));
        for distance in [1.0, 3.0] {
            for x in [0.1, 0.9] {
                assert!(near(at(x, -0.4, distance), red) && near(at(-x, 0.4, distance), red));
                assert!(near(at(x, 0.4, distance), green) && near(at(-x, -0.4, distance), green));
            }
            assert!(at(1.01, 0.0, distance).is_none() && at(0.0, -0.51, distance).is_none());
            assert!(at(0.1, 0.1, -distance).is_none());
        }
        // Twice the mean luminance over an area of 2 x 1.
        let mean = 0.5 * f64::from(red.luminance() + green.luminance());
        assert!((light.power() - 2.0 * mean).abs() < 1e-6, "{}", light.power());
        // Upright with any other axis.
        let down = TextureProjection::new(Some(TextureId(0)), DVec3::NEG_Y, DVec3::NEG_Z, vec2(1.0, 1.0));
        assert!(down.color(&textures, Vec3::new(0.3, -1.0, 0.3).normalize()).g == 0.0, "to the right and below");
        assert!(down.color(&textures, Vec3::new(0.3, -1.0, -0.3).normalize()).r == 0.0, "to the right and above");
        assert!(down.color(&textures, Vec3::Y).is_black());
    }

    #[test]
    fn power_is_what_flows_out() {
        let textures = textures();
        let half = (0.5f64).tan() as f32;
        let projector = Projector::new(DVec3::ZERO, Rgb::splat(3.0), projection(vec2(0.8, 0.3)), &textures);
        let spot = SpotLight::new(DVec3::ZERO, DVec3::NEG_Z, Rgb::splat(3.0), 0.3, 0.5)
            .with_texture(projection(Vec2::splat(half)), &textures);
        for (is_spot, power) in [(false, projector.power()), (true, spot.power())] {
            let sample = |p: DVec3| if is_spot { spot.sample(&textures, p) } else { projector.sample(&textures, p) };
            // Directions evenly in cosine and angle.
            let n = 600;
            let mut sum = 0.0;
            for i in 0..n * n {
                let cos = (f64::from(i / n) + 0.5) / f64::from(n);
                let (sin, phi) = ((1.0 - cos * cos).sqrt(), 2.0 * PI * (f64::from(i % n) + 0.5) / f64::from(n));
                let p = DVec3::new(sin * phi.cos(), sin * phi.sin(), -cos);
                sum += sample(p).map_or(0.0, |sample| f64::from(sample.radiance.luminance()));
            }
            let flux = sum * 2.0 * PI / f64::from(n * n);
            assert!((flux / power - 1.0).abs() < 5e-3, "{flux} {power}");
        }
    }
}
