//! Guided renders: every iteration has as many samples as all before it, whose incident radiance guides its paths.
//!
//! Later iterations are better than earlier ones, so they are averaged with [`IterationWeights`].

use super::iteration_weights::{Gain, IterationWeights, mean};
use super::training_schedule::{Training, is_refinement, next_refinement};
use crate::bytes::{ByteReader, ByteWriter};
use crate::error::Result;
use crate::film::{Film, LayerKind};
use crate::guiding::Guide;
use crate::math::Aabb;
use crate::render::TILE_SIZE;

/// Iterations of at least this many samples decide whether guiding goes on: their variance times rays must be so much
/// less than without.
const MIN_GAINS: [(u32, f64); 2] = [(8, 1.2), (16, GUIDED_COST)];

/// The same where samples are compared with unguided ones after a pilot, in every iteration: the variance of few
/// samples does not show how well Sobol points spread more of them without a guide.
const MIN_COMPARED_GAIN: f64 = 2.2;

/// The same of the pixels without the most noise: where they lose, the gain is but that of rare bright paths.
const MIN_TRIMMED_GAIN: f64 = 0.9;

/// Time of a ray of a guided path over that of another, about, learning included: from 1.2 under many lights to 1.9 in
/// a Cornell box.
const GUIDED_COST: f64 = 1.9;

/// Whether guiding goes on after an iteration of `samples` samples per pixel, `done` together, with this gain.
fn is_worth_it(training: Training, samples: u32, done: u32, gain: Gain) -> bool {
    match training {
        Training::HalfOfSamples => MIN_GAINS.iter().all(|&(least, min_gain)| samples < least || gain.all >= min_gain),
        Training::FixedNumber => {
            let pays = gain.all >= MIN_COMPARED_GAIN && gain.trimmed >= MIN_TRIMMED_GAIN;
            pays || !training.is_compared(done)
        }
    }
}

/// A film like that of a render for the samples of an iteration, with what their weights depend on.
fn iteration(film: &Film) -> Result<Film> {
    let mut shape = film.shape().clone();
    shape.layers.insert(LayerKind::Variance);
    Film::new(shape, TILE_SIZE)
}

/// The guide, and the samples that have no weight yet.
#[derive(Clone, Debug)]
pub(in crate::render) struct GuidedPlanner {
    /// `None` once guiding has ended.
    pub guide: Option<Guide>,
    /// The samples of the iteration under way; all before are in the film of the render.
    pub iteration: Film,
    /// Samples per pixel of all iterations before.
    pub merged: u32,
    /// Rays of the iteration under way.
    pub rays: u64,
    weights: IterationWeights,
    training: Training,
}

impl GuidedPlanner {
    /// Of a render that begins, whose film this is.
    pub fn new(film: &Film) -> Result<Self> {
        let guide = Guide::new(Aabb::EMPTY, 0.0);
        let weights = IterationWeights::new(film);
        Ok(Self {
            guide: Some(guide),
            iteration: iteration(film)?,
            merged: 0,
            rays: 0,
            weights,
            training: Training::HalfOfSamples,
        })
    }

    /// With a guide that has learned from the `done` samples per pixel of the film. `None` if there is no memory for
    /// the samples of an iteration.
    pub fn trained(film: &Film, guide: Guide, done: u32) -> Option<Self> {
        Some(Self {
            guide: Some(guide),
            iteration: iteration(film).ok()?,
            merged: done,
            rays: 0,
            weights: IterationWeights::new(film),
            training: Training::FixedNumber,
        })
    }

    /// How many samples per pixel after the first `done` have the present guide and one weight.
    pub fn samples_with_this_guide(&self, done: u32) -> u32 {
        let end = self.training.iteration_end(done);
        let end = if self.guide.is_some() { end.min(next_refinement(done)) } else { end };
        end.saturating_sub(done)
    }

    /// Whether the guide is used for the sample with this index.
    pub fn guides(&self, sample: u32) -> bool {
        self.training.guides(sample)
    }

    /// Whether the comparison after a pilot has ended guiding. All samples then have one weight, and nothing is left to
    /// plan.
    pub fn is_over(&self) -> bool {
        self.guide.is_none() && !self.training.weighs(self.merged)
    }

    /// Whether the guide learns from the sample with this index. One that is used until the end does not.
    pub fn learns(&self, sample: u32, spp: u32) -> bool {
        next_refinement(sample) <= self.training.last_refinement(spp)
    }

