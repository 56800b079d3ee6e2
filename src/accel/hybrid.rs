//! Packets for analytic shapes of the world, and Embree or the BVH for all else: a few shapes cost less that way than a
//! second hierarchy in Embree with a callback for each. Beside the BVH, floors and walls are in packets too, and many
//! analytic shapes are not.

use super::bvh::{Bvh, BvhOptions};
use super::embree::{EmbreeAccel, EmbreeOptions};
use super::packet::{Hierarchy, PacketHitRows, has_intervals};
use super::tree::TwoLevel;
use super::{Accelerator, AnyHitRays, Coherence, HitRows, intersect_in_rows};
use crate::error::Result;
use crate::geometry::{Geometry, Hit, Shape};
use crate::id::{PrimId, ShapeId};
use crate::math::rows::{BATCH, Row, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Aabb, Ray, RayRows};

/// The most triangles of a mesh that is traced in packets: a floor, or walls.
const MAX_MESH_TRIANGLES: usize = 48;

/// The most triangles of all such meshes.
const MAX_WALL_TRIANGLES: usize = 80;

/// The least area of the box around such a mesh, in areas of the box around the world.
const MIN_WALL_AREA: f32 = 0.02;

/// The most analytic shapes in packets beside the BVH: more of them are traced faster in it.
const MAX_SHAPES: usize = 512;

/// The same where floors or walls are in packets, which rays that enter a room all meet.
const MAX_SHAPES_BESIDE_WALLS: usize = 64;

/// What traces what is not in packets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HybridOptions {
    /// The bounding volume hierarchy of this crate in place of Embree.
    pub bvh: bool,
}

/// A hierarchy for packets over the spheres, cylinders, disks and quads of the world that have no holes, and Embree or
/// the BVH. Where there are more than 512 of them, or 64 beside floors or walls, all are in the BVH.
pub struct HybridAccel<'g> {
    others: Box<dyn Accelerator + 'g>,
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
    pub fn new(geometry: &'g Geometry, threads: usize, options: HybridOptions) -> Result<Self> {
        let walls = if options.bvh { walls(geometry) } else { Vec::new() };
        let max_shapes = match options.bvh {
            false => usize::MAX,
            true if walls.is_empty() => MAX_SHAPES,
            true => MAX_SHAPES_BESIDE_WALLS,
        };
        let is_analytic = |id: ShapeId| is_traced_in_packets(geometry, id);
        let are_few = geometry.world.iter().filter(|&&id| is_analytic(id)).count() <= max_shapes;
        let (mut shapes, mut others): (Vec<_>, Vec<_>) =
            geometry.world.iter().partition(|&&id| are_few && is_analytic(id) || walls.contains(&id));
        let packets = Hierarchy::new(geometry, &shapes, &geometry.bounds());
        if packets.is_none() {
            others.append(&mut shapes);
        }
        let others: Box<dyn Accelerator + 'g> = if options.bvh {
            Box::new(TwoLevel::<Bvh>::over(geometry, &others, &BvhOptions::default(), threads))
        } else {
            Box::new(EmbreeAccel::over(geometry, &others, threads, EmbreeOptions::default())?)
        };
        Ok(Self { others, shapes, packets, geometry })
    }

    /// The closest hit of one ray on the shapes in packets.
    fn intersect_shapes(&self, ray: &Ray) -> Option<Hit> {
        let mut ray = *ray;
        if !ray.is_valid() {
            return None;
        }
        let mut closest = None;
        for (id, prim) in self.prims() {
            if let Some(hit) = self.geometry.shape(id).intersect_prim(&ray, id, prim) {
                ray.t_max = hit.t;
                closest = Some(hit);
            }
        }
        closest
    }

    /// The primitives in packets.
    fn prims(&self) -> impl Iterator<Item = (ShapeId, PrimId)> {
        self.shapes.iter().flat_map(|&id| (0..self.geometry.shape(id).prim_count()).map(move |i| (id, PrimId::new(i))))
    }

    /// Whether one ray hits any of the shapes in packets.
    fn occluded_by_shapes(&self, ray: &Ray) -> bool {
        ray.is_valid() && self.prims().any(|(id, prim)| self.geometry.shape(id).intersect_prim(ray, id, prim).is_some())
    }
}

/// Which hits are nearer.
struct NearerRows {
    /// 1 where the hit on a shape in packets is, else 0.
    shape: Row<u32>,
    /// 1 where the distance in `f64` decides, else 0.
    is_open: Row<u32>,
}

/// Ends rays where they hit shapes in packets.
#[inline(always)]
fn shorten(t_max: &mut Row, on_shapes: &PacketHitRows, count: usize) {
    let PacketHitRows { prims, ends, .. } = on_shapes;
    for (i, t_max) in t_max[..whole_vectors(count)].iter_mut().enumerate() {
        *t_max = if prims[i] == HitRows::MISS { *t_max } else { ends[i] };
    }
}

/// Compares hits on shapes in packets with hits on others; true if any comparison is open.
#[inline(always)]
fn find_nearer(on_shapes: &PacketHitRows, on_others: &HitRows, nearer: &mut NearerRows, count: usize) -> bool {
    let mut is_any_open = 0;
    for i in 0..count.min(BATCH) {
        let is_on_shape = on_shapes.prims[i] != HitRows::MISS;
        let is_on_other = on_others.shape[i] != HitRows::MISS;
        let is_other_nearer = is_on_other & (on_others.t[i] < on_shapes.t[i]);
        nearer.shape[i] = u32::from(is_on_shape & !is_other_nearer);
        nearer.is_open[i] = u32::from(is_on_shape & is_on_other & !is_other_nearer);
        is_any_open |= nearer.is_open[i];
    }
    is_any_open != 0
}

