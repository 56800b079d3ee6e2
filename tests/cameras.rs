//! What the cameras of the scene file see.

use serde_json::{Value, json};
use steradian::internal::film::{Crop, Image, LayerKind};

use crate::util::folder::Folder;
use crate::util::render::{merge, pixels, render};

/// A picture of a box whose faces are distinguished by their normals, at depths from 4 to 6.
fn scene(camera: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 32, "height": 16, "filter": { "type": "box", "radius": 1e-3 } },
        "sampler": { "spp": 1 },
        "integrator": { "type": "normal" },
        "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
        "shapes": [{
            "type": "cube",
            "transform": [{ "rotate": { "axis": [0, 1, 0], "degrees": 30 } }, { "translate": [0.3, 0.1, 0] }]
        }],
        "outputs": [{ "file": "a.exr", "layers": ["Z", "P"] }]
    });
    merge(&mut scene["camera"], camera);
    scene
}

fn colors(image: &Image) -> Vec<[f32; 3]> {
    pixels(image).collect()
}

#[test]
fn an_environment_camera_takes_the_picture_that_an_environment_light_shows() {
    let folder = Folder::new();
    let texel = |x: usize, y: usize| [x as f32 * 0.1, y as f32 * 0.2, ((x * 7 + y * 3) % 5) as f32];
    let sky = folder.write("sky.exr", "");
    exr::prelude::write_rgb_file(&sky, 16, 8, |x, y| texel(x, y).into()).unwrap();
    // Narrow filters look at the middle of each texel, where the lookup is the texel.
    let scene = json!({
        "film": { "width": 16, "height": 8, "filter": { "type": "box", "radius": 1e-4 } },
        "sampler": { "spp": 1 },
        "camera": { "type": "environment", "position": [3, 2, 1], "look_at": [3, 2, 0] },
        "lights": [{ "type": "environment", "file": sky.to_str().unwrap() }]
    });
    for (i, pixel) in pixels(&render(&scene)).enumerate() {
        let expected = texel(i % 16, i / 16);
        assert!(pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-3), "{i}: {pixel:?} {expected:?}");
    }
}

#[test]
fn depth_is_right_for_every_camera() {
    for (camera, distance) in [
        (json!({ "vertical_fov_degrees": 30 }), false),
        (json!({ "vertical_fov_degrees": 30, "lens": { "radius": 0.3, "focus_distance": 5 } }), false),
        (json!({ "vertical_fov_degrees": 30, "near": 4.2, "shift": [0.1, 0.05] }), false),
        (json!({ "type": "orthographic", "view_height": 3 }), false),
        (json!({ "type": "environment" }), true),
    ] {
        let image = render(&scene(camera.clone()));
        let mut seen = 0;
        for (x, y) in (0..16).flat_map(|y| (0..32).map(move |x| (x, y))) {
            let (z, p) = (image.pixel(LayerKind::Z, x, y).unwrap()[0], image.pixel(LayerKind::P, x, y).unwrap());
            if z < 1e9 {
                let expected = if distance {
                    (p[0] * p[0] + p[1] * p[1] + (p[2] - 5.0) * (p[2] - 5.0)).sqrt()
                } else {
                    5.0 - p[2]
                };
                assert!((z - expected).abs() < 1e-4, "{camera}: {z} {expected}");
                assert!(z >= camera["near"].as_f64().unwrap_or(0.0) as f32 - 1e-5, "{camera}: {z}");
                seen += 1;
            }
        }
        assert!(seen > 3, "{camera}: {seen}");
    }
}

#[test]
fn a_far_orthographic_camera_sees_what_a_long_lens_sees() {
    let parallel = render(&scene(json!({ "type": "orthographic", "view_height": 4 })));
    let far = render(&scene(
        json!({ "position": [0, 0, 50_000], "vertical_fov_degrees": (4.0f64 / 100_000.0).atan().to_degrees() * 2.0 }),
    ));
    let differing = colors(&parallel)
        .iter()
        .zip(colors(&far))
        .filter(|(a, b)| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-3))
        .count();
    assert!(differing <= 4, "{differing} pixels differ");
}

