//! Known flaws of renderers in glass and in round shapes. Each test fails on the formula that its name blames.

use std::f64::consts::TAU;

use serde_json::{Value, json};
use steradian::internal::film::Image;
use steradian::internal::geometry::{Analytic, Disk, Frustum, Profile, Revolution, Sphere, TransformedShape};
use steradian::internal::math::{DMat3, DVec3, Ray, RayF64, Vec3};

use crate::util::geometry::{Rng, all_analytic_shapes, transform};
use crate::util::render::{pixels, render};

/// A ball of unit radius as two Bezier curves, which leave the sphere by up to 2.8e-4.
const BALL: [[f64; 2]; 7] = [
    [0.0, -1.0],
    [0.552_284_749_8, -1.0],
    [1.0, -0.552_284_749_8],
    [1.0, 0.0],
    [1.0, 0.552_284_749_8],
    [0.552_284_749_8, 1.0],
    [0.0, 1.0],
];

fn ball() -> Revolution {
    Revolution::new(&Profile::bezier(&BALL).unwrap(), TAU).unwrap()
}

fn endless(origin: DVec3, direction: DVec3) -> RayF64 {
    RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
}

fn placed(shape: Analytic) -> TransformedShape {
    TransformedShape::new(shape, transform(DMat3::IDENTITY, DVec3::ZERO))
}

/// A picture of light emitted alone, 16 x 16, along -z.
fn emission_only(shapes: Value, camera: Value) -> Image {
    render(&json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": camera,
        "sampler": { "spp": 1 },
        "integrator": { "type": "path", "max_depth": 1 },
        "materials": { "black": { "type": "diffuse", "albedo": 0 } },
        "shapes": shapes
    }))
}

fn lamp(shape: Value, radiance: f64) -> Value {
    let mut shape = shape;
    shape["material"] = json!("black");
    shape["emission"] = json!({ "radiance": [radiance, radiance, radiance], "two_sided": true });
    shape
}

#[test]
fn roots_behind_the_ray_are_not_hits() {
    // Of a sphere by the absolute value of its distance, of a turned profile by Newton's method from wherever it
    // started.
    let mut rng = Rng::new(61);
    for (name, shape) in all_analytic_shapes() {
        let shape = placed(shape);
        for _ in 0..2_000 {
            let direction = rng.direction();
            let ray = Ray::new((rng.cube() + 5.0 * direction).as_vec3(), direction.as_vec3());
            assert!(shape.intersect(&ray).is_none(), "{name}: {ray:?}");
        }
    }
}

#[test]
fn a_surface_of_revolution_hides_only_what_is_behind_it() {
    // Three lamps one behind the other, listed in every order: always the nearest is seen, the turned one first, in the
    // middle and last.
    let revolution = lamp(json!({ "type": "revolution", "profile": { "bezier": BALL } }), 1.0);
    let quad = |z: f64, radiance: f64| {
        lamp(json!({ "type": "quad", "transform": [{ "scale": 3 }, { "translate": [0, 0, z] }] }), radiance)
    };
    let camera = json!({ "position": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov_degrees": 1 });
    for (z, expected) in [([-3.0, -5.0], 1.0), ([3.0, -3.0], 2.0), ([3.0, 5.0], 3.0)] {
        let shapes = [revolution.clone(), quad(z[0], 2.0), quad(z[1], 3.0)];
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0], [2, 1, 0]] {
            let image = emission_only(json!(order.map(|i| &shapes[i])), camera.clone());
            assert!(pixels(&image).all(|p| p[0] == expected), "{z:?} {order:?}");
        }
    }
}

#[test]
fn level_rays_meet_a_surface_of_revolution_on_both_sides() {
    // A solver that divides by the height of the direction gets infinities; the outline of a cylinder is its width.
    let column =
        lamp(json!({ "type": "revolution", "profile": { "bezier": [[1, -2], [1, -1], [1, 1], [1, 2]] } }), 1.0);
    let camera = json!({ "type": "orthographic", "position": [0, 0, 9], "look_at": [0, 0, 0], "view_height": 4 });
    let image = emission_only(json!([column]), camera);
    for (i, p) in pixels(&image).enumerate() {
        // Pixels of 1/4 across x from -2 to 2; the rays are exactly level.
        let x = i % 16;
        assert_eq!(p[0], if (4..12).contains(&x) { 1.0 } else { 0.0 }, "{i}");
    }
}

