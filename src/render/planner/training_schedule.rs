//! When a guide is refined, and which samples share a weight. Both follow from the number of samples alone, so that a
//! render that is resumed anywhere has the guides and the weights of one run.

/// Samples per pixel of the first iteration. One estimates how bright the scene is, the other is learned from.
const FIRST_ITERATION: u32 = 2;

/// How often the guide is refined while the samples double, at most.
const REFINEMENTS: u32 = 4;

/// Samples per pixel that a guide learns from, if that does not depend on their number.
const LEARNED_SAMPLES: u32 = 32;

/// The first sample of the iteration that the sample with this index belongs to: each has as many samples as all before
/// it.
pub(super) fn iteration_start(sample: u32) -> u32 {
    if sample < FIRST_ITERATION { 0 } else { 1 << sample.ilog2() }
}

/// The first sample of the iteration after that.
pub(super) fn iteration_end(sample: u32) -> u32 {
    if sample < FIRST_ITERATION { FIRST_ITERATION } else { iteration_start(sample).saturating_mul(2) }
}

/// The next refinement of a guide after `done` samples per pixel, the first after one.
pub(super) fn next_refinement(done: u32) -> u32 {
    let Some(octave) = done.checked_ilog2() else { return 1 };
    let step = ((1 << octave) / REFINEMENTS).max(1);
    (done / step * step).saturating_add(step)
}

/// From which samples a guide learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Training {
    /// What the last half would learn does not pay for its records.
    HalfOfSamples,
    /// As many however many follow, so that these can be added later.
    FixedNumber,
}

impl Training {
    /// Samples after which a guide of a render with `spp` samples per pixel is no longer refined.
    pub fn last_refinement(self, spp: u32) -> u32 {
        match self {
            Self::HalfOfSamples => spp / 2,
            Self::FixedNumber => LEARNED_SAMPLES,
        }
    }
}

/// Whether a guide is refined after `done` samples per pixel.
pub(super) fn is_refinement(done: u32) -> bool {
    done > 0 && next_refinement(done - 1) == done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iterations_double_and_refinements_come_four_times_in_each() {
        let starts: Vec<u32> = (0..=9).map(iteration_start).collect();
        assert_eq!(starts, [0, 0, 2, 2, 4, 4, 4, 4, 8, 8]);
        assert_eq!([0, 1, 2, 3, 4, 9, u32::MAX].map(iteration_end), [2, 2, 4, 4, 8, 16, u32::MAX]);
        let refinements: Vec<u32> = (0..64).filter(|&done| is_refinement(done)).collect();
        assert_eq!(refinements, [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56]);
        for done in [0, 1, 7, 8, 9, 63, 1000, u32::MAX - 1] {
            assert!(next_refinement(done) > done);
        }
        assert_eq!(next_refinement(u32::MAX), u32::MAX);
    }
}
