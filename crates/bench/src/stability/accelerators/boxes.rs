//! Box tests must never lose a primitive whose own test the ray passes.

use std::f64::consts::TAU;

use super::{count, differing, oracle_hits};
use crate::accel::LinearAccel;
use crate::geometry::{Analytic, Disk, Geometry, Hit, Mesh, Shape, Sphere, TransformedShape};
use crate::math::{DMat3, DVec3, Ray, Transform, Vec3};
use crate::stability::geometry::{Rng, cube, meshes, ray, ray_through, soup, transform, world};
use crate::stability::scenes::{all, own};
use crate::stability::{Effort, Faults, Outcome, Plot};

fn corner(mesh: &Mesh, i: usize) -> DVec3 {
    DVec3::from_array(mesh.positions()[i].map(f64::from))
}

/// The answers of accelerators other than Embree that differ from the oracle's.
fn judged(outcome: Outcome, geometry: &Geometry, rays: Vec<Ray>) -> Outcome {
    let rays = oracle_hits(&LinearAccel::new(geometry), rays);
    let hits = rays.iter().filter(|(_, hit)| hit.is_some()).count();
    let outcome = outcome.record("rays", rays.len() as f64).at_least(
        "share of rays that hit",
        hits as f64 / rays.len() as f64,
        0.4,
    );
    own(geometry).into_iter().fold(outcome, |outcome, (name, accel)| {
        outcome.none(format!("answers of {name} that differ in a bit"), differing(name, &*accel, &rays))
    })
}

pub(super) fn f4_grazed_boxes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(34);
    let boxes: Vec<Mesh> = (0..60).map(|_| cube(DMat3::IDENTITY * rng.range(0.01, 0.2), rng.cube())).collect();
    let mut grazing = || {
        let mesh = &boxes[rng.below(60)];
        let (a, b) = (corner(mesh, rng.below(8)), corner(mesh, rng.below(8)));
        let d = if a == b || rng.unit() < 0.5 { rng.direction() } else { (b - a).normalize() };
        ray(a - d * rng.magnitude(-2.0, 4.0), d)
    };
    let rays = (0..effort.pick(15_000, 1_000_000)).map(|_| grazing()).collect();
    judged(Outcome::new(), &meshes(boxes), rays)
}

/// A sphere or a disk around a point.
struct Round {
    center: DVec3,
    radius: f64,
    /// Of a disk.
    normal: Option<DVec3>,
    placed: TransformedShape,
}

impl Round {
    fn new(rng: &mut Rng, center: DVec3, is_disk: bool) -> Self {
        let (radius, turn) = (rng.range(0.1, 2.0), rng.rotation());
        let shape = if is_disk {
            Disk::new(radius, 0.0, TAU).map(Analytic::Disk)
        } else {
            Sphere::full(radius).map(Analytic::Sphere)
        };
        let placed = TransformedShape::new(shape.expect("radii are above zero"), transform(turn, center));
        Self { center, radius, normal: is_disk.then_some(turn.z_axis), placed }
    }

    /// From the centre to the extreme point along an axis.
    fn extreme(&self, axis: DVec3) -> DVec3 {
        self.radius * self.normal.map_or(axis, |n| axis.reject_from(n).normalize())
    }
}

pub(super) fn f5_extreme_points(effort: Effort) -> Outcome {
    let mut outcome = Outcome::new();
    for distance in [0.0, 100.0, 1e5] {
        let mut rng = Rng::new(35);
        let mut round = |i| {
            let center = DVec3::splat(distance) + 20.0 * rng.cube();
            Round::new(&mut rng, center, i % 2 == 1)
        };
        let rounds: Vec<Round> = (0..64).map(&mut round).collect();
        let mut grazing = || {
            let round = &rounds[rng.below(64)];
            let axis = [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3)] * [1.0, -1.0][rng.below(2)];
            let point = round.center + round.extreme(axis) * (1.0 - rng.magnitude(-8.0, -1.0));
            // Along the side of the bounds.
            let along = axis.cross(rng.direction()).normalize();
            ray(point - 6.0 * along, along)
        };
        let rays: Vec<Ray> = (0..effort.pick(2_000, 150_000)).map(|_| grazing()).collect();
        let geometry = world(rounds.into_iter().map(|round| Shape::Analytic(round.placed)).collect());
        let rays = oracle_hits(&LinearAccel::new(&geometry), rays);
        let hits = rays.iter().filter(|(_, hit)| hit.is_some()).count();
        outcome = outcome.at_least(format!("hits at distance {distance}"), hits as f64, 0.2 * rays.len() as f64);
        let mut differ = Faults::default();
        all(&geometry).iter().for_each(|(name, accel)| differ += differing(name, &**accel, &rays));
        outcome = outcome.none(format!("answers of six accelerators that differ at distance {distance}"), differ);
    }
    outcome
}

