//! Renders of glTF files: images upright, normal maps the right way round, holes, sides that give light.

use serde_json::{Value, json};
use steradian::desc::FilterDesc;
use steradian::internal::accel::AccelKind;
use steradian::internal::compile;
use steradian::internal::film::Image;
use steradian::internal::import::{ImportOptions, read_scene};
use steradian::internal::render::{Overrides, Settings};

use crate::util::folder::Folder;
use crate::util::render::{Prepared, merge, render_with};

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const GONE: [u8; 4] = [255, 255, 255, 0];

/// A square of two units about the origin, facing +Z, its image (`map.png`) upright, seen by a camera that shows just
/// it; a dim light is there.
fn square(material: Value) -> Value {
    let floats: [f32; 20] =
        [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let bytes = floats.iter().flat_map(|x| x.to_le_bytes()).chain([0, 1, 2, 0, 2, 3]);
    let data: String = bytes.map(|b| format!("%{b:02x}")).collect();
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [
            { "mesh": 0 },
            { "camera": 0, "translation": [0, 0, 5] },
            { "translation": [0, 0, 900], "extensions": { "KHR_lights_punctual": { "light": 0 } } }
        ],
        "meshes": [{
            "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }]
        }],
        "cameras": [{ "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 10 } }],
        "materials": [material],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "magFilter": 9728 }],
        "images": [{ "uri": "map.png" }],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 1e-6 }] } },
        "buffers": [{ "byteLength": 86, "uri": format!("data:application/octet-stream,{data}") }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 6 }
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR" }
        ]
    })
}

fn render(gltf: &Value, map: [[u8; 4]; 4]) -> Image {
    let folder = Folder::new();
    image::RgbaImage::from_raw(2, 2, map.concat()).unwrap().save(folder.path("map.png")).unwrap();
    let path = folder.write("scene.gltf", gltf.to_string());
    let mut imported = read_scene(&path, &ImportOptions::default()).unwrap();
    let film = &mut imported.desc.film;
    (film.width, film.height, film.filter) = (4, 4, FilterDesc::Box { radius: 0.5, samples: None });
    imported.desc.sampler.spp = 16;
    let settings = Settings::new(&imported.desc, &Overrides { threads: Some(2), ..Overrides::default() }).unwrap();
    let scene = compile::compile_from(&imported.desc, imported.source(&path)).unwrap();
    render_with(&Prepared { scene, settings }, AccelKind::EMBREE).image
}

/// The middles of the quarters of the picture, row by row from the top.
fn quarters(image: &Image) -> [[f32; 3]; 4] {
    [(0, 0), (3, 0), (0, 3), (3, 3)].map(|(x, y)| image.rgb(x, y).unwrap())
}

#[track_caller]
fn assert_shows(image: &Image, expected: [[u8; 4]; 4]) {
    for (found, expected) in quarters(image).iter().zip(expected) {
        let expected = if expected[3] == 0 { [0; 3] } else { [expected[0], expected[1], expected[2]] };
        let near = |k: usize| (found[k] - f32::from(expected[k]) / 255.0).abs() < 1e-3;
        assert!((0..3).all(near), "{:?}", quarters(image));
    }
}

fn unlit(texture: Value) -> Value {
    json!({ "pbrMetallicRoughness": { "baseColorTexture": texture }, "extensions": { "KHR_materials_unlit": {} } })
}

#[test]
fn images_stand_upright() {
    let map = [RED, GREEN, BLUE, [255, 255, 255, 255]];
    assert_shows(&render(&square(unlit(json!({ "index": 0 }))), map), map);
}

#[test]
fn transforms_move_images_by_the_extension() {
    let map = [RED, GREEN, BLUE, [255, 255, 255, 255]];
    let white = map[3];
    let moved = |transform: Value, expected: [[u8; 4]; 4]| {
        let texture = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
        assert_shows(&render(&square(unlit(texture)), map), expected);
    };
    moved(json!({ "offset": [0.5, 0] }), [GREEN, RED, white, BLUE]);
    moved(json!({ "offset": [0, 0.5] }), [BLUE, white, RED, GREEN]);
    moved(json!({ "scale": [0.5, 1] }), [RED, RED, BLUE, BLUE]);
    moved(json!({ "scale": [1, 0.5], "offset": [0, 0.5] }), [BLUE, white, BLUE, white]);
    // uv turned counter-clockwise by a quarter about its origin, the upper left corner: u' = v, v' = -u. So the image
    // turns clockwise.
    moved(json!({ "rotation": std::f64::consts::FRAC_PI_2 }), [BLUE, RED, white, GREEN]);
    moved(json!({ "rotation": std::f64::consts::FRAC_PI_2, "offset": [0, 0.5] }), [RED, BLUE, GREEN, white]);
}

