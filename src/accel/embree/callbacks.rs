//! What Embree calls: with errors, with changes of memory, and to intersect a shape. None of these may panic; a panic would abort.

use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::Ordering;

use super::device::Monitor;
use super::sys;
use crate::geometry::Placed;
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

/// Counts bytes; called from all building threads at once. An allocation is never refused.
pub(super) unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: as in `on_error`.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    monitor.bytes.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// The distance at which `ray` hits the [`Placed`] behind `shape`; negative on a miss.
pub(super) unsafe extern "C" fn intersect_placed(shape: *const c_void, ray: *const sys::StRay) -> f32 {
    // SAFETY: `shape` was made from a `&Placed` inside the geometry that the accelerator borrows, and `Placed` is not changed by anyone;
    // `ray` points to a ray on the shim's stack, and `StRay` has the layout of `Ray`.
    let (placed, ray) = unsafe { (&*shape.cast::<Placed>(), &*ray.cast::<Ray>()) };
    // Rounding to f32 keeps the order, so the result stays within the ray's interval.
    placed.intersect(ray).map_or(-1.0, |hit| hit.t as f32)
}
