//! Emitters that are not whole, or stretched.

use std::f64::consts::TAU;

use super::{Effort, Outcome, TWO_SIDED, Tests, first_light, place, skew, target};
use crate::geometry::{
    Analytic, Disk, Frustum, Geometry, Profile, Quad, Revolution, Shape, Sphere, SurfaceInteraction,
};
use crate::id::{PrimId, ShapeId};
use crate::light::{AreaLight, LightSampleContext};
use crate::math::float::step_past;
use crate::math::{DVec3, Ray, Rng};
use crate::stability::geometry::{meshes, triangle};

/// Parts of equal area along each side.
const PARTS: usize = 12;

/// Cosine below which a surface counts as seen edge-on: there the density is unbounded.
const EDGE_ON: f32 = 0.2;

/// An emitter in its own space: how far a point lies outside of its clips, and what part of the area lies before the
/// point, along both sides.
struct Emitter {
    name: &'static str,
    shape: Analytic,
    outside: fn(DVec3) -> f64,
    parts: fn(DVec3) -> [f64; 2],
}

fn phi(p: DVec3) -> f64 {
    p.y.atan2(p.x).rem_euclid(TAU)
}

fn rho(p: DVec3) -> f64 {
    p.x.hypot(p.y)
}

/// Surfaces of revolution turn about y, all others about z.
fn about_z(p: DVec3) -> DVec3 {
    DVec3::new(p.z, p.x, p.y)
}

/// How far `x` lies outside of an interval.
fn beyond(x: f64, low: f64, high: f64) -> f64 {
    (low - x).max(x - high).max(0.0)
}

/// How far the angle of `p` lies outside of a sector, as a length.
fn beyond_turn(p: DVec3, phi_max: f64) -> f64 {
    let angle = phi(p);
    rho(p) * (angle - phi_max).max(0.0).min(TAU - angle)
}

/// The profile of the emitter of revolution: straight, so that area has a closed form, though its parameter is not the
/// height.
const STRAIGHT: [[f64; 2]; 4] = [[0.3, 0.0], [0.3, 0.0], [0.7, 0.8], [0.9, 1.2]];

/// Part of a frustum's area below a height, for radii at both ends.
fn below(z: f64, height: f64, low: f64, high: f64) -> f64 {
    let share = z / height;
    share * (2.0 * low + (high - low) * share) / (low + high)
}

fn emitters() -> Vec<Emitter> {
    let revolution =
        Profile::bezier(&STRAIGHT).and_then(|profile| Revolution::new(&profile, 3.5)).expect("a valid profile");
    let quad = Quad::new(DVec3::new(-0.5, -0.3, 0.2), DVec3::new(1.0, 0.2, 0.0), DVec3::Y).expect("a valid quad");
    let valid = "valid limits";
    vec![
        Emitter {
            name: "disk",
            shape: Analytic::Disk(Disk::new(1.0, 0.0, TAU).expect(valid)),
            outside: |p| p.z.abs().max(beyond(rho(p), 0.0, 1.0)),
            parts: |p| [p.truncate().length_squared(), phi(p) / TAU],
        },
        Emitter {
            name: "ring sector",
            shape: Analytic::Disk(Disk::new(1.0, 0.4, 4.0).expect(valid)),
            outside: |p| p.z.abs().max(beyond(rho(p), 0.4, 1.0)).max(beyond_turn(p, 4.0)),
            parts: |p| [(p.truncate().length_squared() - 0.16) / 0.84, phi(p) / 4.0],
        },
        Emitter {
            name: "partial sphere",
            shape: Analytic::Sphere(Sphere::new(1.0, -0.2, 0.7, 5.0).expect(valid)),
            outside: |p| (p.length() - 1.0).abs().max(beyond(p.z, -0.2, 0.7)).max(beyond_turn(p, 5.0)),
            parts: |p| [(p.z + 0.2) / 0.9, phi(p) / 5.0],
        },
        Emitter {
            name: "cylinder sector",
            shape: Analytic::Frustum(Frustum::cylinder(0.6, 1.5, 3.0).expect(valid)),
            outside: |p| (rho(p) - 0.6).abs().max(beyond(p.z, 0.0, 1.5)).max(beyond_turn(p, 3.0)),
            parts: |p| [p.z / 1.5, phi(p) / 3.0],
        },
        Emitter {
            name: "cone",
            shape: Analytic::Frustum(Frustum::new(0.8, 0.0, 1.2, TAU).expect(valid)),
            outside: |p| (rho(p) - 0.8 * (1.0 - p.z / 1.2)).abs().max(beyond(p.z, 0.0, 1.2)),
            parts: |p| [below(p.z, 1.2, 0.8, 0.0), phi(p) / TAU],
        },
        Emitter {
            name: "frustum sector",
            shape: Analytic::Frustum(Frustum::new(0.8, 0.3, 1.2, 2.0).expect(valid)),
            outside: |p| (rho(p) - 0.8 + 0.5 * p.z / 1.2).abs().max(beyond(p.z, 0.0, 1.2)).max(beyond_turn(p, 2.0)),
            parts: |p| [below(p.z, 1.2, 0.8, 0.3), phi(p) / 2.0],
        },
        Emitter {
            name: "revolution sector",
            shape: Analytic::Revolution(revolution),
            outside: |p| {
                (rho(about_z(p)) - 0.3 - 0.5 * p.y).abs().max(beyond(p.y, 0.0, 1.2)).max(beyond_turn(about_z(p), 3.5))
            },
            parts: |p| [below(p.y, 1.2, 0.3, 0.9), phi(about_z(p)) / 3.5],
        },
        Emitter {
            name: "sheared quad",
            shape: Analytic::Quad(quad),
            outside: |p| (p.z - 0.2).abs().max(beyond(p.x, -0.5, 0.5)).max(beyond(p.y - 0.2 * (p.x + 0.5), -0.3, 0.7)),
            parts: |p| [p.x + 0.5, p.y + 0.3 - 0.2 * (p.x + 0.5)],
        },
    ]
}

