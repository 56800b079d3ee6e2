//! Sums that do not depend on the order of their terms.
//!
//! Each is an unevaluated pair of `f64`: what adding to the high part rounds away goes into the low one, exactly (the error-free sum of two
//! floats of Knuth, "The Art of Computer Programming", volume 2, 4.2.2). Terms with the 24 bits of an `f32` are summed
//! exactly as long as the sum is less than 2^65 times the smallest of 2^17 terms, so that films of any parts of the
//! samples merge to the same bits.

/// `N` sums side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sums<const N: usize> {
    high: [f64; N],
    low: [f64; N],
}

impl<const N: usize> Default for Sums<N> {
    fn default() -> Self {
        Self { high: [0.0; N], low: [0.0; N] }
    }
}

impl<const N: usize> Sums<N> {
    /// Adds to each sum.
    #[inline(always)]
    pub fn add(&mut self, terms: [f64; N]) {
        let sums: [(f64, f64); N] = std::array::from_fn(|k| two_sum(self.high[k], terms[k]));
        self.high = std::array::from_fn(|k| sums[k].0);
        self.low = std::array::from_fn(|k| self.low[k] + sums[k].1);
    }

    /// Adds the sums of other terms.
    pub fn merge(&mut self, other: &Self) {
        for k in 0..N {
            merge_pair(&mut self.high[k], &mut self.low[k], other.high[k], other.low[k]);
        }
    }

    /// The high parts and the low ones.
    pub(super) fn pairs(&self) -> [[f64; N]; 2] {
        [self.high, self.low]
    }

    /// Inverts [`pairs`](Self::pairs).
    pub(super) fn from_pairs([high, low]: [[f64; N]; 2]) -> Self {
        Self { high, low }
    }

    /// The sums, rounded.
    #[inline]
    pub fn values(&self) -> [f64; N] {
        std::array::from_fn(|k| self.high[k] + self.low[k])
    }
}

/// The rounded sum of two floats and its error.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    let of_a = sum - of_b;
    (sum, (a - of_a) + (b - of_b))
}

#[inline]
fn merge_pair(high: &mut f64, low: &mut f64, other_high: f64, other_low: f64) {
    let (sum, error) = two_sum(*high, other_high);
    *high = sum;
    *low = (*low + other_low) + error;
}

/// Sums of a number that is not known beforehand: the high parts, then the low ones.
pub mod slice {
    use super::{merge_pair, two_sum};

    /// Adds `terms`, half as many as there are numbers in `sums`.
    #[inline]
    pub fn add(sums: &mut [f64], terms: impl ExactSizeIterator<Item = f64>) {
        let (high, low) = sums.split_at_mut(terms.len());
        for ((high, low), term) in high.iter_mut().zip(low).zip(terms) {
            let (sum, error) = two_sum(*high, term);
            *high = sum;
            *low += error;
        }
    }

    /// Adds terms to the sums from this index on.
    #[inline]
    pub fn add_at<const N: usize>(sums: &mut [f64], first: usize, terms: [f64; N]) {
        let (high, low) = sums.split_at_mut(sums.len() / 2);
        for ((high, low), term) in high[first..first + N].iter_mut().zip(&mut low[first..first + N]).zip(terms) {
            let (sum, error) = two_sum(*high, term);
            *high = sum;
            *low += error;
        }
    }

    /// Adds the sums of other terms.
    pub fn merge(sums: &mut [f64], other: &[f64]) {
        let count = sums.len() / 2;
        let (high, low) = sums.split_at_mut(count);
        for k in 0..count {
            merge_pair(&mut high[k], &mut low[k], other[k], other[count + k]);
        }
    }

    /// The sum with this index, rounded.
    #[inline]
    pub fn value(sums: &[f64], index: usize) -> f64 {
        sums[index] + sums[sums.len() / 2 + index]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Terms as a film has them, over ten orders of magnitude.
    fn terms(rng: &mut Rng, count: usize) -> Vec<f64> {
        (0..count).map(|_| f64::from((rng.unit_f32() - 0.3) * 10f32.powf(10.0 * rng.unit_f32() - 5.0))).collect()
    }

    #[test]
    fn sums_do_not_depend_on_order_or_on_splits() {
        let mut rng = Rng::new(7);
        for _ in 0..200 {
            let terms = terms(&mut rng, 1000);
            let mut forward = Sums::<2>::default();
            terms.iter().for_each(|&x| forward.add([x, -x]));
            let mut backward = Sums::<2>::default();
            terms.iter().rev().for_each(|&x| backward.add([x, -x]));
            let mut merged = Sums::<2>::default();
            let mut in_slice = vec![0.0; 4];
            for part in terms.chunks(37) {
                let (mut sums, mut slice) = (Sums::<2>::default(), vec![0.0; 4]);
                part.iter().for_each(|&x| sums.add([x, -x]));
                part.iter().for_each(|&x| slice::add(&mut slice, [x, -x].into_iter()));
                merged.merge(&sums);
                slice::merge(&mut in_slice, &slice);
            }
            assert_eq!(forward.values(), backward.values());
            assert_eq!(forward.values(), merged.values());
            assert_eq!(forward.values(), [slice::value(&in_slice, 0), slice::value(&in_slice, 1)]);
            assert_eq!(forward.values()[0], -forward.values()[1]);
        }
    }

    #[test]
    fn what_a_plain_sum_loses_is_kept() {
        let mut sums = Sums::<1>::default();
        for x in [1e16, 1.0, 1.0, -1e16] {
            sums.add([x]);
        }
        assert_eq!(sums.values(), [2.0]);
    }
}
