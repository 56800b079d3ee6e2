use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde_json::json;

use super::*;
use crate::assets::MeshData;
use crate::desc::{CameraDesc, ColorDesc, LayerKind, LightDesc, MaterialDesc, OpacityDesc, ShapeDesc};
use crate::film::Image;

/// The corners of a square that stands upright, and its triangles.
const SQUARE: ([[f64; 3]; 4], [[u32; 3]; 2]) =
    ([[-2.0, -1.0, -1.0], [2.0, -1.0, -1.0], [2.0, 3.0, -1.0], [-2.0, 3.0, -1.0]], [[0, 1, 2], [0, 2, 3]]);

/// A ball, a wall and a floor under a sky.
fn scene() -> SceneDesc {
    SceneDesc::default()
        .with_camera(CameraDesc::at([0.0, 1.0, 6.0], [0.0, 0.0, 0.0]))
        .with_material("ball", MaterialDesc::metal("gold", 0.2))
        .with_material("wall", MaterialDesc::diffuse([0.2, 0.5, 0.7]))
        .with_shape(ShapeDesc::sphere(0.8).with_material("ball"))
        .with_shape(ShapeDesc::mesh(&SQUARE.0, &SQUARE.1).with_material("wall"))
        .with_shape(ShapeDesc::quad([-5.0, -1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]))
        .with_light(LightDesc::environment([0.8, 0.9, 1.0]))
}

fn small(scene: SceneDesc) -> Renderer {
    Renderer::from_desc(scene).size(24, 16).spp(4)
}

fn picture(scene: SceneDesc) -> Image {
    small(scene).render().unwrap().into_image()
}

fn geometry(renderer: &Renderer) -> *const crate::geometry::Geometry {
    Arc::as_ptr(&renderer.loaded.as_ref().unwrap().scene.geometry)
}

#[test]
fn a_changed_camera_keeps_the_accelerator_and_gives_the_picture_of_a_new_renderer() {
    let mut renderer = small(scene());
    let first = renderer.render().unwrap().into_image();
    let kept = geometry(&renderer);
    let camera = CameraDesc::at([3.0, 2.0, 4.0], [0.0, 0.0, 0.0]).with_fov(30.0);
    let second = renderer.set_camera(camera.clone()).render().unwrap().into_image();
    assert_eq!((geometry(&renderer), renderer.loaded.as_ref().unwrap().build_seconds), (kept, 0.0));
    assert_ne!(first, second);
    assert_eq!(second, picture(scene().with_camera(camera)));
    // A faulty one is an error, and the scene is as it was.
    let faulty = CameraDesc::at([0.0; 3], [0.0; 3]);
    assert!(renderer.set_camera(faulty).render().unwrap_err().to_string().starts_with("scene: camera"));
    assert_eq!(renderer.set_camera(scene().camera).render().unwrap().into_image(), first);
    assert_eq!(geometry(&renderer), kept);
}

#[test]
fn planes_and_shutters_depend_on_the_camera() {
    let plane = scene().with_shape(ShapeDesc::plane([0.0, -2.0, 0.0], [0.0, 1.0, 0.0]));
    let mut renderer = small(plane.clone());
    renderer.render().unwrap();
    for camera in
        [CameraDesc::at([30.0, 20.0, 400.0], [0.0, 0.0, 0.0]), CameraDesc { shutter: [0.0, 3.0], ..scene().camera }]
    {
        let changed = renderer.set_camera(camera.clone()).render().unwrap().into_image();
        assert_eq!(changed, picture(plane.clone().with_camera(camera)));
    }
}

#[test]
fn a_changed_material_keeps_the_accelerator_and_gives_the_picture_of_a_new_renderer() {
    let mut renderer = small(scene());
    let first = renderer.render().unwrap().into_image();
    let kept = geometry(&renderer);
    for material in [MaterialDesc::diffuse([0.9, 0.1, 0.1]), MaterialDesc::glass(1.5), MaterialDesc::mirror()] {
        let changed = renderer.set_material("ball", material.clone()).render().unwrap().into_image();
        assert_ne!(changed, first);
        assert_eq!(changed, picture(scene().with_material("ball", material)));
        assert_eq!((geometry(&renderer), renderer.loaded.as_ref().unwrap().build_seconds), (kept, 0.0));
    }
    let faulty = MaterialDesc::diffuse(ColorDesc::Rgb([2.0, 0.0, 0.0]));
    assert!(renderer.set_material("ball", faulty).render().unwrap_err().to_string().contains("materials.ball.albedo"));
}

