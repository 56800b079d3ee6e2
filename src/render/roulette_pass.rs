//! The pilot of Russian roulette: a few samples from all over the picture, by which the value of pixels and what paths
//! find after each scattering are estimated. It depends on the scene, the view and the seed alone.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::TILE_SIZE;
use super::tile_renderer::{TileRenderer, TileWorkspace};
use crate::integrator::{ContinuationGrid, PilotRecords, RayCounts, dimensions};
use crate::math::Vec2;
use crate::math::rows::{BATCH, Row, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::sampling::PixelSeed;

/// Pilot pixels, by pixel of the picture.
const PILOTS_PER_PIXEL: f64 = 1.0 / 128.0;

/// The fewest and the most of them.
const PILOTS: [f64; 2] = [256.0, 8192.0];

/// Samples of a pilot pixel: two groups of as many, independent of each other. Within a group samples are as well
/// spread as those of the picture.
const GROUP: u32 = 8;

/// Pilot pixels along the side of a cell of the picture's estimate.
const CELL_SIDE: u32 = 2;

/// Below this part of the picture's median, pixels are the less important the darker they are.
const DARKEST: f32 = 0.25;

/// The largest relative squared error that a sample counts with.
const LARGEST_ERROR: f64 = 20.0;

/// Factor on survival probabilities: the variance of groups is larger than that of many samples, which spread better.
/// Errors times rays on three interiors are least between 1 and 2.
const SURVIVAL_SCALE: f32 = 1.5;

/// The most lights that are sampled at a first vertex.
const MAX_LIGHT_SAMPLES: u32 = 4;

/// Rays that are left of a sample when roulette ends paths, about: from half of them to all.
const RAYS_WITH_ROULETTE: f64 = 0.7;

/// Variance over the area of a pixel, over the variance that the pilot measures, which does not include it. More lights
/// do not lower it.
const VARIANCE_OF_PIXELS: f64 = 0.15;

/// More than one are sampled only if variance times rays is less than this part of that with one.
const WORTHWHILE_COST: f64 = 0.95;

/// What the pilot of a picture has found.
pub(super) struct RouletteEstimates {
    pub continuations: ContinuationGrid,
    /// Lights to be sampled at the first vertex of a path.
    pub light_samples: u32,
    pixels: PixelScales,
}

/// The relative variance and the rays of a sample of the pilot, and the part of the lights at its first vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SampleCosts {
    /// With two lights.
    variance: f64,
    /// Of a single light.
    light_variance: f64,
    /// With one light.
    rays: f64,
    /// Of each further light.
    light_rays: f64,
}

impl SampleCosts {
    /// Found by the samples, for pixels whose errors count with these factors.
    fn of(grid: PilotGrid, samples: &PilotSamples, scales: &[f32]) -> Self {
        // Of one sample, if errors are to fall with their number.
        let error = |i: usize, difference: f32| {
            let relative = difference * scales[cell_of(grid, i)];
            f64::from(0.5 * GROUP as f32 * relative * relative).min(LARGEST_ERROR)
        };
        let count = samples.values.len() as f64;
        let (values, lights) = (samples.values.iter().enumerate(), samples.light_differences.iter().enumerate());
        let per_sample = |rays: u64| rays as f64 / (f64::from(2 * GROUP) * count);
        let further = samples.records.further_shadow_rays;
        Self {
            variance: values.map(|(i, &[a, b])| error(i, a - b)).sum::<f64>() / count,
            // Half the difference of two lights has half the variance of one, and each of the two groups has one.
            light_variance: 2.0 * lights.map(|(i, &[a, b])| error(i, a) + error(i, b)).sum::<f64>() / count,
            rays: per_sample(samples.counts.total() - further),
            light_rays: per_sample(further),
        }
    }

    /// The variance and the rays of a sample with this many lights at its first vertex.
    fn with(&self, lights: u32) -> [f64; 2] {
        let lights = f64::from(lights);
        let variance = self.variance + self.light_variance * (1.0 / lights - 0.5);
        [variance.max(0.0), self.rays + (lights - 1.0) * self.light_rays]
    }

