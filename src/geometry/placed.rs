//! Analytic surfaces and their placement.
//!
//! Contract of every analytic shape, all in its own space and in `f64`: `intersect` gives the first hit within the
//! ray's interval that passes the clips; `surface` gives the reprojected point, unit normal, derivatives and uv there;
//! `bounds` and `area` are those of the clipped part; `sample` covers exactly that part and `pdf_area` is its density.
//!
//! Errors of an intersection are those of `f64` relative to the coordinates of the ray's origin in the shape's space.
//! [`TransformedShape`] therefore first moves the origin along the ray to the shape, so that they are relative to the
//! shape's size.

mod points;

pub use points::{WorldNormalRows, WorldPointRows, WorldSampleRows};

use super::{Detail, Disk, Frustum, Hit, Quad, Revolution, Sphere, SurfaceInteraction};
use crate::math::float::{F64_CHAIN_ERROR, UNIT_ROUNDOFF};
use crate::math::rows::{BATCH, Row};
use crate::math::vectorize::vectorize;
use crate::math::{Bounds, DAffine3, DVec3, Ray, RayF64, RayRows, Transform, Vec2, Vec3};

/// A surface given by a formula.
#[derive(Clone, Debug, PartialEq)]
pub enum Analytic {
    /// Sphere, or the part of it within z and phi limits.
    Sphere(Sphere),
    /// Parallelogram.
    Quad(Quad),
    /// Disk, ring, or a sector of either.
    Disk(Disk),
    /// Cylinder, cone or frustum without caps, or a sector.
    Frustum(Frustum),
    /// Surface of revolution.
    Revolution(Revolution),
}

/// A hit in a shape's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalHit {
    /// Distance in units of the ray's direction.
    pub t: f64,
    /// Profile parameter of a surface of revolution, `segment + s`; zero on other shapes.
    pub profile: f64,
}

/// A point of a shape in the shape's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalSurface {
    /// The point, moved exactly onto the surface.
    pub p: DVec3,
    /// Unit normal.
    pub n: DVec3,
    /// Change of the point with u.
    pub dp_du: DVec3,
    /// Change of the point with v.
    pub dp_dv: DVec3,
    /// Surface parameters, both in `[0, 1]`.
    pub uv: [f64; 2],
    /// Density of [`Analytic::sample`] here, with respect to area in the shape's own space.
    pub pdf_area: f64,
}

impl LocalSurface {
    /// All zero; as a constant, for [`Default::default`] is a call.
    pub const ZERO: Self =
        Self { p: DVec3::ZERO, n: DVec3::ZERO, dp_du: DVec3::ZERO, dp_dv: DVec3::ZERO, uv: [0.0; 2], pdf_area: 0.0 };
}

/// A point chosen on a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample {
    /// The point.
    pub p: DVec3,
    /// Unit normal.
    pub n: DVec3,
    /// Density with respect to area.
    pub pdf_area: f64,
}

macro_rules! each {
    ($self:expr, $shape:ident => $body:expr) => {
        match $self {
            Analytic::Sphere($shape) => $body,
            Analytic::Quad($shape) => $body,
            Analytic::Disk($shape) => $body,
            Analytic::Frustum($shape) => $body,
            Analytic::Revolution($shape) => $body,
        }
    };
}

impl Analytic {
    /// The first hit within the ray's interval.
    #[inline]
    pub fn intersect(&self, ray: &RayF64) -> Option<LocalHit> {
        let t = match self {
            Self::Sphere(sphere) => sphere.distance(ray),
            Self::Quad(quad) => quad.distance(ray),
            Self::Disk(disk) => disk.distance(ray),
            Self::Frustum(frustum) => frustum.distance(ray),
            Self::Revolution(revolution) => return revolution.intersect(ray),
        };
        (!t.is_nan()).then_some(LocalHit { t, profile: 0.0 })
    }

    /// The surface at a hit of `ray`.
    #[inline]
    pub fn surface(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        self.surface_with(Detail::Full, ray, hit)
    }

