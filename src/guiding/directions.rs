//! Distributions of directions that were learned: constant on each cell of a quadtree over the unit square, which an
//! octahedron maps to the sphere.
//!
//! The cells are listed along a Z-order curve, with where each ends on the curve and how much of the light comes before
//! that. Both lists are search trees of 16 keys a node, so that the cell of a direction, or that of a random number, is
//! found in three steps at most without branches.

use crate::bytes::{ByteReader, ByteWriter};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::prefetch::prefetch;
use crate::math::{Vec3, vec3};

/// Divisions in a row at most: a cell is then about 0.0005 radians wide.
pub const MAX_DEPTH: u32 = 12;

/// Length of the curve: the number of the smallest cells.
const CURVE: i32 = 1 << (2 * MAX_DEPTH);

/// All of the light. The density is exactly that of the sampling, as both count in these units.
const WHOLE: i32 = i32::MAX;

/// Keys of a node: a cache line of them.
const FANOUT: usize = 16;

/// Levels of a search tree at most.
const MAX_LEVELS: usize = 3;

/// Cells at most.
pub const MAX_CELLS: usize = FANOUT.pow(MAX_LEVELS as u32);

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
struct Keys([i32; FANOUT]);

impl Keys {
    /// How many are at most this number.
    #[inline(always)]
    fn count(&self, number: i32) -> usize {
        self.0.iter().map(|&key| i32::from(key <= number)).sum::<i32>() as usize
    }
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

/// A distribution of directions, constant on each cell of a quadtree over the square.
#[derive(Clone, Debug)]
pub struct DirectionDistribution {
    /// Cells.
    len: usize,
    /// Nodes of each level of a search tree, from the root; unused levels have none.
    levels: [u16; MAX_LEVELS],
    /// Two search trees of equal shape: where cells end on the curve, and the light up to there.
    nodes: Box<[Keys]>,
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

    fn of_keys(ends: Vec<i32>, limits: Vec<i32>) -> Self {
        let len = ends.len();
        let mut levels = [0; MAX_LEVELS];
        let mut nodes = Vec::new();
        for keys in [ends, limits] {
            let mut tree = vec![keys];
            while tree[0].len() > FANOUT {
                let above = tree[0].chunks(FANOUT).map(|keys| keys[keys.len() - 1]).collect();
                tree.insert(0, above);
            }
            for (count, keys) in levels.iter_mut().zip(&tree) {
                *count = keys.len().div_ceil(FANOUT) as u16;
                nodes.extend(
                    keys.chunks(FANOUT)
                        .map(|keys| Keys(std::array::from_fn(|i| keys.get(i).copied().unwrap_or(i32::MAX)))),
                );
            }
        }
        Self { len, levels, nodes: nodes.into() }
    }

    /// The two search trees: ends of cells, and limits of their light.
    #[inline(always)]
    fn trees(&self) -> [&[Keys]; 2] {
        let (ends, limits) = self.nodes.split_at(self.nodes.len() / 2);
        [ends, limits]
    }

    /// The first step of a search for the cell with the first key above `number`: the child of the root. What the next
    /// steps need of both trees is being loaded then.
    #[inline(always)]
    fn begin(&self, tree: &[Keys], other: &[Keys], number: i32) -> usize {
        let index = tree[0].count(number);
        if self.levels[1] != 0 {
            prefetch(tree, 1 + index);
            prefetch(other, 1 + index);
        }
        index
    }

    /// The other steps of a search that has [begun](Self::begin).
    #[inline(always)]
    fn finish(&self, tree: &[Keys], number: i32, begun: usize) -> usize {
        let (mut first, mut index) = (1, begun);
        for &count in &self.levels[1..] {
            if count == 0 {
                break;
            }
            index = index * FANOUT + tree[first + index].count(number);
            first += usize::from(count);
        }
        index
    }

    /// The keys on both sides of a cell.
    #[inline(always)]
    fn limits(&self, tree: &[Keys], cell: usize) -> [i32; 2] {
        let leaves = &tree[tree.len() - self.len.div_ceil(FANOUT)..];
        let upper = |cell: usize| leaves[cell / FANOUT].0[cell % FANOUT];
        [if cell == 0 { 0 } else { upper(cell - 1) }, upper(cell)]
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
        let [ends, limits] = self.trees();
        let place = f64::from(u) * f64::from(WHOLE);
        SampleLookup { place, v, begun: self.begin(limits, ends, place as i32) }
    }

    /// The other steps of [`sample`](Self::sample).
    #[inline]
    pub fn finish_sample(&self, lookup: &SampleLookup) -> GuideSample {
        let &SampleLookup { place, v, begun } = lookup;
        let [ends, limits] = self.trees();
        let cell = self.finish(limits, place as i32, begun);
        let [lower, upper] = self.limits(limits, cell);
        let mass = f64::from(upper - lower);
        let within = [((place - f64::from(lower)) / mass) as f32, v].map(|x| x.min(ONE_MINUS_EPSILON));
        let [start, end] = self.limits(ends, cell);
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
        let [ends, limits] = self.trees();
        let (at, per_angle) = square_of(direction);
        let place = curve_of(at.map(|x| (x * (1 << MAX_DEPTH) as f32) as i32));
        PdfLookup { place, per_angle, begun: self.begin(ends, limits, place) }
    }

    /// The other steps of [`pdf`](Self::pdf).
    #[inline]
    pub fn finish_pdf(&self, lookup: &PdfLookup) -> f32 {
        let [ends, limits] = self.trees();
        let cell = self.finish(ends, lookup.place, lookup.begun);
        let [lower, upper] = self.limits(limits, cell);
        density(f64::from(upper - lower), self.limits(ends, cell)) * lookup.per_angle
    }

    /// Starts to load what every lookup needs.
    #[inline(always)]
    pub fn prefetch(&self) {
        prefetch(&self.nodes, 0);
        prefetch(&self.nodes, self.nodes.len() / 2);
    }

    /// Writes the distribution.
    pub(super) fn write(&self, out: &mut ByteWriter) {
        for tree in self.trees() {
            out.integers(&(0..self.len).map(|cell| self.limits(tree, cell)[1] as u32).collect::<Vec<_>>());
        }
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
                let expected = cells[cell].light / total * 4f64.powi(cells[cell].depth as i32) * f64::from(per_angle);
                let pdf = f64::from(distribution.pdf(direction));
                // Some thousand units of 2^31 are those that every cell has.
                assert!((pdf - expected).abs() <= 1e-4 * expected + 1e-3, "{pdf} {expected}");
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
