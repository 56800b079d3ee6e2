//! The principled model over the corners of its parameters.

use super::energy::scattered_by;
use super::*;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::sampling::statistics::{compare_directions, random_points};

/// A corner of the unit cube of ten parameters, for a white base; from bit 10 on: a thin sheet, half diffuse transmission.
fn corner(bits: u32) -> PrincipledParameters {
    let bit = |i: u32| (bits >> i & 1) as f32;
    let thin = bits >> 10 & 1 == 1;
    PrincipledParameters {
        base_color: Rgb::WHITE,
        metallic: bit(0),
        roughness: bit(1),
        anisotropic: bit(2),
        ior: PrincipledParameters::ior_of_specular(bit(3)),
        specular_tint: bit(4),
        sheen: bit(5),
        clearcoat: bit(6),
        clearcoat_gloss: bit(7),
        subsurface: bit(8),
        transmission: bit(9),
        thin,
        diffuse_transmission: if thin { 0.5 } else { 0.0 },
        ..PrincipledParameters::default()
    }
}

/// Some inner points, coloured.
fn blends() -> Vec<(String, Bsdf)> {
    let color = Rgb::new(0.8, 0.3, 0.1);
    let half =
        PrincipledParameters { base_color: color, sheen: 0.5, clearcoat: 0.6, clearcoat_gloss: 0.3, ..PrincipledParameters::default() };
    let list = [
        ("plain", PrincipledParameters { base_color: color, ..PrincipledParameters::default() }),
        ("coated cloth", half),
        ("half metal", PrincipledParameters { metallic: 0.5, anisotropic: 0.7, specular_tint: 1.0, ..half }),
        ("flat", PrincipledParameters { subsurface: 0.8, roughness: 0.9, ..half }),
        ("half glass", PrincipledParameters { transmission: 0.5, roughness: 0.4, ..half }),
        ("glass", PrincipledParameters { transmission: 1.0, base_color: color, ..PrincipledParameters::default() }),
        ("sheet", PrincipledParameters { thin: true, transmission: 0.5, diffuse_transmission: 0.3, ..half }),
        ("all", PrincipledParameters { metallic: 0.3, transmission: 0.4, anisotropic: 0.5, subsurface: 0.5, ..half }),
    ];
    list.map(|(name, parameters)| (name.to_owned(), Bsdf::Principled(Principled::new(&parameters)))).into()
}

#[test]
fn directions_follow_the_density() {
    for (name, bsdf) in blends() {
        for cos in [0.9, 0.3, -0.6] {
            let wo = direction(cos, 0.1);
            let sample = |u: [f32; 4]| bsdf.sample(wo, u[2], [u[0], u[1]]).map(|s| s.wi);
            compare_directions(100_000, 23, sample, |wi| bsdf.eval(wo, wi).pdf).check(&format!("{name} {cos}"));
        }
    }
}

#[test]
fn weights_are_value_over_density_and_sides_are_told() {
    for (name, bsdf) in blends() {
        for u in random_points(2, 20_000) {
            let wo = direction(2.0 * u[3] - 1.0, 0.3);
            let Some(s) = bsdf.sample(wo, u[2], [u[0], u[1]]) else { continue };
            let eval = bsdf.eval(wo, s.wi);
            assert_eq!((eval.pdf, eval.value / eval.pdf, s.wi.z * wo.z < 0.0), (s.pdf, s.weight, s.is_transmission), "{name}");
            let bends = s.is_transmission && name != "sheet";
            assert_eq!(
                s.eta,
                if !bends {
                    1.0
                } else if wo.z > 0.0 {
                    1.5
                } else {
                    1.0 / 1.5
                },
                "{name}"
            );
        }
    }
}

#[test]
fn reflection_is_reciprocal_as_is_what_passes_a_sheet() {
    for (name, bsdf) in blends() {
        for u in random_points(5, 5_000) {
            let (a, b) = (direction(0.02 + 0.98 * u[0], u[1]), direction(0.02 + 0.98 * u[2], u[3]));
            let beyond = vec3(b.x, b.y, -b.z);
            for (a, b) in [(a, b)].into_iter().chain((name == "sheet").then_some((a, beyond))) {
                let (ab, ba) = (bsdf.eval(a, b).value / b.z.abs(), bsdf.eval(b, a).value / a.z.abs());
                for (x, y) in ab.to_array().into_iter().zip(ba.to_array()) {
                    assert!((x - y).abs() <= 3e-4 * x.max(y), "{name} {a:?} {b:?} {x} {y}");
                }
            }
        }
    }
}

