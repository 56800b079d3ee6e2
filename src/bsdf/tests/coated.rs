//! The clear coat over other materials.

use super::energy::{COSINES, scattered, scattered_of};
use super::*;
use crate::sampling::statistics::random_points;

fn coated(ior: f32, alpha: [f32; 2], tint: Rgb, base: Bsdf) -> Bsdf {
    Bsdf::Coated(Coated::new(Coat::new(ior, alpha), tint, base).into())
}

fn principled(parameters: PrincipledParameters) -> Bsdf {
    Bsdf::Principled(Principled::new(&parameters))
}

/// Opaque bases of every kind, white or coloured, with a name; the last two are smooth.
fn bases(color: Rgb) -> Vec<(&'static str, Bsdf)> {
    let coat =
        PrincipledParameters { base_color: color, clearcoat: 1.0, sheen: 0.5, ..PrincipledParameters::default() };
    vec![
        ("lambert", Bsdf::Lambert(Lambert { albedo: color })),
        ("eon", Bsdf::Eon(Eon { albedo: color, roughness: 0.8 })),
        ("glossy", Bsdf::Glossy(Glossy::new(color * 0.5, color * 0.5, color * 0.5, 0.2))),
        ("metal", Bsdf::Conductor(Conductor::new(Rgb::BLACK, Rgb::WHITE, [0.4; 2], color))),
        ("plastic", Bsdf::Plastic(Plastic::new(color, 1.5, [0.0; 2]))),
        ("principled", principled(coat)),
        ("coated", coated(1.3, [0.1; 2], color, Bsdf::Lambert(Lambert { albedo: color }))),
        ("mirror", Bsdf::Mirror(Mirror { reflectance: color })),
        ("smooth metal", Bsdf::Conductor(Conductor::new(Rgb::BLACK, Rgb::WHITE, [0.0; 2], color))),
    ]
}

const COLOR: Rgb = Rgb { r: 0.8, g: 0.4, b: 0.1 };
const TINT: Rgb = Rgb { r: 0.9, g: 0.5, b: 0.0 };

/// The coats that the tests try: smooth, rough, anisotropic.
const COATS: [[f32; 2]; 3] = [[0.0; 2], [0.3; 2], [0.1, 0.4]];

#[test]
fn nothing_crosses_a_coat() {
    for (name, base) in bases(COLOR) {
        for alpha in COATS {
            let bsdf = coated(1.7, alpha, TINT, base.clone());
            for u in random_points(4, 2_000) {
                let (a, b) = (direction(0.02 + 0.98 * u[0], u[1]), direction(0.02 + 0.98 * u[2], u[3]));
                assert_eq!(bsdf.eval(a, -b), BsdfEval::default());
                let Some(s) = bsdf.sample(a, u[2], [u[3], u[0]]) else { continue };
                assert!(!s.is_transmission && s.wi.z > 0.0 && s.eta == 1.0, "{name} {alpha:?}");
            }
        }
    }
}

#[test]
fn no_white_base_gives_back_more_than_it_receives_or_much_less() {
    // Quadrature with 4096 points. Over a diffuse base and a mirror nothing is lost but what the tables' interpolation
    // says; over others what the coat reflects of diffuse light more than of light from ahead, at most 0.06 for 1.5,
    // and what the base itself loses.
    for (name, base) in bases(Rgb::WHITE) {
        for alpha in COATS {
            let bsdf = coated(1.5, alpha, Rgb::WHITE, base.clone());
            for cos in COSINES {
                for wo in [direction(cos, 0.05), direction(-cos, 0.2)] {
                    let total = scattered_of(1 << 12, &bsdf, wo).g;
                    let alone = scattered_of(1 << 12, &base, wo).g;
                    let exact = ["lambert", "mirror", "smooth metal"].contains(&name);
                    // An anisotropic coat's albedo is interpolated between its axes.
                    let tolerance = if alpha[0] == alpha[1] { 0.005 } else { 0.015 };
                    assert!(total <= 1.0 + tolerance, "{name} {alpha:?} {cos}: {total}");
                    let bound = if exact { 1.0 - tolerance } else { alone - 0.075 };
                    assert!(total >= bound, "{name} {alpha:?} {cos}: {total} {alone}");
                }
            }
        }
    }
}

