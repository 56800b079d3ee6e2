//! Objects and instances. Instances of objects inside objects are flattened to one level; what emits inside an object is placed in the world
//! once per instance, so that every light is a shape of its own.

use std::collections::BTreeMap;

use super::Builder;
use super::nesting::Nesting;
use super::prepared::PreparedShape;
use crate::desc::{InstanceDesc, SceneDesc};
use crate::error::Result;
use crate::geometry::{Instance, Object};
use crate::id::ObjectId;
use crate::math::DAffine3;

/// An object in parts: what its instances share, and what each of them has of its own.
struct PreparedObject {
    shared: Option<ObjectId>,
    emitters: Vec<PreparedShape>,
}

impl Builder {
    /// Adds the shapes of the world and all instances.
    pub(super) fn add_world(&mut self, desc: &SceneDesc) -> Result<()> {
        for (i, shape) in desc.shapes.iter().enumerate() {
            for prepared in self.prepare(&format!("shapes[{i}]"), shape)? {
                let id = self.place(prepared, &DAffine3::IDENTITY)?;
                self.geometry.world.push(id);
            }
        }

        let nesting = Nesting::new(&self.files, desc)?;
        let mut objects = BTreeMap::new();
        for (name, object) in &desc.objects {
            let mut shapes = Vec::new();
            for (k, shape) in object.shapes.iter().enumerate() {
                shapes.extend(self.prepare(&format!("objects.{name}.shapes[{k}]"), shape)?);
            }
            if nesting.is_used(name) {
                objects.insert(name.as_str(), self.share(shapes)?);
            } else {
                tracing::warn!("{}: objects.{name}: no instance places this object", self.files.scene.display());
            }
        }
        let world = Level { desc, nesting: &nesting, objects: &objects, path: "instances", outer: DAffine3::IDENTITY };
        self.add_instances(&world, &desc.instances)
    }

    /// The shapes of an object: what does not emit goes into a group for all instances.
    fn share(&mut self, shapes: Vec<PreparedShape>) -> Result<PreparedObject> {
        let (emitters, others): (Vec<_>, Vec<_>) = shapes.into_iter().partition(|shape| shape.emission.is_some());
        let mut object = Object::default();
        for shape in others {
            object.shapes.push(self.place(shape, &DAffine3::IDENTITY)?);
        }
        let shared = (!object.shapes.is_empty()).then(|| {
            self.geometry.objects.push(object);
            ObjectId::new(self.geometry.objects.len() - 1)
        });
        Ok(PreparedObject { shared, emitters })
    }

    /// Adds instances and those inside of them; [`Nesting`] has checked that this ends.
    fn add_instances(&mut self, level: &Level, instances: &[InstanceDesc]) -> Result<()> {
        for (i, instance) in instances.iter().enumerate() {
            let name = instance.object.as_str();
            let (Some(inner), Some(object)) = (level.desc.objects.get(name), level.objects.get(name)) else {
                continue;
            };
            if level.nesting.is_empty(name) {
                continue;
            }
            let path = format!("{}[{i}].transform", level.path);
            let transform = self.files.transform(&path, &instance.transform, &level.outer)?;
            if let Some(object) = object.shared {
                self.geometry.instances.push(Instance::new(object, transform));
            }
            let outer = transform.world_from_object;
            for emitter in &object.emitters {
                let id = self.place(emitter.clone(), &outer)?;
                self.geometry.world.push(id);
            }
            let path = format!("objects.{name}.instances");
            self.add_instances(&Level { path: &path, outer, ..*level }, &inner.instances)?;
        }
        Ok(())
    }
}

/// A list of instances and what stands around it.
#[derive(Clone, Copy)]
struct Level<'a> {
    desc: &'a SceneDesc,
    nesting: &'a Nesting<'a>,
    objects: &'a BTreeMap<&'a str, PreparedObject>,
    path: &'a str,
    outer: DAffine3,
}
