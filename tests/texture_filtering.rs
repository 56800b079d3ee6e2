//! Images that are smaller in the picture than they are: less noise, and no blur that stays.

use image::{ImageBuffer, Luma};
use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::film::Image;
use steradian::internal::render::{self, Overrides, Settings};
use steradian::internal::{compile, import};

use crate::bad_input::assert_error;
use crate::util::folder::Folder;
use crate::util::render::{Prepared, merge, pixels, render_with};

/// A folder with noise of 128 x 128 texels.
fn folder() -> Folder {
    let folder = Folder::new();
    let texel = |x: u32, y: u32| {
        let hash =
            u64::from(x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Luma([(hash >> 40) as u8])
    };
    ImageBuffer::from_fn(128, 128, texel).save(folder.path("noise.png")).unwrap();
    folder
}

/// A floor with the noise to the horizon. Its light comes from everywhere and is found by following the BSDF, so that
/// nothing but the texture is noisy.
fn floor(filter: &str, spp: u32, rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 48, "height": 32, "filter": { "type": "box" } },
        "camera": { "position": [0, 1, 4], "look_at": [0, 0.5, 0], "vertical_fov_degrees": 40.0 },
        "sampler": { "spp": spp },
        "integrator": { "type": "path", "max_depth": 6, "strategy": "bsdf" },
        "textures": {
            "noise": {
                "type": "image", "file": "noise.png", "filter": filter, "color_space": "linear", "scale": [100, 100]
            }
        },
        "materials": {
            "floor": { "type": "diffuse", "albedo": { "texture": "noise" } }, "mirror": { "type": "mirror" }
        },
        "shapes": [{
            "type": "quad", "material": "floor", "origin": [-100, 0, 100], "edge_u": [200, 0, 0], "edge_v": [0, 0, -200]
        }],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    merge(&mut scene, rest);
    scene
}

fn relative_mse(reference: &Image, test: &Image) -> f64 {
    let errors = pixels(reference).zip(pixels(test)).map(|(r, t)| {
        let (r, t) = (f64::from(r[1]), f64::from(t[1]));
        (t - r) * (t - r) / (r * r + 0.01)
    });
    errors.sum::<f64>() / (48.0 * 32.0)
}

#[test]
fn filtered_images_have_less_noise_and_converge_to_the_same_picture() {
    let folder = folder();
    let error = |reference: &Image, filter: &str, spp: u32| {
        relative_mse(reference, &folder.render(&floor(filter, spp, json!({}))))
    };
    let reference = folder.render(&floor("bilinear", 1024, json!({ "sampler": { "seed": 7 } })));
    let [points, filtered] = ["bilinear", "trilinear"].map(|filter| error(&reference, filter, 4));
    assert!(filtered < 0.2 * points, "{filtered} {points}");
    let [points, filtered] = ["bilinear", "trilinear"].map(|filter| error(&reference, filter, 1024));
    assert!(filtered < 1.2 * points, "{filtered} {points}");
}

#[test]
fn an_image_seen_from_near_is_the_same_to_the_last_bit() {
    let folder = folder();
    let near = json!({ "camera": { "position": [0, 0.02, 0.02], "look_at": [0, 0, 0] } });
    let [points, filtered] = ["bilinear", "trilinear"].map(|filter| folder.render(&floor(filter, 4, near.clone())));
    assert_eq!(points, filtered);
    // From where texels are small, it is not.
    let [points, filtered] = ["bilinear", "trilinear"].map(|filter| folder.render(&floor(filter, 4, json!({}))));
    assert_ne!(points, filtered);
}

/// The variance between pixels: what a blur takes away.
fn contrast(image: &Image) -> f64 {
    let values: Vec<f64> = pixels(image).map(|p| f64::from(p[1])).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64
}

#[test]
fn a_mirror_shows_what_is_seen_without_it_as_sharp() {
    let folder = folder();
    // Towards the floor, from before a mirror and from behind it.
    let direct = json!({ "camera": { "position": [0, 3, -4], "look_at": [0, 0, 3] } });
    let mut mirrored = json!({ "camera": { "position": [0, 3, 4], "look_at": [0, 0, -3] } });
    let mirror = json!({
        "type": "quad", "material": "mirror", "origin": [-20, 0, 0], "edge_u": [40, 0, 0], "edge_v": [0, 20, 0]
    });
    let shapes = floor("trilinear", 1, json!({}))["shapes"]
        .as_array()
        .unwrap()
        .iter()
        .cloned()
        .chain([mirror])
        .collect::<Vec<_>>();
    mirrored["shapes"] = json!(shapes);
    let contrast_of = |mut rest: Value| {
        merge(&mut rest, json!({ "textures": { "noise": { "scale": [30, 30] } } }));
        contrast(&folder.render(&floor("trilinear", 4, rest)))
    };
    let [direct, mirrored] = [direct, mirrored].map(contrast_of);
    assert!((mirrored / direct - 1.0).abs() < 0.3, "{mirrored} {direct}");
}

fn prepared(folder: &Folder, scene: &Value, threads: u32) -> Prepared {
    let path = folder.write("scene.json", scene.to_string());
    let desc = import::load_scene(&path).unwrap();
    let settings =
        Settings::new(&desc, &Overrides { threads: Some(threads as usize), ..Overrides::default() }).unwrap();
    Prepared { scene: compile::compile(&desc, &path).unwrap(), settings }
}

#[test]
fn filtered_images_are_the_same_for_any_number_of_threads_and_in_a_replay() {
    let folder = folder();
    // A ball over the floor, which see each other by diffuse light.
    let ball = json!({ "type": "sphere", "material": "floor", "transform": [{ "translate": [0, 1, 0] }] });
    let mut scene = floor("trilinear", 3, json!({ "film": { "width": 80, "height": 70 } }));
    scene["shapes"].as_array_mut().unwrap().push(ball);
    let images: Vec<Image> =
        [1, 3, 8].map(|threads| render_with(&prepared(&folder, &scene, threads), AccelKind::EMBREE).image).into();
    assert!(images.windows(2).all(|w| w[0] == w[1]));

    let prepared = prepared(&folder, &scene, 1);
    let accel = accel::build(AccelKind::EMBREE, &prepared.scene.geometry, 1).unwrap();
    let sample = |s| {
        f64::from(render::replay(&prepared.scene, &*accel, &prepared.settings, [41, 30], s).unwrap().pixel.radiance.g)
    };
    assert_eq!(images[0].rgb(41, 30).unwrap()[1], ((0..3).map(sample).sum::<f64>() / 3.0) as f32);
}

#[test]
fn only_materials_with_images_need_cones() {
    let folder = folder();
    let filters = |scene: Value| folder.compile(&scene).unwrap().features.filtered_textures;
    assert!(filters(floor("trilinear", 1, json!({}))));
    assert!(!filters(floor("bilinear", 1, json!({}))));
    assert!(!filters(floor("nearest", 1, json!({}))));
    // Where only holes are textured, which are the same for every ray.
    let mut scene = floor("trilinear", 1, json!({ "materials": { "floor": { "albedo": 0.5 } } }));
    scene["shapes"][0]["opacity"] = json!({ "texture": "noise" });
    assert!(!filters(scene));
}

#[test]
fn filters_that_do_not_exist() {
    for (filter, known) in [(json!("cubic"), "trilinear"), (json!(3), "expected"), (json!(["trilinear"]), "expected")] {
        let mut scene = floor("trilinear", 1, json!({}));
        scene["textures"]["noise"]["filter"] = filter;
        assert_error(&folder(), &scene, ErrorKind::Scene, &["textures.noise.filter", known]);
    }
}
