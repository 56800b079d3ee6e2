//! PLY files, ASCII and binary: element `vertex` with x y z, optionally nx ny nz, u v (or s t) and red green blue (or r g b), and element `face`
//! with a list of vertex indices. Polygons become fans. Colours are linear as floats and sRGB as whole numbers, of which the largest is 1.
//! Faces may have colours too, and both other [attributes](super::ply_attributes).

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::foreign::linear;
use super::ply_attributes::{self, Column};
use super::{AssetError, MeshData};
use crate::attribute::{AttributeValues, VERTEX_COLOR};

/// Reads a PLY file with all of its attributes. One with no faces, such as a cloud of points, is a mesh without triangles.
///
/// # Errors
/// If the file is missing, malformed, ends early, or has no element `vertex`, or faces without a list `vertex_indices`.
pub fn read_ply(path: &Path) -> Result<MeshData, AssetError> {
    read_ply_attributes(path, None)
}

/// As [`read_ply`], with the attributes of these names only, where they are given.
///
/// # Errors
/// As of [`read_ply`].
pub fn read_ply_attributes(path: &Path, wanted: Option<&BTreeSet<String>>) -> Result<MeshData, AssetError> {
    let file = crate::file::open(path).map_err(|e| AssetError::missing(path, &e))?;
    parse_with(BufReader::with_capacity(1 << 20, file), wanted)
}

/// Names of the list of a face's vertices.
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Elements that are read at a time: as the parser has them, they take several times the memory that they end in.
const AT_ONCE: usize = 1 << 14;

#[cfg(test)]
fn parse_ply(source: impl BufRead) -> Result<MeshData, AssetError> {
    parse_with(source, None)
}

/// The colours of faces.
const FACE_COLOR: &str = "face_color";

fn parse_with(source: impl BufRead, wanted: Option<&BTreeSet<String>>) -> Result<MeshData, AssetError> {
    let mut reader = Reader::new(crate::file::skip_mark(source).map_err(|e| malformed("", &e))?);
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(|e| malformed("", &e))?;
    let mut mesh = MeshData::default();
    // Those of types that `f32` does not hold.
    let mut wide: Vec<[f64; 3]> = Vec::new();
    for (name, element) in &header.elements {
        if element.properties.is_empty() && header.encoding != Encoding::Ascii {
            // Such rows take no bytes, however many the header claims.
            continue;
        }
        match name.as_str() {
            "vertex" => {
                if let Some(axis) = ["x", "y", "z"].iter().find(|axis| !element.properties.contains_key(**axis)) {
                    return Err(AssetError::Malformed(format!("the vertices have no property {axis}")));
                }
                let is_wide = is_wide(element);
                let (marked, mut columns) = columns(element, "vertex_", wanted);
                let mut colors = colors(element, VERTEX_COLOR, wanted);
                read_elements(&mut reader, &marked, &header, |_, vertices: Vec<Vertex>| {
                    if is_wide {
                        wide.extend(vertices.iter().map(|v| v.position));
                    }
                    take_vertices(&mut mesh, &vertices, element);
                    colors.iter_mut().for_each(|colors| colors.extend(vertices.iter().map(|v| v.color)));
                    if !columns.is_empty() {
                        vertices.iter().for_each(|vertex| ply_attributes::push(&mut columns, &vertex.numbers, 1));
                    }
                })?;
                add(&mut mesh, VERTEX_COLOR, colors, columns);
            }
            "face" => {
                let mut negative = None;
                let (marked, mut columns) = columns(element, "face_", wanted);
                let mut colors = colors(element, FACE_COLOR, wanted);
                read_elements(&mut reader, &marked, &header, |first, faces: Vec<Face>| {
                    for (i, face) in faces.iter().enumerate() {
                        negative = negative.or(face.negative.map(|bad| (first + i, bad)));
                        mesh.push_polygon(&face.corners);
                        // Every triangle of a polygon has what the polygon has.
                        let triangles = face.corners.len().saturating_sub(2);
                        colors.iter_mut().for_each(|colors| colors.extend(std::iter::repeat_n(face.color, triangles)));
                        ply_attributes::push(&mut columns, &face.numbers, triangles);
                    }
                })?;
                add(&mut mesh, FACE_COLOR, colors, columns);
                if let Some((face, bad)) = negative {
                    return Err(AssetError::Malformed(format!("face {face} refers to vertex {bad}")));
                }
            }
            _ => read_elements(&mut reader, element, &header, |_, _: Vec<DefaultElement>| ())?,
        }
    }
    if !wide.is_empty() {
        (mesh.positions, mesh.origin) = MeshData::rounded(&wide);
    }
    if !header.elements.contains_key("vertex") {
        return Err(AssetError::Malformed("the file has no vertices".into()));
    }
    let faces = header.elements.get("face").filter(|faces| faces.count > 0);
    if faces.is_some_and(|faces| !INDICES.iter().any(|name| faces.properties.contains_key(*name))) {
        return Err(AssetError::Malformed("the faces have no list `vertex_indices`".into()));
    }
    Ok(mesh)
}

