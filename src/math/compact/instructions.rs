//! What moves numbers between lanes, with the instructions that the machine has.

use std::arch::x86_64::__m256i;

use pulp::bytemuck::{cast_mut, cast_ref};
use pulp::cast;
use pulp::x86::{V3, V4};

use super::Masks;
use crate::math::rows::{BATCH, Row, WIDTH};

/// The instructions that the machine has.
#[derive(Clone, Copy, Debug)]
pub enum Instructions {
    Avx512(V4),
    Avx2(V3),
    Scalar,
}

impl Instructions {
    #[inline(always)]
    pub fn detect() -> Self {
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

/// The lanes with a number.
#[inline(always)]
pub fn lanes_with(instructions: Instructions, numbers: &Row<u32>, wanted: u32) -> Masks {
    let vectors = numbers.as_chunks::<WIDTH>().0;
    let mut masks = [0; BATCH / WIDTH];
    match instructions {
        Instructions::Avx512(simd) => simd.vectorize(
            #[inline(always)]
            || {
                let wanted = simd.avx512f._mm512_set1_epi32(wanted as i32);
                for (mask, numbers) in masks.iter_mut().zip(vectors) {
                    *mask = simd.avx512f._mm512_cmpeq_epi32_mask(cast(*numbers), wanted);
                }
            },
        ),
        Instructions::Avx2(simd) => simd.vectorize(
            #[inline(always)]
            || {
                let wanted = simd.avx._mm256_set1_epi32(wanted as i32);
                let equal = |numbers: [u32; 8]| {
                    let equal = simd.avx2._mm256_cmpeq_epi32(cast(numbers), wanted);
                    simd.avx._mm256_movemask_ps(cast(equal)) as u16
                };
                for (mask, numbers) in masks.iter_mut().zip(vectors) {
                    let [low, high]: [[u32; 8]; 2] = cast(*numbers);
                    *mask = equal(low) | equal(high) << 8;
                }
            },
        ),
        Instructions::Scalar => {
            for (mask, numbers) in masks.iter_mut().zip(vectors) {
                *mask = (0..).zip(numbers).fold(0, |bits, (lane, &number)| bits | u16::from(number == wanted) << lane);
            }
        }
    }
    masks
}
