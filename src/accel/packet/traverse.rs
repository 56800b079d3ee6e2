//! Packets through the hierarchy.

use arrayvec::ArrayVec;
use pulp::x86::{V3, V4};
use pulp::{Scalar, Simd, WithSimd};

use super::hierarchy::{Hierarchy, MAX_PACKET_LEAF, NodeContent, Primitive, STACK};
use super::lanes::{LaneSet, NONE, Offer, Packet, any, load, store_f32s, store_u32s};
use super::primitives::PrimRecord;
use super::shapes::{IntervalHits, PacketShape};
use crate::accel::HitRows;
use crate::geometry::{Hit, PACKET_SIZE, RayPacket, Shape, TransformedShape, TrianglePoints, TriangleRay};
use crate::id::ShapeId;
use crate::math::compact::set_bits;
use crate::math::rows::{BATCH, Row};
use crate::math::{Ray, RayRows};

impl Hierarchy<'_> {
    /// Closest hits of the first `count` rays. Rays that do not fit into packets are traced by `alone`.
    pub fn intersect(&self, rays: &RayRows, count: usize, hits: &mut HitRows, alone: impl Fn(&Ray) -> Option<Hit>) {
        let (ends, left_out) = (&mut [0.0; BATCH], &mut LeftOut::new());
        let HitRows { t, shape: prims, .. } = hits;
        run(Closest::<false> { hierarchy: self, rays, count, t, prims, ends, left_out });
        self.complete_all(rays, count, hits);
        for lane in left_out.drain(..).map(usize::from) {
            hits.set(lane, alone(&rays.get(lane)));
        }
    }

    /// What the first `count` rays hit first. Returned are the rays that do not fit into packets.
    pub fn intersect_within(&self, rays: &RayRows, count: usize, hits: &mut PacketHitRows) -> LeftOut {
        let mut left_out = LeftOut::new();
        let PacketHitRows { t, prims, ends } = hits;
        run(Closest::<true> { hierarchy: self, rays, count, t, prims, ends, left_out: &mut left_out });
        left_out
    }

    /// Whether the first `count` rays hit anything.
    pub fn occluded(&self, rays: &RayRows, count: usize, occluded: &mut [bool; BATCH], alone: impl Fn(&Ray) -> bool) {
        run(Occluded { hierarchy: self, rays, count, occluded, alone });
    }

    /// Writes the hits of rays of which the distances are known, and in place of shapes the numbers of primitives.
    pub(super) fn complete_all(&self, rays: &RayRows, count: usize, hits: &mut HitRows) {
        for lane in 0..count.min(BATCH) {
            let prim = hits.shape[lane];
            if prim != NONE {
                self.complete(prim, rays, lane, hits);
            }
        }
    }

    /// Writes the hit of a ray, of which the distance is known, on the primitive with a number.
    #[inline(always)]
    pub fn complete(&self, number: u32, rays: &RayRows, lane: usize, hits: &mut HitRows) {
        let mut prim = &self.prims[number as usize];
        (hits.u[lane], hits.v[lane]) = (0.0, 0.0);
        if prim.is_triangle {
            let p = rays.origin.get(lane) + rays.direction.get(lane) * hits.t[lane];
            prim = &self.prims[number as usize + usize::from(prim.is_beyond(p))];
            [hits.u[lane], hits.v[lane]] = prim.barycentric(p);
        }
        (hits.shape[lane], hits.prim[lane], hits.instance[lane]) = (prim.shape.0, prim.id.0, Hit::NO_INSTANCE.0);
    }

    /// The distances at which some of the rays hit `count` triangles, computed in `f64`; negative on a miss.
    #[cold]
    #[inline(never)]
    fn exact(&self, first: u32, count: usize, lanes: LaneSet, rays: &RayPacket) -> [f32; PACKET_SIZE] {
        let mut distances = [-1.0; PACKET_SIZE];
        for lane in lanes.lanes() {
            // All distances, to be rounded before they are compared with the interval.
            let ray = TriangleRay::from(&Ray { t_min: 0.0, t_max: f32::INFINITY, ..rays.get(lane) });
            let triangles = self.prims[first as usize..][..count].iter().filter_map(|prim| self.triangle(prim));
            let hits = triangles.filter_map(|triangle| ray.intersect(&triangle));
            distances[lane] = hits.map(|hit| hit.t).min_by(f32::total_cmp).unwrap_or(-1.0);
        }
        distances
    }

    fn triangle(&self, prim: &PrimRecord) -> Option<TrianglePoints> {
        match self.geometry.shape(prim.shape) {
            Shape::Mesh(mesh) => Some(mesh.triangle_points(prim.id)),
            Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => None,
        }
    }

    /// Finds the closest hits of a packet, or `ANY` hits; `SHAPES` says whether there are analytic shapes.
    #[inline(always)]
    fn traverse<S: Simd, const ANY: bool, const SHAPES: bool>(&self, simd: S, packet: &mut Packet<S>) {
        let mut stack = ArrayVec::<u32, STACK>::new();
        let mut index = 0;
        loop {
            let node = &self.nodes[index as usize];
            let entering = packet.enter(simd, &node.bounds);
            if any(simd, entering) {
                match node.content {
                    NodeContent::Nodes { children, axis } => {
                        let is_negative = usize::from(packet.is_negative[axis as usize]);
                        stack.push(children[1 - is_negative]);
                        index = children[is_negative];
                        continue;
                    }
                    NodeContent::Primitives { first, count } => {
                        let run = &self.primitives[first as usize..(first + count) as usize];
                        if SHAPES {
                            self.intersect_run::<S, ANY>(simd, run, entering, packet);
                        } else {
                            // A loop: closures are inlined, and so vector code, only while they have one caller.
                            for primitive in run {
                                self.intersect_polygon::<S, ANY, false>(simd, primitive, packet);
                            }
                        }
                    }
                }
            }
            let Some(next) = stack.pop() else { return };
            index = next;
        }
    }

    /// Intersects the rays that enter a leaf with its primitives.
    #[inline(always)]
    fn intersect_run<S: Simd, const ANY: bool>(
        &self,
        simd: S,
        run: &[Primitive<'_>],
        entering: S::m32s,
        packet: &mut Packet<S>,
    ) {
        // First the boxes of shapes: side by side they take less time than one after the other.
        let mut lanes = [entering; MAX_PACKET_LEAF];
        let mut entered = 0;
        for (i, (primitive, lanes)) in run.iter().zip(&mut lanes).enumerate() {
            if let (Primitive::Shape(shape), 2..) = (primitive, run.len()) {
                *lanes = packet.enter(simd, &shape.bounds);
            }
            entered |= u32::from(any(simd, *lanes)) << i;
        }
        for i in set_bits(entered) {
            if let Primitive::Shape(shape) = &run[i] {
                self.intersect_shape::<S, ANY>(simd, shape, lanes[i % MAX_PACKET_LEAF], packet);
            } else {
                self.intersect_polygon::<S, ANY, true>(simd, &run[i], packet);
            }
        }
    }

    #[inline(always)]
    fn intersect_polygon<S: Simd, const ANY: bool, const SHAPES: bool>(
        &self,
        simd: S,
        primitive: &Primitive<'_>,
        packet: &mut Packet<S>,
    ) {
        let (found, prim) = match primitive {
            Primitive::Triangle(polygon) => {
                let exact = |lanes, rays: &RayPacket| self.exact(polygon.prim, 1, lanes, rays);
                (polygon.intersect(simd, packet, exact), polygon.prim)
            }
            Primitive::Quadrilateral(polygon) => {
                let exact = |lanes, rays: &RayPacket| self.exact(polygon.prim, 2, lanes, rays);
                (polygon.intersect(simd, packet, exact), polygon.prim)
            }
            Primitive::Shape(_) => return,
        };
        if let Some((is_hit, t)) = found {
            let exact = |lanes, prims: &[u32; PACKET_SIZE], rays: &RayPacket| self.exact_distances(lanes, prims, rays);
            packet.offer::<ANY, SHAPES>(simd, is_hit, Offer { t, reported: t, prim }, exact);
        }
    }

    #[inline(always)]
    fn intersect_shape<S: Simd, const ANY: bool>(
        &self,
        simd: S,
        shape: &PacketShape<'_>,
        entering: S::m32s,
        packet: &mut Packet<S>,
    ) {
        let s = simd;
        let lanes = s.and_m32s(entering, packet.is_open(s));
        let IntervalHits { low, high, is_hit, may_hit } = shape.intersect::<S, ANY>(s, packet, lanes);
        let is_unclear = packet.offer_interval::<ANY>(s, is_hit, [low, high], shape.prim);
        let undecided = s.and_m32s(lanes, s.or_m32s(may_hit, is_unclear));
        if any(s, undecided) {
            let distances = distances(shape.placed, LaneSet::of(s, undecided), &packet.rays(s));
            let t = load(s, &distances, 0);
            let is_hit = s.greater_than_or_equal_f32s(t, s.splat_f32s(0.0));
            let hit = Offer { t, reported: s.select_f32s(is_unclear, low, t), prim: shape.prim };
            packet.offer::<ANY, true>(s, is_hit, hit, |lanes, prims, rays| self.exact_distances(lanes, prims, rays));
        }
    }

    /// The distances in `f64` at which some of the rays hit the analytic shapes with these numbers.
    #[cold]
    #[inline(never)]
    fn exact_distances(&self, lanes: LaneSet, prims: &[u32; PACKET_SIZE], rays: &RayPacket) -> [f32; PACKET_SIZE] {
        let mut distances = [f32::INFINITY; PACKET_SIZE];
        for lane in lanes.lanes() {
            if let Some(t) = self.exact_distance(self.prims[prims[lane] as usize].shape, &rays.get(lane)) {
                distances[lane] = t;
            }
        }
        distances
    }

    /// Replaces the distances of hits on analytic shapes by those in `f64`.
    pub fn set_exact_distances(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            if let Some(hit) = hit
                && let Some(t) = self.exact_distance(hit.shape, ray)
            {
                hit.t = t;
            }
        }
    }

    /// The distance in `f64` at which a ray hits the primitive with a number, if that is an analytic shape.
    pub fn exact_distance_to(&self, prim: u32, ray: &Ray) -> Option<f32> {
        self.exact_distance(self.prims[prim as usize].shape, ray)
    }

    /// The distance in `f64` at which a ray hits an analytic shape.
    fn exact_distance(&self, shape: ShapeId, ray: &Ray) -> Option<f32> {
        match self.geometry.shape(shape) {
            Shape::Analytic(placed) => placed.intersect(ray).map(|hit| hit.t as f32),
            Shape::Mesh(_) | Shape::Curves(_) | Shape::Points(_) => None,
        }
    }
}