/// The parser's messages run over several lines: what, the text in question, and the same again in other words.
fn malformed(place: &str, error: &dyn std::fmt::Display) -> AssetError {
    let text = error.to_string();
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.chars().all(|c| c == '\'')).take(2).collect();
    AssetError::Malformed(format!("not a valid PLY file: {place}{}", lines.join(" ")))
}

/// Reads all elements of a kind; `take` gets them some at a time, with the number of those before.
fn read_elements<E: PropertyAccess>(
    reader: &mut Reader<impl BufRead>,
    element: &ElementDef,
    header: &Header,
    mut take: impl FnMut(usize, Vec<E>),
) -> Result<(), AssetError> {
    let parser = Parser::<E>::new();
    let mut some = element.clone();
    let mut first = 0;
    while first < element.count {
        some.count = AT_ONCE.min(element.count - first);
        let elements = parser.read_payload_for_element(reader, &some, header).map_err(|e| {
            let place = if first > 0 { format!("after {first} of {} elements: ", element.count) } else { String::new() };
            malformed(&place, &e)
        })?;
        take(first, elements);
        first += some.count;
    }
    Ok(())
}

/// Whether coordinates of vertices are doubles or large whole numbers.
fn is_wide(element: &ElementDef) -> bool {
    let wide = [ScalarType::Double, ScalarType::Int, ScalarType::UInt];
    let of_axis = |axis: &str| element.properties.get(axis).map(|property| &property.data_type);
    ["x", "y", "z"].iter().any(|axis| matches!(of_axis(axis), Some(PropertyType::Scalar(kind)) if wide.contains(kind)))
}

fn take_vertices(mesh: &mut MeshData, vertices: &[Vertex], element: &ElementDef) {
    let has = |names: &[&str]| names.iter().all(|name| element.properties.contains_key(*name));
    mesh.positions.extend(vertices.iter().map(|v| v.position.map(|x| x as f32)));
    if has(&["nx", "ny", "nz"]) {
        mesh.normals.get_or_insert_default().extend(vertices.iter().map(|v| v.normal));
    }
    if has(&["u", "v"]) || has(&["s", "t"]) || has(&["texture_u", "texture_v"]) {
        mesh.uvs.get_or_insert_default().extend(vertices.iter().map(|v| v.uv));
    }
}

/// The attributes of an element, and the element with their properties marked.
fn columns(element: &ElementDef, prefix: &str, wanted: Option<&BTreeSet<String>>) -> (ElementDef, Vec<(Column, AttributeValues)>) {
    let columns = ply_attributes::columns(element, prefix, wanted);
    (ply_attributes::marked(element, &columns), columns.into_iter().map(|column| (column.clone(), column.values())).collect())
}

/// A list for the colours of an element, if it has any and they are wanted.
fn colors(element: &ElementDef, name: &str, wanted: Option<&BTreeSet<String>>) -> Option<Vec<[f32; 3]>> {
    let has = |names: [&str; 3]| names.iter().all(|name| element.properties.contains_key(*name));
    let is_wanted = wanted.is_none_or(|wanted| wanted.contains(name));
    (is_wanted && (has(["red", "green", "blue"]) || has(["r", "g", "b"]))).then(Vec::new)
}

/// Adds attributes to a mesh. Colours come before others of their name.
fn add(mesh: &mut MeshData, name: &str, colors: Option<Vec<[f32; 3]>>, columns: Vec<(Column, AttributeValues)>) {
    mesh.attributes.extend(columns.into_iter().map(|(column, values)| (column.name, values)));
    mesh.attributes.extend(colors.map(|colors| (name.to_owned(), AttributeValues::Colors(colors))));
}

