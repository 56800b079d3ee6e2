//! Filters and what is drawn from them.

use std::f64::consts::TAU;

use statrs::function::erf::erf;

use super::{Effort, Faults, Outcome, sidak_level};
use crate::desc::FilterDesc;
use crate::film::Filter;
use crate::math::Vec2;
use crate::stability::geometry::Rng;
use crate::stability::statistics::chi_squared_p_value;

/// The integral of a filter along one axis.
fn closed_form(desc: &FilterDesc, r: f64) -> f64 {
    match *desc {
        FilterDesc::Box { .. } => 2.0 * r,
        FilterDesc::Tent { .. } => r,
        FilterDesc::Gaussian { sigma, .. } => {
            let sigma = f64::from(sigma);
            sigma * TAU.sqrt() * erf(r / (sigma * 2f64.sqrt())) - 2.0 * r * (-0.5 * (r / sigma).powi(2)).exp()
        }
        FilterDesc::BlackmanHarris { .. } => 0.358_75 * 2.0 * r,
        FilterDesc::Mitchell { .. } => 0.5 * r,
    }
}

pub(super) fn m1_integrals(effort: Effort) -> Outcome {
    let steps = effort.pick(256, 2048);
    let (mut worst, mut outside) = (0f64, Faults::NONE);
    for desc in &Filter::EXAMPLES {
        let filter = Filter::new(desc);
        let r = f64::from(filter.radius());
        let at = |i: u32| (r * (2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0)) as f32;
        let sum: f64 = (0..steps)
            .flat_map(|i| (0..steps).map(move |j| (i, j)))
            .map(|(i, j)| filter.evaluate(Vec2::new(at(i), at(j))))
            .sum();
        let measured = sum * (2.0 * r / f64::from(steps)).powi(2);
        worst = worst.max((measured / closed_form(desc, r).powi(2) - 1.0).abs());
        let beyond = filter.radius().next_up();
        let places = [Vec2::new(beyond, 0.0), Vec2::new(0.0, -beyond), Vec2::new(-2.0 * beyond, 3.0 * beyond)];
        outside += Faults::of(&places, |&p| usize::from(filter.evaluate(p) != 0.0), |p| format!("{desc:?} at {p}"));
    }
    Outcome::new()
        // Midpoints of 256 steps err by some h^2 / 24 of the second derivative: far below the percent of pbrt's test.
        .at_most("relative error of the integral", worst, 1e-3)
        .none("values outside of the radius", outside)
}

/// The integral of `f` of the filter's values from `a` to `b` along one axis.
fn integral(filter: &Filter, a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 4000;
    let h = (b - a) / f64::from(STEPS);
    let at = |i: u32| (a + (f64::from(i) + 0.5) * h) as f32;
    (0..STEPS).map(|i| f(filter.evaluate(Vec2::new(at(i), 0.0))) * h).sum()
}

/// The largest difference between the weight of the samples in a half pixel and the filter's integral there, both over
/// the whole.
fn mass_error(filter: &Filter, draws: u32) -> f64 {
    let r = f64::from(filter.radius());
    let cells = (4.0 * r).ceil() as usize;
    let mut masses = vec![0f64; cells];
    for i in 0..draws {
        // The other axis has one weight, which divides out.
        let sample = filter.sample([(i as f32 + 0.5) / draws as f32, 0.75]);
        let cell = ((f64::from(sample.offset.x) + r) * 2.0) as usize;
        masses[cell.min(cells - 1)] += f64::from(sample.weight);
    }
    let total: f64 = masses.iter().sum();
    let whole = integral(filter, -r, r, |f| f);
    let error = |(i, mass): (usize, &f64)| {
        let (from, to) = (0.5 * i as f64 - r, (0.5 * (i + 1) as f64 - r).min(r));
        (mass / total - integral(filter, from, to, |f| f) / whole).abs()
    };
    masses.iter().enumerate().map(error).fold(0.0, f64::max)
}

/// χ² of samples in square cells against the filter's absolute value.
fn p_value(filter: &Filter, rng: &mut Rng, draws: u32) -> f64 {
    const SIDE: usize = 16;
    let r = f64::from(filter.radius());
    let edge = |i: usize| -r + 2.0 * r * i as f64 / SIDE as f64;
    let axis: Vec<f64> = (0..SIDE).map(|i| integral(filter, edge(i), edge(i + 1), f64::abs)).collect();
    let total: f64 = axis.iter().sum();
    let mut counts = vec![0u32; SIDE * SIDE];
    for _ in 0..draws {
        let offset = filter.sample(rng.pair()).offset;
        let cell = |x: f32| (((f64::from(x) / r + 1.0) * 0.5 * SIDE as f64) as usize).min(SIDE - 1);
        counts[cell(offset.y) * SIDE + cell(offset.x)] += 1;
    }
    let expected: Vec<f64> =
        (0..SIDE * SIDE).map(|i| f64::from(draws) * axis[i / SIDE] * axis[i % SIDE] / (total * total)).collect();
    chi_squared_p_value(&counts, &expected)
}

pub(super) fn m2_sampled_filters(effort: Effort) -> Outcome {
    let mut rng = Rng::new(2);
    let (mut mass, mut least) = (0f64, 1f64);
    for desc in &Filter::EXAMPLES {
        let filter = Filter::new(desc);
        mass = mass.max(mass_error(&filter, 1 << 19));
        least = least.min(p_value(&filter, &mut rng, effort.pick(100_000, 4_000_000)));
    }
    Outcome::new().at_most("error of the mass of half a pixel", mass, 1e-5).at_least(
        format!("smallest p-value of {} χ² tests", Filter::EXAMPLES.len()),
        least,
        sidak_level(Filter::EXAMPLES.len()),
    )
}