/// What is seen of an emitter along rays from a point.
struct View<'a> {
    geometry: &'a Geometry,
    light: &'a AreaLight,
    p: DVec3,
}

impl View<'_> {
    /// All points of the emitter along a direction.
    fn hits(&self, direction: DVec3) -> Vec<(Ray, SurfaceInteraction)> {
        let mut ray = Ray::new(self.p.as_vec3(), direction.as_vec3());
        let mut found = Vec::new();
        while let Some(hit) = self.geometry.shape(ShapeId(0)).intersect_prim(&ray, ShapeId(0), PrimId(0)) {
            found.extend(self.geometry.interaction(&ray, &hit).map(|at| (ray, at)));
            ray.t_min = step_past(hit.t);
        }
        found
    }

    /// The integral of the density over the directions of a cone around the emitter, over the share of samples in the
    /// cone: both without the silhouettes.
    fn integral(&self, n: u32, rng: &mut Rng) -> f64 {
        let bounds = self.geometry.shape(ShapeId(0)).bounds();
        let center = 0.5 * (bounds.min + bounds.max).as_dvec3();
        let (axis, distance) = ((center - self.p).normalize(), (center - self.p).length());
        let cos_max = (1.0 - (0.5 * bounds.size().as_dvec3().length() / distance).powi(2)).max(0.0).sqrt();
        let (x, y) = axis.any_orthonormal_pair();
        let (mut sum, mut share) = (0.0, 0u32);
        for i in 0..n * n {
            let cos = 1.0 - (1.0 - cos_max) * (f64::from(i % n) + rng.unit()) / f64::from(n);
            let (s, c) = (TAU * (f64::from(i / n) + rng.unit()) / f64::from(n)).sin_cos();
            let sin = (1.0 - cos * cos).sqrt();
            for (ray, at) in self.hits(x * (sin * c) + y * (sin * s) + axis * cos) {
                if at.n_g.dot(ray.direction).abs() > EDGE_ON {
                    sum +=
                        f64::from(self.light.pdf(self.geometry, &LightSampleContext::from_any_side(self.p), &ray, &at));
                }
            }
            let u = [(i % n) as f32 + rng.unit_f32(), (i / n) as f32 + rng.unit_f32()]
                .map(|u| (u / n as f32).min(1.0 - f32::EPSILON));
            if let Some(s) = self.light.sample(self.geometry, &[], &LightSampleContext::from_any_side(self.p), u)
                && let crate::light::ShadowTarget::Point(target) = &s.target
            {
                share += u32::from(target.n.dot(s.wi).abs() > EDGE_ON);
            }
        }
        TAU * (1.0 - cos_max) * sum / f64::from(share)
    }

    /// The largest difference between the density of a sample and of the hit of a ray along it, and how many were
    /// compared.
    fn densities(&self, count: u32, rng: &mut Rng) -> (f64, usize) {
        let (mut worst, mut compared) = (0f64, 0);
        for _ in 0..count {
            let Some(s) = self.light.sample(self.geometry, &[], &LightSampleContext::from_any_side(self.p), rng.pair())
            else {
                continue;
            };
            let distance = (target(&s) - self.p).length();
            for (ray, at) in self.hits(s.wi.as_dvec3()) {
                // The rounding of the direction moves the point by distance / cos, and the cosine on a curved surface
                // by as much.
                let cos = f64::from(at.n_g.dot(s.wi));
                if (at.p - target(&s)).length() <= 1e-5 * distance && cos * cos >= 4e-3 * distance {
                    let pdf = self.light.pdf(self.geometry, &LightSampleContext::from_any_side(self.p), &ray, &at);
                    worst = worst.max((f64::from(pdf) / f64::from(s.pdf) - 1.0).abs());
                    compared += 1;
                }
            }
        }
        (worst, compared)
    }
}

