//! A rectangle of the film, which sums samples.

use super::accumulator::{Accumulator, SampleMoments, Values};
use super::cells::Cells;
use super::layer::MAX_MEANS;
use super::nearest::Nearest;
use super::shared_weights::{MAX_TAPS, SharedWeights};
use super::splats::Splats;
use super::sum::SumPlane;
use super::{
    CoverageCounts, Crop, Filter, FilterSample, LayerKind, Layout, LightAovSample, PixelSample, Sample, SampleBatch,
};
use crate::color::Rgb;

/// How many dropped samples a tile keeps; it counts all of them.
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

/// Where a sample of a batch belongs.
#[derive(Clone, Copy, Debug)]
pub struct WorldSample {
    /// Index in the batch.
    pub slot: u32,
    /// Index of the pixel (row by row within the tile).
    pub pixel: u32,
    /// Entry of the pixel within its cell.
    pub entry: u32,
    /// Index of the sample in its pixel.
    pub sample: u32,
    /// Where it lies, and the filter's weight.
    pub place: FilterSample,
}

impl WorldSample {
    /// The pixel, and values times the weight.
    #[inline(always)]
    pub(super) fn weighted<const N: usize>(&self, values: [f32; N]) -> (usize, [f64; N]) {
        let mut terms = [0.0; N];
        for (term, value) in terms.iter_mut().zip(values) {
            *term = f64::from(self.place.weight) * f64::from(value);
        }
        (self.pixel as usize, terms)
    }
}

/// A pixel of samples that do not all count the same.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InverseVarianceSums {
    pub count: f64,
    pub variance: [f64; 3],
}

/// A rectangle of the film. Tiles share nothing, so each can be filled by a thread of its own; what shared samples
/// add to pixels of other tiles is in the borders of the tile's cells until the picture is made.
///
/// [`SumPlane`]s do not depend on the order of samples: the same samples give the same picture, in one tile or merged
/// from several.
#[derive(Clone, Debug)]
pub struct FilmTile {
    pub(super) area: Crop,
    pub(super) active: Crop,
    pub(super) layout: Layout,
    pub(super) cells: Cells,
    /// By entry of the cells: sums of weighted samples.
    pub(super) filtered: Accumulator,
    /// By entry of the cells: sums of the weights. Empty if every weight is 1.
    pub(super) weights: SumPlane<1>,
    /// By pixel: sums of its own samples. Empty unless the filter has negative lobes.
    pub(super) own: Accumulator,
    /// Samples of each pixel that were kept.
    pub(super) samples: Vec<u32>,
    /// Layers of data.
    pub(super) nearest: Nearest,
    /// By entry of the cells; only of layers that need it.
    pub(super) coverage: Option<CoverageCounts>,
    /// Only if the variance is a layer.
    pub(super) moments: Option<SampleMoments>,
    /// What each pixel's samples count together and the variance of their mean. Empty while each counts once.
    pub(super) weighed: Vec<InverseVarianceSums>,
    pub(super) dropped_count: u64,
    pub(super) dropped: Vec<DroppedSample>,
}

