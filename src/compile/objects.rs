//! Shapes of the world, objects and instances. Instances of objects inside objects are flattened to one level; what emits inside an object
//! is placed in the world once per instance, so that every light is a shape of its own.

use std::collections::HashMap;

use super::{Builder, meshes, shapes};
use crate::color::Rgb;
use crate::desc::{InstanceDesc, MeshDesc, MeshShadingDesc, SceneDesc, ShapeCommon, ShapeDesc};
use crate::error::{Error, Result};
use crate::geometry::{Instance, Object, Placed, Shape};
use crate::id::{LightId, MaterialId, ObjectId, PrimId, ShapeId};
use crate::light::{AreaLight, Emission, Light};
use crate::math::{DAffine3, Transform};
use crate::scene::Surface;

/// More instances than any memory holds are refused before they are made.
const MAX_INSTANCES: usize = 100_000_000;

/// Objects that already have an id, by name; `None` for those without shapes to share.
type ObjectIds<'a> = HashMap<&'a str, Option<ObjectId>>;

impl Builder {
    /// Adds the shapes of the world and all instances.
    pub(super) fn add_world(&mut self, desc: &SceneDesc) -> Result<()> {
        for (i, shape) in desc.shapes.iter().enumerate() {
            let added = self.add_shape(&format!("shapes[{i}]"), shape, &DAffine3::IDENTITY)?;
            self.geometry.world.extend(added);
        }
        let mut ids = ObjectIds::new();
        self.add_instances(desc, "instances", &desc.instances, &DAffine3::IDENTITY, &mut Vec::new(), &mut ids)?;
        for name in desc.objects.keys().filter(|name| !ids.contains_key(name.as_str())) {
            tracing::warn!("{}: objects.{name}: no instance places this object", self.files.scene.display());
        }
        Ok(())
    }

