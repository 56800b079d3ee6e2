//! Scenes of no, one and many shapes, one after the other and side by side.

use super::rays::hits;
use super::{Effort, Faults, Outcome};
use crate::accel::{AccelKind, Accelerator, EmbreeAccel, EmbreeOptions, EmbreeQuality, LinearAccel};
use crate::bumpy_sphere;
use crate::geometry::{Geometry, Shape, TransformedShape};
use crate::math::{DMat3, DVec3, Ray, Transform};
use crate::stability::geometry::{
    Rng, all_analytic_shapes, cube, instances, meshes, ray, soup, transform, triangle, world,
};
use crate::stability::scenes::{all, all_answers, build, moving_scene, same, scenes, test_rays};

/// The answers of any accelerator that are not the oracle's.
fn differing(geometry: &Geometry, rays: &[Ray]) -> Faults {
    let oracle = LinearAccel::new(geometry);
    let expected: Vec<_> = rays.iter().map(|ray| oracle.intersect(ray)).collect();
    let is_same = |ray: &Ray, found, expected| match (found, expected) {
        (Some(a), Some(b)) => same(geometry, ray, &a, &b),
        (None, None) => true,
        _ => false,
    };
    let mut wrong = Faults::NONE;
    for (name, accel) in all(geometry) {
        for (ray, expected) in rays.iter().zip(&expected) {
            let found = accel.intersect(ray);
            wrong.require(is_same(ray, found, *expected), || {
                format!("{name}: {ray:?} has {found:?} in place of {expected:?}")
            });
        }
    }
    wrong
}

/// Hits in scenes without a shape, and bounds of such scenes.
fn hits_of_nothing(rays: &[Ray]) -> Faults {
    let no_shapes = instances(vec![], &[transform(DMat3::IDENTITY, DVec3::ZERO)]);
    let mut faults = Faults::NONE;
    for geometry in &[Geometry::default(), no_shapes] {
        for (name, accel) in all(geometry) {
            faults += hits(name, &*accel, rays);
            faults.require(accel.bounds().is_empty(), || format!("{name}: {:?}", accel.bounds()));
        }
    }
    faults
}

fn single_shapes() -> Vec<Geometry> {
    let analytic = all_analytic_shapes()
        .into_iter()
        .map(|(_, shape)| Shape::Analytic(TransformedShape::new(shape, Transform::IDENTITY)));
    let triangle = Shape::Mesh(triangle(-DVec3::X, DVec3::new(1.0, 0.3, 0.2), DVec3::Y));
    analytic.chain([triangle]).map(|shape| world(vec![shape])).collect()
}

/// Rays from inside of a closed mesh that leave it.
fn leaks(effort: Effort, rng: &mut Rng) -> Faults {
    let geometry = meshes(vec![bumpy_sphere(effort.pick(20_000, 1_000_000))]);
    let rays: Vec<Ray> = (0..effort.pick(2_000, 100_000)).map(|_| ray(0.5 * rng.cube(), rng.direction())).collect();
    let kinds = AccelKind::ALL.into_iter().filter(|(kind, _)| *kind != AccelKind::Linear);
    let mut leaks = Faults::NONE;
    for (kind, name) in kinds {
        let accel = build(kind, &geometry);
        let is_lost = |ray: &Ray| usize::from(accel.intersect(ray).is_none() || !accel.occluded(ray));
        leaks += Faults::of(&rays, is_lost, |ray| format!("{name}: {ray:?}"));
    }
    leaks
}

/// Hits of three accelerators, traced in turn, that differ from those of each alone.
fn disturbed(rng: &mut Rng) -> Faults {
    let geometries = [10, 100, 300].map(|count| meshes(vec![soup(rng, count, 0.4)]));
    let rays = test_rays(rng, &geometries[0], 1_000);
    let alone = geometries
        .each_ref()
        .map(|g| rays.iter().map(|ray| build(AccelKind::EMBREE, g).intersect(ray)).take(50).collect::<Vec<_>>());
    let together = geometries.each_ref().map(|geometry| build(AccelKind::EMBREE, geometry));
    let differing = |(i, ray): (usize, &Ray)| {
        (0..3).filter(|&k| alone[k].get(i).is_some_and(|hit| *hit != together[k].intersect(ray))).count()
    };
    let numbered: Vec<_> = rays.iter().enumerate().collect();
    Faults::of(&numbered, |case| differing(*case), |(_, ray)| format!("{ray:?}"))
}

pub(super) fn e8_life_of_scenes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(81);
    let any_rays = test_rays(&mut rng, &Geometry::default(), 100);
    let mut single = Faults::NONE;
    for geometry in &single_shapes() {
        let rays = test_rays(&mut rng, geometry, effort.pick(400, 40_000));
        single += differing(geometry, &rays);
    }
    let mut moved = Faults::NONE;
    let mut place = DVec3::ZERO;
    for _ in 0..16 {
        place += 3.0 * rng.cube();
        let geometry = meshes(vec![cube(rng.rotation(), place), cube(rng.rotation() * 0.5, -place)]);
        let rays = test_rays(&mut rng, &geometry, effort.pick(100, 10_000));
        moved += differing(&geometry, &rays);
    }
    Outcome::new()
        .none("hits, or bounds, of nothing", hits_of_nothing(&any_rays))
        .none("answers on scenes of one shape that are not the oracle's", single)
        .none("rays that leave a closed mesh", leaks(effort, &mut rng))
        .none("answers after moves that are not the oracle's", moved)
        .none("answers that change with other accelerators around", disturbed(&mut rng))
}

pub(super) fn e9_memory(effort: Effort) -> Outcome {
    let mut rng = Rng::new(91);
    let mut geometries = scenes();
    geometries.push(("moving", moving_scene(&mut rng)));
    geometries.push(("bumpy sphere", meshes(vec![bumpy_sphere(effort.pick(20_000, 1_000_000))])));
    let (mut built, mut most) = (0, 0);
    let [mut kept, mut unaccounted, mut failed] = [const { Faults::NONE }; 3];
    for (name, geometry) in &geometries {
        let rays = test_rays(&mut rng, geometry, 100);
        for quality in [EmbreeQuality::Low, EmbreeQuality::Medium, EmbreeQuality::High] {
            let options = EmbreeOptions { quality, ..EmbreeOptions::default() };
            let accel = match EmbreeAccel::with_options(geometry, 2, options) {
                Ok(accel) => accel,
                Err(error) => {
                    failed.add(1, || format!("{name}, {quality:?}: {error}"));
                    continue;
                }
            };
            // A triangle's corners alone are 36 bytes.
            let triangles = geometry.world.iter().map(|id| geometry.shape(*id).prim_count()).sum::<usize>();
            let bytes = accel.memory_bytes();
            unaccounted.require(triangles <= 1_000 || bytes >= 36 * triangles, || {
                format!("{name}, {quality:?}: {bytes} bytes of {triangles} triangles")
            });
            most = most.max(bytes);
            all_answers(&accel, &rays);
            let left = accel.release();
            kept.add(left.unsigned_abs(), || format!("{name}, {quality:?}: {left} bytes"));
            built += 1;
        }
    }
    Outcome::new()
        .record("accelerators built", f64::from(built))
        .none("that could not be built", failed)
        .record("most bytes held", most as f64)
        .none("large scenes that hold less than their corners", unaccounted)
        .none("bytes held after the release", kept)
}
