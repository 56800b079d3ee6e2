//! A rectangle of the film, which sums samples.

use super::sum::{Sums, slice};
use super::{Average, CoverageCounts, Crop, FilmLayers, LayerInfo, LayerKind, PixelSample, Sample, Source};
use crate::color::Rgb;

/// How many dropped samples a tile remembers; it counts all of them.
pub(super) const DROPPED_KEPT: usize = 16;

/// Depth where nothing was hit.
const MISS_DEPTH: f32 = 1e10;

/// A sample that was dropped because it was not finite; it can be replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct DroppedSample {
    /// Column in the full picture.
    pub x: u32,
    /// Row in the full picture.
    pub y: u32,
    /// Index of the sample.
    pub sample: u32,
}

/// How far groups of a pixel's samples lie apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spread {
    pub groups: u32,
    pub sums: Sums<3>,
    pub squares: Sums<3>,
}

/// A pixel of samples that do not all count the same.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weighed {
    count: f64,
    variance: [f64; 3],
}

/// A rectangle of the film. Tiles share nothing, so each can be filled by a thread of its own.
///
/// [`Sums`] do not depend on the order of samples: whoever adds the same samples gets the same picture, in one tile or merged from several.
#[derive(Clone, Debug)]
pub struct FilmTile {
    pub(super) area: Crop,
    pub(super) active: Crop,
    layers: FilmLayers,
    /// Radiance and alpha.
    pub(super) color: Vec<Sums<4>>,
    /// Samples of each pixel that were kept.
    pub(super) samples: Vec<u32>,
    /// With `w` the weight: sums of `(w - 1)` times radiance and alpha, then of `w - 1`. Empty until a weight differs from 1.
    pub(super) corrections: Vec<Sums<5>>,
    /// The parts of the radiance, a pixel's [values](mod@slice) side by side, and beside `corrections` the same of `(w - 1)` times them.
    pub(super) parts: Vec<f64>,
    pub(super) part_corrections: Vec<f64>,
    /// Layers of surfaces, a pixel's [values](mod@slice) side by side. Empty without such layers, and so is `hits`.
    pub(super) surfaces: Vec<f64>,
    pub(super) hits: Vec<u32>,
    /// Only of layers that need it.
    pub(super) coverage: Option<CoverageCounts>,
    /// Empty unless the variance is asked for.
    pub(super) spread: Vec<Spread>,
    /// With `w` a group's weight and `v` its weighted radiance: sums of `w - 1`, of its square, and of `(w - 1) v`. Empty until a weight differs
    /// from 1.
    pub(super) spread_corrections: Vec<Sums<5>>,
    /// What each pixel's samples count together and the variance of their mean. Empty while each counts once.
    pub(super) weighed: Vec<Weighed>,
    pub(super) dropped_count: u64,
    pub(super) dropped: Vec<DroppedSample>,
}

impl FilmTile {
    pub(super) fn new(area: Crop, active: Crop, layers: FilmLayers) -> Self {
        let pixels = area.area() as usize;
        let hits = if layers.surface_channels > 0 { pixels } else { 0 };
        Self {
            area,
            active,
            layers,
            color: vec![Sums::default(); pixels],
            samples: vec![0; pixels],
            corrections: Vec::new(),
            parts: vec![0.0; pixels * layers.part_stride()],
            part_corrections: Vec::new(),
            surfaces: vec![0.0; pixels * layers.surface_stride()],
            hits: vec![0; hits],
            coverage: layers.set.needs_coverage().then(|| CoverageCounts::new(pixels)),
            spread: vec![Spread::default(); if layers.set.contains(LayerKind::Variance) { pixels } else { 0 }],
            spread_corrections: Vec::new(),
            weighed: Vec::new(),
            dropped_count: 0,
            dropped: Vec::new(),
        }
    }

