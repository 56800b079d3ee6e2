//! Importance sampling of light vertices by position: most are hidden from most of a scene. Vertices are grouped into
//! clusters, which are sampled by what those of a pilot would contribute to points near the camera path's vertex,
//! visibility included ("Importance Caching for Complex Illumination", Georgiev, Křivánek, Popov and Slusallek 2012,
//! for single vertices at single points).

use std::f32::consts::FRAC_1_PI;

use rayon::prelude::*;

use super::{LightVertex, bounded, squared};
use crate::accel::{Accelerator, AnyHitRays, Coherence};
use crate::geometry::SpawnPoint;
use crate::integrator::octant_grid::{OctantGrid, cell_count};
use crate::math::prefetch::prefetch;
use crate::math::random::hash64;
use crate::math::rows::BATCH;
use crate::math::{Aabb, RayRows, Vec3};

/// Levels of the tree of clusters.
const LEVELS: u32 = 7;

/// Clusters of light vertices.
const CLUSTERS: usize = 1 << LEVELS;

/// Cells along the longest axis of the grid of tables, and of the coarser one that gives their prior.
const GRID_SIDE: usize = 16;
const COARSE_SIDE: usize = 8;

/// The fewest and the most pairs of a point of a cell and a vertex of a cluster that are compared.
const PAIRS: [u64; 2] = [1, 32];

/// Vertices that would contribute less than this part of the most are taken to be visible as often as others.
const LEAST_TRACED: f32 = 0.05;

/// Weight of the mean of the coarser cell around a cell, in pairs.
const PRIOR_PAIRS: f32 = 2.0;

/// The part of the connections that are chosen uniformly among all vertices.
const UNIFORM_FRACTION: f32 = 0.25;

/// One over the probability of a step: the probabilities of clusters are whole numbers of steps.
const PROBABILITY_STEPS: u32 = 1 << 16;

/// The sum of the probabilities of the clusters before each, in steps.
type ClusterCdf = [u16; CLUSTERS];

/// A binary tree over positions, in levels; a node has the axis and the coordinate of its split.
type Splits = Vec<(u8, f32)>;

/// Probabilities of clusters by position and octant of the normal.
#[derive(Clone, Debug)]
pub struct ConnectionTables {
    splits: Splits,
    grid: OctantGrid<GRID_SIDE>,
    /// By cell, an index into the tables.
    table_indices: Vec<u32>,
    /// The first is that of cells of which nothing is known.
    tables: Vec<ClusterCdf>,
    /// By table, the radiance that a connection of a diffuse point with an albedo of 1 is expected to add.
    radiances: Vec<f32>,
}

/// Light vertices by cluster.
#[derive(Clone, Debug)]
pub struct ClusteredVertices {
    /// Indices of vertices, cluster by cluster.
    order: Vec<u32>,
    /// Where each cluster begins in `order`, and where the last ends.
    starts: Vec<u32>,
}

/// What tables are made from.
#[derive(Clone, Copy, Debug)]
pub struct ConnectionPilot<'a> {
    /// The vertices of light paths.
    pub vertices: &'a [LightVertex],
    /// The number of these paths.
    pub paths: u32,
    /// Where paths from the camera were scattered, with the normals on their side.
    pub points: &'a [SpawnPoint],
    /// The box around most of these.
    pub bounds: Aabb,
}

/// A light vertex that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChosenVertex {
    /// Its index.
    pub index: usize,
    /// One over the probability of the choice.
    pub inverse_probability: f32,
}

impl ClusteredVertices {
    /// Those of a cluster.
    fn of(&self, cluster: usize) -> &[u32] {
        &self.order[self.starts[cluster] as usize..self.starts[cluster + 1] as usize]
    }
}

