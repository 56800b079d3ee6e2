//! The one triangle test that all own accelerators share: watertight, with edge functions in `f64`.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection": shear the ray onto the axis where its direction is
//! largest; the signs of three edge functions decide. Shared edges are computed from the same numbers in both
//! triangles, so no ray passes between them.

use crate::math::float::UNIT_ROUNDOFF;
use crate::math::rows::soa;
use crate::math::{Aabb, DVec3, Ray, Vec3};
use crate::sampling::warp;

/// The corners of one triangle. The front is where they appear counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrianglePoints {
    /// First corner.
    pub a: Vec3,
    /// Second corner.
    pub b: Vec3,
    /// Third corner.
    pub c: Vec3,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// Where a ray meets the plane of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct TriangleIntersection {
    /// The point.
    pub p: DVec3,
    /// Distance in units of the ray's direction; only a hit if it is [valid](Self::is_valid).
    pub t: f64,
    /// Unit geometric normal, towards the front.
    pub n_g: Vec3,
    /// As [`SurfaceInteraction::error`](super::SurfaceInteraction::error), for a triangle at rest.
    pub error: f32,
    /// Twice the triangle's area.
    pub double_area: f64,
}

impl TriangleIntersection {
    /// Whether the distance is positive and finite: else the hit was a rounding artefact.
    #[inline(always)]
    pub fn is_valid(&self) -> bool {
        self.t > 0.0 && self.t < f64::INFINITY
    }
}

/// A point chosen uniformly on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleSample {
    /// The point.
    pub p: DVec3,
    /// Unit geometric normal.
    pub n: Vec3,
    /// Density with respect to area.
    pub pdf_area: f64,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

impl TrianglePoints {
    /// Tight bounds.
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.a.min(self.b).min(self.c), max: self.a.max(self.b).max(self.c) }
    }

    /// Where a ray meets the plane of the triangle, in `f64`.
    #[inline(always)]
    pub fn intersect_plane(&self, origin: Vec3, direction: Vec3) -> TriangleIntersection {
        let cross = self.cross();
        let t = cross.dot(self.a.as_dvec3() - origin.as_dvec3()) / cross.dot(direction.as_dvec3());
        let p = origin.as_dvec3() + direction.as_dvec3() * t;
        let double_area = cross.length();
        let n_g = (cross / double_area).as_vec3();
        // Embree subtracts the origin from the corners and forms the normal in f32: 4 units of roundoff of the extent
        // seen from here.
        let p32 = p.as_vec3();
        let reach = (self.a - p32).abs().max((self.b - p32).abs()).max((self.c - p32).abs());
        TriangleIntersection { p, t, n_g, error: 4.0 * UNIT_ROUNDOFF as f32 * reach.max_element(), double_area }
    }

    /// Twice the area times the normal, in `f64`.
    #[inline(always)]
    pub fn cross(&self) -> DVec3 {
        let a = self.a.as_dvec3();
        (self.b.as_dvec3() - a).cross(self.c.as_dvec3() - a)
    }

    /// The inverse sine of the angle between the two shortest edges, at least 1: a normal computed from them in `f32`
    /// is off by this many units of roundoff.
    pub fn flatness(&self) -> f64 {
        let [a, b, c] = [self.a, self.b, self.c].map(Vec3::as_dvec3);
        let [ab, bc, ca] = [b - a, c - b, a - c].map(DVec3::length);
        (ab * bc).min(bc * ca).min(ca * ab) / self.cross().length()
    }

    /// Whether the triangle is so flat that rays which leave it may be found to hit it in `f32`, although they start
    /// where they should.
    pub fn is_sliver(&self) -> bool {
        // The offset of rays is 4 units of roundoff of the extent; without an area there is nothing to hit.
        let flatness = self.flatness();
        flatness > 4.0 && flatness < f64::INFINITY
    }

    /// Area.
    pub fn area(&self) -> f64 {
        0.5 * self.cross().length()
    }

    /// The hit within the ray's interval, with either side up.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<TriangleHit> {
        TriangleRay::from(ray).intersect(self)
    }

    /// A point distributed uniformly by area; `u` in the unit square. `None` if the triangle has no area.
    pub fn sample(&self, u: [f32; 2]) -> Option<TriangleSample> {
        let cross = self.cross();
        let double_area = cross.length();
        if !(double_area > 0.0) {
            return None;
        }
        let [b0, b1] = warp::uniform_triangle(u);
        let b2 = (1.0 - b0 - b1).max(0.0);
        let p = self.a.as_dvec3() * b2 + self.b.as_dvec3() * b0 + self.c.as_dvec3() * b1;
        let n = (cross / double_area).as_vec3();
        Some(TriangleSample { p, n, pdf_area: 2.0 / double_area, u: b0 as f32, v: b1 as f32 })
    }
}

