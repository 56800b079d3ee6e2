//! The film as independent tiles that sum samples in double precision.

use super::{Crop, Image, Layer, LayerInfo, LayerKind, LayerSet, PixelSample};
use crate::error::{Error, Result};

/// How many dropped samples a tile remembers; it counts all of them.
const DROPPED_KEPT: usize = 16;

/// Depth where nothing was hit.
const MISS_DEPTH: f32 = 1e10;

/// A sample that was dropped because it was not finite; it can be replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DroppedSample {
    /// Column in the full picture.
    pub x: u32,
    /// Row in the full picture.
    pub y: u32,
    /// Index of the sample.
    pub sample: u32,
}

/// How far groups of a pixel's samples lie apart.
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    groups: u32,
    sums: [f64; 3],
    squares: [f64; 3],
}

/// A pixel of samples that do not all count the same.
#[derive(Clone, Copy, Debug, Default)]
struct Merged {
    count: f64,
    variance: [f64; 3],
}

/// A rectangle of the film. Tiles share nothing, so each can be filled by a thread of its own.
///
/// A sample's order of arrival at its pixel is the order of summation: whoever adds samples in the order of their indices gets the same
/// picture with any number of threads.
#[derive(Clone, Debug)]
pub struct FilmTile {
    area: Crop,
    active: Crop,
    layers: LayerSet,
    /// Radiance and alpha.
    color: Vec<[f64; 4]>,
    /// Samples of each pixel that were kept.
    samples: Vec<u32>,
    /// With `w` the weight: sums of `(w - 1)` times radiance and alpha, then of `w - 1`. Empty until a weight differs from 1.
    corrections: Vec<[f64; 5]>,
    /// All other layers, a pixel's values side by side. Empty without such layers, and so is `hits`.
    beside: Vec<f64>,
    hits: Vec<u32>,
    /// Empty unless the variance is asked for.
    spread: Vec<Spread>,
    /// What each pixel's samples count together and the variance of their mean. Empty while each counts once.
    merged: Vec<Merged>,
    dropped_count: u64,
    dropped: Vec<DroppedSample>,
}

