use std::f64::consts::{FRAC_PI_3, PI, TAU};

use super::tests::{assert_power_flows_out, assert_samples_are_hits, irradiance};
use super::*;
use crate::geometry::{Disk, Frustum, Quad, Sphere};
use crate::math::float::step_past;
use crate::math::{DAffine3, DMat3, Rng, Transform};

const WHITE: Emission = Emission::constant(Rgb::WHITE);
const TWO_SIDED: Emission = Emission { two_sided: true, ..WHITE };

fn place(shape: Analytic, map: DAffine3) -> Geometry {
    let placed = Placed::new(shape, Transform::new(map).unwrap());
    Geometry { shapes: vec![Shape::Analytic(placed)], world: vec![ShapeId(0)], ..Geometry::default() }
}

fn light(geometry: &Geometry, emission: Emission) -> AreaLight {
    AreaLight::new(ShapeId(0), PrimId(0), emission, geometry, &[])
}

fn sphere() -> Analytic {
    Analytic::Sphere(Sphere::full(0.5).unwrap())
}

/// A rotation about a skew axis, with scales along the axes and a translation.
fn skew(scale: [f64; 3]) -> DAffine3 {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 1.3);
    DAffine3 { matrix3: turn * DMat3::from_diagonal(scale.into()), translation: DVec3::new(0.4, 1.0, -0.7) }
}

/// Every analytic emitter that is not whole, and ways to place it.
fn partial() -> Vec<(&'static str, Analytic)> {
    vec![
        ("disk", Analytic::Disk(Disk::new(1.0, 0.0, TAU).unwrap())),
        ("ring sector", Analytic::Disk(Disk::new(1.0, 0.4, 4.0).unwrap())),
        ("partial sphere", Analytic::Sphere(Sphere::new(1.0, -0.2, 0.7, 5.0).unwrap())),
        ("cylinder", Analytic::Frustum(Frustum::cylinder(0.6, 1.5, 3.0).unwrap())),
        ("cone", Analytic::Frustum(Frustum::new(0.8, 0.0, 1.2, TAU).unwrap())),
        ("frustum", Analytic::Frustum(Frustum::new(0.8, 0.3, 1.2, 2.0).unwrap())),
        ("quad", Analytic::Quad(Quad::new(DVec3::new(-0.5, -0.3, 0.2), DVec3::new(1.0, 0.2, 0.0), DVec3::Y).unwrap())),
    ]
}

/// Cosine below which a surface counts as seen edge-on.
const EDGE_ON: f32 = 0.2;

#[test]
fn a_placed_sphere_gives_the_closed_form_irradiance() {
    let map = DAffine3 { matrix3: skew([2.0, 2.0, -2.0]).matrix3, translation: DVec3::new(1.2, 0.0, 1.6) };
    let geometry = place(Analytic::Sphere(Sphere::full(0.25).unwrap()), map);
    let light = light(&geometry, WHITE);
    // E = pi L (R / d)² cos.
    let e = irradiance(std::slice::from_ref(&light), &geometry, DVec3::ZERO, DVec3::Z);
    assert!((e / (PI * 0.0625 * 0.8) - 1.0).abs() < 1e-4, "{e}");
    assert!((light.power() / (4.0 * PI * PI * 0.25) - 1.0).abs() < 1e-6);
    assert_samples_are_hits(&geometry, &light, DVec3::ZERO, 1e-4);
    assert_samples_are_hits(&geometry, &light, DVec3::new(1.2, 0.3, 2.2), 1e-4);
    assert!(light.sample(&geometry, &[], DVec3::new(1.2, 0.1, 1.5), [0.5; 2]).is_none());
}

#[test]
fn a_sphere_turned_inside_out_lights_its_inside() {
    let mut geometry = place(sphere(), skew([3.0; 3]));
    if let Shape::Analytic(placed) = &mut geometry.shapes[0] {
        placed.reverse_normal = true;
    }
    let light = light(&geometry, WHITE);
    for p in [[0.4, 1.0, -0.7], [0.2, 0.4, 0.1]] {
        // Radiance 1 from everywhere.
        let e = irradiance(std::slice::from_ref(&light), &geometry, p.into(), DVec3::new(0.6, 0.0, 0.8));
        assert!((e / PI - 1.0).abs() < 1e-3, "{e}");
        assert_samples_are_hits(&geometry, &light, p.into(), 1e-4);
    }
    assert!(light.sample(&geometry, &[], DVec3::splat(9.0), [0.5; 2]).is_none());
}

