//! Medians over repeats, slopes and times to equal error.

use serde::Serialize;

use super::bias::Blocks;
use super::plan::{ErrorOptions, Subject};
use super::{Budget, Pictures, TaxReport};
use crate::{Machine, Spent, fitted_slope, median_and_range};

/// Everything that a run has found.
#[derive(Clone, Debug, Serialize)]
pub struct ErrorReport {
    /// Where it ran.
    pub machine: Machine,
    /// The command that ran it.
    pub command: String,
    /// The scene's name.
    pub scene: String,
    /// What was rendered against.
    pub reference: ReferenceInfo,
    /// Repetitions requested.
    pub repeats: usize,
    /// Whether it ended before the last of them.
    pub interrupted: bool,
    /// What the renders of Steradian took.
    pub spent: Spent,
    /// In the order of the command line.
    pub variants: Vec<VariantReport>,
    /// The time that each takes to the same error.
    pub equal_error: Option<EqualError>,
    /// What rendering takes beyond tracing, if requested.
    pub tax: Option<TaxReport>,
    /// For the viewer.
    #[serde(skip)]
    pub pictures: Pictures,
}

/// What was rendered against.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReferenceInfo {
    /// The file; without one two renders stood in.
    pub file: Option<String>,
    /// Samples per pixel of each of these.
    pub halves_spp: Option<u32>,
    /// relMSE of their mean, a quarter of that of their difference; it is subtracted from what is measured.
    pub noise_relmse: Option<f64>,
}

/// One of the things compared.
#[derive(Clone, Debug, Serialize)]
pub struct VariantReport {
    /// Its name.
    pub name: String,
    /// Whether another program rendered it, whose time is its own or that of its process.
    pub external: bool,
    /// By budget.
    pub points: Vec<Point>,
    /// Slope of the logarithm of relMSE over that of the time; -1 is that of independent samples.
    pub slope_of_time: Option<f64>,
    /// The same over samples per pixel.
    pub slope_of_spp: Option<f64>,
}

/// One variant with one budget. Arrays are median, lowest and highest of the repeats.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// What it was allowed to take.
    pub budget: Budget,
    /// Samples per pixel: the median.
    pub spp: Option<f64>,
    /// Seconds of the render.
    pub seconds: [f64; 3],
    /// Processor seconds, of all threads together; of other programs those of the whole process.
    pub processor_seconds: [f64; 3],
    /// Mean of `(test - reference)² / (reference² + 0.01)`.
    pub relmse: [f64; 3],
    /// The same without the worst thousandth of the pixels.
    pub relmse_trimmed: [f64; 3],
    /// Mean of `(test - reference)²`.
    pub mse: [f64; 3],
    /// Mean HDR-FLIP of the first repeat.
    pub flip: Option<f64>,
    /// Brightness against the reference.
    pub bias: Option<Bias>,
    /// Pixels and samples that were not finite, in all repeats.
    pub not_finite: u64,
    /// Millions of samples per second.
    pub msamples_per_second: Option<[f64; 3]>,
    /// Millions of rays per second.
    pub mrays_per_second: Option<[f64; 3]>,
    /// `1 / (relMSE seconds)`.
    pub efficiency: Option<[f64; 3]>,
    /// Each repeat.
    pub runs: Vec<Run>,
}