    fn add_instances<'a>(
        &mut self,
        desc: &'a SceneDesc,
        path: &str,
        instances: &'a [InstanceDesc],
        outer: &DAffine3,
        inside: &mut Vec<&'a str>,
        ids: &mut ObjectIds<'a>,
    ) -> Result<()> {
        for (i, instance) in instances.iter().enumerate() {
            let path = format!("{path}[{i}]");
            let Some((name, object)) = desc.objects.get_key_value(&instance.object) else {
                let names = desc.objects.keys().map(String::as_str);
                return Err(self.files.unknown(&format!("{path}.object"), "object", &instance.object, names));
            };
            let name = name.as_str();
            if inside.contains(&name) {
                let cycle = [inside.as_slice(), &[name]].concat().join(" > ");
                return Err(self.files.error(&path, format!("objects contain each other in a cycle: {cycle}")));
            }
            let transform = self.files.transform(&format!("{path}.transform"), &instance.transform, outer)?;

            let id = match ids.get(name) {
                Some(id) => *id,
                None => {
                    let id = self.add_object(name, &object.shapes)?;
                    ids.insert(name, id);
                    id
                }
            };
            if let Some(object) = id {
                if self.geometry.instances.len() >= MAX_INSTANCES {
                    return Err(Error::OutOfMemory(format!("{path}: more than {MAX_INSTANCES} instances")));
                }
                self.geometry.instances.push(Instance { object, transform });
            }
            for (k, shape) in object.shapes.iter().enumerate().filter(|(_, shape)| emits(shape)) {
                let added = self.add_shape(&format!("objects.{name}.shapes[{k}]"), shape, &transform.world_from_object)?;
                self.geometry.world.extend(added);
            }

            inside.push(name);
            let nested = format!("objects.{name}.instances");
            self.add_instances(desc, &nested, &object.instances, &transform.world_from_object, inside, ids)?;
            inside.pop();
        }
        Ok(())
    }

    /// The object of the shapes that instances can share.
    fn add_object(&mut self, name: &str, shapes: &[ShapeDesc]) -> Result<Option<ObjectId>> {
        let mut object = Object::default();
        for (k, shape) in shapes.iter().enumerate().filter(|(_, shape)| !emits(shape)) {
            object.shapes.extend(self.add_shape(&format!("objects.{name}.shapes[{k}]"), shape, &DAffine3::IDENTITY)?);
        }
        if object.shapes.is_empty() {
            return Ok(None);
        }
        self.geometry.objects.push(object);
        Ok(Some(ObjectId::new(self.geometry.objects.len() - 1)))
    }

    /// Adds one shape of the scene file, placed by its own transform and `outer` after it; an OBJ file may bring several.
    fn add_shape(&mut self, path: &str, desc: &ShapeDesc, outer: &DAffine3) -> Result<Vec<ShapeId>> {
        let common = desc.common();
        let material = self.materials.find(&self.files, path, common.material)?;
        let transform = self.files.transform(&format!("{path}.transform"), common.transform, outer)?;
        let emission = self.emission(path, &common)?;
        if let Some(surface) = shapes::compile(&self.files, path, desc)? {
            let mut placed = Placed::new(surface, transform);
            placed.reverse_normal = common.reverse_normal;
            return Ok(vec![self.push_shape(path, Shape::Analytic(placed), material, emission)?]);
        }
        match desc {
            ShapeDesc::Mesh(mesh) => self.add_meshes(path, mesh, &transform, material, emission),
            _ => {
                let placement =
                    meshes::Placement { transform: &transform, shading: MeshShadingDesc::Flat, reverse_normal: common.reverse_normal };
                let mesh = meshes::place(&self.files, path, None, meshes::cube(), placement)?;
                Ok(vec![self.push_shape(path, Shape::Mesh(mesh), material, emission)?])
            }
        }
    }

    fn add_meshes(
        &mut self,
        path: &str,
        desc: &MeshDesc,
        transform: &Transform,
        material: MaterialId,
        emission: Option<Emission>,
    ) -> Result<Vec<ShapeId>> {
        let mut added = Vec::new();
        for loaded in meshes::load(&self.files, path, desc)? {
            let placement = meshes::Placement { transform, shading: desc.shading, reverse_normal: desc.reverse_normal };
            let mesh = meshes::place(&self.files, path, desc.file.as_deref(), loaded.data, placement)?;
            let (mut material, mut emission) = (material, emission);
            if let Some(mtl) = &loaded.material {
                material = self.materials.push(super::materials::from_mtl(mtl));
                let glow = mtl.emissive.filter(|e| e.iter().all(|x| x.is_finite() && *x >= 0.0) && e.iter().any(|&x| x > 0.0));
                emission = emission.or(glow.map(|radiance| Emission { radiance: radiance.into(), two_sided: false }));
            }
            added.push(self.push_shape(path, Shape::Mesh(mesh), material, emission)?);
        }
        Ok(added)
    }

    fn emission(&self, path: &str, common: &ShapeCommon) -> Result<Option<Emission>> {
        let Some(emission) = common.emission else {
            return Ok(None);
        };
        let radiance = Rgb::from(self.files.emitted(&format!("{path}.emission.radiance"), emission.radiance)?);
        Ok((!radiance.is_black()).then_some(Emission { radiance, two_sided: emission.two_sided }))
    }

    fn push_shape(&mut self, path: &str, shape: Shape, material: MaterialId, emission: Option<Emission>) -> Result<ShapeId> {
        if !shape.bounds().min.is_finite() || !shape.bounds().max.is_finite() {
            return Err(self.files.error(path, "the shape reaches to infinity: its size or place is too large for 32-bit numbers"));
        }
        let id = ShapeId::new(self.geometry.shapes.len());
        self.geometry.shapes.push(shape);
        let mut surface = Surface { material, first_light: None, single_light: false };
        if let Some(emission) = emission {
            let lights = AreaLight::for_shape(id, emission, &self.geometry);
            if !lights.iter().any(|light| light.area() > 0.0) {
                return Err(self.files.error(&format!("{path}.emission"), "the light has no area"));
            }
            surface.first_light = Some(LightId::new(self.lights.len()));
            surface.single_light = lights.len() == 1;
            self.lights.extend(lights.into_iter().map(Light::Area));
            debug_assert!(surface.light(PrimId(0)).is_some());
        }
        self.surfaces.push(surface);
        Ok(id)
    }
}

/// Whether a shape gives off light, as far as the scene file says.
fn emits(desc: &ShapeDesc) -> bool {
    desc.common().emission.is_some_and(|e| e.radiance.iter().any(|&r| r != 0.0))
}
