//! Discrete and piecewise constant distributions.

use super::{Effort, Faults, Outcome, Tests};
use crate::math::Rng;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::sampling::{AliasTable, Piecewise2d, PiecewiseCell};

/// Weights of few and of many entries, with zeros in all places and of very different sizes.
fn tables() -> Vec<Vec<f64>> {
    let mut rng = Rng::new(3);
    vec![
        vec![1.0],
        vec![0.0, 1.0],
        vec![1.0, 0.0],
        vec![0.0, 0.1, 0.1, 0.1, 0.0, 0.3, 0.0],
        vec![0.0, 1e-300, 0.0],
        vec![1e300, 1e300, 2e300],
        (0..100).map(f64::from).collect(),
        (0..1000).map(|_| rng.magnitude(-6.0, 0.0)).collect(),
    ]
}

/// What numbers of a regular grid over the unit interval choose.
struct Found {
    /// Largest difference of a share and its probability, in entries' widths.
    share: f64,
    /// Chosen though of weight zero.
    zero: usize,
    /// What is left of the number, by sixteenths.
    left: Vec<u32>,
    out_of_range: usize,
}

fn walk(weights: &[f64], table: &AliasTable, bits: u32) -> Found {
    let mut counts = vec![0u32; weights.len()];
    let mut found = Found { share: 0.0, zero: 0, left: vec![0; 16], out_of_range: 0 };
    let n = 1u32 << bits;
    let numbers = (0..n).map(|i| i as f32 / n as f32).chain([f32::MIN_POSITIVE, ONE_MINUS_EPSILON]);
    for (i, u) in numbers.enumerate() {
        let chosen = table.sample(u);
        found.zero += usize::from(weights[chosen.index] == 0.0);
        found.out_of_range += usize::from(!(0.0..1.0).contains(&chosen.u));
        if i < n as usize {
            counts[chosen.index] += 1;
            found.left[((chosen.u * 16.0) as usize).min(15)] += 1;
        }
    }
    for (i, &count) in counts.iter().enumerate() {
        found.share = found.share.max((f64::from(count) / f64::from(n) - f64::from(table.pmf(i))).abs());
    }
    found
}

pub(super) fn l9_tables(effort: Effort) -> Outcome {
    let bits = effort.pick(20, 24);
    let n = f64::from(1u32 << bits);
    let (mut shares, mut left, mut pmf) = (0f64, 0f64, 0f64);
    let (mut zero, mut out_of_range) = (Faults::NONE, Faults::NONE);
    for weights in tables() {
        let Some(table) = AliasTable::new(&weights) else { return Outcome::new() };
        let largest = weights.iter().copied().fold(0.0, f64::max);
        let total: f64 = weights.iter().map(|w| w / largest).sum();
        for (i, w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            pmf = pmf.max((f64::from(table.pmf(i)) * total / (w / largest) - 1.0).abs());
        }
        let found = walk(&weights, &table, bits);
        // Each bin has two pieces, whose ends round by up to one number each.
        shares = shares.max(found.share * n / (2.0 * weights.len() as f64 + 2.0));
        zero.add(found.zero, || format!("table {weights:?}"));
        out_of_range.add(found.out_of_range, || format!("table {weights:?}"));
        left = found.left.iter().fold(left, |worst, &c| worst.max((f64::from(c) / n * 16.0 - 1.0).abs()));
    }

    // Densities over the square: counts of cells, and none of weight zero at the ends of the unit interval.
    let (mut tests, mut rng, mut cells) = (Tests::new(), Rng::new(5), 0f64);
    for (width, height) in [(1, 1), (7, 3), (64, 33)] {
        let weights: Vec<f32> =
            (0..width * height).map(|i| if i % 3 == 1 { 0.0 } else { rng.magnitude(-3.0, 1.0) as f32 }).collect();
        let Some(density) = Piecewise2d::new(width, height, &weights) else { return Outcome::new() };
        let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let count = effort.pick(100_000, 10_000_000);
        let mut counts = vec![0u32; weights.len()];
        let place = |cell: &PiecewiseCell| cell.y as usize * width + cell.x as usize;
        for _ in 0..count {
            let cell = density.sample_cell(rng.pair());
            let at = place(&cell);
            counts[at] += 1;
            let exact = f64::from(weights[at]) / total;
            // Tables count in 2^-32, and each cell and each row has one unit at least; the pdf is rounded to f32.
            let unit = (width + height) as f64 / f64::from(u32::MAX) + exact * f64::from(f32::EPSILON);
            cells = cells.max((f64::from(cell.pmf) - exact).abs() / unit);
        }
        let expected: Vec<f64> = weights.iter().map(|w| f64::from(*w) / total * f64::from(count)).collect();
        tests.counts(&format!("{width} x {height}"), &counts, &expected);
        for u in [[0.0, 0.0], [0.0, ONE_MINUS_EPSILON], [ONE_MINUS_EPSILON, 0.0], [ONE_MINUS_EPSILON; 2]] {
            let cell = density.sample_cell(u);
            let describe = || format!("{width} x {height} for {u:?}: {cell:?}");
            zero.require(weights[place(&cell)] != 0.0, describe);
            out_of_range.require(cell.within.to_array().iter().all(|w| (0.0..1.0).contains(w)), describe);
        }
    }
    let outcome = Outcome::new()
        .at_most("error of shares on a regular grid, in numbers of each end of an entry", shares, 1.0)
        .at_most("relative error of probabilities of alias tables", pmf, 1e-6)
        .at_most("error of probabilities of cells, in units of 2^-32 for each row and column and of f32", cells, 1.0)
        .none("entries of weight zero chosen", zero)
        .none("rest of a random number out of [0, 1)", out_of_range)
        .at_most("unevenness of the rest, by sixteenths", left, 0.01);
    tests.judge(outcome)
}
