//! Scattering by a whole hair, near enough that its width shows: Chiang et al., "A Practical and Controllable Hair and
//! Fur Model for Production Path Tracing", with the longitudinal scattering of d'Eon et al., "An Energy-Conserving Hair
//! Reflectance Model".
//!
//! `x` of the frame runs along the hair. Where a ray meets the hair across its width, `h` within `[-1, 1]`, follows
//! from the normal: it is the sine of the angle between the normal and the direction back, seen along the hair.
//!
//! Each lobe `p` is light that has crossed the hair `p` times inside: 0 is reflected (R), 1 transmitted (TT), 2
//! reflected once inside (TRT), and the last all light that was reflected more often. A lobe is `Ap Mp Np`: its
//! attenuation, and normalised distributions along and around the hair.

use std::f32::consts::{PI, TAU};

use super::rows::LaneBsdf;
use super::{BsdfEval, BsdfFlags, BsdfSample, fresnel};
use crate::color::Rgb;
use crate::math::{Vec3, angle_of, exp_of, ln_of, sin_cos_turns, vec3};

/// Lobes, the last for all higher orders.
const LOBES: usize = 4;

/// The least roughness that counts: lobes are no deltas.
const LEAST_ROUGHNESS: f32 = 0.02;

/// What light loses in a hair: absorption per radius, `ln` of the fraction left.
///
/// Eumelanin is brown to black, pheomelanin yellow to red (d'Eon et al.; the absorption of both as of pbrt).
pub fn hair_absorption(eumelanin: f32, pheomelanin: f32) -> Rgb {
    Rgb::new(0.419, 0.697, 1.37) * eumelanin + Rgb::new(0.187, 0.4, 1.05) * pheomelanin
}

/// The absorption that gives hair of many strands about a colour, which scatter light several times (Chiang et al.,
/// section 4.2). `azimuthal` is the roughness around the hair.
pub fn hair_absorption_of_color(color: Rgb, azimuthal: f32) -> Rgb {
    let b = azimuthal;
    let scale = 5.969 + b * (-0.215 + b * (2.532 + b * (-10.73 + b * (5.574 + b * 0.245))));
    // Black absorbs all but what no number tells from nothing.
    color.map(|c| (c.max(1e-6).ln() / scale).powi(2))
}

/// A hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hair {
    sigma_a: Rgb,
    eta: f32,
    /// Along the hair, of the lobes; that of the last is that of the third.
    along: [Longitudinal; 3],
    around: Logistic,
    /// Sine and cosine of once, twice, and four times the tilt of the scales.
    tilt: [[f32; 2]; 3],
}

/// Components of a direction along and around a hair.
#[derive(Clone, Copy)]
struct HairDirection {
    sin: f32,
    cos: f32,
    /// Angle around the hair, from the normal.
    phi: f32,
}

impl HairDirection {
    #[inline(always)]
    fn new(v: Vec3) -> Self {
        // A direction is unit within rounding only.
        let across = (v.y * v.y + v.z * v.z).sqrt();
        let length = (v.x * v.x + across * across).sqrt();
        Self { sin: v.x / length, cos: across / length, phi: angle_of(v.y, v.z) }
    }

    /// Sine and cosine of the angle along the hair, turned by an angle given by its own, to one side or the other.
    #[inline(always)]
    fn tilted(self, [sin, cos]: [f32; 2], side: f32) -> (f32, f32) {
        let sin = side * sin;
        (self.sin * cos + self.cos * sin, (self.cos * cos - self.sin * sin).abs())
    }
}

/// A lobe for one direction back.
#[derive(Clone, Copy)]
struct Lobe {
    attenuation: Rgb,
    /// The probability to sample it.
    pmf: f32,
    along: Longitudinal,
    /// Sine and cosine of the angle along the hair, turned by the tilt of the scales as the lobe is.
    sin: f32,
    cos: f32,
    /// The angle around the hair from the direction back to that of a perfectly smooth lobe.
    exit_angle: f32,
}

impl Lobe {
    /// Its part of the value and of the density, for the density `around` the hair.
    #[inline(always)]
    fn eval(&self, wi: HairDirection, around: f32) -> BsdfEval {
        let density = self.along.density([wi.sin, wi.cos], [self.sin, self.cos]) * around;
        BsdfEval { value: self.attenuation * density, pdf: self.pmf * density }
    }
}

