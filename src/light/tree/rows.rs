//! Choices for many points at once, from a tree of one node.

use super::node::{Node, WIDTH};
use super::{LEAF, LightTree};
use crate::light::LightQueries;
use crate::light::set::{LightChoiceRows, with_digits};
use crate::math::Vec3;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{BATCH, Row, whole_vectors};
use crate::math::vectorize::vectorize;

impl LightTree {
    /// Whether all lights are children of the root.
    pub fn has_one_node(&self) -> bool {
        self.nodes.len() == 1
    }

    /// [`choose`](Self::choose) for many points, by numbers over `share`; probabilities are multiplied by it, and 0
    /// where nothing arrives. Of a tree of one node.
    pub fn choose_rows(&self, queries: &LightQueries, share: f32, choices: &mut LightChoiceRows) {
        vectorize!(choose(&self.nodes[0], queries, share, choices));
    }
}

#[inline(always)]
fn choose(node: &Node, queries: &LightQueries, share: f32, choices: &mut LightChoiceRows) {
    let (lights, pmfs) = (&mut choices.light, &mut choices.pmf);
    let count = whole_vectors(queries.count);
    let mut importances: [Row; WIDTH] = [[0.0; BATCH]; WIDTH];
    let mut totals: Row = [0.0; BATCH];
    let children = node.count();
    for (slot, importances) in importances.iter_mut().enumerate().take(children) {
        let bounds = node.bounds(slot);
        for i in 0..count {
            let (p, n) = (queries.points.get(i).as_vec3(), queries.normals.get(i));
            importances[i] = bounds.importance(p, n, n == Vec3::ZERO).0;
            totals[i] += importances[i];
        }
    }
    let (mut x, mut lower): (Row<f64>, Row<f64>) = ([0.0; BATCH], [0.0; BATCH]);
    for i in 0..count {
        let [u, _, _, v] = queries.u.of(i);
        let total = f64::from(totals[i]);
        let at = with_digits([u, v]) / f64::from(share) * total;
        let last = total * f64::from(ONE_MINUS_EPSILON);
        x[i] = if at < last { at } else { last };
        pmfs[i] = 0.0;
    }
    for (slot, importances) in importances.iter().enumerate().take(children) {
        let light = node.child(slot) & !LEAF;
        for i in 0..count {
            let importance = importances[i];
            // As `pick` does.
            let is_picked = (importance > 0.0) & ((pmfs[i] == 0.0) | (x[i] >= lower[i]));
            pmfs[i] = if is_picked { importance } else { pmfs[i] };
            lights[i] = if is_picked { light } else { lights[i] };
            lower[i] += f64::from(importance);
        }
    }
    for i in 0..count {
        let pmf = pmfs[i] / totals[i] * share;
        pmfs[i] = if totals[i] > 0.0 { pmf } else { 0.0 };
    }
}
