//! Pixel filters: shared samples, or importance sampled as in "Filter Importance Sampling" (Ernst, Stamminger and
//! Greiner, 2006).
//!
//! All filters are separable and even, so one axis is described on `[0, radius]`. With shared samples, points are
//! uniform within each pixel and a sample is weighted for every pixel whose filter reaches it. For importance sampling,
//! a random number picks a side and a distance.

use std::f64::consts::TAU;

use super::Crop;
use super::shared_weights::{MAX_TAPS, SharedWeights};
use crate::desc::{FilterDesc, FilterSamplesDesc};
use crate::math::Vec2;

/// Cells of a table. With them the sampled distribution differs from the filter's by less than `1e-6` (a test measures
/// it).
const CELLS: usize = 1024;

/// Steps of the integration that makes a table.
pub(super) const STEPS: usize = 1 << 15;

/// Steps per pixel of the integrals of [`VarianceKernel`].
const KERNEL_STEPS: u32 = 1000;

/// A pixel filter.
#[derive(Clone, Debug)]
pub struct Filter {
    desc: FilterDesc,
    kernel: Kernel,
    shared: Option<Box<SharedWeights>>,
}

/// An offset from the pixel's centre and the weight of a sample there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Offset in pixels.
    pub offset: Vec2,
    /// 1 for shared samples and for filters without negative lobes; else the filter over the density, of mean 1.
    pub weight: f32,
}

impl Default for FilterSample {
    /// The pixel's centre.
    fn default() -> Self {
        Self { offset: Vec2::ZERO, weight: 1.0 }
    }
}

/// How the noise of pixels' own samples becomes that of the filtered picture. Along one axis, for the pixels `-border
/// ..= border` around a pixel.
///
/// Of independent samples at positions that do not correlate with their values, with the variance `v` of the mean of a
/// pixel's own samples, the filtered picture has the variance `sum(squares * v) / sum(means)^2`.
#[derive(Clone, Debug)]
pub struct VarianceKernel {
    /// Integral of the filter over each pixel.
    pub means: Vec<f64>,
    /// Integral of the filter's square over each pixel.
    pub squares: Vec<f64>,
    /// Sum of the squared correlations of a pixel's noise with that of every pixel, itself included.
    pub correlation: f64,
}

#[derive(Clone, Debug)]
enum Kernel {
    Box { radius: f32 },
    Tent { radius: f32 },
    Table(Box<Table>),
}

impl Filter {
    /// Every kind of filter, with usual parameters and others, to be checked.
    pub const EXAMPLES: [FilterDesc; 10] = Self::examples(FilterSamplesDesc::Importance);

