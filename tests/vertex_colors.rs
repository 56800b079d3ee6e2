//! Colours of vertices: in pictures, from every kind of file, and what is refused.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::color::linear_from_srgb;
use steradian::internal::math::Vec3;

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
    json!({
        "type": "mesh", "material": "m", "positions": CORNERS, "triangles": [[0, 1, 2], [0, 2, 3]], "colors": linear()
    })
}

fn ply<T: ToString>(kind: &str, colors: [[T; 3]; 4]) -> String {
    let words = |row: &[T; 3]| row.iter().map(T::to_string).collect::<Vec<_>>().join(" ");
    let rows: String =
        CORNERS.iter().zip(&colors).map(|([x, y, z], color)| format!("{x} {y} {z} {}\n", words(color))).collect();
    let property = |kind: &str, names: [&str; 3]| names.map(|name| format!("property {kind} {name}\n")).concat();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\n{}{}element face 1\nproperty list uchar int vertex_indices\n\
         end_header\n{rows}4 0 1 2 3\n",
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
        let expected = if u > v { a * (1.0 - u) + b * (u - v) + c * v } else { a * (1.0 - v) + c * u + d * (v - u) };
        // A pixel on the diagonal is a mean over both sides; elsewhere samples are spread evenly over it.
        let bound = if (u - v).abs() < 0.01 { 0.05 } else { 0.01 };
        assert!((Vec3::from(found) - expected).abs().max_element() < bound, "{i}: {found:?} for {expected}");
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
    for (found, expected) in pixels(&folder.render(&scene)).zip(&expected) {
        assert!(
            (2.0 * Vec3::from(found) - Vec3::from(*expected)).abs().max_element() < 1e-4,
            "{found:?} for {expected:?}"
        );
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
        (
            json!({ "type": "mesh", "material": "m", "file": "plain.obj" }),
            ErrorKind::Scene,
            ["shapes[0]", "plain.obj", "\"m\""],
        ),
        (
            json!({ "type": "mesh", "material": "m", "file": "bad.ply" }),
            ErrorKind::Scene,
            ["bad.ply", "vertex 1", "-0.25"],
        ),
        (
            json!({ "type": "mesh", "material": "m", "file": "nan.ply" }),
            ErrorKind::Scene,
            ["nan.ply", "Line 15", "NaN"],
        ),
    ] {
        assert_error(&folder, &scene_of(shape), kind, &parts);
    }
    // Media are evaluated at every hit, with textures and without.
    let mut medium = scene_of(json!({ "type": "sphere", "material": "m" }));
    set(
        &mut medium,
        "materials.m",
        json!({ "type": "dielectric", "priority": 1, "roughness": { "texture": "colors" } }),
    );
    assert_error(&folder, &medium, ErrorKind::Scene, &["shapes[0]", "\"m\"", "the shape has none"]);
    let mut few = scene_of(inline());
    set(&mut few, "shapes[0].colors", json!([[1, 1, 1], [0, 0, 0]]));
    assert_error(&folder, &few, ErrorKind::Scene, &["shapes[0]", "\"vertex_color\": 2 for 4 vertices"]);
    // Parts of a material count, too.
    let mut mixed = good_scene();
    set(&mut mixed, "textures.colors", json!({ "type": "vertex_color" }));
    set(
        &mut mixed,
        "textures.tinted",
        json!({ "type": "product", "factors": [{ "texture": "colors" }, { "texture": "tiles" }] }),
    );
    set(&mut mixed, "materials.colored", json!({ "type": "plastic", "albedo": { "texture": "tinted" } }));
    set(&mut mixed, "materials.sides", json!({ "type": "two_sided", "front": "Gold", "back": "colored" }));
    set(&mut mixed, "materials.coated", json!({ "type": "coated", "base": "sides" }));
    assert!(folder.compile(&mixed).is_ok());
    set(&mut mixed, "shapes[3].material", json!("coated"));
    assert_error(&folder, &mixed, ErrorKind::Scene, &["shapes[3]", "\"coated\""]);
}

