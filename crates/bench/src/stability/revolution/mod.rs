//! Group D: surfaces of revolution.

mod roots;
mod surfaces;

use std::f64::consts::{PI, TAU};

use self::roots::all_hits;
use self::surfaces::{d3_equals_quadrics, d4_joints_and_poles, d5_spheroids_are_not_hit_again, d6_areas, d7_b_splines};
use super::geometry::Rng;
use super::{Effort, Faults, Outcome, vectors};
use crate::geometry::{Profile, Revolution};
use crate::math::{DVec3, RayF64, dvec3};

checks! {
    "D1" d1_all_roots_are_found "completeness of roots":
        "vase, looping profile, ball and a tall curl; rays through points of the surface: general, within 1e-1 to 1e-7 \
         of tangent, tilted by 1e-9 to 1e-2 and by 0, nearly and exactly along the axis, through the axis, on the \
         axis; against all roots of the same polynomial in 106 bits";
    "D2" d2_roots_are_accurate "accuracy of roots":
        "rays of D1 with as many hits as the reference";
    "D3" d3_equals_quadrics "straight profiles are quadrics":
        "cylinder, cone and frustum as turned lines, through f32 rays as in C1, against 106 bits; against the \
         frustum's own routine in parts of a turn; two cubics against the sphere they nearly are (error of the cubic: \
         2.73e-4)";
    "D4" d4_joints_and_poles "joints and poles are closed":
        "rays from inside to the joint of a ball of two cubics, also level and within 1e-12 to 1e-16 of it, and \
         through its poles, also within 1e-6 to 1e-16; each must be hit once";
    "D5" d5_spheroids_are_not_hit_again "rays that leave a convex surface":
        "spheroids of radius 1e-6, 1 and 1e6, centres at 0 to 1e6 radii, directions of every angle with the normal, \
         half of them grazing by 1e-5 to 1e-1";
    "D6" d6_areas "areas by Pappus":
        "cylinder, cone and ring as lines, a torus as four cubics, a ball as two (within 3e-4 of the sphere)";
    "D7" d7_b_splines "B-splines are Bezier curves":
        "control points at random; points by the basis functions, hits by the converted control points";
    "D8" d8_stored_vectors "stored rays with exact hits":
        "300 f32 rays at vase, looping profile and ball: general, near tangent, nearly level, level, nearly along the \
         axis; hits of 256 bits in the sources; both for the program and for the reference of D1";
    "D9" d9_nearest_first "hits in order":
        "rays of D1 on the looping profile: ascending, on the surface, none behind the origin, and found again from \
         their own distance";
}

const VALID: &str = "the checks' profiles are valid";
const VASE: &[[f64; 2]] = &[[0.0, -1.0], [0.9, -1.0], [1.2, -0.3], [0.5, 0.2], [0.2, 0.4], [0.3, 0.9], [0.6, 1.0]];
const LOOPING: &[[f64; 2]] = &[[0.2, -0.8], [2.5, 1.2], [0.1, 1.4], [1.2, -0.7], [1.6, -1.2], [0.3, 0.4], [0.5, 1.0]];
/// Half a circle in two segments.
const ROUND: f64 = 0.552_284_749_8;
const CIRCLE: &[[f64; 2]] =
    &[[0.0, -1.0], [ROUND, -1.0], [1.0, -ROUND], [1.0, 0.0], [1.0, ROUND], [ROUND, 1.0], [0.0, 1.0]];
/// A cubic with a loop, tall and thin.
const CURL: &[[f64; 2]] = &[[0.1, -2.0], [0.9, 3.0], [0.0, -1.5], [0.5, 2.0]];

fn turned(points: &[[f64; 2]]) -> Revolution {
    Revolution::new(&Profile::bezier(points).expect(VALID), TAU).expect(VALID)
}

fn endless(origin: DVec3, direction: DVec3) -> RayF64 {
    RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
}

fn hits_of(shape: &Revolution, ray: &RayF64) -> Vec<f64> {
    let mut hits = Vec::new();
    let mut rest = *ray;
    while let Some(hit) = shape.intersect(&rest) {
        hits.push(hit.t);
        rest.t_min = hit.t.next_up();
        if hits.len() > 50 {
            break;
        }
    }
    hits
}

