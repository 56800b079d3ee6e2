//! Cylinders, cones and frusta without caps, and their sectors: one routine for all.
//!
//! Object space: about +z between `z = 0`, where the radius is `radius`, and `z = height`, where it is `top_radius`;
//! `0 <= phi <= phi_max` with phi from +x towards +y. The normal points away from the axis.
//!
//! `uv = (phi / phi_max, z / height)`.

use super::placed::first_accepted;
use super::sector::{Sector, direction_from_axis};
use super::shape_error::{not_negative, positive};
use super::{Detail, LocalHit, LocalSurface, ShapeError, ShapeSample};
use crate::math::float::F64_CHAIN_ERROR;
use crate::math::{Bounds, DVec3, Quadratic, RayF64, difference_of_products, dvec3, quadratic_roots};

/// The side of a cylinder, a cone or a frustum.
#[derive(Clone, Debug, PartialEq)]
pub struct Frustum {
    radius: f64,
    top_radius: f64,
    height: f64,
    sector: Sector,
    /// The height where the radius would be zero, unless that is far away.
    apex: Option<f64>,
    /// The lowest and the highest `z` that counts: an apex reaches a rounding farther.
    z_min: f64,
    z_max: f64,
    /// Length of a straight line on the surface from bottom to top.
    slant: f64,
    area: f64,
}

impl Frustum {
    /// A frustum; a `top_radius` of zero makes a cone. `phi_max` in radians.
    ///
    /// # Errors
    /// Unless the radii are finite and not negative with one above zero, the height is finite and above zero and
    /// `0 < phi_max <= 2 pi`.
    pub fn new(radius: f64, top_radius: f64, height: f64, phi_max: f64) -> Result<Self, ShapeError> {
        not_negative("radius", radius)?;
        not_negative("top radius", top_radius)?;
        positive("height", height)?;
        if radius == 0.0 && top_radius == 0.0 {
            return Err(ShapeError::NoRadius);
        }
        let sector = Sector::new(phi_max)?;
        let slant = (top_radius - radius).hypot(height);
        let area = 0.5 * sector.phi_max() * (radius + top_radius) * slant;
        let apex = if top_radius == 0.0 { height } else { height * (radius / (radius - top_radius)) };
        let is_near = (radius - top_radius).abs() >= 0.5 * radius.max(top_radius);
        let beyond = |r: f64| if r == 0.0 { F64_CHAIN_ERROR * height } else { 0.0 };
        Ok(Self {
            radius,
            top_radius,
            height,
            sector,
            apex: is_near.then_some(apex),
            z_min: -beyond(radius),
            z_max: height + beyond(top_radius),
            slant,
            area,
        })
    }

    /// A cylinder; `phi_max` in radians.
    ///
    /// # Errors
    /// Unless radius and height are finite and above zero and `0 < phi_max <= 2 pi`.
    pub fn cylinder(radius: f64, height: f64, phi_max: f64) -> Result<Self, ShapeError> {
        positive("radius", radius)?;
        Self::new(radius, radius, height, phi_max)
    }

    /// The radius at `z = 0` and at `z = height`.
    pub fn radii(&self) -> [f64; 2] {
        [self.radius, self.top_radius]
    }

    /// The height.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Whether both radii are the same.
    pub fn is_cylinder(&self) -> bool {
        self.radii()[0] == self.radii()[1]
    }

    /// Whether all angles are kept.
    pub fn is_full_turn(&self) -> bool {
        self.sector.is_full()
    }

    /// Distance of the first hit within the ray's interval; NaN on a miss.
    #[inline(always)]
    pub fn distance(&self, ray: &RayF64) -> f64 {
        let roots = self.roots(ray);
        first_accepted([roots.near, roots.far], [self.accepts(ray, roots.near), self.accepts(ray, roots.far)])
    }

