//! A tree over the world, and one over each object that instances place.

use super::{Counter, Items, NotCounted, Query, Tree};
use crate::accel::Accelerator;
use crate::accel::inspect::{Inspect, NodeInfo, TraversalCounts};
use crate::geometry::{Geometry, Hit};
use crate::id::ObjectId;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{Aabb, Ray};

/// Trees over borrowed geometry.
pub(in crate::accel) struct TwoLevel<'g, T> {
    geometry: &'g Geometry,
    world: T,
    objects: Vec<T>,
    bounds: Aabb,
    instance_slack: f32,
}

impl<'g, T: Tree> TwoLevel<'g, T> {
    /// Builds all trees with `threads` threads (0: all).
    pub fn new(geometry: &'g Geometry, options: &T::Options, threads: usize) -> Self {
        let build = || {
            let objects: Vec<T> =
                geometry.objects.iter().map(|object| T::build(&Items::of_shapes(geometry, &object.shapes), options)).collect();
            let bounds: Vec<Aabb> = objects.iter().map(T::bounds).collect();
            (T::build(&Items::of_world(geometry, &bounds), options), objects)
        };
        // A pool that cannot be made is no reason to fail: the current one builds the same trees.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let (world, objects) = match pool {
            Ok(pool) => pool.install(build),
            Err(_) => build(),
        };
        Self { geometry, world, objects, bounds: geometry.bounds(), instance_slack: instance_slack(geometry) }
    }

    /// What all trees are over.
    #[inline(always)]
    pub fn geometry(&self) -> &'g Geometry {
        self.geometry
    }

    /// The tree over an object's shapes.
    #[inline(always)]
    pub fn object(&self, id: ObjectId) -> &T {
        &self.objects[id.index()]
    }

    /// Relative slack of boxes in the world's tree.
    #[inline(always)]
    pub fn instance_slack(&self) -> f32 {
        self.instance_slack
    }

    #[inline(always)]
    fn query<C: Counter, const ANY: bool>(&self, ray: &Ray, counter: &mut C) -> Option<Hit> {
        if !ray.is_valid() {
            return None;
        }
        let mut query: Query<'_, T, C, ANY> = Query::new(self, ray, counter);
        self.world.traverse(&mut query);
        query.best
    }
}

/// How far, relative to the magnitudes of origin and bounds, a ray rounded in an instance's space can lie from the exact one: one rounding of
/// the origin and one of the direction there, seen in the world.
fn instance_slack(geometry: &Geometry) -> f32 {
    let condition = geometry.instances.iter().map(|instance| {
        let norm = |m: &crate::math::DAffine3| {
            let m = &m.matrix3;
            (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element()
        };
        norm(&instance.transform.world_from_object) * norm(&instance.transform.object_from_world)
    });
    condition.fold(0.0, |worst: f64, c| worst.max(8.0 * UNIT_ROUNDOFF * c)) as f32
}

impl<T: Tree> Accelerator for TwoLevel<'_, T> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.query::<_, false>(ray, &mut NotCounted)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.query::<_, true>(ray, &mut NotCounted).is_some()
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn memory_bytes(&self) -> usize {
        self.world.memory_bytes() + self.objects.iter().map(T::memory_bytes).sum::<usize>()
    }

    fn description(&self) -> String {
        self.world.description()
    }

    fn inspect(&self) -> Option<&dyn Inspect> {
        Some(self)
    }
}

impl<T: Tree> Inspect for TwoLevel<'_, T> {
    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
        self.world.visit_nodes(visit);
        for object in &self.objects {
            object.visit_nodes(visit);
        }
    }

    fn intersect_counted(&self, ray: &Ray, counts: &mut TraversalCounts) -> Option<Hit> {
        self.query::<_, false>(ray, counts)
    }

    fn occluded_counted(&self, ray: &Ray, counts: &mut TraversalCounts) -> bool {
        self.query::<_, true>(ray, counts).is_some()
    }
}