impl FilmTile {
    fn new(area: Crop, active: Crop, layers: LayerSet) -> Self {
        let pixels = area.area() as usize;
        let stride = channels_beside(layers);
        Self {
            area,
            active,
            layers,
            color: vec![[0.0; 4]; pixels],
            samples: vec![0; pixels],
            corrections: Vec::new(),
            beside: vec![0.0; pixels * stride],
            hits: vec![0; if stride > 0 { pixels } else { 0 }],
            spread: vec![Spread::default(); if layers.contains(LayerKind::Variance) { pixels } else { 0 }],
            merged: Vec::new(),
            dropped_count: 0,
            dropped: Vec::new(),
        }
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
    pub fn add(&mut self, pixel: usize, sample: u32, value: &PixelSample, weight: f32) -> bool {
        let color = [value.radiance.r, value.radiance.g, value.radiance.b, value.alpha];
        // A sum is finite only if every term is, save for an overflow, which is no use either.
        if !(color[0] + color[1] + color[2] + color[3] + weight).is_finite() {
            self.drop_sample(pixel, sample);
            return false;
        }
        if self.layers.needs_surface() && !self.add_beside(pixel, value) {
            self.drop_sample(pixel, sample);
            return false;
        }
        let sum = &mut self.color[pixel];
        for (sum, value) in sum.iter_mut().zip(color) {
            *sum += f64::from(value);
        }
        if weight != 1.0 {
            self.correct(pixel, color, f64::from(weight) - 1.0);
        }
        self.samples[pixel] += 1;
        true
    }

    /// Tells of a group of the pixel's samples, which have been added, the mean of weight times radiance and that of the weight, if the variance
    /// is asked for. The better the samples of a group are spread, the less is their variance overestimated; all groups of a pixel are of
    /// one size.
    #[inline]
    pub fn add_group(&mut self, pixel: usize, weighted: [f64; 3], weight: f64) {
        let mut mean = weighted;
        if weight != 1.0 {
            // As the estimate has it.
            let color = self.color_at(pixel);
            mean = [0, 1, 2].map(|k| weighted[k] - (weight - 1.0) * f64::from(color[k]));
        }
        let Some(spread) = self.spread.get_mut(pixel) else { return };
        spread.groups += 1;
        for (k, value) in mean.into_iter().enumerate() {
            spread.sums[k] += value;
            spread.squares[k] += value * value;
        }
    }

    /// Whether [`add_group`](Self::add_group) does anything.
    #[inline]
    pub fn wants_groups(&self) -> bool {
        !self.spread.is_empty()
    }

    /// Mean of a pixel's groups and the variance of that mean, by channel; `None` with fewer than two groups.
    pub fn group_statistics(&self, pixel: usize) -> Option<([f64; 3], [f64; 3])> {
        let spread = self.spread.get(pixel).filter(|spread| spread.groups >= 2)?;
        let n = f64::from(spread.groups);
        let mean = spread.sums.map(|sum| sum / n);
        let variance = [0, 1, 2].map(|k| ((spread.squares[k] / n - mean[k] * mean[k]) / (n - 1.0)).max(0.0));
        Some((mean, variance))
    }

    /// The mean radiance of a pixel's samples so far.
    pub fn mean(&self, pixel: usize) -> [f32; 3] {
        let [r, g, b, _] = self.color_at(pixel);
        [r, g, b]
    }

    /// Adds all samples of another tile of the same pixels and layers. For the colour, each counts `factor` times as much as a single one; to the
    /// layers of surfaces all are alike. Nothing may be added to this tile but by merging.
    pub fn merge(&mut self, other: &Self, factor: f64) {
        self.merged.resize(self.samples.len(), Merged::default());
        for pixel in 0..self.samples.len() {
            let count = f64::from(other.samples[pixel]) * factor;
            let merged = &mut self.merged[pixel];
            let (ours, theirs) = (merged.count, count);
            merged.count += count;
            if merged.count > 0.0 {
                // Where a pixel's variance is not known, its samples are taken to be as good as the others.
                let known = other.group_statistics(pixel).map(|(_, variance)| variance);
                for k in 0..3 {
                    let own = merged.variance[k];
                    let other = known.map_or(own * ours / theirs.max(f64::MIN_POSITIVE), |variance| variance[k]);
                    merged.variance[k] = (ours * ours * own + theirs * theirs * other) / (merged.count * merged.count);
                }
            }
        }
        add_scaled(self.color.as_flattened_mut(), other.color.as_flattened(), factor);
        if !other.corrections.is_empty() {
            self.corrections.resize(self.samples.len(), [0.0; 5]);
            add_scaled(self.corrections.as_flattened_mut(), other.corrections.as_flattened(), factor);
        }
        add_scaled(&mut self.beside, &other.beside, 1.0);
        for (sums, counts) in [(&mut self.samples, &other.samples), (&mut self.hits, &other.hits)] {
            for (sum, count) in sums.iter_mut().zip(counts) {
                *sum += count;
            }
        }
        self.dropped_count += other.dropped_count;
        self.dropped.extend(other.dropped.iter().take(DROPPED_KEPT - self.dropped.len().min(DROPPED_KEPT)));
    }

    /// Adds to the layers beside the colour; `false` (and nothing is added) if a value is not finite.
    fn add_beside(&mut self, pixel: usize, value: &PixelSample) -> bool {
        if value.alpha <= 0.0 {
            return true;
        }
        let stride = channels_beside(self.layers);
        let mut values = [0.0; MAX_CHANNELS_BESIDE];
        let mut start = 0;
        for info in self.layers.of_surfaces() {
            if let Some(read) = info.read {
                read(&value.surface, &mut values[start..start + info.channels.len()]);
            }
            start += info.channels.len();
        }
        if !values.iter().all(|v| v.is_finite()) {
            return false;
        }
        let sums = &mut self.beside[pixel * stride..(pixel + 1) * stride];
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += f64::from(value);
        }
        self.hits[pixel] += 1;
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

    fn correct(&mut self, pixel: usize, color: [f32; 4], excess: f64) {
        if self.corrections.is_empty() {
            self.corrections = vec![[0.0; 5]; self.samples.len()];
        }
        let sums = &mut self.corrections[pixel];
        for (sum, value) in sums.iter_mut().zip(color) {
            *sum += excess * f64::from(value);
        }
        sums[4] += excess;
    }

    /// The pixel's radiance and alpha.
    ///
    /// With `n` samples `v` of weight `w` and their plain mean `m`, the estimate is `m + mean(w (v - m))`. If all weights are 1, that is the
    /// mean. With negative lobes a constant stays exactly constant, as it does when dividing by the sum of weights, with the same bias of
    /// order `1 / n`, but without a sum of weights near zero in a denominator.
    fn color_at(&self, pixel: usize) -> [f32; 4] {
        let n = self.merged.get(pixel).map_or(f64::from(self.samples[pixel]), |merged| merged.count);
        if n == 0.0 {
            return [0.0; 4];
        }
        let mut mean = self.color[pixel].map(|sum| sum / n);
        if let Some(sums) = self.corrections.get(pixel) {
            let excess = sums[4] / n;
            for (mean, sum) in mean.iter_mut().zip(sums) {
                *mean += sum / n - excess * *mean;
            }
        }
        mean.map(to_f32)
    }

    /// What the film itself knows of a pixel, for layers that samples have no values for.
    fn own_at(&self, pixel: usize, kind: LayerKind, out: &mut [f32]) {
        match kind {
            LayerKind::Color => out.copy_from_slice(&self.color_at(pixel)),
            LayerKind::Samples => out[0] = self.samples[pixel] as f32,
            _ => {
                let merged = self.merged.get(pixel).map(|merged| merged.variance);
                let variance = merged.unwrap_or_else(|| self.group_statistics(pixel).unwrap_or_default().1);
                out.copy_from_slice(&variance.map(to_f32));
            }
        }
    }

    /// A layer's values at a pixel; `first` is the layer's first channel within those beside the colour.
    fn beside_at(&self, pixel: usize, info: &LayerInfo, first: usize, out: &mut [f32]) {
        let hits = f64::from(self.hits[pixel]);
        let first = pixel * channels_beside(self.layers) + first;
        let sums = &self.beside[first..first + info.channels.len()];
        let divisor = match info.kind {
            LayerKind::Z | LayerKind::P => hits,
            LayerKind::N => sums.iter().map(|sum| sum * sum).sum::<f64>().sqrt(),
            _ => f64::from(self.samples[pixel]),
        };
        if info.kind == LayerKind::Z && hits == 0.0 {
            out.fill(MISS_DEPTH);
        } else if divisor > 0.0 {
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = to_f32(sum / divisor);
            }
        }
    }
}

