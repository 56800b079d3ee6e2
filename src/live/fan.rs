//! Several listeners to one render.

use crate::film::Image;
use crate::render::Progress;

/// Forwards every event to all listeners.
pub struct Fan<'a> {
    listeners: Vec<&'a dyn Progress>,
}

impl<'a> Fan<'a> {
    /// For these listeners, notified in this order.
    pub fn new(listeners: impl IntoIterator<Item = &'a dyn Progress>) -> Self {
        Self { listeners: listeners.into_iter().collect() }
    }
}

impl Progress for Fan<'_> {
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        self.listeners.iter().for_each(|listener| listener.start(samples_per_pixel, pixels));
    }

    fn plan(&self, samples: u64, error: f64, target: f64) {
        self.listeners.iter().for_each(|listener| listener.plan(samples, error, target));
    }

    fn resumed(&self, samples: u64) {
        self.listeners.iter().for_each(|listener| listener.resumed(samples));
    }

    fn tile_done(&self, samples: u64) {
        self.listeners.iter().for_each(|listener| listener.tile_done(samples));
    }

    fn finish(&self) {
        self.listeners.iter().for_each(|listener| listener.finish());
    }

    fn note(&self, message: &str) {
        self.listeners.iter().for_each(|listener| listener.note(message));
    }

    fn warn(&self, message: &str) {
        self.listeners.iter().for_each(|listener| listener.warn(message));
    }

    fn needs_picture(&self) -> bool {
        self.listeners.iter().any(|listener| listener.needs_picture())
    }

    fn picture(&self, image: &Image, spp: u32) {
        self.listeners.iter().for_each(|listener| listener.picture(image, spp));
    }
}
