//! The equal-area octahedral map of the sphere (Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"):
//! how pbrt stores environments.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use crate::assets::{IesData, RgbImage};
use crate::math::DVec3;

/// Rows of the lat-long image at most.
const MAX_ROWS: f64 = 4096.0;

/// Steps from pole to pole of a table of intensities at most.
const MAX_STEPS: usize = 720;

/// Lookups along each side of a pixel of the lat-long image.
const SUBSAMPLES: usize = 4;

/// The point of the unit square that a direction (z up) is stored at.
pub fn square_from_direction(d: DVec3) -> [f64; 2] {
    let d = d.normalize_or_zero();
    let [x, y, z] = d.abs().to_array();
    let r = (1.0 - z).max(0.0).sqrt();
    let phi = if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x) / (2.0 * FRAC_PI_4) };
    let (mut v, mut u) = (phi * r, r - phi * r);
    if d.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [u.copysign(d.x), v.copysign(d.y)].map(|x| 0.5 * (x + 1.0))
}

/// The direction (z up) of a point of the unit square.
pub fn direction_from_square([s, t]: [f64; 2]) -> DVec3 {
    let (u, v) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    let (up, vp) = (u.abs(), v.abs());
    let distance = 1.0 - (up + vp);
    let r = 1.0 - distance.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((vp - up) / r + 1.0) * FRAC_PI_4 };
    let z = (1.0 - r * r).copysign(distance);
    let side = r * (2.0 - r * r).max(0.0).sqrt();
    DVec3::new(phi.cos().copysign(u) * side, phi.sin().copysign(v) * side, z)
}

/// A square equal-area image as a lat-long image of Steradian's convention, in which pbrt's z is up (y here) and its x
/// stays. With `mirrored`, x is negated.
pub fn lat_long(image: &RgbImage, mirrored: bool) -> RgbImage {
    // Twice as many pixels as the square has, whatever its shape.
    let height = (image.width as f64 * image.height as f64).sqrt().round().clamp(1.0, MAX_ROWS) as usize;
    let width = 2 * height;
    let mut pixels = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let mut sum = [0.0f64; 3];
            for i in 0..SUBSAMPLES * SUBSAMPLES {
                let at = |k: usize, sub: usize, size: usize| {
                    (k as f64 + (sub as f64 + 0.5) / SUBSAMPLES as f64) / size as f64
                };
                let (u, v) = (at(column, i % SUBSAMPLES, width), at(row, i / SUBSAMPLES, height));
                let color = lookup(image, square_from_direction(pbrt_from_ours(direction(u, v), mirrored)));
                sum.iter_mut().zip(color).for_each(|(sum, x)| *sum += f64::from(x));
            }
            pixels.push(sum.map(|x| (x / (SUBSAMPLES * SUBSAMPLES) as f64) as f32));
        }
    }
    RgbImage { width, height, pixels }
}

/// The means of the channels of a square equal-area image by direction, about a nadir of -y from +x towards -z: as the
/// profile of a light that hangs straight. `image_from_world` turns directions into the image's, in which z is up.
pub fn profile(image: &RgbImage, image_from_world: impl Fn(DVec3) -> DVec3) -> IesData {
    // Twice as fine as the pixels.
    let steps = (2 * image.height).clamp(8, MAX_STEPS);
    let angles = |count: usize| -> Vec<f32> { (0..=count).map(|i| (180.0 * i as f64 / steps as f64) as f32).collect() };
    let (vertical, horizontal) = (angles(steps), angles(2 * steps));
    let mut candela = Vec::with_capacity(vertical.len() * horizontal.len());
    for around in &horizontal {
        let (sin, cos) = f64::from(*around).to_radians().sin_cos();
        for from_nadir in &vertical {
            let (across, down) = f64::from(*from_nadir).to_radians().sin_cos();
            let world = DVec3::new(across * cos, -down, -across * sin);
            candela.push(mean(lookup(image, square_from_direction(image_from_world(world)))));
        }
    }
    IesData { vertical, horizontal, candela }
}

/// The mean of the channels, as pbrt takes it where it needs one number.
pub fn mean(rgb: [f32; 3]) -> f32 {
    (rgb.iter().sum::<f32>() / 3.0).clamp(0.0, f32::MAX)
}

