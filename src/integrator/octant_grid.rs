//! Cells of surface points.

use crate::math::float::{WHOLE, floor};
use crate::math::{Aabb, Vec3};

/// Octants of normals.
const OCTANTS: usize = 8;

/// A grid of cubic cells, `SIDE` along the longest axis of a box, each apart for the eight octants of normals.
#[derive(Clone, Copy, Debug)]
pub struct OctantGrid<const SIDE: usize> {
    corner: Vec3,
    cells_per_unit: f32,
}

impl<const SIDE: usize> OctantGrid<SIDE> {
    /// Over a box.
    pub fn new(bounds: &Aabb) -> Self {
        let size = bounds.size().max_element();
        let cells_per_unit = if size > 0.0 && size < f32::INFINITY { SIDE as f32 / size } else { 0.0 };
        Self { corner: bounds.min, cells_per_unit }
    }

    /// The index of the cell of a point with this normal, nearest to it where the grid has ended; below
    /// [`cell_count`]`(SIDE)`.
    #[inline(always)]
    pub fn cell(&self, p: Vec3, n: Vec3) -> u32 {
        let (side, last) = (SIDE as f32, (SIDE - 1) as f32);
        let at = |k: usize| {
            let x = (p[k] - self.corner[k]) * self.cells_per_unit;
            // NaN becomes 0.
            let x = if x > 0.0 { x } else { 0.0 };
            floor(if x < last { x } else { last })
        };
        let bit = |k: usize| if n[k] < 0.0 { (1 << k) as f32 } else { 0.0 };
        let cell = ((at(2) * side + at(1)) * side + at(0)) * OCTANTS as f32 + bit(0) + bit(1) + bit(2);
        const { assert!(cell_count(SIDE) <= 1 << 23) };
        // An integer below 2^23 is the mantissa of its sum with 2^23. A cast saturates, which is not vector code.
        (cell + WHOLE).to_bits() - WHOLE.to_bits()
    }

    /// The cell of a grid over the same box with a smaller side around a cell, with the same octant.
    pub fn coarser_cell(cell: usize, side: usize) -> usize {
        let (octant, cell) = (cell % OCTANTS, cell / OCTANTS);
        let at = [cell % SIDE, cell / SIDE % SIDE, cell / (SIDE * SIDE)].map(|x| x * side / SIDE);
        ((at[2] * side + at[1]) * side + at[0]) * OCTANTS + octant
    }
}

/// Cells of a grid with this side.
pub const fn cell_count(side: usize) -> usize {
    side.pow(3) * OCTANTS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn cells_are_by_position_and_octant_and_end_with_the_box() {
        let grid = OctantGrid::<16>::new(&Aabb { min: Vec3::ZERO, max: Vec3::new(16.0, 8.0, 4.0) });
        let cell = |p: [f32; 3], n: [f32; 3]| grid.cell(Vec3::from(p), Vec3::from(n)) as usize;
        assert_eq!(cell([2.5, 1.5, 0.5], [1.0, -1.0, 1.0]), (16 + 2) * OCTANTS + 2);
        assert_eq!(cell([99.0, 99.0, 99.0], [-1.0; 3]), cell_count(16) - 1);
        assert_eq!(cell([f32::NAN, -3.0, f32::NEG_INFINITY], [1.0; 3]), 0);
        let cells = [[2.5, 1.5, 0.5], [3.5, 0.5, 1.5]].map(|p| cell(p, [1.0; 3]));
        assert_eq!(cells.map(|cell| OctantGrid::<16>::coarser_cell(cell, 8)), [OCTANTS; 2]);
        assert_eq!(OctantGrid::<16>::new(&Aabb::EMPTY).cell(Vec3::ONE, Vec3::ONE), 0);
    }

    #[test]
    fn cells_are_those_of_integer_arithmetic() {
        let grid = OctantGrid::<32>::new(&Aabb { min: Vec3::new(-1.0, 2.0, -3.0), max: Vec3::new(4.0, 3.0, 1.0) });
        let mut random = Rng::new(17);
        for _ in 0..20_000 {
            let p = random.direction().as_vec3() * 6.0 * random.unit_f32();
            let n = random.direction().as_vec3();
            let at = |k: usize| ((p[k] - grid.corner[k]) * grid.cells_per_unit).clamp(0.0, 31.0) as u32;
            let octant = (0..3).map(|k| u32::from(n[k] < 0.0) << k).sum::<u32>();
            assert_eq!(grid.cell(p, n), ((at(2) * 32 + at(1)) * 32 + at(0)) * 8 + octant, "{p} {n}");
        }
    }
}