    /// [`EXAMPLES`](Self::EXAMPLES), applied in this way.
    pub const fn examples(samples: FilterSamplesDesc) -> [FilterDesc; 10] {
        let samples = Some(samples);
        [
            FilterDesc::Box { radius: 0.5, samples },
            FilterDesc::Box { radius: 0.8, samples },
            FilterDesc::Tent { radius: 1.0, samples },
            FilterDesc::Gaussian { radius: 1.5, sigma: 0.5, samples },
            FilterDesc::Gaussian { radius: 2.0, sigma: 3.0, samples },
            FilterDesc::BlackmanHarris { radius: 1.5, samples },
            FilterDesc::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0, samples },
            FilterDesc::Mitchell { radius: 2.0, b: 1.0, c: 0.0, samples },
            FilterDesc::Mitchell { radius: 2.0, b: 0.0, c: 0.5, samples },
            FilterDesc::Mitchell { radius: 2.0, b: 0.0, c: 1.0, samples },
        ]
    }

    /// From its description; radii and the Gaussian's deviation are above 0.
    pub fn new(desc: &FilterDesc) -> Self {
        let kernel = match *desc {
            FilterDesc::Box { radius, .. } => Kernel::Box { radius },
            FilterDesc::Tent { radius, .. } => Kernel::Tent { radius },
            _ => Kernel::Table(Box::new(Table::new(desc))),
        };
        let mut desc = *desc;
        // Samples within a pixel reach another from a radius of 0.5 on.
        let can_share = desc.radius() > 0.5 && desc.radius() <= MAX_TAPS as f32 / 2.0;
        let shared = can_share && *desc.samples_mut() != Some(FilterSamplesDesc::Importance);
        let shared = shared.then(|| Box::new(SharedWeights::new(&desc)));
        Self { desc, kernel, shared }
    }

    /// Where a sample lies: uniform within the pixel if samples are shared, else in proportion to the filter's absolute
    /// value.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> FilterSample {
        if self.is_shared() {
            return FilterSample { offset: Vec2::new(u[0] - 0.5, u[1] - 0.5), weight: 1.0 };
        }
        match &self.kernel {
            Kernel::Box { radius } => FilterSample {
                offset: Vec2::new((2.0 * u[0] - 1.0) * radius, (2.0 * u[1] - 1.0) * radius),
                weight: 1.0,
            },
            Kernel::Tent { radius } => {
                FilterSample { offset: Vec2::new(tent(u[0]) * radius, tent(u[1]) * radius), weight: 1.0 }
            }
            Kernel::Table(table) => table.sample(&self.desc, u),
        }
    }

    /// The filter itself, of any scale, at an offset from the pixel's centre in pixels.
    pub fn evaluate(&self, offset: Vec2) -> f64 {
        evaluate(&self.desc, f64::from(offset.x)) * evaluate(&self.desc, f64::from(offset.y))
    }

    /// Whether the filter has negative lobes, so that weights differ from 1.
    pub fn is_signed(&self) -> bool {
        matches!(&self.kernel, Kernel::Table(table) if table.signed_integral.is_some())
    }

    /// Half the width of its support in pixels.
    pub fn radius(&self) -> f32 {
        self.desc.radius()
    }

    /// Its description.
    pub fn desc(&self) -> &FilterDesc {
        &self.desc
    }

    /// Whether a sample counts for all pixels that it reaches.
    #[inline]
    pub fn is_shared(&self) -> bool {
        self.shared.is_some()
    }

    /// How many pixels beyond its own a sample reaches in each direction.
    pub fn border(&self) -> u32 {
        self.shared.as_ref().map_or(0, |shared| shared.border() as u32)
    }

    /// The weights of shared samples.
    #[inline]
    pub(super) fn shared_weights(&self) -> Option<&SharedWeights> {
        self.shared.as_deref()
    }

    /// How noise of pixels becomes that of the filtered picture.
    pub fn variance_kernel(&self) -> VarianceKernel {
        let radius = f64::from(self.radius());
        let integral = |from: f64, to: f64, f: &dyn Fn(f64) -> f64| -> f64 {
            let steps = f64::from(KERNEL_STEPS) * (to - from);
            let h = (to - from) / steps.ceil();
            (0..steps.ceil() as u32).map(|i| f(evaluate(&self.desc, from + (f64::from(i) + 0.5) * h)) * h).sum()
        };
        let whole = integral(-radius, radius, &|f| f);
        if !self.is_shared() {
            // Weights are `± integral(|f|) / integral(f)`.
            let square = (integral(-radius, radius, &f64::abs) / whole).powi(2);
            return VarianceKernel { means: vec![1.0], squares: vec![square], correlation: 1.0 };
        }
        let border = f64::from(self.border());
        let pixels = || (0..=2 * self.border()).map(|i| f64::from(i) - border);
        let over_pixel = |x: f64, f: &dyn Fn(f64) -> f64| integral((x - 0.5).max(-radius), (x + 0.5).min(radius), f);
        VarianceKernel {
            means: pixels().map(|x| over_pixel(x, &|f| f) / whole).collect(),
            squares: pixels().map(|x| over_pixel(x, &|f| f * f) / (whole * whole)).collect(),
            correlation: self.correlation().powi(2),
        }
    }

    /// [`VarianceKernel::correlation`] along one axis.
    fn correlation(&self) -> f64 {
        let radius = f64::from(self.radius());
        let h = 2.0 * radius / STEPS as f64;
        let covariance = |distance: f64| -> f64 {
            let term = |x: f64| evaluate(&self.desc, x) * evaluate(&self.desc, x - distance);
            (0..STEPS).map(|i| term(-radius + (i as f64 + 0.5) * h) * h).sum()
        };
        let own = covariance(0.0);
        1.0 + 2.0
            * (1..=(2.0 * radius) as u32).map(|distance| (covariance(f64::from(distance)) / own).powi(2)).sum::<f64>()
    }
}

