//! Layers with holes, and cards that move.

use super::{
    Effort, Faults, Outcome, PIXELS, SIDE, Tests, Value, json, merge, pixels, prepare, render, render_with, scene,
};
use crate::accel::{AccelKind, EmbreeOptions, EmbreeQuality};
use crate::render::Overrides;
use crate::stability::render::Estimate;
use crate::stability::verdict::estimate;

/// Meshes of two triangles each, with opacity one half, before a sky of radiance 1: the diagonal runs from corner to
/// corner of the picture.
fn stack(spp: u32, layers: u32) -> Value {
    let layer = |i: u32| {
        let z = 0.1 * f64::from(i);
        json!({ "type": "mesh", "material": "black", "opacity": 0.5, "triangles": [[0, 1, 2], [0, 2, 3]],
            "positions": [[-1, -1, z], [1, -1, z], [1, 1, z], [-1, 1, z]] })
    };
    scene(
        spp,
        json!({
            // Just the inside of the cards.
            "camera": { "type": "orthographic", "view_height": 1.9, "vertical_fov_degrees": null },
            "integrator": { "type": "path", "max_depth": 2 },
            "materials": { "black": { "type": "diffuse", "albedo": 0 } },
            "shapes": (0..layers).map(layer).collect::<Vec<_>>(),
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    )
}

pub(super) fn i9_alpha(effort: Effort) -> Outcome {
    let high = AccelKind::Embree(EmbreeOptions { quality: EmbreeQuality::High, ..EmbreeOptions::default() });
    let kinds = AccelKind::ALL.into_iter().chain([(high, "embree:high")]);
    let (mut tests, mut diagonals) = (Tests::new(), Tests::new());
    for (kind, name) in kinds {
        for layers in [1, 2, 4, 6] {
            let prepared =
                prepare(&stack(effort.pick(64, 2048), layers), &Overrides { threads: Some(2), ..Overrides::default() });
            let image = render_with(&prepared, kind).image;
            let expected = 0.5f64.powi(layers as i32);
            tests.mean(&format!("{name}, {layers} layers"), Estimate::of(&image, 1), PIXELS, expected, 0.0);

            // Rows run downward, the diagonal upward.
            let side = SIDE as usize;
            let on_diagonal = |i: usize| i % side + i / side + 1 == side;
            let of = |diagonal: bool| -> Vec<f64> {
                let all = pixels(&image).enumerate().filter(|(i, _)| on_diagonal(*i) == diagonal);
                all.map(|(_, p)| f64::from(p[1])).collect()
            };
            diagonals.mean(&format!("{name}, {layers} layers, diagonal"), estimate(&of(true)), side, expected, 0.0);
        }
    }
    let outcome = diagonals.judge_means(Outcome::new(), effort.pick(1.0, 0.2));
    tests.judge_means(outcome, effort.pick(0.2, 0.04))
}

/// A card from 0 to 1 along x that a camera sees from -0.5 to 2.5.
fn card() -> Value {
    json!({ "type": "quad", "material": "black", "origin": [0, -5, 0], "edge_u": [1, 0, 0], "edge_v": [0, 10, 0] })
}

fn before_a_sky(spp: u32, rest: Value) -> Value {
    let mut scene = scene(
        spp,
        json!({
            "camera": {
                "type": "orthographic", "view_height": 3, "vertical_fov_degrees": null, "position": [1, 0, 6],
                "look_at": [1, 0, 0]
            },
            "integrator": { "type": "path", "max_depth": 2 },
            "materials": { "black": { "type": "diffuse", "albedo": 0 } },
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    );
    merge(&mut scene, rest);
    scene
}

/// The card on its way by `distance`: as a shape, an instance, a shape within an instance, and a mesh that deforms.
fn moving(distance: f64) -> Vec<(&'static str, Value)> {
    let path = json!([{ "time": 0 }, { "time": 1, "transform": [{ "translate": [distance, 0, 0] }] }]);
    let mut shape = card();
    shape["motion"] = path.clone();
    let corners = |x: f64| json!([[x, -5, 0], [x + 1.0, -5, 0], [x + 1.0, 5, 0], [x, 5, 0]]);
    let mesh = json!({ "type": "mesh", "material": "black", "triangles": [[0, 1, 2], [0, 2, 3]],
        "positions": corners(0.0), "deform_positions": [corners(distance)] });
    vec![
        ("shape", json!({ "shapes": [shape] })),
        (
            "instance",
            json!({ "objects": { "o": { "shapes": [card()] } }, "instances": [{ "object": "o", "motion": path }] }),
        ),
        (
            "shape in an instance",
            json!({ "objects": { "o": { "shapes": [shape] } }, "instances": [{ "object": "o" }] }),
        ),
        ("mesh", json!({ "shapes": [mesh] })),
    ]
}

/// How long the card covers a pixel's column, as a mean over its width: x, then 2 - x.
fn coverage(column: u32) -> f64 {
    let edge = |i: u32| -0.5 + 3.0 * f64::from(i) / f64::from(SIDE);
    // The integral of the triangle.
    let integral = |x: f64| {
        let x = x.clamp(0.0, 2.0);
        if x < 1.0 { 0.5 * x * x } else { 1.0 - 0.5 * (2.0 - x) * (2.0 - x) }
    };
    (integral(edge(column + 1)) - integral(edge(column))) * f64::from(SIDE) / 3.0
}

pub(super) fn i10_motion(effort: Effort) -> Outcome {
    let mut tests = Tests::new();
    for (name, rest) in moving(1.0) {
        let image = render(&before_a_sky(effort.pick(64, 4096), rest));
        let values: Vec<f64> = pixels(&image).map(|p| f64::from(p[1])).collect();
        for column in 0..SIDE {
            let rows: Vec<f64> = values.iter().skip(column as usize).step_by(SIDE as usize).copied().collect();
            tests.mean(&format!("{name}, column {column}"), estimate(&rows), rows.len(), 1.0 - coverage(column), 0.0);
        }
    }

    // With both steps the same nothing moves.
    let still: Vec<_> = pixels(&render(&before_a_sky(16, json!({ "shapes": [card()] })))).collect();
    let mut different = Faults::NONE;
    for (name, rest) in moving(0.0) {
        let image = render(&before_a_sky(16, rest));
        different.add(pixels(&image).zip(&still).filter(|(a, b)| a != *b).count(), || name.to_owned());
    }
    let outcome = Outcome::new().none("pixels of cards with two equal steps that differ from those at rest", different);
    tests.judge_means(outcome, effort.pick(1.0, 0.15))
}
