//! What packets are intersected with: triangles, pairs of triangles that make a flat quadrilateral, and analytic
//! shapes.

use pulp::Simd;

use super::lanes::{BoundingSphere, LaneSet, Packet, any, dot, splat, subtract};
use crate::geometry::{PACKET_SIZE, RayPacket, TransformedShape, TrianglePoints};
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
    /// distances, negative on a miss.
    #[inline(always)]
    pub fn intersect<S: Simd, const ANY: bool>(
        &self,
        simd: S,
        packet: &mut Packet<S>,
        exact: impl Fn(LaneSet, &RayPacket) -> [f32; PACKET_SIZE],
    ) {
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
            return;
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
            t = s.select_f32s(is_undecided, s.partial_load_f32s(&distances[..S::F32_LANES]), t);
            is_hit = may_hit;
        }
        packet.offer::<ANY>(s, is_hit, t, self.prim);
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
}

impl PrimRecord {
    /// An analytic shape.
    pub fn analytic(shape: ShapeId, id: PrimId) -> Self {
        Self { shape, id, corner: Vec3::ZERO, du: Vec3::ZERO, dv: Vec3::ZERO, distance: 0.0, inward: Vec3::ZERO }
    }

    /// A triangle.
    pub fn triangle(shape: ShapeId, id: PrimId, points: &TrianglePoints) -> Self {
        let n = points.cross();
        let [a, b, c] = [points.a, points.b, points.c].map(Vec3::as_dvec3);
        let (du, dv) = ((c - a).cross(n) / n.length_squared(), n.cross(b - a) / n.length_squared());
        Self { corner: points.a, du: du.as_vec3(), dv: dv.as_vec3(), ..Self::analytic(shape, id) }
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

/// Fewer rays are intersected with analytic shapes one by one.
const MIN_PACKET_RAYS: u32 = 3;

/// Intersects some rays of a packet with an analytic shape.
#[inline(always)]
pub(super) fn intersect_shape<S: Simd, const ANY: bool>(
    simd: S,
    placed: &TransformedShape,
    prim: u32,
    lanes: LaneSet,
    packet: &mut Packet<S>,
) {
    let distances = distances(placed, lanes, &packet.rays(simd));
    let t = simd.partial_load_f32s(&distances[..S::F32_LANES]);
    packet.offer::<ANY>(simd, simd.greater_than_or_equal_f32s(t, simd.splat_f32s(0.0)), t, prim);
}

/// The distances at which some rays hit a shape; negative on a miss, and for the others.
#[inline(never)]
fn distances(placed: &TransformedShape, lanes: LaneSet, rays: &RayPacket) -> [f32; PACKET_SIZE] {
    let mut distances = [-1.0; PACKET_SIZE];
    let alone = |lane: usize| placed.intersect(&rays.get(lane)).map_or(-1.0, |hit| hit.t as f32);
    if lanes.count() < MIN_PACKET_RAYS {
        lanes.lanes().for_each(|lane| distances[lane] = alone(lane));
    } else {
        let hits = placed.intersect_packet(rays);
        lanes
            .lanes()
            .for_each(|lane| distances[lane] = if hits.is_undecided[lane] == 0 { hits.t[lane] } else { alone(lane) });
    }
    distances
}
