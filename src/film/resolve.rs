//! From the sums of a film to the picture.

use super::sum::slice;
use super::tile::FilmTile;
use super::{Coverage, Film, Filtering, Image, Layer, LayerInfo, LayerKind, ShapeKey, Source, VarianceKernel};

/// Depth where nothing was hit.
const MISS_DEPTH: f32 = 1e10;

/// What the samples around a pixel say of it: a weighted mean, linear in the values of the samples, so that parts of the radiance sum to the whole.
///
/// With the weights `w` of the samples `v` that reach the pixel, the mean is `sum(w v) / sum(w)`. Of a filter with negative lobes the sum of weights
/// may be near zero; with its expected value `n` and the plain mean `m` of the pixel's own samples, the estimate is then `m + sum(w (v - m)) / n`.
/// Both keep constants exactly and have a bias of order `1 / samples`.
struct Estimator<'a> {
    /// The pixel's own tile and the pixel's index there.
    own: (&'a FilmTile, usize),
    /// Entries of cells that reach the pixel, with the factor by which their sums count.
    entries: Vec<(&'a FilmTile, usize, f64)>,
    /// Sum of the weights.
    weight: f64,
    /// For filters with negative lobes: expected sum of the weights, and how many own samples there are.
    expected: Option<(f64, f64)>,
}

impl<'a> Estimator<'a> {
    fn new(film: &'a Film, x: u32, y: u32) -> Option<Self> {
        let own @ (tile, pixel) = film.tile_of(x, y)?;
        let (border, size) = (film.layout.border, film.cell_size());
        let mut entries = Vec::with_capacity(1);
        let cells = |at: u32| at.saturating_sub(border) / size..=(at + border) / size;
        for row in cells(y) {
            for column in cells(x) {
                // A pixel of the cell, by which its tile is found.
                let corner = [(column * size).max(film.grid().area.x), (row * size).max(film.grid().area.y)];
                let Some((tile, corner)) = film.tile_of(corner[0], corner[1]) else { continue };
                let scale = if film.shape().block_size.is_some() { 1.0 / tile.samples_of_cell(corner).max(1.0) } else { 1.0 };
                let [left, top] = tile.origin();
                let cell = [column - left / size, row - top / size];
                let entry = tile.cells.entry_in(cell, [x as i32 - left as i32, y as i32 - top as i32]);
                entries.push((tile, entry, scale));
            }
        }
        let count = tile.count_at(pixel);
        let weight = if film.layout.is_weighted() {
            entries.iter().map(|&(tile, entry, scale)| scale * tile.weights[entry].values()[0]).sum()
        } else {
            // In cells of their own, samples count once.
            entries.iter().map(|(_, _, scale)| scale * count).sum()
        };
        let own_scale = entries.iter().find(|(other, ..)| std::ptr::eq(*other, tile)).map_or(1.0, |(_, _, scale)| *scale);
        let expected = film.layout.signed.then_some((if own_scale == 1.0 { count } else { 1.0 }, count));
        Some(Self { own, entries, weight, expected })
    }

    /// The mean of a value whose sum is `sum(tile, entry)` at an entry, and `own(tile, pixel)` over the pixel's own samples.
    fn mean(&self, sum: impl Fn(&FilmTile, usize) -> f64, own: impl Fn(&FilmTile, usize) -> f64) -> f32 {
        let weighted: f64 = self.entries.iter().map(|&(tile, entry, scale)| scale * sum(tile, entry)).sum();
        let mean = match self.expected {
            Some((_, 0.0)) => 0.0,
            Some((expected, count)) => {
                let plain = own(self.own.0, self.own.1) / count;
                plain + (weighted - self.weight * plain) / expected
            }
            None if self.weight > 0.0 => weighted / self.weight,
            None => 0.0,
        };
        to_f32(mean)
    }

    fn color(&self, out: &mut [f32]) {
        for (k, out) in out.iter_mut().enumerate() {
            let of = |sums: &[super::Sums<4>], index: usize| sums[index].values()[k];
            *out = self.mean(|tile, entry| of(&tile.filtered.color, entry), |tile, pixel| of(&tile.own.color, pixel));
        }
    }

    /// The averaged channels from `first` on.
    fn channels(&self, first: usize, out: &mut [f32]) {
        let stride = self.own.0.layout.channel_stride();
        for (k, out) in out.iter_mut().enumerate() {
            let of = |sums: &[f64], index: usize| slice::value(&sums[index * stride..(index + 1) * stride], first + k);
            *out = self.mean(|tile, entry| of(&tile.filtered.channels, entry), |tile, pixel| of(&tile.own.channels, pixel));
        }
    }

    /// The layers of data from the channel `first` on.
    fn data(&self, info: &LayerInfo, first: usize, out: &mut [f32]) {
        let (tile, pixel) = self.own;
        if info.kind == LayerKind::Z && !tile.nearest.hit(pixel) {
            out.fill(MISS_DEPTH);
        } else {
            out.copy_from_slice(&tile.nearest.of(pixel)[first..first + out.len()]);
        }
    }

    /// The weight of each shape.
    fn coverage(&self) -> Vec<(ShapeKey, f64)> {
        let mut weights = Vec::new();
        for &(tile, entry, scale) in &self.entries {
            let counts = tile.coverage.as_ref().map_or(&[][..], |coverage| coverage.of(entry));
            weights.extend(counts.iter().map(|&(key, units)| (key, scale * units as f64)));
        }
        weights
    }
}

impl Film {
    /// The picture of the samples so far; a pixel without samples is black and without a surface.
    ///
    /// Colour, its parts, albedo and features are means that the filter gives (a miss counts as black); the other layers of surfaces are those of
    /// the pixel's nearest sample. Coverage has the filter's absolute value as weight.
    pub fn resolve(&self) -> Image {
        let crop = self.grid().crop;
        let (mut layers, mut firsts, mut nearest, mut mean) = (Vec::new(), Vec::new(), 0, 3 * self.parts().count());
        for (kind, group) in self.stored() {
            let info = kind.info();
            let channels = info.channels.len();
            layers.push(Layer {
                kind,
                group: group.map(|group| self.shape().light_groups[group].clone()),
                data: Vec::with_capacity(crop.area() as usize * channels),
            });
            let take = |next: &mut usize| std::mem::replace(next, *next + channels);
            firsts.push(match info.source {
                Source::Part(part) => 3 * part as usize,
                Source::LightGroups => 3 * (self.parts().first_group() + group.unwrap_or_default()),
                Source::Surface(_, Filtering::Nearest) => take(&mut nearest),
                Source::Surface(_, Filtering::Mean) => take(&mut mean),
                _ => 0,
            });
        }
        let kernel = self.filter.variance_kernel();
        let mut coverage = Vec::new();
        let has_coverage = self.layout.set.needs_coverage();
        for (x, y) in crop.pixels() {
            let Some(estimator) = Estimator::new(self, x, y) else { continue };
            for (layer, &first) in layers.iter_mut().zip(&firsts) {
                let info = layer.kind.info();
                let start = layer.data.len();
                layer.data.resize(start + info.channels.len(), 0.0);
                let out = &mut layer.data[start..];
                match info.source {
                    Source::Color => estimator.color(out),
                    Source::Part(_) | Source::LightGroups | Source::Surface(_, Filtering::Mean) => estimator.channels(first, out),
                    Source::Surface(_, Filtering::Nearest) => estimator.data(info, first, out),
                    Source::Film if info.kind == LayerKind::Samples => out[0] = estimator.own.0.samples[estimator.own.1] as f32,
                    Source::Film => out.copy_from_slice(&self.variance(&kernel, x, y).map(to_f32)),
                    Source::Coverage | Source::Denoiser => {}
                }
            }
            if has_coverage {
                coverage.push(estimator.coverage());
            }
        }
        let coverage = has_coverage.then(|| Coverage::new(coverage.into_iter()));
        Image { size: self.shape().size, crop: self.shape().crop, overscan: 0, layers, coverage }
    }

    /// The variance of a pixel of the filtered picture, by channel.
    fn variance(&self, kernel: &VarianceKernel, x: u32, y: u32) -> [f64; 3] {
        let (mut sum, mut whole) = ([0.0; 3], 0.0);
        kernel.for_each(self.grid().area, [x, y], |[x, y], mean, square| {
            let Some((tile, pixel)) = self.tile_of(x, y) else { return };
            let variance = tile.variance(pixel);
            sum = [0, 1, 2].map(|k| sum[k] + square * variance[k]);
            whole += mean;
        });
        sum.map(|sum| if whole == 0.0 { 0.0 } else { sum / (whole * whole) })
    }

    /// The picture's layers, and of those of groups of lights, which.
    fn stored(&self) -> impl Iterator<Item = (LayerKind, Option<usize>)> + '_ {
        let all = self.layout.set.iter().filter(|info| !matches!(info.source, Source::Coverage | Source::Denoiser));
        all.flat_map(|info| {
            let is_group = matches!(info.source, Source::LightGroups);
            let groups = if is_group { self.layout.parts.light_groups as usize } else { 1 };
            (0..groups).map(move |group| (info.kind, is_group.then_some(group)))
        })
    }
}

/// Rounded; what `f32` cannot hold becomes its largest number, so that a file never holds an infinity.
fn to_f32(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}