/// Whether a shape of the world is traced in packets.
pub(super) fn is_traced_in_packets(geometry: &Geometry, id: ShapeId) -> bool {
    matches!(geometry.shape(id), Shape::Analytic(placed) if has_intervals(&placed.shape))
        && !geometry.cutouts.has_holes(id)
}

/// Whether a shape is a mesh that does not deform.
pub(super) fn is_resting_mesh(shape: &Shape) -> bool {
    matches!(shape, Shape::Mesh(mesh) if !mesh.is_deforming())
}

/// Floors and walls: the largest meshes of few triangles, which rays of all directions meet.
fn walls(geometry: &Geometry) -> Vec<ShapeId> {
    let area = |id: ShapeId| geometry.shape(id).bounds().area();
    let min_area = MIN_WALL_AREA * geometry.bounds().area();
    let is_wall = |id: &ShapeId| {
        is_resting_mesh(geometry.shape(*id))
            && geometry.shape(*id).prim_count() <= MAX_MESH_TRIANGLES
            && area(*id) > min_area
            && !geometry.cutouts.has_holes(*id)
    };
    let mut walls: Vec<ShapeId> = geometry.world.iter().copied().filter(is_wall).collect();
    walls.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    let mut triangles = 0;
    walls.retain(|&id| {
        let sum = triangles + geometry.shape(id).prim_count();
        let fits = sum <= MAX_WALL_TRIANGLES;
        triangles = if fits { sum } else { triangles };
        fits
    });
    walls
}

impl Accelerator for HybridAccel<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let on_shape = self.intersect_shapes(ray);
        let rest = Ray { t_max: on_shape.map_or(ray.t_max, |hit| hit.t), ..*ray };
        match (self.others.intersect(&rest), on_shape) {
            (Some(hit), Some(on_shape)) if hit.t >= on_shape.t => Some(on_shape),
            (hit, on_shape) => hit.or(on_shape),
        }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_by_shapes(ray) || self.others.occluded(ray)
    }

    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        let Some(packets) = &self.packets else { return self.others.intersect_rows(rays, count, hits, coherence) };
        let count = count.min(BATCH);
        let mut on_shapes = PacketHitRows { t: [0.0; BATCH], prims: [HitRows::MISS; BATCH], ends: [0.0; BATCH] };
        let left_out = packets.intersect_within(rays, count, &mut on_shapes);
        if left_out.is_empty() && on_shapes.prims[..count].iter().all(|&prim| prim == HitRows::MISS) {
            return self.others.intersect_rows(rays, count, hits, coherence);
        }
        let mut rest = rays.clone();
        vectorize!(shorten(&mut rest.t_max, &on_shapes, count));
        self.others.intersect_rows(&rest, count, hits, coherence);
        let mut order = NearerRows { shape: [0; BATCH], is_open: [0; BATCH] };
        if vectorize!(find_nearer(&on_shapes, hits, &mut order, count)) {
            for lane in (0..count).filter(|&lane| order.is_open[lane] != 0) {
                // Within the limits of the distance to the shape, that in `f64` decides.
                let exact = packets.exact_distance_to(on_shapes.prims[lane], &rays.get(lane));
                order.shape[lane] = u32::from(!exact.is_some_and(|t| hits.t[lane] < t));
            }
        }
        for lane in (0..count).filter(|&lane| order.shape[lane] != 0) {
            hits.t[lane] = on_shapes.t[lane];
            packets.complete(on_shapes.prims[lane], rays, lane, hits);
        }
        for lane in left_out.into_iter().map(usize::from) {
            hits.set(lane, self.intersect(&rays.get(lane)));
        }
    }

    fn occluded_rows(&self, rays: AnyHitRays, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let Some(packets) = &self.packets else { return self.others.occluded_rows(rays, occluded, coherence) };
        let AnyHitRays { rays, count, end_shapes } = rays;
        let count = count.min(BATCH);
        let mut by_shapes = [false; BATCH];
        packets.occluded(rays, count, &mut by_shapes, |ray| self.occluded_by_shapes(ray));
        let mut rest = rays.clone();
        for (t_max, is_occluded) in rest.t_max.iter_mut().zip(by_shapes).take(count) {
            *t_max = if is_occluded { -1.0 } else { *t_max };
        }
        self.others.occluded_rows(AnyHitRays { rays: &rest, count, end_shapes }, occluded, coherence);
        occluded[..count].iter_mut().zip(by_shapes).for_each(|(occluded, by_shape)| *occluded |= by_shape);
    }

    fn skips_end_shape(&self, shape: ShapeId) -> bool {
        self.others.skips_end_shape(shape)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
        intersect_in_rows(self, rays, hits, coherence);
        if let Some(packets) = &self.packets {
            packets.set_exact_distances(rays, hits);
        }
    }

    fn bounds(&self) -> Aabb {
        self.others.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.others.memory_bytes() + self.packets.as_ref().map_or(0, Hierarchy::memory_bytes)
    }

    fn description(&self) -> String {
        match self.shapes.len() {
            0 => self.others.description(),
            count => format!("{}, packets of rays for {count} shapes", self.others.description()),
        }
    }
}
