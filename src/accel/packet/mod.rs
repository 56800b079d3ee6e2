//! A bounding volume hierarchy that whole packets of rays traverse together, in `f32`: for scenes of few primitives,
//! where most rays of a packet meet the same boxes whatever their directions.

mod hierarchy;
mod lanes;
mod primitives;
mod shapes;
#[cfg(test)]
mod tests;
mod traverse;

use super::bvh::Bvh;
use super::inspect::Inspect;
use super::tree::TwoLevel;
use super::{Accelerator, AnyHitRays, BvhOptions, Coherence, HitRows, intersect_in_rows};
use crate::geometry::{Analytic, Geometry, Hit, Shape};
use crate::id::ShapeId;
use crate::math::rows::BATCH;
use crate::math::{Aabb, Ray, RayRows};
pub(super) use hierarchy::Hierarchy;
pub(super) use lanes::{Vector, load, load_vector, store_f32s};
pub(super) use shapes::has_intervals;
pub(super) use traverse::PacketHitRows;

/// Up to this number of polygons and analytic shapes, packets are faster than Embree (`docs/performance.md`).
const FEW: usize = 40;

/// Beside them, up to this number of spheres and cylinders (`docs/accelerators.md`).
const MANY_QUADRICS: usize = 3_000;

/// Traces batches in packets, and single rays as the BVH does.
///
/// A result in a batch depends on its ray alone, and is the same on every machine. Edges are widened by a bound of the
/// rounding errors: no ray slips between triangles that share an edge or a corner.
pub struct PacketBvh<'g> {
    single: TwoLevel<'g, Bvh>,
    /// `None` where something moves, is instanced or has holes: rays of batches are traced one by one then.
    packets: Option<Hierarchy<'g>>,
}

impl<'g> PacketBvh<'g> {
    /// Builds both forms with `threads` threads (0: all).
    pub fn new(geometry: &'g Geometry, threads: usize) -> Self {
        let packets = is_static(geometry).then(|| of_world(geometry));
        Self { single: TwoLevel::new(geometry, &BvhOptions::default(), threads), packets: packets.flatten() }
    }

    /// Whether packets are faster than Embree for `geometry`.
    pub fn suits(geometry: &Geometry) -> bool {
        let (quadrics, others): (Vec<&Shape>, Vec<&Shape>) =
            geometry.world.iter().map(|&id| geometry.shape(id)).partition(|shape| is_quadric(shape));
        // Two triangles may make one polygon.
        let prims: usize = others.iter().map(|shape| shape.prim_count()).sum();
        prims <= 2 * FEW
            && quadrics.len() <= MANY_QUADRICS
            && is_static(geometry)
            && of_world(geometry).is_some_and(|packets| packets.len() <= FEW + quadrics.len())
    }
}

/// The hierarchy over the whole of a static world.
fn of_world(geometry: &Geometry) -> Option<Hierarchy<'_>> {
    Hierarchy::new(geometry, &geometry.world, &geometry.bounds())
}

/// Whether a shape is a sphere or a cylinder.
fn is_quadric(shape: &Shape) -> bool {
    match shape {
        Shape::Analytic(placed) => match &placed.shape {
            Analytic::Sphere(_) => true,
            Analytic::Frustum(frustum) => frustum.is_cylinder(),
            Analytic::Quad(_) | Analytic::Disk(_) | Analytic::Revolution(_) => false,
        },
        Shape::Mesh(_) | Shape::Curves(_) | Shape::Points(_) => false,
    }
}

/// Whether all shapes are meshes or analytic, in the world, at rest, and without holes.
fn is_static(geometry: &Geometry) -> bool {
    let is_at_rest = |shape: &Shape| match shape {
        Shape::Mesh(mesh) => !mesh.is_deforming(),
        Shape::Analytic(_) => true,
        Shape::Curves(_) | Shape::Points(_) => false,
    };
    geometry.instances.is_empty() && geometry.cutouts.is_empty() && geometry.shapes.iter().all(is_at_rest)
}

impl Accelerator for PacketBvh<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.single.intersect(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.single.occluded(ray)
    }

    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        let Some(packets) = &self.packets else { return self.single.intersect_rows(rays, count, hits, coherence) };
        packets.intersect(rays, count.min(BATCH), hits, |ray| self.single.intersect(ray));
    }

    fn occluded_rows(&self, rays: AnyHitRays, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let Some(packets) = &self.packets else { return self.single.occluded_rows(rays, occluded, coherence) };
        packets.occluded(rays.rays, rays.count.min(BATCH), occluded, |ray| self.single.occluded(ray));
    }

    fn skips_end_shape(&self, shape: ShapeId) -> bool {
        self.packets.is_none() && self.single.skips_end_shape(shape)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
        intersect_in_rows(self, rays, hits, coherence);
        if let Some(packets) = &self.packets {
            packets.set_exact_distances(rays, hits);
        }
    }

    fn bounds(&self) -> Aabb {
        self.single.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.single.memory_bytes() + self.packets.as_ref().map_or(0, Hierarchy::memory_bytes)
    }

    fn description(&self) -> String {
        match &self.packets {
            Some(_) => "BVH, packets of rays".into(),
            None => self.single.description(),
        }
    }

    fn inspect(&self) -> Option<&dyn Inspect> {
        self.single.inspect()
    }
}
