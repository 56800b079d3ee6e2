//! Light from every direction.
//!
//! A lat-long image is laid around the scene with its top at +Y: the unit direction `d`, in the light's own space,
//! looks up `u = 1/2 + atan2(d.x, -d.z) / (2 pi)` and `v = acos(d.y) / pi`, where (0, 0) is the image's upper left
//! corner. The middle column is -Z and +X lies at three quarters of the width (Mitsuba's `envmap` after half a turn
//! about +Y). The lookup is bilinear between texel centres, wraps in u and clamps in v.
//!
//! Beside sampling the BSDF, which finds all directions about evenly, an image is sampled by how much brighter it is
//! than its mean (Karlik et al., "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling"):
//! nothing of an even sky.

mod batch;

pub use batch::{EnvironmentScratch, InfiniteLightSampleRows};

use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;
use std::sync::OnceLock;

use super::{InfiniteLightEval, LightSample, MisCompensation};
use crate::color::Rgb;
use crate::math::prefetch::{address, prefetch_lines};
use crate::math::rows::soa;
use crate::math::{DMat3, Vec3, angle_of, unit_circle};
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};
use crate::sampling::{Piecewise2d, PiecewiseCell};

/// By this share of the mean a cell is at least brighter than the mean, or counts as even.
const EVEN: f64 = 1e-6;

/// Light from every direction.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from everywhere.
    Constant(Rgb),
    /// A lat-long image.
    Map(Box<EnvironmentMap>),
}

impl Environment {
    /// Light from a direction chosen by brightness; `u` in the unit square. `None` if there is nothing to find.
    #[inline]
    pub fn sample(&self, u: [f32; 2], compensation: MisCompensation) -> Option<LightSample> {
        let (wi, radiance, pdf) = match self {
            Self::Constant(_) if compensation == MisCompensation::On => return None,
            Self::Constant(radiance) => (uniform_sphere(u), *radiance, UNIFORM_SPHERE_PDF),
            Self::Map(map) => {
                let chosen = map.choose(&map.density(compensation)?.cells, u);
                (chosen.wi, map.lookup(chosen.at), chosen.pdf)
            }
        };
        Some(LightSample::infinite_sample(wi, radiance, pdf))
    }

    /// Radiance arriving along the unit direction `wi`, and the density of sampling it.
    #[inline]
    pub fn eval(&self, wi: Vec3, compensation: MisCompensation) -> InfiniteLightEval {
        match self {
            Self::Constant(radiance) => InfiniteLightEval {
                radiance: *radiance,
                pdf: if compensation == MisCompensation::On { 0.0 } else { UNIFORM_SPHERE_PDF },
            },
            Self::Map(map) => {
                let at = map.locate(wi);
                let corners = map.corners(at.x as usize, at.y as usize);
                let pdf = map.density(compensation).map_or(0.0, |density| density.pdf(corners));
                InfiniteLightEval { radiance: interpolate(corners, at.within), pdf }
            }
        }
    }

    /// Radiance arriving along the unit direction `wi`.
    #[inline]
    pub fn radiance(&self, wi: Vec3) -> Rgb {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Map(map) => map.lookup(map.locate(wi)),
        }
    }

    /// Power that falls on a scene of the given radius, as luminance.
    pub fn power(&self, scene_radius: f64) -> f64 {
        self.sampled_power(scene_radius, MisCompensation::Off)
    }

    /// The part of [`power`](Self::power) that [`sample`](Self::sample) is to find.
    pub(super) fn sampled_power(&self, scene_radius: f64, compensation: MisCompensation) -> f64 {
        let fluence = match self {
            Self::Constant(_) if compensation == MisCompensation::On => 0.0,
            Self::Constant(radiance) => 4.0 * PI * f64::from(radiance.luminance()),
            Self::Map(map) => map.fluence(compensation),
        };
        PI * scene_radius * scene_radius * fluence
    }
}

