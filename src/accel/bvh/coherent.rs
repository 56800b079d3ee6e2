//! Packets of coherent rays through the wide hierarchy: as many rays as a vector has lanes.
//!
//! Interval arithmetic finds the children that any ray of a packet may meet, whose boxes are tested with all its rays
//! side by side. At leaves, `f32` excludes rays that miss a triangle by more than a bound of its errors; the others are
//! tested in `f64`. Answers are those of single rays, bit for bit.

use pulp::Simd;
use pulp::x86::{V3, V4};

use super::Bvh;
use super::batch::{PreparedRows, Scratch};
use super::best_hits::BestHits;
use super::lanes::SimdIsa;
use super::wide::{Block, Child, ChildKind, STACK, WIDTH, Wide, WideNode};
use crate::accel::inspect::ItemKind;
use crate::accel::packet::{Vector, load, load_vector, store_f32s};
use crate::accel::tree::{Answers, Batch};
use crate::geometry::{Hit, TriangleHit, TrianglePoints};
use crate::math::compact::set_bits;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::rows::{BATCH, Row, WIDTH as MAX_LANES};
use crate::math::{DVec3, RayRows};

/// Rays with larger reciprocals of directions are not traced in packets: a product of one and zero is NaN.
const LARGEST_RECIPROCAL: f32 = 1e30;

/// Rays that are tested together in `f64`.
const F64_LANES: usize = 8;

/// Of fewer rays, each is tested alone in `f64`.
const MIN_F64_RAYS: u32 = 2;

/// Packets are faster where at least this part of their rays enters the nodes and leaves that they visit.
const MIN_OCCUPANCY: f32 = 0.28;

/// Where packets are slower, one of so many batches is traced in packets, to measure them again.
const PERIOD: u32 = 16;

/// An instruction set with vectors of a packet's rays.
pub(super) trait PacketIsa: Simd {
    /// A bit for each lane.
    fn bits(self, mask: Self::m32s) -> u32;

    /// The instructions for the eight boxes of a node.
    fn for_boxes(self) -> V3;
}

impl PacketIsa for V3 {
    #[inline(always)]
    fn for_boxes(self) -> V3 {
        self
    }

    #[inline(always)]
    fn bits(self, mask: Self::m32s) -> u32 {
        self.avx._mm256_movemask_ps(pulp::cast(mask)) as u32 & 255
    }
}

impl PacketIsa for V4 {
    #[inline(always)]
    fn for_boxes(self) -> V3 {
        *self
    }

    #[inline(always)]
    fn bits(self, mask: Self::m32s) -> u32 {
        mask.0.into()
    }
}

/// How many rays of packets enter the nodes and leaves that these visit: moving sums.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Occupancy {
    lanes: f32,
    entering: f32,
    batches: u32,
}

impl Occupancy {
    /// Whether the next batch is to be traced in packets.
    fn next(&mut self) -> bool {
        self.batches = self.batches.wrapping_add(1);
        self.entering >= MIN_OCCUPANCY * self.lanes || self.batches.is_multiple_of(PERIOD)
    }

    /// Adds a batch, of which so many lanes of visits had rays that enter.
    fn add(&mut self, lanes: u32, entering: u32) {
        self.lanes = 0.875 * self.lanes + lanes as f32;
        self.entering = 0.875 * self.entering + entering as f32;
    }
}

/// Children that wait.
#[repr(align(64))]
pub(super) struct PacketStack {
    /// Where each ray enters: NaN where it does not.
    near: [[f32; MAX_LANES]; STACK + WIDTH],
    children: [Child; STACK + WIDTH],
    len: usize,
}

impl Default for PacketStack {
    fn default() -> Self {
        Self { near: [[0.0; MAX_LANES]; STACK + WIDTH], children: [Child::NONE; STACK + WIDTH], len: 0 }
    }
}

impl PacketStack {
    #[inline(always)]
    fn push<S: Simd>(&mut self, simd: S, near: S::f32s, child: Child) {
        // There is room: `Bvh::wide` bounds the depth.
        store_f32s(simd, near, &mut self.near[self.len]);
        self.children[self.len] = child;
        self.len += 1;
    }

    /// Takes entries from the top, up to one that some ray enters before its `t_max`, and which do.
    #[inline(always)]
    fn pop<S: PacketIsa>(&mut self, simd: S, t_max: S::f32s) -> Option<(Child, u32)> {
        while self.len > 0 {
            self.len -= 1;
            let near = load(simd, &self.near[self.len], 0);
            let entering = simd.bits(simd.less_than_or_equal_f32s(near, t_max));
            if entering != 0 {
                return Some((self.children[self.len], entering));
            }
        }
        None
    }
}

