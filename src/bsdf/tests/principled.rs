//! The principled model over the corners of its parameters.

use super::energy::scattered_by;
use super::*;
use crate::sampling::statistics::random_points;

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
    // Corners that differ in what has no effect scatter alike, bit for bit. For each of the others the albedo comes
    // from two shifted Sobol sequences over all random numbers of a sample. Nothing is random: the points are fixed.
    let mut corners = Vec::new();
    for bits in 0..2048 {
        if essential(bits) == bits {
            corners.push(bits);
            continue;
        }
        let [a, b] = [bits, essential(bits)].map(|bits| Principled::new(&PrincipledParameters::white_corner(bits)));
        for u in random_points(bits, 4) {
            let (wo, wi) = (direction(u[0], u[1]), direction(2.0 * u[2] - 1.0, u[3]));
            assert_eq!(a.eval(wo, wi), b.eval(wo, wi), "{bits:b}");
        }
    }
    assert_eq!(corners.len(), 252);
    let mut worst = 0f32;
    for bits in corners {
        let bsdf = Bsdf::Principled(Principled::new(&PrincipledParameters::white_corner(bits)));
        // Only glass has another inside.
        let inside = (bits >> 9 & 1 == 1).then_some(-0.5);
        for cos in [1.0, 0.7, 0.3, 0.1, 0.02].into_iter().chain(inside) {
            let by =
                |count: u32| [1, 2].map(|seed| scattered_by(count, seed, &bsdf, direction(cos, 0.07)).max_channel());
            let [mut a, mut b] = by(4096);
            // Where the two leave it open, the narrow lobe of a coat at grazing angles for the most part, many more
            // points tell.
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
        let bsdf = Bsdf::Principled(Principled::new(&PrincipledParameters::white_corner(bits & !0b1000_0000)));
        let turns: &[f32] = if bits & 0b100 == 0 { &[0.07] } else { &[0.07, 0.2, 0.25] };
        for (cos, turns) in
            [0.999, 0.6, 0.2, 0.05].into_iter().flat_map(|cos| turns.iter().map(move |&turns| (cos, turns)))
        {
            let wo = direction(cos, turns);
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
            assert!(total <= bound, "{bits:b} at {cos} {turns}: {total}");
        }
    }
}

#[test]
fn thin_sheets_of_mitsuba_are_sampled_as_they_are_evaluated() {
    for (ior, anisotropic, specular_tint) in [(1.5, 0.0, 0.0), (1.5, 0.8, 0.7), (1.2, 0.0, 1.0), (2.5, 0.5, 0.0)] {
        let glass = PrincipledParameters {
            ior,
            anisotropic,
            specular_tint,
            transmission: 1.0,
            thin: true,
            ..PrincipledParameters::default()
        };
        let parameters =
            PrincipledParameters { base_color: Rgb::new(0.9, 0.5, 0.25), model: PrincipledModel::Mitsuba, ..glass };
        let bsdf = Bsdf::Principled(Principled::new(&parameters));
        let disagreement = sampling::worst_disagreement(&bsdf, &[1.0, 0.7, 0.3, 0.05, -0.5]);
        assert!(disagreement < 2e-4, "{ior} {anisotropic}: {disagreement}");
        // What samples weigh on average is the integral of the values, on either side.
        let wo = direction(0.6, 0.13);
        let (mut sampled, mut integral) = ([0.0f64; 2], [0.0f64; 2]);
        let count = 1 << 16;
        for u in random_points(5, count) {
            if let Some(sample) = bsdf.sample(wo, u[0], [u[1], u[2]]) {
                sampled[usize::from(sample.is_transmission)] += f64::from(sample.weight.r) / count as f64;
            }
        }
        let side = 1000;
        for i in 0..side * side {
            let [row, column] = [i / side, i % side].map(|k| (k as f32 + 0.5) / side as f32);
            let wi = direction(2.0 * row - 1.0, column);
            integral[usize::from(wi.z < 0.0)] +=
                f64::from(bsdf.eval(wo, wi).value.r) * 2.0 * std::f64::consts::TAU / f64::from(side * side);
        }
        // Of 65,536 weights with a deviation of at most 0.6: more than five deviations of their mean.
        for (a, b) in sampled.iter().zip(integral) {
            assert!((a - b).abs() < 0.0125, "{ior} {anisotropic}: {sampled:?} {integral:?}");
        }
    }
}

#[test]
fn a_white_metal_loses_nothing_and_black_keeps_only_its_layers() {
    for roughness in [0.0, 0.3, 0.7, 1.0] {
        let metal = PrincipledParameters {
            base_color: Rgb::WHITE,
            metallic: 1.0,
            roughness,
            ..PrincipledParameters::default()
        };
        let black = PrincipledParameters { base_color: Rgb::BLACK, roughness, ..PrincipledParameters::default() };
        for cos in [1.0, 0.5, 0.1] {
            let wo = direction(cos, 0.2);
            let mean = |parameters: &PrincipledParameters| {
                let bsdf = Principled::new(parameters);
                let samples =
                    random_points(3, 20_000).map(|u| bsdf.sample(wo, u[2], [u[0], u[1]]).map_or(0.0, |s| s.weight.g));
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
    // With G from another alpha than D, normals visible from a direction would not add up to it: the white furnace of
    // single scattering at the limit of weak roughness keeps all, at any direction.
    let metal = PrincipledParameters {
        base_color: Rgb::WHITE,
        metallic: 1.0,
        roughness: 0.1,
        multiscatter: false,
        ..Default::default()
    };
    let bsdf = Principled::new(&metal);
    for cos in [1.0, 0.5, 0.2] {
        let wo = direction(cos, 0.0);
        let mean = random_points(4, 10_000)
            .map(|u| bsdf.sample(wo, u[2], [u[0], u[1]]).map_or(0.0, |s| s.weight.g))
            .sum::<f32>()
            / 10_000.0;
        assert!((mean - 1.0).abs() < 0.005, "{cos}: {mean}");
    }
}

#[test]
fn the_base_is_coloured_once() {
    // What cosine-weighted samples carry of a plain diffuse base is its colour below the layer: no factor pi, no colour
    // twice.
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