/// The corner with the bits cleared that have no effect on it.
fn essential(bits: u32) -> u32 {
    let (metal, glass, coat) = (bits & 1 == 1, bits >> 9 & 1 == 1, bits >> 6 & 1 == 1);
    // The base is white, and a tint with it.
    let mut idle = 1 << 4;
    if metal {
        idle |= 1 << 3 | 1 << 5 | 1 << 8 | 1 << 9 | 1 << 10;
    } else if glass {
        idle |= 1 << 5 | 1 << 8;
    }
    if !coat {
        idle |= 1 << 7;
    }
    bits & !idle
}

#[test]
fn no_corner_scatters_more_than_it_receives() {
    // Corners that differ in what has no effect scatter alike, bit for bit. For each of the others the albedo comes from two shifted Sobol
    // sequences over all random numbers of a sample. Nothing is random: the points are fixed.
    let mut corners = Vec::new();
    for bits in 0..2048 {
        if essential(bits) == bits {
            corners.push(bits);
            continue;
        }
        let [a, b] = [bits, essential(bits)].map(|bits| Principled::new(&corner(bits)));
        for u in random_points(bits, 4) {
            let (wo, wi) = (direction(u[0], u[1]), direction(2.0 * u[2] - 1.0, u[3]));
            assert_eq!(a.eval(wo, wi), b.eval(wo, wi), "{bits:b}");
        }
    }
    assert_eq!(corners.len(), 252);
    let mut worst = 0f32;
    for bits in corners {
        let bsdf = Bsdf::Principled(Principled::new(&corner(bits)));
        // Only glass has another inside.
        let inside = (bits >> 9 & 1 == 1).then_some(-0.5);
        for cos in [1.0, 0.7, 0.3, 0.1, 0.02].into_iter().chain(inside) {
            let by = |count: u32| [1, 2].map(|seed| scattered_by(count, seed, &bsdf, direction(cos, 0.07)).max_channel());
            let [mut a, mut b] = by(4096);
            // Where the two leave it open, the narrow lobe of a coat at grazing angles for the most part, many more points tell.
            if 0.5 * (a + b) + (a - b).abs() > 1.005 {
                [a, b] = by(1 << 17);
                assert!((a - b).abs() < 0.004, "{bits:b} at {cos}: {a} {b}");
            }
            let albedo = 0.5 * (a + b);
            assert!(albedo <= 1.005, "{bits:b} at {cos}: {a} {b}");
            worst = worst.max(albedo);
        }
    }
    assert!(worst > 0.99, "the bound is far from what is reached: {worst}");
}

#[test]
fn no_corner_reflects_more_than_it_receives_by_quadrature() {
    // Opaque corners with broad lobes, by a product rule over all directions.
    let (rows, columns) = (200, 100);
    for bits in (0..512).filter(|bits| bits & 0b10 != 0) {
        let bsdf = Bsdf::Principled(Principled::new(&corner(bits & !0b1000_0000)));
        for cos in [0.999, 0.6, 0.2, 0.05] {
            let wo = direction(cos, 0.07);
            let mut sum = 0.0;
            for row in 0..rows {
                // Denser towards grazing.
                let root = (row as f32 + 0.5) / rows as f32;
                for column in 0..columns {
                    let wi = direction(root * root, (column as f32 + 0.5) / columns as f32);
                    sum += f64::from(bsdf.eval(wo, wi).value.max_channel() * 2.0 * root);
                }
            }
            let total = sum * std::f64::consts::TAU / f64::from(rows * columns);
            // Tables interpolate: of anisotropic microfacets, at azimuths between their axes, to a hundredth.
            let bound = if bits & 0b100 == 0 { 1.002 } else { 1.01 };
            assert!(total <= bound, "{bits:b} at {cos}: {total}");
        }
    }
}

