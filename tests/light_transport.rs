//! The three strategies against each other; furnaces and the depth law are in the catalogue of stability, group I.

use serde_json::json;

use crate::util::render::{AssertIs, Estimate, assert_blocks_agree, block_means, floor_probe, merge, render};

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
            {
                "type": "sphere", "radius": 0.4, "material": "black", "emission": { "radiance": [5, 4, 3] },
                "transform": [{ "translate": [-1, 2, -2] }]
            },
            {
                "type": "sphere", "radius": 0.9, "material": "black", "emission": { "radiance": [1, 2, 3] },
                "transform": [{ "translate": [1.2, 2.2, -2] }]
            }
        ]
    });
    let open_air = json!({
        "camera": { "position": [0, 1, 4], "look_at": [0, 0.4, 0], "vertical_fov_degrees": 40 },
        "integrator": { "type": "path", "max_depth": 5 },
        "materials": { "grey": { "type": "diffuse", "albedo": 0.6 }, "rough": { "type": "dielectric", "alpha": 0.3 } },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "sphere", "material": "rough", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            {
                "type": "cylinder", "material": "grey", "radius": 0.3, "height": 1,
                "transform": [{ "translate": [0.7, 0.4, 0] }]
            }
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
            {
                "type": "cone", "radius": 0.4, "height": 0.8, "phi_max_degrees": 280, "material": "black",
                "emission": { "radiance": [1, 3, 2], "two_sided": true },
                "transform": [{ "translate": [0.2, 0.8, -0.5] }]
            },
            {
                "type": "sphere", "radius": 0.4, "z_max": 0.1, "phi_max_degrees": 270, "material": "black",
                "emission": { "radiance": [2, 1, 3], "two_sided": true },
                "transform": [{ "translate": [1.2, 0.8, 0.3] }]
            },
            {
                "type": "revolution", "profile": { "bezier": [[0.1, 0], [0.4, 0.2], [0, 0.5], [0.2, 0.8]] },
                "material": "black", "emission": { "radiance": [2, 2, 2] },
                "transform": [{ "translate": [-0.3, 0.3, 1] }]
            }
        ]
    });
    for (name, rest) in [("plates", plates), ("open air", open_air), ("partial lights", partial_lights)] {
        let mut scene = json!({
            "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
            "sampler": { "type": "independent", "spp": 1024 }
        });
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
fn next_event_estimation_does_not_count_light_twice() {
    // A diffuse floor under an emissive sphere: twice the light if emission were added at every hit besides light
    // sampling.
    let sphere = json!({
        "type": "sphere", "radius": 0.5, "material": "black", "emission": { "radiance": [1, 1, 1] },
        "transform": [{ "translate": [0, 2, 0] }]
    });
    let scene = floor_probe([0.0, 0.0, 0.0], json!([sphere]));
    Estimate::of(&render(&scene), 0).assert_is(0.25 / 4.0, "sphere overhead");
}
