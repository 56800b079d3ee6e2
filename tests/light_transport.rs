//! Integrators against closed forms: furnaces, the depth law, irradiance of disk, polygon and sphere lights, a glass slab; and the three
//! strategies against each other.

use serde_json::{Value, json};

use crate::util::render::{Estimate, assert_blocks_agree, assert_irradiance, block_means, floor_probe, merge, pixels, probe, render};

/// Inside a closed sphere of albedo 1/2 that emits 1/2: radiance 1/2 + 1/4 + 1/8 + ... = 1.
fn furnace(max_depth: u32, rr_depth: u32) -> Value {
    json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": { "position": [0.1, 0.2, 0.3], "look_at": [0.4, 0.1, -0.5], "vertical_fov_degrees": 60.0 },
        "sampler": { "type": "independent", "spp": 256 },
        "integrator": { "type": "path", "max_depth": max_depth, "rr_depth": rr_depth },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.5 } },
        "shapes": [{ "type": "sphere", "material": "grey", "emission": { "radiance": [0.5, 0.5, 0.5], "two_sided": true } }]
    })
}

#[test]
fn a_furnace_of_albedo_one_half_shines_with_radiance_one() {
    for strategy in ["mis", "light", "bsdf"] {
        for rr_depth in [1, 5, 100] {
            let mut scene = furnace(64, rr_depth);
            scene["integrator"]["strategy"] = json!(strategy);
            Estimate::of(&render(&scene), 1).assert_is(1.0, &format!("{strategy}, roulette from {rr_depth}"));
        }
    }
}

#[test]
fn each_bounce_adds_half_of_the_one_before() {
    for (depth, expected) in [(1, 0.5), (2, 0.75), (3, 0.875), (4, 0.9375), (5, 0.96875)] {
        for rr_depth in [1, 100] {
            Estimate::of(&render(&furnace(depth, rr_depth)), 1).assert_is(expected, &format!("depth {depth}"));
        }
    }
}

#[test]
fn a_point_light_in_a_closed_sphere_gives_the_closed_form() {
    // Irradiance I / r² everywhere; radiosity: albedo I / (1 - albedo) / pi = 1 for I = pi and albedo 1/2.
    let mut scene = furnace(64, 5);
    scene["shapes"][0].as_object_mut().unwrap().remove("emission");
    let pi = std::f64::consts::PI;
    scene["lights"] = json!([{ "type": "point", "position": [0.0, 0.0, 0.0], "intensity": [pi, pi, pi] }]);
    Estimate::of(&render(&scene), 0).assert_is(1.0, "one point light");
    let quarter = json!({ "type": "point", "position": [0.0, 0.0, 0.0], "intensity": [pi / 4.0, pi / 4.0, pi / 4.0] });
    scene["lights"] = json!([quarter, quarter, quarter, quarter]);
    Estimate::of(&render(&scene), 2).assert_is(1.0, "four point lights");
}

#[test]
fn convex_white_objects_vanish_in_a_white_environment() {
    // Every material that neither absorbs nor loses energy to missing multiple scattering.
    let materials = [
        json!({ "type": "diffuse", "albedo": 1.0 }),
        json!({ "type": "mirror", "reflectance": 1.0 }),
        json!({ "type": "dielectric", "ior": 1.5 }),
        json!({ "type": "dielectric", "ior": 1.0001 }),
        json!({ "type": "plastic", "albedo": 1.0, "ior": 1.5 }),
    ];
    let shapes = [
        json!({ "type": "sphere", "material": "m" }),
        json!({ "type": "cube", "material": "m", "transform": [{ "scale": 0.6 }, { "rotate": { "axis": [1, 1, 0], "degrees": 30 } }] }),
    ];
    for material in &materials {
        for shape in &shapes {
            let scene = json!({
                "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
                "camera": { "position": [0.0, 0.0, 6.0], "look_at": [0.0, 0.0, 0.0], "vertical_fov_degrees": 20.0 },
                "sampler": { "type": "independent", "spp": 512 },
                "integrator": { "type": "path", "max_depth": 512, "rr_depth": 100 },
                "materials": { "m": material },
                "shapes": [shape],
                "lights": [{ "type": "environment", "radiance": [1.0, 1.0, 1.0] }]
            });
            let estimate = Estimate::of(&render(&scene), 1);
            // The smooth plastic's internal reflectance is tabulated: the stated accuracy is 0.2 %.
            let slack = if material["type"] == "plastic" { 2e-3 } else { 0.0 };
            assert!((estimate.mean - 1.0).abs() <= 5.5 * estimate.error + 1e-4 + slack, "{material} {shape}: {estimate:?}");
        }
    }
}

