//! What samples of pixels bring.

use crate::color::Rgb;
use crate::math::Vec3;

/// What one sample of a pixel brings to the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Radiance, without the filter's weight.
    pub radiance: Rgb,
    /// 1 where the camera sees a surface or a background, 0 where not.
    pub alpha: f32,
}

/// The shape that a sample shows, and through which instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ShapeKey {
    /// The instance's id, or [`ShapeKey::NO_INSTANCE`].
    pub instance: u32,
    /// The shape's id.
    pub shape: u32,
}

impl ShapeKey {
    /// The instance of shapes that stand in the world directly.
    pub const NO_INSTANCE: u32 = u32::MAX;
    /// Of a sample that shows no shape.
    pub const NONE: Self = Self { instance: u32::MAX, shape: u32::MAX };
}

impl Default for ShapeKey {
    fn default() -> Self {
        Self::NONE
    }
}

/// What layers beside the picture need of a sample's first surface; zero where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceSample {
    /// Depth along the view axis.
    pub depth: f32,
    /// Shading normal, world.
    pub normal: Vec3,
    /// Geometric normal, world.
    pub geometric_normal: Vec3,
    /// Position, world.
    pub position: Vec3,
    /// Surface parameters.
    pub uv: [f32; 2],
    /// How far the point moves in the picture while the shutter is open, in pixels to the right and down. Not zero
    /// where a moving camera sees no surface.
    pub motion: [f32; 2],
    /// Fraction of light scattered.
    pub albedo: Rgb,
    /// Fraction of light scattered by the first surface that is no mirror and no clear glass.
    pub feature_albedo: Rgb,
    /// Shading normal of that surface, world.
    pub feature_normal: Vec3,
    /// The shape; [`ShapeKey::NONE`] where there is none.
    pub shown: ShapeKey,
}

impl SurfaceSample {
    /// Whether every number is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        let vectors = [self.normal, self.geometric_normal, self.position, self.feature_normal].map(|v| v.x.abs() + v.y.abs() + v.z.abs());
        let colors = [self.albedo, self.feature_albedo].map(|c| c.r.abs() + c.g.abs() + c.b.abs());
        let rest = [self.depth, self.uv[0], self.uv[1], self.motion[0], self.motion[1]].map(f32::abs);
        let all = vectors.into_iter().chain(colors).chain(rest);
        all.fold(0.0, |sum, value| sum + value * 0.0) == 0.0
    }
}

/// A part of the picture's radiance, by how the light came to the camera. The parts of a sample sum to its radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightAov {
    /// Scattered once, by diffuse reflection.
    DiffuseDirect,
    /// Scattered more than once, the last time before the camera by diffuse reflection.
    DiffuseIndirect,
    /// Scattered once, by specular reflection.
    SpecularDirect,
    /// Scattered more than once, the last time before the camera by specular reflection.
    SpecularIndirect,
    /// Scattered once, through a surface.
    TransmissionDirect,
    /// Scattered more than once, the last time before the camera through a surface.
    TransmissionIndirect,
    /// Given off by the surface that the camera sees.
    Emission,
    /// From infinity straight to the camera.
    Background,
}

impl LightAov {
    /// How many there are.
    pub const COUNT: usize = 8;
}

/// Which [light AOVs](SampleBatch::light_aovs) samples have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightAovRequest {
    /// Those of [`LightAov`].
    pub by_scattering: bool,
    /// How many groups of lights there are, the last for lights in no group; 0 if they are not wanted.
    pub light_groups: u32,
}

impl LightAovRequest {
    /// Parts of each sample.
    #[inline]
    pub const fn count(self) -> usize {
        self.first_group() + self.light_groups as usize
    }

    /// The place of the first group of lights among the parts.
    #[inline]
    pub const fn first_group(self) -> usize {
        if self.by_scattering { LightAov::COUNT } else { 0 }
    }
}

/// What a batch of samples brings.
#[derive(Clone, Debug, Default)]
pub struct SampleBatch {
    /// For the picture.
    pub pixels: Vec<PixelSample>,
    /// For layers of surfaces; empty if there are none.
    pub surfaces: Vec<SurfaceSample>,
    /// For each sample, its [`light_aovs_per_sample`](Self::light_aovs_per_sample) parts: those of [`LightAov`], then
    /// those of groups of lights; each only if wanted.
    pub light_aovs: Vec<Rgb>,
    /// How many parts each sample has.
    pub light_aovs_per_sample: usize,
}

impl SampleBatch {
    /// Makes place for `count` samples, which bring nothing yet.
    pub fn reset(&mut self, count: usize, surfaces: bool, light_aovs: LightAovRequest) {
        self.pixels.clear();
        self.pixels.resize(count, PixelSample::default());
        self.surfaces.clear();
        self.surfaces.resize(if surfaces { count } else { 0 }, SurfaceSample::default());
        self.light_aovs_per_sample = light_aovs.count();
        self.light_aovs.clear();
        self.light_aovs.resize(count * self.light_aovs_per_sample, Rgb::BLACK);
    }

    /// What the sample with this index brings.
    #[inline]
    pub fn sample(&self, index: usize) -> Sample<'_> {
        let first = index * self.light_aovs_per_sample;
        Sample {
            pixel: &self.pixels[index],
            surface: self.surfaces.get(index),
            light_aovs: &self.light_aovs[first..first + self.light_aovs_per_sample],
        }
    }

    /// The parts of the sample with this index.
    #[inline]
    pub fn light_aovs_mut(&mut self, index: usize) -> &mut [Rgb] {
        let first = index * self.light_aovs_per_sample;
        &mut self.light_aovs[first..first + self.light_aovs_per_sample]
    }
}

/// What one sample brings.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// For the picture.
    pub pixel: &'a PixelSample,
    /// For layers of surfaces, if there are any.
    pub surface: Option<&'a SurfaceSample>,
    /// As in [`SampleBatch::light_aovs`].
    pub light_aovs: &'a [Rgb],
}

impl<'a> From<&'a PixelSample> for Sample<'a> {
    fn from(pixel: &'a PixelSample) -> Self {
        Self { pixel, surface: None, light_aovs: &[] }
    }
}
