//! Scenes, rays at them, and when two hits are the same: for tests that compare accelerators.

use steradian::geometry::{Geometry, Hit, Shape};
use steradian::math::float::UNIT_ROUNDOFF;
use steradian::math::{DMat3, DVec3, Ray};

use super::geometry::{
    Rng, cube, grid, instances, meshes, placed_analytic_shapes, ray, ray_through, reach, soup, sphere_mesh, transform, world,
};

/// Scenes with their names, all of them within a few units of `center` times `scale`.
pub fn scenes() -> Vec<(&'static str, Geometry)> {
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
pub fn test_rays(rng: &mut Rng, geometry: &Geometry, count: usize) -> Vec<Ray> {
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

/// Camera rays: blocks of 4 by 4 pixels in order.
pub fn camera_rays(geometry: &Geometry, resolution: usize) -> Vec<Ray> {
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

/// Whether two hits of `ray` are the same within rounding: 8 ulp of t and 4 roundoffs of the reach, over the cosine with the surface.
pub fn same(geometry: &Geometry, ray: &Ray, a: &Hit, b: &Hit) -> bool {
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
