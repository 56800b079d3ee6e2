//! Caustics by photons: the same picture as paths find by chance, with less noise, and the same bits however a render
//! is split.

use serde_json::{Value, json};
use steradian::Error;
use steradian::desc::{AutoDesc, CausticsDesc};
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::render::{self, Overrides};

use crate::checkpoints::assert_resumed_split_and_replayed;
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

/// A floor and a wall beside these shapes, lit by a lamp so large that paths meet it.
fn scene_of(shapes: &Value, materials: &Value) -> Value {
    let mut scene = json!({
        "camera": { "position": [0, 1.6, 4], "look_at": [0, 0.4, 0], "vertical_fov_degrees": 40 },
        "film": { "width": 72, "height": 72, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 8 },
        "materials": { "white": { "type": "diffuse", "albedo": 0.6 } },
        "shapes": [
            { "type": "quad", "material": "white", "origin": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] },
            { "type": "quad", "material": "white", "origin": [-3, 0, -2], "edge_u": [6, 0, 0], "edge_v": [0, 3, 0] },
            { "type": "quad", "material": "white", "origin": [-1, 2.5, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2],
              "emission": { "radiance": [6, 5, 4] } }
        ]
    });
    scene["shapes"].as_array_mut().unwrap().extend(shapes.as_array().unwrap().iter().cloned());
    scene["materials"].as_object_mut().unwrap().extend(materials.as_object().unwrap().clone());
    scene
}

/// Glass, a mirror, and a rough metal.
fn balls() -> Value {
    scene_of(
        &json!([
            { "type": "sphere", "material": "glass", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0.3] }] },
            { "type": "sphere", "material": "mirror", "radius": 0.4, "transform": [{ "translate": [0.7, 0.4, 0.2] }] },
            { "type": "cube", "material": "gold", "transform": [{ "scale": 0.3 }, { "translate": [0.1, 0.3, 0.9] }] }
        ]),
        &json!({
            "glass": { "type": "dielectric" }, "mirror": { "type": "mirror" },
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.5 }
        }),
    )
}

/// A coat whose mirror is one of several lobes, a pane, and glass with smooth normals on coarse facets.
fn coats() -> Value {
    let corner = |x: f64, z: f64| json!([x, 0.45 - 0.5 * (x * x + z * z), z]);
    let at = |i: u32, j: u32| corner(0.4 * f64::from(i) - 0.6, 0.4 * f64::from(j) - 0.6);
    let vertices: Vec<Value> = (0..16).map(|k| at(k % 4, k / 4)).collect();
    let cells = (0..9).map(|k| k / 3 * 4 + k % 3);
    let indices: Vec<[u32; 3]> = cells.flat_map(|a| [[a, a + 4, a + 1], [a + 1, a + 4, a + 5]]).collect();
    scene_of(
        &json!([
            { "type": "mesh", "material": "glass", "positions": vertices, "triangles": indices, "shading": "smooth" },
            { "type": "quad", "material": "pane", "origin": [0.8, 0, 1], "edge_u": [0, 0, -2],
              "edge_v": [0.3, 1.2, 0] },
            { "type": "sphere", "material": "coat", "radius": 0.4, "transform": [{ "translate": [-1.3, 0.4, 0] }] }
        ]),
        &json!({
            "glass": { "type": "dielectric", "ior": 1.3 }, "pane": { "type": "thin_dielectric" },
            "coat": { "type": "plastic", "albedo": [0.7, 0.2, 0.1] }
        }),
    )
}

/// Rough metal and rough glass, beside a mirror or lit by a sun and a point light as well: photons of these would also
/// show what the mirror throws.
fn rough_casters(has_mirror: bool) -> Value {
    let mut scene = scene_of(
        &json!([
            { "type": "quad", "material": "gold", "origin": [-1.2, 0.1, -0.6], "edge_u": [1.6, 0, 0.3],
              "edge_v": [0, 1, -0.2] },
            { "type": "sphere", "material": "frosted", "radius": 0.45, "transform": [{ "translate": [0.9, 0.6, 0.2] }] }
        ]),
        &json!({
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.35 },
            "frosted": { "type": "dielectric", "roughness": 0.4 }, "mirror": { "type": "mirror" }
        }),
    );
    if has_mirror {
        scene["shapes"].as_array_mut().unwrap().push(json!(
            { "type": "quad", "material": "mirror", "origin": [-1.9, 0.1, -1], "edge_u": [0, 0, 1.5],
              "edge_v": [0, 0.8, 0] }
        ));
    } else {
        scene["lights"] = json!([
            { "type": "directional", "direction": [-0.2, -1, -0.8], "irradiance": [1, 0.8, 0.6] },
            { "type": "point", "position": [0.2, 1.9, 1], "intensity": [1, 1.5, 2] }
        ]);
    }
    scene
}

