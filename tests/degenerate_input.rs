//! What is not a ray hits nothing and ends nothing; what is hardly a triangle does not disturb its neighbours.

use steradian::accel::{AccelKind, Accelerator, Coherence, EmbreeAccel, LinearAccel, build};
use steradian::geometry::{Geometry, Hit, Shape};
use steradian::math::float::SMALLEST_NORMAL;
use steradian::math::{DMat3, DVec3, Ray, Vec3};

use crate::util::geometry::{Rng, cube, instances, meshes, placed_analytic_shapes, soup, transform, triangle};

/// A valid ray that hits every scene of [`scenes`].
const GOOD: Ray = Ray { origin: Vec3::new(0.1, 0.2, 0.3), t_min: 0.0, direction: Vec3::Z, t_max: f32::INFINITY, time: 0.0 };

/// A box in the world, a box through instances, and a box with every analytic shape around it.
fn scenes() -> Vec<Geometry> {
    let unit = || Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO));
    let turned = |scale: f64| transform(DMat3::from_rotation_y(0.2) * scale, DVec3::splat(0.01));
    let mut shapes = placed_analytic_shapes(&mut Rng::new(1), DVec3::ZERO);
    shapes.push(unit());
    vec![
        crate::util::geometry::world(vec![unit()]),
        instances(vec![unit()], &[turned(1.0), turned(5.0), turned(1e-6), turned(1e6)]),
        crate::util::geometry::world(shapes.clone()),
        instances(shapes, &[turned(1.0), turned(2.0)]),
    ]
}

/// One ray for each way of being none.
fn invalid_rays() -> Vec<Ray> {
    let mut rays = Vec::new();
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e19, -1e19, f32::MAX, f32::MIN] {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let put = |v: Vec3| Vec3::select(axis.cmpgt(Vec3::ZERO), Vec3::splat(bad), v);
            rays.push(Ray { origin: put(GOOD.origin), ..GOOD });
            rays.push(Ray { direction: put(GOOD.direction), ..GOOD });
        }
        rays.push(Ray { time: bad, ..GOOD });
    }
    for t in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -SMALLEST_NORMAL, -1e-45] {
        rays.push(Ray { t_min: t, ..GOOD });
    }
    for t in [f32::NAN, f32::NEG_INFINITY, -1.0, -1e-45] {
        rays.push(Ray { t_max: t, ..GOOD });
    }
    rays.push(Ray { t_min: 2.0, t_max: 1.0, ..GOOD });
    rays.push(Ray { direction: Vec3::ZERO, ..GOOD });
    rays.push(Ray { direction: -Vec3::ZERO, ..GOOD });
    rays.push(Ray { time: -1e-7, ..GOOD });
    rays.push(Ray { time: 1.000_000_1, ..GOOD });
    rays.push(Ray::INACTIVE);
    rays
}

/// Valid rays at the end of what is allowed; they may hit or miss.
fn extreme_rays() -> Vec<Ray> {
    let mut rays = vec![Ray { t_min: 1e-45, ..GOOD }, Ray { t_max: 0.0, ..GOOD }, Ray { t_max: 1e-45, ..GOOD }];
    for size in [1e-45, 1e-38, 1e-30, 1e-10, 1e10, 1e13, 1e17, 1.8e18] {
        rays.push(Ray { direction: Vec3::new(0.0, 0.0, size), ..GOOD });
        rays.push(Ray { direction: Vec3::splat(size), ..GOOD });
        rays.push(Ray { direction: Vec3::new(1.0, size, -size), ..GOOD });
        rays.push(Ray { origin: Vec3::splat(size), direction: Vec3::splat(-1.0), ..GOOD });
        rays.push(Ray { origin: Vec3::splat(size), direction: Vec3::splat(-size), ..GOOD });
        rays.push(Ray { t_min: size, ..GOOD });
    }
    rays.push(Ray { time: 1.0, ..GOOD });
    rays
}

/// The answers of every entry point to these rays.
fn all_answers(accel: &dyn Accelerator, rays: &[Ray]) -> Vec<(Vec<Option<Hit>>, Vec<bool>)> {
    let mut answers = vec![(rays.iter().map(|r| accel.intersect(r)).collect(), rays.iter().map(|r| accel.occluded(r)).collect())];
    for coherence in [Coherence::Coherent, Coherence::Incoherent] {
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        accel.intersect_batch(rays, &mut hits, coherence);
        accel.occluded_batch(rays, &mut occluded, coherence);
        answers.push((hits, occluded));
    }
    answers
}

