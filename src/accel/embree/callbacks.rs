//! What Embree calls for analytic shapes: bounds, and the hit of one ray.

use std::ffi::c_void;

use super::sys;
use crate::geometry::Placed;
use crate::math::{Ray, vec3};

/// The user data of a shape for the shim.
///
/// The shape must stay where it is, unchanged, as long as Embree may call back.
pub fn user_shape(shape: &Placed) -> sys::StShape {
    sys::StShape { intersect: Some(intersect), shape: (&raw const *shape).cast() }
}

/// Distance of the first hit within the ray's interval, or a NaN.
unsafe extern "C" fn intersect(shape: *const c_void, ray: *const sys::StRay) -> f32 {
    // SAFETY: `shape` comes from `user_shape`, whose caller keeps it alive and unchanged.
    let shape = unsafe { &*shape.cast::<Placed>() };
    // SAFETY: the shim passes a pointer to a ray on its stack.
    let ray = unsafe { &*ray };
    let [ox, oy, oz] = ray.origin;
    let [dx, dy, dz] = ray.direction;
    let ray = Ray { origin: vec3(ox, oy, oz), t_min: ray.t_min, direction: vec3(dx, dy, dz), t_max: ray.t_max, time: ray.time };
    // Rounding to nearest must not leave the interval.
    shape.intersect(&ray).map_or(f32::NAN, |hit| (hit.t as f32).clamp(ray.t_min, ray.t_max))
}

/// Padded bounds of a shape. Embree's user pointer is the `StShape`.
pub unsafe extern "C" fn bounds(args: *const sys::RTCBoundsFunctionArguments) {
    // SAFETY: Embree passes valid arguments whose user pointer is the `StShape` given to `st_set_user_geometry`; its `shape` comes from
    // `user_shape`. The output is a valid place for one box.
    unsafe {
        let args = &*args;
        let user = &*args.geometryUserPtr.cast::<sys::StShape>();
        let bounds = (*user.shape.cast::<Placed>()).bounds().padded();
        *args.bounds_o = sys::RTCBounds {
            lower_x: bounds.min.x,
            lower_y: bounds.min.y,
            lower_z: bounds.min.z,
            align0: 0.0,
            upper_x: bounds.max.x,
            upper_y: bounds.max.y,
            upper_z: bounds.max.z,
            align1: 0.0,
        };
    }
}