/// A packet: what is prepared of its rays, as in [`SlabRay`](crate::accel::tree::SlabRay) and
/// [`Shear`](crate::geometry::Shear).
struct Packet<S: Simd> {
    near_origin: Vector<S>,
    near_reciprocal: Vector<S>,
    far_origin: Vector<S>,
    far_reciprocal: Vector<S>,
    t_min: S::f32s,
    shear: [S::f32s; 2],
    /// Along the axes of the shear.
    origin: Vector<S>,
    /// Those axes.
    axes: [usize; 3],
    /// The most by which a coordinate of a sheared corner is off, by rounding.
    error: S::f32s,
    /// A bit for each axis along which all rays point towards smaller coordinates.
    octant: usize,
}

impl<S: PacketIsa> Packet<S> {
    #[inline(always)]
    fn new(simd: S, wide: &Wide, batch: &Batch<'_, '_, Bvh>, prepared: &PreparedRows, first: usize) -> Self {
        let (s, rays) = (simd, batch.rays);
        let [mut sx, mut sy] = [[0.0; MAX_LANES]; 2];
        let mut reach = wide.bounds.min.abs().max(wide.bounds.max.abs()).max_element();
        for i in 0..S::F32_LANES {
            sx[i] = prepared.shears.sx[first + i] as f32;
            sy[i] = prepared.shears.sy[first + i] as f32;
            reach = reach.max(rays.origin.get(first + i).abs().max_element());
        }
        let axes = prepared.triangle_ray(first, rays, 0.0).axes();
        let slabs = &prepared.slabs;
        Self {
            near_origin: load_vector(s, &slabs.near_origin.0, first),
            near_reciprocal: load_vector(s, &slabs.near_reciprocal.0, first),
            far_origin: load_vector(s, &slabs.far_origin.0, first),
            far_reciprocal: load_vector(s, &slabs.far_reciprocal.0, first),
            t_min: load(s, &rays.t_min, first),
            shear: [load(s, &sx, 0), load(s, &sy, 0)],
            origin: axes.map(|axis| load(s, &rays.origin.0[axis], first)),
            axes,
            // The corner, seen from the origin, is within twice the reach; it has one rounding, as have its shear,
            // which is at most 1, and their difference.
            error: s.splat_f32s((12.0 * UNIT_ROUNDOFF) as f32 * 2.0 * reach),
            octant: slabs.negative[first] as usize % 8,
        }
    }

    /// Where each ray enters the box of a child before `t_max`, else NaN; and which rays do.
    #[inline(always)]
    fn enter(&self, simd: S, node: &WideNode, slot: usize, t_max: S::f32s) -> (S::f32s, u32) {
        let s = simd;
        let (mut near, mut far) = (self.t_min, t_max);
        for axis in 0..3 {
            let row = 2 * axis + (self.octant >> axis & 1);
            let a = s.sub_f32s(s.splat_f32s(node.planes[row][slot]), self.near_origin[axis]);
            let b = s.sub_f32s(s.splat_f32s(node.planes[row ^ 1][slot]), self.far_origin[axis]);
            near = s.max_f32s(s.mul_f32s(a, self.near_reciprocal[axis]), near);
            far = s.min_f32s(s.mul_f32s(b, self.far_reciprocal[axis]), far);
        }
        let is_entering = s.less_than_or_equal_f32s(near, far);
        (s.select_f32s(is_entering, near, s.splat_f32s(f32::NAN)), s.bits(is_entering))
    }

