//! Measured reflection: tables of metals whose reflection is known.

use std::f32::consts::{FRAC_PI_2, PI};

use super::sampling::worst_disagreement;
use super::*;
use crate::measured::{MeasuredData, MeasuredTable};
use crate::sampling::statistics::{compare_directions, random_points};
use crate::sampling::{BilinearTable, BilinearWarp, SliceMix};

/// Points of the tables of distributions along each axis.
const POINTS: usize = 40;

/// The half vector of a place in the unit square.
fn half_vector([u, v]: [f32; 2], azimuth: f32) -> Vec3 {
    let theta = u * u * FRAC_PI_2;
    direction(theta.cos(), (2.0 * v - 1.0) * 0.5 + azimuth / (2.0 * PI))
}

fn grid<T>(value: impl Fn([f32; 2]) -> T) -> Vec<T> {
    let at = |k: usize| k as f32 / (POINTS - 1) as f32;
    (0..POINTS * POINTS).map(|k| value([at(k % POINTS), at(k / POINTS)])).collect()
}

fn table<T>(values: Vec<T>) -> MeasuredTable<T> {
    MeasuredTable { size: [POINTS; 2], values }
}

fn lerp(count: usize, [low, high]: [f32; 2]) -> Vec<f32> {
    (0..count).map(|i| low + (high - low) * i as f32 / (count - 1).max(1) as f32).collect()
}

/// The GGX distribution and the area that microfacets show to a direction.
fn ggx([a, b]: [f32; 2], w: Vec3) -> [f32; 2] {
    let stretched = (w.x / a).powi(2) + (w.y / b).powi(2) + w.z * w.z;
    let area = 0.5 * (w.z + ((a * w.x).powi(2) + (b * w.y).powi(2) + w.z * w.z).sqrt());
    [1.0 / (PI * a * b * stretched * stretched), area]
}

