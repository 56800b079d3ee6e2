//! Rays that are none, and rays at the end of what is one.

use super::{Effort, Faults, Outcome};
use crate::accel::{AccelKind, Accelerator};
use crate::geometry::{Geometry, Hit, Shape};
use crate::math::float::{SMALLEST_NORMAL, step_past};
use crate::math::{DMat3, DVec3, Ray, Vec3};
use crate::stability::geometry::{Rng, cube, instances, meshes, placed_analytic_shapes, transform, triangle, world};
use crate::stability::scenes::{INEXACT_RECIPROCALS, all, all_answers, build, distance_error};

/// A valid ray that hits every scene of [`scenes`].
const GOOD: Ray =
    Ray { origin: Vec3::new(0.1, 0.2, 0.3), t_min: 0.0, direction: Vec3::Z, t_max: f32::INFINITY, time: 0.0 };

/// The smallest number above zero, a denormal.
const SMALLEST: f32 = f32::from_bits(1);

/// A box in the world, a box through instances, and a box with every analytic shape around it, likewise.
fn scenes() -> Vec<Geometry> {
    let unit = || Shape::Mesh(cube(DMat3::IDENTITY, DVec3::ZERO));
    let turned = |scale: f64| transform(DMat3::from_rotation_y(0.2) * scale, DVec3::splat(0.01));
    let mut shapes = placed_analytic_shapes(&mut Rng::new(1), DVec3::ZERO);
    shapes.push(unit());
    vec![
        world(vec![unit()]),
        instances(vec![unit()], &[turned(1.0), turned(5.0), turned(1e-6), turned(1e6)]),
        world(shapes.clone()),
        instances(shapes, &[turned(1.0), turned(2.0)]),
    ]
}

/// [`all`] and the oracle.
fn everyone(geometry: &Geometry) -> Vec<(&'static str, Box<dyn Accelerator + '_>)> {
    let mut accels = all(geometry);
    accels.push(("linear", build(AccelKind::Linear, geometry)));
    accels
}

/// One ray for each way of being none.
fn invalid_rays() -> Vec<Ray> {
    let mut rays = Vec::new();
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e19, -1e19, f32::MAX, f32::MIN] {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let put = |v: Vec3| Vec3::select(axis.cmpgt(Vec3::ZERO), Vec3::splat(bad), v);
            rays.push(Ray { origin: put(GOOD.origin), ..GOOD });
            rays.push(Ray { direction: put(GOOD.direction), ..GOOD });
        }
        rays.push(Ray { time: bad, ..GOOD });
    }
    rays.extend(
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -SMALLEST_NORMAL, -SMALLEST]
            .map(|t_min| Ray { t_min, ..GOOD }),
    );
    rays.extend([f32::NAN, f32::NEG_INFINITY, -1.0, -SMALLEST].map(|t_max| Ray { t_max, ..GOOD }));
    rays.extend([-1e-7, 1.000_000_1].map(|time| Ray { time, ..GOOD }));
    rays.push(Ray { t_min: 2.0, t_max: 1.0, ..GOOD });
    rays.push(Ray::INACTIVE);
    rays
}

/// A ray of random bits, or with numbers of random signs and exponents, zeros and denormals among them.
fn wild_ray(rng: &mut Rng) -> Ray {
    let mut number = || match rng.below(6) {
        0 => 0.0,
        1 => f32::from_bits(rng.bits() as u32 & 0x807f_ffff),
        2 => f32::from_bits(rng.bits() as u32),
        _ => (rng.magnitude(-45.0, 18.2) * rng.range(-1.0, 1.0).signum()) as f32,
    };
    let mut vector = || Vec3::new(number(), number(), number());
    let (origin, direction) = (vector(), vector());
    let [t_min, t_max, time] = [number(), number(), number()];
    match rng.below(4) {
        0 => Ray { origin, t_min, direction, t_max, time },
        1 => Ray { t_min: t_min.abs(), ..Ray::new(origin, direction) },
        _ => Ray::new(origin, direction),
    }
}

/// The answers of any entry point that are at fault: `faults` counts those of closest-hit and any-hit queries of a ray.
fn faults_of(
    name: &str,
    accel: &dyn Accelerator,
    rays: &[Ray],
    faults: impl Fn(usize, Option<Hit>, bool) -> usize,
) -> Faults {
    let mut found = Faults::default();
    for (hits, occluded) in all_answers(accel, rays) {
        for (i, ray) in rays.iter().enumerate() {
            found.add(faults(i, hits[i], occluded[i]), || {
                format!("{name}: {ray:?} has {:?} (occluded: {})", hits[i], occluded[i])
            });
        }
    }
    found
}

