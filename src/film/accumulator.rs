//! Sums over the samples of a tile.

use super::layer::MAX_MEANS;
use super::sum::SumPlane;
use super::{Layout, LightAovSample, WorldSample};
use crate::bytes::{ByteReader, ByteWriter};
use crate::color::Rgb;

/// Sums over groups of each pixel's samples, of their means and the squares of these.
///
/// Means are [`rounded`] to 16 bits, so that sums of squares are as exact as those of the means.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SampleMoments {
    /// Number of groups, by pixel.
    pub groups: Vec<u32>,
    pub sums: SumPlane<3>,
    pub squares: SumPlane<3>,
}

impl SampleMoments {
    /// Bytes of a pixel.
    pub const PIXEL_BYTES: usize = size_of::<u32>() + 2 * SumPlane::<3>::ENTRY_BYTES;

    pub fn new(pixels: usize) -> Self {
        Self { groups: vec![0; pixels], sums: SumPlane::new(pixels), squares: SumPlane::new(pixels) }
    }

    #[inline]
    pub fn add(&mut self, pixel: usize, mean: [f64; 3]) {
        self.groups[pixel] += 1;
        let mean = mean.map(rounded);
        self.sums.add(pixel, mean);
        self.squares.add(pixel, mean.map(|value| value * value));
    }

    /// Adds groups, at most one of each pixel, by pixel and mean.
    pub fn add_all(&mut self, buffer: &mut Vec<f64>, means: impl ExactSizeIterator<Item = (usize, [f64; 3])> + Clone) {
        means.clone().for_each(|(pixel, _)| self.groups[pixel] += 1);
        let means = means.map(|(pixel, mean)| (pixel, mean.map(rounded)));
        self.sums.add_all(buffer, means.clone());
        self.squares.add_all(buffer, means.map(|(pixel, mean)| (pixel, mean.map(|value| value * value))));
    }

    pub fn merge(&mut self, other: &Self) {
        self.groups.iter_mut().zip(&other.groups).for_each(|(sum, groups)| *sum = sum.saturating_add(*groups));
        self.sums.merge(&other.sums, 1.0);
        self.squares.merge(&other.squares, 1.0);
    }
}

/// To 16 bits: squares then have 32, and 2^17 of them are summed exactly as long as the sum is less than 2^28 times the
/// smallest. What rounding adds to a variance is below 1e-10 of the squared mean.
#[inline(always)]
fn rounded(value: f64) -> f64 {
    const DROPPED: u32 = 52 - 15;
    f64::from_bits((value.to_bits() + (1 << (DROPPED - 1))) & (u64::MAX << DROPPED))
}

/// What is summed of a sample.
pub(super) struct Values<'a> {
    /// Radiance and alpha.
    pub color: [f32; 4],
    pub light_aovs: LightAovSample<'a>,
    /// Of layers of surfaces that are averaged; the others are black.
    pub means: [Rgb; MAX_MEANS],
    /// The index of the first of these among the averages.
    pub first_mean: usize,
}

impl Values<'_> {
    /// Calls `f` with the index and value of each average beside the colour that is not black.
    #[inline(always)]
    pub fn for_each_average(&self, mut f: impl FnMut(usize, Rgb)) {
        self.light_aovs.for_each(&mut f);
        let means = self.means.iter().enumerate().filter(|(_, value)| !value.is_black());
        means.for_each(|(i, &value)| f(self.first_mean + i, value));
    }
}

/// Sums over the weighted samples that reach an entry of the tile's cells, or over the samples of a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Accumulator {
    entries: usize,
    /// Radiance and alpha.
    pub color: SumPlane<4>,
    /// The averages beside the colour: light AOVs, then layers of surfaces. Those that are black everywhere are empty.
    pub averages: Vec<SumPlane<3>>,
}

impl Accumulator {
    pub fn new(entries: usize, layout: &Layout) -> Self {
        Self { entries, color: SumPlane::new(entries), averages: vec![SumPlane::default(); layout.averages()] }
    }

    /// The sums of an average, which is not black everywhere.
    #[inline(always)]
    pub fn average_mut(&mut self, index: usize) -> &mut SumPlane<3> {
        let plane = &mut self.averages[index];
        if plane.is_empty() {
            *plane = SumPlane::new(self.entries);
        }
        plane
    }

    #[inline(always)]
    pub fn add(&mut self, entry: usize, value: &Values, weight: f32) {
        let weight = f64::from(weight);
        self.color.add(entry, value.color.map(|value| weight * f64::from(value)));
        value.for_each_average(|k, value| {
            self.average_mut(k).add(entry, value.to_array().map(|value| weight * f64::from(value)));
        });
    }

    /// Adds one average of samples; a sample's entry is its pixel.
    #[inline(always)]
    pub fn add_average(
        &mut self,
        index: usize,
        samples: &[WorldSample],
        buffer: &mut Vec<f64>,
        value: impl Fn(&WorldSample) -> Rgb,
    ) {
        if samples.iter().any(|at| !value(at).is_black()) {
            let terms = samples.iter().map(|at| at.weighted(value(at).to_array()));
            self.average_mut(index).add_all(buffer, terms);
        }
    }

    /// Adds the sums of another, times a factor.
    pub fn merge(&mut self, other: &Self, factor: f64) {
        self.color.merge(&other.color, factor);
        for (k, average) in other.averages.iter().enumerate().filter(|(_, average)| !average.is_empty()) {
            self.average_mut(k).merge(average, factor);
        }
    }

    /// The sum of an average at an entry.
    #[inline]
    pub fn average(&self, index: usize, entry: usize) -> [f64; 3] {
        let plane = &self.averages[index];
        if plane.is_empty() { [0.0; 3] } else { plane.values(entry) }
    }

    pub fn save(&self, out: &mut ByteWriter) {
        self.color.save(out);
        self.averages.iter().for_each(|average| average.save(out));
    }

    /// Replaces the sums by saved ones.
    pub fn load(&mut self, data: &mut ByteReader) -> Option<()> {
        self.color = self.color.load_same(data)?;
        for average in &mut self.averages {
            *average = SumPlane::load(data).filter(|plane| plane.is_empty() || plane.has_entries(self.entries))?;
        }
        Some(())
    }
}