/// Mean luminance of all repeats over that of the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bias {
    /// The ratio.
    pub ratio: f64,
    /// Lower end of its confidence interval, from the differences of blocks of 8 x 8 pixels summed over the repeats.
    /// All intervals of a report together hold with 95 %.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// One render.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// Which repeat, from 0.
    pub repeat: usize,
    /// Its seed.
    pub seed: u64,
    /// Samples per pixel done, if known.
    pub spp: Option<u32>,
    /// Seconds of the render.
    pub seconds: f64,
    /// Seconds of the process, of another program.
    pub process_seconds: Option<f64>,
    /// Processor seconds, of all threads together; of another program those of the whole process.
    pub processor_seconds: f64,
    /// Mean of `(test - reference)²`.
    pub mse: f64,
    /// Mean of `(test - reference)² / (reference² + 0.01)`.
    pub relmse: f64,
    /// The same without the worst thousandth of the pixels.
    pub relmse_trimmed: f64,
    /// Mean HDR-FLIP; of the first repeat only.
    pub flip: Option<f64>,
    /// Means of red, green and blue over those of the reference.
    pub mean_ratio: [f64; 3],
    /// Pixels that hold a NaN or an infinity, and samples left out because they would have.
    pub not_finite: u64,
    /// Millions of samples per second.
    pub msamples_per_second: Option<f64>,
    /// Millions of rays per second.
    pub mrays_per_second: Option<f64>,
    /// `1 / (relMSE seconds)`; none if the error is below that of the reference.
    pub efficiency: Option<f64>,
}

/// The time that each variant takes to the same relMSE.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EqualError {
    /// The smallest that every variant reached.
    pub relmse: f64,
    /// Seconds by variant, between the points measured on straight lines of the logarithms; where a variant was better
    /// from the start, what follows from its first point with a slope of -1.
    pub seconds: Vec<Option<f64>>,
    /// By variant: how many times as fast as the first it is, for each repeat; median, lowest and highest.
    pub times_as_fast: Vec<Option<[f64; 3]>>,
    /// As `seconds`, in processor seconds of all threads together.
    pub processor_seconds: Vec<Option<f64>>,
    /// As `times_as_fast`, by processor seconds.
    pub times_as_fast_by_processor: Vec<Option<[f64; 3]>>,
}

impl Bias {
    /// Whether the interval leaves out 1.
    pub fn is_found(&self) -> bool {
        !(self.low..=self.high).contains(&1.0)
    }
}

impl ErrorReport {
    /// An empty one.
    pub(super) fn new(machine: Machine, options: &ErrorOptions) -> Self {
        let variants = options.variants.iter().map(|variant| VariantReport {
            name: variant.name.clone(),
            external: matches!(variant.subject, Subject::External(_)),
            points: options.budgets.iter().copied().map(Point::new).collect(),
            slope_of_time: None,
            slope_of_spp: None,
        });
        Self {
            machine,
            command: options.command.clone(),
            scene: options.scene.clone(),
            reference: ReferenceInfo::default(),
            repeats: options.repeats,
            interrupted: false,
            spent: Spent::default(),
            variants: variants.collect(),
            equal_error: None,
            tax: None,
            pictures: Pictures::default(),
        }
    }

    /// Renders done.
    pub fn runs(&self) -> usize {
        self.variants.iter().flat_map(|variant| &variant.points).map(|point| point.runs.len()).sum()
    }

    pub(super) fn add(&mut self, variant: usize, budget: usize, run: Run) {
        self.variants[variant].points[budget].runs.push(run);
    }

    /// Fills in what follows from the runs.
    pub(super) fn summarize(&mut self, blocks: &[Vec<Blocks>]) {
        let intervals = blocks.iter().flatten().filter(|blocks| blocks.ratio(1).is_some()).count();
        for (variant, blocks) in self.variants.iter_mut().zip(blocks) {
            for (point, blocks) in variant.points.iter_mut().zip(blocks) {
                point.summarize();
                point.bias = blocks.ratio(intervals).map(|[ratio, low, high]| Bias { ratio, low, high });
            }
            variant.slope_of_time = slope(&variant.curve());
            variant.slope_of_spp = slope(&variant.curve_of_spp());
        }
        let times =
            |of: fn(&VariantReport) -> Vec<(f64, f64)>| equal_error(&self.variants.iter().map(of).collect::<Vec<_>>());
        let by_time = times(VariantReport::curve);
        let by_processor = times(|variant| variant.curve_over(|point| Some(point.processor_seconds[0])));
        self.equal_error = by_time.zip(by_processor).map(|((relmse, seconds), (_, processor_seconds))| EqualError {
            relmse,
            seconds,
            times_as_fast: self.times_as_fast(|run| run.seconds),
            processor_seconds,
            times_as_fast_by_processor: self.times_as_fast(|run| run.processor_seconds),
        });
    }