fn of(scene: &Value, caustics: CausticsDesc, overrides: &Overrides) -> Image {
    let overrides = Overrides { caustics: Some(caustics), ..overrides.clone() };
    render_with(&prepare(scene, &overrides), AccelKind::EMBREE).image
}

fn of_seed(scene: &Value, caustics: CausticsDesc, seed: u64, spp: u32) -> Image {
    of(scene, caustics, &Overrides { seed: Some(seed), spp: Some(spp), ..Overrides::default() })
}

/// By Welch's test on blocks of pixels: wrong densities of either technique would be seen where both find the light.
#[test]
fn photons_and_paths_have_the_same_mean() {
    let scenes = [
        ("balls", balls()),
        ("coats", coats()),
        ("rough casters and a mirror", rough_casters(true)),
        ("rough casters under delta lights", rough_casters(false)),
    ];
    for (what, scene) in scenes {
        let blocks = |caustics, first: u64| -> Vec<Vec<f64>> {
            (first..first + 8).map(|seed| block_means(&of_seed(&scene, caustics, seed, 64))).collect()
        };
        assert_blocks_agree(&blocks(CausticsDesc::Photons, 0), &blocks(CausticsDesc::Paths, 100), what);
    }
}

/// The balls, lit by a lamp so small that paths hardly meet it.
fn small_lamp() -> Value {
    let mut scene = balls();
    scene["shapes"][2] = json!({
        "type": "sphere", "material": "white", "radius": 0.2, "transform": [{ "translate": [0, 2.5, 0] }],
        "emission": { "radiance": [60, 50, 45] }
    });
    scene
}

/// Two renders differ by twice the variance of one.
#[test]
fn photons_lower_the_error_of_a_small_lamp_behind_glass() {
    let mut scene = small_lamp();
    scene["integrator"]["roulette"] = json!("throughput");
    let difference = |caustics| {
        let [a, b] = [1, 2].map(|seed| of_seed(&scene, caustics, seed, 32));
        let (a, b) = (a.layer(LayerKind::Color).unwrap(), b.layer(LayerKind::Color).unwrap());
        a.data.iter().zip(&b.data).map(|(a, b)| f64::from(a - b).powi(2) / (f64::from(*b).powi(2) + 0.01)).sum::<f64>()
    };
    let (photons, paths) = (difference(CausticsDesc::Photons), difference(CausticsDesc::Paths));
    assert!(photons < 0.2 * paths, "{photons} {paths}");
}

/// A floor seen from above, beside a mirror that shows it a second lamp: the irradiance of both is known.
fn lamp_beside_a_mirror(lamp: &Value) -> Value {
    let mut scene = json!({
        "camera": {
            "type": "orthographic", "position": [2.5, 2, 0], "look_at": [2.5, 0, 0], "up": [0, 0, 1], "view_height": 2.4
        },
        "film": { "width": 32, "height": 32, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 3 },
        "materials": { "white": { "type": "diffuse", "albedo": 0.5 }, "mirror": { "type": "mirror" } },
        "shapes": [
            { "type": "quad", "material": "white", "origin": [0, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] },
            { "type": "quad", "material": "mirror", "origin": [0, 0, -3], "edge_u": [0, 0, 6], "edge_v": [0, 1, 0] }
        ]
    });
    let place = if lamp["type"] == "sphere" { "shapes" } else { "lights" };
    scene.as_object_mut().unwrap().entry(place).or_insert(json!([])).as_array_mut().unwrap().push(lamp.clone());
    scene
}

