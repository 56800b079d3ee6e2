//! Sampled directions, densities and weights agree.

use super::*;
use crate::sampling::statistics::{compare_directions, random_points};

fn check_density(name: &str, bsdf: &Bsdf, wo: Vec3) {
    let sample = |u: [f32; 4]| bsdf.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
    compare_directions(100_000, 17, sample, |wi| bsdf.eval(wo, wi).pdf).check(&format!("{name} from {wo:?}"));
}

#[test]
fn directions_follow_the_density_and_it_integrates_to_what_is_sampled() {
    for (name, bsdf) in rough_bsdfs() {
        for cos in [1.0, 0.707, 0.05] {
            check_density(&name, &bsdf, direction(cos, 0.1));
        }
    }
}

#[test]
fn directions_follow_the_density_from_inside_of_glass() {
    for alpha in ALPHAS {
        for ior in [1.5, 0.8] {
            let bsdf = Bsdf::Dielectric(Dielectric::new(ior, alpha));
            // At -0.707 most microfacets reflect totally for 1.5.
            for cos in [-1.0, -0.707, -0.05] {
                check_density(&format!("dielectric {ior} {alpha:?}"), &bsdf, direction(cos, 0.35));
            }
        }
    }
}

#[test]
fn directions_follow_the_density_on_the_back() {
    for bsdf in [gold([0.3, 0.1]), blue_plastic([0.3, 0.1]), Bsdf::Lambert(Lambert { albedo: Rgb::WHITE })] {
        check_density("back", &bsdf, direction(-0.6, 0.6));
    }
}

#[test]
fn the_base_of_smooth_plastic_follows_its_density() {
    let bsdf = blue_plastic([0.0; 2]);
    let wo = direction(0.4, 0.0);
    let sample = |u: [f32; 4]| bsdf.sample(wo, u[2], [u[0], u[1]]).filter(|s| !s.is_delta).map(|s| s.wi);
    compare_directions(100_000, 18, sample, |wi| bsdf.eval(wo, wi).pdf).check("smooth plastic");
}

/// Largest relative difference between a sample and the evaluation of its direction, over the samples of some directions.
fn worst_disagreement(bsdf: &Bsdf, cosines: &[f32]) -> f32 {
    let mut worst = 0f32;
    for &cos in cosines {
        let wo = direction(cos, 0.2);
        for u in random_points(3, 20_000) {
            let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]).filter(|s| !s.is_delta) else { continue };
            let eval = bsdf.eval(wo, s.wi);
            let weight = eval.value / eval.pdf;
            for (a, b) in [(s.pdf, eval.pdf), (s.weight.r, weight.r), (s.weight.g, weight.g), (s.weight.b, weight.b)] {
                assert!(a.is_finite() && a >= 0.0 && b.is_finite(), "{bsdf:?} {wo:?} {s:?} {eval:?}");
                worst = worst.max((a - b).abs() / a.max(b).max(1e-20));
            }
        }
    }
    worst
}

#[test]
fn weights_are_value_over_density() {
    for (name, bsdf) in rough_bsdfs() {
        // Where refraction is involved the half vector is a difference of directions, and near the critical angle 1 - F is the root of one:
        // both amplify the rounding of wi.
        let (limit, cosines): (f32, &[f32]) = match bsdf {
            Bsdf::Dielectric(_) => (2e-3, &[1.0, 0.7, 0.3, -0.3, -0.7, -1.0]),
            _ => (2e-4, &[1.0, 0.7, 0.3, 0.05, -0.5]),
        };
        let worst = worst_disagreement(&bsdf, cosines);
        assert!(worst < limit, "{name}: {worst}");
    }
    assert!(worst_disagreement(&white_plastic([0.0; 2]), &[1.0, 0.5, 0.05]) < 1e-5);
}

#[test]
fn reflection_is_reciprocal() {
    for (name, bsdf) in rough_bsdfs() {
        for u in random_points(5, 5_000) {
            let (a, b) = (direction(0.02 + 0.98 * u[0], u[1]), direction(0.02 + 0.98 * u[2], u[3]));
            // Without the cosine of the second direction.
            let (ab, ba) = (bsdf.eval(a, b).value / b.z, bsdf.eval(b, a).value / a.z);
            for (x, y) in [(ab.r, ba.r), (ab.g, ba.g), (ab.b, ba.b)] {
                assert!((x - y).abs() <= 1e-4 * x.max(y), "{name} {a:?} {b:?} {x} {y}");
            }
        }
    }
}

#[test]
fn refraction_is_reciprocal_but_for_the_squared_index() {
    for ior in [1.5f32, 0.7, 2.4] {
        for alpha in ALPHAS {
            let bsdf = Bsdf::Dielectric(Dielectric::new(ior, alpha));
            let mut compared = 0;
            for u in random_points(6, 10_000) {
                let a = direction(0.05 + 0.95 * u[0], u[1]);
                let Some(b) = bsdf.sample(a, u[2], [u[3], u[0]]).filter(|s| s.is_transmission).map(|s| s.wi) else { continue };
                if b.z > -0.05 {
                    continue;
                }
                // Radiance towards the outside is smaller by ior² than the reverse.
                let outside = bsdf.eval(a, b).value.r / -b.z;
                let inside = bsdf.eval(b, a).value.r / a.z;
                assert!((outside * ior * ior - inside).abs() <= 3e-4 * inside, "{ior} {alpha:?} {a:?} {b:?}");
                compared += 1;
            }
            assert!(compared > 1000, "{compared}");
        }
    }
}

#[test]
fn nothing_crosses_an_opaque_surface_and_all_that_crosses_says_so() {
    for (name, bsdf) in rough_bsdfs() {
        let opaque = !matches!(bsdf, Bsdf::Dielectric(_));
        for u in random_points(8, 2_000) {
            for wo in [direction(u[0].max(0.01), u[1]), direction(-u[0].max(0.01), u[1])] {
                assert!(!opaque || bsdf.eval(wo, direction(-u[2] * wo.z.signum(), u[3])) == BsdfEval::default(), "{name}");
                if let Some(s) = bsdf.sample(wo, u[2], [u[3], u[0]]) {
                    assert_eq!(s.is_transmission, s.wi.z * wo.z < 0.0, "{name}");
                    assert!(!(opaque && s.is_transmission), "{name}");
                    let expected = match (s.is_transmission, wo.z > 0.0) {
                        (false, _) => 1.0,
                        (true, true) => 1.5,
                        (true, false) => 1.0 / 1.5,
                    };
                    assert_eq!(s.eta, expected, "{name}");
                }
            }
        }
    }
}
