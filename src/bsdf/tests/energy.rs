//! White furnaces: how much of the light from everywhere is scattered towards one direction.

use super::*;
use crate::sampling::{PixelSeed, Sampler, SamplerKind};

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

pub(super) const COSINES: [f32; 7] = [1.0, 0.8, 0.5, 0.25, 0.1, 0.05, 0.01];

#[test]
fn several_reflections_deepen_a_metals_colour() {
    let (Bsdf::Conductor(metal), wo) = (gold([1.0; 2]), direction(0.5, 0.0)) else { unreachable!() };
    let (all, once) =
        (scattered(&Bsdf::Conductor(metal), wo), scattered(&Bsdf::Conductor(metal.single_scattering()), wo));
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