#[test]
fn a_coat_over_a_diffuse_base_is_plastic() {
    for alpha in COATS {
        let base = Bsdf::Lambert(Lambert { albedo: COLOR });
        let (a, b) = (coated(1.6, alpha, Rgb::WHITE, base), Bsdf::Plastic(Plastic::new(COLOR, 1.6, alpha)));
        for u in random_points(6, 2_000) {
            let (wo, wi) = (direction(0.01 + 0.99 * u[0], u[1]), direction(0.01 + 0.99 * u[2], u[3]));
            let (x, y) = (a.eval(wo, wi).value, b.eval(wo, wi).value);
            assert!((x - y).max_channel().abs() <= 1e-6 * x.max_channel(), "{x:?} {y:?}");
        }
    }
}

#[test]
fn a_coat_of_matching_index_leaves_the_base_alone() {
    for (name, base) in bases(COLOR) {
        for (alpha, tint) in [([0.0; 2], Rgb::WHITE), ([0.3; 2], Rgb::WHITE), ([0.3; 2], Rgb::splat(0.5))] {
            let bsdf = coated(1.0, alpha, tint, base.clone());
            for u in random_points(7, 1_000) {
                let (wo, wi) = (direction(0.1 + 0.9 * u[0], u[1]), direction(0.1 + 0.9 * u[2], u[3]));
                let kept = if tint == Rgb::WHITE { 1.0 } else { 0.5f32.powf(0.5 / wo.z + 0.5 / wi.z) };
                let (x, y) = (bsdf.eval(wo, wi).value, base.eval(wo, wi).value * kept);
                assert!(
                    (x - y).max_channel().abs() <= 1e-4 * y.max_channel().max(1e-6),
                    "{name} {alpha:?}: {x:?} {y:?}"
                );
            }
        }
    }
}

#[test]
fn a_tint_colours_what_crosses_the_coat_and_more_so_at_an_angle() {
    let mirror = Bsdf::Mirror(Mirror { reflectance: Rgb::WHITE });
    let (clear, amber) = (coated(1.5, [0.0; 2], Rgb::WHITE, mirror.clone()), coated(1.5, [0.0; 2], TINT, mirror));
    for cos in [1.0f32, 0.6, 0.2] {
        let wo = direction(cos, 0.3);
        let coat = fresnel::dielectric(cos, 1.5);
        let below = scattered(&amber, wo) - Rgb::splat(coat.reflectance);
        assert!((scattered(&clear, wo).g - 1.0).abs() < 2e-3);
        for (x, tint) in below.to_array().into_iter().zip(TINT.to_array()) {
            let expected = (1.0 - coat.reflectance) * tint.powf(1.0 / coat.cos_t);
            assert!((x - expected).abs() < 2e-3, "{cos}: {below:?} {expected}");
        }
    }
}

#[test]
fn two_smooth_layers_are_deltas_and_ends_of_ranges_are_finite() {
    let mirror = Bsdf::Mirror(Mirror { reflectance: Rgb::WHITE });
    assert!(
        coated(1.5, [0.0; 2], Rgb::WHITE, mirror.clone()).flags().is_delta()
            && !coated(1.5, [0.1; 2], Rgb::WHITE, mirror).flags().is_delta()
    );
    for (name, base) in bases(COLOR) {
        for ior in [1.0, 1.5, 10.0] {
            for alpha in [[0.0; 2], [1e-4; 2], [1.0; 2], [1.0, 1e-4]] {
                let bsdf = coated(ior, alpha, TINT, base.clone());
                for cos in [1.0f32, 1e-3, 1e-12, 1e-30, 1e-45, 0.0] {
                    let wo = direction(cos, 0.2);
                    assert!(bsdf.albedo(wo).is_finite(), "{name}");
                    for u in random_points(1, 30) {
                        let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]) else { continue };
                        assert!(
                            s.wi.is_finite() && s.weight.is_finite() && s.pdf > 0.0 && s.pdf.is_finite(),
                            "{name} {ior} {alpha:?} {cos} {s:?}"
                        );
                        let eval = bsdf.eval(wo, direction(u[3] * u[3] * cos, u[0]));
                        assert!(
                            eval.value.is_finite() && eval.pdf.is_finite(),
                            "{name} {ior} {alpha:?} {cos} {eval:?}"
                        );
                    }
                }
            }
        }
    }
}
