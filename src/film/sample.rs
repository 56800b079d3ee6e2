//! The values of pixel samples.

use crate::color::Rgb;
use crate::math::Vec3;
use crate::math::vectorize::vectorize;

/// Far from what `f32` can hold: weighted sums of fewer values are finite.
const BOUND: f32 = 1e30;

#[inline(always)]
fn are_bounded<T>(values: &[T], magnitude: impl Fn(&T) -> f32) -> bool {
    let mut all = true;
    for value in values {
        all &= magnitude(value) < BOUND;
    }
    all
}

#[inline(always)]
fn magnitude(color: Rgb) -> f32 {
    color.r.abs() + color.g.abs() + color.b.abs()
}

/// Radiance and alpha of one sample of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Radiance, without the filter's weight.
    pub radiance: Rgb,
    /// 1 where the camera sees a surface or a background, 0 where not.
    pub alpha: f32,
}

impl PixelSample {
    /// Radiance, then alpha.
    #[inline(always)]
    pub fn to_array(self) -> [f32; 4] {
        let [r, g, b] = self.radiance.to_array();
        [r, g, b, self.alpha]
    }

    /// The sum of all numbers' absolute values: not finite unless all of them are.
    #[inline(always)]
    pub fn magnitude(&self) -> f32 {
        magnitude(self.radiance) + self.alpha.abs()
    }
}

/// The shape that a sample shows, and through which instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ShapeKey {
    /// The instance's id, [`ShapeKey::NO_INSTANCE`] or [`ShapeKey::MEDIUM`].
    pub instance: u32,
    /// The shape's id, or the medium's.
    pub shape: u32,
}

impl ShapeKey {
    /// The instance of shapes that stand in the world directly.
    pub const NO_INSTANCE: u32 = u32::MAX;
    /// The instance of media.
    pub const MEDIUM: u32 = u32::MAX - 1;
    /// Of a sample that shows nothing.
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
    pub visible_shape: ShapeKey,
}

impl SurfaceSample {
    /// The sum of all numbers' absolute values: not finite unless all of them are.
    #[inline(always)]
    pub fn magnitude(&self) -> f32 {
        let vectors = self.normal.abs() + self.geometric_normal.abs() + self.position.abs() + self.feature_normal.abs();
        let ([u, v], [x, y]) = (self.uv, self.motion);
        let scalars = Vec3::new(self.depth, u, v).abs() + Vec3::new(x, y, 0.0).abs();
        magnitude(self.albedo) + magnitude(self.feature_albedo) + (vectors + scalars).element_sum()
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
    /// Scattered once, by a medium.
    VolumeDirect,
    /// Scattered more than once, the last time before the camera by a medium.
    VolumeIndirect,
    /// Given off by the surface that the camera sees, or by a medium before it.
    Emission,
    /// From infinity straight to the camera.
    Background,
}

impl LightAov {
    /// How many there are.
    pub const COUNT: usize = 10;
}

/// Which light AOVs samples have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightAovRequest {
    /// Those of [`LightAov`].
    pub by_scattering: bool,
    /// How many groups of lights there are, the last for lights in no group; 0 if they are not requested.
    pub light_groups: u32,
}

impl LightAovRequest {
    /// How many AOVs that are.
    #[inline]
    pub const fn count(self) -> usize {
        self.first_group() + self.light_groups as usize
    }

    /// The index of the first group of lights among them.
    #[inline]
    pub const fn first_group(self) -> usize {
        if self.by_scattering { LightAov::COUNT } else { 0 }
    }
}

/// The light AOVs of the samples of a batch.
#[derive(Clone, Debug, Default)]
pub struct LightAovRows {
    request: LightAovRequest,
    samples: usize,
    /// By AOV: those of [`LightAov`], then those of groups of lights; each only if requested. Empty where all samples
    /// are black.
    rows: Vec<Vec<Rgb>>,
}

