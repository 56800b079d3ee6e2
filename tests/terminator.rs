//! Where a coarse smooth mesh turns away from a light: shadow as soft as that of the surface it approximates, and no
//! leaks instead.

use serde_json::{Value, json};
use steradian::internal::film::Image;

use crate::util::geometry::Rng;
use crate::util::render::{Estimate, merge, pixels, render};

/// An octahedron whose triangles are divided into four a number of times, on the unit sphere, with the sphere's
/// normals.
fn ball(divisions: u32) -> Value {
    let signs = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]];
    let octant = |s: [f64; 3]| [[s[0], 0.0, 0.0], [0.0, s[1], 0.0], [0.0, 0.0, s[2]]];
    let mut triangles: Vec<[[f64; 3]; 3]> = signs.map(octant).into();
    triangles.extend(signs.map(|s| octant(s.map(|x| -x))).map(|[a, b, c]| [a, c, b]));
    let middle = |a: [f64; 3], b: [f64; 3]| {
        let sum: [f64; 3] = std::array::from_fn(|k| a[k] + b[k]);
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum.map(|x| x / length)
    };
    for _ in 0..divisions {
        let divided = triangles.iter().flat_map(|&[a, b, c]| {
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        });
        triangles = divided.collect();
    }
    let corners: Vec<[f64; 3]> = triangles.iter().flatten().copied().collect();
    let indices: Vec<[usize; 3]> = (0..triangles.len()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    json!({ "type": "mesh", "material": "m", "positions": corners, "normals": corners, "triangles": indices })
}

/// Towards the light.
const LIGHT: [f64; 3] = [0.974, 0.19, 0.124];

/// A scene lit from the side.
fn lit(shapes: Value, changes: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 96, "height": 96, "filter": { "type": "box" } },
        "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov_degrees": 14 },
        "sampler": { "type": "independent", "spp": 16 },
        "integrator": { "type": "path", "max_depth": 2 },
        "materials": { "m": { "type": "diffuse", "albedo": 0.8 } },
        "shapes": shapes,
        "lights": [{ "type": "directional", "direction": LIGHT.map(|x| -x), "irradiance": [3, 3, 3] }]
    });
    merge(&mut scene, changes);
    scene
}

/// Relative squared error of a picture against that of the round ball, over the zone where the round ball's cosine to
/// the light is below 0.35.
fn error_at_terminator(round: &Image, image: &Image) -> f64 {
    let pixel = 9.0 * 7f64.to_radians().tan() / 48.0;
    let (mut sum, mut count) = (0.0, 0);
    for (x, y) in (0..96).flat_map(|y| (0..96).map(move |x| (x, y))) {
        let (u, v) = ((f64::from(x) - 47.5) * pixel, (47.5 - f64::from(y)) * pixel);
        let cos = u * LIGHT[0] + v * LIGHT[1] + (1.0 - u * u - v * v).max(0.0).sqrt() * LIGHT[2];
        if u.hypot(v) < 0.85 && (-0.1..0.35).contains(&cos) {
            let [a, b] = [round, image].map(|image| f64::from(image.rgb(x, y).unwrap()[1]));
            sum += (a - b) * (a - b) / (a * a + 0.01);
            count += 1;
        }
    }
    assert!(count > 1_000);
    sum / f64::from(count)
}

#[test]
fn a_coarse_smooth_ball_turns_away_from_light_like_a_round_one() {
    let round = render(&lit(json!([{ "type": "sphere", "material": "m" }]), json!({})));
    // Dark facets give 0.28 for 32 triangles and 6e-3 for 128, and so does darkening by the factor for normal maps, or
    // worse.
    for (divisions, most) in [(1, 6e-3), (2, 6e-4)] {
        for integrator in ["path", "whitted"] {
            let image = render(&lit(json!([ball(divisions)]), json!({ "integrator": { "type": integrator } })));
            let error = error_at_terminator(&round, &image);
            assert!(error < most, "{divisions} {integrator}: {error}");
        }
    }

    // An instance that undoes the scale of its object, mirrored.
    let mut object = ball(2);
    object["transform"] = json!([{ "scale": 4.0 }]);
    let placed = json!([{ "object": "o", "transform": [{ "scale": [-0.25, 0.25, 0.25] }] }]);
    let objects = json!({ "objects": { "o": { "shapes": [object] } }, "instances": placed });
    let error = error_at_terminator(&round, &render(&lit(json!([]), objects)));
    assert!(error < 6e-4, "{error}");
}

