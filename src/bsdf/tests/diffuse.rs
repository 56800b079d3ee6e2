//! Rough diffuse reflection, diffuse transmission, panes, and the models of older scenes.

use super::*;
use crate::sampling::statistics::{compare_directions, random_points};

fn eon(roughness: f32) -> Bsdf {
    Bsdf::Eon(Eon { albedo: Rgb::new(1.0, 0.5, 0.1), roughness })
}

/// The formula of reports that leave out pi and the cosines' place is replaced by the normalised one: here with `d + s
/// = 1`.
fn cook_torrance(m: f32) -> Bsdf {
    Bsdf::Glossy(Glossy::new(Rgb::new(0.4, 0.2, 0.1), Rgb::new(0.5, 0.3, 0.1) * 0.6, Rgb::splat(0.6), m))
}

fn phong(exponent: f32) -> Bsdf {
    Bsdf::Glossy(Glossy::phong(Rgb::new(0.6, 0.3, 0.2), Rgb::splat(0.4), exponent))
}

fn cosine_lobe(exponent: f32) -> Bsdf {
    Bsdf::Phong(Phong::new(Rgb::new(0.6, 0.3, 0.2), Rgb::splat(0.4), exponent))
}

fn leaf() -> Bsdf {
    Bsdf::DiffuseTransmission(DiffuseTransmission::new(Rgb::new(0.3, 0.5, 0.1), Rgb::new(0.6, 0.5, 0.2)))
}

fn all() -> Vec<(&'static str, Bsdf)> {
    vec![
        ("eon 0.05", eon(0.05)),
        ("eon 0.5", eon(0.5)),
        ("eon 1", eon(1.0)),
        ("cook_torrance 0.1", cook_torrance(0.1)),
        ("cook_torrance 0.6", cook_torrance(0.6)),
        ("phong 40", phong(40.0)),
        ("phong 0", phong(0.0)),
        ("cosine lobe 0", cosine_lobe(0.0)),
        ("cosine lobe 3.5", cosine_lobe(3.5)),
        ("cosine lobe 60", cosine_lobe(60.0)),
        ("leaf", leaf()),
    ]
}

/// Mean weight of samples.
fn scattered(bsdf: &Bsdf, wo: Vec3) -> Rgb {
    const COUNT: u32 = 20_000;
    let mut sums = [0f64; 3];
    for s in random_points(7, COUNT).filter_map(|u| bsdf.sample(wo, u[2], [u[0], u[1]])) {
        sums.iter_mut().zip(s.weight.to_array()).for_each(|(sum, weight)| *sum += f64::from(weight));
    }
    Rgb::from(sums.map(|sum| (sum / f64::from(COUNT)) as f32))
}

