//! When a guide is refined, and which samples share a weight. Both follow from the number of samples alone, so that a
//! render that is resumed anywhere has the guides and the weights of one run.

/// Samples per pixel of the first iteration. One estimates how bright the scene is, the other is learned from.
const FIRST_ITERATION: u32 = 2;

/// How often the guide is refined while the samples double, at most.
const REFINEMENTS: u32 = 4;

/// Samples per pixel that a guide learns from, if that does not depend on their number.
const LEARNED_SAMPLES: u32 = 128;

/// After the pilot's, iterations of as many samples per pixel without and with the guide are compared: from these
/// samples on.
pub(in crate::render) const GUIDED_START: u32 = 8;
const GUIDED_END: u32 = 12;

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
    /// The first sample of the iteration that the sample with this index belongs to: each has as many samples as all
    /// before it, but for those that are compared.
    pub fn iteration_start(self, sample: u32) -> u32 {
        match sample {
            0..FIRST_ITERATION => 0,
            GUIDED_END..16 if self == Self::FixedNumber => GUIDED_END,
            _ => 1 << sample.ilog2(),
        }
    }

    /// The first sample of the iteration after that.
    pub fn iteration_end(self, sample: u32) -> u32 {
        match sample {
            0..FIRST_ITERATION => FIRST_ITERATION,
            GUIDED_START..GUIDED_END if self == Self::FixedNumber => GUIDED_END,
            _ => (1u32 << sample.ilog2()).saturating_mul(2),
        }
    }

    /// Whether the sample with this index is guided.
    pub fn guides(self, sample: u32) -> bool {
        self == Self::HalfOfSamples || sample >= GUIDED_START
    }

    /// Whether iterations that end with `done` samples per pixel have weights. Those up to the comparison have none, so
    /// that a render whose guiding ends there goes on as if there had been none.
    pub fn weighs(self, done: u32) -> bool {
        self == Self::HalfOfSamples || done > GUIDED_END
    }

    /// Whether guided samples have been compared with others after `done` samples per pixel.
    pub fn is_compared(self, done: u32) -> bool {
        self == Self::FixedNumber && done >= GUIDED_END
    }

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
        let all = |training: Training, samples: &[u32]| -> Vec<[u32; 2]> {
            samples.iter().map(|&sample| [training.iteration_start(sample), training.iteration_end(sample)]).collect()
        };
        let (first, last) = ([0, 1, 2, 3, 4, 7], [16, 31, 32, u32::MAX]);
        for training in [Training::HalfOfSamples, Training::FixedNumber] {
            assert_eq!(all(training, &first), [[0, 2], [0, 2], [2, 4], [2, 4], [4, 8], [4, 8]]);
            assert_eq!(all(training, &last), [[16, 32], [16, 32], [32, 64], [1 << 31, u32::MAX]]);
        }
        let compared = [8, 11, 12, 15];
        assert_eq!(all(Training::HalfOfSamples, &compared), [[8, 16]; 4]);
        assert_eq!(all(Training::FixedNumber, &compared), [[8, 12], [8, 12], [12, 16], [12, 16]]);
        let refinements: Vec<u32> = (0..64).filter(|&done| is_refinement(done)).collect();
        assert_eq!(refinements, [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56]);
        for done in [0, 1, 7, 8, 9, 63, 1000, u32::MAX - 1] {
            assert!(next_refinement(done) > done);
        }
        assert_eq!(next_refinement(u32::MAX), u32::MAX);
    }
}