impl ConnectionTables {
    /// From a pilot, with about this many shadow rays.
    pub fn new(pilot: &ConnectionPilot, accel: &dyn Accelerator, rays: u64) -> Self {
        let ConnectionPilot { vertices, paths, points, bounds } = *pilot;
        let mut indices: Vec<u32> = (0..vertices.len() as u32).collect();
        let mut splits = vec![(0, f32::INFINITY); CLUSTERS - 1];
        split(vertices, &mut indices, 0, &mut splits);
        let mut tables = Self {
            splits,
            grid: OctantGrid::new(&bounds),
            table_indices: vec![0; cell_count(GRID_SIDE)],
            tables: Vec::new(),
            radiances: Vec::new(),
        };
        let clustered = tables.clustered(vertices);
        tables.tables.push(cdf_of([0.0; CLUSTERS], &clustered));
        tables.radiances.push(f32::INFINITY);
        let cell = |point: &SpawnPoint| tables.grid.cell(point.p.as_vec3(), point.n);
        let mut by_cell: Vec<(u32, u32)> = points.iter().map(cell).zip(0..).collect();
        by_cell.sort_unstable();
        let cells: Vec<&[(u32, u32)]> = by_cell.chunk_by(|a, b| a.0 == b.0).collect();
        // With fewer rays than cells and clusters, some cells take the mean of those around them.
        let per_cluster = rays / CLUSTERS as u64;
        let pairs = (per_cluster / cells.len().max(1) as u64).clamp(PAIRS[0], PAIRS[1]) as u32;
        let step = (cells.len() as u64).div_ceil(per_cluster.max(1)).max(1) as usize;
        let is_compared = |i: usize| i.is_multiple_of(step);
        let squares: Vec<_> = cells
            .par_iter()
            .enumerate()
            .map(|(i, cell)| is_compared(i).then(|| mean_squares(pilot, &clustered, cell, pairs, accel)))
            .collect();
        let mut around = vec![([0.0; CLUSTERS], 0.0); cell_count(COARSE_SIDE)];
        for (cell, squares) in cells.iter().zip(&squares) {
            let Some(squares) = squares else { continue };
            let (sums, count) = &mut around[coarse_cell(cell[0].0)];
            sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
            *count += 1.0;
        }
        for (cell, squares) in cells.iter().zip(&squares) {
            let (sums, count) = &around[coarse_cell(cell[0].0)];
            if *count > 0.0 {
                let own = |i: usize| squares.as_ref().map_or(0.0, |squares| pairs as f32 * squares[i]);
                let root = |i: usize| (own(i) + PRIOR_PAIRS * sums[i] / count).sqrt();
                tables.table_indices[cell[0].0 as usize] = tables.tables.len() as u32;
                let roots = std::array::from_fn(root);
                tables.tables.push(cdf_of(roots, &clustered));
                let sum: f32 = (0..CLUSTERS).map(|i| roots[i] * clustered.of(i).len() as f32).sum();
                let pairs = if squares.is_some() { pairs as f32 } else { 0.0 } + PRIOR_PAIRS;
                tables.radiances.push(FRAC_1_PI * FRAC_1_PI * sum / (pairs.sqrt() * paths as f32));
            }
        }
        tables
    }

    /// The vertices by cluster.
    pub fn clustered(&self, vertices: &[LightVertex]) -> ClusteredVertices {
        let clusters: Vec<u8> = vertices.par_iter().map(|vertex| self.cluster(position(vertex)) as u8).collect();
        let mut starts = vec![0; CLUSTERS + 1];
        clusters.iter().for_each(|&cluster| starts[usize::from(cluster) + 1] += 1);
        for cluster in 0..CLUSTERS {
            starts[cluster + 1] += starts[cluster];
        }
        let mut ends = starts.clone();
        let mut order = vec![0; vertices.len()];
        for (&cluster, i) in clusters.iter().zip(0..) {
            let end = &mut ends[usize::from(cluster)];
            order[*end as usize] = i;
            *end += 1;
        }
        ClusteredVertices { order, starts }
    }

    /// The index of the table for a point with this facing normal.
    #[inline]
    pub fn table(&self, p: Vec3, n: Vec3) -> usize {
        self.table_indices[self.grid.cell(p, n) as usize] as usize
    }

    /// Makes a table ready for [`choose`](Self::choose).
    #[inline]
    pub fn prefetch(&self, table: usize) {
        prefetch(&self.tables, table);
    }

    /// The radiance that a connection of a diffuse point of a table with an albedo of 1 is expected to add; infinite
    /// where nothing is known.
    #[inline]
    pub fn radiance(&self, table: usize) -> f32 {
        self.radiances[table]
    }