#[test]
fn relief_takes_no_colours_of_vertices() {
    let folder = Folder::new();
    let texture = json!({ "texture": "colors" });
    let mut scene = scene_of(inline());
    set(
        &mut scene,
        "materials.bumpy",
        json!({ "type": "relief", "material": "m", "bump_map": { "texture": "colors", "height": 1 } }),
    );
    assert_error(&folder, &scene, ErrorKind::Scene, &["materials.bumpy", "\"colors\" takes attributes of meshes"]);
    // Numbers of materials are luminances.
    let mut scene = scene_of(inline());
    set(&mut scene, "materials.m.roughness", texture.clone());
    set(&mut scene, "materials.gold", json!({ "type": "conductor", "metal": "gold" }));
    set(&mut scene, "materials.mixed", json!({ "type": "mix", "materials": ["m", "gold"], "amount": texture }));
    set(&mut scene, "shapes[0].material", json!("mixed"));
    folder.render(&scene);
}

/// A PLY file of the square with colours and numbers of vertices and faces.
fn attributes_ply() -> String {
    let row =
        |([x, y, z], i): (&[f32; 3], usize)| format!("{x} {y} {z} {} {} 0 {}\n", 0.25 * i as f32, 0.5, 0.1 * i as f32);
    let rows: String = CORNERS.iter().zip(0..).map(row).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\n{}element face 3\nproperty list uchar int vertex_indices\n\
         {}end_header\n{rows}3 0 0 1 0.9 0.9 0.9 0.9\n\
         3 0 1 2 1 0 0.5 0.25\n3 0 2 3 0 1 0.5 0.75\n",
        ["x", "y", "z", "tint_0", "tint_1", "tint_2", "a_0"].map(|name| format!("property float {name}\n")).concat(),
        ["tint_0", "tint_1", "tint_2", "b_0"].map(|name| format!("property float {name}\n")).concat()
    )
}

#[test]
fn attributes_of_vertices_and_faces_are_colours_numbers_holes_and_light() {
    let folder = Folder::new();
    folder.write("m.ply", attributes_ply());
    let scene = |attribute: &str, of_texture: Value, shape: Value| {
        let mut scene = scene_of(json!({ "type": "mesh", "material": "m", "file": "m.ply" }));
        set(&mut scene, "textures.colors", json!({ "type": "mesh_attribute", "name": attribute }));
        for (whole, changes) in [("textures.colors", of_texture), ("shapes[0]", shape)] {
            changes
                .as_object()
                .unwrap()
                .iter()
                .for_each(|(key, value)| set(&mut scene, &format!("{whole}.{key}"), value.clone()));
        }
        scene
    };
    let shown = |scene: &Value| -> Vec<[f32; 3]> { pixels(&folder.render(scene)).collect() };
    // Right and below the diagonal the first triangle with an area, else the second: the one without is left out with
    // its values.
    let corners = |image: &[[f32; 3]]| [image[16 * 15 + 15], image[0]];
    let none = || json!({});
    let is_near = |found: [[f32; 3]; 2], expected: [[f32; 3]; 2], bound: f32| {
        let near = found.as_flattened().iter().zip(expected.as_flattened()).all(|(a, b)| (a - b).abs() < bound);
        assert!(near, "{found:?} for {expected:?}");
    };
    is_near(corners(&shown(&scene("face_tint", none(), none()))), [[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]], 1e-5);
    is_near(corners(&shown(&scene("face_b", none(), none()))), [[0.25; 3], [0.75; 3]], 1e-5);
    is_near(corners(&shown(&scene("face_b", json!({ "scale": 0.5 }), none()))), [[0.125; 3], [0.375; 3]], 1e-5);
    // Half a pixel from the second and the fourth corner.
    is_near(corners(&shown(&scene("vertex_tint", none(), none()))), [[0.25, 0.5, 0.0], [0.71875, 0.5, 0.0]], 0.005);
    is_near(corners(&shown(&scene("vertex_a", none(), none()))), [[0.1; 3], [0.2875; 3]], 0.005);

    // Light, brighter than 1; points on it that are sampled have the same radiance.
    let light = json!({ "emission": { "radiance": [1, 1, 1], "texture": "colors" } });
    let mut lit = scene("face_b", json!({ "scale": 4 }), light);
    set(&mut lit, "materials.m.albedo", json!(0));
    is_near(corners(&shown(&lit)), [[1.0; 3], [3.0; 3]], 1e-5);
    set(&mut lit, "integrator", json!({ "type": "path" }));
    is_near(corners(&shown(&lit)), [[1.0; 3], [3.0; 3]], 1e-5);

    // Holes: means over 16 * 64 samples of a half each are within 5.5 standard deviations (false alarm 4e-8).
    let mut holes = scene("face_b", none(), json!({ "opacity": { "texture": "colors" } }));
    set(&mut holes, "materials.m.albedo", json!(1));
    set(&mut holes, "sampler", json!({ "type": "independent", "spp": 64 }));
    let image = shown(&holes);
    for (expected, is_first) in [(0.25f32, true), (0.75, false)] {
        let of_half = |i: usize| (i % 16 > i / 16) == is_first && i % 16 != i / 16;
        let alike: Vec<f32> = (0..256).filter(|&i| of_half(16 * (15 - i / 16) + i % 16)).map(|i| image[i][0]).collect();
        let mean = alike.iter().sum::<f32>() / alike.len() as f32;
        let deviation = (expected * (1.0 - expected) / (alike.len() * 64) as f32).sqrt();
        assert!((mean - expected).abs() < 5.5 * deviation, "{mean} for {expected}");
    }
}

