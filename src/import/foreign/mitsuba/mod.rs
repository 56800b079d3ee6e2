//! Mitsuba 3 scenes.
//!
//! What Mitsuba does when it renders in RGB is what is meant. Its surfaces are black from behind unless `twosided`, its
//! images have their origin at the top left, its cameras look along +Z with +X to the left; light that rough surfaces
//! scatter twice between their microfacets is lost.

mod bsdfs;
mod curves;
mod element;
mod emitters;
mod integrators;
mod media;
mod meshes;
mod names;
mod principled;
mod sensor;
mod serialized;
mod shapes;
mod sky;
mod spectra;
mod textures;
mod transforms;
mod tree;
mod values;
mod volumes;
mod xml;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::{Draft, ImportOptions, Imported};
use crate::error::Result;
use bsdfs::BsdfBinding;
use textures::{Role, TextureValue, UvOrigin};
use tree::{Document, PluginId, Value};

/// Reads a Mitsuba 3 XML file.
pub fn read(path: &Path, options: &ImportOptions) -> Result<Imported> {
    let document = xml::read(path, &options.defines)?;
    let mut reader = Reader {
        document: &document,
        scene: path,
        draft: Draft::of_files(&document.files),
        textures: BTreeMap::new(),
        bindings: BTreeMap::new(),
        surfaces: BTreeMap::new(),
        groups: BTreeMap::new(),
        reliefs: BTreeSet::new(),
        black: None,
        media: BTreeMap::new(),
        containers: BTreeMap::new(),
        media_inside: BTreeSet::new(),
        media_outside: BTreeSet::new(),
        open: Vec::new(),
    };
    reader.scene()?;
    Ok(reader.draft.finish())
}

/// A scene while it is read.
struct Reader<'a> {
    document: &'a Document,
    scene: &'a Path,
    draft: Draft,
    /// What textures have become.
    textures: BTreeMap<(PluginId, Role, UvOrigin), TextureValue>,
    /// What BSDFs have become.
    bindings: BTreeMap<(PluginId, UvOrigin), BsdfBinding>,
    /// The materials of shapes with these BSDFs.
    surfaces: BTreeMap<(PluginId, UvOrigin), String>,
    /// Objects of shape groups; none where a group is empty.
    groups: BTreeMap<PluginId, Option<String>>,
    /// Materials that have relief, or parts with it.
    reliefs: BTreeSet<String>,
    /// The material that reflects nothing.
    black: Option<String>,
    /// The names of what media have become.
    media: BTreeMap<PluginId, String>,
    /// Materials of surfaces of media, by those of the surface, the names of the media inside, and whether another is
    /// outside.
    containers: BTreeMap<(String, Option<String>, bool), String>,
    /// Media that are inside of some shape,
    media_inside: BTreeSet<String>,
    /// and outside of some, or around a camera or a light.
    media_outside: BTreeSet<String>,
    /// Plugins on the way to the one that is read.
    open: Vec<PluginId>,
}

/// Plugins that refer to each other deeper than this are a mistake.
const MAX_REFERENCES: usize = 100;

impl Reader<'_> {
    /// Reads everything.
    fn scene(&mut self) -> Result<()> {
        let Some(scene) = self.document.plugins.last() else {
            return Ok(());
        };
        let (mut has_sensor, mut has_integrator) = (false, false);
        for property in &scene.properties {
            let Some(id) = self.document.plugin_of(property)? else {
                self.draft.ignored(&property.place.to_string(), "scene", &property.name, "a scene has no parameters");
                continue;
            };
            let is_reference = matches!(property.value, Value::Reference(_));
            let plugin = &self.document.plugins[id.0];
            match (plugin.class.as_str(), plugin.kind.as_str()) {
                _ if is_reference => {}
                ("sensor", _) if has_sensor => self.whole(id, "only the first sensor is used"),
                ("sensor", "perspective" | "thinlens" | "orthographic") => {
                    has_sensor = true;
                    self.sensor(id)?;
                }
                ("sensor", _) => self.whole(id, "unsupported sensor: it is left out"),
                ("integrator", _) if has_integrator => self.whole(id, "only the first integrator is used"),
                ("integrator", _) => {
                    has_integrator = true;
                    self.integrator(id)?;
                }
                ("shape", _) => self.world_shape(id)?,
                ("emitter", _) => self.emitter(id)?,
                ("medium" | "phase" | "volume", _) if !self.shows_media() => {
                    self.whole(id, "the integrator shows no participating media: left out");
                }
                // What others refer to is read when they do.
                _ => {}
            }
        }
        if !has_sensor {
            return Err(scene.place.error("the scene has no sensor of type perspective, thinlens or orthographic"));
        }
        self.surround();
        if !has_integrator {
            self.draft.desc.integrator = integrators::unlimited_path();
        }
        Ok(())
    }

    /// Reports that a plugin is ignored with all that is in it.
    fn whole(&mut self, id: PluginId, why: &str) {
        let plugin = &self.document.plugins[id.0];
        self.draft.ignored(&plugin.place.to_string(), &plugin.title(), "", why);
    }

    /// Rejects a plugin that is a part of itself, or lies too deep. `open.pop()` ends what this begins.
    fn guard(&mut self, id: PluginId) -> Result<()> {
        let plugin = &self.document.plugins[id.0];
        if self.open.contains(&id) {
            return Err(plugin.place.error(format!("{} refers to itself", plugin.title())));
        }
        if self.open.len() >= MAX_REFERENCES {
            return Err(plugin.place.error(format!("references are nested more than {MAX_REFERENCES} deep")));
        }
        self.open.push(id);
        Ok(())
    }
}
