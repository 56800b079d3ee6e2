//! What is rendered, and how.

use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use serde::Serialize;

use super::External;
use crate::Spent;
use crate::accel::{self, AccelKind, Accelerator};
use crate::film::Image;
use crate::machine::processor_seconds;
use crate::render::{self, Settings, Silent};
use crate::scene::Scene;
use steradian::Result;

/// A render may turn out this many times as fast as its first sample before the number of samples ends it and not the
/// time.
const HEADROOM: f64 = 4.0;

/// What a render may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Budget {
    /// Samples per pixel.
    Spp(u32),
    /// Seconds of the render loop.
    Seconds(f64),
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spp(spp) => write!(f, "{spp} spp"),
            Self::Seconds(seconds) => write!(f, "{seconds} s"),
        }
    }
}

impl Budget {
    /// For comparisons of budgets of one kind.
    fn amount(self) -> f64 {
        match self {
            Self::Spp(spp) => f64::from(spp),
            Self::Seconds(seconds) => seconds,
        }
    }
}

/// Who renders.
#[derive(Clone, Debug)]
pub enum Subject {
    /// This program, with these settings; samples, seed and time limit are those of the run.
    Steradian(Box<Settings>),
    /// Another program.
    External(External),
}

/// One of the things that are compared.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Its name in the report.
    pub name: String,
    /// Who renders.
    pub subject: Subject,
}

/// What is rendered against.
#[derive(Clone, Debug)]
pub enum Standard {
    /// A picture, and the file it is from.
    File(PathBuf, Image),
    /// Two renders of the first variant with the largest budget.
    Halves,
}

/// Options of the benchmark.
#[derive(Clone, Debug)]
pub struct ErrorOptions {
    /// The scene's name.
    pub scene: String,
    /// The command line.
    pub command: String,
    /// What is compared; the first must be a Steradian render unless there is a reference.
    pub variants: Vec<Variant>,
    /// What each may take, in turn.
    pub budgets: Vec<Budget>,
    /// Repetitions, each with a seed of its own.
    pub repeats: usize,
    /// Seed of the first repeat.
    pub seed: u64,
    /// What is rendered against.
    pub reference: Standard,
    /// Whether to replay the rays of a render.
    pub tax: bool,
}

impl ErrorOptions {
    /// All renders of the plan.
    pub fn runs(&self) -> usize {
        self.variants.len() * self.budgets.len() * self.repeats
    }

    /// The most that a render may take.
    pub fn largest_budget(&self) -> Option<Budget> {
        self.budgets.iter().copied().max_by(|a, b| a.amount().total_cmp(&b.amount()))
    }
}

/// A picture and what it took.
pub(super) struct Measured {
    pub(super) image: Image,
    /// Seconds of the render itself, as far as it is known.
    pub(super) seconds: f64,
    /// Seconds of the whole process, of other programs.
    pub(super) process_seconds: Option<f64>,
    /// What it took on this program's threads, or on those that another program may have started.
    pub(super) spent: Spent,
    pub(super) spp: Option<u32>,
    pub(super) samples: Option<u64>,
    pub(super) rays: Option<u64>,
    /// Samples that were not finite and left out.
    pub(super) dropped: u64,
}

/// The variants, ready to run.
pub(super) struct Program<'a> {
    scene: &'a Scene,
    options: &'a ErrorOptions,
    stop: &'a AtomicBool,
    accels: Vec<(AccelKind, Box<dyn Accelerator + 'a>)>,
    /// Seconds that a sample a pixel takes, by variant.
    seconds_per_sample: Vec<f64>,
}

impl<'a> Program<'a> {
    /// Builds the accelerators.
    pub(super) fn new(scene: &'a Scene, options: &'a ErrorOptions, stop: &'a AtomicBool) -> Result<Self> {
        let mut accels: Vec<(AccelKind, Box<dyn Accelerator + 'a>)> = Vec::new();
        for variant in &options.variants {
            if let Subject::Steradian(settings) = &variant.subject
                && accels.iter().all(|(kind, _)| *kind != settings.accel)
            {
                accels.push((settings.accel, accel::build(settings.accel, &scene.geometry, settings.threads)?));
            }
        }
        Ok(Self { scene, options, stop, accels, seconds_per_sample: vec![0.0; options.variants.len()] })
    }

    /// The accelerator of a variant that Steradian renders.
    pub(super) fn accel(&self, settings: &Settings) -> Option<&dyn Accelerator> {
        self.accels.iter().find(|(kind, _)| *kind == settings.accel).map(|(_, accel)| &**accel)
    }

    /// Renders one sample with a variant of Steradian, so that pages and caches are as they are in the middle of a run.
    pub(super) fn warm_up(&mut self, variant: usize) -> Result<()> {
        if let Subject::Steradian(_) = self.options.variants[variant].subject
            && let Some(measured) = self.render(variant, Budget::Spp(1), self.options.seed)?
        {
            self.seconds_per_sample[variant] = measured.seconds;
        }
        Ok(())
    }

    /// Renders; `None` if interrupted.
    pub(super) fn render(&self, variant: usize, budget: Budget, seed: u64) -> Result<Option<Measured>> {
        let settings = match &self.options.variants[variant].subject {
            Subject::External(external) => return external.run(budget, seed, self.stop),
            Subject::Steradian(settings) => settings,
        };
        let Some(accel) = self.accel(settings) else { return Ok(None) };
        let (spp, time_limit) = match budget {
            Budget::Spp(spp) => (spp, None),
            Budget::Seconds(seconds) => {
                let most = HEADROOM * seconds / self.seconds_per_sample[variant].max(1e-6);
                ((most as u32).max(1), Duration::try_from_secs_f64(seconds).ok())
            }
        };
        let settings = Settings { spp, time_limit, seed, ..Settings::clone(settings) };
        let before = processor_seconds();
        let result = render::render(self.scene, accel, &settings, &Silent, self.stop)?;
        let stats = result.stats;
        let spent = Spent::new(settings.threads, stats.render_seconds, processor_seconds() - before);
        Ok((!stats.interrupted).then(|| Measured {
            image: result.image,
            seconds: stats.render_seconds,
            process_seconds: None,
            spent,
            spp: Some(stats.spp_done),
            samples: Some(stats.samples),
            rays: Some(stats.rays.total()),
            dropped: stats.nan_samples,
        }))
    }
}
