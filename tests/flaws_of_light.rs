//! Known flaws of renderers in lights and light transport. Each test fails on the formula that its name blames.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::util::folder::Folder;
use crate::util::render::{AssertIs, Estimate, assert_irradiance, floor_probe, pixels, probe, render};

fn sphere(center: [f64; 3], radius: f64) -> Value {
    json!({
        "type": "sphere", "radius": radius, "material": "black", "emission": { "radiance": [1, 1, 1] },
        "transform": [{ "translate": center }]
    })
}

/// Irradiance on the floor by sampling lights alone, which has no noise from point-like lights.
#[track_caller]
fn assert_exact(scene: &Value, expected: f64, what: &str) {
    Estimate::of(&render(scene), 0).assert_is(expected / PI, what);
}

fn with_lights(mut scene: Value, lights: Value) -> Value {
    scene["lights"] = lights;
    scene
}

#[test]
fn light_found_by_sampling_it_is_not_added_again_where_a_path_meets_it() {
    // pi (R / d)² = pi / 16 above the floor; emission added at every hit doubles it.
    assert_irradiance(&floor_probe([0.0; 3], json!([sphere([0.0, 2.0, 0.0], 0.5)])), PI / 16.0, "sphere overhead");
}

#[test]
fn a_point_inside_a_sphere_light_is_lit_without_nan() {
    // No cone holds a sphere seen from inside: its formula has the root of a negative number there.
    let mut around = sphere([0.0, 0.3, 0.0], 3.0);
    around["emission"]["two_sided"] = json!(true);
    assert_irradiance(&floor_probe([0.0; 3], json!([around])), PI, "inside");
}

#[test]
fn the_solid_angle_of_a_far_sphere_does_not_cancel_to_zero() {
    // 1 - cos of 1e-5 is 0 in single precision; the irradiance pi L (R / d)² is not.
    let mut far = sphere([0.0, 2e5, 0.0], 2.0);
    far["emission"]["radiance"] = json!([1e10, 1e10, 1e10]);
    let mut scene = floor_probe([0.0; 3], json!([far]));
    scene["integrator"]["strategy"] = json!("light");
    assert_exact(&scene, PI, "far sphere");
}

#[test]
fn directional_light_is_shadowed_and_given_as_irradiance() {
    let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [2, 2, 2] }]);
    assert_exact(&with_lights(floor_probe([0.0; 3], json!([])), sun.clone()), 2.0, "open");
    let roof = json!([{
        "type": "disk", "radius": 0.3, "material": "black",
        "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }]
    }]);
    let shadowed = render(&with_lights(floor_probe([0.0; 3], roof), sun));
    assert!(pixels(&shadowed).all(|p| p == [0.0; 3]));
}

#[test]
fn a_point_light_falls_with_the_square_of_distance() {
    for d in [0.5, 2.0, 300.0] {
        let intensity = 3.0 * d * d;
        let light = json!([{ "type": "point", "position": [0, d, 0], "intensity": [intensity, intensity, intensity] }]);
        assert_exact(&with_lights(floor_probe([0.0; 3], json!([])), light), 3.0, &format!("at {d}"));
    }
}

