//! Scenes of other renderers, read into a [`SceneDesc`].

mod draft;
mod gltf;
mod missing;
mod mitsuba;
mod pbrt;
mod recolor;
mod report;

pub use draft::Draft;
pub use report::{ImportReport, Outcome, ReportEntry};

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::load_scene;
use crate::assets::{Assets, SceneSource};
use crate::desc::SceneDesc;
use crate::error::{Error, Result};

/// Options of an import beside the scene file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImportOptions {
    /// Mitsuba: values of `$name` that replace the defaults of the file.
    pub defines: Vec<(String, String)>,
    /// glTF: seconds into the animations.
    pub time: f64,
}

/// A scene file in the native format.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The scene.
    pub desc: SceneDesc,
    /// What it names that is no file.
    pub assets: Arc<Assets>,
    /// What became of the file's parameters; empty for the native format.
    pub report: ImportReport,
    /// The files beside the scene's own that were read to make it, as far as they are known by then.
    pub files: Arc<BTreeSet<PathBuf>>,
    /// The places in the file that became `shapes[0]`, `materials.floor` and so on; empty for the native format.
    pub places: Arc<BTreeMap<String, String>>,
}

impl Imported {
    /// Where the scene comes from, which was read from `file`.
    pub fn source(&self, file: &Path) -> SceneSource {
        SceneSource { file: file.into(), assets: Arc::clone(&self.assets), places: Arc::clone(&self.places) }
    }
}

/// The error for a file that is there and, by its extension, no scene.
fn not_a_scene(file: &Path, extension: &str) -> Option<Error> {
    let message = match extension {
        "obj" | "ply" | "stl" => "a mesh, not a scene: a scene names it as `file` of a shape of type `mesh`",
        "exr" | "png" | "jpg" | "jpeg" | "hdr" | "tif" | "tiff" => "an image, not a scene",
        "blend" | "fbx" | "usd" | "usda" | "usdc" | "usdz" | "dae" | "abc" | "3ds" => {
            "scenes of this kind cannot be read: export it as glTF (.glb), which Blender does"
        }
        _ => return None,
    };
    file.is_file().then(|| Error::Malformed { file: file.into(), message: message.into() })
}

/// Reads a scene file of any kind that its extension names: `.json` (Steradian's, and any other name), `.xml` (Mitsuba
/// 3), `.pbrt` (pbrt-v4), `.gltf` and `.glb` (glTF 2.0). Files that the scene names are looked up beside it.
///
/// # Errors
/// [`Error::Missing`] if it cannot be read, [`Error::Parse`] or
/// [`Error::Scene`] for faults in it.
pub fn read_scene(path: &Path, options: &ImportOptions) -> Result<Imported> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "xml" => mitsuba::read(path, options),
        "pbrt" => pbrt::read(path, options),
        "gltf" | "glb" => gltf::read(path, options),
        _ => {
            let desc = load_scene(path).map_err(|error| not_a_scene(path, &extension).unwrap_or(error))?;
            Ok(Imported {
                desc,
                assets: Arc::default(),
                report: ImportReport::default(),
                files: Arc::default(),
                places: Arc::default(),
            })
        }
    }
}
