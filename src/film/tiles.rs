//! The film as independent tiles.

use super::sum::Sums;
use super::tile::{DROPPED_KEPT, DroppedSample, FilmTile, Spread};
use super::{Coverage, Crop, Image, Layer, LayerKind, LayerSet, PartNeeds, Source};
use crate::error::{Error, Result};

/// What a film holds for each pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilmLayers {
    pub set: LayerSet,
    /// The parts of the radiance.
    pub parts: PartNeeds,
    /// Channels of the layers of surfaces.
    pub surface_channels: usize,
}

impl FilmLayers {
    fn new(set: LayerSet, light_groups: usize) -> Self {
        let light_groups = if set.contains(LayerKind::LightGroups) { light_groups as u32 } else { 0 };
        let parts = PartNeeds { by_scattering: set.needs_parts(), light_groups };
        Self { set, parts, surface_channels: set.of_surfaces().map(|info| info.channels.len()).sum() }
    }

    /// Numbers that a pixel's parts take.
    #[inline]
    pub fn part_stride(&self) -> usize {
        2 * 3 * self.parts.count()
    }

    /// Numbers that a pixel's layers of surfaces take.
    #[inline]
    pub fn surface_stride(&self) -> usize {
        2 * self.surface_channels
    }

    /// Whether samples bring more than colour.
    #[inline]
    pub fn beside_color(&self) -> bool {
        self.set.needs_surface() || self.part_stride() > 0
    }
}

/// The film: the tiles that a picture's crop touches.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    crop: Crop,
    layers: FilmLayers,
    light_groups: Vec<String>,
    tiles: Vec<FilmTile>,
}

impl Film {
    /// A black film for the part `crop` of a picture of `size` pixels. Tiles of `tile_size` pixels (at least 1) lie on the full picture's
    /// grid, so a pixel's tile does not depend on the crop.
    ///
    /// # Errors
    /// [`Error::Usage`] if the crop is empty or reaches beyond the picture; [`Error::OutOfMemory`] if the film cannot be held.
    pub fn new(size: [u32; 2], crop: Crop, layers: &LayerSet, tile_size: u32) -> Result<Self> {
        Self::with_light_groups(size, crop, layers, Vec::new(), tile_size)
    }

    /// As [`new`](Self::new), with layers for these groups of lights if `layers` has them.
    ///
    /// # Errors
    /// As of [`new`](Self::new).
    pub fn with_light_groups(size: [u32; 2], crop: Crop, layers: &LayerSet, light_groups: Vec<String>, tile_size: u32) -> Result<Self> {
        if !crop.fits(size) {
            let Crop { x, y, width, height } = crop;
            return Err(Error::Usage(format!("crop {x},{y},{width},{height} does not fit a picture of {}x{} pixels", size[0], size[1])));
        }
        let layers = FilmLayers::new(*layers, light_groups.len());
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
        Ok(Self { size, crop, layers, light_groups, tiles })
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
        self.layers.set
    }

    /// Which parts of the radiance are stored.
    pub fn parts(&self) -> PartNeeds {
        self.layers.parts
    }

