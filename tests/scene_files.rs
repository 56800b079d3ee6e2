//! The content of scene files reaches the compiled scene: schema, transforms, meshes, materials, instances, lights.

use std::os::unix::fs::MetadataExt;

use image::ImageBuffer;
use serde_json::{Value, json};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::assets;
use steradian::internal::bsdf::Bsdf;
use steradian::internal::compile::Summary;
use steradian::internal::config::{self, Trust};
use steradian::internal::geometry::{Mesh, Shape};
use steradian::internal::id::{PrimId, ShapeId};
use steradian::internal::import::{self, ImportOptions};
use steradian::internal::integrator::World;
use steradian::internal::light::Light;
use steradian::internal::math::{DVec3, Ray, Vec2, Vec3};
use steradian::internal::scene::Scene;
use steradian::internal::texture::Footprint;

use crate::util::folder::{Folder, good_scene};
use crate::util::root;

fn lit(shape: Value) -> Value {
    json!({
        "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
        "shapes": [shape],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    })
}

fn mesh(scene: &Scene, shape: usize) -> &Mesh {
    match &scene.geometry.shapes[shape] {
        Shape::Mesh(mesh) => mesh,
        _ => panic!("no mesh"),
    }
}

fn geometric_normal(mesh: &Mesh, triangle: usize) -> Vec3 {
    mesh.triangle_points(PrimId::new(triangle)).cross().normalize().as_vec3()
}

#[test]
fn a_scene_survives_writing() {
    let folder = Folder::new();
    let path = folder.write("scene.json", good_scene().to_string());
    let scene = import::load_scene(&path).unwrap();
    let text = serde_json::to_string(&scene).unwrap();
    let again = import::parse_scene(&text, &path).unwrap();
    assert_eq!(text, serde_json::to_string(&again).unwrap());
}

#[test]
fn comments_are_allowed_everywhere_but_in_strings() {
    let text =
        good_scene().to_string().replace("{\"", "/* \" */{ // }\n\"").replace("\"out.exr\"", "\"a//b/*c*/.exr\"");
    let path = Folder::new().write("scene.json", &text);
    let scene = import::parse_scene(&text, &path).unwrap();
    assert_eq!(scene.outputs[0].file, "a//b/*c*/.exr");
}

#[test]
fn the_first_step_of_a_transform_acts_first() {
    let folder = Folder::new();
    let turn = json!({ "rotate": { "axis": [0, 0, 1], "degrees": 90 } });
    let shift = json!({ "translate": [5, 0, 0] });
    let first = |steps: [&Value; 2]| {
        let triangle = json!({
            "type": "mesh", "positions": [[1, 0, 0], [2, 0, 0], [1, 1, 0]], "triangles": [[0, 1, 2]], "transform": steps
        });
        mesh(&folder.compile(&lit(triangle)).unwrap(), 0).positions()[0]
    };
    assert_eq!(first([&turn, &shift]), [5.0, 1.0, 0.0]);
    assert_eq!(first([&shift, &turn]), [0.0, 6.0, 0.0]);
}

#[test]
fn fronts_stay_fronts_in_a_mirror_and_turn_on_demand() {
    let folder = Folder::new();
    for (scale, reverse, front) in [(1.0, false, 1.0), (-1.0, false, 1.0), (1.0, true, -1.0), (-1.0, true, -1.0)] {
        let triangle = json!({
            "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]],
            "normals": vec![[0.6, 0.0, 0.8]; 3],
            "transform": [{ "scale": [scale, 1.0, 2.0] }], "reverse_normal": reverse
        });
        let scene = folder.compile(&lit(triangle)).unwrap();
        let normal = geometric_normal(mesh(&scene, 0), 0);
        assert!((normal - front * Vec3::Z).length() < 1e-6, "{scale} {reverse}: {normal}");
    }
}

#[test]
fn triangles_without_area_are_dropped() {
    let triangle = json!({
        "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]],
        "triangles": [[0, 1, 3], [0, 1, 2], [1, 1, 2], [1, 3, 2]]
    });
    let scene = Folder::new().compile(&lit(triangle)).unwrap();
    assert_eq!(mesh(&scene, 0).triangles(), [[0, 1, 2], [1, 3, 2]]);
}

#[test]
fn shading_chooses_the_normals() {
    let folder = Folder::new();
    let has_normals = |normals: bool, shading: Value| {
        let mut triangle = json!({
            "type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]], "shading": shading
        });
        if normals {
            triangle["normals"] = json!(vec![[0.0, 0.0, 1.0]; 3]);
        }
        mesh(&folder.compile(&lit(triangle)).unwrap(), 0).has_normals()
    };
    for (given, shading, expected) in [
        (false, "auto", false),
        (true, "auto", true),
        (false, "flat", false),
        (true, "flat", false),
        (false, "smooth", true),
        (true, "smooth", true),
    ] {
        assert_eq!(has_normals(given, json!(shading)), expected, "{given} {shading}");
    }
}

