//! White furnaces: how much of the light from everywhere is scattered towards one direction.

use super::*;
use crate::sampling::{PixelSeed, Sampler, SamplerKind, warp};

/// Mean weight of samples with the radiance scaling of refraction undone.
pub(super) fn scattered(bsdf: &Bsdf, wo: Vec3) -> Rgb {
    scattered_of(1 << 14, bsdf, wo)
}

pub(super) fn scattered_of(count: u32, bsdf: &Bsdf, wo: Vec3) -> Rgb {
    scattered_by(count, 1, bsdf, wo)
}

/// By the first points of a Sobol sequence that is scrambled by `seed`.
pub(super) fn scattered_by(count: u32, seed: u32, bsdf: &Bsdf, wo: Vec3) -> Rgb {
    let sampler = Sampler::new(SamplerKind::Sobol, 9);
    let mut sum = Rgb::BLACK;
    for i in 0..count {
        let u = sampler.sample_4d(PixelSeed(seed), i, 0);
        if let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]) {
            sum += s.weight * (s.eta * s.eta);
        }
    }
    sum / count as f32
}

fn assert_close(name: &str, value: Rgb, expected: f32, tolerance: f32) {
    for x in value.to_array() {
        assert!((x - expected).abs() <= tolerance, "{name}: {value:?}, expected {expected}");
    }
}

pub(super) const COSINES: [f32; 7] = [1.0, 0.8, 0.5, 0.25, 0.1, 0.05, 0.01];

#[test]
fn white_surfaces_without_microfacets_lose_nothing() {
    for cos in COSINES {
        for wo in [direction(cos, 0.2), direction(-cos, 0.7)] {
            assert_close("lambert", scattered(&Bsdf::Lambert(Lambert { albedo: Rgb::WHITE }), wo), 1.0, 1e-5);
            assert_close("mirror", scattered(&Bsdf::Mirror(Mirror { reflectance: Rgb::WHITE }), wo), 1.0, 1e-5);
            assert_close("metal", scattered(&perfect_metal([0.0; 2]), wo), 1.0, 1e-5);
            assert_close("glass", scattered(&glass([0.0; 2]), wo), 1.0, 1e-5);
            // The two lobes are chosen at random.
            assert_close("plastic", scattered(&white_plastic([0.0; 2]), wo), 1.0, 2e-3);
        }
    }
}

#[test]
fn a_white_base_under_a_rough_coat_loses_nothing() {
    for alpha in ALPHAS {
        for cos in COSINES {
            let total = scattered(&white_plastic(alpha), direction(cos, 0.1));
            // The coat's table interpolates, an anisotropic one also between two azimuths.
            let tolerance = if alpha[0] == alpha[1] { 0.002 } else { 0.015 };
            assert_close(&format!("plastic {alpha:?} at {cos}"), total, 1.0, tolerance);
        }
    }
}

#[test]
fn nothing_scatters_more_than_it_receives() {
    for alpha in ALPHAS.into_iter().chain([[1.0, 0.3], [0.02, 0.08], [1e-3; 2]]) {
        for cos in COSINES {
            for wo in [direction(cos, 0.05), direction(-cos, 0.2)] {
                for bsdf in [perfect_metal(alpha), glass(alpha), white_plastic(alpha), gold(alpha)] {
                    let total = scattered(&bsdf, wo);
                    assert!(total.max_channel() <= 1.01 && total.r > 0.0, "{bsdf:?} {wo:?}: {total:?}");
                }
            }
        }
    }
}

#[test]
fn single_scattering_keeps_the_known_fraction() {
    // Height-correlated Smith GGX with F = 1: computed independently; 1 - ln 2 at alpha 1 and normal incidence is exact.
    let cosines = [0.05, 0.1, 0.25, 0.5, 0.75, 1.0];
    let table = [
        (1.0, [0.8477, 0.7602, 0.5977, 0.4507, 0.3645, 1.0 - std::f32::consts::LN_2]),
        (0.5, [0.9125, 0.8601, 0.7652, 0.6983, 0.6821, 0.6879]),
        (0.25, [0.9330, 0.8916, 0.8401, 0.8573, 0.8916, 0.9157]),
        (0.1, [0.9106, 0.8829, 0.9214, 0.9692, 0.9835, 0.9868]),
    ];
    for (alpha, row) in table {
        for (cos, expected) in cosines.into_iter().zip(row) {
            let Bsdf::Conductor(metal) = perfect_metal([alpha; 2]) else { unreachable!() };
            let single = Bsdf::Conductor(metal.single_scattering());
            assert_close(&format!("{alpha} {cos}"), scattered(&single, direction(cos, 0.3)), expected, 2e-3);
        }
    }
}

#[test]
fn a_white_rough_metal_loses_nothing() {
    for alpha in [1e-3, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0] {
        for cos in COSINES {
            assert_close(&format!("{alpha} {cos}"), scattered_of(1 << 12, &perfect_metal([alpha; 2]), direction(cos, 0.3)), 1.0, 0.01);
        }
    }
}