#[test]
fn a_shifted_picture_is_the_crop_of_a_larger_one() {
    let shifted = render(&scene(json!({ "vertical_fov_degrees": 20, "shift": [0.25, -0.25] })));
    // Twice the size in each direction, and the part right and below of the middle.
    let mut large =
        scene(json!({ "vertical_fov_degrees": (2.0 * f64::to_radians(10.0).tan()).atan().to_degrees() * 2.0 }));
    large["film"]["width"] = json!(64);
    large["film"]["height"] = json!(32);
    large["film"]["crop"] = json!([16 + 8, 8 + 4, 32, 16]);
    let part = render(&large);
    let (a, b) = (colors(&shifted), (0..16).flat_map(|y| (0..32).map(move |x| (x, y))));
    let differing = a
        .iter()
        .zip(b)
        .filter(|(a, (x, y))| part.rgb(24 + x, 12 + y).unwrap().iter().zip(*a).any(|(b, a)| (a - b).abs() > 1e-4));
    assert!(differing.count() <= 2);
    assert!(a.iter().any(|p| p[0] > 0.0) && a.iter().any(|p| p[0] == 0.0));
}

#[test]
fn wide_pixels_show_as_much_in_fewer_columns() {
    // Every other column of a picture of narrow pixels is centred in none of the wide ones: those are centred on column
    // edges.
    let wide = render(&scene(json!({ "vertical_fov_degrees": 30, "pixel_aspect": 3 })));
    let mut narrow = scene(json!({ "vertical_fov_degrees": 30 }));
    narrow["film"]["width"] = json!(96);
    let narrow = render(&narrow);
    for (x, y) in (0..16).flat_map(|y| (0..32).map(move |x| (x, y))) {
        let (a, b) = (wide.rgb(x, y).unwrap(), narrow.rgb(3 * x + 1, y).unwrap());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{x} {y}");
    }
}

#[test]
fn blades_shape_what_is_out_of_focus() {
    // A small light far out of focus draws the aperture: a triangle with a corner to the right.
    let star = |blades: Value| {
        let mut scene = json!({
            "film": { "width": 33, "height": 33, "filter": { "type": "box" } },
            "sampler": { "spp": 512 },
            "camera": {
                "position": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 40,
                "lens": { "radius": 0.25, "focus_distance": 1e6 }
            },
            "shapes": [{ "type": "sphere", "radius": 0.03, "emission": { "radiance": [1, 1, 1] } }],
            "integrator": { "type": "path", "max_depth": 1 }
        });
        if !blades.is_null() {
            scene["camera"]["lens"]["blades"] = blades;
        }
        render(&scene)
    };
    // The image of a lens point at (x, y) lies at -(x, y): the film sees the star from the other side of the axis.
    let lit = |image: &Image, x: f64, y: f64| {
        let pixel = |a: f64| (16.5 + a * 0.25 / f64::to_radians(20.0).tan() * 16.5).floor() as u32;
        image.rgb(pixel(-x), pixel(y)).unwrap()[0] > 0.0
    };
    let (disk, triangle) = (star(Value::Null), star(json!({ "count": 3 })));
    for angle in [0.0f64, 60.0, 120.0, 180.0, 240.0, 300.0] {
        let (sin, cos) = angle.to_radians().sin_cos();
        let at_corner = angle % 120.0 == 0.0;
        assert!(lit(&disk, 0.85 * cos, 0.85 * sin), "{angle}");
        assert_eq!(lit(&triangle, 0.75 * cos, 0.75 * sin), at_corner, "{angle}");
        assert!(lit(&triangle, 0.3 * cos, 0.3 * sin), "{angle}");
    }
    let turned = star(json!({ "count": 3, "rotation_degrees": 60 }));
    assert!(lit(&turned, -0.75, 0.0) && !lit(&turned, 0.75, 0.0));
}

/// A ball in motion before a camera.
fn blurred(camera: Value, motion: Value) -> Image {
    let mut scene = scene(json!({ "vertical_fov_degrees": 20 }));
    merge(&mut scene["camera"], camera);
    scene["sampler"]["spp"] = json!(64);
    scene["shapes"] =
        json!([{ "type": "sphere", "radius": 0.4, "transform": [{ "translate": [0, 0, 1] }], "motion": motion }]);
    render(&scene)
}

/// Along x, from one place to another.
fn flight(times: [f64; 2], places: [f64; 2]) -> Value {
    json!([
        { "time": times[0], "transform": [{ "translate": [places[0], 0, 0] }] },
        { "time": times[1], "transform": [{ "translate": [places[1], 0, 0] }] }
    ])
}

/// Rounding may turn a sample at an outline into a miss, in few pixels and by few samples.
#[track_caller]
fn assert_alike(a: &Image, b: &Image, what: &str) {
    let (a, b) = (colors(a), colors(b));
    let largest = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    let differing = a.iter().zip(&b).filter(|(a, b)| largest(a, b) > 1e-3).count();
    let lit = a.iter().filter(|p| **p != [0.0; 3]).count();
    assert!(differing <= 3 && lit >= 4, "{what}: {differing} pixels of {lit} differ");
    assert!(a.iter().zip(&b).all(|(a, b)| largest(a, b) < 0.05), "{what}");
}

