//! Scenes far too small, too large or too far away for 32-bit coordinates: the same picture, layers in the scene's own
//! units, or an error.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::film::{Image, LayerKind};

use crate::bad_input::assert_error;
use crate::util::folder::Folder;
use crate::util::program::{run, stderr_of};

/// A scene of everything with lengths, `s` times as large and moved by `offset`.
fn scene(s: f64, offset: [f64; 3]) -> Value {
    let along = |p: [f64; 3]| p.map(|x| x * s);
    let at = |p: [f64; 3]| [0, 1, 2].map(|k| offset[k] + p[k] * s);
    json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": {
            "position": at([0.25, 1.5, 4.0]), "look_at": at([0.0, 0.5, 0.0]), "vertical_fov_degrees": 40,
            "near": 0.125 * s,
            "lens": { "radius": 0.03125 * s, "focus_distance": 4.0 * s }
        },
        "sampler": { "type": "independent", "spp": 16, "seed": 5 },
        "textures": { "bumps": { "type": "checker", "scale": [8, 8] } },
        "materials": {
            "grey": { "type": "diffuse", "albedo": 0.5 },
            "rough": { "type": "relief", "material": "grey", "bump_map": { "texture": "bumps", "height": 0.0625 * s } },
            "tea": {
                "type": "dielectric", "ior": 1.5, "absorption": { "color": [0.25, 0.5, 0.75], "distance": 0.5 * s }
            }
        },
        "shapes": [
            {
                "type": "quad", "material": "rough", "origin": at([-4.0, 0.0, 4.0]), "edge_u": along([8.0, 0.0, 0.0]),
                "edge_v": along([0.0, 0.0, -8.0])
            },
            {
                "type": "sphere", "material": "tea", "radius": 0.5 * s,
                "transform": [{ "translate": at([-0.75, 0.5, 0.25]) }]
            },
            {
                "type": "mesh", "material": "grey", "triangles": [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
                "positions": [
                    at([-1.5, 0.0625, -0.75]), at([-1.0, 0.0625, -0.5]), at([-1.25, 0.0625, -1.5]),
                    at([-1.25, 1.0, -1.0])
                ]
            },
            { "type": "disk", "radius": 0.5 * s, "emission": { "radiance": [9, 8, 7] },
              "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": at([0.0, 2.5, 0.0]) }] }
        ],
        "objects": { "block": { "shapes": [{ "type": "cube", "material": "grey" }] } },
        "instances": [{
            "object": "block", "transform": [{ "scale": 0.375 * s }, { "translate": at([0.75, 0.375, 0.5]) }],
            "motion": [
                { "time": 0, "transform": [] }, { "time": 1, "transform": [{ "translate": along([0.125, 0.0, 0.0]) }] }
            ]
        }],
        "lights": [
            { "type": "environment", "radiance": [0.25, 0.25, 0.5] },
            { "type": "point", "position": at([-1.5, 1.5, 1.5]), "intensity": [1.5 * s * s, 1.5 * s * s, 1.5 * s * s] },
            {
                "type": "spot", "position": at([1.5, 2.0, 1.5]), "look_at": at([0.0, 0.0, 0.0]),
                "intensity": [s * s, s * s, s * s]
            }
        ],
        "outputs": [{ "file": "a.exr", "layers": ["Z", "P"] }]
    })
}

/// Depth in Z where there is nothing.
const NOTHING: f32 = 1e10;

fn layer(image: &Image, kind: LayerKind) -> &[f32] {
    &image.layers.iter().find(|layer| layer.kind == kind).unwrap().data
}

/// Root mean square difference of the colours over their mean.
fn difference(a: &Image, b: &Image) -> f64 {
    let (a, b) = (layer(a, LayerKind::Color), layer(b, LayerKind::Color));
    let squares: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let mean = b.iter().map(|&b| f64::from(b)).sum::<f64>() / b.len() as f64;
    (squares / b.len() as f64).sqrt() / mean
}

#[test]
fn scales_by_powers_of_two_change_no_bit() {
    let folder = Folder::new();
    let expected = folder.render(&scene(1.0, [0.0; 3]));
    for k in [-50, -25, -8, 25, 36, 50] {
        let s = 2f64.powi(k);
        let image = folder.render(&scene(s, [0.0; 3]));
        assert_eq!(layer(&image, LayerKind::Color), layer(&expected, LayerKind::Color), "2^{k}");
        for kind in [LayerKind::Z, LayerKind::P] {
            // What is not there has a depth of its own.
            let scaled = |x: f32| if x == NOTHING { x } else { (f64::from(x) * s) as f32 };
            let expected: Vec<f32> = layer(&expected, kind).iter().map(|&x| scaled(x)).collect();
            assert_eq!(layer(&image, kind), expected, "2^{k}");
        }
    }
}

