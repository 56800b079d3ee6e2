//! Interleaved traversal of the wide hierarchy: while the memory that one ray needs is on its way, others advance.
//!
//! Rays are prepared in rows. Then up to [`SLOTS`] are traversed at once: a round opens a node for each ray that is
//! at one, and tests a leaf for each ray that is at one. Loops without branches compute, and others take what was found
//! from memory: a branch right after a long chain of operations would be known to be wrong only at its end. What a ray
//! needs in the next round is prefetched. A ray that meets an instance goes on in the object's hierarchy, until the
//! entry on its stack that returns it to the world's. Answers are those of single rays, bit for bit.

use std::cell::RefCell;
use std::hint::select_unpredictable;

use super::Bvh;
use super::any_hit_order::{AnyHitOrder, MeasuredOrders};
use super::best_hits::BestHits;
use super::coherent::{Occupancy, PacketStack};
use super::lanes::{BlockHits, SimdIsa, WideRay};
use super::wide::{Child, Entry, STACK, WIDTH, Wide, WideNode};
use crate::accel::inspect::{Item, ItemKind};
use crate::accel::tree::{Answers, Batch, SlabRay, SlabRows};
use crate::geometry::{Hit, Shear, ShearRows, TriangleHit, TriangleRay, largest_axis};
use crate::id::InstanceId;
use crate::math::compact::set_bits;
use crate::math::prefetch::{address, prefetch_lines};
use crate::math::rows::{BATCH, Row, WIDTH as ROW_WIDTH, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Aabb, Ray, RayRows};

/// Rays that are traversed at once: a bit each.
const SLOTS: usize = 32;

/// Lines of the caches that a node fills; a block fills one less.
const PREFETCHED_LINES: usize = size_of::<WideNode>() / 64;

/// What is found of rays before they are traced.
pub(super) struct PreparedRows {
    pub slabs: SlabRows,
    pub shears: ShearRows,
    pub axes: Row<u32>,
    /// Zero also where a ray is answered.
    pub is_valid: Row<u32>,
}

/// What one thread needs to trace batches.
pub(super) struct Scratch {
    pub prepared: PreparedRows,
    pub packets: PacketStack,
    pub occupancy: Occupancy,
    /// Of rays in instances, in their spaces.
    in_object: PreparedRows,
    object_rays: RayRows,
    pub t_max: Row,
    pub keys: Row<u32>,
    /// The node or leaf that each ray visits next.
    next: [Child; BATCH],
    /// On the triangles that each ray is at.
    hits: [BlockHits; SLOTS],
    stacks: [Stack; SLOTS],
    any_hit_orders: MeasuredOrders,
}

thread_local! {
    static SCRATCH: RefCell<Box<Scratch>> = RefCell::default();
}

/// Calls `trace` with the memory of this thread.
pub(super) fn with_scratch(trace: impl FnOnce(&mut Scratch)) {
    SCRATCH.with_borrow_mut(|scratch| trace(scratch));
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            prepared: PreparedRows::default(),
            packets: PacketStack::default(),
            occupancy: Occupancy::default(),
            in_object: PreparedRows::default(),
            object_rays: RayRows::default(),
            t_max: [0.0; BATCH],
            keys: [0; BATCH],
            next: [Child::ROOT; BATCH],
            hits: [BlockHits::NONE; SLOTS],
            stacks: [Stack { entries: [Entry::NONE; MAX_ENTRIES], len: 0 }; SLOTS],
            any_hit_orders: MeasuredOrders::default(),
        }
    }
}

impl Scratch {
    /// Prepares the rays of a batch, none of which has been answered.
    pub fn prepare(&mut self, wide: &Wide, batch: &Batch<'_, '_, Bvh>, answers: &mut impl Answers) {
        let rays = batch.rays;
        let count = whole_vectors(batch.count);
        vectorize!(self.prepared.set(wide, batch, count));
        self.t_max = rays.t_max;
        self.next = [Child::ROOT; BATCH];
        let cutouts = &batch.accel.geometry().cutouts;
        for (i, keys) in self.keys.chunks_mut(ROW_WIDTH).enumerate().take(count / ROW_WIDTH) {
            cutouts.set_keys(rays, i * ROW_WIDTH, keys);
        }
        for lane in 0..batch.count.min(BATCH) {
            answers.set(lane, None);
        }
    }
}

impl Default for PreparedRows {
    fn default() -> Self {
        Self { slabs: SlabRows::default(), shears: ShearRows::default(), axes: [0; BATCH], is_valid: [0; BATCH] }
    }
}