/// The answers of any entry point that are hits, of closest-hit and any-hit queries.
pub(super) fn hits(name: &str, accel: &dyn Accelerator, rays: &[Ray]) -> Faults {
    faults_of(name, accel, rays, |_, hit, occluded| usize::from(hit.is_some()) + usize::from(occluded))
}

/// The answers with a distance that is not within the ray's interval.
fn outside(name: &str, accel: &dyn Accelerator, rays: &[Ray]) -> Faults {
    let within = |ray: &Ray, t: f32| ray.t_min <= t && t <= ray.t_max;
    faults_of(name, accel, rays, |i, hit, _| usize::from(hit.is_some_and(|hit| !within(&rays[i], hit.t))))
}

pub(super) fn e1_invalid_rays(effort: Effort) -> Outcome {
    let invalid = invalid_rays();
    // Between invalid lanes of a packet a valid one is answered all the same.
    let mixed: Vec<Ray> = invalid.iter().flat_map(|&bad| [bad, GOOD, bad]).collect();
    let mut rng = Rng::new(21);
    let wild: Vec<Ray> = (0..effort.pick(3_000, 400_000)).map(|_| wild_ray(&mut rng)).collect();
    let wild_invalid: Vec<Ray> = wild.iter().filter(|ray| !ray.is_valid()).copied().collect();
    let (mut struck, mut disturbed, mut beyond) = (Faults::default(), Faults::default(), Faults::default());
    for geometry in &scenes() {
        for (name, accel) in everyone(geometry) {
            struck += hits(name, &*accel, &invalid);
            disturbed += faults_of(name, &*accel, &mixed, |i, hit, occluded| {
                usize::from([hit.is_some(), occluded] != [i % 3 == 1; 2])
            });
            // The oracle sees as many as it has time for.
            let few = if name == "linear" { 2_000 } else { wild.len() };
            struck += hits(name, &*accel, &wild_invalid[..few.min(wild_invalid.len())]);
            beyond += outside(name, &*accel, &wild[..few.min(wild.len())]);
        }
    }
    Outcome::new()
        .record("invalid rays", (invalid.len() + wild_invalid.len()) as f64)
        .none(
            "valid among those made to be invalid",
            Faults::of(&invalid, |ray| usize::from(ray.is_valid()), |ray| format!("{ray:?}")),
        )
        .at_least("valid rays among the wild", (wild.len() - wild_invalid.len()) as f64, 0.4 * wild.len() as f64)
        .none("invalid rays that hit", struck)
        .none("rays between invalid ones with another answer", disturbed)
        .none("distances outside of the ray's interval", beyond)
}

pub(super) fn e2_zero_directions(effort: Effort) -> Outcome {
    let mut rng = Rng::new(22);
    let (mut struck, mut beyond, mut tried) = (Faults::default(), Faults::default(), 0);
    for geometry in &scenes() {
        for (name, accel) in everyone(geometry) {
            let (mut zeros, mut tiny) = (Vec::new(), Vec::new());
            for _ in 0..effort.pick(200, 5_000) {
                let start = Ray::new(3.0 * rng.cube().as_vec3(), rng.direction().as_vec3());
                let zero = |rng: &mut Rng| if rng.unit() < 0.5 { 0.0f32 } else { -0.0 };
                let direction = Vec3::new(zero(&mut rng), zero(&mut rng), zero(&mut rng));
                // Off the surfaces, and on one.
                let on = accel.intersect(&start).map_or(start.origin, |hit| start.at(hit.t));
                zeros.extend([start.origin, on].map(|origin| Ray { origin, direction, ..start }));
                let length = rng.magnitude(-45.0, -30.0) as f32;
                tiny.extend([start.origin, on].map(|origin| Ray {
                    origin,
                    direction: start.direction * length,
                    ..start
                }));
            }
            tried += zeros.len();
            struck += hits(name, &*accel, &zeros);
            beyond += outside(name, &*accel, &tiny);
        }
    }
    Outcome::new()
        .record("rays of direction zero", tried as f64)
        .none("of those, hits", struck)
        .none("distances of the shortest directions outside of the interval", beyond)
}

