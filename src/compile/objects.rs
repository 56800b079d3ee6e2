//! Objects and instances. Instances of objects inside objects are flattened to one level; what emits inside an object
//! is placed in the world once per instance, so that every light is a shape of its own.

use std::collections::BTreeMap;

use super::Builder;
use super::faults::Faults;
use super::nesting::Nesting;
use super::prepared::PreparedShape;
use crate::desc::{InstanceDesc, SceneDesc, ShapeDesc, UsedNames};
use crate::error::Result;
use crate::film::PlacementId;
use crate::geometry::{Instance, Object};
use crate::id::ObjectId;
use crate::math::{Bounds, DAffine3, Motion, RenderSpace};

/// An object in parts: what its instances share, and what each of them has of its own.
struct PreparedObject {
    shared: Option<ObjectId>,
    /// Shapes that move in it.
    movers: Vec<(ObjectId, Motion)>,
    emitters: Vec<PreparedShape>,
}

/// The shapes of a scene, loaded and checked; each of the world with its number.
#[derive(Default)]
pub(super) struct PreparedWorld<'a> {
    world: Vec<(usize, PreparedShape)>,
    planes: Vec<PreparedShape>,
    objects: BTreeMap<&'a str, Vec<PreparedShape>>,
    nesting: Option<Nesting<'a>>,
}