    /// The number of lights for which variance times rays is least.
    fn best_light_samples(&self) -> u32 {
        let unseen = VARIANCE_OF_PIXELS * self.with(1)[0];
        let costs = Self { variance: self.variance + unseen, rays: RAYS_WITH_ROULETTE * self.rays, ..*self };
        let cost = |lights: u32| costs.with(lights).into_iter().product::<f64>();
        let best = (2..=MAX_LIGHT_SAMPLES).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(1);
        if cost(best) < WORTHWHILE_COST * cost(1) { best } else { 1 }
    }
}

/// Pixels of the pilot, evenly spread over the picture.
#[derive(Clone, Copy)]
struct PilotGrid {
    view: [u32; 2],
    /// Columns and rows, multiples of [`CELL_SIDE`].
    size: [u32; 2],
}

impl PilotGrid {
    fn new(view: [u32; 2]) -> Self {
        let [width, height] = view.map(f64::from);
        let count = (PILOTS_PER_PIXEL * width * height).clamp(PILOTS[0], PILOTS[1]);
        let columns = (count * width / height).sqrt();
        let side = |x: f64| ((x / f64::from(CELL_SIDE)).round() as u32).clamp(1, 1024) * CELL_SIDE;
        Self { view, size: [side(columns), side(count / columns)] }
    }

    fn count(self) -> u32 {
        self.size[0] * self.size[1]
    }

    /// A point of the film within the pilot pixel `i`, from numbers in `[0, 1)`.
    fn point(self, i: u32, u: [f32; 2]) -> Vec2 {
        let at = |k: usize, cell: u32| (cell as f32 + u[k]) / self.size[k] as f32 * self.view[k] as f32;
        Vec2::new(at(0, i % self.size[0]), at(1, i / self.size[0]))
    }
}

/// One over the values of pixels, by cell of the picture.
struct PixelScales {
    /// Columns and rows.
    size: [u32; 2],
    cells_per_pixel: Vec2,
    /// By cell: its own, and those of the cells on its right, below, and below on the right; at the edge, those within.
    scales: Vec<[f32; 4]>,
}

/// Cells left of and above pixels, and how far from the one to the next pixels are.
struct CellRows {
    cell: Row<u32>,
    x: Row,
    y: Row,
}

impl PixelScales {
    fn new(size: [u32; 2], cells_per_pixel: Vec2, scales: &[f32]) -> Self {
        let [columns, rows] = size.map(|count| count as usize);
        let scale = |x: usize, y: usize| scales[y.min(rows - 1) * columns + x.min(columns - 1)];
        let with_neighbours =
            |(x, y): (usize, usize)| [scale(x, y), scale(x + 1, y), scale(x, y + 1), scale(x + 1, y + 1)];
        let cells = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        Self { size, cells_per_pixel, scales: cells.map(with_neighbours).collect() }
    }

    /// Between the centres of cells.
    fn set(&self, pixels: &[Row<u32>; 2], count: usize, scales: &mut Row) {
        let mut cells = CellRows { cell: [0; BATCH], x: [0.0; BATCH], y: [0.0; BATCH] };
        vectorize!(find_cells(self.size, self.cells_per_pixel, pixels, &mut cells, count));
        for (i, scale) in scales.iter_mut().enumerate().take(count) {
            let [a, b, c, d] = self.scales[cells.cell[i] as usize];
            let (above, below) = (a + cells.x[i] * (b - a), c + cells.x[i] * (d - c));
            *scale = above + cells.y[i] * (below - above);
        }
    }
}

#[inline(always)]
fn find_cells(size: [u32; 2], cells_per_pixel: Vec2, pixels: &[Row<u32>; 2], cells: &mut CellRows, count: usize) {
    let [last_x, last_y] = size.map(|count| (count - 1) as f32);
    let [columns, rows] = pixels;
    for (i, (&x, &y)) in columns.iter().zip(rows).enumerate().take(whole_vectors(count)) {
        // Beyond the left and the upper edge of the view coordinates wrap.
        let x = ((x as i32 as f32 + 0.5) * cells_per_pixel.x - 0.5).clamp(0.0, last_x);
        let y = ((y as i32 as f32 + 0.5) * cells_per_pixel.y - 0.5).clamp(0.0, last_y);
        let (column, row) = (x as i32, y as i32);
        cells.cell[i] = (row * size[0] as i32 + column) as u32;
        (cells.x[i], cells.y[i]) = (x - column as f32, y - row as f32);
    }
}

