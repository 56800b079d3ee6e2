//! Files that are none, or that must not end in a hang or a crash.

use super::*;
use crate::error::Error;

fn message(asset: &Asset) -> String {
    asset.try_read().unwrap_err().to_string()
}

#[test]
fn nodes_form_a_forest() {
    let mut asset = Asset::new(json!([{ "children": [1] }, { "children": [2] }, { "children": [1] }]));
    assert!(message(&asset).contains("nodes[2].children[0]: nodes[1] is below nodes[0] too: a node has one parent"));
    asset.json["nodes"] = json!([{}, { "children": [2] }, { "children": [1] }]);
    asset.json["scenes"][0]["nodes"] = json!([0]);
    assert!(message(&asset).contains("nodes[1]: is below itself"));
    asset.json["nodes"] = json!([{ "children": [0] }]);
    assert!(message(&asset).contains("nodes[0]: is below itself"));
    asset.json["nodes"] = json!([{ "children": [1] }, {}]);
    asset.json["scenes"][0]["nodes"] = json!([1]);
    assert!(message(&asset).contains("scenes[0].nodes[0]: nodes[1] is below nodes[0]: a scene lists roots"));
    asset.json["scenes"][0]["nodes"] = json!([0, 0]);
    assert!(message(&asset).contains("a node is listed twice"));
}

