//! Phase functions.

use super::*;
use crate::sampling::statistics::{compare_directions, random_points};

const PHASES: [Phase; 8] = [
    Phase::ISOTROPIC,
    Phase::HenyeyGreenstein { g: 1e-4 },
    Phase::HenyeyGreenstein { g: 2e-3 },
    Phase::HenyeyGreenstein { g: 0.5 },
    Phase::HenyeyGreenstein { g: -0.7 },
    Phase::HenyeyGreenstein { g: 0.9 },
    Phase::HenyeyGreenstein { g: -0.99 },
    Phase::Rayleigh,
];

#[test]
fn directions_follow_the_density() {
    for (seed, phase) in PHASES.into_iter().enumerate() {
        for (cos, turns) in [(1.0, 0.0), (0.4, 0.3), (-0.8, 0.6)] {
            let wo = direction(cos, turns);
            let sample = |u: [f32; 4]| phase.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
            compare_directions(400_000, seed as u32, sample, |wi| phase.pdf(wo, wi)).check(&format!("{phase:?} {wo}"));
        }
    }
}

#[test]
fn a_sample_has_the_density_of_its_direction() {
    for phase in PHASES {
        for u in random_points(5, 10_000) {
            let wo = direction(2.0 * u[2] - 1.0, u[3]);
            let sample = phase.sample(wo, 0.0, [u[0], u[1]]).unwrap();
            assert_eq!(sample.pdf, phase.pdf(wo, sample.wi));
            assert_eq!(phase.eval(wo, sample.wi), BsdfEval { value: Rgb::splat(sample.pdf), pdf: sample.pdf });
            assert!((sample.wi.length() - 1.0).abs() < 1e-5 && sample.pdf > 0.0, "{phase:?} {sample:?}");
        }
    }
}

#[test]
fn the_mean_cosine_is_g() {
    for phase in PHASES {
        let Phase::HenyeyGreenstein { g } = phase else { continue };
        let wo = direction(0.3, 0.7);
        let cosines = random_points(11, 1_000_000).map(|u| {
            let sample = phase.sample(wo, 0.0, [u[0], u[1]]).unwrap();
            f64::from(-wo.dot(sample.wi))
        });
        let mean = cosines.sum::<f64>() / 1e6;
        // The deviation of a cosine is at most 1: 5.5 of the mean's are 0.0055.
        assert!((mean - f64::from(g)).abs() < 5.5e-3, "{g}: {mean}");
    }
}

#[test]
fn strong_peaks_have_their_closed_form() {
    // (1 + g) / (4 pi (1 - g)²) straight on.
    for g in [0.9f32, 0.99, -0.99] {
        let expected = (1.0 + g.abs()) / (4.0 * std::f32::consts::PI * (1.0 - g.abs()).powi(2));
        let wo = direction(0.6, 0.1);
        let found = Phase::HenyeyGreenstein { g }.pdf(wo, -wo * 1f32.copysign(g));
        assert!((found / expected - 1.0).abs() < 5e-3, "{g}: {found} {expected}");
    }
}