/// A pyramid of a quad and four triangles, with uv.
const PYRAMID: [[f32; 5]; 5] = [
    [-1.0, 0.0, -1.0, 0.0, 0.0],
    [1.0, 0.0, -1.0, 1.0, 0.0],
    [1.0, 0.0, 1.0, 1.0, 1.0],
    [-1.0, 0.0, 1.0, 0.0, 1.0],
    [0.0, 1.5, 0.0, 0.5, 0.5],
];
const FACES: [&[u32]; 5] = [&[0, 1, 2, 3], &[1, 0, 4], &[2, 1, 4], &[3, 2, 4], &[0, 3, 4]];

fn pyramid_ply(format: &str, number: impl Fn(f32) -> Vec<u8>, index: impl Fn(u32) -> Vec<u8>) -> Vec<u8> {
    let mut out = format!("ply\nformat {format} 1.0\nelement vertex 5\n").into_bytes();
    for name in ["x", "y", "z", "u", "v"] {
        out.extend(format!("property float {name}\n").bytes());
    }
    out.extend(b"element face 5\nproperty list uchar int vertex_indices\nend_header\n");
    let is_text = format == "ascii";
    for vertex in PYRAMID {
        vertex.iter().for_each(|&x| out.extend(number(x)));
        out.extend(is_text.then_some(b'\n'));
    }
    for face in FACES {
        if is_text {
            out.extend(format!("{} ", face.len()).bytes());
        } else {
            out.push(face.len() as u8);
        }
        face.iter().for_each(|&i| out.extend(index(i)));
        out.extend(is_text.then_some(b'\n'));
    }
    out
}

fn pyramid_obj() -> String {
    let vertices = PYRAMID.iter().map(|[x, y, z, u, v]| format!("v {x} {y} {z}\nvt {u} {v}\n")).collect::<String>();
    let corner = |i: &u32| format!(" {0}/{0}", i + 1);
    vertices
        + &FACES.iter().map(|face| format!("f{}\n", face.iter().map(corner).collect::<String>())).collect::<String>()
}

#[test]
fn the_same_mesh_in_every_format_is_the_same() {
    let folder = Folder::new();
    folder.write("a.ply", pyramid_ply("ascii", |x| format!("{x} ").into_bytes(), |i| format!("{i} ").into_bytes()));
    folder.write("l.ply", pyramid_ply("binary_little_endian", |x| x.to_le_bytes().into(), |i| i.to_le_bytes().into()));
    folder.write("b.ply", pyramid_ply("binary_big_endian", |x| x.to_be_bytes().into(), |i| i.to_be_bytes().into()));
    folder.write("o.obj", pyramid_obj());
    let corners = |name: &str| {
        let scene = folder.compile(&lit(json!({ "type": "mesh", "file": name }))).unwrap();
        let mesh = mesh(&scene, 0);
        assert!(mesh.has_uvs(), "{name}");
        mesh.triangles().iter().map(|t| t.map(|i| mesh.positions()[i as usize])).collect::<Vec<_>>()
    };
    let expected = corners("a.ply");
    assert_eq!(expected.len(), 6);
    for name in ["l.ply", "b.ply", "o.obj"] {
        assert_eq!(corners(name), expected, "{name}");
    }
}

#[test]
fn an_obj_has_its_materials_and_lights_unless_one_is_given() {
    let folder = Folder::new();
    folder.write("m.mtl", "newmtl wall\nKd 0.2 0.4 0.6\nnewmtl lamp\nKd 0 0 0\nKe 3 2 1\n");
    folder.write(
        "m.obj",
        format!("mtllib m.mtl\n{}usemtl lamp\nf 1 2 3\nusemtl wall\nf 1 3 4\ng more\nf 2 3 5\n", pyramid_obj()),
    );
    let own = folder.compile(&lit(json!({ "type": "mesh", "file": "m.obj" }))).unwrap();
    // Without a material, with the lamp's, with the wall's.
    assert_eq!(own.geometry.shapes.len(), 3);
    assert_eq!(own.surfaces.iter().filter(|s| s.first_light.is_some()).count(), 1);
    assert_eq!(own.lights.lights().iter().filter(|light| matches!(light, Light::Area(_))).count(), 1);

    let mut scene = lit(json!({ "type": "mesh", "file": "m.obj", "material": "red" }));
    scene["materials"] = json!({ "red": { "type": "diffuse", "albedo": [0.5, 0, 0] } });
    let given = folder.compile(&scene).unwrap();
    assert_eq!(given.geometry.shapes.len(), 1);
    assert!(given.surfaces[0].first_light.is_none());
}

