//! Closed spheres, and lights seen directly.

use std::f64::consts::PI;

use super::{
    Effort, Outcome, PIXELS, STRATEGIES, Tests, Value, json, mean, merge, pixels, render, scene, with_strategy,
};

/// Inside a closed sphere of albedo 1/2.
pub(super) fn grey_sphere(spp: u32, max_depth: u32, rr_depth: u32) -> Value {
    scene(
        spp,
        json!({
            "camera": { "position": [0.1, 0.2, 0.3], "look_at": [0.4, 0.1, -0.5], "vertical_fov_degrees": 60.0 },
            "integrator": { "type": "path", "max_depth": max_depth, "rr_depth": rr_depth },
            "materials": { "grey": { "type": "diffuse", "albedo": 0.5 } },
            "shapes": [{ "type": "sphere", "material": "grey" }]
        }),
    )
}

/// [`grey_sphere`] that emits 1/2: radiance 1/2 + 1/4 + 1/8 + ... = 1.
pub(super) fn glowing_sphere(spp: u32, max_depth: u32, rr_depth: u32) -> Value {
    let mut scene = grey_sphere(spp, max_depth, rr_depth);
    scene["shapes"][0]["emission"] = json!({ "radiance": [0.5, 0.5, 0.5], "two_sided": true });
    scene
}

/// [`grey_sphere`] with lights of intensity pi together in its middle: irradiance pi everywhere, radiance 1/2 / (1 -
/// 1/2) = 1.
fn lit_sphere(spp: u32, lights: u32) -> Value {
    let intensity = [PI / f64::from(lights); 3];
    let light = json!({ "type": "point", "position": [0.0, 0.0, 0.0], "intensity": intensity });
    let mut scene = grey_sphere(spp, 64, 5);
    scene["lights"] = json!(vec![light; lights as usize]);
    scene
}

fn cameras() -> [(&'static str, Value); 4] {
    [
        ("perspective", json!({})),
        ("lens", json!({ "lens": { "radius": 0.05, "focus_distance": 0.5 } })),
        ("orthographic", json!({ "type": "orthographic", "view_height": 0.4, "vertical_fov_degrees": null })),
        ("environment", json!({ "type": "environment", "vertical_fov_degrees": null })),
    ]
}

pub(super) fn i1_furnaces(effort: Effort) -> Outcome {
    let spp = effort.pick(16, 512);
    let mut tests = Tests::new();
    for (camera, change) in cameras() {
        for sampler in ["independent", "sobol"] {
            let furnaces = [
                ("glowing", glowing_sphere(spp, 64, 5)),
                ("one light", lit_sphere(spp, 1)),
                ("four lights", lit_sphere(spp, 4)),
            ];
            for (furnace, mut scene) in furnaces {
                merge(&mut scene, json!({ "camera": change, "sampler": { "type": sampler } }));
                let name = format!("{furnace}, {camera}, {sampler}");
                tests.mean(&name, mean(&scene, 1), PIXELS, 1.0, 0.0);
            }
        }
    }
    tests.judge_means(Outcome::new(), effort.pick(0.01, 0.002))
}

pub(super) fn i2_depth(effort: Effort) -> Outcome {
    let spp = effort.pick(64, 1024);
    let mut tests = Tests::new();
    for depth in [1, 2, 3, 4, 5, 8, 64] {
        let expected = 1.0 - 0.5f64.powi(depth);
        for rr_depth in [1, 100] {
            for strategy in STRATEGIES {
                let scene = with_strategy(&glowing_sphere(spp, depth as u32, rr_depth), strategy);
                tests.mean(
                    &format!("depth {depth}, roulette from {rr_depth}, {strategy}"),
                    mean(&scene, 1),
                    PIXELS,
                    expected,
                    0.0,
                );
            }
        }
    }
    // What one bounce more or less changes at depth 8.
    tests.judge_means(Outcome::new(), effort.pick(0.018, 0.0039))
}

pub(super) fn i11_seen_directly(_: Effort) -> Outcome {
    let radiance = [3.5, 0.25, 1.0f32];
    let emission = json!({ "radiance": radiance });
    let shapes = [
        (
            "quad",
            json!({
                "shapes": [{ "type": "quad", "material": "black", "emission": emission, "transform": [{ "scale": 3 }] }]
            }),
        ),
        ("sphere", json!({ "shapes": [{ "type": "sphere", "material": "black", "radius": 2, "emission": emission }] })),
        ("disk", json!({ "shapes": [{ "type": "disk", "material": "black", "radius": 3, "emission": emission }] })),
        ("sky", json!({ "lights": [{ "type": "environment", "radiance": radiance }] })),
    ];
    let (mut different, mut names) = (0, Vec::new());
    for (name, shape) in shapes {
        for depth in [1, 2, 8] {
            for strategy in STRATEGIES {
                let mut scene = scene(4, json!({ "materials": { "black": { "type": "diffuse", "albedo": 0 } } }));
                merge(&mut scene, shape.clone());
                scene["integrator"] = json!({ "type": "path", "max_depth": depth, "strategy": strategy });
                let image = render(&scene);
                let wrong = pixels(&image).filter(|p| *p != radiance).count() + PIXELS - pixels(&image).count();
                if wrong > 0 {
                    names.push(format!("{name} {depth} {strategy}"));
                }
                different += wrong;
            }
        }
    }
    Outcome::new().none(format!("pixels with another radiance ({})", names.join(", ")), different)
}
