//! Random walks below the surfaces of principled materials.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind, LayerSet};
use steradian::internal::math::{DVec3, Rng};
use steradian::internal::render::Overrides;

use crate::bad_input::{assert_error, assert_faults};
use crate::layers::assert_sums;
use crate::participating_media::hg;
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{
    Estimate, assert_blocks_agree, block_means, merge, pixels, prepare, probe, render, render_with,
};

/// A material whose light all enters, as far as the layer on top lets it.
fn wax(color: &Value, rest: Value) -> Value {
    let mut wax = json!({
        "type": "principled", "base_color": color, "subsurface": 1, "subsurface_method": "random_walk", "specular": 0
    });
    merge(&mut wax, rest);
    wax
}

/// Shapes of wax under a white sky.
fn furnace(wax: &Value, shapes: Value) -> Value {
    let mut scene = probe(
        [0.3, 0.2, 5.0],
        [0.3, 0.2, 0.0],
        json!({
            "integrator": { "type": "path", "max_depth": 1000 },
            "sampler": { "spp": 128 },
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    );
    scene["materials"] = json!({ "wax": wax, "mirror": { "type": "mirror", "reflectance": 0.3 } });
    scene["shapes"] = shapes;
    scene
}

fn ball() -> Value {
    json!([{ "type": "sphere", "material": "wax" }])
}

/// A mesh of a box, which no ray leaves but through its faces.
fn block(reverse: bool) -> Value {
    json!([{ "type": "cube", "material": "wax", "reverse_normal": reverse, "transform": [{ "scale": [8, 8, 0.5] }] }])
}

/// What the layer on top of a material reflects by itself.
fn layer(wax: &Value, shapes: &Value) -> f64 {
    let mut black = wax.clone();
    black["base_color"] = json!(0);
    Estimate::of(&render(&furnace(&black, shapes.clone())), 0).mean
}

#[test]
fn a_white_furnace_shows_no_wax() {
    for (rest, shapes) in [
        (json!({ "subsurface_radius": 0.3 }), ball()),
        (json!({ "subsurface_radius": [2, 0.2, 0.06], "subsurface_anisotropy": 0.8 }), ball()),
        (json!({ "subsurface_radius": 0.02 }), ball()),
        (json!({ "subsurface_radius": 0.4, "subsurface_scale": 0.5, "subsurface_anisotropy": -0.5 }), block(false)),
        (json!({ "subsurface_radius": 0.2 }), block(true)),
    ] {
        let white = wax(&json!(1), rest.clone());
        for strategy in ["mis", "light", "bsdf"] {
            let mut scene = furnace(&white, shapes.clone());
            scene["integrator"]["strategy"] = json!(strategy);
            let image = render(&scene);
            for channel in 0..3 {
                let Estimate { mean, error } = Estimate::of(&image, channel);
                // The albedo of the layer is from a table.
                let bound = 5.5 * error + 1e-3;
                assert!((mean - 1.0).abs() < bound, "{rest} {strategy}, channel {channel}: {mean} +- {error}");
            }
        }
    }
}

#[test]
fn shares_of_a_walk_add_up() {
    let of_share = |share: f64| {
        let grey = wax(&json!(0.5), json!({ "subsurface": share, "subsurface_radius": 0.2, "roughness": 0.8 }));
        Estimate::of(&render(&furnace(&grey, ball())), 0)
    };
    let [diffuse, both, walk] = [0.0, 0.4, 1.0].map(of_share);
    let (expected, error) = (0.6 * diffuse.mean + 0.4 * walk.mean, (0.4 * walk.error).hypot(0.6 * diffuse.error));
    let bound = 5.5 * both.error.hypot(error) + 1e-4;
    assert!((both.mean - expected).abs() < bound && walk.mean > diffuse.mean + 0.01, "{diffuse:?} {both:?} {walk:?}");
}

#[test]
fn flat_ground_has_the_base_color() {
    let ground = json!([{
        "type": "cube", "material": "wax", "transform": [{ "scale": [40, 40, 20] }, { "translate": [0, 0, -20] }]
    }]);
    for anisotropy in [0.0, 0.6, -0.4] {
        let color = [0.85, 0.5, 0.15];
        let wax =
            wax(&json!(color), json!({ "subsurface_radius": [0.1, 0.02, 0.05], "subsurface_anisotropy": anisotropy }));
        let mut scene = furnace(&wax, ground.clone());
        scene["sampler"]["spp"] = json!(512);
        let (image, layer) = (render(&scene), layer(&wax, &ground));
        for (channel, color) in color.into_iter().enumerate() {
            let Estimate { mean, error } = Estimate::of(&image, channel);
            // What the formula is off by: the similarity of anisotropic scattering to isotropic one is not exact.
            let bound = 5.5 * error + if anisotropy == 0.0 { 3e-3 } else { 1e-2 };
            assert!((mean - layer - color).abs() < bound, "{anisotropy}: {mean} +- {error}, {layer} {color}");
        }
    }
}

/// The share of light that leaves a unit ball of a medium after entering it diffusely, with its standard error.
fn escaping(scattering: f64, absorption: f64, g: f64) -> (f64, f64) {
    const WALKS: u32 = 400_000;
    let (mut rng, extinction) = (Rng::new(7), scattering + absorption);
    let deflected = |rng: &mut Rng, d: DVec3| loop {
        // By rejection.
        let to = rng.direction();
        if rng.unit() * hg(g, if g < 0.0 { -1.0 } else { 1.0 }) < hg(g, d.dot(to)) {
            break to;
        }
    };
    let mut left = 0u32;
    for _ in 0..WALKS {
        let (mut p, mut d) = (DVec3::Z, rng.cosine_around(-DVec3::Z));
        let leaves = loop {
            let (b, c) = (p.dot(d), p.length_squared() - 1.0);
            let to_surface = -b + (b * b - c).max(0.0).sqrt();
            let free = -(1.0 - rng.unit()).ln() / extinction;
            if free >= to_surface {
                break true;
            }
            if rng.unit() * extinction >= scattering {
                break false;
            }
            p += d * free;
            d = deflected(&mut rng, d);
        };
        left += u32::from(leaves);
    }
    let share = f64::from(left) / f64::from(WALKS);
    (share, (share * (1.0 - share) / f64::from(WALKS)).sqrt())
}

#[test]
fn a_ball_is_as_bright_as_a_walk_within_it() {
    let (colors, radii) = ([0.9, 0.6, 0.3], [0.5, 0.2, 0.35]);
    for g in [0.0, 0.5] {
        let wax = wax(&json!(colors), json!({ "subsurface_radius": radii, "subsurface_anisotropy": g }));
        let mut scene = furnace(&wax, ball());
        scene["sampler"]["spp"] = json!(512);
        let (image, layer) = (render(&scene), layer(&wax, &ball()));
        for channel in 0..3 {
            // Van de Hulst's formula, solved by bisection.
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..60 {
                let s = 0.5 * (low + high);
                let albedo = (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s);
                if albedo > colors[channel] { low = s } else { high = s }
            }
            let (absorption, reduced) = (low * low / radii[channel], (1.0 - low * low) / radii[channel]);
            let (expected, walk_error) = escaping(reduced / (1.0 - g), absorption, g);
            let estimate = Estimate::of(&image, channel);
            let error = estimate.error.hypot(walk_error);
            // Two-sided, 5.5 standard errors: a false alarm in 2e7.
            let off = estimate.mean - layer - expected;
            assert!(off.abs() < 5.5 * error, "g {g}, channel {channel}: {estimate:?} - {layer}, {expected}");
        }
    }
}

#[test]
fn what_is_within_the_surface_is_not_there() {
    let wax = wax(&json!([0.9, 0.7, 0.4]), json!({ "subsurface_radius": 0.3 }));
    let expected = Estimate::of(&render(&furnace(&wax, ball())), 0).mean;
    let mut shapes = ball();
    shapes.as_array_mut().unwrap().push(json!({ "type": "sphere", "radius": 0.9, "material": "mirror" }));
    let full = Estimate::of(&render(&furnace(&wax, shapes)), 0);
    assert!((full.mean - expected).abs() < 5.5 * full.error * 2f64.sqrt(), "{full:?} {expected}");
    // Balls that overlap are one body, through which light passes from one to the other.
    let white = self::wax(&json!(1), json!({ "subsurface_radius": 0.3 }));
    let two = json!([
        { "type": "sphere", "material": "wax" },
        { "type": "sphere", "material": "wax", "transform": [{ "translate": [0.5, 0, 0] }] }
    ]);
    let Estimate { mean, error } = Estimate::of(&render(&furnace(&white, two)), 0);
    assert!((mean - 1.0).abs() < 5.5 * error + 1e-3, "{mean} +- {error}");
}

#[test]
fn open_surfaces_lose_light() {
    let sheet = json!([{
        "type": "quad", "material": "wax", "origin": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0]
    }]);
    for radius in [0.01, 0.5, 100.0] {
        let white = wax(&json!(1), json!({ "subsurface_radius": radius }));
        let mut scene = furnace(&white, sheet.clone());
        scene["sampler"]["spp"] = json!(8);
        let image = render(&scene);
        let mean = Estimate::of(&image, 0).mean;
        assert!(pixels(&image).flatten().all(f32::is_finite) && (0.0..1.0).contains(&mean), "{radius}: {mean}");
    }
}

/// Bodies of wax and others under lamps.
fn still_life(spp: u32) -> Value {
    json!({
        "film": { "width": 48, "height": 48 },
        "camera": { "position": [0, 4, 5], "look_at": [0, 0.3, 0], "vertical_fov_degrees": 40 },
        "sampler": { "spp": spp },
        "integrator": { "type": "path", "max_depth": 12 },
        "media": { "haze": { "scattering": 0.02 } },
        "textures": { "tiles": { "type": "checker", "color0": [0.9, 0.4, 0.3], "color1": [0.4, 0.7, 0.9] } },
        "materials": {
            "grey": { "type": "diffuse", "albedo": 0.5 },
            "skin": {
                "type": "principled", "base_color": { "texture": "tiles" }, "subsurface": 0.8, "roughness": 0.4,
                "subsurface_method": "random_walk", "subsurface_radius": [0.3, 0.1, 0.05], "clearcoat": 0.5
            },
            "painted": { "type": "mix", "materials": ["skin", "grey"], "amount": 0.3 }
        },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-20, 0, 20], "edge_u": [40, 0, 0], "edge_v": [0, 0, -40] },
            { "type": "sphere", "material": "skin", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            {
                "type": "cube", "material": "painted", "emission": { "radiance": 0.1 },
                "transform": [{ "scale": 0.3 }, { "translate": [0.7, 0.4, -0.3] }]
            },
            { "type": "disk", "emission": { "radiance": [9, 8, 7], "group": "key" },
              "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }] }
        ],
        "lights": [{ "type": "point", "position": [2, 3, 1], "intensity": [3, 2, 1], "group": "fill" }]
    })
}

