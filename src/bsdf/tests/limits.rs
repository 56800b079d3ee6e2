//! The ends of every range: grazing angles, smallest and largest alpha, the limit of a smooth surface.

use super::*;
use crate::sampling::statistics::random_points;

fn is_sound(value: Rgb, pdf: f32) -> bool {
    value.is_finite() && value.r >= 0.0 && value.g >= 0.0 && value.b >= 0.0 && pdf.is_finite() && pdf >= 0.0
}

#[test]
fn everything_is_finite_at_every_angle_and_alpha() {
    let alphas = [[0.0; 2], [1e-4; 2], [1e-3; 2], [0.01; 2], [1.0; 2], [1.0, 1e-4], [0.0, 1.0]];
    let cosines = [1.0f32, 0.5, 1e-2, 1e-3, 1e-6, 1e-12, 1e-30, 1e-38, 1e-45, 0.0];
    for alpha in alphas {
        let mut all = vec![gold(alpha), perfect_metal(alpha), blue_plastic(alpha)];
        all.extend(
            [1.5, 1.0, 1.000_1, 1.001, 0.1, 10.0, 1.0 / 1.5].map(|ior| Bsdf::Dielectric(Dielectric::new(ior, alpha))),
        );
        all.push(Bsdf::Plastic(Plastic::new(Rgb::BLACK, 1.0, alpha)));
        all.push(beckmann_gold(alpha));
        all.extend([1.5, 1.0, 1.001, 0.1, 10.0].map(|ior| {
            Bsdf::Beckmann(SingleScatteringBsdf::Dielectric(Dielectric::with_facets(ior, alpha, Beckmann::new)))
        }));
        for bsdf in all {
            for cos in cosines.iter().flat_map(|&cos| [cos, -cos]) {
                let wo = direction(cos, 0.2);
                for u in random_points(1, 100) {
                    if let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]) {
                        assert!(s.wi.is_finite() && is_sound(s.weight, s.pdf), "{bsdf:?} {wo:?} {s:?}");
                        let eval = bsdf.eval(wo, s.wi);
                        assert!(is_sound(eval.value, eval.pdf), "{bsdf:?} {wo:?} {:?} {eval:?}", s.wi);
                    }
                    for cos_i in cosines.iter().flat_map(|&cos| [cos, -cos]) {
                        for turns in [0.2, 0.7, u[3]] {
                            let eval = bsdf.eval(wo, direction(cos_i, turns));
                            assert!(is_sound(eval.value, eval.pdf), "{bsdf:?} {wo:?} {cos_i} {turns} {eval:?}");
                        }
                    }
                }
                // Corners of the square of random numbers.
                let last = 1.0 - f32::EPSILON / 2.0;
                for (x, y) in [(0.0, 0.0), (0.0, last), (last, 0.0), (last, last), (0.5, 0.5)] {
                    for lobe in [0.0, last] {
                        if let Some(s) = bsdf.sample(wo, lobe, [x, y]) {
                            assert!(s.wi.is_finite() && is_sound(s.weight, s.pdf), "{bsdf:?} {wo:?} {s:?}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn lobes_below_the_limit_are_deltas() {
    let below = [0.99 * SMOOTH_ALPHA; 2];
    assert!(
        gold(below).flags().is_delta() && glass(below).flags().is_delta() && !white_plastic(below).flags().is_delta()
    );
    assert!(!gold([SMOOTH_ALPHA; 2]).flags().is_delta());
    // One rough axis makes the surface rough.
    assert!(!gold([0.0, 0.1]).flags().is_delta());
    // Hardly any refraction: straight, whatever the slopes.
    assert!(Bsdf::Dielectric(Dielectric::new(1.000_1, [0.5; 2])).flags().is_delta());
    assert!(
        beckmann_gold(below).flags().is_delta()
            && beckmann_glass(below).flags().is_delta()
            && !beckmann_gold([0.0, 0.1]).flags().is_delta()
    );
    for bsdf in [gold(below), glass(below), beckmann_gold(below), beckmann_glass(below)] {
        assert_eq!(bsdf.eval(direction(0.5, 0.0), direction(0.5, 0.5)), BsdfEval::default());
    }
}

#[test]
fn smooth_glass_refracts_by_its_side_and_reflects_totally() {
    let bsdf = glass([0.0; 2]);
    // From outside, to Snell's angle and with the radiance compressed.
    let wo = direction(0.6, 0.0);
    let s = bsdf.sample(wo, 0.999, [0.5; 2]).unwrap();
    assert!(s.is_transmission && s.is_delta && s.eta == 1.5);
    assert!((s.wi.x + 0.8 / 1.5).abs() < 1e-6 && s.wi.z < 0.0 && (s.wi.length() - 1.0).abs() < 1e-6);
    assert!((s.weight.r - 1.0 / 2.25).abs() < 1e-6);
    // And back on the same path.
    let back = bsdf.sample(s.wi, 0.999, [0.5; 2]).unwrap();
    assert!(
        (back.wi - wo).length() < 1e-6 && (back.weight.r - 2.25).abs() < 1e-5 && (back.eta * 1.5 - 1.0).abs() < 1e-6
    );
    // Inside beyond the critical angle nothing leaves and nothing is lost.
    let s = bsdf.sample(direction(-0.6, 0.0), 0.999_999, [0.5; 2]).unwrap();
    assert!(!s.is_transmission && s.weight == Rgb::WHITE && s.pdf == 1.0 && s.wi.z == -0.6);
}
