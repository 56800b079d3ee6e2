//! Rendering without the interpreter's lock: progress and interrupts are looked after meanwhile.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use steradian::{Renderer, Rendering, StopHandle};

use crate::errors::OrRaise;
use crate::image::{PyImage, Source};
use crate::scene::{PyScene, apply};

/// How often signals are looked for and progress is reported.
const INTERVAL: Duration = Duration::from_millis(50);

/// As much as the main thread of a program has.
const STACK: usize = 8 << 20;

/// A renderer after its render.
type Done = (Renderer, steradian::Result<Rendering>);

/// Renders a scene. Other threads of Python run meanwhile; Ctrl-C ends the render with KeyboardInterrupt.
///
/// progress: a function that is called with the share done, from 0 to 1. Settings, with the names of the options of
/// `steradian render`: spp, size, crop, seed, threads, integrator, max_depth, layers, time_limit, target_error, accel,
/// guiding, caustics, roulette, clamp, denoise, set={"integrator.clamp": 10}, ...
#[pyfunction]
#[pyo3(signature = (scene, *, progress=None, **settings))]
pub fn render(
    scene: &Bound<'_, PyScene>,
    progress: Option<Bound<'_, PyAny>>,
    settings: Option<Bound<'_, PyDict>>,
) -> PyResult<PyImage> {
    let py = scene.py();
    let merged = scene.try_borrow()?.merged(settings.as_ref())?;
    let renderer = scene.try_borrow_mut()?.take()?;
    let (renderer, applied) = apply(py, renderer, merged);
    if let Err(error) = applied {
        scene.borrow_mut().put(renderer);
        return Err(error);
    }
    let share = Arc::new(AtomicU64::new(0));
    let (seen, stop) = (Arc::clone(&share), StopHandle::default());
    let mut renderer = renderer.stop_with(&stop).on_progress(move |done| seen.store(done.to_bits(), Ordering::Relaxed));
    let (sender, receiver) = channel::<Done>();
    let worker = std::thread::Builder::new().name("steradian".to_owned()).stack_size(STACK).spawn(move || {
        let result = renderer.render();
        // The receiver waits for it.
        let _ = sender.send((renderer, result));
    })?;
    let report = || match &progress {
        Some(call) => call.call1((f64::from_bits(share.load(Ordering::Relaxed)),)).map(drop),
        None => Ok(()),
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

/// Waits for the render. A signal, or an error of `report`, ends it and is the second result.
fn wait(
    py: Python<'_>,
    receiver: &Mutex<Receiver<Done>>,
    stop: &StopHandle,
    report: impl Fn() -> PyResult<()>,
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
                interruption = py.check_signals().and_then(|()| report()).err();
                if interruption.is_some() {
                    stop.stop();
                }
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
