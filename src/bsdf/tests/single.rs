//! Materials of other renderers against their values.

use super::*;

/// `pi f / r` of Mitsuba 3.9.1's `roughplastic` with index 1.49 and no reflection by the coat, for `wi` ahead and `wo`
/// at cosines 0.1, 0.55 and 1, and its internal reflectance, from its values of a nonlinear base.
const MITSUBA: [(bool, f32, [f32; 3], f32); 6] = [
    (false, 0.1, [0.58267, 0.87832, 0.91551], 0.54553),
    (false, 0.3, [0.52012, 0.65491, 0.69436], 0.40877),
    (false, 0.7, [0.25891, 0.40970, 0.47692], 0.19615),
    (true, 0.1, [0.53459, 0.94211, 0.97913], 0.57467),
    (true, 0.3, [0.66644, 0.83260, 0.87343], 0.52344),
    (true, 0.7, [0.51455, 0.59675, 0.62623], 0.34112),
];

#[test]
fn bases_of_lossy_plastics_are_mitsubas() {
    for (is_beckmann, alpha, expected, internal) in MITSUBA {
        let value = |wo: Vec3, r: f32, nonlinear: bool| {
            fn plastic<D: Microfacets>(facets: D, r: f32, nonlinear: bool) -> SingleScatteringBsdf<D> {
                let coat = Coat::single_scattering(1.49, facets, mitsuba_diffuse_mean);
                SingleScatteringBsdf::Plastic(Plastic { diffuse: Rgb::splat(r), coat, tint: Rgb::BLACK, nonlinear })
            }
            let bsdf = if is_beckmann {
                Bsdf::Beckmann(plastic(Beckmann::new([alpha; 2]), r, nonlinear))
            } else {
                Bsdf::SeparableGgx(plastic(SeparableGgx::new([alpha; 2]), r, nonlinear))
            };
            bsdf.eval(wo, Vec3::Z).value.g * std::f32::consts::PI / r
        };
        for (cos, expected) in [0.1, 0.55, 1.0].into_iter().zip(expected) {
            let found = value(direction(cos, 0.2), 0.5, false);
            // Mitsuba masks Beckmann's microfacets by a rational fit, up to 0.6 % off.
            let limit = if is_beckmann { 4e-3 } else { 2e-3 };
            assert!((found - expected).abs() < limit * expected, "{is_beckmann} {alpha} {cos}: {found} {expected}");
        }
        // A dark base shows none of the reflections within.
        let found = 1.0 - value(Vec3::Z, 1e-3, true) / value(Vec3::Z, 0.5, false);
        assert!((found - internal).abs() < 2e-3, "{is_beckmann} {alpha}: {found} {internal}");
    }
}

#[test]
fn a_nonlinear_base_deepens_and_a_white_one_loses_nothing() {
    let plastic = |r: f32, alpha: f32| Plastic { nonlinear: true, ..Plastic::new(Rgb::splat(r), 1.5, [alpha; 2]) };
    for alpha in [0.0, 0.3] {
        let (white, linear) = (plastic(1.0, alpha), Plastic::new(Rgb::WHITE, 1.5, [alpha; 2]));
        let (o, i) = (direction(0.6, 0.1), direction(0.3, 0.7));
        assert_eq!(white.eval(o, i), linear.eval(o, i));
    }
    // r (1 - R) / (1 - r R) with R = 0.5963.
    let ratio = plastic(0.5, 0.0).eval(Vec3::Z, Vec3::Z).value.g
        / Plastic::new(Rgb::WHITE, 1.5, [0.0; 2]).eval(Vec3::Z, Vec3::Z).value.g;
    assert!((ratio - 0.2876).abs() < 1e-3, "{ratio}");
}

#[test]
fn tints_colour_what_is_reflected_and_what_crosses() {
    let (reflection, transmission) = (Rgb::new(0.1, 0.2, 0.3), Rgb::new(0.4, 0.5, 0.6));
    let wo = direction(0.5, 0.1);
    let pane = ThinDielectric { ior: 1.5, reflection_tint: reflection, transmission_tint: transmission };
    for alpha in [[0.0; 2], [0.3; 2]] {
        let clear = Dielectric::new(1.5, alpha);
        let tinted = clear.tinted(reflection, transmission);
        for u_lobe in [0.0, 0.02, 0.5, 0.9] {
            let (Some(a), Some(b)) = (clear.sample(wo, u_lobe, [0.4; 2]), tinted.sample(wo, u_lobe, [0.4; 2])) else {
                continue;
            };
            let tint = if a.is_transmission { transmission } else { reflection };
            assert_eq!((a.wi, a.pdf, a.weight * tint), (b.wi, b.pdf, b.weight));
            assert_eq!(clear.eval(wo, a.wi).value * tint, tinted.eval(wo, a.wi).value);
        }
    }
    assert_eq!(pane.sample(wo, 0.0, [0.5; 2]).unwrap().weight, reflection);
    assert_eq!(pane.sample(wo, 0.99, [0.5; 2]).unwrap().weight, transmission);
}

#[test]
fn least_alphas_widen_rough_surfaces_alone() {
    let alpha_of = |bsdf: &Bsdf| match bsdf {
        Bsdf::Conductor(metal) => metal.alpha(),
        Bsdf::Dielectric(glass) => glass.alpha(),
        other => panic!("{other:?}"),
    };
    for make in [gold, glass] {
        assert_eq!(alpha_of(&make([0.01, 0.3]).with_min_alpha(0.2).unwrap()), [0.2, 0.3]);
        assert!(make([0.2; 2]).with_min_alpha(0.2).is_none() && make([0.0; 2]).with_min_alpha(0.2).is_none());
    }
    for (name, bsdf) in rough_bsdfs() {
        let Some(rougher) = bsdf.with_min_alpha(0.6) else { continue };
        assert!(rougher.with_min_alpha(0.6).is_none(), "{name}");
        // A wider lobe is lower at its peak.
        let (o, i) = (direction(0.8, 0.1), direction(0.8, 0.6));
        assert!(rougher.eval(o, i).value.g < bsdf.eval(o, i).value.g, "{name}");
    }
}
