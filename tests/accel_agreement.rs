//! Embree answers as the linear oracle does, alone, in packets and from many threads.

use steradian::accel::{Accelerator, Coherence, EmbreeAccel, EmbreeInfo, LinearAccel};
use steradian::geometry::{Geometry, Hit, Shape};
use steradian::math::float::UNIT_ROUNDOFF;
use steradian::math::{DMat3, DVec3, Ray};

use crate::util::geometry::{
    Rng, cube, grid, ids, instances, meshes, placed_analytic_shapes, ray, ray_through, reach, soup, sphere_mesh, transform, world,
};

fn embree(geometry: &Geometry) -> EmbreeAccel<'_> {
    EmbreeAccel::new(geometry, 1).expect("Embree builds")
}

/// Scenes with their names, all of them within a few units of `center` times `scale`.
fn scenes() -> Vec<(&'static str, Geometry)> {
    let mut rng = Rng::new(11);
    let far = DVec3::new(5e3, -2e3, 1e4);
    let turned = |rng: &mut Rng, scale: f64| transform(rng.rotation() * scale, 2.0 * rng.cube());
    let placements: Vec<_> = (0..12).map(|i| turned(&mut rng, 0.2 + 0.1 * f64::from(i))).collect();
    let mut scenes = vec![
        ("soup", meshes(vec![soup(&mut rng, 400, 0.2)])),
        ("small soup", meshes(vec![soup(&mut rng, 1000, 0.02)])),
        ("two soups", meshes(vec![soup(&mut rng, 200, 0.3), soup(&mut rng, 200, 0.1)])),
        ("sphere", meshes(vec![sphere_mesh(DVec3::ZERO, 1.0, 32, 16)])),
        ("far sphere", meshes(vec![sphere_mesh(far, 1.0, 32, 16)])),
        ("stairs", meshes((0..8).map(|i| cube(DMat3::IDENTITY * 0.125, DVec3::splat(-0.875 + 0.25 * f64::from(i)))).collect())),
        ("one triangle", meshes(vec![soup(&mut rng, 1, 1.0)])),
        (
            "hills",
            meshes(vec![grid(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, 20, |s, t| {
                0.2 * (9.0 * s).sin() * (7.0 * t).cos()
            })]),
        ),
        ("slivers", meshes(vec![grid(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, DVec3::new(0.3, 0.02, 0.5), 16, |s, t| 0.1 * s * t)])),
        (
            "instances",
            instances(vec![Shape::Mesh(soup(&mut rng, 30, 0.4)), Shape::Mesh(cube(DMat3::IDENTITY * 0.5, DVec3::ZERO))], &placements),
        ),
    ];
    // An object that shares a shape with the world, and ids that do not start at zero.
    let mut mixed = instances(
        vec![Shape::Mesh(soup(&mut rng, 50, 0.3)), Shape::Mesh(soup(&mut rng, 50, 0.3)), Shape::Mesh(soup(&mut rng, 50, 0.2))],
        &placements[..3],
    );
    mixed.objects[0].shapes.remove(0);
    mixed.world = vec![steradian::id::ShapeId(0), steradian::id::ShapeId(2)];
    scenes.push(("mixed", mixed));
    let analytic = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    scenes.push(("analytic", world(analytic.clone())));
    scenes.push(("far analytic", world(placed_analytic_shapes(&mut rng, far))));
    scenes.push(("analytic instances", instances(analytic, &placements[..4])));
    scenes.push(("nothing", Geometry::default()));
    scenes
}

/// Random, axis-parallel and grazing rays at a scene, with unit and other directions.
fn test_rays(rng: &mut Rng, geometry: &Geometry, count: usize) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let (center, half) =
        if bounds.is_empty() { (DVec3::ZERO, DVec3::ONE) } else { (bounds.center().as_dvec3(), 0.5 * bounds.size().as_dvec3()) };
    let size = half.max_element();
    let mut next = |i: usize| {
        let inside = center + half * rng.cube();
        match i % 4 {
            0 => ray(inside, rng.direction()),
            1 => ray_through(center + rng.direction() * size * 4.0, inside),
            2 => {
                // One or two zero components, with either sign.
                let axis = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, -0.8, 0.0), DVec3::new(-0.0, 0.6, 0.8)][rng.below(5)];
                let axis = if rng.unit() < 0.5 { -axis } else { axis };
                ray(inside - axis * 3.0 * size, axis)
            }
            _ => {
                // Along a face of the bounds, nearly.
                let face = DVec3::new(inside.x, inside.y, center.z + half.z * (1.0 + 1e-4 * rng.range(-1.0, 1.0)));
                let d = rng.direction() * DVec3::new(1.0, 1.0, 1e-3);
                ray(face - d * 3.0 * size, d)
            }
        }
    };
    (0..count).map(&mut next).collect()
}

