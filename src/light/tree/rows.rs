//! Choices of lights for a batch of vertices.

use super::batch::BatchCuts;
use super::node::Node;
use super::pick::{Picked, pick, pick_of_two};
use super::{LEAF, LightTree, ShadingPoint};
use crate::light::LightQueries;
use crate::light::set::{LightChoiceRows, with_digits};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{BATCH, Row, whole_vectors};
use crate::math::vectorize::vectorize;

/// Memory of [`LightTree::choose_rows`].
#[derive(Default)]
pub struct LightTreeScratch {
    /// Only where a tree has more than one node.
    batch: Option<Box<BatchCuts>>,
    /// Lanes of the points of the cuts.
    lanes: Vec<usize>,
}

impl LightTree {
    /// [`choose`](Self::choose) for the vertices that are wanted, by numbers over `share`; probabilities are multiplied
    /// by it, and 0 where nothing arrives. Other lanes may be set too.
    pub fn choose_rows(
        &self,
        queries: &LightQueries,
        is_wanted: impl Fn(usize) -> bool,
        share: f32,
        scratch: &mut LightTreeScratch,
        choices: &mut LightChoiceRows,
    ) {
        if let [node] = &self.nodes[..] {
            match node.count() {
                ..=2 => vectorize!(choose(node, queries, share, pick_of_two, choices)),
                _ => vectorize!(choose(node, queries, share, pick, choices)),
            }
            return;
        }
        let LightTreeScratch { batch, lanes } = scratch;
        let batch = batch.get_or_insert_default();
        batch.cuts.clear();
        lanes.clear();
        choices.pmf = [0.0; BATCH];
        for lane in (0..queries.count.min(BATCH)).filter(|&lane| is_wanted(lane)) {
            let [u, _, _, digits] = queries.u.of(lane);
            let u = with_digits([u, digits]);
            if u < f64::from(share) {
                let u = (u / f64::from(share)).min(f64::from(ONE_MINUS_EPSILON));
                batch.cuts.push(point(queries, lane), u);
                lanes.push(lane);
            }
        }
        vectorize!(batch.choose(self, |point, choice| {
            let lane = lanes[point];
            choices.light[lane] = choice.light;
            choices.pmf[lane] = choice.pmf * share;
        }));
    }
}

#[inline(always)]
fn point(queries: &LightQueries, lane: usize) -> ShadingPoint {
    ShadingPoint { p: queries.points.get(lane).as_vec3(), n: queries.normals.get(lane) }
}

/// Chooses among the children of a root, which are all lights: up to `CHILDREN` of them.
#[inline(always)]
fn choose<const CHILDREN: usize>(
    node: &Node,
    queries: &LightQueries,
    share: f32,
    pick: impl Fn(&[f32; CHILDREN], f64) -> Picked,
    choices: &mut LightChoiceRows,
) {
    let (lights, pmfs) = (&mut choices.light, &mut choices.pmf);
    let count = whole_vectors(queries.count);
    let mut importances: [Row; CHILDREN] = [[0.0; BATCH]; CHILDREN];
    for (slot, importances) in importances.iter_mut().enumerate().take(node.count()) {
        let bounds = node.bounds(slot);
        for (i, importance) in importances.iter_mut().enumerate().take(count) {
            *importance = bounds.importance(point(queries, i)).0;
        }
    }
    for i in 0..count {
        let mut of = [0.0; CHILDREN];
        for (of, row) in of.iter_mut().zip(&importances) {
            *of = row[i];
        }
        let [u, _, _, digits] = queries.u.of(i);
        let u = with_digits([u, digits]) / f64::from(share);
        let last = f64::from(ONE_MINUS_EPSILON);
        let picked = pick(&of, if u < last { u } else { last });
        lights[i] = picked.slot;
        pmfs[i] = picked.pmf * share;
    }
    for light in &mut lights[..count] {
        *light = node.child(*light as usize) & !LEAF;
    }
}