/// A direction of the lat-long image: the top is +y, the middle column -z, and +x lies at three quarters of the width.
pub fn direction(u: f64, v: f64) -> DVec3 {
    let (theta, phi) = (PI * v, TAU * u);
    DVec3::new(-theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos())
}

/// A direction of the lat-long image in the space of pbrt's light.
pub fn pbrt_from_ours(d: DVec3, mirrored: bool) -> DVec3 {
    DVec3::new(if mirrored { -d.x } else { d.x }, -d.z, d.y)
}

fn lookup(image: &RgbImage, [s, t]: [f64; 2]) -> [f32; 3] {
    let pixel = |share: f64, size: usize| ((share * size as f64).max(0.0) as usize).min(size.saturating_sub(1));
    image.pixels.get(pixel(t, image.height) * image.width + pixel(s, image.width)).copied().unwrap_or_default()
}

/// The illuminance that pbrt finds for the upper half of an image: twice pi over the number of pixels for each.
pub fn illuminance(image: &RgbImage) -> f64 {
    let mut sum = 0.0;
    for (i, [r, g, b]) in image.pixels.iter().map(|pixel| pixel.map(f64::from)).enumerate() {
        let at = |k: usize, size: usize| (k as f64 + 0.5) / size as f64;
        let up = direction_from_square([at(i % image.width, image.width), at(i / image.width, image.height)]).z;
        sum += up.max(0.0) * (0.212_639 * r + 0.715_169 * g + 0.072_192 * b);
    }
    sum * TAU / (image.width * image.height) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_and_its_inverse_agree() {
        for i in 0..40 {
            for j in 0..40 {
                let square = [(f64::from(i) + 0.5) / 40.0, (f64::from(j) + 0.5) / 40.0];
                let d = direction_from_square(square);
                assert!((d.length() - 1.0).abs() < 1e-12);
                let back = square_from_direction(d);
                assert!(
                    (back[0] - square[0]).abs() < 1e-9 && (back[1] - square[1]).abs() < 1e-9,
                    "{square:?} {back:?}"
                );
            }
        }
    }

    #[test]
    fn poles_and_axes_lie_where_pbrt_has_them() {
        let close = |d: [f64; 3], expected: [f64; 2]| {
            let found = square_from_direction(DVec3::from(d));
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{d:?}: {found:?}");
        };
        close([0.0, 0.0, 1.0], [0.5, 0.5]);
        close([1.0, 0.0, 0.0], [1.0, 0.5]);
        close([0.0, 1.0, 0.0], [0.5, 1.0]);
        close([-1.0, 0.0, 0.0], [0.0, 0.5]);
        assert!((direction_from_square([0.01, 0.01]) - DVec3::NEG_Z).length() < 0.1);
    }

    #[test]
    fn all_pixels_have_the_same_solid_angle() {
        // The share of pixels within 60 degrees of the x axis is that of the cap, 1/4.
        let n = 200;
        let within = |i: usize| {
            direction_from_square([((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64]).x > 0.5
        };
        let share = (0..n * n).filter(|&i| within(i)).count() as f64 / (n * n) as f64;
        assert!((share - 0.25).abs() < 1e-3, "{share}");
    }

    #[test]
    fn lat_long_keeps_directions() {
        // One bright quarter: x and y above 0 and z above 0, which in Steradian is x > 0, z < 0 and y > 0.
        let n = 64;
        let color = |d: DVec3| if d.min_element() > 0.0 { [1.0; 3] } else { [0.0; 3] };
        let at =
            |i: usize| direction_from_square([((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64]);
        let image = RgbImage { width: n, height: n, pixels: (0..n * n).map(|i| color(at(i))).collect() };
        for mirrored in [false, true] {
            let sky = lat_long(&image, mirrored);
            // +x is at 3/4 of the width, -z at the half: between them 5/8.
            let bright = if mirrored { 3 } else { 5 };
            for eighth in [1, 3, 5, 7] {
                let pixel = sky.pixels[(sky.height / 4) * sky.width + sky.width * eighth / 8];
                assert_eq!(pixel[0], if eighth == bright { 1.0 } else { 0.0 }, "{mirrored} {eighth}");
            }
            assert_eq!(sky.pixels[(3 * sky.height / 4) * sky.width + sky.width * bright / 8][0], 0.0);
        }
    }
}
