//! Compaction: the chosen lanes of rows, one after the other.

use pulp::cast;
use pulp::x86::V4;

use super::rows::{BATCH, Row};

/// Lanes of a vector of 32-bit numbers.
const WIDTH: usize = 16;

/// Chosen lanes of a block.
#[derive(Clone, Copy, Debug)]
pub struct Compaction {
    masks: [u16; BATCH / WIDTH],
    count: usize,
    simd: Option<V4>,
    /// Without AVX-512: the chosen lanes, in order.
    lanes: Row<u8>,
}

/// Numbers that AVX-512 compacts.
pub trait Compact: Copy + Default {
    /// Writes the numbers whose bits are set, then any others.
    fn compress(simd: V4, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]);
}

macro_rules! compact {
    ($($number:ty),*) => {$(
        impl Compact for $number {
            #[inline(always)]
            fn compress(simd: V4, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]) {
                *to = cast(simd.avx512f._mm512_maskz_compress_ps(bits, cast(*numbers)));
            }
        }
    )*};
}

compact!(f32, u32);

impl Compact for f64 {
    #[inline(always)]
    fn compress(simd: V4, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]) {
        let [low, high]: [[Self; WIDTH / 2]; 2] = cast(*numbers);
        if let Some(to) = to.first_chunk_mut::<{ WIDTH / 2 }>() {
            *to = cast(simd.avx512f._mm512_maskz_compress_pd(bits as u8, cast(low)));
        }
        if let Some(to) = to[(bits as u8).count_ones() as usize..].first_chunk_mut::<{ WIDTH / 2 }>() {
            *to = cast(simd.avx512f._mm512_maskz_compress_pd((bits >> 8) as u8, cast(high)));
        }
    }
}

impl Compaction {
    /// Those of the first `count` lanes whose `flags` are `chosen`.
    #[inline]
    pub fn equal(flags: &Row<u32>, chosen: u32, count: usize) -> Self {
        Self::new(flags, count, |flag| flag == chosen)
    }

    /// Those of the first `count` lanes whose `flags` are not `other`.
    #[inline]
    pub fn different(flags: &Row<u32>, other: u32, count: usize) -> Self {
        Self::new(flags, count, |flag| flag != other)
    }

    #[inline(always)]
    fn new(flags: &Row<u32>, count: usize, is_chosen: impl Fn(u32) -> bool) -> Self {
        let mut masks = [0u16; BATCH / WIDTH];
        for (i, (mask, flags)) in masks.iter_mut().zip(flags.as_chunks::<WIDTH>().0).enumerate() {
            let chosen = (0..).zip(flags).fold(0, |bits, (lane, &flag)| bits | u32::from(is_chosen(flag)) << lane);
            let within = count.saturating_sub(i * WIDTH).min(WIDTH);
            *mask = (chosen & ((1 << within) - 1)) as u16;
        }
        Self::of_masks(masks, V4::try_new())
    }

    #[inline(always)]
    fn of_masks(masks: [u16; BATCH / WIDTH], simd: Option<V4>) -> Self {
        let count = masks.iter().map(|mask| mask.count_ones() as usize).sum();
        let mut lanes = [0; BATCH];
        if simd.is_none() {
            let chosen = (0..BATCH).step_by(WIDTH).zip(masks).flat_map(|(first, bits)| set_bits(bits.into()).map(move |bit| first + bit));
            lanes.iter_mut().zip(chosen).for_each(|(to, lane)| *to = lane as u8);
        }
        Self { masks, count, simd, lanes }
    }

    /// How many there are.
    #[inline]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether a lane is among them.
    #[inline(always)]
    pub fn contains(&self, lane: usize) -> bool {
        self.masks[lane / WIDTH] >> (lane % WIDTH) & 1 != 0
    }

    /// Writes the chosen numbers of `from` to the first lanes of `to`. Lanes after them may change too.
    #[inline]
    pub fn compact<T: Compact>(&self, from: &Row<T>, to: &mut Row<T>) {
        self.append(from, to, None, 0);
    }

    /// [`compact`](Self::compact) for three rows.
    #[inline]
    pub fn compact_3<T: Compact>(&self, from: &[Row<T>; 3], to: &mut [Row<T>; 3]) {
        self.append_3(from, to, None, 0);
    }

