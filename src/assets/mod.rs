//! Assets, which a scene names: meshes, images, volumes, light profiles and measured BRDFs, read from files to buffers
//! that nobody has checked, or made by the reader of a scene format.

mod environment_image;
mod fingerprint;
mod ies;
mod image_file;
mod in_memory;
mod jpeg_check;
mod mesh_data;
mod mtl_maps;
mod obj;
mod obj_check;
mod ply;
mod ply_attributes;
mod source;
mod strands;
mod tensors;
mod vdb;
mod volume;

pub use environment_image::{RgbImage, read_rgb_image};
pub(crate) use fingerprint::{Hash, file_hashes, files_of_obj, is_obj};
pub use ies::{IesData, ies_bytes, read_ies};
pub use image_file::{read_image, read_image_bytes};
pub use in_memory::Assets;
pub use mesh_data::MeshData;
pub use mtl_maps::{ObjMap, ObjMaps};
pub use obj::{ObjMaterial, ObjMesh, read_obj};
pub use ply::{read_ply, read_ply_attributes};
pub use source::SceneSource;
pub use strands::{StrandData, read_strands};
pub use tensors::{TENSOR_MAGIC, read_measured};
pub use vdb::{GridChoice, VDB_MAGICS, VdbGrid, list_vdb, read_vdb, read_vdb_within};
pub use volume::{VolHeader, VolumeData, read_raw_volume, read_vol, read_vol_header, vol_bytes};

use std::path::{Path, PathBuf};

use crate::error::Error;

/// Why an asset cannot be used; the caller adds the place in the scene.
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
            Self::Malformed(message) => {
                Error::Asset { scene: scene.into(), path: path.into(), asset: asset.into(), message }
            }
        }
    }
}
