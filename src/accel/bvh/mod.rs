//! A bounding volume hierarchy: built by the surface area heuristic, traced eight boxes and four triangles at a time.

mod any_hit_order;
mod batch;
mod best_hits;
mod binary;
mod build;
mod coherent;
mod collapse;
mod lanes;
mod reinsertion;
#[cfg(test)]
mod tests;
mod traverse;
mod wide;

use pulp::x86::{V3, V4};

use super::Coherence;
use super::inspect::NodeInfo;
use super::tree::{Answers, Batch, Counter, Items, Query, Tree};
use crate::math::Aabb;
use batch::Scratch;
use binary::BinaryTree;
pub(super) use build::{Binary, BinaryKind, MAX_LEAF, Reference};
use coherent::PacketIsa;
use lanes::Portable;
use wide::{ChildKind, STACK, WIDTH, Wide};

/// How a BVH is built and traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BvhOptions {
    /// Two boxes a node, without SIMD.
    pub binary: bool,
}

/// The hierarchy.
pub(super) struct Bvh(Layout);

enum Layout {
    Empty,
    Binary(BinaryTree),
    Wide(Wide, Option<V3>),
}

struct Run<'r, 'a, C, const ANY: bool> {
    simd: V3,
    wide: &'r Wide,
    query: &'r mut Query<'a, Bvh, C, ANY>,
}

impl<C: Counter, const ANY: bool> pulp::NullaryFnOnce for Run<'_, '_, C, ANY> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        traverse::traverse(self.simd, self.wide, self.query);
    }
}

/// Traces rays of a batch in packets of `S`.
struct PacketRun<'r, 'a, S, A> {
    simd: S,
    wide: &'r Wide,
    batch: &'r Batch<'r, 'a, Bvh>,
    scratch: &'r mut Scratch,
    answers: &'r mut A,
}

impl<S: PacketIsa, A: Answers> pulp::NullaryFnOnce for PacketRun<'_, '_, S, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        coherent::trace(self.simd, self.wide, self.batch, self.scratch, self.answers);
    }
}

struct BatchRun<'r, 'a, A, const ANY: bool> {
    simd: V3,
    wide: &'r Wide,
    batch: &'r Batch<'r, 'a, Bvh>,
    scratch: &'r mut Scratch,
    answers: &'r mut A,
}

impl<A: Answers, const ANY: bool> pulp::NullaryFnOnce for BatchRun<'_, '_, A, ANY> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        if self.batch.accel.geometry().instances.is_empty() {
            batch::trace::<_, ANY, false>(self.simd, self.wide, self.batch, self.scratch, self.answers);
        } else {
            batch::trace::<_, ANY, true>(self.simd, self.wide, self.batch, self.scratch, self.answers);
        }
    }
}

impl Bvh {
    /// Whether the machine has the instructions that batches of rays are traced with.
    pub fn is_vectorized() -> bool {
        V3::try_new().is_some()
    }

    fn as_wide(&self) -> Option<&Wide> {
        match &self.0 {
            Layout::Wide(wide, _) => Some(wide),
            Layout::Empty | Layout::Binary(_) => None,
        }
    }

    /// The wide form over at least one item, traced with or without SIMD.
    fn wide(items: &Items<'_>, simd: Option<V3>) -> Self {
        let mut tree = Wide::new(&binary(items), items);
        if tree.depth * (WIDTH - 1) >= STACK {
            // Halving gives the fewest levels.
            tree = Wide::new(&Binary::halved(references(items), |item| is_alone(items, item)), items);
        }
        Self(Layout::Wide(tree, simd))
    }
}

fn references(items: &Items<'_>) -> Vec<Reference> {
    items.bounds.iter().zip(0..).map(|(&bounds, item)| Reference { bounds, item }).collect()
}

/// What is not a triangle has a leaf for itself.
fn is_alone(items: &Items<'_>, item: u32) -> bool {
    items.triangle(item as usize).is_none()
}

fn binary(items: &Items<'_>) -> Binary {
    let mut binary = Binary::new(references(items), |item| is_alone(items, item));
    reinsertion::optimize(&mut binary);
    binary
}

impl Tree for Bvh {
    type Options = BvhOptions;