impl Hair {
    /// A hair.
    ///
    /// `longitudinal` and `azimuthal` are its roughness along and around it, within `[0, 1]`, of which at least 0.02
    /// counts; `tilt` is the angle of its scales in radians; `ior` is above 1; `sigma_a` is the absorption per radius.
    pub fn new(sigma_a: Rgb, ior: f32, [longitudinal, azimuthal]: [f32; 2], tilt: f32) -> Self {
        let (m, n) = (longitudinal.max(LEAST_ROUGHNESS), azimuthal.max(LEAST_ROUGHNESS));
        let reflected = (0.726 * m + 0.812 * m * m + 3.7 * m.powi(20)).powi(2);
        let scale = (PI / 8.0).sqrt() * (0.265 * n + 1.194 * n * n + 5.372 * n.powi(22));
        let sin_cos = |times: f32| <[f32; 2]>::from((times * tilt).sin_cos());
        Self {
            sigma_a,
            eta: ior,
            along: [1.0, 0.25, 4.0].map(|factor| Longitudinal::new(factor * reflected)),
            around: Logistic::new(scale),
            tilt: [1.0, 2.0, 4.0].map(sin_cos),
        }
    }

    /// The absorption per radius.
    pub(super) fn absorption(&self) -> Rgb {
        self.sigma_a
    }

    /// This hair with another absorption per radius.
    #[inline(always)]
    pub fn with_absorption(self, sigma_a: Rgb) -> Self {
        Self { sigma_a, ..self }
    }

