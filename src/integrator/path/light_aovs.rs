//! What light AOVs and AOVs of surfaces beyond the first need to know of paths; empty where none is requested.

use super::wave::set_or_push;
use super::{Context, PathIntegrator};
use crate::color::Rgb;
use crate::id::LightId;
use crate::integrator::light_events::{LightEvent, LobeWeights};

/// A path that is compacted, by its indices in the wave.
#[derive(Clone, Copy)]
pub(super) struct PathMove {
    pub from: usize,
    pub to: usize,
}

/// State beside paths and shadow rays.
#[derive(Default)]
pub(super) struct LightAovs {
    /// By path, how it left its first surface; only for AOVs by scattering.
    lobes: Vec<LobeWeights>,
    /// By path, the throughput of the mirrors and clear glass that are all it has met; only for features.
    features: Vec<Option<Rgb>>,
    /// By shadow ray.
    pub shadow_sources: Vec<(LightEvent, LightId)>,
}

impl LightAovs {
    /// Starts with `paths` camera rays.
    pub fn start(&mut self, config: &PathIntegrator, paths: usize) {
        self.lobes.clear();
        self.shadow_sources.clear();
        self.features.clear();
        if config.surface_aovs.features {
            self.features.resize(paths, Some(Rgb::WHITE));
        }
    }

    /// The class of light that was scattered `scatterings` times before it meets a path; `straight` if none.
    pub fn event(&self, scatterings: u32, path: usize, straight: LightEvent) -> LightEvent {
        match (scatterings, self.lobes.get(path)) {
            (1, Some(&lobes)) => LightEvent::Direct(lobes),
            (2.., Some(&lobes)) => LightEvent::Indirect(lobes),
            _ => straight,
        }
    }

    /// The class of light that a shadow ray from a path's vertex finds, scattered `scatterings` times before, which the
    /// vertex scatters with these weights of lobes.
    pub fn shadow_event(
        &self,
        context: &Context,
        path: usize,
        scatterings: u32,
        lobes: impl FnOnce() -> LobeWeights,
    ) -> LightEvent {
        // Without AOVs by scattering, any class will do.
        let is_first = context.bounce == 0 && context.config.light_aovs.by_scattering;
        match (is_first, scatterings) {
            (true, 0) => LightEvent::Direct(lobes()),
            (true, _) => LightEvent::Indirect(lobes()),
            (false, _) => self.event(context.bounce + 1 + scatterings, path, LightEvent::Emission),
        }
    }

    /// How a path left its first surface; `None` at that surface, and without AOVs by scattering.
    pub fn lobes(&self, path: usize) -> Option<LobeWeights> {
        self.lobes.get(path).copied()
    }

    /// Sets the state of a path that begins at a vertex of another.
    pub fn start_branch(&mut self, context: &Context, path: usize, lobes: LobeWeights) {
        if context.config.light_aovs.by_scattering {
            set_or_push(&mut self.lobes, path, lobes);
        }
        if context.config.surface_aovs.features {
            set_or_push(&mut self.features, path, None);
        }
    }

    /// Moves the state of a path to its compacted index, after a vertex that scattered it so.
    pub fn append(
        &mut self,
        context: &Context,
        PathMove { from, to }: PathMove,
        lobes: impl FnOnce() -> LobeWeights,
        feature_factor: impl FnOnce() -> Option<Rgb>,
    ) {
        if context.config.light_aovs.by_scattering {
            if context.bounce == 0 {
                self.lobes.push(lobes());
            } else {
                self.lobes[to] = self.lobes[from];
            }
        }
        if let Some(&before) = self.features.get(from) {
            self.features[to] = before.and_then(|before| feature_factor().map(|factor| before * factor));
        }
    }

    /// The throughput of the mirrors and clear glass that are all the path has met; `None` after anything else.
    #[inline]
    pub fn feature_throughput(&self, path: usize) -> Option<Rgb> {
        self.features.get(path).copied().flatten()
    }

    /// Multiplies the state of a path by the transmittance of a medium.
    pub fn absorb(&mut self, path: usize, transmittance: Rgb) {
        if let Some(Some(throughput)) = self.features.get_mut(path) {
            *throughput *= transmittance;
        }
    }
}
