//! Irradiance of area lights, and a slab of glass.

use std::f64::consts::PI;

use super::{Effort, Outcome, PIXELS, SIDE, STRATEGIES, Tests, Value, json, mean, merge, with_strategy};
use crate::math::DVec3;
use crate::stability::lights::lambert;
use crate::stability::render::{Estimate, floor_probe, probe};

/// Irradiance that a probe sees on the floor, from shapes of radiance 1 by each strategy, against what is expected.
fn compare(tests: &mut Tests, effort: Effort, name: &str, mut scene: Value, expected: f64) -> f64 {
    merge(&mut scene, json!({ "film": { "width": SIDE, "height": SIDE } }));
    let mut worst = 0f64;
    for strategy in STRATEGIES {
        // By chance small lights are found rarely.
        let spp = if strategy == "bsdf" { effort.pick(512, 8192) } else { effort.pick(64, 4096) };
        scene["sampler"]["spp"] = json!(spp);
        let found = mean(&with_strategy(&scene, strategy), 0);
        let irradiance = Estimate { mean: PI * found.mean, error: PI * found.error };
        tests.mean(&format!("{name}, {strategy}"), irradiance, PIXELS, expected, 0.0);
        if strategy != "bsdf" {
            worst = worst.max((irradiance.mean / expected - 1.0).abs());
        }
    }
    worst
}

/// The catalogue requires a relative error below 0.2 %, which scattering alone would need hours for.
fn judge(tests: Tests, effort: Effort, worst: f64) -> Outcome {
    let outcome = Outcome::new().at_most("relative error where lights are sampled", worst, effort.pick(0.02, 0.002));
    tests.judge_means(outcome, effort.pick(0.06, 0.01))
}

/// A light with the emission of radiance 1.
fn lamp(mut shape: Value) -> Value {
    merge(&mut shape, json!({ "material": "black", "emission": { "radiance": [1, 1, 1] } }));
    shape
}

pub(super) fn i4_disk(effort: Effort) -> Outcome {
    let disk = lamp(json!({
        "type": "disk", "radius": 0.5,
        "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 1, 0] }]
    }));
    // F = (1 - (x² + h² - R²) / sqrt((x² + h² + R²)² - 4 R² x²)) / 2; 0.1107935 for x = 0.7.
    let share = |x: f64| {
        let (x2, r2) = (x * x, 0.25);
        0.5 * (1.0 - (x2 + 1.0 - r2) / ((x2 + 1.0 + r2).powi(2) - 4.0 * r2 * x2).sqrt())
    };
    let mut tests = Tests::new();
    let worst = [0.0, 0.7].map(|x| {
        compare(&mut tests, effort, &format!("x = {x}"), floor_probe([x, 0.0, 0.0], json!([disk])), PI * share(x))
    });
    let form = (share(0.7) - 0.110_793_5).abs().max((share(0.0) - 0.2).abs());
    judge(tests, effort, worst[0].max(worst[1])).at_most(
        "distance of the formula from the catalogue's number",
        form,
        1e-6,
    )
}

pub(super) fn i5_quad(effort: Effort) -> Outcome {
    let quad = lamp(json!({ "type": "quad", "origin": [-0.3, 1, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1] }));
    let mesh = lamp(json!({
        "type": "mesh", "positions": [[-0.3, 1, -0.5], [0.7, 1, -0.5], [0.7, 1, 0.5], [-0.3, 1, 0.5]],
        "triangles": [[0, 1, 2], [0, 2, 3]]
    }));
    let one = lamp(json!({
        "type": "mesh", "positions": [[-0.3, 1, -0.5], [0.7, 1, -0.5], [0.7, 1, 0.5]], "triangles": [[0, 1, 2]]
    }));
    let other = lamp(json!({
        "type": "mesh", "positions": [[-0.3, 1, -0.5], [0.7, 1, 0.5], [-0.3, 1, 0.5]], "triangles": [[0, 1, 2]]
    }));
    let sheared = lamp(
        json!({ "type": "quad", "origin": [-0.6, 0.8, -0.4], "edge_u": [0.9, 0.3, 0.2], "edge_v": [0.3, 0, 0.8] }),
    );
    let exact =
        lambert(&[[-0.6, 0.8, -0.4], [0.3, 1.1, -0.2], [0.6, 1.1, 0.6], [-0.3, 0.8, 0.4]].map(DVec3::from), DVec3::Y);
    let square =
        lambert(&[[-0.3, 1.0, -0.5], [0.7, 1.0, -0.5], [0.7, 1.0, 0.5], [-0.3, 1.0, 0.5]].map(DVec3::from), DVec3::Y);
    let mut tests = Tests::new();
    let worst = [
        compare(&mut tests, effort, "quad", floor_probe([0.0; 3], json!([quad])), square),
        compare(&mut tests, effort, "two triangles", floor_probe([0.0; 3], json!([mesh])), square),
        compare(&mut tests, effort, "two meshes", floor_probe([0.0; 3], json!([one, other])), square),
        compare(&mut tests, effort, "sheared", floor_probe([0.0; 3], json!([sheared])), exact),
    ];
    let form = (square - 0.718_688_9).abs();
    judge(tests, effort, worst.into_iter().fold(0.0, f64::max)).at_most(
        "distance of the formula from the catalogue's number",
        form,
        1e-6,
    )
}

