//! From borrowed geometry to a committed Embree scene. A [`SceneBuilder`] takes geometries; [`SceneBuilder::commit`]
//! consumes it and only the committed [`Scene`] can be traced.

use std::ffi::c_void;
use std::ptr::NonNull;

use super::callbacks::{
    Filter, counts, enter_instance, intersect_cutout, intersect_placed, intersect_placed_packet, intersect_primitive,
    primitive_bounds,
};
use super::device::Device;
use super::{EmbreeOptions, EmbreeQuality, sys};
use crate::error::{Error, Result};
use crate::geometry::{CurveBasis, Curves, Geometry, Instance, Mesh, Shape};
use crate::id::ShapeId;
use crate::math::Aabb;

/// Hits with curves that are closer to the origin of a ray than so many radii are confirmed in `f64`.
const CONFIRMED_RADII: f32 = 4.0;

/// What Embree's callbacks need of one shape. Embree keeps addresses of it.
pub(super) enum UserData {
    /// Triangles of which every hit counts.
    Triangles,
    /// Triangles with holes or slivers.
    FilteredTriangles(sys::StFilter, #[allow(dead_code)] Box<Filter>),
    /// An analytic shape, with its own data where it has holes.
    Analytic(sys::StUserShape, #[allow(dead_code)] Option<Box<Filter>>),
    /// Curves or points.
    Primitives(sys::StUserPrimitives, #[allow(dead_code)] Box<Filter>),
    /// Curves that Embree intersects.
    Curves(sys::StCurves, #[allow(dead_code)] Box<Filter>),
}

impl UserData {
    /// That of curves or points.
    fn of_primitives(shape: &Shape, has_holes: bool, filter: Box<Filter>) -> Self {
        let primitives = sys::StUserPrimitives {
            shape: std::ptr::from_ref(&*filter).cast::<c_void>(),
            count: shape.prim_count() as u32,
            intersect: Some(intersect_primitive),
            bounds: Some(primitive_bounds),
        };
        match shape {
            Shape::Curves(curves) if !has_holes && curves.is_swept_disk() => {
                Self::Curves(sys::StCurves { primitives, reach: CONFIRMED_RADII * curves.max_radius() }, filter)
            }
            _ => Self::Primitives(primitives, filter),
        }
    }
}

/// The user data of every shape, by [`ShapeId`].
pub(super) struct UserShapes(Vec<UserData>);

// SAFETY: the pointers inside lead to the geometry, which is `Send` and `Sync`, and are only read through.
unsafe impl Send for UserShapes {}
// SAFETY: as above.
unsafe impl Sync for UserShapes {}

impl UserShapes {
    /// The table for `geometry`.
    pub(super) fn new(geometry: &Geometry) -> Self {
        let of = |(i, shape): (usize, &Shape)| {
            let id = ShapeId::new(i);
            let has_holes = geometry.cutouts.has_holes(id);
            let has_slivers = matches!(shape, Shape::Mesh(mesh) if mesh.has_slivers());
            let filter = (has_holes || has_slivers).then(|| Box::new(Filter::new(geometry, id)));
            match (shape, filter) {
                (Shape::Mesh(_), None) => UserData::Triangles,
                (Shape::Mesh(_), Some(filter)) => {
                    // Closest hits are confirmed by the caller.
                    let user = std::ptr::from_ref(&*filter).cast::<c_void>();
                    let raw = sys::StFilter { user, counts: Some(counts), any_hit_only: !has_holes };
                    UserData::FilteredTriangles(raw, filter)
                }
                (Shape::Analytic(placed), filter) => {
                    let Aabb { min, max } = placed.bounds().padded();
                    let (lower, upper) = (min.to_array(), max.to_array());
                    let raw = match &filter {
                        None => {
                            let shape = std::ptr::from_ref(placed).cast::<c_void>();
                            let intersect_packet = placed.intersects_packets().then_some(intersect_placed_packet as _);
                            sys::StUserShape {
                                shape,
                                intersect: Some(intersect_placed),
                                intersect_packet,
                                lower,
                                upper,
                            }
                        }
                        Some(filter) => {
                            let shape = std::ptr::from_ref(&**filter).cast::<c_void>();
                            sys::StUserShape {
                                shape,
                                intersect: Some(intersect_cutout),
                                intersect_packet: None,
                                lower,
                                upper,
                            }
                        }
                    };
                    UserData::Analytic(raw, filter)
                }
                (Shape::Curves(_) | Shape::Points(_), filter) => {
                    let filter = filter.unwrap_or_else(|| Box::new(Filter::new(geometry, id)));
                    UserData::of_primitives(shape, has_holes, filter)
                }
            }
        };
        Self(geometry.shapes.iter().enumerate().map(of).collect())
    }

    /// How many shapes have filters, and how many are user geometries.
    pub(super) fn counts(&self) -> [usize; 2] {
        let count = |of: fn(&UserData) -> bool| self.0.iter().filter(|data| of(data)).count();
        [
            count(|data| matches!(data, UserData::FilteredTriangles(..))),
            count(|data| matches!(data, UserData::Analytic(..) | UserData::Primitives(..))),
        ]
    }

    /// Whether more than half of all primitives are curves that Embree intersects.
    pub(super) fn are_mostly_curves(&self, geometry: &Geometry) -> bool {
        let is_native = |data: &UserData| matches!(data, UserData::Curves(..));
        let (all, curves) = self.0.iter().zip(&geometry.shapes).fold((0, 0), |(all, curves), (data, shape)| {
            let count = shape.prim_count();
            (all + count, curves + if is_native(data) { count } else { 0 })
        });
        2 * curves > all
    }

    /// The entry of one shape.
    pub(super) fn get(&self, id: ShapeId) -> &UserData {
        &self.0[id.index()]
    }
}

/// The user data of the instances that move or stretch unevenly, into whose space we move the rays ourselves; the
/// others have none. Embree keeps addresses into it.
pub(super) struct UserInstances(Vec<Option<sys::StEnteredInstance>>);

// SAFETY: the pointers inside lead to the geometry and to Embree's scenes, and are only read through, which both allow
// from any thread.
unsafe impl Send for UserInstances {}
// SAFETY: as above.
unsafe impl Sync for UserInstances {}

impl UserInstances {
    /// The table for `geometry`, over the committed scenes of its objects, which must live as long.
    pub(super) fn new(geometry: &Geometry, objects: &[Scene]) -> Self {
        let of = |instance: &Instance| {
            if instance.motion.is_none() && !instance.is_uneven() {
                return None;
            }
            let object = geometry.object(instance.object);
            let inside = object.shapes.iter().fold(Aabb::EMPTY, |b, &id| b.union(&geometry.shape(id).bounds()));
            let Aabb { min, max } = instance.bounds(&inside);
            Some(sys::StEnteredInstance {
                instance: std::ptr::from_ref(instance).cast::<c_void>(),
                enter: Some(enter_instance),
                object: objects[instance.object.index()].handle(),
                lower: min.to_array(),
                upper: max.to_array(),
            })
        };
        Self(geometry.instances.iter().map(of).collect())
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.0.iter().flatten().count()
    }

    /// The entry of one instance.
    pub(super) fn get(&self, index: usize) -> Option<&sys::StEnteredInstance> {
        self.0[index].as_ref()
    }
}

/// An Embree geometry, released on drop; scenes it is attached to keep it alive.
pub(super) struct GeometryHandle(NonNull<sys::RTCGeometryTy>);

impl GeometryHandle {
    fn new(device: &Device, handle: sys::RTCGeometry) -> Result<Self> {
        NonNull::new(handle).map(Self).ok_or_else(|| no_object(device, "geometry"))
    }

    /// The committed geometry of a shape.
    ///
    /// # Safety
    /// The shape and its user data must outlive every scene the geometry is attached to, and must not move.
    pub(super) unsafe fn of_shape(device: &Device, shape: &Shape, user: &UserData) -> Result<Self> {
        match (shape, user) {
            // SAFETY: the caller keeps the mesh alive.
            (Shape::Mesh(mesh), UserData::Triangles) => unsafe { Self::of_mesh(device, mesh, None) },
            // SAFETY: the caller keeps the mesh and the user data alive.
            (Shape::Mesh(mesh), UserData::FilteredTriangles(filter, _)) => unsafe {
                Self::of_mesh(device, mesh, Some(filter))
            },
            (Shape::Analytic(_), UserData::Analytic(user, _)) => {
                // SAFETY: the device is alive; the caller keeps the user data alive.
                let handle = unsafe { sys::st_new_user_geometry(device.handle(), user) };
                Self::new(device, handle)
            }
            (Shape::Curves(_) | Shape::Points(_), UserData::Primitives(user, _)) => {
                // SAFETY: the device is alive; the caller keeps the user data and the geometry alive.
                let handle = unsafe { sys::st_new_user_primitives(device.handle(), user) };
                Self::new(device, handle)
            }
            // SAFETY: the caller keeps the curves and the user data alive.
            (Shape::Curves(curves), UserData::Curves(user, _)) => unsafe { Self::of_curves(device, curves, user) },
            _ => Err(Error::Internal("user data of another shape".into())),
        }
    }

    /// Triangles on the mesh's own buffers.
    ///
    /// # Safety
    /// As for [`of_shape`](Self::of_shape).
    unsafe fn of_mesh(device: &Device, mesh: &Mesh, filter: Option<&sys::StFilter>) -> Result<Self> {
        // SAFETY: the device is alive.
        let handle = unsafe { sys::rtcNewGeometry(device.handle(), sys::RTC_GEOMETRY_TYPE_TRIANGLE) };
        let this = Self::new(device, handle)?;
        // SAFETY: all buffers hold as many items of that format as are announced; 16 bytes may be read of the last
        // position, since the mesh keeps one more behind it; Embree only reads them, and the caller keeps them alive.
        unsafe {
            sys::rtcSetGeometryTimeStepCount(handle, mesh.padded_steps().count() as u32);
            for (step, positions) in (0..).zip(mesh.padded_steps()) {
                let positions = &positions[..positions.len() - 1];
                this.share(sys::RTC_BUFFER_TYPE_VERTEX, step, sys::RTC_FORMAT_FLOAT3, positions);
            }
            this.share(sys::RTC_BUFFER_TYPE_INDEX, 0, sys::RTC_FORMAT_UINT3, mesh.triangles());
            if let Some(filter) = filter {
                sys::st_set_filter(handle, filter);
            }
            sys::rtcCommitGeometry(handle);
        }
        Ok(this)
    }

    /// Curves on their own buffers.
    ///
    /// # Safety
    /// As for [`of_shape`](Self::of_shape).
    unsafe fn of_curves(device: &Device, curves: &Curves, user: &sys::StCurves) -> Result<Self> {
        let kind = match curves.basis() {
            CurveBasis::Bezier => sys::RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE,
            CurveBasis::BSpline => sys::RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE,
            CurveBasis::CatmullRom => sys::RTC_GEOMETRY_TYPE_ROUND_CATMULL_ROM_CURVE,
            CurveBasis::Linear => return Err(Error::Internal("curves without tangents".into())),
        };
        // SAFETY: the device is alive.
        let handle = unsafe { sys::rtcNewGeometry(device.handle(), kind) };
        let this = Self::new(device, handle)?;
        // SAFETY: as in `of_mesh`; items of 16 and of 4 bytes are read whole.
        unsafe {
            this.share(sys::RTC_BUFFER_TYPE_VERTEX, 0, sys::RTC_FORMAT_FLOAT4, curves.points());
            this.share(sys::RTC_BUFFER_TYPE_INDEX, 0, sys::RTC_FORMAT_UINT, curves.first_points());
            sys::st_set_curve_filter(handle, user);
            sys::rtcCommitGeometry(handle);
        }
        Ok(this)
    }

    /// Shares items, of which Embree reads those of `format` at the size of `T` from each other.
    ///
    /// # Safety
    /// They must be of that format, and must outlive the geometry.
    unsafe fn share<T>(&self, kind: sys::RTCBufferType, slot: u32, format: sys::RTCFormat, items: &[T]) {
        let (data, size) = (items.as_ptr().cast(), size_of::<T>());
        // SAFETY: the handle is alive; the rest is guaranteed by the caller.
        unsafe { sys::rtcSetSharedGeometryBuffer(self.0.as_ptr(), kind, slot, format, data, 0, size, items.len()) }
    }

    /// The committed geometry of an instance into whose space we move the rays.
    ///
    /// # Safety
    /// The user data, the instance and the scene it names must outlive every scene the geometry is attached to, and
    /// must not move.
    pub(super) unsafe fn of_entered_instance(device: &Device, user: &sys::StEnteredInstance) -> Result<Self> {
        // SAFETY: the device is alive; the caller keeps the rest alive.
        let handle = unsafe { sys::st_new_entered_instance(device.handle(), user) };
        Self::new(device, handle)
    }

    /// The committed geometry of an instance of `object` at rest.
    pub(super) fn of_instance(device: &Device, object: &Scene, instance: &Instance) -> Result<Self> {
        // SAFETY: the device is alive.
        let handle = unsafe { sys::rtcNewGeometry(device.handle(), sys::RTC_GEOMETRY_TYPE_INSTANCE) };
        let this = Self::new(device, handle)?;
        let map = &instance.transform.world_from_object;
        let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation]
            .map(|c| c.as_vec3().to_array());
        // SAFETY: both handles are alive, the geometry keeps the object's scene alive, and Embree copies the twelve
        // floats.
        unsafe {
            sys::rtcSetGeometryInstancedScene(handle, object.handle());
            sys::rtcSetGeometryTransform(handle, 0, sys::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.as_ptr().cast());
            sys::rtcCommitGeometry(handle);
        }
        Ok(this)
    }
}

impl Drop for GeometryHandle {
    fn drop(&mut self) {
        // SAFETY: gives back the one reference this handle owns.
        unsafe { sys::rtcReleaseGeometry(self.0.as_ptr()) }
    }
}

/// A scene that takes geometries and cannot be traced yet.
pub(super) struct SceneBuilder<'d> {
    device: &'d Device,
    scene: Scene,
}

impl<'d> SceneBuilder<'d> {
    /// An empty scene.
    pub(super) fn new(device: &'d Device, options: EmbreeOptions) -> Result<Self> {
        // SAFETY: the device is alive.
        let handle = unsafe { sys::rtcNewScene(device.handle()) };
        let scene = NonNull::new(handle).map(Scene).ok_or_else(|| no_object(device, "scene"))?;
        // Without the robust flag one ray in ten slips through the edges of a distant mesh.
        let robust = if options.robust { sys::RTC_SCENE_FLAG_ROBUST } else { sys::RTC_SCENE_FLAG_NONE };
        let compact = if options.compact { sys::RTC_SCENE_FLAG_COMPACT } else { sys::RTC_SCENE_FLAG_NONE };
        let quality = match options.quality {
            EmbreeQuality::Low => sys::RTC_BUILD_QUALITY_LOW,
            EmbreeQuality::Medium => sys::RTC_BUILD_QUALITY_MEDIUM,
            EmbreeQuality::High => sys::RTC_BUILD_QUALITY_HIGH,
        };
        // SAFETY: the scene is alive.
        unsafe {
            sys::rtcSetSceneFlags(handle, robust | compact);
            sys::rtcSetSceneBuildQuality(handle, quality);
        }
        Ok(Self { device, scene })
    }

    /// Adds a geometry under a number that no other has; hits name it. Embree's tables grow with the largest number.
    pub(super) fn attach(&mut self, geometry: &GeometryHandle, number: usize) -> Result<()> {
        let number = u32::try_from(number).map_err(|_| Error::Embree("too many shapes and instances".into()))?;
        // SAFETY: both handles are alive; the scene takes a reference of its own.
        unsafe { sys::rtcAttachGeometryByID(self.scene.handle(), geometry.0.as_ptr(), number) };
        Ok(())
    }

    /// Builds the acceleration structure.
    ///
    /// # Errors
    /// The first error that the device has reported.
    pub(super) fn commit(self) -> Result<Scene> {
        self.device.check()?;
        // SAFETY: the scene is alive and this builder is its only user.
        unsafe { sys::rtcCommitScene(self.scene.handle()) };
        self.device.check()?;
        Ok(self.scene)
    }
}

/// A committed scene, released on drop.
pub(super) struct Scene(NonNull<sys::RTCSceneTy>);

// SAFETY: a committed scene is only traced, which Embree allows from any number of threads at once, and at last
// released, by its owner.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Scene {
    #[inline]
    pub(super) fn handle(&self) -> sys::RTCScene {
        self.0.as_ptr()
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: gives back the one reference this scene owns; nobody traces it any more.
        unsafe { sys::rtcReleaseScene(self.handle()) }
    }
}

/// The message of a failed creation: the device's error, or at least what is missing.
fn no_object(device: &Device, what: &str) -> Error {
    device.check().err().unwrap_or_else(|| Error::Embree(format!("no {what} could be created")))
}

/// Fills a scene with shapes: each under the number that `number` gives it.
pub(super) fn attach_shapes(
    builder: &mut SceneBuilder,
    shapes: &[Option<GeometryHandle>],
    ids: &[ShapeId],
    number: impl Fn(usize, ShapeId) -> usize,
) -> Result<()> {
    for (position, &id) in ids.iter().enumerate() {
        if let Some(geometry) = &shapes[id.index()] {
            builder.attach(geometry, number(position, id))?;
        }
    }
    Ok(())
}
