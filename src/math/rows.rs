//! Structures of arrays: rows of numbers, one per lane, for loops that become [vector code](super::vectorize).

use super::{DVec3, Vec2, Vec3};

/// Lanes of a row: few enough that rows stay in the nearest caches.
pub const BATCH: usize = 128;

/// Lanes of the widest vectors.
pub const WIDTH: usize = 16;

/// The first `count` lanes and those after them in the last vector, at most [`BATCH`]. Loops over whole vectors leave
/// no lanes to be computed one by one; what they compute beyond the count is not used.
#[inline(always)]
pub fn whole_vectors(count: usize) -> usize {
    // The compiler sees that it is a multiple.
    count.min(BATCH).div_ceil(WIDTH) * WIDTH
}

/// One number per lane.
pub type Row<T = f32> = [T; BATCH];

/// What structures of arrays store by component.
pub trait Element: Copy {
    /// One per lane.
    type Rows: Clone + std::fmt::Debug;

    /// All zero.
    const ZERO: Self::Rows;

    /// The element of a lane.
    fn get(rows: &Self::Rows, i: usize) -> Self;

    /// Sets the element of a lane.
    fn set(rows: &mut Self::Rows, i: usize, value: Self);
}

macro_rules! number {
    ($($number:ident $zero:literal),*) => {$(
        impl Element for $number {
            type Rows = Row<Self>;
            const ZERO: Row<Self> = [$zero; BATCH];

            #[inline(always)]
            fn get(rows: &Row<Self>, i: usize) -> Self {
                rows[i]
            }

            #[inline(always)]
            fn set(rows: &mut Row<Self>, i: usize, value: Self) {
                rows[i] = value;
            }
        }
    )*};
}

number!(f32 0.0, f64 0.0, u32 0);

/// The pair of a lane.
#[inline(always)]
pub fn pair(rows: &[Row; 2], i: usize) -> [f32; 2] {
    [rows[0][i], rows[1][i]]
}

/// A vector of the plane per lane, by component.
#[derive(Clone, Debug)]
pub struct Vec2Rows(pub [Row; 2]);

impl Vec2Rows {
    /// The vector of a lane.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Vec2 {
        Vec2::new(self.0[0][i], self.0[1][i])
    }

    /// Sets the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, i: usize, v: Vec2) {
        (self.0[0][i], self.0[1][i]) = (v.x, v.y);
    }
}

impl Element for Vec2 {
    type Rows = Vec2Rows;
    const ZERO: Vec2Rows = Vec2Rows([[0.0; BATCH]; 2]);

    #[inline(always)]
    fn get(rows: &Vec2Rows, i: usize) -> Self {
        rows.get(i)
    }

    #[inline(always)]
    fn set(rows: &mut Vec2Rows, i: usize, value: Self) {
        rows.set(i, value);
    }
}

/// A vector per lane, by component.
#[derive(Clone, Debug)]
pub struct Vec3Rows(pub [Row; 3]);

impl Vec3Rows {
    /// All zero.
    pub const ZERO: Self = Self([[0.0; BATCH]; 3]);

    /// The vector of a lane.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Vec3 {
        Vec3::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    /// Sets the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, i: usize, v: Vec3) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.x, v.y, v.z);
    }
}

impl Default for Vec3Rows {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Element for Vec3 {
    type Rows = Vec3Rows;
    const ZERO: Vec3Rows = Vec3Rows::ZERO;

    #[inline(always)]
    fn get(rows: &Vec3Rows, i: usize) -> Self {
        rows.get(i)
    }

    #[inline(always)]
    fn set(rows: &mut Vec3Rows, i: usize, value: Self) {
        rows.set(i, value);
    }
}

/// A point per lane, by coordinate.
#[derive(Clone, Debug)]
pub struct DVec3Rows(pub [Row<f64>; 3]);

impl DVec3Rows {
    /// All zero.
    pub const ZERO: Self = Self([[0.0; BATCH]; 3]);

    /// The point of a lane.
    #[inline(always)]
    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    /// Sets the point of a lane.
    #[inline(always)]
    pub fn set(&mut self, i: usize, v: DVec3) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (v.x, v.y, v.z);
    }
}

impl Element for DVec3 {
    type Rows = DVec3Rows;
    const ZERO: DVec3Rows = DVec3Rows::ZERO;

    #[inline(always)]
    fn get(rows: &DVec3Rows, i: usize) -> Self {
        rows.get(i)
    }

    #[inline(always)]
    fn set(rows: &mut DVec3Rows, i: usize, value: Self) {
        rows.set(i, value);
    }
}

/// Declares a structure of rows, one for each field: `soa! { pub struct PathRows { pdf: f32, throughput: Rgb } }`. With
/// `of Path` the structure `Path` of one of them is declared too, and `get` and `set`. Rows of 32 and of 64 bits that
/// one loop writes belong into different structures: where all rows are alike, the compiler sees that they do not
/// overlap.
macro_rules! soa {
    (
        $(#[$meta:meta])* $vis:vis struct $rows:ident of $item:ident {
            $($(#[$field_meta:meta])* $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug)]
        $vis struct $item { $($(#[$field_meta])* pub $field: $type,)* }

        $crate::math::rows::soa! { $(#[$meta])* $vis struct $rows { $($(#[$field_meta])* $field: $type,)* } }

        #[allow(dead_code)]
        impl $rows {
            /// The element of a lane.
            #[inline(always)]
            $vis fn get(&self, i: usize) -> $item {
                $item { $($field: <$type as $crate::math::rows::Element>::get(&self.$field, i),)* }
            }

            /// Sets the element of a lane.
            #[inline(always)]
            $vis fn set(&mut self, i: usize, item: &$item) {
                $(<$type as $crate::math::rows::Element>::set(&mut self.$field, i, item.$field);)*
            }
        }
    };
    ($(#[$meta:meta])* $vis:vis struct $rows:ident { $($(#[$field_meta:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug)]
        #[repr(align(64))]
        $vis struct $rows { $($(#[$field_meta])* pub $field: <$type as $crate::math::rows::Element>::Rows,)* }

        impl Default for $rows {
            fn default() -> Self {
                Self { $($field: <$type as $crate::math::rows::Element>::ZERO,)* }
            }
        }
    };
}

pub(crate) use soa;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_vectors_hold_the_count_up_to_a_row() {
        let counts = [0, 1, 15, 16, 17, 112, 113, BATCH, BATCH + 1];
        assert_eq!(counts.map(whole_vectors), [0, 16, 16, 16, 32, 112, BATCH, BATCH, BATCH]);
    }
}
