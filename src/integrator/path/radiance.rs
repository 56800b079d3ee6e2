//! The only writer of radiance: the picture, and the light AOVs that it is divided into.

use super::Context;
use crate::color::Rgb;
use crate::film::SampleBatch;
use crate::id::LightId;
use crate::integrator::light_events::{LightEvent, add_by_group, add_by_scattering, group_of};

/// The samples of a wave.
pub(super) struct Output<'a> {
    pub batch: &'a mut SampleBatch,
}

impl Output<'_> {
    /// Adds light to a sample.
    #[inline(always)]
    pub fn add(&mut self, slot: u32, light: Rgb) {
        self.batch.pixels[slot as usize].radiance += light;
    }

    /// Adds light of one light to the light AOVs of a sample.
    pub fn add_to_light_aovs(&mut self, context: &Context, slot: u32, light: Rgb, event: LightEvent, id: LightId) {
        self.add_by_scattering(slot, light, event);
        self.add_to_group_of(context, slot, light, id);
    }

    /// Adds light that no light of the scene gives to a sample and its light AOVs.
    pub fn add_without_light(&mut self, context: &Context, slot: u32, light: Rgb, event: LightEvent) {
        self.add(slot, light);
        if context.config.needs_light_aovs() {
            self.add_by_scattering(slot, light, event);
            let last = context.scene.light_groups.names().len();
            add_by_group(&mut self.batch.light_aovs, slot as usize, light, last);
        }
    }

    /// Adds light to the light AOVs by scattering of a sample.
    pub fn add_by_scattering(&mut self, slot: u32, light: Rgb, event: LightEvent) {
        add_by_scattering(&mut self.batch.light_aovs, slot as usize, light, event);
    }

    /// Adds light to the AOV of the group that has the light `id`.
    pub fn add_to_group_of(&mut self, context: &Context, slot: u32, light: Rgb, id: LightId) {
        add_by_group(&mut self.batch.light_aovs, slot as usize, light, group_of(context.scene, id));
    }
}
