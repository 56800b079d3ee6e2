//! Changes of a scene between two renders.

use std::sync::Arc;
use std::time::Instant;

use super::Renderer;
use super::loaded::LoadedScene;
use crate::compile::{CheckedScene, SceneChanges};
use crate::desc::{CameraDesc, MaterialDesc, SceneDesc};
use crate::error::Result;
use crate::render::Settings;

impl Renderer {
    /// Replaces the camera. The accelerator is kept; the scene is compiled again only if it has planes, which reach
    /// beyond the camera, or subdivision that follows it, or the shutter is another. A fault of the camera is an error
    /// of the next render.
    pub fn set_camera(&mut self, camera: CameraDesc) -> &mut Self {
        self.imported.desc.camera = camera;
        self.changed().camera = true;
        self
    }

    /// Replaces a material or adds one. The accelerator is kept, and files are not read again, unless the new material
    /// needs other data of the meshes. If one of constants replaces one of constants, nothing else is compiled; see
    /// [`change`](Self::change). A fault of the material is an error of the next render.
    pub fn set_material(&mut self, name: impl Into<String>, material: MaterialDesc) -> &mut Self {
        let name = name.into();
        self.imported.desc.materials.insert(name.clone(), material);
        self.changed().materials.insert(name);
        self
    }

    /// The scene's description, to be changed. The next render compiles the scene again; meshes and images are read
    /// from their files at the first change and kept from then on. The accelerator is kept if no shape has changed and
    /// none has `opacity`.
    pub fn scene_mut(&mut self) -> &mut SceneDesc {
        self.changed().others = true;
        &mut self.imported.desc
    }

    /// What of the loaded scene is not as its description has it, for another change.
    pub(super) fn changed(&mut self) -> &mut SceneChanges {
        self.is_as_in_file = false;
        (self.recipe, self.fingerprint) = (None, None);
        &mut self.changes
    }

    /// Makes the loaded scene that of the description. On an error it stays as it was.
    pub(super) fn update(&mut self, settings: &Settings) -> Result<()> {
        let start = if self.loaded.is_some() { Instant::now() } else { self.start };
        let source = self.imported.source(&self.scene_file);
        if let Some(loaded) = &mut self.loaded {
            let is_changed = self.changes != SceneChanges::default();
            if !is_changed && loaded.suits(settings) {
                (loaded.load_seconds, loaded.build_seconds) = (0.0, 0.0);
                return Ok(());
            }
            // A lens that was removed may be needed again.
            self.changes.camera |= !loaded.suits(settings);
            let desc = &self.imported.desc;
            if self.changes.apply(&mut loaded.scene, desc, source.clone())? {
                self.changes = SceneChanges::default();
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
        self.changes = SceneChanges::default();
        Ok(())
    }
}