impl FilmTile {
    pub(super) fn new(area: Crop, active: Crop, layout: Layout) -> Self {
        let (set, signed) = (layout.set, layout.signed);
        let pixels = area.area() as usize;
        let cells = Cells::new([area.width, area.height], layout.cell_size, layout.border);
        let entries = cells.entries();
        Self {
            area,
            active,
            layout,
            cells,
            filtered: Accumulator::new(entries, &layout),
            weights: SumPlane::new(if layout.is_weighted() { entries } else { 0 }),
            own: Accumulator::new(if signed { pixels } else { 0 }, &layout),
            samples: vec![0; pixels],
            nearest: Nearest::new(pixels, layout.nearest.channels()),
            coverage: set.needs_coverage().then(|| CoverageCounts::new(entries)),
            moments: set.contains(LayerKind::Variance).then(|| SampleMoments::new(pixels)),
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

    /// The pixels that reach the picture: those within the film's crop, in coordinates of the full picture. Never
    /// empty.
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
        self.add_values(pixel, &value, &values, weight);
        true
    }

    /// As [`add`](Self::add) for samples of a batch, at most one of each pixel, each of which is a
    /// [group](Self::add_moments) of its own. `buffer` is for what is added to one plane.
    pub fn add_batch(&mut self, batch: &SampleBatch, samples: &[WorldSample], buffer: &mut Vec<f64>) {
        if self.layout.signed || !batch.is_bounded() {
            for at in samples {
                let (pixel, slot) = (at.pixel as usize, at.slot as usize);
                if self.add(pixel, at.sample, batch.sample(slot), at.place.weight) {
                    self.add_moments(pixel, batch.radiance(slot));
                }
            }
            return;
        }
        for at in samples {
            let pixel = at.pixel as usize;
            self.samples[pixel] += 1;
            if let Some(surface) = batch.surfaces.get(at.slot as usize) {
                self.nearest.add(pixel, at.sample, surface, &self.layout.nearest);
                if let Some(coverage) = &mut self.coverage {
                    coverage.add(pixel, surface.visible_shape, 1);
                }
            }
        }
        self.add_planes(batch, samples, buffer);
    }

    /// Adds samples to the sums, one plane after the other.
    fn add_planes(&mut self, batch: &SampleBatch, samples: &[WorldSample], buffer: &mut Vec<f64>) {
        self.filtered
            .color
            .add_all(buffer, samples.iter().map(|at| at.weighted(batch.pixels[at.slot as usize].to_array())));
        if !self.weights.is_empty() {
            self.weights.add_all(buffer, samples.iter().map(|at| at.weighted([1.0])));
        }
        for (k, row) in batch.light_aovs.rows() {
            self.filtered.add_average(k, samples, buffer, |at| row[at.slot as usize]);
        }
        let (first, means) = (self.layout.light_aovs.count(), self.layout.means);
        for (k, read) in means.readers().enumerate() {
            self.filtered.add_average(first + k, samples, buffer, |at| {
                let mut value = [0.0; 3];
                read(&batch.surfaces[at.slot as usize], &mut value);
                Rgb::from(value)
            });
        }
        if let Some(moments) = &mut self.moments {
            moments.add_all(buffer, samples.iter().map(|at| (at.pixel as usize, batch.radiance(at.slot as usize))));
        }
    }

    /// Adds a sample that was taken to what is filtered.
    #[inline(always)]
    fn add_values(&mut self, pixel: usize, value: &Sample, values: &Values, weight: f32) {
        let entry = self.cells.entry_of(pixel);
        self.filtered.add(entry, values, weight);
        if !self.weights.is_empty() {
            self.weights.add(entry, [f64::from(weight)]);
        }
        if let (Some(coverage), Some(surface)) = (&mut self.coverage, value.surface) {
            coverage.add(entry, surface.visible_shape, 1);
        }
    }

    /// [`add`](Self::add) where nothing but the colour is kept, and all samples have the same weight.
    #[inline(always)]
    fn add_color(
        &mut self,
        pixel: usize,
        sample: u32,
        PixelSample { radiance, alpha }: &PixelSample,
        weight: f32,
    ) -> bool {
        if !is_finite(weight, *radiance, *alpha) {
            self.drop_sample(pixel, sample);
            return false;
        }
        let weight = f64::from(weight);
        let color = [radiance.r, radiance.g, radiance.b, *alpha].map(|value| weight * f64::from(value));
        self.filtered.color.add(self.cells.entry_of(pixel), color);
        self.samples[pixel] += 1;
        true
    }

    /// Where samples of the pixel with this index belong: the first sample of the first slot, at the pixel's centre.
    #[inline]
    pub fn world_sample(&self, pixel: usize) -> WorldSample {
        let entry = self.cells.entry_within_cell(pixel) as u32;
        WorldSample { slot: 0, pixel: pixel as u32, entry, sample: 0, place: FilterSample::default() }
    }

    /// As [`add`](Self::add), to all pixels that a sample of this filter reaches, which [shares](Filter::is_shared) its
    /// samples. `splats` collects samples of one cell, and [`flush`](Self::flush) adds them to the tile.
    #[inline]
    pub fn splat<'a>(
        &mut self,
        at: &WorldSample,
        value: impl Into<Sample<'a>>,
        filter: &Filter,
        splats: &mut Splats,
    ) -> bool {
        let mut is_added = false;
        self.splat_all([(at, value.into())].into_iter(), filter, splats, |_, _| is_added = true);
        is_added
    }

