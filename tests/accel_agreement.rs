//! Embree answers alike alone, in packets and from many threads.

use steradian::internal::accel::{Accelerator, Coherence, EmbreeAccel, EmbreeInfo};
use steradian::internal::geometry::{Geometry, Shape};
use steradian::internal::math::DVec3;

use crate::util::geometry::{Rng, instances, meshes, placed_analytic_shapes, soup, transform};
use crate::util::scenes::{camera_rays, same, scenes, test_rays};

fn embree(geometry: &Geometry) -> EmbreeAccel<'_> {
    EmbreeAccel::new(geometry, 1).expect("Embree builds")
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
fn embree_reports_its_name_and_memory() {
    let info = EmbreeInfo::query().expect("a device");
    assert_eq!(info.version.split('.').count(), 3, "{info:?}");
    let geometry = meshes(vec![soup(&mut Rng::new(17), 10_000, 0.1)]);
    let accel = embree(&geometry);
    assert_eq!(accel.description(), format!("Embree {} ({})", info.version, info.isa));
    // A triangle's corners alone are 36 bytes.
    assert!((360_000..10_000_000).contains(&accel.memory_bytes()), "{}", accel.memory_bytes());
}
