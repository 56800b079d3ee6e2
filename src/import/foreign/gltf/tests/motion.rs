//! Animations, skins and morph targets.

use super::*;

/// A square whose node moves: the path, times and values of one channel.
fn moving<const N: usize>(path: &str, interpolation: &str, times: &[f32], values: &[[f32; N]]) -> Asset {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    asset.square(json!({}));
    animate(&mut asset, 0, path, interpolation, times, values);
    asset
}

fn animate<const N: usize>(
    asset: &mut Asset,
    node: usize,
    path: &str,
    interpolation: &str,
    times: &[f32],
    values: &[[f32; N]],
) {
    let input = asset.floats(&times.iter().map(|t| [*t]).collect::<Vec<_>>());
    let output = asset.floats(values);
    let animation = json!({
        "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        "samplers": [{ "input": input, "output": output, "interpolation": interpolation }]
    });
    match asset.json["animations"].as_array_mut() {
        Some(animations) => animations.push(animation),
        None => asset.json["animations"] = json!([animation]),
    }
}

fn place_at(asset: &Asset, time: f64) -> DAffine3 {
    place(&asset.read_at(time).unwrap().desc.shapes[0])
}

#[test]
fn keyframes_are_joined_as_they_say() {
    let values = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 8.0, 0.0]];
    let x = |asset: &Asset, time: f64| place_at(asset, time).translation.to_array();
    let linear = moving("translation", "LINEAR", &[1.0, 2.0, 4.0], &values);
    assert_eq!(x(&linear, 0.0), [0.0, 0.0, 0.0]);
    assert_eq!(x(&linear, 1.25), [1.0, 0.0, 0.0]);
    assert_eq!(x(&linear, 3.0), [4.0, 4.0, 0.0]);
    assert_eq!(x(&linear, 9.0), [4.0, 8.0, 0.0]);
    let step = moving("translation", "STEP", &[1.0, 2.0, 4.0], &values);
    assert_eq!(x(&step, 1.99), [0.0, 0.0, 0.0]);
    assert_eq!(x(&step, 2.0), [4.0, 0.0, 0.0]);
    // In-tangent, value, out-tangent, the tangents per second: p(t) = t³ - t² + t from 0 to 2, whose slopes are 1 and
    // 9.
    let (none, first, last) = ([0.0; 3], [1.0, 0.0, 0.0], [9.0, 0.0, 0.0]);
    let cubic = moving("translation", "CUBICSPLINE", &[0.0, 2.0], &[none, none, first, last, [6.0, 0.0, 0.0], none]);
    for t in [0.0f64, 0.5, 1.0, 1.75, 2.0] {
        assert_close(place_at(&cubic, t).translation, [t.powi(3) - t.powi(2) + t, 0.0, 0.0]);
    }
}

#[test]
fn rotations_go_the_short_way_round_evenly() {
    // From 0 to 120 degrees about z, the second with its sign turned.
    let end = [0.0, 0.0, -(60f32.to_radians().sin()), -(60f32.to_radians().cos())];
    let asset = moving("rotation", "LINEAR", &[0.0, 1.0], &[[0.0, 0.0, 0.0, 1.0], end]);
    let (sin, cos) = 30f64.to_radians().sin_cos();
    assert_close(place_at(&asset, 0.25).transform_vector3(DVec3::X), [cos, sin, 0.0]);
}

#[test]
fn the_first_animation_of_a_property_counts() {
    let mut asset = moving("scale", "STEP", &[0.0], &[[2.0, 2.0, 2.0]]);
    animate(&mut asset, 0, "scale", "STEP", &[0.0], &[[3.0, 3.0, 3.0]]);
    animate(&mut asset, 0, "translation", "STEP", &[0.0], &[[5.0, 0.0, 0.0]]);
    assert_close(place_at(&asset, 0.0).transform_point3(DVec3::X), [7.0, 0.0, 0.0]);
    let imported = asset.read();
    let ignored = |e: &&crate::import::ReportEntry| e.parameter == "channel" && e.outcome == Outcome::Ignored;
    assert_eq!(
        imported.report.entries.iter().filter(ignored).map(|e| e.place.as_str()).collect::<Vec<_>>(),
        ["animations[1].channels[0]"]
    );
}

#[test]
fn animations_that_make_no_sense_are_errors() {
    let fault = |asset: Asset, message: &str| {
        let error = asset.try_read().unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("animations[0].channels[0]"), "{error}");
    };
    fault(moving("translation", "LINEAR", &[0.0, 1.0], &[[0.0; 3]; 3]), "has 2 times, but 3 values");
    fault(moving("translation", "CUBICSPLINE", &[0.0, 1.0], &[[0.0; 3]; 2]), "has 2 times, but 2 values");
    fault(
        moving("translation", "LINEAR", &[1.0, 1.0], &[[0.0; 3]; 2]),
        "time 1 of 2 does not come after the one before",
    );
    fault(moving("translation", "LINEAR", &[0.0, f32::NAN], &[[0.0; 3]; 2]), "time 1 of 2");
    fault(moving("rotation", "LINEAR", &[0.0, 1.0], &[[0.0; 4]; 2]), "does not give a rotation");
    fault(moving("rotation", "LINEAR", &[0.0, 1.0], &[[0.0; 3]; 2]), "has elements of type VEC3, but VEC4 is needed");
}

