use std::f64::consts::{FRAC_PI_2, TAU};

use super::*;
use crate::light::test_support::assert_chi_squared;
use crate::math::{DVec3, Rng};

fn map(width: usize, height: usize, texel: impl Fn(usize, usize) -> f32) -> EnvironmentMap {
    turned(width, height, DMat3::IDENTITY, texel)
}

fn turned(width: usize, height: usize, rotation: DMat3, texel: impl Fn(usize, usize) -> f32) -> EnvironmentMap {
    let pixels = (0..width * height).map(|i| Rgb::splat(texel(i % width, i / width))).collect();
    EnvironmentMap::new(width, height, pixels, rotation, 1.0).unwrap()
}

fn environment(map: EnvironmentMap) -> Environment {
    Environment::Map(Box::new(map))
}

/// The direction at polar angle `theta` from +Y and at `u` of the image's width.
fn direction(u: f64, theta: f64) -> Vec3 {
    let (sin, cos) = (TAU * u).sin_cos();
    DVec3::new(-theta.sin() * sin, theta.cos(), theta.sin() * cos).as_vec3()
}

#[test]
fn the_image_is_laid_out_as_documented() {
    // A ramp of the column's index: constant texel steps, read at texel centres.
    let ramp = map(64, 32, |x, _| x as f32);
    let at = |d: Vec3| ramp.lookup(ramp.locate(d)).r;
    assert!((at(-Vec3::Z) - 31.5).abs() < 1e-3);
    assert!((at(Vec3::X) - 47.5).abs() < 1e-3);
    assert!((at(-Vec3::X) - 15.5).abs() < 1e-3);
    let rows = map(64, 32, |_, y| y as f32);
    let at = |d: Vec3| rows.lookup(rows.locate(d)).r;
    assert!((at(Vec3::X) - 15.5).abs() < 1e-3 && at(Vec3::Y) == 0.0 && at(-Vec3::Y) == 31.0);
    assert!((at(direction(0.1, PI * 8.5 / 32.0)) - 8.0).abs() < 1e-3);
    // A quarter turn about +Y takes -Z to -X.
    let turned = turned(64, 32, DMat3::from_rotation_y(FRAC_PI_2), |x, _| x as f32);
    assert!((turned.lookup(turned.locate(-Vec3::X)).r - 31.5).abs() < 1e-3);
}

#[test]
fn the_lookup_wraps_at_the_seam_and_clamps_at_the_poles() {
    let map = map(8, 4, |x, y| (1 + x * 3 % 8 + y) as f32);
    for i in 0..50 {
        let theta = 0.05 + 0.06 * f64::from(i);
        let [left, right] = [-1e-6, 1e-6].map(|du| map.lookup(map.locate(direction(du, theta))).r);
        assert!((left - right).abs() < 1e-3, "{theta}");
    }
    // Next to the pole only the first row is seen.
    for i in 0..16 {
        let u = (f64::from(i) + 0.5) / 16.0;
        assert!((map.lookup(map.locate(direction(u, 0.01))).r - map.lookup(map.locate(direction(u, 0.3))).r).abs() < 1e-3);
    }
}