/// Kinds of rays that have troubled solvers.
const KINDS: [&str; 8] = [
    "general",
    "near tangent",
    "nearly level",
    "level",
    "nearly along the axis",
    "through the axis",
    "along the axis",
    "on the axis",
];

fn test_ray(rng: &mut Rng, shape: &Revolution, kind: usize) -> RayF64 {
    let target = shape.sample([rng.unit(), rng.unit()]);
    let sign = if rng.unit() < 0.5 { 1.0 } else { -1.0 };
    let mut direction = rng.direction();
    let mut through = target.p + rng.cube() * 0.2;
    match KINDS[kind] {
        "near tangent" => {
            direction = target.n.cross(direction).normalize();
            through = target.p + target.n * sign * rng.magnitude(-7.0, -1.0);
        }
        "nearly level" => direction.y = rng.magnitude(-9.0, -2.0) * sign,
        "level" => direction.y = 0.0 * sign,
        "nearly along the axis" => direction = (DVec3::Y + direction * rng.magnitude(-9.0, -1.0)).normalize(),
        "through the axis" => direction = (dvec3(0.0, rng.range(-1.0, 1.0), 0.0) - through).normalize(),
        "along the axis" => direction = sign * DVec3::Y,
        "on the axis" => (direction, through) = (sign * DVec3::Y, DVec3::ZERO),
        _ => {}
    }
    endless(through - 4.0 * direction, direction)
}

/// Calls `compare` with rays of every kind, the hits found and those expected.
fn compare_hits(seed: u64, rays: usize, mut compare: impl FnMut(usize, &Revolution, &RayF64, &[f64], &[f64])) {
    let mut rng = Rng::new(seed);
    for points in [VASE, LOOPING, CIRCLE, CURL] {
        let shape = turned(points);
        for kind in 0..KINDS.len() {
            for _ in 0..rays {
                let ray = test_ray(&mut rng, &shape, kind);
                compare(kind, &shape, &ray, &hits_of(&shape, &ray), &all_hits(points, &ray));
            }
        }
    }
}

fn d1_all_roots_are_found(effort: Effort) -> Outcome {
    let per_kind = effort.pick(75, 6_000);
    let mut equal = [0usize; KINDS.len()];
    let (mut odd, mut lost, mut invented) = (Faults::NONE, 0, 0);
    compare_hits(51, per_kind, |kind, _, ray, found, expected| {
        equal[kind] += usize::from(found.len() == expected.len());
        odd.add((found.len() + expected.len()) % 2, || format!("{ray:?} has {found:?} in place of {expected:?}"));
        lost += usize::from(found.len() < expected.len());
        invented += usize::from(found.len() > expected.len());
    });
    let rays = 4 * per_kind * KINDS.len();
    let outcome = Outcome::new()
        .none("rays whose number of hits is odd where it is even, or the reverse", odd)
        .at_least("share of rays with the right number", equal.iter().sum::<usize>() as f64 / rays as f64, 0.999)
        .record("rays that lose hits", lost as f64)
        .record("rays with too many", invented as f64);
    KINDS
        .iter()
        .zip(equal)
        .fold(outcome, |outcome, (kind, equal)| outcome.at_least(*kind, equal as f64 / (4 * per_kind) as f64, 0.99))
}

/// The equation of D1 at a point of the surface: the squared distance of the surface from the axis less that of the ray
/// at the same height, times the squared height of the unit direction.
fn equation(ray: &RayF64, p: DVec3) -> f64 {
    let (o, d) = (ray.origin, ray.direction.normalize());
    let (a, b, c) = (d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z);
    let height = p.y - o.y;
    d.y * d.y * (p.x * p.x + p.z * p.z - c) - height * (a * height + 2.0 * b * d.y)
}

