//! Sample values in batches, the same as for each sample alone.

use pulp::cast;
use pulp::x86::V4;

use super::{PixelSeed, SOBOL_COLUMNS, Sampler, SamplerKind, SobolSeeds, owen_scramble, pcg_4d, unit};
use crate::math::rows::{BATCH, whole_vectors};
use crate::math::vectorize::vectorize;

/// The pixel samples of a batch.
#[derive(Clone, Debug)]
pub struct SampleIdRows {
    /// Seeds of the pixels.
    pub pixels: [PixelSeed; BATCH],
    /// Indices of the samples.
    pub samples: [u32; BATCH],
}

impl Default for SampleIdRows {
    fn default() -> Self {
        Self { pixels: [PixelSeed(0); BATCH], samples: [0; BATCH] }
    }
}

/// Four numbers for each of many samples, by dimension.
#[derive(Clone, Debug)]
pub struct SampleRows([[f32; BATCH]; 4]);

impl Default for SampleRows {
    fn default() -> Self {
        Self([[0.0; BATCH]; 4])
    }
}

impl SampleRows {
    /// The four numbers of one sample.
    #[inline(always)]
    pub fn of(&self, i: usize) -> [f32; 4] {
        [self.0[0][i], self.0[1][i], self.0[2][i], self.0[3][i]]
    }

    /// From the four numbers of each sample.
    #[cfg(test)]
    pub fn new(samples: &[[f32; 4]]) -> Self {
        let mut numbers = Self::default();
        for (i, sample) in samples.iter().enumerate() {
            (0..4).for_each(|k| numbers.0[k][i] = sample[k]);
        }
        numbers
    }

    /// Each of the four numbers, by sample.
    #[inline(always)]
    pub fn numbers(&self) -> &[[f32; BATCH]; 4] {
        &self.0
    }

    /// Replaces the first number of one sample.
    #[inline(always)]
    pub fn set_first(&mut self, i: usize, u: f32) {
        self.0[0][i] = u;
    }

    #[inline(always)]
    fn set(&mut self, i: usize, bits: [u32; 4]) {
        for (row, bits) in self.0.iter_mut().zip(bits) {
            row[i] = unit(bits);
        }
    }
}

impl Sampler {
    /// [`sample_4d`](Self::sample_4d) for the first `count` samples of `requests`, at most [`BATCH`].
    #[inline]
    pub fn sample_4d_batch(&self, requests: &SampleIdRows, count: usize, set: u32, numbers: &mut SampleRows) {
        let count = count.min(BATCH);
        match self.kind {
            SamplerKind::Sobol => match V4::try_new() {
                Some(simd) => simd.vectorize(
                    #[inline(always)]
                    || draw_by_tables(simd, requests, count, set, numbers),
                ),
                None => vectorize!(draw::<true>(requests, count, set, numbers)),
            },
            SamplerKind::Independent => vectorize!(draw::<false>(requests, count, set, numbers)),
        }
    }
}

/// Draws Sobol points or independent numbers.
#[inline(always)]
fn draw<const SOBOL: bool>(requests: &SampleIdRows, count: usize, set: u32, numbers: &mut SampleRows) {
    for i in 0..whole_vectors(count) {
        let (pixel, sample) = (requests.pixels[i], requests.samples[i]);
        let bits = if SOBOL { sobol_4d_by_columns(pixel, sample, set) } else { pcg_4d([sample, set, pixel.0, 0]) };
        numbers.set(i, bits);
    }
}

/// Adds, to the points of the second to fourth dimension, the columns of the given bits of the index: what a loop does,
/// laid out since loops within loops are not turned into vector code.
macro_rules! add_columns {
    ($point:ident, $index:ident, $($bit:literal)*) => { $(
        let chosen = 0u32.wrapping_sub($index >> $bit & 1);
        $point[1] ^= chosen & SOBOL_COLUMNS[$bit][1];
        $point[2] ^= chosen & SOBOL_COLUMNS[$bit][2];
        $point[3] ^= chosen & SOBOL_COLUMNS[$bit][3];
    )* };
}

/// As `sobol_4d`, without a table: each bit of the index adds its column.
#[inline(always)]
fn sobol_4d_by_columns(pixel: PixelSeed, sample: u32, set: u32) -> [u32; 4] {
    let seeds = SobolSeeds::new(pixel, set);
    let index = owen_scramble(reversed(sample), seeds.shuffle);
    // The first dimension is the index itself.
    let mut point = [reversed(index), 0, 0, 0];
    add_columns!(point, index, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31);
    let scramble = |k: usize| reversed(owen_scramble(point[k], seeds.scrambles[k]));
    [scramble(0), scramble(1), scramble(2), scramble(3)]
}

/// By four bits of the index, dimension (from the second on) and value of these bits, the sum of their columns.
const DIGITS: [[[u32; WIDTH]; 3]; 8] = {
    let mut digits = [[[0; WIDTH]; 3]; 8];
    let mut i = 0;
    while i < 8 * 3 * WIDTH * 4 {
        let (bit, value, k, digit) = (i % 4, i / 4 % WIDTH, i / (4 * WIDTH) % 3, i / (12 * WIDTH));
        if value >> bit & 1 != 0 {
            digits[digit][k][value] ^= SOBOL_COLUMNS[4 * digit + bit][k + 1];
        }
        i += 1;
    }
    digits
};

/// Numbers in a vector of AVX-512, and the values of four bits.
const WIDTH: usize = 16;