    /// [`surface`](Self::surface), where [`Detail::Position`] may leave parameters and derivatives zero.
    #[inline]
    pub fn surface_with(&self, detail: Detail, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        match self {
            Self::Sphere(sphere) => sphere.surface(detail, ray, hit),
            Self::Quad(quad) => quad.surface(detail, ray, hit),
            Self::Disk(disk) => disk.surface(detail, ray, hit),
            Self::Frustum(frustum) => frustum.surface(detail, ray, hit),
            Self::Revolution(revolution) => revolution.surface(ray, hit),
        }
    }

    /// Exact bounds.
    pub fn bounds(&self) -> Bounds {
        each!(self, shape => shape.bounds())
    }

    /// Surface area.
    pub fn area(&self) -> f64 {
        each!(self, shape => shape.area())
    }

    /// Surface parameters at the point `p` that [`sample`](Self::sample) finds with `u`.
    fn uv(&self, p: DVec3, u: [f64; 2]) -> [f64; 2] {
        let profile = match self {
            Self::Revolution(revolution) => revolution.sampled_profile(u),
            _ => 0.0,
        };
        let still = RayF64 { origin: p, direction: DVec3::Z, t_min: 0.0, t_max: 0.0 };
        self.surface(&still, &LocalHit { t: 0.0, profile }).uv
    }

    /// A point chosen on the surface; `u` in the unit square.
    pub fn sample(&self, u: [f64; 2]) -> ShapeSample {
        each!(self, shape => shape.sample(u))
    }
}

/// An analytic surface with its transform.
#[derive(Clone, Debug, PartialEq)]
pub struct TransformedShape {
    /// The surface in its own space.
    pub shape: Analytic,
    /// Where it stands.
    pub transform: Transform,
    /// Whether the front is the side against the shape's own normal.
    pub reverse_normal: bool,
    /// The middle of the shape in its own space, and where the transform puts it.
    center: DVec3,
    placed_center: DVec3,
    /// Bound on the error of a point of the placed surface in `f64`. Rays that start on the surface must clear it even
    /// where the coordinate along the normal is zero and rounding to `f32` gives no distance.
    error: f32,
}

/// A ray in a shape's own space whose origin is the point of the original ray near the shape's centre.
#[derive(Clone, Copy, Debug)]
struct CenteredRay {
    ray: RayF64,
    /// `t` of the original ray at the origin of this one.
    shift: f64,
}

impl TransformedShape {
    /// A surface with its transform.
    pub fn new(shape: Analytic, transform: Transform) -> Self {
        let bounds = shape.bounds();
        let center = 0.5 * bounds.min + 0.5 * bounds.max;
        let placed = bounds.transformed(&transform.world_from_object);
        let error = (F64_CHAIN_ERROR * placed.min.abs().max(placed.max.abs()).max_element()) as f32;
        Self { shape, transform, reverse_normal: false, center, placed_center: transform.point(center), error }
    }

    /// `ray` in the shape's own space, accurate relative to the size of the shape however far away the ray starts.
    #[inline(always)]
    fn centered_ray(&self, ray: &Ray) -> CenteredRay {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let from_center = origin - self.placed_center;
        // What the difference rounds off (Knuth's two-sum). Far away it is as large as what decides at a silhouette.
        let taken = origin - from_center;
        let lost = (origin - (from_center + taken)) + (taken - self.placed_center);

        // With 24 bits, the shift times the direction (also 24 bits) is exact, and the sum rounds at the size of the
        // result.
        let to_closest = -from_center.dot(direction) / direction.length_squared();
        let shift = f64::from_bits(to_closest.to_bits() & !((1 << 29) - 1));
        let near_center = (from_center + direction * shift) + lost;

        let ray = RayF64 {
            origin: self.center + self.transform.inverse_vector(near_center),
            direction: self.transform.inverse_vector(direction),
            t_min: f64::from(ray.t_min) - shift,
            t_max: f64::from(ray.t_max) - shift,
        };
        CenteredRay { ray, shift }
    }