    /// The rays that may hit a triangle of a block.
    #[inline(always)]
    fn may_hit(&self, simd: S, block: &Block, triangle: usize) -> u32 {
        let s = simd;
        let zero = s.splat_f32s(0.0);
        let [mut x, mut y] = [[zero; 3]; 2];
        // Of a product of two coordinates, the error is at most that of a coordinate times the sum of both, and its own
        // rounding, which is as small.
        let mut sum = s.add_f32s(self.error, self.error);
        for (corner, rows) in block.corners.iter().enumerate() {
            let [px, py, pz] = [0, 1, 2].map(|k: usize| rows[self.axes[k]][triangle]);
            let z = s.sub_f32s(s.splat_f32s(pz), self.origin[2]);
            x[corner] = s.negate_mul_add_f32s(self.shear[0], z, s.sub_f32s(s.splat_f32s(px), self.origin[0]));
            y[corner] = s.negate_mul_add_f32s(self.shear[1], z, s.sub_f32s(s.splat_f32s(py), self.origin[1]));
            sum = s.add_f32s(sum, s.add_f32s(s.abs_f32s(x[corner]), s.abs_f32s(y[corner])));
        }
        let u = s.negate_mul_add_f32s(y[2], x[1], s.mul_f32s(x[2], y[1]));
        let v = s.negate_mul_add_f32s(y[0], x[2], s.mul_f32s(x[0], y[2]));
        let w = s.negate_mul_add_f32s(y[1], x[0], s.mul_f32s(x[1], y[0]));
        // Products may be too small for f32.
        let error = s.mul_add_f32s(self.error, sum, s.splat_f32s(1e-36));
        let is_negative = s.less_than_f32s(s.min_f32s(u, s.min_f32s(v, w)), s.neg_f32s(error));
        let is_positive = s.greater_than_f32s(s.max_f32s(u, s.max_f32s(v, w)), error);
        !s.bits(s.and_m32s(is_negative, is_positive))
    }
}

/// Limits of what is prepared of a packet's rays.
struct Limits {
    near_origin: [f32; 3],
    near_reciprocal: [[f32; 2]; 3],
    far_origin: [f32; 3],
    far_reciprocal: [[f32; 2]; 3],
    t_min: f32,
    octant: usize,
}

impl Limits {
    #[inline(always)]
    fn new<S: Simd>(simd: S, packet: &Packet<S>) -> Self {
        let s = simd;
        let [mut near_origin, mut far_origin] = [[0.0; 3]; 2];
        let [mut near_reciprocal, mut far_reciprocal] = [[[0.0; 2]; 3]; 2];
        for axis in 0..3 {
            let (near, far) = (packet.near_origin[axis], packet.far_origin[axis]);
            // The nearest entry is from the origin farthest along the axis, the farthest exit from the least.
            if packet.octant >> axis & 1 == 0 {
                (near_origin[axis], far_origin[axis]) = (s.reduce_max_f32s(near), s.reduce_min_f32s(far));
            } else {
                (near_origin[axis], far_origin[axis]) = (s.reduce_min_f32s(near), s.reduce_max_f32s(far));
            }
            let (near, far) = (packet.near_reciprocal[axis], packet.far_reciprocal[axis]);
            near_reciprocal[axis] = [s.reduce_min_f32s(near), s.reduce_max_f32s(near)];
            far_reciprocal[axis] = [s.reduce_min_f32s(far), s.reduce_max_f32s(far)];
        }
        let t_min = s.reduce_min_f32s(packet.t_min);
        Self { near_origin, near_reciprocal, far_origin, far_reciprocal, t_min, octant: packet.octant }
    }

    /// The slots of children that any ray may meet before `t_max`, far ones first, and how many they are.
    #[inline(always)]
    fn enter(&self, simd: V3, node: &WideNode, t_max: f32) -> ([usize; WIDTH], usize) {
        let s = simd.avx;
        let (mut near, mut far) = (s._mm256_set1_ps(self.t_min), s._mm256_set1_ps(t_max));
        for axis in 0..3 {
            let row = 2 * axis + (self.octant >> axis & 1);
            let a = s._mm256_sub_ps(pulp::cast(node.planes[row]), s._mm256_set1_ps(self.near_origin[axis]));
            let b = s._mm256_sub_ps(pulp::cast(node.planes[row ^ 1]), s._mm256_set1_ps(self.far_origin[axis]));
            // A product is least and greatest at the limits of its factor.
            let [low, high] = self.near_reciprocal[axis].map(|limit| s._mm256_mul_ps(a, s._mm256_set1_ps(limit)));
            near = s._mm256_max_ps(s._mm256_min_ps(low, high), near);
            let [low, high] = self.far_reciprocal[axis].map(|limit| s._mm256_mul_ps(b, s._mm256_set1_ps(limit)));
            far = s._mm256_min_ps(s._mm256_max_ps(low, high), far);
        }
        let is_missed = s._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_NLE_UQ }>(near, far);
        let (entries, count) = simd.ordered(pulp::cast(is_missed), node.orders[self.octant], &Child::SLOTS);
        (entries.map(|entry| entry.child().node_index()), count as usize)
    }
}

