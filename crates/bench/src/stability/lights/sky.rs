//! Images of light from all sides.

use std::f64::consts::{PI, TAU};

use super::{Effort, Faults, Outcome, Tests};
use crate::color::Rgb;
use crate::light::{Environment, EnvironmentMap, MisCompensation};
use crate::math::{DMat3, DVec3, Rng, Vec3};

/// A map with what it is made of.
struct Sky {
    name: &'static str,
    size: [usize; 2],
    rotation: DMat3,
    environment: Environment,
    brightest: f64,
}

impl Sky {
    fn new(name: &'static str, size: [usize; 2], rotation: DMat3, texel: impl Fn(usize, usize) -> f32) -> Self {
        let [width, height] = size;
        let pixels: Vec<Rgb> = (0..width * height).map(|i| Rgb::splat(texel(i % width, i / width))).collect();
        let brightest = pixels.iter().fold(0.0, |most, texel| f64::from(texel.g).max(most));
        let map = EnvironmentMap::new(width, height, pixels, rotation, 1.0).expect("a valid map");
        Self { name, size, rotation, environment: Environment::Map(Box::new(map)), brightest }
    }

    /// Polar angle of the upper limit of a row of the density, whose cells lie between texel centres and the poles.
    fn limit(&self, row: usize) -> f64 {
        PI * (row as f64 - 0.5).clamp(0.0, self.size[1] as f64) / self.size[1] as f64
    }

    /// The world's direction at a share of the width and a polar angle.
    fn direction(&self, u: f64, theta: f64) -> Vec3 {
        let (sin, cos) = (TAU * u).sin_cos();
        (self.rotation * DVec3::new(-theta.sin() * sin, theta.cos(), theta.sin() * cos)).as_vec3()
    }

    /// Probability of each cell: its density in the middle times its solid angle, in which the sine is.
    fn cells(&self) -> Vec<f64> {
        let [width, height] = self.size;
        let mut cells = Vec::with_capacity(width * (height + 1));
        for row in 0..=height {
            let (upper, lower) = (self.limit(row), self.limit(row + 1));
            let solid_angle = TAU / width as f64 * (upper.cos() - lower.cos());
            for column in 0..width {
                let middle = self.direction((column as f64 + 1.0) / width as f64, 0.5 * (upper + lower));
                cells.push(f64::from(self.environment.eval(middle, MisCompensation::Off).pdf) * solid_angle);
            }
        }
        cells
    }

    /// The cell in which a direction lies.
    fn cell(&self, wi: Vec3) -> usize {
        let [width, height] = self.size;
        let d = self.rotation.transpose() * wi.as_dvec3();
        let column = ((0.5 + d.x.atan2(-d.z) / TAU) * width as f64 - 0.5).rem_euclid(width as f64) as usize;
        let row = (d.x.hypot(d.z).atan2(d.y) / PI * height as f64 + 0.5) as usize;
        row.min(height) * width + column.min(width - 1)
    }
}

fn skies() -> Vec<Sky> {
    let turned = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_z(-1.1);
    vec![
        Sky::new("one texel", [1, 1], DMat3::IDENTITY, |_, _| 2.0),
        Sky::new("constant", [128, 64], DMat3::IDENTITY, |_, _| 0.5),
        Sky::new("three by two", [3, 2], turned, |x, y| (x + 2 * y) as f32),
        Sky::new("ramp", [32, 16], turned, |x, y| (x * y) as f32),
        Sky::new("sun", [64, 32], turned, |x, y| if (x, y) == (20, 9) { 5e4 } else { 0.1 }),
        Sky::new("poles", [16, 8], turned, |_, y| if y == 0 || y == 7 { 1.0 } else { 0.0 }),
        Sky::new("seam", [16, 8], DMat3::IDENTITY, |x, _| if x == 0 { 1.0 } else { 0.0 }),
    ]
}

/// What samples of a map show.
#[derive(Default)]
struct Found {
    counts: Vec<u32>,
    /// Radiance over density, least and most.
    weights: Option<[f64; 2]>,
    /// Samples whose density is another than that of their direction: rounding takes directions at a limit to the next
    /// cell.
    strays: usize,
    radiance: f64,
    invalid: usize,
}

fn sample(sky: &Sky, count: u32) -> Found {
    let mut found = Found { counts: vec![0; sky.size[0] * (sky.size[1] + 1)], ..Found::default() };
    let mut rng = Rng::new(21);
    for _ in 0..count {
        let Some(s) = sky.environment.sample(rng.pair(), MisCompensation::Off) else { continue };
        found.counts[sky.cell(s.wi)] += 1;
        let weight = f64::from(s.radiance.g) / f64::from(s.pdf);
        let [low, high] = found.weights.unwrap_or([weight; 2]);
        found.weights = Some([low.min(weight), high.max(weight)]);
        let at = sky.environment.eval(s.wi, MisCompensation::Off);
        found.strays += usize::from((at.pdf - s.pdf).abs() > 1e-5 * s.pdf);
        // Next to a pole the rounding of a direction turns its azimuth by one over the sine as much.
        let cos = sky.rotation.y_axis.dot(s.wi.as_dvec3());
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        found.radiance = found.radiance.max(sin * f64::from((at.radiance.g - s.radiance.g).abs()) / sky.brightest);
        found.invalid += usize::from(!(s.pdf > 0.0 && s.pdf.is_finite() && (s.wi.length() - 1.0).abs() < 1e-6));
    }
    found
}

