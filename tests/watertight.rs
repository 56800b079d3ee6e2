//! Closed meshes have no holes.

use steradian::accel::{Accelerator, EmbreeAccel, LinearAccel};
use steradian::geometry::{Geometry, Mesh};
use steradian::id::PrimId;
use steradian::math::{DVec3, Ray};

use crate::util::geometry::{Rng, cube, grid, meshes, ray, ray_through, sphere_mesh};

/// Where Embree's own watertightness test stands: coordinates are quantised to 1/64 there, the sphere's radius is 2.
const FAR: DVec3 = DVec3::new(148_376.0, 1_234.0, -223_423.0);

fn embree(geometry: &Geometry) -> EmbreeAccel<'_> {
    EmbreeAccel::new(geometry, 1).expect("Embree builds")
}

/// How many of `count` rays hit nothing, by closest and by any hit.
fn lost(accel: &dyn Accelerator, count: usize, mut next: impl FnMut() -> Ray) -> [usize; 2] {
    let mut lost = [0; 2];
    for _ in 0..count {
        let ray = next();
        lost[0] += usize::from(accel.intersect(&ray).is_none());
        lost[1] += usize::from(!accel.occluded(&ray));
    }
    lost
}

fn corners(mesh: &Mesh, prim: usize) -> [DVec3; 3] {
    let points = mesh.triangle_points(PrimId::new(prim));
    [points.a, points.b, points.c].map(steradian::math::Vec3::as_dvec3)
}

#[test]
fn no_ray_leaves_a_closed_sphere() {
    for (center, seed) in [(DVec3::ZERO, 2), (FAR, 3)] {
        let geometry = meshes(vec![sphere_mesh(center, 2.0, 500, 250)]);
        let accel = embree(&geometry);
        let mut rng = Rng::new(seed);
        let lost = lost(&accel, 200_000, || ray(center + 0.5 * rng.cube(), rng.direction()));
        assert_eq!(lost, [0, 0], "at {center}");
    }
}

#[test]
fn no_ray_passes_a_far_plane() {
    let (x, y) = (12.0 * DVec3::X, 12.0 * DVec3::Y);
    let corner = FAR - 0.5 * (x + y);
    let geometry = meshes(vec![grid(corner, x, y, 500, |_, _| 0.0)]);
    let accel = embree(&geometry);
    let mut rng = Rng::new(4);
    let next = || {
        let target = corner + x * rng.range(0.05, 0.95) + y * rng.range(0.05, 0.95);
        ray_through(target + DVec3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), rng.range(1.0, 4.0)), target)
    };
    assert_eq!(lost(&accel, 100_000, next), [0, 0]);
}

#[test]
fn no_ray_passes_an_edge() {
    let mut rng = Rng::new(5);
    let mut tested = 0;
    for scale in [1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6] {
        for offset in [0.0, 1e5, 1e7] {
            let center = DVec3::new(0.7, -0.4, 0.6) * offset * scale;
            let mesh = sphere_mesh(center, 2.0 * scale, 48, 24);
            let geometry = meshes(vec![mesh.clone()]);
            let accel = embree(&geometry);
            // At the largest offset a sphere is a few floats wide: rays start in the middle, the one point that is inside for sure.
            let next = || {
                let [a, b, _] = corners(&mesh, rng.below(mesh.triangles().len()));
                ray_through(center, a.lerp(b, rng.unit()))
            };
            assert_eq!(lost(&accel, 10_000, next), [0, 0], "scale {scale} offset {offset}");
            tested += 10_000;
        }
    }
    assert!(tested >= 200_000);
}

#[test]
fn rays_at_vertices_hit_the_linear_oracle_always_and_embree_nearly_always() {
    let mut rng = Rng::new(6);
    let mesh = sphere_mesh(DVec3::ZERO, 2.0, 48, 24);
    let geometry = meshes(vec![mesh.clone()]);
    let mut at_vertex = |count| {
        let next = || {
            let p = mesh.positions()[rng.below(mesh.positions().len())];
            ray_through(0.5 * rng.cube(), DVec3::from_array(p.map(f64::from)))
        };
        std::iter::repeat_with(next).take(count).collect::<Vec<_>>()
    };
    let rays = at_vertex(20_000);
    let embree = embree(&geometry);
    let missed = rays.iter().filter(|ray| embree.intersect(ray).is_none()).count();
    println!("Embree missed {missed} of {} at vertices", rays.len());
    assert!(missed * 100 <= 3 * rays.len(), "{missed}");

    let linear = LinearAccel::new(&geometry);
    let mut rays = rays.into_iter();
    assert_eq!(lost(&linear, 2_000, || rays.next().expect("enough rays")), [0, 0]);
}

#[test]
fn a_bumpy_closed_mesh_has_no_holes_for_the_linear_oracle() {
    let mut rng = Rng::new(7);
    let smooth = sphere_mesh(DVec3::ZERO, 1.0, 16, 16);
    let positions = smooth.positions().iter().map(|p| DVec3::from_array(p.map(f64::from)) * (1.0 + 5.0 * rng.unit()));
    let mesh = crate::util::geometry::mesh(&positions.collect::<Vec<_>>(), smooth.triangles().to_vec());
    let geometry = meshes(vec![mesh]);
    let next = || ray(0.25 * rng.cube(), rng.direction());
    assert_eq!(lost(&LinearAccel::new(&geometry), 10_000, next), [0, 0]);
}

#[test]
fn a_box_around_a_grid_of_boxes_keeps_every_ray() {
    // Walls that meet at right angles along axes: rays in the planes of walls, with zero and negative zero components.
    let geometry = meshes(vec![cube(steradian::math::DMat3::IDENTITY, DVec3::ZERO)]);
    let accel = embree(&geometry);
    for x in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        for y in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            for zero in [0.0, -0.0] {
                for d in [DVec3::new(zero, zero, 1.0), DVec3::new(zero, 1.0, zero), DVec3::new(-1.0, zero, zero)] {
                    let inside = ray(DVec3::new(x, y, 0.25) * 0.999, d);
                    assert!(accel.intersect(&inside).is_some() && accel.occluded(&inside), "{inside:?}");
                }
            }
        }
    }
}