    /// A vertex to connect a point of a table to, by a number in `[0, 1)`; `None` if the chosen cluster is empty.
    #[inline]
    pub fn choose(&self, table: usize, vertices: &ClusteredVertices, u: f64) -> Option<ChosenVertex> {
        let cdf = &self.tables[table];
        let u = u * f64::from(PROBABILITY_STEPS);
        let step = u as u16;
        // The first begins at 0. All are compared: the processor does many at once, and could not predict a search.
        let cluster = cdf.iter().map(|&start| u16::from(start <= step)).sum::<u16>() as usize - 1;
        let start = u32::from(cdf[cluster]);
        let end = cdf.get(cluster + 1).map_or(PROBABILITY_STEPS, |&end| u32::from(end));
        let steps = end - start;
        let first = vertices.starts[cluster];
        let count = vertices.starts[cluster + 1] - first;
        let within = (u - f64::from(start)) * f64::from(count) / f64::from(steps);
        let last = count.checked_sub(1)?;
        let index = vertices.order[(first + (within as u32).min(last)) as usize] as usize;
        Some(ChosenVertex { index, inverse_probability: count as f32 * (PROBABILITY_STEPS as f32 / steps as f32) })
    }

    #[inline(always)]
    fn cluster(&self, p: Vec3) -> usize {
        let mut node = 0;
        for _ in 0..LEVELS {
            let (axis, at) = self.splits[node];
            node = 2 * node + 1 + usize::from(p[usize::from(axis)] >= at);
        }
        node - (CLUSTERS - 1)
    }
}

fn position(vertex: &LightVertex) -> Vec3 {
    vertex.point.p.as_vec3()
}

/// The normal on the side of the light that arrives.
fn facing_normal(vertex: &LightVertex) -> Vec3 {
    vertex.point.n * 1f32.copysign(vertex.cos_geometric)
}

fn bounds_of(points: impl Iterator<Item = Vec3>) -> Aabb {
    points.fold(Aabb::EMPTY, |bounds, p| bounds.extended(p))
}

/// Splits vertices about in halves along the longest axis, level by level.
fn split(pilot: &[LightVertex], indices: &mut [u32], node: usize, splits: &mut Splits) {
    let position = |i: &u32| position(&pilot[*i as usize]);
    let bounds = bounds_of(indices.iter().map(position));
    let size = bounds.size();
    if node >= splits.len() || !(size.max_element() > 0.0) {
        return;
    }
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    indices.sort_unstable_by(|a, b| position(a)[axis].total_cmp(&position(b)[axis]));
    let at = |i: usize| position(&indices[i])[axis];
    // Many have the same coordinate, as on floors: neither side is to be empty.
    let middle = indices.partition_point(|i| position(i)[axis] < at(indices.len() / 2));
    let first = if middle > 0 { middle } else { indices.partition_point(|i| position(i)[axis] <= bounds.min[axis]) };
    splits[node] = (axis as u8, at(first));
    let (below, above) = indices.split_at_mut(first);
    split(pilot, below, 2 * node + 1, splits);
    split(pilot, above, 2 * node + 2, splits);
}

fn coarse_cell(cell: u32) -> usize {
    OctantGrid::<GRID_SIDE>::coarser_cell(cell as usize, COARSE_SIDE)
}

