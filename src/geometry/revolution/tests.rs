//! Surfaces of revolution against dense sampling, quadrics and closed forms.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::geometry::Frustum;
use crate::geometry::testing::{Double, endless};
use crate::math::Rng;

const VASE: &[[f64; 2]] = &[[0.0, -1.0], [0.9, -1.0], [1.2, -0.3], [0.5, 0.2], [0.2, 0.4], [0.3, 0.9], [0.6, 1.0]];
const LOOPING: &[[f64; 2]] = &[[0.2, -0.8], [2.5, 1.2], [0.1, 1.4], [1.2, -0.7], [1.6, -1.2], [0.3, 0.4], [0.5, 1.0]];
/// Half a circle in two segments.
const ROUND: f64 = 0.552_284_749_8;
const CIRCLE: &[[f64; 2]] = &[[0.0, -1.0], [ROUND, -1.0], [1.0, -ROUND], [1.0, 0.0], [1.0, ROUND], [ROUND, 1.0], [0.0, 1.0]];

fn turned(points: &[[f64; 2]]) -> Revolution {
    Revolution::new(&Profile::bezier(points).unwrap(), TAU).unwrap()
}

/// A line as a cubic with its parameter proportional to length.
fn line(a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    (0..4).map(|i| std::array::from_fn(|k| a[k] + (b[k] - a[k]) * f64::from(i) / 3.0)).collect()
}

fn all_hits(shape: &Revolution, ray: &RayF64) -> Vec<f64> {
    let mut hits = Vec::new();
    let mut rest = *ray;
    while let Some(hit) = shape.intersect(&rest) {
        hits.push(hit.t);
        rest.t_min = hit.t.next_up();
        assert!(hits.len() < 50);
    }
    hits
}

const STEPS: usize = 1000;

/// Changes of sign of `f` between neighbours of a list of parameters, refined by bisection.
fn crossings(parameters: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut found = Vec::new();
    for pair in parameters.windows(2) {
        let (mut lo, mut hi) = (pair[0], pair[1]);
        let positive = f(lo) >= 0.0;
        if positive == (f(hi) >= 0.0) {
            continue;
        }
        for _ in 0..50 {
            let middle = 0.5 * (lo + hi);
            if (f(middle) >= 0.0) == positive { lo = middle } else { hi = middle }
        }
        found.push(0.5 * (lo + hi));
    }
    found
}

/// Distances of all hits, by the sign changes of a defining equation on a dense grid, with twice the digits where they cancel.
fn dense_hits(points: &[[f64; 2]], ray: &RayF64) -> Vec<f64> {
    let d = |x: f64| Double::from(x);
    let (o, dir) = ([ray.origin.z, ray.origin.x, ray.origin.y].map(d), [ray.direction.z, ray.direction.x, ray.direction.y].map(d));
    let a = dir[0] * dir[0] + dir[1] * dir[1];
    let b = o[0] * dir[0] + o[1] * dir[1];
    let c = o[0] * o[0] + o[1] * o[1];
    let grid: Vec<f64> = (0..=STEPS).map(|i| i as f64 / STEPS as f64).collect();
    let mut hits = Vec::new();
    for segment in 0..points.len() / 3 {
        let curve = |s: f64| -> [Double; 2] {
            let (s, q) = (d(s), d(1.0) - d(s));
            let w = [q * q * q, d(3.0) * s * q * q, d(3.0) * s * s * q, s * s * s];
            std::array::from_fn(|k| (0..4).fold(d(0.0), |sum, i| sum + w[i] * d(points[3 * segment + i][k])))
        };
        if ray.direction.y.abs() < 1e-2 * ray.direction.length() {
            // Compare heights on either side of the point closest to the axis, where the ray reaches the profile's distance at all.
            let half_squared = |s: f64| ((b * b - a * (c - curve(s)[0] * curve(s)[0])) / (a * a)).value();
            let mut parameters = grid.clone();
            parameters.extend(crossings(&grid, half_squared));
            parameters.sort_by(f64::total_cmp);
            for side in [-1.0, 1.0] {
                let t = |s: f64| -(b / a).value() + side * half_squared(s).max(0.0).sqrt();
                let above = |s: f64| (curve(s)[1] - o[2] - dir[2] * d(t(s))).value();
                let reached = |s: &f64| half_squared(*s) >= -1e-12;
                hits.extend(parameters.chunk_by(|x, y| reached(x) && reached(y)).flat_map(|run| crossings(run, above)).map(t));
            }
        } else {
            let f = |s: f64| {
                let [r, z] = curve(s);
                let zeta = z - o[2];
                (dir[2] * dir[2] * (r * r - c) - zeta * (a * zeta + d(2.0) * b * dir[2])).value()
            };
            hits.extend(crossings(&grid, f).iter().map(|&s| ((curve(s)[1] - o[2]) / dir[2]).value()));
        }
    }
    hits.retain(|&t| t >= 0.0);
    hits.sort_by(f64::total_cmp);
    hits
}

