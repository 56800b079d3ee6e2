//! Compaction: the chosen lanes of rows, one after the other; and expansion, which undoes it.

use pulp::bytemuck::{cast_mut, cast_ref};
use pulp::cast;
use pulp::x86::{V3, V4};
use std::arch::x86_64::__m256i;

use super::rows::{BATCH, Row, WIDTH, whole_vectors};

/// Chosen lanes of a block.
#[derive(Clone, Copy, Debug)]
pub struct Compaction {
    masks: [u16; BATCH / WIDTH],
    /// How many of the masks may have bits: blocks are often nearly empty after many bounces.
    used: usize,
    count: usize,
    /// The chosen lanes, if there are no more.
    first: [u8; LISTED],
    instructions: Instructions,
}

/// Few lanes are moved one by one if they are fewer than this in each vector.
const LISTED_IN_VECTOR: usize = 3;

/// The most lanes that are moved one by one.
const LISTED: usize = 16;

/// The instructions that the machine has.
#[derive(Clone, Copy, Debug)]
enum Instructions {
    Avx512(V4),
    Avx2(V3),
    Scalar,
}

impl Instructions {
    #[inline(always)]
    fn detect() -> Self {
        V4::try_new().map_or_else(|| V3::try_new().map_or(Self::Scalar, Self::Avx2), Self::Avx512)
    }
}

/// Moves numbers between the lanes whose bits are set and the first ones.
pub trait Compress: Copy {
    /// Writes the numbers of 32 bits whose bits are set, then any others.
    fn of_32_bits(self, bits: u16, numbers: [u32; WIDTH], to: &mut [u32; WIDTH]);
    /// Writes the numbers of 64 bits whose bits are set, then any others.
    fn of_64_bits(self, bits: u16, numbers: [u64; WIDTH], to: &mut [u64; WIDTH]);
    /// Writes the first numbers of 32 bits to the lanes whose bits are set.
    fn expand_32_bits(self, bits: u16, numbers: &[u32; WIDTH], to: &mut [u32; WIDTH]);
    /// Writes the first numbers of 64 bits to the lanes whose bits are set.
    fn expand_64_bits(self, bits: u16, numbers: &[u64; WIDTH], to: &mut [u64; WIDTH]);
}

impl Compress for V4 {
    #[inline(always)]
    fn of_32_bits(self, bits: u16, numbers: [u32; WIDTH], to: &mut [u32; WIDTH]) {
        *to = cast(self.avx512f._mm512_maskz_compress_epi32(bits, cast(numbers)));
    }

    #[inline(always)]
    fn of_64_bits(self, bits: u16, numbers: [u64; WIDTH], to: &mut [u64; WIDTH]) {
        store_parts(bits, cast::<_, [[u64; 8]; 2]>(numbers), to, |bits, part| {
            cast(self.avx512f._mm512_maskz_compress_epi64(bits as u8, cast(part)))
        });
    }

    #[inline(always)]
    fn expand_32_bits(self, bits: u16, numbers: &[u32; WIDTH], to: &mut [u32; WIDTH]) {
        *to = cast(self.avx512f._mm512_mask_expand_epi32(cast(*to), bits, cast(*numbers)));
    }

    #[inline(always)]
    fn expand_64_bits(self, bits: u16, numbers: &[u64; WIDTH], to: &mut [u64; WIDTH]) {
        load_parts(bits, numbers, cast_mut::<_, [[u64; 8]; 2]>(to), |bits, part, to| {
            cast(self.avx512f._mm512_mask_expand_epi64(cast(to), bits as u8, cast(part)))
        });
    }
}

impl Compress for V3 {
    #[inline(always)]
    fn of_32_bits(self, bits: u16, numbers: [u32; WIDTH], to: &mut [u32; WIDTH]) {
        store_parts(bits, cast::<_, [[u32; 8]; 2]>(numbers), to, |bits, part| {
            let order = self.avx2._mm256_cvtepu8_epi32(cast([ORDER_OF_8[usize::from(bits as u8)], 0]));
            cast(self.avx2._mm256_permutevar8x32_epi32(cast(part), order))
        });
    }