pub(super) fn e5_ends_of_intervals(_: Effort) -> Outcome {
    let geometry = meshes(vec![triangle(DVec3::ZERO, DVec3::X, DVec3::Y)]);
    let accels = everyone(&geometry);
    let (mut cases, mut wrong) = (0, Faults::default());
    let on = Ray::new(Vec3::new(0.25, 0.25, 0.0), Vec3::Z);
    let mut worst: f32 = 0.0;
    for (name, accel) in &accels {
        let error = distance_error(name);
        worst = worst.max(error);
        let mut judge = |ray: Ray, expected: bool| {
            for (hits, occluded) in all_answers(&**accel, &[ray]) {
                cases += 1;
                let answer = (hits[0].is_some(), occluded[0]);
                wrong.require(answer == (expected, expected), || format!("{name}: {ray:?}: hit, occluded: {answer:?}"));
            }
        };
        for exponent in -20..=20 {
            let t = 2f32.powi(exponent);
            let ray = Ray::new(Vec3::new(0.25, 0.25, -t), Vec3::Z);
            let (before, after) = (t * (1.0 - error), t * (1.0 + error));
            judge(Ray { t_min: before, ..ray }, true);
            judge(Ray { t_min: after.next_up(), ..ray }, false);
            judge(Ray { t_max: after, ..ray }, true);
            judge(Ray { t_max: before.next_down(), ..ray }, false);
            judge(Ray { t_min: before, t_max: after, ..ray }, true);
        }
        judge(on, true);
        judge(Ray { t_max: SMALLEST_NORMAL, ..on }, true);
        judge(Ray { t_min: SMALLEST_NORMAL, ..on }, false);
    }
    let outcome = Outcome::new().record("queries", cases as f64).none("answered wrongly", wrong);
    if worst == 0.0 { outcome } else { outcome.short(INEXACT_RECIPROCALS) }
}

/// Hits of a ray in turn, each sought from one step past the one before; at most `limit`.
fn walk(accel: &dyn Accelerator, mut ray: Ray, limit: usize) -> Vec<f32> {
    let mut distances = Vec::new();
    while let Some(hit) = accel.intersect(&ray) {
        distances.push(hit.t);
        if distances.len() == limit {
            break;
        }
        ray.t_min = step_past(hit.t);
    }
    distances
}

pub(super) fn e6_steps_past_hits(effort: Effort) -> Outcome {
    const PLANES: usize = 17;
    let mut walks = 0;
    let [mut endless, mut backward, mut incomplete, mut again] = [const { Faults::NONE }; 4];
    let mut rng = Rng::new(23);
    for scale in [1.0, 1e-10, 1e-20] {
        let plane = |i: usize| DVec3::Z * (i as f64 * scale);
        let corner = |i: usize, d: DVec3| plane(i) + 4.0 * scale * d;
        let side =
            |i: usize| triangle(corner(i, -DVec3::X - DVec3::Y), corner(i, 2.0 * DVec3::X), corner(i, 2.0 * DVec3::Y));
        let geometry = meshes((0..PLANES).map(side).collect());
        for (name, accel) in everyone(&geometry) {
            for length in [1.0, 1e10, 1e18] {
                for _ in 0..effort.pick(10, 1_000) {
                    let start = scale * DVec3::new(rng.range(-0.5, 0.5), rng.range(-0.5, 0.5), 0.0);
                    let ray = Ray::new(start.as_vec3(), Vec3::new(0.0, 0.0, length));
                    let distances = walk(&*accel, ray, PLANES + 1);
                    walks += 1;
                    let describe = || format!("{name}: {ray:?} has {distances:?}");
                    endless.require(distances.len() <= PLANES, describe);
                    backward.add(distances.windows(2).filter(|pair| pair[1] <= pair[0]).count(), describe);
                    // Smaller distances than normal floats may be stepped over.
                    if scale / f64::from(length) > f64::from(SMALLEST_NORMAL) * 1e6 && scale > 1e-18 {
                        incomplete.require(distances.len() == PLANES, describe);
                    }
                    // Past a hit at zero even the smallest step is one, and so it is where denormals count as zero.
                    let stepped = [step_past(0.0), SMALLEST].map(|t_min| accel.intersect(&Ray { t_min, ..ray }));
                    again.add(stepped.iter().flatten().filter(|hit| hit.t == 0.0).count(), describe);
                }
            }
        }
    }
    Outcome::new()
        .record("walks", walks as f64)
        .none("walks that find more hits than there are planes", endless)
        .none("steps back", backward)
        .none("walks at normal distances that miss a plane", incomplete)
        .none("hits at zero found again from beyond it", again)
}