/// Rays of all the kinds that have troubled solvers.
fn test_rays(random: &mut Rng, shape: &Revolution, count: usize) -> Vec<RayF64> {
    let kinds = 6;
    (0..count)
        .map(|i| {
            let target = shape.sample([random.unit(), random.unit()]);
            let mut direction = random.direction();
            let mut through = target.p + (random.cube() * 0.2);
            match i % kinds {
                // Tangent, inside or outside by a little.
                1 => {
                    direction = target.n.cross(direction).normalize();
                    let side = if i % 4 < 2 { 1.0 } else { -1.0 };
                    through = target.p + target.n * side * random.magnitude(-7.0, -1.0);
                }
                // Nearly perpendicular to the axis, down to exactly.
                2 => direction.y = random.magnitude(-9.0, -2.0) * direction.y.signum(),
                3 => direction.y = if i % 4 < 2 { 0.0 } else { -0.0 },
                // Nearly parallel to the axis.
                4 => direction = (DVec3::Y + direction * random.magnitude(-9.0, -1.0)).normalize(),
                // Through the axis.
                5 => direction = (dvec3(0.0, random.range(-1.0, 1.0), 0.0) - through).normalize(),
                _ => {}
            }
            endless(through - 4.0 * direction, direction)
        })
        .collect()
}

#[test]
fn all_roots_are_found() {
    let mut random = Rng::new(21);
    let (mut rays, mut unequal, mut lost, mut worst) = (0, 0, 0, 0f64);
    for points in [VASE, LOOPING, CIRCLE] {
        let shape = turned(points);
        for ray in test_rays(&mut random, &shape, 250) {
            let (found, expected) = (all_hits(&shape, &ray), dense_hits(points, &ray));
            rays += 1;
            assert_eq!(found.len() % 2, expected.len() % 2, "{ray:?} {found:?} {expected:?}");
            if found.len() != expected.len() {
                unequal += 1;
                lost += usize::from(found.len() < expected.len());
                continue;
            }
            for (t, exact) in found.iter().zip(&expected) {
                worst = worst.max((t - exact).abs());
            }
        }
    }
    // Pairs of roots between two steps of the grid are missed by the grid; the solver loses none.
    assert!(f64::from(unequal) <= 0.015 * f64::from(rays), "{unequal} of {rays}");
    assert_eq!(lost, 0);
    assert!(worst < 1e-10, "{worst:e}");
}

#[test]
fn level_rays_inside_and_outside_hit_on_both_sides() {
    // A solver that divides by the height of the direction, or iterates from a few starting points, fails here.
    let vase = turned(VASE);
    for dy in [0.0, -0.0, 1e-300, -1e-12, 1e-5] {
        let from_outside = all_hits(&vase, &endless(dvec3(-3.0, -0.5, 0.1), dvec3(1.0, dy, 0.0)));
        assert_eq!(from_outside.len(), 2, "{dy} {from_outside:?}");
        assert!(from_outside[0] < 3.0 && from_outside[1] > 3.0 && (from_outside[0] + from_outside[1] - 6.0).abs() < 1e-3);
        let from_inside = all_hits(&vase, &endless(dvec3(0.0, -0.5, 0.1), dvec3(1.0, dy, 0.0)));
        assert_eq!(from_inside.len(), 1, "{dy}");
        assert!((from_inside[0] + 3.0 - from_outside[1]).abs() < 1e-4);
    }
}

#[test]
fn the_nearest_of_many_hits_is_the_first() {
    let mut random = Rng::new(22);
    let shape = turned(LOOPING);
    let mut most = 0;
    for ray in test_rays(&mut random, &shape, 6_000) {
        let hits = all_hits(&shape, &ray);
        assert!(hits.windows(2).all(|pair| pair[0] < pair[1]));
        most = most.max(hits.len());
        // The surface is where the hit says, and no hit before the start is given.
        for &t in &hits {
            let hit = shape.intersect(&RayF64 { t_min: t, ..ray }).unwrap();
            let s = shape.surface(&ray, &hit);
            assert!(hit.t == t && (s.p - ray.at(t)).length() < 1e-9, "{ray:?} {:e}", (s.p - ray.at(t)).length());
        }
        let behind = endless(ray.origin + ray.direction * 1e3, ray.direction);
        assert!(shape.intersect(&behind).is_none());
    }
    assert!(most >= 6, "{most}");
}

