//! Subdivision surfaces and displacement as users give them.

use std::collections::{HashMap, HashSet};

use image::{ImageBuffer, Luma, Rgb};
use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::geometry::{Geometry, Mesh, Shape};
use steradian::internal::id::PrimId;
use steradian::internal::math::{Ray, Vec3};
use steradian::internal::render::Overrides;

use crate::bad_input::assert_faults;
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{prepare, render_with};

/// A cube of quadrilaterals; each face is a chart of its own.
fn cube(more: Value) -> Value {
    let at = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1 } else { -1 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let uvs = [[0, 0], [1, 0], [1, 1], [0, 1]].repeat(6);
    let mut mesh = json!({
        "type": "mesh", "positions": faces.iter().flatten().map(|&i| at(i)).collect::<Vec<_>>(), "uvs": uvs,
        "faces": (0..6).map(|i| [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]).collect::<Vec<_>>()
    });
    mesh.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    mesh
}

fn scene(shapes: Value) -> Value {
    json!({
        "film": { "width": 32, "height": 32 },
        "camera": { "position": [1, 2, 5], "look_at": [0, 0, 0] },
        "sampler": { "spp": 4 },
        "textures": {
            "heights": { "type": "image", "file": "heights.png" },
            "color": { "type": "image", "file": "color.png" },
            "squares": { "type": "checker", "scale": 3 }
        },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    })
}

/// Waves that repeat.
fn height(u: f64, v: f64) -> f64 {
    use std::f64::consts::TAU;
    0.5 + 0.25 * (TAU * u).sin() * (TAU * v).cos()
}

fn folder() -> Folder {
    let folder = Folder::new();
    let heights = ImageBuffer::from_fn(256, 256, |x, y| {
        let code = height((f64::from(x) + 0.5) / 256.0, 1.0 - (f64::from(y) + 0.5) / 256.0) * 65_535.0;
        Luma([code.round() as u16])
    });
    heights.save(folder.path("heights.png")).unwrap();
    ImageBuffer::from_pixel(1, 1, Rgb([13_107u16, 26_214, 39_321])).save(folder.path("color.png")).unwrap();
    folder
}

fn meshes(geometry: &Geometry) -> Vec<&Mesh> {
    let mut found = Vec::new();
    for shape in &geometry.shapes {
        if let Shape::Mesh(mesh) = shape {
            found.push(mesh);
        }
    }
    found
}

/// Asserts that every edge between two positions has one triangle on each side.
#[track_caller]
fn assert_closed(mesh: &Mesh) {
    let mut uses: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    let at = |i: u32| mesh.positions()[i as usize].map(|x| (x + 0.0).to_bits());
    for t in mesh.triangles() {
        for i in 0..3 {
            *uses.entry([at(t[i]), at(t[(i + 1) % 3])]).or_default() += 1;
        }
    }
    for ([a, b], count) in &uses {
        assert!(*count == 1 && uses.get(&[*b, *a]) == Some(&1), "{a:?} {b:?}: {count}");
    }
}

#[test]
fn a_cube_of_six_charts_becomes_one_surface() {
    let folder = folder();
    let fine = json!({ "subdivision": { "levels": 3 } });
    let scene_of = |shape: Value| folder.compile(&scene(json!([shape]))).unwrap();
    let scene = scene_of(cube(fine));
    let mesh = meshes(&scene.geometry)[0];
    assert_eq!(mesh.triangles().len(), 768);
    assert!(mesh.has_normals() && mesh.has_uvs());
    assert_closed(mesh);
    // The limit of a corner with three faces.
    let half = mesh.positions().iter().filter(|p| p.iter().all(|x| (x.abs() - 0.5).abs() < 1e-6));
    assert_eq!(half.map(|p| p.map(|x| x > 0.0)).collect::<HashSet<_>>().len(), 8);
    let apart = cube(json!({ "smooth_by": "index", "subdivision": { "levels": 1 } }));
    let scene = scene_of(apart);
    assert!(meshes(&scene.geometry)[0].positions().iter().all(|p| p.iter().any(|x| x.abs() == 1.0)));
}

#[test]
fn displaced_charts_stay_closed() {
    let folder = folder();
    for (space, texture) in [("normal", "heights"), ("normal", "squares"), ("tangent", "color"), ("object", "heights")]
    {
        for subdivision in [json!({ "levels": 4 }), json!({ "edge_length": 3.0 }), json!({ "scheme": "loop" })] {
            let displacement = json!({ "texture": texture, "scale": 0.3, "space": space });
            let mesh = cube(json!({ "subdivision": subdivision, "displacement": displacement }));
            let scene = folder.compile(&scene(json!([mesh]))).unwrap();
            assert_closed(meshes(&scene.geometry)[0]);
        }
    }
}

