//! Samples per second of small renders of the project's scenes through every accelerator; the pictures are compared
//! before anything is timed.

use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use steradian::internal::accel::{self, AccelKind, Accelerator};
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::render::{self, Overrides, Settings, Silent};
use steradian::internal::scene::Scene;
use steradian::internal::{compile, import};

const SIZE: [u32; 2] = [128, 128];
const SPP: u32 = 4;

fn render(scene: &Scene, accel: &dyn Accelerator, settings: &Settings) -> Image {
    render::render(scene, accel, settings, &Silent, &AtomicBool::new(false)).expect("renders").image
}

fn mean_and_different(a: &Image, b: &Image) -> (f64, usize) {
    let pixels = |image: &Image| {
        image.layer(LayerKind::Color).expect("is there").pixels().flatten().copied().collect::<Vec<f32>>()
    };
    let (a, b) = (pixels(a), pixels(b));
    let mean = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>();
    (mean(&a) / mean(&b), a.iter().zip(&b).filter(|(a, b)| a != b).count())
}

fn renders(criterion: &mut Criterion) {
    for name in ["cornell", "knot", "gallery"] {
        let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes")).join(name).with_extension("json");
        let desc = import::load_scene(&file).expect("loads");
        let overrides = Overrides {
            size: Some(SIZE),
            spp: Some(SPP),
            default_outputs: vec!["unused.png".into()],
            ..Overrides::default()
        };
        let settings = Settings::new(&desc, &overrides).expect("valid");
        let scene = compile::compile(&desc, &file).expect("compiles");
        let kinds = AccelKind::ALL.iter().filter(|(kind, _)| *kind != AccelKind::Linear || name == "cornell");
        let accels: Vec<_> =
            kinds.map(|(kind, name)| (name, accel::build(*kind, &scene.geometry, 0).expect("builds"))).collect();
        let pictures: Vec<_> = accels.iter().map(|(_, accel)| render(&scene, &**accel, &settings)).collect();
        // Ours draw the same picture bit for bit, Embree but for rays at edges.
        for (picture, (accel, _)) in pictures[2..].iter().zip(&accels[2..]) {
            assert_eq!(mean_and_different(picture, &pictures[1]).1, 0, "{name}, {accel}");
        }
        let (ratio, different) = mean_and_different(&pictures[0], &pictures[1]);
        assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
        println!("{name}: {different} of {} values differ between embree and bvh", 3 * SIZE[0] * SIZE[1]);
        let mut group = criterion.benchmark_group(format!("render/{name}"));
        group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
        group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1] * SPP)));
        for (accel_name, accel) in &accels {
            group.bench_function(**accel_name, |bencher| {
                bencher.iter(|| render(&scene, black_box(&**accel), &settings));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, renders);
criterion_main!(benches);