pub(super) fn f6_far_cameras(effort: Effort) -> Outcome {
    let sphere = Analytic::Sphere(Sphere::full(1.0).expect("the radius is 1"));
    let geometry = world(vec![Shape::Analytic(TransformedShape::new(sphere, Transform::IDENTITY))]);
    let accels = all(&geometry);
    let mut rng = Rng::new(36);
    let (mut differ, mut missed, mut sure) = (Faults::default(), Faults::default(), 0);
    let mut curve = Vec::new();
    for exponent in 1..=9 {
        let distance = 10f64.powi(exponent);
        let mut at_sphere = || ray_through(distance * rng.direction(), 0.9 * rng.unit().cbrt() * rng.direction());
        let rays = (0..effort.pick(1_000, 100_000)).map(|_| at_sphere()).collect();
        let rays = oracle_hits(&LinearAccel::new(&geometry), rays);
        let before = differ.count;
        accels.iter().for_each(|(name, accel)| differ += differing(name, &**accel, &rays));
        curve.push((distance, (differ.count - before) as f64 / (accels.len() * rays.len()) as f64));
        // What f32 has made of the ray may pass the sphere.
        let meets = |ray: &Ray| {
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            o.reject_from(d).length() < 0.999
        };
        sure += count(&rays, |(ray, _)| meets(ray));
        let is_missed = |(ray, hit): &(Ray, Option<Hit>)| usize::from(meets(ray) && hit.is_none());
        missed += Faults::of(&rays, is_missed, |(ray, _)| format!("{ray:?}"));
    }
    Outcome::new()
        .at_least("rays that surely meet the sphere", sure as f64, effort.pick(5e3, 5e5))
        .none("of those, rays that miss by the oracle", missed)
        .none("answers of six accelerators that differ from the oracle's", differ)
        .plot(Plot {
            caption: "Share of rays from afar at a unit sphere that an accelerator answers otherwise than the oracle"
                .into(),
            x: "distance in radii".into(),
            y: "share of rays".into(),
            floor: 1e-7,
            curves: vec![("all accelerators".into(), curve)],
        })
}

/// A ray along an axis or in a plane of two, from a point with coordinates of two vertices: in planes of the faces of
/// boxes.
fn axis_parallel(rng: &mut Rng, mesh: &Mesh) -> Ray {
    let vertex = |rng: &mut Rng| Vec3::from(mesh.positions()[rng.below(mesh.positions().len())]);
    let zero = |rng: &mut Rng| if rng.unit() < 0.5 { 0.0 } else { -0.0 };
    let axis = rng.below(3);
    let mut direction = Vec3::new(zero(rng), zero(rng), zero(rng));
    direction[axis] = if rng.unit() < 0.5 { 1.0 } else { -1.0 };
    let (a, b) = (vertex(rng), vertex(rng));
    let mut start = a;
    start[(axis + 1) % 3] = if rng.unit() < 0.5 { b[(axis + 1) % 3] } else { rng.range(-1.0, 1.0) as f32 };
    if rng.unit() < 0.3 {
        direction[(axis + 1) % 3] = rng.range(-1.0, 1.0) as f32;
    }
    // From a face of the boxes, or from outside.
    if rng.unit() < 0.7 {
        start -= direction * 4.0;
    }
    Ray::new(start, direction)
}

pub(super) fn f7_axis_parallel_rays(effort: Effort) -> Outcome {
    let mut rng = Rng::new(37);
    let mesh = soup(&mut rng, 400, 0.4);
    let rays: Vec<Ray> = (0..effort.pick(10_000, 500_000)).map(|_| axis_parallel(&mut rng, &mesh)).collect();
    let geometry = meshes(vec![mesh]);
    judged(Outcome::new(), &geometry, rays)
}
