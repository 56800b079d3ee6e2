//! Guides as bytes and back. What is read may come from anywhere: a guide that could not have been learned is rejected.

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use super::{
    DirectionDistribution, DirectionRecords, Guide, Leaf, MAX_DEPTH, MAX_LEAVES, MAX_NODES_OF_LEAF, Node, ROOTS,
    Region, SpaceTrees,
};
use crate::bytes::{ByteReader, ByteWriter};
use crate::math::Aabb;

/// Where the directions of a leaf are.
mod directions {
    /// Nowhere: nothing is known.
    pub const NONE: u32 = 0;
    /// They are those of the leaf before, with which it was one.
    pub const SHARED: u32 = 1;
    /// They follow.
    pub const OWN: u32 = 2;
}

impl Clone for Guide {
    fn clone(&self) -> Self {
        let copy = |leaf: &Leaf| Leaf {
            records: leaf.records.copied(),
            count: AtomicU64::new(leaf.count.load(Ordering::Relaxed)),
            gains: leaf.gains.each_ref().map(|gain| AtomicI64::new(gain.load(Ordering::Relaxed))),
        };
        let leaves = self.leaves.iter().map(copy).collect();
        let (trees, learned) = (self.trees.clone(), self.learned.clone());
        Self { trees, learned, leaves, ..*self }
    }
}

impl Guide {
    /// Writes all but the bounds.
    pub fn write(&self, out: &mut ByteWriter) {
        out.integers(&self.trees.nodes().iter().map(|node| node.0).collect::<Vec<_>>());
        out.integers(&[self.scale.to_bits()]);
        let mut last: Option<&DirectionDistribution> = None;
        for (learned, leaf) in self.learned.iter().zip(&self.leaves) {
            let own = learned.directions.as_ref();
            let is_shared = own.zip(last).is_some_and(|(own, last)| own.is_same(last));
            let place = if is_shared { directions::SHARED } else { own.map_or(directions::NONE, |_| directions::OWN) };
            out.integers(&[place, learned.bsdf_sampling_fraction.to_bits()]);
            if let Some(own) = own.filter(|_| !is_shared) {
                own.write(out);
            }
            last = own;
            leaf.records.write(out);
            out.long(leaf.count.load(Ordering::Relaxed));
            leaf.gains.iter().for_each(|gain| out.long(gain.load(Ordering::Relaxed) as u64));
        }
    }

    /// Reads what [`write`](Self::write) gave; `None` if it is no guide. The bounds are still to be set.
    pub fn read(data: &mut ByteReader) -> Option<Self> {
        let nodes: Vec<Node> = data.integers()?.into_iter().map(Node).collect();
        let leaves = count_leaves(&nodes).filter(|count| *count <= MAX_LEAVES)?;
        let mut guide = Self { trees: SpaceTrees::of_nodes(nodes), ..Self::new(Aabb::EMPTY, 0.0) };
        let [scale] = data.integers()?.try_into().ok()?;
        guide.scale = Some(f32::from_bits(scale)).filter(|scale| (0.0..f32::INFINITY).contains(scale))?;
        guide.learned.clear();
        guide.leaves.clear();
        for _ in 0..leaves {
            let learned = read_learned(data, guide.learned.last())?;
            guide.learned.push(learned);
            let records = DirectionRecords::read(data, MAX_NODES_OF_LEAF)?;
            let count = AtomicU64::new(data.long()?);
            let gains =
                [data.long()?, data.long()?, data.long()?, data.long()?].map(|gain| AtomicI64::new(gain as i64));
            guide.leaves.push(Leaf { records, count, gains });
        }
        Some(guide)
    }
}

fn read_learned(data: &mut ByteReader, last: Option<&Region>) -> Option<Region> {
    let [place, share] = data.integers()?.try_into().ok()?;
    let directions = match place {
        directions::NONE => None,
        directions::SHARED => Some(last?.directions.clone()?),
        directions::OWN => Some(DirectionDistribution::read(data)?),
        _ => return None,
    };
    let bsdf_sampling_fraction = Some(f32::from_bits(share)).filter(|share| *share > 0.0 && *share < 1.0)?;
    Some(Region { directions, bsdf_sampling_fraction })
}

/// The leaves of the trees over space; `None` if these are not six binary trees with each leaf once, none too deep.
fn count_leaves(nodes: &[Node]) -> Option<usize> {
    let leaves = nodes.iter().filter(|node| node.leaf().is_some()).count();
    let mut is_met = vec![false; leaves];
    let mut is_child = vec![false; nodes.len()];
    let mut depths = vec![0; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        match node.leaf() {
            Some(leaf) if std::mem::replace(is_met.get_mut(leaf)?, true) => return None,
            Some(_) => {}
            None => {
                let first = node.0 as usize;
                let pair = is_child.get_mut(first..first.checked_add(2)?).filter(|_| first > index.max(ROOTS - 1))?;
                let depth = depths[index] + 1;
                if depth > MAX_DEPTH || std::mem::replace(&mut pair[0], true) || std::mem::replace(&mut pair[1], true) {
                    return None;
                }
                depths[first..first + 2].fill(depth);
            }
        }
    }
    let are_roots = |roots: &[bool]| roots.iter().all(|is_child| !is_child);
    let (roots, others) = is_child.split_at_checked(ROOTS)?;
    (are_roots(roots) && others.iter().all(|is_child| *is_child)).then_some(leaves)
}
