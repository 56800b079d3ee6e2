//! The search of every triangle as a course framework has it: each test multiplies three matrices for each of three
//! corners.

use std::hint::black_box;

use super::search::Search;
use super::{Forest, MeshTree};
use crate::accel::Accelerator;
use crate::geometry::{Geometry, Hit, Mesh};
use crate::math::{Aabb, Ray, Vec3};

/// A search of every triangle with the framework's cost for each test.
pub struct MatrixLinear<'g>(Forest<'g, Triangles>);

struct Triangles {
    corners: Vec<[Vec3; 3]>,
    /// The mesh's place: translation, rotation, scale. All are one, so that the answers stay those of the other
    /// accelerators.
    place: [Matrix; 3],
}

type Matrix = [[f32; 4]; 4];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

impl<'g> MatrixLinear<'g> {
    /// Over the meshes of the world.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self(Forest::new(geometry, "linear with matrices", |mesh: &Mesh| {
            let points = |prim| mesh.triangle_points(crate::id::PrimId::new(prim));
            let corners = (0..mesh.triangles().len()).map(points).map(|p| [p.a, p.b, p.c]).collect();
            Triangles { corners, place: [IDENTITY; 3] }
        }))
    }
}

/// Row by column.
fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

fn moved(m: &Matrix, p: Vec3) -> Vec3 {
    let row = |i: usize| m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
    Vec3::new(row(0), row(1), row(2))
}

impl MeshTree for Triangles {
    fn visit(&self, search: &mut Search) {
        for (prim, corners) in (0..).zip(&self.corners) {
            for corner in corners {
                // The compiler must not see that it is the same every time.
                let [translation, rotation, scale] = black_box(&self.place);
                black_box(moved(&product(&product(translation, rotation), scale), *corner));
            }
            search.test(prim);
        }
    }

    fn memory_bytes(&self) -> usize {
        0
    }
}

super::delegate!(MatrixLinear);