/// Why an image cannot be an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentMapError {
    /// No texels, or not as many as the size requires.
    #[error("{texels} texels for an image of {width} x {height}")]
    Size {
        /// Width as stated.
        width: usize,
        /// Height as stated.
        height: usize,
        /// How many texels there are.
        texels: usize,
    },
    /// A texel that is not finite, before or after the scale.
    #[error("the texel at column {x}, row {y} is not finite")]
    Texel {
        /// Column, from 0.
        x: usize,
        /// Row, from 0.
        y: usize,
    },
    /// A matrix that is more (or less) than a rotation.
    #[error("the transform is not a rotation")]
    Rotation,
}

/// A lat-long image around the scene, sampled by luminance.
///
/// The cells of the density are bounded by texel centres (and the poles), like those of the bilinear lookup: wherever
/// the lookup is not black, neither is the density zero. Within a cell it is constant per solid angle, so the poles
/// need no special case.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    width: usize,
    height: usize,
    texels: Vec<Rgb>,
    /// Columns in world space: the light's axes.
    axes: [Vec3; 3],
    /// How directions are chosen, by [`MisCompensation`]; built on first use. `None` if the image is black. Column i
    /// lies between the centres of texels i and i + 1; row j between those of rows j - 1 and j, the first and the last
    /// between the outermost centres and the poles.
    densities: [OnceLock<Option<CellDensity>>; 2],
    /// Of each row of the density.
    bands: Vec<Band>,
}

soa! {
    /// What the cells of a row have in common.
    struct BandRows of Band {
        /// Cosines of the polar angle at the upper and the lower limit.
        upper: f64,
        lower: f64,
        /// 1 over the solid angle of a cell.
        inverse_solid_angle: f32,
    }
}

/// How cells are chosen.
#[derive(Clone, Debug)]
struct CellDensity {
    cells: Piecewise2d,
    /// What the luminance is multiplied by, so that neither the brightest nor faint images leave the range of `f32`.
    scale: f32,
    /// The scaled luminance that is found without sampling the image, and the least of a cell that is chosen.
    found_without: f32,
    limit: f32,
    /// 1 over the integral of the scaled luminance that is to be found.
    inverse_fluence: f32,
}

impl CellDensity {
    /// Density per solid angle of a cell with these texels at its corners. [`Piecewise2d::pmf`] is the same but for
    /// rounding, and waits for more memory.
    #[inline(always)]
    fn pdf(&self, corners: [Rgb; 4]) -> f32 {
        let quarter = 0.25 * self.scale;
        let [a, b, c, d] = corners.map(|t| brightness(t * quarter));
        let mean = (a + b) + (c + d);
        if mean > self.limit { (mean - self.found_without) * self.inverse_fluence } else { 0.0 }
    }
}

/// What is to be found in each cell, row by row: luminance times solid angle.
struct CellWeights {
    weights: Vec<f64>,
    /// The luminance that is found without sampling the image.
    found_without: f64,
}

/// A direction in the image: a cell of the density and where between its corners, linear in azimuth and polar angle.
#[derive(Clone, Copy)]
struct Location {
    x: u32,
    y: u32,
    within: [f32; 2],
}

/// A direction that was chosen.
#[derive(Clone, Copy)]
struct Chosen {
    wi: Vec3,
    at: Location,
    pdf: f32,
}

