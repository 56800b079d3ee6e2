//! The BSDFs of a block's vertices for directions that were chosen elsewhere: by lights, or by a guide.

use super::block::{EvalRows, VertexRows};
use super::materials::BsdfTable;
use super::wave::BsdfScratch;
use crate::bsdf::Lambert;
use crate::math::Frame;
use crate::math::rows::{BATCH, Vec3Rows};
use crate::math::vectorize::vectorize;
use crate::scene::Scene;

/// The surfaces of a block.
pub(super) struct Surfaces<'a> {
    pub scene: &'a Scene,
    pub count: usize,
    pub rows: &'a VertexRows,
    pub bsdfs: &'a BsdfTable,
    /// Those that are not diffuse.
    pub non_diffuse: &'a [u8],
}

impl Surfaces<'_> {
    /// Evaluates the BSDFs for the directions of the vertices that are wanted.
    pub fn eval(
        &self,
        directions: &Vec3Rows,
        is_wanted: impl Fn(usize) -> bool,
        scratch: &mut BsdfScratch,
        evals: &mut EvalRows,
    ) {
        vectorize!(eval_diffuse(self.rows, directions, evals, self.count));
        let BsdfScratch { lanes, queries, evals: results, .. } = scratch;
        for group in self.bsdfs.groups(self.non_diffuse) {
            lanes.clear();
            lanes.extend(group.iter().filter(|&&lane| is_wanted(usize::from(lane))));
            let Some(bsdf) = lanes.first().and_then(|&lane| self.bsdfs.get(self.scene, usize::from(lane))) else {
                continue;
            };
            for (i, &lane) in lanes.iter().enumerate() {
                queries.wo.set(i, self.rows.wo.get(usize::from(lane)));
                queries.wi.set(i, evals.wi.get(usize::from(lane)));
            }
            let varies = self.bsdfs.varies(usize::from(lanes[0]));
            if varies {
                self.bsdfs.set_parameters(self.scene, lanes, queries);
            }
            bsdf.eval_rows(queries, varies, lanes.len(), results);
            for (i, &lane) in lanes.iter().enumerate() {
                evals.value.set(usize::from(lane), results.value.get(i));
                evals.pdf[usize::from(lane)] = results.pdf[i];
            }
        }
    }
}

#[inline(always)]
fn eval_diffuse(rows: &VertexRows, directions: &Vec3Rows, evals: &mut EvalRows, count: usize) {
    for i in 0..count.min(BATCH) {
        let frame = Frame { x: rows.frame_x.get(i), y: rows.frame_y.get(i), z: rows.n.get(i) };
        let wi = frame.to_local(directions.get(i));
        let eval = Lambert { albedo: rows.albedo.get(i) }.eval(rows.wo.get(i), wi);
        evals.wi.set(i, wi);
        evals.value.set(i, eval.value);
        evals.pdf[i] = eval.pdf;
    }
}
