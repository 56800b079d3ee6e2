//! How much of the light from everywhere is scattered towards one direction: white furnaces.

use std::f64::consts::LN_2;

use rayon::prelude::*;

use super::super::{Effort, Faults, Outcome, Plot};
use super::materials::{ALPHAS, Material, coats, direction, glass, white, white_metal};
use crate::bsdf::{
    Bsdf, Conductor, Dielectric, Eon, Lambert, Mirror, Plastic, Principled, PrincipledParameters, ThinDielectric,
};
use crate::color::Rgb;
use crate::math::Vec3;
use crate::sampling::{PixelSeed, Sampler, SamplerKind, warp};

/// Mean weight of samples in its largest channel, with the radiance scaling of refraction undone.
fn scattered(count: u32, seed: u32, bsdf: &Bsdf, wo: Vec3) -> f64 {
    let sampler = Sampler::new(SamplerKind::Sobol, 9);
    let mut sums = [0f64; 3];
    for i in 0..count {
        let u = sampler.sample_4d(PixelSeed(seed), i, 0);
        if let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]) {
            let weight = s.weight * (s.eta * s.eta);
            sums.iter_mut().zip(weight.to_array()).for_each(|(sum, w)| *sum += f64::from(w));
        }
    }
    sums.into_iter().fold(f64::NEG_INFINITY, f64::max) / f64::from(count)
}

/// By two scrambles of Sobol's sequence: by more points where these do not show that the albedo is within `bounds`, as
/// for the narrow lobe of a coat at grazing angles.
fn albedo(count: u32, bsdf: &Bsdf, wo: Vec3, bounds: [f64; 2]) -> f64 {
    let mut mean = 0.0;
    for more in [0, 3, 6] {
        let [a, b] = [1, 2].map(|seed| scattered(count << more, seed, bsdf, wo));
        let spread = (a - b).abs();
        mean = 0.5 * (a + b);
        if bounds[0] + spread <= mean && mean + spread <= bounds[1] {
            break;
        }
    }
    mean
}

/// Cosines from 1 down to `least`, as many in each decade.
fn cosines(least: f32, count: u32) -> impl Iterator<Item = f32> {
    (0..count).map(move |i| least.powf(i as f32 / (count - 1) as f32))
}

pub(super) fn g5_energy(effort: Effort) -> Outcome {
    let (angles, samples) = effort.pick((6, 1 << 10), (20, 1 << 12));
    let found: Vec<_> = white()
        .par_iter()
        .flat_map_iter(|material| {
            cosines(0.001, angles).flat_map(move |cos| {
                let sides = [direction(cos, 0.05), direction(-cos, 0.2)];
                sides.map(|wo| {
                    (albedo(samples, &material.bsdf, wo, [0.0, 1.01]), format!("{} from {:.3}", material.name, wo.z))
                })
            })
        })
        .collect();
    let broken =
        Faults::of(&found, |(albedo, _)| usize::from(!(*albedo >= 0.0)), |(albedo, name)| format!("{name}: {albedo}"));
    let worst = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are materials");
    Outcome::new()
        .at_most(format!("largest albedo of {} ({})", found.len(), worst.1), worst.0, 1.01)
        .none("albedos that are no fraction", broken)
}

/// What is left of white light in a furnace.
const FURNACE: [f64; 2] = [0.99, 1.01];

/// A white material and what it scatters at once: light scattered several times has a narrow chance to be sampled where
/// there is little of it.
struct White {
    material: Material,
    once: Option<Bsdf>,
}

impl White {
    fn plain(bsdf: Bsdf) -> Self {
        Self { material: Material { name: String::new(), bsdf, ior: 1.0 }, once: None }
    }

    fn metal(alpha: [f32; 2]) -> Self {
        let metal = white_metal(alpha);
        Self { once: Some(Bsdf::Conductor(metal.single_scattering())), ..Self::plain(Bsdf::Conductor(metal)) }
    }

    fn principled_metal(roughness: f32) -> Self {
        let all = PrincipledParameters {
            base_color: Rgb::WHITE,
            metallic: 1.0,
            roughness,
            ..PrincipledParameters::default()
        };
        let once = PrincipledParameters { multiscatter: false, ..all };
        Self {
            once: Some(Bsdf::Principled(Principled::new(&once))),
            ..Self::plain(Bsdf::Principled(Principled::new(&all)))
        }
    }

    fn glass(ior: f32, alpha: f32) -> Self {
        let once = Dielectric::new(ior, [alpha; 2]).single_scattering();
        Self { material: glass(ior, [alpha; 2]), once: Some(Bsdf::Dielectric(once)) }
    }

