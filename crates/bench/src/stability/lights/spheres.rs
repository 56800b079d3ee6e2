//! Whole spheres, seen from outside, from inside and from very far.

use std::f64::consts::{PI, TAU};

use super::{Effort, Faults, Outcome, TWO_SIDED, Tests, first_light, grid, place, target, transform};
use crate::geometry::{Analytic, Geometry, Sphere};
use crate::id::{PrimId, ShapeId};
use crate::light::{AreaLight, LightSampleContext};
use crate::math::{DMat3, DVec3, Ray, Rng};
use crate::stability::Plot;

const RADIUS: f64 = 2.5;
const CENTER: DVec3 = DVec3::new(0.1, 0.2, 0.3);
const ASIDE: DVec3 = DVec3::new(0.48, -0.6, 0.64);

fn lamp(radius: f64) -> (Geometry, AreaLight) {
    let sphere = Analytic::Sphere(Sphere::full(radius).expect("a positive radius"));
    let geometry = place(sphere, transform(DMat3::IDENTITY, CENTER));
    let light = first_light(&geometry, TWO_SIDED);
    (geometry, light)
}

/// Distances from 1.0001 to 1e7 radii.
fn distances(count: u32) -> impl Iterator<Item = f64> {
    (0..=count).map(move |i| 1.0 + 1e-4 * 1e11f64.powf(f64::from(i) / f64::from(count)))
}

/// Solid angle of a sphere from `d` radii away.
fn solid_angle(d: f64) -> f64 {
    let half_angle = 1f64.atan2(((d - 1.0) * (d + 1.0)).sqrt());
    4.0 * PI * (0.5 * half_angle).sin().powi(2)
}

pub(super) fn l2_solid_angles(effort: Effort) -> Outcome {
    let (geometry, light) = lamp(RADIUS);
    let mean = |d: f64, n: u32| {
        let p = CENTER + ASIDE * (d * RADIUS);
        let sum: f64 = grid(n)
            .filter_map(|u| light.sample(&geometry, &[], &LightSampleContext::from_any_side(p), u))
            .map(|s| 1.0 / f64::from(s.pdf))
            .sum();
        sum / f64::from(n * n)
    };
    // One density for all directions: a few samples give it.
    let relative = |d: f64| (mean(d, 8) / solid_angle(d) - 1.0).abs();
    let curve: Vec<(f64, f64)> = distances(effort.pick(100, 1000)).map(|d| (d - 1.0, relative(d))).collect();
    let outside = curve.iter().fold(0.0, |worst, &(_, e)| e.max(worst));

    // At least the catalogue's 131,072 points.
    let n = effort.pick(363, 2000);
    let inside = [0.0, 0.3, 0.6, 0.9].iter().map(|&d| (mean(d, n) - 4.0 * PI).abs()).fold(0.0, f64::max);
    // Seen from the surface itself, the sphere fills a half-space.
    let on = (mean(1.0, n) - TAU).abs();
    let plot = Plot {
        caption: "Solid angle of a sphere: relative error of the mean inverse density".into(),
        x: "height above the surface, in radii".into(),
        y: "relative error".into(),
        floor: 1e-9,
        curves: vec![("by cone".into(), curve)],
    };
    Outcome::new()
        .at_most("relative error outside", outside, 1e-3)
        .at_most("relative error 1 % above the surface", relative(1.01), 1e-3)
        .at_most("error inside, in steradians", inside, 0.01)
        .at_most("error on the surface, in steradians", on, 0.01)
        .plot(plot)
}