fn full(scene: &Value, threads: u32) -> Image {
    let mut prepared = prepare(scene, &Overrides { threads: Some(threads as usize), ..Overrides::default() });
    prepared.settings.layers = LayerSet::FULL;
    let result = render_with(&prepared, AccelKind::EMBREE);
    assert_eq!(result.stats.nan_samples, 0);
    result.image
}

#[test]
fn any_number_of_threads_gives_the_same_walks_and_parts_sum_to_the_picture() {
    for change in [
        json!({}),
        json!({ "medium": "haze" }),
        json!({ "integrator": { "clamp": 0.5 } }),
        json!({ "integrator": { "guiding": true } }),
        json!({ "integrator": { "strategy": "bsdf" } }),
    ] {
        let mut scene = still_life(8);
        merge(&mut scene, change.clone());
        let image = full(&scene, 1);
        let learns = change["integrator"]["guiding"] == json!(true);
        assert!(learns || image == full(&scene, 3), "{change}");
        assert_sums(&image, &change.to_string());
    }
    // All of it is diffuse light.
    let mut scene = still_life(4);
    scene["shapes"] = json!([scene["shapes"][1]]);
    let image = full(&scene, 2);
    let lit = |kind: LayerKind| image.layer(kind).unwrap().data.iter().any(|&x| x > 0.0);
    assert!(lit(LayerKind::DiffuseIndirect) && !lit(LayerKind::TransmissionIndirect));
}