/// The mean squares of what the vertices of each cluster add to points of a cell, both by index.
fn mean_squares(
    pilot: &ConnectionPilot,
    clustered: &ClusteredVertices,
    cell: &[(u32, u32)],
    pairs: u32,
    accel: &dyn Accelerator,
) -> [f32; CLUSTERS] {
    let mut counter = u64::from(cell[0].0) << 32;
    let mut below = |count: usize| {
        counter += 1;
        ((hash64(counter) >> 32) as usize * count) >> 32
    };
    let mut squares = [0.0; CLUSTERS];
    let (mut rays, mut occluded) = (RayRows::default(), [false; BATCH]);
    for _ in 0..pairs {
        let (mut found, mut count) = ([(0, 0.0); BATCH], 0);
        let mut contributions = [0.0; CLUSTERS];
        let mut pair = [(0, 0); CLUSTERS];
        for cluster in 0..CLUSTERS {
            let vertices = clustered.of(cluster);
            if !vertices.is_empty() {
                pair[cluster] = (cell[below(cell.len())].1, vertices[below(vertices.len())]);
                let (at, light) = pair[cluster];
                contributions[cluster] = contribution(&pilot.points[at as usize], &pilot.vertices[light as usize]);
            }
        }
        let least = LEAST_TRACED * contributions.iter().copied().fold(0.0, f32::max);
        for (cluster, &contribution) in contributions.iter().enumerate().filter(|(_, c)| **c > least) {
            let (at, light) = pair[cluster];
            rays.set(count, &pilot.points[at as usize].ray_to(&pilot.vertices[light as usize].point));
            found[count] = (cluster, contribution);
            count += 1;
        }
        accel.occluded_rows(AnyHitRays::new(&rays, count), &mut occluded, Coherence::Incoherent);
        for (&(cluster, contribution), _) in found[..count].iter().zip(&occluded).filter(|(_, occluded)| !**occluded) {
            squares[cluster] += contribution * contribution / pairs as f32;
        }
        let visible = occluded[..count].iter().filter(|occluded| !**occluded).count() as f32 / count.max(1) as f32;
        for (square, &contribution) in squares.iter_mut().zip(&contributions).filter(|(_, c)| **c <= least) {
            *square += visible * contribution * contribution / pairs as f32;
        }
    }
    squares
}

/// What a light vertex that is visible adds to a point with this facing normal, both taken as diffuse, weighted by MIS.
fn contribution(at: &SpawnPoint, light: &LightVertex) -> f32 {
    let toward = (light.point.p - at.p).as_vec3();
    let distance_squared = toward.length_squared();
    let direction = toward * (1.0 / distance_squared.sqrt());
    let (cos, cos_light) = (at.n.dot(direction), -facing_normal(light).dot(direction));
    // Not where the points are the same, either.
    if !(cos > 0.0 && cos_light > 0.0) {
        return 0.0;
    }
    let geometry = cos_light / distance_squared;
    let by_camera = squared(FRAC_1_PI * cos * geometry) * light.mis.sum(FRAC_1_PI * light.cos_shading.abs());
    let weight = (1.0 / (1.0 + bounded(by_camera))) as f32;
    let contribution = light.flux.max_channel() * cos * geometry * weight;
    if contribution < f32::INFINITY { contribution } else { 0.0 }
}

