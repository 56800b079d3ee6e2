//! Values between the middles of voxels.

use std::ops::{Add, Mul};

use crate::color::Rgb;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DVec3, Vec3, vec3};

/// What voxels hold.
pub trait Voxel: Copy + Default + Send + Sync + Add<Output = Self> + Mul<f32, Output = Self> {
    /// The smaller of two, of colours by channel.
    fn smaller(self, other: Self) -> Self;
    /// The larger of two, of colours by channel.
    fn larger(self, other: Self) -> Self;
}

impl Voxel for f32 {
    fn smaller(self, other: Self) -> Self {
        self.min(other)
    }

    fn larger(self, other: Self) -> Self {
        self.max(other)
    }
}

impl Voxel for Rgb {
    fn smaller(self, other: Self) -> Self {
        Self::new(self.r.min(other.r), self.g.min(other.g), self.b.min(other.b))
    }

    fn larger(self, other: Self) -> Self {
        Self::new(self.r.max(other.r), self.g.max(other.g), self.b.max(other.b))
    }
}

/// What is beyond the middles of the outermost voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// Their values.
    Clamp,
    /// Values that fall to zero as if the next voxels were empty.
    Zero,
}

/// A box of voxels over the unit cube, between whose middles values are interpolated trilinearly.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelGrid<T> {
    /// Along x, y and z.
    resolution: [usize; 3],
    /// By z, then y, then x.
    values: Vec<T>,
    /// From the unit cube to numbers of voxels, whole at their middles.
    scale: Vec3,
    offset: Vec3,
}

/// The least and the largest of values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval<T> {
    /// The least.
    pub min: T,
    /// The largest.
    pub max: T,
}

impl<T: Voxel> VoxelGrid<T> {
    /// Voxels of these values, by z, then y, then x; there are as many as the resolution, of no axis 0, demands.
    pub fn new(resolution: [u32; 3], values: Vec<T>, border: Border) -> Self {
        let inner = resolution.map(|edge| edge as usize);
        debug_assert_eq!(inner.iter().product::<usize>(), values.len());
        let scale = Vec3::from(resolution.map(|edge| edge as f32));
        if border == Border::Clamp {
            return Self { resolution: inner, values, scale, offset: Vec3::splat(-0.5) };
        }
        let outer = inner.map(|edge| edge + 2);
        let mut padded = vec![T::default(); outer.iter().product()];
        for (row, from) in values.chunks_exact(inner[0]).enumerate() {
            let (y, z) = (row % inner[1], row / inner[1]);
            let start = ((z + 1) * outer[1] + y + 1) * outer[0] + 1;
            padded[start..start + inner[0]].copy_from_slice(from);
        }
        Self { resolution: outer, values: padded, scale, offset: Vec3::splat(0.5) }
    }

    /// As [`new`](Self::new), for voxels that fill the box from `min` to `max` of the unit cube; beyond it, there are
    /// the values of the outermost ones.
    pub fn placed(resolution: [u32; 3], values: Vec<T>, min: DVec3, max: DVec3) -> Self {
        let scale = DVec3::from(resolution.map(f64::from)) / (max - min);
        let offset = (-min * scale - 0.5).as_vec3();
        Self { scale: scale.as_vec3(), offset, ..Self::new(resolution, values, Border::Clamp) }
    }

    /// Voxels along x, y and z; of those that fill a part of the unit cube, as many as would fill all of it.
    pub fn resolution(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.resolution[axis].max(self.scale[axis].ceil() as usize))
    }

    /// Bytes of all values.
    pub fn bytes(&self) -> usize {
        self.values.len() * size_of::<T>()
    }

    /// The value at a point of the unit cube.
    #[inline]
    pub fn at(&self, p: Vec3) -> T {
        let [nx, ny, nz] = self.resolution;
        // A NaN becomes 0.
        let place = |p: f32, scale: f32, offset: f32, n: usize| {
            let x = (p * scale + offset).max(0.0).min((n - 1) as f32);
            let i = x as usize;
            (i, (i + 1).min(n - 1), x - i as f32)
        };
        let Self { scale, offset, .. } = self;
        let (x0, x1, fx) = place(p.x, scale.x, offset.x, nx);
        let (y0, y1, fy) = place(p.y, scale.y, offset.y, ny);
        let (z0, z1, fz) = place(p.z, scale.z, offset.z, nz);
        let mix = |a: T, b: T, f: f32| a * (1.0 - f) + b * f;
        let row = |y: usize, z: usize| {
            let start = (z * ny + y) * nx;
            mix(self.values[start + x0], self.values[start + x1], fx)
        };
        mix(mix(row(y0, z0), row(y1, z0), fy), mix(row(y0, z1), row(y1, z1), fy), fz)
    }

    /// What the values at points of a box within the unit cube cannot exceed.
    pub fn bounds(&self, min: Vec3, max: Vec3) -> Interval<T> {
        // A little wider, so that rounding leads out of no box.
        let range = |axis: usize| {
            let (scale, offset, last) = (self.scale[axis], self.offset[axis], self.resolution[axis] - 1);
            let rounding = 8.0 * UNIT_ROUNDOFF as f32 * (scale + offset.abs() + 1.0);
            let low = (min[axis] * scale + offset - rounding).max(0.0) as usize;
            let high = (max[axis] * scale + offset + rounding).max(0.0).ceil() as usize;
            low.min(last)..=high.min(last)
        };
        let [nx, ny, _] = self.resolution;
        let (xs, ys) = (range(0), range(1));
        let first = self.values[(*range(2).start() * ny + ys.start()) * nx + xs.start()];
        let mut bounds = Interval { min: first, max: first };
        for z in range(2) {
            for y in ys.clone() {
                let start = (z * ny + y) * nx;
                for &value in &self.values[start + xs.start()..=start + xs.end()] {
                    bounds = Interval { min: bounds.min.smaller(value), max: bounds.max.larger(value) };
                }
            }
        }
        bounds
    }
}