/// Whether two hits of `ray` are the same within rounding: 8 ulp of t and 4 roundoffs of the reach, over the cosine with the surface.
fn same(geometry: &Geometry, ray: &Ray, a: &Hit, b: &Hit) -> bool {
    let length = f64::from(ray.direction.length());
    let slack = |hit: &Hit| {
        let cosine = geometry.interaction(ray, hit).map_or(1.0, |si| f64::from(si.n_g.dot(ray.direction).abs()) / length);
        let origin = f64::from(ray.origin.abs().max_element());
        let instanced = if hit.instance == Hit::NO_INSTANCE { 0.0 } else { origin };
        16.0 * UNIT_ROUNDOFF * f64::from(hit.t)
            + 4.0 * UNIT_ROUNDOFF * (reach(geometry, ray, hit) + instanced) / (length * cosine.max(1e-6))
    };
    (f64::from(a.t) - f64::from(b.t)).abs() <= slack(a) + slack(b)
}

#[test]
fn embree_agrees_with_the_linear_oracle() {
    let mut rng = Rng::new(12);
    for (name, geometry) in &scenes() {
        let (embree, linear) = (embree(geometry), LinearAccel::new(geometry));
        let rays = test_rays(&mut rng, geometry, 8_000);
        let (mut hits, mut other, mut flags) = (0, 0, 0);
        for ray in &rays {
            match (embree.intersect(ray), linear.intersect(ray)) {
                (Some(a), Some(b)) => {
                    hits += 1;
                    other += usize::from(ids(&a) != ids(&b));
                    assert!(same(geometry, ray, &a, &b), "{name}: {a:?} is not {b:?} of {ray:?}");
                }
                (None, None) => {}
                (a, b) => {
                    flags += 1;
                    println!("{name}: {a:?} against {b:?} of {ray:?}");
                }
            }
        }
        println!("{name}: {hits} hits of {}, {other} ties, {flags} flags differ", rays.len());
        assert!(hits > 50 || geometry.shapes.is_empty(), "{name}: {hits}");
        assert_eq!(flags, 0, "{name}");
        assert_eq!(embree.bounds(), linear.bounds());
    }
}

#[test]
fn any_hit_means_that_there_is_a_closest_hit() {
    let mut rng = Rng::new(13);
    for (name, geometry) in &scenes() {
        let accel = embree(geometry);
        let linear = LinearAccel::new(geometry);
        for (i, ray) in test_rays(&mut rng, geometry, 20_000).iter().enumerate() {
            // The oracle is slow, and it is the same code in both of its answers.
            let accels: [&dyn Accelerator; 2] = [&accel, &linear];
            for accel in &accels[..if i % 40 == 0 { 2 } else { 1 }] {
                let hit = accel.intersect(ray);
                assert_eq!(accel.occluded(ray), hit.is_some(), "{name}: {ray:?}");
                let Some(hit) = hit else { continue };
                for t_max in [hit.t, hit.t.next_up(), hit.t.next_down()] {
                    let cut = Ray { t_max, ..*ray };
                    assert_eq!(accel.occluded(&cut), accel.intersect(&cut).is_some(), "{name}: {cut:?}");
                }
                // On triangles the interval is closed at the very t that was reported; a shape's f64 distance may round below itself.
                if matches!(geometry.shape(hit.shape), Shape::Mesh(_)) && accel.description() != "linear" {
                    assert!(accel.occluded(&Ray { t_max: hit.t, ..*ray }), "{name}: {ray:?}");
                }
            }
        }
    }
}

