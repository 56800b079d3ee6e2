//! Newtype ids: indices into the tables of a compiled scene.

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an index.
            #[inline]
            pub const fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of the item at `index`. Tables longer than `u32::MAX - 1` are rejected at compile, so nothing is
            /// cut off.
            #[inline]
            pub const fn new(index: usize) -> Self {
                Self(index as u32)
            }
        }
    )*};
}

ids! {
    /// A shape of the [`Geometry`](crate::geometry::Geometry).
    ShapeId,
    /// A primitive of a shape: a triangle of a mesh; analytic shapes have only `PrimId(0)`.
    PrimId,
    /// An object: a group of shapes that instances share.
    ObjectId,
    /// One placement of an object.
    InstanceId,
    /// A material.
    MaterialId,
    /// A medium.
    MediumId,
    /// What differs within a medium.
    VolumeId,
    /// A texture.
    TextureId,
    /// The name of an attribute of meshes.
    AttributeId,
    /// A normal or bump map.
    NormalPerturbationId,
    /// A light.
    LightId,
    /// A group of lights.
    LightGroupId,
}
