//! Nodes, instances, cameras and lights.

use super::*;
use crate::desc::{CameraKindDesc, LightDesc};

#[test]
fn transforms_are_scale_then_rotation_then_translation_then_those_of_parents() {
    // A quarter turn about z takes x to y.
    let turn = [0.0, 0.0, 0.5f64.sqrt(), 0.5f64.sqrt()];
    let mut asset = Asset::new(json!([
        { "children": [1], "translation": [10, 0, 0], "rotation": turn },
        { "mesh": 0, "translation": [1, 0, 0], "rotation": turn, "scale": [2, 3, 4] }
    ]));
    asset.json["scenes"] = json!([{ "nodes": [0] }]);
    asset.square(json!({}));
    let imported = asset.read();
    let place = place(&imported.desc.shapes[0]);
    // Scaled to (2, 0, 0), turned to (0, 2, 0), moved to (1, 2, 0), turned to (-2, 1, 0), moved to (8, 1, 0).
    assert_close(place.transform_point3(DVec3::X), [8.0, 1.0, 0.0]);
    assert_close(place.transform_point3(DVec3::Y), [10.0, -2.0, 0.0]);
}

#[test]
fn matrices_are_written_column_by_column() {
    let mut asset = Asset::new(json!([{ "mesh": 0, "matrix": [1, 0, 0, 0, 5, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1] }]));
    asset.square(json!({}));
    let place = place(&asset.read().desc.shapes[0]);
    assert_close(place.transform_point3(DVec3::ZERO), [7.0, 8.0, 9.0]);
    assert_close(place.transform_vector3(DVec3::Y), [5.0, 1.0, 0.0]);
}

#[test]
fn a_mesh_that_is_seen_twice_is_an_object() {
    let mut asset = Asset::new(json!([
        { "mesh": 0, "translation": [1, 0, 0], "name": "left" }, { "mesh": 1, "name": "alone" },
        { "mesh": 0, "translation": [2, 0, 0] }, { "mesh": 0, "scale": [0, 1, 1] }
    ]));
    asset.square(json!({ "name": "a" }));
    asset.square(json!({ "name": "b" }));
    let imported = asset.read();
    assert_eq!((imported.desc.shapes.len(), imported.desc.objects.len(), imported.desc.instances.len()), (1, 1, 2));
    assert_eq!(imported.desc.shapes[0].common().material, Some("b"));
    assert_eq!(imported.assets.meshes.len(), 2);
    for (instance, x) in imported.desc.instances.iter().zip([1.0, 2.0]) {
        assert_close(place_of(instance).translation, [x, 0.0, 0.0]);
    }
    let names: Vec<_> = imported.desc.instances.iter().map(|instance| instance.name.as_deref()).collect();
    assert_eq!((names, imported.desc.shapes[0].common().name), (vec![Some("left"), None], Some("alone")));
    // What is scaled to nothing cannot be seen.
    assert!(imported.report.entries.iter().any(|e| e.place == "nodes[3]" && e.outcome == Outcome::Ignored));
}

#[test]
fn an_extension_places_a_mesh_many_times() {
    let mut asset = Asset::new(json!([{ "mesh": 0, "translation": [0, 0, 5], "name": "grass" }]));
    asset.square(json!({}));
    let places = asset.floats(&[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    asset.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    let imported = asset.read();
    assert_eq!(imported.desc.instances.len(), 3);
    assert!(imported.desc.instances.iter().all(|instance| instance.name.is_none()));
    assert_close(place_of(&imported.desc.instances[2]).translation, [3.0, 0.0, 5.0]);
}

#[test]
fn only_the_chosen_scene_is_shown() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }, { "mesh": 1 }]));
    asset.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1] }]);
    asset.json["scene"] = json!(1);
    asset.square(json!({ "name": "a" }));
    asset.square(json!({ "name": "b" }));
    let imported = asset.read();
    assert_eq!(imported.desc.shapes.iter().map(|s| s.common().material).collect::<Vec<_>>(), [Some("b")]);
    asset.json.as_object_mut().unwrap().retain(|key, _| !key.starts_with("scene"));
    assert_eq!(asset.read().desc.shapes.len(), 2);
}

