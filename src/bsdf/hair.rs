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

use std::f64::consts::{PI, TAU};

use super::{BsdfEval, BsdfFlags, BsdfSample, fresnel};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};

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
    /// Variance along the hair of the lobes; that of the last is that of the third.
    variance: [f32; 3],
    /// Scale of the logistic distribution around the hair.
    scale: f32,
    /// Sine and cosine of once, twice, and four times the tilt of the scales.
    tilt: [[f32; 2]; 3],
}

/// Components of a direction along and around a hair.
#[derive(Clone, Copy)]
struct HairDirection {
    sin: f64,
    cos: f64,
    /// Angle around the hair, from the normal.
    phi: f64,
}

impl HairDirection {
    fn new(v: Vec3) -> Self {
        let [x, y, z] = v.to_array().map(f64::from);
        let across = y.hypot(z);
        // A direction is unit within rounding only.
        let length = x.hypot(across);
        Self { sin: x / length, cos: across / length, phi: if across > 0.0 { y.atan2(z) } else { 0.0 } }
    }
}

/// What all lobes have in common for one direction back.
struct Lobes {
    wo: HairDirection,
    /// Angle of refraction in the plane across the hair.
    gamma_t: f64,
    attenuation: [Rgb; LOBES],
    /// Probabilities to sample them.
    pmf: [f64; LOBES],
}

impl Hair {
    /// A hair.
    ///
    /// `longitudinal` and `azimuthal` are its roughness along and around it, within `[0, 1]`, of which at least 0.02
    /// counts; `tilt` is the angle of its scales in radians; `ior` is above 1; `sigma_a` is the absorption per radius.
    pub fn new(sigma_a: Rgb, ior: f32, [longitudinal, azimuthal]: [f32; 2], tilt: f32) -> Self {
        let (m, n) = (longitudinal.max(LEAST_ROUGHNESS), azimuthal.max(LEAST_ROUGHNESS));
        let reflected = (0.726 * m + 0.812 * m * m + 3.7 * m.powi(20)).powi(2);
        let scale = (std::f32::consts::PI / 8.0).sqrt() * (0.265 * n + 1.194 * n * n + 5.372 * n.powi(22));
        let sin_cos = |times: f32| <[f32; 2]>::from((times * tilt).sin_cos());
        Self {
            sigma_a,
            eta: ior,
            variance: [reflected, 0.25 * reflected, 4.0 * reflected],
            scale,
            tilt: [1.0, 2.0, 4.0].map(sin_cos),
        }
    }

    /// Value and density for a pair of directions.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let side = 1f32.copysign(wo.z);
        let (wo, wi) = (vec3(wo.x, wo.y, wo.z * side), vec3(wi.x, wi.y, wi.z * side));
        self.eval_lobes(&self.lobes(wo), HairDirection::new(wi))
    }

    fn eval_lobes(&self, lobes: &Lobes, wi: HairDirection) -> BsdfEval {
        let phi = wi.phi - lobes.wo.phi;
        let (mut value, mut pdf) = (Rgb::BLACK, 0.0);
        for p in 0..LOBES {
            let [sin, cos] = self.tilted(&lobes.wo, p);
            let along = longitudinal([wi.sin, wi.cos], [sin, cos], self.variance(p));
            let density = along * self.azimuthal(lobes, p, phi);
            value += lobes.attenuation[p] * density as f32;
            pdf += lobes.pmf[p] * density;
        }
        BsdfEval { value, pdf: pdf as f32 }
    }

    /// A direction; `u_lobe` chooses the lobe and the angle around the hair.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, [u, v]: [f32; 2]) -> Option<BsdfSample> {
        let side = 1f32.copysign(wo.z);
        let lobes = self.lobes(vec3(wo.x, wo.y, wo.z * side));
        let (p, w) = choose(&lobes.pmf, f64::from(u_lobe));

        // Along the hair (d'Eon, Marschner and Hanika, "Importance Sampling for Physically-Based Hair Fiber Models").
        let [sin_o, cos_o] = self.tilted(&lobes.wo, p);
        let variance = self.variance(p);
        let u = f64::from(u);
        let cos = 1.0 + variance * (u.max(1e-30) + (1.0 - u) * (-2.0 / variance).exp()).ln();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let sin_i = (-cos * sin_o + sin * (TAU * f64::from(v)).cos() * cos_o).clamp(-1.0, 1.0);
        let cos_i = (1.0 - sin_i * sin_i).sqrt();

        // Around it.
        let turn =
            if p + 1 < LOBES { exit_angle(&lobes, p) + sample_logistic(w, f64::from(self.scale)) } else { TAU * w };
        let phi = lobes.wo.phi + turn;
        let wi = vec3(sin_i as f32, (cos_i * phi.sin()) as f32, (cos_i * phi.cos()) as f32);
        let BsdfEval { value, pdf } = self.eval_lobes(&lobes, HairDirection::new(wi));
        let wi = vec3(wi.x, wi.y, wi.z * side);
        // False for a NaN.
        (pdf > 0.0 && pdf.is_finite()).then(|| BsdfSample {
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
        let lobes = self.lobes(vec3(wo.x, wo.y, wo.z.abs()));
        lobes.attenuation.iter().fold(Rgb::BLACK, |sum, &a| sum + a)
    }

    fn variance(&self, p: usize) -> f64 {
        f64::from(self.variance[p.min(2)])
    }

    fn lobes(&self, wo: Vec3) -> Lobes {
        let wo = HairDirection::new(wo);
        let (h, cos_gamma) = wo.phi.sin_cos();
        let eta = f64::from(self.eta);

        // The refracted ray, along the hair and across it.
        let sin_t = wo.sin / eta;
        let cos_t = (1.0 - sin_t * sin_t).sqrt();
        let sin_gamma_t = h * wo.cos / ((eta - wo.sin) * (eta + wo.sin)).sqrt();
        let gamma_t = sin_gamma_t.clamp(-1.0, 1.0).asin();
        let path = (2.0 * gamma_t.cos() / cos_t) as f32;
        let transmittance = self.sigma_a.map(|sigma| (-sigma * path).exp());

        let reflectance = fresnel::dielectric((wo.cos * cos_gamma).clamp(0.0, 1.0) as f32, self.eta).reflectance;
        let twice = transmittance * (1.0 - reflectance).powi(2);
        let again = transmittance * reflectance;
        let rest = twice * again * again;
        let attenuation = [
            Rgb::splat(reflectance),
            twice,
            twice * again,
            rest * again.map(|again| 1.0 / (1.0 - again).max(f32::MIN_POSITIVE)),
        ];
        let mut pmf = attenuation.map(|a| f64::from(a.luminance()));
        let sum: f64 = pmf.iter().sum();
        // At grazing angles all is reflected.
        pmf = if sum > 0.0 { pmf.map(|weight| weight / sum) } else { [1.0, 0.0, 0.0, 0.0] };
        Lobes { wo, gamma_t, attenuation, pmf }
    }

    /// Sine and cosine of the angle along the hair, turned by the tilt of the scales as the lobe is.
    fn tilted(&self, wo: &HairDirection, p: usize) -> [f64; 2] {
        let turned = |[sin, cos]: [f32; 2], side: f64| {
            let (sin, cos) = (side * f64::from(sin), f64::from(cos));
            [wo.sin * cos + wo.cos * sin, (wo.cos * cos - wo.sin * sin).abs()]
        };
        match p {
            0 => turned(self.tilt[1], -1.0),
            1 => turned(self.tilt[0], 1.0),
            2 => turned(self.tilt[2], 1.0),
            _ => [wo.sin, wo.cos],
        }
    }

    /// The density of the angle around the hair between both directions.
    fn azimuthal(&self, lobes: &Lobes, p: usize, phi: f64) -> f64 {
        if p + 1 == LOBES {
            return 1.0 / TAU;
        }
        let off = phi - exit_angle(lobes, p);
        logistic(off - TAU * (off / TAU).round(), f64::from(self.scale))
    }
}