/// Fewer rays are intersected with analytic shapes one by one.
const MIN_PACKET_RAYS: u32 = 3;

/// The distances in `f64` at which some rays hit a shape; negative on a miss, and for the others.
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

fn run<K: WithSimd>(kernel: K) -> K::Output {
    if let Some(simd) = V4::try_new() {
        Simd::vectorize(simd, kernel)
    } else if let Some(simd) = V3::try_new() {
        Simd::vectorize(simd, kernel)
    } else {
        Simd::vectorize(Scalar::new(), kernel)
    }
}

/// Lanes of rays that do not fit into packets.
pub(in crate::accel) type LeftOut = ArrayVec<u8, BATCH>;

/// What rays hit first.
pub(in crate::accel) struct PacketHitRows {
    /// Distances, as of [`HitRows`].
    pub t: Row,
    /// The numbers of the primitives, or [`HitRows::MISS`].
    pub prims: Row<u32>,
    /// Upper limits of the distances, or the ends of the rays that hit nothing.
    pub ends: Row,
}

const _: () = assert!(NONE == HitRows::MISS);

/// `WITHIN`: with upper limits of the distances, over analytic shapes.
pub(super) struct Closest<'a, const WITHIN: bool> {
    pub hierarchy: &'a Hierarchy<'a>,
    pub rays: &'a RayRows,
    pub count: usize,
    pub t: &'a mut Row,
    pub prims: &'a mut Row<u32>,
    /// The limits; not written without `WITHIN`.
    pub ends: &'a mut Row,
    pub left_out: &'a mut LeftOut,
}

