//! Beckmann's microfacets.

use super::energy::{COSINES, scattered};
use super::*;
use crate::sampling::statistics::{compare_directions, random_points};

const CLEAR: f32 = 1.5;

fn metal(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Beckmann(SingleScatteringBsdf::Conductor(
        Conductor::new(Rgb::BLACK, Rgb::WHITE, [0.0; 2], Rgb::WHITE).with_facets(Beckmann::new(alpha), Rgb::WHITE),
    ))
}

fn clear(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Beckmann(SingleScatteringBsdf::Dielectric(Dielectric::with_facets(CLEAR, alpha, Beckmann::new)))
}

#[test]
fn visible_normals_follow_their_density_and_cover_what_is_seen() {
    for alpha in ALPHAS {
        let facets = Beckmann::new(alpha);
        for cos in [1.0, 0.9, 0.5, 0.1, 0.005] {
            let o = direction(cos, 0.15);
            let pdf = |m: Vec3| {
                if m.z > 0.0 { 4.0 * o.dot(m).max(0.0) * facets.reflection_pdf(o, m) } else { 0.0 }
            };
            compare_directions(50_000, 4, |u| Some(facets.sample_visible_normal(o, [u[0], u[1]])), pdf)
                .check(&format!("{alpha:?} {cos}"));
        }
    }
}

#[test]
fn masking_is_the_closed_form() {
    for alpha in ALPHAS {
        let facets = Beckmann::new(alpha);
        for u in random_points(5, 1_000) {
            let w = direction(u[0].max(1e-5), u[1]);
            let slope = f64::from(w.z) / f64::from(alpha[0] * w.x).hypot(f64::from(alpha[1] * w.y));
            let erf = statrs::function::erf::erf(slope);
            let lambda = 0.5 * (erf - 1.0) + (-slope * slope).exp() / (2.0 * slope * std::f64::consts::PI.sqrt());
            let expected = 1.0 / (1.0 + lambda);
            assert!(
                (f64::from(facets.g1(w)) - expected).abs() < 2e-6 * expected,
                "{alpha:?} {w}: {} {expected}",
                facets.g1(w)
            );
        }
    }
}

#[test]
fn directions_follow_the_density() {
    for (name, bsdf) in rough_bsdfs().into_iter().filter(|(_, bsdf)| matches!(bsdf, Bsdf::Beckmann(_))) {
        let inside: &[f32] = if bsdf.flags().transmits() { &[-0.3, -0.9] } else { &[] };
        for &cos in [1.0, 0.6, 0.1].iter().chain(inside) {
            let wo = direction(cos, 0.15);
            let sample = |u: [f32; 4]| bsdf.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
            compare_directions(50_000, 31, sample, |wi| bsdf.eval(wo, wi).pdf).check(&format!("{name} {cos}"));
        }
    }
}

#[test]
fn scattering_is_reciprocal() {
    for alpha in ALPHAS {
        for u in random_points(6, 2_000) {
            let (a, b) = (direction(0.02 + 0.98 * u[0], u[1]), direction(0.02 + 0.98 * u[2], u[3]));
            let (there, back) = (metal(alpha).eval(a, b).value.g / b.z, metal(alpha).eval(b, a).value.g / a.z);
            assert!((there - back).abs() <= 1e-5 * there, "{alpha:?} {a} {b}: {there} {back}");
            // Radiance is compressed on the inside.
            let (there, back) = (clear(alpha).eval(a, -b).value.g / b.z, clear(alpha).eval(-b, a).value.g / a.z);
            assert!((there * CLEAR * CLEAR - back).abs() <= 2e-4 * back, "{alpha:?} {a} {b}: {there} {back}");
        }
    }
}

#[test]
fn no_white_furnace_gains_light_and_a_smooth_one_loses_none() {
    for cos in COSINES {
        for alpha in [[1.0; 2], [0.5; 2], [0.3, 0.1], [0.1; 2], [0.01; 2], [1e-4; 2]] {
            for (bsdf, cos) in [(metal(alpha), cos), (clear(alpha), cos), (clear(alpha), -cos)] {
                let kept = scattered(&bsdf, direction(cos, 0.2)).g;
                assert!(kept <= 1.000_01 && (kept > 0.99 || alpha != [1e-4; 2]), "{bsdf:?} {cos}: {kept}");
            }
        }
    }
    // Where several encounters count, they are missing.
    assert!(scattered(&metal([1.0; 2]), direction(0.5, 0.2)).g < 0.9);
}

#[test]
fn a_hardly_rough_surface_scatters_as_a_smooth_one_does() {
    for (rough, smooth) in
        [(metal([SMOOTH_ALPHA; 2]), metal([0.0; 2])), (clear([3.0 * SMOOTH_ALPHA; 2]), clear([0.0; 2]))]
    {
        assert!(smooth.flags().is_delta() && !rough.flags().is_delta());
        for u in random_points(2, 2_000) {
            let wo = direction(0.2 + 0.8 * u[0], u[1]);
            let (a, b) = (rough.sample(wo, u[2], [u[3], u[0]]).unwrap(), smooth.sample(wo, u[2], [0.5; 2]).unwrap());
            // The lobe is chosen by the reflectance of the microfacet, which differs a little.
            if a.is_transmission == b.is_transmission {
                assert!((a.wi - b.wi).length() < 0.02 && (a.weight.g - b.weight.g).abs() < 0.01, "{wo} {a:?} {b:?}");
            }
        }
    }
}
