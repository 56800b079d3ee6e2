//! The film as independent tiles.

use serde::{Deserialize, Serialize};

use super::accumulator::SampleMoments;
use super::layer::SurfaceChannels;
use super::sum::SumPlane;
use super::tile::{DROPPED_KEPT, DroppedSample, FilmTile};
use super::{CoverageCounts, Crop, Filter, Filtering, LayerKind, LayerSet, LightAovRequest, VarianceKernel};
use crate::desc::FilterDesc;
use crate::error::{Error, Result};

/// What a film holds, and how samples reach it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmShape {
    /// Width and height of the full picture in pixels.
    pub size: [u32; 2],
    /// Pixels of it on each side around what the camera shows.
    pub overscan: u32,
    /// The part that is there.
    pub crop: Crop,
    /// Its layers.
    pub layers: LayerSet,
    /// Names of the groups of lights, for the layers of groups if there are any.
    pub light_groups: Vec<String>,
    /// The pixel filter.
    pub filter: FilterDesc,
    /// Width and height in pixels of the squares whose pixels have equally many samples, if not all have: a divisor of
    /// the tiles' size.
    pub block_size: Option<u32>,
}

impl Default for FilmShape {
    fn default() -> Self {
        Self::new([0, 0], Crop::default(), LayerSet::COLOR)
    }
}

impl FilmShape {
    /// With a box filter, and as many samples for every pixel.
    pub fn new(size: [u32; 2], crop: Crop, layers: LayerSet) -> Self {
        Self {
            size,
            overscan: 0,
            crop,
            layers,
            light_groups: Vec::new(),
            filter: FilterDesc::Box { radius: 0.5, samples: None },
            block_size: None,
        }
    }
}

/// Where the pixels of a film are on the grid of its tiles. The grid's corner is a multiple of the tiles' size above
/// and left of the pixel that the camera sees in its upper left corner, so a pixel has the same place within a tile,
/// whatever the overscan and the margin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmGrid {
    /// Place of the full picture's first pixel, along both axes.
    pub offset: u32,
    /// The full picture and around it the margin, whose samples reach the picture.
    pub area: Crop,
    /// The part that is rendered.
    pub crop: Crop,
}

impl FilmGrid {
    /// Of a film with tiles of this size.
    pub fn new(shape: &FilmShape, filter: &Filter, tile_size: u32) -> Self {
        let around = shape.overscan + filter.border();
        let corner = around.div_ceil(tile_size) * tile_size;
        // Blocks lie on the grid, too.
        let start = corner - around.next_multiple_of(shape.block_size.unwrap_or(1)).min(corner);
        let offset = corner - shape.overscan;
        let end = shape.size.map(|side| side.saturating_add(offset + filter.border()));
        let Crop { x, y, width, height } = shape.crop;
        Self {
            offset,
            area: Crop { x: start, y: start, width: end[0] - start, height: end[1] - start },
            crop: Crop { x: x + offset, y: y + offset, width, height },
        }
    }
}

/// What a film holds for each pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub set: LayerSet,
    /// The parts of the radiance.
    pub light_aovs: LightAovRequest,
    /// The layers of surfaces that are averaged.
    pub means: SurfaceChannels,
    /// The layers of surfaces that are data.
    pub nearest: SurfaceChannels,
    /// Width and height of cells, whose pixels have equally many samples.
    pub cell_size: u32,
    /// How many pixels beyond its own a sample reaches.
    pub border: u32,
    /// Whether the filter has negative lobes.
    pub signed: bool,
}

impl Layout {
    fn new(set: LayerSet, light_groups: usize, filter: &Filter, cell_size: u32) -> Self {
        let light_groups = if set.contains(LayerKind::LightGroups) { light_groups as u32 } else { 0 };
        let light_aovs = LightAovRequest { by_scattering: set.needs_light_aovs(), light_groups };
        let [means, nearest] =
            [Filtering::Mean, Filtering::Nearest].map(|filtering| SurfaceChannels::new(set, filtering));
        Self { set, light_aovs, means, nearest, cell_size, border: filter.border(), signed: filter.is_signed() }
    }

    /// Averages of three channels beside the colour: light AOVs, then layers of surfaces.
    #[inline]
    pub fn averages(&self) -> usize {
        self.light_aovs.count() + self.means.channels() / 3
    }

    /// Whether samples have AOVs.
    #[inline]
    pub fn beside_color(&self) -> bool {
        self.set.needs_surface() || self.light_aovs.count() > 0
    }

    /// Whether weights differ from 1.
    #[inline]
    pub fn is_weighted(&self) -> bool {
        self.border > 0 || self.signed
    }
}

/// The film: the tiles that a picture's crop touches, and that its samples come from.
#[derive(Clone, Debug)]
pub struct Film {
    shape: FilmShape,
    grid: FilmGrid,
    pub(super) filter: Filter,
    pub(super) layout: Layout,
    tile_size: u32,
    /// Column and row of the first tile on the full picture's grid.
    first: [u32; 2],
    /// Tiles in a row.
    columns: u32,
    tiles: Vec<FilmTile>,
}

