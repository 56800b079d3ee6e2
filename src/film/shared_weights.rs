//! The weights of shared samples for the pixels that they reach.

use super::WorldSample;
use super::cells::Cells;
use super::filter::{STEPS, evaluate};
use crate::desc::FilterDesc;

/// Cells of the offsets within a pixel, an even number: usual filters have their kinks at ends of cells.
pub(super) const OFFSET_CELLS: usize = 256;

/// Most pixels along an axis that a shared sample reaches.
pub(super) const MAX_TAPS: usize = 8;

/// The weights of shared samples by offset from their pixel's centre, along one axis; linear within a cell of offsets,
/// so that kinks and ends of the filter within a cell (none at the usual radii) are smoothed. Over all offsets within a
/// pixel, the weights of a sample have a mean sum of 1.
#[derive(Clone, Debug)]
pub(super) struct SharedWeights {
    /// As [`Filter::border`](super::Filter::border).
    border: i32,
    /// How many pixels have weights: 2, 3, 4 or [`MAX_TAPS`].
    count: usize,
    /// By cell of offsets: the first pixel.
    first: [i8; OFFSET_CELLS],
    /// By cell: the weights at its lower end, then what they grow by up to the upper one.
    weights: Vec<f32>,
}

/// The weights of a shared sample along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taps<const N: usize> {
    /// The first pixel, counted from the sample's own.
    pub first: i32,
    /// How many pixels; the weights beyond are 0.
    pub count: usize,
    /// By pixel.
    pub weights: [f32; N],
}

/// The entries of a cell that a shared sample reaches.
pub(super) struct Splat<const N: usize> {
    /// The first entry of the first row.
    first: usize,
    /// Entries from one row to the next.
    stride: usize,
    columns: Taps<N>,
    rows: Taps<N>,
}

impl SharedWeights {
    pub fn new(desc: &FilterDesc) -> Self {
        let radius = f64::from(desc.radius());
        let half: f64 = (0..STEPS)
            .map(|i| (i as f64 + 0.5) * radius / STEPS as f64)
            .map(|x| evaluate(desc, x) * radius / STEPS as f64)
            .sum();
        let border = (radius - 0.5).ceil() as i32;
        let count = Some((2.0 * radius).ceil() as usize).filter(|count| *count <= 4).unwrap_or(MAX_TAPS);
        let (mut first, mut weights) = ([0; OFFSET_CELLS], Vec::with_capacity(2 * OFFSET_CELLS * count));
        for (cell, first) in first.iter_mut().enumerate() {
            let ends = [cell, cell + 1].map(|end| end as f64 / OFFSET_CELLS as f64 - 0.5);
            let pixel = ((ends[0] - radius).floor() as i32 + 1).min(border + 1 - count as i32).max(-border);
            *first = pixel as i8;
            let weight = |k: usize, end: f64| {
                if pixel + k as i32 > border {
                    0.0
                } else {
                    evaluate(desc, f64::from(pixel + k as i32) - end) / (2.0 * half)
                }
            };
            weights.extend((0..count).map(|k| weight(k, ends[0]) as f32));
            weights.extend((0..count).map(|k| (weight(k, ends[1]) - weight(k, ends[0])) as f32));
        }
        Self { border, count, first, weights }
    }

    /// How many pixels beyond its own a sample reaches in each direction.
    #[inline]
    pub fn border(&self) -> i32 {
        self.border
    }

    /// How many pixels along an axis have weights: 2, 3, 4 or [`MAX_TAPS`].
    #[inline]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The weights at this offset from the pixel's centre, from -0.5 to 0.5; `N` is [`count`](Self::count).
    #[inline(always)]
    pub fn taps<const N: usize>(&self, offset: f32) -> Taps<N> {
        let at = (offset + 0.5) * OFFSET_CELLS as f32;
        let cell = (at as i32).clamp(0, OFFSET_CELLS as i32 - 1);
        let within = at - cell as f32;
        let cell = cell as usize;
        let (low, growth) = self.weights[2 * N * cell..2 * N * (cell + 1)].split_at(N);
        let mut weights = [0.0; N];
        for k in 0..N {
            weights[k] = low[k] + within * growth[k];
        }
        let first = i32::from(self.first[cell]);
        // The usual counts are constants, for unrolled loops: as many pixels lie within the border.
        let count = if N < MAX_TAPS { N } else { N.min((self.border + 1 - first) as usize) };
        Taps { first, count, weights }
    }

    /// The entries that a sample reaches; `N` is [`count`](Self::count).
    #[inline(always)]
    pub fn splat<const N: usize>(&self, cells: &Cells, at: &WorldSample) -> Splat<N> {
        let (columns, rows) = (self.taps::<N>(at.place.offset.x), self.taps::<N>(at.place.offset.y));
        let stride = cells.stride();
        let first = at.entry as isize + rows.first as isize * stride as isize + columns.first as isize;
        Splat { first: first as usize, stride, columns, rows }
    }
}

impl<const N: usize> Splat<N> {
    /// Calls `f` with every entry and its weight.
    #[inline(always)]
    pub fn for_each(&self, mut f: impl FnMut(usize, f32)) {
        for row in 0..self.rows.count {
            for column in 0..self.columns.count {
                f(self.first + row * self.stride + column, self.rows.weights[row] * self.columns.weights[column]);
            }
        }
    }

    /// Adds weighted terms to the sums of the entries.
    #[inline(always)]
    pub fn add<const K: usize>(&self, sums: &mut [[f32; K]], terms: [f32; K]) {
        for row in 0..self.rows.count {
            let first = self.first + row * self.stride;
            let sums = &mut sums[first..first + self.columns.count];
            for (sums, column) in sums.iter_mut().zip(self.columns.weights) {
                let weight = self.rows.weights[row] * column;
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += weight * term;
                }
            }
        }
    }
}
