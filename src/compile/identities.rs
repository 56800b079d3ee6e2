//! What shapes, materials and instances are called in the layers that pick them.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::CompileContext;
use crate::desc::{InstanceDesc, SceneDesc, ShapeDesc};
use crate::film::{Identities, Label, NameId, PlacementId, ShapeIdentity};

/// The name of the material of shapes that name none.
const DEFAULT_MATERIAL: &str = "default";

/// Identities under construction: each name is kept once.
#[derive(Default)]
pub struct IdentityTable {
    identities: Identities,
    ids: HashMap<Box<str>, NameId>,
    /// Names that the scene gives and that look as if they had been made here.
    given: HashSet<String>,
    /// Names of objects, which instances are called after.
    objects: HashSet<String>,
}

impl IdentityTable {
    pub fn new(desc: &SceneDesc) -> Self {
        let instances = desc.instances.iter().chain(desc.objects.values().flat_map(|object| &object.instances));
        let of_instances = instances.filter_map(|instance| instance.name.as_deref());
        let of_shapes = desc.shapes.iter().chain(desc.objects.values().flat_map(|object| &object.shapes));
        let names = of_instances.chain(of_shapes.filter_map(|shape| shape.common().name));
        let given = names.filter(|name| ends_in_a_number(name)).map(str::to_owned).collect();
        Self { given, objects: desc.objects.keys().cloned().collect(), ..Self::default() }
    }

    /// The table.
    pub fn finish(self) -> Identities {
        self.identities
    }

    /// The id of a name; a new one if it is new.
    pub fn name(&mut self, name: &str) -> NameId {
        if let Some(&id) = self.ids.get(name) {
            return id;
        }
        let id = self.identities.add_name(name);
        self.ids.insert(name.into(), id);
        id
    }

    /// A name that the scene does not give.
    fn numbered(&mut self, base: &str, number: usize) -> Label {
        let mut name = format!("{base}_{number}");
        if !self.given.contains(&name) {
            return Label::numbered(self.name(base), number as u32);
        }
        while self.given.contains(&name) {
            name.push('_');
        }
        Label::plain(self.name(&name))
    }

    /// What a shape is called that is the one with this number of its list.
    pub fn shape(&mut self, files: &CompileContext, number: usize, desc: &ShapeDesc) -> ShapeIdentity {
        let common = desc.common();
        let stem = match desc {
            // Inline data in place of a file has no name in the scene.
            ShapeDesc::Mesh(mesh) => {
                mesh.file.as_deref().filter(|file| !files.source.assets.meshes.contains_key(*file))
            }
            _ => None,
        };
        let stem = stem.and_then(|file| Path::new(file).file_stem()).map(|stem| stem.to_string_lossy().into_owned());
        let label = match common.name.filter(|name| !name.is_empty()) {
            Some(name) => Label::plain(self.name(name)),
            None => {
                let mut base = stem.clone().unwrap_or_else(|| kind(desc).to_owned());
                while self.objects.contains(&base) {
                    base.push('_');
                }
                self.numbered(&base, number)
            }
        };
        let material = self.name(common.material.unwrap_or(DEFAULT_MATERIAL));
        let asset = stem.map(|stem| self.name(&stem));
        ShapeIdentity { label, material, asset, placement: None }
    }

    /// What an instance is called that is the one with this number of its list.
    pub fn placement(&mut self, number: usize, desc: &InstanceDesc, parent: Option<PlacementId>) -> PlacementId {
        let label = match desc.name.as_deref().filter(|name| !name.is_empty()) {
            Some(name) => Label::plain(self.name(name)),
            None => self.numbered(&desc.object, number),
        };
        let asset = self.name(&desc.object);
        self.identities.add_placement(label, parent, asset)
    }

    /// Adds the next shape of the geometry.
    pub fn add_shape(&mut self, shape: ShapeIdentity) {
        self.identities.add_shape(shape);
    }

    /// Adds all media, by their names.
    pub fn add_media(&mut self, names: &[Option<String>]) {
        for name in names {
            let name = name.as_deref().map(|name| self.name(name));
            self.identities.add_medium(name);
        }
    }

    /// Adds the next instance of the geometry.
    pub fn add_instance(&mut self, placement: Option<PlacementId>) {
        self.identities.add_instance(placement);
    }
}

fn ends_in_a_number(name: &str) -> bool {
    name.trim_end_matches('_').ends_with(|c: char| c.is_ascii_digit())
}

/// What shapes are called that come from no file.
fn kind(desc: &ShapeDesc) -> &'static str {
    match desc {
        ShapeDesc::Mesh(_) => "mesh",
        ShapeDesc::Sphere(_) => "sphere",
        ShapeDesc::Quad(_) => "quad",
        ShapeDesc::Plane(_) => "plane",
        ShapeDesc::Cube(_) => "cube",
        ShapeDesc::Disk(_) => "disk",
        ShapeDesc::Cylinder(_) => "cylinder",
        ShapeDesc::Cone(_) => "cone",
        ShapeDesc::Revolution(_) => "revolution",
        ShapeDesc::Curves(_) => "curves",
        ShapeDesc::Points(_) => "points",
    }
}