#[test]
fn a_line_is_a_frustum() {
    let mut random = Rng::new(23);
    for (bottom, top, height) in [(1.0, 1.0, 2.0), (1.0, 0.0, 1.5), (0.25, 1.0, 0.5)] {
        for phi_max in [TAU, 2.0, 4.5] {
            let profile = Profile::bezier(&line([bottom, 0.0], [top, height])).unwrap();
            let shape = Revolution::new(&profile, phi_max).unwrap();
            let frustum = Frustum::new(bottom, top, height, phi_max).unwrap();
            assert!((shape.area() / frustum.area() - 1.0).abs() < 1e-12);
            let mut differ = 0;
            for ray in test_rays(&mut random, &shape, 5_000) {
                let (o, d) = (ray.origin, ray.direction);
                let turned = endless(dvec3(o.z, o.x, o.y), dvec3(d.z, d.x, d.y));
                let (a, b) = (shape.intersect(&ray), frustum.intersect(&turned));
                let (Some(a), Some(b)) = (a, b) else {
                    differ += u32::from(a.is_some() != b.is_some());
                    continue;
                };
                let (a, b) = (shape.surface(&ray, &a), frustum.surface(&turned, &b));
                let expected = dvec3(b.p.y, b.p.z, b.p.x);
                if (a.p - expected).length() > 1e-8 {
                    differ += 1;
                    continue;
                }
                assert!((a.n - dvec3(b.n.y, b.n.z, b.n.x)).length() < 1e-7 && (a.uv[0] - b.uv[0]).abs() < 1e-7);
                assert!((a.pdf_area * frustum.area() - 1.0).abs() < 1e-9);
            }
            // Rays nearly along the lines of the surface and over its rims are decided by the last digits.
            assert!(differ <= 5, "{bottom} {top} {height} {phi_max}: {differ}");
        }
    }
}

#[test]
fn two_segments_are_nearly_a_sphere() {
    let shape = turned(CIRCLE);
    let mut random = Rng::new(24);
    for _ in 0..20_000 {
        let direction = random.direction();
        let offset = random.direction().cross(direction).normalize() * random.range(0.0, 0.95);
        let ray = endless(offset - 3.0 * direction, direction);
        let hit = shape.intersect(&ray).unwrap();
        let s = shape.surface(&ray, &hit);
        assert!((s.p.length() - 1.0).abs() < 2.8e-4 && s.n.dot(s.p) > 0.999, "{ray:?} {s:?}");
    }
    assert!((shape.area() / (4.0 * PI) - 1.0).abs() < 3e-4);
}

#[test]
fn no_ray_passes_a_joint() {
    let mut random = Rng::new(25);
    let shape = turned(CIRCLE);
    let mut lost = 0;
    for i in 0..100_000 {
        let (sin, cos) = random.range(0.0, TAU).sin_cos();
        let from = random.direction() * 0.5;
        let mut target = dvec3(cos, 0.0, sin);
        if i % 2 == 0 {
            target.y = random.magnitude(-16.0, -12.0);
        }
        let mut ray = endless(from, target - from);
        if i % 3 == 0 {
            ray.origin.y = 0.0;
            ray.direction.y = 0.0;
        }
        let hits = all_hits(&shape, &ray);
        lost += usize::from(hits.len() != 1);
    }
    assert_eq!(lost, 0);
}

#[test]
fn areas_are_those_of_pappus() {
    let cases = [
        (line([2.0, -1.0], [2.0, 3.0]), TAU * 2.0 * 4.0),
        (line([0.0, 0.0], [3.0, 4.0]), PI * 3.0 * 5.0),
        (line([0.5, 1.0], [2.0, 1.0]), PI * (4.0 - 0.25)),
    ];
    for (points, expected) in cases {
        assert!((turned(&points).area() / expected - 1.0).abs() < 1e-10);
    }
    // A circle around a point off the axis: its length times the way of its centre, both of the Bezier curve itself.
    let torus: Vec<[f64; 2]> =
        CIRCLE.iter().map(|p| [p[0] + 2.0, p[1]]).chain(CIRCLE.iter().rev().skip(1).map(|p| [2.0 - p[0], p[1]])).collect();
    let profile = Profile::bezier(&torus).unwrap();
    let length: f64 = (0..400_000).map(|i| (profile.point(f64::from(i + 1) * 1e-5) - profile.point(f64::from(i) * 1e-5)).length()).sum();
    assert!((turned(&torus).area() / (TAU * 2.0 * length) - 1.0).abs() < 1e-9);
}