/// The height above the floor and the slope along z of what is seen at this x and z, if anything.
type Surface = fn(f64, f64) -> Option<[f64; 2]>;

/// Mean radiance of the picture where such a surface is seen, by a lamp of intensity 1 at this x, 1 above the floor.
fn radiance_of(lamp: f64, surface: Surface) -> f64 {
    let at = |i: i32| (f64::from(i) + 0.5) / 600.0 * 2.4 - 1.2;
    let points = (0..600).flat_map(|i| (0..600).map(move |j| (at(i) + 2.5, at(j))));
    let irradiance = points.filter_map(|(x, z)| {
        let [y, slope] = surface(x, z)?;
        let (above, distance) = (1.0 - y, ((x - lamp).powi(2) + (1.0 - y).powi(2) + z * z).sqrt());
        Some((above + slope * z).max(0.0) / (slope.hypot(1.0) * distance.powi(3)))
    });
    0.5 / std::f64::consts::PI * irradiance.sum::<f64>() / 360_000.0
}

fn floor_if(is_seen: bool) -> Option<[f64; 2]> {
    is_seen.then_some([0.0, 0.0])
}

/// The same of the whole floor.
fn floor_radiance(lamp: f64) -> f64 {
    radiance_of(lamp, |_, _| Some([0.0, 0.0]))
}

/// The mean of the red channel of a picture of that floor.
fn mean_red(scene: &Value, caustics: CausticsDesc, overrides: &Overrides) -> f64 {
    let image = of(scene, caustics, overrides);
    let red = |i: u32| f64::from(image.pixel(LayerKind::Color, i % 32, i / 32).unwrap()[0]);
    (0..32 * 32).map(red).sum::<f64>() / (32.0 * 32.0)
}

fn with_samples(spp: u32) -> Overrides {
    Overrides { spp: Some(spp), ..Overrides::default() }
}

/// Paths never meet a point light. A sphere of the same intensity has the same irradiance.
#[test]
fn photons_find_what_a_mirror_shows_of_a_lamp() {
    let point = json!({ "type": "point", "position": [1, 1, 0], "intensity": [1, 1, 1] });
    let radiance = 100.0 / std::f64::consts::PI;
    let sphere = json!({
        "type": "sphere", "material": "white", "radius": 0.1, "transform": [{ "translate": [1, 1, 0] }],
        "emission": { "radiance": [radiance, radiance, radiance] }
    });
    let (direct, mirrored) = (floor_radiance(1.0), floor_radiance(-1.0));
    for lamp in [&point, &sphere] {
        let mut scene = lamp_beside_a_mirror(lamp);
        let found = (mean_red(&scene, CausticsDesc::Photons, &with_samples(512)) - direct) / mirrored;
        // Eight standard errors of the sphere (0.0023 over 20 seeds); the blur of the point's photons is 0.0008.
        assert!((found - 1.0).abs() < 0.02, "{lamp}: {found}");
        // Paths of two segments are too short for the mirror.
        scene["integrator"]["max_depth"] = json!(2);
        let found = mean_red(&scene, CausticsDesc::Photons, &with_samples(64)) / direct;
        assert!((found - 1.0).abs() < 0.005, "{lamp}: {found}");
    }
    let without = mean_red(&lamp_beside_a_mirror(&point), CausticsDesc::Paths, &with_samples(64)) / direct;
    assert!((without - 1.0).abs() < 0.005, "{without}");
}

#[test]
fn pictures_with_photons_do_not_depend_on_threads_or_accelerators() {
    let image = |threads, kind| {
        let overrides = Overrides {
            threads: Some(threads),
            caustics: Some(CausticsDesc::Photons),
            spp: Some(12),
            ..Overrides::default()
        };
        render_with(&prepare(&balls(), &overrides), kind).image
    };
    let first = image(1, AccelKind::EMBREE);
    assert!([2, 3].into_iter().all(|threads| image(threads, AccelKind::EMBREE) == first));
    assert_ne!(first, of_seed(&balls(), CausticsDesc::Paths, 0, 12));
}

/// The width of a fold, seen from above.
const FOLD: f64 = 0.05;
/// Its height over its width.
const SLOPE: f64 = 0.3;