    /// The clip in z also removes the other half of the double cone.
    #[inline(always)]
    fn accepts(&self, ray: &RayF64, t: f64) -> bool {
        let p = ray.at(t);
        ray.contains(t) & t.is_finite() & (self.z_min <= p.z) & (p.z <= self.z_max) & self.sector.contains(p.x, p.y)
    }

    /// Where the ray meets the whole double cone or cylinder; NaN where it does not.
    #[inline(always)]
    fn roots(&self, ray: &RayF64) -> Quadratic {
        // height² (x² + y²) = (radius * height + (top_radius - radius) z)², homogeneous in the height: nothing is
        // divided by.
        let (o, d) = (ray.origin, ray.direction);
        let spread = self.top_radius - self.radius;
        let squared = self.height * self.height;
        let a = squared * (d.x * d.x + d.y * d.y) - spread * spread * d.z * d.z;
        let Some(apex) = self.apex else {
            let q = self.radius * self.height + spread * o.z;
            let half_b = squared * (o.x * d.x + o.y * d.y) - spread * q * d.z;
            let c = squared * (o.x * o.x + o.y * o.y) - q * q;
            return quadratic_roots(a, half_b, c, difference_of_products(half_b, half_b, a, c));
        };

        // About the apex the discriminant is a form of the ray's moments. Of the coefficients only the last digits
        // would be left there, and rays from inside would pass.
        let o = dvec3(o.x, o.y, o.z - apex);
        let (spread_squared, moment) = (spread * spread, o.cross(d));
        let form = spread_squared * (moment.x * moment.x + moment.y * moment.y) - squared * moment.z * moment.z;
        let noise = F64_CHAIN_ERROR * (self.height + self.radius + self.top_radius);
        let rounding = (squared + spread_squared) * noise * noise * d.length_squared();
        let discriminant = squared * if form < 0.0 && form >= -rounding { 0.0 } else { form };
        let t_closest = -o.dot(d) / d.length_squared();
        let p = o + d * t_closest;
        let half_b = squared * (p.x * d.x + p.y * d.y) - spread_squared * p.z * d.z;
        let c = squared * (p.x * p.x + p.y * p.y) - spread_squared * p.z * p.z;
        let roots = quadratic_roots(a, half_b, c, discriminant);
        Quadratic { near: roots.near + t_closest, far: roots.far + t_closest }
    }

    /// The surface at a hit of `ray`. At an apex the normal is that of the line on the cone at the ray's own angle, or
    /// at phi = 0.
    #[inline(always)]
    pub fn surface(&self, detail: Detail, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        let raw = ray.at(hit.t);
        let toward = direction_from_axis(raw.x, raw.y);
        let z = raw.z.max(0.0).min(self.height);
        let v = z / self.height;
        let spread = self.top_radius - self.radius;
        let p = (toward * (self.radius + spread * v)).extend(z);
        let (n, pdf_area) = (self.normal(toward.x, toward.y), 1.0 / self.area);
        if detail == Detail::Position {
            return LocalSurface { p, n, pdf_area, ..LocalSurface::ZERO };
        }
        LocalSurface {
            p,
            n,
            dp_du: dvec3(-p.y, p.x, 0.0) * self.sector.phi_max(),
            dp_dv: (toward * spread).extend(self.height),
            uv: [self.sector.fraction(raw.x, raw.y), v],
            pdf_area,
        }
    }

    #[inline(always)]
    fn normal(&self, cos: f64, sin: f64) -> DVec3 {
        dvec3(self.height * cos, self.height * sin, self.radius - self.top_radius) / self.slant
    }

    /// Exact bounds.
    pub fn bounds(&self) -> Bounds {
        let ring = self.sector.bounds(self.radius.min(self.top_radius), self.radius.max(self.top_radius));
        Bounds { min: ring.min.extend(0.0), max: ring.max.extend(self.height) }
    }

    /// Surface area.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// A point distributed uniformly by area.
    #[inline(always)]
    pub fn sample(&self, u: [f64; 2]) -> ShapeSample {
        if self.is_full_turn() { self.sample_turn::<true>(u) } else { self.sample_turn::<false>(u) }
    }

