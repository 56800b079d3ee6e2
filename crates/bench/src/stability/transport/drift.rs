//! How a mean behaves over very many samples.

use super::furnaces::glowing_sphere;
use super::{Effort, Outcome, Tests, prepare};
use crate::accel::{self, AccelKind};
use crate::film::{Crop, Film, FilmShape, LayerSet, LightAovRequest};
use crate::integrator::{
    self, CameraBatch, CameraSample, Guidance, PassContext, RenderContext, Setup, SurfaceAovs, Workspace, World,
    dimensions,
};
use crate::math::Vec2;
use crate::render::{Overrides, Settings};
use crate::sampling::Sampler;
use crate::stability::Plot;

/// Width and height: a picture's tiles would trace a thousand pixels.
const WIDTH: u32 = 4;
const COUNT: usize = (WIDTH * WIDTH) as usize;

/// Samples of each pixel in a batch.
const AT_ONCE: u32 = 64;

/// A sum that keeps what rounding takes from it (Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation
/// endlicher Summen").
#[derive(Clone, Copy, Default)]
struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.lost += if self.sum.abs() >= x.abs() { (self.sum - sum) + x } else { (x - sum) + self.sum };
        self.sum = sum;
    }

    fn value(self) -> f64 {
        self.sum + self.lost
    }
}

/// The samples `first .. first + AT_ONCE` of all pixels.
fn batch(world: &World, sampler: &Sampler, first: u32) -> CameraBatch {
    let mut samples = CameraBatch::default();
    for sample in first..first + AT_ONCE {
        for pixel in 0..WIDTH * WIDTH {
            let (x, y) = (pixel % WIDTH, pixel / WIDTH);
            let seed = sampler.pixel(x, y);
            let u = sampler.sample_4d(seed, sample, dimensions::CAMERA);
            let film = Vec2::new(x as f32 + u[0], y as f32 + u[1]);
            let ray = world.scene.camera.ray(film, [WIDTH; 2], [u[2], u[3]], 0.0);
            samples.push(&CameraSample { ray, seed, sample });
        }
    }
    samples
}

/// What the film and exact sums hold after some samples.
struct Checkpoint {
    spp: u32,
    mean: f64,
    error: f64,
    /// Largest relative difference of a pixel of the film from its exact sum.
    rounding: f64,
}

fn checkpoint(film: &Film, sums: &[Sum], squares: f64, spp: u32) -> Checkpoint {
    let image = film.resolve();
    let n = f64::from(spp);
    let mut rounding = 0f64;
    for (i, sum) in (0..).zip(sums) {
        let pixel = image.rgb(i % WIDTH, i / WIDTH).map_or(f64::NAN, |p| f64::from(p[1]));
        let difference = (pixel * n / sum.value() - 1.0).abs();
        if !(difference <= rounding) {
            rounding = difference;
        }
    }
    let count = n * COUNT as f64;
    let mean = sums.iter().map(|sum| sum.value()).sum::<f64>() / count;
    let variance = (squares / count - mean * mean).max(0.0);
    Checkpoint { spp, mean, error: (variance / count).sqrt(), rounding }
}

fn run(settings: &Settings, world: &World, to: u32) -> Option<Vec<Checkpoint>> {
    let sampler = Sampler::new(settings.sampler, settings.seed);
    let setup = Setup { sampler, surface_aovs: SurfaceAovs::default(), light_aovs: LightAovRequest::default() };
    let integrator = integrator::build(&settings.integrator, setup);
    let mut film = Film::new(FilmShape::new([WIDTH; 2], Crop::full([WIDTH; 2]), LayerSet::COLOR), WIDTH).ok()?;
    let (mut sums, mut squares) = (vec![Sum::default(); COUNT], 0.0);
    let (pass, mut workspace) = (
        PassContext {
            world,
            render: RenderContext::new(world.scene, [WIDTH; 2], to),
            guidance: Guidance::default(),
            caustics: None,
            light_paths: None,
            continuations: None,
            light_samples: 1,
        },
        Workspace::default(),
    );
    let (mut checkpoints, mut next) = (Vec::new(), 1);
    for first in (0..to).step_by(AT_ONCE as usize) {
        let samples = batch(world, &sampler, first);
        integrator.render_batch(&pass, &samples, &mut workspace);
        for (i, (sample, value)) in samples.iter().zip(&workspace.out.pixels).enumerate() {
            let pixel = i % COUNT;
            film.tiles_mut()[0].add(pixel, sample.sample, value, 1.0);
            let radiance = f64::from(value.radiance.g);
            sums[pixel].add(radiance);
            squares += radiance * radiance;
            if pixel + 1 == COUNT && sample.sample + 1 == next {
                checkpoints.push(checkpoint(&film, &sums, squares, next));
                next = if next >= to { u32::MAX } else { next * 10 };
            }
        }
    }
    Some(checkpoints)
}

pub(super) fn i12_drift(effort: Effort) -> Outcome {
    let prepared = prepare(&glowing_sphere(1, 64, 5), &Overrides { threads: Some(1), ..Overrides::default() });
    let Ok(accel) = accel::build(AccelKind::EMBREE, &prepared.scene.geometry, 1) else { return Outcome::new() };
    let world = World::new(&prepared.scene, &*accel);
    let Some(checkpoints) = run(&prepared.settings, &world, effort.pick(10_000, 1_000_000)) else {
        return Outcome::new();
    };

    let (mut tests, mut rounding) = (Tests::new(), 0f64);
    let [mut distance, mut error, mut film] = [Vec::new(), Vec::new(), Vec::new()];
    for at in &checkpoints {
        let n = f64::from(at.spp);
        // Sixteen samples have no normal mean.
        if at.spp >= 10 {
            tests.deviations(&format!("{} samples", at.spp), (at.mean - 1.0) / at.error);
        }
        rounding = rounding.max(at.rounding);
        distance.push((n, (at.mean - 1.0).abs()));
        error.push((n, at.error));
        film.push((n, at.rounding));
    }
    let last = checkpoints.last().map_or(f64::NAN, |at| at.error);
    let plot = Plot {
        caption: "The mean of a furnace of radiance 1 over its samples".into(),
        x: "samples a pixel".into(),
        y: "distance".into(),
        floor: 1e-9,
        curves: vec![
            ("mean from 1".into(), distance),
            ("standard error".into(), error),
            ("film from the exact sum".into(), film),
        ],
    };
    // Half a unit in the last place of f32, in which pictures are, and a little for f64 sums.
    let bound = 0.5 * f64::from(f32::EPSILON) + 1e-9;
    let outcome = Outcome::new()
        .at_most("relative difference of the film from exact sums", rounding, bound)
        .at_most("standard error at the end", last, effort.pick(3e-3, 3e-4))
        .plot(plot);
    tests.judge(outcome)
}
