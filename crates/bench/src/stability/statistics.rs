//! Whether samples follow a density, and points to draw them from.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::math::{Vec3, vec3};
use crate::sampling::{PixelSeed, Sampler, SamplerKind};

/// Smallest p-value that passes: a correct sampler fails once in a million tests.
pub const MIN_P_VALUE: f64 = 1e-6;

/// Independent random numbers, four at a time.
pub fn random_points(seed: u32, count: u32) -> impl Iterator<Item = [f32; 4]> {
    let sampler = Sampler::new(SamplerKind::Independent, 1);
    (0..count).map(move |i| sampler.sample_4d(PixelSeed(seed), i, 0))
}

/// p-value of counts against expected counts, cells with few expected pooled.
pub fn chi_squared_p_value(observed: &[u32], expected: &[f64]) -> f64 {
    let mut cells: Vec<_> = expected.iter().copied().zip(observed.iter().copied()).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut statistic, mut terms) = (0.0, 0u32);
    let mut pool = (0.0, 0.0);
    for (expected, observed) in cells {
        pool.0 += expected;
        pool.1 += f64::from(observed);
        if pool.0 >= 5.0 {
            statistic += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
            terms += 1;
            pool = (0.0, 0.0);
        }
    }
    // What is left in the pool expects less than five: only an excess that no Poisson number shows counts.
    if pool.1 > 25.0 {
        return 0.0;
    }
    if terms < 2 {
        return 1.0;
    }
    ChiSquared::new(f64::from(terms - 1)).expect("positive degrees of freedom").sf(statistic)
}

/// What [`compare_directions`] found.
#[derive(Clone, Debug)]
pub struct DirectionTest {
    /// Of the χ² test over cells of the sphere; 0 if a draw was no unit vector.
    pub p_value: f64,
    /// Integral of the density over the sphere.
    pub integral: f64,
    /// Fraction of draws that gave a direction.
    pub accepted: f64,
    /// Draws.
    pub count: u32,
    /// Cells along the azimuth; the angle from the pole counts the rows.
    pub columns: usize,
    /// Directions in each cell.
    pub observed: Vec<u32>,
    /// Directions that the density expects in each cell.
    pub expected: Vec<f64>,
}

impl DirectionTest {
    /// How far the density's integral is from the fraction of draws that succeeded, beyond `deviations` standard
    /// deviations of the latter.
    pub fn excess(&self, deviations: f64) -> f64 {
        let deviation = (self.accepted * (1.0 - self.accepted) / f64::from(self.count)).sqrt();
        (self.integral - self.accepted).abs() - deviations * deviation
    }

    /// Fails unless the directions follow the density and it integrates to the fraction of draws that succeeded.
    #[track_caller]
    pub fn check(&self, name: &str) {
        let Self { p_value, integral, accepted, .. } = self;
        assert!(*p_value > MIN_P_VALUE, "{name}: p = {p_value}, integral {integral}, accepted {accepted}");
        // Five standard deviations, and the quadrature's own error.
        assert!(self.excess(5.0) < 1e-3, "{name}: integral {integral}, accepted {accepted}");
    }
}

/// Rows and columns of cells that [`compare_directions`] counts in.
const GRID: [usize; 2] = [20, 40];

