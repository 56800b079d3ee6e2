//! What lights emit.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use super::{Effort, Outcome, TWO_SIDED, WHITE, first_light, place, quasi_random, transform};
use crate::color::Rgb;
use crate::geometry::{Analytic, Geometry, Profile, Revolution};
use crate::light::{
    DirectionalLight, Environment, EnvironmentMap, IesLight, IesProfile, Light, LightSampleContext, MisCompensation,
    PointLight, SpotLight,
};
use crate::math::{DMat3, DVec3};
use crate::stability::geometry::{all_analytic_shapes, meshes, triangle};

/// Where lamps stand, and around which their light is gathered.
const CENTER: DVec3 = DVec3::new(0.4, 1.0, -0.7);
/// Radius of the sphere that gathers light; of the scene for lights at infinity.
const REACH: f64 = 9.0;

/// A light with its power by a closed form of this file.
struct Lamp {
    name: String,
    geometry: Geometry,
    light: Light,
    exact: f64,
}

/// A direction from two numbers of the unit square.
fn direction(u: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * u[0];
    let (sin, cos) = (TAU * u[1]).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// What flows through a sphere around a lamp; of lights at infinity, what falls on one.
fn flux(lamp: &Lamp, count: u32) -> f64 {
    let at_infinity = lamp.light.is_at_infinity();
    let mut sum = 0.0;
    for [a, b, c, d] in quasi_random(count) {
        let outward = direction([a, b]);
        let p = CENTER + outward * REACH;
        let Some(s) = lamp.light.sample(
            &lamp.geometry,
            &[],
            &LightSampleContext::from_any_side(p),
            [c as f32, d as f32],
            MisCompensation::Off,
        ) else {
            continue;
        };
        let cos = outward.dot(s.wi.as_dvec3());
        let cos = if at_infinity { cos.max(0.0) } else { -cos };
        sum += f64::from(s.radiance.luminance()) * cos / f64::from(s.pdf);
    }
    sum / f64::from(count) * 4.0 * PI * REACH * REACH
}

/// Area of each of [`all_analytic_shapes`], from the numbers given there, and of a cone as a surface of revolution.
fn area(name: &str) -> f64 {
    let slant = |a: f64, b: f64, height: f64, phi: f64| 0.5 * phi * (a + b) * (a - b).hypot(height);
    match name {
        "sphere" => 4.0 * PI,
        "clipped sphere" => 4.0 * 1.1,
        "quad" => DVec3::new(2.0, 0.1, 0.0).cross(DVec3::new(0.3, 1.0, 0.2)).length(),
        "disk" => PI,
        "ring sector" => 0.5 * 2.5 * (1.0 - 0.16),
        "cylinder" => slant(0.6, 0.6, 1.5, TAU),
        "cone" => slant(0.8, 0.0, 1.2, TAU),
        "frustum sector" => slant(0.8, 0.3, 1.2, 4.5),
        // Pappus: the length of the way of the profile's centroid, by fine chords.
        "revolution" => TAU * vase_moment(),
        "revolution sector" => 3.5 * vase_moment(),
        "straight profile" => slant(0.3, 0.9, 1.2, TAU),
        _ => f64::NAN,
    }
}

/// The integral of the radius along the profile of [`all_analytic_shapes`].
fn vase_moment() -> f64 {
    let profile = Profile::bezier(&[[0.2, -0.9], [1.1, -0.5], [0.1, 0.2], [0.6, 0.9]]).expect("a valid profile");
    let n = 20_000;
    let points: Vec<_> = (0..=n).map(|i| profile.point(f64::from(i) / f64::from(n))).collect();
    points.windows(2).map(|w| 0.5 * (w[0].x + w[1].x) * (w[1] - w[0]).length()).sum()
}

fn shapes() -> Vec<Lamp> {
    let mut lamps = Vec::new();
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 1.3);
    let map = transform(turn * 1.5, CENTER);
    let mut all = all_analytic_shapes();
    let line = Profile::bezier(&[[0.3, 0.0], [0.5, 0.4], [0.7, 0.8], [0.9, 1.2]]).expect("a valid profile");
    all.push(("straight profile", Analytic::Revolution(Revolution::new(&line, TAU).expect("a valid turn"))));
    for (name, shape) in all {
        let exact = 2.25 * PI * area(name);
        let geometry = place(shape, map);
        for (sides, emission) in [(1.0, WHITE), (2.0, TWO_SIDED)] {
            // What the inside of a whole sphere emits never leaves it.
            if sides == 2.0 && name == "sphere" {
                continue;
            }
            let light = Light::Area(first_light(&geometry, emission));
            lamps.push(Lamp {
                name: format!("{name}, {sides} sides"),
                geometry: geometry.clone(),
                light,
                exact: sides * exact,
            });
        }
    }
    let [a, b, c] = [DVec3::X, DVec3::new(0.1, 1.2, 0.0), DVec3::new(-0.5, 0.2, 0.9)];
    let geometry = meshes(vec![triangle(CENTER + a, CENTER + b, CENTER + c)]);
    let light = Light::Area(first_light(&geometry, WHITE));
    lamps.push(Lamp { name: "triangle".into(), geometry, light, exact: 0.5 * PI * (b - a).cross(c - a).length() });
    lamps
}