    /// A tile of the same pixels and layers without samples.
    pub fn empty(&self) -> Self {
        Self::new(self.area, self.active, self.layers)
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

    /// Adds a sample to the pixel with this index (row by row within the tile); `sample` is the sample's index, `weight` the filter's.
    /// A sample that is not finite is dropped and counted, and `false` returned.
    #[inline]
    pub fn add<'a>(&mut self, pixel: usize, sample: u32, value: impl Into<Sample<'a>>, weight: f32) -> bool {
        let Sample { pixel: PixelSample { radiance, alpha }, surface, parts } = value.into();
        let color = [radiance.r, radiance.g, radiance.b, *alpha];
        // A sum is finite only if every term is, save for an overflow, which is no use either.
        if !(color[0] + color[1] + color[2] + color[3] + weight).is_finite() {
            self.drop_sample(pixel, sample);
            return false;
        }
        if self.layers.beside_color() {
            let finite = parts.iter().all(|part| part.is_finite());
            if !finite || !surface.is_none_or(|surface| self.add_surface(pixel, surface, *alpha)) {
                self.drop_sample(pixel, sample);
                return false;
            }
            let stride = self.layers.part_stride();
            if stride > 0 {
                add_parts(&mut self.parts[pixel * stride..(pixel + 1) * stride], parts, 1.0);
            }
        }
        self.color[pixel].add(color.map(f64::from));
        if weight != 1.0 {
            self.correct(pixel, color, parts, weight - 1.0);
        }
        self.samples[pixel] += 1;
        true
    }

    /// Tells of a group of the pixel's samples, which have been added, the mean of weight times radiance and that of the weight, if the variance
    /// is asked for. The better the samples of a group are spread, the less is their variance overestimated; all groups of a pixel are of
    /// one size.
    #[inline]
    pub fn add_group(&mut self, pixel: usize, weighted: [f64; 3], weight: f64) {
        let Some(spread) = self.spread.get_mut(pixel) else { return };
        spread.groups += 1;
        spread.sums.add(weighted);
        spread.squares.add(weighted.map(|value| value * value));
        if weight != 1.0 {
            self.begin_spread_corrections();
            let excess = weight - 1.0;
            let [r, g, b] = weighted.map(|value| excess * value);
            self.spread_corrections[pixel].add([excess, excess * excess, r, g, b]);
        }
    }

    /// Whether [`add_group`](Self::add_group) does anything.
    #[inline]
    pub fn wants_groups(&self) -> bool {
        !self.spread.is_empty()
    }

    /// Mean of a pixel's groups and the variance of that mean, by channel; `None` with fewer than two groups.
    ///
    /// A group of mean weight `w` and mean `v` of weight times radiance stands for `v - (w - 1) m`, with the pixel's estimate `m`.
    pub fn group_statistics(&self, pixel: usize) -> Option<([f64; 3], [f64; 3])> {
        let spread = self.spread.get(pixel).filter(|spread| spread.groups >= 2)?;
        let n = f64::from(spread.groups);
        let mut mean = spread.sums.values().map(|sum| sum / n);
        let mut square = spread.squares.values().map(|sum| sum / n);
        if let Some(sums) = self.spread_corrections.get(pixel) {
            let [excess, excess_square, products @ ..] = sums.values().map(|sum| sum / n);
            for (k, estimate) in self.mean(pixel).map(f64::from).into_iter().enumerate() {
                mean[k] -= excess * estimate;
                square[k] += estimate * (estimate * excess_square - 2.0 * products[k]);
            }
        }
        let variance = [0, 1, 2].map(|k| ((square[k] - mean[k] * mean[k]) / (n - 1.0)).max(0.0));
        Some((mean, variance))
    }

    /// The mean radiance of a pixel's samples so far.
    pub fn mean(&self, pixel: usize) -> [f32; 3] {
        let [r, g, b, _] = self.color_at(pixel);
        [r, g, b]
    }

    /// Adds all samples of another tile of the same pixels and layers.
    pub fn merge(&mut self, other: &Self) {
        for (sums, others) in self.color.iter_mut().zip(&other.color) {
            sums.merge(others);
        }
        if !other.corrections.is_empty() {
            self.begin_corrections();
            for (sums, others) in self.corrections.iter_mut().zip(&other.corrections) {
                sums.merge(others);
            }
        }
        let (part_stride, surface_stride) = (self.layers.part_stride(), self.layers.surface_stride());
        merge_each(&mut self.parts, &other.parts, part_stride);
        merge_each(&mut self.part_corrections, &other.part_corrections, part_stride);
        merge_each(&mut self.surfaces, &other.surfaces, surface_stride);
        for (spread, others) in self.spread.iter_mut().zip(&other.spread) {
            spread.groups += others.groups;
            spread.sums.merge(&others.sums);
            spread.squares.merge(&others.squares);
        }
        if !other.spread_corrections.is_empty() {
            self.begin_spread_corrections();
            for (sums, others) in self.spread_corrections.iter_mut().zip(&other.spread_corrections) {
                sums.merge(others);
            }
        }
        self.merge_counts(other);
    }