/// Bins `count` draws of `sample` over the sphere and compares them with the integral of `pdf` over each cell.
pub fn compare_directions(
    count: u32,
    seed: u32,
    sample: impl Fn([f32; 4]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
) -> DirectionTest {
    compare_directions_on(GRID, count, seed, sample, pdf)
}

/// The same on a grid of another size.
pub fn compare_directions_on(
    [rows, columns]: [usize; 2],
    count: u32,
    seed: u32,
    sample: impl Fn([f32; 4]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
) -> DirectionTest {
    use std::f64::consts::{PI, TAU};
    let mut observed = vec![0u32; rows * columns];
    let (mut accepted, mut broken) = (0, 0);
    for w in random_points(seed, count).filter_map(sample) {
        accepted += 1;
        if !((w.length() - 1.0).abs() < 1e-4) {
            broken += 1;
            continue;
        }
        let theta = f64::from(w.truncate().length()).atan2(f64::from(w.z));
        let phi = f64::from(w.y).atan2(f64::from(w.x));
        let row = ((theta / PI * rows as f64) as usize).min(rows - 1);
        let column = (((phi / TAU).rem_euclid(1.0) * columns as f64) as usize).min(columns - 1);
        observed[row * columns + column] += 1;
    }

    let density = |theta: f64, phi: f64| {
        let w = vec3((theta.sin() * phi.cos()) as f32, (theta.sin() * phi.sin()) as f32, theta.cos() as f32);
        f64::from(pdf(w)) * theta.sin()
    };
    let (height, width) = (PI / rows as f64, TAU / columns as f64);
    let mut expected = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        for column in 0..columns {
            let cell = Cell { theta: row as f64 * height, phi: column as f64 * width, height, width };
            expected.push(cell.integrate_in_parts(&density));
        }
    }
    let integral = expected.iter().sum();
    expected.iter_mut().for_each(|p| *p *= f64::from(count));
    let p_value = if broken > 0 { 0.0 } else { chi_squared_p_value(&observed, &expected) };
    DirectionTest {
        p_value,
        integral,
        accepted: f64::from(accepted) / f64::from(count),
        count,
        columns,
        observed,
        expected,
    }
}

/// Parts that a cell is divided into at least are no higher than this, so that no narrow lobe is overlooked.
const COARSEST: f64 = 0.04;

#[derive(Clone, Copy)]
struct Cell {
    theta: f64,
    phi: f64,
    height: f64,
    width: f64,
}

impl Cell {
    fn quarters(&self) -> [Self; 4] {
        let (height, width) = (0.5 * self.height, 0.5 * self.width);
        [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].map(|(row, column)| Self {
            theta: self.theta + row * height,
            phi: self.phi + column * width,
            height,
            width,
        })
    }

    /// Adaptive quadrature of all parts.
    fn integrate_in_parts(&self, f: &impl Fn(f64, f64) -> f64) -> f64 {
        if self.height > COARSEST {
            return self.quarters().iter().map(|part| part.integrate_in_parts(f)).sum();
        }
        // 14 halvings resolve a ridge of 2e-6 radians, as a lobe of alpha 1e-3 has at a cosine of 1e-3.
        self.integrate(f, self.simpson(f), 14)
    }

    /// Simpson's rule, drawn in a little: with nodes this close to the edge halving a cell shows any jump of the
    /// density, yet no node lies on the horizon itself.
    fn simpson(&self, f: &impl Fn(f64, f64) -> f64) -> f64 {
        const REACH: f64 = 0.498;
        const WEIGHT: f64 = 1.0 / (24.0 * REACH * REACH);
        const NODES: [(f64, f64); 3] = [(0.5 - REACH, WEIGHT), (0.5, 1.0 - 2.0 * WEIGHT), (0.5 + REACH, WEIGHT)];
        let mut sum = 0.0;
        for (y, weight_y) in NODES {
            for (x, weight_x) in NODES {
                sum += weight_y * weight_x * f(self.theta + y * self.height, self.phi + x * self.width);
            }
        }
        sum * self.height * self.width
    }

    /// Adaptive quadrature.
    fn integrate(&self, f: &impl Fn(f64, f64) -> f64, whole: f64, depth: u32) -> f64 {
        let parts = self.quarters().map(|part| (part, part.simpson(f)));
        let sum = parts.iter().map(|part| part.1).sum::<f64>();
        if depth == 0 || (sum - whole).abs() <= 1e-7 + 1e-4 * sum.abs() {
            return sum;
        }
        parts.into_iter().map(|(part, estimate)| part.integrate(f, estimate, depth - 1)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp;

    #[test]
    fn a_wrong_density_is_found() {
        let sample = |u: [f32; 4]| Some(warp::cosine_hemisphere([u[0], u[1]]));
        let right = compare_directions(50_000, 1, sample, |w| warp::cosine_hemisphere_pdf(w.z.max(0.0)));
        right.check("cosine");
        // Up to a tenth more towards the pole.
        let wrong =
            compare_directions(50_000, 1, sample, |w| warp::cosine_hemisphere_pdf(w.z.max(0.0)) * (0.85 + 0.225 * w.z));
        assert!(wrong.p_value < MIN_P_VALUE, "{}", wrong.p_value);
        assert!((wrong.integral - 1.0).abs() < 1e-3);
    }
}