    #[inline(always)]
    fn of_64_bits(self, bits: u16, numbers: [u64; WIDTH], to: &mut [u64; WIDTH]) {
        store_parts(bits, cast::<_, [[u64; 4]; 4]>(numbers), to, |bits, part| {
            let order = self.avx2._mm256_cvtepu8_epi32(cast([ORDER_OF_4[usize::from(bits % 16)], 0]));
            cast(self.avx2._mm256_permutevar8x32_epi32(cast(part), order))
        });
    }

    #[inline(always)]
    fn expand_32_bits(self, bits: u16, numbers: &[u32; WIDTH], to: &mut [u32; WIDTH]) {
        load_parts(bits, numbers, cast_mut::<_, [[u32; 8]; 2]>(to), |bits, part, to| {
            cast(expand_by(self, RANKS_OF_8[usize::from(bits as u8)], cast(part), cast(to)))
        });
    }

    #[inline(always)]
    fn expand_64_bits(self, bits: u16, numbers: &[u64; WIDTH], to: &mut [u64; WIDTH]) {
        load_parts(bits, numbers, cast_mut::<_, [[u64; 4]; 4]>(to), |bits, part, to| {
            cast(expand_by(self, RANKS_OF_4[usize::from(bits % 16)], cast(part), cast(to)))
        });
    }
}

/// Takes each lane from the one with its rank, a byte each; negative ones keep what is there.
#[inline(always)]
fn expand_by(simd: V3, ranks: u64, part: __m256i, to: __m256i) -> __m256i {
    let ranks = simd.avx2._mm256_cvtepi8_epi32(cast([ranks, 0]));
    let chosen = simd.avx2._mm256_permutevar8x32_epi32(part, ranks);
    // The sign of each lane, as a mask of all its bytes.
    simd.avx2._mm256_blendv_epi8(chosen, to, simd.avx2._mm256_srai_epi32::<31>(ranks))
}

/// Replaces each part by what `expand` makes of it and of the numbers that follow those of the part before.
#[inline(always)]
fn load_parts<T: Copy, const N: usize, const PARTS: usize>(
    bits: u16,
    numbers: &[T; WIDTH],
    to: &mut [[T; N]; PARTS],
    expand: impl Fn(u16, [T; N], [T; N]) -> [T; N],
) {
    let mut at = 0;
    for (i, to) in to.iter_mut().enumerate() {
        let bits = bits >> (i * N) & (u16::MAX >> (16 - N));
        if let Some(part) = numbers.get(at..).and_then(<[T]>::first_chunk::<N>) {
            *to = expand(bits, *part, *to);
        }
        at += bits.count_ones() as usize;
    }
}

/// Compacts each part and writes it over what follows the chosen numbers of the part before.
#[inline(always)]
fn store_parts<T, const N: usize, const PARTS: usize>(
    bits: u16,
    parts: [[T; N]; PARTS],
    to: &mut [T; WIDTH],
    compress: impl Fn(u16, [T; N]) -> [T; N],
) {
    let mut at = 0;
    for (i, part) in parts.into_iter().enumerate() {
        let bits = bits >> (i * N) & (u16::MAX >> (16 - N));
        if let Some(to) = to.get_mut(at..).and_then(<[T]>::first_chunk_mut::<N>) {
            *to = compress(bits, part);
        }
        at += bits.count_ones() as usize;
    }
}

/// The lanes whose bits are set in the index, a byte each.
pub const ORDER_OF_8: [u64; 256] = order(1);
/// The halves of lanes of twice the width.
const ORDER_OF_4: [u64; 16] = order(2);

const fn order<const N: usize>(halves: u32) -> [u64; N] {
    let mut orders = [0; N];
    let mut bits = 0;
    while bits < N {
        let (mut lane, mut shift) = (0, 0);
        while lane < 8 {
            if bits >> (lane / halves) & 1 != 0 {
                orders[bits] |= (lane as u64) << shift;
                shift += 8;
            }
            lane += 1;
        }
        bits += 1;
    }
    orders
}

/// The ranks of the lanes whose bits are set in the index, a byte each, which is negative for all others.
const RANKS_OF_8: [u64; 256] = ranks(1);
/// Of the halves of lanes of twice the width.
const RANKS_OF_4: [u64; 16] = ranks(2);

const fn ranks<const N: usize>(halves: u32) -> [u64; N] {
    let mut ranks = [0; N];
    let mut bits = 0;
    while bits < N {
        let (mut lane, mut rank) = (0, 0);
        while lane < 8 {
            let is_chosen = bits >> (lane / halves) & 1 != 0;
            ranks[bits] |= (if is_chosen { rank } else { 0xff }) << (8 * lane);
            rank += is_chosen as u64;
            lane += 1;
        }
        bits += 1;
    }
    ranks
}