#[test]
fn rough_materials_never_gain_energy() {
    // A rough glass ball loses the most: light meets its surface several times (an independent renderer finds 0.766).
    for (material, least) in [
        (json!({ "type": "dielectric", "ior": 1.5, "alpha": 0.3 }), 0.73),
        (json!({ "type": "plastic", "albedo": 1.0, "ior": 1.5, "alpha": 0.3 }), 0.95),
        (json!({ "type": "conductor", "eta": [0.01, 0.01, 0.01], "k": [1e4, 1e4, 1e4], "alpha": 0.5 }), 0.7),
    ] {
        let scene = json!({
            "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
            "camera": { "position": [0.0, 0.0, 6.0], "look_at": [0.0, 0.0, 0.0], "vertical_fov_degrees": 18.0 },
            "sampler": { "type": "independent", "spp": 512 },
            "integrator": { "type": "path", "max_depth": 512, "rr_depth": 100 },
            "materials": { "m": material },
            "shapes": [{ "type": "sphere", "material": "m" }],
            "lights": [{ "type": "environment", "radiance": [1.0, 1.0, 1.0] }]
        });
        let estimate = Estimate::of(&render(&scene), 1);
        assert!(estimate.mean <= 1.0 + 5.5 * estimate.error + 2e-3, "{material}: {estimate:?}");
        assert!(estimate.mean > least, "{material}: {estimate:?}");
    }
}

#[test]
fn a_disk_light_gives_walshs_irradiance() {
    let disk = json!({
        "type": "disk", "radius": 0.5, "material": "black", "emission": { "radiance": [1, 1, 1] },
        "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 1, 0] }]
    });
    let pi = std::f64::consts::PI;
    assert_irradiance(&floor_probe([0.0, 0.0, 0.0], json!([disk])), pi * 0.25 / 1.25, "on the axis");
    let (r2, h2, x2) = (0.25f64, 1.0f64, 0.49f64);
    let sum = x2 + h2 + r2;
    let off_axis = 0.5 * (1.0 - (x2 + h2 - r2) / (sum * sum - 4.0 * r2 * x2).sqrt());
    assert!((off_axis - 0.110_793_5).abs() < 1e-6);
    assert_irradiance(&floor_probe([0.7, 0.0, 0.0], json!([disk])), pi * off_axis, "off the axis");
}

#[test]
fn a_quad_light_gives_lamberts_irradiance() {
    let quad = json!({
        "type": "quad", "origin": [-0.3, 1, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1],
        "material": "black", "emission": { "radiance": [1, 1, 1] }
    });
    assert_irradiance(&floor_probe([0.0, 0.0, 0.0], json!([quad])), 0.718_688_9, "quad");
    let mesh = json!({
        "type": "mesh", "positions": [[-0.3, 1, -0.5], [0.7, 1, -0.5], [0.7, 1, 0.5], [-0.3, 1, 0.5]],
        "triangles": [[0, 1, 2], [0, 2, 3]], "material": "black", "emission": { "radiance": [1, 1, 1] }
    });
    assert_irradiance(&floor_probe([0.0, 0.0, 0.0], json!([mesh])), 0.718_688_9, "two triangles");
}

