//! Surfaces of revolution against quadrics and closed forms; joints, poles and rays that leave.

use super::*;
use crate::accel::{Accelerator, LinearAccel};
use crate::geometry::{Analytic, Frustum, Shape, TransformedShape};
use crate::math::{DMat3, DVec2};
use crate::stability::geometry::{closest, transform, world};
use crate::stability::oracle::line_cases;
use crate::stability::quadrics::compare_with_oracle;

/// A line as a cubic with its parameter proportional to length.
pub fn line(a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    (0..4).map(|i| std::array::from_fn(|k| a[k] + (b[k] - a[k]) * f64::from(i) / 3.0)).collect()
}

pub(super) fn d3_equals_quadrics(effort: Effort) -> Outcome {
    let mut rng = Rng::new(54);
    let exact = compare_with_oracle(&line_cases(), effort.pick(60, 6_000), 55);

    // Parts of a turn, with normals, parameters and densities.
    let (mut differ, mut normal, mut rays) = (0usize, 0f64, 0usize);
    for (bottom, top, height) in [(1.0, 1.0, 2.0), (1.0, 0.0, 1.5), (0.25, 1.0, 0.5)] {
        for phi_max in [TAU, 2.0, 4.5] {
            let profile = Profile::bezier(&line([bottom, 0.0], [top, height])).expect(VALID);
            let shape = Revolution::new(&profile, phi_max).expect(VALID);
            let frustum = Analytic::Frustum(Frustum::new(bottom, top, height, phi_max).expect(VALID));
            for i in 0..effort.pick(2_000, 100_000) {
                let ray = test_ray(&mut rng, &shape, i % KINDS.len());
                let cycled = |v: DVec3| dvec3(v.z, v.x, v.y);
                let twin = endless(cycled(ray.origin), cycled(ray.direction));
                rays += 1;
                match (shape.intersect(&ray), frustum.intersect(&twin)) {
                    (Some(a), Some(b)) => {
                        let (a, b) = (shape.surface(&ray, &a), frustum.surface(&twin, &b));
                        if (cycled(a.p) - b.p).length() > 1e-8 {
                            differ += 1;
                            continue;
                        }
                        let density = (a.pdf_area * frustum.area() - 1.0).abs();
                        normal = normal.max((cycled(a.n) - b.n).length()).max((a.uv[0] - b.uv[0]).abs()).max(density);
                    }
                    (a, b) => differ += usize::from(a.is_some() != b.is_some()),
                }
            }
        }
    }

    let ball = turned(CIRCLE);
    let (mut missed, mut radial) = (Faults::NONE, 0f64);
    for _ in 0..effort.pick(10_000, 1_000_000) {
        let direction = rng.direction();
        let offset = rng.direction().cross(direction).normalize() * rng.range(0.0, 0.95);
        let ray = endless(offset - 3.0 * direction, direction);
        match ball.intersect(&ray) {
            Some(hit) => radial = radial.max((ball.surface(&ray, &hit).p.length() - 1.0).abs()),
            None => missed.require(false, || format!("{ray:?}")),
        }
    }
    Outcome::new()
        .none("lines: missed or false hits", exact.wrong)
        .at_most("lines: error of the point in 2^-24 max|p|", exact.error, 1.0)
        .at_most("lines: share of rays that cannot be decided", exact.undecidable, 1e-3)
        // Rays nearly along the lines of the surface, and through its rims, are decided by the last digits.
        .at_most("share of rays answered otherwise than by the frustum", differ as f64 / rays as f64, 1e-3)
        .at_most("difference of normals, u and densities from the frustum's", normal, 1e-7)
        .none("ball: missed", missed)
        .at_most("ball: distance from the sphere", radial, 2.74e-4)
}

pub(super) fn d4_joints_and_poles(effort: Effort) -> Outcome {
    let mut rng = Rng::new(56);
    let ball = turned(CIRCLE);
    let (mut joints, mut poles, mut place) = (Faults::NONE, Faults::NONE, 0f64);
    for i in 0..effort.pick(50_000, 1_000_000) {
        let (sin, cos) = rng.range(0.0, TAU).sin_cos();
        let from = rng.direction() * 0.5;
        let mut target = dvec3(cos, 0.0, sin);
        if i % 2 == 0 {
            target.y = rng.magnitude(-16.0, -12.0);
        }
        let mut ray = endless(from, target - from);
        if i % 3 == 0 {
            (ray.origin.y, ray.direction.y) = (0.0, 0.0);
        }
        let hits = hits_of(&ball, &ray);
        joints.require(hits.len() == 1, || format!("{ray:?} has {hits:?}"));
    }
    // Exactly through the pole, and past it by less than the root of a rounding; along the axis and not.
    for i in 0..effort.pick(20_000, 300_000) {
        let from = if i % 5 == 0 { DVec3::ZERO } else { rng.direction() * 0.5 };
        let mut target = dvec3(0.0, if i % 2 == 0 { 1.0 } else { -1.0 }, 0.0);
        if i % 3 == 0 {
            target.x = rng.magnitude(-16.0, -6.0);
        }
        let ray = endless(from, target - from);
        let hits = hits_of(&ball, &ray);
        poles.require(hits.len() == 1, || format!("{ray:?} has {hits:?}"));
        place = hits.iter().fold(place, |worst, t| worst.max((t - 1.0).abs()));
    }
    Outcome::new()
        .none("rays at joints that hit never or twice", joints)
        .none("rays at poles that hit never or twice", poles)
        // A ray that passes the pole by 1e-6 meets the surface there to second order.
        .at_most("error of the distance at poles", place, 1e-5)
}

