//! Ray queries on hills of 260 000 triangles, in rays per second. The answers are compared before anything is timed.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use steradian::accel::{Accelerator, Coherence, EmbreeAccel};
use steradian::geometry::{Geometry, Hit, Mesh, Shape, SpawnTarget};
use steradian::id::ShapeId;
use steradian::math::{DVec3, Ray, Vec3};

/// Cells along each side.
const CELLS: u32 = 361;

/// Pixels along each side, in blocks of 4 by 4.
const RESOLUTION: usize = 1024;

fn hills() -> Geometry {
    let height = |x: f32, y: f32| 0.05 * (9.0 * x).sin() * (7.0 * y).cos() + 0.01 * (61.0 * x + 13.0 * y).sin() * (53.0 * y).cos();
    let vertex = |i: u32, j: u32| {
        let (x, y) = (i as f32 / CELLS as f32, j as f32 / CELLS as f32);
        [x, y, height(x, y)]
    };
    let positions = (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| vertex(i, j))).collect();
    let at = |i: u32, j: u32| j * (CELLS + 1) + i;
    let cell = |i: u32, j: u32| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles = (0..CELLS).flat_map(|j| (0..CELLS).flat_map(move |i| cell(i, j))).collect();
    let mesh = Mesh::new(positions, triangles, None, None).expect("a valid mesh");
    Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() }
}

fn camera_rays() -> Vec<Ray> {
    let eye = Vec3::new(-0.3, -0.4, 0.8);
    let forward = (Vec3::new(0.5, 0.5, 0.0) - eye).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let up = right.cross(forward);
    let blocks = RESOLUTION / 4;
    let pixel = |n: usize| {
        let (block, within) = (n / 16, n % 16);
        let x = (block % blocks) * 4 + within % 4;
        let y = (block / blocks) * 4 + within / 4;
        let at = |p: usize| (p as f32 + 0.5) / RESOLUTION as f32 - 0.5;
        Ray::new(eye, (forward + 0.8 * (right * at(x) + up * at(y))).normalize())
    };
    (0..RESOLUTION * RESOLUTION).map(pixel).collect()
}

/// Rays that leave the hit points anyhow, and shadow rays from there to one point.
fn secondary_rays(geometry: &Geometry, rays: &[Ray], hits: &[Option<Hit>]) -> (Vec<Ray>, Vec<Ray>) {
    let light = SpawnTarget { p: DVec3::new(0.2, 0.7, 0.5), n: Vec3::ZERO, error: 0.0 };
    let (mut bounces, mut shadows) = (Vec::new(), Vec::new());
    for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let Some(si) = hit.and_then(|hit| geometry.interaction(ray, &hit)) else { continue };
        // A low-discrepancy walk over directions, far from neighbour to neighbour.
        let (u, v) = ((i as f32 * 0.618_034) % 1.0, (i as f32 * 0.754_877_7) % 1.0);
        let (sin, cos) = (std::f32::consts::TAU * u).sin_cos();
        let direction = Vec3::new(cos * v.sqrt(), sin * v.sqrt(), (1.0 - v).sqrt());
        bounces.push(si.spawn(direction));
        shadows.push(si.spawn_to(&light));
    }
    (bounces, shadows)
}

fn queries(criterion: &mut Criterion) {
    let geometry = hills();
    let accel = EmbreeAccel::new(&geometry, 0).expect("Embree builds");
    let rays = camera_rays();
    let mut hits = vec![None; rays.len()];
    accel.intersect_batch(&rays, &mut hits, Coherence::Coherent);
    for (ray, hit) in rays.iter().zip(&hits) {
        let single = accel.intersect(ray);
        assert_eq!(single.map(|h| h.prim), hit.map(|h| h.prim), "packets and single rays must agree");
    }
    let (bounces, shadows) = secondary_rays(&geometry, &rays, &hits);
    assert!(bounces.len() > rays.len() / 4);
    let mut occluded = vec![false; shadows.len()];
    accel.occluded_batch(&shadows, &mut occluded, Coherence::Coherent);
    assert!(shadows.iter().zip(&occluded).all(|(ray, occluded)| accel.occluded(ray) == *occluded));

    let mut group = criterion.benchmark_group("accel");
    group.sample_size(10);
    for (name, rays, coherence) in [
        ("camera/coherent", &rays, Coherence::Coherent),
        ("camera/single", &rays, Coherence::Incoherent),
        ("bounce/coherent", &bounces, Coherence::Coherent),
        ("bounce/single", &bounces, Coherence::Incoherent),
    ] {
        group.throughput(Throughput::Elements(rays.len() as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| accel.intersect_batch(black_box(rays), black_box(&mut hits[..rays.len()]), coherence));
        });
    }
    for (name, coherence) in [("shadow/coherent", Coherence::Coherent), ("shadow/single", Coherence::Incoherent)] {
        group.throughput(Throughput::Elements(shadows.len() as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| accel.occluded_batch(black_box(&shadows), black_box(&mut occluded), coherence));
        });
    }
    group.finish();
}

criterion_group!(benches, queries);
criterion_main!(benches);