#[test]
fn directions_follow_the_density_and_weights_are_value_over_density() {
    for (name, bsdf) in all() {
        for cos in [1.0, 0.6, 0.1, -0.4] {
            let wo = direction(cos, 0.15);
            let sample = |u: [f32; 4]| bsdf.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
            compare_directions(50_000, 31, sample, |wi| bsdf.eval(wo, wi).pdf).check(&format!("{name} {cos}"));
            for u in random_points(1, 2_000) {
                let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]) else { continue };
                let eval = bsdf.eval(wo, s.wi);
                // Never the albedo in place of value over density, never negative.
                assert!(
                    (eval.value.g - s.weight.g * s.pdf).abs() <= 1e-5 * eval.value.g && eval.value.g >= 0.0,
                    "{name} {s:?} {eval:?}"
                );
                assert!(
                    (eval.pdf - s.pdf).abs() <= 1e-5 * s.pdf
                        && s.is_transmission == (s.wi.z * wo.z < 0.0)
                        && s.eta == 1.0,
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn the_albedo_of_rough_diffuse_surfaces_is_what_they_scatter() {
    for roughness in [0.01, 0.3, 0.7, 1.0] {
        for cos in [1.0, 0.7, 0.3, 0.1, 0.02] {
            let wo = direction(cos, 0.3);
            let (found, expected) = (scattered(&eon(roughness), wo), eon(roughness).albedo(wo));
            assert!(
                (found.g - expected.g).abs() < 0.01 && (found.b - expected.b).abs() < 0.003,
                "{roughness} {cos}: {found:?} {expected:?}"
            );
        }
    }
}

#[test]
fn hardly_rough_diffuse_surfaces_are_ideal_ones() {
    let (rough, ideal) = (eon(1e-5), Bsdf::Lambert(Lambert { albedo: Rgb::new(1.0, 0.5, 0.1) }));
    for u in random_points(9, 1_000) {
        let (a, b) = (direction(u[0].max(0.01), u[1]), direction(u[2].max(0.01), u[3]));
        let (x, y) = (rough.eval(a, b).value, ideal.eval(a, b).value);
        assert!((x.g - y.g).abs() < 1e-3 * y.g, "{a:?} {b:?} {x:?} {y:?}");
    }
}

#[test]
fn older_models_never_scatter_more_than_they_receive() {
    let ggx = [cook_torrance(0.05), cook_torrance(0.3), cook_torrance(1.0), phong(0.0), phong(10.0), phong(1e6)];
    for bsdf in ggx.into_iter().chain(COSINE_EXPONENTS.map(cosine_lobe)) {
        for cos in [1.0, 0.5, 0.1, 0.01] {
            let total = scattered(&bsdf, direction(cos, 0.2));
            assert!(total.max_channel() <= 1.01 && total.r > 0.3, "{bsdf:?} {cos}: {total:?}");
        }
    }
}

/// Exponents of Phong's own lobe, up to the largest that counts and beyond.
const COSINE_EXPONENTS: [f32; 6] = [0.0, 1.0, 10.0, 300.0, 1e6, 1e30];

#[test]
fn phongs_lobe_is_reciprocal_and_reflects_its_share_from_ahead() {
    for exponent in COSINE_EXPONENTS {
        let bsdf = cosine_lobe(exponent);
        for u in random_points(6, 2_000) {
            let (a, b) = (direction(0.02 + 0.98 * u[0], u[1]), direction(0.02 + 0.98 * u[2], u[3]));
            let (there, back) = (bsdf.eval(a, b).value.g / b.z, bsdf.eval(b, a).value.g / a.z);
            assert!((there - back).abs() <= 1e-4 * there, "{exponent} {a} {b}: {there} {back}");
        }
        // From ahead (n + 2) / (2 pi) cos^n times the cosine integrates to 1: kd + ks, here 0.3 + 0.4.
        let ahead = scattered(&bsdf, direction(1.0, 0.0)).g;
        assert!((ahead - 0.7).abs() < 0.01, "{exponent}: {ahead}");
        // In the mirror direction the closed form.
        let o = direction(0.5, 0.1);
        let peak = bsdf.eval(o, vec3(-o.x, -o.y, o.z)).value.g;
        let expected = 0.5 * (0.3 / std::f32::consts::PI + 0.4 * (exponent.min(1e6) + 2.0) / std::f32::consts::TAU);
        assert!((peak - expected).abs() <= 1e-3 * expected, "{exponent}: {peak} {expected}");
    }
}

#[test]
fn phongs_lobe_is_finite_at_the_ends_of_its_ranges() {
    let last = 1.0 - f32::EPSILON / 2.0;
    for bsdf in COSINE_EXPONENTS.map(cosine_lobe) {
        for cos in [1.0f32, 1e-3, 1e-12, 1e-38, 0.0, -1e-6, -1.0] {
            let wo = direction(cos, 0.2);
            for (x, y) in [(0.0, 0.0), (0.0, last), (last, 0.0), (last, last), (0.5, 0.5)] {
                for lobe in [0.0, last] {
                    let Some(s) = bsdf.sample(wo, lobe, [x, y]) else { continue };
                    assert!(
                        s.wi.is_finite() && s.weight.is_finite() && s.pdf > 0.0 && s.pdf.is_finite(),
                        "{bsdf:?} {wo} {s:?}"
                    );
                }
                let eval = bsdf.eval(wo, direction(cos * x, y));
                assert!(eval.value.is_finite() && eval.pdf.is_finite() && eval.pdf >= 0.0, "{bsdf:?} {wo} {eval:?}");
            }
        }
    }
}

#[test]
fn a_glossy_value_has_pi_and_the_cosine_and_no_bias_at_grazing() {
    // A sharp white highlight reflects all, and a diffuse part alone is Lambert's, at every angle.
    let highlight = Bsdf::Glossy(Glossy::new(Rgb::BLACK, Rgb::WHITE, Rgb::WHITE, 0.02));
    let diffuse = Bsdf::Glossy(Glossy::new(Rgb::splat(0.8), Rgb::BLACK, Rgb::BLACK, 0.3));
    for cos in [1.0, 0.5, 0.2] {
        let wo = direction(cos, 0.4);
        assert!((scattered(&highlight, wo).g - 1.0).abs() < 0.01, "{cos}");
        assert!((scattered(&diffuse, wo).g - 0.8).abs() < 1e-4, "{cos}");
    }
}

#[test]
fn a_pane_reflects_the_sum_of_all_inner_reflections_and_bends_nothing() {
    let pane = Bsdf::ThinDielectric(ThinDielectric::new(1.5));
    assert!(pane.flags().is_delta() && pane.flags().transmits());
    let wo = direction(1.0, 0.0);
    // R = 0.04: 2 R / (1 + R).
    let (reflected, passed) = (pane.sample(wo, 0.0, [0.5; 2]).unwrap(), pane.sample(wo, 0.99, [0.5; 2]).unwrap());
    assert!((reflected.pdf - 0.08 / 1.04).abs() < 1e-6 && !reflected.is_transmission && reflected.weight.g == 1.0);
    assert!((passed.pdf - 0.96 / 1.04).abs() < 1e-6 && passed.is_transmission && passed.eta == 1.0);
    for wo in [direction(0.3, 0.2), direction(-0.7, 0.6)] {
        assert_eq!(pane.sample(wo, 0.999, [0.5; 2]).unwrap().wi, -wo);
    }
}

#[test]
fn a_diffuser_shares_light_out_to_both_sides() {
    let wo = direction(-0.4, 0.2);
    let (mut same, mut other) = (Rgb::BLACK, Rgb::BLACK);
    for u in random_points(3, 50_000) {
        let s = leaf().sample(wo, u[2], [u[0], u[1]]).unwrap();
        *(if s.is_transmission { &mut other } else { &mut same }) += s.weight / 50_000.0;
    }
    assert!(
        (same.g - 0.5).abs() < 0.01 && (other.g - 0.5).abs() < 0.01 && (other.r - 0.6).abs() < 0.02,
        "{same:?} {other:?}"
    );
    // More than all is scaled down.
    assert_eq!(DiffuseTransmission::new(Rgb::WHITE, Rgb::WHITE).albedo(wo), Rgb::WHITE);
}
