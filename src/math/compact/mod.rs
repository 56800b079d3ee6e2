//! Compaction: the chosen lanes of rows, one after the other; and expansion, which undoes it.

mod instructions;
mod lists;
#[cfg(test)]
mod tests;

pub use instructions::ORDER_OF_8;
use instructions::{Compact, Compress, Instructions, lanes_with};
pub use lists::{collect_lanes, filter_lanes, set_bits, sort_lanes};

use super::rows::{BATCH, Row, WIDTH};

/// A bit for each lane.
type Masks = [u16; BATCH / WIDTH];

/// Chosen lanes of a block.
#[derive(Clone, Copy, Debug)]
pub struct Compaction {
    masks: Masks,
    /// How many of the masks may have bits: blocks are often nearly empty after many bounces.
    used: usize,
    count: usize,
    /// The chosen lanes in ascending order, if they are moved one by one.
    first: [u8; LISTED],
    instructions: Instructions,
}

/// Few lanes are moved one by one if they are fewer than this in each vector.
const LISTED_IN_VECTOR: usize = 3;

/// The most lanes that are moved one by one.
const LISTED: usize = 16;

impl Compaction {
    /// Those of the first `count` lanes whose `flags` are `chosen`.
    #[inline]
    pub fn equal(flags: &Row<u32>, chosen: u32, count: usize) -> Self {
        let (first, equal) = (first_lanes(count), lanes_with(Instructions::detect(), flags, chosen));
        Self::from_masks(std::array::from_fn(|i| first[i] & equal[i]))
    }

    /// Those of the first `count` lanes whose `flags` are not `other`.
    #[inline]
    pub fn different(flags: &Row<u32>, other: u32, count: usize) -> Self {
        let (first, equal) = (first_lanes(count), lanes_with(Instructions::detect(), flags, other));
        Self::from_masks(std::array::from_fn(|i| first[i] & !equal[i]))
    }

    /// These lanes, in any order.
    #[inline]
    pub fn of(lanes: &[u8]) -> Self {
        let mut masks = [0; BATCH / WIDTH];
        for lane in lanes.iter().map(|&lane| usize::from(lane) % BATCH) {
            masks[lane / WIDTH] |= 1 << (lane % WIDTH);
        }
        Self::from_masks(masks)
    }

    /// Those of these lanes that are among `others`.
    #[inline]
    pub fn and(&self, others: &Self) -> Self {
        Self::from_masks(std::array::from_fn(|i| self.masks[i] & others.masks[i]))
    }