impl VarianceKernel {
    /// Calls `f` with every pixel around one within a rectangle, and the kernel there.
    pub fn for_each(&self, area: Crop, [x, y]: [u32; 2], mut f: impl FnMut([u32; 2], f64, f64)) {
        let border = (self.means.len() / 2) as u32;
        let around = |at: u32, start: u32, length: u32| {
            at.saturating_sub(border).max(start)..(at + border + 1).min(start + length)
        };
        for row in around(y, area.y, area.height) {
            for column in around(x, area.x, area.width) {
                let [i, j] = [column + border - x, row + border - y].map(|i| i as usize);
                f([column, row], self.means[i] * self.means[j], self.squares[i] * self.squares[j]);
            }
        }
    }
}

/// Inverts the distribution of a tent on `[-1, 1]`.
#[inline(always)]
fn tent(u: f32) -> f32 {
    let v = 2.0 * u - 1.0;
    (1.0 - (1.0 - v.abs()).sqrt()).copysign(v)
}

/// One axis of a filter.
pub(super) fn evaluate(desc: &FilterDesc, x: f64) -> f64 {
    let radius = f64::from(desc.radius());
    let x = x.abs();
    if x > radius {
        return 0.0;
    }
    match *desc {
        FilterDesc::Box { .. } => 1.0,
        FilterDesc::Tent { .. } => 1.0 - x / radius,
        FilterDesc::Gaussian { sigma, .. } => {
            let exponent = |x: f64| -0.5 * (x / f64::from(sigma)).powi(2);
            exponent(x).exp() - exponent(radius).exp()
        }
        FilterDesc::BlackmanHarris { .. } => {
            let phase = TAU * (0.5 * x / radius + 0.5);
            0.358_75 - 0.488_29 * phase.cos() + 0.141_28 * (2.0 * phase).cos() - 0.011_68 * (3.0 * phase).cos()
        }
        FilterDesc::Mitchell { b, c, .. } => mitchell(2.0 * x / radius, f64::from(b), f64::from(c)),
    }
}

