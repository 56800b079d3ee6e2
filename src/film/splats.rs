//! Shared samples of a cell, weighted for each pixel that they reach.

use super::cells::Cells;
use super::filter::Taps;
use super::sum::{Sums, slice};
use super::tile::{Accumulator, Values};

/// Sums over few samples of one cell, in the order in which they come: a pass over the cell. Sums of passes then go
/// into exact sums, so that each sample touches several pixels at little cost.
#[derive(Clone, Debug, Default)]
pub struct Splats {
    /// By entry: weighted red, green, blue and alpha, then the weight.
    color: Vec<[f32; 8]>,
    /// By entry: weighted channels.
    channels: Vec<f32>,
    channel_count: usize,
}

impl Splats {
    /// A bound for the sum of weights that reach an entry in a pass of a few samples per pixel, with ample room.
    pub const MOST_TERMS: f32 = 1e6;

    /// Adds a sample of the pixel with this entry.
    #[inline]
    pub(super) fn add(&mut self, cells: &Cells, entry: usize, taps: &[Taps; 2], values: &Values) {
        if self.color.is_empty() {
            self.color.resize(cells.entries_of_cell(), [0.0; 8]);
            self.channel_count = values.channels();
            self.channels.resize(cells.entries_of_cell() * self.channel_count, 0.0);
        }
        let entry = entry % cells.entries_of_cell();
        let [r, g, b, a] = values.color;
        let terms = [r, g, b, a, 1.0, 0.0, 0.0, 0.0];
        cells.for_each_tap(entry, taps, |entry, weight| {
            for (sum, term) in self.color[entry].iter_mut().zip(terms) {
                *sum += weight * term;
            }
        });
        if self.channel_count > 0 {
            cells.for_each_tap(entry, taps, |entry, weight| {
                let sums = &mut self.channels[entry * self.channel_count..(entry + 1) * self.channel_count];
                values.for_each_channel(|k, value| sums[k] += weight * value);
            });
        }
    }

    /// Adds all samples to the entries of a cell, and empties itself.
    pub(super) fn flush(&mut self, cells: &Cells, cell: usize, filtered: &mut Accumulator, weights: &mut [Sums<1>]) {
        let first = cell * cells.entries_of_cell();
        let stride = 2 * self.channel_count;
        let (colors, weights) = (&mut filtered.color[first..], &mut weights[first..]);
        for ((sums, color), weight) in self.color.iter().zip(colors).zip(weights) {
            let [r, g, b, a, w, ..] = sums.map(f64::from);
            color.add([r, g, b, a]);
            weight.add([w]);
        }
        if stride > 0 {
            let channels = self.channels.chunks_exact(self.channel_count);
            for (channels, to) in channels.zip(filtered.channels[first * stride..].chunks_exact_mut(stride)) {
                slice::add(to, channels.iter().map(|&value| f64::from(value)));
            }
        }
        self.color.clear();
        self.channels.clear();
    }
}
