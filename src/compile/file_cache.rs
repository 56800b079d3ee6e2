//! Files that are kept for a scene which is compiled again after a change.

use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::meshes::LoadedMesh;
use crate::texture::TextureImage;

/// Meshes and images of textures as they were read. What changes in a file afterwards is not seen.
#[derive(Default)]
pub struct FileCache {
    meshes: Mutex<HashMap<MeshKey, Vec<LoadedMesh>>>,
    images: Mutex<HashMap<PathBuf, Arc<TextureImage>>>,
}

impl fmt::Debug for FileCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FileCache").finish_non_exhaustive()
    }
}

/// A mesh file and what is read of it.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) struct MeshKey {
    pub asset: PathBuf,
    pub with_materials: bool,
    pub attributes: BTreeSet<String>,
}

impl FileCache {
    pub(super) fn mesh(&self, key: &MeshKey) -> Option<Vec<LoadedMesh>> {
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner).get(key).cloned()
    }

    pub(super) fn keep_mesh(&self, key: MeshKey, meshes: &[LoadedMesh]) {
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner).insert(key, meshes.to_vec());
    }

    pub(super) fn image(&self, asset: &Path) -> Option<Arc<TextureImage>> {
        self.images.lock().unwrap_or_else(PoisonError::into_inner).get(asset).cloned()
    }

    pub(super) fn keep_image(&self, asset: &Path, image: &Arc<TextureImage>) {
        self.images.lock().unwrap_or_else(PoisonError::into_inner).insert(asset.to_owned(), Arc::clone(image));
    }
}
