//! The BSDFs of a block's vertices for directions that were chosen elsewhere: by lights, or by a guide.

use super::block::{EvalRows, VertexRows};
use super::materials::BsdfTable;
use super::wave::BsdfScratch;
use crate::bsdf::{BsdfEvalRows, Lambert};
use crate::math::Frame;
use crate::math::rows::{Row, Vec3Rows, whole_vectors};
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

/// Local directions at the vertices of a block.
struct Directions<'a> {
    wo: &'a Vec3Rows,
    wi: &'a Vec3Rows,
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
        let EvalRows { wi, value, pdf } = evals;
        self.eval_non_diffuse(Directions { wo: &self.rows.wo, wi }, is_wanted, scratch, |results, i, lane| {
            value.set(lane, results.value.get(i));
            pdf[lane] = results.pdf[i];
        });
    }

    /// The densities with which scattering chooses the directions back from the local directions `wi`.
    pub fn reversed_pdfs(
        &self,
        wi: &Vec3Rows,
        is_wanted: impl Fn(usize) -> bool,
        scratch: &mut BsdfScratch,
        pdfs: &mut Row,
    ) {
        vectorize!(reversed_diffuse_pdfs(self.rows, wi, pdfs, self.count));
        self.eval_non_diffuse(Directions { wo: wi, wi: &self.rows.wo }, is_wanted, scratch, |results, i, lane| {
            pdfs[lane] = results.pdf[i];
        });
    }

    /// Evaluates the BSDFs of the vertices that are wanted and not diffuse: `set` gets their results, with the index
    /// among them and the vertex.
    #[inline(always)]
    fn eval_non_diffuse(
        &self,
        directions: Directions,
        is_wanted: impl Fn(usize) -> bool,
        scratch: &mut BsdfScratch,
        mut set: impl FnMut(&BsdfEvalRows, usize, usize),
    ) {
        let BsdfScratch { lanes, queries, evals: results, .. } = scratch;
        for group in self.bsdfs.groups(self.non_diffuse) {
            lanes.clear();
            lanes.extend(group.iter().filter(|&&lane| is_wanted(usize::from(lane))));
            let Some(bsdf) = lanes.first().and_then(|&lane| self.bsdfs.get(self.scene, usize::from(lane))) else {
                continue;
            };
            for (i, &lane) in lanes.iter().enumerate() {
                queries.wo.set(i, directions.wo.get(usize::from(lane)));
                queries.wi.set(i, directions.wi.get(usize::from(lane)));
            }
            let varies = self.bsdfs.varies(usize::from(lanes[0]));
            if varies {
                self.bsdfs.set_parameters(self.scene, lanes, queries);
            }
            bsdf.eval_rows(queries, varies, lanes.len(), results);
            for (i, &lane) in lanes.iter().enumerate() {
                set(results, i, usize::from(lane));
            }
        }
    }
}

#[inline(always)]
fn eval_diffuse(rows: &VertexRows, directions: &Vec3Rows, evals: &mut EvalRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let frame = Frame { x: rows.frame_x.get(i), y: rows.frame_y.get(i), z: rows.n.get(i) };
        let wi = frame.to_local(directions.get(i));
        let eval = Lambert { albedo: rows.albedo.get(i) }.eval(rows.wo.get(i), wi);
        evals.wi.set(i, wi);
        evals.value.set(i, eval.value);
        evals.pdf[i] = eval.pdf;
    }
}

#[inline(always)]
fn reversed_diffuse_pdfs(rows: &VertexRows, wi: &Vec3Rows, pdfs: &mut Row, count: usize) {
    for (i, pdf) in pdfs.iter_mut().enumerate().take(whole_vectors(count)) {
        *pdf = Lambert { albedo: rows.albedo.get(i) }.eval(wi.get(i), rows.wo.get(i)).pdf;
    }
}
