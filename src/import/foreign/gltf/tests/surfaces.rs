//! Triangles and the accessors behind them.

use super::*;

/// A file of one primitive of these corners, drawn in a mode.
fn drawn(mode: u32, indices: Option<&[u16]>, count: usize) -> Imported {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    let positions: Vec<[f32; 3]> = (0..count).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    let positions = asset.floats(&positions);
    let mut primitive = json!({ "attributes": { "POSITION": positions }, "mode": mode });
    if let Some(indices) = indices {
        primitive["indices"] = json!(asset.indices(indices));
    }
    asset.mesh(primitive);
    asset.read()
}

#[test]
fn modes_make_triangles() {
    assert_eq!(mesh(&drawn(4, None, 7), 0).triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh(&drawn(5, None, 5), 0).triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    assert_eq!(mesh(&drawn(6, None, 5), 0).triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert_eq!(mesh(&drawn(6, Some(&[3, 0, 1, 2]), 4), 0).triangles, [[3, 0, 1], [3, 1, 2]]);
    for mode in 0..4 {
        let imported = drawn(mode, None, 4);
        assert!(imported.desc.shapes.is_empty());
        assert_eq!(outcome(&imported, "mode"), Some(Outcome::Ignored));
    }
}

#[test]
fn vertices_that_no_triangle_uses_are_left_out() {
    let imported = drawn(4, Some(&[6, 2, 4]), 9);
    assert_eq!(mesh(&imported, 0).triangles, [[2, 0, 1]]);
    assert_eq!(mesh(&imported, 0).positions.iter().map(|p| p[0]).collect::<Vec<_>>(), [2.0, 4.0, 6.0]);
}

#[test]
fn without_normals_a_mesh_is_flat() {
    assert!(mesh(&drawn(4, None, 3), 0).normals.is_none());
}

#[test]
fn numbers_are_read_in_every_form() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    // Signed bytes in proportion, four bytes apart, from the second element of the view on.
    let view = asset.view(&[9, 9, 9, 9, 127, 129, 128, 0, 0, 64, 0, 0, 0, 0, 127]);
    asset.json["bufferViews"][view]["byteStride"] = json!(4);
    let positions = json!({
        "bufferView": view, "byteOffset": 4, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"
    });
    let positions = asset.accessor(positions);
    // Unsigned shorts as they are.
    let view = asset.view(&[1, 0, 0, 1, 3, 0, 0, 0, 5, 0, 6, 0]);
    asset.json["materials"] = json!([{ "normalTexture": { "index": 0 } }]);
    asset.json["textures"] = json!([{ "source": 0 }]);
    asset.json["images"] = json!([{ "uri": "n.png" }]);
    let uvs = asset.accessor(json!({ "bufferView": view, "componentType": 5123, "count": 3, "type": "VEC2" }));
    asset.mesh(json!({ "attributes": { "POSITION": positions, "TEXCOORD_0": uvs }, "material": 0 }));
    let imported = asset.read();
    let mesh = mesh(&imported, 0);
    assert_eq!(mesh.positions, [[1.0, -1.0, -1.0], [0.0, 64.0 / 127.0, 0.0], [0.0, 0.0, 1.0]]);
    // v is counted from below.
    assert_eq!(mesh.uvs.as_ref().unwrap()[..], [[1.0, -255.0], [3.0, 1.0], [5.0, -5.0]]);
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    let base = asset.floats(&[[1.0f32, 1.0, 1.0], [2.0, 2.0, 2.0], [3.0, 3.0, 4.0]]);
    let indices = asset.view(&[2, 0]);
    let values: Vec<u8> = [7.0f32, 8.0, 9.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let values = asset.view(&values);
    let sparse = json!({
        "count": 1, "indices": { "bufferView": indices, "componentType": 5123 }, "values": { "bufferView": values }
    });
    asset.json["accessors"][base]["sparse"] = sparse.clone();
    asset.mesh(json!({ "attributes": { "POSITION": base } }));
    assert_eq!(mesh(&asset.read(), 0).positions, [[1.0; 3], [2.0; 3], [7.0, 8.0, 9.0]]);
    // Without a view all else is zero.
    asset.json["accessors"][base] = json!({ "componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse });
    assert_eq!(mesh(&asset.read(), 0).positions, [[0.0; 3], [0.0; 3], [7.0, 8.0, 9.0]]);
}

#[test]
fn accessors_that_reach_too_far_are_errors() {
    let broken = |change: &dyn Fn(&mut Asset), message: &str| {
        let mut asset = Asset::new(json!([{ "mesh": 0 }]));
        asset.square(json!({}));
        change(&mut asset);
        let error = asset.try_read().unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("scene.gltf"), "{error}");
    };
    broken(
        &|a| a.json["accessors"][0]["count"] = json!(5),
        "5 elements do not fit into bufferViews[0], which has 48 bytes",
    );
    broken(&|a| a.json["accessors"][0]["count"] = json!(u64::MAX), "elements do not fit");
    broken(&|a| a.json["accessors"][0]["byteOffset"] = json!(4), "4 elements do not fit");
    broken(&|a| a.json["accessors"][0]["byteOffset"] = json!(u64::MAX), "4 elements do not fit");
    broken(&|a| a.json["bufferViews"][0]["byteLength"] = json!(1u64 << 40), "are not all in buffers[0]");
    broken(&|a| a.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "are not all in buffers[0]");
    broken(&|a| a.json["bufferViews"][0]["byteStride"] = json!(8), "elements of 12 bytes stand 8 bytes apart");
    broken(&|a| a.json["accessors"][0]["type"] = json!("VEC2"), "has elements of type VEC2, but VEC3 is needed");
    broken(&|a| a.json["accessors"][3]["componentType"] = json!(5126), "has numbers that are no indices");
    broken(&|a| a.json["accessors"][0]["count"] = json!(3), "index 5 is 3, but there are 3 vertices");
    broken(&|a| a.json["bufferViews"][0]["buffer"] = json!(1), "no element of this index");
    let sparse = |count: u64| {
        let part = json!({ "bufferView": 0, "componentType": 5121 });
        json!({
            "componentType": 5126, "count": count, "type": "VEC3",
            "sparse": { "count": 1, "indices": part, "values": { "bufferView": 0 } }
        })
    };
    broken(&|a| a.json["accessors"][0] = sparse(1 << 40), "more than the file has bytes");
    broken(
        &|a| {
            let far = a.view(&[9]);
            let part = json!({ "bufferView": far, "componentType": 5121 });
            a.json["accessors"][0]["sparse"] = json!({ "count": 1, "indices": part, "values": { "bufferView": 0 } });
        },
        "replaces element 9 of 4",
    );
}

#[test]
fn the_same_bytes_cannot_become_endlessly_many_vertices() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    let positions: Vec<[f32; 3]> = (0..3000).map(|i| [i as f32, (i % 7) as f32, 0.0]).collect();
    let positions = asset.floats(&positions);
    let primitive = json!({ "attributes": { "POSITION": positions }, "mode": 5 });
    asset.mesh(primitive.clone());
    asset.json["meshes"][0]["primitives"] = json!(vec![primitive; 3000]);
    assert!(asset.try_read().unwrap_err().to_string().contains("the same data is used again and again"));
}