/// The cubic of "Reconstruction Filters in Computer Graphics" (Mitchell and Netravali, 1988) for `0 <= x <= 2`.
#[inline]
fn mitchell(x: f64, b: f64, c: f64) -> f64 {
    if x < 1.0 {
        (((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)) / 6.0
    } else {
        // In the distance from the end, where the cubic vanishes like its square.
        let d = 2.0 - x;
        d * d * (b * d - 6.0 * c * (1.0 - d)) / 6.0
    }
}

/// The inverse of one axis' distribution.
///
/// With `v` uniform in `[-1, 1)` the distance at which a fraction `1 - |v|` of the filter's absolute value lies farther
/// out is tabulated over `s = sqrt(1 - |v|)`: that makes the cells small where the filter fades out, and a linear step
/// between knots exact for a tent.
#[derive(Clone, Debug)]
struct Table {
    /// Distance at `s = i / CELLS`, from the radius down to 0.
    knots: [f32; CELLS + 1],
    /// Integral over `[0, radius]` if the filter has negative lobes; without them every weight is 1.
    signed_integral: Option<f64>,
}

impl Table {
    fn new(desc: &FilterDesc) -> Self {
        let radius = f64::from(desc.radius());
        let step = radius / STEPS as f64;
        let at = |i: usize| radius - i as f64 * step;

        // Integrals from the end inwards: `outside[i]` is that of |f| over [at(i), radius].
        let mut outside = Vec::with_capacity(STEPS + 1);
        let (mut total, mut signed, mut negative) = (0.0, 0.0, false);
        outside.push(0.0);
        for i in 0..STEPS {
            let [a, m, b] = [evaluate(desc, at(i)), evaluate(desc, at(i) - 0.5 * step), evaluate(desc, at(i + 1))];
            total += (a.abs() + 4.0 * m.abs() + b.abs()) * step / 6.0;
            signed += (a + 4.0 * m + b) * step / 6.0;
            // Rounding may leave a tiny negative number at the very end of a positive filter.
            negative |= m < 0.0 && i > 0;
            outside.push(total);
        }

        let mut knots = [0.0; CELLS + 1];
        let mut i = 0;
        for (k, knot) in knots.iter_mut().enumerate() {
            let target = total * (k as f64 / CELLS as f64).powi(2);
            while i + 1 < STEPS && outside[i + 1] < target {
                i += 1;
            }
            // Within a step |f| is taken as linear: from `a` at its outer end to `b`; solved for the part of the step's
            // mass.
            let (a, b) = (evaluate(desc, at(i)).abs(), evaluate(desc, at(i + 1)).abs());
            let mass = outside[i + 1] - outside[i];
            let part = if mass > 0.0 { ((target - outside[i]) / mass).clamp(0.0, 1.0) } else { 0.0 };
            let root = (a * a + (b * b - a * a) * part).sqrt();
            let fraction = if a + root > 0.0 { part * (a + b) / (a + root) } else { 0.0 };
            *knot = (at(i) - fraction * step) as f32;
        }
        knots[0] = radius as f32;
        knots[CELLS] = 0.0;
        Self { knots, signed_integral: negative.then_some(signed) }
    }

    #[inline]
    fn sample(&self, desc: &FilterDesc, u: [f32; 2]) -> FilterSample {
        let (x, y) = (self.sample_axis(u[0]), self.sample_axis(u[1]));
        let weight = match self.signed_integral {
            None => 1.0,
            Some(integral) => (x.weight(desc, integral) * y.weight(desc, integral)) as f32,
        };
        FilterSample { offset: Vec2::new(x.offset, y.offset), weight }
    }

    #[inline]
    fn sample_axis(&self, u: f32) -> AxisSample {
        let v = 2.0 * u - 1.0;
        let s = (1.0 - v.abs()).max(0.0).sqrt() * CELLS as f32;
        let cell = (s as usize).min(CELLS - 1);
        let (outer, inner) = (self.knots[cell], self.knots[cell + 1]);
        let distance = outer + (s - cell as f32) * (inner - outer);
        AxisSample { offset: distance.copysign(v), s, cell_width: outer - inner }
    }
}

/// A sample of one axis with what its density needs.
#[derive(Clone, Copy)]
struct AxisSample {
    offset: f32,
    /// The table's parameter in cells.
    s: f32,
    cell_width: f32,
}

impl AxisSample {
    /// The filter over its integral, over the density. Both on one side: `1 - s²` is uniform there and distance is
    /// linear in `s` within a cell, so the density is `2 s (ds / dx)`.
    #[inline]
    fn weight(self, desc: &FilterDesc, integral: f64) -> f64 {
        let cells = CELLS as f64;
        let pdf = 2.0 * f64::from(self.s) / (cells * cells * f64::from(self.cell_width));
        let value = evaluate(desc, f64::from(self.offset));
        if pdf > 0.0 && pdf.is_finite() { value / (pdf * integral) } else { 0.0 }
    }
}

#[cfg(test)]
#[path = "filter_tests.rs"]
mod tests;