#[test]
fn a_disk_gives_walshs_irradiance() {
    // The disk looks down from z = 1.
    let map = DAffine3 { matrix3: DMat3::from_rotation_x(PI), translation: DVec3::Z };
    let geometry = place(Analytic::Disk(Disk::new(0.5, 0.0, TAU).unwrap()), map);
    let light = light(&geometry, WHITE);
    let at = |x: f64| irradiance(std::slice::from_ref(&light), &geometry, DVec3::new(x, 0.0, 0.0), DVec3::Z);
    assert!((at(0.0) / (PI * 0.25 / 1.25) - 1.0).abs() < 1e-4);
    // F = (1 - (x² + h² - R²) / sqrt((x² + h² + R²)² - 4 R² x²)) / 2.
    assert!((at(0.7) / (PI * 0.110_793_5) - 1.0).abs() < 1e-4);
}

#[test]
fn a_quad_light_gives_lamberts_irradiance() {
    let quad = Analytic::Quad(Quad::new(DVec3::new(-0.3, -0.5, 0.0), DVec3::Y, DVec3::X).unwrap());
    let geometry = place(quad, DAffine3::from_translation(DVec3::Z));
    let light = light(&geometry, WHITE);
    let e = irradiance(std::slice::from_ref(&light), &geometry, DVec3::ZERO, DVec3::Z);
    assert!((e / 0.718_688_9 - 1.0).abs() < 1e-4, "{e}");
    assert!(light.sample(&geometry, &[], DVec3::new(0.0, 0.0, 2.0), [0.5; 2]).is_none());
}

#[test]
fn partial_emitters_are_sampled_within_their_clips() {
    for (name, shape) in partial() {
        let geometry = place(shape, skew([1.0, 1.7, 0.6]));
        let Shape::Analytic(placed) = &geometry.shapes[0] else { panic!("just placed") };
        let light = light(&geometry, TWO_SIDED);
        let mut random = Rng::new(13);
        let p = DVec3::new(3.0, -2.0, 4.0);
        for _ in 0..5000 {
            let Some(s) = light.sample(&geometry, &[], p, random.pair()) else { continue };
            let ShadowTarget::Point(target) = s.target else { panic!("an area light is not at infinity") };
            let q = placed.transform.inverse_point(target.p);
            let (rho, phi) = (q.x.hypot(q.y), q.y.atan2(q.x).rem_euclid(TAU));
            let e = 1e-6;
            let inside = match name {
                "disk" => q.z.abs() < e && rho <= 1.0 + e,
                "ring sector" => q.z.abs() < e && (0.4 - e..=1.0 + e).contains(&rho) && phi <= 4.0 + e,
                "partial sphere" => (q.length() - 1.0).abs() < e && (-0.2 - e..=0.7 + e).contains(&q.z) && phi <= 5.0 + e,
                "cylinder" => (rho - 0.6).abs() < e && (-e..=1.5 + e).contains(&q.z) && phi <= 3.0 + e,
                "cone" => (rho - 0.8 * (1.0 - q.z / 1.2)).abs() < e && (-e..=1.2 + e).contains(&q.z),
                "frustum" => (rho - 0.8 + 0.5 * q.z / 1.2).abs() < e && (-e..=1.2 + e).contains(&q.z) && phi <= 2.0 + e,
                _ => (q.z - 0.2).abs() < e && (-0.5 - e..=0.5 + e).contains(&q.x),
            };
            assert!(inside, "{name}: {q}");
        }
    }
}

