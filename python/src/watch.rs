//! Rendering without the interpreter's lock: progress and interrupts are looked after meanwhile.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use steradian::{Image, Progress, Renderer, Rendering, StopHandle};

use crate::errors::{OrRaise, raise};
use crate::image::{PyImage, Source};
use crate::scene::{PyScene, apply};

/// How often signals are looked for and progress is reported.
const INTERVAL: Duration = Duration::from_millis(50);

/// As much as the main thread of a program has.
const STACK: usize = 8 << 20;

/// A renderer after its render.
type Done = (Renderer, steradian::Result<Rendering>);

/// What a render has done so far, for the thread that waits for it.
#[derive(Default)]
struct Watched {
    total: AtomicU64,
    done: AtomicU64,
    /// How often pictures are made; never, if not given.
    every: Option<Duration>,
    pictures: Mutex<Pictures>,
}

/// The picture so far with its samples per pixel, until it is taken; and when it was made.
#[derive(Default)]
struct Pictures {
    latest: Option<(Image, u32)>,
    made: Option<Instant>,
}

impl Watched {
    fn share(&self) -> f64 {
        let total = self.total.load(Ordering::Relaxed).max(1);
        (self.done.load(Ordering::Relaxed) as f64 / total as f64).min(1.0)
    }

    fn pictures(&self) -> std::sync::MutexGuard<'_, Pictures> {
        self.pictures.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A listener to the render that fills in [`Watched`].
struct Listener(Arc<Watched>);

impl Progress for Listener {
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        self.0.total.store(u64::from(samples_per_pixel) * pixels, Ordering::Relaxed);
    }

    fn plan(&self, samples: u64, _error: f64, _target: f64) {
        self.0.total.store(samples, Ordering::Relaxed);
    }

    fn resumed(&self, samples: u64) {
        self.0.done.fetch_add(samples, Ordering::Relaxed);
    }

    fn tile_done(&self, samples: u64) {
        self.0.done.fetch_add(samples, Ordering::Relaxed);
    }

    fn needs_picture(&self) -> bool {
        let pictures = self.0.pictures();
        let is_due = |every| pictures.made.is_none_or(|made| made.elapsed() >= every);
        pictures.latest.is_none() && self.0.every.is_some_and(is_due)
    }

    fn picture(&self, image: &Image, samples_per_pixel: u32) {
        *self.0.pictures() = Pictures { latest: Some((image.clone(), samples_per_pixel)), made: Some(Instant::now()) };
    }
}

/// Renders a scene. Other threads of Python run meanwhile; Ctrl-C ends the render with KeyboardInterrupt.
///
/// progress: a function that is called with the share done, from 0 to 1. If it returns False, the render ends and the
/// result is the picture of the samples so far. picture: a function that is called with the picture so far and its
/// samples per pixel, at most every `picture_every` seconds. Both are called in the thread that called `render`.
/// Settings, with the names of the options of `steradian render`: spp, size, crop, seed, threads, integrator,
/// max_depth, layers, time_limit, target_error, accel, guiding, caustics, bidirectional, roulette, clamp, denoise,
/// set={"integrator.clamp": 10}, ...
#[pyfunction]
#[pyo3(signature = (scene, *, progress=None, picture=None, picture_every=1.0, **settings))]
pub fn render(
    scene: &Bound<'_, PyScene>,
    progress: Option<Bound<'_, PyAny>>,
    picture: Option<Bound<'_, PyAny>>,
    picture_every: f64,
    settings: Option<Bound<'_, PyDict>>,
) -> PyResult<PyImage> {
    let py = scene.py();
    let every = Duration::try_from_secs_f64(picture_every)
        .map_err(|_| raise(py, "SettingError", &format!("`picture_every` {picture_every}: must not be negative")))?;
    let merged = scene.try_borrow()?.merged(settings.as_ref())?;
    let renderer = scene.try_borrow_mut()?.take()?;
    let (renderer, applied) = apply(py, renderer, merged);
    if let Err(error) = applied {
        scene.borrow_mut().put(renderer);
        return Err(error);
    }
    let watched = Arc::new(Watched { every: picture.is_some().then_some(every), ..Watched::default() });
    let stop = StopHandle::default();
    let mut renderer = renderer.stop_with(&stop).progress(Listener(Arc::clone(&watched)));
    let (sender, receiver) = channel::<Done>();
    let worker = std::thread::Builder::new().name("steradian".to_owned()).stack_size(STACK).spawn(move || {
        let result = renderer.render();
        // The receiver waits for it.
        let _ = sender.send((renderer, result));
    })?;
    let report = || {
        let latest = watched.pictures().latest.take();
        if let (Some(call), Some((image, samples))) = (&picture, latest) {
            call.call1((PyImage::new(Source::Plain(image)), samples))?;
        }
        match &progress {
            Some(call) => Ok(!call.call1((watched.share(),))?.is(PyBool::new(py, false))),
            None => Ok(true),
        }
    };
    let receiver = Mutex::new(receiver);
    let (outcome, interruption) = wait(py, &receiver, &stop, report);
    py.detach(|| worker.join().map_err(drop)).ok();
    let (renderer, result) = outcome?;
    scene.borrow_mut().put(renderer);
    if let Some(error) = interruption {
        return Err(error);
    }
    Ok(PyImage::new(Source::Rendering(Box::new(result.or_raise(py)?))))
}

/// Waits for the render. A signal, or an error of `report`, ends it and is the second result; `report` is false to end
/// it without an error.
fn wait(
    py: Python<'_>,
    receiver: &Mutex<Receiver<Done>>,
    stop: &StopHandle,
    report: impl Fn() -> PyResult<bool>,
) -> (PyResult<Done>, Option<PyErr>) {
    let mut interruption = None;
    loop {
        match py.detach(|| receive(receiver)) {
            Ok(done) => {
                if interruption.is_none() {
                    interruption = report().err();
                }
                return (Ok(done), interruption);
            }
            Err(RecvTimeoutError::Timeout) if interruption.is_none() => {
                let goes_on = if stop.is_stopped() { Ok(true) } else { py.check_signals().and_then(|()| report()) };
                if !matches!(goes_on, Ok(true)) {
                    stop.stop();
                }
                interruption = goes_on.err();
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let lost = PyRuntimeError::new_err("internal error: the render ended without a result (this is a bug)");
                return (Err(lost), interruption);
            }
        }
    }
}

fn receive(receiver: &Mutex<Receiver<Done>>) -> Result<Done, RecvTimeoutError> {
    receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(INTERVAL)
}
