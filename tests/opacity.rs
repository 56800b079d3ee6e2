//! Opacity: leaves cut out by images, veils by numbers, and by an MTL.

use std::f32::consts::{FRAC_1_SQRT_2, PI};

use image::{ImageBuffer, Luma, Rgba};
use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::id::ShapeId;
use steradian::internal::math::{Ray, Vec3, vec3};
use steradian::internal::scene::Scene;

use crate::util::folder::Folder;
use crate::util::render::{Estimate, assert_irradiance, floor_probe, merge};

/// A red leaf on the right half of a card with nothing on its left half.
fn save_leaf(folder: &Folder) {
    ImageBuffer::from_fn(2, 1, |x, _| Rgba([255u8, 0, 0, 255 * x as u8])).save(folder.path("leaf.png")).unwrap();
    ImageBuffer::from_fn(2, 1, |x, _| Luma([255 * x as u8])).save(folder.path("mask.png")).unwrap();
}

/// A card of 2 by 2 one unit before a wall, and a light from the right.
fn card_before_a_wall(card: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 33, "height": 33, "filter": { "type": "box" } },
        // The wall's piece from -2.5 to 2.5.
        "camera": {
            "position": [0, 0, 9], "look_at": [0, 0, 0],
            "vertical_fov_degrees": 2.0 * (2.5f64 / 9.0).atan().to_degrees()
        },
        "sampler": { "spp": 4 },
        "integrator": { "type": "path", "max_depth": 2 },
        "textures": {
            "leaf": { "type": "image", "file": "leaf.png", "filter": "nearest" },
            "mask": { "type": "image", "file": "mask.png", "filter": "nearest" }
        },
        "materials": {
            "leaf": { "type": "diffuse", "albedo": { "texture": "leaf" } }, "wall": { "type": "diffuse", "albedo": 0.5 }
        },
        "shapes": [{ "type": "quad", "material": "wall", "transform": [{ "scale": 4 }] }],
        "lights": [{ "type": "directional", "direction": [-1, 0, -1], "irradiance": [3, 3, 3] }]
    });
    scene["shapes"].as_array_mut().unwrap().push(card);
    scene
}

fn quad(opacity: Value) -> Value {
    json!({ "type": "quad", "material": "leaf", "opacity": opacity, "transform": [{ "translate": [0, 0, 1] }] })
}

/// Which shape each accelerator sees along -z at x = -1/2 and 1/2, where it also tests for shadow.
fn seen(scene: &Scene) -> [u32; 2] {
    let mut found = None;
    for (kind, name) in AccelKind::ALL {
        let accel = accel::build(kind, &scene.geometry, 1).unwrap();
        let sides = [-0.5, 0.5].map(|x| {
            let ray = Ray::new(vec3(x, 0.1, 5.0), -Vec3::Z);
            let hit = accel.intersect(&ray).unwrap();
            // To just before the wall: blocked by the card alone.
            assert_eq!(accel.occluded(&Ray { t_max: 4.5, ..ray }), hit.shape != ShapeId(0), "{name}");
            hit.shape.0
        });
        assert_eq!(*found.get_or_insert(sides), sides, "{name}");
    }
    found.unwrap()
}

