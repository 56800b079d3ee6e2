//! Every primitive for every ray: slow, simple, and the oracle that the others are held against.

use super::Accelerator;
use crate::geometry::{Geometry, Hit};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::{Aabb, Ray};

/// Tests every primitive of the geometry.
pub struct LinearAccel<'g> {
    geometry: &'g Geometry,
}

impl<'g> LinearAccel<'g> {
    /// Nothing is built.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self { geometry }
    }

    /// Calls `visit` with every hit of `ray` until it returns false. The ray that `visit` may shorten is the one that is tested.
    fn visit_hits(&self, ray: &Ray, mut visit: impl FnMut(Hit, &mut f32) -> bool) {
        if !ray.is_valid() {
            return;
        }
        let mut t_max = ray.t_max;
        if !self.visit_shapes(&self.geometry.world, ray, Hit::NO_INSTANCE, &mut t_max, &mut visit) {
            return;
        }
        for (i, instance) in self.geometry.instances.iter().enumerate() {
            let local = instance.object_ray(ray);
            if local.is_valid() {
                let shapes = &self.geometry.object(instance.object).shapes;
                if !self.visit_shapes(shapes, &local, InstanceId::new(i), &mut t_max, &mut visit) {
                    return;
                }
            }
        }
    }

    fn visit_shapes(
        &self,
        shapes: &[ShapeId],
        ray: &Ray,
        instance: InstanceId,
        t_max: &mut f32,
        visit: &mut impl FnMut(Hit, &mut f32) -> bool,
    ) -> bool {
        for &id in shapes {
            let shape = self.geometry.shape(id);
            for prim in 0..shape.prim_count() {
                let ray = Ray { t_max: *t_max, ..*ray };
                if let Some(hit) = shape.intersect_prim(&ray, id, PrimId::new(prim))
                    && !visit(Hit { instance, ..hit }, t_max)
                {
                    return false;
                }
            }
        }
        true
    }
}

impl Accelerator for LinearAccel<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut closest: Option<Hit> = None;
        self.visit_hits(ray, |hit, t_max| {
            if closest.is_none_or(|c| hit.is_before(&c)) {
                *t_max = t_max.min(hit.t);
                closest = Some(hit);
            }
            true
        });
        closest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut found = false;
        self.visit_hits(ray, |_, _| {
            found = true;
            false
        });
        found
    }

    fn bounds(&self) -> Aabb {
        self.geometry.bounds()
    }

    fn memory_bytes(&self) -> usize {
        0
    }

    fn description(&self) -> String {
        "linear (scalar, every primitive)".into()
    }
}
