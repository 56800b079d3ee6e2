//! Rays that leave a surface do not find it again, however large, small, thin or far away it is; and none leaks out of a closed box.

use steradian::accel::{Accelerator, EmbreeAccel};
use steradian::geometry::{Geometry, Mesh, Shape, SpawnTarget, SurfaceInteraction};
use steradian::id::PrimId;
use steradian::math::{DMat3, DVec3, Vec3};

use crate::util::geometry::{Rng, closest, cube, instances, meshes, ray, ray_through, transform, triangle};

fn embree(geometry: &Geometry) -> EmbreeAccel<'_> {
    EmbreeAccel::new(geometry, 1).expect("Embree builds")
}

/// A random point inside one triangle of a mesh.
fn point_on(rng: &mut Rng, mesh: &Mesh, prim: usize) -> DVec3 {
    let points = mesh.triangle_points(PrimId::new(prim));
    let [a, b, c] = rng.barycentric();
    points.a.as_dvec3() * a + points.b.as_dvec3() * b + points.c.as_dvec3() * c
}

/// The interaction of a ray aimed at `target` from the side `n`, at about the distance `far`; `None` if rounding takes it past an edge.
fn seen(rng: &mut Rng, accel: &dyn Accelerator, geometry: &Geometry, target: DVec3, n: DVec3, far: f64) -> Option<SurfaceInteraction> {
    let from = target + rng.direction_around(n) * far * rng.range(0.1, 2.0);
    closest(accel, geometry, &ray_through(from, target)).found
}

/// Leaves a surface to either side, half of the time at a grazing angle down to 1e-5.
fn leaving(rng: &mut Rng, n: Vec3) -> DVec3 {
    let n = n.as_dvec3() * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
    let d = rng.direction_around(n);
    if rng.unit() < 0.5 {
        return d;
    }
    let along = (d - n * d.dot(n)).normalize();
    (along + n * 10f64.powf(rng.range(-5.0, -1.0))).normalize()
}

/// What became of rays that leave a single triangle.
#[derive(Debug, Default)]
struct Tally {
    rays: usize,
    /// Hits that stand in `f64`.
    false_hits: usize,
    /// Shadow rays to a free point that were called occluded, where no `f64` test looks.
    false_shadows: usize,
    retraces: usize,
}

/// Leaves the one triangle of `mesh` `directions` times.
fn leave_triangle(rng: &mut Rng, mesh: Mesh, directions: usize, tally: &mut Tally) {
    let size = mesh.bounds().size().max_element();
    let n = mesh.triangle_points(PrimId(0)).cross().normalize();
    let geometry = meshes(vec![mesh.clone()]);
    let accel = embree(&geometry);
    for _ in 0..directions {
        let target = point_on(rng, &mesh, 0);
        let Some(si) = seen(rng, &accel, &geometry, target, n, f64::from(size)) else { continue };
        let direction = leaving(rng, si.n_g);
        let again = closest(&accel, &geometry, &si.spawn(direction.as_vec3()));
        let free = si.p + direction * f64::from(size) * 10f64.powf(rng.range(-3.0, 3.0));
        let shadow = si.spawn_to(&SpawnTarget { p: free, n: Vec3::ZERO, error: 0.0 });
        tally.rays += 1;
        tally.false_hits += usize::from(again.found.is_some());
        tally.false_shadows += usize::from(accel.occluded(&shadow));
        tally.retraces += again.retraces;
    }
}

#[test]
fn a_triangle_of_any_size_is_not_hit_again() {
    let mut rng = Rng::new(1);
    let mut tally = Tally::default();
    for _ in 0..500 {
        let size = 10f64.powf(rng.range(-8.0, 8.0));
        let [a, b, c] = [rng.cube() * size, rng.cube() * size, rng.cube() * size];
        leave_triangle(&mut rng, triangle(a, b, c), 200, &mut tally);
    }
    println!("random triangles: {tally:?}");
    assert!(tally.rays > 80_000);
    assert_eq!(tally.false_hits, 0);
    // Slivers among them; a shadow ray has no second look.
    assert!(tally.false_shadows * 1000 <= tally.rays, "{tally:?}");
}