#[test]
fn invalid_rays_hit_nothing_through_any_entry_point() {
    let invalid = invalid_rays();
    assert!(invalid.iter().all(|ray| !ray.is_valid()));
    for (scene, geometry) in scenes().iter().enumerate() {
        for (kind, name) in AccelKind::ALL {
            let accel = build(kind, geometry, 1).unwrap();
            for (hits, occluded) in all_answers(&*accel, &invalid) {
                assert!(hits.iter().all(Option::is_none) && !occluded.contains(&true), "{name}, scene {scene}");
            }

            // Between invalid lanes a valid one is answered all the same.
            let mixed: Vec<Ray> = invalid.iter().flat_map(|&bad| [bad, GOOD, bad]).collect();
            for (hits, occluded) in all_answers(&*accel, &mixed) {
                for (i, ray) in mixed.iter().enumerate() {
                    assert_eq!((hits[i].is_some(), occluded[i]), (ray.is_valid(), ray.is_valid()), "{name}, scene {scene}, {ray:?}");
                }
            }
        }
    }
}

#[test]
fn extreme_rays_end_nothing() {
    let rays = extreme_rays();
    assert!(rays.iter().all(Ray::is_valid));
    for geometry in &scenes() {
        for (kind, _) in AccelKind::ALL {
            let accel = build(kind, geometry, 1).unwrap();
            for (hits, _) in all_answers(&*accel, &rays) {
                assert!(hits.iter().zip(&rays).all(|(hit, ray)| hit.is_none_or(|h| h.t >= ray.t_min && h.t <= ray.t_max)));
            }
        }
    }
}

#[test]
fn an_instance_beyond_f32_is_an_error_and_a_small_one_is_not() {
    let scaled =
        |scale: f64| instances(vec![Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO))], &[transform(DMat3::IDENTITY * scale, DVec3::ZERO)]);
    for scale in [1e-16, 1e-30, 1e16, 1e30] {
        let message = EmbreeAccel::new(&scaled(scale), 1).err().expect("no inverse in f32").to_string();
        assert!(message.contains("instance 0"), "{message}");
    }
    for scale in [1e-10, 1e-4, 1e4, 1e10] {
        let geometry = scaled(scale);
        let accel = EmbreeAccel::new(&geometry, 1).unwrap();
        let hit = accel.intersect(&Ray::new(Vec3::ZERO, Vec3::X)).expect("from inside");
        assert!((f64::from(hit.t) / scale - 1.0).abs() < 1e-5, "{scale} {hit:?}");
    }
}

#[test]
fn degenerate_triangles_are_never_hit_and_disturb_nobody() {
    let p = DVec3::new(0.25, 0.25, 0.0);
    let degenerate =
        [triangle(p, p, p), triangle(p, p, p + DVec3::X), triangle(DVec3::ZERO, DVec3::new(0.25, 0.25, 0.0), DVec3::new(0.5, 0.5, 0.0))];
    let mut shapes: Vec<_> = degenerate.to_vec();
    shapes.push(triangle(DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.0, -1.0), DVec3::new(0.0, 1.0, -1.0)));
    let geometry = meshes(shapes);
    for (kind, name) in AccelKind::ALL {
        let accel = build(kind, &geometry, 1).unwrap();
        for x in [0.25f32, 0.2, 0.3] {
            let hit = accel.intersect(&Ray::new(Vec3::new(x, 0.25, 1.0), -Vec3::Z)).expect("the proper triangle");
            assert_eq!((hit.shape.0, hit.t), (3, 2.0), "{name}");
        }
        assert!(!accel.bounds().is_empty() && accel.bounds().max.is_finite());
    }
}

