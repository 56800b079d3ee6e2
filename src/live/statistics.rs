//! What a render has done so far, in numbers.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

/// Statistics of a render's progress.
#[derive(Debug)]
pub struct Statistics {
    time_limit: Option<Duration>,
    done: AtomicU64,
    plan: Mutex<Plan>,
}

/// What changes rarely.
#[derive(Debug)]
struct Plan {
    start: Instant,
    end: Option<Instant>,
    pixels: u64,
    total: u64,
    errors: Option<[f64; 2]>,
}

/// The numbers at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProgressNumbers {
    /// Samples done, of all pixels together.
    pub samples: u64,
    /// Samples that are to be done as far as known.
    pub samples_planned: u64,
    /// Samples per pixel, the mean over the picture.
    pub spp: f64,
    /// Samples per pixel that are to be done as far as known.
    pub spp_planned: f64,
    /// Samples per second.
    pub samples_per_second: f64,
    /// Seconds since the start of the render, at most until its end.
    pub elapsed: f64,
    /// Seconds that it will take still, as far as known.
    pub left: Option<f64>,
    /// The picture's relative squared error, of renders with a target for it.
    pub error: Option<f64>,
    /// What it is to be.
    pub target_error: Option<f64>,
}

impl Statistics {
    /// For a render that ends at the latest after `time_limit`.
    pub fn new(time_limit: Option<Duration>) -> Self {
        let plan = Plan { start: Instant::now(), end: None, pixels: 0, total: 0, errors: None };
        Self { time_limit, done: AtomicU64::new(0), plan: Mutex::new(plan) }
    }

    fn plan_mut(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The render starts: samples per pixel at most, and number of pixels.
    pub fn start(&self, samples_per_pixel: u32, pixels: u64) {
        let mut plan = self.plan_mut();
        (plan.start, plan.end, plan.pixels) = (Instant::now(), None, pixels);
        plan.total = u64::from(samples_per_pixel) * pixels;
    }

    /// The number of samples in all changed: the picture's error is `error`, and its target `target`.
    pub fn plan(&self, samples: u64, error: f64, target: f64) {
        let mut plan = self.plan_mut();
        (plan.total, plan.errors) = (samples, Some([error, target]));
    }

    /// Adds a number of samples.
    pub fn add(&self, samples: u64) {
        self.done.fetch_add(samples, Ordering::Relaxed);
    }

    /// No more will come.
    pub fn end(&self) {
        self.plan_mut().end.get_or_insert_with(Instant::now);
    }

    /// The numbers at this moment.
    pub fn numbers(&self) -> ProgressNumbers {
        let plan = self.plan_mut();
        let elapsed = plan.end.unwrap_or_else(Instant::now).saturating_duration_since(plan.start).as_secs_f64();
        let samples = self.done.load(Ordering::Relaxed);
        let per_pixel = |samples: u64| if plan.pixels == 0 { 0.0 } else { samples as f64 / plan.pixels as f64 };
        ProgressNumbers {
            samples,
            samples_planned: plan.total,
            spp: per_pixel(samples),
            spp_planned: per_pixel(plan.total),
            samples_per_second: if elapsed > 0.0 { samples as f64 / elapsed } else { 0.0 },
            elapsed,
            left: if plan.end.is_some() { Some(0.0) } else { left(samples, plan.total, elapsed, self.time_limit) },
            error: plan.errors.map(|[error, _]| error),
            target_error: plan.errors.map(|[_, target]| target),
        }
    }
}

/// Seconds left after `elapsed` seconds: what the samples missing will take, or what the time limit leaves if that is
/// less.
fn left(samples: u64, total: u64, elapsed: f64, time_limit: Option<Duration>) -> Option<f64> {
    let of_samples = (samples > 0).then(|| elapsed * total.saturating_sub(samples) as f64 / samples as f64);
    let of_time = time_limit.map(|limit| (limit.as_secs_f64() - elapsed).max(0.0));
    match (of_samples, of_time) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_follows_from_what_is_done_and_from_the_time_limit() {
        assert_eq!(left(0, 100, 1.0, None), None);
        assert_eq!(left(25, 100, 2.0, None), Some(6.0));
        assert_eq!(left(25, 100, 2.0, Some(Duration::from_secs(5))), Some(3.0));
        assert_eq!(left(0, 100, 7.0, Some(Duration::from_secs(5))), Some(0.0));
        assert_eq!(left(120, 100, 2.0, None), Some(0.0));
    }

    #[test]
    fn numbers_follow_the_progress_of_the_render() {
        let statistics = Statistics::new(None);
        assert_eq!((statistics.numbers().spp, statistics.numbers().error), (0.0, None));
        statistics.start(8, 100);
        statistics.add(150);
        statistics.add(50);
        let numbers = statistics.numbers();
        assert_eq!((numbers.samples, numbers.samples_planned, numbers.spp, numbers.spp_planned), (200, 800, 2.0, 8.0));
        statistics.plan(1600, 0.5, 0.25);
        statistics.end();
        let numbers = statistics.numbers();
        assert_eq!(
            (numbers.spp_planned, numbers.error, numbers.target_error, numbers.left),
            (16.0, Some(0.5), Some(0.25), Some(0.0))
        );
        assert_eq!(statistics.numbers().elapsed, numbers.elapsed);
    }
}