#[test]
fn attributes_of_inline_meshes_and_their_faults() {
    let folder = Folder::new();
    folder.write("m.ply", attributes_ply());
    let inline = json!({
        "type": "mesh", "material": "m", "positions": CORNERS, "triangles": [[0, 1, 2], [0, 2, 3]],
        "attributes": {
            "face_tint": [[1, 0, 0.5], [0, 1, 0.5]], "vertex_a": [0, 0.1, 0.2, 0.3], "vertex_unused": [-1, 9, 9, 9]
        }
    });
    let with = |shape: &Value, attribute: &str| {
        let mut scene = scene_of(shape.clone());
        set(&mut scene, "textures.colors", json!({ "type": "mesh_attribute", "name": attribute }));
        scene
    };
    let file = json!({ "type": "mesh", "material": "m", "file": "m.ply" });
    for attribute in ["face_tint", "vertex_a"] {
        let of_file: Vec<[f32; 3]> = pixels(&folder.render(&with(&file, attribute))).collect();
        assert!(pixels(&folder.render(&with(&inline, attribute))).eq(of_file.iter().copied()), "{attribute}");
    }
    assert_error(
        &folder,
        &with(&file, "vertex_b"),
        ErrorKind::Scene,
        &["m.ply", "\"m\"", "\"vertex_b\": the shape has none"],
    );
    assert_error(&folder, &with(&file, "b"), ErrorKind::Scene, &["textures.colors.name", "vertex_ or face_"]);
    assert_error(&folder, &with(&inline, "vertex_unused"), ErrorKind::Scene, &["vertex 0", "-1", "within 0 and 1"]);
    let mut bad = with(&inline, "face_tint");
    set(&mut bad, "shapes[0].attributes.face_tint", json!([1, 0, 1]));
    assert_error(&folder, &bad, ErrorKind::Scene, &["shapes[0]", "\"face_tint\": 3 for 2 triangles"]);
    set(&mut bad, "shapes[0].attributes.face_tint", json!([0.5, 1.25]));
    assert_error(&folder, &bad, ErrorKind::Scene, &["triangle 1", "1.25"]);
    set(&mut bad, "shapes[0].attributes", json!({ "tint": [1, 1] }));
    assert_error(&folder, &bad, ErrorKind::Scene, &["shapes[0].attributes.tint"]);
}
