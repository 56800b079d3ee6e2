//! Phase functions.

use super::*;
use crate::sampling::statistics::{compare_directions, random_points};

const LOBES: [PhaseLobe; 8] = [
    PhaseLobe::HenyeyGreenstein { g: 0.0 },
    PhaseLobe::HenyeyGreenstein { g: 1e-4 },
    PhaseLobe::HenyeyGreenstein { g: 2e-3 },
    PhaseLobe::HenyeyGreenstein { g: 0.5 },
    PhaseLobe::HenyeyGreenstein { g: -0.7 },
    PhaseLobe::HenyeyGreenstein { g: 0.9 },
    PhaseLobe::HenyeyGreenstein { g: -0.99 },
    PhaseLobe::Rayleigh,
];

fn mean(lobes: &[(f32, PhaseLobe)]) -> Phase {
    let lobes: Vec<_> = lobes.iter().map(|&(weight, lobe)| WeightedLobe { weight, lobe }).collect();
    Phase::mean(&lobes).unwrap()
}

/// Of one lobe, and means of several.
fn phases() -> Vec<Phase> {
    let means = [
        mean(&[(0.3, LOBES[5]), (0.7, LOBES[4])]),
        mean(&[(5.0, LOBES[7]), (0.0, LOBES[6]), (1.0, LOBES[3]), (2.0, LOBES[0])]),
        mean(&[(1.0, LOBES[3]), (1.0, LOBES[4]), (1.0, LOBES[7]), (1.0, LOBES[0])]),
    ];
    LOBES.into_iter().map(Phase::from).chain(means).collect()
}

#[test]
fn means_have_shares_of_their_lobes() {
    let weights = |phase: Phase| phase.lobes().iter().map(|lobe| lobe.weight).collect::<Vec<_>>();
    assert_eq!(weights(mean(&[(5.0, LOBES[7]), (0.0, LOBES[6]), (15.0, LOBES[0])])), [0.25, 0.75]);
    assert_eq!(mean(&[(0.1, LOBES[3])]), Phase::from(LOBES[3]));
    assert_eq!(Phase::mean(&[]), None);
    assert_eq!(Phase::mean(&[WeightedLobe { weight: 0.0, lobe: LOBES[0] }]), None);
    assert_eq!(Phase::mean(&LOBES.map(|lobe| WeightedLobe { weight: 1.0, lobe })), None);
    let (wo, wi) = (direction(0.4, 0.1), direction(-0.3, 0.8));
    let both = [LOBES[5], LOBES[4]].map(|lobe| Phase::from(lobe).pdf(wo, wi));
    let found = mean(&[(0.3, LOBES[5]), (0.7, LOBES[4])]).pdf(wo, wi);
    assert!((found - 0.3 * both[0] - 0.7 * both[1]).abs() < 1e-6, "{found}");
}

#[test]
fn directions_follow_the_density() {
    for (seed, phase) in phases().into_iter().enumerate() {
        for (cos, turns) in [(1.0, 0.0), (0.4, 0.3), (-0.8, 0.6)] {
            let wo = direction(cos, turns);
            let sample = |u: [f32; 4]| phase.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
            compare_directions(400_000, seed as u32, sample, |wi| phase.pdf(wo, wi)).check(&format!("{phase:?} {wo}"));
        }
    }
}

#[test]
fn a_sample_has_the_density_of_its_direction() {
    for phase in phases() {
        for u in random_points(5, 10_000) {
            let wo = direction(2.0 * u[2] - 1.0, u[3]);
            let sample = phase.sample(wo, u[2], [u[0], u[1]]).unwrap();
            assert_eq!(sample.pdf, phase.pdf(wo, sample.wi));
            assert_eq!(phase.eval(wo, sample.wi), BsdfEval { value: Rgb::splat(sample.pdf), pdf: sample.pdf });
            assert!((sample.wi.length() - 1.0).abs() < 1e-5 && sample.pdf > 0.0, "{phase:?} {sample:?}");
        }
    }
}

#[test]
fn the_mean_cosine_is_g() {
    for lobe in LOBES {
        let PhaseLobe::HenyeyGreenstein { g } = lobe else { continue };
        let phase = Phase::from(lobe);
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
        let found = Phase::from(PhaseLobe::HenyeyGreenstein { g }).pdf(wo, -wo * 1f32.copysign(g));
        assert!((found / expected - 1.0).abs() < 5e-3, "{g}: {found} {expected}");
    }
}
