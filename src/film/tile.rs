//! A rectangle of the film, which sums samples.

use super::cells::Cells;
use super::layer::channels_of;
use super::nearest::Nearest;
use super::splats::Splats;
use super::sum::{Sums, slice};
use super::{CoverageCounts, Crop, Filtering, LayerKind, Layout, PixelSample, Sample, Source, SurfaceSample, Taps};
use crate::color::Rgb;

/// How many dropped samples a tile remembers; it counts all of them.
pub(super) const DROPPED_KEPT: usize = 16;

/// A sample that was dropped because it was not finite; it can be replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct DroppedSample {
    /// Column in the full picture (of a tile: on the film).
    pub x: u32,
    /// Row in the full picture (of a tile: on the film).
    pub y: u32,
    /// Index of the sample.
    pub sample: u32,
}

/// How far groups of a pixel's samples lie apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SampleMoments {
    pub groups: u32,
    pub sums: Sums<3>,
    pub squares: Sums<3>,
}

/// A pixel of samples that do not all count the same.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InverseVarianceSums {
    pub count: f64,
    pub variance: [f64; 3],
}

/// What is summed of a sample.
pub(super) struct Values<'a> {
    /// Radiance and alpha.
    pub color: [f32; 4],
    light_aovs: &'a [Rgb],
    /// Of layers of surfaces that are averaged.
    means: [f32; MAX_MEANS],
    /// Channels of parts, and of these layers.
    counts: [usize; 2],
}

impl Values<'_> {
    fn read_means(&mut self, layout: Layout, surface: Option<&SurfaceSample>) {
        let Some(surface) = surface else { return };
        let mut start = 0;
        for info in layout.set.surfaces(Filtering::Mean) {
            if let Source::Surface(read, _) = info.source {
                read(surface, &mut self.means[start..start + info.channels.len()]);
            }
            start += info.channels.len();
        }
    }

    /// Number of channels beside the colour.
    #[inline]
    pub fn channels(&self) -> usize {
        self.counts[0] + self.counts[1]
    }

    /// Calls `f` with the index and value of each channel beside the colour that is not 0.
    #[inline]
    pub fn for_each_channel(&self, mut f: impl FnMut(usize, f32)) {
        // Most parts of a sample are black.
        for (i, part) in self.light_aovs.iter().enumerate().filter(|(_, part)| !part.is_black()) {
            part.to_array().into_iter().enumerate().for_each(|(k, value)| f(3 * i + k, value));
        }
        let means = &self.means[..self.counts[1]];
        means.iter().enumerate().filter(|(_, value)| **value != 0.0).for_each(|(k, &value)| f(self.counts[0] + k, value));
    }
}

/// Most channels of layers of surfaces that are averaged.
const MAX_MEANS: usize = channels_of(Filtering::Mean);

/// Sums over the weighted samples that reach an entry of the tile's cells, or over the samples of a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Accumulator {
    /// Radiance and alpha.
    pub color: Vec<Sums<4>>,
    /// The channels beside the colour that are averaged: those of parts, then those of surfaces; an entry's
    /// [values](mod@slice) side by side.
    pub channels: Vec<f64>,
}

impl Accumulator {
    fn new(count: usize, layout: Layout) -> Self {
        Self { color: vec![Sums::default(); count], channels: vec![0.0; count * layout.channel_stride()] }
    }

    #[inline(always)]
    fn add(&mut self, index: usize, value: &Values, weight: f32) {
        let weight = f64::from(weight);
        let [r, g, b, a] = value.color;
        self.color[index].add([weight * f64::from(r), weight * f64::from(g), weight * f64::from(b), weight * f64::from(a)]);
        let stride = 2 * value.channels();
        if stride > 0 {
            let sums = &mut self.channels[index * stride..(index + 1) * stride];
            value.for_each_channel(|k, value| slice::add_at(sums, k, [weight * f64::from(value)]));
        }
    }

    /// Adds the sums of another, times a factor.
    fn merge(&mut self, other: &Self, stride: usize, factor: f64) {
        for (sums, others) in self.color.iter_mut().zip(&other.color) {
            if factor == 1.0 { sums.merge(others) } else { sums.add(others.values().map(|sum| factor * sum)) }
        }
        if stride > 0 {
            for (sums, others) in self.channels.chunks_exact_mut(stride).zip(other.channels.chunks_exact(stride)) {
                if factor == 1.0 {
                    slice::merge(sums, others);
                } else {
                    slice::add(sums, (0..stride / 2).map(|k| factor * slice::value(others, k)));
                }
            }
        }
    }
}

