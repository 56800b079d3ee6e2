//! Scenes to files: the native format, with its meshes and images beside it.

mod files;
mod json;
mod ply;

pub use ply::write_ply;

use std::path::{Path, PathBuf};

use crate::desc::{NamedFile, SceneDesc};
use crate::error::{Error, Result};
use crate::import::Imported;
use crate::output::{FileUses, check_creatable, write_atomically};

use files::AssetCopier;

/// What is done with the files that a scene names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Originals {
    /// They are copied beside the scene.
    Copy,
    /// The scene refers to them where they are.
    Link,
}

/// Writes a scene that was read from `source` as `target`, a file of the native format. Meshes and images without
/// files, and with [`Originals::Copy`] all others, come into the folder `NAME_files` beside it. The scene itself is
/// written last, so that it never names what is not there. The result is the number of files beside the scene. Files
/// that are not there and that the world does not use keep their names, with a warning. `uses` are files of the caller,
/// which are not overwritten either.
///
/// # Errors
/// [`Error::Usage`] if a file would be overwritten that is read, before any is written, [`Error::Missing`] if a file
/// that the world uses is not there, [`Error::Output`] if one cannot be written.
pub fn write_scene(
    imported: &Imported,
    source: &Path,
    target: &Path,
    originals: Originals,
    mut uses: FileUses,
) -> Result<usize> {
    if !target.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return Err(Error::Usage(format!("{}: Steradian's scene files end with .json", target.display())));
    }
    check_creatable(target)?;
    uses.read(source, "the scene")?;
    uses.write(target, "the converted scene")?;
    imported.files.iter().try_for_each(|file| uses.read(file, "a file of the scene"))?;
    copy_all(imported, &mut AssetCopier::new(imported, source, target, originals).with_uses(uses))?;
    let mut files = AssetCopier::new(imported, source, target, originals);
    for NamedFile { path, name, is_used } in imported.desc.clone().files_mut() {
        if !is_used && !files.is_there(name) {
            tracing::warn!("{}: {path}: no file {name}; nothing uses it", source.display());
        }
    }
    let desc = copy_all(imported, &mut files)?;
    let text = json::scene_text(&desc)?;
    write_atomically(target, |out| std::io::Write::write_all(out, text.as_bytes()).map_err(|e| e.to_string()))?;
    Ok(files.count())
}

/// Copies all files of a scene; the result is the scene with their names.
fn copy_all(imported: &Imported, files: &mut AssetCopier) -> Result<SceneDesc> {
    let mut desc = imported.desc.clone();
    for NamedFile { path, name, is_used } in desc.files_mut() {
        if is_used || files.is_there(name) {
            *name = files.add(&path, name)?;
        }
    }
    Ok(desc)
}

/// The folder of a file; `.` for a bare name.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}
