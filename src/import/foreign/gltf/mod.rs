//! glTF 2.0 scenes, `.gltf` and `.glb`.
//!
//! The JSON and the indices in it are checked by the crate `gltf`; buffers, images and extensions are read here. A path
//! tracer shows both sides of every surface, whatever `doubleSided` is; only light is emitted by one side of what is
//! not double-sided.

mod accessors;
mod animation;
mod buffers;
mod camera;
mod defaults;
mod document;
mod extensions;
mod geometry;
mod lights;
mod materials;
mod meshes;
mod nodes;
mod skins;
#[cfg(test)]
mod tests;
mod textures;

use std::path::Path;

use gltf::json::Root;

use self::buffers::Buffers;
use self::nodes::Tree;
use super::{Draft, ImportOptions, Imported};
use crate::error::{Error, Result};

/// What is read: the JSON and its buffers.
#[derive(Clone, Copy, Debug)]
struct GltfSource<'a> {
    file: &'a Path,
    root: &'a Root,
    buffers: &'a Buffers<'a>,
}

impl GltfSource<'_> {
    /// An error at a place in the JSON.
    fn fault(&self, path: &str, message: impl Into<String>) -> Error {
        Error::Scene { file: self.file.into(), path: path.into(), message: message.into() }
    }
}

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// [`Error::Missing`] if it or one of its buffers cannot be read, [`Error::Parse`] or [`Error::Scene`] for faults in
/// it.
pub fn read(path: &Path, options: &ImportOptions) -> Result<Imported> {
    let bytes =
        crate::file::read_stream(path).map_err(|e| Error::Missing { file: path.into(), message: e.to_string() })?;
    let document = document::parse(path, &bytes)?;
    let buffers = Buffers::load(path, &document.root, document.bin)?;
    let source = GltfSource { file: path, root: &document.root, buffers: &buffers };

    let mut draft = Draft::of_files(&buffers.files);
    document::report_extensions(source.root, &mut draft);
    let tree = Tree::new(source, &mut draft)?;
    let motion = animation::evaluate(source, options.time, &mut draft)?;
    let pose = tree.pose(source, &motion)?;
    let placed = meshes::add(source, &tree, &pose, &mut draft)?;
    let has_light = lights::add(source, &tree, &pose, &mut draft)?;
    let has_camera = camera::add(source, &tree, &pose, &mut draft)?;
    if !has_camera {
        defaults::add_camera(&placed, &mut draft);
    }
    if !has_light && !placed.gives_light {
        defaults::add_light(&mut draft);
    }
    Ok(draft.finish())
}