/// Whether rays from `first` on fit into a packet: all are valid, of one octant, and largest along the same axis.
#[inline(always)]
fn is_coherent(prepared: &PreparedRows, first: usize, lanes: usize) -> bool {
    let PreparedRows { slabs, axes, is_valid, .. } = prepared;
    let mut is_other = false;
    for lane in first..first + lanes {
        is_other |= (slabs.negative[lane] != slabs.negative[first]) | (axes[lane] != axes[first]);
        is_other |= is_valid[lane] == 0;
        let size = slabs.far_reciprocal.get(lane).abs();
        is_other |= !(size.x < LARGEST_RECIPROCAL) | !(size.y < LARGEST_RECIPROCAL) | !(size.z < LARGEST_RECIPROCAL);
    }
    !is_other
}

/// Finds the closest hits of rays of a batch that fit into packets, in a scene without instances, and clears
/// [`PreparedRows::is_valid`] of these.
#[inline(always)]
pub(super) fn trace<S: PacketIsa>(
    simd: S,
    wide: &Wide,
    batch: &Batch<'_, '_, Bvh>,
    scratch: &mut Scratch,
    answers: &mut impl Answers,
) {
    if !scratch.occupancy.next() {
        return;
    }
    let Scratch { prepared, packets, keys, t_max, .. } = scratch;
    let best = BestHits { accel: batch.accel, keys, t_max, answers };
    let mut tracer = Tracer { simd, wide, batch, prepared, best, lanes: 0, entering: 0 };
    for first in (0..batch.count.min(BATCH)).step_by(S::F32_LANES) {
        if first + S::F32_LANES <= batch.count && is_coherent(tracer.prepared, first, S::F32_LANES) {
            tracer.trace(packets, first);
            tracer.prepared.is_valid[first..first + S::F32_LANES].fill(0);
        }
    }
    let (lanes, entering) = (tracer.lanes, tracer.entering);
    scratch.occupancy.add(lanes, entering);
}

struct Tracer<'t, 'r, 'a, S, A> {
    simd: S,
    wide: &'r Wide,
    batch: &'t Batch<'r, 'a, Bvh>,
    prepared: &'t mut PreparedRows,
    best: BestHits<'t, 'a, A>,
    /// Lanes of the packets at all nodes and leaves.
    lanes: u32,
    /// Those whose rays enter.
    entering: u32,
}

