//! Rays per second of every accelerator, and of two other crates, on a lumpy mesh of 70,000 triangles and on scans
//! where they are at hand. The answers are compared before anything is timed. One thread.

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use steradian::internal::accel::{self, AccelKind, Accelerator, AnyHitRays, HitRows};
use steradian::internal::math::RayRows;
use steradian::internal::math::rows::BATCH;
use steradian_benches::models::{Model, hare, scans};
use steradian_benches::others::{BvhCrate, ObvhsCrate, Other};
use steradian_benches::rays::{RaySet, ray_sets};

/// Pixels along each side of the picture that the rays are of.
const RESOLUTION: usize = 128;

const ACCELERATORS: [&str; 6] = ["embree", "bvh", "bvh:binary", "kdtree", "kdtree:median", "octree"];

/// Rays that the linear oracle answers too.
const ORACLE_RAYS: usize = 64;

fn agree(
    model: &Model,
    set: &RaySet,
    accels: &[(AccelKind, Box<dyn Accelerator + '_>)],
    others: &[(&str, Box<dyn Other>)],
) {
    let linear = accel::build(AccelKind::Linear, &model.geometry, 1).expect("builds");
    let (_, reference) = accels.iter().find(|(kind, _)| kind.to_string() == "bvh").expect("in the list");
    for ray in set.rays.iter().step_by((set.rays.len() / ORACLE_RAYS).max(1)) {
        assert_eq!(linear.intersect(ray), reference.intersect(ray), "{ray:?}");
    }
    let answers: Vec<_> = set.rays.iter().map(|ray| reference.intersect(ray)).collect();
    for (kind, accel) in accels {
        let mut different = 0;
        for (ray, expected) in set.rays.iter().zip(&answers) {
            let found = accel.intersect(ray);
            assert_eq!(found.is_some(), accel.occluded(ray), "{kind}: {ray:?}");
            match kind {
                AccelKind::Embree(_) | AccelKind::Hybrid(_) => {
                    different += usize::from(found.map(|h| h.prim) != expected.map(|h| h.prim));
                }
                _ => assert_eq!(found, *expected, "{kind}: {ray:?}"),
            }
        }
        assert!(different * 1000 <= set.rays.len(), "{kind}: {different} of {} answers differ", set.rays.len());
    }
    for (name, other) in others {
        let (mut again, mut different) = (0, 0);
        for (ray, expected) in set.rays.iter().zip(&answers) {
            match other.closest(ray) {
                // They test triangles in f32, and not watertight: some rays find the surface again that they leave.
                Some((prim, t)) if Some(prim) != expected.map(|h| h.prim.0) && t < 1e-3 => again += 1,
                found => different += usize::from(found.map(|(prim, _)| prim) != expected.map(|h| h.prim.0)),
            }
        }
        let count = set.rays.len();
        assert!(different * 100 <= count, "{name}: {different} of {count} answers differ");
        println!(
            "{}, {}: {name} differs on {different} of {count} rays and finds the surface again that they leave on \
             {again}",
            model.name, set.name
        );
    }
}

fn time(
    group: &mut BenchmarkGroup<WallTime>,
    name: &str,
    set: &RaySet,
    closest: impl Fn(&steradian::internal::math::Ray) -> bool,
) {
    group.throughput(Throughput::Elements(set.rays.len() as u64));
    group.bench_function(name, |bencher| {
        bencher.iter(|| black_box(&set.rays).iter().filter(|ray| closest(ray)).count());
    });
}

fn queries(criterion: &mut Criterion) {
    for model in std::iter::once(hare(93)).chain(scans()) {
        let geometry = &model.geometry;
        let accels: Vec<_> = ACCELERATORS
            .iter()
            .map(|name| name.parse::<AccelKind>().expect("a name"))
            .map(|kind| (kind, accel::build(kind, geometry, 0).expect("builds")))
            .collect();
        let others: Vec<(&str, Box<dyn Other>)> = vec![
            ("crate bvh", Box::new(BvhCrate::new(model.mesh()))),
            ("crate obvhs", Box::new(ObvhsCrate::new(model.mesh()))),
        ];
        for set in ray_sets(&model, &*accels[0].1, RESOLUTION) {
            agree(&model, &set, &accels, &others);
            let mut group = criterion.benchmark_group(format!("{}/{}", model.name, set.name));
            group.sampling_mode(SamplingMode::Flat).sample_size(10);
            group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(600));
            for (kind, accel) in &accels {
                let any = set.any;
                time(&mut group, &kind.to_string(), &set, |ray| {
                    if any { accel.occluded(ray) } else { accel.intersect(ray).is_some() }
                });
            }
            let (blocks, mut hits, mut occluded) = (RayRows::blocks(&set.rays), HitRows::default(), [false; BATCH]);
            group.bench_function("embree in batches", |bencher| {
                bencher.iter(|| {
                    for (rays, count) in black_box(&blocks) {
                        match set.any {
                            true => {
                                accels[0].1.occluded_rows(AnyHitRays::new(rays, *count), &mut occluded, set.coherence);
                            }
                            false => accels[0].1.intersect_rows(rays, *count, &mut hits, set.coherence),
                        }
                        black_box((&hits, &occluded));
                    }
                });
            });
            for (name, other) in &others {
                let any = set.any;
                time(&mut group, name, &set, |ray| if any { other.any(ray) } else { other.closest(ray).is_some() });
            }
            group.finish();
        }
    }
}

criterion_group!(benches, queries);
criterion_main!(benches);
