//! One ray on its way through a tree: tests items, keeps the best hit, optionally counts the work.

use super::{Tree, TwoLevel};
use crate::accel::inspect::{Item, ItemKind, TraversalCounts};
use crate::geometry::{Hit, Shape, TriangleRay};
use crate::id::InstanceId;
use crate::math::Ray;

/// Counts work, or does nothing at all.
pub(in crate::accel) trait Counter {
    /// Nodes were opened.
    fn nodes(&mut self, count: u32);
    /// Primitives were tested.
    fn prims(&mut self, count: u32);
}

/// Counts nothing, at no cost.
pub(in crate::accel) struct NotCounted;

impl Counter for NotCounted {
    #[inline(always)]
    fn nodes(&mut self, _: u32) {}
    #[inline(always)]
    fn prims(&mut self, _: u32) {}
}

impl Counter for TraversalCounts {
    fn nodes(&mut self, count: u32) {
        self.nodes += u64::from(count);
    }
    fn prims(&mut self, count: u32) {
        self.prims += u64::from(count);
    }
}

/// A closest-hit query (`ANY` false) or an any-hit query.
pub(in crate::accel) struct Query<'a, T, C, const ANY: bool> {
    /// The ray in the tree's space. Its `t_max` shrinks to one float beyond the best hit, so that a hit which rounds to
    /// the same distance is compared as a tie.
    pub ray: Ray,
    /// The ray prepared for triangles, with the same `t_max`.
    pub triangle_ray: TriangleRay,
    /// The best hit so far, or of an any-hit query the only one.
    pub best: Option<Hit>,
    /// Counts the work.
    pub counter: &'a mut C,
    /// The space this query is in: what a [`Hit`] found here names as its instance.
    pub instance: InstanceId,
    /// Of the world-space ray, for cut-outs.
    key: u32,
    accel: &'a TwoLevel<'a, T>,
}

/// What `t_max` becomes with a hit: one float beyond it, so that a hit which rounds to the same distance is compared as
/// a tie.
#[inline(always)]
pub(in crate::accel) fn t_max_after(hit: &Hit, t_max: f32) -> f32 {
    hit.t.next_up().min(t_max)
}

impl<'a, T: Tree, C: Counter, const ANY: bool> Query<'a, T, C, ANY> {
    /// A query of the world; the ray must be valid.
    #[inline(always)]
    pub fn new(accel: &'a TwoLevel<'a, T>, ray: &Ray, counter: &'a mut C) -> Self {
        let key = accel.geometry().cutouts.key(ray);
        Self::prepared(accel, *ray, TriangleRay::from(ray), key, counter)
    }

    /// [`new`](Self::new) with what is known of the ray, and its key for cut-outs.
    #[inline(always)]
    pub fn prepared(
        accel: &'a TwoLevel<'a, T>,
        ray: Ray,
        triangle_ray: TriangleRay,
        key: u32,
        counter: &'a mut C,
    ) -> Self {
        Self { ray, triangle_ray, best: None, counter, instance: Hit::NO_INSTANCE, key, accel }
    }

    /// Largest of the distances that still matter, inclusive.
    #[inline(always)]
    pub fn t_max(&self) -> f32 {
        self.ray.t_max
    }

    /// The slack that boxes of this tree need, in units of the tree's space: rays are rounded to `f32` on their way
    /// into instances.
    #[inline(always)]
    pub fn slack(&self) -> f32 {
        if self.instance == Hit::NO_INSTANCE { self.accel.instance_slack(&self.ray) } else { 0.0 }
    }

    /// Tests one item. True ends the traversal.
    #[inline(always)]
    pub fn test(&mut self, item: Item) -> bool {
        match item.kind() {
            ItemKind::Prim(shape, prim) => {
                self.counter.prims(1);
                match self.accel.geometry().shape(shape) {
                    Shape::Mesh(mesh) => {
                        let hit = self.triangle_ray.intersect(&mesh.triangle_points_at(prim, self.ray.time));
                        hit.is_some_and(|h| {
                            self.offer(Hit { t: h.t, u: h.u, v: h.v, shape, prim, instance: self.instance })
                        })
                    }
                    Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => {
                        let hit = self.accel.geometry().intersect_prim(&self.ray, self.key, shape, prim, self.instance);
                        hit.is_some_and(|hit| self.take(hit))
                    }
                }
            }
            ItemKind::Instance(id) => self.enter(id),
        }
    }

    /// Takes a hit of a triangle within the ray's interval, if it counts and is better than the best. True ends the
    /// traversal.
    #[inline(always)]
    pub fn offer(&mut self, hit: Hit) -> bool {
        let geometry = self.accel.geometry();
        let better = ANY || self.best.is_none_or(|best| hit.is_before(&best));
        better && geometry.cutouts.counts(&geometry.shapes, self.key, &self.ray, &hit) && self.take(hit)
    }

    /// Takes a hit that counts, if it is better than the best.
    #[inline(always)]
    fn take(&mut self, hit: Hit) -> bool {
        if self.best.is_none_or(|best| hit.is_before(&best)) {
            self.best = Some(hit);
            self.set_t_max(t_max_after(&hit, self.ray.t_max));
        }
        ANY
    }

    #[inline(always)]
    fn set_t_max(&mut self, t_max: f32) {
        self.ray.t_max = t_max;
        self.triangle_ray.t_max = f64::from(t_max);
    }

    #[inline(never)]
    fn enter(&mut self, id: InstanceId) -> bool {
        let instance = self.accel.geometry().instance(id);
        let ray = instance.object_ray(&self.ray);
        // A ray may leave the range of f32 on its way into a small object.
        if !ray.is_valid() {
            return false;
        }
        let mut inner: Query<'_, T, C, ANY> = Query {
            triangle_ray: TriangleRay::from(&ray),
            ray,
            best: self.best,
            counter: self.counter,
            instance: id,
            key: self.key,
            accel: self.accel,
        };
        self.accel.object(instance.object).traverse(&mut inner);
        self.best = inner.best;
        let t_max = inner.ray.t_max;
        self.set_t_max(t_max);
        ANY && self.best.is_some()
    }
}