pub(super) fn l3_far_spheres(effort: Effort) -> Outcome {
    let (mut samples, mut hits) = (0f64, 0f64);
    let mut curve = Vec::new();
    for radius in [1e-3, RADIUS, 1e4] {
        let (geometry, light) = lamp(radius);
        for d in distances(effort.pick(200, 20_000)) {
            let p = CENTER + ASIDE * (d * radius);
            // The centre's coordinates round: at a height of 1e-4 radii that is what the distance can be known to.
            let d = (p - CENTER).length() / radius;
            let Some(s) = light.sample(&geometry, &[], &LightSampleContext::from_any_side(p), [0.4, 0.3]) else {
                return Outcome::new();
            };
            let error = (f64::from(s.pdf) * solid_angle(d) - 1.0).abs();
            samples = samples.max(error);
            if radius == RADIUS {
                curve.push((d, error));
            }

            // The density of a hit is computed by another way, from the point alone.
            let ray = Ray::new(p.as_vec3(), s.wi);
            let Some(hit) = geometry.shape(ShapeId(0)).intersect_prim(&ray, ShapeId(0), PrimId(0)) else { continue };
            let Some(at) = geometry.interaction(&ray, &hit) else { continue };
            hits = hits.max(
                (f64::from(light.pdf(&geometry, &LightSampleContext::from_any_side(p), &ray, &at)) * solid_angle(d)
                    - 1.0)
                    .abs(),
            );
        }
    }
    let plot = Plot {
        caption: "Density towards a sphere against f64 half-angles".into(),
        x: "distance in radii".into(),
        y: "relative error".into(),
        floor: 1e-10,
        curves: vec![("sample".into(), curve)],
    };
    Outcome::new()
        .at_most("relative error of samples", samples, 1e-6)
        .at_most("relative error of hits", hits, 1e-6)
        .plot(plot)
}

pub(super) fn l4_directions(effort: Effort) -> Outcome {
    let (geometry, light) = lamp(RADIUS);
    let shape = geometry.shape(ShapeId(0));
    let (mut lost, mut cone, mut along, mut point) = (Faults::NONE, 0f64, 0f64, 0f64);
    for d in [1.05, 2.0, 10.0, 100.0] {
        let p = (CENTER + ASIDE * (d * RADIUS)).as_vec3().as_dvec3();
        let distance = (CENTER - p).length();
        let axis = (CENTER - p) / distance;
        let one_minus_cos_max = solid_angle(distance / RADIUS) / TAU;
        for u in grid(10) {
            let Some(s) = light.sample(&geometry, &[], &LightSampleContext::from_any_side(p), u) else {
                lost.require(false, || format!("no sample at {p} for {u:?}"));
                continue;
            };
            // The chord keeps the digits of small angles.
            let toward = target(&s) - p;
            let one_minus_cos = 0.5 * (toward.normalize() - axis).length_squared();
            cone = cone.max((one_minus_cos / one_minus_cos_max - f64::from(u[0])).abs());
            along = along.max((toward.normalize() - s.wi.as_dvec3()).length());

            let ray = Ray::new(p.as_vec3(), s.wi);
            let at = shape.intersect_prim(&ray, ShapeId(0), PrimId(0)).and_then(|hit| geometry.interaction(&ray, &hit));
            let Some(at) = at else {
                lost.require(false, || format!("no hit of {ray:?}"));
                continue;
            };
            point = point.max((at.p - target(&s)).length() / distance);
        }
    }

    let mut tests = Tests::new();
    for d in [1.000_1, 1.05, 2.0, 50.0, 1e5] {
        let p = CENTER + ASIDE * (d * RADIUS);
        let axis = (CENTER - p).normalize();
        let (x, y) = axis.any_orthonormal_pair();
        let one_minus_cos_max = solid_angle(d) / TAU;
        let (mut counts, mut rng, n) = (vec![0u32; 256], Rng::new(1), effort.pick(100_000, 3_000_000));
        for _ in 0..n {
            let Some(s) = light.sample(&geometry, &[], &LightSampleContext::from_any_side(p), rng.pair()) else {
                continue;
            };
            let w = (target(&s) - p).normalize();
            let i = (0.5 * (w - axis).length_squared() / one_minus_cos_max * 16.0) as usize;
            let j = ((w.dot(y).atan2(w.dot(x)) / TAU + 1.0).fract() * 16.0) as usize;
            counts[i.min(15) * 16 + j.min(15)] += 1;
        }
        tests.counts(&format!("{d} radii away"), &counts, &vec![f64::from(n) / 256.0; 256]);
    }
    let outcome = Outcome::new()
        .none("grid directions without a sample or a hit", lost)
        .at_most("error of 1 - cos, in parts of the cone's", cone, 1e-5)
        .at_most("error of the direction", along, 1e-5)
        .at_most("distance to the hit, in parts of the way", point, 1e-5);
    tests.judge(outcome)
}
