//! What a check has measured, and whether that is good enough.

use std::ops::AddAssign;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::film::Image;

/// What a number must be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// No larger than this.
    AtMost(f64),
    /// No smaller than this.
    AtLeast(f64),
    /// Between these, inclusive.
    Within(f64, f64),
    /// Anything: the number is reported, not judged.
    Any,
}

impl Bound {
    /// Whether `value` keeps the bound; a NaN keeps none.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(limit) => value <= limit,
            Self::AtLeast(limit) => value >= limit,
            Self::Within(low, high) => low <= value && value <= high,
            Self::Any => !value.is_nan(),
        }
    }
}

/// One number with its bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// What was measured, with its unit.
    pub what: String,
    /// The number.
    pub value: f64,
    /// What it must be.
    pub bound: Bound,
    /// Of a count of faults: the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counterexample: Option<String>,
}

/// How many of many cases are at fault, and the first of those in words.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// How many.
    pub count: usize,
    /// The first one: the input, such as a ray, with what came of it.
    pub first: Option<String>,
}

impl Faults {
    /// No fault yet.
    pub const NONE: Self = Self { count: 0, first: None };

    /// Counts the faults of each item in parallel.
    pub fn of<T: Sync>(items: &[T], faults: impl Fn(&T) -> usize + Sync, describe: impl FnOnce(&T) -> String) -> Self {
        let count = items.par_iter().map(&faults).sum();
        let first = if count == 0 { None } else { items.iter().find(|item| faults(item) > 0).map(describe) };
        Self { count, first }
    }

    /// Counts the faults of one case.
    pub fn add(&mut self, faults: usize, describe: impl FnOnce() -> String) {
        if faults > 0 {
            self.count += faults;
            self.first.get_or_insert_with(describe);
        }
    }

    /// Counts one fault unless `holds`.
    pub fn require(&mut self, holds: bool, describe: impl FnOnce() -> String) {
        self.add(usize::from(!holds), describe);
    }
}

impl From<usize> for Faults {
    fn from(count: usize) -> Self {
        Self { count, first: None }
    }
}

impl AddAssign for Faults {
    fn add_assign(&mut self, other: Self) {
        self.count += other.count;
        self.first = self.first.take().or(other.first);
    }
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Every number keeps its bound.
    Passed,
    /// Every number keeps a bound that is weaker than one would wish, for a reason that is reported.
    Short,
    /// A number breaks its bound.
    Failed,
}

/// Curves on logarithmic axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plot {
    /// What it shows.
    pub caption: String,
    /// Label of the horizontal axis.
    pub x: String,
    /// Label of the vertical axis.
    pub y: String,
    /// Where zeros are drawn, as logarithms have none.
    pub floor: f64,
    /// Name and points of each curve.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// What a check has found.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Outcome {
    /// The numbers.
    pub measures: Vec<Measure>,
    /// Why a bound is weaker than one would wish.
    pub shortfalls: Vec<String>,
    /// Curves for the report.
    pub plots: Vec<Plot>,
    /// Pictures that explain a failure, by name: of what was measured, of what it should be, of the difference.
    #[serde(skip)]
    pub evidence: Vec<(String, Image)>,
}

impl Outcome {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    fn with(mut self, what: impl Into<String>, value: f64, bound: Bound) -> Self {
        self.measures.push(Measure { what: what.into(), value, bound, counterexample: None });
        self
    }

    /// A number that must not exceed `limit`.
    #[must_use]
    pub fn at_most(self, what: impl Into<String>, value: f64, limit: f64) -> Self {
        self.with(what, value, Bound::AtMost(limit))
    }

    /// A number that must not be below `limit`.
    #[must_use]
    pub fn at_least(self, what: impl Into<String>, value: f64, limit: f64) -> Self {
        self.with(what, value, Bound::AtLeast(limit))
    }

    /// A number that must lie between `low` and `high`.
    #[must_use]
    pub fn within(self, what: impl Into<String>, value: f64, low: f64, high: f64) -> Self {
        self.with(what, value, Bound::Within(low, high))
    }