impl Builder {
    /// Loads and checks all shapes and instances.
    pub(super) fn prepare_world<'a>(
        &mut self,
        desc: &'a SceneDesc,
        used: &UsedNames,
        faults: &mut Faults,
    ) -> PreparedWorld<'a> {
        let mut all = PreparedWorld::default();
        for (i, shape) in desc.shapes.iter().enumerate() {
            let prepared = faults.keep(self.prepare(&format!("shapes[{i}]"), i, shape, true)).unwrap_or_default();
            let (endless, others): (Vec<_>, Vec<_>) = prepared.into_iter().partition(PreparedShape::is_plane);
            all.planes.extend(endless);
            all.world.extend(others.into_iter().map(|prepared| (i, prepared)));
        }
        all.nesting = faults.keep(Nesting::new(&self.files, desc));
        if let Some(nesting) = &all.nesting
            && desc.used_shapes(used).any(|(_, shape)| is_diced(shape))
        {
            let still = Motion::constant(DAffine3::IDENTITY);
            let level = Level { desc, nesting, path: "instances", outer: &still, placement: None };
            faults.keep(self.find_instances(&level, &desc.instances));
        }
        for (name, object) in &desc.objects {
            let is_used = used.objects.contains(name);
            let mut shapes = Vec::new();
            for (k, shape) in object.shapes.iter().enumerate() {
                let prepared = self.prepare(&format!("objects.{name}.shapes[{k}]"), k, shape, is_used);
                shapes.extend(faults.keep(prepared).unwrap_or_default());
            }
            if is_used {
                all.objects.insert(name.as_str(), shapes);
            } else {
                self.files.warn(&format!("objects.{name}"), format_args!("no instance places this object"));
            }
        }
        all
    }

    /// Adds the shapes of the world and all instances, in the render space that suits them.
    pub(super) fn add_world(&mut self, desc: &SceneDesc, prepared: PreparedWorld) -> Result<()> {
        let PreparedWorld { world, planes, objects, nesting } = prepared;
        let Some(nesting) = &nesting else { return Ok(()) };
        let still = Motion::constant(DAffine3::IDENTITY);
        let level = Level { desc, nesting, path: "instances", outer: &still, placement: None };
        self.space = self.render_space(&level, &world, &objects)?;

        for (i, prepared) in world {
            if let Some(motion) = prepared.motion.clone() {
                if let Some(object) = self.group(vec![prepared])? {
                    self.push_instance(&format!("shapes[{i}].motion"), object, &motion, None)?;
                }
            } else {
                let id = self.place(prepared, &DAffine3::IDENTITY, &{ self.space })?;
                self.geometry.world.extend(id);
            }
        }
        let mut shared = BTreeMap::new();
        for (name, shapes) in objects {
            shared.insert(name, self.share(shapes)?);
        }
        self.add_instances(&level, &shared, &desc.instances)?;

        self.surroundings = self.surroundings.transformed(&self.space.from_world());
        let bounds = self.geometry.bounds();
        if !bounds.is_empty() {
            self.surroundings =
                self.surroundings.union(&Bounds { min: bounds.min.as_dvec3(), max: bounds.max.as_dvec3() });
        }
        for plane in planes {
            let id = self.place(plane, &DAffine3::IDENTITY, &{ self.space })?;
            self.geometry.world.extend(id);
        }
        Ok(())
    }

    /// The space that suits the world's shapes and the instances of objects.
    fn render_space(
        &self,
        world: &Level,
        shapes: &[(usize, PreparedShape)],
        objects: &BTreeMap<&str, Vec<PreparedShape>>,
    ) -> Result<RenderSpace> {
        let mut bounds: Vec<Bounds> = Vec::with_capacity(shapes.len() + world.desc.instances.len());
        for (_, shape) in shapes {
            bounds.push(self.checked_bounds(shape.path(), shape.bounds())?);
        }
        let mut own = BTreeMap::new();
        for (name, shapes) in objects {
            own.insert(*name, shapes.iter().fold(Bounds::EMPTY, |all, shape| all.union(&shape.bounds())));
        }
        self.instance_bounds(world, &own, &world.desc.instances, &mut bounds)?;
        let largest = bounds.iter().map(|b| b.min.abs().max(b.max.abs()).max_element()).fold(0.0, f64::max);
        let least = RenderSpace::EXTENTS[0];
        if largest > 0.0 && largest < least {
            let message =
                format!("the scene reaches only {largest:e} from the origin: at least {least:e} can be rendered");
            return Err(self.files.error("shapes", message));
        }
        Ok(RenderSpace::around(&bounds))
    }

    /// Bounds of instances and those inside of them.
    fn instance_bounds(
        &self,
        level: &Level,
        own: &BTreeMap<&str, Bounds>,
        instances: &[InstanceDesc],
        bounds: &mut Vec<Bounds>,
    ) -> Result<()> {
        for (i, instance) in instances.iter().enumerate() {
            let name = instance.object.as_str();
            let (Some(inner), Some(object)) = (level.desc.objects.get(name), own.get(name)) else { continue };
            if level.nesting.is_empty(name) {
                continue;
            }
            let path = format!("{}[{i}]", level.path);
            let outer = self.instance_motion(level, &path, instance)?;
            if !object.is_empty() {
                let placed = outer.as_constant().map_or_else(|| outer.bounds(object), |map| object.transformed(&map));
                bounds.push(self.checked_bounds(&format!("{path}.transform"), placed)?);
            }
            let path = format!("objects.{name}.instances");
            self.instance_bounds(&Level { path: &path, outer: &outer, ..*level }, own, &inner.instances, bounds)?;
        }
        Ok(())
    }

    /// Finds where the instances of objects and those inside of them are when the shutter opens.
    fn find_instances(&mut self, level: &Level, instances: &[InstanceDesc]) -> Result<()> {
        for (i, instance) in instances.iter().enumerate() {
            let name = instance.object.as_str();
            let Some(inner) = level.desc.objects.get(name).filter(|_| !level.nesting.is_empty(name)) else { continue };
            let outer = self.instance_motion(level, &format!("{}[{i}]", level.path), instance)?;
            self.dicing.instances.entry(name.into()).or_default().push(outer.map_at(0.0));
            let path = format!("objects.{name}.instances");
            self.find_instances(&Level { path: &path, outer: &outer, ..*level }, &inner.instances)?;
        }
        Ok(())
    }

    /// Bounds within the range of coordinates; what is not finite is rejected where it is placed.
    fn checked_bounds(&self, path: &str, bounds: Bounds) -> Result<Bounds> {
        let (reach, most) = (bounds.min.abs().max(bounds.max.abs()).max_element(), RenderSpace::EXTENTS[1]);
        if reach.is_finite() && reach > most && !bounds.is_empty() {
            return Err(self.files.error(path, format!("reaches to {reach:e}: coordinates are at most {most:e}")));
        }
        Ok(bounds)
    }

    /// Where an instance stands in the world.
    fn instance_motion(&self, level: &Level, path: &str, instance: &InstanceDesc) -> Result<Motion> {
        let map = self
            .files
            .transform(&format!("{path}.transform"), &instance.transform, &DAffine3::IDENTITY)?
            .world_from_object;
        Ok(level.outer.after(&self.files.motion(&format!("{path}.motion"), &instance.motion, &map, self.shutter)?))
    }

    /// The shapes of an object: what neither emits nor moves goes into a group for all instances.
    fn share(&mut self, shapes: Vec<PreparedShape>) -> Result<PreparedObject> {
        let (emitters, others): (Vec<_>, Vec<_>) =
            shapes.into_iter().partition(|shape| shape.surface.emission.is_some());
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
        let bounds: Vec<Bounds> = shapes.iter().map(PreparedShape::bounds_at_rest).collect();
        let space = RenderSpace::around(&bounds);
        let mut object = Object::default();
        for shape in shapes {
            object.shapes.extend(self.place(shape, &DAffine3::IDENTITY, &space)?);
        }
        if object.shapes.is_empty() {
            return Ok(None);
        }
        self.geometry.objects.push(object);
        self.object_spaces.push(space);
        Ok(Some(ObjectId::new(self.geometry.objects.len() - 1)))
    }

    fn push_instance(
        &mut self,
        path: &str,
        object: ObjectId,
        motion: &Motion,
        placement: Option<PlacementId>,
    ) -> Result<()> {
        let motion = self.space.place_motion(&self.object_spaces[object.index()].place_within(motion));
        let instance = Instance::moving(object, motion).ok_or_else(|| self.files.error(path, super::SINGULAR))?;
        if instance.motion.is_none() && instance.inverse_reach().is_none() {
            let message =
                "scales the object so much, up or down, that the inverse is out of the range of 32-bit numbers";
            return Err(self.files.error(path, message));
        }
        self.geometry.instances.push(instance);
        self.identities.add_instance(placement);
        Ok(())
    }

    /// Adds instances and those inside of them; [`Nesting`] has checked that this ends.
    fn add_instances(
        &mut self,
        level: &Level,
        objects: &BTreeMap<&str, PreparedObject>,
        instances: &[InstanceDesc],
    ) -> Result<()> {
        for (i, instance) in instances.iter().enumerate() {
            let name = instance.object.as_str();
            let (Some(inner), Some(object)) = (level.desc.objects.get(name), objects.get(name)) else {
                continue;
            };
            if level.nesting.is_empty(name) {
                continue;
            }
            let path = format!("{}[{i}]", level.path);
            let place = format!("{path}.transform");
            let outer = self.instance_motion(level, &path, instance)?;
            let placement = Some(self.identities.placement(i, instance, level.placement));
            if let Some(object) = object.shared {
                self.push_instance(&place, object, &outer, placement)?;
            }
            for (object, motion) in &object.movers {
                self.push_instance(&place, *object, &outer.after(motion), placement)?;
            }
            for emitter in &object.emitters {
                let outer = outer.as_constant().ok_or_else(|| {
                    self.files
                        .error(&format!("{path}.motion"), format!("object \"{name}\" emits light and cannot move"))
                })?;
                let mut emitter = emitter.clone();
                emitter.surface.identity.placement = placement;
                let id = self.place(emitter, &outer, &{ self.space })?;
                self.geometry.world.extend(id);
            }
            let path = format!("objects.{name}.instances");
            self.add_instances(&Level { path: &path, outer: &outer, placement, ..*level }, objects, &inner.instances)?;
        }
        Ok(())
    }
}

/// A list of instances and what stands around it.
#[derive(Clone, Copy)]
struct Level<'a> {
    desc: &'a SceneDesc,
    nesting: &'a Nesting<'a>,
    path: &'a str,
    outer: &'a Motion,
    placement: Option<PlacementId>,
}

/// Whether it depends on the camera how a shape is refined.
pub(super) fn is_diced(shape: &ShapeDesc) -> bool {
    let ShapeDesc::Mesh(mesh) = shape else { return false };
    mesh.subdivision.as_ref().is_some_and(|subdivision| subdivision.edge_length.is_some())
}