fn points() -> Vec<Lamp> {
    let lamp = |name: String, light: Light, exact: f64| Lamp { name, geometry: Geometry::default(), light, exact };
    let intensity = Rgb::splat(3.0);
    let mut lamps = vec![lamp("point".into(), Light::Point(PointLight { position: CENTER, intensity }), 12.0 * PI)];
    for (beam, cutoff) in [(15f64, 20f64), (0.0, 90.0), (30.0, 30.0), (90.0, 180.0), (180.0, 180.0), (5.0, 8.0)] {
        let (b, c) = (beam.to_radians(), cutoff.to_radians());
        let light = SpotLight::new(CENTER, DVec3::new(0.3, -1.0, 0.2), intensity, b, c);
        // The integral of sin t min(1, (c - t) / (c - b)) by parts.
        let share = if beam < cutoff { 1.0 - (c.sin() - b.sin()) / (c - b) } else { 1.0 - c.cos() };
        lamps.push(lamp(format!("spot {beam} {cutoff}"), Light::Spot(Box::new(light)), 3.0 * TAU * share));
    }
    let profile = |vertical: &[f32], horizontal: &[f32], intensity: &[f32]| {
        Arc::new(IesProfile::new(vertical.to_vec(), horizontal.to_vec(), intensity.to_vec()).expect("a valid table"))
    };
    let tables = [
        ("measured, even", profile(&[0.0, 180.0], &[0.0], &[2.0, 2.0]), 8.0 * PI),
        // The integral of (1 - t / (pi / 2)) sin t up to pi / 2.
        ("measured, falling", profile(&[0.0, 90.0], &[0.0], &[1.0, 0.0]), TAU * (1.0 - 1.0 / FRAC_PI_2)),
        // The mean over the turn is 2 everywhere.
        ("measured, mirrored", profile(&[0.0, 180.0], &[0.0, 90.0], &[1.0, 1.0, 3.0, 3.0]), 8.0 * PI),
    ];
    for (name, table, flux) in tables {
        let light = IesLight::new(CENTER, DVec3::new(0.2, -1.0, 0.4), 0.3, intensity, table);
        lamps.push(lamp(name.into(), Light::Ies(Box::new(light)), 3.0 * flux));
    }
    lamps
}

/// Scenes as large as the sphere that gathers light: what falls on it is the fluence times its cross-section.
fn at_infinity() -> Vec<Lamp> {
    let lamp = |name: String, light: Light, fluence: f64| Lamp {
        name,
        geometry: Geometry::default(),
        light,
        exact: PI * REACH * REACH * fluence,
    };
    let sun = |angle: f64| DirectionalLight::new(DVec3::new(0.3, -0.8, 0.2), Rgb::splat(2.0), f64::to_radians(angle));
    let mut lamps = vec![lamp("sharp sun".into(), Light::Directional(Box::new(sun(0.0))), 2.0)];
    let constant = Environment::Constant(Rgb::splat(0.5));
    lamps.push(lamp("constant sky".into(), Light::Environment(constant), TAU));

    // Rows of equal texels: the bilinear lookup is linear in the polar angle between row centres, and constant beyond
    // the outermost.
    let rows = [1.0f32, 3.0, 0.5, 2.0];
    let pixels = rows.iter().flat_map(|&r| [Rgb::splat(r); 6]).collect();
    let turned = DMat3::from_rotation_x(1.0) * DMat3::from_rotation_y(0.3);
    let map = EnvironmentMap::new(6, rows.len(), pixels, turned, 1.0).expect("a valid map");
    let step = PI / rows.len() as f64;
    let mut fluence = 0.0;
    for i in 0..=rows.len() {
        let [a, b] = [i, i + 1].map(|k| (k as f64 - 0.5).clamp(0.0, rows.len() as f64) * step);
        let value = |k: usize| f64::from(rows[k.min(rows.len() - 1)]);
        let (fa, fb) = (value(i.saturating_sub(1)), value(i));
        fluence += TAU * (fa * a.cos() - fb * b.cos() + (fb - fa) / (b - a) * (b.sin() - a.sin()));
    }
    lamps.push(lamp("sky map".into(), Light::Environment(Environment::Map(Box::new(map))), fluence));
    lamps
}

pub(super) fn l1_power(effort: Effort) -> Outcome {
    let (mut closed, mut flow, mut gathered) = ((0f64, String::new()), (0f64, String::new()), 0f64);
    for lamp in shapes().into_iter().chain(points()).chain(at_infinity()) {
        let power = lamp.light.power(REACH);
        // A map's power takes the mean of each cell's corners, which is not the mean over its solid angle.
        let is_map = matches!(&lamp.light, Light::Environment(Environment::Map(_)));
        let against_form = (power / lamp.exact - 1.0).abs();
        if !is_map && against_form > closed.0 {
            closed = (against_form, lamp.name.clone());
        }
        let reference = if is_map { lamp.exact } else { power };
        let against_flux = (flux(&lamp, effort.pick(100_000, 1_000_000)) / reference - 1.0).abs();
        if is_map {
            gathered = (power / reference - 1.0).abs();
        }
        if against_flux > flow.0 {
            flow = (against_flux, lamp.name);
        }
    }
    Outcome::new()
        .at_most(format!("relative error of closed forms ({})", closed.1), closed.0, 1e-6)
        .at_most(format!("relative error of the flux ({})", flow.1), flow.0, effort.pick(1e-2, 3e-3))
        .record(
            "relative error of the power of a map of 6 x 4 texels, which only weighs it against other lights",
            gathered,
        )
}