soa! {
    /// The shear that puts a ray's direction onto the axis `kz` along which it is largest; `kx` and `ky` are the axes
    /// after it, in cyclic order.
    pub struct ShearRows of Shear {
        /// The direction's component along `kx` over that along `kz`.
        sx: f64,
        /// The direction's component along `ky` over that along `kz`.
        sy: f64,
        /// The direction's component along `kz`.
        dz: f64,
        /// Where `t = 0`: along `kx`, `ky` and `kz`.
        origin: DVec3,
    }
}

impl Shear {
    /// The shear of a ray along this `kz`.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3, kz: u32) -> Self {
        let [x, y, dz] = permuted(direction, kz).map(f64::from);
        Self { sx: x / dz, sy: y / dz, dz, origin: permuted(origin, kz).map(f64::from).into() }
    }

    /// The edge functions of a triangle with these corners, whose coordinates are along `kx`, `ky` and `kz`.
    #[inline(always)]
    pub fn edges(&self, corners: [DVec3; 3]) -> EdgeFunctions {
        // Corners relative to the origin (exact differences of f32 up to one rounding), sheared.
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            DVec3::new(p.x - self.sx * p.z, p.y - self.sy * p.z, p.z)
        });
        let (u, v, w) = (c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        EdgeFunctions { u, v, w, z: [a.z, b.z, c.z] }
    }
}

/// The edge functions of a triangle for a ray on the axis `kz`: twice the areas that two corners each span with it.
#[derive(Clone, Copy, Debug)]
pub struct EdgeFunctions {
    /// Opposite to the first corner.
    pub u: f64,
    /// Opposite to the second corner.
    pub v: f64,
    /// Opposite to the third corner.
    pub w: f64,
    /// Of the corners, relative to the origin of the ray.
    z: [f64; 3],
}

impl EdgeFunctions {
    /// Whether the ray misses the triangle. A point on an edge belongs to both neighbours.
    #[inline(always)]
    pub fn is_outside(&self) -> bool {
        let Self { u, v, w, .. } = *self;
        ((u < 0.0) | (v < 0.0) | (w < 0.0)) & ((u > 0.0) | (v > 0.0) | (w > 0.0))
    }

    /// The sum, which the barycentric coordinates are fractions of; zero where the ray is parallel to the triangle.
    #[inline(always)]
    pub fn determinant(&self) -> f64 {
        self.u + self.v + self.w
    }

    /// The distance to the plane of the triangle, in units of a direction whose component along `kz` is `dz`.
    #[inline(always)]
    pub fn distance(&self, dz: f64) -> f64 {
        let [a, b, c] = self.z;
        (self.u * a + self.v * b + self.w * c) / (self.determinant() * dz)
    }
}

/// The axis along which a direction is largest.
#[inline(always)]
pub fn largest_axis(direction: Vec3) -> u32 {
    let size = direction.abs();
    let of_others = if size.y > size.z { 1 } else { 2 };
    if (size.x > size.y) & (size.x > size.z) { 0 } else { of_others }
}

/// The components along `kx`, `ky` and `kz`, without branches.
#[inline(always)]
fn permuted(v: Vec3, kz: u32) -> [f32; 3] {
    let choose = |of_0, of_1, of_2| {
        let of_others = if kz == 1 { of_1 } else { of_2 };
        if kz == 0 { of_0 } else { of_others }
    };
    [choose(v.y, v.z, v.x), choose(v.z, v.x, v.y), choose(v.x, v.y, v.z)]
}

/// A ray prepared for many triangles.
#[derive(Clone, Copy, Debug)]
pub struct TriangleRay {
    /// The axis along which the direction is largest.
    pub kz: u32,
    /// How the ray is put onto that axis.
    pub shear: Shear,
    /// Smallest accepted `t`, inclusive.
    pub t_min: f64,
    /// Largest accepted `t`, inclusive.
    pub t_max: f64,
}

impl From<&Ray> for TriangleRay {
    #[inline]
    fn from(ray: &Ray) -> Self {
        let kz = largest_axis(ray.direction);
        let shear = Shear::new(ray.origin, ray.direction, kz);
        Self { kz, shear, t_min: ray.t_min.into(), t_max: ray.t_max.into() }
    }
}

