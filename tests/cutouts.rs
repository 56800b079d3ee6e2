use std::sync::Arc;

use steradian::internal::accel::{AccelKind, Coherence, build};
use steradian::internal::geometry::{AlphaMask, AlphaMasks, Geometry, Hit, Shape, Sphere, TransformedShape};
use steradian::internal::id::ShapeId;
use steradian::internal::math::{DMat3, DVec3, Ray};

use crate::util::geometry::{
    Rng, cube, grid, ids, instances, meshes, placed_analytic_shapes, ray, ray_through, soup, transform, world,
};

/// Every shape but the first has the same coverage everywhere.
#[derive(Debug)]
struct Veil(f32);

impl AlphaMask for Veil {
    fn has_holes(&self, shape: ShapeId) -> bool {
        shape.0 != 0
    }

    fn alpha(&self, _: &Shape, _: &Ray, _: &Hit) -> f32 {
        self.0
    }
}

/// Every shape is there only where x is not negative, in the space it is placed in.
#[derive(Debug)]
struct Half;

impl AlphaMask for Half {
    fn has_holes(&self, _: ShapeId) -> bool {
        true
    }

    fn alpha(&self, _: &Shape, ray: &Ray, hit: &Hit) -> f32 {
        if ray.at(hit.t).x >= 0.0 { 1.0 } else { 0.0 }
    }
}

fn with(coverage: impl AlphaMask + 'static, geometry: Geometry) -> Geometry {
    Geometry { cutouts: AlphaMasks::new(Arc::new(coverage)), ..geometry }
}

fn scenes(rng: &mut Rng) -> Vec<Geometry> {
    let placements: Vec<_> = (0..6).map(|_| transform(rng.rotation() * 0.8, 2.0 * rng.cube())).collect();
    let mut mixed = placed_analytic_shapes(rng, DVec3::ZERO);
    mixed.push(Shape::Mesh(soup(rng, 300, 0.5)));
    vec![
        meshes(vec![soup(rng, 300, 0.6), soup(rng, 300, 0.6)]),
        world(mixed.clone()),
        instances(mixed, &placements),
        instances(vec![Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO)), Shape::Mesh(soup(rng, 40, 0.8))], &placements),
    ]
}

fn rays(rng: &mut Rng, count: usize) -> Vec<Ray> {
    (0..count).map(|_| ray_through(6.0 * rng.cube(), 2.0 * rng.cube())).collect()
}

#[test]
fn every_accelerator_sees_the_same_holes() {
    let mut rng = Rng::new(71);
    for (i, scene) in scenes(&mut rng).into_iter().enumerate() {
        for geometry in [with(Veil(0.4), scene.clone()), with(Half, scene)] {
            let rays = rays(&mut rng, 4_000);
            let oracle = build(AccelKind::Linear, &geometry, 1).unwrap();
            let expected: Vec<_> = rays.iter().map(|ray| oracle.intersect(ray)).collect();
            assert!(expected.iter().flatten().count() > 100, "{i}");
            for (kind, name) in AccelKind::ALL {
                let accel = build(kind, &geometry, 1).unwrap();
                let mut hits = vec![None; rays.len()];
                accel.intersect_batch(&rays, &mut hits, Coherence::Incoherent);
                let mut different = 0;
                for ((ray, hit), expected) in rays.iter().zip(&hits).zip(&expected) {
                    assert_eq!(accel.occluded(ray), hit.is_some(), "{name}: {ray:?}");
                    assert_eq!(accel.intersect(ray).map(|h| ids(&h)), hit.map(|h| ids(&h)), "{name}: {ray:?}");
                    different += usize::from(hit.map(|h| ids(&h)) != expected.map(|h| ids(&h)));
                    if !matches!(kind, AccelKind::Embree(_) | AccelKind::Hybrid(_)) {
                        assert_eq!(hit, expected, "{name}: {ray:?}");
                    }
                }
                // Where an edge of a hole or a shape runs through a ray, roundings decide.
                assert!(different <= 2, "{name}: {different} rays of scene {i}");
            }
        }
    }
}

#[test]
fn a_ray_passes_any_number_of_layers() {
    // A thousand quads behind each other, then a wall.
    let wall = grid(DVec3::new(-1.0, -1.0, 2.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, 1, |_, _| 0.0);
    let layer =
        |i: u32| grid(DVec3::new(-1.0, -1.0, f64::from(i) * 1e-3), 2.0 * DVec3::X, 2.0 * DVec3::Y, 1, |_, _| 0.0);
    let scene = meshes(std::iter::once(wall).chain((0..1000).map(layer)).collect());
    for (coverage, expected) in [(0.0, 0), (1.0, 1)] {
        let geometry = with(Veil(coverage), scene.clone());
        for (kind, name) in AccelKind::ALL {
            let accel = build(kind, &geometry, 1).unwrap();
            let ray = ray(DVec3::new(0.2, 0.3, -1.0), DVec3::Z);
            assert_eq!(accel.intersect(&ray).map(|hit| hit.shape.0), Some(expected), "{name}");
            assert!(accel.occluded(&ray), "{name}");
            assert_eq!(accel.occluded(&Ray { t_max: 2.5, ..ray }), expected != 0, "{name}");
        }
    }
}

#[test]
fn light_passes_a_veil_as_its_layers_say() {
    let layers =
        (0..3).map(|i| grid(DVec3::new(-1.0, -1.0, f64::from(i)), 2.0 * DVec3::X, 2.0 * DVec3::Y, 1, |_, _| 0.0));
    let unseen = soup(&mut Rng::new(1), 1, 1e-3);
    let geometry = with(Veil(0.3), meshes(std::iter::once(unseen).chain(layers).collect()));
    let accel = build(AccelKind::EMBREE, &geometry, 1).unwrap();
    let mut rng = Rng::new(72);
    let n = 100_000;
    let free = (0..n)
        .filter(|_| !accel.occluded(&ray(DVec3::new(rng.range(-0.9, 0.9), rng.range(-0.9, 0.9), -1.0), DVec3::Z)))
        .count();
    let expected: f64 = 0.7 * 0.7 * 0.7;
    // Five standard deviations: false alarm 6e-7.
    let bound = 5.0 * (expected * (1.0 - expected) / f64::from(n)).sqrt();
    assert!((free as f64 / f64::from(n) - expected).abs() <= bound, "{free}");
}

#[test]
fn the_far_side_shows_through_a_hole_of_a_sphere() {
    let sphere = Shape::Analytic(TransformedShape::new(
        steradian::internal::geometry::Analytic::Sphere(Sphere::full(1.0).unwrap()),
        transform(DMat3::IDENTITY, DVec3::new(0.0, 0.0, 5.0)),
    ));
    for geometry in [world(vec![sphere.clone()]), instances(vec![sphere], &[transform(DMat3::IDENTITY, DVec3::ZERO)])] {
        let geometry = with(Half, geometry);
        // From the missing half towards the other.
        let ray = ray(DVec3::new(-4.0, 0.1, 5.0), DVec3::X);
        for (kind, name) in AccelKind::ALL {
            let accel = build(kind, &geometry, 1).unwrap();
            let hit = accel.intersect(&ray).unwrap();
            let at = geometry.interaction(&ray, &hit).unwrap();
            assert!(at.p.x > 0.9 && (at.p - DVec3::new(0.0, 0.0, 5.0)).length() - 1.0 < 1e-6, "{name}: {at:?}");
        }
    }
}
