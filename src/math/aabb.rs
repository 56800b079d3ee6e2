//! Axis-aligned boxes: `f64` while a shape computes them, `f32` rounded outward for accelerators.

use super::float::{round_down, round_up};
use super::{DAffine3, DVec3, Vec3};

/// An axis-aligned box in `f32`; empty when some `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The smallest coordinates.
    pub min: Vec3,
    /// The largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Whether no point lies inside.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box around this one and `p`.
    #[must_use]
    pub fn extended(&self, p: Vec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The middle.
    pub fn center(&self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Edge lengths.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Surface area; zero for an empty box.
    pub fn area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let d = self.size();
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// Whether `p` lies inside or on the boundary.
    pub fn contains(&self, p: Vec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Whether a point lies inside or on the boundary of both.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }
}

/// An axis-aligned box in `f64`; empty when some `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The smallest coordinates.
    pub min: DVec3,
    /// The largest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Whether no point lies inside.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The smallest box around this one and `p`.
    #[must_use]
    pub fn extended(&self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// This box with `margin` added on each side.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// The box around this box after an affine map.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        let center = map.transform_point3(0.5 * (self.min + self.max));
        let half = 0.5 * (self.max - self.min);
        let m = &map.matrix3;
        let reach = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
        Self { min: center - reach, max: center + reach }
    }

    /// The `f32` box for an accelerator: rounded outward, then one float wider on each side, since Embree's traversal
    /// of user geometry is not conservative (it errs by about half a unit in the last place of the ray's origin).
    pub fn padded(&self) -> Aabb {
        let lower = |x: f64| round_down(x).next_down();
        let upper = |x: f64| round_up(x).next_up();
        Aabb {
            min: Vec3::new(lower(self.min.x), lower(self.min.y), lower(self.min.z)),
            max: Vec3::new(upper(self.max.x), upper(self.max.y), upper(self.max.z)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_padded_box_holds_the_exact_one() {
        let exact = Bounds { min: DVec3::new(0.1, -0.3, 1e5 + 0.7), max: DVec3::new(0.2, -0.1, 1e5 + 0.9) };
        let padded = exact.padded();
        assert!(padded.min.as_dvec3().cmplt(exact.min).all() && padded.max.as_dvec3().cmpgt(exact.max).all());
    }

    #[test]
    fn a_turned_cube_has_the_box_of_its_corners() {
        let map = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4);
        let cube = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) }.transformed(&map);
        assert!((cube.max - DVec3::new(2f64.sqrt(), 2f64.sqrt(), 1.0)).abs().max_element() < 1e-15);
    }
}