#[test]
fn a_triangle_with_corners_of_very_different_sizes_is_not_hit_again() {
    // Each coordinate has an exponent of its own, as in pbrt's Triangle.Reintersect.
    let mut rng = Rng::new(2);
    let mut tally = Tally::default();
    for _ in 0..200 {
        let mut coordinate = || 10f64.powf(rng.range(-8.0, 8.0)) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let [a, b, c] = [(); 3].map(|()| DVec3::new(coordinate(), coordinate(), coordinate()));
        leave_triangle(&mut rng, triangle(a, b, c), 200, &mut tally);
    }
    println!("wild triangles: {tally:?}");
    assert!(tally.rays > 20_000);
    assert_eq!(tally.false_hits, 0);
}

#[test]
fn slivers_are_not_hit_again() {
    let mut rng = Rng::new(3);
    for aspect in [1.0, 1e-2, 1e-4] {
        let mut tally = Tally::default();
        for _ in 0..100 {
            let frame = rng.rotation() * 10f64.powf(rng.range(-3.0, 3.0));
            let offset = rng.cube() * 10f64.powf(rng.range(-3.0, 3.0));
            let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::new(rng.unit(), aspect, 0.0)].map(|p| frame * p + offset);
            leave_triangle(&mut rng, triangle(a, b, c), 300, &mut tally);
        }
        println!("aspect {aspect}: {tally:?}");
        assert!(tally.rays > 10_000);
        assert_eq!(tally.false_hits, 0, "aspect {aspect}");
        assert!(aspect < 1e-3 || tally.retraces * 50 <= tally.rays, "aspect {aspect}: {tally:?}");
    }
}

#[test]
fn closed_boxes_do_not_leak() {
    let mut rng = Rng::new(4);
    for (half, offset) in [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (1e-6, 1e-2), (1.0, 1e4), (1e6, 1e10), (1000.0, 1e7)] {
        let (mut rays, mut own, mut leaks, mut retraces) = (0, 0, 0, 0);
        for _ in 0..4 {
            let center = DVec3::new(0.8, -0.5, 0.3) * offset;
            let mesh = cube(rng.rotation() * half, center);
            let geometry = meshes(vec![mesh.clone()]);
            let accel = embree(&geometry);
            for _ in 0..5000 {
                let Some(si) = closest(&accel, &geometry, &ray(center, rng.direction())).found else { continue };
                let direction = rng.direction_around(-si.n_g.as_dvec3());
                let next = closest(&accel, &geometry, &si.spawn(direction.as_vec3()));
                rays += 1;
                retraces += next.retraces;
                match next.found {
                    None => leaks += 1,
                    Some(hit) => own += usize::from(hit.prim == si.prim),
                }
            }
        }
        println!("half {half} offset {offset}: {rays} rays, {own} own, {leaks} leaks, {retraces} retraces");
        assert!(rays >= 19_990, "{rays}");
        assert_eq!(own, 0, "half {half} offset {offset}");
        let allowed = if offset == 0.0 { 0 } else { rays / 2000 };
        assert!(leaks <= allowed, "half {half} offset {offset}: {leaks} of {rays}");
    }
}

#[test]
fn a_large_ground_is_not_hit_again_near_its_middle() {
    // The hit point is tiny and the error is not: what an offset in proportion to the point gets wrong.
    let mut rng = Rng::new(5);
    for size in [1e4, 1e6] {
        let frame = rng.rotation() * size;
        let [a, b, c] = [DVec3::new(-1.0, -0.8, 0.0), DVec3::new(1.1, -0.7, 0.0), DVec3::new(0.1, 1.2, 0.0)].map(|p| frame * p);
        let geometry = meshes(vec![triangle(a, b, c)]);
        let accel = embree(&geometry);
        let n = (b - a).cross(c - a).normalize();
        let (mut rays, mut again, mut shadows) = (0, 0, 0);
        for _ in 0..20_000 {
            let Some(si) = seen(&mut rng, &accel, &geometry, rng_near_zero(rays), n, 1.0) else { continue };
            let direction = leaving(&mut rng, si.n_g);
            rays += 1;
            again += usize::from(closest(&accel, &geometry, &si.spawn(direction.as_vec3())).found.is_some());
            shadows += usize::from(accel.occluded(&si.spawn(direction.as_vec3())));
        }
        println!("ground {size}: {rays} rays, {again} again, {shadows} before validation");
        assert!(rays > 19_000);
        assert_eq!(again, 0);
    }
}

