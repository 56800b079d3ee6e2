//! Warps of the unit square, each beside its density. Hemispheres and cones are around +z.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use crate::math::{Vec2, Vec3, sin_cos_eighth, sin_cos_turns, unit_circle, vec2, vec3};

/// Uniform on the unit disk (Shirley and Chiu, "A Low Distortion Map Between Disk and Square"); density `1 / pi`.
#[inline(always)]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    concentric(u).0
}

/// The point and its signed distance from the centre, which the map gives without rounding.
#[inline(always)]
fn concentric(u: [f32; 2]) -> (Vec2, f32) {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    let first = a.abs() > b.abs();
    let (radius, across) = if first { (a, b) } else { (b, a) };
    if radius == 0.0 {
        return (Vec2::ZERO, 0.0);
    }
    let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (across / radius));
    let p = if first { vec2(cos, sin) } else { vec2(sin, cos) };
    (p * radius, radius)
}

/// The point of the unit square that [`concentric_disk`] maps to `p`, up to rounding.
pub fn inverse_concentric_disk(p: Vec2) -> [f32; 2] {
    let radius = p.length();
    if radius == 0.0 {
        return [0.5, 0.5];
    }
    let first = p.x.abs() > p.y.abs();
    let (along, side) = if first { (p.x, p.y) } else { (p.y, p.x) };
    let radius = radius.copysign(along);
    let across = radius * (side / along).atan() / FRAC_PI_4;
    let (a, b) = if first { (radius, across) } else { (across, radius) };
    [0.5 * (a + 1.0), 0.5 * (b + 1.0)]
}

/// A direction of the hemisphere with density [`cosine_hemisphere_pdf`] (Malley's method).
#[inline(always)]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (p, radius) = concentric(u);
    p.extend(((1.0 - radius) * (1.0 + radius)).sqrt())
}

/// Density per solid angle of [`cosine_hemisphere`] at a direction with the given cosine, not negative.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos * FRAC_1_PI
}

/// A direction of the hemisphere with density [`UNIFORM_HEMISPHERE_PDF`].
#[inline]
pub fn uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    uniform_cone(u, 1.0)
}

/// Density per solid angle of [`uniform_hemisphere`].
pub const UNIFORM_HEMISPHERE_PDF: f32 = 1.0 / TAU;

/// A direction with density [`UNIFORM_SPHERE_PDF`].
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let sin = (4.0 * u[0] * (1.0 - u[0])).max(0.0).sqrt();
    (unit_circle(u[1]).as_vec2() * sin).extend(z).normalize()
}

/// Density per solid angle of [`uniform_sphere`].
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// A direction within a cone, with density [`uniform_cone_pdf`]. The cone is given by `1 - cos` of its half-angle,
/// within `(0, 2]`, since the cosine of a narrow cone has no digits left.
#[inline]
pub fn uniform_cone(u: [f32; 2], one_minus_cos_max: f32) -> Vec3 {
    let one_minus_cos = u[0] * one_minus_cos_max;
    let radius = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
    let (sin, cos) = sin_cos_turns(u[1]);
    vec3(radius * cos, radius * sin, 1.0 - one_minus_cos)
}

/// Density per solid angle of [`uniform_cone`].
#[inline]
pub fn uniform_cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (TAU * one_minus_cos_max)
}