/// The mean of the largest channels of the two groups of each pilot pixel, and what their paths found.
#[derive(Default)]
struct PilotSamples {
    values: Vec<[f32; 2]>,
    /// In place of the values, the differences of lights.
    light_differences: Vec<[f32; 2]>,
    records: PilotRecords,
    counts: RayCounts,
}

/// Pilot samples from all over the picture.
pub(super) struct CameraPilot {
    grid: PilotGrid,
    samples: PilotSamples,
}

impl CameraPilot {
    /// Traces the pilot of a picture.
    pub fn trace(renderer: &TileRenderer, workspaces: &[Mutex<TileWorkspace>]) -> Self {
        let grid = PilotGrid::new(renderer.view);
        let chunk = TILE_SIZE * TILE_SIZE / (2 * GROUP);
        let parts: Vec<PilotSamples> = (0..grid.count().div_ceil(chunk))
            .into_par_iter()
            .map(|i| {
                let thread = rayon::current_thread_index().unwrap_or(0) % workspaces.len();
                let mut workspace = workspaces[thread].lock().unwrap_or_else(PoisonError::into_inner);
                trace(renderer, grid, i * chunk..((i + 1) * chunk).min(grid.count()), &mut workspace)
            })
            .collect();
        let mut all = PilotSamples::default();
        for mut part in parts {
            all.values.extend(part.values);
            all.light_differences.extend(part.light_differences);
            all.records.append(&mut part.records);
            all.counts.add(&part.counts);
        }
        Self { grid, samples: all }
    }

    /// What its paths found.
    pub fn records(&self) -> &PilotRecords {
        &self.samples.records
    }
}

impl RouletteEstimates {
    /// By the pilot of a picture; `None` if it is black. Without `light_samples` it finds how many are best.
    pub fn new(pilot: &CameraPilot, light_samples: Option<u32>) -> Option<Self> {
        Self::from_samples(pilot.grid, &pilot.samples, light_samples)
    }

    fn from_samples(grid: PilotGrid, samples: &PilotSamples, light_samples: Option<u32>) -> Option<Self> {
        let mut continuations = ContinuationGrid::new(&samples.records)?;
        let values = blurred(&cell_means(grid, &samples.values), grid.size[0] / CELL_SIDE);
        let mut positive: Vec<f32> = values.iter().copied().filter(|&value| value > 0.0).collect();
        positive.sort_unstable_by(f32::total_cmp);
        let median = *positive.get(positive.len() / 2)?;
        let scales =
            |darkest: f32| -> Vec<f32> { values.iter().map(|&value| 1.0 / value.hypot(darkest * median)).collect() };
        let light_samples =
            light_samples.unwrap_or_else(|| SampleCosts::of(grid, samples, &scales(1.0)).best_light_samples());
        let scales = scales(DARKEST);
        let costs = SampleCosts::of(grid, samples, &scales);
        tracing::debug!("pilot of roulette: {costs:?}, {light_samples} light samples");
        let [variance, rays] = costs.with(light_samples);
        // Error times cost is least where going on adds to a path's error and cost in the proportion of all paths.
        continuations.scale(SURVIVAL_SCALE * (rays / variance.max(f64::MIN_POSITIVE)).sqrt().min(1e6) as f32);
        let size = grid.size.map(|side| side / CELL_SIDE);
        let cells_per_pixel = Vec2::new(size[0] as f32 / grid.view[0] as f32, size[1] as f32 / grid.view[1] as f32);
        Some(Self { continuations, pixels: PixelScales::new(size, cells_per_pixel, &scales), light_samples })
    }