#[test]
fn a_sphere_light_gives_the_irradiance_of_its_solid_angle() {
    // pi L (R / d)² cos = 0.157 for R = 0.5, d = 2, cos = 0.8.
    let sphere = json!({
        "type": "sphere", "radius": 0.5, "material": "black", "emission": { "radiance": [1, 1, 1] },
        "transform": [{ "translate": [1.2, 1.6, 0] }]
    });
    assert_irradiance(&floor_probe([0.0, 0.0, 0.0], json!([sphere])), 0.157_079_6, "sphere");
}

#[test]
fn the_strategies_agree_on_three_scenes() {
    let glossy = |alpha: f64| json!({ "type": "conductor", "metal": "silver", "alpha": alpha });
    let plates = json!({
        "camera": { "position": [0, 2, 6], "look_at": [0, 0.6, 0], "vertical_fov_degrees": 35 },
        "integrator": { "type": "path", "max_depth": 4 },
        "materials": {
            "black": { "type": "diffuse", "albedo": 0 }, "a": glossy(0.02), "b": glossy(0.1), "c": glossy(0.4),
            "d": { "type": "plastic", "alpha": 0.1 }
        },
        "shapes": [
            { "type": "quad", "material": "a", "origin": [-2, 0, 1], "edge_u": [1, 0, 0], "edge_v": [0, 0.4, -2] },
            { "type": "quad", "material": "b", "origin": [-1, 0, 1], "edge_u": [1, 0, 0], "edge_v": [0, 0.4, -2] },
            { "type": "quad", "material": "c", "origin": [0, 0, 1], "edge_u": [1, 0, 0], "edge_v": [0, 0.4, -2] },
            { "type": "quad", "material": "d", "origin": [1, 0, 1], "edge_u": [1, 0, 0], "edge_v": [0, 0.4, -2] },
            { "type": "sphere", "radius": 0.4, "material": "black", "emission": { "radiance": [5, 4, 3] }, "transform": [{ "translate": [-1, 2, -2] }] },
            { "type": "sphere", "radius": 0.9, "material": "black", "emission": { "radiance": [1, 2, 3] }, "transform": [{ "translate": [1.2, 2.2, -2] }] }
        ]
    });
    let open_air = json!({
        "camera": { "position": [0, 1, 4], "look_at": [0, 0.4, 0], "vertical_fov_degrees": 40 },
        "integrator": { "type": "path", "max_depth": 5 },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.6 }, "rough": { "type": "dielectric", "alpha": 0.3 } },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "sphere", "material": "rough", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            { "type": "cylinder", "material": "grey", "radius": 0.3, "height": 1, "transform": [{ "translate": [0.7, 0.4, 0] }] }
        ],
        "lights": [
            { "type": "environment", "radiance": [0.4, 0.5, 0.6] },
            { "type": "directional", "direction": [1, -1, -1], "irradiance": [1, 1, 1], "angular_diameter_degrees": 20 }
        ]
    });
    let partial_lights = json!({
        "camera": { "position": [0, 1.5, 4], "look_at": [0, 0.5, 0], "vertical_fov_degrees": 45 },
        "integrator": { "type": "path", "max_depth": 3 },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.6 }, "black": { "type": "diffuse", "albedo": 0 } },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "disk", "radius": 0.6, "inner_radius": 0.2, "phi_max_degrees": 200, "material": "black",
              "emission": { "radiance": [3, 2, 1], "two_sided": true }, "transform": [{ "translate": [-1, 1, -0.5] }] },
            { "type": "cone", "radius": 0.4, "height": 0.8, "phi_max_degrees": 280, "material": "black",
              "emission": { "radiance": [1, 3, 2], "two_sided": true }, "transform": [{ "translate": [0.2, 0.8, -0.5] }] },
            { "type": "sphere", "radius": 0.4, "z_max": 0.1, "phi_max_degrees": 270, "material": "black",
              "emission": { "radiance": [2, 1, 3], "two_sided": true }, "transform": [{ "translate": [1.2, 0.8, 0.3] }] },
            { "type": "revolution", "profile": { "bezier": [[0.1, 0], [0.4, 0.2], [0, 0.5], [0.2, 0.8]] }, "material": "black",
              "emission": { "radiance": [2, 2, 2] }, "transform": [{ "translate": [-0.3, 0.3, 1] }] }
        ]
    });
    for (name, rest) in [("plates", plates), ("open air", open_air), ("partial lights", partial_lights)] {
        let mut scene = json!({ "film": { "width": 24, "height": 24, "filter": { "type": "box" } }, "sampler": { "type": "independent", "spp": 1024 } });
        merge(&mut scene, rest);
        // Pixels differ from each other, so the standard error comes from independent renders, block by block.
        let blocks = |strategy: &str| -> Vec<Vec<f64>> {
            (0..8)
                .map(|seed| {
                    let mut scene = scene.clone();
                    scene["integrator"]["strategy"] = json!(strategy);
                    scene["sampler"]["seed"] = json!(seed + 1000 * strategy.len());
                    scene["sampler"]["spp"] = json!(128);
                    block_means(&render(&scene))
                })
                .collect()
        };
        let (mis, light, bsdf) = (blocks("mis"), blocks("light"), blocks("bsdf"));
        assert_blocks_agree(&mis, &light, &format!("{name}: mis against light"));
        assert_blocks_agree(&mis, &bsdf, &format!("{name}: mis against bsdf"));
    }
}