/// A square with two morph targets.
fn morphing() -> Asset {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    asset.square(json!({}));
    let targets = [[0.0f32, 0.0, 1.0], [0.0, 2.0, 0.0]].map(|step| json!({ "POSITION": asset.floats(&[step; 4]) }));
    asset.json["meshes"][0]["primitives"][0]["targets"] = json!(targets);
    asset
}

#[test]
fn morph_targets_add_up_by_their_weights() {
    let mut asset = morphing();
    assert_eq!(mesh(&asset.read(), 0).positions[1], [1.0, 0.0, 0.0]);
    asset.json["meshes"][0]["weights"] = json!([0.5, 0.25]);
    assert_eq!(mesh(&asset.read(), 0).positions[1], [1.0, 0.5, 0.5]);
    // A node's own weights come before those of its mesh, and an animation before both.
    asset.json["nodes"][0]["weights"] = json!([0, 1]);
    assert_eq!(mesh(&asset.read(), 0).positions[1], [1.0, 2.0, 0.0]);
    animate(&mut asset, 0, "weights", "LINEAR", &[0.0, 1.0], &[[0.0f32], [0.0], [1.0], [3.0]]);
    assert_eq!(mesh(&asset.read_at(0.5).unwrap(), 0).positions[1], [1.0, 3.0, 0.5]);
    asset.json["nodes"][0]["weights"] = json!([1]);
    asset.json.as_object_mut().unwrap().remove("animations");
    assert!(asset.try_read().unwrap_err().to_string().contains("nodes[0]: has 1 weights for 2 morph targets"));
}

#[test]
fn the_same_mesh_in_two_shapes_is_two_meshes() {
    let mut asset = morphing();
    asset.json["nodes"] =
        json!([{ "mesh": 0, "weights": [1, 0] }, { "mesh": 0, "weights": [0, 1] }, { "mesh": 0, "weights": [1, 0] }]);
    asset.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let imported = asset.read();
    assert_eq!((imported.desc.objects.len(), imported.desc.instances.len(), imported.desc.shapes.len()), (1, 2, 1));
    assert_eq!(mesh(&imported, 0).positions[0], [0.0, 2.0, 0.0]);
}

/// A square on two joints, its left side on the first and its right side on the second.
fn skinned() -> Asset {
    let mut asset = Asset::new(json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] }, { "translation": [0, 0, 1] }, { "translation": [0, 3, 0] }
    ]));
    asset.square(json!({}));
    let joints = asset.view(&[0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let joints = asset.accessor(json!({ "bufferView": joints, "componentType": 5121, "count": 4, "type": "VEC4" }));
    let weights =
        asset.floats(&[[1.0f32, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]]);
    let normals = asset.floats(&[[0.0f32, 0.0, 1.0]; 4]);
    let attributes = &mut asset.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    attributes["NORMAL"] = json!(normals);
    asset.json["skins"] = json!([{ "joints": [1, 2] }]);
    asset
}

#[test]
fn joints_carry_vertices_and_the_node_of_the_mesh_does_not() {
    let mut asset = skinned();
    let imported = asset.read();
    assert_eq!(place(&imported.desc.shapes[0]), DAffine3::IDENTITY);
    let positions = &mesh(&imported, 0).positions;
    assert_eq!(positions[..], [[0.0, 0.0, 1.0], [1.0, 3.0, 0.0], [1.0, 4.0, 0.0], [0.0, 2.5, 0.5]]);

    // Inverse bind matrices act first; the second joint turns x to y about z.
    let half = 0.5f64.sqrt();
    asset.json["nodes"][2] = json!({ "rotation": [0, 0, half, half] });
    let mut matrices = [[0.0f32; 16]; 2];
    for matrix in &mut matrices {
        (0..4).for_each(|k| matrix[5 * k] = 1.0);
    }
    matrices[1][12] = 10.0;
    let matrices = asset.floats(&matrices);
    asset.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
    let imported = asset.read();
    let corner = mesh(&imported, 0).positions[1];
    assert_close(DVec3::from(corner.map(f64::from)), [0.0, 11.0, 0.0]);
}

#[test]
fn normals_turn_with_their_joints() {
    let mut asset = skinned();
    // A quarter turn about x takes z to -y; a mirror keeps what is outside.
    let half = 0.5f64.sqrt();
    asset.json["nodes"][2] = json!({ "rotation": [half, 0, 0, half], "scale": [1, 1, 3] });
    asset.json["nodes"][1] = json!({ "scale": [-1, 1, 1] });
    let imported = asset.read();
    let normals = mesh(&imported, 0).normals.as_ref().unwrap();
    assert_close(DVec3::from(normals[1].map(f64::from)), [0.0, -1.0, 0.0]);
    assert_close(DVec3::from(normals[0].map(f64::from)), [0.0, 0.0, 1.0]);
}

#[test]
fn skins_that_make_no_sense_are_errors() {
    let fault = |change: &dyn Fn(&mut Asset), message: &str| {
        let mut asset = skinned();
        change(&mut asset);
        let error = asset.try_read().unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    };
    fault(&|a| a.json["skins"][0]["joints"] = json!([1]), "vertex 1 hangs on joint 1 of 1");
    fault(&|a| a.json["skins"][0]["joints"] = json!([1, 9]), "no element of this index");
    fault(
        &|a| {
            a.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("WEIGHTS_0");
        },
        "has JOINTS_0, but not WEIGHTS_0",
    );
    fault(
        &|a| {
            let one = a.floats(&[[0.0f32; 16]]);
            a.json["skins"][0]["inverseBindMatrices"] = json!(one);
        },
        "has 2 joints, but 1 matrices",
    );
}