#[test]
fn samples_weighted_by_their_density_are_uniform() {
    const BINS: usize = 20;
    const COUNT: usize = 60_000;
    for points in [VASE, LOOPING, CIRCLE] {
        let shape = Revolution::new(&Profile::bezier(points).unwrap(), 2.0).unwrap();
        // Expected counts: the density along the profile, integrated by midpoints.
        let mut random = Rng::new(26);
        let (mut area, mut counts) = ([0f64; BINS], [0f64; BINS]);
        for _ in 0..COUNT {
            let u = [random.unit(), random.unit()];
            let s = shape.sample(u);
            assert!(s.pdf_area > 0.0 && s.p.x >= 0.0 && (s.n.length() - 1.0).abs() < 1e-12);
            // The sampler is monotone along the profile, so equal steps of its input are bins.
            let bin = ((u[1] * BINS as f64) as usize).min(BINS - 1);
            counts[bin] += 1.0 / s.pdf_area;
            area[bin] += 1.0;
        }
        let total: f64 = counts.iter().sum::<f64>() / COUNT as f64;
        // Relative spread of 1 / pdf is below 0.1 except next to the poles.
        assert!((total / shape.area() - 1.0).abs() < 5.0 * 0.2 / (COUNT as f64).sqrt() + 1e-3, "{total} {}", shape.area());
        for (weight, n) in counts.iter().zip(area) {
            assert!((weight / n / shape.area() - 1.0).abs() < 0.02, "{} {}", weight / n, shape.area());
        }
    }
}

#[test]
fn profiles_that_make_no_surface_are_refused() {
    let new = |points: &[[f64; 2]]| Revolution::new(&Profile::bezier(points).unwrap(), TAU);
    assert_eq!(new(&[[1.0, 0.0]; 4]), Err(ShapeError::ProfileEmpty));
    assert_eq!(new(&line([0.0, 0.0], [0.0, 1.0])), Err(ShapeError::ProfileEmpty));
    assert!(matches!(new(&line([1.0, 0.0], [-0.5, 1.0])), Err(ShapeError::ProfileNegative { segment: 0, .. })));
    assert!(Revolution::new(&Profile::bezier(VASE).unwrap(), 7.0).is_err());
    // A control point across the axis is harmless as long as the curve is not.
    assert!(new(&[[1.0, 0.0], [-0.1, 0.3], [0.5, 0.6], [1.0, 1.0]]).is_ok());
}

#[test]
fn standing_profiles_have_normals() {
    // Tripled ends and a cusp inside.
    let spline =
        Profile::b_spline(&[[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.5], [1.0, 0.5], [1.0, 0.5], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0]]);
    let shape = Revolution::new(&spline.unwrap(), TAU).unwrap();
    let ray = endless(dvec3(0.0, -1.0, 0.0), DVec3::Y);
    for profile in [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
        let s = shape.surface(&ray, &LocalHit { t: 1.0, profile });
        assert!((s.n.length() - 1.0).abs() < 1e-12 && s.pdf_area.is_finite() && s.pdf_area > 0.0, "{profile} {s:?}");
    }
}

#[test]
fn a_profile_towards_positive_y_has_outward_normals_and_v_along_it() {
    let points = line([1.0, -2.0], [1.0, 4.0]);
    for (points, sign) in [(points.clone(), 1.0), (points.iter().rev().copied().collect(), -1.0)] {
        let shape = turned(&points);
        let ray = endless(dvec3(0.0, 2.5, 3.0), -DVec3::Z);
        let s = shape.surface(&ray, &shape.intersect(&ray).unwrap());
        assert!((s.n - sign * DVec3::Z).length() < 1e-15 && s.uv[0] == 0.0);
        assert!((s.uv[1] - if sign > 0.0 { 0.75 } else { 0.25 }).abs() < 1e-15);
        // A quarter of a turn from +z is +x.
        let ray = endless(dvec3(3.0, 2.5, 0.0), -DVec3::X);
        assert!((shape.surface(&ray, &shape.intersect(&ray).unwrap()).uv[0] - 0.25).abs() < 1e-15);
    }
}
