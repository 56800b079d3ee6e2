//! The best hits of the rays of a batch so far.

use super::Bvh;
use crate::accel::inspect::Item;
use crate::accel::tree::{Answers, NotCounted, Query, TwoLevel, t_max_after};
use crate::geometry::{Hit, TriangleRay};
use crate::id::InstanceId;
use crate::math::Ray;
use crate::math::rows::Row;

/// Where hits of a batch's rays are offered.
pub(super) struct BestHits<'t, 'a, A> {
    pub accel: &'t TwoLevel<'a, Bvh>,
    /// Of the rays in the world, for cut-outs.
    pub keys: &'t Row<u32>,
    /// The ends of the rays: one float beyond their hits.
    pub t_max: &'t mut Row,
    pub answers: &'t mut A,
}

impl<A: Answers> BestHits<'_, '_, A> {
    /// Takes a hit on a triangle within the interval of the ray of a lane, if it counts and is better than the best.
    /// `ray` is in the space of the triangle. True if the ray is answered.
    #[inline(always)]
    pub fn offer<const ANY: bool>(&mut self, lane: usize, hit: &Hit, ray: impl FnOnce() -> Ray) -> bool {
        let geometry = self.accel.geometry();
        let is_better = ANY || self.answers.get(lane).is_none_or(|best| hit.is_before(&best));
        if is_better && geometry.cutouts.counts(&geometry.shapes, self.keys[lane], &ray(), hit) {
            self.answers.set(lane, Some(*hit));
            self.t_max[lane] = t_max_after(hit, self.t_max[lane]);
            return ANY;
        }
        false
    }

    /// Tests items of an instance, other than triangles, with the ray of a lane in its space. True if the ray is
    /// answered.
    #[inline(never)]
    pub fn test_items<const ANY: bool>(
        &mut self,
        lane: usize,
        items: &[Item],
        instance: InstanceId,
        ray: &Ray,
        triangle_ray: TriangleRay,
    ) -> bool {
        let ray = Ray { t_max: self.t_max[lane], ..*ray };
        let counter = &mut NotCounted;
        let mut query = Query::<_, _, ANY>::prepared(self.accel, ray, triangle_ray, self.keys[lane], counter);
        query.instance = instance;
        query.best = self.answers.get(lane);
        let is_answered = items.iter().any(|&item| query.test(item));
        self.answers.set(lane, query.best);
        self.t_max[lane] = query.t_max();
        is_answered
    }
}
