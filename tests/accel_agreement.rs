//! Embree, alone and beside packets, answers alike for single rays, in batches and from many threads.

use steradian::internal::accel::{
    AccelKind, Accelerator, BvhOptions, Coherence, EmbreeAccel, EmbreeInfo, HybridAccel, HybridOptions, build,
};
use steradian::internal::geometry::{Analytic, Geometry, Mesh, Shape};
use steradian::internal::math::DVec3;

use crate::util::geometry::{Rng, instances, meshes, placed_analytic_shapes, soup, transform, world};
use crate::util::scenes::{camera_rays, same, scenes, test_rays};

fn embree(geometry: &Geometry) -> EmbreeAccel<'_> {
    EmbreeAccel::new(geometry, 1).expect("Embree builds")
}

#[test]
fn packets_answer_as_single_rays_do() {
    let kinds = [AccelKind::EMBREE, AccelKind::HYBRID, AccelKind::HYBRID_BVH];
    for ((name, geometry), kind) in scenes().iter().flat_map(|scene| kinds.map(|kind| (scene, kind))) {
        let accel = build(kind, geometry, 1).expect("it builds");
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
    let kinds = [AccelKind::EMBREE, AccelKind::HYBRID, AccelKind::Bvh(BvhOptions::default())];
    for ((name, geometry), kind) in scenes().iter().flat_map(|scene| kinds.map(|kind| (scene, kind))) {
        let accel = build(kind, geometry, 1).expect("it builds");
        let rays = test_rays(&mut rng, geometry, 5_001);
        let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
        accel.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
        accel.occluded_batch(&rays, &mut occluded, Coherence::Incoherent);
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!((hits[i], occluded[i]), (accel.intersect(ray), accel.occluded(ray)), "{name} {kind}");
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
fn shapes_in_packets_are_hit_where_embree_hits_them() {
    let mut rng = Rng::new(18);
    let mut shapes = placed_analytic_shapes(&mut rng, DVec3::ZERO);
    shapes.push(Shape::Mesh(soup(&mut rng, 2_000, 0.1)));
    let geometry = world(shapes);
    let (hybrid, embree) =
        (HybridAccel::new(&geometry, 1, HybridOptions::default()).expect("it builds"), embree(&geometry));
    assert!(hybrid.description().contains("packets"), "{}", hybrid.description());
    let rays = test_rays(&mut rng, &geometry, 20_000);
    let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
    hybrid.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
    hybrid.occluded_batch(&rays, &mut occluded, Coherence::Incoherent);
    let mut on_shapes = 0;
    for ((ray, hit), occluded) in rays.iter().zip(hits).zip(occluded) {
        let expected = embree.intersect(ray);
        assert_eq!((hit.is_some(), occluded), (expected.is_some(), expected.is_some()), "{ray:?}");
        if let (Some(a), Some(b)) = (&hit, &expected) {
            assert!(same(&geometry, ray, a, b), "{a:?} is not {b:?}");
            on_shapes += usize::from(matches!(geometry.shape(a.shape), Shape::Analytic(_)));
        }
    }
    assert!(on_shapes > 1_000, "{on_shapes}");
}

#[test]
fn few_analytic_shapes_beside_many_triangles_are_traced_in_packets() {
    let mut rng = Rng::new(19);
    let mesh = Shape::Mesh(soup(&mut rng, 2_000, 0.1));
    let is_quad = |shape: &Shape| matches!(shape, Shape::Analytic(placed) if matches!(placed.shape, Analytic::Quad(_)));
    let quad = placed_analytic_shapes(&mut rng, DVec3::ZERO).into_iter().find(is_quad).expect("there is one");
    let beside = |count: usize, mesh: &Shape| {
        let shapes = std::iter::repeat_n(quad.clone(), count).chain([mesh.clone()]).collect();
        build(AccelKind::Auto, &world(shapes), 1).expect("it builds").description()
    };
    // Meshes at rest are in the BVH, where the machine has the instructions that make it fast; there more shapes are
    // few, and with many all but floors and walls are in the BVH.
    let is_bvh = std::arch::is_x86_feature_detected!("avx2");
    let few = if is_bvh { 512 } else { 16 };
    assert!(beside(1, &mesh).contains("for 1 shapes") && beside(few, &mesh).contains(&format!("for {few} shapes")));
    for count in [0, few + 1] {
        let description = beside(count, &mesh);
        assert!(!description.contains("packets"), "{description}");
        assert_eq!(description.starts_with("BVH"), is_bvh);
        assert_eq!(description.starts_with("Embree"), !is_bvh);
    }
    let corners = [[-9.0, -1.0], [9.0, -1.0], [9.0, 1.0], [-9.0, 1.0]].map(|[x, z]| [x, -1.0, 9.0 * z]);
    let floor = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]], None, None).expect("it is valid");
    for (count, in_packets) in [(64, 65), (65, 1)].into_iter().filter(|_| is_bvh) {
        let shapes = std::iter::repeat_n(quad.clone(), count).chain([mesh.clone(), Shape::Mesh(floor.clone())]);
        let description = build(AccelKind::Auto, &world(shapes.collect()), 1).expect("it builds").description();
        assert!(description.contains(&format!("for {in_packets} shapes")), "{description}");
    }
    let inside = instances(vec![quad.clone(), mesh], &[transform(rng.rotation(), rng.cube())]);
    assert!(build(AccelKind::Auto, &inside, 1).expect("it builds").description().starts_with("Embree"));
}