    /// As [`splat`](Self::splat) for samples of a batch and one cell, each of which is a [group](Self::add_moments) of
    /// its own; adds them to the tile.
    pub fn splat_batch(&mut self, batch: &SampleBatch, samples: &[WorldSample], filter: &Filter, splats: &mut Splats) {
        let values = samples.iter().map(|at| (at, batch.sample(at.slot as usize)));
        self.splat_all(values, filter, splats, |tile, at| {
            tile.add_moments(at.pixel as usize, batch.radiance(at.slot as usize));
        });
        if let Some(first) = samples.first() {
            self.flush(first.pixel as usize, splats);
        }
    }

    /// Calls `added` with each sample that was not dropped.
    #[inline(always)]
    fn splat_all<'a>(
        &mut self,
        samples: impl Iterator<Item = (&'a WorldSample, Sample<'a>)>,
        filter: &Filter,
        splats: &mut Splats,
        added: impl FnMut(&mut Self, &WorldSample),
    ) {
        let Some(weights) = filter.shared_weights() else { return };
        match weights.count() {
            2 => self.splat_counted::<2>(samples, weights, splats, added),
            3 => self.splat_counted::<3>(samples, weights, splats, added),
            4 => self.splat_counted::<4>(samples, weights, splats, added),
            _ => self.splat_counted::<MAX_TAPS>(samples, weights, splats, added),
        }
    }

    /// [`splat_all`](Self::splat_all) of a filter with weights for `N` pixels.
    #[inline(always)]
    fn splat_counted<'a, const N: usize>(
        &mut self,
        samples: impl Iterator<Item = (&'a WorldSample, Sample<'a>)>,
        weights: &SharedWeights,
        splats: &mut Splats,
        mut added: impl FnMut(&mut Self, &WorldSample),
    ) {
        let has_color_alone = !self.layout.beside_color() && !self.layout.signed;
        let entries = self.cells.entries_of_cell();
        for (at, value) in samples {
            let splat = weights.splat::<N>(&self.cells, at);
            let pixel = at.pixel as usize;
            // A sum of as many terms as a pixel has neighbours is to be finite, too.
            if has_color_alone {
                let &PixelSample { radiance, alpha } = value.pixel;
                if !is_finite(Splats::MOST_TERMS, radiance, alpha) {
                    self.drop_sample(pixel, at.sample);
                    continue;
                }
                self.samples[pixel] += 1;
                splats.add_color(entries, &splat, value.pixel.to_array());
            } else {
                let Some(values) = self.take(pixel, at.sample, value, Splats::MOST_TERMS) else { continue };
                splats.add(entries, &splat, &values);
                if let (Some(coverage), Some(surface)) = (&mut self.coverage, value.surface) {
                    let first = self.cells.cell_of(pixel) * entries;
                    splat.for_each(|entry, weight| {
                        let units = (f64::from(weight.abs()) * COVERAGE_UNITS).round() as u64;
                        coverage.add(first + entry, surface.visible_shape, units);
                    });
                }
            }
            added(self, at);
        }
    }

    /// Adds the samples of the cell that has this pixel, and empties `splats`.
    pub fn flush(&mut self, pixel: usize, splats: &mut Splats) {
        splats.flush(&self.cells, self.cells.cell_of(pixel), &mut self.filtered, &mut self.weights);
    }

    /// Adds a sample to what is kept of its own pixel and returns what is filtered; `None` if it is not finite.
    #[inline(always)]
    fn take<'a>(&mut self, pixel: usize, sample: u32, value: Sample<'a>, weight: f32) -> Option<Values<'a>> {
        let Sample { pixel: PixelSample { radiance, alpha }, surface, light_aovs } = value;
        let color = [radiance.r, radiance.g, radiance.b, *alpha];
        let mut values = Values {
            color,
            light_aovs: LightAovSample::default(),
            means: [Rgb::BLACK; MAX_MEANS],
            first_mean: self.layout.light_aovs.count(),
        };
        let mut finite =
            is_finite(weight, *radiance, *alpha) && surface.is_none_or(|surface| surface.magnitude().is_finite());
        if self.layout.beside_color() {
            values.light_aovs = light_aovs;
            if let Some(surface) = surface {
                values.means = self.layout.means.means(surface);
            }
            values.for_each_average(|_, value| finite &= is_finite(weight, value, 0.0));
        }
        if let (true, Some(surface)) = (finite, surface) {
            self.nearest.add(pixel, sample, surface, &self.layout.nearest);
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

    /// Adds a group of the pixel's samples, which have been added, by their mean radiance, if the variance is needed.
    /// The better the samples of a group are spread, the less is their variance overestimated; all groups of a pixel
    /// are of one size.
    #[inline]
    pub fn add_moments(&mut self, pixel: usize, radiance: [f64; 3]) {
        if let Some(moments) = &mut self.moments {
            moments.add(pixel, radiance);
        }
    }

    /// Whether [`add_moments`](Self::add_moments) does anything.
    #[inline]
    pub fn tracks_variance(&self) -> bool {
        self.moments.is_some()
    }

    /// Mean of a pixel's own groups and the variance of that mean, by channel; `None` with fewer than two groups.
    pub fn group_statistics(&self, pixel: usize) -> Option<([f64; 3], [f64; 3])> {
        let moments = self.moments.as_ref().filter(|moments| moments.groups[pixel] >= 2)?;
        let n = f64::from(moments.groups[pixel]);
        let mean = moments.sums.values(pixel).map(|sum| sum / n);
        let square = moments.squares.values(pixel).map(|sum| sum / n);
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
        let mean = |moments: &SampleMoments| {
            moments.sums.values(pixel).map(|sum| sum / f64::from(moments.groups[pixel].max(1)))
        };
        self.moments.as_ref().map_or([0.0; 3], mean)
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
        if let (Some(moments), Some(other)) = (&mut self.moments, &other.moments) {
            moments.merge(other);
        }
    }

    /// Adds all samples of another tile of the same pixels and layers, each counted `factor` times as much as a single
    /// one, except in layers of data and of coverage. Nothing may be added to this tile but by this from then on.
    pub fn merge_inverse_variance(&mut self, other: &Self, factor: f64) {
        if self.weighed.is_empty() {
            let counted = |pixel| InverseVarianceSums { count: self.count_at(pixel), variance: self.variance(pixel) };
            self.weighed = (0..self.samples.len()).map(counted).collect();
        }
        for (pixel, weighed) in self.weighed.iter_mut().enumerate() {
            let count = f64::from(other.samples[pixel]) * factor;
            let (before, added) = (weighed.count, count);
            weighed.count += count;
            if weighed.count > 0.0 {
                // Where a pixel's variance is not known, its samples are taken to be as good as the others.
                let known = other.group_statistics(pixel).map(|(_, variance)| variance);
                for k in 0..3 {
                    let own = weighed.variance[k];
                    let other = known.map_or(own * before / added.max(f64::MIN_POSITIVE), |variance| variance[k]);
                    weighed.variance[k] =
                        (before * before * own + added * added * other) / (weighed.count * weighed.count);
                }
            }
        }
        self.merge_sums(other, factor);
    }

    fn merge_sums(&mut self, other: &Self, factor: f64) {
        self.filtered.merge(&other.filtered, factor);
        self.own.merge(&other.own, factor);
        self.weights.merge(&other.weights, factor);
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
