//! Changes of a scene between two renders.

use std::sync::Arc;
use std::time::Instant;

use super::Renderer;
use super::loaded::LoadedScene;
use crate::compile::{CheckedScene, change_camera};
use crate::desc::{CameraDesc, MaterialDesc, SceneDesc};
use crate::error::Result;
use crate::render::Settings;

/// What of a loaded scene is not as its description has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Change {
    Nothing,
    Camera,
    Anything,
}

impl Renderer {
    /// Replaces the camera. The accelerator is kept; the scene is compiled again only if it has planes, which reach
    /// beyond the camera, or the shutter is another. A fault of the camera is an error of the next render.
    pub fn set_camera(&mut self, camera: CameraDesc) -> &mut Self {
        self.imported.desc.camera = camera;
        self.changed(Change::Camera)
    }

    /// Replaces a material or adds one. The accelerator is kept, and files are not read again, unless the new material
    /// needs other data of the meshes. A fault of the material is an error of the next render.
    pub fn set_material(&mut self, name: impl Into<String>, material: MaterialDesc) -> &mut Self {
        self.imported.desc.materials.insert(name.into(), material);
        self.changed(Change::Anything)
    }

    /// The scene's description, to be changed. The next render compiles the scene again; meshes and images are read
    /// from their files at the first change and kept from then on. The accelerator is kept if no shape has changed and
    /// none has `opacity`.
    pub fn scene_mut(&mut self) -> &mut SceneDesc {
        self.changed(Change::Anything);
        &mut self.imported.desc
    }

    pub(super) fn changed(&mut self, change: Change) -> &mut Self {
        self.change = self.change.max(change);
        self.is_as_in_file = false;
        (self.recipe, self.fingerprint) = (None, None);
        self
    }

    /// Makes the loaded scene that of the description. On an error it stays as it was.
    pub(super) fn update(&mut self, settings: &Settings) -> Result<()> {
        let start = if self.loaded.is_some() { Instant::now() } else { self.start };
        let source = self.imported.source(&self.scene_file);
        if let Some(loaded) = &mut self.loaded {
            if self.change == Change::Nothing && loaded.suits(settings) {
                (loaded.load_seconds, loaded.build_seconds) = (0.0, 0.0);
                return Ok(());
            }
            let desc = &self.imported.desc;
            if self.change <= Change::Camera && change_camera(&mut loaded.scene, desc, source.clone())? {
                self.change = Change::Nothing;
                loaded.adapt_lens(settings);
                if loaded.suits(settings) {
                    (loaded.load_seconds, loaded.build_seconds) = (start.elapsed().as_secs_f64(), 0.0);
                    return Ok(());
                }
            }
            self.files.get_or_insert_default();
        }
        let desc = &self.imported.desc;
        let checked = match &self.files {
            Some(files) => CheckedScene::with_cache(desc, source, Arc::clone(files))?,
            None => CheckedScene::new(desc, source)?,
        };
        let scene = checked.compile()?;
        let load_seconds = start.elapsed().as_secs_f64();
        self.loaded = Some(LoadedScene::new(scene, self.loaded.take(), settings, load_seconds)?);
        self.change = Change::Nothing;
        Ok(())
    }
}
