//! Live view: the picture as it grows, sent to the viewer tev and served to browsers as a small web page.
//!
//! The render hands over a copy of the picture when a viewer needs one ([`Progress::needs_picture`]) and goes on at
//! once; sending, converting and waiting happen on threads of the viewers. No viewer can slow or end the render: what
//! one has not taken when the next picture comes is replaced by that.

mod fan;
mod pace;
mod preview;
mod snapshot;
mod statistics;
mod tev;

pub use fan::Fan;
pub use preview::{Compared, HttpTimeouts, Preview, PreviewOptions};
pub use snapshot::Snapshot;
pub use statistics::{ProgressNumbers, Statistics};
pub use tev::{DEFAULT_ADDRESS, Tev, TevCounters, TevOptions};

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::film::Image;
use crate::render::Progress;
use pace::Pace;

/// No viewer gets more pictures than one in this time.
const PICTURE_PERIOD: Duration = Duration::from_millis(250);

/// How long the end of the program waits for viewers to take the finished picture.
const FINAL_WAIT: Duration = Duration::from_secs(2);

/// Which viewers there are to be.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// What the picture is called.
    pub name: String,
    /// When the render ends whatever is missing.
    pub time_limit: Option<Duration>,
    /// Where tev listens.
    pub tev: Option<TevOptions>,
    /// Where the page is served.
    pub preview: Option<PreviewOptions>,
}

/// The viewers of a render.
pub struct Live {
    statistics: Arc<Statistics>,
    pace: Pace,
    tev: Option<Tev>,
    preview: Option<Preview>,
}

impl Live {
    /// Starts the threads of the viewers.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if the page cannot be served at the requested address and port. A tev that is not
    /// running is no error.
    pub fn new(options: Options) -> Result<Self> {
        let statistics = Arc::new(Statistics::new(options.time_limit));
        let preview = options
            .preview
            .map(|preview| Preview::new(&preview, options.name.clone(), Arc::clone(&statistics)))
            .transpose()?;
        let tev = options.tev.map(|tev| Tev::new(tev, &options.name));
        Ok(Self { statistics, pace: Pace::default(), tev, preview })
    }

    /// Where the page is served, if it is.
    pub fn preview_url(&self) -> Option<String> {
        self.preview.as_ref().map(Preview::url)
    }

    /// Shows the finished picture, and waits about two seconds at most for connected viewers to take it.
    pub fn show_final(&self, image: &Image, spp: u32) {
        if self.tev.is_none() && self.preview.is_none() {
            return;
        }
        self.statistics.end();
        let snapshot = Arc::new(Snapshot::new(image, spp));
        let deadline = Instant::now() + FINAL_WAIT;
        // Both get it before either is waited for.
        if let Some(tev) = &self.tev {
            tev.offer_final(&snapshot);
        }
        if let Some(preview) = &self.preview {
            preview.show_final(&snapshot);
            preview.wait(deadline);
        }
        if let Some(tev) = &self.tev {
            tev.wait(deadline);
        }
    }
}

impl Progress for Live {
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        self.statistics.start(samples_per_pixel, pixels);
    }

    fn plan(&self, samples: u64, error: f64, target: f64) {
        self.statistics.plan(samples, error, target);
    }

    fn tile_done(&self, samples: u64) {
        self.statistics.add(samples);
    }

    fn needs_picture(&self) -> bool {
        let is_needed = self.tev.as_ref().is_some_and(Tev::needs_picture)
            || self.preview.as_ref().is_some_and(Preview::needs_picture);
        is_needed && self.pace.may_request()
    }

    fn picture(&self, image: &Image, samples_per_pixel: u32) {
        // A viewer that is not ready for it yet would only drop it for a later one.
        let tev = self.tev.as_ref().filter(|tev| tev.needs_picture());
        let preview = self.preview.as_ref().filter(|preview| preview.needs_picture());
        if tev.is_none() && preview.is_none() {
            return;
        }
        let snapshot = Arc::new(Snapshot::new(image, samples_per_pixel));
        self.pace.made();
        if let Some(tev) = tev {
            tev.offer(&snapshot);
        }
        if let Some(preview) = preview {
            preview.show(&snapshot);
        }
    }

    fn finish(&self) {
        self.statistics.end();
    }
}