fn d2_roots_are_accurate(effort: Effort) -> Outcome {
    let (mut distance, mut residual) = ([0f64; KINDS.len()], 0f64);
    compare_hits(52, effort.pick(75, 6_000), |kind, shape, ray, found, expected| {
        if found.len() != expected.len() {
            return;
        }
        let size = shape.bounds().max.max_element();
        for (t, exact) in found.iter().zip(expected) {
            let error = (t - exact).abs() * ray.direction.length() / size;
            distance[kind] = distance[kind].max(error);
            if let Some(hit) = shape.intersect(&RayF64 { t_min: *t, ..*ray }) {
                residual = residual.max(equation(ray, shape.surface(ray, &hit).p).abs() / (size * size));
            }
        }
    });
    // What a residual of 1e-13 moves along a ray that passes inside a tangent by 1e-7, with a half chord of sqrt(2e-7).
    let implied = 1e-13 / (2.0 * 2e-7f64.sqrt());
    let worst = distance.iter().copied().fold(0.0, f64::max);
    let mut outcome = Outcome::new().at_most("residual of the equation / size²", residual, 1e-13).at_most(
        "error of the distance / size",
        worst,
        implied,
    );
    if worst > 1e-11 {
        outcome = outcome.short(
            "a distance near a tangent is known as well as the residual over the slope; the catalogue requires 1e-11 \
             of fewer rays",
        );
    }
    KINDS.iter().zip(distance).fold(outcome, |outcome, (kind, error)| outcome.record(format!("error, {kind}"), error))
}

fn d8_stored_vectors(_: Effort) -> Outcome {
    let (mut rays, mut excluded, mut unequal, mut oracle) = (0usize, 0, Faults::NONE, Faults::NONE);
    let (mut distance, mut oracle_error) = (0f64, 0f64);
    let worst = |found: &[f64], exact: &[f64]| {
        found.iter().zip(exact).fold(0f64, |worst, (t, exact)| worst.max((t - exact).abs()))
    };
    for ((_, text), points) in vectors::PROFILES.iter().zip([VASE, LOOPING, CIRCLE]) {
        let shape = turned(points);
        excluded += vectors::excluded(text);
        for vector in vectors::revolution_vectors(text) {
            let ray = RayF64::from(&vector.ray);
            let (found, reference) = (hits_of(&shape, &ray), all_hits(points, &ray));
            rays += 1;
            for (faults, hits) in [(&mut unequal, &found), (&mut oracle, &reference)] {
                faults.require(hits.len() == vector.hits.len(), || {
                    format!("{ray:?} has {hits:?} in place of {:?}", vector.hits)
                });
            }
            if found.len() == vector.hits.len() {
                distance = distance.max(worst(&found, &vector.hits) * ray.direction.length() / ray.origin.length());
            }
            oracle_error =
                oracle_error.max(worst(&reference, &vector.hits) * ray.direction.length() / ray.origin.length());
        }
    }
    Outcome::new()
        .none("rays with another number of hits", unequal)
        .at_most("error of the distance, relative to that of the origin", distance, 1e-11)
        .none("rays with another number of hits in the reference", oracle)
        // A hundredth of what it judges.
        .at_most("the same of the reference", oracle_error, 1e-13)
        .at_most("share of rays left out as undecidable", excluded as f64 / (excluded + rays) as f64, 1e-3)
        .record("rays", rays as f64)
}

fn d9_nearest_first(effort: Effort) -> Outcome {
    let mut rng = Rng::new(53);
    let shape = turned(LOOPING);
    let (mut most, mut off) = (0, 0f64);
    let [mut disordered, mut behind, mut lost] = [const { Faults::NONE }; 3];
    for i in 0..effort.pick(6_000, 500_000) {
        let ray = test_ray(&mut rng, &shape, i % KINDS.len());
        let hits = hits_of(&shape, &ray);
        most = most.max(hits.len());
        let describe = || format!("{ray:?} has {hits:?}");
        disordered.add(hits.windows(2).filter(|pair| pair[0] >= pair[1]).count(), describe);
        for &t in &hits {
            match shape.intersect(&RayF64 { t_min: t, ..ray }).filter(|hit| hit.t == t) {
                Some(hit) => off = off.max((shape.surface(&ray, &hit).p - ray.at(t)).length()),
                None => lost.require(false, describe),
            }
        }
        let beyond = endless(ray.origin + ray.direction.normalize() * 1e3, ray.direction);
        behind.require(shape.intersect(&beyond).is_none(), || format!("{beyond:?}"));
    }
    Outcome::new()
        .none("hits out of order", disordered)
        .none("hits lost when the interval begins there", lost)
        .none("hits behind the origin", behind)
        .at_most("distance of the ray's point from the surface's", off, 1e-9)
        .at_least("most hits of a ray", most as f64, 6.0)
}
