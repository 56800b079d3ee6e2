//! The space in which a scene is rendered: the world, or, where `f32` could not hold the world's coordinates, the world
//! moved and scaled.

use super::{Bounds, DAffine3, DMat3, DVec3, Motion};

/// Scenes whose extent lies within these powers of two are not scaled. Measured: from 2^-26 to 2^36 pictures do not
/// depend on the scale.
const UNSCALED: [i32; 2] = [-20, 30];

/// The extent, as a power of two, that smaller and larger scenes are scaled to. Large ones stay large: what is small in
/// them gains.
const SCALED: [i32; 2] = [0, 20];

/// Scenes that reach this many times as far from their middle as that lies from the origin are not moved: they would
/// gain less than two bits.
const LEAST_GAIN: f64 = 4.0;

/// Scenes are not moved if their middle is nearer than this many times the size of their smallest shape, whose edges
/// `f32` places to a 16,384th of that size there.
const NEAR: f64 = 1024.0;

/// Render space: the world after a translation and then a scale by a power of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSpace {
    /// The world point at its origin.
    origin: DVec3,
    /// Its units for a world unit.
    scale: f64,
}

impl RenderSpace {
    /// The world itself.
    pub const WORLD: Self = Self { origin: DVec3::ZERO, scale: 1.0 };

    /// The least and largest extent, in world units, of scenes that it is made for; beyond them not even layers hold
    /// world coordinates.
    pub const EXTENTS: [f64; 2] = [1e-30, 1e30];

    /// The space for shapes (or groups of them) with these bounds; the world if that will do. What has no finite bounds
    /// does not count.
    pub fn around(shapes: &[Bounds]) -> Self {
        let finite = |b: &&Bounds| b.min.is_finite() && b.max.is_finite() && b.min.cmple(b.max).all();
        let shapes: Vec<&Bounds> = shapes.iter().filter(finite).collect();
        if shapes.is_empty() {
            return Self::WORLD;
        }
        let all = shapes.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
        let reach = |from: DVec3| (all.min - from).abs().max((all.max - from).abs()).max_element();
        let smallest = shapes
            .iter()
            .map(|b| (b.max - b.min).max_element())
            .filter(|&size| size > 0.0)
            .fold(f64::INFINITY, f64::min);
        let middle = middle(&shapes);
        let distance = middle.abs().max_element();
        let moves = distance > LEAST_GAIN * reach(middle) && distance > NEAR * smallest;
        let origin = if moves { middle } else { DVec3::ZERO };
        let extent = reach(origin);
        let exponent = if extent > 0.0 { extent.log2().floor() as i32 } else { 0 };
        let target = match exponent {
            e if e < UNSCALED[0] => SCALED[0],
            e if e > UNSCALED[1] => SCALED[1],
            e => e,
        };
        Self { origin, scale: f64::from(target - exponent).exp2() }
    }

    /// Whether it is the world.
    pub fn is_world(&self) -> bool {
        *self == Self::WORLD
    }

    /// Its units for a world unit, a power of two.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The map from the world.
    pub fn from_world(&self) -> DAffine3 {
        DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(self.scale)), translation: -self.scale * self.origin }
    }

    /// The map to the world.
    pub fn to_world(&self) -> DAffine3 {
        DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(1.0 / self.scale)), translation: self.origin }
    }

    /// Where a world point is.
    pub fn point(&self, world: DVec3) -> DVec3 {
        (world - self.origin) * self.scale
    }

    /// The world point that is at `p`.
    #[inline]
    pub fn world_point(&self, p: DVec3) -> DVec3 {
        if self.is_world() { p } else { p / self.scale + self.origin }
    }

    /// The length in world units.
    #[inline]
    pub fn world_length(&self, length: f64) -> f64 {
        length / self.scale
    }

    /// A map to the world, as one to this space. The translation is exact to the last bits of the difference.
    #[must_use]
    pub fn place(&self, world_from_object: &DAffine3) -> DAffine3 {
        DAffine3 {
            matrix3: world_from_object.matrix3 * self.scale,
            translation: self.point(world_from_object.translation),
        }
    }

    /// A rotation and translation to the world, as one to this space.
    #[must_use]
    pub fn place_rigid(&self, world_from_object: &DAffine3) -> DAffine3 {
        DAffine3 { matrix3: world_from_object.matrix3, translation: self.point(world_from_object.translation) }
    }

    /// A motion in the world, as one in this space.
    #[must_use]
    pub fn place_motion(&self, world_from_object: &Motion) -> Motion {
        if self.is_world() {
            world_from_object.clone()
        } else {
            Motion::constant(self.from_world()).after(world_from_object)
        }
    }

    /// The map that undoes a scale.
    pub fn unscaling(scale: f64) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(1.0 / scale))
    }

    /// A motion of what is within this space of its own, as one of what is in the space around it.
    #[must_use]
    pub fn place_within(&self, motion: &Motion) -> Motion {
        if self.is_world() { motion.clone() } else { motion.after(&Motion::constant(self.to_world())) }
    }
}

