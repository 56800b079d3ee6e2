//! Orthonormal frames around a normal.

use super::Vec3;

/// A right-handed orthonormal frame; `z` is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// Normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around the unit normal `n` (Duff et al., "Building an Orthonormal Basis, Revisited").
    #[inline(always)]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            x: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            y: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            z: n,
        }
    }

    /// A frame around the unit normal `n` whose `x` is `tangent` without its part along `n`; any frame if nothing is
    /// left of it.
    #[inline(always)]
    pub fn from_normal_and_tangent(n: Vec3, tangent: Vec3) -> Self {
        let across = tangent - n * n.dot(tangent);
        let length_squared = across.length_squared();
        // Written so that a NaN takes the fallback too.
        if !(length_squared > 1e-12 * tangent.length_squared()) {
            return Self::from_normal(n);
        }
        let x = across / length_squared.sqrt();
        Self { x, y: n.cross(x), z: n }
    }

    /// Components of a world vector in this frame.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// The world vector with components `v` in this frame.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let normals = [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.6, 0.0, -0.8), Vec3::new(1e-4, 0.0, -1.0).normalize()];
        for n in normals {
            for f in [
                Frame::from_normal(n),
                Frame::from_normal_and_tangent(n, Vec3::new(0.3, 1.0, 0.2)),
                Frame::from_normal_and_tangent(n, n),
            ] {
                assert!(f.x.dot(f.y).abs() < 1e-6 && f.y.dot(f.z).abs() < 1e-6 && f.z.dot(f.x).abs() < 1e-6, "{f:?}");
                assert!((f.x.length() - 1.0).abs() < 1e-6 && (f.y.length() - 1.0).abs() < 1e-6);
                assert!((f.x.cross(f.y) - f.z).length() < 1e-6, "{f:?}");
            }
        }
    }
}
