//! Many directions of an image at once: where they look is found side by side, and the lookups, which wait for memory, follow one another
//! closely.

use super::{Chosen, EnvironmentMap, Location, far_away};
use crate::light::{FoundBy, InfinityEval, LightSample};
use crate::math::Vec3;
use crate::math::rows::BATCH;
use crate::math::vectorize::{Kernel, vectorize};
use crate::sampling::PiecewiseCell;

const NOWHERE: Location = Location { x: 0, y: 0, within: [0.0; 2] };

impl EnvironmentMap {
    /// [`Environment::eval`](super::Environment::eval) for as many unit directions as there are places for the results.
    pub fn eval_batch(&self, directions: &[Vec3], found_by: FoundBy, evals: &mut [InfinityEval]) {
        let mut locations = [NOWHERE; BATCH];
        for (directions, evals) in directions.chunks(BATCH).zip(evals.chunks_mut(BATCH)) {
            vectorize(Locate { map: self, directions, locations: &mut locations });
            for (&at, eval) in locations.iter().zip(evals) {
                *eval = InfinityEval { radiance: self.lookup(at), pdf: self.pdf(at, found_by) };
            }
        }
    }

    /// [`Environment::sample`](super::Environment::sample) for as many pairs of numbers as there are places for the results.
    pub fn sample_batch(&self, us: &[[f32; 2]], found_by: FoundBy, samples: &mut [Option<LightSample>]) {
        let Some(density) = self.density(found_by) else {
            samples.fill(None);
            return;
        };
        let mut cells = [PiecewiseCell::default(); BATCH];
        let mut chosen = [Chosen { wi: Vec3::ZERO, at: NOWHERE, pdf: 0.0 }; BATCH];
        for (us, samples) in us.chunks(BATCH).zip(samples.chunks_mut(BATCH)) {
            density.sample_cells(us, &mut cells);
            vectorize(ChooseDirections { map: self, cells: &cells[..us.len()], chosen: &mut chosen });
            for (chosen, sample) in chosen.iter().zip(samples) {
                *sample = Some(far_away(chosen.wi, self.lookup(chosen.at), chosen.pdf));
            }
        }
    }
}

struct Locate<'a> {
    map: &'a EnvironmentMap,
    directions: &'a [Vec3],
    locations: &'a mut [Location; BATCH],
}

impl Kernel for Locate<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (location, &direction) in self.locations.iter_mut().zip(self.directions) {
            *location = self.map.locate(direction);
        }
    }
}

struct ChooseDirections<'a> {
    map: &'a EnvironmentMap,
    cells: &'a [PiecewiseCell],
    chosen: &'a mut [Chosen; BATCH],
}

impl Kernel for ChooseDirections<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (chosen, cell) in self.chosen.iter_mut().zip(self.cells) {
            *chosen = self.map.direction_in(cell);
        }
    }
}