/// Photons are gathered within 0.15: a floor of narrower strips, one between blocks that stand on it, one with a
/// partition that is thinner, and one in folds, whose area is larger. The lamp and what the mirror shows of it are in
/// the plane of the partition and above the middle between the blocks. Without photons paths never find the latter.
#[test]
fn what_photons_carry_to_narrow_and_curved_surfaces_is_kept() {
    let point = json!({ "type": "point", "position": [1, 1, 0], "intensity": [1, 1, 1] });
    let strip = |from: f64, width: f64| {
        json!({ "type": "quad", "material": "white", "origin": [from, 0, 3], "edge_u": [width, 0, 0],
                "edge_v": [0, 0, -6] })
    };
    let block = |half_width: f64, z: f64| {
        let transform = json!([{ "scale": [1.5, 0.1, half_width] }, { "translate": [2.5, 0.1, z] }]);
        json!({ "type": "cube", "material": "black", "transform": transform })
    };
    let slats = (0..12).map(|i| f64::from(i) * 0.2 + 1.36);
    let floor = strip(0.0, 6.0);
    let fold = |i: i32| {
        let rise = if i % 2 == 0 { SLOPE * FOLD } else { -SLOPE * FOLD };
        json!({ "type": "quad", "material": "white", "origin": [0, (-rise).max(0.0), f64::from(i + 1) * FOLD],
                "edge_u": [6, 0, 0], "edge_v": [0, rise, -FOLD] })
    };
    let on_fold = |_, z: f64| {
        let along = (z / FOLD).rem_euclid(2.0) - 1.0;
        Some([SLOPE * FOLD * along.abs(), SLOPE * along.signum()])
    };
    let cases: [(&str, Vec<Value>, Surface); 4] = [
        ("slats", slats.map(|from| strip(from, 0.06)).collect(), |x, _| floor_if(x > 1.36 && (x - 1.36) % 0.2 < 0.06)),
        ("blocks", vec![floor.clone(), block(1.0, 1.1), block(1.0, -1.1)], |_, z| floor_if(z.abs() < 0.1)),
        ("partition", vec![floor, block(1e-3, 0.0)], |_, _| floor_if(true)),
        ("folds", (-30..30).map(fold).collect(), on_fold),
    ];
    for (what, shapes, surface) in cases {
        let mut scene = lamp_beside_a_mirror(&point);
        scene["materials"]["black"] = json!({ "type": "diffuse", "albedo": 0 });
        let mirror = scene["shapes"][1].clone();
        scene["shapes"] = json!([mirror]);
        scene["shapes"].as_array_mut().unwrap().extend(shapes);
        let mean = |caustics| mean_red(&scene, caustics, &with_samples(512));
        let found = (mean(CausticsDesc::Photons) - mean(CausticsDesc::Paths)) / radiance_of(-1.0, surface);
        // Five standard errors: some 32,000 photons arrive between the blocks.
        assert!((found - 1.0).abs() < 0.03, "{what}: {found}");
    }
}

/// The balls within a sphere that emits as much as its wall absorbs, where paths have no noise.
fn furnace() -> Value {
    let mut scene = balls();
    scene["materials"]["white"]["albedo"] = json!(0.5);
    scene["shapes"] = json!([
        { "type": "sphere", "material": "mirror", "radius": 0.5 },
        { "type": "sphere", "radius": 5, "material": "white",
          "emission": { "radiance": [0.5, 0.5, 0.5], "two_sided": true } }
    ]);
    scene["integrator"] = json!({ "type": "path", "max_depth": 3, "rr_depth": 100 });
    scene
}

#[test]
fn a_pilot_decides_where_photons_are_worth_their_time() {
    let mut clamped = small_lamp();
    clamped["integrator"]["clamp"] = json!(10);
    let (auto, off) = (AutoDesc::Auto, AutoDesc::Off);
    for (scene, bidirectional, is_worth_it) in
        [(small_lamp(), auto, true), (balls(), off, true), (furnace(), off, false), (clamped, off, false)]
    {
        let of_choice = |caustics, spp| {
            let bidirectional = Some(bidirectional);
            of(&scene, caustics, &Overrides { bidirectional, spp: Some(spp), ..Overrides::default() })
        };
        let [auto, photons, paths] =
            [CausticsDesc::Auto, CausticsDesc::Photons, CausticsDesc::Paths].map(|choice| of_choice(choice, 16));
        assert!(photons != paths);
        assert!(auto == if is_worth_it { photons } else { paths }, "{is_worth_it}");
        // So few samples are not worth a pilot.
        assert!(of_choice(CausticsDesc::Auto, 15) == of_choice(CausticsDesc::Paths, 15));
    }
}