    /// These lanes by their keys: each key with its lanes.
    #[inline]
    pub fn groups<'k>(&self, keys: &'k Row<u32>) -> impl Iterator<Item = (u32, Self)> + use<'k> {
        let (mut rest, instructions) = (self.masks, self.instructions);
        std::iter::from_fn(move || {
            let key = keys[lanes_of(&rest).next()?];
            let mut masks = lanes_with(instructions, keys, key);
            for (mask, rest) in masks.iter_mut().zip(&mut rest) {
                *mask &= *rest;
                *rest ^= *mask;
            }
            Some((key, Self::from_masks(masks)))
        })
    }

    #[inline(always)]
    fn from_masks(masks: Masks) -> Self {
        let used = masks.iter().rposition(|&mask| mask != 0).map_or(0, |last| last + 1);
        let count = masks.iter().map(|mask| mask.count_ones() as usize).sum();
        let mut lanes = Self { masks, used, count, first: [0; LISTED], instructions: Instructions::detect() };
        if lanes.is_listed() {
            lanes.first.iter_mut().zip(lanes_of(&masks)).for_each(|(first, lane)| *first = lane as u8);
        }
        lanes
    }

    /// Whether the lanes are moved one by one.
    #[inline(always)]
    fn is_listed(&self) -> bool {
        self.count <= LISTED && self.count < LISTED_IN_VECTOR * self.used
    }

    /// The lanes, if they are moved one by one.
    #[inline(always)]
    fn listed(&self) -> Option<&[u8]> {
        if self.is_listed() { self.first.get(..self.count) } else { None }
    }

    /// The lanes, in ascending order.
    #[inline]
    pub fn lanes(&self) -> impl Iterator<Item = usize> {
        lanes_of(&self.masks)
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
        if let Some(lanes) = self.listed() {
            let mut next = next;
            for (at, &lane) in (at..).zip(lanes) {
                if let Some(to) = place(to, next.as_deref_mut(), at) {
                    *to = from[usize::from(lane) % BATCH];
                }
            }
            return;
        }
        match self.instructions {
            Instructions::Avx512(simd) => simd.vectorize(
                #[inline(always)]
                || self.compress(simd, from, to, next, at),
            ),
            Instructions::Avx2(simd) => simd.vectorize(
                #[inline(always)]
                || self.compress(simd, from, to, next, at),
            ),
            Instructions::Scalar => self.copy(from, to, next, at),
        }
    }

    /// [`append`](Self::append) one by one.
    fn copy<T: Compact>(&self, from: &Row<T>, to: &mut Row<T>, mut next: Option<&mut Row<T>>, at: usize) {
        let chosen = self.masks.iter().zip(from.as_chunks::<WIDTH>().0);
        let chosen = chosen.flat_map(|(&bits, numbers)| set_bits(bits.into()).map(|bit| numbers[bit]));
        for (at, number) in (at..).zip(chosen) {
            if let Some(to) = place(to, next.as_deref_mut(), at) {
                *to = number;
            }
        }
    }

    /// [`append`](Self::append) by vectors.
    #[inline(always)]
    fn compress<T: Compact>(
        &self,
        by: impl Compress,
        from: &Row<T>,
        to: &mut Row<T>,
        mut next: Option<&mut Row<T>>,
        mut at: usize,
    ) {
        for (&bits, numbers) in self.masks.iter().zip(from.as_chunks::<WIDTH>().0).take(self.used) {
            let count = bits.count_ones() as usize;
            let (row, first) = if at < BATCH { (Some(&mut *to), at) } else { (next.as_deref_mut(), at - BATCH) };
            let Some(row) = row else { return };
            if let Some(whole) = row.get_mut(first..).and_then(<[T]>::first_chunk_mut::<WIDTH>) {
                T::compress(by, bits, numbers, whole);
            } else {
                let room = BATCH.saturating_sub(first);
                let mut compressed = [T::default(); WIDTH];
                T::compress(by, bits, numbers, &mut compressed);
                if let Some(last) = row.last_chunk_mut::<WIDTH>() {
                    T::expand(by, (u32::from(u16::MAX) << (WIDTH - room)) as u16, &compressed, last);
                }
                if count > room
                    && let Some(first) = next.as_mut().and_then(|next| next.first_chunk_mut::<WIDTH>())
                {
                    T::compress(by, without_lowest(bits, room), numbers, first);
                }
            }
            at += count;
        }
    }

    /// [`append`](Self::append) for three rows.
    #[inline]
    pub fn append_3<T: Compact>(
        &self,
        from: &[Row<T>; 3],
        to: &mut [Row<T>; 3],
        next: Option<&mut [Row<T>; 3]>,
        at: usize,
    ) {
        match next {
            None => (0..3).for_each(|k| self.append(&from[k], &mut to[k], None, at)),
            Some(next) => (0..3).for_each(|k| self.append(&from[k], &mut to[k], Some(&mut next[k]), at)),
        }
    }

    /// Writes the first numbers of `from` to the chosen lanes of `to`, and nothing to the others.
    #[inline]
    pub fn expand<T: Compact>(&self, from: &Row<T>, to: &mut Row<T>) {
        if let Some(lanes) = self.listed() {
            lanes.iter().zip(from).for_each(|(&lane, number)| to[usize::from(lane) % BATCH] = *number);
            return;
        }
        match self.instructions {
            Instructions::Avx512(simd) => simd.vectorize(
                #[inline(always)]
                || self.expand_by(simd, from, to),
            ),
            Instructions::Avx2(simd) => simd.vectorize(
                #[inline(always)]
                || self.expand_by(simd, from, to),
            ),
            Instructions::Scalar => self.lanes().zip(from).for_each(|(lane, number)| to[lane] = *number),
        }
    }

    /// [`expand`](Self::expand) by vectors.
    #[inline(always)]
    fn expand_by<T: Compact>(&self, by: impl Compress, from: &Row<T>, to: &mut Row<T>) {
        let mut at = 0;
        for (&bits, to) in self.masks.iter().zip(to.as_chunks_mut::<WIDTH>().0).take(self.used) {
            // No more lanes than these are before.
            if let Some(numbers) = from.get(at..).and_then(<[T]>::first_chunk::<WIDTH>) {
                T::expand(by, bits, numbers, to);
            }
            at += bits.count_ones() as usize;
        }
    }

    /// [`expand`](Self::expand) for three rows.
    #[inline]
    pub fn expand_3<T: Compact>(&self, from: &[Row<T>; 3], to: &mut [Row<T>; 3]) {
        (0..3).for_each(|k| self.expand(&from[k], &mut to[k]));
    }
}

/// Without as many of the lowest bits that are set.
#[inline(always)]
fn without_lowest(bits: u16, count: usize) -> u16 {
    (0..count).fold(bits, |bits, _| bits & bits.wrapping_sub(1))
}

/// The lanes before one.
#[inline(always)]
fn first_lanes(count: usize) -> Masks {
    std::array::from_fn(|i| ((1u32 << count.saturating_sub(i * WIDTH).min(WIDTH)) - 1) as u16)
}

/// The lanes whose bits are set, in order.
#[inline(always)]
fn lanes_of(masks: &Masks) -> impl Iterator<Item = usize> + use<> {
    let masks = *masks;
    (0..BATCH / WIDTH).flat_map(move |i| set_bits(masks[i].into()).map(move |bit| i * WIDTH + bit))
}

/// A lane of a block or of the next.
#[inline(always)]
fn place<'a, T>(to: &'a mut Row<T>, next: Option<&'a mut Row<T>>, at: usize) -> Option<&'a mut T> {
    if at < BATCH { to.get_mut(at) } else { next?.get_mut(at - BATCH) }
}
