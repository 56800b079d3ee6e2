//! Choices for many points at once.

use super::node::{Importances, WIDTH};
use super::pick::{pick, total};
use super::{LEAF, LightTree, MAX_OPEN, NONE, TreeChoice};
use crate::math::Vec3;
use crate::math::compact::ORDER_OF_8;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{self, BATCH, whole_vectors_of};

/// The cuts of up to `POINTS` points (a multiple of [`rows::WIDTH`]), of up to `NODES` less [`WIDTH`] nodes in all: for
/// each point, the root and near nodes below it, with the importances of those children that are not in the cut
/// themselves.
pub(super) struct Cuts<const POINTS: usize, const NODES: usize> {
    count: usize,
    points: [ShadingPoint; POINTS],
    /// Random numbers in `[0, 1)`.
    u: [f64; POINTS],
    /// Sums of the importances.
    totals: [f64; POINTS],
    /// How many nodes a point has.
    open: [u32; POINTS],
    /// Nodes of all points: those of each in the order in which they are found.
    nodes: [u32; NODES],
    node_points: [u32; NODES],
    node_count: usize,
    importances: [[f32; WIDTH]; NODES],
    /// Sums of the importances of the nodes before, of the same point.
    starts: [f64; NODES],
    level: Level<POINTS>,
}

/// The cut of one point.
pub(super) type OneCut = Cuts<{ rows::WIDTH }, { MAX_OPEN + WIDTH }>;

/// The cuts of a batch.
pub(super) type BatchCuts = Cuts<BATCH, { BATCH * MAX_OPEN + WIDTH }>;

#[derive(Clone, Copy)]
struct ShadingPoint {
    p: Vec3,
    n: Vec3,
}

/// A node for each point, of which a child is to be picked.
struct Level<const POINTS: usize> {
    count: usize,
    points: [u32; POINTS],
    nodes: [u32; POINTS],
    /// By child.
    importances: [[f32; POINTS]; WIDTH],
    /// Numbers in `[0, 1)`.
    u: [f64; POINTS],
    /// Probability of the node, then of the child.
    pmfs: [f32; POINTS],
    slots: [u32; POINTS],
}

impl<const POINTS: usize, const NODES: usize> Default for Cuts<POINTS, NODES> {
    fn default() -> Self {
        Self {
            count: 0,
            points: [ShadingPoint { p: Vec3::ZERO, n: Vec3::ZERO }; POINTS],
            u: [0.0; POINTS],
            totals: [0.0; POINTS],
            open: [0; POINTS],
            nodes: [0; NODES],
            node_points: [0; NODES],
            node_count: 0,
            importances: [[0.0; WIDTH]; NODES],
            starts: [0.0; NODES],
            level: Level {
                count: 0,
                points: [0; POINTS],
                nodes: [0; POINTS],
                importances: [[0.0; POINTS]; WIDTH],
                u: [0.0; POINTS],
                pmfs: [0.0; POINTS],
                slots: [0; POINTS],
            },
        }
    }
}

impl<const POINTS: usize, const NODES: usize> Cuts<POINTS, NODES> {
    /// Removes all points.
    #[inline(always)]
    pub fn clear(&mut self) {
        (self.count, self.node_count) = (0, 0);
    }

    /// Adds a point, with a number in `[0, 1)`.
    #[inline(always)]
    pub fn push(&mut self, p: Vec3, n: Vec3, u: f64) {
        let point = self.count;
        self.points[point] = ShadingPoint { p, n };
        self.u[point] = u;
        self.totals[point] = 0.0;
        self.open[point] = 1;
        self.nodes[point] = 0;
        self.node_points[point] = point as u32;
        self.count += 1;
        self.node_count = self.count;
    }

    /// Sum of the importances at a point.
    #[inline(always)]
    pub fn total(&self, point: usize) -> f64 {
        self.totals[point]
    }

