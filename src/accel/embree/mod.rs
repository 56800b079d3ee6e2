//! Embree as an accelerator: triangles on the meshes' own buffers, analytic shapes as user geometry, objects as scenes
//! of their own that instances place.
//!
//! This directory is the only home of `unsafe`. What of Embree's interface is inline or differs between versions is in
//! `ffi/embree_shim.c`.

mod callbacks;
mod device;
mod gate;
mod packet;
mod replay;
mod scene;
mod sys;
#[cfg(test)]
mod tests;

pub use device::EmbreeInfo;
pub use replay::EmbreeReplay;

use std::ffi::c_char;

use super::{Accelerator, AnyHitRays, Coherence, HitRows};
use crate::error::Result;
use crate::geometry::{Geometry, Hit, Shape};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::rows::BATCH;
use crate::math::{Aabb, Ray, RayRows};
use device::Device;
use gate::RayLimits;
use packet::{HitPacket, INVALID, ShadowPacket, Tracer, WIDTH};
use scene::{GeometryHandle, Scene, SceneBuilder, UserInstances, UserShapes};
use sys::StHit;

/// Has `report` called, in place of abort(), for an exception of C++ that nobody catches, such as one of memory in a
/// thread of Embree's. It gets whether memory or threads ran out, and a description that lives during the call, and
/// must not return.
pub fn on_uncaught_exception(report: extern "C" fn(bool, *const c_char)) {
    // SAFETY: the function pointer is valid for ever, and takes the parameters declared in the header.
    unsafe { sys::st_on_uncaught(Some(report)) }
}

/// How much effort Embree's build makes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmbreeQuality {
    /// Morton codes: fastest to build.
    Low,
    /// Binned surface area heuristic.
    #[default]
    Medium,
    /// With spatial splits.
    High,
}

/// How Embree builds and traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmbreeOptions {
    /// Effort of the build.
    pub quality: EmbreeQuality,
    /// Whether rays may not slip through edges. Without it distances are less certain, too; for comparisons only.
    pub robust: bool,
    /// Less memory for some speed.
    pub compact: bool,
}

impl Default for EmbreeOptions {
    fn default() -> Self {
        Self { quality: EmbreeQuality::Medium, robust: true, compact: false }
    }
}

/// What a scene makes Embree call back for, or keep beside triangles at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Registered {
    /// Meshes with a filter for holes or slivers.
    pub filters: usize,
    /// Analytic shapes.
    pub user_geometries: usize,
    /// Instances that move or stretch unevenly.
    pub entered_instances: usize,
    /// Positions of deforming meshes after the first.
    pub time_steps: usize,
}

/// An Embree scene over borrowed geometry.
///
/// With the robust flag no ray slips between the triangles of a closed mesh, and `t_min` and `t_max` are inclusive.
pub struct EmbreeAccel<'g> {
    // Dropped in this order: the scene inside refers to the user data, to the objects' scenes and to the device.
    tracer: Tracer,
    user_shapes: UserShapes,
    entered: UserInstances,
    _objects: Vec<Scene>,
    device: Device,
    geometry: &'g Geometry,
    bounds: Aabb,
    /// Whether rays of batches are traced one by one, which Embree does faster with curves (`docs/curves.md`).
    one_by_one: bool,
}

impl<'g> EmbreeAccel<'g> {
    /// Builds the accelerator with `threads` threads (0: all).
    ///
    /// # Errors
    /// If Embree reports an error, memory runs out, or an instance's transform has no inverse in `f32`.
    pub fn new(geometry: &'g Geometry, threads: usize) -> Result<Self> {
        Self::with_options(geometry, threads, EmbreeOptions::default())
    }

    /// [`new`](Self::new) with options.
    ///
    /// # Errors
    /// As there.
    pub fn with_options(geometry: &'g Geometry, threads: usize, options: EmbreeOptions) -> Result<Self> {
        Self::over(geometry, &geometry.world, threads, options)
    }

    /// [`with_options`](Self::with_options) over some of the shapes of the world, and all instances.
    pub(super) fn over(
        geometry: &'g Geometry,
        world_shapes: &[ShapeId],
        threads: usize,
        options: EmbreeOptions,
    ) -> Result<Self> {
        let gate = RayLimits::for_instances(&geometry.instances)?;
        let device = Device::new(threads)?;
        let user_shapes = UserShapes::new(geometry);
        let shapes = shape_handles(geometry, world_shapes, &device, &user_shapes)?;
        let objects = object_scenes(geometry, &device, &shapes, options)?;
        let entered = UserInstances::new(geometry, &objects);
        let mut world = SceneBuilder::new(&device, options)?;
        scene::attach_shapes(&mut world, &shapes, world_shapes, |_, id| id.index())?;
        attach_instances(&mut world, geometry, &device, &objects, &entered)?;
        // It must be dropped before the user data and the objects' scenes.
        let scene = world.commit()?;
        let tracer = Tracer { scene, gate, frusta: geometry.instances.is_empty(), cutouts: geometry.cutouts.clone() };
        let one_by_one = user_shapes.are_mostly_curves(geometry);
        let bounds = geometry.bounds();
        Ok(Self { tracer, user_shapes, entered, _objects: objects, device, geometry, bounds, one_by_one })
    }

    /// What Embree calls back for, or keeps beside triangles at rest.
    pub fn registered(&self) -> Registered {
        let [filters, user_geometries] = self.user_shapes.counts();
        let meshes = self
            .geometry
            .shapes
            .iter()
            .filter_map(|shape| if let Shape::Mesh(mesh) = shape { Some(mesh) } else { None });
        let time_steps = meshes.map(|mesh| mesh.padded_steps().count() - 1).sum();
        Registered { filters, user_geometries, entered_instances: self.entered.count(), time_steps }
    }