    /// Sets what roulette multiplies the throughputs of the paths of pixels by.
    pub fn set_scales(&self, pixels: &[Row<u32>; 2], count: usize, scales: &mut Row) {
        self.pixels.set(pixels, count, scales);
    }
}

/// Traces the samples of these pilot pixels.
fn trace(
    renderer: &TileRenderer,
    grid: PilotGrid,
    pilots: std::ops::Range<u32>,
    workspace: &mut TileWorkspace,
) -> PilotSamples {
    // Beyond all pixels.
    let seed = |i: u32, group: u32| renderer.sampler.pixel(i, u32::MAX - 1 - group);
    let mut ids =
        pilots.flat_map(|i| (0..2 * GROUP).map(move |k| (i, k))).map(|(i, k)| (i, seed(i, k / GROUP), k % GROUP));
    let point = |(i, _): (u32, PixelSeed)| {
        // All samples have the same place, or edges would count as noise.
        let u = renderer.sampler.sample_4d(seed(i, 2), 0, dimensions::CAMERA);
        grid.point(i, [u[0], u[1]])
    };
    let mut samples = PilotSamples::default();
    renderer.trace_pilot(&mut ids, point, workspace, &mut samples.records);
    let value = |slot: usize| {
        let value = workspace.radiance(slot).into_iter().fold(0.0, f64::max) as f32;
        if value < f32::INFINITY { value } else { 0.0 }
    };
    let group = GROUP as usize;
    let mean = |k: usize| (k * group..(k + 1) * group).map(value).sum::<f32>() / GROUP as f32;
    samples.values = (0..workspace.sample_count() / (2 * group)).map(|i| [mean(2 * i), mean(2 * i + 1)]).collect();
    let differences = std::mem::take(&mut samples.records.light_differences);
    let mean_of = |values: &[f32]| values.iter().filter(|value| value.is_finite()).sum::<f32>() / GROUP as f32;
    samples.light_differences = differences
        .chunks_exact(2 * group)
        .map(|of_pixel| [mean_of(&of_pixel[..group]), mean_of(&of_pixel[group..])])
        .collect();
    samples.counts = std::mem::take(&mut workspace.integrator.counts);
    samples
}

/// The cell of a pilot pixel.
fn cell_of(grid: PilotGrid, i: usize) -> usize {
    let [columns, _] = grid.size.map(|x| x as usize);
    let side = CELL_SIDE as usize;
    (i / columns / side) * (columns / side) + i % columns / side
}

/// The mean of each cell.
fn cell_means(grid: PilotGrid, values: &[[f32; 2]]) -> Vec<f32> {
    let [columns, rows] = grid.size.map(|x| (x / CELL_SIDE) as usize);
    let mut means = vec![0.0; columns * rows];
    let weight = 0.5 / (CELL_SIDE * CELL_SIDE) as f32;
    for (i, &[a, b]) in values.iter().enumerate() {
        means[cell_of(grid, i)] += weight * (a + b);
    }
    means
}

