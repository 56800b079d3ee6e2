//! Light from every direction.
//!
//! A lat-long image is laid around the scene with its top at +Y: the unit direction `d`, in the light's own space, looks up
//! `u = 1/2 + atan2(d.x, -d.z) / (2 pi)` and `v = acos(d.y) / pi`, where (0, 0) is the image's upper left corner. The middle column is -Z and
//! +X lies at three quarters of the width (Mitsuba's `envmap` after half a turn about +Y). The lookup is bilinear between texel centres,
//! wraps in u and clamps in v.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;

use super::{InfinityEval, LightSample, ShadowTarget, unit_circle};
use crate::color::Rgb;
use crate::math::{DMat3, Vec3};
use crate::sampling::Piecewise2d;

const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Light from every direction.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from everywhere.
    Constant(Rgb),
    /// A lat-long image.
    Map(Box<EnvironmentMap>),
}

impl Environment {
    /// Light from a direction chosen by brightness; `u` in the unit square. `None` if there is no light at all.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let (wi, radiance, pdf) = match self {
            Self::Constant(radiance) => {
                let z = 1.0 - 2.0 * u[0];
                let sin = (4.0 * u[0] * (1.0 - u[0])).max(0.0).sqrt();
                let around = unit_circle(u[1]).as_vec2() * sin;
                (Vec3::new(around.x, around.y, z).normalize(), *radiance, UNIFORM_SPHERE_PDF)
            }
            Self::Map(map) => {
                let s = map.sample(u)?;
                (s.wi, s.radiance, s.pdf)
            }
        };
        Some(LightSample { wi, radiance, pdf, is_delta: false, target: ShadowTarget::Infinity })
    }

    /// Radiance arriving along the unit direction `wi`, and the density of sampling it.
    #[inline]
    pub fn eval(&self, wi: Vec3) -> InfinityEval {
        match self {
            Self::Constant(radiance) => InfinityEval { radiance: *radiance, pdf: UNIFORM_SPHERE_PDF },
            Self::Map(map) => {
                let at = map.locate(wi);
                InfinityEval { radiance: map.lookup(at), pdf: map.pdf(at) }
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

    /// Density with which [`sample`](Self::sample) chooses `wi`.
    #[inline]
    pub fn pdf(&self, wi: Vec3) -> f32 {
        match self {
            Self::Constant(_) => UNIFORM_SPHERE_PDF,
            Self::Map(map) => map.pdf(map.locate(wi)),
        }
    }

    /// Power that falls on a scene of the given radius, as luminance.
    pub fn power(&self, scene_radius: f64) -> f64 {
        let fluence = match self {
            Self::Constant(radiance) => 4.0 * PI * f64::from(radiance.luminance()),
            Self::Map(map) => map.fluence,
        };
        PI * scene_radius * scene_radius * fluence
    }
}

/// Why an image cannot be an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentMapError {
    /// No texels, or not as many as the size says.
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
/// The cells of the density are bounded by texel centres (and the poles), like those of the bilinear lookup: wherever the lookup is not
/// black, neither is the density zero. Within a cell it is constant per solid angle, so the poles need no care.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    width: usize,
    height: usize,
    texels: Vec<Rgb>,
    /// Columns in world space: the light's axes.
    axes: [Vec3; 3],
    /// None if all is black. Column i lies between the centres of texels i and i + 1; row j between those of rows j - 1 and j, the first
    /// and the last between the outermost centres and the poles.
    density: Option<Piecewise2d>,
    /// Cosine of the polar angle at the upper limit of each row of the density, and at the lower pole.
    cosines: Vec<f64>,
    /// Integral of luminance over all directions.
    fluence: f64,
}

/// A direction in the image: a cell of the density and where between its corners, linear in azimuth and polar angle.
#[derive(Clone, Copy)]
struct Location {
    x: usize,
    y: usize,
    within: [f32; 2],
}

struct MapSample {
    wi: Vec3,
    radiance: Rgb,
    pdf: f32,
}

impl EnvironmentMap {
    /// An environment of `width * height` texels by rows, the top row first. `rotation` maps directions of the light's own space to the
    /// world; reflections are allowed. Each texel is multiplied by `scale`.
    ///
    /// # Errors
    /// If the count is wrong, a texel is not finite, or `rotation` is not orthonormal.
    pub fn new(width: usize, height: usize, pixels: Vec<Rgb>, rotation: DMat3, scale: f32) -> Result<Self, EnvironmentMapError> {
        if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
            return Err(EnvironmentMapError::Size { width, height, texels: pixels.len() });
        }
        let product = rotation.transpose() * rotation;
        // Written so that a NaN is refused.
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
        let cosines = (0..=height + 1).map(|row| (PI * limit(row)).cos()).collect();
        let map = Self { width, height, texels, axes, density: None, cosines, fluence: 0.0 };
        let weights = map.weights();
        let fluence = map.fluence();
        let density = Piecewise2d::new(width, height + 1, &weights);
        Ok(Self { density, fluence, ..map })
    }

    /// Mean of the bilinear luminance over each cell (its corners' mean) times its solid angle, up to a factor; row by row.
    fn weights(&self) -> Vec<f32> {
        // Negative channels (of colours out of gamut) must not cancel others: such a texel is not black.
        let brightness = |t: Rgb| f64::from(t.map(f32::abs).luminance());
        let mut weights = Vec::with_capacity(self.width * (self.height + 1));
        for y in 0..=self.height {
            let cap = self.cosines[y] - self.cosines[y + 1];
            for x in 0..self.width {
                let mean = self.corners(x, y).map(brightness).iter().sum::<f64>();
                weights.push(mean * cap);
            }
        }
        // Scaled so that neither the brightest nor faint ones leave the range of f32.
        let largest = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        weights.iter().map(|&w| if w > 0.0 { ((w / largest) as f32).max(f32::MIN_POSITIVE) } else { 0.0 }).collect()
    }

    /// Integral of luminance over all directions, with the lookup's mean over each cell.
    fn fluence(&self) -> f64 {
        let mut sum = 0.0;
        for y in 0..=self.height {
            let cap = self.cosines[y] - self.cosines[y + 1];
            for x in 0..self.width {
                sum += cap * self.corners(x, y).iter().map(|t| f64::from(t.luminance())).sum::<f64>();
            }
        }
        (0.25 * 2.0 * PI / self.width as f64 * sum).max(0.0)
    }

    /// The texels at the corners of a cell: upper left, upper right, lower left, lower right.
    #[inline]
    fn corners(&self, x: usize, y: usize) -> [Rgb; 4] {
        let right = if x + 1 == self.width { 0 } else { x + 1 };
        let upper = y.saturating_sub(1) * self.width;
        let lower = y.min(self.height - 1) * self.width;
        [self.texels[upper + x], self.texels[upper + right], self.texels[lower + x], self.texels[lower + right]]
    }

    #[inline]
    fn lookup(&self, at: Location) -> Rgb {
        let [a, b, c, d] = self.corners(at.x, at.y);
        let [s, t] = at.within;
        (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t
    }

    /// Where in the image the unit direction `wi` looks.
    #[inline]
    fn locate(&self, wi: Vec3) -> Location {
        let d = Vec3::new(self.axes[0].dot(wi), self.axes[1].dot(wi), self.axes[2].dot(wi));
        let u = 0.5 + d.x.atan2(-d.z) / TAU;
        self.place(u, d.x.hypot(d.z).atan2(d.y))
    }

    #[inline]
    fn place(&self, u: f32, theta: f32) -> Location {
        // Texel centres lie at half-integers; half a texel left of the first centre belongs to the last column.
        let x = u * self.width as f32 - 0.5;
        let x = if x < 0.0 { x + self.width as f32 } else { x };
        let column = (x as usize).min(self.width - 1);
        let y = theta * FRAC_1_PI * self.height as f32 + 0.5;
        let row = (y as usize).min(self.height);
        Location { x: column, y: row, within: [(x - column as f32).min(1.0), (y - row as f32).min(1.0)] }
    }

    /// Density per solid angle, constant in each cell.
    #[inline]
    fn pdf(&self, at: Location) -> f32 {
        self.density.as_ref().map_or(0.0, |density| density.pmf(at.x, at.y) * self.inverse_solid_angle(at.y))
    }

    #[inline]
    fn inverse_solid_angle(&self, row: usize) -> f32 {
        let cap = self.cosines[row] - self.cosines[row + 1];
        self.width as f32 / (TAU * cap as f32)
    }

    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<MapSample> {
        let cell = self.density.as_ref()?.sample_cell(u);

        // Uniform on the cell: in the cosine of the polar angle and in the azimuth.
        let (upper, lower) = (self.cosines[cell.y], self.cosines[cell.y + 1]);
        let cos = upper + f64::from(cell.within[1]) * (lower - upper);
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let x = cell.x as f32 + 0.5 + cell.within[0];
        let x = if x >= self.width as f32 { x - self.width as f32 } else { x };
        // u = 1/2 is -Z and the azimuth turns towards +X.
        let around = unit_circle(x / self.width as f32) * sin;
        let [right, up, back] = self.axes;
        let wi = right * -around.y as f32 + up * cos as f32 + back * around.x as f32;

        let theta = (sin as f32).atan2(cos as f32);
        let t = theta * FRAC_1_PI * self.height as f32 + 0.5 - cell.y as f32;
        let radiance = self.lookup(Location { x: cell.x, y: cell.y, within: [cell.within[0], t.clamp(0.0, 1.0)] });
        Some(MapSample { wi: wi.normalize(), radiance, pdf: cell.pmf * self.inverse_solid_angle(cell.y) })
    }
}

#[cfg(test)]
mod tests;