    /// Value and density for a pair of directions.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let side = 1f32.copysign(wo.z);
        let wo = HairDirection::new(vec3(wo.x, wo.y, wo.z * side));
        self.eval_lobes(&self.lobes(wo), wo, HairDirection::new(vec3(wi.x, wi.y, wi.z * side)))
    }

    #[inline(always)]
    fn eval_lobes(&self, lobes: &[Lobe; LOBES], wo: HairDirection, wi: HairDirection) -> BsdfEval {
        let phi = wi.phi - wo.phi;
        let [r, tt, trt, rest] = lobes;
        // What was reflected more often leaves in all directions around the hair. Not a loop, which vector code would
        // leave in place.
        let [r, tt, trt] = [
            r.eval(wi, self.around_exit(phi, r)),
            tt.eval(wi, self.around_exit(phi, tt)),
            trt.eval(wi, self.around_exit(phi, trt)),
        ];
        let rest = rest.eval(wi, 1.0 / TAU);
        BsdfEval {
            value: (r.value + tt.value) + (trt.value + rest.value),
            pdf: (r.pdf + tt.pdf) + (trt.pdf + rest.pdf),
        }
    }

    /// The density of the angle around the hair between both directions, for a lobe around an angle.
    #[inline(always)]
    fn around_exit(&self, phi: f32, lobe: &Lobe) -> f32 {
        let off = phi - lobe.exit_angle;
        self.around.density(off - TAU * (off / TAU).round_ties_even())
    }

    /// A direction; `u_lobe` chooses the lobe and the angle around the hair.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, [u, v]: [f32; 2]) -> Option<BsdfSample> {
        let side = 1f32.copysign(wo.z);
        let back = HairDirection::new(vec3(wo.x, wo.y, wo.z * side));
        let lobes = self.lobes(back);
        let (lobe, is_last, w) = choose(&lobes, u_lobe);

        let below = lobe.along.sample_below(u);
        let (cos, sin) = (1.0 - below, (below * (2.0 - below)).max(0.0).sqrt());
        let (_, cos_around) = sin_cos_turns(v);
        let sin_i = (sin * cos_around * lobe.cos - cos * lobe.sin).clamp(-1.0, 1.0);
        let cos_i = ((1.0 - sin_i) * (1.0 + sin_i)).sqrt();

        let turn = if is_last { TAU * w } else { lobe.exit_angle + self.around.sample(w) };
        let phi = back.phi + turn;
        let (sin_phi, cos_phi) = sin_cos_turns(phi / TAU);
        let BsdfEval { value, pdf } = self.eval_lobes(&lobes, back, HairDirection { sin: sin_i, cos: cos_i, phi });
        let wi = vec3(sin_i, cos_i * sin_phi, cos_i * cos_phi * side);
        // Densities that have an inverse. False for a NaN.
        (f32::MIN_POSITIVE..f32::INFINITY).contains(&pdf).then(|| BsdfSample {
            wi,
            weight: value / pdf,
            pdf,
            is_delta: false,
            is_transmission: wi.z * wo.z < 0.0,
            eta: 1.0,
        })
    }

    /// The lobes.
    pub fn flags(&self) -> BsdfFlags {
        type F = BsdfFlags;
        F::GLOSSY | F::REFLECTION | F::TRANSMISSION | F::ANISOTROPIC | F::FIBER
    }

    /// The fraction of light scattered.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let lobes = self.lobes(HairDirection::new(vec3(wo.x, wo.y, wo.z.abs())));
        lobes.iter().fold(Rgb::BLACK, |sum, lobe| sum + lobe.attenuation)
    }

    #[inline(always)]
    fn lobes(&self, wo: HairDirection) -> [Lobe; LOBES] {
        let eta = self.eta;
        let (h, cos_gamma) = sin_cos_turns(wo.phi / TAU);

        // The refracted ray, along the hair and across it.
        let eta_along = ((eta - wo.sin) * (eta + wo.sin)).sqrt();
        let sin_gamma_t = (h * wo.cos / eta_along).clamp(-1.0, 1.0);
        let cos_gamma_t = ((1.0 - sin_gamma_t) * (1.0 + sin_gamma_t)).sqrt();
        let gamma_t = angle_of(sin_gamma_t, cos_gamma_t);
        let path = 2.0 * cos_gamma_t * eta / eta_along;
        let transmittance = self.sigma_a.map(
            #[inline(always)]
            |sigma| exp_of(-sigma * path),
        );

        let reflectance = fresnel::dielectric((wo.cos * cos_gamma).clamp(0.0, 1.0), eta).reflectance;
        let passing = 1.0 - reflectance;
        let twice = transmittance * (passing * passing);
        let again = transmittance * reflectance;
        let rest = twice * again * again;
        let orders = again.map(
            #[inline(always)]
            |again| 1.0 / (1.0 - again).max(f32::MIN_POSITIVE),
        );
        let [a, b, c, d] = [Rgb::splat(reflectance), twice, twice * again, rest * orders];
        // Not by `map`, which is a call.
        let [w0, w1, w2, w3] = [a.luminance(), b.luminance(), c.luminance(), d.luminance()];
        let sum = (w0 + w1) + (w2 + w3);
        // At grazing angles all is reflected.
        let [w0, inverse] = if sum > 0.0 { [w0, 1.0 / sum] } else { [1.0, 1.0] };
        let [once, doubled, fourfold] = self.tilt;
        let [r, tt, trt] = self.along;
        let [(sin_r, cos_r), (sin_tt, cos_tt), (sin_trt, cos_trt)] =
            [wo.tilted(doubled, -1.0), wo.tilted(once, 1.0), wo.tilted(fourfold, 1.0)];
        let opposite = -2.0 * wo.phi;
        [
            Lobe { attenuation: a, pmf: w0 * inverse, along: r, sin: sin_r, cos: cos_r, exit_angle: opposite },
            Lobe {
                attenuation: b,
                pmf: w1 * inverse,
                along: tt,
                sin: sin_tt,
                cos: cos_tt,
                exit_angle: opposite + (2.0 * gamma_t + PI),
            },
            Lobe {
                attenuation: c,
                pmf: w2 * inverse,
                along: trt,
                sin: sin_trt,
                cos: cos_trt,
                exit_angle: opposite + (4.0 * gamma_t + TAU),
            },
            Lobe { attenuation: d, pmf: w3 * inverse, along: trt, sin: wo.sin, cos: wo.cos, exit_angle: 0.0 },
        ]
    }
}

/// One of the lobes, whether it is the last, and what is left of `u`, within `[0, 1)`.
#[inline(always)]
fn choose([r, tt, trt, rest]: &[Lobe; LOBES], u: f32) -> (Lobe, bool, f32) {
    let ends = [r.pmf, r.pmf + tt.pmf, (r.pmf + tt.pmf) + trt.pmf];
    let (lobe, below) = if u >= ends[0] { (*tt, ends[0]) } else { (*r, 0.0) };
    let (lobe, below) = if u >= ends[1] { (*trt, ends[1]) } else { (lobe, below) };
    let is_last = u >= ends[2];
    let (lobe, below) = if is_last { (*rest, ends[2]) } else { (lobe, below) };
    (lobe, is_last, ((u - below) / lobe.pmf.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0 - f32::EPSILON))
}