fn runs(change: &Value, kind: AccelKind) -> Vec<Vec<f64>> {
    let run = |seed: u64| {
        let mut scene = still_life(6);
        merge(&mut scene, change.clone());
        scene["sampler"]["seed"] = json!(seed);
        let prepared = prepare(&scene, &Overrides { threads: Some(2), ..Overrides::default() });
        block_means(&render_with(&prepared, kind).image)
    };
    (0..8).map(run).collect()
}

#[test]
fn every_accelerator_and_strategy_gives_the_same_walks() {
    let embree = runs(&json!({}), AccelKind::EMBREE);
    for &(kind, _) in AccelKind::ALL.iter().filter(|(kind, _)| *kind != AccelKind::EMBREE) {
        assert_blocks_agree(&runs(&json!({}), kind), &embree, &format!("{kind:?}"));
    }
    let without_point = |strategy: &str| json!({ "lights": [], "integrator": { "strategy": strategy } });
    let mis = runs(&without_point("mis"), AccelKind::EMBREE);
    assert_blocks_agree(&runs(&without_point("light"), AccelKind::EMBREE), &mis, "light sampling alone");
    assert_blocks_agree(&runs(&json!({ "integrator": { "guiding": true } }), AccelKind::EMBREE), &embree, "guiding");
}