/// The channel of a colour that a property is, and its linear value.
fn channel(name: &str, property: &Property) -> Option<(usize, f32)> {
    let channel = match name {
        "red" | "r" => 0,
        "green" | "g" => 1,
        "blue" | "b" => 2,
        _ => return None,
    };
    let value = number(property)? as f32;
    Some((channel, largest(property).map_or(value, |largest| linear(value / largest))))
}

#[derive(Default)]
struct Vertex {
    position: [f64; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    color: [f32; 3],
    /// Of attributes, in the order of the file.
    numbers: Vec<f32>,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(exact) = number(&property) else {
            return PropertyAccessResult::Ignored;
        };
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
            self.position[axis] = exact;
            return PropertyAccessResult::Set;
        }
        if ply_attributes::is_marked(name) {
            self.numbers.push(exact as f32);
            return PropertyAccessResult::Set;
        }
        if let Some((channel, value)) = channel(name, &property) {
            self.color[channel] = value;
            return PropertyAccessResult::Set;
        }
        let place = match name {
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "u" | "s" | "texture_u" => &mut self.uv[0],
            "v" | "t" | "texture_v" => &mut self.uv[1],
            _ => return PropertyAccessResult::Ignored,
        };
        *place = exact as f32;
        PropertyAccessResult::Set
    }
}

/// A single number of any type.
fn number(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(x) => f64::from(x),
        Property::UChar(x) => f64::from(x),
        Property::Short(x) => f64::from(x),
        Property::UShort(x) => f64::from(x),
        Property::Int(x) => f64::from(x),
        Property::UInt(x) => f64::from(x),
        Property::Float(x) => f64::from(x),
        Property::Double(x) => x,
        _ => return None,
    })
}

/// The largest value of a type of whole numbers.
fn largest(property: &Property) -> Option<f32> {
    Some(match property {
        Property::Char(_) => f32::from(i8::MAX),
        Property::UChar(_) => f32::from(u8::MAX),
        Property::Short(_) => f32::from(i16::MAX),
        Property::UShort(_) => f32::from(u16::MAX),
        Property::Int(_) => i32::MAX as f32,
        Property::UInt(_) => u32::MAX as f32,
        _ => return None,
    })
}

#[derive(Default)]
struct Face {
    corners: Vec<u32>,
    negative: Option<i64>,
    color: [f32; 3],
    /// Of attributes, in the order of the file.
    numbers: Vec<f32>,
}

