//! Scenes to files: our own format, with its meshes and images beside it.

mod files;
mod json;
mod ply;

pub use ply::write_ply;

use std::path::{Path, PathBuf};

use crate::desc::{LightDesc, SceneDesc, ShapeDesc, TextureDesc};
use crate::error::{Error, Result};
use crate::import::Imported;
use crate::output::{check_creatable, write_atomically};

use files::Files;

/// What is done with the files that a scene names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Originals {
    /// They are copied beside the scene.
    Copy,
    /// The scene refers to them where they are.
    Link,
}

/// Writes a scene that was read from `source` as `target`, a file of our format. Meshes and images without files, and with
/// [`Originals::Copy`] all others, come into the folder `NAME_files` beside it. The scene itself is written last, so that it never names
/// what is not there. The result is the number of files beside the scene.
///
/// # Errors
/// [`Error::Missing`] if a file that the scene names is not there, [`Error::Output`] if one cannot be written.
pub fn write_scene(imported: &Imported, source: &Path, target: &Path, originals: Originals) -> Result<usize> {
    if !target.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return Err(Error::Usage(format!("{}: scenes of ours end with .json", target.display())));
    }
    check_creatable(target)?;
    let mut desc = imported.desc.clone();
    let mut files = Files::new(imported, source, target, originals);
    for (path, file) in named_files(&mut desc) {
        *file = files.bring(&path, file)?;
    }
    let text = json::scene_text(&desc)?;
    write_atomically(target, |out| std::io::Write::write_all(out, text.as_bytes()).map_err(|e| e.to_string()))?;
    Ok(files.count())
}

/// Every name of a file in a scene, with its place.
fn named_files(desc: &mut SceneDesc) -> Vec<(String, &mut String)> {
    let mut names = Vec::new();
    let shapes = desc.shapes.iter_mut().enumerate().map(|(i, shape)| (format!("shapes[{i}]"), shape));
    let objects = desc.objects.iter_mut().flat_map(|(name, object)| {
        object.shapes.iter_mut().enumerate().map(move |(i, shape)| (format!("objects.{name}.shapes[{i}]"), shape))
    });
    for (path, shape) in shapes.chain(objects) {
        if let ShapeDesc::Mesh(mesh) = shape {
            names.extend(mesh.file.as_mut().map(|file| (format!("{path}.file"), file)));
            names.extend(mesh.deform_files.iter_mut().enumerate().map(|(i, file)| (format!("{path}.deform_files[{i}]"), file)));
        }
    }
    for (name, texture) in &mut desc.textures {
        if let TextureDesc::Image { file, .. } = texture {
            names.push((format!("textures.{name}.file"), file));
        }
    }
    for (i, light) in desc.lights.iter_mut().enumerate() {
        let file = match light {
            LightDesc::Environment(light) => light.file.as_mut(),
            LightDesc::Ies(light) => Some(&mut light.file),
            LightDesc::Point(_) | LightDesc::Spot(_) | LightDesc::Directional(_) => None,
        };
        names.extend(file.map(|file| (format!("lights[{i}].file"), file)));
    }
    names
}

/// The folder of a file; `.` for a bare name.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}