    /// How many times as fast as the first each variant reaches the same error, over the repeats.
    fn times_as_fast(&self, seconds_of: fn(&Run) -> f64) -> Vec<Option<[f64; 3]>> {
        let mut ratios = vec![Vec::new(); self.variants.len()];
        for repeat in 0..self.repeats {
            let curves: Vec<_> =
                self.variants.iter().map(|variant| variant.curve_of_repeat(repeat, seconds_of)).collect();
            let Some((_, seconds)) = equal_error(&curves) else { continue };
            for (ratios, own) in ratios.iter_mut().zip(&seconds) {
                ratios.extend(seconds[0].zip(*own).map(|(first, own)| first / own));
            }
        }
        ratios.iter().map(|ratios| (!ratios.is_empty()).then(|| median_and_range(ratios))).collect()
    }
}

impl VariantReport {
    /// Seconds and relMSE of the points that have any, by time.
    pub(super) fn curve(&self) -> Vec<(f64, f64)> {
        self.curve_over(|point| Some(point.seconds[0]))
    }

    /// Samples per pixel and relMSE.
    pub(super) fn curve_of_spp(&self) -> Vec<(f64, f64)> {
        self.curve_over(|point| point.spp)
    }

    /// Seconds and relMSE of one repeat, by time.
    fn curve_of_repeat(&self, repeat: usize, seconds_of: fn(&Run) -> f64) -> Vec<(f64, f64)> {
        let runs = self.points.iter().filter_map(|point| point.runs.iter().find(|run| run.repeat == repeat));
        sorted(runs.map(|run| (seconds_of(run), run.relmse)))
    }

    fn curve_over(&self, of: impl Fn(&Point) -> Option<f64>) -> Vec<(f64, f64)> {
        let measured = self.points.iter().filter(|point| !point.runs.is_empty());
        sorted(measured.filter_map(|point| Some((of(point)?, point.relmse[0]))))
    }
}

/// Points that have logarithms, from left to right.
fn sorted(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut curve: Vec<_> = points.filter(|(x, y)| *x > 0.0 && *y > 0.0).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    curve
}

impl Point {
    /// Without any run yet.
    fn new(budget: Budget) -> Self {
        Self {
            budget,
            spp: None,
            seconds: [0.0; 3],
            processor_seconds: [0.0; 3],
            relmse: [0.0; 3],
            relmse_trimmed: [0.0; 3],
            mse: [0.0; 3],
            flip: None,
            bias: None,
            not_finite: 0,
            msamples_per_second: None,
            mrays_per_second: None,
            efficiency: None,
            runs: Vec::new(),
        }
    }

    fn summarize(&mut self) {
        let over = |of: fn(&Run) -> f64| median_and_range(&self.runs.iter().map(of).collect::<Vec<_>>());
        let some = |of: fn(&Run) -> Option<f64>| {
            let values: Vec<f64> = self.runs.iter().filter_map(of).collect();
            (!values.is_empty()).then(|| median_and_range(&values))
        };
        let spp = some(|run| run.spp.map(f64::from)).map(|spp| spp[0]);
        let (msamples, mrays, efficiency) =
            (some(|run| run.msamples_per_second), some(|run| run.mrays_per_second), some(|run| run.efficiency));
        let [seconds, relmse, trimmed, mse] =
            [over(|run| run.seconds), over(|run| run.relmse), over(|run| run.relmse_trimmed), over(|run| run.mse)];
        self.processor_seconds = over(|run| run.processor_seconds);
        self.flip = self.runs.iter().find_map(|run| run.flip);
        self.not_finite = self.runs.iter().map(|run| run.not_finite).sum();
        (self.spp, self.seconds, self.relmse, self.relmse_trimmed, self.mse) = (spp, seconds, relmse, trimmed, mse);
        (self.msamples_per_second, self.mrays_per_second, self.efficiency) = (msamples, mrays, efficiency);
    }
}