#[test]
fn scenes_far_from_the_origin_look_as_they_do_there() {
    let folder = Folder::new();
    let expected = folder.render(&scene(1.0, [0.0; 3]));
    for (offset, s) in [([5e6, 1000.0, -4e6], 1.0), ([1e10, 0.0, 0.0], 1.0), ([-3e9, 2e9, 0.0], 64.0)] {
        let image = folder.render(&scene(s, offset));
        let found = difference(&image, &expected);
        assert!(found < 1e-2, "{offset:?}: {found}");
        // Depth in the scene's units, to half a float.
        let depths = layer(&image, LayerKind::Z).iter().zip(layer(&expected, LayerKind::Z));
        for (z, expected) in depths.filter(|(z, _)| **z != NOTHING) {
            let expected = f64::from(*expected) * s;
            assert!((f64::from(*z) - expected).abs() <= 1e-3 * expected, "{z} {expected}");
        }
        // Points where the scene has them.
        let extent = 6.0 * s + 1e-6 * offset[0].abs();
        for p in layer(&image, LayerKind::P).as_chunks::<3>().0.iter().filter(|p| **p != [0.0; 3]) {
            assert!((0..3).all(|k| (f64::from(p[k]) - offset[k]).abs() <= extent), "{p:?}");
        }
    }
}

/// A tetrahedron far away, from files of every kind, looks as it does near the origin.
#[test]
fn meshes_with_map_coordinates_keep_their_digits() {
    let near = [[-0.5, 0.0, 0.25], [0.75, 0.125, 0.0], [0.0, 1.0, -0.875], [0.25, 0.25, 0.875]];
    let folder = Folder::new();
    let picture = |mesh: Value, offset: [f64; 3]| {
        let at = |p: [f64; 3]| [0, 1, 2].map(|k| offset[k] + p[k]);
        let mut mesh = mesh;
        mesh["type"] = json!("mesh");
        folder.render(&json!({
            "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
            "sampler": { "type": "independent", "spp": 4, "seed": 1 },
            "camera": { "position": at([0.0, 0.5, 4.0]), "look_at": at([0.0, 0.5, 0.0]), "vertical_fov_degrees": 30 },
            "integrator": { "type": "normal" },
            "shapes": [mesh]
        }))
    };
    let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    let expected = picture(json!({ "positions": near, "triangles": faces }), [0.0; 3]);
    let offset = [4_194_304.0, 8_388_608.0, -2_097_152.0];
    let far = near.map(|p| [0, 1, 2].map(|k| offset[k] + p[k]));
    assert_eq!(picture(json!({ "positions": far, "triangles": faces }), offset), expected);

    let lines = |prefix: &str, rows: &[[f64; 3]]| -> String {
        rows.iter().map(|[x, y, z]| format!("{prefix}{x:?} {y:?} {z:?}\n")).collect()
    };
    let obj_faces: String = faces.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect();
    folder.write("m.obj", format!("{}{obj_faces}", lines("v ", &far)));
    assert_eq!(picture(json!({ "file": "m.obj" }), offset), expected);

    let ply_faces: String = faces.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
                  element face 4\n\
                  property list uchar int vertex_indices\nend_header\n";
    folder.write("m.ply", format!("{header}{}{ply_faces}", lines("", &far)));
    assert_eq!(picture(json!({ "file": "m.ply" }), offset), expected);
}

#[test]
fn what_no_space_holds_is_refused_with_its_place() {
    let folder = Folder::new();
    let base = || scene(1.0, [0.0; 3]);
    let refused = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let mut scene = base();
        change(&mut scene);
        assert_error(&folder, &scene, ErrorKind::Scene, parts);
    };
    refused(&|s| s["shapes"][1]["radius"] = json!(1e35), &["shapes[1]: ", "at most 1e30"]);
    refused(&|s| s["camera"]["position"] = json!([1e308, 0, 0]), &["camera: ", "at most 1e30"]);
    refused(&|s| s["camera"]["position"] = json!([1e25, 0, 0]), &["camera.position: ", "too far"]);
    refused(&|s| s["lights"][1]["position"] = json!([0, 1e29, 0]), &["lights[1].position: ", "too far"]);
    refused(&|s| s["lights"][0]["radiance"] = json!([3e38, 0, 0]), &["lights[0].radiance: ", "at most 1e36"]);
    refused(
        &|s| s["instances"][0] = json!({ "object": "block", "transform": [{ "scale": 1e-14 }] }),
        &["instances[0].transform: ", "32-bit"],
    );
    refused(&|s| s["shapes"][2]["transform"] = json!([{ "scale": 1e-14 }]), &["shapes[2]: ", "measures"]);
}

/// Spheres far larger than Embree's largest coordinate, seen from outside.
#[test]
fn a_huge_sphere_is_drawn() {
    let folder = Folder::new();
    let picture = |r: f64| {
        folder.render(&json!({
            "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
            "sampler": { "type": "independent", "spp": 4, "seed": 1 },
            "camera": { "position": [0, 0, 4.0 * r], "look_at": [0, 0, 0], "vertical_fov_degrees": 40 },
            "materials": { "m": { "type": "diffuse", "albedo": 0.5 } },
            "shapes": [{ "type": "sphere", "material": "m", "radius": r }],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }))
    };
    assert_eq!(picture(2f64.powi(70)), picture(1.0));
}