/// Distances out of the clips, and counts by parts of equal area.
fn clips(emitter: &Emitter, view: &View, count: u32, rng: &mut Rng) -> (f64, Vec<u32>) {
    let (mut outside, mut counts) = (0f64, vec![0u32; PARTS * PARTS]);
    let Shape::Analytic(placed) = view.geometry.shape(ShapeId(0)) else { return (f64::NAN, counts) };
    for _ in 0..count {
        let q = placed.transform.inverse_point(placed.sample_area(rng.pair()).p);
        outside = outside.max((emitter.outside)(q));
        let [i, j] = (emitter.parts)(q).map(|part| ((part * PARTS as f64) as usize).min(PARTS - 1));
        counts[i * PARTS + j] += 1;
    }
    // Not every point of a light is a sample where it is seen edge-on; those that are lie within the clips too.
    for _ in 0..count / 10 {
        let Some(s) = view.light.sample(view.geometry, &[], &LightSampleContext::from_any_side(view.p), rng.pair())
        else {
            continue;
        };
        outside = outside.max((emitter.outside)(placed.transform.inverse_point(target(&s))));
    }
    (outside, counts)
}

pub(super) fn l5_partial_emitters(effort: Effort) -> Outcome {
    let mut rng = Rng::new(13);
    let mut tests = Tests::new();
    let (mut outside, mut integral, mut density, mut compared) = (0f64, (0f64, String::new()), 0f64, usize::MAX);
    let samples = effort.pick(20_000, 2_000_000);
    let mut measure = |view: &View, name: &str, rng: &mut Rng| {
        let error = (view.integral(effort.pick(200, 1000), rng) - 1.0).abs();
        if !(error <= integral.0) {
            integral = (error, name.to_owned());
        }
        let (worst, hits) = view.densities(effort.pick(2000, 20_000), rng);
        density = density.max(worst);
        compared = compared.min(hits);
    };
    for emitter in emitters() {
        for scale in [[1.0; 3], [1.0, 1.7, 0.6]] {
            let geometry = place(emitter.shape.clone(), skew(scale));
            let light = first_light(&geometry, TWO_SIDED);
            let view = View { geometry: &geometry, light: &light, p: DVec3::new(3.0, -2.0, 4.0) };
            let (worst, counts) = clips(&emitter, &view, samples, &mut rng);
            outside = outside.max(worst);
            let expected = vec![f64::from(samples) / (PARTS * PARTS) as f64; PARTS * PARTS];
            tests.counts(&format!("{} {scale:?}", emitter.name), &counts, &expected);
            measure(&view, emitter.name, &mut rng);
        }
    }
    let [a, b, c] = [[0.3, 0.1, -0.2], [1.1, 0.4, 0.3], [0.2, 1.3, 0.5]].map(DVec3::from);
    let geometry = meshes(vec![triangle(a, b, c)]);
    let light = first_light(&geometry, TWO_SIDED);
    measure(&View { geometry: &geometry, light: &light, p: DVec3::new(3.0, -2.0, 4.0) }, "triangle", &mut rng);

    let outcome = Outcome::new()
        .at_most("distance of samples out of the clips", outside, 1e-6)
        .at_most(format!("error of the density's integral ({})", integral.1), integral.0, 0.01)
        .at_most("relative error of the density of hits", density, 1e-4)
        .at_least("hits compared of each emitter", compared as f64, effort.pick(100.0, 1000.0));
    tests.judge(outcome)
}