/// Numbers that can be compacted.
pub trait Compact: Copy + Default {
    /// Writes the numbers whose bits are set, then any others.
    fn compress(by: impl Compress, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]);
    /// Writes the first numbers to the lanes whose bits are set.
    fn expand(by: impl Compress, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]);
}

macro_rules! compact {
    ($($number:ty => $of_bits:ident, $expand_bits:ident,)*) => {$(
        impl Compact for $number {
            #[inline(always)]
            fn compress(by: impl Compress, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]) {
                by.$of_bits(bits, cast(*numbers), cast_mut(to));
            }

            #[inline(always)]
            fn expand(by: impl Compress, bits: u16, numbers: &[Self; WIDTH], to: &mut [Self; WIDTH]) {
                by.$expand_bits(bits, cast_ref(numbers), cast_mut(to));
            }
        }
    )*};
}

compact! {
    f32 => of_32_bits, expand_32_bits,
    u32 => of_32_bits, expand_32_bits,
    f64 => of_64_bits, expand_64_bits,
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
        let used = whole_vectors(count) / WIDTH;
        let mut masks = masks_of(flags, used, is_chosen);
        if let Some(last) = used.checked_sub(1).and_then(|last| masks.get_mut(last)) {
            *last &= u16::MAX >> (used * WIDTH - count.min(BATCH));
        }
        Self::from_masks(masks, used)
    }

    /// These lanes, in any order.
    #[inline]
    pub fn of(lanes: &[u8]) -> Self {
        let mut masks = [0; BATCH / WIDTH];
        for lane in lanes.iter().map(|&lane| usize::from(lane) % BATCH) {
            masks[lane / WIDTH] |= 1 << (lane % WIDTH);
        }
        let used = masks.iter().rposition(|&mask| mask != 0).map_or(0, |last| last + 1);
        Self::from_masks(masks, used)
    }

    /// Those of these lanes that are among `others`.
    #[inline]
    pub fn and(&self, others: &Self) -> Self {
        let masks = std::array::from_fn(|i| self.masks[i] & others.masks[i]);
        Self::from_masks(masks, self.used.min(others.used))
    }

    /// These lanes by their keys: each key with its lanes.
    #[inline]
    pub fn groups<'k>(&self, keys: &'k Row<u32>) -> impl Iterator<Item = (u32, Self)> + use<'k> {
        let (mut rest, used) = (self.masks, self.used);
        std::iter::from_fn(move || {
            let key = keys[lanes_of(&rest).next()?];
            let mut masks = masks_of(keys, used, |other| other == key);
            for (mask, rest) in masks.iter_mut().zip(&mut rest) {
                *mask &= *rest;
                *rest ^= *mask;
            }
            Some((key, Self::from_masks(masks, used)))
        })
    }

    #[inline(always)]
    fn from_masks(masks: [u16; BATCH / WIDTH], used: usize) -> Self {
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
}

