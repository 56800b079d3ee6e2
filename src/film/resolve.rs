//! From the sums of a film to the picture.

use super::tile::FilmTile;
use super::{
    Coverage, Film, Filtering, Image, Layer, LayerInfo, LayerKind, LayerSource, Layout, ShapeKey, VarianceKernel,
};

/// Depth where nothing was hit.
const MISS_DEPTH: f32 = 1e10;

/// The estimate of a pixel from the samples around it: a weighted mean, linear in the values of the samples, so that
/// parts of the radiance sum to the whole.
///
/// With the weights `w` of the samples `v` that reach the pixel, the mean is `sum(w v) / sum(w)`. Of a filter with
/// negative lobes the sum of weights may be near zero; with its expected value `n` and the plain mean `m` of the
/// pixel's own samples, the estimate is then `m + sum(w (v - m)) / n`. Both keep constants exactly and have a bias of
/// order `1 / samples`.
struct Estimator<'a> {
    film: &'a Film,
    /// The pixel's own tile and the pixel's index there.
    own: (&'a FilmTile, usize),
    /// Entries of cells that reach the pixel, with the factor by which their sums count.
    entries: Vec<(&'a FilmTile, usize, f64)>,
    /// Sum of the weights.
    weight: f64,
    /// Expected sum of the weights.
    expected: f64,
}

impl<'a> Estimator<'a> {
    /// Of no pixel yet; films have tiles.
    fn new(film: &'a Film) -> Self {
        Self { film, own: (&film.tiles()[0], 0), entries: Vec::new(), weight: 0.0, expected: 0.0 }
    }

    /// Goes to a pixel on the film's grid; `false` if the film does not have it.
    fn move_to(&mut self, x: u32, y: u32) -> bool {
        let film = self.film;
        let Some(own @ (tile, pixel)) = film.tile_of(x, y) else { return false };
        self.own = own;
        self.entries.clear();
        let Layout { border, cell_size: size, .. } = film.layout;
        // Where cells differ in their samples, each counts by its own number; without a border, pixels are normalised
        // by theirs.
        let is_scaled = film.shape().block_size.is_some() && border > 0;
        let cells = |at: u32| at.saturating_sub(border) / size..=(at + border) / size;
        for row in cells(y) {
            for column in cells(x) {
                // A pixel of the cell, by which its tile is found.
                let corner = [(column * size).max(film.grid().area.x), (row * size).max(film.grid().area.y)];
                let Some((tile, corner)) = film.tile_of(corner[0], corner[1]) else { continue };
                let scale = if is_scaled { 1.0 / tile.samples_of_cell(corner).max(1.0) } else { 1.0 };
                let [left, top] = tile.origin();
                let cell = [column - left / size, row - top / size];
                let entry = tile.cells.entry_in(cell, [x as i32 - left as i32, y as i32 - top as i32]);
                self.entries.push((tile, entry, scale));
            }
        }
        let count = tile.count_at(pixel);
        self.expected = if is_scaled { 1.0 } else { count };
        self.weight =
            if film.layout.is_weighted() { self.sum(|tile, entry| tile.weights.values(entry)[0]) } else { count };
        true
    }

    /// The sum of a value over the samples that reach the pixel; `sum` gives that of an entry.
    fn sum(&self, sum: impl Fn(&FilmTile, usize) -> f64) -> f64 {
        self.entries.iter().map(|&(tile, entry, scale)| scale * sum(tile, entry)).sum()
    }

    /// The mean of a value whose weighted sum this is; `own` gives its sum over the pixel's own samples.
    fn mean(&self, weighted: f64, own: impl FnOnce() -> f64) -> f32 {
        let count = self.own.0.count_at(self.own.1);
        let mean = if !self.film.layout.signed {
            if self.weight > 0.0 { weighted / self.weight } else { 0.0 }
        } else if count > 0.0 {
            let plain = own() / count;
            plain + (weighted - self.weight * plain) / self.expected
        } else {
            0.0
        };
        to_f32(mean)
    }

    fn color(&self, out: &mut [f32]) {
        let mut weighted = [0.0; 4];
        for &(tile, entry, scale) in &self.entries {
            let sums = tile.filtered.color.values(entry);
            weighted = std::array::from_fn(|k| weighted[k] + scale * sums[k]);
        }
        for (k, out) in out.iter_mut().enumerate() {
            *out = self.mean(weighted[k], || self.own.0.own.color.values(self.own.1)[k]);
        }
    }

    /// The average with this index.
    fn average(&self, index: usize, out: &mut [f32]) {
        let mut weighted = [0.0; 3];
        for &(tile, entry, scale) in &self.entries {
            let sums = tile.filtered.average(index, entry);
            weighted = std::array::from_fn(|k| weighted[k] + scale * sums[k]);
        }
        for (k, out) in out.iter_mut().enumerate() {
            *out = self.mean(weighted[k], || self.own.0.own.average(index, self.own.1)[k]);
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
            let counts = tile.coverage.as_ref().map(|coverage| coverage.of(entry));
            weights.extend(counts.into_iter().flatten().map(|(key, units)| (key, scale * units as f64)));
        }
        weights
    }
}

impl Film {
    /// The picture of the samples so far; a pixel without samples is black and without a surface.
    ///
    /// Colour, its parts, albedo and features are means that the filter gives (a miss counts as black); the other
    /// layers of surfaces are those of the pixel's nearest sample. Coverage has the filter's absolute value as weight.
    pub fn resolve(&self) -> Image {
        let crop = self.grid().crop;
        let (mut layers, mut firsts, mut nearest, mut mean) = (Vec::new(), Vec::new(), 0, self.light_aovs().count());
        for (kind, group) in self.stored() {
            let info = LayerInfo::of(kind);
            let channels = info.channels.len();
            layers.push(Layer {
                kind,
                group: group.map(|group| self.shape().light_groups[group].clone()),
                data: Vec::with_capacity(crop.area() as usize * channels),
            });
            let take = |next: &mut usize, count: usize| std::mem::replace(next, *next + count);
            firsts.push(match info.source {
                LayerSource::LightAov(part) => part as usize,
                LayerSource::LightGroups => self.light_aovs().first_group() + group.unwrap_or_default(),
                LayerSource::Surface(_, Filtering::Nearest) => take(&mut nearest, channels),
                LayerSource::Surface(_, Filtering::Mean) => take(&mut mean, 1),
                _ => 0,
            });
        }
        let kernel = self.filter.variance_kernel();
        let mut coverage = self.layout.set.needs_coverage().then(Coverage::default);
        let mut estimator = Estimator::new(self);
        for (x, y) in crop.pixels() {
            if !estimator.move_to(x, y) {
                continue;
            }
            for (layer, &first) in layers.iter_mut().zip(&firsts) {
                let info = LayerInfo::of(layer.kind);
                let mut values = [0.0; 4];
                let out = &mut values[..info.channels.len()];
                match info.source {
                    LayerSource::Color => estimator.color(out),
                    LayerSource::LightAov(_) | LayerSource::LightGroups | LayerSource::Surface(_, Filtering::Mean) => {
                        estimator.average(first, out);
                    }
                    LayerSource::Surface(_, Filtering::Nearest) => estimator.data(info, first, out),
                    LayerSource::Film if info.kind == LayerKind::Samples => {
                        out[0] = estimator.own.0.samples[estimator.own.1] as f32;
                    }
                    LayerSource::Film => out.copy_from_slice(&self.variance(&kernel, x, y).map(to_f32)),
                    LayerSource::Coverage | LayerSource::Denoiser => {}
                }
                layer.data.extend_from_slice(out);
            }
            if let Some(coverage) = &mut coverage {
                coverage.push(estimator.coverage());
            }
        }
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
        let all =
            self.layout.set.iter().filter(|info| !matches!(info.source, LayerSource::Coverage | LayerSource::Denoiser));
        all.flat_map(|info| {
            let is_group = matches!(info.source, LayerSource::LightGroups);
            let groups = if is_group { self.layout.light_aovs.light_groups as usize } else { 1 };
            (0..groups).map(move |group| (info.kind, is_group.then_some(group)))
        })
    }
}

/// Rounded; what `f32` cannot hold becomes its largest number, so that a file never holds an infinity.
fn to_f32(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}
