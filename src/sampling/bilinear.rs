//! Densities on the unit square that are bilinear between the points of a grid, and means of several of them (Dupuy and
//! Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering", 2018, section 4.2).

use std::ops::{Add, Mul};

use crate::math::float::ONE_MINUS_EPSILON;

/// Which slices of tables count, and how much of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceMix([(usize, f32); 4]);

impl SliceMix {
    /// The first slice alone.
    pub const FIRST: Self = Self([(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]);

    /// Interpolates at `place` along two axes: slices are at every pair of knots of the outer and of the inner one,
    /// which both increase, those of the inner one next to each other. Outside of the knots, the outermost ones count.
    pub fn between([outer, inner]: [&[f32]; 2], place: [f32; 2]) -> Self {
        let ((row, y), (column, x)) = (bracket(outer, place[0]), bracket(inner, place[1]));
        let slice = |dy: usize, dx: usize| {
            let knot = |at: usize, d: usize, count: usize| (at + d).min(count - 1);
            knot(row, dy, outer.len()) * inner.len() + knot(column, dx, inner.len())
        };
        Self([
            (slice(0, 0), (1.0 - y) * (1.0 - x)),
            (slice(0, 1), (1.0 - y) * x),
            (slice(1, 0), y * (1.0 - x)),
            (slice(1, 1), y * x),
        ])
    }

    /// The mean of what each slice has.
    #[inline]
    pub fn mean<T: Add<Output = T> + Mul<f32, Output = T>>(&self, of: impl Fn(usize) -> T) -> T {
        let [(first, weight), rest @ ..] = self.0;
        rest.iter()
            .filter(|(_, weight)| *weight > 0.0)
            .fold(of(first) * weight, |sum, &(slice, weight)| sum + of(slice) * weight)
    }
}

/// The knot at or below `x`, not the last one unless it is the only one, and how far `x` is on the way to the next.
fn bracket(knots: &[f32], x: f32) -> (usize, f32) {
    let Some(last) = knots.len().checked_sub(2) else { return (0, 0.0) };
    let below = knots.partition_point(|&knot| knot <= x).saturating_sub(1).min(last);
    (below, ((x - knots[below]) / (knots[below + 1] - knots[below])).clamp(0.0, 1.0))
}

/// Slices of values at the points of a grid over the unit square, its outermost ones at the border.
#[derive(Clone, Debug, PartialEq)]
pub struct BilinearTable<T> {
    width: usize,
    height: usize,
    /// By slice, then by row, which is the second coordinate.
    values: Vec<T>,
}

/// A place between four points of a grid.
#[derive(Clone, Copy)]
struct Cell {
    column: usize,
    row: usize,
    x: f32,
    y: f32,
}

impl<T: Copy + Add<Output = T> + Mul<f32, Output = T>> BilinearTable<T> {
    /// A table of `width` columns, at least 2.
    ///
    /// # Panics
    /// If the values are no whole slices, or `width` or `height` is less than 2.
    pub fn new([width, height]: [usize; 2], values: Vec<T>) -> Self {
        assert!(width >= 2 && height >= 2 && values.len().is_multiple_of(width * height), "{width} x {height}");
        Self { width, height, values }
    }

    #[inline]
    fn cell(&self, [u, v]: [f32; 2]) -> Cell {
        let split = |u: f32, count: usize| {
            let u = u.clamp(0.0, 1.0) * (count - 1) as f32;
            let low = (u as usize).min(count - 2);
            (low, u - low as f32)
        };
        let ((column, x), (row, y)) = (split(u, self.width), split(v, self.height));
        Cell { column, row, x, y }
    }

    /// Both ends of a cell along its row, at `y`.
    #[inline]
    fn ends(&self, mix: &SliceMix, cell: Cell) -> [T; 2] {
        [0, 1].map(|side| {
            mix.mean(|slice| {
                let at = (slice * self.height + cell.row) * self.width + cell.column + side;
                self.values[at] * (1.0 - cell.y) + self.values[at + self.width] * cell.y
            })
        })
    }

