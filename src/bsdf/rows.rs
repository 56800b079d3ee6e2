//! Scattering for many pairs of directions at once, the same as for each of them alone.

use super::conductor::{MultipleScattering as MetalMultiple, Scattering, SingleScattering as Metal};
use super::dielectric::{MultipleScattering as GlassMultiple, SingleScattering as Glass, Smooth as SmoothGlass};
use super::plastic::{IsotropicPlastic, PlasticLayers, SmoothPlastic};
use super::{Bsdf, BsdfEval, BsdfSample, Hair, Plastic, Principled, SingleScatteringBsdf};
use crate::color::Rgb;
use crate::math::Vec3;
use crate::math::rows::{BATCH, soa};
use crate::math::vectorize::{self, vectorize};

soa! {
    /// Arguments of [`Bsdf::eval`] and of [`Bsdf::sample`], and what differs between their BSDFs.
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
        /// Of BSDFs that vary, the colour of the base, or the absorption of hair,
        color: Rgb,
        /// and the factor on what a coat reflects;
        tint: Rgb,
        /// of principled ones, the reflectance of the dielectric layer ahead,
        specular: Rgb,
        /// the colour of light scattered several times,
        multiple: Rgb,
        /// the share of metal,
        metallic: f32,
        /// the roughness,
        roughness: f32,
        /// the index of refraction,
        ior: f32,
        /// and alpha.
        alpha: f32,
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
        const NONE: BsdfSample = BsdfSample {
            wi: Vec3::ZERO,
            weight: Rgb::BLACK,
            pdf: 0.0,
            is_delta: false,
            is_transmission: false,
            eta: 1.0,
        };
        self.is_valid[i] = u32::from(sample.is_some());
        let BsdfSample { wi, weight, pdf, is_delta, is_transmission, eta } = sample.unwrap_or(NONE);
        self.wi.set(i, wi);
        self.weight.set(i, weight);
        (self.pdf[i], self.eta[i]) = (pdf, eta);
        (self.is_delta[i], self.is_transmission[i]) = (u32::from(is_delta), u32::from(is_transmission));
    }
}

impl BsdfQueryRows {
    /// Sets the parameters of a query's own BSDF, one for which [`Bsdf::can_vary`].
    #[inline]
    pub fn set_parameters(&mut self, i: usize, bsdf: &Bsdf) {
        match bsdf {
            Bsdf::Plastic(plastic) => self.set_plastic(i, plastic),
            Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(plastic)) => self.set_plastic(i, plastic),
            Bsdf::Principled(principled) => principled.set_parameters(i, self),
            Bsdf::Hair(hair) => self.color.set(i, hair.absorption()),
            _ => {}
        }
    }

    #[inline(always)]
    fn set_plastic<D>(&mut self, i: usize, plastic: &Plastic<D>) {
        self.color.set(i, plastic.diffuse);
        self.tint.set(i, plastic.tint);
    }
}

/// A BSDF whose functions are inlined into loops that become vector code.
pub(super) trait LaneBsdf {
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval;
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample>;
}

/// A [`LaneBsdf`] for each lane.
trait LaneBsdfs {
    fn lane(&self, i: usize) -> impl LaneBsdf;
}

/// The same for all lanes.
struct Uniform<B>(B);

impl<B: LaneBsdf + Copy> LaneBsdfs for Uniform<B> {
    #[inline(always)]
    fn lane(&self, _i: usize) -> impl LaneBsdf {
        self.0
    }
}

/// Plastics under one coat.
struct Plastics<'a, D, F> {
    layers: PlasticLayers<'a, D>,
    queries: &'a BsdfQueryRows,
    lane_bsdf: F,
}

impl<'a, D: Copy, B: LaneBsdf, F: Fn(PlasticLayers<'a, D>) -> B> LaneBsdfs for Plastics<'a, D, F> {
    #[inline(always)]
    fn lane(&self, i: usize) -> impl LaneBsdf {
        let (diffuse, tint) = (self.queries.color.get(i), self.queries.tint.get(i));
        (self.lane_bsdf)(PlasticLayers { diffuse, tint, ..self.layers })
    }
}

/// Principled BSDFs of one model.
struct Principleds<'a, F> {
    first: &'a Principled,
    queries: &'a BsdfQueryRows,
    lane_bsdf: F,
}

impl<B: LaneBsdf, F: Fn(&Principled) -> B> LaneBsdfs for Principleds<'_, F> {
    #[inline(always)]
    fn lane(&self, i: usize) -> impl LaneBsdf {
        (self.lane_bsdf)(&self.first.with_parameters(i, self.queries))
    }
}

/// Hairs that differ in absorption alone.
struct Hairs<'a> {
    first: &'a Hair,
    queries: &'a BsdfQueryRows,
}

impl LaneBsdfs for Hairs<'_> {
    #[inline(always)]
    fn lane(&self, i: usize) -> impl LaneBsdf {
        self.first.with_absorption(self.queries.color.get(i))
    }
}