/// Each cell with weight 1/2, and those beside, above and below with 1/4, along both axes.
fn blurred(cells: &[f32], columns: u32) -> Vec<f32> {
    let columns = columns as usize;
    let rows = cells.len() / columns;
    let near = |i: usize, count: usize| [i.saturating_sub(1), i, i, (i + 1).min(count - 1)];
    let along = |cells: &[f32], at: &dyn Fn(usize, usize) -> [usize; 4]| -> Vec<f32> {
        (0..rows * columns).map(|i| at(i % columns, i / columns).iter().map(|&k| 0.25 * cells[k]).sum()).collect()
    };
    let across = along(cells, &|x, y| near(x, columns).map(|x| y * columns + x));
    along(&across, &|x, y| near(y, rows).map(|y| y * columns + x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_cover_pictures_of_any_shape() {
        for view in [[1, 1], [512, 512], [1920, 1080], [7, 3000], [65_536, 1]] {
            let grid = PilotGrid::new(view);
            assert!(grid.count() >= 16 && grid.count() <= 80_000, "{view:?} {:?}", grid.size);
            for i in [0, grid.count() - 1] {
                let p = grid.point(i, [0.5, 0.5]);
                assert!(p.x > 0.0 && p.x < view[0] as f32 && p.y > 0.0 && p.y < view[1] as f32);
                assert!(cell_of(grid, i as usize) < (grid.count() / (CELL_SIDE * CELL_SIDE)) as usize);
            }
        }
    }

    #[test]
    fn scales_are_those_of_cells_at_their_centres_and_lie_between_elsewhere() {
        let scales = PixelScales::new([2, 2], Vec2::new(0.2, 0.2), &[1.0, 2.0, 3.0, 4.0]);
        let pixels = [[2, 2], [7, 2], [2, 7], [7, 7], [4, 2], [2, 4], [u32::MAX, 0], [100, 100], [0, 100]];
        let (mut rows, mut of_pixels): ([Row<u32>; 2], Row) = ([[0; BATCH]; 2], [0.0; BATCH]);
        for (i, [x, y]) in pixels.into_iter().enumerate() {
            (rows[0][i], rows[1][i]) = (x, y);
        }
        scales.set(&rows, pixels.len(), &mut of_pixels);
        for (found, expected) in of_pixels.into_iter().zip([1.0, 2.0, 3.0, 4.0, 1.4, 1.8, 1.0, 4.0, 3.0]) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn blurring_keeps_the_sum_of_inner_cells_and_even_pictures() {
        assert!(blurred(&[2.0; 12], 4).iter().all(|&x| (x - 2.0).abs() < 1e-6));
        let mut cells = vec![0.0; 25];
        cells[12] = 16.0;
        let blurred = blurred(&cells, 5);
        assert_eq!([blurred[12], blurred[11], blurred[6], blurred[10]], [4.0, 2.0, 1.0, 0.0]);
    }

    #[test]
    fn as_many_lights_are_sampled_as_pay() {
        let costs =
            |variance, light_variance, light_rays| SampleCosts { variance, light_variance, rays: 4.0, light_rays };
        // All noise is that of lights.
        assert_eq!(costs(0.5, 1.0, 0.3).with(1), [1.0, 4.0]);
        assert_eq!(costs(0.5, 1.0, 0.3).with(4), [0.25, 4.9]);
        assert_eq!(costs(0.5, 1.0, 0.3).best_light_samples(), MAX_LIGHT_SAMPLES);
        // Some of it: (0.4 + 3/4 / n) (2.8 + 0.7 (n - 1)) is least for two.
        assert_eq!(costs(0.25 + 0.375, 0.75, 0.7).best_light_samples(), 2);
        // None, or none at all.
        assert_eq!(costs(1.0, 0.0, 0.5).best_light_samples(), 1);
        assert_eq!(costs(0.0, 0.0, 0.5).best_light_samples(), 1);
        // Little.
        assert_eq!(costs(0.9, 0.2, 0.3).best_light_samples(), 1);
    }

    /// Two lights that differ by one, in every pilot pixel and group.
    #[test]
    fn variances_of_lights_are_found_by_their_differences() {
        let grid = PilotGrid::new([64, 64]);
        let count = grid.count() as usize;
        let samples = PilotSamples {
            values: vec![[1.5, 0.5]; count],
            light_differences: vec![[0.25, -0.25]; count],
            records: PilotRecords { further_shadow_rays: 16 * count as u64, ..PilotRecords::default() },
            counts: RayCounts { camera: 64 * count as u64, ..RayCounts::default() },
        };
        let costs = SampleCosts::of(grid, &samples, &vec![1.0; count]);
        assert_eq!(costs, SampleCosts { variance: 4.0, light_variance: 1.0, rays: 3.0, light_rays: 1.0 });
    }

    #[test]
    fn a_black_pilot_estimates_nothing() {
        let grid = PilotGrid::new([64, 64]);
        let samples = PilotSamples { values: vec![[0.0; 2]; grid.count() as usize], ..PilotSamples::default() };
        assert!(RouletteEstimates::from_samples(grid, &samples, None).is_none());
    }
}