/// Camera rays: blocks of 4 by 4 pixels in order.
fn camera_rays(geometry: &Geometry, resolution: usize) -> Vec<Ray> {
    let bounds = geometry.bounds();
    let (center, size) =
        if bounds.is_empty() { (DVec3::ZERO, 1.0) } else { (bounds.center().as_dvec3(), f64::from(bounds.size().max_element())) };
    let eye = center + DVec3::new(0.9, 1.1, 0.8) * size;
    let (right, up) = (DVec3::new(-0.77, 0.63, 0.0), DVec3::new(-0.31, -0.38, 0.87));
    let blocks = (resolution / 4).pow(2);
    let pixel = |i: usize| {
        let (block, within) = (i / 16, i % 16);
        let x = (block % (resolution / 4)) * 4 + within % 4;
        let y = (block / (resolution / 4)) * 4 + within / 4;
        let at = |p: usize| (p as f64 + 0.5) / resolution as f64 - 0.5;
        ray_through(eye, center + (right * at(x) + up * at(y)) * size * 1.5)
    };
    (0..blocks * 16).map(pixel).collect()
}

#[test]
fn packets_answer_as_single_rays_do() {
    for (name, geometry) in &scenes() {
        let accel = embree(geometry);
        let rays = camera_rays(geometry, 128);
        // Every length of the last run.
        for count in (rays.len() - 17..=rays.len()).chain(0..18) {
            let rays = &rays[..count];
            let (mut hits, mut occluded) = (vec![None; count], vec![false; count]);
            accel.intersect_batch(rays, &mut hits, Coherence::Coherent);
            accel.occluded_batch(rays, &mut occluded, Coherence::Coherent);
            for (i, ray) in rays.iter().enumerate() {
                let single = accel.intersect(ray);
                assert_eq!(hits[i].is_some(), single.is_some(), "{name}: {ray:?}");
                assert_eq!(occluded[i], single.is_some(), "{name}: {ray:?}");
                if let (Some(a), Some(b)) = (&hits[i], &single) {
                    assert!(same(geometry, ray, a, b), "{name}: {a:?} is not {b:?}");
                }
            }
        }
    }
}

#[test]
fn incoherent_batches_equal_single_rays_bit_for_bit() {
    let mut rng = Rng::new(15);
    for (name, geometry) in &scenes() {
        let accel = embree(geometry);
        let rays = test_rays(&mut rng, geometry, 5_001);
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        accel.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
        accel.occluded_batch(&rays, &mut occluded, Coherence::Incoherent);
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!((hits[i], occluded[i]), (accel.intersect(ray), accel.occluded(ray)), "{name}");
        }
    }
}

#[test]
fn many_threads_get_the_answers_of_one() {
    let mut rng = Rng::new(16);
    let mut shapes = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    shapes.push(Shape::Mesh(soup(&mut rng, 2_000, 0.1)));
    let placements: Vec<_> = (0..5).map(|_| transform(rng.rotation(), 2.0 * rng.cube())).collect();
    let geometry = instances(shapes, &placements);
    let accel = EmbreeAccel::new(&geometry, 0).expect("Embree builds");
    let rays = test_rays(&mut rng, &geometry, 10_000);
    let answers = || {
        let mut hits = vec![None; rays.len()];
        accel.intersect_batch(&rays, &mut hits, Coherence::Coherent);
        let singles: Vec<_> = rays.iter().map(|ray| accel.intersect(ray)).collect();
        let occluded: Vec<_> = rays.iter().map(|ray| accel.occluded(ray)).collect();
        (hits, singles, occluded)
    };
    let alone = answers();
    std::thread::scope(|scope| {
        let others: Vec<_> = (0..8).map(|_| scope.spawn(answers)).collect();
        for other in others {
            assert!(other.join().expect("no thread panics") == alone);
        }
    });
}

#[test]
fn embree_tells_its_name_and_memory() {
    let info = EmbreeInfo::query().expect("a device");
    assert_eq!(info.version.split('.').count(), 3, "{info:?}");
    let geometry = meshes(vec![soup(&mut Rng::new(17), 10_000, 0.1)]);
    let accel = embree(&geometry);
    assert_eq!(accel.description(), format!("Embree {} ({})", info.version, info.isa));
    // A triangle's corners alone are 36 bytes.
    assert!((360_000..10_000_000).contains(&accel.memory_bytes()), "{}", accel.memory_bytes());
}
