//! Russian roulette by what a path is worth ("EARS: Efficiency-Aware Russian Roulette and Splitting", Rath et al. 2022,
//! without splitting): a path goes on with a probability in proportion to what it may still add to the error of its
//! pixel, over the root of what going on costs.

use super::bidirectional::DistantRay;
use super::octant_grid::{OctantGrid, cell_count};
use crate::desc::DEFAULT_RR_DEPTH;
use crate::math::rows::{BATCH, DVec3Rows, Row, Vec3Rows, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Aabb, Vec3};

/// Which paths and shadow rays Russian roulette terminates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Roulette {
    /// None.
    Off,
    /// From this many segments on, by the throughput.
    Throughput {
        /// At least 1.
        from: u32,
    },
    /// From the second scattering on, by [`ContinuationGrid`]; where nothing is known, as `Throughput` from 5.
    Auto,
    /// Shadow rays alone, by [`ContinuationGrid`].
    ShadowRays,
}

/// With estimates, a path goes on with at least this part of what scattering has left of it: wrong estimates cannot
/// make it much brighter at once.
const LEAST_SHARE: f32 = 0.75;

/// Shadow rays are traced with this many times the probability that a path worth as much would go on with: direct light
/// is stratified better than the variance of a sample suggests, and roulette disturbs that.
const SHADOW_SCALE: f32 = 4.0;

/// With which probability paths go on.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurvivalRule {
    /// At least this. 1 where there is no roulette.
    least: f32,
    /// At least this part of what the last scattering has left.
    least_share: f32,
}

impl SurvivalRule {
    /// The probability for a path that is worth `value`, of which the last scattering has left `kept`.
    #[inline(always)]
    pub fn probability(self, value: f32, kept: f32) -> f32 {
        let least = self.least + self.least_share * kept;
        // NaN becomes 1: it must be seen in the sample.
        let probability = if value < least { least } else { value };
        probability.min(1.0)
    }
}

impl Roulette {
    /// The rule after `bounce` scatterings.
    pub(super) fn rule(self, bounce: u32, has_estimates: bool) -> SurvivalRule {
        let from = match self {
            Self::Off | Self::ShadowRays => u32::MAX,
            Self::Throughput { from } => from,
            // At the first, roulette disturbs the stratification of a pixel's samples by more than it saves.
            Self::Auto if has_estimates && bounce > 0 => return SurvivalRule { least: 0.0, least_share: LEAST_SHARE },
            Self::Auto => DEFAULT_RR_DEPTH,
        };
        SurvivalRule { least: if bounce + 1 >= from { 0.0 } else { 1.0 }, least_share: 0.0 }
    }
}

/// What a path found after it was scattered.
#[derive(Clone, Copy, Debug)]
pub struct Continuation {
    /// Where it was scattered.
    pub p: Vec3,
    /// The normal there, on the side of the path.
    pub n: Vec3,
    /// Radiance of the sampled direction: what the path added to its sample, over its throughput.
    pub radiance: f32,
    /// Rays traced from there on.
    pub rays: f32,
}

/// What pilot paths found.
#[derive(Clone, Debug, Default)]
pub struct PilotRecords {
    /// After each scattering.
    pub continuations: Vec<Continuation>,
    /// Shadow rays traced.
    pub shadow_rays: u64,
    /// Of these, those that reached their lights.
    pub unoccluded: u64,
    /// Shadow rays towards the second light of a first vertex.
    pub further_shadow_rays: u64,
    /// What a sample's first vertex got from the first light less what it got from the second, each with half its
    /// weight; by sample, the largest channel.
    pub light_differences: Vec<f32>,
    /// Rays of lights at infinity.
    pub distant_rays: Vec<DistantRay>,
    /// What shadow rays towards other lights add to the samples, by the largest channel.
    pub near_contribution: f64,
}

impl PilotRecords {
    /// Appends those of other paths.
    pub fn append(&mut self, other: &mut Self) {
        self.continuations.append(&mut other.continuations);
        self.shadow_rays += other.shadow_rays;
        self.unoccluded += other.unoccluded;
        self.further_shadow_rays += other.further_shadow_rays;
        self.light_differences.append(&mut other.light_differences);
        self.distant_rays.append(&mut other.distant_rays);
        self.near_contribution += other.near_contribution;
    }

    /// Of all scatterings, as far as they are finite.
    fn finite_continuations(&self) -> Vec<Continuation> {
        let finite = |record: &&Continuation| record.p.is_finite() && record.radiance.is_finite();
        self.continuations.iter().filter(finite).copied().collect()
    }

    /// The box around all points where paths were scattered but a few at its ends.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        let records = self.finite_continuations();
        let outliers = (records.len() as f64 * OUTLIERS) as usize;
        for k in 0..if records.is_empty() { 0 } else { 3 } {
            let mut coordinates: Vec<f32> = records.iter().map(|record| record.p[k]).collect();
            coordinates.sort_unstable_by(f32::total_cmp);
            bounds.min[k] = coordinates[outliers];
            bounds.max[k] = coordinates[coordinates.len() - 1 - outliers];
        }
        bounds
    }
}