/// A rectangle of the film. Tiles share nothing, so each can be filled by a thread of its own; what shared samples
/// bring to pixels of other tiles is in the borders of the tile's cells until the picture is made.
///
/// [`Sums`] do not depend on the order of samples: whoever adds the same samples gets the same picture, in one tile or merged from several.
#[derive(Clone, Debug)]
pub struct FilmTile {
    pub(super) area: Crop,
    pub(super) active: Crop,
    pub(super) layout: Layout,
    pub(super) cells: Cells,
    /// By entry of the cells: sums of weighted samples.
    pub(super) filtered: Accumulator,
    /// By entry of the cells: sums of the weights. Empty if every weight is 1.
    pub(super) weights: Vec<Sums<1>>,
    /// By pixel: sums of its own samples. Empty unless the filter has negative lobes.
    pub(super) own: Accumulator,
    /// Samples of each pixel that were kept.
    pub(super) samples: Vec<u32>,
    /// Layers of data.
    pub(super) nearest: Nearest,
    /// By entry of the cells; only of layers that need it.
    pub(super) coverage: Option<CoverageCounts>,
    /// Empty unless the variance is asked for.
    pub(super) spread: Vec<SampleMoments>,
    /// What each pixel's samples count together and the variance of their mean. Empty while each counts once.
    pub(super) weighed: Vec<InverseVarianceSums>,
    pub(super) dropped_count: u64,
    pub(super) dropped: Vec<DroppedSample>,
}

impl FilmTile {
    pub(super) fn new(area: Crop, active: Crop, layout: Layout) -> Self {
        let pixels = area.area() as usize;
        let cells = Cells::new([area.width, area.height], layout.cell_size, layout.border);
        let entries = cells.entries();
        Self {
            area,
            active,
            layout,
            cells,
            filtered: Accumulator::new(entries, layout),
            weights: vec![Sums::default(); if layout.is_weighted() { entries } else { 0 }],
            own: Accumulator::new(if layout.signed { pixels } else { 0 }, layout),
            samples: vec![0; pixels],
            nearest: Nearest::new(pixels, layout.data_channels),
            coverage: layout.set.needs_coverage().then(|| CoverageCounts::new(entries)),
            spread: vec![SampleMoments::default(); if layout.set.contains(LayerKind::Variance) { pixels } else { 0 }],
            weighed: Vec::new(),
            dropped_count: 0,
            dropped: Vec::new(),
        }
    }

    /// A tile of the same pixels and layers without samples.
    pub fn empty(&self) -> Self {
        Self::new(self.area, self.active, self.layout)
    }