#[test]
fn a_b_spline_is_there_between_its_ends_and_nowhere_else() {
    // Four control points on a line: of y from 0 to 3 the curve reaches from 1 to 2. A parameter out of its domain
    // shows more or less.
    let spline =
        Revolution::new(&Profile::b_spline(&[[1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 3.0]]).unwrap(), TAU).unwrap();
    for i in 0..=300 {
        let y = 0.01 * f64::from(i) + 0.005;
        for dy in [0.0, 1e-9] {
            let hit = spline.intersect(&endless(DVec3::new(0.2, y, 3.0), DVec3::new(0.0, dy, -1.0)));
            assert_eq!(hit.is_some(), y > 1.0 && y < 2.0, "{y} {dy}");
            let toward_y = hit.map(|hit| spline.surface(&endless(DVec3::new(0.2, y, 3.0), -DVec3::Z), &hit).uv[1]);
            assert!(toward_y.is_none_or(|v| (v - (y - 1.0)).abs() < 1e-8), "{y}: {toward_y:?}");
        }
    }
}

#[test]
fn exact_zeros_of_a_profile_are_hits() {
    // At the poles, at the joint and in the middle of a segment; a test for normal numbers rejects a parameter or a
    // distance of 0.
    let ball = ball();
    for direction in [DVec3::Y, -DVec3::Y, DVec3::X, -DVec3::Z] {
        let outside = ball.intersect(&endless(-2.0 * direction, direction)).unwrap();
        let inside = ball.intersect(&endless(DVec3::ZERO, direction)).unwrap();
        assert!(
            (outside.t - 1.0).abs() < 1e-12 && (inside.t - 1.0).abs() < 1e-12,
            "{direction}: {outside:?} {inside:?}"
        );
        // From the surface itself, inward and outward.
        let from_surface = ball.intersect(&RayF64 { t_min: 1e-9, ..endless(-direction, direction) }).unwrap();
        assert!((from_surface.t - 2.0).abs() < 1e-12, "{direction}: {from_surface:?}");
    }
}

/// A ball of glass above a floor of two lamps.
fn glass_ball(shape: Value) -> Image {
    let mut shape = shape;
    shape["material"] = json!("glass");
    let half = |x: f64, radiance: [f64; 3]| {
        json!({
            "type": "quad", "origin": [x, -9, -6], "edge_u": [9, 0, 0], "edge_v": [0, 18, 0], "material": "black",
            "emission": { "radiance": radiance }
        })
    };
    render(&json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "camera": { "position": [0, 0, 8], "look_at": [0, 0, 0], "vertical_fov_degrees": 17 },
        "sampler": { "spp": 64 },
        "integrator": { "type": "whitted", "max_depth": 8 },
        "materials": { "glass": { "type": "dielectric", "ior": 1.5 }, "black": { "type": "diffuse", "albedo": 0 } },
        "shapes": [shape, half(0.0, [1.0, 0.2, 0.2]), half(-9.0, [0.2, 0.4, 2.0])],
        "lights": [{ "type": "environment", "radiance": [0.1, 0.1, 0.1] }]
    }))
}