/// A scene with materials of every kind for what a change of one compiles.
fn scene_of_parts() -> SceneDesc {
    let json = json!({
        "camera": { "position": [0, 1, 6], "look_at": [0, 0, 0] },
        "textures": { "checks": { "type": "checker", "color0": [0.9, 0.8, 0.7], "color1": [0.1, 0.2, 0.1] } },
        "materials": {
            "ball": { "type": "conductor", "metal": "gold", "roughness": 0.2 },
            "floor": { "type": "diffuse", "albedo": { "texture": "checks" } },
            "wall": { "type": "diffuse", "albedo": [0.2, 0.5, 0.7] },
            "part": { "type": "diffuse", "albedo": [0.7, 0.1, 0.1] },
            "mixed": { "type": "mix", "materials": ["part", "wax"], "amount": 0.4 },
            "wax": { "type": "plastic", "albedo": [0.1, 0.7, 0.1] },
            "drop": { "type": "dielectric", "absorption": { "color": [0.5, 0.9, 0.9], "distance": 0.5 } }
        },
        "shapes": [
            { "type": "sphere", "material": "ball", "radius": 0.8 },
            { "type": "sphere", "material": "mixed", "radius": 0.5, "transform": [{ "translate": [-1.4, 0, 1] }] },
            { "type": "sphere", "material": "drop", "radius": 0.5, "transform": [{ "translate": [1.4, 0, 1] }] },
            { "type": "quad", "material": "floor", "origin": [-5, -1, 5], "edge_u": [10, 0, 0], "edge_v": [0, 0, -10] },
            { "type": "quad", "material": "wall", "origin": [-5, -1, -2], "edge_u": [10, 0, 0], "edge_v": [0, 9, 0] },
            {
                "type": "sphere", "radius": 0.3, "emission": { "radiance": [3, 3, 3] },
                "transform": [{ "translate": [-2, 2, 0] }]
            }
        ],
        "lights": [
            { "type": "environment", "radiance": [0.4, 0.5, 0.6] },
            { "type": "point", "position": [2, 3, 3], "intensity": [20, 20, 20], "group": "key" }
        ]
    });
    serde_json::from_value(json).unwrap()
}

#[test]
fn constants_are_replaced_in_the_compiled_scene_and_other_changes_compile_it_again() {
    let first = picture(scene_of_parts());
    for (is_replaced, path, value) in [
        (true, "materials.ball.roughness", json!(0.6)),
        (true, "materials.ball", json!({ "type": "dielectric" })),
        (true, "materials.ball", json!({ "type": "conductor", "metal": "gold", "roughness": [0.1, 0.6] })),
        (true, "materials.wall", json!({ "type": "mirror" })),
        (true, "lights[0].radiance", json!([0.9, 0.1, 0.1])),
        (true, "lights[1].intensity", json!([3, 30, 3])),
        (
            true,
            "lights[1]",
            json!({ "type": "directional", "direction": [0, -1, -1], "irradiance": [2, 2, 2], "group": "key" }),
        ),
        // A texture, before or after; a medium; a walk below the surface; a part of another material; two parts.
        (false, "materials.ball", json!({ "type": "diffuse", "albedo": { "texture": "checks" } })),
        (false, "materials.floor.albedo", json!(0.5)),
        (false, "materials.wall", json!({ "type": "dielectric", "priority": 1 })),
        (false, "materials.drop", json!({ "type": "dielectric" })),
        (false, "materials.wall", json!({ "type": "principled", "subsurface": 1, "subsurface_method": "random_walk" })),
        (false, "materials.part.albedo", json!(0.9)),
        (false, "materials.ball", json!({ "type": "mix", "materials": ["wall", "wax"] })),
        // Another group; no light at infinity any more.
        (
            false,
            "lights[1]",
            json!({ "type": "point", "position": [0, 3, 3], "intensity": [9, 9, 9], "group": "fill" }),
        ),
        (false, "lights[0]", json!({ "type": "point", "position": [0, 3, 3], "intensity": [9, 9, 9] })),
        (false, "textures.checks.color1", json!([0.1, 0.1, 0.9])),
    ] {
        let mut renderer = small(scene_of_parts());
        renderer.load().unwrap();
        let kept = geometry(&renderer);
        renderer.change(path, value.clone()).unwrap();
        let changed = renderer.render().unwrap().into_image();
        assert_ne!(changed, first, "{path} {value}");
        assert_eq!(changed, picture(renderer.scene().clone()), "{path} {value}");
        // Files are kept from the first time that the scene is compiled again.
        assert_eq!((renderer.files.is_none(), geometry(&renderer)), (is_replaced, kept), "{path} {value}");
    }
}

