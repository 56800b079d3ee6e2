//! The reader as a whole.

mod curves;
mod errors;
mod materials;
mod media;
mod places;

use crate::desc::{ShapeDesc, TransformDesc, TransformStepDesc};
use crate::error::{Error, Result};
use crate::import::foreign::{ImportOptions, Imported, Outcome};
use crate::math::{DAffine3, DMat3, DVec3};

/// Reads a scene from text; other files lie beside it.
fn read_with(text: &str, files: &[(&str, &[u8])]) -> Result<Imported> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let path = folder.path().join("s.pbrt");
    std::fs::write(&path, text).unwrap();
    super::read(&path, &ImportOptions::default())
}

/// Reads a scene from text.
fn read(text: &str) -> Imported {
    read_with(text, &[]).unwrap()
}

/// Reads a world from text.
fn world(text: &str) -> Imported {
    read(&format!("WorldBegin\n{text}"))
}

/// The map of a transform of one matrix, or of none.
fn map(transform: &TransformDesc) -> DAffine3 {
    match transform.0.as_slice() {
        [] => DAffine3::IDENTITY,
        [TransformStepDesc::Matrix(m)] => {
            let column = |i: usize| DVec3::new(m[0][i], m[1][i], m[2][i]);
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
        }
        other => panic!("not one matrix: {other:?}"),
    }
}

/// The only shape of a scene.
fn shape(imported: &Imported) -> &ShapeDesc {
    let [shape] = imported.desc.shapes.as_slice() else { panic!("not one shape: {:?}", imported.desc.shapes) };
    shape
}

/// What became of a parameter.
fn outcome(imported: &Imported, element: &str, parameter: &str) -> Outcome {
    let entries = &imported.report.entries;
    let entry = entries.iter().find(|entry| entry.element.starts_with(element) && entry.parameter == parameter);
    entry.unwrap_or_else(|| panic!("no report on {parameter}: {entries:#?}")).outcome
}

/// Where a scene is wrong.
fn line_and_column(error: &Error) -> (usize, usize) {
    match error {
        Error::Parse { line, column, .. } => (*line, *column),
        other => panic!("not an error of the text: {other}"),
    }
}

fn close(a: impl IntoIterator<Item = f32>, b: impl IntoIterator<Item = f32>) -> bool {
    a.into_iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-4 * b.abs().max(1.0))
}