#[test]
fn glass_of_revolution_has_a_consistent_inside() {
    // The same ball as a sphere and as a turned profile; one that always reports its outside would never let light out
    // as it came in.
    let sphere = glass_ball(json!({ "type": "sphere" }));
    let turned = glass_ball(json!({ "type": "revolution", "profile": { "bezier": BALL } }));
    let mut difference = 0.0;
    for (a, b) in pixels(&sphere).zip(pixels(&turned)) {
        difference += (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum::<f64>() / (3.0 * 576.0);
    }
    assert!(difference < 0.01, "{difference}");
    // Seen through the ball left is right.
    let [left, right] = [9, 14].map(|x| sphere.rgb(x, 12).unwrap());
    assert!(left[0] > left[2] && right[2] > right[0], "{left:?} {right:?}");
}

#[test]
fn whitteds_glass_divides_light_by_fresnels_equations_and_loses_none() {
    let scene = |camera: Value, shape: Value| {
        render(&json!({
            "film": { "width": 12, "height": 12, "filter": { "type": "box" } },
            "camera": camera,
            "sampler": { "spp": 1 },
            "integrator": { "type": "whitted", "max_depth": 12 },
            "materials": { "glass": { "type": "dielectric", "ior": 1.5 } },
            "shapes": [shape],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }))
    };
    // Refraction alone would lose what is reflected.
    let camera = json!({ "position": [0.7, 1.9, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 16 });
    let sphere = scene(camera, json!({ "type": "sphere", "material": "glass", "radius": 0.9 }));
    // After 12 segments 1 - (1 - R) R¹⁰ has come back, at least 0.9649 (where R = 10 / 11, near the rim) and all of it
    // in the middle.
    assert!(
        pixels(&sphere).all(|p| p[1] > 0.9649 && p[1] < 1.0 + 1e-5)
            && (sphere.rgb(6, 6).unwrap()[1] - 1.0).abs() < 1e-5
    );
    // Square onto one leg of a prism of 45 degrees: light is reflected totally at its back, which must not be black,
    // and leaves by the other leg. What goes round more than twice is below R⁴.
    let prism = json!({ "type": "mesh", "material": "glass",
        "positions": [[0, -1, 0], [1, -1, 0], [0, -1, -1], [0, 1, 0], [1, 1, 0], [0, 1, -1]],
        "triangles": [[0, 1, 4], [0, 4, 3], [0, 3, 5], [0, 5, 2], [1, 2, 5], [1, 5, 4], [0, 2, 1], [3, 4, 5]] });
    let camera = json!({ "type": "orthographic", "position": [0.5, 0, 5], "look_at": [0.5, 0, 0], "view_height": 0.5 });
    let image = scene(camera, prism);
    assert!(pixels(&image).all(|p| (p[1] - 1.0).abs() < 1e-4), "{:?}", image.rgb(6, 6));
}

#[test]
fn a_sphere_is_hit_near_its_surface_and_missed_without_a_root() {
    // A near hit is not too near, and the root of a negative number is no distance.
    let sphere = placed(Analytic::Sphere(Sphere::full(1.0).unwrap()));
    for gap in [1e-6f32, 1e-5, 1e-4, 4e-4, 1e-3] {
        let hit = sphere.intersect(&Ray::new(Vec3::new(0.0, 0.0, 1.0 + gap), -Vec3::Z)).unwrap();
        assert!((hit.t / f64::from(1.0 + gap - 1.0) - 1.0).abs() < 1e-6, "{gap}: {hit:?}");
    }
    let mut rng = Rng::new(62);
    for _ in 0..10_000 {
        let direction = rng.direction();
        let away = rng.direction().cross(direction).normalize();
        let distance = 1.0 + 10f64.powf(rng.range(-5.0, 2.0));
        let ray = Ray::new((away * distance - direction * rng.range(0.0, 10.0)).as_vec3(), direction.as_vec3());
        assert!(sphere.intersect(&ray).is_none(), "{ray:?}");
    }
}

#[test]
fn rays_within_the_plane_of_a_ring_and_at_its_edges_are_decided_without_nan() {
    let ring = Analytic::Disk(Disk::new(1.0, 0.5, TAU).unwrap());
    for dz in [0.0, -0.0] {
        for z in [0.0, -0.0, 1e-300, 0.5] {
            assert_eq!(ring.intersect(&endless(DVec3::new(-3.0, 0.2, z), DVec3::new(1.0, 0.0, dz))), None, "{z} {dz}");
        }
    }
    let straight = |r: f64| ring.intersect(&endless(DVec3::new(r, 0.0, 2.0), -DVec3::Z));
    assert!(straight(0.5).is_some() && straight(1.0).is_some());
    assert!(straight(0.5f64.next_down()).is_none() && straight(1.0f64.next_up()).is_none());
    // What would be divided by 0 is refused.
    assert!(Disk::new(1.0, 1.0, TAU).is_err() && Disk::new(1.0, 0.5, 0.0).is_err());
    assert!(Frustum::cylinder(1.0, 1.0, 0.0).is_err() && Frustum::new(1.0, 0.0, 1.0, 0.0).is_err());
}

#[test]
fn a_scale_acts_on_every_shape_as_its_measures_do() {
    // Where a scale moves the box but not the hit, or the centre but not the radius, the two pictures differ.
    let cases = [
        (json!({ "type": "sphere", "radius": 0.5 }), json!({ "type": "sphere", "radius": 1.0 })),
        (
            json!({ "type": "disk", "radius": 0.5, "inner_radius": 0.2 }),
            json!({ "type": "disk", "radius": 1.0, "inner_radius": 0.4 }),
        ),
        (
            json!({ "type": "cylinder", "radius": 0.5, "height": 0.4 }),
            json!({ "type": "cylinder", "radius": 1.0, "height": 0.8 }),
        ),
        (
            json!({ "type": "cone", "radius": 0.5, "height": 0.6 }),
            json!({ "type": "cone", "radius": 1.0, "height": 1.2 }),
        ),
        (
            json!({ "type": "quad", "origin": [0, 0, 0], "edge_u": [0.5, 0, 0.2], "edge_v": [0, 0.5, 0] }),
            json!({ "type": "quad", "origin": [0, 0, 0], "edge_u": [1, 0, 0.4], "edge_v": [0, 1, 0] }),
        ),
        (
            json!({ "type": "revolution", "profile": { "bezier": [[0.1, 0], [0.5, 0.2], [0.2, 0.3], [0.4, 0.5]] } }),
            json!({ "type": "revolution", "profile": { "bezier": [[0.2, 0], [1, 0.4], [0.4, 0.6], [0.8, 1]] } }),
        ),
    ];
    let turn = json!({ "rotate": { "axis": [1, 2, 0.5], "degrees": 40 } });
    let picture = |shape: &Value, transform: Value| {
        let mut shape = shape.clone();
        shape["transform"] = transform;
        render(&json!({
            "film": { "width": 32, "height": 32, "filter": { "type": "box" } },
            "camera": { "position": [0.2, 0.3, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 30 },
            "sampler": { "spp": 1 },
            "integrator": { "type": "normal" },
            "shapes": [shape]
        }))
    };
    for (small, large) in cases {
        let scaled = picture(&small, json!([{ "scale": 2 }, turn]));
        let measured = picture(&large, json!([turn]));
        assert!(pixels(&measured).filter(|p| *p != [0.0; 3]).count() > 60, "{large}");
        for (a, b) in pixels(&scaled).zip(pixels(&measured)) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-5), "{large}: {a:?} {b:?}");
        }
    }
}

