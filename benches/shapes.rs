//! Nanoseconds per ray of analytic shapes: the test alone, through Embree as user geometry, and of a mesh of the same
//! sphere through Embree. Answers are compared before anything is timed. One thread. At the end a table of surfaces of
//! revolution by the number of their segments and the kind of ray, beside a sphere.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use steradian::internal::accel::{self, AccelKind, Accelerator};
use steradian::internal::geometry::{
    Analytic, Disk, Frustum, Geometry, Hit, Profile, Quad, Revolution, Shape, Sphere, TransformedShape,
};
use steradian::internal::id::{PrimId, ShapeId};
use steradian::internal::math::{DVec3, Ray, Rng, Transform, Vec3};
use steradian_benches::models::tessellated_sphere;

const RAYS: usize = 16_384;

fn shapes() -> Vec<(&'static str, Analytic)> {
    let vase = Profile::bezier(&[[0.2, -0.9], [1.1, -0.5], [0.1, 0.2], [0.6, 0.9]]).expect("a profile");
    let quad = Quad::new(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y);
    vec![
        ("sphere", Analytic::Sphere(Sphere::full(1.0).expect("valid"))),
        ("disk", Analytic::Disk(Disk::new(1.0, 0.0, TAU).expect("valid"))),
        ("ring", Analytic::Disk(Disk::new(1.0, 0.4, 5.0).expect("valid"))),
        ("quad", Analytic::Quad(quad.expect("valid"))),
        ("cylinder", Analytic::Frustum(Frustum::cylinder(0.6, 1.5, TAU).expect("valid"))),
        ("cone", Analytic::Frustum(Frustum::new(0.8, 0.0, 1.2, TAU).expect("valid"))),
        ("revolution", Analytic::Revolution(Revolution::new(&vase, TAU).expect("valid"))),
    ]
}

fn world(shape: Analytic) -> Geometry {
    let shapes = vec![Shape::Analytic(TransformedShape::new(shape, Transform::IDENTITY))];
    Geometry { shapes, world: vec![ShapeId(0)], ..Geometry::default() }
}

/// From a sphere of radius 3 to points of the bounds.
fn rays(geometry: &Geometry) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let mut random = Rng::new(3);
    let ray = |_| {
        let from = 3.0 * random.direction().as_vec3();
        let at = [random.unit(), random.unit(), random.unit()].map(|u| u as f32);
        let to = bounds.min + bounds.size() * Vec3::from(at);
        Ray::new(from, (to - from).normalize())
    };
    (0..RAYS).map(ray).collect()
}

fn shape_tests(criterion: &mut Criterion) {
    for (name, shape) in shapes() {
        let geometry = world(shape);
        let rays = rays(&geometry);
        let embree = accel::build(AccelKind::EMBREE, &geometry, 1).expect("builds");
        let direct = |ray: &Ray| geometry.intersect_prim(ray, 0, ShapeId(0), PrimId(0), Hit::NO_INSTANCE);
        let hits = rays.iter().filter(|ray| direct(ray).is_some()).count();
        assert!(hits > RAYS / 10, "{name}: {hits}");
        for ray in &rays {
            assert_eq!(direct(ray), embree.intersect(ray), "{name}: {ray:?}");
        }
        let mut group = criterion.benchmark_group(format!("shapes/{name}"));
        group.sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(1000));
        group.throughput(Throughput::Elements(RAYS as u64));
        group.bench_function("test alone", |b| {
            b.iter(|| black_box(&rays).iter().filter(|ray| direct(ray).is_some()).count());
        });
        group.bench_function("embree", |b| {
            b.iter(|| black_box(&rays).iter().filter(|ray| embree.intersect(ray).is_some()).count());
        });
        if name == "sphere" {
            for cells in [4, 16, 64] {
                let mesh = tessellated_sphere(cells);
                let accel = accel::build(AccelKind::EMBREE, &mesh, 1).expect("builds");
                // The mesh is inscribed: a ray that hits it hits the sphere.
                let count = |accel: &dyn Accelerator| rays.iter().filter(|ray| accel.intersect(ray).is_some()).count();
                let found = count(&*accel);
                assert!(found <= hits && found * 100 > hits * (99 - 80 / cells as usize), "{found} of {hits}");
                let triangles = mesh.shapes[0].prim_count();
                group
                    .bench_function(format!("embree, {triangles} triangles"), |b| b.iter(|| count(black_box(&*accel))));
            }
        }
        group.finish();
    }
}

/// A wavy column of a number of cubic segments, as a B-spline.
fn column(segments: usize) -> Analytic {
    let points: Vec<[f64; 2]> = (0..segments + 3)
        .map(|i| {
            let s = (i as f64 - 1.0) / segments as f64;
            [0.6 + 0.25 * (7.0 * s).sin(), 2.0 * s - 1.0]
        })
        .collect();
    Analytic::Revolution(Revolution::new(&Profile::b_spline(&points).expect("a profile"), TAU).expect("valid"))
}

/// The best of many passes over `rays`, in nanoseconds per ray.
fn nanoseconds(shape: &TransformedShape, rays: &[Ray]) -> f64 {
    let end = Instant::now() + Duration::from_millis(300);
    let mut best = f64::INFINITY;
    while Instant::now() < end {
        let start = Instant::now();
        black_box(black_box(rays).iter().filter(|ray| shape.intersect(ray).is_some()).count());
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / rays.len() as f64);
    }
    best
}

/// Rays from afar that hit and that pass through the bounds without, level rays, rays along the axis.
fn kinds_of_rays(geometry: &Geometry, shape: &TransformedShape) -> Vec<(&'static str, Vec<Ray>)> {
    let (hits, misses): (Vec<Ray>, Vec<Ray>) =
        rays(geometry).into_iter().partition(|ray| shape.intersect(ray).is_some());
    let mut random = Rng::new(4);
    let mut through = |direction: fn(DVec3) -> DVec3| -> Vec<Ray> {
        let mut ray = |_| {
            let d = direction(random.direction()).normalize();
            Ray::new(
                (shape.shape.sample([random.unit(), random.unit()]).p + 0.05 * random.cube() - 3.0 * d).as_vec3(),
                d.as_vec3(),
            )
        };
        (0..4_096).map(&mut ray).collect()
    };
    let (level, axial) = (through(|d| DVec3::new(d.x, 0.0, d.z)), through(|_| DVec3::Y));
    vec![("hit", hits), ("miss", misses), ("level", level), ("axial", axial)]
}

fn revolution_table(_: &mut Criterion) {
    println!("ns per ray           hit   miss  level  axial");
    let sphere = ("sphere".to_owned(), Analytic::Sphere(Sphere::full(1.0).expect("valid")));
    for (name, shape) in std::iter::once(sphere).chain([1, 2, 4, 8, 16].map(|n| (format!("{n} segments"), column(n)))) {
        let placed = TransformedShape::new(shape.clone(), Transform::IDENTITY);
        let cells = kinds_of_rays(&world(shape), &placed);
        let cells: String = cells.iter().map(|(_, rays)| format!("{:7.0}", nanoseconds(&placed, rays))).collect();
        println!("{name:<17}{cells}");
    }
}

criterion_group!(benches, shape_tests, revolution_table);
criterion_main!(benches);