    fn build(items: &Items<'_>, options: &BvhOptions) -> Self {
        if items.len() == 0 {
            return Self(Layout::Empty);
        }
        if options.binary {
            Self(Layout::Binary(BinaryTree::new(binary(items), items)))
        } else {
            Self::wide(items, V3::try_new())
        }
    }

    #[inline]
    fn traverse<C: Counter, const ANY: bool>(&self, query: &mut Query<'_, Self, C, ANY>) {
        match &self.0 {
            Layout::Empty => {}
            Layout::Binary(tree) => tree.traverse(query),
            Layout::Wide(wide, Some(simd)) => simd.vectorize(Run { simd: *simd, wide, query }),
            Layout::Wide(wide, None) => traverse::traverse(Portable, wide, query),
        }
    }

    const SKIPS_END_SHAPES: bool = true;

    fn trace_rows<const ANY: bool>(batch: &Batch<'_, '_, Self>, answers: &mut impl Answers, coherence: Coherence) {
        let Layout::Wide(wide, Some(simd)) = &batch.accel.world().0 else {
            return batch.trace_one_by_one::<ANY>(answers);
        };
        batch::with_scratch(|scratch| {
            scratch.prepare(wide, batch, answers);
            if coherence == Coherence::Coherent && !ANY && batch.accel.geometry().instances.is_empty() {
                if let Some(v4) = V4::try_new() {
                    v4.vectorize(PacketRun { simd: v4, wide, batch, scratch, answers });
                } else {
                    simd.vectorize(PacketRun { simd: *simd, wide, batch, scratch, answers });
                }
            }
            simd.vectorize(BatchRun::<_, ANY> { simd: *simd, wide, batch, scratch, answers });
        });
    }

    fn bounds(&self) -> Aabb {
        match &self.0 {
            Layout::Empty => Aabb::EMPTY,
            Layout::Binary(tree) => tree.bounds(),
            Layout::Wide(wide, _) => wide.bounds,
        }
    }

    fn cover(&self) -> Vec<Aabb> {
        self.as_wide().map_or_else(|| vec![self.bounds()], Wide::cover)
    }

    fn memory_bytes(&self) -> usize {
        match &self.0 {
            Layout::Empty => 0,
            Layout::Binary(tree) => tree.memory_bytes(),
            Layout::Wide(wide, _) => wide.memory_bytes(),
        }
    }

    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
        match &self.0 {
            Layout::Empty => {}
            Layout::Binary(tree) => tree.visit_nodes(visit),
            Layout::Wide(wide, _) => visit_wide(wide, visit),
        }
    }

    fn description(&self) -> String {
        match &self.0 {
            Layout::Empty => "BVH, empty".into(),
            Layout::Binary(_) => "BVH, 2 wide, scalar".into(),
            Layout::Wide(_, Some(_)) => "BVH, 8 wide, AVX2".into(),
            Layout::Wide(_, None) => "BVH, 8 wide, scalar".into(),
        }
    }
}

fn visit_wide(wide: &Wide, visit: &mut dyn FnMut(&NodeInfo)) {
    let mut open = vec![(0usize, wide.bounds, 0)];
    let mut items = Vec::new();
    while let Some((index, bounds, depth)) = open.pop() {
        let slots: Vec<_> = (0..WIDTH).filter_map(|slot| wide.nodes[index].get(slot)).collect();
        visit(&NodeInfo { bounds, depth, children: slots.len() as u32, items: &[] });
        for (bounds, child) in slots.into_iter().rev() {
            items.clear();
            match child.kind() {
                ChildKind::Node(node) => {
                    open.push((node as usize, bounds, depth + 1));
                    continue;
                }
                ChildKind::Blocks { first, count } => {
                    let blocks = &wide.blocks[first as usize..(first + count) as usize];
                    items.extend(blocks.iter().flat_map(|block| &block.items[..block.count as usize]));
                }
                ChildKind::Items { first, count } => {
                    items.extend_from_slice(&wide.items[first as usize..(first + count) as usize]);
                }
                ChildKind::Leave => {}
            }
            visit(&NodeInfo { bounds, depth: depth + 1, children: 0, items: &items });
        }
    }
}