/// The box of the unit cube that is `index` of so many blocks, by z, then y, then x: both corners.
pub fn block_box(index: usize, blocks: [usize; 3]) -> [Vec3; 2] {
    let at = [index % blocks[0], index / blocks[0] % blocks[1], index / blocks[0] / blocks[1]];
    let corner = |offset: usize| {
        let of = |axis: usize| (at[axis] + offset) as f32 / blocks[axis] as f32;
        vec3(of(0), of(1), of(2))
    };
    [corner(0), corner(1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn random_grid(border: Border) -> VoxelGrid<f32> {
        let mut rng = Rng::new(3);
        VoxelGrid::new([3, 4, 5], (0..60).map(|_| rng.unit_f32()).collect(), border)
    }

    #[test]
    fn middles_of_voxels_have_their_values() {
        for border in [Border::Clamp, Border::Zero] {
            let mut rng = Rng::new(3);
            let grid = random_grid(border);
            for i in 0..60 {
                let at = [i % 3, i / 3 % 4, i / 12].map(|i| i as f32 + 0.5);
                let found = grid.at(vec3(at[0] / 3.0, at[1] / 4.0, at[2] / 5.0));
                assert!((found - rng.unit_f32()).abs() < 1e-5, "{i}");
            }
        }
    }

    #[test]
    fn between_middles_values_are_linear_along_each_axis() {
        // Of values that are a product of linear functions, all are.
        let value = |p: Vec3| (1.0 + p.x) * (2.0 - p.y) * (0.5 + p.z);
        let middle = |i: usize| vec3((i % 4) as f32 + 0.5, (i / 4 % 4) as f32 + 0.5, (i / 16) as f32 + 0.5) / 4.0;
        let grid = VoxelGrid::new([4; 3], (0..64).map(|i| value(middle(i))).collect(), Border::Clamp);
        let mut rng = Rng::new(1);
        for _ in 0..1000 {
            let p = vec3(rng.unit_f32(), rng.unit_f32(), rng.unit_f32());
            let inside = p.clamp(Vec3::splat(0.125), Vec3::splat(0.875));
            assert!((grid.at(p) - value(inside)).abs() < 1e-5, "{p}");
        }
    }

    #[test]
    fn a_border_of_zero_halves_the_faces() {
        let grid = VoxelGrid::new([1, 2, 1], vec![1.0, 1.0], Border::Zero);
        for (p, expected) in [([0.5, 0.5, 0.5], 1.0), ([0.0, 0.5, 0.5], 0.5), ([1.0, 1.0, 0.5], 0.25)] {
            assert_eq!(grid.at(Vec3::from(p)), expected);
        }
    }

    #[test]
    fn no_value_in_a_block_is_beyond_its_bounds() {
        let mut rng = Rng::new(7);
        for border in [Border::Clamp, Border::Zero] {
            let grid = random_grid(border);
            for blocks in [[1; 3], [2, 3, 1], [7, 2, 5]] {
                for index in 0..blocks.iter().product() {
                    let [min, max] = block_box(index, blocks);
                    let bounds = grid.bounds(min, max);
                    for _ in 0..100 {
                        let u = vec3(rng.unit_f32(), rng.unit_f32(), rng.unit_f32());
                        let value = grid.at(min + (max - min) * u);
                        assert!((bounds.min - 1e-6..=bounds.max + 1e-6).contains(&value), "{index} {value} {bounds:?}");
                    }
                }
            }
        }
    }
}
