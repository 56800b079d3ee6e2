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
use crate::math::{Vec3, unit_circle, vec3};

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
    sin: f64,
    cos: f64,
    /// Angle around the hair, from the normal.
    phi: f64,
}

impl HairDirection {
    fn new(v: Vec3) -> Self {
        let (x, y, z) = (f64::from(v.x), f64::from(v.y), f64::from(v.z));
        // A direction is unit within rounding only.
        let across = (y * y + z * z).sqrt();
        let length = (x * x + across * across).sqrt();
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
            along: [1.0, 0.25, 4.0].map(|factor| Longitudinal::new(factor * reflected)),
            around: Logistic::new(scale),
            tilt: [1.0, 2.0, 4.0].map(sin_cos),
        }
    }

    /// This hair with another absorption per radius.
    pub fn with_absorption(self, sigma_a: Rgb) -> Self {
        Self { sigma_a, ..self }
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
            let density = self.along(p).density([wi.sin, wi.cos], [sin, cos]) * self.azimuthal(lobes, p, phi);
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

        let [sin_o, cos_o] = self.tilted(&lobes.wo, p);
        let cos = self.along(p).sample_cos(f64::from(u));
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let sin_i = (-cos * sin_o + sin * unit_circle(v).x * cos_o).clamp(-1.0, 1.0);
        let cos_i = (1.0 - sin_i * sin_i).sqrt();

        // Around it.
        let turn = if p + 1 < LOBES { exit_angle(&lobes, p) + self.around.sample(w) } else { TAU * w };
        let phi = lobes.wo.phi + turn;
        let wi = vec3(sin_i as f32, (cos_i * phi.sin()) as f32, (cos_i * phi.cos()) as f32);
        let BsdfEval { value, pdf } = self.eval_lobes(&lobes, HairDirection { sin: sin_i, cos: cos_i, phi });
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

    fn along(&self, p: usize) -> &Longitudinal {
        &self.along[p.min(2)]
    }

    fn lobes(&self, wo: Vec3) -> Lobes {
        let (y, z) = (f64::from(wo.y), f64::from(wo.z));
        let wo = HairDirection::new(wo);
        let across = (y * y + z * z).sqrt();
        let (h, cos_gamma) = if across > 0.0 { (y / across, z / across) } else { (0.0, 1.0) };
        let eta = f64::from(self.eta);

        // The refracted ray, along the hair and across it.
        let sin_t = wo.sin / eta;
        let cos_t = (1.0 - sin_t * sin_t).sqrt();
        let sin_gamma_t = (h * wo.cos / ((eta - wo.sin) * (eta + wo.sin)).sqrt()).clamp(-1.0, 1.0);
        let gamma_t = sin_gamma_t.asin();
        let path = (2.0 * ((1.0 - sin_gamma_t) * (1.0 + sin_gamma_t)).sqrt() / cos_t) as f32;
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
        self.around.density(off - TAU * (off / TAU).round())
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
    fn density(&self, [sin_i, cos_i]: [f64; 2], [sin_o, cos_o]: [f64; 2]) -> f64 {
        let (cos, concentration) = (cos_i * cos_o, f64::from(self.concentration));
        let exponent = (cos - sin_i * sin_o - 1.0) * concentration;
        bessel_without_exponential(cos * concentration) * exponent.exp() * f64::from(self.normalization)
    }

    /// The cosine to the cone (d'Eon, Marschner and Hanika, "Importance Sampling for Physically-Based Hair Fiber
    /// Models").
    fn sample_cos(&self, u: f64) -> f64 {
        1.0 + (u.max(1e-30) + (1.0 - u) * f64::from(self.least)).ln() / f64::from(self.concentration)
    }
}

/// `exp(-x) I0(x)` of an `x` not below 0, with the modified Bessel function `I0`, within 1e-6 of the value (Abramowitz
/// and Stegun, 9.8.1 and 9.8.2).
fn bessel_without_exponential(x: f64) -> f64 {
    let t = x / 3.75;
    if t < 1.0 {
        let t = t * t;
        let high = 0.265_973_2 + t * (0.036_076_8 + t * 0.004_581_3);
        return (1.0 + t * (3.515_622_9 + t * (3.089_942_4 + t * (1.206_749_2 + t * high)))) * (-x).exp();
    }
    let t = 1.0 / t;
    let high = 0.009_162_81 + t * (-0.020_577_06 + t * (0.026_355_37 + t * (-0.016_476_33 + t * 0.003_923_77)));
    (0.398_942_28 + t * (0.013_285_92 + t * (0.002_253_19 + t * (-0.001_575_65 + t * high)))) / x.sqrt()
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
        Self { scale, tail: (1.0 / (1.0 + (PI / f64::from(scale)).exp())) as f32 }
    }

    fn density(&self, x: f64) -> f64 {
        let (scale, inside) = (f64::from(self.scale), 1.0 - 2.0 * f64::from(self.tail));
        let e = (-x.abs() / scale).exp();
        e / (scale * (1.0 + e).powi(2) * inside)
    }

    fn sample(&self, u: f64) -> f64 {
        let tail = f64::from(self.tail);
        let cumulative = tail + u * (1.0 - 2.0 * tail);
        (-f64::from(self.scale) * (1.0 / cumulative - 1.0).ln()).clamp(-PI, PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_are_their_integrals() {
        for x in (0..400).map(|i| 0.025 * f64::from(i * i)) {
            // (1 / pi) times the integral of exp(x (cos a - 1)) over half a turn; midpoints of a periodic function.
            let values = (0..2_000).map(|i| (x * ((f64::from(i) + 0.5) * PI / 2_000.0).cos() - x).exp());
            let expected = values.sum::<f64>() / 2_000.0;
            let found = bessel_without_exponential(x);
            assert!((found / expected - 1.0).abs() < 1e-6, "{x}: {found} {expected}");
        }
    }
}
