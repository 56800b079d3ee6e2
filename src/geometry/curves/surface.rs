//! Points of the surfaces of curves.

use std::f64::consts::TAU;

use super::segment::{Pick, RaySpace, Segment, SegmentHit};
use super::{CurveBasis, CurveKind, Curves};
use crate::attribute::AttributePoint;
use crate::geometry::{Hit, SurfaceInteraction};
use crate::id::PrimId;
use crate::math::float::F64_CHAIN_ERROR;
use crate::math::{DVec3, DVec4, Ray, Vec2, Vec4, angle_of};

/// A point of the surface.
struct CurvePoint {
    p: DVec3,
    n: DVec3,
    dp_dv: DVec3,
    /// Around the tube, or across the ribbon.
    v: f64,
}

impl Curves {
    /// The interaction for a hit of `ray`, with the change of the point with v. u runs along the strand from its first
    /// point; v runs around a tube, and across a ribbon.
    pub(in crate::geometry) fn interaction_and_dp_dv(
        &self,
        ray: &Ray,
        hit: &Hit,
    ) -> Option<(SurfaceInteraction, crate::math::Vec3)> {
        let segment = self.segment(hit.prim);
        let space = RaySpace::new(ray);
        let found = self.find_again(hit, &segment, &space)?;
        let t = found.distance / space.length;
        if t <= 0.0 {
            return None;
        }
        let [center, derivative] = segment.at(found.u);
        let raw = space.origin + space.direction() * found.distance;
        let tangent = tangent(&segment, derivative);
        let strand = self.strand(hit.prim);
        let [first, end] = [self.strands[strand], self.strands[strand + 1]];
        let at = match self.kind {
            CurveKind::Round => self.on_tube([first, end], raw, center, tangent),
            kind => on_ribbon(kind, space.direction(), raw, center, tangent),
        }?;
        let segments = f64::from(end - first);
        let along = (f64::from(hit.prim.0 - first) + found.u) / segments;
        let uv = match &self.root_uvs {
            Some(uvs) => Vec2::from(uvs[strand]),
            None => Vec2::new(along as f32, at.v as f32),
        };
        let size = at.p.abs().max(center.truncate().abs()).max_element() + center.w;
        let n = at.n.as_vec3();
        let interaction = SurfaceInteraction {
            p: at.p,
            t: t as f32,
            error: (F64_CHAIN_ERROR * size) as f32,
            n_g: n,
            n_s: n,
            dp_du: (tangent * (derivative.truncate().length() * segments)).as_vec3(),
            uv,
            shape: hit.shape,
            prim: hit.prim,
            instance: hit.instance,
            time: ray.time,
        };
        Some((interaction, at.dp_dv.as_vec3()))
    }

    /// A hit to full precision, from the parameter of one that Embree has found, which is not 0.
    fn find_again(&self, hit: &Hit, segment: &Segment, space: &RaySpace) -> Option<SegmentHit> {
        let distance = f64::from(hit.t) * space.length;
        let refined = if hit.u > 0.0 && self.kind == CurveKind::Round {
            segment.in_space(space).refine(f64::from(hit.u), distance)
        } else {
            None
        };
        refined.or_else(|| self.find(hit.prim, segment, space, Pick::Nearest(distance)))
    }

    /// The point of a tube's sphere `center` next to `raw`, on the strand of the segments from `first` to before `end`.
    fn on_tube(&self, [first, end]: [u32; 2], raw: DVec3, center: DVec4, tangent: DVec3) -> Option<CurvePoint> {
        let n = (raw - center.truncate()).try_normalize()?;
        // The angle is that from the axis that a strand leaves alone most, so that v does not turn along it.
        let last = if self.basis == CurveBasis::Linear { 1 } else { 3 };
        let [root, tip] = [self.segments[first as usize], self.segments[end as usize - 1] + last]
            .map(|i| Vec4::from(self.points[i as usize]).truncate());
        let chord = (tip - root).abs();
        let axis = if chord.x <= chord.y.min(chord.z) {
            DVec3::X
        } else if chord.y <= chord.z {
            DVec3::Y
        } else {
            DVec3::Z
        };
        let across = tangent.cross(axis).try_normalize().unwrap_or_else(|| tangent.any_orthonormal_vector());
        let angle = angle_of(n.dot(across) as f32, n.dot(across.cross(tangent)) as f32);
        Some(CurvePoint {
            p: center.truncate() + n * center.w,
            n,
            dp_dv: tangent.cross(n) * (TAU * center.w),
            v: (f64::from(angle) / TAU).rem_euclid(1.0),
        })
    }

    /// The attributes at a point given by where a ray meets a segment; `None` if there are none.
    pub(in crate::geometry) fn attributes_at(&self, prim: PrimId, p: DVec3) -> Option<AttributePoint<'_>> {
        if !self.has_attributes() {
            return None;
        }
        // The parameter of the closest point, from the better end of two by bisection steps of the squared distance.
        let u = self.closest_parameter(prim, p);
        let ([a, b], part) = self.points_around(prim, u);
        let strand = PrimId::new(self.strand(prim));
        let part = part as f32;
        Some(AttributePoint {
            attributes: &self.attributes,
            prim: strand,
            corners: [a, b, b],
            weights: [1.0 - part, part, 0.0],
        })
    }

    /// The parameter of the point of a segment that is closest to `p`, by steps of Newton's method on its tangents.
    fn closest_parameter(&self, prim: PrimId, p: DVec3) -> f64 {
        let segment = self.segment(prim);
        let distance = |u: f64| (segment.at(u)[0].truncate() - p).length_squared();
        let mut best =
            (0..=8).map(|i| f64::from(i) / 8.0).fold(0.0, |a, b| if distance(b) < distance(a) { b } else { a });
        for _ in 0..8 {
            let [c, d] = segment.at(best).map(DVec4::truncate);
            let step = (p - c).dot(d) / d.length_squared();
            if !step.is_finite() {
                break;
            }
            best = (best + step).clamp(0.0, 1.0);
        }
        best
    }
}

/// The unit tangent: where control points coincide, the direction of the segment's chord.
fn tangent(segment: &Segment, derivative: DVec4) -> DVec3 {
    let chord = || (segment.0[3] - segment.0[0]).truncate().try_normalize();
    derivative.truncate().try_normalize().or_else(chord).unwrap_or(DVec3::Z)
}

/// The point of a ribbon that faces a ray along `direction`.
fn on_ribbon(kind: CurveKind, direction: DVec3, raw: DVec3, center: DVec4, tangent: DVec3) -> Option<CurvePoint> {
    let side = tangent.cross(direction).try_normalize()?;
    let facing = side.cross(tangent);
    let facing = if facing.dot(direction) > 0.0 { -facing } else { facing };
    let h = ((raw - center.truncate()).dot(side) / center.w).clamp(-1.0, 1.0);
    let n = if kind == CurveKind::Flat { facing } else { facing * ((1.0 - h) * (1.0 + h)).sqrt() + side * h };
    Some(CurvePoint { p: raw, n, dp_dv: side * (2.0 * center.w), v: 0.5 + 0.5 * h })
}
