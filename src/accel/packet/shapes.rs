//! Analytic shapes in packets: intervals of distances in `f32` that contain the distances found in `f64`.
//!
//! A ray is transformed into a space where the shape has the size 1. Let `sigma = row * (|o - c| + |c| + size)` with
//! the largest component `row` of the transform, 1-norms, the ray's origin `o`, and the centre `c` and size of the
//! shape. Of the transformed ray, rounding moves the point where the shape is hit by at most `24 u sigma` (`u` is the
//! unit roundoff of `f32`): a component of the origin takes 5 roundings, one of the centre, and one of the direction 4,
//! over a distance of at most `|o - c| + size`; three components and the conversion of norms make a factor of 3 at
//! most. The rounding of what follows is bounded where it is done.
//!
//! Distances are reported as the lower limits of intervals, [`RESOLUTION`] wide at most: what shades a hit computes it
//! again. Where the intervals decide whether and where the shape is hit first, nothing is computed in `f64`; everywhere
//! else [`TransformedShape::intersect`] decides.

mod planar;
mod quadric;

use planar::Planar;
use pulp::Simd;
use quadric::Quadric;

use super::lanes::{Packet, any, load, store, within};
use crate::geometry::{Analytic, PACKET_SIZE, RayPacket, TransformedShape};
use crate::math::float::F64_CHAIN_ERROR;
use crate::math::vectorize::vectorize;
use crate::math::{Aabb, DMat3, DVec3};

/// Relative error of the side of a point in `f64`, with that of [`TransformedShape::intersect`].
const SIDE_ERROR: f64 = 4.0 * F64_CHAIN_ERROR;

/// The length of the interval of a hit's distance, times the direction's, relative to `|o - c| + |c| + size`.
const RESOLUTION: f32 = 1.0 / 1024.0;

/// A shape as packets are intersected with it.
pub(super) struct PacketShape<'g> {
    pub placed: &'g TransformedShape,
    /// Its number.
    pub prim: u32,
    /// What rays that hit it enter.
    pub bounds: Aabb,
    bounded: Bounded,
}

/// What is bounded in `f32`.
enum Bounded {
    /// A sphere or an ellipsoid.
    Sphere(Quadric),
    /// A cylinder between two planes.
    Cylinder(Quadric),
    /// A parallelogram.
    Quad(Planar),
    /// A disk or a ring.
    Disk(Planar),
    /// Nothing: all rays are intersected in `f64`.
    Nothing,
}

/// Whether distances to a shape are bounded in `f32`, so that few are computed in `f64`.
pub(in crate::accel) fn has_intervals(shape: &Analytic) -> bool {
    match shape {
        Analytic::Sphere(_) | Analytic::Quad(_) | Analytic::Disk(_) => true,
        Analytic::Frustum(frustum) => frustum.is_cylinder(),
        Analytic::Revolution(_) => false,
    }
}

/// Where rays may meet a surface: at distances from `low` to `high` if at all.
#[derive(Clone, Copy)]
struct RootInterval<S: Simd> {
    pub low: S::f32s,
    pub high: S::f32s,
    /// Whether the ray certainly meets the part of the surface that is kept.
    pub is_hit: S::m32s,
    /// Whether it certainly does not.
    pub is_miss: S::m32s,
}

/// Where rays meet the whole of a surface.
struct Roots<S: Simd> {
    near: RootInterval<S>,
    /// Never met on planes.
    far: RootInterval<S>,
    /// Limits of the middle between the roots.
    middle: [S::f32s; 2],
}

