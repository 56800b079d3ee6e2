//! Shapes, meshes and rays that checks share.

use std::f64::consts::{PI, TAU};

use crate::accel::Accelerator;
use crate::geometry::{
    Analytic, Disk, Frustum, Geometry, Hit, Instance, Mesh, Object, Profile, Quad, Revolution, Shape, Sphere,
    SurfaceInteraction, TransformedShape,
};
use crate::id::{ObjectId, ShapeId};
pub use crate::math::Rng;
use crate::math::float::step_past;
use crate::math::{DMat3, DVec3, Ray, Transform, Vec3};

/// Shapes of checks and tests are written there, not by users.
const VALID: &str = "shapes of checks are valid";

/// A mesh from positions in `f64`.
///
/// # Panics
/// If it is no [`Mesh`].
pub fn mesh(positions: &[DVec3], triangles: Vec<[u32; 3]>) -> Mesh {
    let positions = positions.iter().map(|p| p.as_vec3().to_array()).collect();
    Mesh::new(positions, triangles, None, None).expect(VALID)
}

/// One triangle.
pub fn triangle(a: DVec3, b: DVec3, c: DVec3) -> Mesh {
    mesh(&[a, b, c], vec![[0, 1, 2]])
}

/// `count` triangles of about the given size in the unit cube.
pub fn soup(rng: &mut Rng, count: usize, size: f64) -> Mesh {
    let mut positions = Vec::with_capacity(3 * count);
    for _ in 0..count {
        let center = rng.cube();
        positions.extend((0..3).map(|_| center + size * rng.cube()));
    }
    mesh(&positions, (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A closed sphere of latitude rings, with front faces outside.
pub fn sphere_mesh(center: DVec3, radius: f64, slices: u32, rings: u32) -> Mesh {
    let mut positions = vec![center + radius * DVec3::Z];
    for ring in 1..rings {
        let (sin_theta, cos_theta) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        for slice in 0..slices {
            let (sin, cos) = (TAU * f64::from(slice) / f64::from(slices)).sin_cos();
            positions.push(center + radius * DVec3::new(sin_theta * cos, sin_theta * sin, cos_theta));
        }
    }
    positions.push(center - radius * DVec3::Z);
    let last = positions.len() as u32 - 1;
    let at = |ring: u32, slice: u32| match ring {
        0 => 0,
        r if r == rings => last,
        r => 1 + (r - 1) * slices + slice % slices,
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for slice in 0..slices {
            let [a, b] = [at(ring, slice), at(ring, slice + 1)];
            let [c, d] = [at(ring + 1, slice), at(ring + 1, slice + 1)];
            if ring + 1 < rings {
                triangles.push([a, c, d]);
            }
            if ring > 0 {
                triangles.push([a, d, b]);
            }
        }
    }
    mesh(&positions, triangles)
}

/// A square grid of `n` by `n` cells: `origin + i / n * x + j / n * y`, raised by `height(i / n, j / n)` along z.
pub fn grid(origin: DVec3, x: DVec3, y: DVec3, n: u32, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let mut positions = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            positions.push(origin + x * s + y * t + DVec3::Z * height(s, t));
        }
    }
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = cells
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    mesh(&positions, triangles.collect())
}

/// The cube `[-1, 1]³` after a linear map and a translation, with front faces outside.
pub fn cube(linear: DMat3, center: DVec3) -> Mesh {
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)) * 2.0 - 1.0;
    let positions: Vec<DVec3> = (0..8).map(|i| linear * corner(i) + center).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    mesh(&positions, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// Shapes in the world.
pub fn world(shapes: Vec<Shape>) -> Geometry {
    let world = (0..shapes.len()).map(ShapeId::new).collect();
    Geometry { shapes, world, ..Geometry::default() }
}

/// Meshes in the world.
pub fn meshes(meshes: Vec<Mesh>) -> Geometry {
    world(meshes.into_iter().map(Shape::Mesh).collect())
}

/// One object of these shapes with an instance for each transform.
pub fn instances(shapes: Vec<Shape>, transforms: &[Transform]) -> Geometry {
    let objects = vec![Object { shapes: (0..shapes.len()).map(ShapeId::new).collect() }];
    let instances = transforms.iter().map(|&transform| Instance::new(ObjectId(0), transform)).collect();
    Geometry { shapes, objects, instances, ..Geometry::default() }
}

/// An instance's transform from its parts.
///
/// # Panics
/// If the linear part is singular.
pub fn transform(linear: DMat3, translation: DVec3) -> Transform {
    Transform::new(crate::math::DAffine3 { matrix3: linear, translation }).expect(VALID)
}

/// Analytic shapes of every kind, each reaching no farther than about 2 from the origin.
pub fn all_analytic_shapes() -> Vec<(&'static str, Analytic)> {
    let vase = Profile::bezier(&[[0.2, -0.9], [1.1, -0.5], [0.1, 0.2], [0.6, 0.9]]).expect(VALID);
    vec![
        ("sphere", Analytic::Sphere(Sphere::full(1.0).expect(VALID))),
        ("clipped sphere", Analytic::Sphere(Sphere::new(1.0, -0.4, 0.7, 4.0).expect(VALID))),
        (
            "quad",
            Analytic::Quad(
                Quad::new(DVec3::new(-1.0, -0.5, 0.1), DVec3::new(2.0, 0.1, 0.0), DVec3::new(0.3, 1.0, 0.2))
                    .expect(VALID),
            ),
        ),
        ("disk", Analytic::Disk(Disk::new(1.0, 0.0, TAU).expect(VALID))),
        ("ring sector", Analytic::Disk(Disk::new(1.0, 0.4, 2.5).expect(VALID))),
        ("cylinder", Analytic::Frustum(Frustum::cylinder(0.6, 1.5, TAU).expect(VALID))),
        ("cone", Analytic::Frustum(Frustum::new(0.8, 0.0, 1.2, TAU).expect(VALID))),
        ("frustum sector", Analytic::Frustum(Frustum::new(0.8, 0.3, 1.2, 4.5).expect(VALID))),
        ("revolution", Analytic::Revolution(Revolution::new(&vase, TAU).expect(VALID))),
        ("revolution sector", Analytic::Revolution(Revolution::new(&vase, 3.5).expect(VALID))),
    ]
}

/// One of each analytic shape, turned and moved, in a cube of half size 4 around `center`.
pub fn placed_analytic_shapes(rng: &mut Rng, center: DVec3) -> Vec<Shape> {
    let place =
        |shape| Shape::Analytic(TransformedShape::new(shape, transform(rng.rotation(), center + 2.0 * rng.cube())));
    all_analytic_shapes().into_iter().map(|(_, shape)| shape).map(place).collect()
}

/// What [`closest`] found.
pub struct Closest {
    /// The surface, if any.
    pub found: Option<SurfaceInteraction>,
    /// How many false hits were passed.
    pub retraces: usize,
}

/// The closest hit that stands in `f64`: a false one is stepped past.
pub fn closest(accel: &dyn Accelerator, geometry: &Geometry, ray: &Ray) -> Closest {
    let mut ray = *ray;
    for retraces in 0..64 {
        let Some(hit) = accel.intersect(&ray) else { return Closest { found: None, retraces } };
        if let Some(found) = geometry.interaction(&ray, &hit) {
            return Closest { found: Some(found), retraces };
        }
        ray.t_min = step_past(hit.t);
    }
    Closest { found: None, retraces: 64 }
}

/// A ray between `f64` points, from `from` towards `through` with `t = 1` there.
pub fn ray_through(from: DVec3, through: DVec3) -> Ray {
    let origin = from.as_vec3();
    Ray::new(origin, (through - origin.as_dvec3()).as_vec3())
}

/// A ray of unit direction.
pub fn ray(origin: DVec3, direction: DVec3) -> Ray {
    Ray::new(origin.as_vec3(), direction.as_vec3())
}

/// The ids of a hit, to compare.
pub fn ids(hit: &Hit) -> (u32, u32, u32) {
    (hit.instance.0, hit.shape.0, hit.prim.0)
}

/// The largest distance along an axis from the origin of `ray` to a corner of the triangle hit, in its own space; zero
/// on analytic shapes.
pub fn reach(geometry: &Geometry, ray: &Ray, hit: &Hit) -> f64 {
    let Shape::Mesh(mesh) = geometry.shape(hit.shape) else { return 0.0 };
    let points = mesh.triangle_points(hit.prim);
    let origin =
        if hit.instance == Hit::NO_INSTANCE { *ray } else { geometry.instance(hit.instance).object_ray(ray) }.origin;
    let far = |p: Vec3| (p - origin).abs().max_element();
    f64::from(far(points.a).max(far(points.b)).max(far(points.c)))
}
