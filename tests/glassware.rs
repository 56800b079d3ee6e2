//! The glasses and bottles of `scenes/glassware.json`: every crossing is found, and what is clear loses no light.

use serde_json::{Value, json};
use steradian::desc::{ProfileDesc, SceneDesc, ShapeDesc};
use steradian::internal::geometry::{Profile, Revolution};
use steradian::internal::import;
use steradian::internal::math::{DVec2, DVec3, RayF64};

use crate::util::geometry::Rng;
use crate::util::render::{Estimate, pixels, render};
use crate::util::root;

fn scene_file() -> SceneDesc {
    import::load_scene(&root().join("scenes/glassware.json")).unwrap()
}

/// The closed profiles, which start and end on the axis, by name.
fn closed_profiles() -> Vec<(String, Profile)> {
    let mut found = Vec::new();
    for shape in scene_file().shapes {
        let ShapeDesc::Revolution(shape) = shape else { continue };
        let profile = match &shape.profile {
            ProfileDesc::Bezier(points) => Profile::bezier(points),
            ProfileDesc::BSpline(points) => Profile::b_spline(points),
        }
        .unwrap();
        if profile.point(0.0).x == 0.0 && profile.point(profile.segments().len() as f64).x == 0.0 {
            found.push((shape.name.unwrap(), profile));
        }
    }
    found
}

/// Lines between points of a profile, a number on each segment.
fn polyline(profile: &Profile, per_segment: usize) -> Vec<DVec2> {
    (0..=profile.segments().len() * per_segment).map(|i| profile.point(i as f64 / per_segment as f64)).collect()
}

/// Where a line crosses the cone frusta that a turned polyline consists of, from the quadratic equation of each.
fn frustum_hits(points: &[DVec2], origin: DVec3, direction: DVec3) -> Vec<f64> {
    let (o, d) = (origin, direction);
    let (a, b, c) = (d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z);
    let mut hits = Vec::new();
    for pair in points.windows(2) {
        let (from, change) = (pair[0], pair[1] - pair[0]);
        if change.y.abs() < 1e-12 {
            let t = (from.y - o.y) / d.y;
            let s = (((a * t + 2.0 * b) * t + c).sqrt() - from.x) / change.x;
            if (0.0..1.0).contains(&s) {
                hits.push(t);
            }
            continue;
        }
        // The radius is q + k d.y t.
        let k = change.x / change.y;
        let q = from.x + k * (o.y - from.y);
        let (a, b, c) = (a - k * k * d.y * d.y, b - k * d.y * q, c - q * q);
        let root = b * b - a * c;
        if root < 0.0 {
            continue;
        }
        let numerator = -b - root.sqrt().copysign(b);
        for t in [numerator / a, c / numerator] {
            let s = (o.y + d.y * t - from.y) / change.y;
            if (0.0..1.0).contains(&s) && q + k * d.y * t >= 0.0 {
                hits.push(t);
            }
        }
    }
    hits.sort_by(f64::total_cmp);
    hits
}

fn all_hits(shape: &Revolution, origin: DVec3, direction: DVec3) -> Vec<f64> {
    let mut ray = RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY };
    let mut hits = Vec::new();
    while let Some(hit) = shape.intersect(&ray) {
        hits.push(hit.t);
        ray.t_min = hit.t.next_up();
    }
    hits
}

/// A line through the shape from far outside: any, level, nearly level, through the axis, upright, nearly touching.
fn line(rng: &mut Rng, shape: &Revolution, kind: usize) -> (DVec3, DVec3) {
    let sample = shape.sample([rng.unit(), rng.unit()]);
    let mut direction = rng.direction();
    let mut through = sample.p + 0.1 * rng.cube();
    match kind {
        1 => direction.y = 0.0,
        2 => direction.y *= 1e-6,
        3 => direction = DVec3::new(0.0, 2.0 * rng.unit(), 0.0) - through,
        4 => direction = DVec3::Y + 1e-3 * direction,
        5 => {
            direction = sample.n.cross(direction);
            through = sample.p - sample.n * 10f64.powf(rng.range(-5.0, -1.0));
        }
        _ => {}
    }
    let direction = direction.normalize();
    (through - 5.0 * direction, direction)
}