/// [`draw`] for Sobol points, with a lookup in registers for each four bits of the index.
#[inline(always)]
fn draw_by_tables(simd: V4, requests: &SampleIdRows, count: usize, set: u32, numbers: &mut SampleRows) {
    for first in (0..count.min(BATCH)).step_by(WIDTH) {
        let samples = requests.samples[first..].first_chunk().copied().unwrap_or_default();
        let (mut points, mut scrambles) =
            ([reversed_by_tables(simd, samples), [0; WIDTH], [0; WIDTH], [0; WIDTH]], [[0; WIDTH]; 4]);
        for i in 0..WIDTH {
            let seeds = SobolSeeds::new(requests.pixels[first + i], set);
            points[0][i] = owen_scramble(points[0][i], seeds.shuffle);
            for (row, scramble) in scrambles.iter_mut().zip(seeds.scrambles) {
                row[i] = scramble;
            }
        }
        let mut digits = points[0];
        for tables in &DIGITS {
            for k in 0..3 {
                let found: [u32; WIDTH] = cast(simd.avx512f._mm512_permutexvar_epi32(cast(digits), cast(tables[k])));
                for i in 0..WIDTH {
                    points[k + 1][i] ^= found[i];
                }
            }
            for digit in &mut digits {
                *digit >>= 4;
            }
        }
        points[0] = reversed_by_tables(simd, points[0]);
        for k in 0..4 {
            for i in 0..WIDTH {
                points[k][i] = owen_scramble(points[k][i], scrambles[k][i]);
            }
            let bits = reversed_by_tables(simd, points[k]);
            for (number, bits) in numbers.0[k][first..first + WIDTH].iter_mut().zip(bits) {
                *number = unit(bits);
            }
        }
    }
}

/// A table of 16 bytes for each 16 bytes of a vector.
const fn repeated(table: [u8; 16]) -> [u8; 4 * WIDTH] {
    let mut all = [0; 4 * WIDTH];
    let mut i = 0;
    while i < all.len() {
        all[i] = table[i % 16];
        i += 1;
    }
    all
}

/// `reverse_bits` of each, with lookups in registers.
#[inline(always)]
fn reversed_by_tables(simd: V4, n: [u32; WIDTH]) -> [u32; WIDTH] {
    // The reversed bits of the lower and of the upper half of a byte.
    const LOWER: [u8; 4 * WIDTH] =
        repeated([0x00, 0x80, 0x40, 0xc0, 0x20, 0xa0, 0x60, 0xe0, 0x10, 0x90, 0x50, 0xd0, 0x30, 0xb0, 0x70, 0xf0]);
    const UPPER: [u8; 4 * WIDTH] = repeated([0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15]);
    const SWAPPED_BYTES: [u8; 4 * WIDTH] = repeated([3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12]);
    let swapped: [u32; WIDTH] = cast(simd.avx512bw._mm512_shuffle_epi8(cast(n), cast(SWAPPED_BYTES)));
    let (mut lower, mut upper) = ([0; WIDTH], [0; WIDTH]);
    for i in 0..WIDTH {
        lower[i] = swapped[i] & 0x0f0f_0f0f;
        upper[i] = swapped[i] >> 4 & 0x0f0f_0f0f;
    }
    let lower: [u32; WIDTH] = cast(simd.avx512bw._mm512_shuffle_epi8(cast(LOWER), cast(lower)));
    let upper: [u32; WIDTH] = cast(simd.avx512bw._mm512_shuffle_epi8(cast(UPPER), cast(upper)));
    let mut reversed = [0; WIDTH];
    for i in 0..WIDTH {
        reversed[i] = lower[i] | upper[i];
    }
    reversed
}

/// `reverse_bits` in steps that every vector unit has.
#[inline(always)]
fn reversed(n: u32) -> u32 {
    let n = (n >> 1 & 0x5555_5555) | (n & 0x5555_5555) << 1;
    let n = (n >> 2 & 0x3333_3333) | (n & 0x3333_3333) << 2;
    let n = (n >> 4 & 0x0f0f_0f0f) | (n & 0x0f0f_0f0f) << 4;
    n.swap_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use crate::math::rows::BATCH;
    use crate::math::vectorize::with_each;

    #[test]
    fn numbers_are_those_of_single_samples_on_every_instruction_set() {
        let mut rng = Rng::new(31);
        for round in 0..200u32 {
            let mut requests = SampleIdRows::default();
            for (pixel, sample) in requests.pixels.iter_mut().zip(&mut requests.samples) {
                *pixel = PixelSeed(rng.bits() as u32);
                *sample = rng.bits() as u32 >> (round % 32);
            }
            let (set, count) = (rng.bits() as u32, 1 + rng.bits() as usize % BATCH);
            for kind in [SamplerKind::Sobol, SamplerKind::Independent] {
                let sampler = Sampler::new(kind, 5);
                let mut results = [(); 4].map(|()| SampleRows::default());
                let [first, others @ ..] = &mut results;
                sampler.sample_4d_batch(&requests, count, set, first);
                let mut others = others.iter_mut();
                match kind {
                    SamplerKind::Sobol => {
                        with_each!(draw::<true>(&requests, count, set, others.next().unwrap()));
                    }
                    SamplerKind::Independent => {
                        with_each!(draw::<false>(&requests, count, set, others.next().unwrap()));
                    }
                }
                let run = 4 - others.len();
                for numbers in &results[..run] {
                    for i in 0..count {
                        assert_eq!(numbers.of(i), sampler.sample_4d(requests.pixels[i], requests.samples[i], set));
                    }
                }
            }
        }
    }
}