#[test]
fn a_white_metal_loses_nothing_and_black_keeps_only_its_layers() {
    for roughness in [0.0, 0.3, 0.7, 1.0] {
        let metal = PrincipledParameters { base_color: Rgb::WHITE, metallic: 1.0, roughness, ..PrincipledParameters::default() };
        let black = PrincipledParameters { base_color: Rgb::BLACK, roughness, ..PrincipledParameters::default() };
        for cos in [1.0, 0.5, 0.1] {
            let wo = direction(cos, 0.2);
            let mean = |parameters: &PrincipledParameters| {
                let bsdf = Principled::new(parameters);
                let samples = random_points(3, 20_000).map(|u| bsdf.sample(wo, u[2], [u[0], u[1]]).map_or(0.0, |s| s.weight.g));
                samples.sum::<f32>() / 20_000.0
            };
            assert!((mean(&metal) - 1.0).abs() < 0.01, "{roughness} {cos}: {}", mean(&metal));
            let alone = mean(&PrincipledParameters { multiscatter: false, ..metal });
            assert!(alone < 1.005 && (roughness < 0.7 || alone < 0.97), "{roughness} {cos}: {alone}");
            let layer = Principled::new(&black).layer_albedo_at(wo);
            assert!((mean(&black) - layer).abs() < 0.01, "{roughness} {cos}: {} {layer}", mean(&black));
        }
    }
}

#[test]
fn masking_and_distribution_share_their_alpha() {
    // With G from another alpha than D, normals visible from a direction would not add up to it: the white furnace of single scattering at
    // the limit of weak roughness keeps all, at any direction.
    let metal = PrincipledParameters { base_color: Rgb::WHITE, metallic: 1.0, roughness: 0.1, multiscatter: false, ..Default::default() };
    let bsdf = Principled::new(&metal);
    for cos in [1.0, 0.5, 0.2] {
        let wo = direction(cos, 0.0);
        let mean =
            random_points(4, 10_000).map(|u| bsdf.sample(wo, u[2], [u[0], u[1]]).map_or(0.0, |s| s.weight.g)).sum::<f32>() / 10_000.0;
        assert!((mean - 1.0).abs() < 0.005, "{cos}: {mean}");
    }
}

#[test]
fn everything_is_finite_at_every_corner() {
    for bits in 0..2048 {
        let bsdf = Bsdf::Principled(Principled::new(&corner(bits)));
        for cos in [1.0f32, 1e-3, 1e-6, 1e-12, 1e-30, 1e-45, 0.0] {
            for wo in [direction(cos, 0.2), direction(-cos, 0.7)] {
                assert!(bsdf.albedo(wo).is_finite(), "{bits:b} {wo:?}");
                for lobe in [0.0, 0.3, 0.5, 0.8, ONE_MINUS_EPSILON] {
                    for u in [[0.0, 0.0], [0.0, ONE_MINUS_EPSILON], [ONE_MINUS_EPSILON, 0.0], [0.4, 0.6]] {
                        let Some(s) = bsdf.sample(wo, lobe, u) else { continue };
                        let sound =
                            s.weight.is_finite() && s.weight.to_array().iter().all(|&v| v >= 0.0) && s.pdf.is_finite() && s.pdf > 0.0;
                        assert!(sound && s.wi.is_finite() && (s.wi.length() - 1.0).abs() < 1e-4, "{bits:b} {wo:?} {s:?}");
                    }
                }
                for cos_i in [1.0f32, 1e-3, 1e-12, 1e-30, -1e-6, -1.0, 0.0] {
                    let eval = bsdf.eval(wo, direction(cos_i, 0.7));
                    assert!(eval.value.is_finite() && eval.pdf.is_finite() && eval.pdf >= 0.0, "{bits:b} {wo:?} {cos_i} {eval:?}");
                }
            }
        }
    }
}

#[test]
fn the_base_is_coloured_once() {
    // What cosine-weighted samples carry of a plain diffuse base is its colour below the layer: no factor pi, no colour twice.
    let color = Rgb::new(0.8, 0.4, 0.2);
    let plain = PrincipledParameters { base_color: color, ior: 1.0, roughness: 0.5, ..PrincipledParameters::default() };
    let bsdf = Principled::new(&plain);
    let wo = Vec3::Z;
    let wi = direction(0.9, 0.3);
    let ratio = bsdf.eval(wo, wi).value / bsdf.eval(wo, wi).value.r;
    assert!((ratio.g - 0.5).abs() < 0.01 && (ratio.b - 0.25).abs() < 0.01, "{ratio:?}");
    let lambert = color.r * std::f32::consts::FRAC_1_PI * wi.z;
    assert!((bsdf.eval(wo, wi).value.r / lambert - 1.0).abs() < 0.1);
}