fn add_scaled(sums: &mut [f64], values: &[f64], factor: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Rounded; what `f32` cannot hold becomes its largest number, so that a file never holds an infinity.
fn to_f32(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}

const MAX_CHANNELS_BESIDE: usize = {
    let (mut total, mut i) = (0, 1);
    while i < LayerKind::ALL.len() {
        total += LayerKind::ALL[i].channels.len();
        i += 1;
    }
    total
};

fn channels_beside(layers: LayerSet) -> usize {
    layers.of_surfaces().map(|info| info.channels.len()).sum()
}

/// The film: the tiles that a picture's crop touches.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    crop: Crop,
    layers: LayerSet,
    tiles: Vec<FilmTile>,
}

impl Film {
    /// A black film for the part `crop` of a picture of `size` pixels. Tiles of `tile_size` pixels (at least 1) lie on the full picture's
    /// grid, so a pixel's tile does not depend on the crop.
    ///
    /// # Errors
    /// [`Error::Usage`] if the crop is empty or reaches beyond the picture; [`Error::OutOfMemory`] if the film cannot be held.
    pub fn new(size: [u32; 2], crop: Crop, layers: &LayerSet, tile_size: u32) -> Result<Self> {
        if !crop.fits(size) {
            let Crop { x, y, width, height } = crop;
            return Err(Error::Usage(format!("crop {x},{y},{width},{height} does not fit a picture of {}x{} pixels", size[0], size[1])));
        }
        let layers = *layers;
        let tile_size = tile_size.max(1);
        check_memory(&crop, layers)?;
        let mut tiles = Vec::new();
        for row in crop.y / tile_size..=(crop.y + crop.height - 1) / tile_size {
            for column in crop.x / tile_size..=(crop.x + crop.width - 1) / tile_size {
                let cell = Crop { x: column * tile_size, y: row * tile_size, width: tile_size, height: tile_size };
                let area = cell.intersection(&Crop::full(size));
                tiles.push(FilmTile::new(area, area.intersection(&crop), layers));
            }
        }
        Ok(Self { size, crop, layers, tiles })
    }