    /// What is scattered at once by its own sampling, the rest, which is smooth, by the cosine.
    fn albedo(&self, count: u32, wo: Vec3) -> f64 {
        let bsdf = &self.material.bsdf;
        let Some(once) = &self.once else { return albedo(count / 4, bsdf, wo, FURNACE) };
        let sampler = Sampler::new(SamplerKind::Sobol, 9);
        let eta = if wo.z > 0.0 { self.material.ior } else { 1.0 / self.material.ior };
        let mut rest = 0.0;
        for i in 0..count {
            let u = sampler.sample_4d(PixelSeed(1), i, 1);
            let near = warp::cosine_hemisphere([u[0], u[1]]);
            for (wi, scale) in [(near, 1.0), (-near, eta * eta)] {
                let wi = if wo.z > 0.0 { wi } else { -wi };
                let added = bsdf.eval(wo, wi).value.g - once.eval(wo, wi).value.g;
                rest += f64::from(added * scale / warp::cosine_hemisphere_pdf(near.z));
            }
        }
        scattered(count, 1, once, wo) + rest / f64::from(count)
    }
}

/// White materials with the same bounds in a furnace.
struct Family {
    name: &'static str,
    members: Vec<White>,
    /// Azimuths in turns.
    azimuths: &'static [f32],
    /// The least albedo, and why if that is less than the catalogue's.
    least: f64,
    cause: Option<&'static str>,
}

/// What a furnace finds for a family.
struct Furnace {
    least: f64,
    most: f64,
    /// Cosine and the largest distance of the albedo from 1 there.
    errors: Vec<(f64, f64)>,
}

impl Family {
    fn new(name: &'static str, members: Vec<White>) -> Self {
        Self { name, members, azimuths: &[0.3], least: FURNACE[0], cause: None }
    }

    /// From cosine 1 down to 0.01.
    fn measure(&self, effort: Effort) -> Furnace {
        let (angles, samples) = effort.pick((6, 1 << 12), (24, 1 << 14));
        let cosines: Vec<f32> = cosines(0.01, angles).collect();
        let extremes = |cos: &f32| {
            let members = self.members.iter().flat_map(|white| self.azimuths.iter().map(move |&turns| (white, turns)));
            let albedos = members.flat_map(|(white, turns)| {
                let inside = white.material.bsdf.flags().transmits().then_some(-cos);
                [*cos].into_iter().chain(inside).map(move |cos| white.albedo(samples, direction(cos, turns)))
            });
            let (least, most) =
                albedos.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
            (f64::from(*cos), least, most)
        };
        let rows: Vec<_> = cosines.par_iter().map(extremes).collect();
        Furnace {
            least: rows.iter().map(|row| row.1).fold(f64::INFINITY, f64::min),
            most: rows.iter().map(|row| row.2).fold(f64::NEG_INFINITY, f64::max),
            errors: rows
                .into_iter()
                .map(|(cos, least, most)| (cos, (1.0 - least).abs().max((most - 1.0).abs())))
                .collect(),
        }
    }
}

const AZIMUTHS: &[f32] = &[0.0, 0.03, 0.08, 0.15, 0.25];

/// Without microfacets: all but the last four scatter all of every sample, or choose between two lobes.
fn smooth() -> Vec<White> {
    let mut list = vec![
        Bsdf::Lambert(Lambert { albedo: Rgb::WHITE }),
        Bsdf::Mirror(Mirror { reflectance: Rgb::WHITE }),
        Bsdf::ThinDielectric(ThinDielectric::new(1.5)),
        Bsdf::Conductor(white_metal([0.0; 2])),
        glass(1.5, [0.0; 2]).bsdf,
        plastic([0.0; 2]),
    ];
    list.extend([0.01, 0.3, 0.7, 1.0].map(|roughness| Bsdf::Eon(Eon { albedo: Rgb::WHITE, roughness })));
    list.into_iter().map(White::plain).collect()
}

fn plastic(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Plastic(Plastic::new(Rgb::WHITE, 1.5, alpha))
}

/// What coats leave over a diffuse base or a mirror, which is all; anisotropic ones apart.
fn coated() -> [Vec<White>; 2] {
    let is_exact = |material: &Material| material.name.ends_with("lambert") || material.name.ends_with("mirror");
    let coats = coats(Rgb::WHITE, Rgb::WHITE).into_iter().filter(is_exact).map(|material| material.bsdf);
    let plastics = [[0.01; 2], [0.1; 2], [0.5; 2], [1.0; 2], ALPHAS[2], [0.1, 0.4]].map(plastic);
    let (turned, round): (Vec<_>, Vec<_>) =
        coats.chain(plastics).partition(|bsdf: &Bsdf| bsdf.flags().is_anisotropic());
    [round, turned].map(|list| list.into_iter().map(White::plain).collect())
}

const METAL: &str = "anisotropic metal may lose 0.02 in place of 0.01: what it scatters at once is read between the \
                     tables' two axes and eleven aspects, and what is added for several reflections is made a \
                     hundredth too dark on purpose, so that nothing shines";