impl EnvironmentMap {
    /// An environment of `width * height` texels by rows, the top row first. `rotation` maps directions of the light's
    /// own space to the world; reflections are allowed. Each texel is multiplied by `scale`.
    ///
    /// # Errors
    /// If the count is wrong, a texel is not finite, or `rotation` is not orthonormal.
    pub fn new(
        width: usize,
        height: usize,
        pixels: Vec<Rgb>,
        rotation: DMat3,
        scale: f32,
    ) -> Result<Self, EnvironmentMapError> {
        if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
            return Err(EnvironmentMapError::Size { width, height, texels: pixels.len() });
        }
        let product = rotation.transpose() * rotation;
        // Written so that a NaN is rejected.
        if !(product - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-6) {
            return Err(EnvironmentMapError::Rotation);
        }
        let mut texels = pixels;
        for texel in &mut texels {
            *texel *= scale;
        }
        if let Some(i) = texels.iter().position(|t| !t.is_finite()) {
            return Err(EnvironmentMapError::Texel { x: i % width, y: i / width });
        }
        let axes = [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|axis| axis.normalize().as_vec3());
        // Half rows at both poles.
        let limit = |row: usize| (row as f64 - 0.5).clamp(0.0, height as f64) / height as f64;
        let cosines: Vec<_> = (0..=height + 1).map(|row| (PI * limit(row)).cos()).collect();
        let inverse_solid_angle = |cap: f64| width as f32 / (TAU * cap as f32);
        let band = |limits: &[f64]| {
            let (upper, lower) = (limits[0], limits[1]);
            Band { upper, lower, inverse_solid_angle: inverse_solid_angle(upper - lower) }
        };
        let bands = cosines.windows(2).map(band).collect();
        Ok(Self { width, height, texels, axes, densities: Default::default(), bands })
    }

    /// Of each cell, the mean of the bilinear luminance (its corners' mean) times the solid angle.
    fn weights(&self, compensation: MisCompensation) -> CellWeights {
        let row = |y: usize| -> Vec<f64> {
            self.texels[y * self.width..(y + 1) * self.width].iter().map(|&t| brightness(t).into()).collect()
        };
        let solid_angle = |y: usize| (self.bands[y].upper - self.bands[y].lower) * 2.0 * PI / self.width as f64;
        let mut weights = Vec::with_capacity(self.width * (self.height + 1));
        let mut upper = row(0);
        for y in 0..=self.height {
            let lower = row(y.min(self.height - 1));
            let right = |x: usize| if x + 1 == self.width { 0 } else { x + 1 };
            weights.extend((0..self.width).map(|x| 0.25 * (upper[x] + upper[right(x)] + lower[x] + lower[right(x)])));
            upper = lower;
        }
        let rows = |weights: &[f64]| -> f64 {
            weights.chunks(self.width).zip(0..).map(|(row, y)| row.iter().sum::<f64>() * solid_angle(y)).sum()
        };
        let found_without = match compensation {
            MisCompensation::Off => 0.0,
            MisCompensation::On => rows(&weights) / (4.0 * PI),
        };
        for (row, y) in weights.chunks_mut(self.width).zip(0..) {
            for weight in row {
                // Of an even image nothing but rounding would be left.
                let left = if *weight > found_without * (1.0 + EVEN) { *weight - found_without } else { 0.0 };
                *weight = left * solid_angle(y);
            }
        }
        CellWeights { weights, found_without }
    }

    fn density(&self, compensation: MisCompensation) -> Option<&CellDensity> {
        let make = || {
            let CellWeights { weights, found_without } = self.weights(compensation);
            // Scaled so that neither the brightest nor faint ones leave the range of f32.
            let largest = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let scaled = |&w: &f64| if w > 0.0 { ((w / largest) as f32).max(f32::MIN_POSITIVE) } else { 0.0 };
            let scaled: Vec<_> = weights.iter().map(scaled).collect();
            let cells = Piecewise2d::new(self.width, self.height + 1, &scaled)?;
            let brightest = self.texels.iter().fold(f32::MIN_POSITIVE, |most, &t| most.max(brightness(t)));
            let scale = 2f32.powi(-brightest.log2().floor() as i32);
            let [found_without, limit] = [1.0, 1.0 + EVEN].map(|by| (found_without * by * f64::from(scale)) as f32);
            let inverse_fluence = (1.0 / (weights.iter().sum::<f64>() * f64::from(scale))) as f32;
            Some(CellDensity { cells, scale, found_without, limit, inverse_fluence })
        };
        self.densities[compensation as usize].get_or_init(make).as_ref()
    }

    /// Integral of the luminance that is to be found over all directions.
    fn fluence(&self, compensation: MisCompensation) -> f64 {
        self.weights(compensation).weights.iter().sum()
    }

    /// The texels at the corners of a cell: upper left, upper right, lower left, lower right.
    #[inline]
    fn corners(&self, x: usize, y: usize) -> [Rgb; 4] {
        let right = if x + 1 == self.width { 0 } else { x + 1 };
        let upper = y.saturating_sub(1) * self.width;
        let lower = y.min(self.height - 1) * self.width;
        [self.texels[upper + x], self.texels[upper + right], self.texels[lower + x], self.texels[lower + right]]
    }

    /// Starts to load what [`corners`](Self::corners) reads.
    #[inline(always)]
    fn prefetch_corners(&self, x: usize, y: usize) {
        for row in [y.saturating_sub(1), y.min(self.height - 1)] {
            prefetch_lines(address(&self.texels, row * self.width + x), 1);
        }
    }

    #[inline]
    fn lookup(&self, at: Location) -> Rgb {
        interpolate(self.corners(at.x as usize, at.y as usize), at.within)
    }

    /// Where in the image the unit direction `wi` looks.
    #[inline(always)]
    fn locate(&self, wi: Vec3) -> Location {
        let d = Vec3::new(self.axes[0].dot(wi), self.axes[1].dot(wi), self.axes[2].dot(wi));
        let u = 0.5 + angle_of(d.x, -d.z) * (1.0 / TAU);
        let theta = angle_of((d.x * d.x + d.z * d.z).sqrt(), d.y);
        // Texel centres lie at half-integers; half a texel left of the first centre belongs to the last column.
        let (width, height) = (self.width as i32, self.height as i32);
        let x = u * width as f32 - 0.5;
        let x = if x < 0.0 { x + width as f32 } else { x };
        let column = (x as i32).min(width - 1);
        let y = theta * FRAC_1_PI * height as f32 + 0.5;
        let row = (y as i32).min(height);
        Location { x: column as u32, y: row as u32, within: [(x - column as f32).min(1.0), (y - row as f32).min(1.0)] }
    }

    /// A direction chosen by a density.
    #[inline]
    fn choose(&self, density: &Piecewise2d, u: [f32; 2]) -> Chosen {
        let cell = density.sample_cell(u);
        let band = self.bands[cell.y as usize];
        let (wi, at) = self.direction_in(&cell, &band);
        Chosen { wi, at, pdf: cell.pmf * band.inverse_solid_angle }
    }

    /// The direction at the point within a cell, which is in a band.
    #[inline(always)]
    fn direction_in(&self, cell: &PiecewiseCell, band: &Band) -> (Vec3, Location) {
        let [within_x, within_y] = cell.within.to_array();
        // Uniform on the cell: in the cosine of the polar angle and in the azimuth.
        let cos = band.upper + f64::from(within_y) * (band.lower - band.upper);
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let x = cell.x as f32 + 0.5 + within_x;
        let x = if x >= self.width as f32 { x - self.width as f32 } else { x };
        // u = 1/2 is -Z and the azimuth turns towards +X.
        let around = unit_circle(x / self.width as f32) * sin;
        let [right, up, back] = self.axes;
        let wi = right * -around.y as f32 + up * cos as f32 + back * around.x as f32;

        let theta = angle_of(sin as f32, cos as f32);
        let t = theta * FRAC_1_PI * self.height as f32 + 0.5 - cell.y as f32;
        (wi.normalize(), Location { x: cell.x, y: cell.y, within: [within_x, t.clamp(0.0, 1.0)] })
    }
}

/// The luminance of a texel. Negative channels (of colours out of gamut) must not cancel others: such a texel is not
/// black.
#[inline(always)]
fn brightness(texel: Rgb) -> f32 {
    texel.map(f32::abs).luminance()
}

/// The bilinear interpolation of the texels at the corners of a cell, as [`EnvironmentMap::corners`] has them.
#[inline(always)]
fn interpolate([a, b, c, d]: [Rgb; 4], [s, t]: [f32; 2]) -> Rgb {
    (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t
}

#[cfg(test)]
mod tests;