    /// The value at a place in `[0, 1]²`.
    #[inline]
    pub fn at(&self, mix: &SliceMix, place: [f32; 2]) -> T {
        let cell = self.cell(place);
        let [left, right] = self.ends(mix, cell);
        left * (1.0 - cell.x) + right * cell.x
    }
}

/// Warps of the unit square to densities, one for each slice of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct BilinearWarp {
    /// Densities.
    table: BilinearTable<f32>,
    /// The integral along each row, up to each column.
    conditional: Vec<f32>,
    /// The integral of all rows up to each.
    marginal: Vec<f32>,
}

impl BilinearWarp {
    /// Densities in proportion to values, which are not negative; the same everywhere of slices that are all 0.
    pub fn new(mut table: BilinearTable<f32>) -> Self {
        let [width, height] = [table.width, table.height];
        let (mut conditional, mut marginal) = (Vec::new(), Vec::new());
        let [dx, dy] = [width, height].map(|count| 1.0 / (count - 1) as f64);
        for slice in table.values.chunks_exact_mut(width * height) {
            let rows: Vec<f64> =
                slice.chunks_exact(width).map(|row| total(row.iter().copied().map(f64::from)) * dx).collect();
            let mut whole = total(rows.into_iter()) * dy;
            if whole <= 0.0 {
                slice.fill(1.0);
                whole = 1.0;
            }
            slice.iter_mut().for_each(|value| *value = (f64::from(*value) / whole) as f32);
            let mut sums = Vec::with_capacity(height);
            for row in slice.chunks_exact(width) {
                let row = cumulative(row.iter().copied().map(f64::from), dx);
                sums.push(row[width - 1]);
                conditional.extend(row.into_iter().map(|sum| sum as f32));
            }
            marginal.extend(cumulative(sums.into_iter(), dy).into_iter().map(|sum| sum as f32));
        }
        Self { table, conditional, marginal }
    }

    /// The density at a place.
    pub fn density(&self, mix: &SliceMix, place: [f32; 2]) -> f32 {
        self.table.at(mix, place)
    }

    #[inline]
    fn marginal(&self, mix: &SliceMix, row: usize) -> f32 {
        mix.mean(|slice| self.marginal[slice * self.table.height + row])
    }

    /// The integral up to `column` along the row at `cell`.
    #[inline]
    fn conditional(&self, mix: &SliceMix, cell: Cell, column: usize) -> f32 {
        mix.mean(|slice| {
            let at = (slice * self.table.height + cell.row) * self.table.width + column;
            self.conditional[at] * (1.0 - cell.y) + self.conditional[at + self.table.width] * cell.y
        })
    }

    /// The integrals along both rows beside a cell.
    #[inline]
    fn row_totals(&self, mix: &SliceMix, row: usize) -> [f32; 2] {
        let total = |y: f32| self.conditional(mix, Cell { column: 0, row, x: 0.0, y }, self.table.width - 1);
        [total(0.0), total(1.0)]
    }

    /// The place of a pair of uniform numbers.
    pub fn sample(&self, mix: &SliceMix, [u, v]: [f32; 2]) -> [f32; 2] {
        let [width, height] = [self.table.width, self.table.height];
        let target = v * self.marginal(mix, height - 1);
        let row = last_at_most(height - 1, |row| self.marginal(mix, row) <= target);
        let rest = (target - self.marginal(mix, row)) * (height - 1) as f32;
        let [low, high] = self.row_totals(mix, row);
        let y = solve_trapezoid([low, high], rest);

        let cell = Cell { column: 0, row, x: 0.0, y };
        let target = u * self.conditional(mix, cell, width - 1);
        let column = last_at_most(width - 1, |column| self.conditional(mix, cell, column) <= target);
        let rest = (target - self.conditional(mix, cell, column)) * (width - 1) as f32;
        let x = solve_trapezoid(self.table.ends(mix, Cell { column, ..cell }), rest);
        [(column as f32 + x) / (width - 1) as f32, (row as f32 + y) / (height - 1) as f32]
    }

    /// The uniform numbers of which [`sample`](Self::sample) makes a place, and the density there.
    pub fn invert(&self, mix: &SliceMix, place: [f32; 2]) -> ([f32; 2], f32) {
        let [width, height] = [self.table.width, self.table.height];
        let cell @ Cell { column, row, x, y } = self.table.cell(place);
        let [low, high] = self.row_totals(mix, row);
        let share = |part: f32, whole: f32| if whole > 0.0 { (part / whole).min(ONE_MINUS_EPSILON) } else { 0.0 };
        let below = self.marginal(mix, row) + trapezoid([low, high], y) / (height - 1) as f32;
        let v = share(below, self.marginal(mix, height - 1));

        let ends = self.table.ends(mix, cell);
        let left = self.conditional(mix, cell, column) + trapezoid(ends, x) / (width - 1) as f32;
        let u = share(left, self.conditional(mix, cell, width - 1));
        ([u, v], ends[0] * (1.0 - x) + ends[1] * x)
    }
}

