//! Known flaws of renderers in camera and film. Each test fails on the formula that its name blames.

use serde_json::{Value, json};
use steradian::internal::film::Image;

use crate::util::render::{pixels, render};

/// A scene that is the same from left to right, from top to bottom, and along its diagonals: a bright square in the
/// middle.
fn symmetric(size: [u32; 2], filter: Value) -> Value {
    json!({
        "film": { "width": size[0], "height": size[1], "filter": filter },
        "sampler": { "spp": 4096 },
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 40 },
        "integrator": { "type": "path", "max_depth": 1 },
        "shapes": [{
            "type": "quad", "origin": [-0.6, -0.6, 0], "edge_u": [1.2, 0, 0], "edge_v": [0, 1.2, 0],
            "emission": { "radiance": [1, 1, 1] }
        }]
    })
}

fn brightness(image: &Image, x: u32, y: u32) -> f64 {
    f64::from(image.rgb(x, y).unwrap()[0])
}

/// Brightness-weighted means of the pixels' middles.
fn centroid(image: &Image) -> [f64; 2] {
    let [width, height] = image.size;
    let mut sums = [0.0; 3];
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let b = brightness(image, x, y);
        sums[0] += b * (f64::from(x) + 0.5);
        sums[1] += b * (f64::from(y) + 0.5);
        sums[2] += b;
    }
    [sums[0] / sums[2], sums[1] / sums[2]]
}

#[test]
fn the_tent_filter_does_not_shift_the_picture_by_a_quarter_pixel() {
    // An offset that lacks half a pixel moves the picture by 1/4; the centroid of the symmetric scene shows it.
    for filter in [
        json!({ "type": "tent" }),
        json!({ "type": "box" }),
        json!({ "type": "gaussian" }),
        json!({ "type": "mitchell" }),
    ] {
        let [x, y] = centroid(&render(&symmetric([16, 16], filter.clone())));
        assert!((x - 8.0).abs() < 5e-3 && (y - 8.0).abs() < 5e-3, "{filter}: {x} {y}");
    }
}

#[test]
fn bright_samples_are_not_clamped_before_the_mean() {
    // Half of each pixel on the square's edge has radiance 100: the mean is 50, whatever a display can show.
    let mut scene = symmetric([8, 8], json!({ "type": "box" }));
    scene["shapes"][0]["origin"] = json!([0, -9, 0]);
    scene["shapes"][0]["edge_u"] = json!([9, 0, 0]);
    scene["shapes"][0]["edge_v"] = json!([0, 18, 0]);
    scene["shapes"][0]["emission"]["radiance"] = json!([100, 100, 100]);
    scene["film"]["width"] = json!(9);
    let image = render(&scene);
    assert!(
        (brightness(&image, 4, 3) - 50.0).abs() < 0.5
            && brightness(&image, 5, 3) == 100.0
            && brightness(&image, 3, 3) == 0.0
    );
}

#[test]
fn pictures_that_are_not_square_are_not_stretched_by_one_angle_for_both_axes() {
    for size in [[32, 16], [16, 32]] {
        let image = render(&symmetric(size, json!({ "type": "box" })));
        let [width, height] = image.size;
        let row: f64 = (0..width).map(|x| brightness(&image, x, height / 2)).sum();
        let column: f64 = (0..height).map(|y| brightness(&image, width / 2, y)).sum();
        // The square covers as many pixels across as down.
        assert!((row - column).abs() < 0.05 && row > 3.0, "{size:?}: {row} {column}");
    }
}

#[test]
fn the_lens_is_sampled_by_area_and_not_by_radius() {
    // A small light out of focus is drawn as an even disk. A radius of u R makes the inner half twice as bright as it
    // should be.
    let scene = json!({
        "film": { "width": 32, "height": 32, "filter": { "type": "box" } },
        "sampler": { "spp": 1024 },
        "camera": {
            "position": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 40,
            "lens": { "radius": 0.25, "focus_distance": 1e6 }
        },
        "integrator": { "type": "path", "max_depth": 1 },
        "shapes": [{ "type": "sphere", "radius": 0.02, "emission": { "radiance": [1, 1, 1] } }]
    });
    let image = render(&scene);
    let radius = 0.25 / f64::to_radians(20.0).tan() * 16.0;
    let (mut inner, mut all) = (0.0, 0.0);
    for (i, p) in pixels(&image).enumerate() {
        let (x, y) = ((i % 32) as f64 - 15.5, (i / 32) as f64 - 15.5);
        all += f64::from(p[0]);
        inner += if x.hypot(y) < 0.5 * radius { f64::from(p[0]) } else { 0.0 };
    }
    assert!((inner / all - 0.25).abs() < 0.03, "{}", inner / all);
}

#[test]
fn samples_stay_in_the_row_of_their_pixel() {
    // The square's upper edge lies between rows 7 and 8. A jitter that reaches a row too far brightens row 7 and
    // darkens row 8.
    let mut scene = symmetric([16, 16], json!({ "type": "box" }));
    scene["shapes"][0]["origin"] = json!([-9, -18, 0]);
    scene["shapes"][0]["edge_u"] = json!([18, 0, 0]);
    scene["shapes"][0]["edge_v"] = json!([0, 18, 0]);
    let image = render(&scene);
    for x in 0..16 {
        assert_eq!((brightness(&image, x, 7), brightness(&image, x, 8)), (0.0, 1.0), "column {x}");
    }
}

#[test]
fn the_samples_of_a_pixel_are_stratified_and_repeatable() {
    // Along an edge through the pixels' middles, 64 independent samples err by 0.06; stratified ones by less than half
    // as much.
    let mut scene = symmetric([16, 16], json!({ "type": "box" }));
    scene["sampler"]["spp"] = json!(64);
    scene["shapes"][0]["origin"] = json!([0, -9, 0]);
    scene["shapes"][0]["edge_u"] = json!([9, 4, 0]);
    scene["shapes"][0]["edge_v"] = json!([0, 18, 0]);
    scene["film"]["width"] = json!(17);
    let image = render(&scene);
    let errors: Vec<f64> = (0..16).map(|y| brightness(&image, 8, y) - 0.5).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / 16.0).sqrt();
    assert!(rms < 0.03, "{rms}");
    assert!(pixels(&image).eq(pixels(&render(&scene))));
}