/// A ramp of the column's number read between its texels, as a shift in texels; and the largest step at the seam and
/// next to the poles.
fn lookups() -> [f64; 3] {
    let ramp = Sky::new("columns", [64, 32], DMat3::IDENTITY, |x, _| x as f32);
    let rows = Sky::new("rows", [64, 32], DMat3::IDENTITY, |_, y| y as f32);
    let mixed = Sky::new("mixed", [8, 4], DMat3::IDENTITY, |x, y| (1 + x * 3 % 8 + y) as f32);
    let at = |sky: &Sky, u: f64, theta: f64| f64::from(sky.environment.radiance(sky.direction(u, theta)).r);
    let (mut shift, mut seam, mut pole) = (0f64, 0f64, 0f64);
    for i in 0..400 {
        let share = (f64::from(i) + 0.37) / 400.0;
        let column = 64.0 * share - 0.5;
        if (0.0..=63.0).contains(&column) {
            shift = shift.max((at(&ramp, share, 1.0) - column).abs());
        }
        let row = 32.0 * share - 0.5;
        if (0.0..=31.0).contains(&row) {
            shift = shift.max((at(&rows, 0.3, PI * share) - row).abs());
        }
        let theta = PI * share;
        seam = seam.max((at(&mixed, 1.0 - 1e-6, theta) - at(&mixed, 1e-6, theta)).abs());
        // From the pole to the first row of centres only that row is seen.
        pole = pole.max((at(&mixed, share, 0.0005) - at(&mixed, share, 0.3)).abs());
        pole = pole.max((at(&mixed, share, PI - 0.0005) - at(&mixed, share, PI - 0.3)).abs());
    }
    [shift, seam, pole]
}

/// Directions along the axes and at corners of texels where the density or the light is not a number, or zero where
/// there is light.
fn bad_corners() -> Faults {
    let sky = Sky::new("corners", [16, 8], DMat3::IDENTITY, |x, y| (1 + x + y) as f32);
    let near_poles =
        [Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(1e-20, 1.0, 0.0), Vec3::new(0.0, -1.0, -1e-30)];
    let corners = (0..=8).flat_map(|y| (0..=16).map(move |x| (f64::from(x) / 16.0, PI * f64::from(y) / 8.0)));
    let directions = near_poles.into_iter().chain(corners.map(|(u, theta)| sky.direction(u, theta)));
    let is_bad = |&d: &Vec3| {
        let at = sky.environment.eval(d, MisCompensation::Off);
        usize::from(!(at.pdf > 0.0 && at.pdf.is_finite() && at.radiance.is_finite()))
    };
    Faults::of(&directions.collect::<Vec<_>>(), is_bad, |d| format!("direction {d}"))
}

pub(super) fn l7_environment_maps(effort: Effort) -> Outcome {
    let mut tests = Tests::new();
    let (mut total, mut constant, mut strays, mut radiance, mut invalid) = (0f64, 0f64, 0f64, 0f64, bad_corners());
    let mut bounded = 0f64;
    for sky in skies() {
        let cells = sky.cells();
        total = total.max((cells.iter().sum::<f64>() - 1.0).abs());
        let count = effort.pick(60_000, 2_000_000);
        let found = sample(&sky, count);
        let expected: Vec<f64> = cells.iter().map(|p| p * f64::from(count)).collect();
        tests.counts(sky.name, &found.counts, &expected);
        let [low, high] = found.weights.unwrap_or([f64::NAN; 2]);
        if matches!(sky.name, "one texel" | "constant") {
            constant = constant.max(high / low - 1.0);
        }
        // Bilinear light is at most four times the mean of a cell's corners, which its density follows.
        let fluence = sky.environment.power(1.0) / PI;
        bounded = bounded.max(high / fluence);
        strays = strays.max(found.strays as f64 / f64::from(count));
        radiance = radiance.max(found.radiance);
        invalid.add(found.invalid, || sky.name.to_owned());
    }
    let [shift, seam, pole] = lookups();
    let outcome = Outcome::new()
        .at_most("error of the density's sum over cells and their solid angles", total, 1e-5)
        .at_most("spread of the weights of a constant", constant, 1e-5)
        .at_most("largest weight over the mean", bounded, 4.1)
        .at_most("share of samples with another density than their direction", strays, 1e-3)
        .at_most(
            "difference of radiance between samples and their direction, in parts of the brightest texel",
            radiance,
            1e-4,
        )
        .at_most("shift of a ramp, in texels", shift, 1e-4)
        .at_most("step at the seam", seam, 5e-3)
        .at_most("step next to the poles", pole, 5e-3)
        .none("samples or corners of texels that are not finite", invalid);
    tests.judge(outcome)
}
