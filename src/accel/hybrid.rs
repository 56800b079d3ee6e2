//! Embree for meshes, and packets for the analytic shapes that stand in the world: a few of them cost less than a
//! second hierarchy in Embree with a callback for each.

use super::embree::{EmbreeAccel, EmbreeOptions};
use super::packet::{Hierarchy, has_intervals};
use super::{Accelerator, Coherence, HitRows, intersect_in_rows};
use crate::error::Result;
use crate::geometry::{Geometry, Hit, Shape};
use crate::id::{PrimId, ShapeId};
use crate::math::rows::BATCH;
use crate::math::{Aabb, Ray, RayRows};

/// Up to this number of analytic shapes, packets beside Embree are mostly faster (`docs/accelerators.md`).
const FEW: usize = 16;

/// Embree, and a hierarchy for packets over the spheres, cylinders, disks and quads of the world that have no holes.
pub struct HybridAccel<'g> {
    embree: EmbreeAccel<'g>,
    /// In packets.
    shapes: Vec<ShapeId>,
    /// `None` without such shapes.
    packets: Option<Hierarchy<'g>>,
    geometry: &'g Geometry,
}

impl<'g> HybridAccel<'g> {
    /// Builds both with `threads` threads (0: all).
    ///
    /// # Errors
    /// As [`EmbreeAccel::new`].
    pub fn new(geometry: &'g Geometry, threads: usize) -> Result<Self> {
        let (mut shapes, mut others): (Vec<_>, Vec<_>) =
            geometry.world.iter().partition(|&&id| is_traced_in_packets(geometry, id));
        let packets = Hierarchy::new(geometry, &shapes, &geometry.bounds());
        if packets.is_none() {
            others.append(&mut shapes);
        }
        let embree = EmbreeAccel::over(geometry, &others, threads, EmbreeOptions::default())?;
        Ok(Self { embree, shapes, packets, geometry })
    }

    /// Whether this is faster than Embree alone for `geometry`.
    pub fn suits(geometry: &Geometry) -> bool {
        let count = geometry.world.iter().filter(|&&id| is_traced_in_packets(geometry, id)).count();
        (1..=FEW).contains(&count)
    }

    /// The closest hit of one ray on the shapes in packets.
    fn intersect_shapes(&self, ray: &Ray) -> Option<Hit> {
        let mut ray = *ray;
        if !ray.is_valid() {
            return None;
        }
        let mut closest = None;
        for &id in &self.shapes {
            if let Some(hit) = self.geometry.shape(id).intersect_prim(&ray, id, PrimId(0)) {
                ray.t_max = hit.t;
                closest = Some(hit);
            }
        }
        closest
    }

    /// Whether one ray hits any of the shapes in packets.
    fn occluded_by_shapes(&self, ray: &Ray) -> bool {
        let hits = |id: &ShapeId| self.geometry.shape(*id).intersect_prim(ray, *id, PrimId(0)).is_some();
        ray.is_valid() && self.shapes.iter().any(hits)
    }
}

/// Whether a shape of the world is traced in packets.
fn is_traced_in_packets(geometry: &Geometry, id: ShapeId) -> bool {
    matches!(geometry.shape(id), Shape::Analytic(placed) if has_intervals(&placed.shape))
        && !geometry.cutouts.has_holes(id)
}

impl Accelerator for HybridAccel<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let on_shape = self.intersect_shapes(ray);
        let rest = Ray { t_max: on_shape.map_or(ray.t_max, |hit| hit.t), ..*ray };
        match (self.embree.intersect(&rest), on_shape) {
            (Some(hit), Some(on_shape)) if hit.t >= on_shape.t => Some(on_shape),
            (hit, on_shape) => hit.or(on_shape),
        }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_by_shapes(ray) || self.embree.occluded(ray)
    }

    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        let Some(packets) = &self.packets else { return self.embree.intersect_rows(rays, count, hits, coherence) };
        let count = count.min(BATCH);
        let (mut on_shapes, mut ends) = (HitRows::default(), [0.0; BATCH]);
        packets.intersect_within(rays, count, &mut on_shapes, &mut ends, |ray| self.intersect_shapes(ray));
        if on_shapes.shape[..count].iter().all(|&shape| shape == HitRows::MISS) {
            return self.embree.intersect_rows(rays, count, hits, coherence);
        }
        let mut rest = rays.clone();
        for (lane, &end) in ends[..count].iter().enumerate() {
            if on_shapes.shape[lane] != HitRows::MISS {
                rest.t_max[lane] = end;
            }
        }
        self.embree.intersect_rows(&rest, count, hits, coherence);
        for lane in 0..count {
            let Some(hit) = on_shapes.get(lane) else { continue };
            // Within the limits of the distance to the shape, that in `f64` decides.
            let is_first = hits.shape[lane] != HitRows::MISS
                && (hits.t[lane] < hit.t
                    || packets.exact_distance(hit.shape, &rays.get(lane)).is_some_and(|t| hits.t[lane] < t));
            if !is_first {
                hits.set(lane, Some(hit));
            }
        }
    }

    fn occluded_rows(&self, rays: &RayRows, count: usize, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let Some(packets) = &self.packets else {
            return self.embree.occluded_rows(rays, count, occluded, coherence);
        };
        let count = count.min(BATCH);
        let mut by_shapes = [false; BATCH];
        packets.occluded(rays, count, &mut by_shapes, |ray| self.occluded_by_shapes(ray));
        self.embree.occluded_rows(rays, count, occluded, coherence);
        occluded[..count].iter_mut().zip(by_shapes).for_each(|(occluded, by_shape)| *occluded |= by_shape);
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
        intersect_in_rows(self, rays, hits, coherence);
        if let Some(packets) = &self.packets {
            packets.set_exact_distances(rays, hits);
        }
    }

    fn bounds(&self) -> Aabb {
        self.embree.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.embree.memory_bytes() + self.packets.as_ref().map_or(0, Hierarchy::memory_bytes)
    }

    fn description(&self) -> String {
        match self.shapes.len() {
            0 => self.embree.description(),
            count => format!("{}, packets of rays for {count} analytic shapes", self.embree.description()),
        }
    }
}
