//! Scattering for many pairs of directions at once, the same as for each of them alone.

use super::conductor::SingleScattering as Metal;
use super::dielectric::{SingleScattering as Glass, Smooth as SmoothGlass};
use super::plastic::{IsotropicPlastic, SmoothPlastic};
use super::{Bsdf, BsdfEval, BsdfSample, SingleScatteringBsdf};
use crate::color::Rgb;
use crate::math::Vec3;
use crate::math::rows::{BATCH, soa};
use crate::math::vectorize::vectorize;

soa! {
    /// Arguments of [`Bsdf::eval`] and of [`Bsdf::sample`].
    pub struct BsdfQueryRows {
        /// The direction back.
        wo: Vec3,
        /// The other direction, to be evaluated.
        wi: Vec3,
        /// Chooses the lobe.
        u_lobe: f32,
        /// Choose the direction:
        u: f32,
        /// two numbers.
        v: f32,
    }
}

soa! {
    /// Values as [`BsdfEval`] has them.
    pub struct BsdfEvalRows {
        /// `f |cos|`.
        value: Rgb,
        /// Density per solid angle.
        pdf: f32,
    }
}

soa! {
    /// Samples as [`BsdfSample`] has them.
    pub struct BsdfSampleRows {
        /// The direction.
        wi: Vec3,
        /// `f |cos| / pdf`.
        weight: Rgb,
        /// Density per solid angle.
        pdf: f32,
        /// Relative index of refraction.
        eta: f32,
        /// Whether there is a sample at all.
        is_valid: u32,
        /// Whether it came from a delta lobe.
        is_delta: u32,
        /// Whether it crosses the surface.
        is_transmission: u32,
    }
}

impl BsdfEvalRows {
    #[inline(always)]
    fn set(&mut self, i: usize, eval: &BsdfEval) {
        self.value.set(i, eval.value);
        self.pdf[i] = eval.pdf;
    }
}

impl BsdfSampleRows {
    #[inline(always)]
    fn set(&mut self, i: usize, sample: Option<BsdfSample>) {
        const NONE: BsdfSample =
            BsdfSample { wi: Vec3::ZERO, weight: Rgb::BLACK, pdf: 0.0, is_delta: false, is_transmission: false, eta: 1.0 };
        self.is_valid[i] = u32::from(sample.is_some());
        let BsdfSample { wi, weight, pdf, is_delta, is_transmission, eta } = sample.unwrap_or(NONE);
        self.wi.set(i, wi);
        self.weight.set(i, weight);
        (self.pdf[i], self.eta[i]) = (pdf, eta);
        (self.is_delta[i], self.is_transmission[i]) = (u32::from(is_delta), u32::from(is_transmission));
    }
}

/// A BSDF whose functions are inlined into loops that become vector code.
pub(super) trait LaneBsdf {
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval;
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample>;
}

/// `$body` with a BSDF that is fit for vector code as `$lane`, else `$otherwise`.
macro_rules! lanes {
    ($bsdf:expr, $lane:ident => $body:expr, $otherwise:expr) => {{
        macro_rules! with {
            ($made:expr) => {{
                let $lane = $made;
                $body
            }};
        }
        match $bsdf {
            Bsdf::Conductor(bsdf) if bsdf.is_rough_single() => with!(Metal(bsdf)),
            Bsdf::Dielectric(bsdf) if bsdf.flags().is_delta() => with!(SmoothGlass(bsdf)),
            Bsdf::Dielectric(bsdf) if bsdf.is_rough_single() => with!(Glass(bsdf)),
            Bsdf::Plastic(bsdf) if bsdf.coat.is_smooth() => with!(SmoothPlastic(bsdf)),
            Bsdf::Plastic(bsdf) if !bsdf.flags().is_anisotropic() => with!(IsotropicPlastic(bsdf)),
            Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(bsdf)) if bsdf.coat.is_smooth() => with!(SmoothPlastic(bsdf)),
            Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(bsdf)) if !bsdf.flags().is_anisotropic() => with!(IsotropicPlastic(bsdf)),
            Bsdf::SeparableGgx(SingleScatteringBsdf::Conductor(bsdf)) if bsdf.is_rough_single() => with!(Metal(bsdf)),
            Bsdf::SeparableGgx(SingleScatteringBsdf::Dielectric(bsdf)) if bsdf.is_rough_single() => with!(Glass(bsdf)),
            _ => $otherwise,
        }
    }};
}

impl Bsdf {
    /// [`eval`](Self::eval) for the first `count` queries, at most [`BATCH`].
    pub fn eval_rows(&self, queries: &BsdfQueryRows, count: usize, out: &mut BsdfEvalRows) {
        lanes!(self, bsdf => vectorize!(eval(&bsdf, queries, out, count)), {
            for i in 0..count.min(BATCH) {
                out.set(i, &self.eval(queries.wo.get(i), queries.wi.get(i)));
            }
        });
    }

    /// [`sample`](Self::sample) for the first `count` queries, at most [`BATCH`].
    pub fn sample_rows(&self, queries: &BsdfQueryRows, count: usize, out: &mut BsdfSampleRows) {
        lanes!(self, bsdf => vectorize!(sample(&bsdf, queries, out, count)), {
            for i in 0..count.min(BATCH) {
                out.set(i, self.sample(queries.wo.get(i), queries.u_lobe[i], [queries.u[i], queries.v[i]]));
            }
        });
    }
}

// Whole vectors: what is computed for lanes beyond the count is not used.
#[inline(always)]
fn eval<B: LaneBsdf>(bsdf: &B, queries: &BsdfQueryRows, out: &mut BsdfEvalRows, count: usize) {
    for i in 0..count.next_multiple_of(LANES).min(BATCH) {
        out.set(i, &bsdf.eval(queries.wo.get(i), queries.wi.get(i)));
    }
}

#[inline(always)]
fn sample<B: LaneBsdf>(bsdf: &B, queries: &BsdfQueryRows, out: &mut BsdfSampleRows, count: usize) {
    for i in 0..count.next_multiple_of(LANES).min(BATCH) {
        out.set(i, bsdf.sample(queries.wo.get(i), queries.u_lobe[i], [queries.u[i], queries.v[i]]));
    }
}

/// Lanes of the widest vectors.
const LANES: usize = 16;