/// Measures a metal of separable GGX facets.
fn measure(metal: &Bsdf, alpha: [f32; 2]) -> Measured {
    let phi = if alpha[0] == alpha[1] { vec![0.0] } else { lerp(10, [-PI, -FRAC_PI_2]) };
    let theta = lerp(12, [0.02, 1.55]);
    let (mut visible, mut luminance, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for (&phi_o, &theta_o) in phi.iter().flat_map(|phi| theta.iter().map(move |theta| (phi, theta))) {
        let o = direction(theta_o.cos(), phi_o / (2.0 * PI));
        let turned = if phi.len() == 1 { phi_o } else { 0.0 };
        let slice = grid(|place| {
            let m = half_vector(place, turned);
            let [d, _] = ggx(alpha, m);
            d * o.dot(m).max(0.0) * place[0] * m.x.hypot(m.y)
        });
        let warp = BilinearWarp::new(BilinearTable::new([POINTS; 2], slice.clone()));
        let slice_colors = grid(|u| {
            let m = half_vector(warp.sample(&SliceMix::FIRST, u), turned);
            let i = m * (2.0 * o.dot(m)) - o;
            let scale = ggx(alpha, m)[0] / (4.0 * ggx(alpha, o)[1]);
            (metal.eval(o, i).value / scale).to_array()
        });
        visible.extend(slice);
        luminance.extend(slice_colors.iter().map(|[r, g, b]| r + g + b + 0.02));
        colors.extend(slice_colors);
    }
    Measured::new(MeasuredData {
        phi,
        theta,
        ndf: table(grid(|place| ggx(alpha, half_vector(place, 0.0))[0])),
        sigma: table(grid(|place| ggx(alpha, half_vector(place, 0.0))[1])),
        vndf: table(visible),
        luminance: table(luminance),
        colors: table(colors),
        jacobian: true,
    })
}

/// A metal and how it was measured, round and stretched.
fn pairs() -> Vec<(Bsdf, Bsdf)> {
    let pair = |alpha| (separable_gold(alpha), Bsdf::Measured(measure(&separable_gold(alpha), alpha)));
    [[0.35; 2], [0.5, 0.2]].map(pair).into()
}

const EYES: [(f32, f32); 5] = [(0.98, 0.3), (0.8, 0.1), (0.6, 0.45), (0.4, 0.8), (-0.7, 0.6)];

#[test]
fn tables_reflect_as_what_they_were_measured_of() {
    for (metal, measured) in pairs() {
        for (cos, turns) in EYES {
            let wo = direction(cos, turns);
            let (mut difference, mut whole) = (0.0, 0.0);
            for u in random_points(9, 20_000) {
                let wi = direction((1.0 - u[0]).copysign(cos), u[1]);
                let (expected, found) = (metal.eval(wo, wi).value, measured.eval(wo, wi).value);
                difference += (expected - found).map(f32::abs).mean();
                whole += expected.mean();
            }
            assert!(difference < 0.03 * whole, "{measured:?} {wo}: {}", difference / whole);
            // What leaves in all: no energy is gained beyond that of the metal.
            let reflected = |bsdf: &Bsdf| {
                let samples = random_points(10, 40_000).filter_map(|u| bsdf.sample(wo, u[2], [u[0], u[1]]));
                samples.fold(Rgb::BLACK, |sum, sample| sum + sample.weight) / 40_000.0
            };
            let (expected, found) = (reflected(&metal), reflected(&measured));
            assert!((expected - found).map(f32::abs).max_channel() < 0.01, "{wo}: {expected:?} {found:?}");
            assert!((measured.albedo(wo) - found).map(f32::abs).max_channel() < 0.02, "{wo}: {found:?}");
            assert!(found.max_channel() < 1.0);
        }
    }
}

#[test]
fn directions_follow_the_density() {
    for (seed, (_, measured)) in pairs().iter().enumerate() {
        for (cos, turns) in EYES {
            let wo = direction(cos, turns);
            let sample = |u: [f32; 4]| measured.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
            compare_directions(200_000, seed as u32, sample, |wi| measured.eval(wo, wi).pdf)
                .check(&format!("{measured:?} {wo}"));
        }
        assert!(worst_disagreement(measured, &[1.0, 0.7, 0.3, 0.05, -0.5]) < 1e-6);
    }
}

#[test]
fn both_sides_and_only_they_reflect_alike() {
    for (metal, measured) in pairs() {
        assert_eq!(measured.flags().is_anisotropic(), metal.flags().is_anisotropic());
        assert!(!measured.flags().transmits() && !measured.flags().is_delta());
        for u in random_points(11, 2_000) {
            let (wo, wi) = (direction(u[0].max(0.01), u[1]), direction(u[2].max(0.01), u[3]));
            let [below_o, below_i] = [wo, wi].map(|w| vec3(w.x, w.y, -w.z));
            assert_eq!(measured.eval(wo, wi), measured.eval(below_o, below_i));
            assert_eq!(measured.eval(wo, below_i), BsdfEval::default());
            if let Some(sample) = measured.sample(below_o, u[2], [u[1], u[3]]) {
                assert!(sample.wi.z < 0.0 && !sample.is_transmission && !sample.is_delta);
            }
        }
        for wo in [Vec3::X, vec3(0.6, 0.8, 0.0)] {
            assert_eq!(measured.eval(wo, Vec3::Z), BsdfEval::default());
            assert!(measured.sample(wo, 0.5, [0.5, 0.5]).is_none());
        }
    }
}

#[test]
fn tables_of_nothing_reflect_nothing() {
    let nothing = |slices: usize| MeasuredTable { size: [2, 2], values: vec![0.0; 4 * slices] };
    let data = MeasuredData {
        phi: vec![0.0],
        theta: vec![0.0, 1.0],
        ndf: nothing(1),
        sigma: nothing(1),
        vndf: nothing(2),
        luminance: nothing(2),
        colors: MeasuredTable { size: [2, 2], values: vec![[0.0; 3]; 8] },
        jacobian: true,
    };
    let measured = Bsdf::Measured(Measured::new(data));
    let wo = direction(0.7, 0.1);
    for u in random_points(12, 1_000) {
        let eval = measured.eval(wo, direction(u[0], u[1]));
        assert!(eval.value.is_black() && eval.pdf.is_finite() && eval.pdf >= 0.0, "{eval:?}");
        if let Some(sample) = measured.sample(wo, u[2], [u[1], u[3]]) {
            assert!(sample.weight.is_black() && (sample.wi.length() - 1.0).abs() < 1e-5);
        }
    }
    assert!(measured.albedo(wo).is_black());
}
