//! Packets through the hierarchy.

use arrayvec::ArrayVec;
use pulp::x86::{V3, V4};
use pulp::{Scalar, Simd, WithSimd};

use super::hierarchy::{Hierarchy, NodeContent, Primitive, STACK};
use super::lanes::{LaneSet, NONE, Packet, any};
use super::primitives::{PrimRecord, intersect_shape};
use crate::accel::HitRows;
use crate::geometry::{Hit, PACKET_SIZE, RayPacket, Shape, TrianglePoints, TriangleRay};
use crate::math::rows::BATCH;
use crate::math::{Ray, RayRows};

impl Hierarchy<'_> {
    /// Closest hits of the first `count` rays. Rays that do not fit into packets are traced by `alone`.
    pub fn intersect(&self, rays: &RayRows, count: usize, hits: &mut HitRows, alone: impl Fn(&Ray) -> Option<Hit>) {
        run(Closest { hierarchy: self, rays, count, hits, alone });
    }

    /// Whether the first `count` rays hit anything.
    pub fn occluded(&self, rays: &RayRows, count: usize, occluded: &mut [bool; BATCH], alone: impl Fn(&Ray) -> bool) {
        run(Occluded { hierarchy: self, rays, count, occluded, alone });
    }

    /// Writes the hit of a ray, of which the distance is known, on the primitive with a number.
    #[inline(always)]
    fn complete(&self, number: u32, rays: &RayRows, lane: usize, hits: &mut HitRows) {
        let p = rays.origin.get(lane) + rays.direction.get(lane) * hits.t[lane];
        let number = number + u32::from(self.prims[number as usize].is_beyond(p));
        let prim = &self.prims[number as usize];
        [hits.u[lane], hits.v[lane]] = prim.barycentric(p);
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
            Shape::Analytic(_) => None,
        }
    }

    #[inline(always)]
    fn traverse<S: Simd, const ANY: bool>(&self, simd: S, packet: &mut Packet<S>) {
        let mut stack = ArrayVec::<u32, STACK>::new();
        let mut index = 0;
        loop {
            let node = &self.nodes[index as usize];
            let entering = packet.enter(simd, node.low, node.high);
            if any(simd, entering) {
                match node.content {
                    NodeContent::Nodes { children, axis } => {
                        let is_negative = usize::from(packet.is_negative[axis as usize]);
                        stack.push(children[1 - is_negative]);
                        index = children[is_negative];
                        continue;
                    }
                    NodeContent::Primitives { first, count } => {
                        for primitive in &self.primitives[first as usize..(first + count) as usize] {
                            match primitive {
                                Primitive::Triangle(polygon) => {
                                    polygon.intersect::<S, ANY>(simd, packet, |lanes, rays| {
                                        self.exact(polygon.prim, 1, lanes, rays)
                                    });
                                }
                                Primitive::Quadrilateral(polygon) => {
                                    polygon.intersect::<S, ANY>(simd, packet, |lanes, rays| {
                                        self.exact(polygon.prim, 2, lanes, rays)
                                    });
                                }
                                Primitive::Shape(placed, prim) => {
                                    intersect_shape::<S, ANY>(simd, placed, *prim, LaneSet::of(simd, entering), packet);
                                }
                            }
                        }
                    }
                }
            }
            let Some(next) = stack.pop() else { return };
            index = next;
        }
    }
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

pub(super) struct Closest<'a, F> {
    pub hierarchy: &'a Hierarchy<'a>,
    pub rays: &'a RayRows,
    pub count: usize,
    pub hits: &'a mut HitRows,
    pub alone: F,
}

impl<F: Fn(&Ray) -> Option<Hit>> WithSimd for Closest<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { hierarchy, rays, count, hits, alone } = self;
        for first in (0..count).step_by(S::F32_LANES) {
            let (mut packet, left_out) = Packet::new(simd, &hierarchy.sphere, rays, first, count - first);
            hierarchy.traverse::<S, false>(simd, &mut packet);
            let lanes = first..first + S::F32_LANES;
            simd.partial_store_f32s(&mut hits.t[lanes.clone()], packet.t);
            simd.partial_store_u32s(&mut hits.shape[lanes.clone()], packet.prim);
            for lane in lanes {
                let number = hits.shape[lane];
                if number != NONE {
                    hierarchy.complete(number, rays, lane, hits);
                }
            }
            for lane in left_out.lanes() {
                hits.set(first + lane, alone(&rays.get(first + lane)));
            }
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
            hierarchy.traverse::<S, true>(simd, &mut packet);
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
