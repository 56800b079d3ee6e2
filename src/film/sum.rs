//! Sums that do not depend on the order of their terms.
//!
//! Each is an unevaluated pair: an `f64`, and an `f32` for what adding to it rounds away (the error-free sum of two
//! floats of Knuth, "The Art of Computer Programming", volume 2, 4.2.2). Terms with the 24 bits of an `f32` are summed
//! exactly as long as the sum is less than 2^36 times the smallest of 2^17 terms (beyond that, the `f32` is rounded).
//! So films of any parts of the samples merge to the same bits.

use crate::bytes::{ByteReader, ByteWriter};
use crate::math::vectorize::vectorize;

/// `N` sums for each of a number of entries; those of an entry side by side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SumPlane<const N: usize> {
    high: Vec<[f64; N]>,
    low: Vec<[f32; N]>,
}

impl<const N: usize> SumPlane<N> {
    /// Bytes of an entry.
    pub const ENTRY_BYTES: usize = N * (size_of::<f64>() + size_of::<f32>());

    /// Zeros.
    pub fn new(entries: usize) -> Self {
        Self { high: vec![[0.0; N]; entries], low: vec![[0.0; N]; entries] }
    }

    /// Whether there is no entry.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.high.is_empty()
    }

    /// Adds to each sum of an entry.
    #[inline(always)]
    pub fn add(&mut self, entry: usize, terms: [f64; N]) {
        add_terms(&mut self.high[entry], &mut self.low[entry], &terms);
    }

    /// Adds to each sum of consecutive entries.
    #[inline(always)]
    pub fn add_run(&mut self, first: usize, terms: impl Iterator<Item = [f64; N]>) {
        for ((high, low), terms) in self.high[first..].iter_mut().zip(&mut self.low[first..]).zip(terms) {
            add_terms(high, low, &terms);
        }
    }

    /// Adds terms to entries, at most one to each. `buffer` holds them in the order of the entries.
    #[inline(always)]
    pub fn add_all(&mut self, buffer: &mut Vec<f64>, terms: impl ExactSizeIterator<Item = (usize, [f64; N])>) {
        let count = self.high.len() * N;
        if buffer.len() < count {
            buffer.resize(count, 0.0);
        }
        let buffer = &mut buffer[..count];
        if terms.len() < self.high.len() {
            buffer.fill(0.0);
        }
        let by_entry = buffer.as_chunks_mut::<N>().0;
        for (entry, term) in terms {
            by_entry[entry] = term;
        }
        vectorize!(add_terms(self.high.as_flattened_mut(), self.low.as_flattened_mut(), buffer));
    }

    /// Adds the sums of other terms, each times `factor`.
    pub fn merge(&mut self, other: &Self, factor: f64) {
        for (entry, (other_high, other_low)) in other.high.iter().zip(&other.low).enumerate() {
            if factor == 1.0 {
                self.add(entry, *other_high);
                self.low[entry].iter_mut().zip(other_low).for_each(|(low, other)| *low += other);
            } else {
                self.add(entry, other.values(entry).map(|sum| factor * sum));
            }
        }
    }

    /// The sums of an entry, rounded.
    #[inline]
    pub fn values(&self, entry: usize) -> [f64; N] {
        let (high, low) = (&self.high[entry], &self.low[entry]);
        std::array::from_fn(|k| high[k] + f64::from(low[k]))
    }

    /// Writes all sums.
    pub fn save(&self, out: &mut ByteWriter) {
        out.floats(self.high.as_flattened().iter().copied());
        out.integers(&self.low.as_flattened().iter().map(|low| low.to_bits()).collect::<Vec<_>>());
    }

    /// What [`save`](Self::save) wrote; `None` if it is something else.
    pub fn load(data: &mut ByteReader) -> Option<Self> {
        let (high, low) = (data.floats()?, data.integers()?);
        if high.len() != low.len() || !high.len().is_multiple_of(N) {
            return None;
        }
        let low: Vec<f32> = low.into_iter().map(f32::from_bits).collect();
        Some(Self { high: high.as_chunks().0.to_vec(), low: low.as_chunks().0.to_vec() })
    }

    /// [`load`](Self::load) of as many entries as there are here.
    pub fn load_same(&self, data: &mut ByteReader) -> Option<Self> {
        Self::load(data).filter(|plane| plane.has_entries(self.high.len()))
    }

    /// Whether this is the number of entries.
    pub fn has_entries(&self, entries: usize) -> bool {
        self.high.len() == entries
    }
}

#[inline(always)]
fn add_terms(high: &mut [f64], low: &mut [f32], terms: &[f64]) {
    for ((high, low), &term) in high.iter_mut().zip(low).zip(terms) {
        let (sum, error) = two_sum(*high, term);
        *high = sum;
        *low += error as f32;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Terms as a film has them, over ten orders of magnitude.
    fn terms(rng: &mut Rng, count: usize) -> Vec<f64> {
        (0..count).map(|_| f64::from((rng.unit_f32() - 0.3) * 10f32.powf(10.0 * rng.unit_f32() - 5.0))).collect()
    }

    fn sums<'a>(terms: impl IntoIterator<Item = &'a f64>) -> SumPlane<2> {
        let mut plane = SumPlane::new(2);
        terms.into_iter().for_each(|&x| plane.add(1, [x, -x]));
        plane
    }

    #[test]
    fn sums_do_not_depend_on_order_or_on_splits() {
        let mut rng = Rng::new(7);
        for _ in 0..200 {
            let terms = terms(&mut rng, 1000);
            let forward = sums(&terms).values(1);
            let mut merged = SumPlane::new(2);
            terms.chunks(37).for_each(|part| merged.merge(&sums(part), 1.0));
            assert_eq!(forward, sums(terms.iter().rev()).values(1));
            assert_eq!(forward, merged.values(1));
            assert_eq!((forward[0], merged.values(0)), (-forward[1], [0.0; 2]));
        }
    }

    #[test]
    fn what_a_plain_sum_loses_is_kept() {
        let plane = sums(&[1e16, 1.0, 1.0, -1e16]);
        assert_eq!(plane.values(1), [2.0, -2.0]);
        let mut thrice = SumPlane::new(2);
        thrice.merge(&plane, 3.0);
        assert_eq!(thrice.values(1), [6.0, -6.0]);
    }

    #[test]
    fn saved_planes_come_back_and_others_are_refused() {
        let plane = sums(&[1e16, 1.0]);
        let mut out = ByteWriter::default();
        plane.save(&mut out);
        let bytes = out.into_bytes();
        assert_eq!(SumPlane::load(&mut ByteReader::new(&bytes)), Some(plane));
        assert_eq!(SumPlane::<3>::load(&mut ByteReader::new(&bytes)), None);
        assert_eq!(SumPlane::<2>::new(1).load_same(&mut ByteReader::new(&bytes)), None);
    }
}
