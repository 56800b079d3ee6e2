//! Sampled directions, densities and weights agree.

use super::*;
use crate::sampling::statistics::random_points;

/// Largest relative difference between a sample and the evaluation of its direction, over the samples of some
/// directions.
pub(super) fn worst_disagreement(bsdf: &Bsdf, cosines: &[f32]) -> f32 {
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
        // Where refraction is involved the half vector is a difference of directions, and near the critical angle 1 - F
        // is the root of one: both amplify the rounding of wi. So does the exponential of Beckmann's density.
        const BOTH_SIDES: &[f32] = &[1.0, 0.7, 0.3, -0.3, -0.7, -1.0];
        let (limit, cosines) = match bsdf {
            Bsdf::Dielectric(_) | Bsdf::SeparableGgx(SingleScatteringBsdf::Dielectric(_)) => (2e-3, BOTH_SIDES),
            Bsdf::Beckmann(SingleScatteringBsdf::Dielectric(_)) => (4e-3, BOTH_SIDES),
            _ => (2e-4, [1.0, 0.7, 0.3, 0.05, -0.5].as_slice()),
        };
        let worst = worst_disagreement(&bsdf, cosines);
        assert!(worst < limit, "{name}: {worst}");
    }
    assert!(worst_disagreement(&white_plastic([0.0; 2]), &[1.0, 0.5, 0.05]) < 1e-5);
}

#[test]
fn nothing_crosses_an_opaque_surface_and_all_that_crosses_says_so() {
    for (name, bsdf) in rough_bsdfs() {
        let opaque = !bsdf.flags().transmits();
        for u in random_points(8, 2_000) {
            for wo in [direction(u[0].max(0.01), u[1]), direction(-u[0].max(0.01), u[1])] {
                assert!(
                    !opaque || bsdf.eval(wo, direction(-u[2] * wo.z.signum(), u[3])) == BsdfEval::default(),
                    "{name}"
                );
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

/// Weight times probability of a specular reflection is its mean over choices of lobes.
#[test]
fn the_first_lobe_is_the_specular_reflection() {
    const STEPS: u32 = 4096;
    let coat = |alpha, base| Bsdf::coated(Coat::new(1.5, alpha), Rgb::WHITE, base);
    let layered = [coat([0.0; 2], gold([0.3; 2])), coat([0.2; 2], white_plastic([0.0; 2]))];
    let lossy = Bsdf::SeparableGgx(lossy_plastic(SeparableGgx::new([0.0; 2]), true));
    let smooth = [white_plastic([0.0; 2]), lossy, glass([0.0; 2]), gold([0.0; 2])];
    let mut mixed = 0;
    for bsdf in smooth.into_iter().chain(layered).chain(rough_bsdfs().into_iter().map(|(_, bsdf)| bsdf)) {
        if !bsdf.has_mixed_specular_reflection() {
            continue;
        }
        mixed += 1;
        for cos in [1.0, 0.6, 0.1, -0.3, -0.9] {
            let wo = direction(cos, 0.2);
            let reflected =
                |u_lobe| bsdf.sample(wo, u_lobe, [0.5; 2]).filter(|sample| sample.is_delta && !sample.is_transmission);
            let first = reflected(0.0).unwrap();
            let chosen = (0..STEPS).filter_map(|step| reflected((step as f32 + 0.5) / STEPS as f32));
            let sum = chosen.fold(Rgb::BLACK, |sum, sample| {
                assert_eq!((sample.wi, sample.pdf), (first.wi, first.pdf), "{bsdf:?}");
                sum + sample.weight
            });
            let (mean, known) = (sum / STEPS as f32, first.weight * first.pdf);
            assert!((mean - known).map(f32::abs).max_channel() < 1.0 / STEPS as f32, "{bsdf:?} {mean:?} {known:?}");
        }
    }
    assert_eq!(mixed, 3);
}
