//! The ends of every range: surfaces that are all but smooth, and the corners of the principled model's parameters.

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::super::geometry::Rng;
use super::super::{Effort, Faults, Outcome, sidak_level};
use super::density::{compare, judge_directions, judge_integrals};
use super::materials::{Material, View, corner, direction, glass, gold};
use super::weights::{Weights, check_samples};
use crate::bsdf::{Bsdf, BsdfEval, Plastic};
use crate::color::Rgb;
use crate::math::Vec3;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::stability::statistics::random_points;

/// Incident radiance that differs by direction.
fn sky(w: Vec3) -> f64 {
    f64::from(1.0 + 0.5 * w.x + 0.3 * w.y - 0.4 * w.z)
}

/// The contribution of one sample.
fn contribution(bsdf: &Bsdf, wo: Vec3, u: [f32; 4]) -> f64 {
    bsdf.sample(wo, u[2], [u[0], u[1]]).map_or(0.0, |s| f64::from(s.weight.g) * sky(s.wi))
}

/// Mean and its variance.
fn estimate(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for value in values {
        n += 1.0;
        let change = value - mean;
        mean += change / n;
        squares += change * (value - mean);
    }
    (mean, squares / (n * (n - 1.0)))
}

/// p-value of Welch's test of two materials by different random numbers, and the relative difference of their means by
/// the same.
fn welch(a: &Bsdf, b: &Bsdf, wo: Vec3, count: u32) -> (f64, f64) {
    let of = |bsdf: &Bsdf, seed: u32| estimate(random_points(seed, count).map(|u| contribution(bsdf, wo, u)));
    let ((mean_a, variance_a), (mean_b, variance_b)) = (of(a, 1), of(b, 2));
    let t = (mean_a - mean_b) / (variance_a + variance_b).sqrt();
    let freedom = (variance_a + variance_b).powi(2) / (variance_a.powi(2) + variance_b.powi(2)) * f64::from(count - 1);
    let p = 2.0 * StudentsT::new(0.0, 1.0, freedom).expect("positive degrees of freedom").sf(t.abs());
    (p, (mean_a / of(b, 1).0 - 1.0).abs())
}

/// Surfaces with alpha at the limit of roughness against smooth ones.
fn judge_smooth_limit(outcome: Outcome, effort: Effort) -> Outcome {
    let plastic = |alpha| Bsdf::Plastic(Plastic::new(Rgb::new(0.1, 0.2, 0.7), 1.5, alpha));
    let pairs = [
        (gold([1e-4; 2]), gold([0.0; 2])),
        // Twice the least alpha at which refraction by this index counts as rough.
        (glass(1.5, [4e-4; 2]).bsdf, glass(1.5, [0.0; 2]).bsdf),
        (plastic([1e-4; 2]), plastic([0.0; 2])),
    ];
    let deltas = Faults::of(&pairs, |(rough, _)| usize::from(rough.flags().is_delta()), |pair| format!("{:?}", pair.0));
    let cases = pairs.iter().flat_map(|pair| [1.0, 0.8, 0.4, -0.9, -0.5].map(|cos| (pair, direction(cos, 0.3))));
    let found: Vec<_> =
        cases.map(|((rough, smooth), wo)| welch(rough, smooth, wo, effort.pick(20_000, 1_000_000))).collect();
    outcome
        .none("materials that count as smooth already", deltas)
        .at_least(
            "smallest p-value of rough against smooth",
            found.iter().map(|f| f.0).fold(1.0, f64::min),
            sidak_level(found.len()),
        )
        // A lobe of width 4e-4 changes the mean by about as much.
        .at_most("relative difference by the same random numbers", found.iter().map(|f| f.1).fold(0.0, f64::max), 2e-3)
}

fn is_sound(value: Rgb, pdf: f32) -> bool {
    value.is_finite() && value.to_array().iter().all(|&v| v >= 0.0) && pdf.is_finite() && pdf >= 0.0
}

/// Samples and evaluations of a material, from all directions down to the smallest cosine, that are no numbers or
/// negative.
fn unsound(bsdf: &Bsdf) -> usize {
    const COSINES: [f32; 7] = [1.0, 1e-3, 1e-6, 1e-12, 1e-30, 1e-45, 0.0];
    const COSINES_I: [f32; 7] = [1.0, 1e-3, 1e-12, 1e-30, -1e-6, -1.0, 0.0];
    const LAST: f32 = ONE_MINUS_EPSILON;
    let mut count = 0;
    for wo in COSINES.iter().flat_map(|&cos| [direction(cos, 0.2), direction(-cos, 0.7)]) {
        count += usize::from(!bsdf.albedo(wo).is_finite());
        for lobe in [0.0, 0.3, 0.5, 0.8, LAST] {
            for u in [[0.0, 0.0], [0.0, LAST], [LAST, 0.0], [0.4, 0.6]] {
                let Some(s) = bsdf.sample(wo, lobe, u) else { continue };
                count += usize::from(!(is_sound(s.weight, s.pdf) && s.pdf > 0.0 && (s.wi.length() - 1.0).abs() < 1e-4));
            }
        }
        for cos_i in COSINES_I {
            let BsdfEval { value, pdf } = bsdf.eval(wo, direction(cos_i, 0.7));
            count += usize::from(!is_sound(value, pdf));
        }
    }
    count
}

/// G1 to G3 for random corners.
fn judge_corners(outcome: Outcome, effort: Effort) -> Outcome {
    let mut rng = Rng::new(10);
    let corners: Vec<Material> = (0..effort.pick(6, 64)).map(|_| corner(rng.below(1 << 10) as u32)).collect();
    let directions = effort.pick(&[0.7f32][..], &[1.0, 0.7, 0.05, -0.6]);
    let views: Vec<View> = corners
        .iter()
        .flat_map(|material| directions.iter().map(|&cos| View { material: material.clone(), wo: direction(cos, 0.1) }))
        .collect();
    let comparisons: Vec<_> = views.par_iter().map(|view| compare(view, effort.pick(30_000, 300_000), 19)).collect();
    let mut weights = Weights::default();
    for material in &corners {
        check_samples(&mut weights, material, effort.pick(5_000, 100_000), &mut rng);
    }
    weights.judge(judge_integrals(judge_directions(outcome, &comparisons), &comparisons))
}

pub(super) fn g10_limits(effort: Effort) -> Outcome {
    let corners: Vec<u32> = (0..2048).collect();
    let broken = Faults::of(&corners, |&bits| unsound(&corner(bits).bsdf), |&bits| corner(bits).name);
    let outcome = Outcome::new().none("values at 2048 corners that are no numbers or negative", broken);
    judge_corners(judge_smooth_limit(outcome, effort), effort)
}