#[test]
fn a_change_after_a_fault_and_a_part_that_was_free_are_seen() {
    let mut renderer = small(scene_of_parts());
    let first = renderer.render().unwrap().into_image();
    renderer.change("materials.ball.roughness", 0.6).unwrap();
    renderer.change("lights[1].position", json!([1, 3, 3])).unwrap();
    renderer.change("materials.wall.albedo", json!([2, 0, 0])).unwrap();
    assert!(renderer.render().unwrap_err().to_string().contains("materials.wall.albedo"));
    renderer.change("materials.wall.albedo", 0.3).unwrap();
    let changed = renderer.render().unwrap().into_image();
    assert_ne!(changed, first);
    assert_eq!(changed, picture(renderer.scene().clone()));
    // A coat is one of constants too, and its base then a part.
    renderer.change("materials.ball", json!({ "type": "coated", "base": "wall" })).unwrap();
    renderer.render().unwrap();
    renderer.change("materials.wall.albedo", json!([0.9, 0.1, 0.1])).unwrap();
    assert_eq!(renderer.render().unwrap().into_image(), picture(renderer.scene().clone()));
}

#[test]
fn subdivision_follows_the_camera_and_the_film() {
    let mut desc = scene();
    let corners =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let mut mesh = ShapeDesc::mesh(&corners, &faces);
    if let ShapeDesc::Mesh(mesh) = &mut mesh {
        mesh.subdivision = serde_json::from_value(json!({ "scheme": "loop", "edge_length": 1 })).unwrap();
    }
    desc.shapes[0] = mesh;
    (desc.film.width, desc.film.height, desc.sampler.spp) = (24, 16, 1);
    let mut renderer = Renderer::from_desc(desc);
    renderer.render().unwrap();
    for (path, value) in [("camera.position", json!([0, 0.5, 2.5])), ("film.height", json!(64))] {
        let before = geometry(&renderer);
        renderer.change(path, value).unwrap();
        let changed = renderer.render().unwrap().into_image();
        assert_eq!(changed, Renderer::from_desc(renderer.scene().clone()).render().unwrap().into_image());
        assert_ne!(geometry(&renderer), before);
    }
}

#[test]
fn parameters_have_the_paths_of_the_scene_format() {
    let mut renderer = small(scene());
    assert_eq!(renderer.parameter("camera.position").unwrap(), json!([0.0, 1.0, 6.0]));
    assert_eq!(renderer.parameter("materials.ball.metal").unwrap(), "gold");
    assert_eq!(renderer.parameter("lights[0].radiance[2]").unwrap(), 1.0);
    renderer.render().unwrap();
    let kept = geometry(&renderer);
    renderer.change("materials.ball.roughness", 0.5).unwrap();
    renderer.change("camera.position[0]", 2.0).unwrap();
    renderer.change("sampler.spp", 2).unwrap();
    let changed = renderer.render().unwrap().into_image();
    let expected = scene()
        .with_camera(CameraDesc::at([2.0, 1.0, 6.0], [0.0, 0.0, 0.0]))
        .with_material("ball", MaterialDesc::metal("gold", 0.5));
    assert_eq!((changed, geometry(&renderer)), (picture(expected), kept));
    renderer.change("materials.ball.type", "mirror").unwrap();
    assert_eq!(renderer.parameter("materials.ball").unwrap()["reflectance"], 1.0);
    renderer.change("shapes[0].radius", 0.5).unwrap();
    for (path, message) in [
        ("materials.bal.albedo", "did you mean \"ball\""),
        ("materials.ball.albedo", "unknown field `albedo`"),
        ("shapes[9].radius", "no \"9\" in its shapes"),
        ("cmera.position", "paths begin with one of camera"),
        ("outputs", "paths begin with one of camera"),
    ] {
        let error = renderer.change(path, 0.5).unwrap_err().to_string();
        assert!(error.starts_with(&format!("scene: {path}: ")) && error.contains(message), "{error}");
    }
    renderer.render().unwrap();
}