pub(super) fn i6_sphere(effort: Effort) -> Outcome {
    let sphere = |radius: f64, center: [f64; 3]| {
        lamp(json!({ "type": "sphere", "radius": radius, "transform": [{ "translate": center }] }))
    };
    // Half the size, doubled and mirrored; and cut in two, which is sampled by area.
    let placed = lamp(json!({
        "type": "sphere", "radius": 0.25, "transform": [{ "scale": [2, -2, 2] }, { "translate": [1.2, 1.6, 0] }]
    }));
    let half = |from: f64, to: f64| {
        lamp(json!({
            "type": "sphere", "radius": 0.5, "z_min": from, "z_max": to,
            "transform": [{ "translate": [1.2, 1.6, 0] }]
        }))
    };
    // pi (R / d)² cos: 0.1570796 for R = 0.5, d = 2, cos = 0.8.
    let expected = PI * 0.0625 * 0.8;
    let mut tests = Tests::new();
    let worst = [
        compare(&mut tests, effort, "sphere", floor_probe([0.0; 3], json!([sphere(0.5, [1.2, 1.6, 0.0])])), expected),
        compare(&mut tests, effort, "scaled", floor_probe([0.0; 3], json!([placed])), expected),
        compare(
            &mut tests,
            effort,
            "two parts",
            floor_probe([0.0; 3], json!([half(-0.5, 0.1), half(0.1, 0.5)])),
            expected,
        ),
        compare(
            &mut tests,
            effort,
            "overhead",
            floor_probe([0.0; 3], json!([sphere(0.5, [0.0, 1.0, 0.0])])),
            PI * 0.25,
        ),
    ];
    judge(tests, effort, worst.into_iter().fold(0.0, f64::max))
}

/// A slab of glass between a lamp at the back and one at the front, of these radiances.
fn slab(spp: u32, back: f64, front: f64) -> Value {
    let mut scene = probe(
        [0.0, 0.0, 3.0],
        [0.0, 0.0, 0.0],
        json!({
            "film": { "width": SIDE, "height": SIDE }, "sampler": { "spp": spp },
            "integrator": { "type": "path", "max_depth": 256, "rr_depth": 256 },
            "materials": { "glass": { "type": "dielectric", "ior": 1.5 }, "black": { "type": "diffuse", "albedo": 0 } },
            "shapes": [
                { "type": "quad", "material": "glass", "transform": [{ "translate": [0, 0, 0.25] }] },
                {
                    "type": "quad", "material": "glass", "reverse_normal": true,
                    "transform": [{ "translate": [0, 0, -0.25] }]
                },
            ]
        }),
    );
    for (z, radiance, turned) in [(-1.0, back, false), (4.0, front, true)] {
        let lamp = json!({
            "type": "quad", "material": "black", "emission": { "radiance": [radiance, radiance, radiance] },
            "reverse_normal": turned, "transform": [{ "translate": [0, 0, z] }]
        });
        if let Some(shapes) = scene["shapes"].as_array_mut() {
            shapes.push(lamp);
        }
    }
    scene
}

pub(super) fn i8_slab(effort: Effort) -> Outcome {
    // r = 0.04 at each surface: R = 2 r / (1 + r).
    let (reflected, spp) = (0.08 / 1.04, effort.pick(256, 16_384));
    let mut tests = Tests::new();
    tests.mean("transmitted", mean(&slab(spp, 1.0, 0.0), 0), PIXELS, 1.0 - reflected, 0.0);
    let back = mean(&slab(spp, 0.0, 1.0), 0);
    tests.mean("reflected", back, PIXELS, reflected, 0.0);
    let all = mean(&slab(effort.pick(16, 256), 1.0, 1.0), 0);
    let outcome = Outcome::new().at_most("error of all together", (all.mean - 1.0).abs().max(all.error), 1e-5);
    tests.judge_means(outcome, effort.pick(0.05, 0.005))
}