/// `$body` with BSDFs that are fit for vector code as `$lanes`, else `$otherwise`.
macro_rules! lanes {
    ($bsdf:expr, $varying:expr, $lanes:ident => $body:expr, $otherwise:expr) => {{
        macro_rules! with {
            ($made:expr) => {{
                let $lanes = $made;
                $body
            }};
        }
        macro_rules! with_plastic {
            ($plastic:expr, $kind:path) => {
                match $varying {
                    None => with!(Uniform($kind($plastic.layers()))),
                    Some(queries) => with!(Plastics { layers: $plastic.layers(), queries, lane_bsdf: $kind }),
                }
            };
        }
        macro_rules! with_principled {
            ($principled:expr, $basic:expr) => {
                match $varying {
                    None => with!(Uniform($basic($principled))),
                    Some(queries) => with!(Principleds { first: $principled, queries, lane_bsdf: $basic }),
                }
            };
        }
        match $bsdf {
            Bsdf::Principled(bsdf) if bsdf.is_basic() && bsdf.is_mitsuba() => {
                with_principled!(bsdf, Principled::basic::<true>)
            }
            Bsdf::Principled(bsdf) if bsdf.is_basic() => with_principled!(bsdf, Principled::basic::<false>),
            Bsdf::Conductor(bsdf) => match bsdf.scattering() {
                Scattering::Single => with!(Uniform(Metal(bsdf))),
                Scattering::Multiple { isotropic: true } => with!(Uniform(MetalMultiple::<_, true>(bsdf))),
                Scattering::Smooth | Scattering::Multiple { isotropic: false } => $otherwise,
            },
            Bsdf::Dielectric(bsdf) if bsdf.flags().is_delta() => with!(Uniform(SmoothGlass(bsdf))),
            Bsdf::Dielectric(bsdf) => match bsdf.multiple() {
                None => with!(Uniform(Glass(bsdf))),
                Some(multiple) => with!(Uniform(GlassMultiple { bsdf, multiple })),
            },
            Bsdf::Plastic(bsdf) if bsdf.coat.is_smooth() => with_plastic!(bsdf, SmoothPlastic),
            Bsdf::Plastic(bsdf) if !bsdf.flags().is_anisotropic() => with_plastic!(bsdf, IsotropicPlastic),
            Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(bsdf)) if bsdf.coat.is_smooth() => {
                with_plastic!(bsdf, SmoothPlastic)
            }
            Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(bsdf)) if !bsdf.flags().is_anisotropic() => {
                with_plastic!(bsdf, IsotropicPlastic)
            }
            Bsdf::SeparableGgx(SingleScatteringBsdf::Conductor(bsdf)) if bsdf.scattering() == Scattering::Single => {
                with!(Uniform(Metal(bsdf)))
            }
            Bsdf::SeparableGgx(SingleScatteringBsdf::Dielectric(bsdf)) if !bsdf.flags().is_delta() => {
                with!(Uniform(Glass(bsdf)))
            }
            Bsdf::Hair(bsdf) => match $varying {
                None => with!(Uniform(*bsdf)),
                Some(queries) => with!(Hairs { first: bsdf, queries }),
            },
            _ => $otherwise,
        }
    }};
}

impl Bsdf {
    /// Whether BSDFs of one material that are like this one, and of plastics and hair those that differ in colours
    /// alone, can be one group of queries.
    pub fn can_vary(&self) -> bool {
        match self {
            Self::Plastic(bsdf) => bsdf.coat.is_smooth() || !bsdf.coat.is_anisotropic(),
            Self::SeparableGgx(SingleScatteringBsdf::Plastic(bsdf)) => {
                bsdf.coat.is_smooth() || !bsdf.coat.is_anisotropic()
            }
            Self::Principled(bsdf) => bsdf.is_basic(),
            Self::Hair(_) => true,
            _ => false,
        }
    }

    /// [`eval`](Self::eval) for the first `count` queries, at most [`BATCH`]; with the parameters of the queries where
    /// `varies`.
    pub fn eval_rows(&self, queries: &BsdfQueryRows, varies: bool, count: usize, out: &mut BsdfEvalRows) {
        let single = |i: usize| self.eval(queries.wo.get(i), queries.wi.get(i));
        if count == 1 {
            return out.set(0, &single(0));
        }
        lanes!(self, varies.then_some(queries), bsdfs => {
            let count = machine_vectors(count);
            vectorize!(eval(&bsdfs, queries, out, count))
        }, {
            (0..count.min(BATCH)).for_each(|i| out.set(i, &single(i)));
        });
    }

    /// [`sample`](Self::sample) for the first `count` queries, as [`eval_rows`](Self::eval_rows).
    pub fn sample_rows(&self, queries: &BsdfQueryRows, varies: bool, count: usize, out: &mut BsdfSampleRows) {
        let single = |i: usize| self.sample(queries.wo.get(i), queries.u_lobe[i], [queries.u[i], queries.v[i]]);
        if count == 1 {
            return out.set(0, single(0));
        }
        lanes!(self, varies.then_some(queries), bsdfs => {
            let count = machine_vectors(count);
            vectorize!(sample(&bsdfs, queries, out, count))
        }, {
            (0..count.min(BATCH)).for_each(|i| out.set(i, single(i)));
        });
    }
}

/// The count rounded up to the vectors that the machine has, which may be narrower than those of
/// [`whole_vectors`](crate::math::rows::whole_vectors): groups are small, and a lane takes long.
fn machine_vectors(count: usize) -> usize {
    count.next_multiple_of(vectorize::lanes()).min(BATCH)
}

#[inline(always)]
fn eval(bsdfs: &impl LaneBsdfs, queries: &BsdfQueryRows, out: &mut BsdfEvalRows, count: usize) {
    for i in 0..count.min(BATCH) {
        out.set(i, &bsdfs.lane(i).eval(queries.wo.get(i), queries.wi.get(i)));
    }
}

#[inline(always)]
fn sample(bsdfs: &impl LaneBsdfs, queries: &BsdfQueryRows, out: &mut BsdfSampleRows, count: usize) {
    for i in 0..count.min(BATCH) {
        out.set(i, bsdfs.lane(i).sample(queries.wo.get(i), queries.u_lobe[i], [queries.u[i], queries.v[i]]));
    }
}