#[test]
fn a_chain_of_nodes_may_be_long() {
    const LENGTH: usize = 100_000;
    let mut nodes: Vec<Value> = (1..LENGTH).map(|i| json!({ "children": [i], "translation": [0, 0, 1] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    let mut asset = Asset::new(json!(nodes));
    asset.json["scenes"][0]["nodes"] = json!([0]);
    asset.square(json!({}));
    assert_eq!(place(&asset.read().desc.shapes[0]).translation.z, (LENGTH - 1) as f64);
}

#[test]
fn transforms_are_finite() {
    let mut asset = Asset::new(json!([{ "children": [1], "scale": [3e38, 1, 1] }]));
    let last = 11;
    let chain =
        (1..=last).map(|i| if i < last { json!({ "children": [i + 1], "scale": [3e38, 1, 1] }) } else { json!({}) });
    asset.json["nodes"].as_array_mut().unwrap().extend(chain);
    assert!(message(&asset).contains("the transform is not finite"));
    asset.json["nodes"] = json!([{ "rotation": [0, 0, 0, 0] }]);
    assert!(message(&asset).contains("nodes[0].rotation: is not a rotation"));
    asset.json["nodes"] = json!([{ "matrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }]);
    assert!(message(&asset).contains("nodes[0].matrix: the last row must be 0 0 0 1"));
}

#[test]
fn what_the_file_needs_must_be_known() {
    let mut asset = Asset::new(json!([{}]));
    asset.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    let imported = asset.read();
    assert!(imported.report.entries.iter().any(|e| e.element.contains("draco") && e.outcome == Outcome::Ignored));
    asset.json["extensionsRequired"] = json!(["KHR_materials_ior", "KHR_draco_mesh_compression", "KHR_texture_basisu"]);
    assert!(message(&asset).contains(
        "extensionsRequired: the file cannot be read without KHR_draco_mesh_compression, KHR_texture_basisu, which is \
         not supported"
    ));
    asset.json["extensionsRequired"] = json!(["KHR_materials_ior", "KHR_mesh_quantization"]);
    asset.read();
    asset.json["asset"]["version"] = json!("1.0");
    assert!(message(&asset).contains("the file is glTF 1.0; 2.0 is read"));
}

#[test]
fn faults_of_the_text_have_line_and_column() {
    for (text, line, column) in [
        ("{\n  \"asset\": { \"version\": 2 }\n}", 2, 25),
        ("{ \"asset\": { \"version\": \"2.0\" },\n\"nodes\": [{ \"mesh\": -1 }] }", 2, 22),
        ("{ \"asset\": { \"version\": \"2.0\" }", 1, 31),
        ("", 1, 1),
        ("not a scene", 1, 2),
    ] {
        match read_bytes("a.gltf", text.as_bytes(), 0.0).unwrap_err() {
            Error::Parse { line: l, column: c, .. } => assert_eq!((l, c), (line, column), "{text}"),
            other => panic!("{other}"),
        }
    }
    let deep = format!("{{ \"asset\": {{ \"version\": \"2.0\", \"extras\": {} }} }}", "[".repeat(100_000));
    assert!(matches!(read_bytes("a.gltf", deep.as_bytes(), 0.0), Err(Error::Parse { .. })));
}

/// A GLB file of these chunks.
fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, bytes) in chunks {
        body.extend((bytes.len() as u32).to_le_bytes());
        body.extend(*kind);
        body.extend(*bytes);
    }
    let mut file = b"glTF".to_vec();
    file.extend(2u32.to_le_bytes());
    file.extend((12 + body.len() as u32).to_le_bytes());
    file.extend(body);
    file
}

#[test]
fn binary_files_have_chunks() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    asset.square(json!({}));
    let mut json = asset.json.clone();
    json["buffers"] = json!([{ "byteLength": asset.bytes.len() }]);
    let json = json.to_string();
    let whole = glb(&[(b"JSON", json.as_bytes()), (b"BIN\0", &asset.bytes), (b"more", b"1234")]);
    assert_eq!(mesh(&read_bytes("a.glb", &whole, 0.0).unwrap(), 0).triangles.len(), 2);

    let fault = |bytes: &[u8]| read_bytes("a.glb", bytes, 0.0).unwrap_err().to_string();
    assert!(fault(&glb(&[(b"JSON", json.as_bytes())])).contains("buffers[0] has no data"));
    assert!(fault(&glb(&[(b"JSON", json.as_bytes()), (b"BIN\0", &asset.bytes[8..])])).contains("but `byteLength` is"));
    assert!(fault(&glb(&[(b"BIN\0", &asset.bytes)])).contains("the first chunk is not the JSON"));
    assert!(fault(&glb(&[])).contains("no JSON chunk"));
    for length in 4..whole.len() {
        assert!(read_bytes("a.glb", &whole[..length], 0.0).is_err(), "{length} bytes");
    }
    let mut claims = whole.clone();
    claims[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(fault(&claims).contains("the chunk at byte 12 reaches beyond the end of the file"));
    claims[8..12].copy_from_slice(&7u32.to_le_bytes());
    assert!(fault(&claims).contains("no JSON chunk"));
}

#[test]
fn buffers_must_be_there() {
    let mut asset = Asset::new(json!([{ "mesh": 0 }]));
    asset.square(json!({}));
    let mut json: Value = serde_json::from_str(&asset.text()).unwrap();
    json["buffers"][0]["uri"] = json!("gone%20away.bin");
    match read_bytes("a.gltf", json.to_string().as_bytes(), 0.0).unwrap_err() {
        Error::Missing { file, message } => {
            assert!(file.ends_with("gone away.bin") && message.contains("buffers[0]"), "{message}");
        }
        other => panic!("{other}"),
    }
    json["buffers"][0]["uri"] = json!("/dev/zero");
    assert!(matches!(read_bytes("a.gltf", json.to_string().as_bytes(), 0.0), Err(Error::Missing { .. })));
    json["buffers"][0]["uri"] = json!("https://example.org/a.bin");
    assert!(matches!(read_bytes("a.gltf", json.to_string().as_bytes(), 0.0), Err(Error::Scene { .. })));
}

/// Whatever is put in place of a value, there is a scene or an error.
#[test]
fn any_value_may_be_anything() {
    let mut asset = Asset::new(json!([{ "mesh": 0, "skin": 0, "camera": 0 }, { "translation": [1, 2, 3] }]));
    asset.square(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }, "normalTexture": { "index": 0 },
        "alphaMode": "MASK",
        "emissiveFactor": [1, 1, 1],
        "extensions": {
            "KHR_materials_clearcoat": { "clearcoatFactor": 0.5, "clearcoatTexture": { "index": 0 } },
            "KHR_materials_volume": {
                "thicknessFactor": 1, "attenuationDistance": 1, "attenuationColor": [0.5, 0.5, 0.5]
            },
            "KHR_materials_transmission": { "transmissionFactor": 1 }
        }
    }));
    let joints = asset.view(&[0; 16]);
    let joints = asset.accessor(json!({ "bufferView": joints, "componentType": 5121, "count": 4, "type": "VEC4" }));
    let weights = asset.floats(&[[1.0, 0.0, 0.0, 0.0]; 4]);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
    let steps = asset.floats(&[[0.0, 0.0, 1.0]; 4]);
    asset.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": steps }]);
    asset.json["meshes"][0]["weights"] = json!([0.5]);
    let times = asset.floats(&[[0.0f32], [1.0]]);
    let values = asset.floats(&[[0.0f32, 0.0, 0.0], [1.0, 1.0, 1.0]]);
    asset.json["animations"] = json!([{
        "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
        "samplers": [{ "input": times, "output": values }]
    }]);
    asset.json["skins"] = json!([{ "joints": [1] }]);
    asset.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.5 } }]);
    asset.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    asset.json["samplers"] = json!([{ "wrapS": 10497 }]);
    asset.json["images"] = json!([{ "uri": png(1, 1, &[[1, 2, 3, 4]]) }]);
    asset.read();

    let whole = asset.json.clone();
    let mut paths = Vec::new();
    collect(&whole, &mut String::new(), &mut paths);
    assert!(paths.len() > 150, "{}", paths.len());
    let odd = [
        json!(0),
        json!(1),
        json!(-1),
        json!(4_294_967_295u64),
        json!(1e30),
        json!("x"),
        json!([]),
        json!({}),
        Value::Null,
    ];
    for path in paths {
        for value in &odd {
            asset.json = whole.clone();
            *asset.json.pointer_mut(&path).unwrap() = value.clone();
            // Not of the kinds that the helper itself needs.
            if asset.json.is_object() {
                let _ = asset.read_at(0.5);
            }
        }
    }
}

/// Pointers to all values within a value.
fn collect(value: &Value, path: &mut String, out: &mut Vec<String>) {
    let mut visit = |key: &str, value: &Value| {
        let length = path.len();
        path.push('/');
        path.push_str(key);
        out.push(path.clone());
        collect(value, path, out);
        path.truncate(length);
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| visit(key, value)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| visit(&i.to_string(), value)),
        _ => {}
    }
}