impl<'g> PacketShape<'g> {
    /// Hits of a packet's rays, of `ANY` or the closest. `lanes` are those that ask.
    #[inline(always)]
    pub fn intersect<S: Simd, const ANY: bool>(&self, simd: S, packet: &Packet<S>, lanes: S::m32s) -> IntervalHits<S> {
        let (s, o, d) = (simd, packet.origin, packet.direction);
        let mut roots = match &self.bounded {
            Bounded::Sphere(sphere) => sphere.roots::<S, false>(s, o, d, packet.length),
            Bounded::Cylinder(cylinder) => cylinder.roots::<S, true>(s, o, d, packet.length),
            Bounded::Quad(quad) => quad.root::<S, false>(s, o, d, packet.length),
            Bounded::Disk(disk) => disk.root::<S, true>(s, o, d, packet.length),
            Bounded::Nothing => {
                let (never, always) = (none(s), s.not_m32s(none(s)));
                let infinity = s.splat_f32s(f32::INFINITY);
                return IntervalHits { low: infinity, high: infinity, is_hit: never, may_hit: always };
            }
        };
        let hits = roots.first::<ANY>(s, packet);
        if !any(s, s.and_m32s(hits.may_hit, lanes)) {
            return hits;
        }
        // Most rays that leave the shape, or end at it, are decided by the sides of it that their ends are on.
        let starts_near = s.or_m32s(roots.near.contains(s, packet.t_min), roots.far.contains(s, packet.t_min));
        let end = s.select_f32s(starts_near, packet.t_min, packet.t_max);
        let sides = self.sides(&packet.rays(s), &store(s, end));
        roots.exclude(s, packet, starts_near, load(s, &sides, 0));
        roots.first::<ANY>(s, packet)
    }

    /// The sides of the whole surface that ends of rays, at distances `t`, are on: positive outside a quadric, and at
    /// planes where a ray starts behind or ends before it; negative inside a quadric; else, and where rounding in `f64`
    /// could decide, zero.
    #[inline(never)]
    fn sides(&self, rays: &RayPacket, t: &[f32; PACKET_SIZE]) -> [f32; PACKET_SIZE] {
        let mut sides = [0.0; PACKET_SIZE];
        match &self.bounded {
            Bounded::Sphere(sphere) => vectorize!(sphere.sides::<false>(rays, t, &mut sides)),
            Bounded::Cylinder(cylinder) => vectorize!(cylinder.sides::<true>(rays, t, &mut sides)),
            Bounded::Quad(plane) | Bounded::Disk(plane) => vectorize!(plane.sides(rays, t, &mut sides)),
            Bounded::Nothing => {}
        }
        sides
    }

    pub fn new(placed: &'g TransformedShape, prim: u32, bounds: Aabb) -> Self {
        let world = |v: DVec3| placed.transform.vector(v);
        let center = |p: DVec3| placed.transform.point(p);
        let rows = &placed.transform.object_from_world.matrix3;
        let scaled = |scale: DVec3| DMat3::from_diagonal(scale) * *rows;
        let bounded = match &placed.shape {
            Analytic::Sphere(sphere) => {
                let (radius, c) = (sphere.radius(), center(DVec3::ZERO));
                let size = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| world(axis * radius).length());
                Bounded::Sphere(Quadric::new(c, scaled(DVec3::splat(1.0 / radius)), size, sphere.is_full()))
            }
            Analytic::Frustum(frustum) if frustum.is_cylinder() => {
                let (radius, half) = (frustum.radii()[0], 0.5 * frustum.height());
                let scale = DVec3::new(1.0 / radius, 1.0 / radius, 1.0 / half);
                let size = [DVec3::X * radius, DVec3::Y * radius, DVec3::Z * half].map(|axis| world(axis).length());
                Bounded::Cylinder(Quadric::new(center(DVec3::Z * half), scaled(scale), size, frustum.is_full_turn()))
            }
            Analytic::Quad(quad) => {
                let (u, v) = (0.5 * quad.edge_u(), 0.5 * quad.edge_v());
                Bounded::Quad(Planar::new(placed, center(quad.origin() + u + v), [world(u), world(v)], 0.0, true))
            }
            Analytic::Disk(disk) => {
                let edges = [DVec3::X, DVec3::Y].map(|axis| world(axis * disk.radius()));
                let inner = disk.inner_radius() / disk.radius();
                Bounded::Disk(Planar::new(placed, center(DVec3::ZERO), edges, inner, disk.is_full_turn()))
            }
            Analytic::Frustum(_) | Analytic::Revolution(_) => Bounded::Nothing,
        };
        Self { placed, prim, bounds, bounded }
    }
}

