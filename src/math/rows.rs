//! Rows of numbers for loops that work on many things [side by side](super::vectorize).

use super::{DVec3, Vec3};

/// Things that are worked on side by side at most: their rows stay in the nearest caches.
pub const BATCH: usize = 128;

/// One number for each of many things.
pub type Row<T = f32> = [T; BATCH];

/// A vector for each, by component.
#[derive(Clone, Debug)]
pub struct Vectors([Row; 3]);

impl Vectors {
    /// All zero.
    pub const ZERO: Self = Self([[0.0; BATCH]; 3]);

    /// Those of one.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Vec3 {
        Vec3::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    /// Sets those of one.
    #[inline(always)]
    pub fn set(&mut self, i: usize, v: Vec3) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.x, v.y, v.z);
    }
}

/// A point for each, by coordinate.
#[derive(Clone, Debug)]
pub struct Points([Row<f64>; 3]);

impl Points {
    /// All zero.
    pub const ZERO: Self = Self([[0.0; BATCH]; 3]);

    /// Those of one.
    #[inline(always)]
    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    /// Sets those of one.
    #[inline(always)]
    pub fn set(&mut self, i: usize, v: DVec3) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.x, v.y, v.z);
    }
}