    /// Adds all samples of another tile of the same pixels and layers. For the colour and its parts, each counts `factor` times as much as a single
    /// one; to the layers of surfaces all are alike. Nothing may be added to this tile but by this.
    pub fn merge_weighed(&mut self, other: &Self, factor: f64) {
        self.weighed.resize(self.samples.len(), Weighed::default());
        for pixel in 0..self.samples.len() {
            let count = f64::from(other.samples[pixel]) * factor;
            let weighed = &mut self.weighed[pixel];
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
            self.color[pixel].add(other.color[pixel].values().map(|sum| factor * sum));
        }
        if !other.corrections.is_empty() {
            self.begin_corrections();
            for (sums, others) in self.corrections.iter_mut().zip(&other.corrections) {
                sums.add(others.values().map(|sum| factor * sum));
            }
        }
        let (part_stride, surface_stride) = (self.layers.part_stride(), self.layers.surface_stride());
        let scaled = |sums: &[f64]| -> Vec<f64> { sums.iter().map(|sum| factor * sum).collect() };
        merge_each(&mut self.parts, &scaled(&other.parts), part_stride);
        merge_each(&mut self.part_corrections, &scaled(&other.part_corrections), part_stride);
        merge_each(&mut self.surfaces, &other.surfaces, surface_stride);
        self.merge_counts(other);
    }

    fn merge_counts(&mut self, other: &Self) {
        for (sums, counts) in [(&mut self.samples, &other.samples), (&mut self.hits, &other.hits)] {
            for (sum, count) in sums.iter_mut().zip(counts) {
                *sum += count;
            }
        }
        if let (Some(coverage), Some(other)) = (&mut self.coverage, &other.coverage) {
            coverage.merge(other);
        }
        self.dropped_count += other.dropped_count;
        self.dropped.extend(other.dropped.iter().take(DROPPED_KEPT - self.dropped.len().min(DROPPED_KEPT)));
    }

    /// Adds to the layers of surfaces; `false` (and nothing is added) if a value is not finite.
    fn add_surface(&mut self, pixel: usize, surface: &super::SurfaceSample, alpha: f32) -> bool {
        let channels = self.layers.surface_channels;
        if channels > 0 {
            let mut values = [0.0; MAX_SURFACE_CHANNELS];
            let mut start = 0;
            for info in self.layers.set.of_surfaces() {
                if let Source::Surface(read, _) = info.source {
                    read(surface, &mut values[start..start + info.channels.len()]);
                }
                start += info.channels.len();
            }
            if !values.iter().all(|v| v.is_finite()) {
                return false;
            }
            let stride = self.layers.surface_stride();
            let sums = &mut self.surfaces[pixel * stride..(pixel + 1) * stride];
            slice::add(sums, values[..channels].iter().map(|v| f64::from(*v)));
            self.hits[pixel] += u32::from(alpha > 0.0);
        }
        if let (Some(coverage), true) = (&mut self.coverage, alpha > 0.0) {
            coverage.add(pixel, surface.shown, 1);
        }
        true
    }

    #[cold]
    fn drop_sample(&mut self, pixel: usize, sample: u32) {
        self.dropped_count += 1;
        if self.dropped.len() < DROPPED_KEPT {
            let (row, column) = (pixel as u32 / self.area.width, pixel as u32 % self.area.width);
            self.dropped.push(DroppedSample { x: self.area.x + column, y: self.area.y + row, sample });
        }
    }

    pub(super) fn begin_corrections(&mut self) {
        if self.corrections.is_empty() {
            self.corrections = vec![Sums::default(); self.samples.len()];
            self.part_corrections = vec![0.0; self.parts.len()];
        }
    }

    fn begin_spread_corrections(&mut self) {
        if self.spread_corrections.is_empty() {
            self.spread_corrections = vec![Sums::default(); self.spread.len()];
        }
    }

    fn correct(&mut self, pixel: usize, color: [f32; 4], parts: &[Rgb], excess: f32) {
        self.begin_corrections();
        let [r, g, b, a] = color.map(|value| f64::from(excess * value));
        self.corrections[pixel].add([r, g, b, a, f64::from(excess)]);
        let stride = self.layers.part_stride();
        if stride > 0 {
            add_parts(&mut self.part_corrections[pixel * stride..(pixel + 1) * stride], parts, excess);
        }
    }

    /// What a pixel's samples count together.
    fn count_at(&self, pixel: usize) -> f64 {
        self.weighed.get(pixel).map_or(f64::from(self.samples[pixel]), |weighed| weighed.count)
    }

