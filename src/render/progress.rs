//! Progress of a render.

use crate::film::Image;

/// Listens to a render. Every method may be called from any thread; all do nothing by default.
pub trait Progress: Sync {
    /// The render starts: samples per pixel at most, and number of pixels.
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        let _ = (samples_per_pixel, pixels);
    }

    /// The number of samples in all changed: the picture's error is `error`, and its target `target`.
    fn plan(&self, samples: u64, error: f64, target: f64) {
        let _ = (samples, error, target);
    }

    /// `samples` samples, all pixels together, are there already from an earlier run.
    fn resumed(&self, samples: u64) {
        let _ = samples;
    }

    /// A tile got this many more samples, all pixels together.
    fn tile_done(&self, samples: u64) {
        let _ = samples;
    }

    /// Whether a picture of the samples so far is needed: called between passes. Making one takes time.
    fn needs_picture(&self) -> bool {
        false
    }

    /// The picture so far, with its samples per pixel (their mean, rounded down).
    fn picture(&self, image: &Image, samples_per_pixel: u32) {
        let _ = (image, samples_per_pixel);
    }

    /// No more samples will come. The picture is not written yet.
    fn finish(&self) {}

    /// A message that is no warning.
    fn note(&self, message: &str) {
        let _ = message;
    }

    /// A warning.
    fn warn(&self, message: &str) {
        let _ = message;
    }
}

/// Reports nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}
