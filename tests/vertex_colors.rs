//! Colours of vertices: in pictures, from every kind of file, and what is refused.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::color::linear_from_srgb;
use steradian::math::Vec3;

use crate::bad_input::assert_error;
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::pixels;

const CORNERS: [[f32; 3]; 4] = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
/// Encoded: red, green, blue, and a grey.
const BYTES: [[u8; 3]; 4] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [188, 188, 51]];

fn linear() -> [[f32; 3]; 4] {
    BYTES.map(|color| color.map(|byte| linear_from_srgb(f32::from(byte) / 255.0)))
}

/// A scene that shows the colour of its one shape, which fills the picture.
fn scene_of(shape: Value) -> Value {
    json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": { "type": "orthographic", "view_height": 2, "position": [0, 0, 5], "look_at": [0, 0, 0] },
        "integrator": { "type": "whitted", "ambient": [1, 1, 1] },
        "sampler": { "spp": 16 },
        "textures": { "colors": { "type": "vertex_color" } },
        "materials": { "m": { "type": "diffuse", "albedo": { "texture": "colors" } } },
        "shapes": [shape]
    })
}

fn inline() -> Value {
    json!({ "type": "mesh", "material": "m", "positions": CORNERS, "triangles": [[0, 1, 2], [0, 2, 3]], "colors": linear() })
}

fn ply<T: ToString>(kind: &str, colors: [[T; 3]; 4]) -> String {
    let words = |row: &[T; 3]| row.iter().map(T::to_string).collect::<Vec<_>>().join(" ");
    let rows: String = CORNERS.iter().zip(&colors).map(|([x, y, z], color)| format!("{x} {y} {z} {}\n", words(color))).collect();
    let property = |kind: &str, names: [&str; 3]| names.map(|name| format!("property {kind} {name}\n")).concat();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\n{}{}element face 1\nproperty list uchar int vertex_indices\nend_header\n{rows}4 0 1 2 3\n",
        property("float", ["x", "y", "z"]),
        property(kind, ["red", "green", "blue"])
    )
}

fn obj() -> String {
    let encoded = |[r, g, b]: [u8; 3]| [r, g, b].map(|byte| f32::from(byte) / 255.0);
    let row = |([x, y, z], color): (&[f32; 3], [u8; 3])| {
        let [r, g, b] = encoded(color);
        format!("v {x} {y} {z} {r} {g} {b}\n")
    };
    CORNERS.iter().zip(BYTES).map(row).chain(["f 1 2 3 4\n".into()]).collect()
}

#[test]
fn a_square_shows_the_colours_between_its_corners() {
    let image = Folder::new().render(&scene_of(inline()));
    let [a, b, c, d] = linear().map(Vec3::from);
    for (i, found) in pixels(&image).enumerate() {
        let (x, y) = ((i % 16) as f32 / 8.0 + 1.0 / 16.0, 2.0 - ((i / 16) as f32 / 8.0 + 1.0 / 16.0));
        let (u, v) = (0.5 * x, 0.5 * y);
        // Both triangles have the diagonal from a to c.
        let wanted = if u > v { a * (1.0 - u) + b * (u - v) + c * v } else { a * (1.0 - v) + c * u + d * (v - u) };
        // A pixel on the diagonal is a mean over both sides; elsewhere samples are spread evenly over it.
        let bound = if (u - v).abs() < 0.01 { 0.05 } else { 0.01 };
        assert!((Vec3::from(found) - wanted).abs().max_element() < bound, "{i}: {found:?} for {wanted}");
    }
}

#[test]
fn every_kind_of_file_gives_the_same_picture() {
    let folder = Folder::new();
    let expected: Vec<[f32; 3]> = pixels(&folder.render(&scene_of(inline()))).collect();
    folder.write("bytes.ply", ply("uchar", BYTES));
    folder.write("floats.ply", ply("float", linear()));
    folder.write("m.obj", obj());
    for file in ["bytes.ply", "floats.ply", "m.obj"] {
        let image = folder.render(&scene_of(json!({ "type": "mesh", "material": "m", "file": file })));
        assert!(pixels(&image).eq(expected.iter().copied()), "{file}");
    }
    // Through an instance, with creases that split vertices, and with a factor.
    let mut scene = scene_of(inline());
    let mut shape = inline();
    set(&mut shape, "shading", json!("computed"));
    set(&mut shape, "crease_angle_degrees", json!(30));
    set(&mut scene, "shapes", json!([]));
    set(&mut scene, "objects", json!({ "o": { "shapes": [shape] } }));
    set(&mut scene, "instances", json!([{ "object": "o" }]));
    set(&mut scene, "textures.half", json!({ "type": "product", "factors": [{ "texture": "colors" }, 0.5] }));
    set(&mut scene, "materials.m.albedo", json!({ "texture": "half" }));
    for (found, wanted) in pixels(&folder.render(&scene)).zip(&expected) {
        assert!((2.0 * Vec3::from(found) - Vec3::from(*wanted)).abs().max_element() < 1e-4, "{found:?} for {wanted:?}");
    }
}

