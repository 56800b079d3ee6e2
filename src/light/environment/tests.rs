use std::f64::consts::{FRAC_PI_2, TAU};

use super::*;
use crate::geometry::Geometry;
use crate::id::LightId;
use crate::light::test_support::assert_chi_squared;
use crate::light::{DirectionalLight, InfiniteLightEvalRows, Light, LightSet};
use crate::math::rows::{BATCH, Vec3Rows};
use crate::math::{DVec3, Rng};

fn map(width: usize, height: usize, texel: impl FnMut(usize, usize) -> f32) -> EnvironmentMap {
    turned(width, height, DMat3::IDENTITY, texel)
}

fn turned(width: usize, height: usize, rotation: DMat3, mut texel: impl FnMut(usize, usize) -> f32) -> EnvironmentMap {
    let pixels = (0..width * height).map(|i| Rgb::splat(texel(i % width, i / width))).collect();
    EnvironmentMap::new(width, height, pixels, rotation, 1.0).unwrap()
}

fn environment(map: EnvironmentMap) -> Environment {
    Environment::Map(Box::new(map))
}

/// The density per solid angle, without compensation.
fn pdf_at(map: &EnvironmentMap, at: Location) -> f32 {
    map.density(MisCompensation::Off).unwrap().pdf(map.corners(at.x as usize, at.y as usize))
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
fn the_density_is_finite_at_the_poles_and_at_texel_corners() {
    let map = map(16, 8, |x, y| (x + y) as f32);
    for d in [Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(1e-20, 1.0, 0.0), Vec3::new(0.0, -1.0, -1e-30)] {
        let at = map.locate(d);
        assert!(pdf_at(&map, at).is_finite() && pdf_at(&map, at) > 0.0 && map.lookup(at).is_finite(), "{d}");
    }
    for y in 0..=8 {
        for x in 0..=16 {
            let d = direction(f64::from(x) / 16.0, PI * f64::from(y) / 8.0);
            assert!(pdf_at(&map, map.locate(d)).is_finite());
        }
    }
    for u in [[0.0, 0.0], [0.0, 0.999_999_94], [0.999_999_94, 0.0], [0.999_999_94; 2]] {
        let s = map.choose(&map.density(MisCompensation::Off).unwrap().cells, u);
        assert!(s.wi.is_finite() && s.pdf.is_finite() && s.pdf > 0.0);
    }
}

/// What the texels say against the tables that cells are chosen with, for images from faint to bright.
#[test]
fn the_density_is_that_of_choosing_cells() {
    for (k, scale) in [1e-36, 1e-20, 1.0, 1e20, 1e36].into_iter().enumerate() {
        let mut random = Rng::new(k as u64);
        let map = map(33, 17, |x, y| scale * if (x, y) == (20, 5) { 90.0 } else { random.unit_f32() });
        for compensation in [MisCompensation::Off, MisCompensation::On] {
            let density = map.density(compensation).unwrap();
            for (x, y) in (0..=17).flat_map(|y| (0..33).map(move |x| (x, y))) {
                let expected = density.cells.pmf(x, y) * map.bands[y].inverse_solid_angle;
                let pdf = density.pdf(map.corners(x, y));
                assert!((pdf - expected).abs() <= 2e-6 * expected + 1e-7, "{scale} {x} {y} {pdf} {expected}");
            }
        }
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
            assert!(map.lookup(at).is_black() || pdf_at(&map, at) > 0.0, "{d}");
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
        let s = environment
            .sample([((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32], MisCompensation::Off)
            .unwrap();
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
        let s = environment.sample(random.pair(), MisCompensation::Off).unwrap();
        assert!(
            (s.pdf - environment.eval(s.wi, MisCompensation::Off).pdf).abs() < 1e-9
                && (s.wi.length() - 1.0).abs() < 1e-6
        );
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
    assert!(
        black.sample([0.5; 2], MisCompensation::Off).is_none()
            && black.eval(Vec3::X, MisCompensation::Off).pdf == 0.0
            && black.radiance(Vec3::X).is_black()
    );
}

/// With directions of even density beside it, and the balance heuristic, the density of what is brighter than the mean
/// finds all light.
#[test]
fn beside_even_directions_only_what_is_brighter_than_the_mean_is_sampled() {
    const EVEN: f64 = 0.25 / PI;
    let sky = |x: usize, y: usize| if (x, y) == (20, 9) { 300.0 } else { 0.5 + 0.1 * (x % 7) as f32 };
    let environment = environment(turned(64, 32, DMat3::from_rotation_x(0.7), sky));
    let mean = environment.power(1.0) / (4.0 * PI * PI);
    let light = |wi: Vec3| f64::from(environment.radiance(wi).luminance());
    // In place of a BSDF, to which the density beside it is nearly in proportion.
    let response = |wi: Vec3| 1.0 + 0.1 * f64::from(wi.x);
    let mut random = Rng::new(4);
    let n = 400_000;
    let (mut by_lights, mut by_both, mut strays) = ([0.0; 2], [0.0; 2], 0);
    let add = |sums: &mut [f64; 2], x: f64| {
        sums[0] += x / f64::from(n);
        sums[1] += x * x / f64::from(n);
    };
    for _ in 0..n {
        let even = random.direction().as_vec3();
        for (compensation, sums) in [(MisCompensation::Off, &mut by_lights), (MisCompensation::On, &mut by_both)] {
            let pdf = |wi: Vec3| f64::from(environment.eval(wi, compensation).pdf);
            let s = environment.sample(random.pair(), compensation).unwrap();
            let at = environment.eval(s.wi, compensation);
            // Rounding takes directions at a limit to the next cell.
            strays += u32::from((at.pdf - s.pdf).abs() > 1e-5 * s.pdf);
            add(
                sums,
                light(s.wi) * response(s.wi) / (f64::from(s.pdf) + EVEN)
                    + light(even) * response(even) / (pdf(even) + EVEN),
            );
        }
        // Cells are as bright as their corners in the middle, so that dark directions share a cell with bright ones at
        // most.
        let at = environment.eval(even, MisCompensation::On);
        assert!(at.pdf > 0.0 || f64::from(at.radiance.luminance()) < 2.0 * mean, "{at:?}");
    }
    assert!(strays < n / 1000, "{strays} of {n}");
    let [a, b] = [by_lights, by_both].map(|[first, second]| (first, second - first * first));
    let z = (a.0 - b.0) / ((a.1 + b.1) / f64::from(n)).sqrt();
    assert!(z.abs() < 5.0, "{a:?} {b:?}: {z}");
    assert!(b.1 < 0.9 * a.1, "variances {} and {}", a.1, b.1);

    // Of an even sky nothing is left.
    let even = [Environment::Constant(Rgb::WHITE), self::environment(map(8, 4, |_, _| 2.0))];
    for sky in even {
        assert!(
            sky.sample([0.3, 0.6], MisCompensation::On).is_none() && sky.eval(Vec3::X, MisCompensation::On).pdf == 0.0
        );
        assert!(sky.sampled_power(1.0, MisCompensation::On) == 0.0 && sky.power(1.0) > 0.0);
    }
}

#[test]
fn many_directions_at_once_are_each_of_them() {
    let mut rng = Rng::new(77);
    let map = map(37, 19, |x, y| if y < 3 { 0.0 } else { ((x * 7 + y * 3) % 11) as f32 });
    let sky = environment(map.clone());
    let mut directions = Vec3Rows::ZERO;
    let mut scratch = EnvironmentScratch::default();
    for count in [1, 17, BATCH, BATCH, BATCH, BATCH] {
        (0..count).for_each(|i| directions.set(i, (rng.cube() - 0.5).as_vec3().normalize()));
        let u = std::array::from_fn(|_| rng.pair());
        for compensation in [MisCompensation::Off, MisCompensation::On] {
            let (mut evals, mut samples) = (InfiniteLightEvalRows::default(), InfiniteLightSampleRows::default());
            scratch.eval(&map, &directions, count, Some(compensation), &mut evals);
            assert!(scratch.sample(&map, &u, count, compensation, &mut samples));
            for (i, u) in u.iter().enumerate().take(count) {
                let InfiniteLightEval { radiance, pdf } = sky.eval(directions.get(i), compensation);
                assert_eq!((evals.radiance.get(i), evals.pdf[i]), (radiance, pdf));
                let one = sky.sample(*u, compensation).unwrap();
                assert_eq!(
                    (one.wi, one.radiance, one.pdf),
                    (samples.wi.get(i), samples.radiance.get(i), samples.pdf[i])
                );
            }
        }
    }
}

#[test]
fn an_image_beside_other_lights_at_infinity_is_found() {
    let sun = || Light::Directional(Box::new(DirectionalLight::new(-DVec3::Y, Rgb::WHITE, 0.01)));
    let sky = |environment| LightSet::new(vec![sun(), Light::Environment(environment)], &Geometry::default());
    let image = sky(environment(map(2, 1, |_, _| 1.0)));
    assert_eq!(image.environment_map().map(|(id, _)| id), Some(LightId(1)));
    assert!(sky(Environment::Constant(Rgb::WHITE)).environment_map().is_none());
}
