//! What rays bring that leave the scene, looked up in an image for many of them at once.

use super::{Path, PathIntegrator};
use crate::color::Rgb;
use crate::geometry::Hit;
use crate::id::LightId;
use crate::integrator::World;
use crate::light::{FoundBy, InfinityEval};
use crate::math::rows::BATCH;
use crate::math::{Ray, Vec3};

/// What the rays of a batch bring that have left the scene, if only an image is there.
pub(super) struct Escapes {
    /// Whether it has been looked up.
    known: bool,
    /// By escaped ray.
    directions: Vec<Vec3>,
    evals: [InfinityEval; BATCH],
    /// By ray: how many before it have escaped.
    index_of: [u8; BATCH],
}

impl Default for Escapes {
    fn default() -> Self {
        Self { known: false, directions: Vec::with_capacity(BATCH), evals: [InfinityEval::default(); BATCH], index_of: [0; BATCH] }
    }
}

impl Escapes {
    /// Looks up what at most [`BATCH`] rays with these hits bring.
    #[inline]
    pub fn look(&mut self, world: &World, found_by: FoundBy, rays: &[Ray], hits: &[Option<Hit>]) {
        let image = world.scene.lights.image_at_infinity();
        self.known = image.is_some();
        if let Some((_, image)) = image {
            self.directions.clear();
            for ((ray, hit), index) in rays.iter().zip(hits).zip(&mut self.index_of) {
                *index = self.directions.len() as u8;
                if hit.is_none() {
                    self.directions.push(ray.direction);
                }
            }
            image.eval_batch(&self.directions, found_by, &mut self.evals[..self.directions.len()]);
        }
    }

    /// What an escaped ray of the batch brings, if it has been looked up.
    #[inline]
    pub fn of(&self, ray: usize, hit: Option<Hit>) -> Option<InfinityEval> {
        (self.known && hit.is_none()).then(|| self.evals[usize::from(self.index_of[ray])])
    }
}

impl PathIntegrator {
    /// Light from infinity along `direction`; `known` if it has been looked up already.
    pub(super) fn escaped(&self, world: &World, path: &Path, direction: Vec3, known: Option<InfinityEval>) -> Rgb {
        let mut radiance = Rgb::BLACK;
        for &id in world.scene.lights.at_infinity() {
            radiance += self.escaped_from(world, path, direction, id, known);
        }
        radiance
    }

    /// Light from a light at infinity along `direction`; `known` if it has been looked up already.
    #[inline(always)]
    pub(super) fn escaped_from(&self, world: &World, path: &Path, direction: Vec3, id: LightId, known: Option<InfinityEval>) -> Rgb {
        let found_by = self.strategy.found_by();
        let found = known.unwrap_or_else(|| world.scene.lights.get(id).eval_at_infinity(direction, found_by));
        if found.radiance.is_black() {
            return Rgb::BLACK;
        }
        found.radiance * self.found_by_chance(path, found.pdf * world.scene.lights.pmf(id, &path.from, found_by))
    }
}