#[test]
fn maps_of_an_mtl_colour_mirrors_metals_and_lamps() {
    let folder = Folder::new();
    ImageBuffer::from_fn(2, 1, |x, _| image::Rgb([255 * x as u8; 3])).save(folder.path("map.png")).unwrap();
    let square =
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";
    folder.write("m.obj", format!("mtllib m.mtl\n{square}"));
    let compile = |mtl: &str| {
        folder.write("m.mtl", format!("newmtl m\n{mtl}\n"));
        folder.compile(&lit(json!({ "type": "mesh", "file": "m.obj" }))).unwrap()
    };
    // The map is black at u = 1/4 and white at u = 3/4.
    let [dark, bright] = [Vec2::new(0.25, 0.5), Vec2::new(0.75, 0.5)];
    let w = Vec3::new(0.3, 0.2, 0.9).normalize();
    for (mtl, expected) in [
        ("illum 5\nKs 0.5 0.5 0.5\nmap_Ks map.png", 0.5),
        ("illum 5\nmap_Ks map.png", 1.0),
        ("Kd 0 0 0\nKs 0.5 0.5 0.5\nNs 50\nmap_Ks map.png", 0.5),
    ] {
        let scene = compile(mtl);
        let material = scene.material(ShapeId(0));
        let [black, white] = [dark, bright].map(|uv| match material.bsdf(&scene.textures, || Footprint::point(uv)) {
            Bsdf::Mirror(mirror) => mirror.reflectance.g,
            Bsdf::Conductor(metal) => metal.albedo(Vec3::Z).g,
            other => panic!("{mtl}: {other:?}"),
        });
        assert!(black == 0.0 && (white - expected).abs() < 1e-4, "{mtl}: {black} {white}");
        assert!(material.bsdf(&scene.textures, || Footprint::point(dark)).eval(w, w).value.is_black());
    }
    for (mtl, expected) in [("Ke 2 3 4\nmap_Ke map.png", 3.0), ("map_Ke map.png", 1.0)] {
        let scene = compile(mtl);
        let accel = accel::build(AccelKind::EMBREE, &scene.geometry, 1).unwrap();
        let world = World::new(&scene, &*accel);
        let emitted = |x: f32| {
            let at = world.closest(&Ray::new(Vec3::new(x, 0.1, 2.0), -Vec3::Z)).unwrap();
            world.emitted(&at, Vec3::Z).g
        };
        assert!(emitted(-0.5) == 0.0 && (emitted(0.5) - expected).abs() < 1e-5, "{mtl}");
    }

    let dark = folder.path("dark.exr");
    exr::prelude::write_rgb_file(dark, 1, 1, |_, _| (-1f32, 0f32, 0f32)).unwrap();
    for (mtl, fault) in [
        ("map_Ke dark.exr", "light is not negative"),
        ("illum 5\nmap_Ks dark.exr", "from -1 to 0"),
        ("map_Ke gone.png", "gone.png"),
    ] {
        folder.write("m.mtl", format!("newmtl m\n{mtl}\n"));
        let message = folder.compile(&lit(json!({ "type": "mesh", "file": "m.obj" }))).unwrap_err().to_string();
        assert!(message.contains("shapes[0]") && message.contains(fault), "{mtl}: {message}");
    }
}

#[test]
fn what_emits_in_an_object_stands_in_the_world_for_each_instance() {
    let folder = Folder::new();
    folder.write("m.mtl", "newmtl lamp\nKe 3 2 1\n");
    folder.write("m.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\n");
    let scene = json!({
        "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
        "objects": {
            "inner": {
                "shapes": [
                    { "type": "cube" },
                    { "type": "mesh", "file": "m.obj" },
                    {
                        "type": "sphere", "radius": 0.5, "emission": { "radiance": [1, 1, 1] },
                        "transform": [{ "translate": [1, 0, 0] }]
                    }
                ]
            },
            "outer": {
                "instances": [{ "object": "inner" }, { "object": "inner", "transform": [{ "translate": [0, 10, 0] }] }]
            },
            "idle": { "shapes": [{ "type": "disk" }] }
        },
        "instances": [{ "object": "outer", "transform": [{ "scale": 2 }] }, { "object": "inner" }]
    });
    let scene = folder.compile(&scene).unwrap();
    let summary = Summary::new(&scene);
    assert_eq!((summary.objects, summary.instances, summary.triangles_instanced), (1, 3, 3 * 12 + 3));
    assert_eq!(summary.lights["area"], 6);
    assert_eq!(scene.geometry.world.len(), 6);
    // Transforms multiply: the second sphere of the first instance is moved by 10, then doubled.
    let mut spheres: Vec<DVec3> = Vec::new();
    for &id in &scene.geometry.world {
        assert!(scene.surface(id).light(PrimId(0)).is_some());
        if let Shape::Analytic(placed) = scene.geometry.shape(id) {
            spheres.push(placed.transform.point(DVec3::ZERO));
        }
    }
    assert_eq!(spheres, [DVec3::new(2.0, 0.0, 0.0), DVec3::new(2.0, 20.0, 0.0), DVec3::new(1.0, 0.0, 0.0)]);
    assert!(scene.geometry.objects[0].shapes.iter().all(|&id| scene.surface(id).first_light.is_none()));
}

