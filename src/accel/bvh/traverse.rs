//! Rays through the wide hierarchy, nearest boxes first.

use arrayvec::ArrayVec;

use super::Bvh;
use super::lanes::{SimdIsa, WideRay};
use super::wide::{Block, Child, ChildKind, STACK, Wide};
use crate::accel::inspect::ItemKind;
use crate::accel::tree::{Counter, Query, SlabRay};
use crate::geometry::{Hit, TriangleHit};

type Entry = (f32, Child);

/// [`Tree::traverse`](crate::accel::tree::Tree::traverse) with one instruction set.
#[inline(always)]
pub(super) fn traverse<L: SimdIsa, C: Counter, const ANY: bool>(
    lanes: L,
    wide: &Wide,
    query: &mut Query<'_, Bvh, C, ANY>,
) {
    let ray = WideRay::new(SlabRay::new(&query.ray, &wide.bounds, query.slack()));
    let t_min = query.ray.t_min;
    let mut stack = ArrayVec::<Entry, STACK>::new();
    let mut node = 0u32;
    loop {
        query.counter.nodes(1);
        let current = &wide.nodes[node as usize];
        let (mut mask, enter) = lanes.enter(current, &ray, t_min, query.t_max());

        // The nearest child is next; the others wait, the farther the longer. Of any hits, the last.
        let first = stack.len();
        while mask != 0 {
            let slot = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            stack.push((enter[slot], current.children[slot]));
        }
        if !ANY {
            sort_descending(&mut stack[first..]);
        }

        node = loop {
            let Some((near, child)) = stack.pop() else { return };
            if near > query.t_max() {
                continue;
            }
            if child.is_node() {
                let ChildKind::Node(index) = child.kind() else { continue };
                break index;
            }
            if leaf(lanes, wide, child, query) {
                return;
            }
        };
    }
}

#[inline(always)]
fn sort_descending(entries: &mut [Entry]) {
    for i in 1..entries.len() {
        let entry = entries[i];
        let mut k = i;
        while k > 0 && entries[k - 1].0 < entry.0 {
            entries[k] = entries[k - 1];
            k -= 1;
        }
        entries[k] = entry;
    }
}

#[inline(always)]
fn leaf<L: SimdIsa, C: Counter, const ANY: bool>(
    lanes: L,
    wide: &Wide,
    child: Child,
    query: &mut Query<'_, Bvh, C, ANY>,
) -> bool {
    match child.kind() {
        ChildKind::Blocks { first, count } => {
            // A loop: closures are inlined, and so vector code, only while they have one caller.
            for block in &wide.blocks[first as usize..(first + count) as usize] {
                if test_block(lanes, block, query) {
                    return true;
                }
            }
            false
        }
        ChildKind::Items { first, count } => {
            wide.items[first as usize..(first + count) as usize].iter().any(|&item| query.test(item))
        }
        ChildKind::Node(_) | ChildKind::Leave => false,
    }
}

#[inline(always)]
fn test_block<L: SimdIsa, C: Counter, const ANY: bool>(
    lanes: L,
    block: &Block,
    query: &mut Query<'_, Bvh, C, ANY>,
) -> bool {
    query.counter.prims(block.count);
    let hits = lanes.intersect(block, &query.triangle_ray);
    let mut mask = hits.mask;
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        let ItemKind::Prim(shape, prim) = block.items[lane].kind() else { continue };
        let TriangleHit { t, u, v } = hits.get(lane);
        if query.offer(Hit { t, u, v, shape, prim, instance: query.instance }) {
            return true;
        }
    }
    false
}
