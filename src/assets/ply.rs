//! PLY files, ASCII and binary: element `vertex` with x y z, optionally nx ny nz, u v (or s t) and red green blue (or r
//! g b), and element `face` with a list of vertex indices. Polygons become fans. Colours are linear as floats and sRGB
//! as whole numbers, of which the largest is 1. Faces may have colours too, and both other
//! [attributes](super::ply_attributes).

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::ply_attributes::{self, Column};
use super::{AssetError, MeshData};
use crate::attribute::{AttributeValues, VERTEX_COLOR};
use crate::color::linear_from_srgb;

/// Reads a PLY file with all of its attributes. One with no faces, such as a cloud of points, is a mesh without
/// triangles.
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
pub fn read_ply_attributes(path: &Path, requested: Option<&BTreeSet<String>>) -> Result<MeshData, AssetError> {
    let file = crate::file::open(path).map_err(|e| AssetError::missing(path, &e))?;
    parse_with(BufReader::with_capacity(1 << 20, file), requested)
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

/// Reads the vertices; the result is their positions if their type is wider than `f32`.
fn read_vertices(
    reader: &mut Reader<impl BufRead>,
    header: &Header,
    element: &ElementDef,
    requested: Option<&BTreeSet<String>>,
    mesh: &mut MeshData,
) -> Result<Vec<[f64; 3]>, AssetError> {
    let mut wide = Vec::new();
    if let Some(axis) = ["x", "y", "z"].iter().find(|axis| !element.properties.contains_key(**axis)) {
        return Err(AssetError::Malformed(format!("the vertices have no property {axis}")));
    }
    let is_wide = is_wide(element);
    let (marked, mut columns) = columns(element, "vertex_", requested);
    let mut colors = colors(element, VERTEX_COLOR, requested);
    read_elements(reader, &marked, header, |_, vertices: Vec<Vertex>| {
        if is_wide {
            wide.extend(vertices.iter().map(|v| v.position));
        }
        take_vertices(mesh, &vertices, element);
        colors.iter_mut().for_each(|colors| colors.extend(vertices.iter().map(|v| v.color)));
        if !columns.is_empty() {
            vertices.iter().for_each(|vertex| ply_attributes::push(&mut columns, &vertex.numbers, 1));
        }
    })?;
    add(mesh, VERTEX_COLOR, colors, columns);
    Ok(wide)
}

/// Reads the faces.
fn read_faces(
    reader: &mut Reader<impl BufRead>,
    header: &Header,
    element: &ElementDef,
    requested: Option<&BTreeSet<String>>,
    mesh: &mut MeshData,
) -> Result<(), AssetError> {
    let mut negative = None;
    let (marked, mut columns) = columns(element, "face_", requested);
    let mut colors = colors(element, FACE_COLOR, requested);
    read_elements(reader, &marked, header, |first, faces: Vec<Face>| {
        for (i, face) in faces.iter().enumerate() {
            negative = negative.or(face.negative.map(|bad| (first + i, bad)));
            mesh.push_polygon(&face.corners);
            // Every triangle of a polygon has what the polygon has.
            let triangles = face.corners.len().saturating_sub(2);
            colors.iter_mut().for_each(|colors| colors.extend(std::iter::repeat_n(face.color, triangles)));
            ply_attributes::push(&mut columns, &face.numbers, triangles);
        }
    })?;
    add(mesh, FACE_COLOR, colors, columns);
    if let Some((face, bad)) = negative {
        return Err(AssetError::Malformed(format!("face {face} refers to vertex {bad}")));
    }
    Ok(())
}

fn parse_with(source: impl BufRead, requested: Option<&BTreeSet<String>>) -> Result<MeshData, AssetError> {
    let mut reader = Reader::new(crate::file::skip_mark(source).map_err(|e| malformed("", &e))?);
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(|e| malformed("", &e))?;
    let mut mesh = MeshData::default();
    let mut wide: Vec<[f64; 3]> = Vec::new();
    for (name, element) in &header.elements {
        if element.properties.is_empty() && header.encoding != Encoding::Ascii {
            // Such rows take no bytes, however many the header claims.
            continue;
        }
        match name.as_str() {
            "vertex" => wide = read_vertices(&mut reader, &header, element, requested, &mut mesh)?,
            "face" => read_faces(&mut reader, &header, element, requested, &mut mesh)?,
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
    let lines: Vec<&str> =
        text.lines().map(str::trim).filter(|line| !line.chars().all(|c| c == '\'')).take(2).collect();
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
            let place =
                if first > 0 { format!("after {first} of {} elements: ", element.count) } else { String::new() };
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
fn columns(
    element: &ElementDef,
    prefix: &str,
    requested: Option<&BTreeSet<String>>,
) -> (ElementDef, Vec<(Column, AttributeValues)>) {
    let columns = ply_attributes::columns(element, prefix, requested);
    (
        ply_attributes::marked(element, &columns),
        columns.into_iter().map(|column| (column.clone(), column.values())).collect(),
    )
}

/// A list for the colours of an element, if it has any and `requested` includes them.
fn colors(element: &ElementDef, name: &str, requested: Option<&BTreeSet<String>>) -> Option<Vec<[f32; 3]>> {
    let has = |names: [&str; 3]| names.iter().all(|name| element.properties.contains_key(*name));
    let is_requested = requested.is_none_or(|requested| requested.contains(name));
    (is_requested && (has(["red", "green", "blue"]) || has(["r", "g", "b"]))).then(Vec::new)
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
    Some((channel, largest(property).map_or(value, |largest| linear_from_srgb(value / largest))))
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
mod tests;
