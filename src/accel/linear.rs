//! Every primitive of every shape for every ray: slow, and right by inspection. The other accelerators are tested
//! against it.

use super::Accelerator;
use crate::geometry::{Geometry, Hit, Shape, TriangleHit, TriangleRay};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::{Aabb, Ray};

/// The accelerator without a structure.
pub struct LinearAccel<'g> {
    geometry: &'g Geometry,
}

/// A primitive of a shape in an instance.
#[derive(Clone, Copy)]
struct Primitive {
    id: ShapeId,
    prim: PrimId,
    instance: InstanceId,
}

impl<'g> LinearAccel<'g> {
    /// Keeps a reference; there is nothing to build.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self { geometry }
    }

    /// Calls `visit` for every group of shapes with the ray in the space of the group, until it returns true.
    fn any_group(&self, ray: &Ray, mut visit: impl FnMut(&Ray, &[ShapeId], InstanceId) -> bool) -> bool {
        if visit(ray, &self.geometry.world, Hit::NO_INSTANCE) {
            return true;
        }
        self.geometry.instances.iter().enumerate().any(|(i, instance)| {
            let local = instance.object_ray(ray);
            // A ray may leave the range of f32 on its way into a small object.
            local.is_valid() && visit(&local, &self.geometry.object(instance.object).shapes, InstanceId::new(i))
        })
    }

    /// The hit with one primitive; `triangle_ray` is `ray` prepared for triangles.
    #[inline(always)]
    fn test(
        &self,
        ray: &Ray,
        triangle_ray: &TriangleRay,
        key: u32,
        Primitive { id, prim, instance }: Primitive,
    ) -> Option<Hit> {
        let Shape::Mesh(mesh) = self.geometry.shape(id) else {
            return self.geometry.intersect_prim(ray, key, id, prim, instance);
        };
        let TriangleHit { t, u, v } = triangle_ray.intersect(&mesh.triangle_points_at(prim, ray.time))?;
        let hit = Hit { t, u, v, shape: id, prim, instance };
        self.geometry.cutouts.counts(&self.geometry.shapes, key, ray, &hit).then_some(hit)
    }

    fn prims(&self, id: ShapeId) -> impl Iterator<Item = PrimId> {
        (0..self.geometry.shape(id).prim_count()).map(PrimId::new)
    }
}

impl Accelerator for LinearAccel<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        if !ray.is_valid() {
            return None;
        }
        let key = self.geometry.cutouts.key(ray);
        let mut closest: Option<Hit> = None;
        self.any_group(ray, |local, ids, instance| {
            let mut local = *local;
            let mut triangle_ray = TriangleRay::from(&local);
            for &id in ids {
                for prim in self.prims(id) {
                    // One float beyond the best hit, so that a hit which rounds to the same distance is compared as a
                    // tie.
                    local.t_max = closest.map_or(ray.t_max, |best| best.t.next_up().min(ray.t_max));
                    triangle_ray.t_max = f64::from(local.t_max);
                    let Some(hit) = self.test(&local, &triangle_ray, key, Primitive { id, prim, instance }) else {
                        continue;
                    };
                    if closest.is_none_or(|best| hit.is_before(&best)) {
                        closest = Some(hit);
                    }
                }
            }
            false
        });
        closest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let key = self.geometry.cutouts.key(ray);
        let group = |local: &Ray, ids: &[ShapeId], instance| {
            let triangle_ray = TriangleRay::from(local);
            ids.iter().any(|&id| {
                self.prims(id)
                    .any(|prim| self.test(local, &triangle_ray, key, Primitive { id, prim, instance }).is_some())
            })
        };
        ray.is_valid() && self.any_group(ray, group)
    }

    fn bounds(&self) -> Aabb {
        self.geometry.bounds()
    }

    fn memory_bytes(&self) -> usize {
        0
    }

    fn description(&self) -> String {
        "linear".into()
    }
}