fn families() -> Vec<Family> {
    let mut metals: Vec<_> = [1e-3, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0].map(|alpha| White::metal([alpha; 2])).into();
    metals.extend([0.0, 0.3, 0.7, 1.0].map(White::principled_metal));
    let aspects = [0.02, 0.09, 0.22, 0.4, 0.6, 0.85];
    let stretched = [0.02, 0.1, 0.3, 0.75, 1.0]
        .into_iter()
        .flat_map(|alpha| aspects.map(|aspect| White::metal([alpha * aspect, alpha])));
    let glasses =
        [1.1, 1.5, 2.4, 0.7].into_iter().flat_map(|ior| [0.01, 0.1, 0.4, 1.0].map(|alpha| White::glass(ior, alpha)));
    let [round, turned] = coated();
    vec![
        Family::new("without microfacets", smooth()),
        Family::new("rough metal", metals),
        Family {
            azimuths: AZIMUTHS,
            least: 0.98,
            cause: Some(METAL),
            ..Family::new("anisotropic metal", stretched.collect())
        },
        Family::new("rough glass", glasses.collect()),
        Family::new("coats", round),
        Family { azimuths: AZIMUTHS, ..Family::new("anisotropic coats", turned) },
    ]
}

pub(super) fn g6_furnace(effort: Effort) -> Outcome {
    let mut outcome = Outcome::new();
    let mut curves = Vec::new();
    for family in families() {
        let furnace = family.measure(effort);
        outcome = outcome.at_least(format!("least albedo, {}", family.name), furnace.least, family.least).at_most(
            format!("largest albedo, {}", family.name),
            furnace.most,
            FURNACE[1],
        );
        if let Some(cause) = family.cause {
            outcome = outcome.short(cause);
        }
        curves.push((family.name.to_owned(), furnace.errors));
    }
    outcome.plot(Plot {
        caption: "largest distance of a white surface's albedo from 1".to_owned(),
        x: "cosine".to_owned(),
        y: "error".to_owned(),
        floor: 1e-6,
        curves,
    })
}

/// What microfacets that reflect all scatter at once, by the midpoint rule over the square of random numbers, denser
/// towards the steep facets that reflect below the horizon.
fn scattered_once(alpha: f32, cos: f32, steps: u32) -> f64 {
    let single: Conductor = white_metal([alpha; 2]).single_scattering();
    let wo = direction(cos, 0.3);
    let at = |step: u32| (step as f32 + 0.5) / steps as f32;
    let weight = |x: u32, y: u32| {
        let root = at(y);
        single.sample(wo, 0.5, [at(x), 1.0 - root * root]).map_or(0.0, |s| f64::from(2.0 * root * s.weight.g))
    };
    let sum: f64 = (0..steps).flat_map(|y| (0..steps).map(move |x| (x, y))).map(|(x, y)| weight(x, y)).sum();
    sum / f64::from(steps * steps)
}

/// Cosines of [`ONCE`].
const ONCE_COSINES: [f32; 6] = [0.05, 0.1, 0.25, 0.5, 0.75, 1.0];

/// Alpha, the fraction of light that height-correlated Smith GGX microfacets with a reflectance of 1 scatter at once
/// for each cosine, and the mean under diffuse light: by two quadratures in `f64`, over visible normals and over
/// outgoing directions, which agree in all digits. At alpha 1 and cosine 1 it is 1 - ln 2.
const ONCE: [(f32, [f64; 6], f64); 4] = [
    (1.0, [0.84777, 0.76021, 0.59764, 0.45069, 0.36453, 0.30685], 0.4091),
    (0.5, [0.91255, 0.86011, 0.76520, 0.69825, 0.68208, 0.68785], 0.7002),
    (0.25, [0.93313, 0.89162, 0.84008, 0.85726, 0.89153, 0.91581], 0.8823),
    (0.1, [0.91176, 0.88346, 0.92162, 0.96921, 0.98314, 0.98831], 0.9720),
];

pub(super) fn g7_single_scattering(effort: Effort) -> Outcome {
    let steps = effort.pick(512, 1024);
    let (mut entries, mut means) = (0f64, 0f64);
    for (alpha, row, mean) in ONCE {
        for (cos, expected) in ONCE_COSINES.into_iter().zip(row) {
            entries = entries.max((scattered_once(alpha, cos, steps) - expected).abs());
        }
        let cosines = (0..64u8).map(|i| (f32::from(i) + 0.5) / 64.0);
        let average: f64 =
            cosines.map(|cos| 2.0 * f64::from(cos) * scattered_once(alpha, cos, steps / 4)).sum::<f64>() / 64.0;
        means = means.max((average - mean).abs());
    }
    // A unit of the last digit, and what the rule leaves where samples end below the horizon.
    Outcome::new()
        .at_most("error at 4 alphas and 6 cosines", entries, 5e-5)
        .at_most("error of the means under diffuse light", means, 2e-4)
        .at_most(
            "error of 1 - ln 2 at alpha 1 from ahead",
            (scattered_once(1.0, 1.0, steps) - (1.0 - LN_2)).abs(),
            1e-5,
        )
}
