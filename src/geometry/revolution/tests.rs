//! Surfaces of revolution: level rays, sampling, profiles that are rejected, orientation. Their roots are checked by
//! `bench::stability`.

use std::f64::consts::TAU;

use super::*;
use crate::geometry::testing::endless;
use crate::math::Rng;

const VASE: &[[f64; 2]] = &[[0.0, -1.0], [0.9, -1.0], [1.2, -0.3], [0.5, 0.2], [0.2, 0.4], [0.3, 0.9], [0.6, 1.0]];
const LOOPING: &[[f64; 2]] = &[[0.2, -0.8], [2.5, 1.2], [0.1, 1.4], [1.2, -0.7], [1.6, -1.2], [0.3, 0.4], [0.5, 1.0]];
/// Half a circle in two segments.
const ROUND: f64 = 0.552_284_749_8;
const CIRCLE: &[[f64; 2]] =
    &[[0.0, -1.0], [ROUND, -1.0], [1.0, -ROUND], [1.0, 0.0], [1.0, ROUND], [ROUND, 1.0], [0.0, 1.0]];

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

#[test]
fn level_rays_inside_and_outside_hit_on_both_sides() {
    // A solver that divides by the height of the direction, or iterates from a few starting points, fails here.
    let vase = turned(VASE);
    for dy in [0.0, -0.0, 1e-300, -1e-12, 1e-5] {
        let from_outside = all_hits(&vase, &endless(dvec3(-3.0, -0.5, 0.1), dvec3(1.0, dy, 0.0)));
        assert_eq!(from_outside.len(), 2, "{dy} {from_outside:?}");
        assert!(
            from_outside[0] < 3.0 && from_outside[1] > 3.0 && (from_outside[0] + from_outside[1] - 6.0).abs() < 1e-3
        );
        let from_inside = all_hits(&vase, &endless(dvec3(0.0, -0.5, 0.1), dvec3(1.0, dy, 0.0)));
        assert_eq!(from_inside.len(), 1, "{dy}");
        assert!((from_inside[0] + 3.0 - from_outside[1]).abs() < 1e-4);
    }
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
        assert!(
            (total / shape.area() - 1.0).abs() < 5.0 * 0.2 / (COUNT as f64).sqrt() + 1e-3,
            "{total} {}",
            shape.area()
        );
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
    let spline = Profile::b_spline(&[
        [0.0, 0.0],
        [0.0, 0.0],
        [0.0, 0.0],
        [1.0, 0.5],
        [1.0, 0.5],
        [1.0, 0.5],
        [0.0, 1.0],
        [0.0, 1.0],
        [0.0, 1.0],
    ]);
    let shape = Revolution::new(&spline.unwrap(), TAU).unwrap();
    let ray = endless(dvec3(0.0, -1.0, 0.0), DVec3::Y);
    for profile in [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
        let s = shape.surface(&ray, &LocalHit { t: 1.0, profile });
        assert!((s.n.length() - 1.0).abs() < 1e-12 && s.pdf_area.is_finite() && s.pdf_area > 0.0, "{profile} {s:?}");
    }
}

#[test]
fn v_is_the_height_or_the_length_of_the_profile() {
    let v = |shape: &Revolution, profile: f64| {
        shape.surface(&endless(dvec3(0.0, -9.0, 0.0), DVec3::Y), &LocalHit { t: 1.0, profile }).uv[1]
    };
    let of = |points: &[[f64; 2]], parameter| turned(points).with_parameter(parameter).unwrap();
    // Half a circle: heights are cosines, lengths are angles, as far as cubics make one (7e-6).
    let profile = Profile::bezier(CIRCLE).unwrap();
    let (height, length) = (of(CIRCLE, ProfileParameter::Height), of(CIRCLE, ProfileParameter::ArcLength));
    for i in 0..=64 {
        let at = f64::from(i) / 32.0;
        let DVec2 { x, y } = profile.point(at);
        assert!((v(&height, at) - 0.5 * (y + 1.0)).abs() < 1e-14, "{at}");
        assert!((v(&length, at) - x.atan2(-y) / (0.5 * TAU)).abs() < 1e-5, "{at}");
    }
    // A line with an uneven parameter, and then one three times as long, downwards.
    let bent = [[1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0], [2.0, 0.0], [3.0, -1.0], [4.0, -2.0]];
    let (height, length) = (of(&bent, ProfileParameter::Height), of(&bent, ProfileParameter::ArcLength));
    let total = 1.0 + 18f64.sqrt();
    for i in 0..=16 {
        let s = f64::from(i) / 16.0;
        let eased = s * s * (3.0 - 2.0 * s);
        assert!(
            (v(&height, s) - (2.0 + eased) / 3.0).abs() < 1e-14 && (v(&length, s) - eased / total).abs() < 1e-13,
            "{s}"
        );
        let second = (3.0 * (1.0 - s) / 3.0, (1.0 + s * 18f64.sqrt()) / total);
        assert!(
            (v(&height, 1.0 + s) - second.0).abs() < 1e-14 && (v(&length, 1.0 + s) - second.1).abs() < 1e-13,
            "{s}"
        );
    }
    let level = turned(&line([0.0, 1.0], [1.0, 1.0]));
    assert_eq!(level.clone().with_parameter(ProfileParameter::Height), Err(ShapeError::ProfileLevel));
    assert!(level.with_parameter(ProfileParameter::ArcLength).is_ok());
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
