//! A tree chooses among many lights: the picture is the same as with any other choice, and the tree stays small.

use serde_json::{Value, json};
use steradian::internal::accel::AccelKind;
use steradian::internal::light::{LightSelection, LightSet};
use steradian::internal::render::Overrides;

use crate::util::geometry::Rng;
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

/// A room with lamps of every kind, of sizes and powers that differ, some of them turned away or outside.
fn room() -> Value {
    let mut rng = Rng::new(1);
    let mut shapes = vec![
        json!({ "type": "quad", "material": "grey", "origin": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] }),
        json!({ "type": "quad", "material": "grey", "origin": [-3, 0, -3], "edge_u": [6, 0, 0], "edge_v": [0, 3, 0] }),
        json!({ "type": "sphere", "material": "metal", "radius": 0.6, "transform": [{ "translate": [-0.8, 0.6, 0] }] }),
        json!({
            "type": "sphere", "material": "glass", "radius": 0.5, "transform": [{ "translate": [0.9, 0.5, 0.6] }]
        }),
    ];
    let mut lights = vec![json!({ "type": "environment", "radiance": [0.05, 0.05, 0.08] })];
    let kinds = ["sphere", "quad", "disk", "cone", "cube"];
    for i in 0..30 {
        let place = [rng.range(-3.0, 3.0), rng.range(0.2, 2.5), rng.range(-3.0, 1.0)];
        let degrees = rng.range(0.0, 360.0);
        let power = rng.range(0.0, 3.0).exp2();
        shapes.push(json!({
            "type": kinds[i % 5], "material": "black",
            "emission": { "radiance": [5.0 * power, 4.0 * power, 6.0 * power], "two_sided": i % 2 == 0 },
            "transform": [
                { "scale": rng.range(0.02, 0.1) }, { "rotate": { "axis": [1, 2, 3], "degrees": degrees } },
                { "translate": place }
            ]
        }));
        let spot = json!({
            "type": "spot", "position": place, "look_at": [0, 0, 0], "intensity": [0.1, 0.1, 0.1],
            "cutoff_angle_degrees": 10.0 + degrees / 5.0
        });
        let point = json!({ "type": "point", "position": place, "intensity": [0.02, 0.03, 0.02] });
        lights.extend(if i % 3 == 0 { Some(spot) } else { (i % 3 == 1).then_some(point) });
    }
    json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "sampler": { "type": "independent", "spp": 96 },
        "camera": { "position": [0, 1.6, 6], "look_at": [0, 0.9, 0], "vertical_fov_degrees": 40 },
        "integrator": { "type": "path", "max_depth": 4 },
        "materials": {
            "grey": { "type": "diffuse", "albedo": 0.6 }, "black": { "type": "diffuse", "albedo": 0 },
            "metal": { "type": "conductor", "metal": "silver", "alpha": 0.3 },
            "glass": { "type": "dielectric", "alpha": 0.3 }
        },
        "shapes": shapes,
        "lights": lights
    })
}

#[test]
fn the_picture_does_not_depend_on_how_lights_are_chosen() {
    let scene = room();
    let blocks = |selection: LightSelection, strategy: &str| -> Vec<Vec<f64>> {
        (0..8)
            .map(|seed| {
                let mut scene = scene.clone();
                scene["integrator"]["strategy"] = json!(strategy);
                let overrides = Overrides {
                    threads: Some(2),
                    seed: Some(seed + 100 * strategy.len() as u64),
                    ..Overrides::default()
                };
                let mut prepared = prepare(&scene, &overrides);
                assert_eq!(prepared.scene.lights.selection(), LightSelection::Tree);
                let lights = prepared.scene.lights.lights().to_vec();
                prepared.scene.lights = LightSet::with_selection(lights, &prepared.scene.geometry, selection);
                block_means(&render_with(&prepared, AccelKind::EMBREE).image)
            })
            .collect()
    };
    let by_power = blocks(LightSelection::Power, "mis");
    for strategy in ["mis", "light"] {
        assert_blocks_agree(&by_power, &blocks(LightSelection::Tree, strategy), strategy);
    }
}

#[test]
fn one_light_is_chosen_by_power_and_two_by_a_tree() {
    let mut scene = room();
    scene["lights"] = json!([]);
    for (shapes, selection) in [(6, LightSelection::Tree), (5, LightSelection::Power)] {
        scene["shapes"].as_array_mut().unwrap().truncate(shapes);
        assert_eq!(prepare(&scene, &Overrides::default()).scene.lights.selection(), selection);
    }
}