/// d'Eon's distribution along the hair: `exp(-b) I0(a) / (2 v sinh(1 / v))` of the variance `v`, with
/// `a = cos cos / v` and `b = sin sin / v`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Longitudinal {
    /// `1 / v`.
    concentration: f32,
    /// `1 / (v (1 - exp(-2 / v)))`.
    normalization: f32,
    /// `exp(-2 / v)`.
    least: f32,
}

impl Longitudinal {
    fn new(variance: f32) -> Self {
        let concentration = 1.0 / variance;
        let of_all = -(-2.0 * f64::from(concentration)).exp_m1();
        let normalization = (f64::from(concentration) / of_all) as f32;
        Self { concentration, normalization, least: (1.0 - of_all) as f32 }
    }

    /// The density, from sine and cosine of both angles. Exponents are summed before anything can overflow:
    /// `2 sinh(x) = exp(x) (1 - exp(-2 x))`.
    #[inline(always)]
    fn density(&self, [sin_i, cos_i]: [f32; 2], [sin_o, cos_o]: [f32; 2]) -> f32 {
        // `cos cos - sin sin - 1` without cancellation.
        let (cos_off, sin_off) = (cos_i - cos_o, sin_i + sin_o);
        let exponent = -0.5 * (cos_off * cos_off + sin_off * sin_off) * self.concentration;
        bessel_times_exponential(cos_i * cos_o * self.concentration, exponent) * self.normalization
    }

    /// One less the cosine to the cone (d'Eon, Marschner and Hanika, "Importance Sampling for Physically-Based Hair
    /// Fiber Models").
    #[inline(always)]
    fn sample_below(&self, u: f32) -> f32 {
        -ln_of(u.max(1e-30) + (1.0 - u) * self.least) / self.concentration
    }
}

/// `exp(y - x) I0(x)` for `x >= 0` and `y <= 0`, with the modified Bessel function `I0`, within 2e-6 of the value,
/// relative to it (Abramowitz and Stegun, 9.8.1 and 9.8.2).
#[inline(always)]
fn bessel_times_exponential(x: f32, y: f32) -> f32 {
    let t = x / 3.75;
    let is_small = t < 1.0;
    let s = t * t;
    let high = 0.265_973_2 + s * (0.036_076_8 + s * 0.004_581_3);
    let small = 1.0 + s * (3.515_622_9 + s * (3.089_942_4 + s * (1.206_749_2 + s * high)));
    let s = 1.0 / t;
    let high = 0.009_162_81 + s * (-0.020_577_06 + s * (0.026_355_37 + s * (-0.016_476_33 + s * 0.003_923_77)));
    let large = 0.398_942_3 + s * (0.013_285_92 + s * (0.002_253_19 + s * (-0.001_575_65 + s * high)));
    (if is_small { small } else { large / x.sqrt() }) * exp_of(if is_small { y - x } else { y })
}

/// The logistic distribution, cut off at half a turn to both sides and normalised there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Logistic {
    scale: f32,
    /// The probability beyond half a turn to one side.
    tail: f32,
}

impl Logistic {
    fn new(scale: f32) -> Self {
        Self { scale, tail: (1.0 / (1.0 + (std::f64::consts::PI / f64::from(scale)).exp())) as f32 }
    }

    #[inline(always)]
    fn density(&self, x: f32) -> f32 {
        let (e, inside) = (exp_of(-x.abs() / self.scale), 1.0 - 2.0 * self.tail);
        e / (self.scale * ((1.0 + e) * (1.0 + e)) * inside)
    }

    #[inline(always)]
    fn sample(&self, u: f32) -> f32 {
        let cumulative = self.tail + u * (1.0 - 2.0 * self.tail);
        (-self.scale * ln_of((1.0 / cumulative.max(1e-30) - 1.0).max(1e-30))).clamp(-PI, PI)
    }
}

impl LaneBsdf for Hair {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.eval(wo, wi)
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        self.sample(wo, u_lobe, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_are_their_integrals() {
        for x in (0..400u16).map(|i| 0.025 * f32::from(i) * f32::from(i)) {
            // (1 / pi) times the integral of exp(x (cos a - 1)) over half a turn; midpoints of a periodic function.
            let exact = f64::from(x);
            let half_turn = std::f64::consts::PI;
            let values = (0..2_000).map(|i| (exact * ((f64::from(i) + 0.5) * half_turn / 2_000.0).cos() - exact).exp());
            let expected = values.sum::<f64>() / 2_000.0;
            let found = f64::from(bessel_times_exponential(x, 0.0));
            assert!((found / expected - 1.0).abs() < 2e-6, "{x}: {found} {expected}");
        }
    }
}