#[test]
fn a_glass_slab_transmits_the_closed_form() {
    // r = 0.04 a surface; all orders of internal reflection together: T = (1 - r) / (1 + r).
    let scene = probe(
        [0.0, 0.0, 3.0],
        [0.0, 0.0, 0.0],
        json!({
            "sampler": { "spp": 4096 },
            "integrator": { "type": "path", "max_depth": 64, "rr_depth": 64 },
            "materials": { "glass": { "type": "dielectric", "ior": 1.5 }, "black": { "type": "diffuse", "albedo": 0 } },
            "shapes": [
                { "type": "quad", "material": "glass", "transform": [{ "translate": [0, 0, 0.25] }] },
                { "type": "quad", "material": "glass", "reverse_normal": true, "transform": [{ "translate": [0, 0, -0.25] }] },
                { "type": "quad", "material": "black", "emission": { "radiance": [1, 1, 1] }, "transform": [{ "translate": [0, 0, -1] }] }
            ]
        }),
    );
    Estimate::of(&render(&scene), 0).assert_is(0.923_076_9, "transmittance");
}

#[test]
fn a_light_seen_directly_has_exactly_its_radiance() {
    for depth in [1, 2, 8] {
        let scene = probe(
            [0.0, 0.0, 3.0],
            [0.0, 0.0, 0.0],
            json!({
                "sampler": { "spp": 16 },
                "integrator": { "type": "path", "max_depth": depth },
                "materials": { "black": { "type": "diffuse", "albedo": 0 } },
                "shapes": [{ "type": "quad", "material": "black", "emission": { "radiance": [3.5, 0.25, 1] } }]
            }),
        );
        assert!(pixels(&render(&scene)).all(|p| p == [3.5, 0.25, 1.0]), "depth {depth}");
    }
}

#[test]
fn next_event_estimation_does_not_count_light_twice() {
    // A diffuse floor under an emissive sphere: twice the light if emission were added at every hit besides light sampling.
    let sphere = json!({ "type": "sphere", "radius": 0.5, "material": "black", "emission": { "radiance": [1, 1, 1] }, "transform": [{ "translate": [0, 2, 0] }] });
    let scene = floor_probe([0.0, 0.0, 0.0], json!([sphere]));
    Estimate::of(&render(&scene), 0).assert_is(0.25 / 4.0, "sphere overhead");
}
