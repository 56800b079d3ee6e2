//! What packets are intersected with: triangles, and pairs of triangles that make a flat quadrilateral.

use pulp::Simd;

use super::lanes::{BoundingSphere, LaneSet, Packet, any, dot, load, splat, subtract};
use crate::geometry::{PACKET_SIZE, RayPacket, TrianglePoints};
use crate::id::{PrimId, ShapeId};
use crate::math::{DVec3, Vec3};

/// A line as Plücker coordinates, relative to the middle of the scene.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Unit.
    direction: Vec3,
    /// A point cross the direction.
    moment: Vec3,
}

impl Edge {
    fn new(sphere: &BoundingSphere, [from, to]: [Vec3; 2]) -> Self {
        let (from, to) = (from.as_dvec3() - sphere.center.as_dvec3(), to.as_dvec3() - sphere.center.as_dvec3());
        let direction = (to - from).normalize_or_zero();
        Self { direction: direction.as_vec3(), moment: from.cross(direction).as_vec3() }
    }
}

/// A flat convex polygon: a triangle, or two that share an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon<const N: usize> {
    edges: [Edge; N],
    corner: Vec3,
    /// Unit normal.
    normal: Vec3,
    /// Number of its first triangle.
    pub prim: u32,
}

impl<const N: usize> Polygon<N> {
    /// From its corners in order.
    pub fn new(sphere: &BoundingSphere, corners: [Vec3; N], normal: DVec3, prim: u32) -> Self {
        let edges = std::array::from_fn(|i| Edge::new(sphere, [corners[i], corners[(i + 1) % N]]));
        Self { edges, corner: corners[0], normal: normal.normalize().as_vec3(), prim }
    }

    /// Intersects the rays of a packet with the polygon. Those that pass so close to an edge that rounding could
    /// decide, or so flat that it decides the distance, are intersected by `exact`, which takes lanes and gives
    /// distances, negative on a miss. The result is who hits it, and where.
    #[inline(always)]
    pub fn intersect<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        exact: impl Fn(LaneSet, &RayPacket) -> [f32; PACKET_SIZE],
    ) -> Option<(S::m32s, S::f32s)> {
        let s = simd;
        let mut lowest = packet.side(s, self.edges[0].direction, self.edges[0].moment);
        let mut highest = lowest;
        for edge in &self.edges[1..] {
            let side = packet.side(s, edge.direction, edge.moment);
            (lowest, highest) = (s.min_f32s(lowest, side), s.max_f32s(highest, side));
        }
        // The ray passes all edges on one side, or on the other.
        let (error, minus_error) = (packet.edge_error, s.neg_f32s(packet.edge_error));
        let may_hit =
            s.or_m32s(s.greater_than_or_equal_f32s(lowest, minus_error), s.less_than_or_equal_f32s(highest, error));
        if !any(s, may_hit) {
            return None;
        }
        // Relative to the corner, so that rays which start close to the plane find themselves on their side of it.
        let normal = splat(s, self.normal);
        let cosine = dot(s, packet.direction, normal);
        let mut t = s.div_f32s(dot(s, subtract(s, splat(s, self.corner), packet.origin), normal), cosine);
        let is_inside = s.or_m32s(s.greater_than_f32s(lowest, error), s.less_than_f32s(highest, minus_error));
        let is_steep = s.greater_than_f32s(s.abs_f32s(cosine), packet.flat);
        let mut is_hit = s.and_m32s(is_inside, is_steep);
        let is_undecided = s.and_m32s(s.and_m32s(may_hit, s.not_m32s(is_hit)), packet.is_open(s));
        if any(s, is_undecided) {
            let distances = exact(LaneSet::of(s, is_undecided), &packet.rays(s));
            t = s.select_f32s(is_undecided, load(s, &distances, 0), t);
            is_hit = may_hit;
        }
        Some((is_hit, t))
    }
}

/// What is needed of a primitive once it has been hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct PrimRecord {
    pub shape: ShapeId,
    pub id: PrimId,
    corner: Vec3,
    /// Gradients of the barycentric coordinates; zero on analytic shapes.
    du: Vec3,
    dv: Vec3,
    /// Distance, to the edge shared with the next primitive, of the corner, and its gradient. Where it is negative, the
    /// next primitive is hit.
    distance: f32,
    inward: Vec3,
    /// Whether it is a triangle.
    pub is_triangle: bool,
}

impl PrimRecord {
    /// An analytic shape.
    pub fn analytic(shape: ShapeId, id: PrimId) -> Self {
        let zero = Vec3::ZERO;
        Self { shape, id, corner: zero, du: zero, dv: zero, distance: 0.0, inward: zero, is_triangle: false }
    }

    /// A triangle.
    pub fn triangle(shape: ShapeId, id: PrimId, points: &TrianglePoints) -> Self {
        let n = points.cross();
        let [a, b, c] = [points.a, points.b, points.c].map(Vec3::as_dvec3);
        let (du, dv) = ((c - a).cross(n) / n.length_squared(), n.cross(b - a) / n.length_squared());
        Self { corner: points.a, du: du.as_vec3(), dv: dv.as_vec3(), is_triangle: true, ..Self::analytic(shape, id) }
    }

    /// The first of two triangles that share an edge; `inside` is its corner that the other one has not.
    pub fn with_neighbor(self, [from, to]: [Vec3; 2], inside: Vec3) -> Self {
        let [from, to, inside, corner] = [from, to, inside, self.corner].map(Vec3::as_dvec3);
        let along = (to - from).normalize();
        let inward = (inside - from).reject_from_normalized(along).normalize();
        Self { distance: (corner - from).dot(inward) as f32, inward: inward.as_vec3(), ..self }
    }

    /// Whether a point belongs to the next primitive.
    #[inline(always)]
    pub fn is_beyond(&self, p: Vec3) -> bool {
        self.distance + (p - self.corner).dot(self.inward) < 0.0
    }

    /// Barycentric coordinates of a point.
    #[inline(always)]
    pub fn barycentric(&self, p: Vec3) -> [f32; 2] {
        let p = p - self.corner;
        let u = p.dot(self.du).clamp(0.0, 1.0);
        [u, p.dot(self.dv).clamp(0.0, 1.0 - u)]
    }
}
