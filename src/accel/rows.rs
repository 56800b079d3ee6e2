//! Rays and hits of a batch, as structures of arrays.

use crate::geometry::Hit;
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::RayRows;
use crate::math::rows::{Row, soa};

/// Rays for any-hit queries.
#[derive(Clone, Copy)]
pub struct AnyHitRays<'a> {
    /// The rays.
    pub rays: &'a RayRows,
    /// How many there are, at most [`BATCH`](crate::math::rows::BATCH).
    pub count: usize,
    /// By ray: the shape of the world on which it ends and that it hits nowhere before, or [`AnyHitRays::NO_SHAPE`].
    /// Accelerators may skip that shape.
    pub end_shapes: Option<&'a Row<u32>>,
}

impl<'a> AnyHitRays<'a> {
    /// In place of a shape, where all shapes may be hit.
    pub const NO_SHAPE: u32 = u32::MAX;

    /// The first `count` rays, which may hit all shapes.
    pub fn new(rays: &'a RayRows, count: usize) -> Self {
        Self { rays, count, end_shapes: None }
    }
}

soa! {
    /// Closest hits, as [`Hit`].
    pub struct HitRows {
        /// Distance.
        t: f32,
        /// First barycentric coordinate.
        u: f32,
        /// Second barycentric coordinate.
        v: f32,
        /// Id of the shape, or [`HitRows::MISS`].
        shape: u32,
        /// Id of the primitive.
        prim: u32,
        /// Id of the instance.
        instance: u32,
    }
}

impl HitRows {
    /// In place of a shape, where a ray hits nothing.
    pub const MISS: u32 = u32::MAX;

    /// The hit of one lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Option<Hit> {
        (self.shape[lane] != Self::MISS).then(|| Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            shape: ShapeId(self.shape[lane]),
            prim: PrimId(self.prim[lane]),
            instance: InstanceId(self.instance[lane]),
        })
    }

    /// Sets the hit of one lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, hit: Option<Hit>) {
        let Some(Hit { t, u, v, shape, prim, instance }) = hit else {
            self.shape[lane] = Self::MISS;
            return;
        };
        (self.t[lane], self.u[lane], self.v[lane]) = (t, u, v);
        (self.shape[lane], self.prim[lane], self.instance[lane]) = (shape.0, prim.0, instance.0);
    }
}
