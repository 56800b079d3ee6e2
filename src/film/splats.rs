//! Shared samples of a cell, weighted for each pixel that they reach.

use super::accumulator::{Accumulator, Values};
use super::cells::Cells;
use super::filter::Taps;
use super::sum::SumPlane;

/// Sums over few samples of one cell, in the order in which they come: a pass over the cell. Sums of passes then go
/// into exact sums, so that each sample touches several pixels at little cost.
#[derive(Clone, Debug, Default)]
pub struct Splats {
    /// By entry: weighted red, green, blue and alpha, then the weight.
    color: Vec<[f32; 8]>,
    /// By average and entry: weighted red, green and blue. Averages that were black so far are empty.
    averages: Vec<Vec<[f32; 4]>>,
}

impl Splats {
    /// A bound for the sum of weights that reach an entry in a pass of a few samples per pixel, with ample room.
    pub const MOST_TERMS: f32 = 1e6;

    /// Adds a sample of the pixel with this entry.
    #[inline]
    pub(super) fn add(&mut self, cells: &Cells, entry: usize, taps: &[Taps; 2], values: &Values) {
        let count = cells.entries_of_cell();
        if self.color.is_empty() {
            self.color.resize(count, [0.0; 8]);
        }
        let entry = entry % count;
        let [r, g, b, a] = values.color;
        let terms = [r, g, b, a, 1.0, 0.0, 0.0, 0.0];
        cells.for_each_tap(entry, taps, |entry, weight| {
            for (sum, term) in self.color[entry].iter_mut().zip(terms) {
                *sum += weight * term;
            }
        });
        values.for_each_average(|k, value| {
            let sums = plane(&mut self.averages, k, count);
            let terms = [value.r, value.g, value.b, 0.0];
            cells.for_each_tap(entry, taps, |entry, weight| {
                for (sum, term) in sums[entry].iter_mut().zip(terms) {
                    *sum += weight * term;
                }
            });
        });
    }

    /// Adds all samples to the entries of a cell, and empties itself.
    pub(super) fn flush(&mut self, cells: &Cells, cell: usize, filtered: &mut Accumulator, weights: &mut SumPlane<1>) {
        let first = cell * cells.entries_of_cell();
        for (entry, color) in (first..).zip(&self.color) {
            let [r, g, b, a, w, ..] = color.map(f64::from);
            filtered.color.add(entry, [r, g, b, a]);
            weights.add(entry, [w]);
        }
        for (k, sums) in self.averages.iter().enumerate().filter(|(_, sums)| !sums.is_empty()) {
            let plane = filtered.average_mut(k);
            for (entry, &[r, g, b, _]) in (first..).zip(sums) {
                plane.add(entry, [r, g, b].map(f64::from));
            }
        }
        self.color.clear();
        self.averages.iter_mut().for_each(Vec::clear);
    }
}

/// The sums of an average.
#[inline(always)]
fn plane(averages: &mut Vec<Vec<[f32; 4]>>, index: usize, entries: usize) -> &mut [[f32; 4]] {
    if averages.len() <= index {
        averages.resize_with(index + 1, Vec::new);
    }
    let plane = &mut averages[index];
    if plane.is_empty() {
        plane.resize(entries, [0.0; 4]);
    }
    plane
}
