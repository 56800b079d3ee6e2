//! How a light is chosen.

use std::f64::consts::TAU;

use super::{Effort, Outcome, Tests, transform};
use crate::color::Rgb;
use crate::geometry::{Analytic, Disk, Geometry, Quad, Shape, Sphere, TransformedShape};
use crate::id::{LightId, ShapeId};
use crate::light::{
    AreaLight, Emission, Environment, IesLight, IesProfile, Light, LightSampleContext, LightSelection, LightSet,
    MisCompensation, PointLight, SpotLight,
};
use crate::math::{DMat3, DVec3, Rng, Vec3};
use crate::stability::geometry::mesh;

/// Lights of every kind that is not at infinity, of sizes and powers that differ by orders of magnitude, and optionally
/// a sky.
fn cloud(seed: u64, sky: bool, selection: LightSelection) -> LightSet {
    let mut rng = Rng::new(seed);
    let (mut geometry, mut lights, mut corners) = (Geometry::default(), Vec::new(), Vec::new());
    for i in 0..40 {
        let (p, q) = (2.0 * rng.cube(), 2.0 * rng.cube());
        let power = (2.0 * q.x).exp() as f32;
        let emission = Emission { two_sided: i % 3 == 0, ..Emission::constant(Rgb::new(power, 0.5 * power, power)) };
        let valid = "valid limits";
        let analytic = match i % 4 {
            0 => Analytic::Quad(Quad::new(DVec3::new(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y).expect(valid)),
            1 => Analytic::Sphere(Sphere::new(0.5, -0.5, 0.5, TAU).expect(valid)),
            2 => Analytic::Disk(Disk::new(0.7, 0.2, 4.0).expect(valid)),
            _ => {
                corners.extend([p, p + 0.1 * q, p + 0.1 * DVec3::new(q.y, -q.x, q.z)]);
                continue;
            }
        };
        let turn = DMat3::from_axis_angle(q.normalize(), 3.0 * p.y) * (0.02 + 0.2 * q.z.abs());
        geometry.shapes.push(Shape::Analytic(TransformedShape::new(analytic, transform(turn, p))));
        let shape = ShapeId::new(geometry.shapes.len() - 1);
        geometry.world.push(shape);
        lights.extend(AreaLight::for_shape(shape, emission, &geometry, &[]).into_iter().map(Light::Area));
    }
    let triangles = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    geometry.shapes.push(Shape::Mesh(mesh(&corners, triangles)));
    let shape = ShapeId::new(geometry.shapes.len() - 1);
    geometry.world.push(shape);
    lights.extend(
        AreaLight::for_shape(shape, Emission::constant(Rgb::WHITE), &geometry, &[]).into_iter().map(Light::Area),
    );
    for i in 0..6u8 {
        let (p, q, k) = (2.0 * rng.cube(), rng.direction(), f64::from(i));
        let intensity = Rgb::splat(0.01 * f32::from(i + 1));
        lights.push(Light::Point(PointLight { position: p, intensity }));
        lights.push(Light::Spot(Box::new(SpotLight::new(p, q, intensity, 0.2 * k, 0.3 + 0.5 * k))));
        let vertical = vec![0.0, 30.0 + 25.0 * f32::from(i)];
        let profile = IesProfile::new(vertical, vec![0.0, 180.0], vec![1.0, 2.0, 3.0, 0.0]).expect("a valid table");
        lights.push(Light::Ies(Box::new(IesLight::new(p, q, 0.4, intensity, profile.into()))));
    }
    lights.push(Light::Point(PointLight { position: DVec3::ZERO, intensity: Rgb::BLACK }));
    if sky {
        lights.push(Light::Environment(Environment::Constant(Rgb::splat(0.1))));
    }
    LightSet::with_selection(lights, &geometry, selection)
}

/// Lights whose light reaches every point.
fn points(rng: &mut Rng) -> LightSet {
    let point =
        |_| Light::Point(PointLight { position: 3.0 * rng.direction(), intensity: Rgb::splat(1.0 + rng.unit_f32()) });
    LightSet::with_selection((0..100).map(point).collect(), &Geometry::default(), LightSelection::Tree)
}

/// Points near and far, with a side and without.
fn receivers(rng: &mut Rng, count: usize) -> Vec<LightSampleContext> {
    let receiver = |i: usize| {
        let p = rng.direction() * rng.unit() * if i.is_multiple_of(5) { 50.0 } else { 3.0 };
        let n = if i.is_multiple_of(4) { Vec3::ZERO } else { rng.direction().as_vec3().normalize() };
        LightSampleContext { p, n }
    };
    (0..count).map(receiver).collect()
}

fn probabilities(set: &LightSet, from: &LightSampleContext) -> Vec<f64> {
    (0..set.lights().len()).map(|i| f64::from(set.pmf(LightId::new(i), from, MisCompensation::Off))).collect()
}

/// Where every light reaches every point, no choice may be without a light: how far sums are from 1. Elsewhere: how far
/// they exceed 1.
fn sums(seed: u64) -> [f64; 2] {
    let mut rng = Rng::new(seed);
    let set = points(&mut rng);
    let (mut exact, mut excess) = (0f64, 0f64);
    for from in receivers(&mut rng, 400) {
        let everywhere = LightSampleContext { n: Vec3::ZERO, ..from };
        exact = exact.max((probabilities(&set, &everywhere).iter().sum::<f64>() - 1.0).abs());
    }
    for sky in [false, true] {
        let by_power = cloud(1, sky, LightSelection::Power);
        let by_tree = cloud(1, sky, LightSelection::Tree);
        for from in receivers(&mut rng, 200) {
            exact = exact.max((probabilities(&by_power, &from).iter().sum::<f64>() - 1.0).abs());
            excess = excess.max(probabilities(&by_tree, &from).iter().sum::<f64>() - 1.0);
        }
    }
    [exact, excess]
}

/// What choices from one point show.
struct Choices {
    /// By light, and last how often there was none.
    counts: Vec<u32>,
    /// Largest relative difference of the probability of a sample and that of its query.
    difference: f64,
    /// Mean of 1 / (n p) over n lights that can be chosen, and how many standard deviations it lies from 1.
    mean: f64,
    z: f64,
}

fn choose(set: &LightSet, from: &LightSampleContext, probabilities: &[f64], count: u32, rng: &mut Rng) -> Choices {
    let reachable = probabilities.iter().filter(|p| **p > 0.0).count().max(1) as f64;
    let (mut counts, mut difference, mut sum) = (vec![0u32; probabilities.len() + 1], 0f64, 0.0);
    for _ in 0..count {
        let Some(choice) = set.choose(from, rng.pair(), MisCompensation::Off) else {
            counts[probabilities.len()] += 1;
            continue;
        };
        let p = f64::from(choice.pmf);
        difference = difference.max((p / probabilities[choice.id.index()] - 1.0).abs());
        counts[choice.id.index()] += 1;
        sum += 1.0 / (reachable * p);
    }
    let n = f64::from(count);
    // The second moment is the sum of p / (n p)².
    let second: f64 = probabilities.iter().filter(|p| **p > 0.0).map(|p| 1.0 / (p * reachable * reachable)).sum();
    let deviation = ((second - 1.0).max(0.0) / n).sqrt().max(1e-6);
    let mean = sum / n;
    Choices { counts, difference, mean, z: (mean - 1.0) / deviation }
}

pub(super) fn l8_choice(effort: Effort) -> Outcome {
    let [exact, excess] = sums(9);
    let mut rng = Rng::new(4);
    let (mut tests, mut difference, mut power_mean) = (Tests::new(), 0f64, 0f64);
    let count = effort.pick(60_000, 1_000_000);
    for (selection, name) in [(LightSelection::Power, "by power"), (LightSelection::Tree, "by tree")] {
        for sky in [false, true] {
            let set = cloud(3, sky, selection);
            let sky = if sky { "sky" } else { "no sky" };
            for (k, from) in receivers(&mut rng, 6).into_iter().enumerate() {
                let probabilities = probabilities(&set, &from);
                let found = choose(&set, &from, &probabilities, count, &mut rng);
                difference = difference.max(found.difference);
                let none = (1.0 - probabilities.iter().sum::<f64>()).max(0.0);
                let expected: Vec<f64> =
                    probabilities.iter().copied().chain([none]).map(|p| p * f64::from(count)).collect();
                tests.counts(&format!("{name}, {sky}, from {k}"), &found.counts, &expected);
                if selection == LightSelection::Power {
                    tests.deviations(&format!("1 / (n p), {sky}, from {k}"), found.z);
                    power_mean = power_mean.max((found.mean - 1.0).abs());
                }
            }
        }
    }

    // The mean over points of one over the probability, as pbrt takes it: there are a hundred lights of about the same
    // power around them.
    let set = points(&mut rng);
    let (from, n) = (receivers(&mut rng, effort.pick(20, 50)), effort.pick(60_000, 200_000));
    let means: Vec<f64> = from
        .iter()
        .map(|from| {
            let from = LightSampleContext { p: 0.3 * from.p / from.p.length().max(1.0), n: Vec3::ZERO };
            let found = choose(&set, &from, &probabilities(&set, &from), n, &mut rng);
            difference = difference.max(found.difference);
            found.mean
        })
        .collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let outcome = Outcome::new()
        .at_most("error of sums of probabilities where all lights reach", exact, 1e-5)
        .at_most("excess of sums elsewhere", excess, 1e-5)
        .at_most("relative difference of the probability of a choice and pmf", difference, 1e-5)
        .within("mean of 1 / (n p), by the tree", mean, 0.98, 1.02)
        .at_most("error of the mean of 1 / (n p), by power", power_mean, effort.pick(0.1, 0.02));
    tests.judge(outcome)
}
