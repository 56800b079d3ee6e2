//! Distributions of directions that were learned: constant on each cell of a quadtree over the unit square, which an
//! octahedron maps to the sphere.
//!
//! The cells are listed along a Z-order curve, with where each ends on the curve and how much of the light comes before
//! that. Both lists are search trees of 32 keys of 16 bits a node, side by side, so that the cell of a direction, or
//! that of a random number, is found in two steps at most without branches, in a few cache lines.

use std::sync::Arc;

use crate::bytes::{ByteReader, ByteWriter};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::prefetch::prefetch;
use crate::math::{Vec3, vec3};

/// Divisions in a row at most: a cell is then about 0.01 radians wide.
pub const MAX_DEPTH: u32 = 8;

/// Length of the curve: the number of the smallest cells.
const CURVE: i32 = 1 << (2 * MAX_DEPTH);

/// All of the light. The density is exactly that of the sampling, as both count in these units.
const WHOLE: i32 = u16::MAX as i32;

/// Keys of a node: a cache line of them.
const FANOUT: usize = 32;

/// Cells at most: two levels of nodes.
pub const MAX_CELLS: usize = FANOUT * FANOUT;

/// A direction with the density per solid angle with which it was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideSample {
    /// The direction, unit, in the world.
    pub direction: Vec3,
    /// Density per solid angle.
    pub pdf: f32,
}

/// The direction of a point of the square, and density per solid angle over density per area of the square.
#[inline]
fn direction_of([u, v]: [f32; 2]) -> (Vec3, f32) {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded out over the corners.
    let (x, y) = if z < 0.0 { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) } else { (x, y) };
    let p = vec3(x, y, z);
    let length = p.length();
    (p / length, 0.25 * length * length * length)
}

/// The point of the square of a unit direction; inverts [`direction_of`].
#[inline]
pub fn square_of(direction: Vec3) -> ([f32; 2], f32) {
    let scale = 1.0 / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    let (x, y) = (direction.x * scale, direction.y * scale);
    let (x, y) = if direction.z < 0.0 { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) } else { (x, y) };
    ([0.5 * x + 0.5, 0.5 * y + 0.5].map(|c| c.clamp(0.0, ONE_MINUS_EPSILON)), 0.25 * scale * scale * scale)
}