    /// The upper left corner in the full picture.
    pub fn origin(&self) -> [u32; 2] {
        [self.area.x, self.area.y]
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.area.width, self.area.height]
    }

    /// The pixels that reach the picture: those within the film's crop, in coordinates of the full picture. Never empty.
    pub fn active(&self) -> Crop {
        self.active
    }

    /// The index of a pixel of the full picture, which lies within the tile.
    #[inline]
    pub fn index(&self, x: u32, y: u32) -> usize {
        (y - self.area.y) as usize * self.area.width as usize + (x - self.area.x) as usize
    }

    /// Adds a sample to the pixel with this index (row by row within the tile) alone; `sample` is the sample's index,
    /// `weight` the filter's. A sample that is not finite is dropped and counted, and `false` returned.
    #[inline]
    pub fn add<'a>(&mut self, pixel: usize, sample: u32, value: impl Into<Sample<'a>>, weight: f32) -> bool {
        let value = value.into();
        if !self.layout.beside_color() && self.weights.is_empty() {
            return self.add_color(pixel, sample, value.pixel, weight);
        }
        let Some(values) = self.take(pixel, sample, value, weight) else { return false };
        let entry = self.cells.entry_of(pixel);
        self.filtered.add(entry, &values, weight);
        if let Some(sum) = self.weights.get_mut(entry) {
            sum.add([f64::from(weight)]);
        }
        if let (Some(coverage), Some(surface)) = (&mut self.coverage, value.surface) {
            coverage.add(entry, surface.shown, 1);
        }
        true
    }

    /// [`add`](Self::add) where nothing but the colour is kept, and all samples weigh the same.
    #[inline(always)]
    fn add_color(&mut self, pixel: usize, sample: u32, PixelSample { radiance, alpha }: &PixelSample, weight: f32) -> bool {
        if !is_finite(weight, *radiance, *alpha) {
            self.drop_sample(pixel, sample);
            return false;
        }
        let weight = f64::from(weight);
        let color = [radiance.r, radiance.g, radiance.b, *alpha].map(|value| weight * f64::from(value));
        self.filtered.color[self.cells.entry_of(pixel)].add(color);
        self.samples[pixel] += 1;
        true
    }

    /// As [`add`](Self::add), to all pixels that a shared sample reaches, with the weights of
    /// [`Filter::splat_taps`](super::Filter::splat_taps).
    /// `splats` collects samples of one cell, and [`flush`](Self::flush) adds them to the tile.
    #[inline]
    pub fn splat<'a>(&mut self, pixel: usize, sample: u32, value: impl Into<Sample<'a>>, taps: &[Taps; 2], splats: &mut Splats) -> bool {
        let value = value.into();
        // A sum of as many terms as a pixel has neighbours is to be finite, too.
        let Some(values) = self.take(pixel, sample, value, Splats::MOST_TERMS) else { return false };
        let first = self.cells.entry_of(pixel);
        splats.add(&self.cells, first, taps, &values);
        if let (Some(coverage), Some(surface)) = (&mut self.coverage, value.surface) {
            self.cells.for_each_tap(first, taps, |entry, weight| {
                coverage.add(entry, surface.shown, (f64::from(weight.abs()) * COVERAGE_UNITS).round() as u64);
            });
        }
        true
    }

    /// Adds the samples of the cell that has this pixel, and empties `splats`.
    pub fn flush(&mut self, pixel: usize, splats: &mut Splats) {
        splats.flush(&self.cells, self.cells.cell_of(pixel), &mut self.filtered, &mut self.weights);
    }

    /// Adds a sample to what is kept of its own pixel and returns what is filtered; `None` if it is not finite.
    #[inline(always)]
    fn take<'a>(&mut self, pixel: usize, sample: u32, value: Sample<'a>, weight: f32) -> Option<Values<'a>> {
        let Sample { pixel: PixelSample { radiance, alpha }, surface, light_aovs } = value;
        let mut values =
            Values { color: [radiance.r, radiance.g, radiance.b, *alpha], light_aovs: &[], means: [0.0; MAX_MEANS], counts: [0; 2] };
        let mut finite = is_finite(weight, *radiance, *alpha);
        if self.layout.beside_color() {
            values.light_aovs = &light_aovs[..self.layout.light_aovs.count().min(light_aovs.len())];
            values.counts = [3 * self.layout.light_aovs.count(), self.layout.mean_channels];
            values.read_means(self.layout, surface);
            values.for_each_channel(|_, value| finite &= (weight * value).is_finite());
            finite = finite && surface.is_none_or(|surface| self.nearest.add(pixel, sample, surface, self.layout.set));
        }
        if !finite {
            self.drop_sample(pixel, sample);
            return None;
        }
        if self.layout.signed {
            self.own.add(pixel, &values, 1.0);
        }
        self.samples[pixel] += 1;
        Some(values)
    }

    /// Adds a group of the pixel's samples, which have been added, by their mean radiance, if the variance is asked
    /// for. The better the samples of a group are spread, the less is their variance overestimated; all groups of a
    /// pixel are of one size.
    #[inline]
    pub fn add_moments(&mut self, pixel: usize, radiance: [f64; 3]) {
        let Some(spread) = self.spread.get_mut(pixel) else { return };
        spread.groups += 1;
        spread.sums.add(radiance);
        spread.squares.add(radiance.map(|value| value * value));
    }

    /// Whether [`add_moments`](Self::add_moments) does anything.
    #[inline]
    pub fn tracks_variance(&self) -> bool {
        !self.spread.is_empty()
    }

    /// Mean of a pixel's own groups and the variance of that mean, by channel; `None` with fewer than two groups.
    pub fn group_statistics(&self, pixel: usize) -> Option<([f64; 3], [f64; 3])> {
        let spread = self.spread.get(pixel).filter(|spread| spread.groups >= 2)?;
        let n = f64::from(spread.groups);
        let mean = spread.sums.values().map(|sum| sum / n);
        let square = spread.squares.values().map(|sum| sum / n);
        let variance = [0, 1, 2].map(|k| ((square[k] - mean[k] * mean[k]) / (n - 1.0)).max(0.0));
        Some((mean, variance))
    }

    /// The variance of the mean of a pixel's own samples; 0 where it is not known.
    pub(super) fn variance(&self, pixel: usize) -> [f64; 3] {
        let weighed = self.weighed.get(pixel).map(|weighed| weighed.variance);
        weighed.unwrap_or_else(|| self.group_statistics(pixel).unwrap_or_default().1)
    }

    /// The mean radiance of a pixel's own groups.
    pub fn mean(&self, pixel: usize) -> [f64; 3] {
        self.spread.get(pixel).map_or([0.0; 3], |spread| spread.sums.values().map(|sum| sum / f64::from(spread.groups.max(1))))
    }

    /// What a pixel's own samples count together.
    #[inline]
    pub(super) fn count_at(&self, pixel: usize) -> f64 {
        self.weighed.get(pixel).map_or(f64::from(self.samples[pixel]), |weighed| weighed.count)
    }

    /// The most samples that a pixel of the same cell as this one has.
    pub(super) fn samples_of_cell(&self, pixel: usize) -> f64 {
        let size = self.layout.cell_size;
        let [x, y] = [pixel as u32 % self.area.width, pixel as u32 / self.area.width].map(|at| at / size * size);
        let (right, bottom) = ((x + size).min(self.area.width), (y + size).min(self.area.height));
        let rows = (y..bottom).map(|y| (y * self.area.width + x) as usize..(y * self.area.width + right) as usize);
        rows.flatten().map(|pixel| self.count_at(pixel)).fold(0.0, f64::max)
    }

    /// Adds all samples of another tile of the same pixels and layers.
    pub fn merge(&mut self, other: &Self) {
        self.merge_sums(other, 1.0);
        for (spread, others) in self.spread.iter_mut().zip(&other.spread) {
            spread.groups = spread.groups.saturating_add(others.groups);
            spread.sums.merge(&others.sums);
            spread.squares.merge(&others.squares);
        }
    }

    /// Adds all samples of another tile of the same pixels and layers, each counted `factor` times as much as a single
    /// one, except in layers of data and of coverage. Nothing may be added to this tile but by this.
    pub fn merge_inverse_variance(&mut self, other: &Self, factor: f64) {
        self.weighed.resize(self.samples.len(), InverseVarianceSums::default());
        for (pixel, weighed) in self.weighed.iter_mut().enumerate() {
            let count = f64::from(other.samples[pixel]) * factor;
            let (ours, theirs) = (weighed.count, count);
            weighed.count += count;
            if weighed.count > 0.0 {
                // Where a pixel's variance is not known, its samples are taken to be as good as the others.
                let known = other.group_statistics(pixel).map(|(_, variance)| variance);
                for k in 0..3 {
                    let own = weighed.variance[k];
                    let other = known.map_or(own * ours / theirs.max(f64::MIN_POSITIVE), |variance| variance[k]);
                    weighed.variance[k] = (ours * ours * own + theirs * theirs * other) / (weighed.count * weighed.count);
                }
            }
        }
        self.merge_sums(other, factor);
    }

    fn merge_sums(&mut self, other: &Self, factor: f64) {
        let stride = self.layout.channel_stride();
        self.filtered.merge(&other.filtered, stride, factor);
        self.own.merge(&other.own, stride, factor);
        for (sum, others) in self.weights.iter_mut().zip(&other.weights) {
            if factor == 1.0 { sum.merge(others) } else { sum.add(others.values().map(|sum| factor * sum)) }
        }
        for (sum, count) in self.samples.iter_mut().zip(&other.samples) {
            *sum = sum.saturating_add(*count);
        }
        self.nearest.merge(&other.nearest);
        if let (Some(coverage), Some(other)) = (&mut self.coverage, &other.coverage) {
            coverage.merge(other);
        }
        self.dropped_count = self.dropped_count.saturating_add(other.dropped_count);
        self.dropped.extend(other.dropped.iter().take(DROPPED_KEPT - self.dropped.len().min(DROPPED_KEPT)));
    }

    #[cold]
    fn drop_sample(&mut self, pixel: usize, sample: u32) {
        self.dropped_count += 1;
        if self.dropped.len() < DROPPED_KEPT {
            let (row, column) = (pixel as u32 / self.area.width, pixel as u32 % self.area.width);
            self.dropped.push(DroppedSample { x: self.area.x + column, y: self.area.y + row, sample });
        }
    }
}

/// Whether a weighted sample is finite. A sum is only if every term is, save for an overflow, which is no use either.
#[inline(always)]
fn is_finite(weight: f32, radiance: Rgb, alpha: f32) -> bool {
    (weight * (radiance.r.abs() + radiance.g.abs() + radiance.b.abs() + alpha.abs())).is_finite()
}

/// Units of coverage of a shared sample of weight 1.
const COVERAGE_UNITS: f64 = (1u64 << 20) as f64;
