//! Small scenes, one for each meaning that is easy to get wrong.

mod curves;
mod lights;
mod materials;
mod media;
mod sensors;
mod shapes;
mod syntax;

use crate::desc::{MaterialDesc, SceneDesc, ShapeDesc, TransformDesc, TransformStepDesc};
use crate::error::Result;
use crate::import::{ImportOptions, Imported, Outcome};

const SENSOR: &str = r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="200"/>
<integer name="height" value="100"/></film></sensor>"#;

/// Reads the text of a whole file, and other files beside it.
fn read_with(text: &str, defines: &[(&str, &str)], files: &[(&str, &[u8])]) -> Result<Imported> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let path = folder.path().join("s.xml");
    std::fs::write(&path, text).unwrap();
    let defines = defines.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    super::read(&path, &ImportOptions { defines, time: 0.0 })
}

fn try_scene(body: &str) -> Result<Imported> {
    read_with(&format!("<scene version=\"3.0.0\">{SENSOR}{body}</scene>"), &[], &[])
}

/// The scene with a camera and this.
#[track_caller]
fn scene(body: &str) -> SceneDesc {
    try_scene(body).unwrap().desc
}

/// The message of the error, from the file's name on.
#[track_caller]
fn message(body: &str) -> String {
    let message = try_scene(body).unwrap_err().to_string();
    message.split_once("s.xml").map_or(message.clone(), |(_, rest)| format!("s.xml{rest}"))
}

/// The notes of what was not mapped.
#[track_caller]
fn notes(body: &str) -> Vec<(Outcome, String, String)> {
    let report = try_scene(body).unwrap().report;
    report
        .entries
        .into_iter()
        .filter(|e| e.outcome != Outcome::Mapped)
        .map(|e| (e.outcome, e.parameter, e.note))
        .collect()
}

/// The material of a sphere with this BSDF, without its black back.
#[track_caller]
fn front(bsdf: &str) -> MaterialDesc {
    let desc = scene(&format!("<shape type=\"sphere\">{bsdf}</shape>"));
    material(&desc, 0)
}

/// The front of the material of a shape.
#[track_caller]
fn material(desc: &SceneDesc, shape: usize) -> MaterialDesc {
    let name = desc.shapes[shape].common().material.unwrap();
    match &desc.materials[name] {
        MaterialDesc::TwoSided { front, .. } => desc.materials[front].clone(),
        other => other.clone(),
    }
}

/// The matrix of a transform that is one.
#[track_caller]
fn matrix(transform: &TransformDesc) -> [[f64; 4]; 4] {
    match transform.0[..] {
        [] => [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
        [TransformStepDesc::Matrix(m)] => m,
        ref other => panic!("{other:?}"),
    }
}

#[track_caller]
fn assert_near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-5 * b.abs().max(1.0), "{a} is not {b}");
}

/// Where a transform moves a point.
fn moved(transform: &TransformDesc, p: [f64; 3]) -> [f64; 3] {
    let m = matrix(transform);
    [0, 1, 2].map(|r| m[r][0] * p[0] + m[r][1] * p[1] + m[r][2] * p[2] + m[r][3])
}

#[track_caller]
fn assert_point(a: [f64; 3], b: [f64; 3]) {
    a.into_iter().zip(b).for_each(|(a, b)| assert_near(a, b));
}

/// A shape of the world.
fn shape(desc: &SceneDesc, i: usize) -> &ShapeDesc {
    &desc.shapes[i]
}
