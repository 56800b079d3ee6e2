//! Analytic shapes against an oracle of twice the digits, and what all of them promise.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::*;
use crate::geometry::Profile;
use crate::geometry::testing::{Double, endless};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DMat3, Rng, dvec3};

/// A quadric by `a (x² + y²) + b z² + c z + d = 0` with its clips; what the shapes of that kind have in common.
struct Oracle {
    round: f64,
    z_squared: f64,
    z_linear: f64,
    constant: f64,
    z_min: f64,
    z_max: f64,
    phi_max: f64,
}

/// What the oracle says about a ray.
enum Answer {
    Miss,
    Hit(DVec3),
    /// Too close to a silhouette or a clip for the digits of `f64`.
    Undecidable,
}

impl Oracle {
    fn answer(&self, ray: &Ray, center: DVec3, size: f64) -> Answer {
        let d = |x: f64| Double::from(x);
        let origin = ray.origin.as_dvec3().to_array();
        let o: [Double; 3] = std::array::from_fn(|i| d(origin[i]) - d(center.to_array()[i]));
        let dir = ray.direction.as_dvec3().to_array().map(d);
        let (k, zz, zl, cc) = (d(self.round), d(self.z_squared), d(self.z_linear), d(self.constant));
        let a = k * (dir[0] * dir[0] + dir[1] * dir[1]) + zz * dir[2] * dir[2];
        let b = k * (o[0] * dir[0] + o[1] * dir[1]) + zz * o[2] * dir[2] + d(0.5) * zl * dir[2];
        let c = k * (o[0] * o[0] + o[1] * o[1]) + zz * o[2] * o[2] + zl * o[2] + cc;
        let disc = b * b - a * c;
        // The discriminant as the shape sees it, from the closest point of the ray, is of the order of size².
        let scale = a.value().abs() * size * size * self.round.abs();
        if disc.value().abs() < 1e-13 * scale {
            return Answer::Undecidable;
        }
        if disc.value() < 0.0 {
            return Answer::Miss;
        }
        let mut roots = [(-b - disc.sqrt()) / a, (-b + disc.sqrt()) / a];
        if roots[1].value() < roots[0].value() {
            roots.swap(0, 1);
        }
        for t in roots {
            let p = DVec3::from_array(std::array::from_fn(|i| (o[i] + dir[i] * t).value()));
            let phi = p.y.atan2(p.x).rem_euclid(TAU);
            let near = 1e-11;
            let ends = [t.value() / size, (p.z - self.z_min) / size, (self.z_max - p.z) / size];
            let partial = self.phi_max < TAU;
            let at_clip = ends.iter().any(|e| e.abs() < near)
                || (partial && (phi.min(TAU - phi) < near || (phi - self.phi_max).abs() < near || p.x.hypot(p.y) < near * size));
            if at_clip {
                return Answer::Undecidable;
            }
            if ends.iter().all(|&e| e > 0.0) && (!partial || phi < self.phi_max) {
                let exact = std::array::from_fn(|i| (o[i] + dir[i] * t + d(center.to_array()[i])).value());
                return Answer::Hit(DVec3::from_array(exact));
            }
        }
        Answer::Miss
    }
}

struct Case {
    shape: Analytic,
    oracle: Oracle,
    size: f64,
}

fn sphere_case(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Case {
    let shape = Analytic::Sphere(Sphere::new(radius, z_min, z_max, phi_max).unwrap());
    // A full sphere is not cut at its poles.
    let widen = |z: f64| if z.abs() == radius { 2.0 * z } else { z };
    let (z_min, z_max) = (widen(z_min), widen(z_max));
    let oracle = Oracle { round: 1.0, z_squared: 1.0, z_linear: 0.0, constant: -radius * radius, z_min, z_max, phi_max };
    Case { shape, oracle, size: radius }
}

fn frustum_case(bottom: f64, top: f64, height: f64, phi_max: f64) -> Case {
    let shape = Analytic::Frustum(Frustum::new(bottom, top, height, phi_max).unwrap());
    // Parameters with few digits: these products are exact.
    let spread = top - bottom;
    let oracle = Oracle {
        round: height * height,
        z_squared: -spread * spread,
        z_linear: -2.0 * bottom * height * spread,
        constant: -bottom * bottom * height * height,
        z_min: 0.0,
        z_max: height,
        phi_max,
    };
    Case { shape, oracle, size: bottom.max(top).max(height) }
}

fn full_cases() -> Vec<Case> {
    vec![
        sphere_case(1.0, -1.0, 1.0, TAU),
        frustum_case(1.0, 1.0, 2.0, TAU),
        frustum_case(1.0, 0.0, 2.0, TAU),
        frustum_case(0.5, 1.25, 0.75, TAU),
    ]
}

fn partial_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for phi_max in [0.7, FRAC_PI_2, 2.5, PI, 4.0, 5.5] {
        cases.push(sphere_case(1.0, -0.5, 0.75, phi_max));
        cases.push(sphere_case(1.0, 0.25, 1.0, phi_max));
        cases.push(frustum_case(1.0, 1.0, 2.0, phi_max));
        cases.push(frustum_case(1.0, 0.0, 1.5, phi_max));
        cases.push(frustum_case(0.25, 1.0, 1.0, phi_max));
    }
    cases
}

const NO_HIT: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, shape: ShapeId(0), prim: PrimId(0), instance: InstanceId(u32::MAX) };

fn interaction(placed: &Placed, ray: &Ray) -> Option<SurfaceInteraction> {
    let local = placed.intersect(ray)?;
    placed.interaction(ray, &Hit { t: local.t as f32, ..NO_HIT })
}