impl PreparedRows {
    #[inline(always)]
    fn set(&mut self, wide: &Wide, batch: &Batch<'_, '_, Bvh>, count: usize) {
        let rays = batch.rays;
        for lane in 0..count {
            let ray = rays.get(lane);
            self.slabs.set(lane, &SlabRay::new(&ray, &wide.bounds, batch.accel.instance_slack(&ray)));
        }
        for lane in 0..count {
            self.is_valid[lane] = rays.get(lane).is_valid().into();
            self.axes[lane] = largest_axis(rays.direction.get(lane));
        }
        for lane in 0..count {
            let (origin, direction) = (rays.origin.get(lane), rays.direction.get(lane));
            self.shears.set(lane, &Shear::new(origin, direction, self.axes[lane]));
        }
    }

    /// Sets one ray, for boxes within `bounds`.
    #[inline(always)]
    fn set_one(&mut self, lane: usize, ray: &Ray, bounds: &Aabb) {
        self.slabs.set(lane, &SlabRay::new(ray, bounds, 0.0));
        self.axes[lane] = largest_axis(ray.direction);
        self.shears.set(lane, &Shear::new(ray.origin, ray.direction, self.axes[lane]));
    }

    /// The ray of a lane up to `t_max`, prepared for triangles. `rays` have the others of its limits.
    #[inline(always)]
    pub fn triangle_ray(&self, lane: usize, rays: &RayRows, t_max: f32) -> TriangleRay {
        let (t_min, t_max) = (rays.t_min[lane].into(), t_max.into());
        TriangleRay { kz: self.axes[lane], shear: self.shears.get(lane), t_min, t_max }
    }
}

/// The most entries that wait: those of the world and of an object, one between, and what is stored beyond the top.
const MAX_ENTRIES: usize = 2 * STACK + 2 * WIDTH;

/// Children that wait. Not a power of two long: else the tops of all stacks were in the same few sets of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Stack {
    entries: [Entry; MAX_ENTRIES],
    len: usize,
}

impl Stack {
    /// Adds the first `count` entries.
    #[inline(always)]
    fn push(&mut self, entries: [Entry; WIDTH], count: u32) {
        // There is room: `Bvh::wide` bounds the depth.
        self.entries[self.len..self.len + WIDTH].copy_from_slice(&entries);
        self.len += count as usize;
    }

    /// Adds the entry at which a ray leaves an instance, wherever its closest hit is.
    #[inline(always)]
    fn push_leave(&mut self) {
        self.entries[self.len] = Entry::new(f32::NEG_INFINITY, Child::LEAVE);
        self.len += 1;
    }

    /// Takes entries from the top, up to one that is entered before `t_max`.
    #[inline(always)]
    fn pop(&mut self, t_max: f32) -> Option<Child> {
        while self.len > 0 {
            self.len -= 1;
            let entry = self.entries[self.len];
            if entry.near() <= t_max {
                return Some(entry.child());
            }
        }
        None
    }
}

/// Which slots have a ray at a node, at triangles, and at other items: a bit for each slot, by [`Child::tag`].
type Places = [u32; 4];

/// The hierarchy that a ray is in: that of the world, or of an object.
#[derive(Clone, Copy)]
struct Space<'r> {
    wide: &'r Wide,
    instance: InstanceId,
}

/// The closest hits of rays that are prepared and not answered, or `ANY` hits, in a scene with or without `INSTANCES`.
#[inline(always)]
pub(super) fn trace<'r, L: SimdIsa, const ANY: bool, const INSTANCES: bool>(
    lanes: L,
    wide: &'r Wide,
    batch: &Batch<'r, '_, Bvh>,
    scratch: &mut Scratch,
    answers: &mut impl Answers,
) {
    let count = batch.count.min(BATCH);
    let any_hit_order = if ANY { scratch.any_hit_orders.next() } else { AnyHitOrder::Distance };
    let world = Space { wide, instance: Hit::NO_INSTANCE };
    let mut tracer = Tracer::<_, INSTANCES> {
        world,
        spaces: [world; SLOTS],
        batch,
        scratch,
        answers,
        any_hit_order,
        places: [0; 4],
        ended: u32::MAX,
    };
    let mut steps = 0;
    let mut lane_of = [0; SLOTS];
    let mut rest = 0..count;
    loop {
        for slot in set_bits(std::mem::take(&mut tracer.ended)) {
            let Some(lane) = rest.find(|&lane| tracer.scratch.prepared.is_valid[lane] != 0) else { break };
            lane_of[slot] = lane;
            tracer.scratch.stacks[slot].len = 0;
            if INSTANCES {
                tracer.spaces[slot] = world;
            }
            tracer.places[Child::ROOT.tag()] |= 1 << slot;
        }
        let [nodes, blocks, items, _] = std::mem::take(&mut tracer.places);
        if nodes | blocks | items == 0 {
            break;
        }
        steps += nodes.count_ones() + blocks.count_ones() + items.count_ones();
        tracer.open_nodes::<L, ANY>(lanes, nodes, &lane_of);
        tracer.test_blocks::<L, ANY>(lanes, blocks, &lane_of);
        for slot in set_bits(items) {
            tracer.test_items::<ANY>(slot, lane_of[slot] % BATCH);
        }
    }
    if ANY {
        scratch.any_hit_orders.add(any_hit_order, count, steps);
    }
}

