//! The diffuse share against the lobes evaluated one without the other.

use super::*;
use crate::sampling::statistics::random_points;

const COLOR: Rgb = Rgb { r: 0.7, g: 0.3, b: 0.0 };

/// Pairs of directions on one side, either side.
fn pairs() -> impl Iterator<Item = (Vec3, Vec3)> {
    random_points(9, 400).enumerate().map(|(k, u)| {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let at = |cos: f32, turns: f32| direction(side * (0.05 + 0.95 * cos), turns);
        (at(u[0], u[1]), at(u[2], u[3]))
    })
}

/// The share is what is missing without the diffuse part.
fn assert_split(name: &str, whole: &Bsdf, specular: &Bsdf) {
    for (wo, wi) in pairs() {
        let all = whole.eval(wo, wi).value;
        let (share, rest) = (whole.diffuse_fraction(wo, wi), specular.eval(wo, wi).value);
        for (share, (all, rest)) in share.to_array().into_iter().zip(all.to_array().into_iter().zip(rest.to_array())) {
            assert!((0.0..=1.0).contains(&share), "{name}: {share}");
            assert!(
                (share * all - (all - rest)).abs() <= 1e-5 * all,
                "{name} {wo} {wi}: {share} of {all}, without {rest}"
            );
        }
    }
}

#[test]
fn shares_are_what_the_diffuse_part_adds() {
    for alpha in [0.1, 0.5] {
        let glossy = |diffuse: Rgb| Bsdf::Glossy(Glossy::new(diffuse, Rgb::splat(0.1), Rgb::splat(0.3), alpha));
        assert_split("glossy", &glossy(COLOR), &glossy(Rgb::BLACK));
        let phong = |diffuse: Rgb| Bsdf::Phong(Phong::new(diffuse, Rgb::splat(0.3), 2.0 / alpha));
        assert_split("phong", &phong(COLOR), &phong(Rgb::BLACK));
        let plastic = |diffuse: Rgb| Bsdf::Plastic(Plastic::new(diffuse, 1.5, [alpha, 0.3]));
        assert_split("plastic", &plastic(COLOR), &plastic(Rgb::BLACK));
        let coated = |albedo: Rgb, tint: Rgb| {
            let base = Bsdf::Eon(Eon { albedo, roughness: 0.5 });
            Bsdf::Coated(Coated::new(Coat::new(1.4, [alpha; 2]), tint, base).into())
        };
        assert_split("coated", &coated(COLOR, COLOR), &coated(Rgb::BLACK, COLOR));
        let twice =
            |diffuse: Rgb| Bsdf::Coated(Coated::new(Coat::new(1.4, [0.3; 2]), Rgb::WHITE, plastic(diffuse)).into());
        assert_split("coated plastic", &twice(COLOR), &twice(Rgb::BLACK));
    }
    for roughness in [0.2, 0.7] {
        // So little of everything that no layer has to leave less to the others.
        let dim = PrincipledParameters { base_color: COLOR * 0.3, roughness, ..PrincipledParameters::default() };
        let black = PrincipledParameters { base_color: Rgb::BLACK, ..dim };
        let with = |p: &PrincipledParameters, clearcoat: f32, sheen: f32, transmission: f32| {
            Bsdf::Principled(Principled::new(&PrincipledParameters { clearcoat, sheen, transmission, ..*p }))
        };
        for [clearcoat, sheen, transmission] in [[0.0; 3], [0.2, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.1, 0.4]] {
            let [whole, specular] =
                [(&dim, sheen), (&black, 0.0)].map(|(p, sheen)| with(p, clearcoat, sheen, transmission));
            assert_split("principled", &whole, &specular);
        }
    }
}

#[test]
fn lobes_of_one_kind_are_all_or_nothing() {
    let principled = |metallic: f32, transmission: f32| {
        let p = PrincipledParameters {
            base_color: COLOR,
            clearcoat: 0.5,
            metallic,
            transmission,
            ..PrincipledParameters::default()
        };
        Bsdf::Principled(Principled::new(&p))
    };
    let over = |base: Bsdf, alpha: f32| Bsdf::Coated(Coated::new(Coat::new(1.5, [alpha; 2]), Rgb::WHITE, base).into());
    let lambert = || Bsdf::Lambert(Lambert { albedo: COLOR });
    let specular =
        [gold([0.2; 2]), glass([0.3; 2]), beckmann_gold([0.2; 2]), beckmann_glass([0.2; 2]), principled(1.0, 0.0)];
    let more = [principled(0.0, 1.0), over(gold([0.4; 2]), 0.2), over(gold([0.4; 2]), 0.0)];
    let diffuse =
        [lambert(), Bsdf::Eon(Eon { albedo: COLOR, roughness: 1.0 }), white_plastic([0.0; 2]), over(lambert(), 0.0)];
    let sheet = [Bsdf::DiffuseTransmission(DiffuseTransmission::new(COLOR, COLOR))];
    for (wo, wi) in pairs() {
        assert!(specular.iter().chain(&more).all(|bsdf| bsdf.diffuse_fraction(wo, wi).is_black()));
        assert!(diffuse.iter().chain(&sheet).all(|bsdf| bsdf.diffuse_fraction(wo, wi) == Rgb::WHITE));
    }
}