#[test]
fn masks_cut_holes() {
    let mut material = unlit(json!({ "index": 0 }));
    let map = [RED, GONE, GREEN, GONE];
    assert_shows(&render(&square(material.clone()), map), [RED, [255; 4], GREEN, [255; 4]]);
    merge(&mut material, json!({ "alphaMode": "MASK" }));
    assert_shows(&render(&square(material), map), map);
}

#[test]
fn the_back_gives_light_only_where_it_is_a_side() {
    let seen = |double_sided: bool, turned: bool| {
        let mut gltf = square(json!({ "emissiveFactor": [1, 1, 1], "doubleSided": double_sided }));
        // The lower right half.
        gltf["accessors"][2]["count"] = json!(3);
        if turned {
            gltf["nodes"][0]["rotation"] = json!([0, 1, 0, 0]);
        }
        quarters(&render(&gltf, [RED; 4])).iter().any(|pixel| pixel[0] > 0.9)
    };
    assert_eq!(
        [(false, false), (true, false), (false, true), (true, true)].map(|(d, t)| seen(d, t)),
        [true, true, false, true]
    );
}

/// A normal tilted towards a light makes a surface brighter: red to the right in the image, green up in it.
#[test]
fn normal_maps_have_green_upward() {
    let code = |x: f32| ((0.5 * x + 0.5) * 255.0).round() as u8;
    let (sin, cos) = (0.5 * 0.6f64.asin()).sin_cos();
    // From above and from the right: the light's -Z turned about x and y.
    for (tilt, rotation) in [([0.0, 0.6, 0.8], json!([-sin, 0, 0, cos])), ([0.6, 0.0, 0.8], json!([0, sin, 0, cos]))] {
        let brightness = |with_map: bool, flip: f32| {
            let mut material = json!({ "pbrMetallicRoughness": { "metallicFactor": 0 } });
            if with_map {
                material["normalTexture"] = json!({ "index": 0 });
            }
            let mut gltf = square(material);
            gltf["extensions"]["KHR_lights_punctual"]["lights"][0] = json!({ "type": "directional", "intensity": 3 });
            gltf["nodes"][2]["rotation"] = rotation.clone();
            let pixel = [code(flip * tilt[0]), code(flip * tilt[1]), code(tilt[2]), 255];
            quarters(&render(&gltf, [pixel; 4])).iter().map(|p| p[1]).sum::<f32>()
        };
        let flat = brightness(false, 1.0);
        let (towards, away) = (brightness(true, 1.0) / flat, brightness(true, -1.0) / flat);
        // The cosines are 1, 0.8 and 0.28.
        assert!((towards - 1.25).abs() < 0.12 && (away - 0.35).abs() < 0.12, "{tilt:?}: {towards} {away}");
    }
}

#[test]
fn a_surface_of_glass_shows_what_is_behind() {
    let mut gltf = square(json!({
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0, "baseColorFactor": [1, 0.5, 1, 1] },
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } }
    }));
    gltf["materials"].as_array_mut().unwrap().push(unlit(json!({ "index": 0 })));
    let mut behind = gltf["meshes"][0].clone();
    behind["primitives"][0]["material"] = json!(1);
    gltf["meshes"].as_array_mut().unwrap().push(behind);
    gltf["nodes"].as_array_mut().unwrap().push(json!({ "mesh": 1, "translation": [0, 0, -1] }));
    gltf["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    let [pixel, ..] = quarters(&render(&gltf, [[255; 4]; 4]));
    // A pane of index 1.5 lets 0.92 pass, tinted by its colour.
    assert!((pixel[0] - 0.92).abs() < 0.08 && (pixel[1] / pixel[0] - 0.5).abs() < 0.05, "{pixel:?}");
}
