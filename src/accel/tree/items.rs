//! What a tree is built over.

use crate::accel::inspect::{Item, ItemKind};
use crate::geometry::{Geometry, Shape, TrianglePoints};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::Aabb;

/// Items with their bounds, in the space of one tree.
pub(in crate::accel) struct Items<'g> {
    geometry: &'g Geometry,
    /// The items.
    pub list: Vec<Item>,
    /// The bounds of each item, never empty.
    pub bounds: Vec<Aabb>,
}

impl<'g> Items<'g> {
    /// The primitives of these shapes.
    pub fn of_shapes(geometry: &'g Geometry, ids: &[ShapeId]) -> Self {
        let count = ids.iter().map(|id| geometry.shape(*id).prim_count()).sum();
        let (mut list, mut bounds) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for &id in ids {
            let shape = geometry.shape(id);
            for prim in (0..shape.prim_count()).map(PrimId::new) {
                list.push(Item::prim(id, prim));
                bounds.push(shape.prim_bounds(prim));
            }
        }
        Self { geometry, list, bounds }
    }

    /// These shapes of the world, and instances of objects, of each of which boxes are given that hold it. Instances of
    /// empty objects are left out.
    pub fn of_world(geometry: &'g Geometry, shapes: &[ShapeId], objects: &[Vec<Aabb>]) -> Self {
        let mut items = Self::of_shapes(geometry, shapes);
        for (i, instance) in geometry.instances.iter().enumerate() {
            let boxes = &objects[instance.object.index()];
            let bounds = if instance.motion.is_none() {
                boxes.iter().fold(Aabb::EMPTY, |all, part| all.union(&instance.bounds(part)))
            } else {
                // One box for all: bounds of a motion are those of many intervals of the shutter.
                instance.bounds(&boxes.iter().fold(Aabb::EMPTY, |all, part| all.union(part)))
            };
            if !bounds.is_empty() {
                items.list.push(Item::instance(InstanceId::new(i)));
                items.bounds.push(bounds);
            }
        }
        items
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// The corners of an item that is a triangle at rest.
    pub fn triangle(&self, index: usize) -> Option<TrianglePoints> {
        match self.list[index].kind() {
            ItemKind::Prim(shape, prim) => match self.geometry.shape(shape) {
                Shape::Mesh(mesh) if !mesh.is_deforming() => Some(mesh.triangle_points(prim)),
                _ => None,
            },
            ItemKind::Instance(_) => None,
        }
    }

    /// The box around all items; empty if there is none.
    pub fn all_bounds(&self) -> Aabb {
        self.bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(b))
    }
}