impl LightAovRows {
    /// Clears the AOVs of `samples` samples.
    pub fn reset(&mut self, samples: usize, request: LightAovRequest) {
        (self.samples, self.request) = (samples, request);
        self.rows.iter_mut().for_each(Vec::clear);
        self.rows.resize_with(request.count(), Vec::new);
    }

    /// Which AOVs there are.
    #[inline]
    pub fn request(&self) -> LightAovRequest {
        self.request
    }

    /// Adds to the AOV with this index of a sample.
    #[inline(always)]
    pub fn add(&mut self, sample: usize, aov: usize, light: Rgb) {
        if light.is_black() {
            return;
        }
        let row = &mut self.rows[aov];
        if row.is_empty() {
            row.resize(self.samples, Rgb::BLACK);
        }
        row[sample] += light;
    }

    /// Those that are not black in all samples, with their indices.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &[Rgb])> {
        self.rows.iter().map(Vec::as_slice).enumerate().filter(|(_, row)| !row.is_empty())
    }

    /// Those of a sample.
    #[inline]
    pub fn of(&self, sample: usize) -> LightAovSample<'_> {
        LightAovSample { rows: &self.rows, sample }
    }
}

/// The light AOVs of a sample; by default it has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct LightAovSample<'a> {
    rows: &'a [Vec<Rgb>],
    sample: usize,
}

impl LightAovSample<'_> {
    /// Calls `f` with the index and value of each AOV that is not black.
    #[inline(always)]
    pub fn for_each(&self, mut f: impl FnMut(usize, Rgb)) {
        for (aov, row) in self.rows.iter().enumerate() {
            if let Some(value) = row.get(self.sample).filter(|value| !value.is_black()) {
                f(aov, *value);
            }
        }
    }
}

/// The values of a batch of samples.
#[derive(Clone, Debug, Default)]
pub struct SampleBatch {
    /// For the picture.
    pub pixels: Vec<PixelSample>,
    /// For layers of surfaces; empty if there are none.
    pub surfaces: Vec<SurfaceSample>,
    /// For light AOVs.
    pub light_aovs: LightAovRows,
}

impl SampleBatch {
    /// Makes place for `count` samples, all black and without a surface.
    pub fn reset(&mut self, count: usize, surfaces: bool, light_aovs: LightAovRequest) {
        self.pixels.clear();
        self.pixels.resize(count, PixelSample::default());
        self.surfaces.clear();
        self.surfaces.resize(if surfaces { count } else { 0 }, SurfaceSample::default());
        self.light_aovs.reset(count, light_aovs);
    }

    /// Whether all values are finite, and far from what `f32` can hold.
    pub fn is_bounded(&self) -> bool {
        vectorize!(are_bounded(&self.pixels, PixelSample::magnitude))
            && vectorize!(are_bounded(&self.surfaces, SurfaceSample::magnitude))
            && self.light_aovs.rows().all(|(_, row)| vectorize!(are_bounded(row, |light| magnitude(*light))))
    }

    /// The radiance of the sample with this index.
    #[inline]
    pub fn radiance(&self, index: usize) -> [f64; 3] {
        let Rgb { r, g, b } = self.pixels[index].radiance;
        [f64::from(r), f64::from(g), f64::from(b)]
    }

    /// The values of the sample with this index.
    #[inline]
    pub fn sample(&self, index: usize) -> Sample<'_> {
        Sample { pixel: &self.pixels[index], surface: self.surfaces.get(index), light_aovs: self.light_aovs.of(index) }
    }
}

/// The values of one sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// For the picture.
    pub pixel: &'a PixelSample,
    /// For layers of surfaces, if there are any.
    pub surface: Option<&'a SurfaceSample>,
    /// For light AOVs.
    pub light_aovs: LightAovSample<'a>,
}

impl<'a> From<&'a PixelSample> for Sample<'a> {
    fn from(pixel: &'a PixelSample) -> Self {
        Self { pixel, surface: None, light_aovs: LightAovSample::default() }
    }
}
