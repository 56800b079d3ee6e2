//! Analytic shapes: parameters in degrees to surfaces.

use super::CompileContext;
use crate::desc::{ProfileDesc, ProfileParameterDesc, ShapeDesc};
use crate::error::Result;
use crate::geometry::{Analytic, Disk, Frustum, Profile, ProfileParameter, Quad, Revolution, ShapeError, Sphere};

/// The analytic surface of a shape; `None` for meshes, cubes, curves, points, and planes (whose extent depends on the
/// scene).
pub fn compile(files: &CompileContext, path: &str, desc: &ShapeDesc) -> Result<Option<Analytic>> {
    let surface = match desc {
        ShapeDesc::Mesh(_) | ShapeDesc::Cube(_) | ShapeDesc::Plane(_) | ShapeDesc::Curves(_) | ShapeDesc::Points(_) => {
            return Ok(None);
        }
        ShapeDesc::Sphere(s) => {
            let (z_min, z_max) = (s.z_min.unwrap_or(-s.radius), s.z_max.unwrap_or(s.radius));
            Sphere::new(s.radius, z_min, z_max, s.phi_max_degrees.to_radians()).map(Analytic::Sphere)
        }
        ShapeDesc::Quad(q) => Quad::new(q.origin.into(), q.edge_u.into(), q.edge_v.into()).map(Analytic::Quad),
        ShapeDesc::Disk(d) => Disk::new(d.radius, d.inner_radius, d.phi_max_degrees.to_radians()).map(Analytic::Disk),
        ShapeDesc::Cylinder(c) => {
            Frustum::new(c.radius, c.radius, c.height, c.phi_max_degrees.to_radians()).map(Analytic::Frustum)
        }
        ShapeDesc::Cone(c) => {
            Frustum::new(c.radius, c.top_radius, c.height, c.phi_max_degrees.to_radians()).map(Analytic::Frustum)
        }
        ShapeDesc::Revolution(r) => {
            let surface =
                profile(&r.profile).and_then(|profile| Revolution::new(&profile, r.phi_max_degrees.to_radians()));
            surface.and_then(|surface| surface.with_parameter(parameter(r.v))).map(Analytic::Revolution)
        }
    };
    surface.map(Some).map_err(|e| files.error(path, e.to_string()))
}

fn profile(desc: &ProfileDesc) -> Result<Profile, ShapeError> {
    match desc {
        ProfileDesc::Bezier(points) => Profile::bezier(points),
        ProfileDesc::BSpline(points) => Profile::b_spline(points),
    }
}

fn parameter(desc: ProfileParameterDesc) -> ProfileParameter {
    match desc {
        ProfileParameterDesc::Curve => ProfileParameter::Curve,
        ProfileParameterDesc::Height => ProfileParameter::Height,
        ProfileParameterDesc::ArcLength => ProfileParameter::ArcLength,
    }
}
