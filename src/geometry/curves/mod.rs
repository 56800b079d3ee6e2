//! Curves: hair, fur, grass, threads. Strands of control points with radii, cut into cubic segments, which are the
//! primitives.

mod segment;
mod surface;
#[cfg(test)]
mod tests;

pub use segment::CurveKind;

use super::CurvesError;
use crate::attribute::Attribute;
use crate::id::PrimId;
use crate::math::float::EMBREE_LARGE;
use crate::math::{Aabb, Bounds, DVec4, Ray};
use segment::{Capsule, Pick, RaySpace, Segment, SegmentHit, joint_hit};

/// How control points make a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveBasis {
    /// Straight lines from one to the next.
    Linear,
    /// Joined cubic Bezier curves: `3 n + 1` points.
    Bezier,
    /// A uniform cubic B-spline, which does not reach its end points.
    BSpline,
    /// A uniform Catmull-Rom spline, which passes through all points but the first and the last.
    CatmullRom,
}

impl CurveBasis {
    /// How many segments a strand of as many points has; `None` if there can be no such strand.
    pub fn segments(self, points: usize) -> Option<usize> {
        match self {
            Self::Linear => points.checked_sub(1),
            Self::Bezier => points.checked_sub(1).filter(|rest| rest.is_multiple_of(3)).map(|rest| rest / 3),
            Self::BSpline | Self::CatmullRom => points.checked_sub(3),
        }
        .filter(|&segments| segments > 0)
    }

    /// How many points lie between the first ones of two segments.
    fn stride(self) -> usize {
        if self == Self::Bezier { 3 } else { 1 }
    }

    /// Whether a strand may have corners at its joints.
    fn has_corners(self) -> bool {
        matches!(self, Self::Linear | Self::Bezier)
    }
}

/// Control points of strands: positions with radii, and the number of points of each strand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// x, y, z and the radius.
    pub points: Vec<[f32; 4]>,
    /// How many points each strand has.
    pub counts: Vec<u32>,
}

/// Curves, validated: every number is finite, no radius below 0, every strand long enough.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    points: Vec<[f32; 4]>,
    /// The first point of each segment.
    segments: Vec<u32>,
    /// The first segment of each strand, and the number of all.
    strands: Vec<u32>,
    basis: CurveBasis,
    kind: CurveKind,
    /// In place of the uv along and across, those of each strand.
    root_uvs: Option<Vec<[f32; 2]>>,
    /// What textures take: values for each strand (as those of faces) or for each control point.
    attributes: Box<[Attribute]>,
    bounds: Aabb,
    /// Of each segment.
    capsules: Vec<Capsule>,
}

impl Curves {
    /// Curves from their control points.
    ///
    /// # Errors
    /// If there is none, a number is not finite, a radius below 0, or a strand too short.
    pub fn new(strands: Strands, basis: CurveBasis, kind: CurveKind) -> Result<Self, CurvesError> {
        let Strands { points, counts } = strands;
        if counts.is_empty() {
            return Err(CurvesError::Empty);
        }
        let counted = counts.iter().fold(0usize, |sum, &count| sum.saturating_add(count as usize));
        if counted != points.len() {
            return Err(CurvesError::Counts { counted, points: points.len() });
        }
        check_points(&points)?;
        let (mut segments, mut firsts, mut first) = (Vec::new(), Vec::with_capacity(counts.len() + 1), 0usize);
        for (strand, &count) in counts.iter().enumerate() {
            let number =
                basis.segments(count as usize).ok_or(CurvesError::Points { strand, count: count as usize, basis })?;
            firsts.push(index(segments.len())?);
            for i in 0..number {
                segments.push(index(first + i * basis.stride())?);
            }
            first += count as usize;
        }
        firsts.push(index(segments.len())?);
        segments.shrink_to_fit();
        let mut curves = Self {
            points,
            segments,
            strands: firsts,
            basis,
            kind,
            root_uvs: None,
            attributes: Box::default(),
            bounds: Aabb::EMPTY,
            capsules: Vec::new(),
        };
        curves.capsules = (0..curves.prim_count()).map(|i| Capsule::new(&curves.segment(PrimId::new(i)))).collect();
        curves.bounds =
            (0..curves.prim_count()).fold(Aabb::EMPTY, |all, i| all.union(&curves.prim_bounds(PrimId::new(i))));
        Ok(curves)
    }

