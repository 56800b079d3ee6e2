//! Visible normals of GGX against another way to sample them.

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::super::{Effort, Faults, Outcome, sidak_level};
use super::materials::{ALPHAS, direction};
use crate::bsdf::{Ggx, Microfacets};
use crate::math::{Vec3, sin_cos_turns, vec3};
use crate::stability::statistics::{compare_directions, random_points};

/// Heitz, "Sampling the GGX Distribution of Visible Normals": the same density by another construction.
fn sample_by_disk(ggx: &Ggx, o: Vec3, u: [f32; 2]) -> Vec3 {
    let [ax, ay] = ggx.alpha();
    let w = vec3(ax * o.x, ay * o.y, o.z).normalize();
    let across = w.truncate().length_squared();
    let t1 = if across > 0.0 { vec3(-w.y, w.x, 0.0) / across.sqrt() } else { Vec3::X };
    let t2 = w.cross(t1);
    let (sin, cos) = sin_cos_turns(u[1]);
    let (p1, p2) = (u[0].sqrt() * cos, u[0].sqrt() * sin);
    let s = 0.5 * (1.0 + w.z);
    let p2 = (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt() + s * p2;
    let n = t1 * p1 + t2 * p2 + w * (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
    vec3(ax * n.x, ay * n.y, n.z.max(0.0)).normalize()
}

const ROWS: usize = 16;
const COLUMNS: usize = 32;

/// The cell of a normal after alpha is divided out, where the distribution is broad however narrow its lobe: by height
/// and azimuth.
fn cell(ggx: &Ggx, m: Vec3) -> usize {
    let [ax, ay] = ggx.alpha().map(f64::from);
    let n = crate::math::dvec3(f64::from(m.x) / ax, f64::from(m.y) / ay, f64::from(m.z)).normalize();
    let turns = (n.y.atan2(n.x) / std::f64::consts::TAU).rem_euclid(1.0);
    let row = ((n.z * ROWS as f64) as usize).min(ROWS - 1);
    row * COLUMNS + ((turns * COLUMNS as f64) as usize).min(COLUMNS - 1)
}

/// p-value of the hypothesis that two sets of as many draws have the same distribution; cells with few draws are
/// pooled.
fn two_sample_p_value(a: &[u32], b: &[u32]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0u32);
    let mut pool = [0f64; 2];
    for (&a, &b) in a.iter().zip(b) {
        pool = [pool[0] + f64::from(a), pool[1] + f64::from(b)];
        let sum = pool[0] + pool[1];
        if sum >= 10.0 {
            statistic += (pool[0] - pool[1]).powi(2) / sum;
            cells += 1;
            pool = [0.0; 2];
        }
    }
    if cells < 2 {
        1.0
    } else {
        ChiSquared::new(f64::from(cells - 1)).expect("positive degrees of freedom").sf(statistic)
    }
}

/// What is found for one distribution and direction.
struct Normals {
    name: String,
    p_value: f64,
    histograms: [Vec<u32>; 2],
    /// Normals that are no unit vectors or point into the surface.
    broken: usize,
    /// Normals that do not face the direction, and the smallest cosine with it.
    hidden: usize,
    least_cos: f64,
}

fn compare(alpha: [f32; 2], cos: f32, count: u32) -> Normals {
    let ggx = Ggx::new(alpha);
    let o = direction(cos, 0.15);
    let mut found = Normals {
        name: format!("alpha {alpha:?}, cosine {cos}"),
        p_value: 1.0,
        histograms: [vec![0; ROWS * COLUMNS], vec![0; ROWS * COLUMNS]],
        broken: 0,
        hidden: 0,
        least_cos: f64::INFINITY,
    };
    for u in random_points(3, count) {
        let m = ggx.sample_visible_normal(o, [u[0], u[1]]);
        if !((m.length() - 1.0).abs() < 1e-5 && m.z >= 0.0) {
            found.broken += 1;
            continue;
        }
        found.hidden += usize::from(o.dot(m) <= 0.0);
        found.least_cos = found.least_cos.min(f64::from(o.dot(m)));
        found.histograms[0][cell(&ggx, m)] += 1;
        found.histograms[1][cell(&ggx, sample_by_disk(&ggx, o, [u[2], u[3]]))] += 1;
    }
    found.p_value = two_sample_p_value(&found.histograms[0], &found.histograms[1]);
    found
}

pub(super) fn g8_visible_normals(effort: Effort) -> Outcome {
    let alphas = ALPHAS.into_iter().chain([[1e-4; 2], [1e-3; 2], [1.0, 1e-4], [0.1, 0.9]]);
    let cases: Vec<_> = alphas.flat_map(|alpha| [1.0, 0.5, 0.05, 1e-3, 1e-6].map(|cos| (alpha, cos))).collect();
    let found: Vec<_> =
        cases.par_iter().map(|&(alpha, cos)| compare(alpha, cos, effort.pick(40_000, 2_000_000))).collect();
    let level = sidak_level(found.len());
    let worst = found.iter().min_by(|a, b| a.p_value.total_cmp(&b.p_value)).expect("there are cases");
    let hidden = found.iter().map(|n| n.hidden).sum::<usize>() as f64
        / found.len() as f64
        / f64::from(effort.pick(40_000, 2_000_000));

    let densities: Vec<f64> = ALPHAS
        .iter()
        .flat_map(|&alpha| [1.0, 0.6, 0.05].map(|cos| (Ggx::new(alpha), direction(cos, 0.15))))
        .map(|(ggx, o)| {
            let sample = |u: [f32; 4]| Some(ggx.sample_visible_normal(o, [u[0], u[1]]));
            compare_directions(effort.pick(20_000, 1_000_000), 1, sample, |m| ggx.visible_normal_pdf(o, m)).p_value
        })
        .collect();
    let outcome = Outcome::new()
        .at_least(format!("smallest p-value of {}, two samplers ({})", found.len(), worst.name), worst.p_value, level)
        .at_least(
            "smallest p-value against the density",
            densities.iter().copied().fold(1.0, f64::min),
            sidak_level(densities.len()),
        )
        .none(
            "normals that are no unit vectors of the upper side",
            Faults::of(&found, |normals| normals.broken, |normals| normals.name.clone()),
        )
        .at_least("least cosine with the direction", found.iter().map(|n| n.least_cos).fold(1.0, f64::min), 0.0)
        .record("fraction of normals seen from behind", hidden);
    if worst.p_value >= level {
        return outcome;
    }
    let [own, other] =
        worst.histograms.each_ref().map(|cells| cells.iter().copied().map(f64::from).collect::<Vec<_>>());
    outcome.pictures("normals", COLUMNS, &own, &other)
}
