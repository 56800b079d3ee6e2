//! Whether sampled directions follow the density that goes with them.

use std::cell::Cell;

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use super::super::{Effort, Outcome, sidak_level};
use super::materials::{View, rough, views};
use crate::stability::statistics::{DirectionTest, compare_directions_on};

/// Rows and columns of cells (pbrt, bsdfs_test.cpp).
const GRID: [usize; 2] = [80, 160];

/// Every view if `all`, else one of each `stride`, which is as good a mixture of materials as of directions.
fn selected(all: bool, stride: usize, first: usize) -> Vec<View> {
    let stride = if all { 1 } else { stride };
    views(rough()).into_iter().skip(if all { 0 } else { first }).step_by(stride).collect()
}

/// Samples of one view against the density.
pub struct Comparison {
    pub name: String,
    pub test: DirectionTest,
    /// Samples where the density is zero.
    pub outside: u32,
}

/// Draws and counts; what leaves by a delta lobe counts as a draw that gave nothing.
pub fn compare(view: &View, count: u32, seed: u32) -> Comparison {
    let (bsdf, wo) = (&view.material.bsdf, view.wo);
    let outside = Cell::new(0);
    let sample = |u: [f32; 4]| {
        let wi = bsdf.sample(wo, u[2], [u[0], u[1]]).filter(|s| !s.is_delta)?.wi;
        outside.set(outside.get() + u32::from(bsdf.eval(wo, wi).pdf <= 0.0));
        Some(wi)
    };
    let test = compare_directions_on(GRID, count, seed, sample, |wi| bsdf.eval(wo, wi).pdf);
    Comparison { name: view.name(), test, outside: outside.get() }
}

/// The measures of G1, with pictures of the worst histogram.
pub fn judge_directions(outcome: Outcome, comparisons: &[Comparison]) -> Outcome {
    let level = sidak_level(comparisons.len());
    let worst =
        comparisons.iter().min_by(|a, b| a.test.p_value.total_cmp(&b.test.p_value)).expect("views are not empty");
    let outside = comparisons.iter().map(|c| f64::from(c.outside) / f64::from(c.test.count)).fold(0.0, f64::max);
    let outcome = outcome
        .at_least(format!("smallest p-value of {} ({})", comparisons.len(), worst.name), worst.test.p_value, level)
        .at_most("fraction of samples where the density is 0", outside, 1e-5);
    if worst.test.p_value >= level {
        return outcome;
    }
    let observed: Vec<f64> = worst.test.observed.iter().copied().map(f64::from).collect();
    outcome.pictures("directions", worst.test.columns, &observed, &worst.test.expected)
}

/// The measures of G2.
pub fn judge_integrals(outcome: Outcome, comparisons: &[Comparison]) -> Outcome {
    // Both tails of a normal distribution.
    let deviations = -Normal::standard().inverse_cdf(0.5 * sidak_level(comparisons.len()));
    let excess = |c: &Comparison| c.test.excess(deviations);
    let worst = comparisons.iter().max_by(|a, b| excess(a).total_cmp(&excess(b))).expect("views are not empty");
    let largest = comparisons.iter().map(|c| c.test.integral).fold(0.0, f64::max);
    outcome
        .at_most(
            format!(
                "integral less share of samples that succeed, beyond {deviations:.1} standard errors ({})",
                worst.name
            ),
            excess(worst),
            1e-3,
        )
        .at_most("largest integral", largest, 1.0 + 1e-3)
}

pub(super) fn g1_directions(effort: Effort) -> Outcome {
    let views = selected(effort == Effort::Full, 13, 0);
    let comparisons: Vec<_> = views.par_iter().map(|view| compare(view, effort.pick(50_000, 1_000_000), 17)).collect();
    judge_directions(Outcome::new(), &comparisons)
}

pub(super) fn g2_integrals(effort: Effort) -> Outcome {
    let views = selected(effort == Effort::Full, 13, 5);
    let comparisons: Vec<_> = views.par_iter().map(|view| compare(view, effort.pick(50_000, 300_000), 18)).collect();
    judge_integrals(Outcome::new(), &comparisons)
}