/// Probabilities mostly in proportion to values, and nowhere zero.
fn cdf_of(values: [f32; CLUSTERS], clustered: &ClusteredVertices) -> ClusterCdf {
    // One vertex more in each cluster: later light paths have some where the pilot has none.
    let count = |cluster: usize| (clustered.starts[cluster + 1] - clustered.starts[cluster] + 1) as f32;
    let all = (clustered.order.len() + CLUSTERS) as f32;
    let value = |cluster: usize| count(cluster) * values[cluster];
    let sum: f32 = (0..CLUSTERS).map(value).sum();
    let is_known = sum > 0.0 && sum < f32::INFINITY;
    let uniform_fraction = if is_known { UNIFORM_FRACTION } else { 1.0 };
    let mut before = 0.0;
    std::array::from_fn(|cluster| {
        let start = before * (PROBABILITY_STEPS - CLUSTERS as u32) as f32;
        let known = if is_known { (1.0 - uniform_fraction) * value(cluster) / sum } else { 0.0 };
        before += uniform_fraction * count(cluster) / all + known;
        // At least one step each.
        start as u16 + cluster as u16
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::geometry::Hit;
    use crate::id::LightId;
    use crate::integrator::bidirectional::PartialMis;
    use crate::math::{DVec3, Ray};

    /// The plane x = 0.
    struct Wall;

    impl Accelerator for Wall {
        fn intersect(&self, _: &Ray) -> Option<Hit> {
            None
        }

        fn occluded(&self, ray: &Ray) -> bool {
            (ray.origin.x > 0.0) != ((ray.origin + ray.direction).x > 0.0)
        }

        fn bounds(&self) -> Aabb {
            Aabb::EMPTY
        }

        fn memory_bytes(&self) -> usize {
            0
        }

        fn description(&self) -> String {
            String::new()
        }
    }

    /// The floors, or the ceilings, of two rooms of the unit size beside the wall.
    fn rooms(is_floor: bool) -> Vec<LightVertex> {
        let sign = if is_floor { 1.0 } else { -1.0 };
        let n = Vec3::new(0.0, sign, 0.0);
        let vertex = |i: u64| {
            let u = |k: u64| (hash64(2 * i + k) >> 40) as f64 / f64::from(1 << 24);
            LightVertex {
                point: SpawnPoint { p: DVec3::new(2.0 * u(0) - 1.0, 0.5 - 0.5 * f64::from(sign), u(1)), n, error: 0.0 },
                n,
                cos_geometric: 0.5,
                cos_shading: 0.5,
                cos_normals: 0.0,
                flux: Rgb::splat(1.0),
                scattering: None,
                light: LightId(0),
                segments: 1,
                mis: PartialMis::default(),
                unconnected: PartialMis::default(),
            }
        };
        (0..4096).map(|i| vertex(if is_floor { i } else { i + 4096 })).collect()
    }

    fn facing_point(vertex: &LightVertex) -> SpawnPoint {
        SpawnPoint { n: facing_normal(vertex), ..vertex.point }
    }

    #[test]
    fn vertices_that_are_seen_are_chosen_more_often_and_all_with_their_probabilities() {
        let vertices = [rooms(true), rooms(false)].concat();
        let points: Vec<SpawnPoint> = vertices.iter().map(facing_point).collect();
        let bounds = bounds_of(vertices.iter().map(position));
        let tables = ConnectionTables::new(
            &ConnectionPilot { vertices: &vertices, paths: 4096, points: &points, bounds },
            &Wall,
            1_000_000,
        );
        let clustered = tables.clustered(&vertices);
        const CHOICES: u32 = 1 << 16;
        for at in &points[..16] {
            let (mut seen, mut weights, mut chosen) = (0, 0.0, vec![false; vertices.len()]);
            for i in 0..CHOICES {
                let u = (f64::from(i) + 0.5) / f64::from(CHOICES);
                let choice = tables.choose(tables.table(at.p.as_vec3(), at.n), &clustered, u).unwrap();
                let light = &vertices[choice.index];
                let is_occluded = Wall.occluded(&at.ray_to(&light.point));
                seen += u32::from(contribution(at, light) > 0.0 && !is_occluded);
                weights += f64::from(choice.inverse_probability);
                chosen[choice.index] = true;
            }
            // A quarter of the vertices is seen: the ceiling of the same room.
            assert!(f64::from(seen) > 0.7 * f64::from(CHOICES), "{seen}");
            assert!((weights / f64::from(CHOICES) / vertices.len() as f64 - 1.0).abs() < 1e-3, "{weights}");
            assert!(chosen.iter().all(|&chosen| chosen));
        }
    }

    #[test]
    fn points_far_from_the_pilot_and_pilots_of_one_vertex_have_choices() {
        let vertices = rooms(true);
        let points = [facing_point(&vertices[0])];
        let pilot = ConnectionPilot { vertices: &vertices[..1], paths: 1, points: &points, bounds: Aabb::EMPTY };
        let one = ConnectionTables::new(&pilot, &Wall, 100);
        let clustered = one.clustered(&vertices);
        for p in [Vec3::splat(1e30), Vec3::splat(f32::NAN), Vec3::ZERO] {
            for u in [0.0, 0.5, 1.0f64.next_down()] {
                let choice = one.choose(one.table(p, Vec3::Z), &clustered, u);
                assert!(choice.is_none_or(|choice| choice.index < vertices.len()), "{p} {u}");
            }
        }
        // None of its clusters but those of the first vertex are there.
        let few = one.clustered(&vertices[..1]);
        let table = one.table(Vec3::ZERO, Vec3::Y);
        let found = (0..1000).filter(|&i| one.choose(table, &few, f64::from(i) / 1000.0).is_some());
        assert!((1..1000).contains(&found.count()));
    }
}