    /// These curves with one uv for each strand.
    ///
    /// # Errors
    /// If there are more or fewer than strands, or one is not finite.
    pub fn with_root_uvs(mut self, uvs: Vec<[f32; 2]>) -> Result<Self, CurvesError> {
        if uvs.len() != self.strand_count() {
            return Err(CurvesError::Uvs { uvs: uvs.len(), strands: self.strand_count() });
        }
        if let Some(i) = uvs.iter().position(|uv| !uv.iter().all(|x| x.is_finite())) {
            return Err(CurvesError::Uv(i));
        }
        self.root_uvs = Some(uvs);
        Ok(self)
    }

    /// These curves with attributes: as many values as strands or control points.
    #[must_use]
    pub fn with_attributes(mut self, attributes: Vec<Attribute>) -> Self {
        self.attributes = attributes.into();
        self
    }

    /// Whether there are attributes.
    pub fn has_attributes(&self) -> bool {
        !self.attributes.is_empty()
    }

    /// What the surface is.
    pub fn kind(&self) -> CurveKind {
        self.kind
    }

    /// How control points make the curves.
    pub fn basis(&self) -> CurveBasis {
        self.basis
    }

    /// The control points: x, y, z and the radius.
    pub fn points(&self) -> &[[f32; 4]] {
        &self.points
    }

    /// The number of the first control point of each segment.
    pub fn first_points(&self) -> &[u32] {
        &self.segments
    }

    /// The largest radius of a control point.
    pub fn max_radius(&self) -> f32 {
        self.points.iter().fold(0.0, |most, point| most.max(point[3]))
    }

    /// Whether disks across the curves sweep the same surface as spheres along them, but for 1.2 % of the radius: tubes
    /// without corners that taper slowly. One segment in a hundred may do otherwise, such as one that turns back.
    pub fn is_swept_disk(&self) -> bool {
        const MOST_OTHERS: usize = 100;
        let is_joined = self.basis.has_corners() && self.strand_count() < self.prim_count();
        if self.kind != CurveKind::Round || self.basis == CurveBasis::Linear || is_joined {
            return false;
        }
        let others = (0..self.prim_count()).filter(|&i| !self.segment(PrimId::new(i)).is_slender()).count();
        others * MOST_OTHERS <= self.prim_count() && self.points.iter().all(is_sized)
    }

    /// How many segments there are.
    pub fn prim_count(&self) -> usize {
        self.segments.len()
    }

    /// How many strands there are.
    pub fn strand_count(&self) -> usize {
        self.strands.len() - 1
    }

    /// How many control points there are.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Bounds of a segment.
    pub fn prim_bounds(&self, prim: PrimId) -> Aabb {
        let of = |bounds: Bounds, p: &DVec4| bounds.extended(p.truncate() - p.w).extended(p.truncate() + p.w);
        self.segment(prim).0.iter().fold(Bounds::EMPTY, of).padded()
    }