#[test]
fn no_light_is_found_by_a_tolerance_that_depends_on_the_scale() {
    // The same room a thousand times smaller and larger: a light that counts as reached within 0.1 units is everywhere
    // or nowhere.
    for scale in [1e-3, 1.0, 1e3] {
        let mut lamp = sphere([0.0, 2.0 * scale, 0.0], 0.5 * scale);
        lamp["name"] = json!("without any geometry beside it");
        let blocker = json!({ "type": "disk", "radius": 0.02 * scale, "material": "black",
            "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 0.4 * scale, 0] }] });
        let mut scene = floor_probe([0.0; 3], json!([lamp]));
        for key in ["position", "look_at"] {
            let scaled = scene["camera"][key]
                .as_array()
                .unwrap()
                .iter()
                .map(|x| x.as_f64().unwrap() * scale)
                .collect::<Vec<_>>();
            scene["camera"][key] = json!(scaled);
        }
        assert_irradiance(&scene, PI / 16.0, &format!("scale {scale}"));
        // The blocker hides the middle of the lamp: (0.02 / 0.4)² of the hemisphere's projected disk.
        scene["shapes"].as_array_mut().unwrap().push(blocker);
        assert_irradiance(&scene, PI / 16.0 - PI * 0.0025 / 1.0025, &format!("blocked, scale {scale}"));
    }
}

#[test]
fn lights_shine_in_mirrors_and_through_glass() {
    let lamp = json!({
        "type": "quad", "material": "black", "emission": { "radiance": [3, 2, 1] }, "origin": [-5, -5, 9],
        "edge_u": [10, 0, 0], "edge_v": [0, 10, 0], "reverse_normal": true
    });
    for (material, factor) in [
        (json!({ "type": "mirror", "reflectance": 0.5 }), 0.5),
        (json!({ "type": "conductor", "metal": "silver", "tint": [0, 0, 0] }), 0.0),
    ] {
        let scene = probe(
            [0.0, 0.0, 3.0],
            [0.0; 3],
            json!({
                "sampler": { "spp": 16 }, "integrator": { "type": "path", "max_depth": 3 },
                "materials": { "m": material, "black": { "type": "diffuse", "albedo": 0 } },
                "shapes": [{ "type": "quad", "material": "m" }, lamp]
            }),
        );
        assert!(
            pixels(&render(&scene)).all(|p| (p[0] - 3.0 * factor).abs() < 1e-5 && (p[2] - factor).abs() < 1e-5),
            "{factor}"
        );
    }
}

#[test]
fn a_light_below_the_surface_or_turned_away_gives_nothing() {
    // The product of two negative cosines is positive.
    let below = json!({
        "type": "quad", "material": "black", "emission": { "radiance": [1, 1, 1] }, "origin": [-1, -2, 1],
        "edge_u": [2, 0, 0], "edge_v": [0, 0, -2], "reverse_normal": true
    });
    let away = json!({
        "type": "quad", "material": "black", "emission": { "radiance": [1, 1, 1] }, "origin": [-1, 2, 1],
        "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]
    });
    for lamp in [below, away] {
        for strategy in ["mis", "light", "bsdf"] {
            let mut scene = floor_probe([0.0; 3], json!([lamp]));
            scene["sampler"]["spp"] = json!(16);
            scene["integrator"]["strategy"] = json!(strategy);
            assert!(pixels(&render(&scene)).all(|p| p == [0.0; 3]), "{strategy}: {lamp}");
        }
    }
}

#[test]
fn a_light_across_the_horizon_is_cut_there_and_never_negative() {
    // A wall from 1 below to 1 above the floor's plane at distance 2: only the upper half gives light (Lambert's
    // polygon, clipped).
    let wall = json!({
        "type": "quad", "material": "black", "emission": { "radiance": [1, 1, 1] }, "origin": [2, -1, -1.5],
        "edge_u": [0, 0, 3], "edge_v": [0, 2, 0]
    });
    let mut scene = floor_probe([0.0; 3], json!([wall]));
    // Without the floor in front of the wall nothing else would cut it.
    scene["shapes"][0] = json!({
        "type": "disk", "radius": 0.05, "material": "white",
        "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }]
    });
    let strip = |height: f64| (1.5 / (4.0f64 + height * height).sqrt()).atan() / (4.0 + height * height).sqrt() * 2.0;
    // Irradiance of a vertical strip seen along its normal: E = (atan(w/d) - d / sqrt(d² + h²) atan(w / sqrt(d² + h²)))
    // for half-width w.
    let expected = (1.5f64 / 2.0).atan() - strip(1.0);
    assert_irradiance(&scene, expected, "wall");
    assert!(pixels(&render(&scene)).all(|p| p[0] >= 0.0));
}

#[test]
fn each_area_light_has_an_area_of_its_own() {
    // A small and a large quad at once: one that is sampled with the other's area is wrong by their ratio.
    let quad = |half: f64, x: f64| {
        json!({
            "type": "quad", "material": "black", "emission": { "radiance": [1, 1, 1] }, "origin": [x - half, 1, -half],
            "edge_u": [2.0 * half, 0, 0], "edge_v": [0, 0, 2.0 * half]
        })
    };
    // Above the corner of a rectangle a x b at height 1: E = 1/2 (a/sqrt(1+a²) atan(b/sqrt(1+a²)) + b/sqrt(1+b²)
    // atan(a/sqrt(1+b²))).
    let corner = |a: f64, b: f64| {
        let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        0.5 * (a / ra * (b / ra).atan() + b / rb * (a / rb).atan())
    };
    let aside = |from: f64, to: f64, half: f64| 2.0 * (corner(to, half) - corner(from, half));
    let expected = aside(0.9, 1.1, 0.1) + aside(-1.5f64.abs(), -3.5f64.abs(), 1.0).abs();
    assert_irradiance(&floor_probe([0.0; 3], json!([quad(0.1, 1.0), quad(1.0, -2.5)])), expected, "both");
}

#[test]
fn environments_of_several_sizes_are_right_at_the_pole_and_across_the_seam() {
    // Rows at the pole where the sine is 0, a width shared between lights, and a seam that clamps: each is wrong by a
    // lot here.
    let folder = Folder::new();
    let write = |name: &str, size: [usize; 2], texel: &(dyn Fn(usize, usize) -> f32 + Sync)| {
        let path = folder.write(name, "");
        exr::prelude::write_rgb_file(&path, size[0], size[1], |x, y| [texel(x, y); 3].into()).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let top = |_: usize, y: usize| if y == 0 { 5.0 } else { 0.0 };
    let seam = |x: usize, y: usize| if y < 5 && (x == 0 || x == 15) { 2.0 } else { 0.1 };
    let maps = [(write("top.exr", [4, 6], &top), [4, 6]), (write("seam.exr", [16, 10], &seam), [16, 10])];

    // The integral of the bilinear lookup times the cosine, over the upper hemisphere, by brute force.
    let irradiance = |size: [usize; 2], texel: &dyn Fn(usize, usize) -> f32| {
        let n = 2000;
        let mut sum = 0.0;
        for j in 0..n / 2 {
            let theta = (f64::from(j) + 0.5) / f64::from(n) * PI;
            let mut row = 0.0;
            for i in 0..n {
                let (x, y) =
                    ((f64::from(i) + 0.5) / f64::from(n) * size[0] as f64 - 0.5, theta / PI * size[1] as f64 - 0.5);
                let (fx, fy) = (x - x.floor(), y - y.floor());
                let at = |dx: i64, dy: i64| {
                    let column = (x.floor() as i64 + dx).rem_euclid(size[0] as i64) as usize;
                    f64::from(texel(column, (y.floor() as i64 + dy).clamp(0, size[1] as i64 - 1) as usize))
                };
                row +=
                    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy;
            }
            sum += row * theta.sin() * theta.cos();
        }
        sum * (PI / f64::from(n)) * (2.0 * PI / f64::from(n))
    };
    let expected = irradiance(maps[0].1, &top) + irradiance(maps[1].1, &seam);
    let lights = json!([
        { "type": "environment", "file": maps[0].0 },
        { "type": "environment", "file": maps[1].0, "transform": [{ "rotate": { "axis": [0, 1, 0], "degrees": 77 } }] }
    ]);
    for strategy in ["mis", "light", "bsdf"] {
        let mut scene = with_lights(floor_probe([0.0; 3], json!([])), lights.clone());
        scene["integrator"]["strategy"] = json!(strategy);
        let estimate = Estimate::of(&render(&scene), 0);
        // The brute-force sum is good to 1e-5.
        assert!(
            (estimate.mean - expected / PI).abs() < 5.5 * estimate.error + 2e-5 * expected,
            "{strategy}: {estimate:?} {}",
            expected / PI
        );
    }
}

#[test]
fn environment_light_is_not_counted_by_sampling_and_by_chance() {
    // A convex grey ball under a constant sky has half its radiance; counted twice it vanishes in it.
    let ball = json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "sampler": { "type": "independent", "spp": 64 },
        "camera": { "position": [0, 0, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 10 },
        "integrator": { "type": "path" },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.5 } },
        "shapes": [{ "type": "sphere", "material": "grey" }],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    Estimate::of(&render(&ball), 1).assert_is(0.5, "ball");
}

#[test]
fn light_met_after_a_bounce_carries_the_paths_throughput() {
    // A lamp over a red floor, in the mirror of a blue-tinted wall: each colour once.
    let scene = probe(
        [0.0, 0.0, 3.0],
        [0.0; 3],
        json!({ "sampler": { "spp": 16 }, "integrator": { "type": "path", "max_depth": 8, "rr_depth": 1 },
            "materials": {
                "blue": { "type": "mirror", "reflectance": [0.2, 0.4, 0.8] },
                "red": { "type": "mirror", "reflectance": [0.5, 0.25, 0.125] },
                "black": { "type": "diffuse", "albedo": 0 }
            },
            "shapes": [
                {
                    "type": "quad", "material": "blue",
                    "transform": [{ "rotate": { "axis": [0, 1, 0], "degrees": 45 } }]
                },
                {
                    "type": "quad", "material": "red",
                    "transform": [
                        { "scale": 5 }, { "rotate": { "axis": [0, 1, 0], "degrees": -90 } }, { "translate": [4, 0, 0] }
                    ]
                },
                {
                    "type": "quad", "material": "black", "emission": { "radiance": [8, 8, 8] }, "origin": [-9, -9, 9],
                    "edge_u": [18, 0, 0], "edge_v": [0, 18, 0], "reverse_normal": true
                },
                {
                    "type": "quad", "material": "black", "emission": { "radiance": [8, 8, 8] }, "origin": [-9, -9, -9],
                    "edge_u": [18, 0, 0], "edge_v": [0, 18, 0]
                }
            ] }),
    );
    // Camera, blue (45 degrees), red (straight on), blue again, and back past the camera to the lamp behind it.
    let estimate = |c: usize| Estimate::of(&render(&scene), c);
    for (c, blue, red) in [(0, 0.2, 0.5), (1, 0.4, 0.25), (2, 0.8, 0.125)] {
        let found = estimate(c);
        let expected = 8.0 * blue * red * blue;
        assert!((found.mean - expected).abs() <= 5.5 * found.error + 1e-5, "{c}: {found:?} {expected}");
    }
}

#[test]
fn roulette_gives_the_survivors_the_weight_of_the_dead_on_every_material_and_from_its_own_depth_on() {
    // A factor that is forgotten on glossy surfaces, or applied before roulette has begun, changes the mean with the
    // depth.
    for material in [
        json!({ "type": "diffuse", "albedo": 0.5 }),
        json!({ "type": "conductor", "metal": "copper", "alpha": 0.4 }),
        json!({ "type": "plastic", "albedo": 0.4, "alpha": 0.2 }),
    ] {
        let mean = |rr_depth: u32| {
            let scene = json!({
                "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
                "camera": { "position": [0.1, 0.2, 0.3], "look_at": [0.4, 0.1, -0.5], "vertical_fov_degrees": 60.0 },
                "sampler": { "type": "independent", "spp": 128, "seed": rr_depth },
                "integrator": { "type": "path", "max_depth": 12, "rr_depth": rr_depth },
                "materials": { "m": material },
                "shapes": [{
                    "type": "sphere", "material": "m", "emission": { "radiance": [0.5, 0.5, 0.5], "two_sided": true }
                }]
            });
            Estimate::of(&render(&scene), 1)
        };
        let without = mean(100);
        for rr_depth in [1, 3, 5] {
            let with = mean(rr_depth);
            let error = with.error.hypot(without.error);
            assert!(
                (with.mean - without.mean).abs() < 5.5 * error,
                "{material}, from {rr_depth}: {with:?} {without:?}"
            );
        }
    }
}