/// Barycentric weights of the second and third corner, uniform by area (Heitz, "A Low-Distortion Map Between Triangle
/// and Square").
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> [f64; 2] {
    let [b, c] = u.map(|u| 0.5 * f64::from(u));
    let offset = c - b;
    if offset > 0.0 { [b, c + offset] } else { [b - offset, c] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::statistics::{MIN_P_VALUE, chi_squared_p_value, compare_directions, random_points};

    fn check_plane(name: &str, seed: u32, warp: impl Fn([f32; 2]) -> [f32; 2]) {
        // Sixteen by sixteen cells of equal probability.
        let mut observed = vec![0u32; 256];
        for u in random_points(seed, 100_000) {
            let [x, y] = warp([u[0], u[1]]);
            assert!((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y), "{name} {x} {y}");
            observed[((x * 16.0) as usize).min(15) * 16 + ((y * 16.0) as usize).min(15)] += 1;
        }
        let p = chi_squared_p_value(&observed, &[100_000.0 / 256.0; 256]);
        assert!(p > MIN_P_VALUE, "{name}: p = {p}");
    }

    #[test]
    fn the_disk_is_uniform_in_area_and_inverts() {
        check_plane("disk", 1, |u| {
            let p = concentric_disk(u);
            // Area fraction within the radius, and the angle.
            [p.length_squared(), (p.y.atan2(p.x) / TAU).rem_euclid(1.0)]
        });
        for u in random_points(2, 10_000) {
            let back = inverse_concentric_disk(concentric_disk([u[0], u[1]]));
            assert!((back[0] - u[0]).abs() < 1e-6 && (back[1] - u[1]).abs() < 1e-6, "{u:?} {back:?}");
        }
        assert_eq!(concentric_disk([0.5, 0.5]), Vec2::ZERO);
    }

    #[test]
    fn the_triangle_is_uniform_in_area() {
        check_plane("triangle", 3, |u| {
            let [b1, b2] = uniform_triangle(u).map(|b| b as f32);
            assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0);
            // Area fraction on one side of a line parallel to an edge, and the position along that line.
            [(b1 + b2) * (b1 + b2), if b1 + b2 > 0.0 { b1 / (b1 + b2) } else { 0.0 }]
        });
    }

    #[test]
    fn directions_follow_their_densities() {
        let upper = |w: Vec3, pdf: f32| if w.z > 0.0 { pdf } else { 0.0 };
        let count = 100_000;
        compare_directions(
            count,
            4,
            |u| Some(cosine_hemisphere([u[0], u[1]])),
            |w| upper(w, cosine_hemisphere_pdf(w.z)),
        )
        .check("cosine");
        compare_directions(count, 5, |u| Some(uniform_hemisphere([u[0], u[1]])), |w| upper(w, UNIFORM_HEMISPHERE_PDF))
            .check("hemisphere");
        compare_directions(count, 6, |u| Some(uniform_sphere([u[0], u[1]])), |_| UNIFORM_SPHERE_PDF).check("sphere");
        for one_minus_cos in [0.02f32, 0.5, 1.7] {
            let pdf = |w: Vec3| if 1.0 - w.z <= one_minus_cos { uniform_cone_pdf(one_minus_cos) } else { 0.0 };
            compare_directions(count, 7, |u| Some(uniform_cone([u[0], u[1]], one_minus_cos)), pdf).check("cone");
        }
    }

    #[test]
    fn a_narrow_cone_keeps_its_digits() {
        // Half-angle 1e-5: in f32 its cosine is one. The mean squared sine is half the largest.
        let one_minus_cos = 5e-11f32;
        let (mut mean, count) = (0.0, 100_000);
        for u in random_points(8, count) {
            let w = uniform_cone([u[0], u[1]], one_minus_cos);
            let sine = f64::from(w.truncate().length());
            assert!(sine <= 1.000_001e-5);
            mean += sine * sine / f64::from(count);
        }
        assert!((mean / 5e-11 - 1.0).abs() < 0.01, "{mean}");
    }

    #[test]
    fn corners_of_the_square_give_unit_vectors() {
        let last = 1.0 - f32::EPSILON / 2.0;
        for u in [[0.0, 0.0], [0.0, last], [last, 0.0], [last, last], [0.5, 0.5], [0.5, 0.0]] {
            for w in [cosine_hemisphere(u), uniform_hemisphere(u), uniform_sphere(u), uniform_cone(u, 1e-3)] {
                assert!((w.length() - 1.0).abs() < 1e-6 && w.is_finite(), "{u:?} {w:?}");
            }
            assert!(cosine_hemisphere(u).z >= 0.0);
        }
    }
}
