//! Weights of samples, and reciprocity.

use super::super::geometry::Rng;
use super::super::{Effort, Faults, Outcome};
use super::materials::{Material, direction, rough, single_scattering, smooth};
use crate::bsdf::Bsdf;
use crate::math::Vec3;

/// How far each component of a direction may be from its exact value: it is the sum of a few products of numbers up to
/// 2, each of which is rounded.
const ROUNDING: f32 = 1.0 / (1 << 22) as f32;

/// Relative difference of two numbers.
fn difference(a: f32, b: f32) -> f64 {
    let (a, b) = (f64::from(a), f64::from(b));
    if a.is_finite() && b.is_finite() { (a - b).abs() / a.abs().max(b.abs()).max(1e-20) } else { f64::INFINITY }
}

/// Density, and value over density, for a pair of directions.
fn evaluated(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> [f32; 4] {
    let eval = bsdf.eval(wo, wi);
    let weight = eval.value / eval.pdf;
    [eval.pdf, weight.r, weight.g, weight.b]
}

/// Largest relative difference of corresponding numbers.
fn largest<const N: usize>(a: [f32; N], b: [f32; N]) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| difference(a, b)).fold(0.0, f64::max)
}

/// How much the rounding of `w` changes `f`, relative to `f(w)`.
fn sensitivity<const N: usize>(w: Vec3, f: impl Fn(Vec3) -> [f32; N]) -> f64 {
    let current = f(w);
    let steps = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis * ROUNDING, axis * -ROUNDING]);
    steps.map(|step| largest(current, f(w + step))).fold(0.0, f64::max)
}

/// A direction of either side, as likely grazing as not.
fn any_direction(rng: &mut Rng) -> Vec3 {
    let cos = if rng.unit() < 0.5 { rng.range(0.001, 1.0) } else { rng.magnitude(-3.0, 0.0) } as f32;
    let side = if rng.unit() < 0.5 { 1.0 } else { -1.0 };
    direction(cos * side, rng.unit_f32())
}

/// What [`check_samples`] finds.
#[derive(Clone, Debug, Default)]
pub struct Weights {
    /// Largest relative difference of a sample's weight and density from the evaluation of its direction.
    pub raw: f64,
    /// The same beyond what the rounding of the direction explains.
    pub unexplained: f64,
    /// Where that is.
    pub worst: String,
    /// Samples on another side than that of their lobe, or by a lobe that is a delta and yet has a density.
    pub wrong: Faults,
}

/// Draws samples of one material and adds what is found.
pub fn check_samples(found: &mut Weights, material: &Material, count: usize, rng: &mut Rng) {
    let bsdf = &material.bsdf;
    for _ in 0..count {
        let wo = any_direction(rng);
        let Some(s) = bsdf.sample(wo, rng.unit_f32(), rng.pair()) else { continue };
        let side = s.is_transmission == (s.wi.z * wo.z < 0.0) && (bsdf.flags().transmits() || !s.is_transmission);
        let eta = match (s.is_transmission, wo.z > 0.0) {
            (false, _) => 1.0,
            (true, true) => material.ior,
            (true, false) => 1.0 / material.ior,
        };
        found.wrong.require(side && s.eta == eta, || format!("{} from {wo}: {s:?}", material.name));
        if s.is_delta {
            continue;
        }
        let sampled = [s.pdf, s.weight.r, s.weight.g, s.weight.b];
        let raw = largest(sampled, evaluated(bsdf, wo, s.wi));
        found.raw = found.raw.max(raw);
        if raw > found.unexplained {
            let unexplained = raw - sensitivity(s.wi, |wi| evaluated(bsdf, wo, wi));
            if unexplained > found.unexplained || unexplained.is_nan() {
                found.unexplained = unexplained;
                found.worst.clone_from(&material.name);
            }
        }
    }
}

impl Weights {
    /// The measures of G3.
    pub fn judge(self, outcome: Outcome) -> Outcome {
        outcome
            .at_most(
                format!("relative difference beyond what rounding the direction by 2^-22 changes ({})", self.worst),
                self.unexplained,
                1e-4,
            )
            .none("samples with a wrong side or index", self.wrong)
            .record("relative difference in all", self.raw)
    }
}

pub(super) fn g3_weights(effort: Effort) -> Outcome {
    let mut rng = Rng::new(3);
    let mut found = Weights::default();
    for material in rough().into_iter().chain(smooth()).chain(single_scattering()) {
        check_samples(&mut found, &material, effort.pick(10_000, 200_000), &mut rng);
    }
    found.judge(Outcome::new())
}

/// Scattering from `b` to `a` without the cosine, times the squared index on the side of `b`.
fn scaled(material: &Material, a: Vec3, b: Vec3) -> [f32; 3] {
    let index = if b.z < 0.0 { material.ior } else { 1.0 };
    (material.bsdf.eval(a, b).value * (index * index / b.z.abs())).to_array()
}

pub(super) fn g4_reciprocity(effort: Effort) -> Outcome {
    let mut rng = Rng::new(4);
    let (mut raw, mut unexplained, mut worst, mut compared) = (0.0, 0.0, String::new(), [0usize; 2]);
    for material in rough() {
        for i in 0..effort.pick(4_000, 100_000) {
            let a = any_direction(&mut rng);
            // Half of the pairs lie within the lobes.
            let sample = if i % 2 == 0 {
                material.bsdf.sample(a, rng.unit_f32(), rng.pair()).filter(|s| !s.is_delta)
            } else {
                None
            };
            let b = sample.map_or_else(|| any_direction(&mut rng), |s| s.wi);
            let (ab, ba) = (scaled(&material, a, b), scaled(&material, b, a));
            if b.z.abs() < 0.001 || ab.iter().chain(&ba).all(|&x| x < 1e-18) {
                continue;
            }
            compared[usize::from(a.z * b.z < 0.0)] += 1;
            let error = largest(ab, ba);
            raw = error.max(raw);
            if error > unexplained {
                let explained = [
                    sensitivity(a, |a| scaled(&material, a, b)),
                    sensitivity(b, |b| scaled(&material, a, b)),
                    sensitivity(a, |a| scaled(&material, b, a)),
                    sensitivity(b, |b| scaled(&material, b, a)),
                ];
                let error = error - explained.into_iter().fold(0.0, f64::max);
                if error > unexplained {
                    unexplained = error;
                    worst.clone_from(&material.name);
                }
            }
        }
    }
    Outcome::new()
        .at_most(
            format!("relative difference beyond what rounding the directions by 2^-22 changes ({worst})"),
            unexplained,
            1e-4,
        )
        .record("relative difference in all", raw)
        .at_least("pairs on the same side", compared[0] as f64, 1e4)
        .at_least("pairs on opposite sides", compared[1] as f64, 1e4)
}