#[test]
fn whitted_has_the_flat_lobe() {
    let picture = |method: &str| {
        let mut scene = still_life(2);
        scene["integrator"] = json!({ "type": "whitted", "ambient": 0.1 });
        let skin = &mut scene["materials"]["skin"];
        skin["subsurface_method"] = json!(method);
        if method == "flat" {
            skin.as_object_mut().unwrap().remove("subsurface_radius");
        }
        render(&scene)
    };
    assert!(picture("flat") == picture("random_walk"));
}

#[test]
fn walks_that_make_no_sense() {
    let place = "materials.glass";
    let with = |rest: Value| wax(&json!(0.5), rest);
    assert_faults(&[
        (place, with(json!({ "subsurface_radius": 0 })), "materials.glass.subsurface_radius", "not 0"),
        (place, with(json!({ "subsurface_radius": [1, -1, 1] })), "materials.glass.subsurface_radius", "-1"),
        (place, with(json!({ "subsurface_scale": 0 })), "materials.glass.subsurface_scale", "not 0"),
        (place, with(json!({ "subsurface_anisotropy": 1 })), "materials.glass.subsurface_anisotropy", "0.9"),
        (place, with(json!({ "thin": true })), "materials.glass.subsurface_method", "no inside"),
        (place, with(json!({ "model": "mitsuba" })), "materials.glass.subsurface_method", "mitsuba"),
        (
            place,
            json!({ "type": "principled", "subsurface_radius": 1 }),
            "materials.glass.subsurface_radius",
            "random_walk",
        ),
    ]);
    let folder = Folder::new();
    let mut scene = good_scene();
    set(&mut scene, "materials.glass", with(json!({})));
    folder.compile(&scene).unwrap();
    set(&mut scene, "materials.mixed", json!({ "type": "coated", "base": "glass" }));
    assert_error(&folder, &scene, ErrorKind::Scene, &["materials.mixed.base: ", "`clearcoat`"]);
    let mut scene = good_scene();
    set(&mut scene, "materials.glass", with(json!({})));
    set(&mut scene, "integrator", json!({ "type": "path", "caustics": "photons" }));
    assert_error(&folder, &scene, ErrorKind::Scene, &["integrator.caustics: ", "below surfaces"]);
}