struct Tracer<'t, 'r, 'a, A, const INSTANCES: bool> {
    world: Space<'r>,
    /// Of each slot, with `INSTANCES`.
    spaces: [Space<'r>; SLOTS],
    batch: &'t Batch<'r, 'a, Bvh>,
    scratch: &'t mut Scratch,
    answers: &'t mut A,
    any_hit_order: AnyHitOrder,
    places: Places,
    /// Slots whose rays are answered.
    ended: u32,
}

impl<'r, A: Answers, const INSTANCES: bool> Tracer<'_, 'r, '_, A, INSTANCES> {
    #[inline(always)]
    fn space(&self, slot: usize) -> Space<'r> {
        if INSTANCES { self.spaces[slot] } else { self.world }
    }

    #[inline(always)]
    fn is_in_object(&self, slot: usize) -> bool {
        INSTANCES && self.spaces[slot].instance != Hit::NO_INSTANCE
    }

    /// The ray in the space it is in.
    #[inline(always)]
    fn ray(&self, slot: usize, lane: usize) -> Ray {
        let rays = if self.is_in_object(slot) { &self.scratch.object_rays } else { self.batch.rays };
        rays.get(lane)
    }

    /// What is known of the ray in the space it is in.
    #[inline(always)]
    fn prepared(&self, slot: usize) -> &PreparedRows {
        if self.is_in_object(slot) { &self.scratch.in_object } else { &self.scratch.prepared }
    }

    /// Opens the nodes that rays are at, and goes on with all of them.
    #[inline(always)]
    fn open_nodes<L: SimdIsa, const ANY: bool>(&mut self, lanes: L, slots: u32, lane_of: &[usize; SLOTS]) {
        for slot in set_bits(slots) {
            self.open::<L, ANY>(lanes, slot, lane_of[slot] % BATCH);
        }
        for slot in set_bits(slots) {
            self.advance(slot, lane_of[slot] % BATCH);
        }
    }

    /// Opens the node that a ray is at.
    #[inline(always)]
    fn open<L: SimdIsa, const ANY: bool>(&mut self, lanes: L, slot: usize, lane: usize) {
        let wide = self.space(slot).wide;
        let node = &wide.nodes[self.scratch.next[lane].node_index()];
        let slabs = &self.prepared(slot).slabs;
        let ray = WideRay::new(slabs.get(lane));
        // Not a negative zero: bits of distances are compared.
        let t_min = self.batch.rays.t_min[lane] + 0.0;
        let (_, enter) = lanes.enter(node, &ray, t_min, self.scratch.t_max[lane]);
        let order = if ANY && self.any_hit_order == AnyHitOrder::Occlusion {
            WideNode::BY_SLOT
        } else {
            node.orders[slabs.negative[lane] as usize % 8]
        };
        let (entries, count) = lanes.ordered(enter, order, &node.children);
        self.scratch.stacks[slot].push(entries, count);
    }

    /// Tests the triangles that rays are at, and goes on with those that are not answered.
    #[inline(always)]
    fn test_blocks<L: SimdIsa, const ANY: bool>(&mut self, lanes: L, slots: u32, lane_of: &[usize; SLOTS]) {
        let mut rest = slots;
        let mut index = 0;
        while rest != 0 {
            let (mut hit, mut more) = (0, 0);
            for slot in set_bits(rest) {
                let lane = lane_of[slot] % BATCH;
                let (first, count) = self.scratch.next[lane].run_of_items();
                let block = &self.space(slot).wide.blocks[first + index];
                let hits = lanes.intersect(block, &self.triangle_ray(slot, lane));
                hit |= u32::from(hits.mask != 0) << slot;
                more |= u32::from(index + 1 < count) << slot;
                self.scratch.hits[slot] = hits;
            }
            for slot in set_bits(hit) {
                if self.offer::<ANY>(slot, lane_of[slot] % BATCH, index) {
                    self.ended |= 1 << slot;
                }
            }
            rest = more & !self.ended;
            index += 1;
        }
        for slot in set_bits(slots & !self.ended) {
            self.advance(slot, lane_of[slot] % BATCH);
        }
    }

    /// Tests the items other than triangles that a ray is at, and goes on if it is not answered.
    #[inline(always)]
    fn test_items<const ANY: bool>(&mut self, slot: usize, lane: usize) {
        let (first, count) = self.scratch.next[lane].run_of_items();
        let items = &self.space(slot).wide.items[first..first + count];
        if ANY && self.is_end_shape(items, slot, lane) {
            self.advance(slot, lane);
            return;
        }
        if INSTANCES
            && let [item] = items
            && let ItemKind::Instance(id) = item.kind()
        {
            if !self.enter(id, slot, lane) {
                self.advance(slot, lane);
            }
            return;
        }
        let (ray, triangle_ray) = (self.ray(slot, lane), self.triangle_ray(slot, lane));
        let instance = self.space(slot).instance;
        let Scratch { keys, t_max, .. } = &mut *self.scratch;
        let mut best = BestHits { accel: self.batch.accel, keys, t_max, answers: &mut *self.answers };
        if best.test_items::<ANY>(lane, items, instance, &ray, triangle_ray) {
            self.ended |= 1 << slot;
        } else {
            self.advance(slot, lane);
        }
    }

    /// Whether a leaf has nothing but the shape that a ray ends on.
    #[inline(always)]
    fn is_end_shape(&self, items: &[Item], slot: usize, lane: usize) -> bool {
        let (Some(end_shapes), [item]) = (self.batch.end_shapes, items) else { return false };
        let is_end_shape = matches!(item.kind(), ItemKind::Prim(shape, _) if shape.0 == end_shapes[lane]);
        is_end_shape && !self.is_in_object(slot)
    }

    /// Goes on to the first node of the hierarchy of an instance. False if no ray gets there.
    #[inline(never)]
    fn enter(&mut self, id: InstanceId, slot: usize, lane: usize) -> bool {
        let accel = self.batch.accel;
        let instance = accel.geometry().instance(id);
        let Some(wide) = accel.object(instance.object).as_wide() else { return false };
        let scratch = &mut *self.scratch;
        let ray = instance.object_ray(&Ray { t_max: scratch.t_max[lane], ..self.batch.rays.get(lane) });
        // A ray may leave the range of f32 on its way into a small object.
        if !ray.is_valid() {
            return false;
        }
        scratch.in_object.set_one(lane, &ray, &wide.bounds);
        scratch.object_rays.set(lane, &ray);
        scratch.stacks[slot].push_leave();
        scratch.next[lane] = Child::ROOT;
        self.spaces[slot] = Space { wide, instance: id };
        self.places[Child::ROOT.tag()] |= 1 << slot;
        prefetch_lines(address(&wide.nodes, 0), PREFETCHED_LINES);
        true
    }

    /// Goes on to what is on top of the stack.
    #[inline(always)]
    fn advance(&mut self, slot: usize, lane: usize) {
        let child = loop {
            let Some(child) = self.scratch.stacks[slot].pop(self.scratch.t_max[lane]) else {
                self.ended |= 1 << slot;
                return;
            };
            if !INSTANCES || child != Child::LEAVE {
                break child;
            }
            self.spaces[slot] = self.world;
        };
        self.scratch.next[lane] = child;
        self.places[child.tag()] |= 1 << slot;
        // Without a branch, which would be wrong half of the time. Of other items, an address that is not used.
        let wide = self.space(slot).wide;
        let (node, block) = (address(&wide.nodes, child.node_index()), address(&wide.blocks, child.first()));
        prefetch_lines(select_unpredictable(child.is_node(), node, block), PREFETCHED_LINES);
    }

    #[inline(always)]
    fn triangle_ray(&self, slot: usize, lane: usize) -> TriangleRay {
        self.prepared(slot).triangle_ray(lane, self.batch.rays, self.scratch.t_max[lane])
    }

    /// Takes the hits on the triangles that a ray is at. True if it is answered.
    #[inline(always)]
    fn offer<const ANY: bool>(&mut self, slot: usize, lane: usize, index: usize) -> bool {
        let (instance, is_in_object, wide) =
            (self.space(slot).instance, self.is_in_object(slot), self.space(slot).wide);
        let Scratch { next, hits, keys, t_max, object_rays, .. } = &mut *self.scratch;
        let (block, hits) = (&wide.blocks[next[lane].run_of_items().0 + index], &hits[slot]);
        let rays = if is_in_object { object_rays } else { self.batch.rays };
        let mut best = BestHits { accel: self.batch.accel, keys, t_max, answers: &mut *self.answers };
        for i in set_bits(hits.mask) {
            let ItemKind::Prim(shape, prim) = block.items[i].kind() else { continue };
            let TriangleHit { t, u, v } = hits.get(i);
            if best.offer::<ANY>(lane, &Hit { t, u, v, shape, prim, instance }, || rays.get(lane)) {
                return true;
            }
        }
        false
    }
}
