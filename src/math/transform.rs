//! Invertible affine maps in `f64`.

use super::{DAffine3, DMat3, DVec3};

/// An affine map with its inverse. Names are destination first: `world_from_object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Object to world.
    pub world_from_object: DAffine3,
    /// World to object.
    pub object_from_world: DAffine3,
    /// Transpose of the inverse's linear part: maps normals.
    normal_matrix: DMat3,
    /// Of the linear part of object to world; its sign is the handedness, its magnitude the change of volume.
    determinant: f64,
}

impl Transform {
    /// The map that changes nothing.
    pub const IDENTITY: Self = Self {
        world_from_object: DAffine3::IDENTITY,
        object_from_world: DAffine3::IDENTITY,
        normal_matrix: DMat3::IDENTITY,
        determinant: 1.0,
    };

    /// From object-to-world; `None` if the map is not finite or (numerically) singular.
    pub fn new(world_from_object: DAffine3) -> Option<Self> {
        if !world_from_object.is_finite() {
            return None;
        }
        let m = &world_from_object.matrix3;
        let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        // The determinant relative to the axes' lengths does not depend on scale.
        let determinant = m.determinant();
        let is_regular = determinant.abs() > 1e-12 * volume && volume > 0.0;
        if !is_regular {
            return None;
        }
        let object_from_world = world_from_object.inverse();
        if !object_from_world.is_finite() {
            return None;
        }
        let normal_matrix = object_from_world.matrix3.transpose();
        Some(Self { world_from_object, object_from_world, normal_matrix, determinant })
    }

    /// The map of a translation.
    pub fn from_translation(offset: DVec3) -> Self {
        Self {
            world_from_object: DAffine3::from_translation(offset),
            object_from_world: DAffine3::from_translation(-offset),
            normal_matrix: DMat3::IDENTITY,
            determinant: 1.0,
        }
    }

    /// A point from object to world.
    #[inline(always)]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.world_from_object.transform_point3(p)
    }

    /// A vector from object to world.
    #[inline(always)]
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.world_from_object.transform_vector3(v)
    }

    /// A normal from object to world, by the inverse transpose; not normalised.
    #[inline(always)]
    pub fn normal(&self, n: DVec3) -> DVec3 {
        self.normal_matrix * n
    }

    /// A point from world to object.
    #[inline]
    pub fn inverse_point(&self, p: DVec3) -> DVec3 {
        self.object_from_world.transform_point3(p)
    }

    /// A vector from world to object.
    #[inline(always)]
    pub fn inverse_vector(&self, v: DVec3) -> DVec3 {
        self.object_from_world.transform_vector3(v)
    }

    /// Whether the map turns a right-handed frame into a left-handed one.
    pub fn swaps_handedness(&self) -> bool {
        self.determinant < 0.0
    }

    /// The scale factor if the map is a rotation (or reflection), a uniform scale and a translation; `None` otherwise.
    pub fn uniform_scale(&self) -> Option<f64> {
        let m = &self.world_from_object.matrix3;
        let lengths = [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()];
        let scale = lengths[0];
        let equal = lengths.iter().all(|l| (l - scale).abs() <= 1e-9 * scale);
        let orthogonal = [m.x_axis.dot(m.y_axis), m.y_axis.dot(m.z_axis), m.z_axis.dot(m.x_axis)]
            .iter()
            .all(|d| d.abs() <= 1e-9 * scale * scale);
        (equal && orthogonal).then_some(scale)
    }

    /// By how much the map changes volume; negative if it swaps handedness.
    #[inline(always)]
    pub fn determinant(&self) -> f64 {
        self.determinant
    }

    /// By how much the map stretches area on a surface with the unit object normal `n`: dA_world / dA_object = |det
    /// M| |M^-T n|.
    #[inline]
    pub fn area_factor(&self, n: DVec3) -> f64 {
        self.determinant.abs() * self.normal(n).length()
    }

    /// This map after `inner`: first `inner`, then `self`. `None` if the product is singular.
    pub fn after(&self, inner: &Self) -> Option<Self> {
        Self::new(self.world_from_object * inner.world_from_object)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn singular_and_infinite_maps_are_refused() {
        assert!(Transform::new(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(Transform::new(DAffine3::from_translation(DVec3::new(f64::NAN, 0.0, 0.0))).is_none());
        assert!(Transform::new(DAffine3::from_scale(DVec3::splat(1e-9))).is_some());
    }

    #[test]
    fn normals_stay_perpendicular_under_shear() {
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::new(0.0, 0.3, 2.0));
        let t = Transform::new(DAffine3 { matrix3: shear, translation: DVec3::ONE }).unwrap();
        let (a, b) = (DVec3::new(1.0, 2.0, 0.5), DVec3::new(-0.3, 0.4, 1.0));
        let n = t.normal(a.cross(b));
        assert!(n.dot(t.vector(a)).abs() < 1e-12 && n.dot(t.vector(b)).abs() < 1e-12);
        let area = t.vector(a).cross(t.vector(b)).length() / a.cross(b).length();
        assert!((t.area_factor(a.cross(b).normalize()) - area).abs() < 1e-12 * area);
    }

    #[test]
    fn a_uniform_scale_is_recognised() {
        let t = Transform::new(DAffine3::from_rotation_x(0.3) * DAffine3::from_scale(DVec3::splat(2.5))).unwrap();
        assert!((t.uniform_scale().unwrap() - 2.5).abs() < 1e-12);
        assert!(Transform::new(DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.1))).unwrap().uniform_scale().is_none());
    }
}