#[test]
fn cameras_have_their_angle_shape_and_place() {
    let turn = [0.0, 0.5f64.sqrt(), 0.0, 0.5f64.sqrt()];
    let mut asset = Asset::new(json!([
        { "camera": 0, "translation": [1, 2, 3], "rotation": turn, "scale": [2, 5, 3] },
        { "camera": 1 }
    ]));
    asset.json["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 1.0, "aspectRatio": 2.0, "znear": 0.5, "zfar": 100 } },
        { "type": "orthographic", "orthographic": { "xmag": 4.0, "ymag": 2.5, "znear": 0.0, "zfar": 100 } }
    ]);
    let imported = asset.read();
    let camera = &imported.desc.camera;
    assert!((camera.vertical_fov_degrees.unwrap() - 57.295_779_5).abs() < 1e-4);
    assert_eq!((imported.desc.film.width, imported.desc.film.height), (1280, 640));
    assert_eq!(camera.near, 0.5);
    let place = map(camera.transform.as_ref().unwrap());
    // It looks along its own -Z; the turn takes that to -X. Its scale is no part of the picture.
    assert_close(place.transform_vector3(DVec3::NEG_Z), [-1.0, 0.0, 0.0]);
    assert_close(place.transform_vector3(DVec3::Y), [0.0, 1.0, 0.0]);
    assert_close(place.translation, [1.0, 2.0, 3.0]);

    asset.json["scenes"] = json!([{ "nodes": [1] }]);
    let imported = asset.read();
    assert_eq!(imported.desc.camera.kind, CameraKindDesc::Orthographic);
    assert_eq!(imported.desc.camera.view_height, Some(5.0));
    assert_eq!((imported.desc.film.width, imported.desc.film.height), (1280, 800));
}

#[test]
fn without_a_camera_all_is_seen_and_without_a_light_it_is_lit() {
    let mut asset = Asset::new(json!([{ "mesh": 0, "translation": [100, 0, -30], "scale": [40, 2, 2] }]));
    asset.square(json!({}));
    let imported = asset.read();
    let camera = &imported.desc.camera;
    let (from, to) = (DVec3::from(camera.position.unwrap()), DVec3::from(camera.look_at.unwrap()));
    let forward = (to - from).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let tangent = 20f64.to_radians().tan();
    let mut nearest = f64::INFINITY;
    for corner in [[100.0, 0.0, -30.0], [140.0, 0.0, -30.0], [100.0, 2.0, -30.0], [140.0, 2.0, -30.0]] {
        let p = DVec3::from(corner) - from;
        let depth = p.dot(forward);
        let room =
            [1.0 - p.dot(up).abs() / (depth * tangent), 1.0 - p.dot(right).abs() / (depth * tangent * 16.0 / 9.0)];
        assert!(depth > 0.0 && room.iter().all(|room| *room > 0.0), "{corner:?} {room:?}");
        nearest = room.into_iter().fold(nearest, f64::min);
    }
    assert!(nearest < 0.2, "much of the picture is empty: {nearest}");
    assert_eq!(imported.desc.lights.len(), 2);
    assert_eq!(outcome(&imported, "camera"), Some(Outcome::Approximated));
    assert_eq!(outcome(&imported, "lights"), Some(Outcome::Approximated));
}

#[test]
fn lights_shine_along_minus_z_by_their_units() {
    let half = 0.5f64.sqrt();
    let mut asset = Asset::new(json!([
        { "translation": [1, 2, 3], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "rotation": [-half, 0, 0, half], "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        {
            "translation": [0, 5, 0], "rotation": [-half, 0, 0, half],
            "extensions": { "KHR_lights_punctual": { "light": 2 } }
        }
    ]));
    asset.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    asset.json["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    asset.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "intensity": 8, "color": [1, 0.5, 0.25], "range": 3 },
        { "type": "directional", "intensity": 3 },
        { "type": "spot", "intensity": 2, "spot": { "innerConeAngle": 0.1 } }
    ] } });
    let imported = asset.read();
    let [LightDesc::Point(point), LightDesc::Directional(sun), LightDesc::Spot(spot)] = imported.desc.lights.as_slice()
    else {
        panic!("{:?}", imported.desc.lights);
    };
    assert_eq!((point.position, point.intensity), ([1.0, 2.0, 3.0], [8.0, 4.0, 2.0]));
    // A quarter turn about x, backward, takes -Z to -Y.
    assert_close(DVec3::from(sun.direction), [0.0, -1.0, 0.0]);
    assert_eq!(sun.irradiance, [3.0; 3]);
    assert_close((DVec3::from(spot.look_at) - DVec3::from(spot.position)).normalize(), [0.0, -1.0, 0.0]);
    assert!((spot.cutoff_angle_degrees - 45.0).abs() < 1e-9);
    assert!((spot.beam_angle_degrees.unwrap() - 5.729_578).abs() < 1e-5);
    assert_eq!(outcome(&imported, "units"), Some(Outcome::Approximated));
    assert_eq!(outcome(&imported, "range"), Some(Outcome::Ignored));

    asset.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(3);
    assert!(asset.try_read().unwrap_err().to_string().contains("no light 3"));
}
