//! Our own accelerators against the linear oracle: the same answers bit for bit, on anything, with bounded work.

use steradian::internal::accel::inspect::StructureStats;
use steradian::internal::accel::{AccelKind, Accelerator, LinearAccel, build};
use steradian::internal::geometry::{Geometry, Hit, Mesh};
use steradian::internal::math::{DVec3, Ray};
use steradian::internal::render::{Overrides, Settings};
use steradian::internal::{compile, import};
use steradian_bench::record;

use crate::util::geometry::{Rng, mesh, meshes, ray, ray_through};
use crate::util::root;
use crate::util::scenes::{own, same};

fn assert_equal(name: &str, geometry: &Geometry, accels: &[(&str, Box<dyn Accelerator + '_>)], rays: &[Ray]) {
    let oracle = LinearAccel::new(geometry);
    for ray in rays {
        let expected = oracle.intersect(ray);
        for (accel_name, accel) in accels {
            assert_eq!(accel.intersect(ray), expected, "{name}, {accel_name}: {ray:?}");
            assert_eq!(accel.occluded(ray), expected.is_some(), "{name}, {accel_name}: {ray:?}");
        }
    }
}

/// The rays of renders of the project's scenes; Embree's answers are the same surface within rounding.
fn agree_on_renders(count: usize) {
    for name in ["cornell", "glass", "gallery", "knot", "motion", "textures"] {
        let file = root().join("scenes").join(name).with_extension("json");
        let desc = import::load_scene(&file).unwrap();
        let settings =
            Settings::new(&desc, &Overrides { default_outputs: vec!["a.exr".into()], ..Overrides::default() }).unwrap();
        let scene = compile::compile(&desc, &file).unwrap();
        let geometry = &scene.geometry;
        let (accels, embree) = (own(geometry), build(AccelKind::EMBREE, geometry, 2).unwrap());
        // The linear oracle has shown the BVH to be right elsewhere; here it would take hours.
        let oracle = &accels[0].1;
        for set in record(&scene, &*embree, &settings, count).unwrap() {
            let mut different = 0;
            for ray in &set.rays {
                let expected = oracle.intersect(ray);
                for (accel_name, accel) in &accels[1..] {
                    assert_eq!(accel.intersect(ray), expected, "{name}, {accel_name}: {ray:?}");
                    assert_eq!(accel.occluded(ray), expected.is_some(), "{name}, {accel_name}: {ray:?}");
                }
                match (embree.intersect(ray), expected) {
                    (Some(a), Some(b)) => different += usize::from(!same(geometry, ray, &a, &b)),
                    (None, None) => {}
                    _ => different += 1,
                }
            }
            // An edge seen from the side, met by one and not by the other.
            assert!(
                different * 20_000 <= set.rays.len() + 20_000,
                "{name}, {:?}: {different} of {}",
                set.kind,
                set.rays.len()
            );
        }
    }
}

#[test]
fn rays_of_renders_get_the_same_answers() {
    agree_on_renders(3_000);
}

/// 100 000 rays of each kind.
#[test]
#[ignore = "takes minutes"]
fn many_rays_of_renders_get_the_same_answers() {
    agree_on_renders(100_000);
}

#[test]
fn garbage_ends_in_bounded_trees() {
    let mut rng = Rng::new(38);
    let positions = |n: usize, f: &mut dyn FnMut(usize) -> [DVec3; 3]| -> Mesh {
        let corners: Vec<DVec3> = (0..n).flat_map(f).collect();
        mesh(&corners, (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    };
    let one = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let angle = |i: usize| DVec3::new((i as f64).sin(), (i as f64).cos(), 0.1);
    let cases: Vec<(&str, Mesh)> = vec![
        ("identical", positions(100_000, &mut |_| one)),
        ("one point", positions(1_000, &mut |i| [DVec3::ZERO, angle(i), angle(3 * i + 1).cross(DVec3::X)])),
        (
            "slivers",
            positions(20_000, &mut |_| {
                let (a, d) = (rng.cube(), rng.direction());
                [a, a + d, a + 0.5 * d + 1e-6 * rng.direction()]
            }),
        ),
        (
            "all long",
            positions(5_000, &mut |i| {
                [DVec3::new(-1.0, 0.001 * i as f64, 0.0), DVec3::new(1.0, 0.001 * i as f64, 0.1), angle(i)]
            }),
        ),
        ("shrinking", positions(5_000, &mut |i| one.map(|p| (p + DVec3::ONE) * 0.5f64.powi(i as i32 % 120)))),
        (
            "huge and tiny",
            positions(4_000, &mut |i| {
                let size = if i % 2 == 0 { 1e15 } else { 1e-15 };
                [size * angle(i), size * angle(i + 1), size * angle(i + 2).cross(DVec3::Y)]
            }),
        ),
        ("flat", positions(20_000, &mut |i| one.map(|p| p + DVec3::new((i % 141) as f64, (i / 141) as f64, 0.0)))),
    ];
    for (name, garbage) in cases {
        let count = garbage.triangles().len();
        let geometry = meshes(vec![garbage]);
        for (accel_name, accel) in own(&geometry) {
            let stats = StructureStats::of(accel.inspect().unwrap());
            assert!(stats.max_depth <= 65, "{name}, {accel_name}: {stats:?}");
            assert!(
                accel.memory_bytes() <= 400 * count + 4096,
                "{name}, {accel_name}: {} bytes for {count}",
                accel.memory_bytes()
            );
            assert!(stats.references <= 32 * count as u64 + 1024, "{name}, {accel_name}: {stats:?}");
            let rays = [ray(DVec3::new(0.2, 0.2, -3.0), DVec3::Z), ray(DVec3::new(-3.0, 0.3, 0.05), DVec3::X)];
            if name == "shrinking" || name == "huge and tiny" {
                // From 2^50 times its size away a triangle is a point even in f64, and may be hit falsely where no box
                // lets it be tested.
                assert!(
                    rays.iter().all(|ray| accel.occluded(ray) == accel.intersect(ray).is_some()),
                    "{name}, {accel_name}"
                );
            } else {
                assert_equal(name, &geometry, &[(accel_name, accel)], &rays);
            }
        }
    }
}

/// What is in a leaf twice must be met once: nothing of a hit depends on how often its primitive was tested.
#[test]
fn a_hit_does_not_depend_on_the_order_of_tests() {
    let long: Vec<_> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
    let corners: Vec<DVec3> = long
        .iter()
        .flat_map(|z| [DVec3::new(-9.0, -9.0, *z), DVec3::new(9.0, -9.0, *z), DVec3::new(0.0, 9.0, *z)])
        .collect();
    let geometry = meshes(vec![mesh(&corners, (0..200).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())]);
    let mut rng = Rng::new(39);
    let rays: Vec<Ray> = (0..2_000).map(|_| ray_through(4.0 * rng.direction(), rng.cube())).collect();
    let hits: Vec<Option<Hit>> = rays.iter().map(|ray| LinearAccel::new(&geometry).intersect(ray)).collect();
    assert!(hits.iter().flatten().count() > 1_000);
    assert_equal("long", &geometry, &own(&geometry), &rays);
}
