//! What pilot paths find after each scattering, for Russian roulette.

use std::ops::Range;

use super::block::{Vertices, spawn};
use super::radiance::Output;
use super::wave::PathRows;
use crate::color::Rgb;
use crate::id::LightId;
use crate::integrator::{Continuation, DistantRay, PilotRecords};
use crate::math::{Ray, Vec3};

/// Rays of a vertex beyond the recorded one: the ray that goes on and the shadow ray.
const RAYS_OF_VERTEX: f32 = 2.0;

/// A scattering of a path.
#[derive(Clone, Copy, Debug)]
struct ScatteredPath {
    p: Vec3,
    n: Vec3,
    /// The largest channel of the throughput of the path that goes on.
    throughput: f32,
    radiance_before: Rgb,
    slot: u32,
}

/// The scatterings of a wave of pilot paths.
#[derive(Debug, Default)]
pub(super) struct ContinuationRecorder {
    is_enabled: bool,
    scattered: Vec<ScatteredPath>,
    /// How many of them have their `radiance_before`.
    marked: usize,
    shadow_rays: u64,
    unoccluded: u64,
    /// The shadow rays of the wave that are towards the first lights of first vertices.
    first_lights: Vec<Range<usize>>,
    /// Those along specular reflections.
    specular: Vec<Range<usize>>,
    /// What they bring less what those towards the second lights bring, by sample.
    light_differences: Vec<f32>,
    /// By shadow ray of the wave, its light.
    lights: Vec<LightId>,
    distant_rays: Vec<DistantRay>,
    near_contribution: f64,
}

impl ContinuationRecorder {
    /// For the next wave.
    pub fn enable(&mut self) {
        *self = Self { is_enabled: true, ..Self::default() };
    }

    /// Records the paths that go on.
    pub fn record(&mut self, vertices: &Vertices, paths: &PathRows) {
        if !self.is_enabled {
            return;
        }
        let scatter = &vertices.scatter;
        for lane in (0..vertices.count).filter(|&lane| scatter.status[lane] == spawn::SPAWNED) {
            self.scattered.push(ScatteredPath {
                p: vertices.points.p.get(lane).as_vec3(),
                n: vertices.facing_normal(lane),
                throughput: scatter.throughput.get(lane).max_channel(),
                radiance_before: Rgb::BLACK,
                slot: paths.slot[vertices.path(lane)],
            });
        }
    }

    /// Counts the shadow rays of a block's vertices.
    pub fn count_shadow_rays(&mut self, vertices: &Vertices) {
        if self.is_enabled {
            let status = &vertices.direct.status[..vertices.count];
            self.shadow_rays += status.iter().filter(|&&status| status == spawn::SPAWNED).count() as u64;
        }
    }

    /// Keeps the lights of shadow rays of the wave, in their order.
    pub fn keep_lights(&mut self, lights: impl Iterator<Item = LightId>) {
        if self.is_enabled {
            self.lights.extend(lights);
        }
    }

    /// Records the light of a shadow ray of the wave that nothing blocks.
    pub fn add_shadow_ray(&mut self, index: usize, ray: &Ray, light: Rgb) {
        let Some(&id) = self.lights.get(index) else { return };
        if ray.t_max == f32::INFINITY {
            self.add_distant(id, ray, light);
        } else {
            let contribution = f64::from(light.max_channel());
            self.near_contribution += if contribution.is_finite() { contribution } else { 0.0 };
        }
    }

    /// Records the light of a light at infinity along a ray.
    pub fn add_distant(&mut self, light: LightId, ray: &Ray, added: Rgb) {
        let contribution = added.max_channel();
        if self.is_enabled && contribution > 0.0 && contribution < f32::INFINITY {
            self.distant_rays.push(DistantRay { light, p: ray.origin, wi: ray.direction, contribution });
        }
    }

    /// Whether paths are recorded.
    pub fn is_enabled(&self) -> bool {
        self.is_enabled
    }

    /// These shadow rays of the wave, all after those of calls before, are towards the first lights of first vertices.
    pub fn mark_first_lights(&mut self, rays: Range<usize>) {
        if self.is_enabled {
            self.first_lights.push(rays);
        }
    }

    /// These shadow rays of the wave, all after those of calls before, are specular reflections at first vertices.
    pub fn mark_specular(&mut self, rays: Range<usize>) {
        if self.is_enabled {
            self.specular.push(rays);
        }
    }

    /// Records what a shadow ray of a first vertex brings.
    pub fn add_direct(&mut self, ray: usize, slot: u32, light: Rgb) {
        if !self.is_enabled {
            return;
        }
        let is_in = |ranges: &[Range<usize>]| {
            let range = ranges.partition_point(|range| range.end <= ray);
            ranges.get(range).is_some_and(|range| range.contains(&ray))
        };
        if is_in(&self.specular) {
            return;
        }
        let is_first = is_in(&self.first_lights);
        let slot = slot as usize;
        if self.light_differences.len() <= slot {
            self.light_differences.resize(slot + 1, 0.0);
        }
        self.light_differences[slot] += if is_first { light.max_channel() } else { -light.max_channel() };
    }

    /// Counts shadow rays that reached their lights.
    pub fn count_unoccluded(&mut self, count: usize) {
        self.unoccluded += count as u64;
    }

    /// All that is added to the samples from here on came by the rays that were recorded last.
    pub fn mark_radiance(&mut self, out: &Output) {
        for path in &mut self.scattered[self.marked..] {
            path.radiance_before = out.batch.pixels[path.slot as usize].radiance;
        }
        self.marked = self.scattered.len();
        self.lights.clear();
    }

    /// Appends what the wave of `samples` samples has found, and records no longer.
    pub fn finish(&mut self, out: &Output, samples: usize, records: &mut PilotRecords) {
        let mut later = vec![0.0; samples];
        for path in self.scattered.iter().rev() {
            let later = &mut later[path.slot as usize];
            *later += RAYS_OF_VERTEX;
            let found = out.batch.pixels[path.slot as usize].radiance - path.radiance_before;
            let radiance = found.max_channel().max(0.0) / path.throughput;
            records.continuations.push(Continuation { p: path.p, n: path.n, radiance, rays: *later });
        }
        records.shadow_rays += self.shadow_rays;
        records.unoccluded += self.unoccluded;
        records.further_shadow_rays += self.first_lights.iter().map(|range| range.len() as u64).sum::<u64>();
        self.light_differences.resize(samples, 0.0);
        records.light_differences.append(&mut self.light_differences);
        records.distant_rays.append(&mut self.distant_rays);
        records.near_contribution += self.near_contribution;
        *self = Self::default();
    }
}