/// Two faces in one place that shine to opposite sides: every accelerator meets the same one.
#[test]
fn coincident_faces_of_an_emitter_are_one() {
    let folder = Folder::new();
    let picture = |triangles: Value| {
        folder.render(&json!({
            "film": { "width": 12, "height": 12, "filter": { "type": "box" } },
            "sampler": { "type": "independent", "spp": 2, "seed": 1 },
            "camera": { "position": [0.25, 0.25, 4], "look_at": [0.25, 0.25, 0], "vertical_fov_degrees": 20 },
            "shapes": [{
                "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]], "triangles": triangles,
                "emission": { "radiance": [1, 2, 3] }
            }]
        }))
    };
    let front = picture(json!([[0, 1, 2]]));
    assert!(layer(&front, LayerKind::Color).iter().any(|&x| x > 0.5));
    assert_eq!(picture(json!([[0, 1, 2], [0, 3, 1]])), front);
    assert_eq!(picture(json!([[0, 3, 1], [0, 1, 2]])), picture(json!([[0, 3, 1]])));
}

/// One warning with the number and the first two shapes where another accelerator may meet another surface; none where
/// it does not matter.
#[test]
fn coincident_faces_that_differ_are_one_warning() {
    let folder = tempfile::tempdir().unwrap();
    let face = |triangle: [usize; 3], material: &str| {
        json!({
            "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [triangle],
            "material": material
        })
    };
    let instanced = |x: f64| json!({ "object": "o", "transform": [{ "translate": [x, 0, 0] }] });
    let warnings = |shapes: Vec<Value>, object: Vec<Value>| {
        let scene = json!({
            "camera": { "position": [0.25, 0.25, 4], "look_at": [0.25, 0.25, 0] },
            "materials": {
                "red": { "type": "diffuse", "albedo": [0.8, 0, 0] },
                "crimson": { "type": "diffuse", "albedo": [0.8, 0, 0] },
                "blue": { "type": "diffuse", "albedo": [0, 0, 0.8] }
            },
            "shapes": shapes,
            "objects": { "o": { "shapes": object } },
            "instances": [instanced(0.0), instanced(3.0)],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        });
        std::fs::write(folder.path().join("faces.json"), scene.to_string()).unwrap();
        let output = run(folder.path(), "info faces.json");
        assert!(output.status.success(), "{}", stderr_of(&output));
        stderr_of(&output).lines().filter(|line| line.contains("coincide")).map(str::to_owned).collect::<Vec<_>>()
    };
    let elsewhere = json!({ "type": "sphere", "radius": 0.1 });
    let two = |a: Value, b: Value| warnings(vec![elsewhere.clone(), a, b], vec![elsewhere.clone()]);
    for (first, second, warned) in [
        (face([0, 1, 2], "red"), face([1, 2, 0], "blue"), true),
        (face([0, 1, 2], "red"), face([0, 2, 1], "red"), true),
        (face([0, 1, 2], "red"), face([1, 2, 0], "red"), false),
        (face([0, 1, 2], "red"), face([1, 2, 0], "crimson"), false),
    ] {
        let lines = two(first.clone(), second.clone());
        assert_eq!(lines.len(), usize::from(warned), "{first} {second}: {lines:?}");
        for part in lines
            .iter()
            .flat_map(|line| ["shapes[1]: 1 triangle coincides", "shapes[2]", "remove one"].map(|part| (line, part)))
        {
            assert!(part.0.contains(part.1), "{part:?}");
        }
        // Of an object that is placed twice, once; and with none of another object or of the world.
        assert_eq!(warnings(vec![elsewhere.clone()], vec![first.clone(), second.clone()]).len(), usize::from(warned));
        assert_eq!(warnings(vec![first], vec![second]).len(), 0);
    }
    let mut apart = face([0, 1, 2], "blue");
    apart["transform"] = json!([{ "translate": [0, 0, 1e-6] }]);
    assert!(two(face([0, 1, 2], "red"), apart).is_empty());
    let sides = |emission: Value| {
        json!({ "type": "mesh", "triangles": [[6, 2, 1], [0, 2, 6]], "emission": emission,
                "positions": [
                    [-0.688, 0.6156, 0.7457], [-0.688, 0.6156, 0.7457], [-0.5833, -0.9415, -0.8049],
                    [-0.8036, -0.7218, -0.0448], [0.5423, 0.1878, -0.2835], [0.9112, -0.5908, 0.243],
                    [-0.6787, -0.1173, 0.0922]
                ],
                "transform": [{ "rotate": { "axis": [-0.1016, -0.0028, 0.2143], "degrees": 236.0464 } }] })
    };
    let within = warnings(vec![sides(Value::Null)], vec![elsewhere.clone()]);
    assert!(
        within.len() == 1 && within[0].contains("shapes[0]: 1 triangle") && within[0].contains("of the same mesh"),
        "{within:?}"
    );
    // Those of emitters are dropped already.
    assert!(warnings(vec![sides(json!({ "radiance": [11, 11, 11] }))], vec![elsewhere.clone()]).is_empty());
}