/// The fitted slope; none where the axis hardly changes, as the time of programs does that start slowly.
fn slope(curve: &[(f64, f64)]) -> Option<f64> {
    let wide = curve.first().zip(curve.last()).is_some_and(|(first, last)| last.0 > 1.5 * first.0);
    fitted_slope(curve).filter(|_| wide)
}

/// The smallest error that every curve reaches, and the times to it; `None` if there are fewer than two curves with
/// points.
fn equal_error(curves: &[Vec<(f64, f64)>]) -> Option<(f64, Vec<Option<f64>>)> {
    let best = |curve: &Vec<(f64, f64)>| curve.iter().map(|p| p.1).reduce(f64::min);
    let reached: Vec<f64> = curves.iter().filter_map(best).collect();
    if reached.len() < 2 {
        return None;
    }
    let relmse = reached.into_iter().fold(0.0, f64::max);
    Some((relmse, curves.iter().map(|curve| time_to(curve, relmse)).collect()))
}

/// The time after which a curve falls to an error.
fn time_to(curve: &[(f64, f64)], error: f64) -> Option<f64> {
    let (first, start) = *curve.first()?;
    if start <= error {
        return Some(first * start / error);
    }
    let step = curve.windows(2).find(|pair| pair[1].1 <= error)?;
    let [(t0, e0), (t1, e1)] = [step[0], step[1]];
    let along = (e0 / error).ln() / (e0 / e1).ln();
    Some(t0 * (t1 / t0).powf(along))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_to_equal_error_lie_between_points_on_logarithmic_lines() {
        let slow = vec![(1.0, 0.4), (4.0, 0.1), (16.0, 0.025)];
        let fast = vec![(0.5, 0.2), (2.0, 0.05), (8.0, 0.0125)];
        let (relmse, seconds) = equal_error(&[slow.clone(), fast, vec![(0.1, 0.02)]]).unwrap();
        assert_eq!(relmse, 0.025);
        let seconds: Vec<f64> = seconds.iter().map(|s| s.unwrap()).collect();
        for (found, expected) in seconds.iter().zip([16.0, 4.0, 0.08]) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{seconds:?}");
        }
        assert_eq!(time_to(&slow, 0.01), None);
        assert_eq!(equal_error(&[slow, Vec::new()]), None);
    }

    #[test]
    fn slopes_need_a_range() {
        assert!((slope(&[(1.0, 0.4), (4.0, 0.1), (16.0, 0.025)]).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!((slope(&[(1.0, 0.4), (1.01, 0.1)]), slope(&[(1.0, 0.4)]), slope(&[])), (None, None, None));
    }

    #[test]
    fn medians_and_ranges_are_over_the_runs() {
        let run = |relmse, seconds| Run {
            repeat: 0,
            seed: 0,
            spp: Some(4),
            seconds,
            process_seconds: None,
            processor_seconds: 2.0 * seconds,
            mse: 0.0,
            relmse,
            relmse_trimmed: relmse,
            flip: None,
            mean_ratio: [1.0; 3],
            not_finite: 1,
            msamples_per_second: None,
            mrays_per_second: None,
            efficiency: (relmse > 0.0).then(|| 1.0 / (relmse * seconds)),
        };
        let runs = vec![run(0.5, 1.0), run(0.1, 2.0), run(0.2, 4.0), run(-0.1, 3.0)];
        let mut point = Point { runs, ..Point::new(Budget::Spp(4)) };
        point.summarize();
        assert_eq!((point.spp, point.seconds, point.not_finite), (Some(4.0), [2.5, 1.0, 4.0], 4));
        assert!((point.relmse[0] - 0.15).abs() < 1e-12);
        assert_eq!((point.efficiency.unwrap()[0], point.processor_seconds), (2.0, [5.0, 2.0, 8.0]));
    }
}