    /// [`sample`](Self::sample), where it is known whether all angles are kept.
    #[inline(always)]
    pub(super) fn sample_turn<const FULL: bool>(&self, u: [f64; 2]) -> ShapeSample {
        // The density along the side is proportional to the radius; inverted without dividing by the difference of the
        // radii.
        let (bottom, top) = (self.radius, self.top_radius);
        let radius = (bottom * bottom + u[1] * (top * top - bottom * bottom)).max(0.0).sqrt();
        let sum = bottom + radius;
        let v = if sum > 0.0 { (u[1] * (bottom + top) / sum).min(1.0) } else { 0.0 };
        let toward = self.sector.direction_of::<FULL>(u[0]);
        ShapeSample {
            p: (toward * (bottom + (top - bottom) * v)).extend(v * self.height),
            n: self.normal(toward.x, toward.y),
            pdf_area: 1.0 / self.area,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: DVec3, direction: DVec3) -> RayF64 {
        RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    #[test]
    fn parameters_that_make_no_frustum_are_refused() {
        assert_eq!(Frustum::new(0.0, 0.0, 1.0, 1.0), Err(ShapeError::NoRadius));
        assert!(Frustum::new(1.0, -0.5, 1.0, 1.0).is_err());
        assert!(Frustum::new(1.0, 0.5, 0.0, 1.0).is_err());
        assert!(Frustum::new(1.0, f64::INFINITY, 1.0, 1.0).is_err());
        assert!(Frustum::cylinder(0.0, 1.0, 1.0).is_err());
        assert!(Frustum::new(0.0, 0.5, 1.0, 1.0).is_ok(), "a cone that stands on its apex");
    }

    #[test]
    fn a_ray_parallel_to_the_axis_of_a_cylinder_misses_without_a_nan() {
        let cylinder = Frustum::cylinder(1.0, 2.0, 6.0).unwrap();
        for x in [0.0, -0.0, 0.3, 1.0, 2.0] {
            for dx in [0.0, -0.0] {
                assert!(cylinder.distance(&ray(dvec3(x, 0.0, -1.0), dvec3(dx, -dx, 1.0))).is_nan(), "{x}");
            }
        }
        assert!(cylinder.distance(&ray(DVec3::ZERO, DVec3::ZERO)).is_nan());
    }

    #[test]
    fn a_cone_has_a_normal_at_its_apex() {
        let cone = Frustum::new(1.0, 0.0, 2.0, 6.0).unwrap();
        for direction in [DVec3::X, DVec3::Y, dvec3(1.0, 0.2, -0.1)] {
            let r = ray(dvec3(0.0, 0.0, 2.0) - 3.0 * direction, direction);
            let hit = LocalHit { t: 3.0, profile: 0.0 };
            let s = cone.surface(Detail::Full, &r, &hit);
            assert!((s.n.length() - 1.0).abs() < 1e-15 && s.p.is_finite() && s.dp_dv.is_finite(), "{s:?}");
            assert!((0.0..=1.0).contains(&s.uv[0]) && s.uv[1] > 1.0 - 1e-14);
        }
    }

    #[test]
    fn the_other_half_of_the_double_cone_is_not_hit() {
        let cone = Frustum::new(1.0, 0.0, 1.0, 6.2).unwrap();
        assert!(cone.distance(&ray(dvec3(-3.0, 0.1, 1.5), DVec3::X)).is_nan());
        let t = cone.distance(&ray(dvec3(-3.0, 0.0, 0.5), DVec3::X));
        assert!((t - 2.5).abs() < 1e-15);
        // Parallel to a line on the cone: one root is infinite.
        let t = cone.distance(&ray(dvec3(2.0, 0.0, -2.0), dvec3(-1.0, 0.0, 1.0)));
        assert!((t - 2.5).abs() < 1e-15);
    }
}