impl TriangleRay {
    /// The axes `kx`, `ky` and `kz`.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
        AXES[(self.kz as usize).min(2)]
    }

    /// The hit within the ray's interval, with either side up.
    #[inline]
    pub fn intersect(&self, triangle: &TrianglePoints) -> Option<TriangleHit> {
        let corner = |p: Vec3| DVec3::from(permuted(p, self.kz).map(f64::from));
        let edges = self.shear.edges([corner(triangle.a), corner(triangle.b), corner(triangle.c)]);
        let determinant = edges.determinant();
        if edges.is_outside() || determinant == 0.0 {
            return None;
        }
        let t = edges.distance(self.shear.dz);
        let contained = self.t_min <= t && t <= self.t_max;
        contained.then(|| TriangleHit {
            t: t as f32,
            u: (edges.v / determinant) as f32,
            v: (edges.w / determinant) as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    const UNIT: TrianglePoints = TrianglePoints { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };

    #[test]
    fn hits_have_the_right_distance_and_weights() {
        let hit = UNIT.intersect(&Ray::new(Vec3::new(0.25, 0.5, -2.0), Vec3::new(0.0, 0.0, 0.5))).unwrap();
        assert_eq!(hit, TriangleHit { t: 4.0, u: 0.25, v: 0.5 });
    }

    #[test]
    fn parallel_and_outside_rays_miss() {
        assert!(UNIT.intersect(&Ray::new(Vec3::new(-1.0, 0.2, 0.0), Vec3::X)).is_none());
        assert!(UNIT.intersect(&Ray::new(Vec3::new(0.6, 0.6, 1.0), -Vec3::Z)).is_none());
        assert!(UNIT.intersect(&Ray { t_max: 0.999, ..Ray::new(Vec3::new(0.2, 0.2, 1.0), -Vec3::Z) }).is_none());
    }

    #[test]
    fn slivers_are_flat_and_needles_are_not() {
        let with_tip = |x: f32, y: f32| TrianglePoints { c: Vec3::new(x, y, 0.0), ..UNIT };
        assert!((UNIT.flatness() - 1.0).abs() < 1e-12 && !UNIT.is_sliver());
        assert!(with_tip(0.5, 0.01).is_sliver() && (with_tip(0.5, 0.01).flatness() / 25.01 - 1.0).abs() < 1e-6);
        assert!(!with_tip(0.0, 0.01).is_sliver());
        // Nothing to hit.
        assert!(!with_tip(0.5, 0.0).is_sliver() && !with_tip(0.0, 0.0).is_sliver());
    }

    #[test]
    fn samples_lie_inside() {
        for i in 0..1000 {
            let u = [(i as f32 * 0.618_034) % 1.0, i as f32 / 1000.0];
            let s = UNIT.sample(u).unwrap();
            assert!(s.p.x >= 0.0 && s.p.y >= 0.0 && s.p.x + s.p.y <= 1.0 + 1e-12 && s.p.z == 0.0);
            assert!((s.p.x - f64::from(s.u)).abs() < 1e-7 && (s.p.y - f64::from(s.v)).abs() < 1e-7);
            assert_eq!(s.pdf_area, 2.0);
        }
    }

    #[test]
    fn sides_of_edges_are_those_of_exact_predicates() {
        let mut rng = Rng::new(21);
        let exact = |p: DVec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
        let (mut hits, mut misses) = (0, 0);
        for i in 0..200_000 {
            let mut point = |reach: f64| (rng.cube() * reach).as_vec3();
            let [a, b, c] = [(); 3].map(|()| point(1.0));
            let origin = point(if i % 2 == 0 { 4.0 } else { 1e4 });
            // At a point of an edge, up to the rounding of the direction.
            let target = a.as_dvec3().lerp(b.as_dvec3(), rng.unit());
            let ray = Ray::new(origin, (target - origin.as_dvec3()).as_vec3());
            // The sum of two f32 of about one size is exact in f64.
            let [from, to] = [ray.origin.as_dvec3(), ray.origin.as_dvec3() + ray.direction.as_dvec3()].map(exact);
            let side = |p: Vec3, q: Vec3| robust::orient3d(from, to, exact(p.as_dvec3()), exact(q.as_dvec3()));
            let sides = [side(b, c), side(c, a), side(a, b)];
            let hit = TrianglePoints { a, b, c }.intersect(&ray).is_some();
            if sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0) {
                hits += 1;
                assert!(hit, "{ray:?} {a} {b} {c} {sides:?}");
            } else if sides.iter().any(|s| *s > 0.0) && sides.iter().any(|s| *s < 0.0) {
                misses += 1;
                assert!(!hit, "{ray:?} {a} {b} {c} {sides:?}");
            }
        }
        assert!(hits > 50_000 && misses > 50_000, "{hits} {misses}");
    }
}