    /// Writes the chosen numbers of `from` to the lanes of a block from `at` on, and on to the next, which there is if
    /// they do not fit. Lanes after them may change too.
    #[inline]
    pub fn append<T: Compact>(&self, from: &Row<T>, to: &mut Row<T>, next: Option<&mut Row<T>>, at: usize) {
        if self.count == BATCH && at == 0 {
            *to = *from;
            return;
        }
        if let Some(simd) = self.simd {
            simd.vectorize(
                #[inline(always)]
                || self.compress(simd, from, to, next, at),
            );
            return;
        }
        let (here, after) = self.lanes[..self.count].split_at(self.count.min(BATCH - at));
        let copy = |to: &mut [T], lanes: &[u8]| to.iter_mut().zip(lanes).for_each(|(to, &lane)| *to = from[usize::from(lane) % BATCH]);
        copy(&mut to[at..], here);
        if let Some(next) = next {
            copy(next, after);
        }
    }

    /// [`append`](Self::append) by one instruction for each vector.
    #[inline(always)]
    fn compress<T: Compact>(&self, simd: V4, from: &Row<T>, to: &mut Row<T>, mut next: Option<&mut Row<T>>, mut at: usize) {
        for (&bits, numbers) in self.masks.iter().zip(from.as_chunks::<WIDTH>().0) {
            let count = bits.count_ones() as usize;
            // Of a length that the compiler knows: else each is a call.
            let whole = if at < BATCH {
                to.get_mut(at..).and_then(<[T]>::first_chunk_mut::<WIDTH>)
            } else {
                next.as_mut().and_then(|next| next.get_mut(at - BATCH..)).and_then(<[T]>::first_chunk_mut::<WIDTH>)
            };
            if let Some(whole) = whole {
                T::compress(simd, bits, numbers, whole);
            } else {
                // Through memory, which waits for its own stores.
                let mut compressed = [T::default(); WIDTH];
                T::compress(simd, bits, numbers, &mut compressed);
                for (at, number) in (at..).zip(&compressed[..count]) {
                    if let Some(to) = place(to, next.as_deref_mut(), at) {
                        *to = *number;
                    }
                }
            }
            at += count;
        }
    }

    /// [`append`](Self::append) for three rows.
    #[inline]
    pub fn append_3<T: Compact>(&self, from: &[Row<T>; 3], to: &mut [Row<T>; 3], next: Option<&mut [Row<T>; 3]>, at: usize) {
        match next {
            None => (0..3).for_each(|k| self.append(&from[k], &mut to[k], None, at)),
            Some(next) => (0..3).for_each(|k| self.append(&from[k], &mut to[k], Some(&mut next[k]), at)),
        }
    }
}

/// The places of bits that are set, in order.
#[inline(always)]
pub fn set_bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (place < 32).then_some(place)
    })
}

/// A lane of a block or of the next.
#[inline(always)]
fn place<'a, T>(to: &'a mut Row<T>, next: Option<&'a mut Row<T>>, at: usize) -> Option<&'a mut T> {
    if at < BATCH { to.get_mut(at) } else { next?.get_mut(at - BATCH) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn chosen_lanes_follow_one_another() {
        let mut random = Rng::new(5);
        for share in [0, 1, 3, 8, 10] {
            for count in [0, 1, 17, 100, BATCH] {
                let flags: Row<u32> = std::array::from_fn(|_| u32::from(random.below(10) < share));
                let numbers: Row = std::array::from_fn(|i| i as f32);
                let chosen: Vec<usize> = (0..count).filter(|&lane| flags[lane] == 1).collect();
                let lanes = Compaction::equal(&flags, 1, count);
                assert_eq!(lanes.len(), chosen.len());
                assert!((0..BATCH).all(|lane| lanes.contains(lane) == chosen.contains(&lane)));
                assert_eq!(Compaction::different(&flags, 0, count).masks, lanes.masks);
                for at in [0, 1, 100, BATCH - 1] {
                    // With the instructions that the machine has, and without.
                    for lanes in [lanes, Compaction::of_masks(lanes.masks, None)] {
                        let (mut first, mut second) = ([-1.0; BATCH], [-1.0; BATCH]);
                        lanes.append(&numbers, &mut first, Some(&mut second), at);
                        let (mut first_f64, mut second_f64) = ([-1.0; BATCH], [-1.0; BATCH]);
                        lanes.append(&numbers.map(f64::from), &mut first_f64, Some(&mut second_f64), at);
                        let both = [first, second].concat();
                        assert!(both[..at].iter().all(|x| *x == -1.0));
                        let expected: Vec<f32> = chosen.iter().map(|&lane| lane as f32).collect();
                        assert_eq!(both[at..at + chosen.len()], expected);
                        let both_f64: Vec<f32> = [first_f64, second_f64].concat().iter().map(|x| *x as f32).collect();
                        assert_eq!(both_f64[..at + chosen.len()], both[..at + chosen.len()]);
                    }
                }
            }
        }
    }
}
