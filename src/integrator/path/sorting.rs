//! What layers that are parts of the picture, and those of surfaces beyond the first, need to know of paths under way. Nothing is kept for layers
//! that nobody asked for.

use super::{Path, PathIntegrator};
use crate::bsdf::{Bsdf, BsdfSample};
use crate::color::Rgb;
use crate::film::{PartNeeds, SampleBatch};
use crate::geometry::{Hit, SurfaceInteraction};
use crate::id::LightId;
use crate::integrator::parts::{Course, Way, add_by_group, add_by_scattering, group_of};
use crate::integrator::surface::{place_sample, set_features};
use crate::integrator::{SurfaceNeeds, World};
use crate::light::InfinityEval;
use crate::math::Vec3;

/// Beside paths and the light that is pending.
#[derive(Default)]
pub(super) struct Sorting {
    /// By path, how it left its first surface; empty unless parts by scattering are wanted.
    ways: Vec<Way>,
    /// By path, while it has met nothing but mirrors and clear glass, what these leave; empty unless features are wanted.
    clear: Vec<Option<Rgb>>,
    /// By light that is pending; empty unless parts are wanted.
    pending: Vec<(Course, u32)>,
}

impl Sorting {
    /// Starts anew with so many paths.
    pub fn begin(&mut self, integrator: &PathIntegrator, paths: usize) {
        self.ways.clear();
        self.pending.clear();
        self.clear.clear();
        if integrator.needs.features {
            self.clear.resize(paths, Some(Rgb::WHITE));
        }
    }

    /// Forgets what was pending.
    pub fn clear_pending(&mut self) {
        self.pending.clear();
    }

    /// The course of light that was scattered so many times when it meets the path `i`.
    fn course(&self, scatterings: u32, i: usize, straight: Course) -> Course {
        match (scatterings, self.ways.get(i)) {
            (1, Some(&way)) => Course::Direct(way),
            (2.., Some(&way)) => Course::Indirect(way),
            _ => straight,
        }
    }

    /// Takes note of the light pending last, which the path `i` has found at its vertex number `bounce`: there it goes `way`, if that is the first.
    pub fn push_pending(&mut self, needs: PartNeeds, bounce: u32, [i, group]: [usize; 2], way: impl FnOnce() -> Way) {
        // Without layers by scattering, any course will do.
        let first = bounce == 0 && needs.by_scattering;
        let course = if first { Course::Direct(way()) } else { self.course(bounce + 1, i, Course::Emission) };
        self.pending.push((course, group as u32));
    }

    /// The path `i` becomes the path `alive`, if not its first vertex then by scattering that leaves it `clear`.
    #[inline]
    pub fn follow(
        &mut self,
        needs: PartNeeds,
        bounce: u32,
        [i, alive]: [usize; 2],
        way: impl FnOnce() -> Way,
        clear: impl FnOnce() -> Option<Rgb>,
    ) {
        if needs.by_scattering {
            if bounce == 0 {
                self.ways.push(way());
            } else {
                self.ways[alive] = self.ways[i];
            }
        }
        if let Some(&before) = self.clear.get(i) {
            self.clear[alive] = before.and_then(|before| clear().map(|factor| before * factor));
        }
    }

    /// What the mirrors and clear glass leave that are all that the path `i` has met.
    #[inline]
    pub fn clear_of(&self, i: usize) -> Option<Rgb> {
        self.clear.get(i).copied().flatten()
    }

    /// Light in a medium on the way to the path `i` is absorbed.
    pub fn absorb(&mut self, i: usize, transmittance: Rgb) {
        if let Some(Some(clear)) = self.clear.get_mut(i) {
            *clear *= transmittance;
        }
    }
}

/// What a vertex that scatters so leaves of a view through it; `None` where the view ends.
pub(super) fn seen_through(bsdf: &Bsdf, sample: &BsdfSample) -> Option<Rgb> {
    // Radiance is scaled by refraction, albedo is not.
    (bsdf.is_delta() && sample.is_delta).then(|| sample.weight * (sample.eta * sample.eta))
}

impl PathIntegrator {
    /// Whether light is to be sorted at all.
    #[inline]
    pub(super) fn sorts(&self) -> bool {
        self.parts.count() > 0
    }