    /// Width and height of the full picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The part that is rendered.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// What is stored.
    pub fn layers(&self) -> LayerSet {
        self.layers
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> &[FilmTile] {
        &self.tiles
    }

    /// The tiles, row by row, to be filled.
    pub fn tiles_mut(&mut self) -> &mut [FilmTile] {
        &mut self.tiles
    }

    /// How many samples were not finite and therefore dropped.
    pub fn dropped_count(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.dropped_count).sum()
    }

    /// The first dropped samples, in the order of the tiles.
    pub fn dropped(&self) -> Vec<DroppedSample> {
        self.tiles.iter().flat_map(|tile| &tile.dropped).take(DROPPED_KEPT).copied().collect()
    }

    /// The picture of the samples so far; a pixel without samples is black and without a surface.
    ///
    /// Colour and alpha are means over all samples and albedo is too (a miss counts as black); depth and position are means over the
    /// samples that hit something; normals are averaged over those and normalised. Layers beside the colour have the filter's absolute
    /// value as weight.
    pub fn resolve(&self) -> Image {
        let pixels = self.crop.area() as usize;
        let mut layers: Vec<Layer> =
            self.layers.iter().map(|info| Layer { kind: info.kind, data: vec![0.0; pixels * info.channels.len()] }).collect();
        for tile in &self.tiles {
            let active = tile.active;
            for y in active.y..active.y + active.height {
                for x in active.x..active.x + active.width {
                    let from = tile.index(x, y);
                    let to = (y - self.crop.y) as usize * self.crop.width as usize + (x - self.crop.x) as usize;
                    let mut first = 0;
                    for layer in &mut layers {
                        let info = layer.kind.info();
                        let out = &mut layer.data[to * info.channels.len()..(to + 1) * info.channels.len()];
                        if info.read.is_some() {
                            tile.beside_at(from, info, first, out);
                            first += info.channels.len();
                        } else {
                            tile.own_at(from, layer.kind, out);
                        }
                    }
                }
            }
        }
        Image { size: self.size, crop: self.crop, layers }
    }
}

/// Bytes that a film with these layers holds for each pixel; 40 more with a filter that has negative lobes.
pub fn bytes_per_pixel(layers: LayerSet) -> usize {
    let beside = channels_beside(layers);
    let spread = if layers.contains(LayerKind::Variance) { size_of::<Spread>() } else { 0 };
    spread + size_of::<[f64; 4]>() + size_of::<u32>() * (1 + usize::from(beside > 0)) + size_of::<f64>() * beside
}

/// Asks for the film's memory in one piece first: many small requests would be granted long past what the machine has.
fn check_memory(crop: &Crop, layers: LayerSet) -> Result<()> {
    let bytes = usize::try_from(u128::from(crop.area()) * bytes_per_pixel(layers) as u128).unwrap_or(usize::MAX);
    Vec::<u8>::new()
        .try_reserve_exact(bytes)
        .map_err(|_| Error::OutOfMemory(format!("a film of {}x{} pixels needs {} MiB", crop.width, crop.height, bytes >> 20)))
}

#[cfg(test)]
#[path = "tile_tests.rs"]
mod tests;
