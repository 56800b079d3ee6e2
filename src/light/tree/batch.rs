//! Choices for a batch of points at once.

use super::cuts::{Cuts, PickedNode};
use super::node::{Node, WIDTH};
use super::pick::{pick, total};
use super::{LEAF, LightTree, MAX_OPEN, TreeChoice};
use crate::math::rows::{BATCH, Row, whole_vectors};

/// The cuts of a batch, and the nodes that lead from there to the lights.
#[derive(Default)]
pub(super) struct BatchCuts {
    pub cuts: Cuts<BATCH, { BATCH * MAX_OPEN + WIDTH }>,
    level: Level,
}

/// A node for each point, of which a child is to be picked.
struct Level {
    count: usize,
    points: Row<u32>,
    nodes: Row<u32>,
    /// By child.
    importances: [Row; WIDTH],
    /// Numbers in `[0, 1)`.
    u: Row<f64>,
    /// Probability of the node, then of the child.
    pmfs: Row,
    slots: Row<u32>,
}

impl Default for Level {
    fn default() -> Self {
        Self {
            count: 0,
            points: [0; BATCH],
            nodes: [0; BATCH],
            importances: [[0.0; BATCH]; WIDTH],
            u: [0.0; BATCH],
            pmfs: [0.0; BATCH],
            slots: [0; BATCH],
        }
    }
}

impl BatchCuts {
    /// Chooses lights for all points; with probability 0 where nothing arrives.
    #[inline(always)]
    pub fn choose(&mut self, tree: &LightTree, mut set: impl FnMut(usize, TreeChoice)) {
        self.cuts.expand(tree);
        self.pick_nodes();
        loop {
            self.level.pick();
            let mut count = 0;
            for j in 0..self.level.count {
                let level = &mut self.level;
                let child = tree.nodes[level.nodes[j] as usize].child(level.slots[j] as usize);
                set(level.points[j] as usize, TreeChoice { light: child & !LEAF, pmf: level.pmfs[j] });
                (level.points[count], level.nodes[count]) = (level.points[j], child);
                (level.u[count], level.pmfs[count]) = (level.u[j], level.pmfs[j]);
                count += usize::from(child & LEAF == 0);
            }
            if count == 0 {
                break;
            }
            self.level.count = count;
            self.weigh(tree);
        }
    }

    /// Finds the importances of the level's nodes.
    #[inline(always)]
    fn weigh(&mut self, tree: &LightTree) {
        let Self { cuts, level } = self;
        for j in (0..level.count).step_by(2) {
            // Of an odd number the last is computed twice.
            let two = [j, (j + 1).min(level.count - 1)];
            let points = two.map(|j| cuts.points[level.points[j] as usize]);
            let nodes = two.map(|j| &tree.nodes[level.nodes[j] as usize]);
            let mut importances = [0.0; 2 * WIDTH];
            Node::weigh_two(
                nodes,
                points,
                #[inline(always)]
                |i, importance, _| importances[i] = importance,
            );
            for (j, of) in two.into_iter().zip(importances.as_chunks().0) {
                level.set_importances(j, of);
            }
        }
    }

    /// Picks a node of each cut.
    #[inline(always)]
    fn pick_nodes(&mut self) {
        let Self { cuts, level } = self;
        let Cuts { u, totals, .. } = cuts;
        for (u, total) in u.iter_mut().zip(&*totals) {
            *u *= total;
        }
        level.count = cuts.count;
        // The last of the nodes of a point whose start is not behind its number.
        level.nodes = [0; BATCH];
        for (i, &point) in cuts.node_points[..cuts.node_count].iter().enumerate() {
            let is_reached = u32::from(cuts.u[point as usize] >= cuts.starts[i]).wrapping_neg();
            let picked = &mut level.nodes[point as usize];
            *picked = (*picked).max(i as u32 & is_reached);
        }
        for point in 0..cuts.count {
            let i = level.nodes[point] as usize;
            level.points[point] = point as u32;
            level.nodes[point] = cuts.nodes[i];
            level.set_importances(point, &cuts.importances[i]);
            level.u[point] = cuts.u[point] - cuts.starts[i];
        }
        for (point, all) in cuts.totals.iter().enumerate().take(whole_vectors(cuts.count)) {
            let node = PickedNode::new(level.u[point], total(&level.importances(point)), *all);
            (level.u[point], level.pmfs[point]) = (node.share, node.pmf);
        }
    }
}

impl Level {
    #[inline(always)]
    fn set_importances(&mut self, j: usize, of: &[f32; WIDTH]) {
        for (row, of) in self.importances.iter_mut().zip(of) {
            row[j] = *of;
        }
    }

    #[inline(always)]
    fn importances(&self, j: usize) -> [f32; WIDTH] {
        let mut of = [0.0; WIDTH];
        for (of, row) in of.iter_mut().zip(&self.importances) {
            *of = row[j];
        }
        of
    }

    /// Picks a child of each node.
    #[inline(always)]
    fn pick(&mut self) {
        for j in 0..whole_vectors(self.count) {
            let picked = pick(&self.importances(j), self.u[j]);
            self.slots[j] = picked.slot;
            self.u[j] = picked.share;
            self.pmfs[j] *= picked.pmf;
        }
    }
}