/// The angle around the hair from the direction back to that of a perfectly smooth lobe.
fn exit_angle(lobes: &Lobes, p: usize) -> f64 {
    let p = p as f64;
    2.0 * p * lobes.gamma_t - 2.0 * lobes.wo.phi + p * PI
}

/// One of the lobes, and what is left of `u`, within `[0, 1)`.
fn choose(pmf: &[f64; LOBES], u: f64) -> (usize, f64) {
    let (mut p, mut below) = (0, 0.0);
    while p + 1 < LOBES && u >= below + pmf[p] {
        below += pmf[p];
        p += 1;
    }
    (p, ((u - below) / pmf[p].max(f64::MIN_POSITIVE)).clamp(0.0, 1.0 - f64::EPSILON))
}

/// d'Eon's distribution along the hair, from sine and cosine of both angles: `exp(-b) I0(a) / (2 v sinh(1 / v))` with
/// `a = cos cos / v` and `b = sin sin / v`, in logarithms so that nothing overflows.
fn longitudinal([sin_i, cos_i]: [f64; 2], [sin_o, cos_o]: [f64; 2], variance: f64) -> f64 {
    let (a, b) = (cos_i * cos_o / variance, sin_i * sin_o / variance);
    // ln (2 sinh x) = x + ln (1 - exp(-2 x)).
    let log_sinh = 1.0 / variance + (-(-2.0 / variance).exp()).ln_1p();
    (log_bessel(a) - b - log_sinh).exp() / variance
}

/// The logarithm of the modified Bessel function `I0` of an `x` not below 0: by its series, for large ones by its
/// asymptotic expansion (Abramowitz and Stegun, 9.6.10 and 9.7.1), each within 1e-9.
fn log_bessel(x: f64) -> f64 {
    if x < 20.0 {
        let quarter = 0.25 * x * x;
        let (mut term, mut sum) = (1.0, 1.0);
        for i in 1..48 {
            term *= quarter / f64::from(i * i);
            sum += term;
            if term < 1e-12 * sum {
                break;
            }
        }
        return sum.ln();
    }
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..10 {
        let k = f64::from(k);
        term *= (2.0 * k - 1.0).powi(2) / (8.0 * k * x);
        sum += term;
    }
    x - 0.5 * (TAU * x).ln() + sum.ln()
}

/// The logistic density, cut off at half a turn to both sides and normalised there.
fn logistic(x: f64, scale: f64) -> f64 {
    let e = (-x.abs() / scale).exp();
    e / (scale * (1.0 + e).powi(2)) / (1.0 - 2.0 * tail(scale))
}

/// The probability of the logistic distribution beyond half a turn to one side.
fn tail(scale: f64) -> f64 {
    1.0 / (1.0 + (PI / scale).exp())
}

fn sample_logistic(u: f64, scale: f64) -> f64 {
    let outside = tail(scale);
    let cumulative = outside + u * (1.0 - 2.0 * outside);
    (-scale * (1.0 / cumulative - 1.0).ln()).clamp(-PI, PI)
}