    /// Adds the light pending whose way was free to its parts.
    pub(super) fn sort_pending<'a>(&self, sorting: &Sorting, pending: impl Iterator<Item = ((u32, Rgb), &'a bool)>, out: &mut SampleBatch) {
        for (((slot, light), occluded), &(course, group)) in pending.zip(&sorting.pending) {
            if !occluded {
                let parts = out.parts_mut(slot as usize);
                add_by_scattering(self.parts, parts, light, course);
                add_by_group(self.parts, parts, light, group as usize);
            }
        }
    }

    /// Adds light that the path `i` brings from a surface at its vertex number `bounce` to its parts.
    #[inline(never)]
    pub(super) fn sort_emitted(
        &self,
        world: &World,
        (sorting, i): (&Sorting, usize),
        at: &SurfaceInteraction,
        (slot, bounce): (u32, u32),
        light: Rgb,
        out: &mut SampleBatch,
    ) {
        let Some(id) = world.scene.surface(at.shape).light(at.prim) else { return };
        let parts = out.parts_mut(slot as usize);
        add_by_scattering(self.parts, parts, light, sorting.course(bounce, i, Course::Emission));
        add_by_group(self.parts, parts, light, group_of(world.scene, id));
    }

    /// Adds `light`, which the path `i` brings from infinity after so many bounces, to its parts.
    #[inline(never)]
    pub(super) fn sort_escaped(
        &self,
        world: &World,
        (sorting, i): (&Sorting, usize),
        (path, bounce): (&Path, u32),
        (direction, known): (Vec3, Option<InfinityEval>),
        light: Rgb,
        out: &mut SampleBatch,
    ) {
        let parts = out.parts_mut(path.slot as usize);
        add_by_scattering(self.parts, parts, light, sorting.course(bounce, i, Course::Background));
        let lights = world.scene.lights.at_infinity();
        match lights {
            [] => {}
            [id] => add_by_group(self.parts, parts, light, group_of(world.scene, *id)),
            _ => {
                let brings = |id: LightId| path.throughput * self.escaped_from(world, path, direction, id, known);
                let all = lights.iter().fold(Rgb::BLACK, |sum, &id| sum + brings(id));
                let scale = if all.max_channel() > 0.0 { light.max_channel() / all.max_channel() } else { 0.0 };
                for &id in lights {
                    add_by_group(self.parts, parts, brings(id) * scale, group_of(world.scene, id));
                }
            }
        }
    }

    /// What layers of surfaces show where the path `i`, which has met nothing but mirrors and clear glass, leaves the scene: to denoisers, what
    /// is there to see, as far as it is not brighter than white.
    #[inline(never)]
    pub(super) fn note_escape(
        &self,
        world: &World,
        clear: Option<Rgb>,
        (path, bounce): (&Path, u32),
        (direction, known): (Vec3, Option<InfinityEval>),
        out: &mut SampleBatch,
    ) {
        let surface = &mut out.surfaces[path.slot as usize];
        if bounce == 0 && self.needs.motion {
            surface.motion = world.motion_at_infinity(direction).to_array();
        }
        if let Some(clear) = clear {
            let shown = bounce > 0 || !self.hide_emitters;
            let radiance = if shown { self.escaped(world, path, direction, known) } else { Rgb::BLACK };
            set_features(surface, clear, radiance.map(|value| value.min(1.0)), Vec3::ZERO);
        }
    }

    /// `clear` if layers of surfaces show a surface that a path meets after so many bounces: the first one, or one behind mirrors and clear glass.
    #[inline]
    pub(super) fn notes_surface(&self, bounce: u32, clear: Option<Rgb>) -> Option<Option<Rgb>> {
        (clear.is_some() || (bounce == 0 && self.needs != SurfaceNeeds::default())).then_some(clear)
    }

    /// What layers of surfaces show of a surface of this albedo that the path with this `slot` meets after so many bounces; mirrors and clear
    /// glass on the way leave `clear`, if it has met nothing else.
    #[inline(never)]
    pub(super) fn note_surface(
        &self,
        world: &World,
        (bounce, clear, slot): (u32, Option<Rgb>, u32),
        (at, hit): (&SurfaceInteraction, Option<&Hit>),
        albedo: impl FnOnce() -> Rgb,
        out: &mut SampleBatch,
    ) {
        let surface = &mut out.surfaces[slot as usize];
        if bounce == 0 {
            *surface = place_sample(world, self.needs, at, hit);
        }
        if clear.is_some() || self.needs.albedo {
            let albedo = albedo();
            if bounce == 0 {
                surface.albedo = albedo;
            }
            if let Some(clear) = clear {
                set_features(surface, clear, albedo, at.n_s);
            }
        }
    }
}
