//! Accelerators as in course reports, to separate the gain of the tree itself from that of its optimisation.
//!
//! They are built over the triangles of the meshes in the world, one tree for each mesh, with boxed children, visited
//! recursively or through a queue. They test triangles with the function that all other accelerators use, so their
//! answers are the oracle's bit for bit.

/// Makes a tuple around a forest an accelerator.
macro_rules! delegate {
    ($name:ident) => {
        impl $name<'_> {
            /// Triangles tested for the closest hit of a ray.
            pub fn tests(&self, ray: &Ray) -> u64 {
                self.0.tests(ray)
            }
        }

        impl Accelerator for $name<'_> {
            fn intersect(&self, ray: &Ray) -> Option<Hit> {
                self.0.intersect(ray)
            }

            fn occluded(&self, ray: &Ray) -> bool {
                self.0.occluded(ray)
            }

            fn bounds(&self) -> Aabb {
                self.0.bounds()
            }

            fn memory_bytes(&self) -> usize {
                self.0.memory_bytes()
            }

            fn description(&self) -> String {
                self.0.description()
            }
        }
    };
}

use delegate;

mod bvh;
mod kdtree;
mod linear;
mod octree;
mod search;

pub use bvh::NaiveBvh;
pub use kdtree::NaiveKdTree;
pub use linear::MatrixLinear;
pub use octree::NaiveOctree;

use crate::accel::Accelerator;
use crate::geometry::{Geometry, Hit, Mesh, Shape};
use crate::id::ShapeId;
use crate::math::{Aabb, Ray};
use search::Search;

/// A tree over one mesh.
trait MeshTree: Send + Sync {
    /// Tests every triangle that the tree does not rule out.
    fn visit(&self, search: &mut Search);

    /// Bytes of nodes and lists.
    fn memory_bytes(&self) -> usize;
}

/// One tree for each mesh, every one of them visited.
struct Forest<'g, T> {
    geometry: &'g Geometry,
    trees: Vec<(ShapeId, T)>,
    name: &'static str,
}

impl<'g, T> Forest<'g, T> {
    /// Other shapes and instances are left out.
    fn new(geometry: &'g Geometry, name: &'static str, build: impl Fn(&Mesh) -> T) -> Self {
        let tree = |id: &ShapeId| match geometry.shape(*id) {
            Shape::Mesh(mesh) => Some((*id, build(mesh))),
            Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => None,
        };
        Self { geometry, trees: geometry.world.iter().filter_map(tree).collect(), name }
    }
}

impl<'g, T: MeshTree> Forest<'g, T> {
    fn search(&self, ray: &Ray) -> Option<Search<'g>> {
        if !ray.is_valid() {
            return None;
        }
        let mut search = Search::new(self.geometry, ray);
        for (shape, tree) in &self.trees {
            search.shape = *shape;
            tree.visit(&mut search);
        }
        Some(search)
    }

    fn tests(&self, ray: &Ray) -> u64 {
        self.search(ray).map_or(0, |search| search.tests)
    }
}

impl<T: MeshTree> Accelerator for Forest<'_, T> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.search(ray)?.best
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.intersect(ray).is_some()
    }

    fn bounds(&self) -> Aabb {
        self.geometry.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.trees.iter().map(|(_, tree)| tree.memory_bytes()).sum()
    }

    fn description(&self) -> String {
        format!("{}, scalar", self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::LinearAccel;
    use crate::math::Vec3;
    use crate::mesh::{bumpy_sphere, head};

    fn rays() -> Vec<Ray> {
        let at = |i: usize| (i as f32 + 0.5) / 30.0 * 3.0 - 1.5;
        let eye = Vec3::new(0.3, -3.0, 0.4);
        let toward = |i: usize| Ray::new(eye, Vec3::new(at(i % 30), 0.0, at(i / 30)) - eye);
        let across = |i: usize| Ray::new(Vec3::new(at(i % 30), at(i / 30), -2.0), Vec3::Z);
        let inside = |i: usize| Ray::new(Vec3::ZERO, Vec3::new(at(i % 30), 1.0, at(i / 30)));
        (0..900).flat_map(|i| [toward(i), across(i), inside(i)]).collect()
    }

    #[test]
    fn every_one_answers_as_the_oracle_does() {
        let shapes = vec![Shape::Mesh(head(968)), Shape::Mesh(bumpy_sphere(700))];
        let geometry = Geometry { world: (0..2).map(ShapeId::new).collect(), shapes, ..Geometry::default() };
        let oracle = LinearAccel::new(&geometry);
        let all: [Box<dyn Accelerator + '_>; 4] = [
            Box::new(NaiveOctree::new(&geometry)),
            Box::new(NaiveKdTree::new(&geometry)),
            Box::new(NaiveBvh::new(&geometry)),
            Box::new(MatrixLinear::new(&geometry)),
        ];
        for accel in &all {
            let mut hits = 0;
            for ray in rays() {
                assert_eq!(accel.intersect(&ray), oracle.intersect(&ray), "{}: {ray:?}", accel.description());
                hits += usize::from(accel.occluded(&ray));
            }
            assert!(hits > 1500, "{}: {hits}", accel.description());
        }
    }

    #[test]
    fn the_wrong_range_of_leaves_loses_only_the_first_leaf() {
        let geometry = crate::mesh::sphere_geometry(968);
        let (right, wrong) = (NaiveBvh::new(&geometry), NaiveBvh::with_wrong_leaves(&geometry));
        let lost = rays().iter().filter(|ray| right.intersect(ray) != wrong.intersect(ray)).count();
        let hits = rays().iter().filter(|ray| right.occluded(ray)).count();
        assert!(lost * 20 < hits, "{lost} of {hits}");
    }
}