impl<S: PacketIsa, A: Answers> Tracer<'_, '_, '_, S, A> {
    /// Traces the packet of the rays from `first` on.
    #[inline(always)]
    fn trace(&mut self, stack: &mut PacketStack, first: usize) {
        let s = self.simd;
        let packet = Packet::new(s, self.wide, self.batch, self.prepared, first);
        let limits = Limits::new(s, &packet);
        let mut t_max = load(s, self.best.t_max, first);
        let mut last_t_max = s.reduce_max_f32s(t_max);
        let mut node = &self.wide.nodes[0];
        stack.len = 0;
        loop {
            let (slots, count) = limits.enter(s.for_boxes(), node, last_t_max);
            for &slot in &slots[..count] {
                let (near, entering) = packet.enter(s, node, slot % WIDTH, t_max);
                if entering != 0 {
                    stack.push(s, near, node.children[slot % WIDTH]);
                }
            }
            node = loop {
                let Some((child, entering)) = stack.pop(s, t_max) else { return };
                self.lanes += S::F32_LANES as u32;
                self.entering += entering.count_ones();
                if child.is_node() {
                    break &self.wide.nodes[child.node_index()];
                }
                self.test_leaf(&packet, child, entering, first);
                t_max = load(s, self.best.t_max, first);
                last_t_max = s.reduce_max_f32s(t_max);
            };
        }
    }

    /// Tests the rays that enter a leaf.
    #[inline(always)]
    fn test_leaf(&mut self, packet: &Packet<S>, leaf: Child, entering: u32, first: usize) {
        match leaf.kind() {
            ChildKind::Blocks { first: start, count } => {
                for block in &self.wide.blocks[start as usize..(start + count) as usize] {
                    self.test_block(packet, block, entering, first);
                }
            }
            ChildKind::Items { first: start, count } => {
                let items = &self.wide.items[start as usize..(start + count) as usize];
                for lane in set_bits(entering) {
                    let lane = (first + lane) % BATCH;
                    let ray = self.batch.rays.get(lane);
                    let triangle_ray = self.prepared.triangle_ray(lane, self.batch.rays, self.best.t_max[lane]);
                    self.best.test_items::<false>(lane, items, Hit::NO_INSTANCE, &ray, triangle_ray);
                }
            }
            ChildKind::Node(_) | ChildKind::Leave => {}
        }
    }

    /// Tests some of the packet's rays with the triangles of a block.
    #[inline(always)]
    fn test_block(&mut self, packet: &Packet<S>, block: &Block, entering: u32, first: usize) {
        for triangle in 0..(block.count as usize).min(block.items.len()) {
            let may_hit = packet.may_hit(self.simd, block, triangle) & entering;
            for part in (0..S::F32_LANES).step_by(F64_LANES) {
                let lanes = may_hit >> part & ((1 << F64_LANES) - 1);
                if lanes.count_ones() >= MIN_F64_RAYS {
                    self.test_together(packet, block, triangle, lanes, first + part);
                } else if lanes != 0 {
                    self.test_alone(block, triangle, first + part + lanes.trailing_zeros() as usize);
                }
            }
        }
    }

    /// Tests some of [`F64_LANES`] rays with a triangle in `f64`.
    #[inline(always)]
    fn test_together(&mut self, packet: &Packet<S>, block: &Block, triangle: usize, lanes: u32, first: usize) {
        let corners = block.corners.map(|rows| DVec3::from(packet.axes.map(|axis| f64::from(rows[axis][triangle]))));
        let hits = intersect(corners, self.prepared, self.batch.rays, self.best.t_max, first);
        for i in set_bits(hits.mask & lanes) {
            let hit = TriangleHit { t: hits.t[i % F64_LANES], u: hits.u[i % F64_LANES], v: hits.v[i % F64_LANES] };
            self.offer(block, triangle, hit, first + i);
        }
    }

    /// Tests the ray of a lane with a triangle.
    #[inline(always)]
    fn test_alone(&mut self, block: &Block, triangle: usize, lane: usize) {
        let [a, b, c] = block.corners.map(|rows| rows.map(|row| row[triangle]).into());
        let ray = self.prepared.triangle_ray(lane % BATCH, self.batch.rays, self.best.t_max[lane % BATCH]);
        if let Some(hit) = ray.intersect(&TrianglePoints { a, b, c }) {
            self.offer(block, triangle, hit, lane);
        }
    }

    #[inline(always)]
    fn offer(&mut self, block: &Block, triangle: usize, hit: TriangleHit, lane: usize) {
        let ItemKind::Prim(shape, prim) = block.items[triangle].kind() else { return };
        let hit = Hit { t: hit.t, u: hit.u, v: hit.v, shape, prim, instance: Hit::NO_INSTANCE };
        self.best.offer::<false>(lane % BATCH, &hit, || self.batch.rays.get(lane % BATCH));
    }
}

/// Which of some rays hit a triangle, where.
struct TriangleHits {
    mask: u32,
    t: [f32; F64_LANES],
    u: [f32; F64_LANES],
    v: [f32; F64_LANES],
}

/// [`TriangleRay::intersect`](crate::geometry::TriangleRay::intersect) for [`F64_LANES`] rays from `first` on, with the
/// very same operations.
#[inline(always)]
fn intersect(corners: [DVec3; 3], prepared: &PreparedRows, rays: &RayRows, t_max: &Row, first: usize) -> TriangleHits {
    let mut hits = TriangleHits { mask: 0, t: [0.0; F64_LANES], u: [0.0; F64_LANES], v: [0.0; F64_LANES] };
    let mut is_hit = [0; F64_LANES];
    for (i, is_hit) in is_hit.iter_mut().enumerate() {
        let lane = first + i;
        let shear = prepared.shears.get(lane);
        let edges = shear.edges(corners);
        let (determinant, t) = (edges.determinant(), edges.distance(shear.dz));
        let is_within = (f64::from(rays.t_min[lane]) <= t) & (t <= f64::from(t_max[lane]));
        *is_hit = u32::from(!edges.is_outside() & (determinant != 0.0) & is_within);
        hits.t[i] = t as f32;
        hits.u[i] = (edges.v / determinant) as f32;
        hits.v[i] = (edges.w / determinant) as f32;
    }
    hits.mask = is_hit.iter().enumerate().fold(0, |mask, (i, is_hit)| mask | is_hit << i);
    hits
}

#[cfg(test)]
mod tests;