    /// Every pixel has `done` samples: refines the guide and ends the iteration, if that is due.
    pub fn complete_samples(&mut self, film: &mut Film, done: u32, spp: u32) {
        if let Some(guide) =
            self.guide.as_mut().filter(|_| is_refinement(done) && done <= self.training.last_refinement(spp))
        {
            *guide = guide.refined(done);
            if !guide.has_radiance_scale() {
                guide.set_typical(mean(&self.iteration) as f32);
            }
        }
        // More samples may follow later.
        let is_last = self.training == Training::HalfOfSamples && done == spp;
        if is_last || done == self.training.iteration_end(self.merged) {
            self.complete_iteration(film, done);
        }
    }

    /// Adds the iteration to the film, and ends guiding if it is not worth its cost.
    fn complete_iteration(&mut self, film: &mut Film, done: u32) {
        let samples = done - self.merged;
        let gain = self.weights.add(film, &self.iteration, [samples, done], self.rays, self.training.weighs(done));
        if let Some(guide) = &self.guide {
            let (leaves, nodes) = (guide.leaves(), guide.directional_nodes());
            tracing::debug!(
                "guided: iteration of {samples} samples, {:.2} times as good as the first ({:.2} trimmed); \
                 {leaves} leaves, {nodes} nodes",
                gain.all,
                gain.trimmed
            );
        }
        if self.merged > 0 && !is_worth_it(self.training, samples, done, gain) && self.guide.take().is_some() {
            tracing::info!("guiding does not pay and ends after {done} samples per pixel");
        }
        self.merged = done;
        self.clear_iteration();
    }

    fn clear_iteration(&mut self) {
        self.iteration.tiles_mut().iter_mut().for_each(|tile| *tile = tile.empty());
        self.rays = 0;
    }

    /// Drops the samples of the iteration under way; the result is how many samples every pixel has left.
    pub fn discard_iteration(&mut self) -> u32 {
        self.clear_iteration();
        self.merged
    }

    /// The film of the render together with the iteration under way.
    pub fn whole_film(&self, film: &Film, done: u32) -> Film {
        let mut whole = film.clone();
        let (samples, is_weighed) = (done - self.merged, self.training.weighs(done));
        self.weights.clone().add(&mut whole, &self.iteration, [samples, done], self.rays, is_weighed);
        whole
    }

    /// All but the film, as bytes.
    pub fn save(&self) -> Vec<u8> {
        let mut out = ByteWriter::default();
        let is_fixed = u32::from(self.training == Training::FixedNumber);
        out.integers(&[self.merged, u32::from(self.guide.is_some()), is_fixed]);
        out.long(self.rays);
        self.weights.write(&mut out);
        if let Some(guide) = &self.guide {
            guide.write(&mut out);
        }
        out.into_bytes()
    }

    /// Takes what [`save`](Self::save) gave after `done` samples per pixel for a film of the same shape; `None` if it
    /// is something else.
    pub fn load(&mut self, bytes: &[u8], done: u32) -> Option<()> {
        let mut data = ByteReader::new(bytes);
        let [merged, has_guide, is_fixed] = data.integers()?.try_into().ok()?;
        let training = if is_fixed == 1 { Training::FixedNumber } else { Training::HalfOfSamples };
        if has_guide.max(is_fixed) > 1 || !(merged == done || merged == training.iteration_start(done)) {
            return None;
        }
        self.training = training;
        self.merged = merged;
        self.rays = data.long()?;
        self.weights = IterationWeights::read(&mut data, &self.iteration)?;
        self.guide = if has_guide == 1 { Some(Guide::read(&mut data)?) } else { None };
        data.is_empty().then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guiding_goes_on_where_the_trimmed_variance_does_not_grow_either() {
        let goes_on = |all, trimmed| is_worth_it(Training::FixedNumber, 4, 12, Gain { all, trimmed });
        // A room behind a door ajar, Veach's room of lamps and glass.
        assert!(goes_on(3.15, 2.21) && goes_on(5.19, 1.79) && goes_on(3.51, 1.04));
        // A Cornell box, and one with a dragon of glass, where the gain is that of caustics met by chance.
        assert!(!goes_on(1.6, 1.47) && !goes_on(3.29, 0.78) && !goes_on(1.92, 0.06));
        // Samples without guide are not compared with each other.
        assert!(is_worth_it(Training::FixedNumber, 4, 8, Gain { all: 0.5, trimmed: 0.5 }));
        let by_request = |samples, all| is_worth_it(Training::HalfOfSamples, samples, 16, Gain { all, trimmed: 0.1 });
        assert!(by_request(4, 0.5) && by_request(8, 1.3) && !by_request(8, 1.1) && !by_request(16, 1.8));
    }
}
