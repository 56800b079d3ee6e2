//! Fresnel's equations against closed forms and complex arithmetic in `f64`.

use super::super::geometry::Rng;
use super::super::{Effort, Faults, Outcome};
use crate::bsdf::fresnel::{ComplexIndex, Refraction, dielectric, dielectric_average};

/// Reflectance for an index `eta + i k`, from `(a + ib)^2 = (eta + ik)^2 - sin^2`.
fn exact(cos: f64, eta: f64, k: f64) -> f64 {
    let sin2 = 1.0 - cos * cos;
    let (re, im) = (eta * eta - k * k - sin2, 2.0 * eta * k);
    let modulus = re.hypot(im);
    // The larger of the two parts by a root, the other from their product, without cancellation.
    let (a, b) = if re >= 0.0 {
        let a = (0.5 * (modulus + re)).sqrt();
        (a, if a > 0.0 { 0.5 * im / a } else { 0.0 })
    } else {
        let b = (0.5 * (modulus - re)).sqrt();
        (0.5 * im / b, b)
    };
    let across = ((a - cos).powi(2) + b * b) / ((a + cos).powi(2) + b * b);
    let tilt = sin2 / cos;
    across * (1.0 + ((a - tilt).powi(2) + b * b) / ((a + tilt).powi(2) + b * b)) * 0.5
}

/// The distance of a reflectance from the exact ones of cosines and indices that differ by a rounding: close to the
/// critical angle the root of Snell's law amplifies any rounding a thousandfold.
fn error(found: f32, cos: f32, eta: f32, k: f32) -> f64 {
    const STEP: f64 = 1.0 / (1 << 22) as f64;
    let (cos, eta, k) = (f64::from(cos), f64::from(eta), f64::from(k));
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for i in [-1.0, 0.0, 1.0] {
        for j in [-1.0, 0.0, 1.0] {
            let reflectance = exact((cos * (1.0 + i * STEP)).min(1.0), eta * (1.0 + j * STEP), k);
            range = [range[0].min(reflectance), range[1].max(reflectance)];
        }
    }
    let found = f64::from(found);
    (range[0] - found).max(found - range[1]).max(0.0)
}

pub(super) fn g9_fresnel(effort: Effort) -> Outcome {
    let mut rng = Rng::new(9);
    let (mut glass, mut metal, mut lossless, mut snell) = (0f64, 0f64, 0f64, 0f64);
    let (mut total, mut out_of_range) = (Faults::NONE, Faults::NONE);
    for _ in 0..effort.pick(100_000, 10_000_000) {
        let cos = (1.0 - rng.unit_f32()).min(rng.magnitude(-4.0, 0.5) as f32).min(1.0);
        let eta = rng.magnitude(-1.0, 1.0) as f32;
        let Refraction { reflectance, cos_t } = dielectric(cos, eta);
        glass = glass.max(error(reflectance, cos, eta, 0.0));
        lossless = lossless.max(error(ComplexIndex::new(eta, 0.0).reflectance(cos), cos, eta, 0.0));
        let k = rng.magnitude(-2.0, 1.0) as f32;
        let reflected = ComplexIndex::new(eta, k).reflectance(cos);
        metal = metal.max(error(reflected, cos, eta, k));
        let describe =
            || format!("cosine {cos:?}, index {eta:?} or {eta:?} + {k:?} i: {reflectance:?} or {reflected:?}");
        out_of_range.require([reflectance, reflected].iter().all(|r| (0.0..=1.0).contains(r)), describe);
        let sin2_t = (1.0 - f64::from(cos).powi(2)) / f64::from(eta).powi(2);
        if sin2_t >= 1.0 + 1e-6 {
            total.require(reflectance == 1.0 && cos_t == 0.0, describe);
        } else {
            // Compared as squares: the root amplifies rounding next to the critical angle.
            snell = snell.max((f64::from(cos_t).powi(2) - (1.0 - sin2_t)).abs() / sin2_t.max(1.0));
        }
    }
    // At tan(theta) = eta only the perpendicular half is left: R = ((1 - eta^2) / (1 + eta^2))^2 / 2.
    let brewster = [1.5f32, 1.1, 2.4, 1.0 / 1.5].map(|eta| {
        let square = f64::from(eta).powi(2);
        let expected = 0.5 * ((1.0 - square) / (1.0 + square)).powi(2);
        (f64::from(dielectric((1.0 / (1.0 + square)).sqrt() as f32, eta).reflectance) - expected).abs()
    });
    let ahead = [1.5, 1.0 / 1.5].map(|eta| f64::from((dielectric(1.0, eta).reflectance - 0.04).abs()));
    let glasses = [1.1, 1.5, 10.0, 0.5].map(|eta| dielectric(0.0, eta).reflectance);
    let metals = [[0.2, 3.9], [0.0, 1.0]].map(|[eta, k]| ComplexIndex::new(eta, k).reflectance(0.0));
    let grazing: Vec<f64> =
        glasses.into_iter().chain(metals).map(|reflectance| f64::from((1.0 - reflectance).abs())).collect();
    let nothing = ComplexIndex::new(0.0, 0.0).reflectance(1.0);
    out_of_range.require((0.0..=1.0).contains(&nothing), || format!("index 0: {nothing:?}"));
    let averages = [(1.5, 0.091_78), (1.0 / 1.5, 0.596_35), (1.0, 0.0)]
        .map(|(eta, average)| f64::from((dielectric_average(eta) - average).abs()));
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    Outcome::new()
        .at_most("0.04 ahead for 1.5 from both sides, error", largest(&ahead), 1e-7)
        .at_most("1 at grazing angles, error", largest(&grazing), 0.0)
        .at_most("no parallel light at Brewster's angle, error", largest(&brewster), 1e-7)
        .none("not 1 beyond the critical angle", total)
        .none("reflectances out of [0, 1]", out_of_range)
        .at_most("Snell's law, error of the squared cosine", snell, 1e-5)
        .at_most("dielectrics, error", glass, 1e-5)
        .at_most("metals, error", metal, 1e-5)
        .at_most("metals without extinction against dielectrics, error", lossless, 1e-5)
        .at_most("means under diffuse light, error", largest(&averages), 1e-5)
}