    /// Names of the groups of lights.
    pub fn light_groups(&self) -> &[String] {
        &self.light_groups
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

    /// Adds all samples of another film of the same picture, crop and layers.
    pub fn merge(&mut self, other: &Self) {
        for (tile, other) in self.tiles.iter_mut().zip(&other.tiles) {
            tile.merge(other);
        }
    }

    /// The picture of the samples so far; a pixel without samples is black and without a surface.
    ///
    /// Colour and its parts are means over all samples and albedo is too (a miss counts as black); depth and position are means over the
    /// samples that hit something; normals are averaged over those and normalised. Layers of surfaces have the filter's absolute
    /// value as weight.
    pub fn resolve(&self) -> Image {
        let pixels = self.crop.area() as usize;
        let (mut layers, mut firsts, mut channel) = (Vec::new(), Vec::new(), 0);
        for (kind, group) in self.stored() {
            let info = kind.info();
            layers.push(Layer {
                kind,
                group: group.map(|group| self.light_groups[group].clone()),
                data: vec![0.0; pixels * info.channels.len()],
            });
            firsts.push(match info.source {
                Source::Part(part) => part as usize,
                Source::LightGroups => self.layers.parts.first_group() + group.unwrap_or_default(),
                _ => channel,
            });
            if matches!(info.source, Source::Surface(..)) {
                channel += info.channels.len();
            }
        }
        for (tile, from, to) in self.places() {
            for (layer, &first) in layers.iter_mut().zip(&firsts) {
                let info = layer.kind.info();
                let out = &mut layer.data[to * info.channels.len()..(to + 1) * info.channels.len()];
                tile.layer_at(from, info, first, out);
            }
        }
        Image { size: self.size, crop: self.crop, overscan: 0, layers, coverage: self.coverage() }
    }

    /// Every pixel of the picture: its tile, its index there and in the picture.
    fn places(&self) -> impl Iterator<Item = (&FilmTile, usize, usize)> {
        self.tiles.iter().flat_map(move |tile| {
            let active = tile.active;
            let all = (active.y..active.y + active.height).flat_map(move |y| (active.x..active.x + active.width).map(move |x| (x, y)));
            all.map(move |(x, y)| {
                let to = (y - self.crop.y) as usize * self.crop.width as usize + (x - self.crop.x) as usize;
                (tile, tile.index(x, y), to)
            })
        })
    }

    /// The picture's layers, and of those of groups of lights, which.
    fn stored(&self) -> impl Iterator<Item = (LayerKind, Option<usize>)> + '_ {
        let all = self.layers.set.iter().filter(|info| !matches!(info.source, Source::Coverage | Source::Denoiser));
        all.flat_map(|info| {
            let groups = if matches!(info.source, Source::LightGroups) { self.layers.parts.light_groups as usize } else { 1 };
            let is_group = matches!(info.source, Source::LightGroups);
            (0..groups).map(move |group| (info.kind, is_group.then_some(group)))
        })
    }

    fn coverage(&self) -> Option<Coverage> {
        if !self.layers.set.needs_coverage() {
            return None;
        }
        let mut counts = vec![None; self.crop.area() as usize];
        for (tile, from, to) in self.places() {
            counts[to] = tile.coverage.as_ref().map(|coverage| (coverage.of(from), tile.samples[from]));
        }
        Some(Coverage::new(counts.into_iter().map(Option::unwrap_or_default)))
    }
}

/// Bytes that a film with these layers holds for each pixel, with so many groups of lights; more with a filter that has negative lobes, and
/// without the lists of shapes that layers of objects need.
pub fn bytes_per_pixel(layers: LayerSet, light_groups: usize) -> usize {
    let layers = FilmLayers::new(layers, light_groups);
    let spread = if layers.set.contains(LayerKind::Variance) { size_of::<Spread>() } else { 0 };
    let lists = if layers.set.needs_coverage() { size_of::<Vec<()>>() } else { 0 };
    let counts = size_of::<u32>() * (1 + usize::from(layers.surface_channels > 0));
    spread + lists + counts + size_of::<Sums<4>>() + size_of::<f64>() * (layers.surface_stride() + layers.part_stride())
}

fn check_memory(crop: &Crop, layers: FilmLayers) -> Result<()> {
    let each = bytes_per_pixel(layers.set, layers.parts.light_groups as usize);
    let bytes = usize::try_from(u128::from(crop.area()) * each as u128).unwrap_or(usize::MAX);
    if crate::memory::is_available(bytes) {
        Ok(())
    } else {
        Err(Error::OutOfMemory(format!("a film of {}x{} pixels needs {} MiB", crop.width, crop.height, bytes >> 20)))
    }
}

#[cfg(test)]
#[path = "film_tests.rs"]
mod tests;