impl Film {
    /// A black film. Tiles of `tile_size` pixels (at least 1) lie on the full picture's grid, so a pixel's tile does
    /// not depend on the crop.
    ///
    /// # Errors
    /// [`Error::Usage`] if the crop is empty or reaches beyond the picture; [`Error::OutOfMemory`] if the film cannot
    /// be held.
    pub fn new(shape: FilmShape, tile_size: u32) -> Result<Self> {
        let (size, crop) = (shape.size, shape.crop);
        if !crop.fits(size) {
            let Crop { x, y, width, height } = crop;
            return Err(Error::Usage(format!(
                "crop {x},{y},{width},{height} does not fit a picture of {}x{} pixels",
                size[0], size[1]
            )));
        }
        let filter = Filter::new(&shape.filter);
        let tile_size = tile_size.max(1);
        // Samples that stay in their pixel are normalised by their own number.
        let cell_size = shape.block_size.filter(|_| filter.border() > 0).unwrap_or(tile_size);
        let layout = Layout::new(shape.layers, shape.light_groups.len(), &filter, cell_size);
        let grid = FilmGrid::new(&shape, &filter, tile_size);
        let sampled = grid.crop.grown(filter.border(), grid.area);
        check_memory(&shape, &sampled, layout)?;
        let range = |start: u32, length: u32| start / tile_size..=(start + length - 1) / tile_size;
        let (columns, rows) = (range(sampled.x, sampled.width), range(sampled.y, sampled.height));
        let first = [*columns.start(), *rows.start()];
        let mut tiles = Vec::new();
        for row in rows {
            for column in columns.clone() {
                let cell = Crop { x: column * tile_size, y: row * tile_size, width: tile_size, height: tile_size };
                let area = cell.intersection(&grid.area);
                tiles.push(FilmTile::new(area, area.intersection(&sampled), layout));
            }
        }
        Ok(Self { shape, grid, filter, layout, tile_size, first, columns: columns.count() as u32, tiles })
    }

    /// What it holds.
    pub fn shape(&self) -> &FilmShape {
        &self.shape
    }

    /// Where its pixels are.
    pub fn grid(&self) -> &FilmGrid {
        &self.grid
    }

    /// The pixels whose samples reach the crop, on the grid.
    pub fn sampled(&self) -> Crop {
        self.grid.crop.grown(self.filter.border(), self.grid.area)
    }

    /// Which parts of the radiance are stored.
    pub fn light_aovs(&self) -> LightAovRequest {
        self.layout.light_aovs
    }

    /// How the noise of pixels' own samples becomes that of the picture.
    pub fn variance_kernel(&self) -> VarianceKernel {
        self.filter.variance_kernel()
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> &[FilmTile] {
        &self.tiles
    }

    /// The tiles, row by row, to be filled.
    pub fn tiles_mut(&mut self) -> &mut [FilmTile] {
        &mut self.tiles
    }

    /// Samples of the picture's pixels.
    pub fn samples(&self) -> u64 {
        let places = self.grid.crop.pixels().filter_map(|(x, y)| self.tile_of(x, y));
        places.map(|(tile, pixel)| u64::from(tile.samples[pixel])).sum()
    }

    /// How many samples were not finite and therefore dropped.
    pub fn dropped_count(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.dropped_count).sum()
    }

    /// The first dropped samples of pixels of the full picture, in the order of the tiles.
    pub fn dropped(&self) -> Vec<DroppedSample> {
        let within = |sample: &DroppedSample| {
            let [x, y] = [sample.x.checked_sub(self.grid.offset)?, sample.y.checked_sub(self.grid.offset)?];
            (x < self.shape.size[0] && y < self.shape.size[1]).then_some(DroppedSample { x, y, ..*sample })
        };
        self.tiles.iter().flat_map(|tile| &tile.dropped).filter_map(within).take(DROPPED_KEPT).collect()
    }

    /// Adds all samples of another film of the same picture, crop and layers.
    pub fn merge(&mut self, other: &Self) {
        for (tile, other) in self.tiles.iter_mut().zip(&other.tiles) {
            tile.merge(other);
        }
    }

    /// The tile of a pixel in the film's coordinates and the pixel's index there, if the film has them.
    #[inline]
    pub(super) fn tile_of(&self, x: u32, y: u32) -> Option<(&FilmTile, usize)> {
        let column = (x / self.tile_size).checked_sub(self.first[0]).filter(|column| *column < self.columns)?;
        let row = (y / self.tile_size).checked_sub(self.first[1])?;
        let tile = self.tiles.get((row * self.columns + column) as usize)?;
        tile.area.contains(x, y).then(|| (tile, tile.index(x, y)))
    }
}

/// Bytes that a film holds for each pixel at most, without the borders of cells and where pixels show one shape.
pub fn bytes_per_pixel(shape: &FilmShape) -> usize {
    pixel_bytes(Layout::new(shape.layers, shape.light_groups.len(), &Filter::new(&shape.filter), 1))
}

fn pixel_bytes(layout: Layout) -> usize {
    let filtered = SumPlane::<4>::ENTRY_BYTES + layout.averages() * SumPlane::<3>::ENTRY_BYTES;
    let weights = if layout.is_weighted() { SumPlane::<1>::ENTRY_BYTES } else { 0 };
    let own = if layout.signed { filtered } else { 0 };
    let moments = if layout.set.contains(LayerKind::Variance) { SampleMoments::PIXEL_BYTES } else { 0 };
    let coverage = if layout.set.needs_coverage() { CoverageCounts::PIXEL_BYTES } else { 0 };
    let data = if layout.nearest.channels() > 0 { size_of::<f32>() * (2 + layout.nearest.channels()) } else { 0 };
    filtered + weights + own + moments + coverage + data + size_of::<u32>()
}

fn check_memory(shape: &FilmShape, sampled: &Crop, layout: Layout) -> Result<()> {
    let side = u128::from(layout.cell_size);
    let entries = (side + 2 * u128::from(layout.border)).pow(2);
    let bytes = u128::from(sampled.area()) * pixel_bytes(layout) as u128 * entries / (side * side);
    let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    if crate::memory::is_available(bytes) {
        return Ok(());
    }
    let Crop { width, height, .. } = shape.crop;
    Err(Error::OutOfMemory(format!("a film of {width}x{height} pixels needs {} MiB", bytes >> 20)))
}

#[cfg(test)]
#[path = "film_tests.rs"]
mod tests;