#[test]
fn every_accelerator_meets_edges_and_every_number_of_threads_gives_the_same_bits() {
    let folder = folder();
    let mesh = cube(json!({
        "subdivision": { "edge_length": 4.0, "creases": [{ "vertices": [8, 9], "sharpness": 3 }] },
        "displacement": { "texture": "squares", "scale": 0.2 }
    }));
    let value = scene(json!([mesh]));
    let compiled = folder.compile(&value).unwrap();
    let geometry = &compiled.geometry;
    let mesh = meshes(geometry)[0];
    for (kind, name) in AccelKind::ALL {
        let accel = accel::build(kind, geometry, 1).unwrap();
        for t in mesh.triangles().iter().step_by(7) {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.positions()[i as usize]));
            for target in [a, 0.5 * (a + b), 0.3 * b + 0.7 * c] {
                let ray = Ray::new(Vec3::ZERO, target.normalize());
                assert!(accel.intersect(&ray).is_some() && accel.occluded(&ray), "{name}: {target}");
            }
        }
    }
    let mut plain = value;
    plain["shapes"][0].as_object_mut().unwrap().remove("displacement");
    plain["textures"] = json!({});
    let render = |threads| {
        let overrides = Overrides { threads: Some(threads), ..Overrides::default() };
        AccelKind::ALL.map(|(kind, _)| render_with(&prepare(&plain, &overrides), kind).image)
    };
    let (one, three) = (render(1), render(3));
    assert!(one == three);
    // Those of this program; Embree's hits differ within rounding.
    assert!(one[1..].windows(2).all(|images| images[0] == images[1]));
}

#[test]
fn a_displaced_plane_is_the_field_of_heights() {
    let folder = folder();
    let (count, scale) = (96u32, 0.2);
    let grid = |i: u32| [f64::from(i % (count + 1)), f64::from(i / (count + 1))].map(|x| x / f64::from(count));
    let vertices = (count + 1) * (count + 1);
    let corner = |i: u32| i / count * (count + 1) + i % count;
    let faces = (0..count * count).map(corner).map(|i| [i, i + 1, i + count + 2, i + count + 1]);
    let mesh = json!({
        "type": "mesh", "positions": (0..vertices).map(grid).map(|[x, y]| [x, y, 0.0]).collect::<Vec<_>>(),
        "uvs": (0..vertices).map(grid).collect::<Vec<_>>(), "faces": faces.collect::<Vec<_>>(),
        "displacement": { "texture": "heights", "scale": scale, "midlevel": 0.25 }
    });
    let mut refined = mesh.clone();
    refined["subdivision"] = json!({ "levels": 1 });
    let compiled = folder.compile(&scene(json!([mesh, refined]))).unwrap();
    for mesh in meshes(&compiled.geometry) {
        let mut steepest = 0.0f64;
        for i in 0..mesh.triangles().len() {
            let (points, uv) = (mesh.triangle_points(PrimId::new(i)), mesh.uv(PrimId::new(i), 0.0, 0.0));
            let expected = scale * (height(f64::from(uv.x), f64::from(uv.y)) - 0.25);
            // Interpolation between pixels, h²/8 times the second derivatives, and the rounding to 16 bits.
            assert!((f64::from(points.a.z) - expected).abs() < 2e-5, "{uv}: {} {expected}", points.a.z);
            let (x, y) = (f64::from(points.a.x), f64::from(points.a.y));
            let step = 1e-4;
            let dx = scale * (height(x + step, y) - height(x - step, y)) / (2.0 * step);
            let dy = scale * (height(x, y + step) - height(x, y - step)) / (2.0 * step);
            let n = Vec3::new(-dx as f32, -dy as f32, 1.0).normalize();
            let facet = (points.b - points.a).cross(points.c - points.a).normalize();
            steepest = steepest.max(f64::from(facet.angle_between(n)));
        }
        assert!(steepest < 0.08, "{steepest}");
    }
}

#[test]
fn vectors_are_of_the_meshs_space_or_of_its_uv() {
    let folder = folder();
    // u runs along y, v along -x.
    let square = json!({
        "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "triangles": [[0, 1, 2], [0, 2, 3]],
        "uvs": [[0, 1], [0, 0], [1, 0], [1, 1]]
    });
    let moved = |space: &str| {
        let mut square = square.clone();
        square["displacement"] = json!({ "texture": "color", "scale": 2, "midlevel": 0.1, "space": space });
        let compiled = folder.compile(&scene(json!([square]))).unwrap();
        Vec3::from(meshes(&compiled.geometry)[0].positions()[0])
    };
    for (space, expected) in [("object", [0.2, 0.6, 1.0]), ("tangent", [-0.6, 0.2, 1.0])] {
        assert!((moved(space) - Vec3::from(expected)).length() < 1e-5, "{space}: {}", moved(space));
    }
}

