//! Planes without end: squares that reach far beyond everything else.

use super::CompileContext;
use crate::desc::{PlaneDesc, ShapeCommon};
use crate::error::Result;
use crate::geometry::Quad;
use crate::math::{Bounds, DAffine3, DVec3};

/// How many times as far a plane reaches as everything else: the horizon is off by a hundredth of a degree, and nothing
/// comes near the limits of 32-bit numbers.
const REACH: f64 = 1e4;

/// A plane of the scene file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    point: DVec3,
    /// Unit length.
    normal: DVec3,
}

/// Checks a plane.
pub(super) fn compile(files: &CompileContext, path: &str, desc: &PlaneDesc, common: &ShapeCommon) -> Result<Plane> {
    if common.emission.is_some() {
        return Err(files.error(
            &format!("{path}.emission"),
            "a plane cannot emit light: its area, which would be sampled, has no end; use a quad",
        ));
    }
    if !common.motion.is_empty() {
        return Err(files.error(&format!("{path}.motion"), "a plane cannot move; use a quad"));
    }
    if path.starts_with("objects.") {
        return Err(files.error(
            path,
            "a plane cannot be part of an object, whose instances have bounds; put it into the `shapes` of the scene",
        ));
    }
    let point = files.vector(&format!("{path}.point"), desc.point)?;
    Ok(Plane { point, normal: files.direction(&format!("{path}.normal"), desc.normal)? })
}

/// The part of a plane that reaches [`REACH`] times as far as a box in the world, as a parallelogram in the plane's own
/// space. `map` is regular; `None` if the numbers become too large.
pub(super) fn square(plane: &Plane, map: &DAffine3, surroundings: &Bounds) -> Option<Quad> {
    let Plane { point, normal } = *plane;
    let (center, radius) =
        (0.5 * (surroundings.min + surroundings.max), 0.5 * (surroundings.max - surroundings.min).length());
    let axis = if normal.x.abs() > 0.1 { DVec3::Y } else { DVec3::X };
    let u = axis.cross(normal).normalize();
    let v = normal.cross(u);
    // Where the sphere's centre is above the plane, and how far.
    let (a, b) = (map.transform_vector3(u), map.transform_vector3(v));
    let world_normal = a.cross(b).normalize();
    let distance = world_normal.dot(center - map.transform_point3(point));
    let below = map.inverse().transform_point3(center - world_normal * distance) - point;
    let reach = radius + distance.abs();
    let reach = REACH * if reach > 0.0 { reach } else { 1.0 };
    // The parallelogram's edges are this far from its middle.
    let sine = a.cross(b).length() / (a.length() * b.length());
    let half = [a, b].map(|edge| reach / (edge.length() * sine));
    let low = [below.dot(u) - half[0], below.dot(v) - half[1]];
    let size = half.map(|half| 2.0 * half);
    if !(0..2).all(|k| (low[k].abs() + size[k]) < f64::from(f32::MAX)) {
        return None;
    }
    let quad = Quad::new(point + u * low[0] + v * low[1], u * size[0], v * size[1]).ok()?;
    Some(quad.with_uv(low, size))
}
