//! A tree over the world, and one over each object that instances place.

use super::{Answers, Batch, Counter, Items, NotCounted, Query, Tree};
use crate::accel::inspect::{Inspect, NodeInfo, TraversalCounts};
use crate::accel::{Accelerator, AnyHitRays, Coherence, HitRows};
use crate::geometry::{Geometry, Hit, Instance, Shape};
use crate::id::{ObjectId, ShapeId};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::rows::BATCH;
use crate::math::{Aabb, DAffine3, Motion, Ray, RayRows, Transform};

/// Trees over borrowed geometry.
pub(in crate::accel) struct TwoLevel<'g, T> {
    geometry: &'g Geometry,
    world: T,
    objects: Vec<T>,
    bounds: Aabb,
    instances: Option<InstanceRounding>,
    /// Analytic shapes in the world's tree, in ascending order.
    analytic_shapes: Vec<ShapeId>,
}

impl<'g, T: Tree> TwoLevel<'g, T> {
    /// Builds all trees with `threads` threads (0: all).
    pub fn new(geometry: &'g Geometry, options: &T::Options, threads: usize) -> Self {
        Self::over(geometry, &geometry.world, options, threads)
    }

    /// Over some shapes of the world, and all instances.
    pub fn over(geometry: &'g Geometry, shapes: &[ShapeId], options: &T::Options, threads: usize) -> Self {
        let build = || {
            let objects: Vec<T> = geometry
                .objects
                .iter()
                .map(|object| T::build(&Items::of_shapes(geometry, &object.shapes), options))
                .collect();
            let bounds: Vec<Vec<Aabb>> = objects.iter().map(T::cover).collect();
            (T::build(&Items::of_world(geometry, shapes, &bounds), options), objects)
        };
        // A pool that cannot be made is no reason to fail: the current one builds the same trees.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let (world, objects) = match pool {
            Ok(pool) => pool.install(build),
            Err(_) => build(),
        };
        let is_analytic = |id: &ShapeId| matches!(geometry.shape(*id), Shape::Analytic(_));
        let mut analytic_shapes: Vec<ShapeId> = shapes.iter().copied().filter(is_analytic).collect();
        analytic_shapes.sort_unstable();
        let (bounds, instances) = (geometry.bounds(), InstanceRounding::of(geometry));
        Self { geometry, world, objects, bounds, instances, analytic_shapes }
    }

    /// A tree made by `build` over the world of a geometry without instances.
    #[cfg(test)]
    pub fn over_world(geometry: &'g Geometry, build: impl Fn(&Items<'_>) -> T) -> Self {
        let world = build(&Items::of_world(geometry, &geometry.world, &[]));
        Self {
            geometry,
            world,
            objects: Vec::new(),
            bounds: geometry.bounds(),
            instances: None,
            analytic_shapes: Vec::new(),
        }
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

    /// How far `ray` can move when it is rounded in the space of an instance, in world units.
    #[inline(always)]
    pub fn instance_slack(&self, ray: &Ray) -> f32 {
        self.instances.map_or(0.0, |rounding| rounding.slack(ray))
    }

    /// The tree over the world.
    pub fn world(&self) -> &T {
        &self.world
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

impl<T: Tree> Batch<'_, '_, T> {
    /// As [`Tree::trace_rows`], one ray after the other.
    pub fn trace_one_by_one<const ANY: bool>(&self, answers: &mut impl Answers) {
        for lane in 0..self.count {
            answers.set(lane, self.accel.query::<_, ANY>(&self.rays.get(lane), &mut NotCounted));
        }
    }
}

/// A bound of the rounding of rays in the spaces of all instances, seen in the world.
#[derive(Clone, Copy)]
struct InstanceRounding {
    /// Relative error: the roundoff times the worst condition number.
    relative: f32,
    /// Largest coordinate of bounds and translations.
    reach: f32,
}

impl InstanceRounding {
    /// `None` if there are no instances.
    fn of(geometry: &Geometry) -> Option<Self> {
        let norm =
            |m: &DAffine3| (m.matrix3.x_axis.abs() + m.matrix3.y_axis.abs() + m.matrix3.z_axis.abs()).max_element();
        let bounds = geometry.bounds();
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        let mut rounding: Option<Self> = None;
        let at_rest = |instance: &Instance| instance.motion.is_none().then_some(instance.transform);
        let moving = |instance: &Instance| {
            instance.motion.clone().map(|motion| Motion::sample_times().map(move |time| motion.at(time)))
        };
        let transforms =
            geometry.instances.iter().flat_map(|i| at_rest(i).into_iter().chain(moving(i).into_iter().flatten()));
        for Transform { world_from_object, object_from_world, .. } in transforms {
            // One rounding of the origin and one of the direction, with room for the arithmetic in f64 and for what
            // lies between the times at which motions were sampled.
            let relative = (8.0 * UNIT_ROUNDOFF * norm(&world_from_object) * norm(&object_from_world)) as f32;
            let translation = world_from_object.translation.abs().max_element() as f32;
            let old = rounding.unwrap_or(Self { relative, reach });
            rounding = Some(Self { relative: old.relative.max(relative), reach: old.reach.max(translation) });
        }
        rounding
    }

    #[inline(always)]
    fn slack(&self, ray: &Ray) -> f32 {
        self.relative * (ray.origin.abs().max_element() + self.reach)
    }
}

impl<T: Tree> Accelerator for TwoLevel<'_, T> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.query::<_, false>(ray, &mut NotCounted)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.query::<_, true>(ray, &mut NotCounted).is_some()
    }

    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        let batch = Batch { accel: self, rays, count: count.min(BATCH), end_shapes: None };
        T::trace_rows::<false>(&batch, hits, coherence);
    }

    fn occluded_rows(&self, rays: AnyHitRays, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let AnyHitRays { rays, count, end_shapes } = rays;
        let batch = Batch { accel: self, rays, count: count.min(BATCH), end_shapes };
        T::trace_rows::<true>(&batch, occluded, coherence);
    }

    fn skips_end_shape(&self, shape: ShapeId) -> bool {
        T::SKIPS_END_SHAPES && self.analytic_shapes.binary_search(&shape).is_ok()
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