/// Cells along the longest axis, by level; each level has the cells of the one before in parts.
const LEVELS: [usize; 3] = [2, 8, 32];

/// As many records as this give the level above in a cell's estimate.
const PRIOR_RECORDS: f64 = 8.0;

/// A record counts with this many times the mean radiance at most.
const MAX_RADIANCE: f32 = 20.0;

/// Records at either end of an axis that may lie outside of the grid, of all.
const OUTLIERS: f64 = 0.005;

/// By where a path is scattered, the root of the mean squared radiance that it finds over the rays that takes.
#[derive(Clone, Debug)]
pub struct ContinuationGrid {
    cells: OctantGrid<{ LEVELS[2] }>,
    /// By cell.
    roots: Vec<f32>,
    /// What a ray that finds a radiance of 1 counts as: the factor that is in all roots.
    scale: f32,
    /// [`SHADOW_SCALE`] times the root of the part of the shadow rays that reach their lights, which is the root mean
    /// square of what shadow rays bring over what they carry.
    shadow_scale: f32,
}

/// Sums over the records of a cell.
#[derive(Clone, Copy, Default)]
struct CellSums {
    count: f64,
    squared: f64,
    rays: f64,
}

impl CellSums {
    fn add(&mut self, radiance: f32, rays: f32) {
        self.count += 1.0;
        self.squared += f64::from(radiance) * f64::from(radiance);
        self.rays += f64::from(rays);
    }

    /// The means with [`PRIOR_RECORDS`] of those of another cell.
    fn means(&self, prior: [f64; 2]) -> [f64; 2] {
        let count = self.count + PRIOR_RECORDS;
        [(self.squared + PRIOR_RECORDS * prior[0]) / count, (self.rays + PRIOR_RECORDS * prior[1]) / count]
    }
}

impl ContinuationGrid {
    /// From what pilot paths found; `None` if they found no light.
    pub fn new(pilot: &PilotRecords) -> Option<Self> {
        let records = pilot.finite_continuations();
        let mean = (records.iter().map(|record| f64::from(record.radiance)).sum::<f64>() / records.len() as f64) as f32;
        if !(mean > 0.0 && mean < f32::INFINITY) {
            return None;
        }
        let unoccluded = if pilot.shadow_rays > 0 { pilot.unoccluded as f32 / pilot.shadow_rays as f32 } else { 1.0 };
        let mut grid = Self {
            cells: OctantGrid::new(&pilot.bounds()),
            roots: Vec::new(),
            scale: 1.0,
            shadow_scale: SHADOW_SCALE * unoccluded.sqrt(),
        };
        let mut all = CellSums::default();
        let mut levels = LEVELS.map(|side| vec![CellSums::default(); cell_count(side)]);
        for record in &records {
            let radiance = record.radiance.clamp(0.0, MAX_RADIANCE * mean);
            all.add(radiance, record.rays);
            let cell = grid.cells.cell(record.p, record.n) as usize;
            for (side, sums) in LEVELS.into_iter().zip(&mut levels) {
                sums[OctantGrid::<{ LEVELS[2] }>::coarser_cell(cell, side)].add(radiance, record.rays);
            }
        }
        let overall = [all.squared / all.count, all.rays / all.count];
        let root = |cell: usize| {
            let sums = LEVELS.into_iter().zip(&levels);
            let cell_at = |side: usize| OctantGrid::<{ LEVELS[2] }>::coarser_cell(cell, side);
            let means = sums.fold(overall, |prior, (side, sums)| sums[cell_at(side)].means(prior));
            (means[0] / means[1].max(1.0)).sqrt() as f32
        };
        grid.roots = (0..levels[2].len()).map(root).collect();
        Some(grid)
    }

    /// Multiplies all roots.
    pub fn scale(&mut self, factor: f32) {
        self.scale *= factor;
        self.roots.iter_mut().for_each(|root| *root *= factor);
    }

    /// With which probability a shadow ray that carries `contribution` is traced.
    #[inline(always)]
    pub(super) fn shadow_ray_probability(&self, contribution: f32, rr_scale: f32) -> f32 {
        let value = contribution * rr_scale * self.scale * self.shadow_scale;
        // NaN becomes 1: it must be seen in the sample.
        if value < 1.0 { value } else { 1.0 }
    }

    /// The roots at the first `count` points, whose normals are turned to the side on which `cos_side` is positive.
    pub(super) fn find(&self, points: &DVec3Rows, normals: &Vec3Rows, cos_side: &Row, roots: &mut Row, count: usize) {
        let mut cells = [0; BATCH];
        vectorize!(find_cells(self, points, normals, cos_side, &mut cells[..whole_vectors(count)]));
        for (root, &cell) in roots.iter_mut().zip(&cells).take(count) {
            *root = self.roots[cell as usize];
        }
    }
}