#[test]
fn a_changed_shape_or_opacity_needs_another_accelerator() {
    let mut renderer = small(scene());
    renderer.render().unwrap();
    let (kept, mut changed) = (geometry(&renderer), scene());
    changed.shapes[0] = changed.shapes[0].clone().moved([0.5, 0.0, 0.0]);
    *renderer.scene_mut() = changed.clone();
    assert_eq!(renderer.render().unwrap().into_image(), picture(changed.clone()));
    assert_ne!(geometry(&renderer), kept);
    *changed.shapes[0].common_mut().opacity = Some(OpacityDesc::Number(0.5));
    *renderer.scene_mut() = changed.clone();
    let half = renderer.render().unwrap().into_image();
    assert_eq!(half, picture(changed.clone()));
    changed.materials.insert("ball".into(), MaterialDesc::diffuse(0.5));
    *renderer.scene_mut() = changed.clone();
    assert_eq!(renderer.render().unwrap().into_image(), picture(changed));
}

#[test]
fn a_lens_can_be_switched_off_and_on() {
    let mut desc = scene();
    desc.camera.lens = serde_json::from_str(r#"{ "radius": 0.3, "focus_distance": 3 }"#).unwrap();
    let mut renderer = small(desc);
    let blurred = renderer.render().unwrap().into_image();
    renderer.overrides_mut().no_depth_of_field = true;
    let sharp = renderer.render().unwrap().into_image();
    assert_eq!(sharp, picture(scene()));
    renderer.overrides_mut().no_depth_of_field = false;
    assert_eq!(renderer.render().unwrap().into_image(), blurred);
    assert_ne!(sharp, blurred);
}

#[test]
fn meshes_need_no_file() {
    let mut named = scene();
    named.shapes[1] = ShapeDesc::mesh_file("square.ply").with_material("wall");
    let positions = SQUARE.0.map(|p| p.map(|x| x as f32)).to_vec();
    let mesh = MeshData { positions, triangles: SQUARE.1.to_vec(), ..MeshData::default() };
    let image = small(named).with_mesh("square.ply", mesh).render().unwrap().into_image();
    assert_eq!(image, picture(scene()));
}

#[test]
fn layers_have_names_and_channels() {
    let rendering = small(scene()).layers(["N", "Z"]).unwrap().render().unwrap();
    let names: Vec<String> = rendering.layers().map(|layer| layer.name).collect();
    assert_eq!(names, ["color", "Z", "N"]);
    let normals = rendering.layer("N").unwrap();
    assert_eq!((normals.channels.as_slice(), normals.data.len()), (&["N.X", "N.Y", "N.Z"].map(String::from)[..], 1152));
    assert_eq!(normals.pixels().len(), 24 * 16);
    assert!(rendering.layer("P").is_none());
    let all = small(scene()).layers(["all"]).unwrap();
    assert!(all.overrides.layers.contains(&LayerKind::CryptoObject) && all.overrides.layers.len() > 20);
    let unknown = small(scene()).layers(["normls"]).err().unwrap();
    assert!(
        matches!(&unknown, Error::Setting { setting: "layers", message } if message.contains("normls")),
        "{unknown}"
    );
}

#[test]
fn errors_name_the_setting() {
    for (setting, renderer) in [
        ("spp", small(scene()).spp(0)),
        ("size", small(scene()).size(0, 3)),
        ("max_depth", small(scene()).max_depth(0)),
        ("threads", small(scene()).threads(1 << 20)),
        ("crop", small(scene()).crop([20, 0, 30, 2])),
        ("set", small(scene()).set("integrator.clmap", 3).unwrap()),
    ] {
        let mut renderer = renderer;
        match renderer.render() {
            Err(Error::Setting { setting: found, message }) => {
                assert_eq!(found, setting);
                assert!(message.starts_with(&format!("`{setting}`")) && !message.contains("--"), "{message}");
            }
            other => panic!("{setting}: {:?}", other.map(drop)),
        }
    }
    assert!(small(scene()).set("camera.near", 1).is_err());
}

#[test]
fn keys_of_the_scene_are_set() {
    let mut renderer =
        small(scene()).set("integrator.max_depth", 1).unwrap().set("sampler.type", "independent").unwrap();
    let same = small(scene()).max_depth(1);
    assert_eq!(renderer.settings().unwrap().integrator, same.settings().unwrap().integrator);
    assert_eq!(renderer.settings().unwrap().sampler, crate::sampling::SamplerKind::Independent);
    renderer.render().unwrap();
}

#[test]
fn files_hold_what_those_of_the_command_line_hold() {
    let folder = tempfile::tempdir().unwrap();
    let (file, picture) = (folder.path().join("s.json"), folder.path().join("a.exr"));
    std::fs::write(&file, serde_json::to_string(&scene()).unwrap()).unwrap();
    let mut renderer = Renderer::open(&file).unwrap().size(24, 16).spp(4).layers(["N", "crypto_object"]).unwrap();
    let rendering = renderer.render().unwrap();
    let info = rendering.info();
    assert!(info.world_to_camera.is_some() && info.world_to_ndc.is_some() && info.identities.is_some());
    assert_eq!((info.samples_per_pixel, info.statistics.unwrap().rays), (4, rendering.stats().rays.total()));
    rendering.save(&picture).unwrap();
    let recipe = RenderProvenance::from_value(crate::output::read_settings(&picture).unwrap(), &picture).unwrap();
    assert_eq!((recipe.scene_file.as_path(), recipe.settings.spp, recipe.settings.size), (file.as_path(), 4, [24, 16]));
    assert_eq!(crate::output::read_exr(&picture).unwrap().size, [24, 16]);
    let bytes = std::fs::read(&picture).unwrap();
    for name in ["N.X", "CryptoObject00.r", "worldToCamera", "cryptomatte/"] {
        assert!(bytes.windows(name.len()).any(|window| window == name.as_bytes()), "{name}");
    }
    rendering.save(folder.path().join("a.png")).unwrap();
    assert!(matches!(rendering.save(folder.path().join("a.jpg")), Err(Error::Usage(_))));
    assert_eq!(rendering.statistics()["spp"], 4);
    // What is no longer the scene of the file has no recipe.
    renderer.set_material("ball", MaterialDesc::mirror());
    assert!(renderer.render().unwrap().info().settings.is_none());
}

#[test]
fn progress_reaches_the_end_and_stops_are_heard() {
    let shares = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&shares);
    small(scene()).on_progress(move |share| seen.lock().unwrap().push(share)).render().unwrap();
    assert_eq!(shares.lock().unwrap().last(), Some(&1.0));

    let mut renderer = small(scene()).spp(1 << 30);
    let (stop, calls) = (renderer.stop_handle(), Arc::new(AtomicU64::new(0)));
    let count = Arc::clone(&calls);
    renderer = renderer.on_progress(move |_| {
        count.fetch_add(1, Ordering::Relaxed);
        stop.stop();
    });
    let rendering = renderer.render().unwrap();
    assert!(rendering.stats().interrupted && rendering.stats().spp_done < 1 << 30);
    assert!(calls.load(Ordering::Relaxed) > 0);
}

#[test]
fn a_render_that_is_continued_has_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("a.state");
    let kept = || small(scene()).checkpoint(&state, Duration::from_secs(60));
    kept().spp(2).render().unwrap();
    match kept().render() {
        Err(Error::Setting { setting: "checkpoint", message }) => assert!(message.contains("`resume`"), "{message}"),
        other => panic!("{:?}", other.map(drop)),
    }
    let continued = kept().resume(true).render().unwrap();
    assert_eq!(continued.image(), &picture(scene()));
    assert_eq!(default_outputs(Path::new("a/b/cornell.json")), ["cornell.exr", "cornell.png"]);
}

#[test]
fn a_sample_is_replayed() {
    let mut renderer = small(scene()).spp(1);
    let value = renderer.replay([12, 8], 0).unwrap();
    assert!(value.pixel.radiance.to_array().iter().all(|x| *x > 0.0));
    assert!(matches!(renderer.replay([24, 0], 0), Err(Error::Setting { setting: "pixel", .. })));
}
