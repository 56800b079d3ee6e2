//! Shared samples of a cell, weighted for each pixel that they reach.

use super::accumulator::{Accumulator, Values};
use super::cells::Cells;
use super::shared_weights::Splat;
use super::sum::SumPlane;
use crate::color::Rgb;

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

    /// Adds the radiance and alpha of a sample of a cell with this many entries.
    #[inline(always)]
    pub(super) fn add_color<const N: usize>(&mut self, entries: usize, splat: &Splat<N>, color: [f32; 4]) {
        if self.color.is_empty() {
            self.color.resize(entries, [0.0; 8]);
        }
        let [r, g, b, a] = color;
        splat.add(&mut self.color, [r, g, b, a, 1.0, 0.0, 0.0, 0.0]);
    }

    /// Adds all values of a sample.
    #[inline(always)]
    pub(super) fn add<const N: usize>(&mut self, entries: usize, splat: &Splat<N>, values: &Values) {
        self.add_color(entries, splat, values.color);
        values.for_each_average(|k, Rgb { r, g, b }| {
            splat.add(plane(&mut self.averages, k, entries), [r, g, b, 0.0]);
        });
    }

    /// Adds all samples to the entries of a cell, and empties itself.
    pub(super) fn flush(&mut self, cells: &Cells, cell: usize, filtered: &mut Accumulator, weights: &mut SumPlane<1>) {
        let first = cell * cells.entries_of_cell();
        filtered.color.add_run(first, self.color.iter().map(|&[r, g, b, a, ..]| [r, g, b, a].map(f64::from)));
        weights.add_run(first, self.color.iter().map(|&[_, _, _, _, weight, ..]| [f64::from(weight)]));
        for (k, sums) in self.averages.iter().enumerate().filter(|(_, sums)| !sums.is_empty()) {
            filtered.average_mut(k).add_run(first, sums.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)));
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