/// Points within 0.01 of the origin.
fn rng_near_zero(i: usize) -> DVec3 {
    Rng::new(i as u64).cube() * 0.01
}

#[test]
fn convex_instances_are_not_hit_again() {
    let mut rng = Rng::new(6);
    for anisotropy in [1.0, 100.0] {
        let (mut rays, mut again, mut retraces) = (0, 0, 0);
        for _ in 0..60 {
            let scale = 10f64.powf(rng.range(-2.0, 2.0));
            let stretch = DMat3::from_diagonal(DVec3::new(1.0, rng.range(1.0, anisotropy), 1.0 / rng.range(1.0, anisotropy).sqrt()));
            let linear = rng.rotation() * stretch * rng.rotation() * scale;
            let translation = rng.cube() * scale * 10f64.powf(rng.range(-1.0, 5.0));
            let placement = transform(linear, translation);
            let geometry = instances(vec![Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO))], &[placement]);
            let accel = embree(&geometry);
            for _ in 0..1000 {
                let target = placement.point(rng.cube());
                let from = target + rng.direction() * 4.0 * scale * anisotropy;
                let Some(si) = closest(&accel, &geometry, &ray_through(from, target)).found else { continue };
                // Rounding may have taken the ray to a face from inside; outside is where the normal points.
                let direction = rng.direction_around(si.n_g.as_dvec3());
                let next = closest(&accel, &geometry, &si.spawn(direction.as_vec3()));
                rays += 1;
                again += usize::from(next.found.is_some());
                retraces += next.retraces;
            }
        }
        println!("instances, anisotropy {anisotropy}: {rays} rays, {again} again, {retraces} retraces");
        assert!(rays > 50_000);
        let allowed = if anisotropy == 1.0 { 0 } else { rays / 5000 };
        assert!(again <= allowed, "anisotropy {anisotropy}: {again} of {rays}");
    }
}

#[test]
fn shadow_rays_do_not_see_the_light_they_aim_at() {
    let mut rng = Rng::new(7);
    let (mut rays, mut occluded, mut own) = (0, 0, 0);
    for _ in 0..100 {
        let distance = 10f64.powf(rng.range(-3.0, 6.0));
        let frame = rng.rotation();
        let floor = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)].map(|p| frame * p);
        let up = frame * (DVec3::Z * distance);
        let light = floor.map(|p| p + up);
        let (floor, light) = (triangle(floor[0], floor[1], floor[2]), triangle(light[0], light[2], light[1]));
        let geometry = meshes(vec![floor.clone(), light.clone()]);
        let accel = embree(&geometry);
        for _ in 0..300 {
            let target = point_on(&mut rng, &floor, 0);
            let from = target + up * 0.5;
            let on_light = closest(&accel, &geometry, &ray_through(from, point_on(&mut rng, &light, 0))).found;
            let on_floor = closest(&accel, &geometry, &ray_through(from, target)).found;
            let (Some(si), Some(end)) = (on_floor, on_light) else { continue };
            if (si.shape, end.shape) == (steradian::id::ShapeId(0), steradian::id::ShapeId(1)) {
                rays += 1;
                let shadow = si.spawn_to(&SpawnTarget { p: end.p, n: end.n_g, error: end.error });
                occluded += usize::from(accel.occluded(&shadow));
                own += usize::from(accel.intersect(&shadow).is_some_and(|hit| hit.shape == end.shape));
            }
        }
    }
    assert!(rays > 20_000);
    assert_eq!((occluded, own), (0, 0), "of {rays}");
}
