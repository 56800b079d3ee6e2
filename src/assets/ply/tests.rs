use super::*;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float s\n\
                      property float t\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";

fn expected() -> MeshData {
    MeshData {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        faces: vec![4],
        uvs: Some(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        ..MeshData::default()
    }
}

fn ascii() -> String {
    format!("ply\nformat ascii 1.0\n{HEADER}0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n")
}

fn binary(order: &str, float: fn(f32) -> [u8; 4], int: fn(i32) -> [u8; 4]) -> Vec<u8> {
    let mut out = format!("ply\nformat {order} 1.0\n{HEADER}").into_bytes();
    let mesh = expected();
    for (p, uv) in mesh.positions.iter().zip(mesh.uvs.unwrap()) {
        p.iter().chain(&uv).for_each(|&x| out.extend(float(x)));
    }
    out.push(4);
    (0..4).for_each(|i| out.extend(int(i)));
    out
}

#[test]
fn all_encodings_give_the_same_mesh() {
    assert_eq!(parse_ply(ascii().as_bytes()).unwrap(), expected());
    let little = binary("binary_little_endian", f32::to_le_bytes, i32::to_le_bytes);
    assert_eq!(parse_ply(little.as_slice()).unwrap(), expected());
    let big = binary("binary_big_endian", f32::to_be_bytes, i32::to_be_bytes);
    assert_eq!(parse_ply(big.as_slice()).unwrap(), expected());
}

#[test]
fn vertices_and_faces_have_attributes() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float temp_0\nproperty float x\nproperty float y\n\
                property float z\n\
                property double d_x\nproperty uchar d_y\nproperty float d_z\nelement face 2\nproperty float q_0\n\
                property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
                end_header\n\
                0.5 0 0 0 0.25 7 1\n1.5 1 0 0 1 8 2\n2.5 1 1 0 2 9 3\n-1 0 1 0 3 10 4\n9 4 0 1 2 3 255 0 0\n\
                8 3 0 1 2 0 255 0\n";
    let mesh = parse_ply(text.as_bytes()).unwrap();
    let expected = [
        ("face_color", AttributeValues::Colors(vec![[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
        ("face_q", AttributeValues::Numbers(vec![9.0, 9.0, 8.0])),
        (
            "vertex_d",
            AttributeValues::Colors(vec![[0.25, 7.0, 1.0], [1.0, 8.0, 2.0], [2.0, 9.0, 3.0], [3.0, 10.0, 4.0]]),
        ),
        ("vertex_temp", AttributeValues::Numbers(vec![0.5, 1.5, 2.5, -1.0])),
    ];
    assert_eq!(mesh.attributes, expected.clone().map(|(name, values)| (name.to_owned(), values)).into());
    let requested = BTreeSet::from(["face_q".to_owned(), "vertex_other".to_owned()]);
    let some = parse_with(text.as_bytes(), Some(&requested)).unwrap();
    assert_eq!(some.attributes, [expected[1].clone()].map(|(name, values)| (name.to_owned(), values)).into());
    assert_eq!((some.positions, some.triangles), (mesh.positions, mesh.triangles));
}

#[test]
fn truncated_files_are_errors() {
    let whole = binary("binary_little_endian", f32::to_le_bytes, i32::to_le_bytes);
    for length in [0, 3, 40, whole.len() - 60, whole.len() - 1] {
        assert!(parse_ply(&whole[..length]).is_err(), "{length} bytes");
    }
    let text = ascii();
    assert!(parse_ply(&text.as_bytes()[..text.len() - 12]).is_err());
    for (from, to) in [
        ("0 1 2 3", "0 1 2 -3"),
        ("vertex_indices", "others"),
        ("float z", "float w"),
        ("ply", "pyl"),
        ("ascii", "utf8"),
        ("1 1 0 1 1", "1 x 0 1 1"),
        ("vertex 4", "vertex 400000000000"),
        ("vertex 4", "vertex -4"),
    ] {
        let error = parse_ply(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn elements_without_properties_take_no_time() {
    let whole = binary("binary_little_endian", f32::to_le_bytes, i32::to_le_bytes);
    let text = "element junk 1000000000000000000\nelement vertex";
    let at = whole.windows(14).position(|window| window == b"element vertex").unwrap();
    let file = [&whole[..at], text.as_bytes(), &whole[at + 14..]].concat();
    assert_eq!(parse_ply(file.as_slice()).unwrap(), expected());
    assert!(parse_ply(ascii().replace("element vertex", text).as_bytes()).is_err());
}

#[test]
fn doubles_far_from_the_origin_keep_their_digits() {
    let far = ascii()
        .replace("property float x", "property double x")
        .replace("\n1 0 0 1 0\n1 1", "\n8388608.25 0 0 1 0\n8388608.25 1");
    let far = far.replace("\n0 0 0 0 0\n", "\n8388607.5 0 0 0 0\n").replace("\n0 1 0 0 1\n", "\n8388607.5 1 0 0 1\n");
    let mesh = parse_ply(far.as_bytes()).unwrap();
    assert_eq!(mesh.position(mesh.positions[1]).x - mesh.position(mesh.positions[0]).x, 0.75);
    assert_eq!(mesh.bounds().max.to_array(), [8_388_608.25, 1.0, 0.0]);
}

#[test]
fn files_without_faces_are_meshes_without_triangles() {
    let text = ascii();
    let cloud = |text: &str| {
        (parse_ply(text.as_bytes()).unwrap().positions.len(), parse_ply(text.as_bytes()).unwrap().triangles.len())
    };
    assert_eq!(cloud(&text.replace("4 0 1 2 3", "2 0 1")), (4, 0));
    assert_eq!(cloud(&text.replace("face 1", "face 0").replace("4 0 1 2 3\n", "")), (4, 0));
    let list = "element face 1\nproperty list uchar int vertex_indices\n";
    assert_eq!(cloud(&text.replace(list, "").replace("4 0 1 2 3\n", "")), (4, 0));
}

#[test]
fn long_files_are_read_piece_by_piece() {
    let count = 2 * AT_ONCE + 5;
    let header = HEADER.replace("vertex 4", &format!("vertex {count}")).replace("face 1", &format!("face {count}"));
    let vertices: String = (0..count).map(|i| format!("{i} 0 {} 0 1\n", i % 7)).collect();
    let faces: String = (0..count).map(|i| format!("3 0 {i} {}\n", i / 2)).collect();
    let text = format!("ply\nformat ascii 1.0\n{header}{vertices}{faces}");
    let mesh = parse_ply(text.as_bytes()).unwrap();
    assert_eq!(
        (mesh.positions.len(), mesh.triangles.len(), mesh.uvs.map(|uvs| uvs.len())),
        (count, count, Some(count))
    );
    for i in [0, AT_ONCE - 1, AT_ONCE, count - 1] {
        assert_eq!(
            (mesh.positions[i], mesh.triangles[i]),
            ([i as f32, 0.0, (i % 7) as f32], [0, i as u32, i as u32 / 2])
        );
    }
    let late = AT_ONCE + 2;
    let error = |text: &str| parse_ply(text.as_bytes()).unwrap_err().to_string();
    assert!(
        error(&text.replace(&format!("3 0 {late} "), &format!("3 -1 {late} ")))
            .contains(&format!("face {late} refers to vertex -1"))
    );
    assert!(error(&text[..text.len() - 20]).contains(&format!("after {} of {count} elements", 2 * AT_ONCE)));
    assert!(
        error(&text.replace(&format!("\n{late} 0 "), &format!("\n{late} x "))).contains(&format!("Line {}", 12 + late))
    );
}

#[test]
fn faults_of_text_files_have_a_line() {
    let error = parse_ply(ascii().replacen("1 1 0 1 1", "1 x 0 1 1", 1).as_bytes()).unwrap_err().to_string();
    assert!(error.contains("Line 14"), "{error}");
}

#[test]
fn normals_other_types_and_other_elements_are_read() {
    let text = "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement camera 1\r\n\
                property list uchar float view\r\nelement face 1\r\n\
                property list uint8 uint16 vertex_index\r\nproperty uchar red\r\nelement vertex 3\r\n\
                property double x\r\nproperty short y\r\n\
                property float z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n\
                property uchar red\r\nend_header\r\n\
                2 0.5 0.5\r\n3 2 1 0 255\r\n0 0 0 0 0 1 9\r\n1.5 0 0 0 0 1 9\r\n0 -2 0 0 0 1 9\r\n";
    for text in [text.to_owned(), text.replace("\r\n", "\n")] {
        let mesh = parse_ply(text.as_bytes()).unwrap();
        assert_eq!(mesh.positions, [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, -2.0, 0.0]]);
        assert_eq!(mesh.triangles, [[2, 1, 0]]);
        assert_eq!(mesh.normals, Some(vec![[0.0, 0.0, 1.0]; 3]));
        assert_eq!((&mesh.uvs, mesh.colors()), (&None, None));
    }
}

#[test]
fn colours_are_linear_as_floats_and_encoded_as_whole_numbers() {
    let colors = |kind: &str, names: [&str; 3], color: &str| {
        let properties: String = names.map(|name| format!("property {kind} {name}\n")).concat();
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             {properties}element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 {color}\n\
             1 0 0 {color}\n0 1 0 {color}\n3 0 1 2\n"
        );
        parse_ply(text.as_bytes()).unwrap().colors().map(<[_]>::to_vec)
    };
    assert_eq!(colors("float", ["red", "green", "blue"], "0.25 2 -1"), Some(vec![[0.25, 2.0, -1.0]; 3]));
    assert_eq!(colors("double", ["r", "g", "b"], "0.25 0.5 1"), Some(vec![[0.25, 0.5, 1.0]; 3]));
    assert_eq!(colors("uchar", ["b", "g", "r"], "255 51 0"), Some(vec![[0.0, linear_from_srgb(0.2), 1.0]; 3]));
    assert_eq!(
        colors("ushort", ["red", "green", "blue"], "0 13107 65535"),
        Some(vec![[0.0, linear_from_srgb(0.2), 1.0]; 3])
    );
    assert_eq!(colors("uchar", ["red", "green", "alpha"], "255 51 0"), None);
}
