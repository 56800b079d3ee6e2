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
const CURVE: u32 = 1 << (2 * MAX_DEPTH);

/// All of the light. The density is exactly that of the sampling, as both count in these units.
const WHOLE: u32 = u16::MAX as u32;

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
#[inline(always)]
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
#[inline(always)]
pub fn square_of(direction: Vec3) -> ([f32; 2], f32) {
    let scale = 1.0 / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    let (x, y) = (direction.x * scale, direction.y * scale);
    let (x, y) = if direction.z < 0.0 { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) } else { (x, y) };
    let (u, v) = (0.5 * x + 0.5, 0.5 * y + 0.5);
    ([u.clamp(0.0, ONE_MINUS_EPSILON), v.clamp(0.0, ONE_MINUS_EPSILON)], 0.25 * scale * scale * scale)
}

/// The place on the curve of the smallest cell in this column and row.
#[inline(always)]
fn curve_of([x, y]: [u32; 2]) -> u32 {
    let spread = |x: u32| {
        let x = (x | x << 8) & 0x00ff_00ff;
        let x = (x | x << 4) & 0x0f0f_0f0f;
        let x = (x | x << 2) & 0x3333_3333;
        (x | x << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

/// Inverts [`curve_of`].
#[inline(always)]
fn column_and_row(place: u32) -> [u32; 2] {
    let gather = |x: u32| {
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
struct Keys([u16; FANOUT]);

impl Keys {
    /// A key, from 0 to 65,535.
    #[inline(always)]
    fn get(&self, i: usize) -> u32 {
        u32::from(self.0[i])
    }

    /// How many are less than a number from 0 to 65,535; the last is not.
    #[inline(always)]
    fn count_below(&self, number: u32) -> usize {
        let number = number as u16;
        // By bisection without branches, so that several searches overlap.
        let mut count = 0;
        for half in [16, 8, 4, 2, 1] {
            count += half * usize::from(self.0[(count + half - 1) % FANOUT] < number);
        }
        count
    }
}

/// The two search trees of a distribution.
#[derive(Clone, Copy, Debug)]
pub enum SearchTree {
    /// The last place on the curve of each cell.
    Places,
    /// The light up to the end of each cell.
    Light,
}

/// A direction as a place on the curve.
#[derive(Clone, Copy, Debug)]
pub struct CurvePoint {
    pub place: u32,
    /// Density per solid angle over density per area of the square.
    pub per_angle: f32,
}

impl CurvePoint {
    /// Of a unit direction.
    #[inline(always)]
    pub fn of(direction: Vec3) -> Self {
        let (at, per_angle) = square_of(direction);
        let scale = (1 << MAX_DEPTH) as f32;
        let [x, y] = [at[0] * scale, at[1] * scale];
        Self { place: curve_of([x as i32 as u32, y as i32 as u32]), per_angle }
    }
}

/// A random number as an amount of light, in units of which all light has [`WHOLE`].
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Whole units, plus one: the least key of the cell.
    pub light: u32,
    /// And parts of one.
    pub fraction: f32,
}

impl LightPoint {
    /// Of a number in `[0, 1)`.
    #[inline(always)]
    pub fn of(u: f32) -> Self {
        // `WHOLE` u = 65,536 u - u; the product is exact.
        let scaled = u * (WHOLE + 1) as f32;
        let whole = scaled as i32;
        let rest = (scaled - whole as f32) - u;
        let borrow = i32::from(rest < 0.0);
        Self { light: (whole - borrow + 1) as u32, fraction: rest + borrow as f32 }
    }
}

/// A cell of a distribution.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Where it starts on the curve.
    pub start: u32,
    /// Where it ends there.
    pub end: u32,
    /// The light of all cells before.
    pub light_before: u32,
    /// Together with its own.
    pub light: u32,
}

impl Cell {
    /// The whole square, without light.
    pub const UNLIT: Self = Self { start: 0, end: CURVE, light_before: 0, light: 0 };

    /// The density per area of the square.
    #[inline(always)]
    pub fn density(&self) -> f32 {
        let mass = (self.light - self.light_before) as i32 as f32;
        mass * (CURVE as f32 / WHOLE as f32) / (self.end - self.start) as i32 as f32
    }

    /// The direction of an amount of light within the cell, and another random number; and density per solid angle over
    /// density per area of the square.
    #[inline(always)]
    pub fn direction(&self, at: LightPoint, v: f32) -> (Vec3, f32) {
        let mass = (self.light - self.light_before) as i32 as f32;
        let light = (at.light as i32 - 1 - self.light_before as i32) as f32 + at.fraction;
        let (x, y) = ((light / mass).min(ONE_MINUS_EPSILON), v.min(ONE_MINUS_EPSILON));
        let [column, row] = column_and_row(self.start);
        // Cells have 4^n places, whose root is exact.
        let side = ((self.end - self.start) as i32 as f32).sqrt();
        let scale = 1.0 / (1 << MAX_DEPTH) as f32;
        let (x, y) = ((column as i32 as f32 + side * x) * scale, (row as i32 as f32 + side * y) * scale);
        direction_of([x.min(ONE_MINUS_EPSILON), y.min(ONE_MINUS_EPSILON)])
    }
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
            limits.push(units + (sum / total * free).round().min(free) as u32);
        }
        // Sums in another order may differ in the last digit.
        let last = cells.iter().rposition(|cell| cell.light > 0.0)?;
        limits[last..].fill(WHOLE);
        Some(Self::of_keys(ends, limits))
    }

    /// From where each cell ends on the curve, and the light up to there.
    fn of_keys(ends: Vec<u32>, limits: Vec<u32>) -> Self {
        let len = ends.len();
        let node = |keys: &[u32]| Keys(std::array::from_fn(|i| keys.get(i).copied().unwrap_or(WHOLE) as u16));
        let keys = [ends.into_iter().map(|end| end - 1).collect::<Vec<_>>(), limits];
        let is_deep = len > FANOUT;
        let last_keys = |keys: &[u32]| keys.chunks(FANOUT).map(|keys| keys[keys.len() - 1]).collect::<Vec<_>>();
        let roots = keys.iter().filter(|_| is_deep).map(|keys| node(&last_keys(keys)));
        let leaves = (0..len)
            .step_by(FANOUT)
            .flat_map(|start| keys.each_ref().map(|keys| node(&keys[start..len.min(start + FANOUT)])));
        Self { len, nodes: roots.chain(leaves).collect() }
    }

    /// The first step of a search for the cell with the first key of a tree that is not below `number`: the child of
    /// the root. What the next step needs of both trees is being loaded then.
    #[inline(always)]
    pub(super) fn begin(&self, tree: SearchTree, number: u32) -> usize {
        let index = self.nodes[tree as usize].count_below(number);
        if self.len > FANOUT {
            prefetch(&self.nodes, 2 + 2 * index);
            prefetch(&self.nodes, 3 + 2 * index);
        }
        index
    }

    /// The cell of a search that has [begun](Self::begin).
    #[inline(always)]
    pub(super) fn finish(&self, tree: SearchTree, number: u32, begun: usize) -> Cell {
        let is_deep = self.len > FANOUT;
        self.cell(if is_deep {
            begun * FANOUT + self.nodes[2 + 2 * begun + tree as usize].count_below(number)
        } else {
            begun
        })
    }

    /// The key before a cell, less than the first by one if it is the first, and its own.
    #[inline(always)]
    fn keys(&self, tree: SearchTree, cell: usize) -> [i32; 2] {
        let (node, i, tree) = (cell / FANOUT, cell % FANOUT, tree as usize);
        let is_deep = self.len > FANOUT;
        let leaf = &self.nodes[if is_deep { 2 + 2 * node + tree } else { tree }];
        let before = if i > 0 {
            leaf.get(i - 1) as i32
        } else if node > 0 {
            self.nodes[tree].get(node - 1) as i32
        } else {
            -1
        };
        [before, leaf.get(i) as i32]
    }

    /// A cell by its place in the list.
    #[inline(always)]
    fn cell(&self, index: usize) -> Cell {
        let [before, last] = self.keys(SearchTree::Places, index);
        let [light_before, light] = self.keys(SearchTree::Light, index);
        Cell {
            start: (before + 1) as u32,
            end: (last + 1) as u32,
            light_before: light_before.max(0) as u32,
            light: light as u32,
        }
    }

    /// Whether both are one distribution.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.nodes, &other.nodes)
    }

    /// A direction; `u` in `[0, 1)²`.
    #[inline]
    pub fn sample(&self, [u, v]: [f32; 2]) -> GuideSample {
        let point = LightPoint::of(u);
        let cell = self.finish(SearchTree::Light, point.light, self.begin(SearchTree::Light, point.light));
        let (direction, per_angle) = cell.direction(point, v);
        GuideSample { direction, pdf: cell.density() * per_angle }
    }

    /// The density per solid angle with which [`sample`](Self::sample) chooses a direction.
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let CurvePoint { place, per_angle } = CurvePoint::of(direction);
        self.finish(SearchTree::Places, place, self.begin(SearchTree::Places, place)).density() * per_angle
    }

    /// Starts to load what every lookup needs.
    #[inline(always)]
    pub fn prefetch(&self) {
        prefetch(&self.nodes, 0);
        prefetch(&self.nodes, 1);
    }

    /// Writes the distribution.
    pub(super) fn write(&self, out: &mut ByteWriter) {
        let cells = || (0..self.len).map(|cell| self.cell(cell));
        out.integers(&cells().map(|cell| cell.end).collect::<Vec<_>>());
        out.integers(&cells().map(|cell| cell.light).collect::<Vec<_>>());
    }

    /// Reads what [`write`](Self::write) gave; `None` if it is no distribution over a quadtree.
    pub(super) fn read(data: &mut ByteReader) -> Option<Self> {
        let (ends, limits) = (data.integers()?, data.integers()?);
        let mut start = 0;
        let is_cell = |&end: &u32| {
            let Some(size) = end.checked_sub(std::mem::replace(&mut start, end)) else { return false };
            size.is_power_of_two() && size.trailing_zeros() % 2 == 0 && (end - size) % size == 0
        };
        let is_tree = ends.iter().all(is_cell) && ends.last() == Some(&CURVE);
        let is_cumulative = limits.is_sorted() && limits.last() == Some(&WHOLE);
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
            let ends: Vec<u32> = cells
                .iter()
                .scan(0, |end, cell| {
                    *end += CURVE >> (2 * cell.depth);
                    Some(*end)
                })
                .collect();
            for _ in 0..2000 {
                let place = rng.below(CURVE as usize) as u32;
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
                let place = curve_of(square_of(sample.direction).0.map(|x| (x * (1 << MAX_DEPTH) as f32) as u32));
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
        let (quarter, whole) = (CURVE / 4, WHOLE);
        let quarters = [quarter, 2 * quarter, 3 * quarter, 4 * quarter];
        assert!(written(&quarters, &[5, 5, 9, whole]) && written(&[4 * quarter], &[whole]));
        assert!(!written(&quarters, &[5, 4, 9, whole]) && !written(&quarters, &[5, 5, 9, whole - 1]));
        assert!(!written(&quarters, &[5, 5, whole]) && !written(&quarters[..3], &[5, 5, whole]));
        assert!(!written(&[], &[]) && !written(&[2 * quarter, 4 * quarter], &[5, whole]));
        let shifted = [quarter / 4, quarter / 4 + quarter, 2 * quarter, 3 * quarter, 4 * quarter];
        assert!(!written(&shifted, &[1, 2, 3, 4, whole]) && !written(&quarters, &[u32::MAX, 5, 9, whole]));
    }
}
