//! Meshes, images, volumes and profiles of lights that a reader made itself, for which there are no files.

use std::collections::BTreeMap;

use super::{IesData, MeshData, RgbImage, VolumeData};
use crate::image_data::ImageData;

/// What a scene names as if it were a file: looked up here before the folder of the scene is.
#[derive(Clone, Debug, Default)]
pub struct Assets {
    /// Meshes by the name that stands in place of their file's; such names end with `.ply`.
    pub meshes: BTreeMap<String, MeshData>,
    /// Images of textures; such names end with `.png` (whole numbers) or `.exr` (floats).
    pub images: BTreeMap<String, ImageData>,
    /// Images of environments; such names end with `.exr`.
    pub environments: BTreeMap<String, RgbImage>,
    /// Volumes; such names end with `.vol`.
    pub volumes: BTreeMap<String, VolumeData>,
    /// Intensities of lights by direction; such names end with `.ies`.
    pub profiles: BTreeMap<String, IesData>,
}

impl Assets {
    /// Whether there is an asset of this name.
    pub fn contains(&self, name: &str) -> bool {
        self.meshes.contains_key(name)
            || self.images.contains_key(name)
            || self.environments.contains_key(name)
            || self.volumes.contains_key(name)
            || self.profiles.contains_key(name)
    }
}