    /// Releases everything and returns how many bytes Embree still holds: none, if it works.
    pub fn release(self) -> isize {
        let memory = self.device.memory();
        drop(self);
        memory.bytes()
    }

    /// The hit in ids of [`Geometry`]: in the world a geometry's number is its shape's id, and instances follow the
    /// shapes; in an object it is the shape's place there.
    #[inline(always)]
    fn hit(&self, raw: StHit) -> Hit {
        let (shape, instance) = if raw.instance == INVALID {
            (ShapeId(raw.geometry), Hit::NO_INSTANCE)
        } else {
            self.instanced(raw.geometry, raw.instance)
        };
        Hit { t: raw.t, u: raw.u, v: raw.v, shape, prim: PrimId(raw.prim), instance }
    }

    /// The shape and the instance of a geometry and an instance as Embree numbers them.
    #[inline]
    fn instanced(&self, geometry: u32, instance: u32) -> (ShapeId, InstanceId) {
        let instance = InstanceId(instance - self.geometry.shapes.len() as u32);
        let object = self.geometry.object(self.geometry.instance(instance).object);
        (object.shapes[geometry as usize], instance)
    }

    /// Replaces Embree's numbers by ids of [`Geometry`] where a hit is within an instance.
    fn resolve_instances(&self, hits: &mut HitRows, count: usize) {
        for lane in 0..count {
            if hits.shape[lane] != HitRows::MISS && hits.instance[lane] != INVALID {
                let (shape, instance) = self.instanced(hits.shape[lane], hits.instance[lane]);
                (hits.shape[lane], hits.instance[lane]) = (shape.0, instance.0);
            }
        }
    }
}

/// One Embree geometry for each shape in use, in the world or in objects, however many share it.
fn shape_handles(
    geometry: &Geometry,
    world_shapes: &[ShapeId],
    device: &Device,
    user_shapes: &UserShapes,
) -> Result<Vec<Option<GeometryHandle>>> {
    let mut handles: Vec<Option<GeometryHandle>> = geometry.shapes.iter().map(|_| None).collect();
    let used = world_shapes.iter().chain(geometry.objects.iter().flat_map(|object| &object.shapes));
    for id in used {
        if handles[id.index()].is_none() {
            // SAFETY: the accelerator borrows the geometry and owns the user data, and drops its scene first.
            let handle = unsafe { GeometryHandle::of_shape(device, geometry.shape(*id), user_shapes.get(*id)) }?;
            handles[id.index()] = Some(handle);
        }
    }
    Ok(handles)
}

/// A committed scene for each object.
fn object_scenes(
    geometry: &Geometry,
    device: &Device,
    shapes: &[Option<GeometryHandle>],
    options: EmbreeOptions,
) -> Result<Vec<Scene>> {
    let object_scene = |ids: &[ShapeId]| -> Result<Scene> {
        let mut builder = SceneBuilder::new(device, options)?;
        scene::attach_shapes(&mut builder, shapes, ids, |position, _| position)?;
        builder.commit()
    };
    geometry.objects.iter().map(|object| object_scene(&object.shapes)).collect()
}

/// Attaches the instances, numbered after the shapes.
fn attach_instances(
    world: &mut SceneBuilder,
    geometry: &Geometry,
    device: &Device,
    objects: &[Scene],
    entered: &UserInstances,
) -> Result<()> {
    for (i, instance) in geometry.instances.iter().enumerate() {
        let handle = match entered.get(i) {
            None => GeometryHandle::of_instance(device, &objects[instance.object.index()], instance)?,
            // SAFETY: the accelerator borrows the geometry, owns the rest, and drops its scene first.
            Some(user) => unsafe { GeometryHandle::of_entered_instance(device, user) }?,
        };
        world.attach(&handle, geometry.shapes.len() + i)?;
    }
    Ok(())
}

impl Accelerator for EmbreeAccel<'_> {
    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.tracer.intersect(ray).map(|raw| self.hit(raw))
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.tracer.occluded(ray)
    }

    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        if self.one_by_one {
            return (0..count.min(BATCH)).for_each(|lane| hits.set(lane, self.intersect(&rays.get(lane))));
        }
        let mut packet = HitPacket::new();
        for first in (0..count.min(BATCH)).step_by(WIDTH) {
            packet.intersect(&self.tracer, rays, first..count.min(first + WIDTH), coherence);
            packet.read(hits, first);
        }
        if !self.geometry.instances.is_empty() {
            self.resolve_instances(hits, count);
        }
    }

    fn occluded_rows(&self, rays: AnyHitRays, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let AnyHitRays { rays, count, .. } = rays;
        if self.one_by_one {
            return (0..count.min(BATCH)).for_each(|lane| occluded[lane] = self.occluded(&rays.get(lane)));
        }
        let mut packet = ShadowPacket::new();
        for first in (0..count.min(BATCH)).step_by(WIDTH) {
            let lanes = first..count.min(first + WIDTH);
            let found = packet.occluded(&self.tracer, rays, lanes.clone(), coherence);
            occluded[lanes.clone()].copy_from_slice(&found[..lanes.len()]);
        }
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn memory_bytes(&self) -> usize {
        self.device.memory_bytes()
    }

    fn description(&self) -> String {
        let EmbreeInfo { version, isa } = self.device.info();
        format!("Embree {version} ({isa})")
    }
}
