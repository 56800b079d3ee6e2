//! Pixel filters, importance sampled as in "Filter Importance Sampling" (Ernst, Stamminger and Greiner, 2006).
//!
//! All filters are separable and even, so one axis is described on `[0, radius]` and a random number picks a side and a distance.

use std::f64::consts::TAU;

use crate::desc::FilterDesc;
use crate::math::Vec2;

/// Cells of a table. With them the sampled distribution differs from the filter's by less than `1e-6` (a test measures it).
const CELLS: usize = 1024;

/// Steps of the integration that makes a table.
const STEPS: usize = 1 << 15;

/// A pixel filter, importance sampled: a sample touches one pixel.
#[derive(Clone, Debug)]
pub struct Filter {
    desc: FilterDesc,
    kernel: Kernel,
}

/// An offset from the pixel's centre and the weight of a sample there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Offset in pixels.
    pub offset: Vec2,
    /// 1 for filters without negative lobes; else the filter over the density, of mean 1.
    pub weight: f32,
}

#[derive(Clone, Debug)]
enum Kernel {
    Box { radius: f32 },
    Tent { radius: f32 },
    Table(Box<Table>),
}

impl Filter {
    /// Every kind of filter, with usual parameters and others, to be checked.
    pub(crate) const EXAMPLES: [FilterDesc; 10] = [
        FilterDesc::Box { radius: 0.5 },
        FilterDesc::Box { radius: 0.8 },
        FilterDesc::Tent { radius: 1.0 },
        FilterDesc::Gaussian { radius: 1.5, sigma: 0.5 },
        FilterDesc::Gaussian { radius: 2.0, sigma: 3.0 },
        FilterDesc::BlackmanHarris { radius: 1.5 },
        FilterDesc::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 },
        FilterDesc::Mitchell { radius: 2.0, b: 1.0, c: 0.0 },
        FilterDesc::Mitchell { radius: 2.0, b: 0.0, c: 0.5 },
        FilterDesc::Mitchell { radius: 2.0, b: 0.0, c: 1.0 },
    ];

    /// From its description; radii and the Gaussian's deviation are above 0.
    pub fn new(desc: &FilterDesc) -> Self {
        let kernel = match *desc {
            FilterDesc::Box { radius } => Kernel::Box { radius },
            FilterDesc::Tent { radius } => Kernel::Tent { radius },
            _ => Kernel::Table(Box::new(Table::new(desc))),
        };
        Self { desc: *desc, kernel }
    }

    /// An offset chosen in proportion to the filter's absolute value.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> FilterSample {
        match &self.kernel {
            Kernel::Box { radius } => {
                FilterSample { offset: Vec2::new((2.0 * u[0] - 1.0) * radius, (2.0 * u[1] - 1.0) * radius), weight: 1.0 }
            }
            Kernel::Tent { radius } => FilterSample { offset: Vec2::new(tent(u[0]) * radius, tent(u[1]) * radius), weight: 1.0 },
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
        radius(&self.desc)
    }
}

/// Inverts the distribution of a tent on `[-1, 1]`.
#[inline]
fn tent(u: f32) -> f32 {
    let v = 2.0 * u - 1.0;
    (1.0 - (1.0 - v.abs()).sqrt()).copysign(v)
}

fn radius(desc: &FilterDesc) -> f32 {
    match *desc {
        FilterDesc::Box { radius }
        | FilterDesc::Tent { radius }
        | FilterDesc::Gaussian { radius, .. }
        | FilterDesc::BlackmanHarris { radius }
        | FilterDesc::Mitchell { radius, .. } => radius,
    }
}

/// One axis of a filter.
fn evaluate(desc: &FilterDesc, x: f64) -> f64 {
    let radius = f64::from(radius(desc));
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
/// With `v` uniform in `[-1, 1)` the distance at which a fraction `1 - |v|` of the filter's absolute value lies farther out is tabulated
/// over `s = sqrt(1 - |v|)`: that makes the cells small where the filter fades out, and a linear step between knots exact for a tent.
#[derive(Clone, Debug)]
struct Table {
    /// Distance at `s = i / CELLS`, from the radius down to 0.
    knots: [f32; CELLS + 1],
    /// Integral over `[0, radius]` if the filter has negative lobes; without them every weight is 1.
    signed_integral: Option<f64>,
}

impl Table {
    fn new(desc: &FilterDesc) -> Self {
        let radius = f64::from(radius(desc));
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
            // Within a step |f| is taken as linear: from `a` at its outer end to `b`; solved for the part of the step's mass.
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
    /// The filter over its integral, over the density. Both on one side: `1 - s²` is uniform there and distance is linear in `s` within a
    /// cell, so the density is `2 s (ds / dx)`.
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
