//! Benchmarks of the renderer Steradian: accelerators compared on the same rays (record, replay, check, report); error
//! against time; cost as scenes grow; and numerical stability.

pub mod agreement;
mod child;
mod epo;
pub mod error;
mod machine;
mod measure;
mod mesh;
mod naive;
mod observed;
mod record;
pub mod report;
mod reports;
pub mod scale;
mod scaling;
pub mod stability;

// The parts of the renderer that are compared and checked.
use steradian::desc;
use steradian::internal::{
    accel, assets, bsdf, camera, color, compile, film, geometry, id, import, integrator, light, math, output,
    printable, render, sampling, scene,
};

pub use machine::{Machine, Spent};
pub use measure::{
    AccelReport, BuildReport, KindReport, Mode, NodeMap, Options, RateReport, SceneReport, Subject, bench_scene,
};
pub use mesh::{bumpy_sphere, head};
pub use naive::{MatrixLinear, NaiveBvh, NaiveKdTree, NaiveOctree};
pub use record::{RayKind, RaySet, record};
pub use reports::{Comparison, ComparisonRow, FrameTiming, ReportsOptions, ReportsReport, bench_reports};
pub use scaling::{Fit, ScalingPoint, ScalingReport, bench_scaling, fit, fitted_slope};

/// Receives the progress of a benchmark, and may end it.
pub trait Watch: Sync {
    /// A step begins.
    fn step(&self, what: &str);

    /// Whether to end after the present step with what there is.
    fn is_stopped(&self) -> bool;
}

/// Ignores progress and never ends a benchmark.
#[cfg(test)]
struct Unwatched;

#[cfg(test)]
impl Watch for Unwatched {
    fn step(&self, _: &str) {}
    fn is_stopped(&self) -> bool {
        false
    }
}

/// The middle of the values, and the lowest and highest; zeros if there are none.
pub fn median_and_range(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match (sorted.first(), sorted.last()) {
        (Some(&low), Some(&high)) => {
            let n = sorted.len();
            [0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]), low, high]
        }
        _ => [0.0; 3],
    }
}