/// Hits of a packet's rays on a shape.
pub(super) struct IntervalHits<S: Simd> {
    /// The distances are within these limits.
    pub low: S::f32s,
    pub high: S::f32s,
    /// Where the shape is certainly hit.
    pub is_hit: S::m32s,
    /// Where that is not certain, and neither is it that the shape is missed, or hit behind another hit.
    pub may_hit: S::m32s,
}

/// No lane.
#[inline(always)]
fn none<S: Simd>(simd: S) -> S::m32s {
    simd.less_than_f32s(simd.splat_f32s(1.0), simd.splat_f32s(0.0))
}

/// Where a root certainly is a hit within the ray's interval, and where it certainly is none before the closest hit.
#[inline(always)]
fn in_interval<S: Simd>(simd: S, packet: &Packet<S>, root: &RootInterval<S>) -> (S::m32s, S::m32s) {
    let s = simd;
    let is_within = s.and_m32s(
        s.greater_than_or_equal_f32s(root.low, packet.t_min),
        s.less_than_or_equal_f32s(root.high, packet.t_max),
    );
    let is_beyond = s.or_m32s(s.less_than_f32s(root.high, packet.t_min), s.greater_than_f32s(root.low, packet.t));
    let is_miss = s.or_m32s(root.is_miss, is_beyond);
    (s.and_m32s(s.and_m32s(root.is_hit, is_within), s.not_m32s(is_miss)), is_miss)
}

impl<S: Simd> RootInterval<S> {
    #[inline(always)]
    fn contains(&self, simd: S, t: S::f32s) -> S::m32s {
        within(simd, t, self.low, self.high)
    }
}

impl<S: Simd> Roots<S> {
    /// The first root that is a hit, or either of them where `ANY` will do.
    #[inline(always)]
    fn first<const ANY: bool>(&self, simd: S, packet: &Packet<S>) -> IntervalHits<S> {
        let (s, Self { near, far, .. }) = (simd, self);
        let (near_hit, near_miss) = in_interval(s, packet, near);
        let (far_hit, far_miss) = in_interval(s, packet, far);
        let is_hit = s.or_m32s(near_hit, if ANY { far_hit } else { s.and_m32s(near_miss, far_hit) });
        let is_miss = s.and_m32s(near_miss, far_miss);
        IntervalHits {
            low: s.select_f32s(near_hit, near.low, far.low),
            high: s.select_f32s(near_hit, near.high, far.high),
            is_hit,
            may_hit: s.and_m32s(s.not_m32s(is_hit), s.not_m32s(is_miss)),
        }
    }

    /// Excludes roots by the side that one end of the ray is on: its start, or where `is_start` is false its end.
    #[inline(always)]
    fn exclude(&mut self, simd: S, packet: &Packet<S>, is_start: S::m32s, side: S::f32s) {
        let s = simd;
        let zero = s.splat_f32s(0.0);
        let (is_outside, is_inside) = (s.greater_than_f32s(side, zero), s.less_than_f32s(side, zero));
        let is_end = s.not_m32s(is_start);
        // Outside, and going away at the start or still coming at the end: it meets neither.
        let leaves = s.and_m32s(is_start, s.less_than_f32s(self.middle[1], packet.t_min));
        let comes = s.and_m32s(is_end, s.greater_than_f32s(self.middle[0], packet.t_max));
        let meets_none = s.and_m32s(is_outside, s.or_m32s(leaves, comes));
        let (starts_inside, ends_inside) = (s.and_m32s(is_inside, is_start), s.and_m32s(is_inside, is_end));
        self.near.is_miss = s.or_m32s(self.near.is_miss, s.or_m32s(meets_none, starts_inside));
        self.far.is_miss = s.or_m32s(self.far.is_miss, s.or_m32s(meets_none, ends_inside));
    }
}

/// A point of a ray, in `f64`.
#[inline(always)]
fn point_at(rays: &RayPacket, i: usize, t: f32) -> DVec3 {
    let ray = rays.get(i);
    ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t)
}

#[cfg(test)]
mod tests;