#[test]
fn normals_under_an_uneven_scale_stay_perpendicular() {
    // By the matrix itself instead of its inverse transpose, the normal of an ellipsoid leans the wrong way.
    let ellipsoid = TransformedShape::new(
        Analytic::Sphere(Sphere::full(1.0).unwrap()),
        transform(DMat3::from_diagonal(DVec3::new(3.0, 1.0, 0.5)), DVec3::ZERO),
    );
    let mut rng = Rng::new(63);
    for _ in 0..2_000 {
        let direction = rng.direction();
        let ray = Ray::new((-6.0 * direction).as_vec3(), direction.as_vec3());
        let hit = ellipsoid.intersect(&ray).unwrap();
        let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * hit.t;
        // The gradient of x²/9 + y² + 4 z².
        let expected = DVec3::new(p.x / 9.0, p.y, 4.0 * p.z).normalize();
        let at = steradian::internal::geometry::Shape::Analytic(ellipsoid.clone());
        let found =
            at.intersect_prim(&ray, steradian::internal::id::ShapeId(0), steradian::internal::id::PrimId(0)).unwrap();
        let interaction = ellipsoid.interaction(&ray, &found).unwrap();
        assert!((interaction.n_g.as_dvec3() - expected).length() < 1e-6, "{p}: {} {expected}", interaction.n_g);
    }
}

#[test]
fn paths_between_facing_mirrors_end() {
    // 1 + 2 + ... + the lamp's light after as many reflections as the depth allows; a loop without an end never
    // returns.
    for (integrator, depth) in [("whitted", 12), ("path", 64)] {
        let image = render(&json!({
            "film": { "width": 4, "height": 4, "filter": { "type": "box" } },
            "camera": { "position": [0.1, 0.2, 0.3], "look_at": [0, 0, 2], "vertical_fov_degrees": 1 },
            "sampler": { "spp": 4 },
            "integrator": { "type": integrator, "max_depth": depth },
            "materials": { "mirror": { "type": "mirror" } },
            "shapes": [
                { "type": "quad", "material": "mirror", "transform": [{ "scale": 99 }, { "translate": [0, 0, 2] }] },
                { "type": "quad", "material": "mirror", "transform": [{ "scale": 99 }, { "translate": [0, 0, -2] }] },
                {
                    "type": "sphere", "radius": 0.01, "transform": [{ "translate": [50, 50, 0] }],
                    "emission": { "radiance": [1, 1, 1] }
                }
            ]
        }));
        assert!(pixels(&image).all(|p| p.iter().all(|c| c.is_finite())), "{integrator}");
    }
}
