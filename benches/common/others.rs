//! Accelerators of other crates over one mesh, each used as its documentation shows.

use std::time::Duration;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use nalgebra::{Point3, Vector3};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use steradian::internal::geometry::Mesh;
use steradian::internal::math::Ray;

/// Traces the rays of the benchmarks.
pub trait Other {
    /// The triangle hit first, and its distance.
    fn closest(&self, ray: &Ray) -> Option<(u32, f32)>;

    /// Whether there is any hit.
    fn any(&self, ray: &Ray) -> bool;
}

/// Crate `bvh`: a binary hierarchy, flattened.
pub struct BvhCrate {
    triangles: Vec<BvhTriangle>,
    tree: bvh::bvh::Bvh<f32, 3>,
}

struct BvhTriangle {
    corners: [Point3<f32>; 3],
    node: usize,
}

impl Bounded<f32, 3> for BvhTriangle {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.corners.iter().fold(Aabb::empty(), |all, p| all.grow(p))
    }
}

impl BHShape<f32, 3> for BvhTriangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl BvhCrate {
    /// Built in parallel.
    pub fn new(mesh: &Mesh) -> Self {
        let corners = |t: &[u32; 3]| t.map(|i| Point3::from(mesh.positions()[i as usize]));
        let mut triangles: Vec<_> =
            mesh.triangles().iter().map(|t| BvhTriangle { corners: corners(t), node: 0 }).collect();
        let tree = bvh::bvh::Bvh::build_par(&mut triangles);
        Self { triangles, tree }
    }

    fn ray(ray: &Ray) -> bvh::ray::Ray<f32, 3> {
        let [o, d] = [ray.origin.to_array(), ray.direction.to_array()];
        bvh::ray::Ray::new(Point3::from(o), Vector3::from(d))
    }

    fn distance(ray: &Ray, of: &bvh::ray::Ray<f32, 3>, triangle: &BvhTriangle, scale: f32) -> Option<f32> {
        let [a, b, c] = &triangle.corners;
        // Its test culls one side, so both orders are traced; its rays are normalised.
        let t = of.intersects_triangle(a, b, c).distance.min(of.intersects_triangle(a, c, b).distance) * scale;
        (t.is_finite() && t >= ray.t_min && t <= ray.t_max).then_some(t)
    }
}

impl Other for BvhCrate {
    fn closest(&self, ray: &Ray) -> Option<(u32, f32)> {
        let query = Self::ray(ray);
        let scale = 1.0 / ray.direction.length();
        let mut best: Option<(u32, f32)> = None;
        for triangle in self.tree.nearest_traverse_iterator(&query, &self.triangles) {
            // Triangles come in the order in which the ray enters their boxes.
            if let (Some((_, t)), Some((enter, _))) = (best, query.intersection_slice_for_aabb(&triangle.aabb()))
                && enter * scale > t
            {
                break;
            }
            if let Some(t) = Self::distance(ray, &query, triangle, scale)
                && best.is_none_or(|(_, nearest)| t < nearest)
            {
                let index =
                    (std::ptr::from_ref(triangle).addr() - self.triangles.as_ptr().addr()) / size_of::<BvhTriangle>();
                best = Some((index as u32, t));
            }
        }
        best
    }

    fn any(&self, ray: &Ray) -> bool {
        let query = Self::ray(ray);
        let scale = 1.0 / ray.direction.length();
        self.tree
            .traverse_iterator(&query, &self.triangles)
            .any(|triangle| Self::distance(ray, &query, triangle, scale).is_some())
    }
}

/// Crate `obvhs`: a compressed wide hierarchy, triangles in the order of its leaves.
pub struct ObvhsCrate {
    triangles: Vec<obvhs::triangle::Triangle>,
    tree: CwBvh,
}

impl ObvhsCrate {
    /// With its parameters for slow builds and fast rays.
    pub fn new(mesh: &Mesh) -> Self {
        let vertex = |i: u32| glam::Vec3A::from(mesh.positions()[i as usize]);
        let triangle =
            |t: &[u32; 3]| obvhs::triangle::Triangle { v0: vertex(t[0]), v1: vertex(t[1]), v2: vertex(t[2]) };
        let all: Vec<_> = mesh.triangles().iter().map(triangle).collect();
        let tree = build_cwbvh_from_tris(&all, obvhs::BvhBuildParams::slow_build(), &mut Duration::default());
        let triangles = tree.primitive_indices.iter().map(|i| all[*i as usize]).collect();
        Self { triangles, tree }
    }

    fn ray(ray: &Ray) -> obvhs::ray::Ray {
        let [o, d] = [ray.origin.to_array(), ray.direction.to_array()].map(glam::Vec3A::from);
        obvhs::ray::Ray::new(o, d, ray.t_min, ray.t_max)
    }
}

impl Other for ObvhsCrate {
    fn closest(&self, ray: &Ray) -> Option<(u32, f32)> {
        let mut hit = RayHit::none();
        let found = self.tree.ray_traverse(Self::ray(ray), &mut hit, |ray, index| self.triangles[index].intersect(ray));
        found.then(|| (self.tree.primitive_indices[hit.primitive_id as usize], hit.t))
    }

    fn any(&self, ray: &Ray) -> bool {
        !self.tree.ray_traverse_miss(Self::ray(ray), |ray, index| self.triangles[index].intersect(ray))
    }
}
