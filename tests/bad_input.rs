//! Every fault of a scene is an error that names the file, the place and the offending word; none is a panic.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::assets::SceneSource;
use steradian::internal::compile::CheckedScene;
use steradian::internal::import;

use crate::util::folder::{Folder, good_scene, set};

/// A fault: what is set where in the good scene, and the place and words that the message must have.
pub type Fault = (&'static str, Value, &'static str, &'static str);

#[track_caller]
pub fn assert_error(folder: &Folder, scene: &Value, kind: ErrorKind, parts: &[&str]) {
    let error = folder.compile(scene).err().unwrap_or_else(|| panic!("compiles, but lacks {parts:?}"));
    let message = error.to_string();
    assert_eq!(error.kind(), kind, "{message}");
    for part in parts.iter().chain(&["scene.json"]) {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    assert!(!message.contains('\n'), "{message}");
}

#[track_caller]
pub fn assert_faults(faults: &[Fault]) {
    let folder = Folder::new();
    for (path, value, place, word) in faults {
        let mut scene = good_scene();
        set(&mut scene, path, value.clone());
        assert_error(&folder, &scene, ErrorKind::Scene, &[&format!("{place}: "), word]);
    }
}

#[test]
fn the_good_scene_compiles() {
    Folder::new().compile(&good_scene()).unwrap();
}

#[test]
fn names_that_do_not_exist() {
    assert_faults(&[
        (
            "shapes[0].material",
            json!("gold"),
            "shapes[0].material",
            "no material named \"gold\" (did you mean \"Gold\"?)",
        ),
        ("shapes[0].material", json!("wood"), "shapes[0].material", "no material named \"wood\""),
        ("materials.tiled.albedo.texture", json!("tile"), "materials.tiled.albedo", "did you mean \"tiles\"?"),
        ("materials.Gold.metal", json!("golt"), "materials.Gold.metal", "did you mean \"gold\"?"),
        ("instances[0].object", json!("pear"), "instances[0].object", "did you mean \"pair\"?"),
        (
            "objects.pair.instances[1].object",
            json!("lmap"),
            "objects.pair.instances[1].object",
            "did you mean \"lamp\"?",
        ),
        (
            "objects.unused",
            json!({ "instances": [{ "object": "nothing" }] }),
            "objects.unused.instances[0].object",
            "\"nothing\"",
        ),
        (
            "objects.lamp.shapes[0].material",
            json!("glas"),
            "objects.lamp.shapes[0].material",
            "did you mean \"glass\"?",
        ),
    ]);
}

#[test]
fn unknown_keys_and_types() {
    assert_faults(&[
        ("shaeps", json!([]), "", "unknown key \"shaeps\""),
        ("shapes[0].raduis", json!(1), "shapes[0]", "did you mean \"radius\"?"),
        ("shapes[0].type", json!("shpere"), "shapes[0].type", "did you mean \"sphere\"?"),
        ("shapes[0].radius", json!("one"), "shapes[0].radius", "\"one\""),
        (
            "shapes[0].transform[0]",
            json!({ "trnslate": [0, 0, 0] }),
            "shapes[0].transform[0]",
            "did you mean \"translate\"?",
        ),
        ("camera.lens.radus", json!(1), "camera.lens", "did you mean \"radius\"?"),
        ("film.filter.type", json!("gausian"), "film.filter.type", "did you mean \"gaussian\"?"),
        ("integrator.max_dept", json!(3), "integrator", "did you mean \"max_depth\"?"),
        ("integrator", json!({ "type": "normal", "max_depth": 3 }), "integrator", "max_depth"),
        ("lights[0].intensity", json!([1, 1]), "lights[0].intensity", "expected a list of three numbers, found two"),
        ("materials.Gold.type", json!("conductr"), "materials.Gold.type", "did you mean \"conductor\"?"),
        (
            "materials.tiled.albedo",
            json!({ "texture": "tiles", "scale": 2 }),
            "materials.tiled.albedo.scale",
            "expected a colour",
        ),
        ("film.width", json!(-1), "film.width", "-1"),
        ("film.width", json!(10.5), "film.width", "10.5"),
    ]);
}

#[test]
fn opacities() {
    assert_faults(&[
        ("shapes[0].opacity", json!(1.5), "shapes[0].opacity", "from 0 to 1, not 1.5"),
        ("shapes[0].opacity", json!(-0.25), "shapes[0].opacity", "-0.25"),
        (
            "shapes[0].opacity",
            json!({ "texture": "tiles", "threshold": 1.5 }),
            "shapes[0].opacity.threshold",
            "from 0 to 1, not 1.5",
        ),
        ("shapes[0].opacity", json!([1, 1, 1]), "shapes[0].opacity", "expected an opacity"),
        ("shapes[0].opacity", json!({ "texture": "tilse" }), "shapes[0].opacity.texture", "did you mean \"tiles\"?"),
    ]);
}

#[test]
fn settings_out_of_range() {
    let faults: &[Fault] = &[
        ("film.width", json!(0), "film.width", "0"),
        ("film.height", json!(65_537), "film.height", "65537"),
        ("film.crop", json!([60, 0, 16, 16]), "film.crop", "[60, 0, 16, 16]"),
        ("film.crop", json!([0, 0, 0, 16]), "film.crop", "area"),
        ("film.crop", json!([u32::MAX, 0, 2, 2]), "film.crop", "4294967295"),
        ("film.filter", json!({ "type": "box", "radius": 0 }), "film.filter.radius", "0"),
        ("film.filter", json!({ "type": "tent", "radius": -1 }), "film.filter.radius", "-1"),
        ("film.filter", json!({ "type": "tent", "radius": 1e39 }), "film.filter.radius", "inf"),
        ("film.filter.sigma", json!(0), "film.filter.sigma", "0"),
        ("film.filter.sigma", json!(1e39), "film.filter.sigma", "inf"),
        ("film.filter", json!({ "type": "mitchell", "b": 2 }), "film.filter.b", "2"),
        ("sampler.spp", json!(0), "sampler.spp", "1"),
        ("integrator.max_depth", json!(0), "integrator.max_depth", "1"),
        ("integrator.rr_depth", json!(0), "integrator.rr_depth", "1"),
        ("integrator.light_samples", json!(0), "integrator.light_samples", "1 to 64"),
        ("integrator.light_samples", json!(65), "integrator.light_samples", "65"),
        ("integrator", json!({ "type": "whitted", "max_depth": 0 }), "integrator.max_depth", "0"),
        ("integrator", json!({ "type": "whitted", "ambient": [0, -1, 0] }), "integrator.ambient", "-1"),
        ("integrator", json!({ "type": "ambient_occlusion", "distance": 0 }), "integrator.distance", "0"),
        ("outputs[0].file", json!("out.jpg"), "outputs[0].file", "out.jpg"),
        ("camera.vertical_fov_degrees", json!(0), "camera.vertical_fov_degrees", "0"),
        ("camera.vertical_fov_degrees", json!(180), "camera.vertical_fov_degrees", "180"),
        ("camera.look_at", json!([0, 1, 5]), "camera", "looks at the very point"),
        ("camera.up", json!([0, 0, 2]), "camera", "parallel"),
        ("camera.up", json!([0, 0, 0]), "camera.up", "zero"),
        ("camera.look_at", Value::Null, "camera", "`look_at`"),
        ("camera.position", Value::Null, "camera", "`position`"),
        ("camera", json!({}), "camera", "`position` and `look_at`, or `transform`"),
        ("camera.transform", json!([]), "camera", "either"),
        ("camera", json!({ "transform": [{ "scale": [1, 2, 1] }] }), "camera.transform", "rotation"),
        ("camera", json!({ "transform": [{ "scale": -1 }] }), "camera.transform", "rotation"),
        ("camera", json!({ "transform": [{ "scale": 0 }] }), "camera.transform", "rotation"),
        ("camera.lens.radius", json!(-0.1), "camera.lens.radius", "-0.1"),
        ("camera.lens.f_number", json!(2), "camera.lens", "`f_number`"),
        ("camera.lens", json!({ "f_number": 2, "focus_distance": 1 }), "camera.lens", "`focal_length`"),
        ("camera.lens", json!({ "f_number": 0, "focal_length": 1, "focus_distance": 1 }), "camera.lens.f_number", "0"),
        ("camera.lens", json!({ "radius": 0.1 }), "camera.lens", "`focus_distance`"),
        ("camera.lens.focus_point", json!([0, 1, 0]), "camera.lens", "`focus_point`"),
        ("camera.lens.focus_distance", json!(0), "camera.lens.focus_distance", "0"),
        ("camera.lens", json!({ "radius": 0.1, "focus_point": [0, 1, 6] }), "camera.lens.focus_point", "behind"),
    ];
    assert_faults(faults);

    // The same checks without compiling.
    let folder = Folder::new();
    for (path, value, place, _) in faults {
        let mut scene = good_scene();
        set(&mut scene, path, value.clone());
        let file = folder.write("scene.json", scene.to_string());
        let message =
            CheckedScene::new(&import::load_scene(&file).unwrap(), SceneSource::new(&file)).unwrap_err().to_string();
        assert!(message.contains(&format!("{place}: ")), "{message}");
    }
}

#[test]
fn materials_out_of_range() {
    assert_faults(&[
        ("materials.tiled.albedo", json!([0.5, 1.1, 0.5]), "materials.tiled.albedo", "1.1"),
        ("materials.tiled.albedo", json!(-0.1), "materials.tiled.albedo", "-0.1"),
        ("materials.mirror.reflectance", json!(2), "materials.mirror.reflectance", "2.0"),
        (
            "materials.mirror.reflectance",
            json!({ "texture": "tile" }),
            "materials.mirror.reflectance",
            "did you mean \"tiles\"?",
        ),
        ("materials.Gold.multiscatter", json!(1), "materials.Gold.multiscatter", "true or false"),
        ("materials.Gold.roughness", json!({ "texture": "wood" }), "materials.Gold.roughness", "no texture"),
        ("materials.Gold.roughness", json!([0.1, 0.2, 0.3]), "materials.Gold.roughness", "expected a number"),
        ("materials.paint.alpha", json!({ "texture": "tile" }), "materials.paint.alpha", "did you mean \"tiles\"?"),
        ("materials.paint.ior", json!({ "texture": "tiles" }), "materials.paint.ior", "\"range\": [low, high]"),
        ("materials.paint.ior", json!({ "texture": "tile", "range": [1.1, 2] }), "materials.paint.ior", "no texture"),
        (
            "materials.paint.ior",
            json!({ "texture": "tiles", "range": [1, 2] }),
            "materials.paint.ior.range[0]",
            "above 1",
        ),
        (
            "materials.paint.ior",
            json!({ "texture": "tiles", "range": [1.1, 20] }),
            "materials.paint.ior.range[1]",
            "20",
        ),
        (
            "materials.glass.ior",
            json!({ "texture": "tiles", "range": [1.1, 2] }),
            "materials.glass.ior",
            "cannot come from a texture",
        ),
        ("materials.tiled.roughness", json!(1.5), "materials.tiled.roughness", "1.5"),
        ("materials.Gold.tint", json!([1, 1, 1.5]), "materials.Gold.tint", "1.5"),
        ("materials.Gold.eta", json!([1, 1, 1]), "materials.Gold", "`metal`"),
        ("materials.Gold.metal", Value::Null, "materials.Gold", "`metal`"),
        ("materials.Gold", json!({ "type": "conductor", "eta": [1, 1, 1] }), "materials.Gold", "`k`"),
        (
            "materials.Gold",
            json!({ "type": "conductor", "eta": [1, 0, 1], "k": [1, 1, 1] }),
            "materials.Gold.eta",
            "0.0",
        ),
        ("materials.Gold", json!({ "type": "conductor", "eta": [1, 1, 1], "k": [1, -1, 1] }), "materials.Gold.k", "-1"),
        ("materials.Gold.roughness", json!(1.5), "materials.Gold.roughness", "1.5"),
        ("materials.Gold.roughness", json!([0.1, -0.5]), "materials.Gold.roughness", "-0.5"),
        ("materials.Gold.alpha", json!(0.1), "materials.Gold", "`alpha`"),
        ("materials.paint.alpha", json!(2), "materials.paint.alpha", "2"),
        ("materials.paint.ior", json!(1), "materials.paint.ior", "1"),
        ("materials.glass.ior", json!(0), "materials.glass.ior", "0"),
        ("materials.glass.ior", json!(11), "materials.glass.ior", "11"),
        ("textures.tiles.color0", json!([2, 0, 0]), "textures.tiles.color0", "2.0"),
        ("textures.grey.color", json!([0, -1, 0]), "textures.grey.color", "-1.0"),
        ("textures.tiles.scale", json!([1e39, 1]), "textures.tiles.scale", "finite"),
    ]);
}

#[test]
fn older_and_thin_materials_out_of_range() {
    let glass = "materials.glass";
    assert_faults(&[
        (glass, json!({ "type": "thin_dielectric", "ior": 0 }), "materials.glass.ior", "0"),
        (
            glass,
            json!({ "type": "diffuse_transmission", "reflectance": 0.6, "transmittance": 0.6 }),
            glass,
            "`transmittance`",
        ),
        (glass, json!({ "type": "diffuse_transmission", "transmittance": -1 }), "materials.glass.transmittance", "-1"),
        (glass, json!({ "type": "diffuse_transmission", "reflectance": 2 }), "materials.glass.reflectance", "2"),
        (glass, json!({ "type": "phong", "exponent": -1 }), "materials.glass.exponent", "-1"),
        (
            glass,
            json!({ "type": "phong", "exponent": { "texture": "tiles", "range": [0, -1] } }),
            "materials.glass.exponent.range[1]",
            "-1",
        ),
        (
            glass,
            json!({ "type": "thin_dielectric", "ior": { "texture": "tiles", "range": [0, 1] } }),
            "materials.glass.ior.range[0]",
            "0",
        ),
        (glass, json!({ "type": "cook_torrance", "m": { "texture": "tile" } }), "materials.glass.m", "no texture"),
        (glass, json!({ "type": "cook_torrance", "f0": { "texture": "tile" } }), "materials.glass.f0", "no texture"),
        (glass, json!({ "type": "phong", "exponent": 1e39 }), "materials.glass.exponent", "inf"),
        (glass, json!({ "type": "phong", "diffuse": 0.7, "specular": 0.7 }), glass, "`specular`"),
        (glass, json!({ "type": "phong", "diffuse": 1.5 }), "materials.glass.diffuse", "1.5"),
        (glass, json!({ "type": "phong", "specular": 1.5 }), "materials.glass.specular", "1.5"),
        (glass, json!({ "type": "cook_torrance", "d": 0.7, "s": 0.7 }), glass, "0.7"),
        (glass, json!({ "type": "cook_torrance", "d": -0.5 }), "materials.glass.d", "-0.5"),
        (glass, json!({ "type": "cook_torrance", "s": 1.5 }), "materials.glass.s", "1.5"),
        (glass, json!({ "type": "cook_torrance", "m": 2 }), "materials.glass.m", "2"),
        (glass, json!({ "type": "cook_torrance", "f0": [0, 2, 0] }), "materials.glass.f0", "2.0"),
        (glass, json!({ "type": "cook_torrance", "albedo": [0, -1, 0] }), "materials.glass.albedo", "-1.0"),
    ]);
}

#[test]
fn lights_out_of_range() {
    assert_faults(&[
        ("lights[0].intensity", json!([1, -1, 1]), "lights[0].intensity", "-1"),
        ("lights[0].intensity", json!([1, 1e39, 1]), "lights[0].intensity", "inf"),
        ("lights[1].look_at", json!([0, 5, 0]), "lights[1].look_at", "own position"),
        ("lights[1].cutoff_angle_degrees", json!(0), "lights[1].cutoff_angle_degrees", "0"),
        ("lights[1].cutoff_angle_degrees", json!(181), "lights[1].cutoff_angle_degrees", "181"),
        ("lights[1].beam_angle_degrees", json!(30), "lights[1].beam_angle_degrees", "30"),
        ("lights[2].direction", json!([0, 0, 0]), "lights[2].direction", "zero"),
        ("lights[2].irradiance", json!([-1, 0, 0]), "lights[2].irradiance", "-1"),
        ("lights[2].angular_diameter_degrees", json!(180), "lights[2].angular_diameter_degrees", "180"),
        ("lights[3].radiance", json!([-1, 0, 0]), "lights[3].radiance", "-1"),
        ("lights[3].radiance", Value::Null, "lights[3]", "`radiance` or `file`"),
        ("lights[3].file", json!("sky.exr"), "lights[3]", "`radiance` or `file`"),
        ("lights[3].scale", json!(-1), "lights[3].scale", "-1"),
        ("lights[3].transform", json!([{ "scale": 2 }]), "lights[3].transform", "rotated"),
        ("lights[3].transform", json!([{ "scale": [1, 1, 2] }]), "lights[3].transform", "rotated"),
        ("shapes[1].emission.radiance", json!([1, -1, 1]), "shapes[1].emission.radiance", "-1"),
        (
            "objects.lamp.shapes[1].emission.radiance",
            json!([1, 1, -1]),
            "objects.lamp.shapes[1].emission.radiance",
            "-1",
        ),
    ]);
}

#[test]
fn shapes_out_of_range() {
    assert_faults(&[
        ("shapes[0].radius", json!(0), "shapes[0]", "radius"),
        ("shapes[0].radius", json!(-1), "shapes[0]", "-1"),
        ("shapes[0].z_min", json!(2), "shapes[0]", "z_min 2"),
        ("shapes[0].phi_max_degrees", json!(400), "shapes[0]", "400"),
        ("shapes[0].phi_max_degrees", json!(0), "shapes[0]", "0"),
        ("shapes[0].radius", json!(1e39), "shapes[0]", "at most 1e30"),
        ("shapes[2].edge_u", json!([0, 2, 0]), "shapes[2]", "edges"),
        ("shapes[3].inner_radius", json!(1), "shapes[3]", "inner"),
        ("shapes[4].height", json!(0), "shapes[4]", "height"),
        ("shapes[5].radius", json!(0), "shapes[5]", "radii"),
        ("shapes[6].profile.bezier", json!([[1, 0], [1, 1]]), "shapes[6]", "2"),
        ("shapes[6].profile.bezier", json!([[1, 0], [-5, 1], [-5, 2], [1, 3]]), "shapes[6]", "axis"),
        ("shapes[6].profile", json!({ "b_spline": [[1, 0], [1, 1]] }), "shapes[6]", "2"),
        ("shapes[0].transform", json!([{ "scale": [1, 0, 1] }]), "shapes[0].transform", "singular"),
        (
            "shapes[0].transform",
            json!([{ "rotate": { "axis": [0, 0, 0], "degrees": 10 } }]),
            "shapes[0].transform[0].rotate.axis",
            "zero",
        ),
        (
            "shapes[0].transform[1]",
            json!({ "matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]] }),
            "shapes[0].transform[1].matrix",
            "2",
        ),
        (
            "shapes[0].transform",
            json!([{ "look_at": { "from": [0, 0, 0], "to": [0, 1, 0] } }]),
            "shapes[0].transform[0].look_at",
            "parallel",
        ),
        ("instances[0].transform", json!([{ "scale": 0 }]), "instances[0].transform", "singular"),
    ]);
}

#[test]
fn inline_meshes_that_make_no_sense() {
    assert_faults(&[
        ("shapes[1].triangles", json!([[0, 1, 3]]), "shapes[1]", "vertex 3"),
        ("shapes[1].positions[1]", json!([1e39, 0, 0]), "shapes[1]", "vertex 1"),
        ("shapes[1].triangles", Value::Null, "shapes[1]", "`triangles`"),
        ("shapes[1].positions", Value::Null, "shapes[1]", "`positions`"),
        ("shapes[1].file", json!("a.ply"), "shapes[1]", "either `file`"),
        ("shapes[1].normals", json!([[0, 0, 1]]), "shapes[1]", "normals: 1 for 3"),
        ("shapes[1].uvs", json!([[0, 0], [1, 1], [1e39, 0]]), "shapes[1]", "uv of vertex 2"),
    ]);
}

#[test]
fn objects_that_contain_each_other() {
    let instances =
        |names: &[&str]| json!({ "instances": names.iter().map(|name| json!({ "object": name })).collect::<Vec<_>>() });
    let folder = Folder::new();
    let mut scene = good_scene();
    scene["objects"]["a"] = instances(&["lamp", "b"]);
    scene["objects"]["b"] = instances(&["a"]);
    // Whether or not the world has an instance of them.
    for reached in [false, true] {
        if reached {
            scene["instances"][0]["object"] = json!("b");
        }
        let cycle = if reached { "b > a > b" } else { "a > b > a" };
        assert_error(&folder, &scene, ErrorKind::Scene, &["objects.", ".instances[", cycle]);
    }
    scene["objects"]["a"] = instances(&["a"]);
    assert_error(&folder, &scene, ErrorKind::Scene, &["objects.a.instances[0]", "a > a"]);
}

#[test]
fn objects_that_multiply_without_end() {
    let folder = Folder::new();
    let chain = |depth: usize, width: usize| {
        let mut scene = good_scene();
        for level in 0..depth {
            let inner = if level + 1 == depth { "lamp".to_owned() } else { format!("o{}", level + 1) };
            scene["objects"][format!("o{level}")] = json!({ "instances": vec![json!({ "object": inner }); width] });
        }
        scene["instances"] = json!([{ "object": "o0" }]);
        scene
    };
    assert!(folder.compile(&chain(60, 1)).is_ok());
    assert_error(&folder, &chain(40, 2), ErrorKind::Scene, &["instances: ", "more than"]);
    assert_error(&folder, &chain(5_000, 1), ErrorKind::Scene, &[".instances[0]: ", "more than 64 deep"]);
    // Nothing many times is nothing.
    let mut hollow = chain(40, 2);
    hollow["objects"]["lamp"] = json!({});
    assert_eq!(folder.compile(&hollow).unwrap().geometry.instances.len(), 0);
}

#[test]
fn scenes_without_light_or_content() {
    let folder = Folder::new();
    let dark = |integrator: Value| {
        json!({
            "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
            "shapes": [{ "type": "sphere", "emission": { "radiance": [0, 0, 0] } }],
            "lights": [{ "type": "point", "position": [0, 5, 0], "intensity": [0, 0, 0] }],
            "integrator": integrator
        })
    };
    assert_error(&folder, &dark(json!({ "type": "path" })), ErrorKind::Scene, &["lights: ", "the scene has no light"]);
    assert_error(&folder, &dark(json!({ "type": "whitted" })), ErrorKind::Scene, &["the scene has no light"]);
    for kind in ["normal", "shading_normal", "uv", "depth", "primitive_id", "ambient_occlusion"] {
        assert!(folder.compile(&dark(json!({ "type": kind }))).is_ok(), "{kind}");
    }
    assert!(folder.compile(&dark(json!({ "type": "whitted", "ambient": [1, 1, 1] }))).is_ok());

    let mut empty = dark(json!({ "type": "path" }));
    empty["shapes"] = json!([]);
    assert_error(&folder, &empty, ErrorKind::Scene, &["shapes: ", "no shapes"]);
    empty["lights"] = json!([{ "type": "environment", "radiance": [1, 1, 1] }]);
    assert!(folder.compile(&empty).is_ok());
}
