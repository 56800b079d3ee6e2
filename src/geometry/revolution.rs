//! Surfaces of revolution.
//!
//! Object space: a profile curve in the xy plane, where x is the distance from the axis, turned about +y;
//! `0 <= phi <= phi_max` with phi from +z towards +x. A profile that runs towards +y has normals outward; the normal is
//! on the right of the profile's direction.
//!
//! `uv = (phi / phi_max, v)` with `v = (segment + s) / segments` of the parameter `s` within the profile's segment, or
//! by height or arc length.
//!
//! Inside this module everything turns about z: `(x, y, z)` is the object's `(z, x, y)`, and heights are measured from
//! the middle of the profile.

mod along;
mod density;
mod segment;
mod solve;
#[cfg(test)]
mod tests;

pub use self::along::ProfileParameter;

use self::along::{Along, Parameter};
use self::density::{Density, ProfileSample, area_per_radian};
use self::segment::Segment;
use super::sector::{Sector, direction_from_axis};
use super::{LocalHit, LocalSurface, Profile, ShapeError, ShapeSample};
use crate::math::{Bounds, DVec2, DVec3, RayF64, dvec2, dvec3};

/// A profile curve turned about the y axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Revolution {
    segments: Vec<Segment>,
    sector: Sector,
    /// The height that counts as zero inside.
    middle: f64,
    /// A bound of the coordinates of the segments.
    size: f64,
    density: Density,
    area: f64,
    along: Along,
}

impl Revolution {
    /// The surface of a profile turned by `phi_max` radians.
    ///
    /// # Errors
    /// If the profile crosses the axis, has no length or lies on the axis, or `phi_max` is not in `(0, 2 pi]`.
    pub fn new(profile: &Profile, phi_max: f64) -> Result<Self, ShapeError> {
        let sector = Sector::new(phi_max)?;
        let points = || profile.segments().iter().flatten();
        let (low, high) =
            points().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.y), high.max(p.y)));
        let middle = 0.5 * low + 0.5 * high;
        let size = points().fold(0.5 * (high - low), |size, p| size.max(p.x.abs()));
        let segments: Vec<Segment> =
            profile.segments().iter().map(|control| Segment::new(&control.map(|p| dvec2(p.x, p.y - middle)))).collect();
        for (i, segment) in segments.iter().enumerate() {
            // Touching the axis may come out a rounding below it.
            if segment.r_range.min < -8.0 * f64::EPSILON * size {
                return Err(ShapeError::ProfileNegative { segment: i, x: segment.r_range.min });
            }
        }
        let area = sector.phi_max() * area_per_radian(&segments);
        let density = Density::new(&segments);
        if !(area > 0.0 && area.is_finite()) {
            return Err(ShapeError::ProfileEmpty);
        }
        Ok(Self { segments, sector, middle, size, density, area, along: Along::Curve })
    }

    /// The same surface with another v.
    ///
    /// # Errors
    /// If v is the height of a profile that is level.
    pub fn with_parameter(self, parameter: ProfileParameter) -> Result<Self, ShapeError> {
        let along = Along::new(&self.segments, parameter)?;
        Ok(Self { along, ..self })
    }

    /// Whether all angles are kept.
    pub fn is_full_turn(&self) -> bool {
        self.sector.is_full()
    }

    /// Circles about the y axis, as radius and height, whose hull holds the whole surface.
    pub fn rims(&self) -> impl Iterator<Item = [f64; 2]> {
        let slack = 4.0 * f64::EPSILON * self.size;
        let rims = move |s: &Segment| {
            [s.z_range.min - slack, s.z_range.max + slack].map(|z| [s.r_range.max + slack, z + self.middle])
        };
        self.segments.iter().flat_map(rims)
    }

    /// The first hit within the ray's interval.
    #[inline]
    pub fn intersect(&self, ray: &RayF64) -> Option<LocalHit> {
        let (o, d) = (ray.origin, ray.direction);
        let turned = RayF64 { origin: dvec3(o.z, o.x, o.y - self.middle), direction: dvec3(d.z, d.x, d.y), ..*ray };
        solve::intersect(&self.segments, &self.sector, self.size, &turned)
    }

    /// The surface at a hit of `ray`. Where the profile stands still, the normal is the limit along the profile.
    pub fn surface(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        let raw = ray.at(hit.t);
        let toward = direction_from_axis(raw.z, raw.x);
        let at = self.locate(hit.profile);
        let p = self.point(at, toward);
        let Parameter { v, change } = self.along.at(&self.segments, at);
        LocalSurface {
            p,
            n: self.normal(at, toward),
            dp_du: dvec3(p.z, 0.0, -p.x) * self.sector.phi_max(),
            dp_dv: dvec3(change.x * toward.y, change.y, change.x * toward.x),
            uv: [self.sector.fraction(raw.z, raw.x), v],
            pdf_area: self.pdf_area(at),
        }
    }

    fn locate(&self, profile: f64) -> ProfileSample {
        let segment = (profile.max(0.0) as usize).min(self.segments.len() - 1);
        ProfileSample { segment, s: (profile - segment as f64).clamp(0.0, 1.0) }
    }

    /// The point at a parameter, in the direction (towards +z, towards +x) from the axis.
    fn point(&self, at: ProfileSample, toward: DVec2) -> DVec3 {
        let segment = &self.segments[at.segment];
        let r = segment.r.value(at.s).max(0.0);
        dvec3(r * toward.y, segment.z.value(at.s) + self.middle, r * toward.x)
    }

    fn normal(&self, at: ProfileSample, toward: DVec2) -> DVec3 {
        let tangent = self.segments[at.segment].tangent(at.s);
        dvec3(tangent.y * toward.y, -tangent.x, tangent.y * toward.x)
    }

    fn pdf_area(&self, at: ProfileSample) -> f64 {
        self.density.pdf_area(&self.segments, at, self.sector.phi_max()).unwrap_or(1.0 / self.area)
    }

    /// Exact bounds, up to a rounding.
    pub fn bounds(&self) -> Bounds {
        let start = (f64::INFINITY, 0f64, f64::INFINITY, f64::NEG_INFINITY);
        let (inner, outer, low, high) = self.segments.iter().fold(start, |(inner, outer, low, high), s| {
            (inner.min(s.r_range.min), outer.max(s.r_range.max), low.min(s.z_range.min), high.max(s.z_range.max))
        });
        let slack = 4.0 * f64::EPSILON * self.size;
        let ring = self.sector.bounds((inner - slack).max(0.0), outer + slack);
        let (low, high) = (low - slack + self.middle, high + slack + self.middle);
        Bounds { min: dvec3(ring.min.y, low, ring.min.x), max: dvec3(ring.max.y, high, ring.max.x) }
    }

    /// Surface area.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The profile parameter, `segment + s`, of the point that [`sample`](Self::sample) finds with `u`.
    pub fn sampled_profile(&self, u: [f64; 2]) -> f64 {
        let at = self.density.sample(u[1]);
        at.segment as f64 + at.s
    }

    /// A point chosen nearly uniformly by area; the density is the actual one.
    pub fn sample(&self, u: [f64; 2]) -> ShapeSample {
        let at = self.density.sample(u[1]);
        let toward = self.sector.direction(u[0]);
        ShapeSample { p: self.point(at, toward), n: self.normal(at, toward), pdf_area: self.pdf_area(at) }
    }
}
