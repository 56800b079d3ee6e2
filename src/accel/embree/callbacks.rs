//! What Embree calls: with errors, with changes of memory, and to intersect a shape. None of these may panic; a panic
//! would abort.

use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::Ordering;

use super::device::Monitor;
use super::gate::{RayLimits, RayWords};
use super::packet::INVALID;
use super::sys;
use crate::geometry::{Geometry, Hit, Instance, PACKET_SIZE, RayPacket, Shape, TransformedShape};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::Ray;

// `StRay` is `Ray` under its C name.
const _: () = {
    assert!(size_of::<sys::StRay>() == size_of::<Ray>() && align_of::<sys::StRay>() == align_of::<Ray>());
    assert!(std::mem::offset_of!(sys::StRay, t_min) == std::mem::offset_of!(Ray, t_min));
    assert!(std::mem::offset_of!(sys::StRay, direction) == std::mem::offset_of!(Ray, direction));
    assert!(std::mem::offset_of!(sys::StRay, t_max) == std::mem::offset_of!(Ray, t_max));
    assert!(std::mem::offset_of!(sys::StRay, time) == std::mem::offset_of!(Ray, time));
};

/// Keeps the first error.
pub(super) unsafe extern "C" fn on_error(user: *mut c_void, code: sys::RTCError, message: *const c_char) {
    // SAFETY: `user` is the monitor that the device was given, alive as long as the device.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    let message = if message.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a C string that lives through this call.
        unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned()
    };
    // A second error is a consequence of the first.
    let _ = monitor.first_error.set((code, message));
}

/// Counts bytes; called from all building threads at once. An allocation is never rejected.
pub(super) unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: as in `on_error`.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    monitor.bytes.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// The distance at which `ray` hits the [`TransformedShape`] behind `shape`; negative on a miss.
pub(super) unsafe extern "C" fn intersect_placed(
    shape: *const c_void,
    ray: *const sys::StRay,
    _key: u32,
    _instance: u32,
) -> f32 {
    // SAFETY: `shape` was made from a `&TransformedShape` inside the geometry that the accelerator borrows, which
    // nobody changes; `ray` points to a ray on the shim's stack, and `StRay` has the layout of `Ray`.
    let (placed, ray) = unsafe { (&*shape.cast::<TransformedShape>(), &*ray.cast::<Ray>()) };
    // Rounding to f32 keeps the order, so the result stays within the ray's interval.
    placed.intersect(ray).map_or(-1.0, |hit| hit.t as f32)
}

/// [`intersect_placed`] for the rays of a packet.
pub(super) unsafe extern "C" fn intersect_placed_packet(
    shape: *const c_void,
    rays: *const f32,
    n: u32,
    valid: *const i32,
    t: *mut f32,
) {
    let n = n as usize;
    // SAFETY: the shape as in `intersect_placed`; the shim passes `n` lanes, at most a packet's, of rays in nine rows
    // and more, and of `valid`, and room for the distances of a packet. Every bit pattern is a number.
    let (placed, words, valid, t) = unsafe {
        let words = std::slice::from_raw_parts(rays, ROWS * n);
        (
            &*shape.cast::<TransformedShape>(),
            words,
            std::slice::from_raw_parts(valid, n),
            &mut *t.cast::<[f32; PACKET_SIZE]>(),
        )
    };
    let row = |k: usize| {
        let mut row = [0.0; PACKET_SIZE];
        row[..n].copy_from_slice(&words[k * n..(k + 1) * n]);
        row
    };
    let rays = RayPacket {
        origin: [row(0), row(1), row(2)],
        t_min: row(3),
        direction: [row(4), row(5), row(6)],
        t_max: row(8),
    };
    let hits = placed.intersect_packet(&rays);
    *t = hits.t;
    for lane in (0..n).filter(|&lane| valid[lane] != 0 && hits.is_undecided[lane] != 0) {
        t[lane] = placed.intersect(&rays.get(lane)).map_or(-1.0, |hit| hit.t as f32);
    }
}

/// Rows of a packet up to the end of the rays' intervals: origin, start, direction, time, end.
const ROWS: usize = 9;

/// Writes `ray` in the space of the [`Instance`] behind `instance`; false if it cannot be traced there.
pub(super) unsafe extern "C" fn enter_instance(
    instance: *const c_void,
    ray: *const sys::StRay,
    inside: *mut sys::StRay,
) -> bool {
    // SAFETY: `instance` was made from a `&Instance` inside the geometry that the accelerator borrows; both rays are on
    // the shim's stack, and `StRay` has the layout of `Ray`.
    let (instance, ray) = unsafe { (&*instance.cast::<Instance>(), &*ray.cast::<Ray>()) };
    let local = instance.object_ray(ray);
    // SAFETY: as above; every bit pattern is a `Ray`.
    unsafe { inside.cast::<Ray>().write(local) };
    RayLimits::OPEN.accepts(&RayWords::new(&local))
}