#[test]
fn colours_that_nothing_shows_do_not_matter() {
    let mut scene = scene_of(inline());
    set(&mut scene, "materials.m.albedo", json!(0.5));
    set(&mut scene, "shapes[0].colors[1]", json!([7, -1, 0]));
    assert!(Folder::new().compile(&scene).is_ok());
}

#[test]
fn faults_name_the_shape_and_the_material() {
    let folder = Folder::new();
    folder.write("plain.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
    folder.write("bad.ply", ply("float", [[0.5, 0.5, 0.5], [0.5, -0.25, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]));
    folder.write("nan.ply", ply("float", [[0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, f32::NAN], [0.5, 0.5, 0.5]]));
    for (shape, kind, parts) in [
        (json!({ "type": "sphere", "material": "m" }), ErrorKind::Scene, ["shapes[0]", "\"m\"", "the shape has none"]),
        (json!({ "type": "cube", "material": "m" }), ErrorKind::Scene, ["shapes[0]", "\"m\"", "the shape has none"]),
        (json!({ "type": "mesh", "material": "m", "file": "plain.obj" }), ErrorKind::Scene, ["shapes[0]", "plain.obj", "\"m\""]),
        (json!({ "type": "mesh", "material": "m", "file": "bad.ply" }), ErrorKind::Scene, ["bad.ply", "vertex 1", "-0.25"]),
        (json!({ "type": "mesh", "material": "m", "file": "nan.ply" }), ErrorKind::Scene, ["nan.ply", "Line 15", "NaN"]),
    ] {
        assert_error(&folder, &scene_of(shape), kind, &parts);
    }
    let mut few = scene_of(inline());
    set(&mut few, "shapes[0].colors", json!([[1, 1, 1], [0, 0, 0]]));
    assert_error(&folder, &few, ErrorKind::Scene, &["shapes[0]", "colors: 2 for 4 vertices"]);
    // Parts of a material count, too.
    let mut mixed = good_scene();
    set(&mut mixed, "textures.colors", json!({ "type": "vertex_color" }));
    set(&mut mixed, "textures.tinted", json!({ "type": "product", "factors": [{ "texture": "colors" }, { "texture": "tiles" }] }));
    set(&mut mixed, "materials.colored", json!({ "type": "plastic", "albedo": { "texture": "tinted" } }));
    set(&mut mixed, "materials.sides", json!({ "type": "two_sided", "front": "Gold", "back": "colored" }));
    set(&mut mixed, "materials.coated", json!({ "type": "coated", "base": "sides" }));
    assert!(folder.compile(&mixed).is_ok());
    set(&mut mixed, "shapes[3].material", json!("coated"));
    assert_error(&folder, &mixed, ErrorKind::Scene, &["shapes[3]", "\"coated\""]);
}

#[test]
fn what_knows_only_uv_takes_no_colours_of_vertices() {
    let folder = Folder::new();
    let texture = json!({ "texture": "colors" });
    for (path, value) in [
        ("shapes[0].opacity", texture.clone()),
        ("shapes[0].emission", json!({ "radiance": [1, 1, 1], "texture": "colors" })),
        ("materials.bumpy", json!({ "type": "relief", "material": "m", "bump_map": { "texture": "colors", "height": 1 } })),
    ] {
        let mut scene = scene_of(inline());
        set(&mut scene, path, value);
        assert_error(&folder, &scene, ErrorKind::Scene, &[path, "\"colors\" has the colours of vertices"]);
    }
    // Numbers of materials are luminances.
    let mut scene = scene_of(inline());
    set(&mut scene, "materials.m.roughness", texture.clone());
    set(&mut scene, "materials.gold", json!({ "type": "conductor", "metal": "gold" }));
    set(&mut scene, "materials.mixed", json!({ "type": "mix", "materials": ["m", "gold"], "amount": texture }));
    set(&mut scene, "shapes[0].material", json!("mixed"));
    folder.render(&scene);
}
