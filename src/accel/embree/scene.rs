//! Embree's scene: built by `&mut self`, then committed; a committed scene only answers queries.

use std::ptr;

use super::callbacks;
use super::device::Device;
use super::sys;
use crate::error::Result;
use crate::geometry::{Geometry, Instance, Mesh, Placed, Shape};
use crate::id::ShapeId;

/// A committed scene. It keeps the child scenes of its instances and the user data of its shapes alive, and refers to the buffers of the
/// geometry it was built from.
pub struct CommittedScene {
    handle: sys::RTCScene,
    /// Boxed, because Embree keeps their addresses.
    #[allow(clippy::vec_box)]
    _user_shapes: Vec<Box<sys::StShape>>,
    _children: Vec<CommittedScene>,
}

// SAFETY: after the commit a scene only answers queries, which Embree documents as thread-safe; the pointers it holds refer to data that
// nobody changes.
unsafe impl Send for CommittedScene {}
// SAFETY: as above.
unsafe impl Sync for CommittedScene {}

impl CommittedScene {
    /// The handle, for queries.
    #[inline]
    pub fn handle(&self) -> sys::RTCScene {
        self.handle
    }
}

impl Drop for CommittedScene {
    fn drop(&mut self) {
        // SAFETY: the handle is live and this is its last use; Embree keeps child scenes alive by counting references.
        unsafe { sys::rtcReleaseScene(self.handle) };
    }
}

/// The whole geometry as a committed scene, with one child scene for each object.
///
/// Shapes keep their ids; instance `i` has the id `shapes + i`. The geometry must outlive the scene and must not change.
pub fn build(device: &Device, geometry: &Geometry) -> Result<CommittedScene> {
    let mut children = Vec::with_capacity(geometry.objects.len());
    for object in &geometry.objects {
        let mut builder = Builder::new(device);
        for &id in &object.shapes {
            builder.attach_shape(id, geometry.shape(id));
        }
        children.push(builder.commit(Vec::new())?);
    }
    let mut top = Builder::new(device);
    for &id in &geometry.world {
        top.attach_shape(id, geometry.shape(id));
    }
    for (i, instance) in geometry.instances.iter().enumerate() {
        top.attach_instance(ShapeId::new(geometry.shapes.len() + i), instance, &children[instance.object.index()]);
    }
    top.commit(children)
}

struct Builder<'d> {
    device: &'d Device,
    handle: sys::RTCScene,
    #[allow(clippy::vec_box)]
    user_shapes: Vec<Box<sys::StShape>>,
}

impl<'d> Builder<'d> {
    fn new(device: &'d Device) -> Self {
        // SAFETY: the device is live. A failure gives a null scene, which the calls below report through the device's error callback.
        let handle = unsafe {
            let handle = sys::rtcNewScene(device.handle());
            sys::rtcSetSceneFlags(handle, sys::RTCSceneFlags::RTC_SCENE_FLAG_ROBUST);
            handle
        };
        Self { device, handle, user_shapes: Vec::new() }
    }

    fn attach_shape(&mut self, id: ShapeId, shape: &Shape) {
        match shape {
            Shape::Mesh(mesh) => self.attach_mesh(id, mesh),
            Shape::Analytic(placed) => self.attach_analytic(id, placed),
        }
    }

    fn attach_mesh(&mut self, id: ShapeId, mesh: &Mesh) {
        let positions = mesh.padded_positions();
        let triangles = mesh.triangles();
        // SAFETY: the buffers belong to the borrowed geometry, which outlives the scene; their lengths and strides are as stated, and the
        // position buffer has one vertex of padding behind the last that is declared.
        unsafe {
            let geometry = sys::rtcNewGeometry(self.device.handle(), sys::RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE);
            sys::rtcSetSharedGeometryBuffer(
                geometry,
                sys::RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
                0,
                sys::RTCFormat::RTC_FORMAT_FLOAT3,
                positions.as_ptr().cast(),
                0,
                size_of::<[f32; 3]>(),
                positions.len() - 1,
            );
            sys::rtcSetSharedGeometryBuffer(
                geometry,
                sys::RTCBufferType::RTC_BUFFER_TYPE_INDEX,
                0,
                sys::RTCFormat::RTC_FORMAT_UINT3,
                triangles.as_ptr().cast(),
                0,
                size_of::<[u32; 3]>(),
                triangles.len(),
            );
            self.attach(geometry, id.0);
        }
    }

    fn attach_analytic(&mut self, id: ShapeId, placed: &Placed) {
        let user = Box::new(callbacks::user_shape(placed));
        // SAFETY: the boxed user data is kept by the scene; the shape it names belongs to the borrowed geometry, which outlives the scene.
        unsafe {
            let geometry = sys::rtcNewGeometry(self.device.handle(), sys::RTCGeometryType::RTC_GEOMETRY_TYPE_USER);
            sys::st_set_user_geometry(geometry, &raw const *user, Some(callbacks::bounds));
            self.attach(geometry, id.0);
        }
        self.user_shapes.push(user);
    }

    fn attach_instance(&mut self, id: ShapeId, instance: &Instance, child: &CommittedScene) {
        let columns = instance.transform.world_from_object.to_cols_array().map(|x| x as f32);
        // SAFETY: the child scene is committed and live; Embree copies the twelve numbers.
        unsafe {
            let geometry = sys::rtcNewGeometry(self.device.handle(), sys::RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE);
            sys::rtcSetGeometryInstancedScene(geometry, child.handle);
            sys::rtcSetGeometryTimeStepCount(geometry, 1);
            sys::rtcSetGeometryTransform(geometry, 0, sys::RTCFormat::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.as_ptr().cast());
            self.attach(geometry, id.0);
        }
    }

    /// Commits the geometry and hands it over to the scene under the given id.
    ///
    /// # Safety
    /// `geometry` is a new geometry of this builder's device with all its data set.
    unsafe fn attach(&mut self, geometry: sys::RTCGeometry, id: u32) {
        // SAFETY: by the contract above; the scene holds its own reference, so ours is released.
        unsafe {
            sys::rtcCommitGeometry(geometry);
            sys::rtcAttachGeometryByID(self.handle, geometry, id);
            sys::rtcReleaseGeometry(geometry);
        }
    }

    fn commit(mut self, children: Vec<CommittedScene>) -> Result<CommittedScene> {
        // SAFETY: the scene is complete, and nobody else uses it yet.
        unsafe { sys::rtcCommitScene(self.handle) };
        let committed = CommittedScene {
            handle: std::mem::replace(&mut self.handle, ptr::null_mut()),
            _user_shapes: std::mem::take(&mut self.user_shapes),
            _children: children,
        };
        self.device.check()?;
        Ok(committed)
    }
}

impl Drop for Builder<'_> {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // SAFETY: the scene was not handed over, so this is its last use.
            unsafe { sys::rtcReleaseScene(self.handle) };
        }
    }
}
