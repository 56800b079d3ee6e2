//! Whole files, made here.

mod broken;
mod materials;
mod motion;
mod places;
mod surfaces;

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::assets::MeshData;
use crate::desc::{InstanceDesc, MaterialDesc, PrincipledDesc, ShapeDesc, TransformDesc, TransformStepDesc};
use crate::error::Result;
use crate::import::{ImportOptions, Imported, Outcome, read_scene};
use crate::math::{DAffine3, DMat3, DVec3};

/// A file in the making, with one buffer.
struct Asset {
    json: Value,
    bytes: Vec<u8>,
}

impl Asset {
    /// A file without anything but these nodes, all of which are roots of its scene.
    fn new(nodes: Value) -> Self {
        let roots: Vec<usize> = (0..nodes.as_array().unwrap().len()).collect();
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": roots }], "nodes": nodes,
            "accessors": [], "bufferViews": [], "materials": []
        });
        Self { json, bytes: Vec::new() }
    }

    /// Adds a view of these bytes; the result is its index.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend(bytes);
        views.len() - 1
    }

    /// Adds an accessor; the result is its index.
    fn accessor(&mut self, accessor: Value) -> usize {
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        accessors.len() - 1
    }

    /// Adds elements of floats.
    fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = elements.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.accessor(json!({ "bufferView": view, "componentType": 5126, "count": elements.len(), "type": kind }))
    }

    /// Adds indices.
    fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.accessor(json!({ "bufferView": view, "componentType": 5123, "count": indices.len(), "type": "SCALAR" }))
    }

    /// Adds a mesh of one primitive; the result is its index.
    fn mesh(&mut self, primitive: Value) -> usize {
        if self.json["meshes"].is_null() {
            self.json["meshes"] = json!([]);
        }
        let meshes = self.json["meshes"].as_array_mut().unwrap();
        meshes.push(json!({ "primitives": [primitive] }));
        meshes.len() - 1
    }

    /// Adds the square from (0, 0, 0) to (1, 1, 0), whose image stands upright, with this material. `TEXCOORD_1` shows
    /// the upper left sixteenth of it.
    fn square(&mut self, material: Value) -> usize {
        let positions = self.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        let uvs = self.floats(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        let corner = self.floats(&[[0.0, 0.25], [0.25, 0.25], [0.25, 0.0], [0.0, 0.0]]);
        let indices = self.indices(&[0, 1, 2, 0, 2, 3]);
        let materials = self.json["materials"].as_array_mut().unwrap();
        materials.push(material);
        let material = materials.len() - 1;
        self.mesh(json!({
            "attributes": { "POSITION": positions, "TEXCOORD_0": uvs, "TEXCOORD_1": corner },
            "indices": indices, "material": material
        }))
    }

    /// The text of the file; its buffer is within.
    fn text(&self) -> String {
        let mut json = self.json.clone();
        let data: String = self.bytes.iter().map(|b| format!("%{b:02x}")).collect();
        json["buffers"] =
            json!([{ "byteLength": self.bytes.len(), "uri": format!("data:application/octet-stream,{data}") }]);
        let lists = ["accessors", "bufferViews", "materials", "nodes"];
        json.as_object_mut().unwrap().retain(|key, value| !(lists.contains(&key.as_str()) && *value == json!([])));
        json.to_string()
    }

    fn read(&self) -> Imported {
        self.try_read().unwrap()
    }

    fn try_read(&self) -> Result<Imported> {
        self.read_at(0.0)
    }

    fn read_at(&self, time: f64) -> Result<Imported> {
        read_bytes("scene.gltf", self.text().as_bytes(), time)
    }
}

/// Reads a file of these bytes.
fn read_bytes(name: &str, bytes: &[u8], time: f64) -> Result<Imported> {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_scene(&path, &ImportOptions { time, ..ImportOptions::default() })
}

/// The mesh of a shape of the world.
fn mesh(imported: &Imported, shape: usize) -> &MeshData {
    mesh_of(imported, &imported.desc.shapes[shape])
}

fn mesh_of<'a>(imported: &'a Imported, shape: &ShapeDesc) -> &'a MeshData {
    let ShapeDesc::Mesh(mesh) = shape else { panic!("no mesh") };
    &imported.assets.meshes[mesh.file.as_ref().unwrap()]
}

/// The affine map of a transform with one matrix.
fn map(transform: &TransformDesc) -> DAffine3 {
    let [TransformStepDesc::Matrix(m)] = transform.0.as_slice() else { panic!("not one matrix") };
    let column = |k: usize| DVec3::new(m[0][k], m[1][k], m[2][k]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}

fn place(shape: &ShapeDesc) -> DAffine3 {
    map(shape.common().transform)
}

fn place_of(instance: &InstanceDesc) -> DAffine3 {
    map(&instance.transform)
}

fn principled<'a>(imported: &'a Imported, name: &str) -> &'a PrincipledDesc {
    match &imported.desc.materials[name] {
        MaterialDesc::Principled(desc) => desc,
        other => panic!("{name} is {other:?}"),
    }
}

/// What became of a parameter.
fn outcome(imported: &Imported, parameter: &str) -> Option<Outcome> {
    imported.report.entries.iter().find(|entry| entry.parameter == parameter).map(|entry| entry.outcome)
}

/// A PNG of these pixels, as a data URI.
fn png(width: u32, height: u32, rgba: &[[u8; 4]]) -> String {
    let image = image::RgbaImage::from_raw(width, height, rgba.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let data: String = bytes.into_inner().iter().map(|b| format!("%{b:02x}")).collect();
    format!("data:image/png,{data}")
}

#[track_caller]
fn assert_close(a: DVec3, b: [f64; 3]) {
    assert!((a - DVec3::from(b)).length() < 1e-5, "{a} {b:?}");
}