    /// The pixel's radiance and alpha.
    ///
    /// With `n` samples `v` of weight `w` and their plain mean `m`, the estimate is `m + mean(w (v - m))`. If all weights are 1, that is the
    /// mean. With negative lobes a constant stays exactly constant, as it does when dividing by the sum of weights, with the same bias of
    /// order `1 / n`, but without a sum of weights near zero in a denominator.
    fn color_at(&self, pixel: usize) -> [f32; 4] {
        let n = self.count_at(pixel);
        if n == 0.0 {
            return [0.0; 4];
        }
        let mut mean = self.color[pixel].values().map(|sum| sum / n);
        if let Some(sums) = self.corrections.get(pixel) {
            let sums = sums.values();
            let excess = sums[4] / n;
            for (mean, sum) in mean.iter_mut().zip(sums) {
                *mean += sum / n - excess * *mean;
            }
        }
        mean.map(to_f32)
    }

    /// A part of the pixel's radiance, estimated as the whole is.
    fn part_at(&self, pixel: usize, part: usize, out: &mut [f32]) {
        let n = self.count_at(pixel);
        let stride = self.layers.part_stride();
        let at = pixel * stride..(pixel + 1) * stride;
        for (k, out) in out.iter_mut().enumerate() {
            let mut mean = if n == 0.0 { 0.0 } else { slice::value(&self.parts[at.clone()], part * 3 + k) / n };
            if let (Some(sums), true) = (self.corrections.get(pixel), n != 0.0) {
                let excess = sums.values()[4] / n;
                mean += slice::value(&self.part_corrections[at.clone()], part * 3 + k) / n - excess * mean;
            }
            *out = to_f32(mean);
        }
    }

    /// A layer's values at a pixel; `first` is the layer's first channel among those of surfaces, or its place among the parts.
    pub(super) fn layer_at(&self, pixel: usize, info: &LayerInfo, first: usize, out: &mut [f32]) {
        match info.source {
            Source::Color => out.copy_from_slice(&self.color_at(pixel)),
            Source::Surface(_, average) => self.surface_at(pixel, info, average, first, out),
            Source::Part(_) | Source::LightGroups => self.part_at(pixel, first, out),
            Source::Film if info.kind == LayerKind::Samples => out[0] = self.samples[pixel] as f32,
            Source::Film => {
                let weighed = self.weighed.get(pixel).map(|weighed| weighed.variance);
                let variance = weighed.unwrap_or_else(|| self.group_statistics(pixel).unwrap_or_default().1);
                out.copy_from_slice(&variance.map(to_f32));
            }
            Source::Coverage | Source::Denoiser => {}
        }
    }

    fn surface_at(&self, pixel: usize, info: &LayerInfo, average: Average, first: usize, out: &mut [f32]) {
        let stride = self.layers.surface_stride();
        let all = &self.surfaces[pixel * stride..(pixel + 1) * stride];
        let sum = |k: usize| slice::value(all, first + k);
        let divisor = match average {
            Average::Hits => f64::from(self.hits[pixel]),
            Average::Samples => f64::from(self.samples[pixel]),
            Average::Direction => (0..out.len()).map(|k| sum(k) * sum(k)).sum::<f64>().sqrt(),
        };
        if info.kind == LayerKind::Z && divisor == 0.0 {
            out.fill(MISS_DEPTH);
        } else if divisor > 0.0 {
            for (k, out) in out.iter_mut().enumerate() {
                *out = to_f32(sum(k) / divisor);
            }
        }
    }
}

/// Adds each part times `factor` to its sums. Most parts of a sample are black.
#[inline]
fn add_parts(sums: &mut [f64], parts: &[Rgb], factor: f32) {
    for (k, part) in parts.iter().enumerate().filter(|(_, part)| !part.is_black()) {
        slice::add_at(sums, 3 * k, part.to_array().map(|value| f64::from(factor * value)));
    }
}

fn merge_each(sums: &mut [f64], others: &[f64], stride: usize) {
    if stride > 0 {
        for (sums, others) in sums.chunks_exact_mut(stride).zip(others.chunks_exact(stride)) {
            slice::merge(sums, others);
        }
    }
}

/// Rounded; what `f32` cannot hold becomes its largest number, so that a file never holds an infinity.
fn to_f32(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}

const MAX_SURFACE_CHANNELS: usize = {
    let (mut total, mut i) = (0, 0);
    while i < LayerKind::ALL.len() {
        if matches!(LayerKind::ALL[i].source, Source::Surface(..)) {
            total += LayerKind::ALL[i].channels.len();
        }
        i += 1;
    }
    total
};