impl Compaction {
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

/// The masks of the first lanes with such numbers, in `used` vectors.
#[inline(always)]
fn masks_of(numbers: &Row<u32>, used: usize, is_chosen: impl Fn(u32) -> bool) -> [u16; BATCH / WIDTH] {
    let mut masks = [0; BATCH / WIDTH];
    for (mask, numbers) in masks.iter_mut().zip(numbers.as_chunks::<WIDTH>().0).take(used) {
        *mask = (0..).zip(numbers).fold(0, |bits, (lane, &number)| bits | u32::from(is_chosen(number)) << lane) as u16;
    }
    masks
}

/// The lanes whose bits are set, in order.
#[inline(always)]
fn lanes_of(masks: &[u16; BATCH / WIDTH]) -> impl Iterator<Item = usize> + use<> {
    let masks = *masks;
    (0..BATCH / WIDTH).flat_map(move |i| set_bits(masks[i].into()).map(move |bit| i * WIDTH + bit))
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

/// Replaces `lanes` by the chosen ones of the first `count`, without branches.
#[inline(always)]
pub fn collect_lanes(lanes: &mut Vec<u8>, count: usize, is_chosen: impl FnMut(usize) -> bool) {
    filter_lanes(lanes, 0..count.min(BATCH) as u8, is_chosen);
}

/// Replaces `lanes` by the chosen ones of at most [`BATCH`] others, without branches.
#[inline(always)]
pub fn filter_lanes(lanes: &mut Vec<u8>, from: impl Iterator<Item = u8>, mut is_chosen: impl FnMut(usize) -> bool) {
    lanes.resize(BATCH, 0);
    let mut chosen = 0;
    for lane in from {
        lanes[chosen % BATCH] = lane;
        chosen += usize::from(is_chosen(usize::from(lane) % BATCH));
    }
    lanes.truncate(chosen);
}

/// Sorts `lanes` by their keys. Those of one key are in ascending order, and stay so.
pub fn sort_lanes(lanes: &mut [u8], keys: &Row<u32>) {
    const BINS: usize = 64;
    let key = |lane: u8| keys[usize::from(lane) % BATCH];
    // Counting sort, where there are few keys.
    let (mut counts, mut bits, mut sorted) = ([0u8; BINS], 0, [0u8; BATCH]);
    for &lane in &*lanes {
        bits |= key(lane);
        counts[key(lane) as usize % BINS] += 1;
    }
    if bits >= BINS as u32 || lanes.len() > BATCH {
        lanes.sort_unstable_by_key(|&lane| u64::from(key(lane)) << 8 | u64::from(lane));
        return;
    }
    let mut first = 0;
    for count in &mut counts[..=bits as usize] {
        (*count, first) = (first, first + *count);
    }
    for &lane in &*lanes {
        let place = &mut counts[key(lane) as usize % BINS];
        sorted[usize::from(*place) % BATCH] = lane;
        *place += 1;
    }
    lanes.copy_from_slice(&sorted[..lanes.len()]);
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
    fn lanes_are_sorted_by_few_and_by_many_keys() {
        let mut random = Rng::new(6);
        for limit in [1, 3, 64, 65, usize::MAX] {
            for count in [0, 1, 50, BATCH] {
                let keys: Row<u32> = std::array::from_fn(|_| random.below(limit) as u32);
                let mut lanes: Vec<u8> = (0..count as u8).filter(|_| random.below(3) > 0).collect();
                let mut expected = lanes.clone();
                expected.sort_by_key(|&lane| keys[usize::from(lane)]);
                sort_lanes(&mut lanes, &keys);
                assert_eq!(lanes, expected);
            }
        }
    }

    #[test]
    fn chosen_lanes_follow_one_another() {
        let mut random = Rng::new(5);
        let (avx512, avx2) = (V4::try_new().map(Instructions::Avx512), V3::try_new().map(Instructions::Avx2));
        let instructions = [avx512, avx2, Some(Instructions::Scalar)];
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
                    for instructions in instructions.into_iter().flatten() {
                        let lanes = Compaction { instructions, ..lanes };
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
                for instructions in instructions.into_iter().flatten() {
                    let lanes = Compaction { instructions, ..lanes };
                    let (mut compacted, mut expanded) = ([0.0; BATCH], [-1.0; BATCH]);
                    lanes.compact(&numbers, &mut compacted);
                    lanes.expand(&compacted, &mut expanded);
                    let mut expanded_f64 = [-1.0; BATCH];
                    lanes.expand(&compacted.map(f64::from), &mut expanded_f64);
                    let expected: Row =
                        std::array::from_fn(|lane| if lanes.contains(lane) { lane as f32 } else { -1.0 });
                    assert_eq!(expanded, expected);
                    assert_eq!(expanded_f64, expected.map(f64::from));
                }
                let keys: Row<u32> = std::array::from_fn(|_| random.below(5) as u32);
                let mut groups = Vec::new();
                for (key, group) in lanes.groups(&keys) {
                    let expected: Vec<_> = chosen.iter().copied().filter(|&lane| keys[lane] == key).collect();
                    assert_eq!((group.lanes().collect::<Vec<_>>(), group.len()), (expected.clone(), expected.len()));
                    groups.extend(expected);
                }
                groups.sort_unstable();
                assert_eq!(groups, chosen);
                let list: Vec<u8> = chosen.iter().map(|&lane| lane as u8).collect();
                let listed = Compaction::of(&list);
                assert_eq!((listed.masks, listed.count), (lanes.masks, lanes.count));
            }
        }
    }
}
