//! Shapes and everything an accelerator sees of a scene: bounds, counts, ids and intersection; nothing of materials or
//! lights.

mod attributes;
mod curves;
mod curves_error;
mod cutout;
mod disk;
mod frustum;
mod hit;
mod instance;
mod interaction;
mod mesh;
mod mesh_error;
mod moving;
mod placed;
mod point_cloud;
mod profile;
mod quad;
mod revolution;
mod sector;
mod shape_error;
mod sphere;
mod tangents;
#[cfg(test)]
mod testing;
mod triangle;
mod uv;

pub use curves::{CurveBasis, CurveKind, Curves, Strands};
pub use curves_error::CurvesError;
pub use cutout::{AlphaMask, AlphaMasks};
pub use disk::Disk;
pub use frustum::Frustum;
pub use hit::Hit;
pub(crate) use instance::PointWithNormals;
pub use instance::{Instance, InverseReach, Object};
pub use interaction::{Detail, SpawnPoint, SurfaceInteraction};
pub(crate) use mesh::interpolated_normal;
pub use mesh::{Mesh, MeshStep, TrianglePoints};
pub use mesh_error::MeshError;
pub use placed::{
    Analytic, LocalHit, LocalSurface, PACKET_SIZE, PacketHits, RayPacket, ShapeSample, SurfacePoint, TransformedShape,
    WorldNormalRows, WorldPointRows, WorldSampleRows,
};
pub use point_cloud::Points;
pub use profile::Profile;
pub use quad::Quad;
pub use revolution::{ProfileParameter, Revolution};
pub use sector::Sector;
pub use shape_error::ShapeError;
pub use sphere::Sphere;
pub(crate) use tangents::corner_tangents;
pub use triangle::{Shear, ShearRows, TriangleHit, TriangleIntersection, TriangleRay, TriangleSample, largest_axis};

pub(crate) use uv::{interpolated_uv, uv_area, uv_density};

use crate::id::{InstanceId, ObjectId, PrimId, ShapeId};
use crate::math::float::step_past;
use crate::math::{Aabb, DVec3, Ray, Vec3};

/// A triangle mesh, one analytic surface, curves, or points.
///
/// Analytic surfaces are stored in place: a box would cost a cache miss at every hit, and there are few shapes.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Triangles, with positions in the space the shape is placed in.
    Mesh(Mesh),
    /// A surface given by a formula, with its transform.
    Analytic(TransformedShape),
    /// Curves, in the space they are placed in.
    Curves(Box<Curves>),
    /// Spheres, in the space they are placed in.
    Points(Box<Points>),
}