#[test]
fn a_leaf_card_is_seen_and_casts_a_shadow_only_where_the_leaf_is() {
    let folder = Folder::new();
    save_leaf(&folder);
    let mesh = json!({
        "type": "mesh", "material": "leaf", "opacity": { "texture": "leaf" },
        "positions": [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
        "triangles": [[0, 1, 2], [0, 2, 3]], "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]]
    });
    let mut instanced = card_before_a_wall(json!({ "type": "disk" }));
    instanced["shapes"].as_array_mut().unwrap().pop();
    instanced["objects"] = json!({ "leaf": { "shapes": [quad(json!({ "texture": "mask" }))] } });
    instanced["instances"] = json!([{ "object": "leaf" }]);
    for scene in [
        card_before_a_wall(quad(json!({ "texture": "leaf" }))),
        card_before_a_wall(quad(json!({ "texture": "mask" }))),
        card_before_a_wall(mesh),
        instanced,
    ] {
        assert_eq!(seen(&folder.compile(&scene).unwrap()), [0, 1]);
        let image = folder.render(&scene);
        let at = |x: f32| image.rgb((16.5 + x / 2.5 * 16.5) as u32, 16).unwrap();
        let lit = 3.0 * FRAC_1_SQRT_2 / PI;
        // Light passes the hole on its way to x = -1.5, the leaf stops it on its way to x = -0.5, which the camera sees
        // through the hole.
        for (x, expected) in [(-1.5, [0.5 * lit; 3]), (-0.5, [0.0; 3]), (0.5, [lit, 0.0, 0.0]), (1.5, [0.5 * lit; 3])] {
            assert!(at(x).iter().zip(expected).all(|(s, e)| (s - e).abs() < 1e-4), "{x}: {:?} {expected:?}", at(x));
        }
    }
}

#[test]
fn a_threshold_makes_all_or_nothing_of_an_opacity_for_every_accelerator() {
    let folder = Folder::new();
    // From left to right 0.2, 0.4, 0.6, 0.8.
    ImageBuffer::from_fn(4, 1, |x, _| Luma([51 * (x as u8 + 1)])).save(folder.path("steps.png")).unwrap();
    let solid = |opacity: Value, filter: &str| -> Vec<bool> {
        let mut scene = card_before_a_wall(quad(opacity));
        scene["textures"] =
            json!({ "steps": { "type": "image", "file": "steps.png", "filter": filter, "wrap": "clamp" } });
        scene["materials"]["leaf"]["albedo"] = json!(0.5);
        let scene = folder.compile(&scene).unwrap();
        let mut found: Option<Vec<bool>> = None;
        for (kind, name) in AccelKind::ALL {
            let accel = accel::build(kind, &scene.geometry, 1).unwrap();
            // Many rays over the card, from u = 0 to 1: an opacity without threshold lets some of them pass at every u.
            let rays = (0..200).map(|i| Ray::new(vec3(-0.995 + 0.01 * i as f32, 0.1, 5.0), -Vec3::Z));
            let hits: Vec<bool> = rays.map(|ray| accel.occluded(&Ray { t_max: 4.5, ..ray })).collect();
            assert_eq!(*found.get_or_insert(hits.clone()), hits, "{name}");
        }
        found.unwrap()
    };
    let count = |solid: &[bool]| solid.iter().filter(|hit| **hit).count();
    let part = |threshold: f64| json!({ "texture": "steps", "threshold": threshold });
    for (threshold, first) in [(0.0, 0), (0.2, 0), (0.21, 50), (0.5, 100), (0.8, 150), (0.81, 200), (1.0, 200)] {
        let expected: Vec<bool> = (0..200).map(|i| i >= first).collect();
        assert_eq!(solid(part(threshold), "nearest"), expected, "{threshold}");
    }
    // Of the filtered texture: it is a half in the middle between the second texel and the third, and 0.45 a quarter of
    // a texel before.
    for (threshold, first) in [(0.5, 100), (0.45, 88)] {
        let found = solid(part(threshold), "bilinear");
        assert!(
            found.iter().enumerate().all(|(i, hit)| *hit == (i >= first) || i.abs_diff(first) <= 1),
            "{threshold}: {found:?}"
        );
    }
    let veil = count(&solid(json!({ "texture": "steps" }), "nearest"));
    assert!((60..140).contains(&veil), "{veil}");
}

#[test]
fn a_number_is_the_part_of_the_light_that_a_surface_stops() {
    for (shape, layers) in [("quad", 1), ("sphere", 2)] {
        let scene = json!({
            "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
            "camera": { "position": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov_degrees": 4 },
            "sampler": { "type": "independent", "spp": 64 },
            "materials": { "black": { "type": "diffuse", "albedo": 0 } },
            "shapes": [{ "type": shape, "material": "black", "opacity": 0.25 }],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        });
        let Estimate { mean, error } = Estimate::of(&Folder::new().render(&scene), 1);
        // 5.5 standard errors: false alarm below 1e-6 with 255 degrees of freedom.
        assert!((mean - 0.75f64.powi(layers)).abs() < 5.5 * error && error > 0.0, "{shape}: {mean} +- {error}");
    }
}

#[test]
fn an_mtl_cuts_leaves_out() {
    let folder = Folder::new();
    save_leaf(&folder);
    let card = "mtllib m.mtl\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\n\
                f 1/1 2/2 3/3 4/4\n";
    folder.write("m.obj", card);
    let (whole, leaf, nothing) = ([1, 1], [0, 1], [0, 0]);
    for (mtl, opacity, expected) in [
        ("Kd 1 1 1", None, whole),
        ("map_Kd leaf.png", None, leaf),
        ("map_d mask.png", None, leaf),
        ("map_d leaf.png", None, leaf),
        ("map_d -imfchan r leaf.png", None, whole),
        ("d 0\nmap_d mask.png", None, leaf),
        ("d 0", None, nothing),
        ("Tr 1", None, nothing),
        ("d 1", None, whole),
        // Glass is seen.
        ("illum 4\nNi 1.5\nd 0", None, whole),
        ("Ke 1 1 1\nmap_d mask.png", None, leaf),
        // The scene counts.
        ("map_d mask.png", Some(json!(1)), whole),
        ("Kd 1 1 1", Some(json!({ "texture": "mask" })), leaf),
    ] {
        folder.write("m.mtl", format!("newmtl m\n{mtl}\n"));
        let mut shape = json!({ "type": "mesh", "file": "m.obj" });
        if let Some(opacity) = opacity {
            shape["opacity"] = opacity;
        }
        assert_eq!(seen(&folder.compile(&card_before_a_wall(shape)).unwrap()), expected, "{mtl}");
    }
}

#[test]
fn an_image_of_floats_beyond_1_is_no_opacity() {
    let folder = Folder::new();
    save_leaf(&folder);
    exr::prelude::write_rgb_file(folder.path("bright.exr"), 1, 1, |_, _| (2f32, 2f32, 2f32)).unwrap();
    let mut scene = card_before_a_wall(quad(json!({ "texture": "bright" })));
    scene["textures"]["bright"] = json!({ "type": "image", "file": "bright.exr" });
    let message = folder.compile(&scene).unwrap_err().to_string();
    assert!(message.contains("shapes[1].opacity.texture: ") && message.contains("from 2 to 2"), "{message}");
}

/// A square light with its left half cut out, half of a veil, and a sphere whose inside shines through its outside, by
/// every strategy: points chosen on the light must count as often as rays meet it.
#[test]
fn light_comes_from_what_is_there_of_a_shape_with_holes() {
    // Textures with u below 1/2 cut out; a point below the middle of a square sees a quarter of it in the fraction f of
    // all directions.
    let textures = json!({ "half": { "type": "checker", "color0": [0, 0, 0], "color1": [1, 1, 1], "scale": [1, 0] },
        "dim": { "type": "checker", "color0": [0.4, 0.4, 0.4], "color1": [0.6, 0.6, 0.6], "scale": [1, 0] } });
    let f = FRAC_1_SQRT_2 * FRAC_1_SQRT_2.atan() / PI;
    let half = json!({ "texture": "half" });
    let quad =
        json!({ "type": "quad", "origin": [-1, 1, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "opacity": half });
    let veil =
        json!({ "type": "quad", "origin": [-1, 1, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "opacity": 0.5 });
    let mesh = json!({
        "type": "mesh", "positions": [[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]],
        "triangles": [[0, 1, 2], [0, 2, 3]],
        "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]], "opacity": half
    });
    let mut cut = quad.clone();
    cut["opacity"] = json!({ "texture": "dim", "threshold": 0.5 });
    let sphere = json!({ "type": "sphere", "radius": 0.5, "opacity": 0.5, "transform": [{ "translate": [0, 1, 0] }] });
    for (shape, two_sided, expected) in [
        (quad, false, 2.0 * f),
        (cut, false, 2.0 * f),
        (veil, false, 2.0 * f),
        (mesh, false, 2.0 * f),
        (sphere, true, 0.75 * 0.25),
    ] {
        let mut light = shape.clone();
        merge(
            &mut light,
            json!({ "material": "black", "emission": { "radiance": [1, 1, 1], "two_sided": two_sided } }),
        );
        let mut scene = floor_probe([0.0; 3], json!([light]));
        scene["textures"] = textures.clone();
        assert_irradiance(&scene, f64::from(PI * expected), &shape.to_string());
    }
}