/// A density on the unit square that is bilinear between its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BilinearDensity {
    /// In proportion to the density at (0, 0), (1, 0), (1, 1) and (0, 1); above 0.
    pub corners: [f32; 4],
}

impl BilinearDensity {
    /// The densities at both ends of the row at `y`, up to a common factor.
    #[inline(always)]
    fn ends(&self, y: f32) -> [f32; 2] {
        let [c00, c10, c11, c01] = self.corners;
        [(1.0 - y) * c00 + y * c01, (1.0 - y) * c10 + y * c11]
    }

    /// The place of a pair of uniform numbers.
    #[inline(always)]
    pub fn sample(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let [c00, c10, c11, c01] = self.corners;
        let (low, high) = (c00 + c10, c01 + c11);
        let y = solve_trapezoid([low, high], 0.5 * (low + high) * v);
        let [left, right] = self.ends(y);
        [solve_trapezoid([left, right], 0.5 * (left + right) * u), y]
    }

    /// The density at a place.
    #[inline(always)]
    pub fn density(&self, [x, y]: [f32; 2]) -> f32 {
        let ([left, right], [c00, c10, c11, c01]) = (self.ends(y), self.corners);
        4.0 * ((1.0 - x) * left + x * right) / (c00 + c10 + (c11 + c01))
    }
}

/// Sums of the means of neighbours, times `step`: the integral up to each.
fn cumulative(values: impl Iterator<Item = f64>, step: f64) -> Vec<f64> {
    let mut before = None;
    let mut sum = 0.0;
    let add = |value: f64| {
        sum += before.map_or(0.0, |before: f64| 0.5 * (before + value) * step);
        before = Some(value);
        sum
    };
    values.map(add).collect()
}

/// The last of [`cumulative`].
fn total(values: impl Iterator<Item = f64>) -> f64 {
    cumulative(values, 1.0).last().copied().unwrap_or(0.0)
}

/// The last index below `count` for which `is_low` is true, as it is up to some index; 0 if there is none.
#[inline]
fn last_at_most(count: usize, is_low: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while low + 1 < high {
        let middle = low.midpoint(high);
        if is_low(middle) { low = middle } else { high = middle }
    }
    low
}

/// The integral from 0 to `t` of a line from `a` at 0 to `b` at 1.
#[inline]
fn trapezoid([a, b]: [f32; 2], t: f32) -> f32 {
    t * (a + 0.5 * t * (b - a))
}