#[test]
fn directions_follow_the_density() {
    let rotation = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_z(-1.1);
    let maps = [
        ("one texel", map(1, 1, |_, _| 2.0)),
        ("constant", map(37, 17, |_, _| 0.5)),
        ("three by two", map(3, 2, |x, y| (x + 2 * y) as f32)),
        ("ramp", turned(32, 16, rotation, |x, y| (x * y) as f32)),
        ("poles", map(16, 8, |_, y| if y == 0 || y == 7 { 1.0 } else { 0.0 })),
        ("the seam", map(16, 8, |x, _| if x == 0 { 1.0 } else { 0.0 })),
    ];
    for (name, map) in maps {
        // Cells of the sphere that do not coincide with those of the density, integrated finely.
        let (rows, columns, fine) = (20, 40, 10);
        let mut probabilities = vec![0.0; rows * columns];
        for i in 0..rows * fine {
            for j in 0..columns * fine {
                let z = 1.0 - 2.0 * (i as f64 + 0.5) / (rows * fine) as f64;
                let (sin, cos) = (TAU * (j as f64 + 0.5) / (columns * fine) as f64).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let d = DVec3::new(r * cos, r * sin, z).as_vec3();
                let pdf = f64::from(map.pdf(map.locate(d)));
                probabilities[i / fine * columns + j / fine] += pdf * 4.0 * PI / (rows * columns * fine * fine) as f64;
            }
        }
        let total: f64 = probabilities.iter().sum();
        assert!((total - 1.0).abs() < 0.02, "{name}: {total}");

        let (mut counts, mut random) = (vec![0u32; rows * columns], Rng::new(21));
        for _ in 0..20_000 {
            let s = map.sample(random.pair()).unwrap();
            let phi = (f64::from(s.wi.y).atan2(f64::from(s.wi.x)) / TAU + 1.0).fract();
            let i = ((0.5 - 0.5 * f64::from(s.wi.z)) * rows as f64) as usize;
            let j = (phi * columns as f64) as usize;
            counts[i.min(rows - 1) * columns + j.min(columns - 1)] += 1;
        }
        let probabilities: Vec<f64> = probabilities.iter().map(|p| p / total).collect();
        assert_chi_squared(&counts, &probabilities, name);
    }
}

#[test]
fn a_sun_is_found_as_often_as_the_density_says() {
    let rotation = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_z(-1.1);
    let (width, height) = (64, 32);
    let map = turned(width, height, rotation, |x, y| if (x, y) == (20, 9) { 5e4 } else { 0.1 });
    let limit = |row: usize| PI * (row as f64 - 0.5).clamp(0.0, height as f64) / height as f64;
    let mut probabilities = Vec::new();
    for row in 0..=height {
        for column in 0..width {
            let middle = direction((column as f64 + 1.0) / width as f64, 0.5 * (limit(row) + limit(row + 1)));
            let pdf = map.pdf(map.locate((rotation * middle.as_dvec3()).as_vec3()));
            probabilities.push(f64::from(pdf) * TAU / width as f64 * (limit(row).cos() - limit(row + 1).cos()));
        }
    }
    assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-5);

    let (mut counts, mut random) = (vec![0u32; probabilities.len()], Rng::new(21));
    let mut bright = 0;
    for _ in 0..100_000 {
        let s = map.sample(random.pair()).unwrap();
        let d = rotation.transpose() * s.wi.as_dvec3();
        let column = ((0.5 + d.x.atan2(-d.z) / TAU) * width as f64 - 0.5).rem_euclid(width as f64) as usize;
        let row = (d.x.hypot(d.z).atan2(d.y) / PI * height as f64 + 0.5) as usize;
        counts[row * width + column] += 1;
        bright += u32::from((19..=20).contains(&column) && (9..=10).contains(&row));
    }
    assert_chi_squared(&counts, &probabilities, "a sun");
    assert!(bright > 95_000, "{bright}");
}

#[test]
fn samples_state_the_radiance_and_density_of_their_direction() {
    let rotation = DMat3::from_rotation_y(2.0) * DMat3::from_rotation_x(0.4);
    let environment = environment(turned(33, 15, rotation, |x, y| ((x * 5 + y * 3) % 11) as f32));
    let mut random = Rng::new(4);
    let mut different = 0;
    for _ in 0..50_000 {
        let s = environment.sample(random.pair()).unwrap();
        assert!((s.wi.length() - 1.0).abs() < 1e-6 && s.pdf > 0.0 && s.pdf.is_finite());
        let at = environment.eval(s.wi);
        assert_eq!((at.radiance, at.pdf), (environment.radiance(s.wi), environment.pdf(s.wi)));
        assert!((at.radiance.r - s.radiance.r).abs() < 2e-3, "{:?}", s.wi);
        different += usize::from((at.pdf - s.pdf).abs() > 1e-5 * s.pdf);
    }
    // Rounding takes directions at the limit of a cell to its neighbour.
    assert!(different < 50, "{different}");
}