pub(super) fn d5_spheroids_are_not_hit_again(effort: Effort) -> Outcome {
    let mut rng = Rng::new(57);
    let (mut spawned, mut again) = (0usize, Faults::NONE);
    for radius in [1e-6, 1.0, 1e6] {
        for offset in [0.0, 1.0, 1e2, 1e4, 1e6] {
            for _ in 0..effort.pick(200, 10_000) {
                let linear = rng.rotation() * DMat3::from_diagonal(radius * dvec3(1.0, rng.range(0.5, 2.0), 1.0));
                let center = rng.direction() * offset * radius;
                let shape = Analytic::Revolution(turned(CIRCLE));
                let geometry = world(vec![Shape::Analytic(TransformedShape::new(shape, transform(linear, center)))]);
                let accel = LinearAccel::new(&geometry);
                let from = center + rng.direction() * radius * rng.range(3.0, 30.0);
                let ray = crate::stability::geometry::ray_through(from, center + rng.direction() * 0.5 * radius);
                let Some(at) = closest(&accel, &geometry, &ray).found else { continue };
                let n = at.n_g.as_dvec3();
                for i in 0..20 {
                    let mut away = rng.direction_around(n);
                    if i % 2 == 0 {
                        away = (away - n * away.dot(n)).normalize() + n * rng.magnitude(-5.0, -1.0);
                    }
                    spawned += 1;
                    let leaving = at.spawn(away.as_vec3());
                    again.require(!accel.occluded(&leaving), || format!("{leaving:?} after {ray:?}"));
                }
            }
        }
    }
    Outcome::new().none("rays that hit the surface they leave", again).at_least("rays", spawned as f64, 1_000.0)
}

pub(super) fn d6_areas(_: Effort) -> Outcome {
    let cases = [
        (line([2.0, -1.0], [2.0, 3.0]), TAU * 2.0 * 4.0),
        (line([0.0, 0.0], [3.0, 4.0]), PI * 3.0 * 5.0),
        (line([0.5, 1.0], [2.0, 1.0]), PI * (4.0 - 0.25)),
    ];
    let lines =
        cases.iter().map(|(points, expected)| (turned(points).area() / expected - 1.0).abs()).fold(0.0, f64::max);

    // The way of the curve's centre of mass times its length, both by small chords whose error falls with the square of
    // their number.
    let torus: Vec<[f64; 2]> = CIRCLE
        .iter()
        .map(|p| [p[0] + 2.0, p[1]])
        .chain(CIRCLE.iter().rev().skip(1).map(|p| [2.0 - p[0], p[1]]))
        .collect();
    let profile = Profile::bezier(&torus).expect(VALID);
    let length = |chords: usize| -> f64 {
        let at = |i: usize| profile.point(4.0 * i as f64 / chords as f64);
        (0..chords).map(|i| (at(i + 1) - at(i)).length()).sum()
    };
    // Richardson's extrapolation.
    let length = (4.0 * length(20_000) - length(10_000)) / 3.0;
    Outcome::new()
        .at_most("lines: relative error", lines, 1e-10)
        .at_most("torus: relative error", (turned(&torus).area() / (TAU * 2.0 * length) - 1.0).abs(), 1e-10)
        .at_most("ball: relative difference from the sphere", (turned(CIRCLE).area() / (4.0 * PI) - 1.0).abs(), 3e-4)
}

pub(super) fn d7_b_splines(effort: Effort) -> Outcome {
    let mut rng = Rng::new(58);
    let (mut error, mut joints, mut differ, mut hits) = (0f64, Faults::NONE, Faults::NONE, 0usize);
    for _ in 0..effort.pick(100, 5_000) {
        let points: Vec<[f64; 2]> = (0..6).map(|_| [rng.range(0.1, 2.0), rng.range(-2.0, 2.0)]).collect();
        let spline = Profile::b_spline(&points).expect(VALID);
        for segment in 0..3 {
            for i in 0..=50 {
                let s = f64::from(i) / 50.0;
                // The basis functions of the uniform cubic B-spline.
                let basis = [
                    (1.0 - s).powi(3) / 6.0,
                    (3.0 * s.powi(3) - 6.0 * s * s + 4.0) / 6.0,
                    (-3.0 * s.powi(3) + 3.0 * s * s + 3.0 * s + 1.0) / 6.0,
                    s.powi(3) / 6.0,
                ];
                let expected: DVec2 = (0..4).map(|k| DVec2::from(points[segment + k]) * basis[k]).sum();
                let size = points[segment..segment + 4].iter().flatten().fold(0f64, |size, x| size.max(x.abs()));
                error = error.max((spline.point(segment as f64 + s) - expected).abs().max_element() / size);
            }
        }
        let apart = spline.segments().windows(2).filter(|pair| pair[0][3] != pair[1][0]).count();
        joints.add(apart, || format!("{points:?}"));
        let bezier: Vec<[f64; 2]> = spline
            .segments()
            .iter()
            .enumerate()
            .flat_map(|(i, c)| c[usize::from(i > 0)..].to_vec())
            .map(Into::into)
            .collect();
        let pair = [&spline, &Profile::bezier(&bezier).expect(VALID)].map(|profile| Revolution::new(profile, TAU));
        let [Ok(a), Ok(b)] = pair else { continue };
        for i in 0..20 {
            let ray = test_ray(&mut rng, &a, i % KINDS.len());
            let found = hits_of(&a, &ray);
            differ.require(found == hits_of(&b, &ray), || format!("{points:?}: {ray:?} has {found:?}"));
            hits += found.len();
        }
    }
    Outcome::new()
        // Four products and three sums in each of the two ways.
        .at_most("difference of points relative to the control points", error, 6.0 * f64::EPSILON)
        .none("neighbouring segments that do not share their end", joints)
        .none("rays with other hits", differ)
        .at_least("hits", hits as f64, 100.0)
}