impl Shape {
    /// How many primitives the shape has: triangles, segments of curves, points, or one.
    pub fn prim_count(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.triangles().len(),
            Self::Analytic(_) => 1,
            Self::Curves(curves) => curves.prim_count(),
            Self::Points(points) => points.prim_count(),
        }
    }

    /// Bounds of one primitive over the whole shutter interval, fit for an accelerator (outward, padded on analytic
    /// shapes).
    pub fn prim_bounds(&self, prim: PrimId) -> Aabb {
        match self {
            Self::Mesh(mesh) => mesh.triangle_bounds(prim),
            Self::Analytic(placed) => placed.bounds().padded(),
            Self::Curves(curves) => curves.prim_bounds(prim),
            Self::Points(points) => points.prim_bounds(prim),
        }
    }

    /// Whether textures can take attributes of it.
    pub fn has_attributes(&self) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.has_attributes(),
            Self::Curves(curves) => curves.has_attributes(),
            Self::Analytic(_) | Self::Points(_) => false,
        }
    }

    /// Bounds of the whole shape.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Mesh(mesh) => mesh.bounds(),
            Self::Analytic(placed) => placed.bounds().padded(),
            Self::Curves(curves) => curves.bounds(),
            Self::Points(points) => points.bounds(),
        }
    }

    /// The interaction for a hit of `ray`, in the space the shape is placed in; see [`Geometry::interaction`].
    #[inline]
    pub(crate) fn interaction(&self, detail: Detail, ray: &Ray, hit: &Hit) -> Option<SurfaceInteraction> {
        match self {
            Self::Mesh(mesh) => mesh.interaction(detail, ray, hit),
            Self::Analytic(placed) => placed.interaction_with(detail, ray, hit),
            Self::Curves(_) | Self::Points(_) => self.many_interaction_and_dp_dv(detail, ray, hit).map(|(at, _)| at),
        }
    }

    /// The interaction with curves or points, with the change of the point with v. Apart, so that the code of other
    /// shapes stays small.
    #[inline(never)]
    fn many_interaction_and_dp_dv(&self, detail: Detail, ray: &Ray, hit: &Hit) -> Option<(SurfaceInteraction, Vec3)> {
        match self {
            Self::Curves(curves) => curves.interaction_and_dp_dv(ray, hit),
            Self::Points(points) => points.interaction_and_dp_dv(detail, ray, hit),
            Self::Mesh(_) | Self::Analytic(_) => None,
        }
    }

    /// The interaction with the change of the point with v.
    fn interaction_and_dp_dv(&self, ray: &Ray, hit: &Hit) -> Option<(SurfaceInteraction, Vec3)> {
        match self {
            Self::Mesh(mesh) => mesh.interaction_and_dp_dv(Detail::Full, ray, hit),
            Self::Analytic(placed) => placed.interaction_and_dp_dv(Detail::Full, ray, hit),
            Self::Curves(_) | Self::Points(_) => self.many_interaction_and_dp_dv(Detail::Full, ray, hit),
        }
    }

    /// The distance of the first hit with one of curves or points.
    #[inline(never)]
    fn many_distance(&self, ray: &Ray, prim: PrimId) -> Option<f32> {
        match self {
            Self::Curves(curves) => curves.intersect(prim, ray),
            Self::Points(points) => points.intersect(prim, ray),
            Self::Mesh(_) | Self::Analytic(_) => None,
        }
    }

    /// The hit of `ray` (in the space the shape is placed in) with one primitive. `occluded` queries use this very
    /// function.
    #[inline]
    pub fn intersect_prim(&self, ray: &Ray, shape: ShapeId, prim: PrimId) -> Option<Hit> {
        let instance = Hit::NO_INSTANCE;
        match self {
            Self::Mesh(mesh) => {
                let hit = mesh.triangle_points_at(prim, ray.time).intersect(ray)?;
                Some(Hit { t: hit.t, u: hit.u, v: hit.v, shape, prim, instance })
            }
            Self::Analytic(placed) => {
                let hit = placed.intersect(ray)?;
                Some(Hit { t: hit.t as f32, u: 0.0, v: 0.0, shape, prim, instance })
            }
            Self::Curves(_) | Self::Points(_) => {
                let t = self.many_distance(ray, prim)?;
                Some(Hit { t, u: 0.0, v: 0.0, shape, prim, instance })
            }
        }
    }
}

/// All geometry of a scene: shapes in the world, and objects that instances place any number of times.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Every shape, those of objects included.
    pub shapes: Vec<Shape>,
    /// The shapes that stand in the world directly.
    pub world: Vec<ShapeId>,
    /// Groups of shapes.
    pub objects: Vec<Object>,
    /// Placements of objects in the world.
    pub instances: Vec<Instance>,
    /// Which shapes have holes.
    pub cutouts: AlphaMasks,
}

impl Geometry {
    /// Whether an accelerator over this geometry serves the other one: all shapes and placements are the same, and
    /// neither has holes, which are textures.
    pub fn is_same(&self, other: &Self) -> bool {
        let Self { shapes, world, objects, instances, cutouts } = self;
        cutouts.is_empty()
            && other.cutouts.is_empty()
            && *world == other.world
            && *objects == other.objects
            && *instances == other.instances
            && *shapes == other.shapes
    }

    /// The shape with this id.
    #[inline]
    pub fn shape(&self, id: ShapeId) -> &Shape {
        &self.shapes[id.index()]
    }

    /// The instance with this id.
    #[inline]
    pub fn instance(&self, id: InstanceId) -> &Instance {
        &self.instances[id.index()]
    }

    /// The object with this id.
    #[inline]
    pub fn object(&self, id: ObjectId) -> &Object {
        &self.objects[id.index()]
    }