/// A shape with holes, slivers or many primitives, as the user data of its geometry.
pub(super) struct Filter {
    geometry: *const Geometry,
    shape: ShapeId,
}

impl Filter {
    /// The user data of a shape of `geometry`.
    pub(super) fn new(geometry: &Geometry, shape: ShapeId) -> Self {
        Self { geometry, shape }
    }

    /// # Safety
    /// The geometry must be alive.
    unsafe fn geometry(&self) -> &Geometry {
        // SAFETY: guaranteed by the caller.
        unsafe { &*self.geometry }
    }

    /// The [`InstanceId`] of Embree's instance number: instances follow the shapes.
    fn instance(geometry: &Geometry, number: u32) -> InstanceId {
        if number == INVALID { Hit::NO_INSTANCE } else { InstanceId(number - geometry.shapes.len() as u32) }
    }
}

/// As [`intersect_placed`] for the [`Filter`] of an analytic shape: hits in its holes do not count.
pub(super) unsafe extern "C" fn intersect_cutout(
    filter: *const c_void,
    ray: *const sys::StRay,
    key: u32,
    instance: u32,
) -> f32 {
    // SAFETY: `filter` was made from a `&Filter` that the accelerator owns; the ray as in `intersect_placed`.
    let (filter, ray) = unsafe { (&*filter.cast::<Filter>(), &*ray.cast::<Ray>()) };
    // SAFETY: the accelerator borrows the geometry.
    let geometry = unsafe { filter.geometry() };
    let instance = Filter::instance(geometry, instance);
    geometry.intersect_prim(ray, key, filter.shape, PrimId(0), instance).map_or(-1.0, |hit| hit.t)
}

/// As [`intersect_cutout`] for one primitive of the [`Filter`] of a shape that has many.
pub(super) unsafe extern "C" fn intersect_primitive(
    filter: *const c_void,
    prim: u32,
    ray: *const sys::StRay,
    key: u32,
    instance: u32,
) -> f32 {
    // SAFETY: as in `intersect_cutout`.
    let (filter, ray) = unsafe { (&*filter.cast::<Filter>(), &*ray.cast::<Ray>()) };
    // SAFETY: the accelerator borrows the geometry.
    let geometry = unsafe { filter.geometry() };
    let instance = Filter::instance(geometry, instance);
    geometry.intersect_prim(ray, key, filter.shape, PrimId(prim), instance).map_or(-1.0, |hit| hit.t)
}

/// Writes the bounds of one primitive of the [`Filter`] of a shape that has many.
pub(super) unsafe extern "C" fn primitive_bounds(filter: *const c_void, prim: u32, lower: *mut f32, upper: *mut f32) {
    // SAFETY: as in `intersect_cutout`; the shim passes room for three numbers each.
    let (filter, lower, upper) =
        unsafe { (&*filter.cast::<Filter>(), &mut *lower.cast::<[f32; 3]>(), &mut *upper.cast::<[f32; 3]>()) };
    // SAFETY: the accelerator borrows the geometry.
    let bounds = unsafe { filter.geometry() }.shape(filter.shape).prim_bounds(PrimId(prim));
    (*lower, *upper) = (bounds.min.to_array(), bounds.max.to_array());
}

/// Whether a hit of a triangle of the [`Filter`] behind `user` counts.
pub(super) unsafe extern "C" fn counts(
    user: *const c_void,
    ray: *const sys::StRay,
    key: u32,
    hit: *const sys::StHit,
) -> bool {
    // SAFETY: as in `intersect_cutout`; `hit` points to a hit on the shim's stack.
    let (filter, ray, hit) = unsafe { (&*user.cast::<Filter>(), &*ray.cast::<Ray>(), &*hit) };
    // SAFETY: the accelerator borrows the geometry.
    let geometry = unsafe { filter.geometry() };
    let prim = PrimId(hit.prim);
    if let Shape::Mesh(mesh) = geometry.shape(filter.shape)
        && mesh.has_slivers()
        && !mesh.confirms_hit(prim, ray)
    {
        return false;
    }
    let instance = Filter::instance(geometry, hit.instance);
    let hit = Hit { t: hit.t, u: hit.u, v: hit.v, shape: filter.shape, prim, instance };
    geometry.cutouts.counts(&geometry.shapes, key, ray, &hit)
}