#[test]
fn every_line_enters_a_closed_profile_as_often_as_it_leaves() {
    let mut rng = Rng::new(51);
    let profiles = closed_profiles();
    assert_eq!(profiles.len(), 6, "{profiles:?}");
    for (name, profile) in &profiles {
        let shape = Revolution::new(profile, std::f64::consts::TAU).unwrap();
        let mut most = 0;
        for i in 0..30_000 {
            let (origin, direction) = line(&mut rng, &shape, i % 6);
            let hits = all_hits(&shape, origin, direction);
            assert!(hits.len().is_multiple_of(2), "{name}: {} hits of {origin} {direction}: {hits:?}", hits.len());
            most = most.max(hits.len());
        }
        // Through a foot and two walls, through two walls, through what they hold.
        let least = match name.as_str() {
            "wine glass" => 6,
            "bottle" | "tumbler" => 4,
            _ => 2,
        };
        assert!(most >= least, "{name}: {most}");
    }
}

#[test]
fn crossings_are_those_of_a_fine_tessellation() {
    let mut rng = Rng::new(52);
    for (name, profile) in closed_profiles() {
        let shape = Revolution::new(&profile, std::f64::consts::TAU).unwrap();
        let lines = polyline(&profile, 128);
        let (mut touching, mut worst) = (0, 0f64);
        for i in 0..2_500 {
            let (origin, direction) = line(&mut rng, &shape, i % 5);
            let (found, expected) = (all_hits(&shape, origin, direction), frustum_hits(&lines, origin, direction));
            if found.len() == expected.len() {
                worst = found.iter().zip(&expected).map(|(f, e)| (f - e).abs()).fold(worst, f64::max);
                continue;
            }
            // Only a line that touches the surface may miss its chords: two hits that nearly coincide are one more or
            // less.
            let more = if found.len() > expected.len() { &found } else { &expected };
            assert!(more.windows(2).any(|pair| pair[1] - pair[0] < 0.02), "{name}: {found:?}, expected {expected:?}");
            touching += 1;
        }
        // A chord lies off the curve by up to about 1e-5, which shifts hits near a tangency by its root.
        assert!(worst < 0.02 && touching < 15, "{name}: {worst} {touching}");
    }
}

#[test]
fn clear_glassware_vanishes_in_a_white_environment() {
    let scene = serde_json::to_value(scene_file()).unwrap();
    let mut materials = scene["materials"].as_object().unwrap().clone();
    materials.retain(|_, material| material.get("priority").is_some());
    for material in materials.values_mut() {
        let material = material.as_object_mut().unwrap();
        material.remove("absorption");
        material.remove("roughness");
    }
    let is_medium = |shape: &&Value| materials.contains_key(shape["material"].as_str().unwrap());
    let shapes: Vec<&Value> = scene["shapes"].as_array().unwrap().iter().filter(is_medium).collect();
    assert_eq!(shapes.len(), 8);
    let mut camera = scene["camera"].clone();
    camera["vertical_fov_degrees"] = json!(20);
    let image = render(&json!({
        "film": { "width": 48, "height": 32, "filter": { "type": "box" } },
        "camera": camera,
        "sampler": { "type": "independent", "spp": 64 },
        "integrator": { "type": "path", "max_depth": 1024, "rr_depth": 1000 },
        "materials": materials,
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    }));
    // Every path contributes exactly 1 unless it is still caught in a wall after 1024 segments.
    let mean = Estimate::of(&image, 1).mean;
    assert!((mean - 1.0).abs() < 5e-4, "{mean}");
    let worst = pixels(&image).map(|p| (p[1] - 1.0).abs()).fold(0.0, f32::max);
    assert!(worst < 0.1, "{worst}");
}