    /// Bounds of all.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        let attributes: usize = self.attributes.iter().map(|attribute| size_of_val(attribute.values.numbers())).sum();
        size_of_val(self.points.as_slice())
            + size_of_val(self.segments.as_slice())
            + size_of_val(self.strands.as_slice())
            + size_of_val(self.capsules.as_slice())
            + self.root_uvs.as_ref().map_or(0, |uvs| size_of_val(uvs.as_slice()))
            + attributes
    }

    /// The distance of the first hit of a ray with a segment, within the ray's interval.
    pub fn intersect(&self, prim: PrimId, ray: &Ray) -> Option<f32> {
        if !self.capsules[prim.index()].may_be_met(ray) {
            return None;
        }
        let segment = self.segment(prim);
        let space = RaySpace::new(ray);
        let [min, max] = [ray.t_min, ray.t_max].map(|t| f64::from(t) * space.length);
        // Rounding keeps the order, but the product with the length may have moved the ends.
        let hit = self.find(prim, &segment, &space, Pick::First { min, max })?;
        Some(((hit.distance / space.length) as f32).clamp(ray.t_min, ray.t_max))
    }

    fn find(&self, prim: PrimId, segment: &Segment, space: &RaySpace, pick: Pick) -> Option<SegmentHit> {
        let local = segment.in_space(space);
        let found = local.find(self.kind, pick);
        if self.kind != CurveKind::Round || !self.basis.has_corners() || self.is_first(prim) {
            return found;
        }
        let [p, after] = local.at(0.0);
        let [_, before] = self.segment(PrimId(prim.0 - 1)).in_space(space).at(1.0);
        match joint_hit(p, before, after) {
            Some(distance) => pick.better(found, SegmentHit { distance, u: 0.0 }),
            None => found,
        }
    }

    /// The strand that a segment is of.
    fn strand(&self, prim: PrimId) -> usize {
        // The strand, if all have the same number of segments.
        let guess = (u64::from(prim.0) * self.strand_count() as u64 / self.prim_count() as u64) as usize;
        if self.strands[guess] <= prim.0 && prim.0 < self.strands[guess + 1] {
            return guess;
        }
        self.strands.partition_point(|&first| first <= prim.0) - 1
    }

    fn is_first(&self, prim: PrimId) -> bool {
        self.strands.binary_search(&prim.0).is_ok()
    }

    /// A segment as a Bezier curve.
    fn segment(&self, prim: PrimId) -> Segment {
        let first = self.segments[prim.index()] as usize;
        let point = |i: usize| {
            // Not by `map`, which is a call.
            let [x, y, z, radius] = self.points[first + i];
            DVec4::new(f64::from(x), f64::from(y), f64::from(z), f64::from(radius))
        };
        let positive = |p: DVec4| DVec4::new(p.x, p.y, p.z, p.w.max(0.0));
        Segment(match self.basis {
            CurveBasis::Linear => {
                let (a, b) = (point(0), point(1));
                [a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b]
            }
            CurveBasis::Bezier => [point(0), point(1), point(2), point(3)],
            CurveBasis::BSpline => {
                let [a, b, c, d] = [point(0), point(1), point(2), point(3)];
                [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
            }
            CurveBasis::CatmullRom => {
                let [a, b, c, d] = [point(0), point(1), point(2), point(3)];
                [b, positive(b + (c - a) / 6.0), positive(c - (d - b) / 6.0), c]
            }
        })
    }

    /// The two control points of a segment that lie around a parameter, and how far it is from one to the other.
    fn points_around(&self, prim: PrimId, u: f64) -> ([u32; 2], f64) {
        let first = self.segments[prim.index()];
        match self.basis {
            CurveBasis::Linear => ([first, first + 1], u),
            CurveBasis::Bezier => {
                let part = (3.0 * u).floor().clamp(0.0, 2.0);
                ([first + part as u32, first + part as u32 + 1], 3.0 * u - part)
            }
            CurveBasis::BSpline | CurveBasis::CatmullRom => ([first + 1, first + 2], u),
        }
    }
}

fn index(i: usize) -> Result<u32, CurvesError> {
    u32::try_from(i).map_err(|_| CurvesError::TooMany)
}

/// Whether squares of sizes are far from the limits of `f32`.
fn is_sized([x, y, z, radius]: &[f32; 4]) -> bool {
    const MAX_SIZE: f32 = 1e9;
    [x, y, z, radius].iter().all(|size| size.abs() < MAX_SIZE)
}

/// Rejects points that are not finite and radii below 0.
pub(super) fn check_points(points: &[[f32; 4]]) -> Result<(), CurvesError> {
    if let Some(i) = points.iter().position(|[x, y, z, _]| ![x, y, z].iter().all(|x| x.abs() < EMBREE_LARGE)) {
        return Err(CurvesError::Position(i));
    }
    match points.iter().position(|[.., r]| !(*r >= 0.0 && *r < EMBREE_LARGE)) {
        Some(i) => Err(CurvesError::Radius { point: i, radius: points[i][3] }),
        None => Ok(()),
    }
}
