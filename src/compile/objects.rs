//! Objects and instances. Instances of objects inside objects are flattened to one level; what emits inside an object is placed in the world
//! once per instance, so that every light is a shape of its own.

use std::collections::BTreeMap;

use super::Builder;
use super::nesting::Nesting;
use super::prepared::PreparedShape;
use crate::desc::{InstanceDesc, SceneDesc, UsedNames};
use crate::error::Result;
use crate::film::PlacementId;
use crate::geometry::{Instance, Object};
use crate::id::ObjectId;
use crate::math::{Bounds, DAffine3, Motion};

/// An object in parts: what its instances share, and what each of them has of its own.
struct PreparedObject {
    shared: Option<ObjectId>,
    /// Shapes that move in it.
    movers: Vec<(ObjectId, Motion)>,
    emitters: Vec<PreparedShape>,
}

impl Builder {
    /// Adds the shapes of the world and all instances.
    pub(super) fn add_world(&mut self, desc: &SceneDesc, used: &UsedNames) -> Result<()> {
        let mut planes = Vec::new();
        for (i, shape) in desc.shapes.iter().enumerate() {
            for prepared in self.prepare(&format!("shapes[{i}]"), i, shape, true)? {
                if prepared.is_plane() {
                    planes.push(prepared);
                } else if let Some(motion) = prepared.motion.clone() {
                    if let Some(object) = self.group(vec![prepared])? {
                        self.push_instance(&format!("shapes[{i}].motion"), object, &motion, None)?;
                    }
                } else {
                    let id = self.place(prepared, &DAffine3::IDENTITY)?;
                    self.geometry.world.extend(id);
                }
            }
        }

        let nesting = Nesting::new(&self.files, desc)?;
        let mut objects = BTreeMap::new();
        for (name, object) in &desc.objects {
            let is_used = used.objects.contains(name);
            let mut shapes = Vec::new();
            for (k, shape) in object.shapes.iter().enumerate() {
                shapes.extend(self.prepare(&format!("objects.{name}.shapes[{k}]"), k, shape, is_used)?);
            }
            if is_used {
                objects.insert(name.as_str(), self.share(shapes)?);
            } else {
                self.files.warn(&format!("objects.{name}"), format_args!("no instance places this object"));
            }
        }
        let still = Motion::constant(DAffine3::IDENTITY);
        let world = Level { desc, nesting: &nesting, objects: &objects, path: "instances", outer: &still, placement: None };
        self.add_instances(&world, &desc.instances)?;

        let bounds = self.geometry.bounds();
        if !bounds.is_empty() {
            self.surroundings = self.surroundings.union(&Bounds { min: bounds.min.as_dvec3(), max: bounds.max.as_dvec3() });
        }
        for plane in planes {
            let id = self.place(plane, &DAffine3::IDENTITY)?;
            self.geometry.world.extend(id);
        }
        Ok(())
    }

    /// The shapes of an object: what neither emits nor moves goes into a group for all instances.
    fn share(&mut self, shapes: Vec<PreparedShape>) -> Result<PreparedObject> {
        let (emitters, others): (Vec<_>, Vec<_>) = shapes.into_iter().partition(|shape| shape.emission.is_some());
        let (moving, resting): (Vec<_>, Vec<_>) = others.into_iter().partition(|shape| shape.motion.is_some());
        let shared = self.group(resting)?;
        let mut movers = Vec::new();
        for shape in moving {
            if let Some(motion) = shape.motion.clone()
                && let Some(object) = self.group(vec![shape])?
            {
                movers.push((object, motion));
            }
        }
        Ok(PreparedObject { shared, movers, emitters })
    }

    /// An object of these shapes; `None` if nothing is left of them.
    fn group(&mut self, shapes: Vec<PreparedShape>) -> Result<Option<ObjectId>> {
        let mut object = Object::default();
        for shape in shapes {
            object.shapes.extend(self.place(shape, &DAffine3::IDENTITY)?);
        }
        if object.shapes.is_empty() {
            return Ok(None);
        }
        self.geometry.objects.push(object);
        Ok(Some(ObjectId::new(self.geometry.objects.len() - 1)))
    }

    fn push_instance(&mut self, path: &str, object: ObjectId, motion: &Motion, placement: Option<PlacementId>) -> Result<()> {
        let instance = Instance::moving(object, motion.clone()).ok_or_else(|| self.files.error(path, super::SINGULAR))?;
        self.geometry.instances.push(instance);
        self.identities.add_instance(placement);
        Ok(())
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
            let path = format!("{}[{i}]", level.path);
            let place = format!("{path}.transform");
            let map = self.files.transform(&place, &instance.transform, &DAffine3::IDENTITY)?.world_from_object;
            let outer = level.outer.after(&self.files.motion(&format!("{path}.motion"), &instance.motion, &map, self.shutter)?);
            let placement = Some(self.identities.placement(i, instance, level.placement));
            if let Some(object) = object.shared {
                self.push_instance(&place, object, &outer, placement)?;
            }
            for (object, motion) in &object.movers {
                self.push_instance(&place, *object, &outer.after(motion), placement)?;
            }
            for emitter in &object.emitters {
                let outer = outer.as_constant().ok_or_else(|| {
                    self.files.error(&format!("{path}.motion"), format!("object \"{name}\" gives off light and cannot move"))
                })?;
                let mut emitter = emitter.clone();
                emitter.identity.placement = placement;
                let id = self.place(emitter, &outer)?;
                self.geometry.world.extend(id);
            }
            let path = format!("objects.{name}.instances");
            self.add_instances(&Level { path: &path, outer: &outer, placement, ..*level }, &inner.instances)?;
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
    outer: &'a Motion,
    placement: Option<PlacementId>,
}