/// A ray that starts `distance` away and passes a random point of the shape, or passes inside a silhouette by `depth`; with the centre
/// that makes it so.
fn aimed(random: &mut Rng, shape: &Analytic, distance: f64, depth: Option<f64>) -> (Ray, DVec3) {
    loop {
        let ray = Ray::new((random.cube() * 3.0).as_vec3(), random.direction().as_vec3());
        let d = ray.direction.as_dvec3();
        let target = shape.sample([random.unit(), random.unit()]);
        let local = match depth {
            None => target.p,
            Some(depth) => {
                // A point of the same height whose normal is perpendicular to the ray, moved inward.
                let (rho, n_z) = (target.p.x.hypot(target.p.y), target.n.z);
                let (n_rho, d_rho) = ((1.0 - n_z * n_z).sqrt(), d.x.hypot(d.y));
                let cos = -n_z * d.z / (n_rho * d_rho);
                if cos.is_nan() || cos.abs() > 1.0 {
                    continue;
                }
                let (sin, cos) = (d.y.atan2(d.x) + cos.acos()).sin_cos();
                dvec3(rho * cos, rho * sin, target.p.z) - dvec3(n_rho * cos, n_rho * sin, n_z) * depth
            }
        };
        return (ray, ray.origin.as_dvec3() + d * distance - local);
    }
}

/// C1 and C7: no missed and no false hits, and hit points as good as correctly rounded ones.
fn compare_with_oracle(cases: &[Case], rays: usize, seed: u64) -> f64 {
    let mut random = Rng::new(seed);
    let (mut worst, mut decided, mut all) = (0f64, 0, 0);
    for case in cases {
        for i in 0..rays {
            let distance = random.magnitude(0.5, 6.0);
            let depth = (i % 2 == 0).then(|| random.magnitude(-6.0, -1.0) * if i % 10 == 0 { -1.0 } else { 1.0 });
            let (ray, center) = aimed(&mut random, &case.shape, distance, depth);
            let placed = Placed::new(case.shape.clone(), Transform::from_translation(center));
            let found = interaction(&placed, &ray);
            all += 1;
            match case.oracle.answer(&ray, center, case.size) {
                Answer::Undecidable => continue,
                Answer::Miss => assert!(found.is_none(), "{:?} {ray:?} {center}", case.shape),
                Answer::Hit(exact) => {
                    let p = found.unwrap_or_else(|| panic!("lost: {:?} {ray:?} {center}", case.shape)).p.as_vec3().as_dvec3();
                    let error = (p - exact).abs().max_element() / (UNIT_ROUNDOFF * exact.abs().max_element().max(case.size));
                    worst = worst.max(error);
                }
            }
            decided += 1;
        }
    }
    assert!(f64::from(decided) > 0.99 * f64::from(all), "{decided} of {all}");
    worst
}

#[test]
fn hits_of_quadrics_agree_with_the_oracle() {
    let worst = compare_with_oracle(&full_cases(), 30_000, 1);
    assert!(worst <= 1.001, "{worst}");
}

#[test]
fn hits_of_partial_quadrics_agree_with_the_oracle() {
    let worst = compare_with_oracle(&partial_cases(), 4_000, 2);
    assert!(worst <= 1.001, "{worst}");
}

#[test]
fn hits_of_flat_shapes_agree_with_the_oracle() {
    let mut random = Rng::new(3);
    let mut worst = 0f64;
    let disk = Analytic::Disk(Disk::new(1.0, 0.25, 4.0).unwrap());
    let quad = Analytic::Quad(Quad::new(dvec3(-1.0, -0.5, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.5, 1.5, 0.0)).unwrap());
    for i in 0..60_000 {
        let shape = if i % 2 == 0 { &disk } else { &quad };
        let distance = random.magnitude(0.5, 6.0);
        let (ray, mut center) = aimed(&mut random, shape, distance, None);
        center += dvec3(random.range(-0.5, 0.5), random.range(-0.5, 0.5), 0.0);
        let d = |x: f64| Double::from(x);
        let (o, dir) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let t = (d(center.z) - d(o.z)) / d(dir.z);
        let p = std::array::from_fn::<_, 2, _>(|k| d(o[k]) + d(dir[k]) * t);
        let (x, y) = ((p[0] - d(center.x)).value(), (p[1] - d(center.y)).value());
        let phi = y.atan2(x).rem_euclid(TAU);
        let (v, rho) = ((y + 0.5) / 1.5, x.hypot(y));
        let u = (x + 1.0 - 0.5 * v) / 2.0;
        let margins = if i % 2 == 0 { [1.0 - rho, rho - 0.25, 4.0 - phi, phi] } else { [u, 1.0 - u, v, 1.0 - v] };
        if margins.iter().any(|m| m.abs() < 1e-11) || dir.z.abs() < 1e-4 {
            continue;
        }
        let found = interaction(&Placed::new(shape.clone(), Transform::from_translation(center)), &ray);
        assert_eq!(found.is_some(), margins.iter().all(|&m| m > 0.0), "{shape:?} {ray:?} {center}");
        if let Some(found) = found {
            let exact = dvec3(p[0].value(), p[1].value(), center.z);
            let error = (found.p.as_vec3().as_dvec3() - exact).abs().max_element();
            worst = worst.max(error / (UNIT_ROUNDOFF * exact.abs().max_element().max(1.0)));
        }
    }
    assert!(worst <= 1.001, "{worst}");
}

mod promises;