#[test]
fn floors_and_walls_are_hit_where_the_oracle_hits_them() {
    let mut rng = Rng::new(20);
    let wall = |axis: usize, side: f64| {
        let corner = |u: f64, v: f64| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
            p.map(|x| x as f32)
        };
        let corners = vec![corner(-2.0, -2.0), corner(2.0, -2.0), corner(2.0, 2.0), corner(-2.0, 2.0)];
        Mesh::new(corners, vec![[0, 1, 2], [0, 2, 3]], None, None).expect("it is valid")
    };
    let walls = (0..3).flat_map(|axis| [-2.0, 2.0].map(|side| (axis, side))).map(|(axis, side)| wall(axis, side));
    let geometry = meshes(walls.chain([soup(&mut rng, 2_000, 0.1)]).collect());
    let accel = build(AccelKind::HYBRID_BVH, &geometry, 1).expect("it builds");
    assert!(accel.description().contains("for 6 shapes"), "{}", accel.description());
    let oracle = build(AccelKind::Linear, &geometry, 1).expect("it builds");
    let rays = test_rays(&mut rng, &geometry, 20_000);
    let (mut hits, mut occluded) = (vec![None; rays.len()], vec![false; rays.len()]);
    accel.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
    accel.occluded_batch(&rays, &mut occluded, Coherence::Incoherent);
    let mut on_walls = 0;
    for ((ray, hit), occluded) in rays.iter().zip(hits).zip(occluded) {
        let expected = oracle.intersect(ray);
        assert_eq!((hit.is_some(), occluded), (expected.is_some(), expected.is_some()), "{ray:?}");
        assert_eq!((accel.intersect(ray), accel.occluded(ray)), (expected, expected.is_some()), "{ray:?}");
        if let (Some(a), Some(b)) = (&hit, &expected) {
            assert!(same(&geometry, ray, a, b), "{a:?} is not {b:?}");
            on_walls += usize::from(a.shape.index() < 6);
        }
    }
    assert!(on_walls > 1_000, "{on_walls}");
}

#[test]
fn embree_reports_its_name_and_memory() {
    let info = EmbreeInfo::query().expect("a device");
    assert_eq!(info.version.split('.').count(), 3, "{info:?}");
    let geometry = meshes(vec![soup(&mut Rng::new(17), 10_000, 0.1)]);
    let accel = embree(&geometry);
    assert_eq!(accel.description(), format!("Embree {} ({})", info.version, info.isa));
    // A triangle's corners alone are 36 bytes.
    assert!((360_000..10_000_000).contains(&accel.memory_bytes()), "{}", accel.memory_bytes());
}