#[test]
fn the_density_is_finite_at_the_poles_and_at_texel_corners() {
    let map = map(16, 8, |x, y| (x + y) as f32);
    for d in [Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(1e-20, 1.0, 0.0), Vec3::new(0.0, -1.0, -1e-30)] {
        let at = map.locate(d);
        assert!(map.pdf(at).is_finite() && map.pdf(at) > 0.0 && map.lookup(at).is_finite(), "{d}");
    }
    for y in 0..=8 {
        for x in 0..=16 {
            let d = direction(f64::from(x) / 16.0, PI * f64::from(y) / 8.0);
            assert!(map.pdf(map.locate(d)).is_finite());
        }
    }
    for u in [[0.0, 0.0], [0.0, 0.999_999_94], [0.999_999_94, 0.0], [0.999_999_94; 2]] {
        let s = map.sample(u).unwrap();
        assert!(s.wi.is_finite() && s.pdf.is_finite() && s.pdf > 0.0);
    }
}

#[test]
fn wherever_there_is_light_the_density_is_positive() {
    // Single texels, next to a very bright one too.
    for hot in [(0, 0), (7, 3), (15, 7), (0, 7)] {
        let map = map(16, 8, |x, y| {
            if (x, y) == hot {
                1e-6
            } else if (x, y) == (8, 4) {
                1e9
            } else {
                0.0
            }
        });
        let mut random = Rng::new(9);
        for _ in 0..20_000 {
            let d = random.direction().as_vec3();
            let at = map.locate(d);
            assert!(map.lookup(at).is_black() || map.pdf(at) > 0.0, "{d}");
        }
    }
}

#[test]
fn power_is_the_light_from_all_sides() {
    let map = turned(24, 12, DMat3::from_rotation_x(1.0), |x, y| ((x * 7 + y) % 5) as f32);
    let environment = environment(map);
    let n = 400;
    let mut sum = 0.0;
    for i in 0..n * n {
        let s = environment.sample([((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32]).unwrap();
        sum += f64::from(s.radiance.luminance() / s.pdf);
    }
    let power = PI * 9.0 * sum / f64::from(n * n);
    assert!((environment.power(3.0) / power - 1.0).abs() < 5e-3, "{power} {}", environment.power(3.0));

    let constant = Environment::Constant(Rgb::splat(2.0));
    assert!((constant.power(3.0) / (4.0 * PI * PI * 9.0 * 2.0) - 1.0).abs() < 1e-6);
}

#[test]
fn a_constant_environment_is_sampled_uniformly() {
    let environment = Environment::Constant(Rgb::WHITE);
    let (mut counts, mut random) = (vec![0u32; 100], Rng::new(2));
    for _ in 0..100_000 {
        let s = environment.sample(random.pair()).unwrap();
        assert!((s.pdf - environment.pdf(s.wi)).abs() < 1e-9 && (s.wi.length() - 1.0).abs() < 1e-6);
        let i = ((0.5 + 0.5 * s.wi.x) * 10.0) as usize;
        let j = ((s.wi.y.atan2(s.wi.z) / TAU as f32 + 0.5) * 10.0) as usize;
        counts[i.min(9) * 10 + j.min(9)] += 1;
    }
    assert_chi_squared(&counts, &[0.01; 100], "constant");
}

#[test]
fn what_is_no_environment_is_refused_and_black_gives_nothing() {
    let new = |w, h, pixels, m, s| EnvironmentMap::new(w, h, pixels, m, s).map(|_| ());
    let size = EnvironmentMapError::Size { width: 2, height: 2, texels: 3 };
    assert_eq!(new(2, 2, vec![Rgb::WHITE; 3], DMat3::IDENTITY, 1.0), Err(size));
    assert!(new(0, 0, vec![], DMat3::IDENTITY, 1.0).is_err());
    let mut pixels = vec![Rgb::WHITE; 6];
    pixels[4].g = f32::INFINITY;
    assert_eq!(new(3, 2, pixels, DMat3::IDENTITY, 1.0), Err(EnvironmentMapError::Texel { x: 1, y: 1 }));
    let scaled = DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0));
    assert_eq!(new(1, 1, vec![Rgb::WHITE], scaled, 1.0), Err(EnvironmentMapError::Rotation));
    let black = environment(map(4, 2, |_, _| 0.0));
    assert!(black.sample([0.5; 2]).is_none() && black.pdf(Vec3::X) == 0.0 && black.radiance(Vec3::X).is_black());
}
