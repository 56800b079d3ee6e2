//! Properties of all analytic shapes. The accuracy of their hits is checked by `bench::stability`.

use std::f64::consts::TAU;

use super::*;
use crate::geometry::Profile;
use crate::geometry::testing::endless;
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::{DMat3, Rng, dvec3};

const NO_HIT: Hit =
    Hit { t: f32::INFINITY, u: 0.0, v: 0.0, shape: ShapeId(0), prim: PrimId(0), instance: InstanceId(u32::MAX) };

fn interaction(placed: &TransformedShape, ray: &Ray) -> Option<SurfaceInteraction> {
    let local = placed.intersect(ray)?;
    placed.interaction(ray, &Hit { t: local.t as f32, ..NO_HIT })
}

mod properties;
