//! Signals. The first Ctrl-C or SIGTERM stops the render, and its state and the picture so far are written; the second
//! ends the program at once. SIGUSR1 writes a checkpoint, and the render continues.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::flag;
use steradian::{Error, Result};

/// Exit code after Ctrl-C: 128 and the signal's number, as shells have it.
const INTERRUPTED: u8 = 130;
/// Exit code after SIGTERM.
const TERMINATED: u8 = 143;

/// How often a wait checks for a signal.
const WAIT_STEP: Duration = Duration::from_millis(50);

/// The requests of the signals.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    /// Becomes true with the first signal to stop.
    pub stop: Arc<AtomicBool>,
    /// Becomes true when a checkpoint is requested.
    pub checkpoint: Arc<AtomicBool>,
    code: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Starts to listen.
    #[cfg(feature = "bench")]
    pub fn listen() -> Result<Self> {
        let interrupt = Self::listen_to_requests()?;
        interrupt.listen_to_stop()?;
        Ok(interrupt)
    }

    /// Starts to listen to SIGUSR1, which would end the program otherwise. Signals to stop still do so.
    pub fn listen_to_requests() -> Result<Self> {
        let interrupt = Self::default();
        flag::register(SIGUSR1, Arc::clone(&interrupt.checkpoint)).map_err(failed)?;
        Ok(interrupt)
    }

    /// Starts to listen to signals to stop.
    pub fn listen_to_stop(&self) -> Result<()> {
        for (signal, code) in [(SIGINT, INTERRUPTED), (SIGTERM, TERMINATED)] {
            // Actions run in the order of their registration: the first signal finds the flag down and only then raises
            // it.
            let registered = flag::register_conditional_shutdown(signal, i32::from(code), Arc::clone(&self.stop))
                .and_then(|_| flag::register_usize(signal, Arc::clone(&self.code), usize::from(code)))
                .and_then(|_| flag::register(signal, Arc::clone(&self.stop)));
            registered.map_err(failed)?;
        }
        Ok(())
    }

    /// Returns after the first signal.
    pub fn wait(&self) {
        while !self.stop.load(Ordering::Relaxed) {
            std::thread::sleep(WAIT_STEP);
        }
    }

    /// The exit code of an interrupted run.
    pub fn exit_code(&self) -> u8 {
        u8::try_from(self.code.load(Ordering::Relaxed)).ok().filter(|code| *code != 0).unwrap_or(INTERRUPTED)
    }
}

/// A file that grows beyond the limit of the process (`ulimit -f`) is an error of writing, not the end of the program.
pub fn outlive_file_limits() -> Result<()> {
    flag::register(SIGXFSZ, Arc::default()).map(drop).map_err(failed)
}

fn failed(error: std::io::Error) -> Error {
    Error::Internal(format!("cannot listen to signals: {error}"))
}