impl<const WITHIN: bool> WithSimd for Closest<'_, WITHIN> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { hierarchy, rays, count, t, prims, ends, left_out } = self;
        for first in (0..count).step_by(S::F32_LANES) {
            let (mut packet, outside) = Packet::new(simd, &hierarchy.sphere, rays, first, count - first);
            let has_shapes = WITHIN || hierarchy.has_shapes;
            if has_shapes {
                hierarchy.traverse::<S, false, true>(simd, &mut packet);
            } else {
                hierarchy.traverse::<S, false, false>(simd, &mut packet);
            }
            let reported = if has_shapes { packet.reported } else { packet.t };
            store_f32s(simd, reported, &mut t[first..]);
            store_u32s(simd, packet.prim, &mut prims[first..]);
            if WITHIN {
                store_f32s(simd, packet.t, &mut ends[first..]);
            }
            left_out.extend(outside.lanes().map(|lane| (first + lane) as u8));
        }
    }
}

pub(super) struct Occluded<'a, F> {
    pub hierarchy: &'a Hierarchy<'a>,
    pub rays: &'a RayRows,
    pub count: usize,
    pub occluded: &'a mut [bool; BATCH],
    pub alone: F,
}

impl<F: Fn(&Ray) -> bool> WithSimd for Occluded<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { hierarchy, rays, count, occluded, alone } = self;
        for first in (0..count).step_by(S::F32_LANES) {
            let (mut packet, left_out) = Packet::new(simd, &hierarchy.sphere, rays, first, count - first);
            if hierarchy.has_shapes {
                hierarchy.traverse::<S, true, true>(simd, &mut packet);
            } else {
                hierarchy.traverse::<S, true, false>(simd, &mut packet);
            }
            let is_hit = LaneSet::of(simd, simd.less_than_u32s(packet.prim, simd.splat_u32s(NONE)));
            for (lane, occluded) in occluded[first..count].iter_mut().take(S::F32_LANES).enumerate() {
                *occluded = is_hit.contains(lane);
            }
            for lane in left_out.lanes() {
                occluded[first + lane] = alone(&rays.get(first + lane));
            }
        }
    }
}
