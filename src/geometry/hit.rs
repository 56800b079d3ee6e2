//! What a leaf loop returns: which primitive, where along the ray, and its barycentric coordinates.

use crate::id::{InstanceId, PrimId, ShapeId};

/// The closest hit of a ray: 24 bytes; everything else is computed once it is known which hit wins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Barycentric coordinate of a triangle's second vertex; zero on analytic shapes.
    pub u: f32,
    /// Barycentric coordinate of a triangle's third vertex; zero on analytic shapes.
    pub v: f32,
    /// The shape.
    pub shape: ShapeId,
    /// The primitive of the shape.
    pub prim: PrimId,
    /// The instance through which the shape was hit, or [`Hit::NO_INSTANCE`].
    pub instance: InstanceId,
}

impl Hit {
    /// The instance of shapes that are placed in the world directly.
    pub const NO_INSTANCE: InstanceId = InstanceId(u32::MAX);

    /// In place of an instance: a medium has scattered the ray, whose id stands in place of the shape's.
    pub const MEDIUM: InstanceId = InstanceId(u32::MAX - 1);

    /// The order in which ties are broken: by distance, then by ids, so that all own accelerators return the same
    /// hit.
    #[inline]
    pub fn is_before(&self, other: &Self) -> bool {
        let key = |h: &Self| (h.instance, h.shape, h.prim);
        self.t < other.t || (self.t == other.t && key(self) < key(other))
    }
}