/// Anisotropic alphas, the smaller over the larger from nearly 0 to nearly 1.
fn anisotropic_alphas() -> impl Iterator<Item = [f32; 2]> {
    let alphas = [0.02, 0.1, 0.3, 0.5, 0.75, 1.0].into_iter();
    alphas.flat_map(|alpha| [0.02, 0.09, 0.22, 0.4, 0.6, 0.85].into_iter().map(move |aspect| [alpha * aspect, alpha]))
}

/// Albedo of a white metal: what it scatters at once by visible normals, the rest by the cosine, so that both quadratures are smooth.
fn white_metal_albedo(alpha: [f32; 2], wo: Vec3) -> f32 {
    const COUNT: u32 = 1 << 11;
    let Bsdf::Conductor(metal) = perfect_metal(alpha) else { unreachable!() };
    let single = metal.single_scattering();
    let sampler = Sampler::new(SamplerKind::Sobol, 9);
    let rest: f32 = (0..COUNT)
        .map(|i| {
            let u = sampler.sample_4d(PixelSeed(1), i, 0);
            let wi = warp::cosine_hemisphere([u[0], u[1]]);
            (metal.eval(wo, wi).value.g - single.eval(wo, wi).value.g) / warp::cosine_hemisphere_pdf(wi.z)
        })
        .sum();
    scattered_of(COUNT, &Bsdf::Conductor(single), wo).g + rest / COUNT as f32
}

#[test]
fn a_white_anisotropic_metal_loses_nothing() {
    // The tables interpolate, between their axes too.
    let (mut least, mut most) = (f32::MAX, 0f32);
    for alpha in anisotropic_alphas() {
        for turns in [0.0, 0.01, 0.03, 0.08, 0.15, 0.22, 0.25] {
            for cos in [1.0, 0.7, 0.5, 0.25, 0.1, 0.03, 0.01] {
                let total = white_metal_albedo(alpha, direction(cos, turns));
                (least, most) = (least.min(total), most.max(total));
            }
        }
    }
    assert!(least > 0.98 && most <= 1.005, "{least} {most}");
}

#[test]
fn rough_glass_reflects_and_refracts_all_light() {
    for ior in [1.1, 1.5, 2.4, 0.7] {
        for alpha in [0.01, 0.1, 0.4, 1.0] {
            let bsdf = Bsdf::Dielectric(Dielectric::new(ior, [alpha; 2]));
            for cos in COSINES {
                // Close to the horizon E falls too steeply for its table.
                let tolerance = if cos > 0.02 { 0.02 } else { 0.03 };
                assert_close(&format!("{ior} {alpha} {cos}"), scattered_of(1 << 12, &bsdf, direction(cos, 0.1)), 1.0, tolerance);
                assert_close(&format!("{ior} {alpha} -{cos}"), scattered_of(1 << 12, &bsdf, direction(-cos, 0.1)), 1.0, tolerance);
            }
        }
    }
}

#[test]
fn several_reflections_deepen_a_metals_colour() {
    let (Bsdf::Conductor(metal), wo) = (gold([1.0; 2]), direction(0.5, 0.0)) else { unreachable!() };
    let (all, once) = (scattered(&Bsdf::Conductor(metal), wo), scattered(&Bsdf::Conductor(metal.single_scattering()), wo));
    let added = all - once;
    assert!(added.r > 0.3 && added.b / added.r < 0.8 * once.b / once.r, "{all:?} {once:?}");
}

#[test]
fn glass_of_matching_index_passes_all_light_straight() {
    for alpha in [0.0, 0.5] {
        let bsdf = Bsdf::Dielectric(Dielectric::new(1.0, [alpha; 2]));
        let wo = direction(0.3, 0.4);
        let s = bsdf.sample(wo, 0.5, [0.3, 0.6]).unwrap();
        assert!((s.wi + wo).length() < 1e-6 && s.weight == Rgb::WHITE && s.is_transmission);
    }
}

#[test]
fn smooth_plastic_has_the_linear_formula() {
    // f = (1 - F(o)) (1 - F(i)) diffuse / (pi eta² (1 - F_internal)).
    let (eta, diffuse) = (1.49f32, Rgb::new(0.3, 0.6, 0.1));
    let bsdf = Bsdf::Plastic(Plastic::new(diffuse, eta, [0.0; 2]));
    let (o, i) = (direction(0.7, 0.1), direction(0.2, 0.8));
    let transmitted = |w: Vec3| 1.0 - fresnel::dielectric(w.z, eta).reflectance;
    let internal = fresnel::dielectric_average(1.0 / eta);
    let f = transmitted(o) * transmitted(i) / (std::f32::consts::PI * eta * eta * (1.0 - internal));
    let value = bsdf.eval(o, i).value;
    let expected = diffuse * (f * i.z);
    assert!((value.r - expected.r).abs() < 1e-5 * expected.r && (value.g - expected.g).abs() < 1e-5 * expected.g);
}