/// What a pilot decides does not change what the picture shows: of lights that paths never meet, no caustics.
#[test]
fn a_pilot_adds_no_caustics_of_point_lights() {
    let sphere = json!({
        "type": "sphere", "material": "white", "radius": 0.02, "transform": [{ "translate": [1, 1, 0] }],
        "emission": { "radiance": [2500, 2500, 2500] }
    });
    let red = |caustics, lights: Value| {
        let mut scene = lamp_beside_a_mirror(&sphere);
        scene["lights"] = lights;
        let overrides = Overrides { spp: Some(64), bidirectional: Some(AutoDesc::Off), ..Overrides::default() };
        mean_red(&scene, caustics, &overrides)
    };
    let point = || json!([{ "type": "point", "position": [1.5, 1, 0], "intensity": [3, 3, 3] }]);
    let lamp = red(CausticsDesc::Photons, json!([]));
    assert_eq!(red(CausticsDesc::Auto, json!([])), lamp);
    let [direct, mirrored] = [1.5, -1.5].map(|x| 3.0 * floor_radiance(x));
    let (auto, photons) = (red(CausticsDesc::Auto, point()), red(CausticsDesc::Photons, point()));
    let (added, caustic) = ((auto - lamp) / direct, (photons - auto) / mirrored);
    assert!((added - 1.0).abs() < 0.01 && (caustic - 1.0).abs() < 0.1, "{added} {caustic}");
}

/// Without mirrors and glass there are no photons.
#[test]
fn scenes_without_mirrors_and_glass_stay_what_they_are() {
    let scene = scene_of(&json!([]), &json!({}));
    assert_eq!(of_seed(&scene, CausticsDesc::Photons, 0, 8), of_seed(&scene, CausticsDesc::Paths, 0, 8));
}

#[test]
fn renders_with_photons_are_resumed_split_and_replayed() {
    let overrides =
        Overrides { caustics: Some(CausticsDesc::Photons), spp: Some(21), threads: Some(2), ..Overrides::default() };
    assert_resumed_split_and_replayed(&balls(), &overrides);
}

#[test]
fn renders_are_resumed_split_and_replayed_after_a_pilot() {
    let overrides = Overrides { spp: Some(21), threads: Some(2), ..Overrides::default() };
    assert_resumed_split_and_replayed(&small_lamp(), &overrides);
}

#[test]
fn what_photons_cannot_do_is_refused() {
    let refusal = |scene: &Value, overrides: &Overrides| {
        let desc = serde_json::from_value(scene.clone()).unwrap();
        match render::Settings::new(&desc, overrides) {
            Err(Error::Setting { message, .. }) => message,
            other => panic!("{other:?}"),
        }
    };
    let on = Overrides { caustics: Some(CausticsDesc::Photons), ..Overrides::default() };
    for (overrides, option) in [
        (Overrides { target_error: Some(0.01), ..on.clone() }, "`target_error`"),
        (Overrides { guiding: Some(AutoDesc::On), ..on.clone() }, "`guiding`"),
        (Overrides { regularize: Some(0.1), ..on.clone() }, "`regularize`"),
    ] {
        let desc = serde_json::from_value(balls()).unwrap();
        let auto = Overrides { caustics: Some(CausticsDesc::Auto), ..overrides.clone() };
        assert!(render::Settings::new(&desc, &auto).is_ok(), "{option}");
        let message = refusal(&balls(), &overrides);
        assert!(message.starts_with("`caustics` photons") && message.contains(option), "{message}");
    }
    let mut normals = balls();
    normals["integrator"] = json!({ "type": "normal" });
    assert!(refusal(&normals, &on).starts_with("`caustics`"));
}