#[test]
fn each_emissive_triangle_finds_its_light() {
    let scene = lit(json!({ "type": "cube", "emission": { "radiance": [1, 2, 3] } }));
    let scene = Folder::new().compile(&scene).unwrap();
    for prim in 0..12 {
        let id = scene.surface(ShapeId(0)).light(PrimId(prim)).unwrap();
        match &scene.lights.lights()[id.index()] {
            Light::Area(light) => assert_eq!((light.shape, light.prim), (ShapeId(0), PrimId(prim))),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn the_summary_counts_what_is_there() {
    let scene = Folder::new().compile(&good_scene()).unwrap();
    let summary = serde_json::to_value(Summary::new(&scene)).unwrap();
    assert_eq!(summary["triangles"], 13);
    assert_eq!(summary["instances"], 2);
    assert_eq!(summary["lights"], json!({ "area": 3, "point": 1, "spot": 1, "directional": 1, "environment": 1 }));
    assert_eq!(summary["shapes"]["sphere"], 3);
    assert_eq!(summary["textures"], 1);
    let features = summary["features"].as_array().unwrap();
    for feature in [
        "lights",
        "environment",
        "analytic shapes",
        "instances",
        "textures",
        "mirror or glass",
        "anisotropic materials",
        "lens",
    ] {
        assert!(features.contains(&json!(feature)), "{feature}");
    }
}

/// Some editors put a byte order mark before UTF-8.
#[test]
fn a_byte_order_mark_changes_nothing() {
    let folder = Folder::new();
    let files = root().join("tests/regressions");
    let named = |from: &str| std::fs::read(files.join(from)).unwrap();
    let with = |mark: &str, content: &[u8]| [mark.as_bytes(), content].concat();
    let marks = ["", "\u{feff}"];
    for (from, name) in [
        ("scene_json/full", "a.json"),
        ("mitsuba_xml/min", "a.xml"),
        ("pbrt/box", "a.pbrt"),
        ("gltf/triangle.gltf", "a.gltf"),
    ] {
        let [plain, marked] = marks.map(|mark| {
            let imported =
                import::read_scene(&folder.write(name, with(mark, &named(from))), &ImportOptions::default()).unwrap();
            serde_json::to_value(&imported.desc).unwrap()
        });
        assert_eq!(plain, marked, "{name}");
    }
    for from in ["ply/ascii", "ply/big", "ply/little"] {
        let [plain, marked] =
            marks.map(|mark| assets::read_ply(&folder.write("a.ply", with(mark, &named(from)))).unwrap());
        assert!(plain == marked && !plain.triangles.is_empty(), "{from}");
    }
    let [plain, marked] = marks.map(|mark| {
        folder.write("a.mtl", format!("{mark}newmtl red\nKd 0.5 0 0\n"));
        let obj =
            folder.write("a.obj", format!("{mark}mtllib a.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
        format!("{:?}", assets::read_obj(&obj, true).unwrap())
    });
    assert!(plain == marked && plain.contains("red"), "{marked}");
    let [plain, marked] = marks.map(|mark| {
        let ies = format!("{mark}TILT=NONE\n1 1000 1 2 1 1 1 0 0 0\n1 1 100\n0 90\n0\n100 50\n");
        assets::read_ies(&folder.write("a.ies", ies)).unwrap()
    });
    assert_eq!(plain, marked);
    let [plain, marked] = marks.map(|mark| {
        let file = folder.write("steradian.toml", format!("{mark}spp = 3\n"));
        config::read(&file, Trust::Project, file.metadata().unwrap().uid()).unwrap().unwrap()
    });
    assert!(plain == marked && plain.len() == 1);
}