/// The `t` within `[0, 1]` of an integral.
#[inline(always)]
fn solve_trapezoid([a, b]: [f32; 2], integral: f32) -> f32 {
    // Without cancellation, whichever end is higher.
    let root = (a * a + 2.0 * (b - a) * integral).max(0.0).sqrt();
    if a + root > 0.0 { (2.0 * integral / (a + root)).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::statistics::{chi_squared_p_value, random_points};
    use super::*;

    /// Two slices of 4 x 3 points, one with empty rows and columns.
    fn warp() -> BilinearWarp {
        let values = [
            [1.0, 2.0, 0.5, 3.0, 0.0, 1.0, 4.0, 1.0, 2.0, 2.0, 0.1, 0.3],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        ];
        BilinearWarp::new(BilinearTable::new([4, 3], values.concat()))
    }

    const KNOTS: [f32; 2] = [0.5, 1.5];

    fn mixes() -> [SliceMix; 4] {
        [-9.0, 0.75, 1.25, 9.0].map(|x| SliceMix::between([&[0.0], &KNOTS], [7.0, x]))
    }

    #[test]
    fn means_are_linear_between_knots_and_constant_beyond() {
        let table = BilinearTable::new(
            [2, 2],
            [0.0, 1.0, 2.0, 4.0, 5.0].iter().flat_map(|&v| [v; 4]).chain([9.0; 4]).collect(),
        );
        let (outer, inner) = ([0.0, 10.0], [1.0, 2.0, 4.0]);
        let at = |y: f32, x: f32| table.at(&SliceMix::between([&outer, &inner], [y, x]), [0.3, 0.8]);
        for (y, x, expected) in
            [(0.0, 1.0, 0.0), (0.0, 1.5, 0.5), (-1.0, 3.0, 1.5), (10.0, 9.0, 9.0), (5.0, 0.0, 2.0), (2.5, 3.0, 2.875)]
        {
            assert!((at(y, x) - expected).abs() < 1e-5, "{y} {x}: {}", at(y, x));
        }
    }

    #[test]
    fn samples_have_the_density_and_are_inverted() {
        const BINS: usize = 12;
        for (i, mix) in mixes().iter().enumerate() {
            let warp = warp();
            let mut observed = vec![0; BINS * BINS];
            let count = 200_000;
            for [u, v, ..] in random_points(40 + i as u32, count) {
                let place = warp.sample(mix, [u, v]);
                let (back, density) = warp.invert(mix, place);
                assert!((back[0] - u).abs() < 2e-4 && (back[1] - v).abs() < 2e-4, "{u} {v} {place:?} {back:?}");
                assert!((density - warp.density(mix, place)).abs() < 1e-5 && density > 0.0);
                let bin = place.map(|x| ((x * BINS as f32) as usize).min(BINS - 1));
                observed[bin[1] * BINS + bin[0]] += 1;
            }
            // Cells of 8 x 8 points, at whose middles the mean of a bilinear function is exact but for its kinks.
            let expected = |bin: usize| {
                let fine = 24;
                let places = (0..fine * fine).map(|k| {
                    let at = |bin: usize, k: usize| (bin as f32 + (k as f32 + 0.5) / fine as f32) / BINS as f32;
                    [at(bin % BINS, k % fine), at(bin / BINS, k / fine)]
                });
                let sum: f64 = places.map(|place| f64::from(warp.density(mix, place))).sum();
                sum / (fine * fine * BINS * BINS) as f64 * f64::from(count)
            };
            let expected: Vec<f64> = (0..BINS * BINS).map(expected).collect();
            assert!((expected.iter().sum::<f64>() / f64::from(count) - 1.0).abs() < 1e-4);
            let p = chi_squared_p_value(&observed, &expected);
            assert!(p > 1e-6, "{i}: {p}");
        }
    }

    #[test]
    fn samples_between_four_corners_have_the_density() {
        const BINS: usize = 16;
        for (i, corners) in
            [[1.0; 4], [1.0, 2.0, 0.5, 3.0], [1e9, 2e-5, 1.0, 1e-3], [1e-5, 1e-5, 1e9, 1e-5]].into_iter().enumerate()
        {
            let density = BilinearDensity { corners };
            let mut observed = vec![0; BINS * BINS];
            let count = 200_000;
            for [u, v, ..] in random_points(60 + i as u32, count) {
                let place = density.sample([u, v]);
                assert!(place.iter().all(|x| (0.0..=1.0).contains(x)) && density.density(place) > 0.0, "{place:?}");
                let bin = place.map(|x| ((x * BINS as f32) as usize).min(BINS - 1));
                observed[bin[1] * BINS + bin[0]] += 1;
            }
            // The mean of a bilinear function is its value in the middle.
            let middle = |bin: usize| (bin as f32 + 0.5) / BINS as f32;
            let expected: Vec<f64> = (0..BINS * BINS)
                .map(|bin| f64::from(density.density([middle(bin % BINS), middle(bin / BINS)])))
                .map(|density| density * f64::from(count) / (BINS * BINS) as f64)
                .collect();
            assert!((expected.iter().sum::<f64>() / f64::from(count) - 1.0).abs() < 1e-5);
            let p = chi_squared_p_value(&observed, &expected);
            assert!(p > 1e-6, "{i}: {p}");
        }
    }

    #[test]
    fn what_is_nowhere_is_everywhere() {
        let warp = BilinearWarp::new(BilinearTable::new([3, 2], vec![0.0; 6]));
        assert_eq!(warp.sample(&SliceMix::FIRST, [0.25, 0.5]), [0.25, 0.5]);
        assert_eq!(warp.invert(&SliceMix::FIRST, [0.25, 0.5]), ([0.25, 0.5], 1.0));
    }
}