/// The median of the middles, rounded to `f32` so that differences to it lose nothing: a few shapes far away do not
/// move it.
fn middle(shapes: &[&Bounds]) -> DVec3 {
    let axis = |i: usize| {
        let mut middles: Vec<f64> = shapes.iter().map(|b| 0.5 * b.min[i] + 0.5 * b.max[i]).collect();
        let half = middles.len() / 2;
        let (_, median, _) = middles.select_nth_unstable_by(half, f64::total_cmp);
        let rounded = f64::from(*median as f32);
        if rounded.is_finite() { rounded } else { *median }
    };
    DVec3::new(axis(0), axis(1), axis(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(middle: DVec3, half: f64) -> Bounds {
        Bounds { min: middle - half, max: middle + half }
    }

    #[test]
    fn ordinary_scenes_stay_in_the_world() {
        let at = DVec3::new(10.0, 0.0, -3.0);
        for shapes in [
            vec![],
            vec![Bounds::EMPTY],
            vec![cube(DVec3::ZERO, 1.0)],
            vec![cube(at, 1e-5), cube(DVec3::ZERO, 1e8)],
            vec![cube(at * 1e3, 10.0)],
            vec![cube(at * 1e6, 0.5), cube(DVec3::ZERO, 0.5)],
            vec![cube(DVec3::ZERO, 1.0), cube(DVec3::new(0.0, -6.4e6, 0.0), 6.4e6)],
        ] {
            assert!(RenderSpace::around(&shapes).is_world(), "{shapes:?}");
        }
    }

    #[test]
    fn small_and_large_scenes_are_scaled_by_powers_of_two() {
        for (half, extent) in [(1e-13, 1.0), (3e-8, 1.0), (1e13, 1_048_576.0), (1e25, 1_048_576.0)] {
            let space = RenderSpace::around(&[cube(DVec3::ZERO, half)]);
            let scaled = space.point(DVec3::splat(half)).x;
            assert!(scaled >= extent && scaled < 2.0 * extent, "{half}: {scaled}");
            assert_eq!(space.scale().log2().fract(), 0.0);
            assert_eq!(space.world_point(DVec3::splat(scaled)), DVec3::splat(half));
            assert_eq!(space.world_length(scaled), half);
        }
    }

    #[test]
    fn scenes_far_away_are_moved_to_most_of_their_shapes() {
        let far = DVec3::new(5e6, 123_456.7, -2e6);
        let shapes =
            [cube(far, 1.0), cube(far + 0.25, 0.1), cube(far - 0.5, 0.1), cube(far + DVec3::new(1e5, 0.0, 0.0), 1e3)];
        let space = RenderSpace::around(&shapes);
        assert!(space.point(far).abs().max_element() < 1.0 && space.scale() == 1.0, "{space:?}");
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::splat(2.0),
            super::super::DQuat::from_rotation_x(0.3),
            far,
        );
        let p = DVec3::new(0.3, -0.2, 1.0);
        let placed = space.place(&map).transform_point3(p);
        assert!((space.world_point(placed) - map.transform_point3(p)).length() < 1e-8);
        assert!(((space.to_world() * space.from_world()).transform_point3(far) - far).length() < 1e-8);
    }
}