#[inline(always)]
fn find_cells(grid: &ContinuationGrid, points: &DVec3Rows, normals: &Vec3Rows, cos_side: &Row, cells: &mut [u32]) {
    for (i, cell) in cells.iter_mut().enumerate().take(BATCH) {
        let n = normals.get(i) * 1f32.copysign(cos_side[i]);
        *cell = grid.cells.cell(points.get(i).as_vec3(), n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;

    fn record(x: f32, up: bool, radiance: f32) -> Continuation {
        let n = if up { Vec3::Y } else { -Vec3::Y };
        Continuation { p: Vec3::new(x, 0.0, 0.0), n, radiance, rays: 4.0 }
    }

    fn pilot(continuations: &[Continuation]) -> PilotRecords {
        PilotRecords { continuations: continuations.to_vec(), ..PilotRecords::default() }
    }

    fn found(grid: &ContinuationGrid, x: f32, up: bool) -> f32 {
        let (mut points, mut normals) = (DVec3Rows([[0.0; BATCH]; 3]), Vec3Rows([[0.0; BATCH]; 3]));
        let (mut cos_side, mut roots) = ([1.0; BATCH], [0.0; BATCH]);
        points.set(5, DVec3::new(f64::from(x), 0.0, 0.0));
        normals.set(5, Vec3::Y);
        cos_side[5] = if up { 0.7 } else { -0.7 };
        grid.find(&points, &normals, &cos_side, &mut roots, 6);
        roots[5]
    }

    #[test]
    fn the_grid_has_the_root_of_squared_radiance_over_rays_by_place_and_side() {
        let places = || (0..4000).map(|i| (i % 40) as f32 / 40.0);
        let bright = places().map(|x| record(x, true, if x < 0.5 { 3.0 } else { 1.0 }));
        let records: Vec<Continuation> = bright.chain(places().map(|x| record(x, false, 0.5))).collect();
        let mut pilot = pilot(&records);
        let grid = ContinuationGrid::new(&pilot).unwrap();
        // A cell has about 100 records, and 8 of the cell above.
        for (x, up, radiance) in [(0.1, true, 3.0), (0.9, true, 1.0), (0.1, false, 0.5), (0.9, false, 0.5)] {
            assert!((found(&grid, x, up) / (radiance / 2.0) - 1.0).abs() < 0.15, "{x} {up}: {}", found(&grid, x, up));
        }
        // Outside of the grid its nearest cell counts.
        assert_eq!(found(&grid, -1e9, true), found(&grid, 0.0, true));
        assert_eq!(found(&grid, f32::NAN, true), found(&grid, 0.0, true));
        let mut scaled = grid.clone();
        scaled.scale(2.0);
        assert_eq!(found(&scaled, 0.3, true), 2.0 * found(&grid, 0.3, true));
        let shadow_rays = |contribution| scaled.shadow_ray_probability(contribution, 0.5 / SHADOW_SCALE);
        assert_eq!([0.0, 0.25, 1.0, 3.0, f32::NAN].map(shadow_rays), [0.0, 0.25, 1.0, 1.0, 1.0]);
        // Of which one in four reaches its light.
        (pilot.shadow_rays, pilot.unoccluded) = (4000, 1000);
        let occluded = ContinuationGrid::new(&pilot).unwrap();
        assert_eq!(occluded.shadow_ray_probability(0.5, 1.0 / SHADOW_SCALE), 0.25);
    }

    #[test]
    fn without_light_there_is_no_grid() {
        assert!(ContinuationGrid::new(&pilot(&[])).is_none());
        assert!(ContinuationGrid::new(&pilot(&[record(0.0, true, 0.0)])).is_none());
        assert!(
            ContinuationGrid::new(&pilot(&[record(0.0, true, f32::NAN), record(0.0, true, f32::INFINITY)])).is_none()
        );
        assert!(ContinuationGrid::new(&pilot(&[record(0.0, true, 1.0)])).is_some());
    }

    #[test]
    fn roulette_begins_where_it_is_to() {
        let dim = |roulette: Roulette, bounce, known| roulette.rule(bounce, known).probability(0.01, 0.2);
        for never in [Roulette::Off, Roulette::ShadowRays] {
            assert_eq!([0, 100].map(|bounce| dim(never, bounce, true)), [1.0, 1.0]);
        }
        assert_eq!([1, 2].map(|bounce| dim(Roulette::Throughput { from: 3 }, bounce, false)), [1.0, 0.01]);
        assert_eq!([3, 4].map(|bounce| dim(Roulette::Auto, bounce, false)), [1.0, 0.01]);
        assert_eq!(dim(Roulette::Auto, 0, true), 1.0);
        let rule = Roulette::Auto.rule(1, true);
        assert_eq!([0.01, 0.3, 4.0].map(|value| rule.probability(value, 0.2)), [LEAST_SHARE * 0.2, 0.3, 1.0]);
        assert_eq!(rule.probability(f32::NAN, 0.2), 1.0);
    }
}