#[test]
fn instances_share_and_deforming_meshes_keep_their_faces() {
    let folder = folder();
    let mut value = scene(json!([]));
    value["objects"] = json!({ "o": { "shapes": [cube(json!({ "subdivision": { "edge_length": 2 } }))] } });
    let place = |x: f64| json!({ "object": "o", "transform": [{ "translate": [x, 0, 0] }] });
    value["instances"] = json!([place(0.0), place(30.0)]);
    let both = folder.compile(&value).unwrap();
    assert_eq!((both.geometry.shapes.len(), both.geometry.instances.len()), (1, 2));
    value["instances"] = json!([place(30.0)]);
    let far = folder.compile(&value).unwrap();
    let [near, far] = [&both, &far].map(|scene| meshes(&scene.geometry)[0].triangles().len());
    assert!(near > 4 * far, "{near} {far}");

    let mut moving = cube(json!({ "subdivision": { "levels": 2 } }));
    let later: Vec<[f64; 3]> = serde_json::from_value(moving["positions"].clone()).unwrap();
    moving["deform_positions"] = json!([later.iter().map(|[x, y, z]| [*x, 2.0 * y, *z]).collect::<Vec<_>>()]);
    let mut value = scene(json!([moving]));
    value["camera"]["shutter"] = json!([0, 1]);
    let compiled = folder.compile(&value).unwrap();
    let mesh = meshes(&compiled.geometry)[0];
    assert!(mesh.is_deforming());
    for i in 0..mesh.triangles().len() {
        let [a, b] = [0.0, 1.0].map(|time| mesh.triangle_points_at(PrimId::new(i), time).a);
        assert!((a * Vec3::new(1.0, 2.0, 1.0) - b).length() < 1e-5, "{a} {b}");
    }
}

#[test]
fn polygons_of_files_are_faces() {
    let folder = folder();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 5 6 3\n";
    folder.write("m.obj", obj);
    let ply = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
               element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n\
               2 1 0\n4 0 1 2 3\n4 1 4 5 2\n";
    folder.write("m.ply", ply);
    for file in ["m.obj", "m.ply"] {
        let mesh = |subdivision: Value| json!({ "type": "mesh", "file": file, "subdivision": subdivision });
        let shapes = json!([mesh(json!({ "levels": 1 })), mesh(json!({ "levels": 1, "scheme": "loop" }))]);
        let compiled = folder.compile(&scene(shapes)).unwrap();
        let counts: Vec<usize> = meshes(&compiled.geometry).iter().map(|mesh| mesh.triangles().len()).collect();
        // Eight quadrilaterals; four triangles at each of four.
        assert_eq!(counts, [16, 16], "{file}");
        let middle = meshes(&compiled.geometry)[0].positions().iter().filter(|p| p[0] == 1.0).count();
        assert_eq!(middle, 3, "{file}");
    }
}

#[test]
fn impossible_surfaces_are_refused() {
    let with = |subdivision: Value| cube(json!({ "subdivision": subdivision }));
    let crease = |vertices: Value, sharpness: Value| {
        with(json!({ "creases": [{ "vertices": vertices, "sharpness": sharpness }] }))
    };
    let displaced = |displacement: Value| {
        let mut mesh = cube(json!({ "displacement": displacement }));
        mesh.as_object_mut().unwrap().remove("uvs");
        mesh
    };
    let mut short = cube(json!({}));
    short["faces"] = json!([[0, 1]]);
    let mut far = with(json!({}));
    far["positions"][3] = json!([1e300, 0, 0]);
    let faults = [
        (with(json!({ "levels": 17 })), "shapes[0].subdivision.levels", "from 0 to 16, not 17"),
        (with(json!({ "levels": 12 })), "shapes[0].subdivision", "which allows 9 levels"),
        (with(json!({ "edge_length": 0 })), "shapes[0].subdivision.edge_length", "above 0"),
        (with(json!({ "max_triangles": 0 })), "shapes[0].subdivision.max_triangles", "from 1 to"),
        (
            crease(json!([0, 24]), json!(1)),
            "shapes[0].subdivision.creases[0].vertices",
            "no vertex 24: there are only 24",
        ),
        (
            crease(json!([0, 2]), json!(1)),
            "shapes[0].subdivision.creases[0].vertices",
            "no face has an edge from vertex 0 to",
        ),
        (crease(json!([0]), json!(1)), "shapes[0].subdivision.creases[0].vertices", "two vertices or more"),
        (crease(json!([0, 1]), json!(-1)), "shapes[0].subdivision.creases[0].sharpness", "not below 0"),
        (displaced(json!({ "texture": "none" })), "shapes[0].displacement.texture", "no texture named"),
        (short, "shapes[0].faces[0]", "three corners or more, not 2"),
    ];
    for (shape, place, message) in faults {
        assert_faults(&[("shapes[0]", shape, place, message)]);
    }
    assert_faults(&[
        ("shapes[0]", displaced(json!({ "texture": "tiles" })), "shapes[0]", "the mesh has no uv"),
        ("shapes[0]", far, "shapes[0]", "finite"),
    ]);
    let folder = Folder::new();
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
    let mesh = json!({ "type": "mesh", "file": "m.obj", "subdivision": { "corners": [{ "vertices": [0] }] } });
    let mut value = good_scene();
    set(&mut value, "shapes[0]", mesh);
    let error = folder.compile(&value).unwrap_err().to_string();
    assert!(error.contains("corners[0]") && error.contains("PLY"), "{error}");
}