#[test]
fn densities_integrate_to_one() {
    for (name, shape) in partial().into_iter().chain([("sphere", sphere())]) {
        for scale in [[1.0; 3], [1.0, 1.7, 0.6]] {
            let geometry = place(shape.clone(), skew(scale));
            let light = light(&geometry, TWO_SIDED);
            let p = DVec3::new(1.4, 1.9, 0.6).as_vec3().as_dvec3();
            let mut random = Rng::new(17);
            let n = 1000;
            let mut sum = 0.0;
            for i in 0..n * n {
                // A direction for each cell of a grid on the sphere, and all hits along it: hidden points are sampled too.
                let z = 1.0 - 2.0 * f64::from((i % n) as f32 + random.unit_f32()) / f64::from(n);
                let (sin, cos) = (TAU * f64::from((i / n) as f32 + random.unit_f32()) / f64::from(n)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let mut ray = Ray::new(p.as_vec3(), DVec3::new(r * cos, r * sin, z).as_vec3());
                while let Some(hit) = geometry.shape(ShapeId(0)).intersect_prim(&ray, ShapeId(0), PrimId(0)) {
                    // Without the silhouettes, where the density is unbounded.
                    if let Some(at) = geometry.interaction(&ray, &hit)
                        && at.n_g.dot(ray.direction).abs() > EDGE_ON
                    {
                        sum += f64::from(light.pdf(&geometry, p, &ray, &at));
                    }
                    ray.t_min = step_past(hit.t);
                }
            }
            let integral = sum * 4.0 * PI / f64::from(n * n);
            let mut expected = 0.0;
            for _ in 0..n * n {
                if let Some(LightSample { wi, target: ShadowTarget::Point(target), .. }) = light.sample(&geometry, &[], p, random.pair()) {
                    expected += f64::from(u8::from(target.n.dot(wi).abs() > EDGE_ON)) / f64::from(n * n);
                }
            }
            // A whole sphere is sampled on its near side only, where every direction meets it twice.
            if name == "sphere" && scale == [1.0; 3] {
                expected *= 2.0;
            }
            assert!((integral / expected - 1.0).abs() < 0.01, "{name} {scale:?}: {integral} {expected}");
        }
    }
}

#[test]
fn hits_of_partial_emitters_have_the_density_of_samples() {
    for (name, shape) in partial().into_iter().chain([("sphere", sphere())]) {
        for scale in [[1.0; 3], [-2.0; 3], [1.0, 1.7, 0.6]] {
            let geometry = place(shape.clone(), skew(scale));
            let light = light(&geometry, TWO_SIDED);
            for p in [DVec3::new(2.0, 3.0, 2.0), DVec3::new(-20.0, 3.0, 30.0)] {
                assert_samples_are_hits(&geometry, &light, p, 1e-4);
            }
            if name != "sphere" {
                assert_power_flows_out(&geometry, &light, DVec3::new(0.4, 1.0, -0.7), 12.0, 0.03);
            }
            let one_sided = AreaLight { emission: WHITE, ..light.clone() };
            assert_power_flows_out(&geometry, &one_sided, DVec3::new(0.4, 1.0, -0.7), 12.0, 0.03);
            assert!((2.0 * one_sided.power() / light.power() - 1.0).abs() < 1e-12, "{name}");
        }
    }
}

#[test]
fn the_area_of_a_stretched_surface_is_that_of_the_surface() {
    // A cylinder stretched into an elliptic one: circumference by Ramanujan's second formula, which is exact to 1e-5 here.
    let map = DAffine3::from_scale(DVec3::new(1.5, 1.0, 2.0));
    let geometry = place(Analytic::Frustum(Frustum::cylinder(1.0, 1.0, TAU).unwrap()), map);
    let h = (0.5f64 / 2.5).powi(2);
    let exact = 2.0 * PI * 2.5 * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    assert!((light(&geometry, WHITE).area() / exact - 1.0).abs() < 1e-3);
    // Half an even turn keeps area.
    let geometry = place(Analytic::Disk(Disk::new(2.0, 1.0, FRAC_PI_3).unwrap()), DAffine3::from_rotation_y(0.3));
    assert!((light(&geometry, WHITE).area() / (0.5 * FRAC_PI_3 * 3.0) - 1.0).abs() < 1e-5);
}
