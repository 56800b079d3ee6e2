//! Many statistical tests judged together.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::render::Estimate;
use super::{Outcome, sidak_level};
use crate::stability::statistics::chi_squared_p_value;

/// Mean of some numbers with its standard error.
pub(super) fn estimate(values: &[f64]) -> Estimate {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Estimate { mean, error: (variance / n).sqrt() }
}

/// Two-sided p-value of Welch's test for means over `na` and `nb` values, which may differ by `slack`.
pub(super) fn welch(a: Estimate, na: usize, b: Estimate, nb: usize, slack: f64) -> f64 {
    let (va, vb) = (a.error * a.error, b.error * b.error);
    let difference = ((a.mean - b.mean).abs() - slack).max(0.0);
    if va + vb == 0.0 {
        // Two means without noise are equal or not.
        return if difference > 0.0 { 0.0 } else { 1.0 };
    }
    let freedom = (va + vb).powi(2) / (va * va / (na - 1) as f64 + vb * vb / (nb - 1) as f64);
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |law| 2.0 * law.sf(difference / (va + vb).sqrt()))
}

/// The p-values of a check's tests.
pub(super) struct Tests {
    least: f64,
    worst: String,
    count: usize,
    /// Largest relative standard error of an estimate.
    blur: f64,
    evidence: Option<(Vec<f64>, Vec<f64>)>,
}

impl Tests {
    pub fn new() -> Self {
        Self { least: 1.0, worst: "none".into(), count: 0, blur: 0.0, evidence: None }
    }

    /// A test's p-value.
    pub fn add(&mut self, name: &str, p_value: f64) {
        self.count += 1;
        // A NaN is as bad as can be.
        let p_value = if p_value.is_nan() { 0.0 } else { p_value };
        if p_value < self.least {
            (self.least, self.worst) = (p_value, name.to_owned());
        }
    }

    /// Counts against expected counts.
    pub fn counts(&mut self, name: &str, observed: &[u32], expected: &[f64]) {
        let before = self.least;
        self.add(name, chi_squared_p_value(observed, expected));
        if self.least < before {
            self.evidence = Some((observed.iter().copied().map(f64::from).collect(), expected.to_vec()));
        }
    }

    /// How many standard deviations a number lies from what is expected.
    pub fn deviations(&mut self, name: &str, z: f64) {
        self.add(name, 2.0 * Normal::standard().sf(z.abs()));
    }

    /// A mean over this many independent values, which may differ from `expected` by rounding and by `slack`.
    pub fn mean(&mut self, name: &str, estimate: Estimate, values: usize, expected: f64, slack: f64) {
        let excess = ((estimate.mean - expected).abs() - slack - 1e-5 * expected.abs()).max(0.0);
        // Without any noise only rounding is allowed.
        let t = if excess > 0.0 { excess / estimate.error } else { 0.0 };
        let p_value = StudentsT::new(0.0, 1.0, (values.max(2) - 1) as f64).map_or(f64::NAN, |law| 2.0 * law.sf(t));
        self.add(name, if estimate.mean.is_finite() { p_value } else { 0.0 });
        self.blur = self.blur.max(estimate.error / expected.abs());
    }

    /// Two means that must be the same, each over this many independent values (Welch's test).
    pub fn same(&mut self, name: &str, a: Estimate, b: Estimate, values: usize) {
        self.add(name, welch(a, values, b, values, 1e-5 * a.mean.abs()));
    }

    /// What the smallest of the p-values must reach.
    pub fn level(&self) -> f64 {
        sidak_level(self.count)
    }

    /// The relative error of a mean that half of all runs would find, for the mean with the most noise.
    pub fn found(&self) -> f64 {
        self.blur * Normal::standard().inverse_cdf(1.0 - 0.5 * self.level())
    }

    /// The outcome with the smallest p-value.
    pub fn judge(self, outcome: Outcome) -> Outcome {
        let level = self.level();
        let what = format!("smallest p-value of {} tests ({})", self.count, self.worst);
        let outcome = outcome.at_least(what, self.least, level);
        match self.evidence {
            Some((observed, expected)) if self.least < level => {
                let width = (observed.len() as f64).sqrt().ceil() as usize;
                outcome.pictures("counts", width, &observed, &expected)
            }
            _ => outcome,
        }
    }

    /// [`judge`](Self::judge) for means, which must be fine enough to find a relative error of `error`.
    pub fn judge_means(self, outcome: Outcome, error: f64) -> Outcome {
        let found = self.found();
        self.judge(outcome).at_most("relative error that would be found", found, error)
    }
}