#[test]
fn the_interval_is_inclusive_at_both_ends() {
    let geometry = meshes(vec![triangle(DVec3::ZERO, DVec3::X, DVec3::Y)]);
    let ray = Ray::new(Vec3::new(0.25, 0.25, -1.0), Vec3::Z);
    let on = Ray::new(Vec3::new(0.25, 0.25, 0.0), Vec3::Z);
    let one = 1f32;
    let cases = [
        (Ray { t_min: one, ..ray }, true),
        (Ray { t_min: one.next_up(), ..ray }, false),
        (Ray { t_max: one, ..ray }, true),
        (Ray { t_max: one.next_down(), ..ray }, false),
        (Ray { t_min: one, t_max: one, ..ray }, true),
        (on, true),
        (Ray { t_max: SMALLEST_NORMAL, ..on }, true),
        (Ray { t_min: SMALLEST_NORMAL, ..on }, false),
    ];
    for (kind, name) in AccelKind::ALL {
        let accel = build(kind, &geometry, 1).unwrap();
        for (ray, expected) in cases {
            for (hits, occluded) in all_answers(&*accel, &[ray]) {
                assert_eq!((hits[0].is_some(), occluded[0]), (expected, expected), "{name}: {ray:?}");
            }
        }
    }
}

#[test]
fn an_empty_scene_answers() {
    let empty = Geometry::default();
    let no_shapes = instances(vec![], &[transform(DMat3::IDENTITY, DVec3::ZERO)]);
    for geometry in [&empty, &no_shapes] {
        for (kind, _) in AccelKind::ALL {
            let accel = build(kind, geometry, 1).unwrap();
            assert!(
                all_answers(&*accel, &[GOOD; 40])
                    .iter()
                    .all(|(hits, occluded)| hits.iter().all(Option::is_none) && !occluded.contains(&true))
            );
            assert!(accel.bounds().is_empty());
        }
    }
}

#[test]
fn identical_triangles_build_and_the_linear_oracle_takes_the_first() {
    let one = soup(&mut Rng::new(9), 1, 1.0);
    let positions: Vec<DVec3> = one.positions().iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let geometry = meshes(vec![crate::util::geometry::mesh(&positions, vec![[0, 1, 2]; 20_000])]);
    let center = (positions[0] + positions[1] + positions[2]) / 3.0;
    let ray = crate::util::geometry::ray_through(center + DVec3::new(0.1, 0.2, 3.0), center);
    assert_eq!(LinearAccel::new(&geometry).intersect(&ray).unwrap().prim.0, 0);
    assert!(EmbreeAccel::new(&geometry, 1).unwrap().intersect(&ray).is_some());
}

/// A ray whose numbers have random signs and exponents, among them zeros and denormals, so often that lanes of a packet disagree in all.
fn wild_ray(rng: &mut Rng) -> Ray {
    let mut number = |low: f64, high: f64| {
        let magnitude = match rng.below(8) {
            0 => 0.0,
            1 => 1e-45,
            2 => 1e-20,
            3 => 1.0,
            _ => 10f64.powf(rng.range(low, high)) as f32,
        };
        if rng.unit() < 0.5 { -magnitude } else { magnitude }
    };
    let mut vector = |low, high| Vec3::new(number(low, high), number(low, high), number(low, high));
    Ray { origin: vector(-45.0, 18.2), direction: vector(-45.0, 18.2), ..GOOD }
}

#[test]
fn no_valid_ray_ends_the_process() {
    let mut rng = Rng::new(21);
    let turned = |rng: &mut Rng| transform(rng.rotation() * 10f64.powf(rng.range(-6.0, 6.0)), rng.cube());
    let placements: Vec<_> = (0..9).map(|_| turned(&mut rng)).chain([transform(DMat3::IDENTITY, DVec3::ZERO)]).collect();
    let mut shapes = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    shapes.push(Shape::Mesh(soup(&mut rng, 301, 0.3)));
    for geometry in [crate::util::geometry::world(shapes.clone()), instances(shapes, &placements)] {
        let accel = EmbreeAccel::new(&geometry, 1).unwrap();
        let rays: Vec<Ray> = (0..64_000).map(|_| wild_ray(&mut rng)).collect();
        assert!(rays.iter().filter(|ray| ray.is_valid()).count() > 50_000);
        let answers = all_answers(&accel, &rays);
        // A tiny component in one lane misleads no other. At distances above 1e20 single rays themselves are lost now and then.
        for packets in &answers[1..] {
            let differing = answers[0].0.iter().zip(&packets.0).filter(|(a, b)| a.is_some() != b.is_some()).count();
            let shadows = answers[0].1.iter().zip(&packets.1).filter(|(a, b)| a != b).count();
            assert!(differing.max(shadows) * 2000 <= rays.len(), "{differing} {shadows} of {}", rays.len());
        }
    }
}