    /// Whether anything moves while the shutter is open.
    pub fn is_moving(&self) -> bool {
        let deforming = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if mesh.is_deforming());
        self.shapes.iter().any(deforming) || self.instances.iter().any(|instance| instance.motion.is_some())
    }

    /// The first hit that counts of `ray` with one primitive. `ray` is in the space the shape is placed in, through
    /// `instance`; `key` is that of the world-space ray. Any-hit queries use this very function.
    #[inline]
    pub fn intersect_prim(&self, ray: &Ray, key: u32, id: ShapeId, prim: PrimId, instance: InstanceId) -> Option<Hit> {
        let shape = self.shape(id);
        let mut ray = *ray;
        loop {
            let hit = Hit { instance, ..shape.intersect_prim(&ray, id, prim)? };
            if self.cutouts.counts(&self.shapes, key, &ray, &hit) {
                return Some(hit);
            }
            // A triangle is met once; behind a hole of another surface there may be more of it.
            ray.t_min = match shape {
                Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) if hit.t < ray.t_max => step_past(hit.t),
                _ => return None,
            };
        }
    }

    /// Bounds of everything; empty if there is nothing.
    pub fn bounds(&self) -> Aabb {
        let world = self.world.iter().fold(Aabb::EMPTY, |b, &id| b.union(&self.shape(id).bounds()));
        self.instances.iter().fold(world, |b, instance| {
            let object = self.object(instance.object);
            let inside = object.shapes.iter().fold(Aabb::EMPTY, |b, &id| b.union(&self.shape(id).bounds()));
            b.union(&instance.bounds(&inside))
        })
    }

    /// Bytes of mesh buffers and tables.
    pub fn memory_bytes(&self) -> usize {
        let shapes: usize = self
            .shapes
            .iter()
            .map(|shape| match shape {
                Shape::Mesh(mesh) => mesh.memory_bytes(),
                Shape::Analytic(_) => 0,
                Shape::Curves(curves) => curves.memory_bytes(),
                Shape::Points(points) => points.memory_bytes(),
            })
            .sum();
        shapes + self.shapes.len() * size_of::<Shape>() + self.instances.len() * size_of::<Instance>()
    }

    /// Everything that shading needs about a hit of `ray`, with the hit point recomputed in `f64`.
    ///
    /// `None` if the exact distance is not positive: the hit is a rounding artefact of the accelerator, and the caller
    /// looks again from [`step_past`] of `hit.t`.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Option<SurfaceInteraction> {
        self.interaction_with(Detail::Full, ray, hit)
    }

    /// [`interaction`](Self::interaction), or only the requested part of it.
    #[inline]
    pub fn interaction_with(&self, detail: Detail, ray: &Ray, hit: &Hit) -> Option<SurfaceInteraction> {
        if hit.instance == Hit::NO_INSTANCE {
            self.shape(hit.shape).interaction(detail, ray, hit)
        } else {
            self.instance(hit.instance).interaction(self.shape(hit.shape), detail, ray, hit)
        }
    }

    /// The point of the surface that a smooth mesh's normals suggest above a point of a facet, on the side of `toward`;
    /// `None` where it is not above the facet, and on other shapes.
    pub fn terminator_point(&self, at: &SurfaceInteraction, toward: Vec3) -> Option<DVec3> {
        let Shape::Mesh(mesh) = self.shape(at.shape) else { return None };
        let placement = at.is_instanced().then(|| self.instance(at.instance).transform_at(at.time));
        mesh.terminator_point(at.prim, at.p, toward.as_dvec3(), at.time, placement.as_deref())
    }

    /// Change of the point with v at a hit of `ray`, as [`SurfaceInteraction::dp_du`]; apart from the interaction, for
    /// few surfaces need it.
    #[inline(never)]
    pub fn dp_dv(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let local =
            |ray: &Ray| self.shape(hit.shape).interaction_and_dp_dv(ray, hit).map_or(Vec3::ZERO, |(_, dp_dv)| dp_dv);
        if hit.instance == Hit::NO_INSTANCE {
            return local(ray);
        }
        let instance = self.instance(hit.instance);
        let dp_dv = local(&instance.object_ray(ray));
        instance::finite_or_zero(instance.transform_at(ray.time).vector(dp_dv.as_dvec3()).as_vec3())
    }

    /// Area in uv per area of the surface at a hit of `ray`. Not finite, or zero, where uv do not span the surface.
    #[inline(never)]
    pub fn uv_density(&self, ray: &Ray, hit: &Hit) -> f32 {
        let local = |ray: &Ray| match self.shape(hit.shape) {
            Shape::Mesh(mesh) => mesh.edges_and_uv_area(hit.prim, ray.time),
            shape => {
                let found = shape.interaction_and_dp_dv(ray, hit);
                (found.map_or([Vec3::ZERO; 2], |(at, dp_dv)| [at.dp_du, dp_dv]), 1.0)
            }
        };
        let ([a, b], uv_area) = if hit.instance == Hit::NO_INSTANCE {
            let (edges, uv_area) = local(ray);
            (edges.map(Vec3::as_dvec3), uv_area)
        } else {
            let instance = self.instance(hit.instance);
            let transform = instance.transform_at(ray.time);
            let (edges, uv_area) = local(&instance.object_ray(ray));
            (edges.map(|edge| transform.vector(edge.as_dvec3())), uv_area)
        };
        uv_density(uv_area, a.cross(b).length())
    }
}