/// The place on the curve of the smallest cell in this column and row.
#[inline]
fn curve_of([x, y]: [i32; 2]) -> i32 {
    let spread = |x: i32| {
        let x = (x | x << 8) & 0x00ff_00ff;
        let x = (x | x << 4) & 0x0f0f_0f0f;
        let x = (x | x << 2) & 0x3333_3333;
        (x | x << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

/// Inverts [`curve_of`].
#[inline]
fn column_and_row(place: i32) -> [i32; 2] {
    let gather = |x: i32| {
        let x = x & 0x5555_5555;
        let x = (x | x >> 1) & 0x3333_3333;
        let x = (x | x >> 2) & 0x0f0f_0f0f;
        let x = (x | x >> 4) & 0x00ff_00ff;
        (x | x >> 8) & 0x0000_ffff
    };
    [gather(place), gather(place >> 1)]
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Keys([i16; FANOUT]);

impl Keys {
    /// A key, from 0 to 65,535. Keys are stored less 32,768: processors compare signed numbers.
    #[inline(always)]
    fn get(&self, i: usize) -> i32 {
        i32::from(self.0[i]) + 32_768
    }

    /// How many are less than a number from 0 to 65,535.
    #[inline(always)]
    fn count_below(&self, number: i32) -> usize {
        let number = (number - 32_768) as i16;
        self.0.iter().map(|&key| i16::from(key < number)).sum::<i16>() as usize
    }
}

/// The two search trees of a distribution.
mod tree {
    /// The last place on the curve of each cell.
    pub const PLACES: usize = 0;
    /// The light up to the end of each cell.
    pub const LIGHT: usize = 1;
}

/// A sample whose cell is being looked up.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleLookup {
    /// Of all light, what comes before it.
    place: f64,
    v: f32,
    begun: usize,
}

/// A density whose cell is being looked up.
#[derive(Clone, Copy, Debug, Default)]
pub struct PdfLookup {
    /// On the curve.
    place: i32,
    per_angle: f32,
    begun: usize,
}

/// A cell of a quadtree with its light.
#[derive(Clone, Copy, Debug)]
pub struct DirectionCell {
    /// Divisions of the square down to the cell.
    pub depth: u32,
    /// Light from its directions.
    pub light: f64,
}

/// A distribution of directions, constant on each cell of a quadtree over the square. Copies share it.
#[derive(Clone, Debug)]
pub struct DirectionDistribution {
    /// Cells.
    len: usize,
    /// A node of each tree with all cells or, of more than [`FANOUT`], with the last cells of the nodes that follow.
    nodes: Arc<[Keys]>,
}

impl DirectionDistribution {
    /// Of the cells of a quadtree along the curve, at most `MAX_CELLS`; `None` without light.
    pub fn new(cells: &[DirectionCell]) -> Option<Self> {
        let total: f64 = cells.iter().map(|cell| cell.light).sum();
        if !(total > 0.0) {
            return None;
        }
        // Each cell with light has at least one unit.
        let lit = cells.iter().filter(|cell| cell.light > 0.0).count();
        let free = f64::from(WHOLE) - lit as f64;
        let (mut end, mut units, mut sum) = (0, 0, 0.0);
        let mut ends = Vec::with_capacity(cells.len());
        let mut limits = Vec::with_capacity(cells.len());
        for cell in cells {
            end += CURVE >> (2 * cell.depth);
            if cell.light > 0.0 {
                units += 1;
                sum += cell.light;
            }
            ends.push(end);
            limits.push(units + (sum / total * free).round().min(free) as i32);
        }
        // Sums in another order may differ in the last digit.
        let last = cells.iter().rposition(|cell| cell.light > 0.0)?;
        limits[last..].fill(WHOLE);
        Some(Self::of_keys(ends, limits))
    }

    /// From where each cell ends on the curve, and the light up to there.
    fn of_keys(ends: Vec<i32>, limits: Vec<i32>) -> Self {
        let len = ends.len();
        let node = |keys: &[i32]| {
            Keys(std::array::from_fn(|i| (keys.get(i).copied().unwrap_or(i32::from(u16::MAX)) - 32_768) as i16))
        };
        let keys = [ends.into_iter().map(|end| end - 1).collect::<Vec<_>>(), limits];
        let is_deep = len > FANOUT;
        let last_keys = |keys: &[i32]| keys.chunks(FANOUT).map(|keys| keys[keys.len() - 1]).collect::<Vec<_>>();
        let roots = keys.iter().filter(|_| is_deep).map(|keys| node(&last_keys(keys)));
        let leaves = (0..len)
            .step_by(FANOUT)
            .flat_map(|start| keys.each_ref().map(|keys| node(&keys[start..len.min(start + FANOUT)])));
        Self { len, nodes: roots.chain(leaves).collect() }
    }

    /// The first step of a search for the cell with the first key of a tree that is not below `number`: the child of
    /// the root. What the next steps need of both trees is being loaded then.
    #[inline(always)]
    fn begin(&self, tree: usize, number: i32) -> usize {
        let index = self.nodes[tree].count_below(number);
        if self.len > FANOUT {
            prefetch(&self.nodes, 2 + 2 * index);
            prefetch(&self.nodes, 3 + 2 * index);
        }
        index
    }

    /// The cell of a search that has [begun](Self::begin).
    #[inline(always)]
    fn finish(&self, tree: usize, number: i32, begun: usize) -> usize {
        if self.len > FANOUT { begun * FANOUT + self.nodes[2 + 2 * begun + tree].count_below(number) } else { begun }
    }

    /// The key before a cell, if it is not the first, and its own.
    #[inline(always)]
    fn keys(&self, tree: usize, cell: usize) -> (Option<i32>, i32) {
        let (node, i) = (cell / FANOUT, cell % FANOUT);
        let is_deep = self.len > FANOUT;
        let leaf = &self.nodes[if is_deep { 2 + 2 * node + tree } else { tree }];
        let before = if i > 0 {
            Some(leaf.get(i - 1))
        } else if node > 0 {
            Some(self.nodes[tree].get(node - 1))
        } else {
            None
        };
        (before, leaf.get(i))
    }

    /// Where a cell starts and ends on the curve.
    #[inline(always)]
    fn places(&self, cell: usize) -> [i32; 2] {
        let (before, last) = self.keys(tree::PLACES, cell);
        [before.map_or(0, |last| last + 1), last + 1]
    }

    /// The light before a cell, and that together with its own.
    #[inline(always)]
    fn light(&self, cell: usize) -> [i32; 2] {
        let (before, light) = self.keys(tree::LIGHT, cell);
        [before.unwrap_or(0), light]
    }

    /// Whether both are one distribution.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.nodes, &other.nodes)
    }

    /// A direction; `u` in `[0, 1)²`.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> GuideSample {
        self.finish_sample(&self.begin_sample(u))
    }

    /// The density per solid angle with which [`sample`](Self::sample) chooses a direction.
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        self.finish_pdf(&self.begin_pdf(direction))
    }

    /// The first step of [`sample`](Self::sample): several that have begun wait for memory together.
    #[inline]
    pub fn begin_sample(&self, [u, v]: [f32; 2]) -> SampleLookup {
        let place = f64::from(u) * f64::from(WHOLE);
        SampleLookup { place, v, begun: self.begin(tree::LIGHT, place as i32 + 1) }
    }

    /// The other steps of [`sample`](Self::sample).
    #[inline]
    pub fn finish_sample(&self, lookup: &SampleLookup) -> GuideSample {
        let &SampleLookup { place, v, begun } = lookup;
        let cell = self.finish(tree::LIGHT, place as i32 + 1, begun);
        let [lower, upper] = self.light(cell);
        let mass = f64::from(upper - lower);
        let within = [((place - f64::from(lower)) / mass) as f32, v].map(|x| x.min(ONE_MINUS_EPSILON));
        let [start, end] = self.places(cell);
        let corner = column_and_row(start);
        let side = (1 << ((end - start).trailing_zeros() / 2)) as f32;
        let at = [0, 1].map(|k| {
            let x = (corner[k] as f32 + side * within[k]) * (1.0 / (1 << MAX_DEPTH) as f32);
            x.min(ONE_MINUS_EPSILON)
        });
        let (direction, per_angle) = direction_of(at);
        GuideSample { direction, pdf: density(mass, [start, end]) * per_angle }
    }

    /// The first step of [`pdf`](Self::pdf), as [`begin_sample`](Self::begin_sample).
    #[inline]
    pub fn begin_pdf(&self, direction: Vec3) -> PdfLookup {
        let (at, per_angle) = square_of(direction);
        let place = curve_of(at.map(|x| (x * (1 << MAX_DEPTH) as f32) as i32));
        PdfLookup { place, per_angle, begun: self.begin(tree::PLACES, place) }
    }

    /// The other steps of [`pdf`](Self::pdf).
    #[inline]
    pub fn finish_pdf(&self, lookup: &PdfLookup) -> f32 {
        let cell = self.finish(tree::PLACES, lookup.place, lookup.begun);
        let [lower, upper] = self.light(cell);
        density(f64::from(upper - lower), self.places(cell)) * lookup.per_angle
    }

    /// Starts to load what every lookup needs.
    #[inline(always)]
    pub fn prefetch(&self) {
        prefetch(&self.nodes, 0);
        prefetch(&self.nodes, 1);
    }

    /// Writes the distribution.
    pub(super) fn write(&self, out: &mut ByteWriter) {
        let places = (0..self.len).map(|cell| self.places(cell)[1] as u32);
        out.integers(&places.collect::<Vec<_>>());
        let light = (0..self.len).map(|cell| self.light(cell)[1] as u32);
        out.integers(&light.collect::<Vec<_>>());
    }

    /// Reads what [`write`](Self::write) gave; `None` if it is no distribution over a quadtree.
    pub(super) fn read(data: &mut ByteReader) -> Option<Self> {
        let mut keys = || data.integers()?.into_iter().map(|key| i32::try_from(key).ok()).collect::<Option<Vec<i32>>>();
        let (ends, limits) = (keys()?, keys()?);
        let mut start = 0;
        let is_cell = |&end: &i32| {
            let size = end - std::mem::replace(&mut start, end);
            let start = end - size;
            size > 0 && size & (size - 1) == 0 && size.trailing_zeros() % 2 == 0 && start % size == 0
        };
        let is_tree = ends.iter().all(is_cell) && ends.last() == Some(&CURVE);
        let is_cumulative = limits.is_sorted() && limits.first() >= Some(&0) && limits.last() == Some(&WHOLE);
        let fits = ends.len() == limits.len() && ends.len() <= MAX_CELLS;
        (fits && is_tree && is_cumulative).then(|| Self::of_keys(ends, limits))
    }

    /// Cells of the quadtree.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no cells; never so.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// The density per area of the square in a cell that holds `mass` between two places on the curve.
#[inline(always)]
fn density(mass: f64, [start, end]: [i32; 2]) -> f32 {
    (mass * (f64::from(CURVE) / f64::from(WHOLE)) / f64::from(end - start)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// The cells of a random quadtree, some of them dark.
    fn divide(rng: &mut Rng, depth: u32, cells: &mut Vec<DirectionCell>) {
        for _ in 0..4 {
            if depth < 6 && rng.unit() < 0.5 {
                divide(rng, depth + 1, cells);
            } else {
                let light = if rng.unit() < 0.3 { 0.0 } else { rng.unit().powi(8) };
                cells.push(DirectionCell { depth, light });
            }
        }
    }

    #[test]
    fn cells_are_found_by_direction_and_sampled_by_their_light() {
        let mut rng = Rng::new(2);
        for _ in 0..20 {
            let mut cells = Vec::new();
            divide(&mut rng, 1, &mut cells);
            let Some(distribution) = DirectionDistribution::new(&cells) else { continue };
            let total: f64 = cells.iter().map(|cell| cell.light).sum();
            let ends: Vec<i32> = cells
                .iter()
                .scan(0, |end, cell| {
                    *end += CURVE >> (2 * cell.depth);
                    Some(*end)
                })
                .collect();
            for _ in 0..2000 {
                let place = rng.below(CURVE as usize) as i32;
                let [x, y] = column_and_row(place);
                assert_eq!(curve_of([x, y]), place);
                let center = [x, y].map(|c| (c as f32 + 0.5) / (1 << MAX_DEPTH) as f32);
                let (direction, per_angle) = direction_of(center);
                let cell = ends.partition_point(|&end| end <= place);
                let share = cells[cell].light / total;
                let per_share = 4f64.powi(cells[cell].depth as i32) * f64::from(per_angle);
                let pdf = f64::from(distribution.pdf(direction));
                // Of the units, one is that of the cell, one is rounding, and every lit cell has taken one from all.
                let lit = cells.iter().filter(|cell| cell.light > 0.0).count() as f64;
                let error = (2.0 + share * lit) / f64::from(WHOLE);
                assert!((pdf / per_share - share).abs() <= error * 1.000_01, "{pdf} {per_share} {share}");
            }
            for _ in 0..2000 {
                let u = [rng.unit_f32(), rng.unit_f32()];
                let sample = distribution.sample(u);
                assert!(sample.pdf > 0.0 && sample.pdf.is_finite(), "{sample:?}");
                let expected = cells
                    .iter()
                    .scan(0.0, |sum, cell| {
                        *sum += cell.light / total;
                        Some(*sum)
                    })
                    .position(|sum| sum > f64::from(u[0]));
                let place = curve_of(square_of(sample.direction).0.map(|x| (x * (1 << MAX_DEPTH) as f32) as i32));
                let found = ends.partition_point(|&end| end <= place);
                // At borders of cells either may be found.
                let is_near = expected.is_none_or(|cell| cell.abs_diff(found) <= 1);
                assert!(is_near || cells[found].light > 0.0, "{u:?} {found} {expected:?}");
            }
        }
        assert!(DirectionDistribution::new(&[DirectionCell { depth: 1, light: 0.0 }; 4]).is_none());
    }

    #[test]
    fn bytes_that_are_no_distribution_are_refused() {
        let written = |ends: &[u32], limits: &[u32]| {
            let mut out = ByteWriter::default();
            out.integers(ends);
            out.integers(limits);
            DirectionDistribution::read(&mut ByteReader::new(&out.into_bytes())).is_some()
        };
        let (quarter, whole) = (CURVE as u32 / 4, WHOLE as u32);
        let quarters = [quarter, 2 * quarter, 3 * quarter, 4 * quarter];
        assert!(written(&quarters, &[5, 5, 9, whole]) && written(&[4 * quarter], &[whole]));
        assert!(!written(&quarters, &[5, 4, 9, whole]) && !written(&quarters, &[5, 5, 9, whole - 1]));
        assert!(!written(&quarters, &[5, 5, whole]) && !written(&quarters[..3], &[5, 5, whole]));
        assert!(!written(&[], &[]) && !written(&[2 * quarter, 4 * quarter], &[5, whole]));
        let shifted = [quarter / 4, quarter / 4 + quarter, 2 * quarter, 3 * quarter, 4 * quarter];
        assert!(!written(&shifted, &[1, 2, 3, 4, whole]) && !written(&quarters, &[u32::MAX, 5, 9, whole]));
    }
}