impl Face {
    fn take(&mut self, index: impl Into<i64>) {
        let index = index.into();
        match u32::try_from(index) {
            Ok(index) => self.corners.push(index),
            Err(_) => self.negative = Some(index),
        }
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !INDICES.contains(&name) {
            if ply_attributes::is_marked(name) {
                self.numbers.extend(number(&property).map(|value| value as f32));
            } else if let Some((channel, value)) = channel(name, &property) {
                self.color[channel] = value;
            } else {
                return PropertyAccessResult::Ignored;
            }
            return PropertyAccessResult::Set;
        }
        match property {
            Property::ListInt(list) => list.into_iter().for_each(|i| self.take(i)),
            Property::ListUInt(list) => list.into_iter().for_each(|i| self.take(i)),
            Property::ListShort(list) => list.into_iter().for_each(|i| self.take(i)),
            Property::ListUShort(list) => list.into_iter().for_each(|i| self.take(i)),
            Property::ListChar(list) => list.into_iter().for_each(|i| self.take(i)),
            Property::ListUChar(list) => list.into_iter().for_each(|i| self.take(i)),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n\
                          element face 1\nproperty list uchar int vertex_indices\nend_header\n";

    fn expected() -> MeshData {
        MeshData {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
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
        let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float temp_0\nproperty float x\nproperty float y\nproperty float z\n\
                    property double d_x\nproperty uchar d_y\nproperty float d_z\nelement face 2\nproperty float q_0\n\
                    property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
                    0.5 0 0 0 0.25 7 1\n1.5 1 0 0 1 8 2\n2.5 1 1 0 2 9 3\n-1 0 1 0 3 10 4\n9 4 0 1 2 3 255 0 0\n8 3 0 1 2 0 255 0\n";
        let mesh = parse_ply(text.as_bytes()).unwrap();
        let expected = [
            ("face_color", AttributeValues::Colors(vec![[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
            ("face_q", AttributeValues::Numbers(vec![9.0, 9.0, 8.0])),
            ("vertex_d", AttributeValues::Colors(vec![[0.25, 7.0, 1.0], [1.0, 8.0, 2.0], [2.0, 9.0, 3.0], [3.0, 10.0, 4.0]])),
            ("vertex_temp", AttributeValues::Numbers(vec![0.5, 1.5, 2.5, -1.0])),
        ];
        assert_eq!(mesh.attributes, expected.clone().map(|(name, values)| (name.to_owned(), values)).into());
        let wanted = BTreeSet::from(["face_q".to_owned(), "vertex_other".to_owned()]);
        let some = parse_with(text.as_bytes(), Some(&wanted)).unwrap();
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
        let far =
            ascii().replace("property float x", "property double x").replace("\n1 0 0 1 0\n1 1", "\n8388608.25 0 0 1 0\n8388608.25 1");
        let far = far.replace("\n0 0 0 0 0\n", "\n8388607.5 0 0 0 0\n").replace("\n0 1 0 0 1\n", "\n8388607.5 1 0 0 1\n");
        let mesh = parse_ply(far.as_bytes()).unwrap();
        assert_eq!(mesh.position(mesh.positions[1]).x - mesh.position(mesh.positions[0]).x, 0.75);
        assert_eq!(mesh.bounds().max.to_array(), [8_388_608.25, 1.0, 0.0]);
    }

    #[test]
    fn files_without_faces_are_meshes_without_triangles() {
        let text = ascii();
        let cloud = |text: &str| (parse_ply(text.as_bytes()).unwrap().positions.len(), parse_ply(text.as_bytes()).unwrap().triangles.len());
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
        assert_eq!((mesh.positions.len(), mesh.triangles.len(), mesh.uvs.map(|uvs| uvs.len())), (count, count, Some(count)));
        for i in [0, AT_ONCE - 1, AT_ONCE, count - 1] {
            assert_eq!((mesh.positions[i], mesh.triangles[i]), ([i as f32, 0.0, (i % 7) as f32], [0, i as u32, i as u32 / 2]));
        }
        let late = AT_ONCE + 2;
        let error = |text: &str| parse_ply(text.as_bytes()).unwrap_err().to_string();
        assert!(
            error(&text.replace(&format!("3 0 {late} "), &format!("3 -1 {late} "))).contains(&format!("face {late} refers to vertex -1"))
        );
        assert!(error(&text[..text.len() - 20]).contains(&format!("after {} of {count} elements", 2 * AT_ONCE)));
        assert!(error(&text.replace(&format!("\n{late} 0 "), &format!("\n{late} x "))).contains(&format!("Line {}", 12 + late)));
    }

    #[test]
    fn faults_of_text_files_have_a_line() {
        let error = parse_ply(ascii().replacen("1 1 0 1 1", "1 x 0 1 1", 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains("Line 14"), "{error}");
    }

    #[test]
    fn normals_other_types_and_other_elements_are_read() {
        let text = "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement camera 1\r\nproperty list uchar float view\r\nelement face 1\r\n\
                    property list uint8 uint16 vertex_index\r\nproperty uchar red\r\nelement vertex 3\r\nproperty double x\r\nproperty short y\r\n\
                    property float z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\nproperty uchar red\r\nend_header\r\n\
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
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{properties}\
                 element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 {color}\n1 0 0 {color}\n0 1 0 {color}\n3 0 1 2\n"
            );
            parse_ply(text.as_bytes()).unwrap().colors().map(<[_]>::to_vec)
        };
        assert_eq!(colors("float", ["red", "green", "blue"], "0.25 2 -1"), Some(vec![[0.25, 2.0, -1.0]; 3]));
        assert_eq!(colors("double", ["r", "g", "b"], "0.25 0.5 1"), Some(vec![[0.25, 0.5, 1.0]; 3]));
        assert_eq!(colors("uchar", ["b", "g", "r"], "255 51 0"), Some(vec![[0.0, linear(0.2), 1.0]; 3]));
        assert_eq!(colors("ushort", ["red", "green", "blue"], "0 13107 65535"), Some(vec![[0.0, linear(0.2), 1.0]; 3]));
        assert_eq!(colors("uchar", ["red", "green", "alpha"], "255 51 0"), None);
    }
}
