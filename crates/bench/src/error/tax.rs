//! What a render takes beyond the tracing of its rays.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde::Serialize;

use super::plan::{ErrorOptions, Subject};
use crate::accel::{AccelKind, Accelerator, EmbreeAccel, EmbreeOptions, EmbreeReplay};
use crate::film::Crop;
use crate::observed::{Call, Observed, Observer};
use crate::render::{self, Settings, Silent};
use crate::scene::Scene;
use crate::{Watch, median_and_range};
use steradian::{Error, Result};

/// Rays that are kept at most, about; each takes 50 bytes or more.
const RAYS: u64 = 12_000_000;

/// Samples per pixel at most.
const SPP: u32 = 16;

/// Rounds after the one that warms up, at least.
const ROUNDS: usize = 3;

/// A render beside the bare tracing of its own rays.
#[derive(Clone, Debug, Serialize)]
pub struct TaxReport {
    /// The variant.
    pub variant: String,
    /// What traces.
    pub accelerator: String,
    /// Threads of both.
    pub threads: usize,
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub spp: u32,
    /// Rays traced.
    pub rays: u64,
    /// Those of them that hit something.
    pub hits: u64,
    /// Whether the replay found as many hits as the render.
    pub same_hits: bool,
    /// Seconds of the render: median, lowest and highest.
    pub render_seconds: [f64; 3],
    /// Seconds of the replay.
    pub replay_seconds: [f64; 3],
    /// The one over the other, round by round.
    pub ratio: [f64; 3],
}

/// The first variant that renders with Embree: its name, its settings, Embree's options.
///
/// # Errors
/// If there is none.
pub(super) fn subject(options: &ErrorOptions) -> Result<(&str, &Settings, EmbreeOptions)> {
    let found = options.variants.iter().find_map(|variant| match &variant.subject {
        Subject::Steradian(settings) => match settings.accel {
            AccelKind::Embree(embree) => Some((variant.name.as_str(), &**settings, embree)),
            AccelKind::Auto => Some((variant.name.as_str(), &**settings, EmbreeOptions::default())),
            _ => None,
        },
        Subject::External(_) => None,
    });
    found.ok_or_else(|| Error::Usage("--tax: no variant rendered by Steradian uses embree".into()))
}

/// Measures the [`subject`]; `None` if interrupted.
///
/// # Errors
/// If there is no such variant, or as a render.
pub(super) fn bench_tax(
    scene: &Scene,
    options: &ErrorOptions,
    watch: &dyn Watch,
    stop: &AtomicBool,
) -> Result<Option<TaxReport>> {
    let (name, settings, embree) = subject(options)?;
    watch.step(&format!("tax: recording the rays of {name}"));
    let accel = EmbreeAccel::with_options(&scene.geometry, settings.threads, embree)?;
    let one = Settings { spp: 1, seed: options.seed, time_limit: None, ..settings.clone() };
    let first = render::render(scene, &accel, &one, &Silent, stop)?.stats;
    let settings = within(&one, first.rays.total());
    let recorder = Recorder { replay: Mutex::new(EmbreeReplay::new(&accel)), hits: AtomicU64::new(0) };
    let observed = Observed { inner: &accel, observer: recorder };
    // One thread, so that rays stay in their order.
    let recorded = render::render(scene, &observed, &Settings { threads: 1, ..settings.clone() }, &Silent, stop)?;
    if first.interrupted || recorded.stats.interrupted {
        return Ok(None);
    }
    let expected = observed.observer.hits.load(Ordering::Relaxed);
    let replay = observed.observer.replay.into_inner().unwrap_or_else(PoisonError::into_inner);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(settings.threads)
        .build()
        .map_err(|e| Error::Internal(format!("cannot start {} threads: {e}", settings.threads)))?;
    let (mut renders, mut replays, mut hits) = (Vec::new(), Vec::new(), 0);
    let rounds = options.repeats.max(ROUNDS);
    for round in 0..=rounds {
        watch.step(&format!("tax: round {round} of {rounds}"));
        let rendered = render::render(scene, &accel, &settings, &Silent, stop)?.stats;
        if rendered.interrupted {
            return Ok(None);
        }
        let start = Instant::now();
        hits = pool.install(|| replay.trace());
        let seconds = start.elapsed().as_secs_f64();
        // The first round warms caches and page tables up.
        if round > 0 {
            renders.push(rendered.render_seconds);
            replays.push(seconds);
        }
    }
    let ratios: Vec<f64> = renders.iter().zip(&replays).map(|(render, replay)| render / replay.max(1e-9)).collect();
    Ok(Some(TaxReport {
        variant: name.to_owned(),
        accelerator: accel.description(),
        threads: settings.threads,
        size: [settings.crop.width, settings.crop.height],
        spp: settings.spp,
        rays: replay.rays(),
        hits,
        same_hits: hits == expected,
        render_seconds: median_and_range(&renders),
        replay_seconds: median_and_range(&replays),
        ratio: median_and_range(&ratios),
    }))
}

/// As many samples as fit into memory, where one a pixel has this many rays; a smaller picture if not even one does.
fn within(settings: &Settings, rays: u64) -> Settings {
    let mut settings = settings.clone();
    settings.spp = u32::try_from(RAYS / rays.max(1)).unwrap_or(SPP).clamp(1, SPP);
    if rays > RAYS {
        let scale = (RAYS as f64 / rays as f64).sqrt();
        settings.size = settings.size.map(|side| ((f64::from(side) * scale) as u32).max(1));
        settings.crop = Crop::full(settings.size);
    }
    settings
}

/// Keeps a copy of the rays and counts hits.
struct Recorder<'a, 'g> {
    replay: Mutex<EmbreeReplay<'a, 'g>>,
    hits: AtomicU64,
}

impl Observer for Recorder<'_, '_> {
    fn observe(&self, call: &Call, trace: &mut dyn FnMut()) {
        self.replay.lock().unwrap_or_else(PoisonError::into_inner).push(call.rays, call.any_hit, call.coherence);
        trace();
    }

    fn count(&self, hits: usize) {
        self.hits.fetch_add(hits as u64, Ordering::Relaxed);
    }
}