#[test]
fn a_moving_camera_sees_what_a_camera_at_rest_sees_move_the_other_way() {
    for camera in [
        json!({}),
        json!({ "lens": { "radius": 0.1, "focus_distance": 3 } }),
        json!({ "type": "environment", "vertical_fov_degrees": null }),
    ] {
        let mut moving = camera.clone();
        moving["motion"] = flight([0.0, 1.0], [0.5, -0.5]);
        let from_camera = blurred(moving, json!([]));
        let of_ball = blurred(camera.clone(), flight([0.0, 1.0], [-0.5, 0.5]));
        assert_alike(&from_camera, &of_ball, &camera.to_string());
        let at_rest = blurred(camera, json!([]));
        assert_ne!(colors(&at_rest), colors(&of_ball));
    }
}

#[test]
fn depth_is_that_at_the_time_of_the_ray() {
    // Towards a wall at z = 0 from z = 5 to 4, evenly: the mean depth is 4.5. That from where the camera stood first is
    // 5.
    let mut scene =
        scene(json!({ "motion": [{ "time": 0 }, { "time": 1, "transform": [{ "translate": [0, 0, -1] }] }] }));
    scene["shapes"] = json!([{ "type": "quad", "transform": [{ "scale": 100 }] }]);
    scene["integrator"]["type"] = json!("depth");
    scene["sampler"]["spp"] = json!(256);
    let depths: Vec<f32> = colors(&render(&scene)).iter().map(|p| p[0]).collect();
    // Standard deviations: 0.018 of a pixel and 0.0008 of the mean.
    let mean = depths.iter().sum::<f32>() / depths.len() as f32;
    assert!((mean - 4.5).abs() < 0.005 && depths.iter().all(|depth| (depth - 4.5).abs() < 0.12), "{mean}");
}

#[test]
fn the_shutter_chooses_a_part_of_the_motion() {
    let whole = flight([0.0, 1.0], [-0.5, 0.5]);
    let part = blurred(json!({ "shutter": [0.25, 0.75] }), whole.clone());
    assert_alike(&part, &blurred(json!({}), flight([0.0, 1.0], [-0.25, 0.25])), "the middle half");
    // In other units of time, and beyond the last keyframe.
    let late = blurred(json!({ "shutter": [30, 50] }), flight([20.0, 40.0], [-0.5, 0.5]));
    assert_alike(
        &late,
        &blurred(
            json!({}),
            json!([
                { "time": 0 }, { "time": 0.5, "transform": [{ "translate": [0.5, 0, 0] }] },
                { "time": 1, "transform": [{ "translate": [0.5, 0, 0] }] }
            ]),
        ),
        "the end",
    );
    // A shutter without length takes a still picture of that moment.
    let still = blurred(json!({ "shutter": [0.75, 0.75] }), whole);
    assert_alike(&still, &blurred(json!({}), flight([0.0, 1.0], [0.25, 0.25])), "a moment");
    let from_camera = blurred(json!({ "shutter": [0.75, 0.75], "motion": flight([0.0, 1.0], [0.5, -0.5]) }), json!([]));
    assert_alike(&still, &from_camera, "a moment of a moving camera");
}

/// What is rendered around the picture leaves the picture as it is, bit for bit, and continues it.
#[test]
fn overscan_surrounds_the_picture() {
    let with = |overscan: u32, lens: Value| {
        let mut scene = scene(json!({ "vertical_fov_degrees": 18 }));
        merge(&mut scene["camera"], lens);
        scene["film"] = json!({ "width": 37, "height": 21, "overscan": overscan });
        scene["sampler"]["spp"] = json!(4);
        render(&scene)
    };
    for lens in [json!({}), json!({ "lens": { "radius": 0.3, "focus_distance": 5 } })] {
        let (plain, around) = (with(0, lens.clone()), with(9, lens));
        assert_eq!((around.size, around.crop, around.overscan), ([55, 39], Crop::full([55, 39]), 9));
        for (x, y) in (0..21).flat_map(|y| (0..37).map(move |x| (x, y))) {
            for kind in [LayerKind::Color, LayerKind::Z, LayerKind::P] {
                assert_eq!(plain.pixel(kind, x, y), around.pixel(kind, x + 9, y + 9), "{kind:?} {x} {y}");
            }
        }
        // The box is higher than what the camera shows.
        assert!((0..55).any(|x| around.rgb(x, 2).unwrap() != [0.0; 3]));
    }
}
