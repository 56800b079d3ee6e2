//! Files to plain data: scene text to [`SceneDesc`], meshes and images to buffers. Knows nothing of what compilation makes of them.

mod assets;
mod comments;
mod environment_image;
mod fault;
mod fingerprint;
mod foreign;
mod ies;
mod image_file;
mod jpeg_check;
mod mesh_data;
mod mtl_maps;
mod obj;
mod obj_check;
mod ply;
mod ply_attributes;
mod scene_file;
mod spectrum;

pub use assets::Assets;
pub use environment_image::{RgbImage, read_rgb_image};
pub use fingerprint::{SceneFingerprint, files_of_scene, scene_fingerprint};
pub use foreign::{Draft, ImportOptions, ImportReport, Imported, Outcome, ReportEntry, read_scene};
pub use ies::{IesData, read_ies};
pub use image_file::{ImageData, Samples, read_image, read_image_bytes};
pub use mesh_data::MeshData;
pub use mtl_maps::{ObjMap, ObjMaps};
pub use obj::{ObjMaterial, ObjMesh, read_obj};
pub use ply::{read_ply, read_ply_attributes};
pub use scene_file::{load_scene, parse_scene, scene_as_written};
pub use spectrum::{Named, Spectrum, named};

use std::path::{Path, PathBuf};

use crate::desc::SceneDesc;
use crate::error::Error;

/// The JSON Schema of scene files, as text.
pub fn schema() -> String {
    let schema = schemars::schema_for!(SceneDesc);
    serde_json::to_string_pretty(&schema).unwrap_or_default()
}

/// Why an asset cannot be used; the caller knows where the scene names it.
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    /// The file does not exist or cannot be read.
    #[error("{}: {message}", file.display())]
    Missing {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        message: String,
    },
    /// What the file holds is malformed.
    #[error("{0}")]
    Malformed(String),
}

impl AssetError {
    fn missing(file: &Path, error: &std::io::Error) -> Self {
        Self::Missing { file: file.into(), message: error.to_string() }
    }

    /// The library's error, for an asset that `path` in `scene` names.
    pub fn at(self, scene: &Path, path: &str, asset: &Path) -> Error {
        match self {
            Self::Missing { file, message } => {
                Error::Missing { file, message: format!("{message} (named by {}: {path})", scene.display()) }
            }
            Self::Malformed(message) => Error::Asset { scene: scene.into(), path: path.into(), asset: asset.into(), message },
        }
    }
}