    /// The importances of a node, if it is in a cut.
    #[inline(always)]
    pub fn find(&self, node: u32) -> Option<&[f32; WIDTH]> {
        let i = self.nodes[..self.node_count].iter().position(|&of| of == node)?;
        Some(&self.importances[i])
    }

    /// Finds the cuts. Nodes of all points take turns: what one waits for, others do not.
    #[inline(always)]
    pub fn expand(&mut self, tree: &LightTree) {
        let mut node_count = self.node_count;
        let mut i = 0;
        while i < node_count {
            let point = self.node_points[i] as usize;
            let node = &tree.nodes[self.nodes[i] as usize];
            let ShadingPoint { p, n } = self.points[point];
            let mut found = node.importances(p, n);
            if node.first_node() != NONE {
                let near = found.near_nodes();
                let open = self.open[point] + near.count_ones();
                if open <= MAX_OPEN as u32 {
                    self.open[point] = open;
                    found.of = found.without_near_nodes;
                    // All children's indices are written, those of near nodes first; the arrays have place for them.
                    let order = ORDER_OF_8[near as usize].to_le_bytes();
                    let nodes: &mut [u32; WIDTH] = self.nodes[node_count..].first_chunk_mut().unwrap();
                    for k in 0..WIDTH {
                        nodes[k] = node.first_node() + u32::from(order[k]);
                    }
                    let points: &mut [u32; WIDTH] = self.node_points[node_count..].first_chunk_mut().unwrap();
                    *points = [point as u32; WIDTH];
                    node_count += near.count_ones() as usize;
                }
            }
            self.importances[i] = found.of;
            self.starts[i] = self.totals[point];
            self.totals[point] += f64::from(total(&found.of));
            i += 1;
        }
        self.node_count = node_count;
    }

    /// Chooses lights for all points; with probability 0 where nothing arrives.
    #[inline(always)]
    pub fn choose(&mut self, tree: &LightTree, mut set: impl FnMut(usize, TreeChoice)) {
        self.expand(tree);
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
            for j in 0..count {
                let ShadingPoint { p, n } = self.points[self.level.points[j] as usize];
                let Importances { of, .. } = tree.nodes[self.level.nodes[j] as usize].importances(p, n);
                self.level.set_importances(j, &of);
            }
        }
    }

    /// Picks a node of each cut.
    #[inline(always)]
    fn pick_nodes(&mut self) {
        let Self { u, totals, level, .. } = self;
        for point in 0..whole_vectors_of::<POINTS>(self.count) {
            u[point] *= totals[point];
        }
        level.count = self.count;
        // The last of the nodes of a point whose start is not behind its number.
        level.nodes = [0; POINTS];
        for (i, &point) in self.node_points[..self.node_count].iter().enumerate() {
            let is_reached = u32::from(self.u[point as usize] >= self.starts[i]).wrapping_neg();
            let picked = &mut level.nodes[point as usize];
            *picked = (*picked).max(i as u32 & is_reached);
        }
        for point in 0..self.count {
            let i = level.nodes[point] as usize;
            level.points[point] = point as u32;
            level.nodes[point] = self.nodes[i];
            level.set_importances(point, &self.importances[i]);
            level.u[point] = self.u[point] - self.starts[i];
        }
        for (point, all) in totals.iter().enumerate().take(whole_vectors_of::<POINTS>(self.count)) {
            let total = f64::from(total(&level.importances(point)));
            let share = level.u[point] / total;
            let last = f64::from(ONE_MINUS_EPSILON);
            level.u[point] = if share < last { share } else { last };
            level.pmfs[point] = if *all > 0.0 { (total / all) as f32 } else { 0.0 };
        }
    }
}

impl<const POINTS: usize> Level<POINTS> {
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
        for j in 0..whole_vectors_of::<POINTS>(self.count) {
            let picked = pick(&self.importances(j), self.u[j]);
            self.slots[j] = picked.slot;
            self.u[j] = picked.share;
            self.pmfs[j] *= picked.pmf;
        }
    }
}