    /// Whether [`intersect_packet`](Self::intersect_packet) decides anything: surfaces of revolution are intersected
    /// with one ray at a time.
    pub fn intersects_packets(&self) -> bool {
        !matches!(self.shape, Analytic::Revolution(_))
    }

    /// [`intersect`](Self::intersect) for the rays of a packet, side by side.
    pub fn intersect_packet(&self, rays: &RayPacket) -> PacketHits {
        vectorize!(intersect_packet(self, rays))
    }

    /// The first hit of a ray in the space the shape is placed in.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<LocalHit> {
        let CenteredRay { ray: mut local, shift } = self.centered_ray(ray);
        let mut hit = self.shape.intersect(&local)?;
        if hit.t + shift < f64::from(ray.t_min) {
            // The start of the interval is lost in the shift: a ray that steps past its own start would hit there for
            // ever.
            local.t_min = hit.t.next_up();
            hit = self.shape.intersect(&local)?;
        }
        Some(LocalHit { t: hit.t + shift, ..hit })
    }

    /// Bounds, which turn with the shape (rather than its box) where it makes a full turn; to be
    /// [padded](Bounds::padded) for an accelerator.
    pub fn bounds(&self) -> Bounds {
        let map = &self.transform.world_from_object;
        let boxed = self.shape.bounds().transformed(map);
        match &self.shape {
            // A sphere's box does not grow when it turns.
            Analytic::Sphere(sphere) if sphere.is_full() => {
                let m = map.matrix3.transpose();
                let reach = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length()) * sphere.radius();
                let center = self.transform.point(DVec3::ZERO);
                Bounds { min: center - reach, max: center + reach }
            }
            Analytic::Disk(disk) if disk.is_full_turn() => {
                circle_bounds(map, DVec3::ZERO, [DVec3::X, DVec3::Y].map(|v| v * disk.radius()))
            }
            Analytic::Frustum(frustum) if frustum.is_full_turn() => {
                let [bottom, top] = frustum.radii().map(|r| [DVec3::X * r, DVec3::Y * r]);
                let (a, b) =
                    (circle_bounds(map, DVec3::ZERO, bottom), circle_bounds(map, DVec3::Z * frustum.height(), top));
                Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }
            }
            Analytic::Revolution(revolution) if revolution.is_full_turn() => {
                let rims =
                    revolution.rims().map(|[r, y]| circle_bounds(map, DVec3::Y * y, [DVec3::Z * r, DVec3::X * r]));
                let hull =
                    rims.fold(Bounds::EMPTY, |all, b| Bounds { min: all.min.min(b.min), max: all.max.max(b.max) });
                Bounds { min: hull.min.max(boxed.min), max: hull.max.min(boxed.max) }
            }
            _ => boxed,
        }
    }

    /// The interaction for a hit of `ray`; see [`Geometry::interaction`](super::Geometry::interaction).
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Option<SurfaceInteraction> {
        self.interaction_with(Detail::Full, ray, hit)
    }

    /// [`interaction`](Self::interaction), or only the requested part of it.
    #[inline]
    pub fn interaction_with(&self, detail: Detail, ray: &Ray, hit: &Hit) -> Option<SurfaceInteraction> {
        self.interaction_and_dp_dv(detail, ray, hit).map(|(at, _)| at)
    }

    /// The points of the [interactions](Self::interaction) for hits of the first `count` rays at the distances `t`.
    pub fn resolve_rows(
        &self,
        rays: &RayRows,
        t: &[f32; BATCH],
        count: usize,
        points: &mut WorldPointRows,
        normals: &mut WorldNormalRows,
    ) {
        points::resolve(self, rays, t, count, points, normals);
    }

    /// As [`SurfaceInteraction::error`], at all points.
    #[inline]
    pub fn error(&self) -> f32 {
        self.error
    }

    /// The interaction with the change of the point with v.
    #[inline(always)]
    pub(super) fn interaction_and_dp_dv(
        &self,
        detail: Detail,
        ray: &Ray,
        hit: &Hit,
    ) -> Option<(SurfaceInteraction, Vec3)> {
        let centered = self.centered_ray(&Ray { t_max: f32::INFINITY, ..*ray });
        let local_hit = self.hit_near(hit.t, &centered)?;
        let t = local_hit.t + centered.shift;
        if t <= 0.0 {
            return None;
        }
        let surface = self.shape.surface_with(detail, &centered.ray, &local_hit);
        let placed = self.place(surface.p, surface.n, surface.pdf_area);
        let at = SurfaceInteraction {
            p: placed.p,
            t: t as f32,
            error: self.error,
            n_g: placed.n,
            n_s: placed.n,
            dp_du: self.transform.vector(surface.dp_du).as_vec3(),
            uv: Vec2::new(surface.uv[0] as f32, surface.uv[1] as f32),
            shape: hit.shape,
            prim: hit.prim,
            instance: hit.instance,
            time: ray.time,
        };
        Some((at, self.transform.vector(surface.dp_dv).as_vec3()))
    }

    /// The hit nearest to the distance `t` of the original ray. It need not be the first: the surface may have holes.
    /// It need not be exact either: on their way into an instance, accelerators move the ray in `f32`.
    #[inline]
    fn hit_near(&self, t: f32, centered: &CenteredRay) -> Option<LocalHit> {
        let mut nearest = self.shape.intersect(&centered.ray)?;
        let t = f64::from(t);
        let target = t - centered.shift;
        // A few roundings of t are no reason to look further.
        while target - nearest.t > 8.0 * UNIT_ROUNDOFF * t {
            let beyond = RayF64 { t_min: nearest.t.next_up(), ..centered.ray };
            match self.shape.intersect(&beyond) {
                Some(next) if (next.t - target).abs() < (nearest.t - target).abs() => nearest = next,
                _ => break,
            }
        }
        Some(nearest)
    }

    /// A point chosen on the surface, placed; `u` in the unit square.
    #[inline]
    pub fn sample_area(&self, u: [f32; 2]) -> SurfacePoint {
        let sample = self.shape.sample([f64::from(u[0]), f64::from(u[1])]);
        self.place(sample.p, sample.n, sample.pdf_area)
    }

    /// Whether [`sample_area_rows`](Self::sample_area_rows) samples anything.
    pub fn samples_in_rows(&self) -> bool {
        !matches!(self.shape, Analytic::Revolution(_))
    }

    /// [`sample_area`](Self::sample_area) with each of the first `count` pairs, at most [`BATCH`].
    pub fn sample_area_rows(&self, u: &[Row; 2], count: usize, out: &mut WorldSampleRows) {
        points::sample(self, u, count, out);
    }

    /// Surface parameters at a placed point of the surface; where the shape's sampling found it, with `u`.
    pub fn uv(&self, p: DVec3, u: [f32; 2]) -> Vec2 {
        let [s, t] = self.shape.uv(self.transform.inverse_point(p), u.map(f64::from));
        Vec2::new(s as f32, t as f32)
    }

    /// The density (with respect to transformed area) with which [`TransformedShape::sample_area`] finds the point
    /// where `ray` hits; `None` on a miss.
    pub fn pdf_area(&self, ray: &Ray) -> Option<f64> {
        let centered = self.centered_ray(ray);
        let hit = self.shape.intersect(&centered.ray)?;
        let surface = self.shape.surface_with(Detail::Position, &centered.ray, &hit);
        Some(self.place(surface.p, surface.n, surface.pdf_area).pdf_area)
    }

    /// [`TransformedShape::pdf_area`] at a point known to be on the surface, from its unit normal (of either side)
    /// alone; `None` for surfaces whose sampling is not uniform by area in their own space.
    #[inline]
    pub fn pdf_area_from_normal(&self, n: Vec3) -> Option<f64> {
        if matches!(self.shape, Analytic::Revolution(_)) {
            return None;
        }
        // With M the linear part and m the object normal, M^-T m = n / |M^T n|.
        let length = self.transform.world_from_object.matrix3.transpose().mul_vec3(n.as_dvec3()).length();
        Some(length / (self.shape.area() * self.transform.determinant().abs()))
    }

    #[inline(always)]
    fn place(&self, p: DVec3, n: DVec3, pdf_area: f64) -> SurfacePoint {
        let normal = self.transform.normal(n);
        let length = normal.length();
        // The inverse transpose keeps the side even where the transform reflects.
        let sign = if self.reverse_normal { -1.0 } else { 1.0 };
        SurfacePoint {
            p: self.transform.point(p),
            n: (normal * (sign / length)).as_vec3(),
            pdf_area: pdf_area / (self.transform.determinant().abs() * length),
        }
    }
}