    /// A count that must be zero.
    #[must_use]
    pub fn none(self, what: impl Into<String>, faults: impl Into<Faults>) -> Self {
        let faults = faults.into();
        self.with(what, faults.count as f64, Bound::AtMost(0.0)).shown_by(&faults)
    }

    /// Adds the counterexample of the last number.
    #[must_use]
    pub fn shown_by(mut self, faults: &Faults) -> Self {
        self.measures.iter_mut().last().into_iter().for_each(|m| m.counterexample.clone_from(&faults.first));
        self
    }

    /// A number without a bound.
    #[must_use]
    pub fn record(self, what: impl Into<String>, value: f64) -> Self {
        self.with(what, value, Bound::Any)
    }

    /// Sets the reason why a bound is weaker than desired.
    #[must_use]
    pub fn short(mut self, cause: impl Into<String>) -> Self {
        self.shortfalls.push(cause.into());
        self
    }

    /// Adds curves.
    #[must_use]
    pub fn plot(mut self, plot: Plot) -> Self {
        self.plots.push(plot);
        self
    }

    /// Adds what was measured and what it should be, as pictures of `width` columns, and their difference.
    #[must_use]
    pub fn pictures(mut self, name: &str, width: usize, result: &[f64], reference: &[f64]) -> Self {
        let difference: Vec<f64> = result.iter().zip(reference).map(|(a, b)| a - b).collect();
        for (kind, values) in [("result", result), ("reference", reference), ("error", &difference)] {
            self.evidence.push((format!("{name}-{kind}"), gray(width, values)));
        }
        self
    }

    /// Whether it is good enough.
    pub fn status(&self) -> Status {
        if self.measures.is_empty() || !self.measures.iter().all(|m| m.bound.holds(m.value)) {
            Status::Failed
        } else if self.shortfalls.is_empty() {
            Status::Passed
        } else {
            Status::Short
        }
    }
}

/// A grey picture.
fn gray(width: usize, values: &[f64]) -> Image {
    let size = [width as u32, values.len().div_ceil(width.max(1)) as u32];
    let mut data: Vec<f32> = values.iter().flat_map(|&v| [v as f32, v as f32, v as f32, 1.0]).collect();
    data.resize(4 * size[0] as usize * size[1] as usize, 0.0);
    Image::of_color(size, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_keeps_no_bound() {
        for bound in [Bound::AtMost(1.0), Bound::AtLeast(1.0), Bound::Within(0.0, 1.0), Bound::Any] {
            assert!(!bound.holds(f64::NAN), "{bound:?}");
        }
    }

    #[test]
    fn one_broken_bound_fails_and_nothing_measured_fails() {
        assert_eq!(Outcome::new().status(), Status::Failed);
        let good = Outcome::new().none("lost", 0).at_least("found", 3.0, 3.0);
        assert_eq!(good.status(), Status::Passed);
        assert_eq!(good.clone().short("rounding").status(), Status::Short);
        assert_eq!(good.short("rounding").within("share", 1.1, 0.0, 1.0).status(), Status::Failed);
    }

    #[test]
    fn the_first_fault_is_the_counterexample() {
        let mut faults = Faults::default();
        for ray in [1, 7, 9] {
            faults.require(ray != 7, || format!("ray {ray}"));
            faults.add(usize::from(ray > 7) * 2, || format!("ray {ray}"));
        }
        let mut all = Faults::from(1);
        all += faults;
        let outcome = Outcome::new().none("wrong", all);
        assert_eq!((outcome.measures[0].value, outcome.measures[0].counterexample.as_deref()), (4.0, Some("ray 7")));
        assert_eq!(Outcome::new().none("wrong", Faults::default()).measures[0].counterexample, None);
    }

    #[test]
    fn pictures_have_the_rows_they_need() {
        let outcome = Outcome::new().pictures("bins", 2, &[1.0, 2.0, 3.0], &[1.0, 1.0, 1.0]);
        assert_eq!(outcome.evidence[2].0, "bins-error");
        assert_eq!(outcome.evidence[2].1.size, [2, 2]);
        assert_eq!(outcome.evidence[2].1.rgb(0, 1), Some([2.0; 3]));
    }
}
