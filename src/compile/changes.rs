//! Changes of a compiled scene that leave everything else as it is.

use std::collections::BTreeSet;

use super::materials::{Compiler, MaterialTable};
use super::media::NamedMedia;
use super::objects::is_diced;
use super::textures::TextureTable;
use super::{CompileContext, camera, lights};
use crate::assets::SceneSource;
use crate::camera::Camera;
use crate::desc::{SceneDesc, ShapeDesc};
use crate::error::Result;
use crate::id::{LightId, MaterialId};
use crate::light::{LightGroups, LightSet};
use crate::material::Material;
use crate::scene::Scene;

/// What of a description differs from that of the compiled scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneChanges {
    /// The camera.
    pub camera: bool,
    /// Materials with these names, new ones included.
    pub materials: BTreeSet<String>,
    /// Lights, by their number in the list.
    pub lights: BTreeSet<usize>,
    /// Anything else.
    pub others: bool,
}

impl SceneChanges {
    /// Changes a scene that was compiled from the same description before these changes. The result is whether that is
    /// all: `false` leaves the scene as it was, and it is to be compiled again, because
    /// - shapes depend on the camera (planes reach beyond it, subdivision follows it, motion is that while its shutter
    ///   is open),
    /// - a material is not made of constants alone, before or after the change, or is a part of another one,
    /// - a light has a texture or moves to another group, or the change makes a fault.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) with the key of the camera that makes no sense.
    pub fn apply(&self, scene: &mut Scene, desc: &SceneDesc, source: SceneSource) -> Result<bool> {
        let files = CompileContext::from(source);
        if self.others {
            return Ok(false);
        }
        let camera = if self.camera { changed_camera(scene, desc, &files)?.map(Some) } else { Some(None) };
        let materials = self.materials.iter().map(|name| changed_material(scene, desc, &files, name));
        let (Some(camera), Some(materials), Some(lights)) =
            (camera, materials.collect::<Option<Vec<_>>>(), self.changed_lights(scene, desc, &files))
        else {
            return Ok(false);
        };
        for (id, material) in materials {
            scene.materials[id.index()] = material;
        }
        scene.features.set_materials(&scene.materials, &scene.textures);
        if let Some(lights) = lights {
            scene.lights = lights;
        }
        if let Some(camera) = camera {
            scene.features.lens = camera.lens().is_some();
            scene.features.motion = scene.geometry.is_moving() || camera.is_moving();
            scene.camera = camera;
        }
        Ok(true)
    }

    /// All lights, if one has changed; nothing where the scene is to be compiled again.
    fn changed_lights(&self, scene: &Scene, desc: &SceneDesc, files: &CompileContext) -> Option<Option<LightSet>> {
        if self.lights.is_empty() {
            return Some(None);
        }
        let mut lights = scene.lights.lights().to_vec();
        let of_shapes = lights.len().checked_sub(desc.lights.len())?;
        for &number in &self.lights {
            let (id, light) = (LightId::new(of_shapes + number), desc.lights.get(number)?);
            let group = scene.light_groups.of(id).map(|group| scene.light_groups.names()[group.index()].as_str());
            if light.group().filter(|name| *name != LightGroups::OF_THE_REST) != group {
                return None;
            }
            let path = format!("lights[{number}]");
            lights[id.index()] =
                lights::compile(files, &path, light, scene.camera.render_space(), &TextureTable::default()).ok()?;
        }
        let lights = lights::light_set(lights, &scene.geometry, desc.light_sampler);
        let is_alike = lights.shines() == scene.lights.shines()
            && lights.at_infinity().is_empty() == scene.lights.at_infinity().is_empty();
        is_alike.then_some(Some(lights))
    }
}

/// The camera; nothing where shapes depend on it.
fn changed_camera(scene: &Scene, desc: &SceneDesc, files: &CompileContext) -> Result<Option<Camera>> {
    let camera = camera::compile(files, &desc.camera)?;
    let mut shapes = desc.shapes.iter().chain(desc.objects.values().flat_map(|object| &object.shapes));
    let depend_on_it = shapes.any(|shape| matches!(shape, ShapeDesc::Plane(_)) || is_diced(shape));
    if depend_on_it || camera.shutter() != scene.camera.shutter() {
        return Ok(None);
    }
    camera::place_in(files, &desc.camera, camera, *scene.camera.render_space()).map(Some)
}

/// A material of constants in place of another one; nothing where either is anything else, or has a fault.
fn changed_material(
    scene: &Scene,
    desc: &SceneDesc,
    files: &CompileContext,
    name: &str,
) -> Option<(MaterialId, Material)> {
    let id = *scene.plain_materials.get(name)?;
    if desc.materials.values().any(|material| material.part_names().contains(&name)) {
        return None;
    }
    let (textures, media) = (TextureTable::default(), NamedMedia::default());
    let mut table = MaterialTable::default();
    let used = desc.used_names();
    let compiler = Compiler { files, textures: &textures, media: &media, used: &used };
    let added = table.add(&compiler, desc, name, &mut Vec::new()).ok()?;
    table.is_plain(added).then(|| (id, table.materials.swap_remove(added.index())))
}