/// Rays to a light and rays that find it start in the same place: either way of finding a wide sun gives the same
/// picture. Of independent differences over 2,304 pixels the mean is beyond 5.5 of its standard errors once in 2e7.
#[test]
fn light_beyond_the_facet_is_the_same_sought_or_found() {
    let picture = |strategy: &str, seed: u64| {
        let sun = json!([{
            "type": "directional", "direction": [-1, 0, 0.15], "irradiance": [3, 3, 3], "angular_diameter_degrees": 60
        }]);
        let changes = json!({
            "film": { "width": 48, "height": 48 }, "camera": { "vertical_fov_degrees": 6 },
            "sampler": { "spp": 256, "seed": seed },
            "integrator": { "strategy": strategy }, "lights": sun
        });
        render(&lit(json!([ball(1)]), changes))
    };
    let (sought, found) = (picture("light", 1), picture("bsdf", 2));
    let differences: Vec<f64> = pixels(&sought).zip(pixels(&found)).map(|(a, b)| f64::from(a[1] - b[1])).collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let error = (differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n * (n - 1.0))).sqrt();
    let brightness = Estimate::of(&sought, 1).mean;
    assert!(mean.abs() < 5.5 * error && error < 0.02 * brightness, "{mean} +- {error} of {brightness}");
}

/// A white ball under a white sky reflects no more than arrives, and loses little: only what a facet really hides.
#[test]
fn raised_rays_make_no_light() {
    let changes = json!({
        "camera": { "vertical_fov_degrees": 11 }, "sampler": { "spp": 64 }, "materials": { "m": { "albedo": 1.0 } },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    let Estimate { mean, error } = Estimate::of(&render(&lit(json!([ball(1)]), changes)), 1);
    assert!(mean < 1.0 + 5.0 * error && mean > 0.97, "{mean} +- {error}");
}

/// A triangle with normals that lean outwards, as if it stood for a high dome, and a small sheet below the dome's top.
#[test]
fn a_sheet_above_a_smooth_mesh_keeps_its_shadow() {
    let corners = [[-1.5, -1.0, 0.0], [1.5, -1.0, 0.0], [0.0, 1.6, 0.0]];
    let normals = corners.map(|[x, y, _]: [f64; 3]| [x, y, 1.5]);
    let dome =
        json!({ "type": "mesh", "material": "m", "positions": corners, "normals": normals, "triangles": [[0, 1, 2]] });
    let sheet = json!({
        "type": "quad", "material": "m", "origin": [-0.6, -0.6, 0.2], "edge_u": [1.2, 0, 0], "edge_v": [0, 1.2, 0]
    });
    let brightness = |shapes: Value| {
        let changes = json!({
            "film": { "width": 8, "height": 8 }, "sampler": { "spp": 64 },
            "camera": {
                "position": [0, -3, 0.15], "look_at": [0, -0.3, 0], "up": [0, 0, 1], "vertical_fov_degrees": 0.1
            },
            "lights": [{ "type": "directional", "direction": [0, 1, 0.04], "irradiance": [3, 3, 3] }]
        });
        Estimate::of(&render(&lit(shapes, changes)), 1).mean
    };
    // The light comes from a little below the triangle's plane: it reaches the dome, not what lies beneath the sheet.
    assert!(brightness(json!([dome])) > 0.05);
    assert_eq!(brightness(json!([dome, sheet])), 0.0);
}

#[test]
fn no_light_leaks_into_a_closed_box_with_wild_vertex_normals() {
    let mut rng = Rng::new(5);
    let corners: Vec<[f64; 3]> = (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 0 { -3.0 } else { 3.0 })).collect();
    let triangles = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    for material in [json!({ "type": "diffuse", "albedo": 0.9 }), json!({ "type": "plastic", "roughness": 0.4 })] {
        for integrator in ["path", "whitted"] {
            let normals: Vec<[f64; 3]> = (0..8).map(|_| [0; 3].map(|_| rng.range(-1.0, 1.0))).collect();
            let walls = json!({
                "type": "mesh", "material": "m", "positions": corners, "normals": normals, "triangles": triangles
            });
            let changes = json!({
                "camera": { "position": [0.3, 0.2, 2.6], "vertical_fov_degrees": 100 },
                "integrator": { "type": integrator, "max_depth": 8 },
                "lights": [
                    { "type": "environment", "radiance": [1, 1, 1] },
                    { "type": "point", "position": [9, 8, 7], "intensity": [1e4, 1e4, 1e4] }
                ]
            });
            let mut scene = lit(json!([walls, ball(1)]), changes);
            scene["materials"]["m"] = material.clone();
            assert!(pixels(&render(&scene)).all(|p| p == [0.0; 3]), "{material} {integrator}");
        }
    }
}