/// Rays that a shape is intersected with at once.
pub const PACKET_SIZE: usize = 16;

/// Rays of a packet, one number of each ray side by side.
#[derive(Clone, Debug)]
pub struct RayPacket {
    /// Origins by coordinate.
    pub origin: [[f32; PACKET_SIZE]; 3],
    /// Smallest distances.
    pub t_min: [f32; PACKET_SIZE],
    /// Directions by coordinate.
    pub direction: [[f32; PACKET_SIZE]; 3],
    /// Largest distances.
    pub t_max: [f32; PACKET_SIZE],
}

impl RayPacket {
    /// One of the rays.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        let vector = |rows: &[[f32; PACKET_SIZE]; 3]| Vec3::new(rows[0][i], rows[1][i], rows[2][i]);
        Ray { t_min: self.t_min[i], t_max: self.t_max[i], ..Ray::new(vector(&self.origin), vector(&self.direction)) }
    }
}

/// First hits of the rays of a packet.
#[derive(Clone, Copy, Debug)]
pub struct PacketHits {
    /// Distances; negative on a miss.
    pub t: [f32; PACKET_SIZE],
    /// 1 where [`TransformedShape::intersect`] has to be called, else 0.
    pub is_undecided: [u32; PACKET_SIZE],
}

#[inline(always)]
fn intersect_packet(placed: &TransformedShape, rays: &RayPacket) -> PacketHits {
    let mut hits = PacketHits { t: [-1.0; PACKET_SIZE], is_undecided: [1; PACKET_SIZE] };
    // A macro: closures are not always inlined.
    macro_rules! intersect {
        ($shape:ident) => {
            for i in 0..PACKET_SIZE {
                let ray = rays.get(i);
                let CenteredRay { ray: local, shift } = placed.centered_ray(&ray);
                let t = $shape.distance(&local) + shift;
                // False for a NaN.
                hits.t[i] = if t >= 0.0 { t as f32 } else { -1.0 };
                // The start of the interval is lost in the shift.
                hits.is_undecided[i] = u32::from(t < f64::from(ray.t_min));
            }
        };
    }
    match &placed.shape {
        Analytic::Sphere(sphere) => intersect!(sphere),
        Analytic::Quad(quad) => intersect!(quad),
        Analytic::Disk(disk) => intersect!(disk),
        Analytic::Frustum(frustum) => intersect!(frustum),
        Analytic::Revolution(_) => {}
    }
    hits
}

/// The first of two distances in ascending order that is accepted; NaN if neither is.
#[inline(always)]
pub(super) fn first_accepted([near, far]: [f64; 2], [is_near, is_far]: [bool; 2]) -> f64 {
    let far = if is_far { far } else { f64::NAN };
    if is_near { near } else { far }
}

/// Exact bounds of a circle, given by its centre and two perpendicular radii, after an affine map.
fn circle_bounds(map: &DAffine3, center: DVec3, radii: [DVec3; 2]) -> Bounds {
    let center = map.transform_point3(center);
    let [a, b] = radii.map(|v| map.transform_vector3(v));
    let reach = DVec3::new(a.x.hypot(b.x), a.y.hypot(b.y), a.z.hypot(b.z));
    Bounds { min: center - reach, max: center + reach }
}

/// A point of a placed shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point.
    pub p: DVec3,
    /// Unit normal, towards the front.
    pub n: Vec3,
    /// Density of sampling with respect to area.
    pub pdf_area: f64,
}

#[cfg(test)]
mod tests;
