//! Group K: cameras.

use std::f64::consts::{PI, TAU};

use serde_json::{Value, json};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::geometry::Rng;
use super::render::{pixels, render};
use super::{Effort, Faults, Outcome, sidak_level};
use crate::camera::{Blades, Camera, Framing, Lens, Projection};
use crate::film::Image;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DAffine3, DVec2, DVec3, Motion, Ray, Transform, Vec2};
use crate::stability::statistics::chi_squared_p_value;

checks! {
    "K1" k1_thin_lens "rays of a film point meet in focus":
        "random cameras in scenes a thousandth to a thousand in size, disks and blades; errors in units of rounding of \
         origin and direction, 2^-24 of their lengths (Mitsuba, test_thinlens)";
    "K2" k2_blur "blur of what is out of focus":
        "points of rays in a plane beside the focus, uniform in a disk by a χ² test in 16 rings and 16 sectors; a \
         picture of a small light";
    "K3" k3_pixel_cones "cones have the width of their pixels":
        "against finite differences of rays one pixel apart: perspective, orthographic, environment, with shift, \
         aspect and near limit (Mitsuba, test03_sample_ray_diff)";
    "K4" k4_shutter "what moves leaves a ramp":
        "a bright card that passes an orthographic camera, and a camera that passes the card: coverage of 64 columns \
         by a χ² test; whole and partial shutters";
    "K5" k5_projection "rays lead back to their film points":
        "random cameras at rest and moving, six kinds of projection and framing, points on rays, of parallel ones no \
         farther than the picture is high, projected in f64 (Cycles, kernel_camera_projection_test)";
}

const SIZE: [u32; 2] = [200, 100];

/// Somewhere, turned somehow; where it stands is a point that f32 holds.
fn pose(rng: &mut Rng, reach: f64) -> DAffine3 {
    DAffine3 { matrix3: rng.rotation(), translation: (reach * rng.cube()).as_vec3().as_dvec3() }
}

fn placed(pose: DAffine3, projection: Projection) -> Camera {
    Camera::new(Transform::new(pose).expect("rotations are regular"), projection)
}

fn film_point(rng: &mut Rng) -> Vec2 {
    Vec2::new(rng.unit_f32() * SIZE[0] as f32, rng.unit_f32() * SIZE[1] as f32)
}

/// The point of a ray at a depth along the view axis, in the camera's space.
fn at_depth(pose: &DAffine3, ray: &Ray, depth: f64) -> DVec3 {
    let inverse = pose.inverse();
    let (o, d) = (inverse.transform_point3(ray.origin.as_dvec3()), inverse.transform_vector3(ray.direction.as_dvec3()));
    o + d * ((-depth - o.z) / d.z)
}

fn k1_thin_lens(effort: Effort) -> Outcome {
    let mut rng = Rng::new(1);
    let (mut meet, mut center, mut outside) = (0f64, 0f64, Faults::NONE);
    for i in 0..effort.pick(300, 30_000) {
        let scale = rng.magnitude(-3.0, 3.0);
        let pose = pose(&mut rng, 3.0 * scale);
        let blades = (i % 3 == 0).then(|| Blades { count: 3 + i / 3 % 7, rotation: rng.range(0.0, TAU) });
        let lens = Lens {
            radius: scale * rng.magnitude(-4.0, -0.5),
            focus_distance: scale * rng.magnitude(-0.3, 1.0),
            blades,
        };
        let half_height = rng.magnitude(-1.5, 0.3);
        let (sharp, blurred) = (
            placed(pose, Projection::Perspective { half_height, lens: None }),
            placed(pose, Projection::Perspective { half_height, lens: Some(lens) }),
        );
        let film = film_point(&mut rng);
        let pinhole = sharp.ray(film, SIZE, [0.5; 2], 0.0);
        let focus = at_depth(&pose, &pinhole, lens.focus_distance);
        // Rounding of the origin, of the direction over the distance, and of the pinhole's ray likewise; seen along the
        // view axis.
        let slant = focus.length() / lens.focus_distance;
        let unit = UNIT_ROUNDOFF * slant * (pose.translation.length() + lens.radius + 2.0 * focus.length());
        for _ in 0..20 {
            let ray = blurred.ray(film, SIZE, rng.pair(), 0.0);
            meet = meet.max((at_depth(&pose, &ray, lens.focus_distance) - focus).length() / unit);
            let on_lens = pose.inverse().transform_point3(ray.origin.as_dvec3());
            let reach = lens.radius * (1.0 + 4.0 * UNIT_ROUNDOFF) + 2.0 * UNIT_ROUNDOFF * pose.translation.length();
            outside.require(on_lens.length() <= reach, || format!("{pose:?}, {lens:?}: {ray:?}"));
        }
        if blades.is_none() {
            let middle = blurred.ray(film, SIZE, [0.5; 2], 0.0);
            center = center
                .max((middle.direction - pinhole.direction).as_dvec3().length())
                .max((middle.origin - pinhole.origin).as_dvec3().length() / scale);
        }
    }
    Outcome::new()
        .at_most("distance of rays in the plane of focus, in units of rounding", meet, 2.0)
        .at_most("difference of the ray through the middle from that of a pinhole", center, 1e-7)
        .none("rays that start outside of the lens", outside)
}

/// The mean square distance of a picture's light from its centre, in pixels.
fn spread(image: &Image) -> f64 {
    let [width, height] = image.size;
    let (mut sum, mut moment) = (0.0, 0.0);
    for (i, pixel) in pixels(image).enumerate() {
        let (x, y) = (i as u32 % width, i as u32 / width);
        let d = DVec2::new(f64::from(x) + 0.5 - 0.5 * f64::from(width), f64::from(y) + 0.5 - 0.5 * f64::from(height));
        sum += f64::from(pixel[0]);
        moment += f64::from(pixel[0]) * d.length_squared();
    }
    moment / sum
}

/// A light of the given radius at a distance, through a lens of radius 0.25 in focus at `focus`.
fn small_light(radius: f64, distance: f64, focus: f64, spp: u32) -> Value {
    json!({
        "film": { "width": 65, "height": 65, "filter": { "type": "box" } },
        "sampler": { "spp": spp },
        "camera": {
            "position": [0, 0, distance], "look_at": [0, 0, 0], "vertical_fov_degrees": 40,
            "lens": { "radius": 0.25, "focus_distance": focus }
        },
        "shapes": [{ "type": "disk", "radius": radius, "emission": { "radiance": [1, 1, 1] } }],
        "integrator": { "type": "path", "max_depth": 1 }
    })
}

fn k2_blur(effort: Effort) -> Outcome {
    const RINGS: usize = 16;
    const SECTORS: usize = 16;
    let mut rng = Rng::new(2);
    let samples = effort.pick(50_000, 1_000_000);
    let planes = [0.3, 0.9, 2.5, 40.0];
    let (mut least, mut beyond) = (1f64, 0f64);
    for depth in planes {
        let lens = Lens { radius: 0.2, focus_distance: 2.0, blades: None };
        let pose = pose(&mut rng, 1.0);
        let camera = placed(pose, Projection::Perspective { half_height: 0.5, lens: Some(lens) });
        let film = film_point(&mut rng);
        let middle = at_depth(&pose, &camera.ray(film, SIZE, [0.5; 2], 0.0), depth);
        let radius = lens.radius * (lens.focus_distance - depth).abs() / lens.focus_distance;
        let mut counts = vec![0u32; RINGS * SECTORS];
        for _ in 0..samples {
            let d = (at_depth(&pose, &camera.ray(film, SIZE, rng.pair(), 0.0), depth) - middle) / radius;
            beyond = beyond.max(d.length() - 1.0);
            let ring = ((d.length_squared() * RINGS as f64) as usize).min(RINGS - 1);
            let sector = ((d.y.atan2(d.x) / TAU).rem_euclid(1.0) * SECTORS as f64) as usize;
            counts[ring * SECTORS + sector.min(SECTORS - 1)] += 1;
        }
        let expected = vec![f64::from(samples) / (RINGS * SECTORS) as f64; RINGS * SECTORS];
        least = least.min(chi_squared_p_value(&counts, &expected));
    }
    // In the plane in focus the blur has radius A |f - d| / d; a disk's mean square distance from its centre is half of
    // its radius squared, and those of light and pixel add to it.
    let mut error = 0f64;
    for (distance, focus) in [(1.0, 2.0), (1.0, 0.6), (2.0, 8.0)] {
        let pixel = 2.0 * 20f64.to_radians().tan() * focus / 65.0;
        let light = 0.05;
        let measured = spread(&render(&small_light(light, distance, focus, effort.pick(128, 2048))));
        let others = 0.5 * (light * focus / distance / pixel).powi(2) + 1.0 / 6.0;
        let radius = (2.0 * (measured - others)).max(0.0).sqrt();
        error = error.max((radius - 0.25 * (focus - distance).abs() / distance / pixel).abs());
    }
    Outcome::new()
        .at_least(
            format!("smallest p-value of {} χ² tests of uniformity", planes.len()),
            least,
            sidak_level(planes.len()),
        )
        .at_most("how far points lie beyond the disk, over its radius", beyond, 1e-5)
        .at_most("error of the blur's radius in a picture, in pixels", error, 0.25)
}

fn k3_pixel_cones(effort: Effort) -> Outcome {
    // Pixels so small that second differences do not count.
    const FINE: [u32; 2] = [4000, 2000];
    let mut rng = Rng::new(3);
    let mut worst = [0f64; 3];
    for _ in 0..effort.pick(300, 30_000) {
        let pose = pose(&mut rng, 1.0);
        let eye = pose.translation;
        let framing =
            Framing { pixel_aspect: rng.range(0.5, 2.0), shift: [rng.range(-0.3, 0.3), rng.range(-0.3, 0.3)] };
        let lens = Lens { radius: 1e-9, focus_distance: 5.0, blades: None };
        let projections = [
            Projection::Perspective { half_height: rng.range(0.1, 1.0), lens: Some(lens) },
            Projection::Orthographic { half_height: rng.range(0.5, 5.0) },
            Projection::Environment,
        ];
        let film = DVec2::new(rng.unit() * 4000.0, rng.range(100.0, 1900.0));
        for (projection, worst) in projections.into_iter().zip(&mut worst) {
            let camera = placed(pose, projection).with_framing(framing).with_near(rng.range(0.0, 0.5));
            let at = |x: f64, y: f64| {
                let ray = camera.ray(DVec2::new(film.x + x, film.y + y).as_vec2(), FINE, [0.5; 2], 0.0);
                // All at the same distance from the camera.
                (
                    ray,
                    ray.origin.as_dvec3() + ray.direction.as_dvec3() * (40.0 - (ray.origin.as_dvec3() - eye).length()),
                )
            };
            // Over 8 pixels, so that the rounding of rays does not count either.
            let (right, down) = ((at(4.0, 0.0).1 - at(-4.0, 0.0).1) / 8.0, (at(0.0, 4.0).1 - at(0.0, -4.0).1) / 8.0);
            let ray = at(0.0, 0.0).0;
            let expected = right.cross(down).dot(ray.direction.as_dvec3()).abs().sqrt();
            for ray in [ray, Ray::new(ray.at(7.0), ray.direction)] {
                let distance = 40.0 - (ray.origin.as_dvec3() - eye).length();
                let width = f64::from(camera.pixel_cone(&ray, FINE).width_at(distance as f32));
                *worst = worst.max((width / expected - 1.0).abs());
            }
        }
    }
    let [perspective, orthographic, environment] = worst;
    Outcome::new()
        .at_most("relative error of the width, perspective", perspective, 1e-3)
        .at_most("relative error of the width, orthographic", orthographic, 1e-3)
        .at_most("relative error of the width, environment", environment, 1e-3)
}

/// A black card, one wide, that goes from x = -1 to 1 in unit time before a white sky, or a camera that goes the other
/// way; 4 wide.
fn passing_card(shutter: [f64; 2], camera_moves: bool, spp: u32) -> Value {
    let way = |from: f64, to: f64| {
        let key = |time: f64, x: f64| json!({ "time": time, "transform": [{ "translate": [x, 0, 0] }] });
        json!([key(0.0, from), key(1.0, to)])
    };
    let mut scene = json!({
        "film": { "width": COLUMNS, "height": ROWS, "filter": { "type": "box" } },
        "sampler": { "type": "independent", "spp": spp },
        "integrator": { "type": "path", "max_depth": 1 },
        "camera": {
            "type": "orthographic", "position": [0, 0, 5], "look_at": [0, 0, 0], "view_height": 0.5, "shutter": shutter
        },
        "materials": { "black": { "type": "diffuse", "albedo": 0 } },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
        "shapes": [{
            "type": "quad", "material": "black", "origin": [-0.5, -1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 2, 0]
        }]
    });
    if camera_moves {
        scene["camera"]["motion"] = way(1.0, -1.0);
    } else {
        scene["shapes"][0]["motion"] = way(-1.0, 1.0);
    }
    scene
}

const COLUMNS: usize = 64;
const ROWS: usize = 8;

/// The share of the column's samples that the card covers: an integral over its width of the time that the card is over
/// each point.
fn exact_coverage(column: usize, shutter: [f64; 2]) -> f64 {
    const STEPS: usize = 1024;
    let over = |x: f64| {
        // The card's middle is at 2 t - 1.
        let [from, to] = [0.5 * (x + 0.5), 0.5 * (x + 1.5)];
        (to.min(shutter[1]) - from.max(shutter[0])).max(0.0) / (shutter[1] - shutter[0])
    };
    let at = |i: usize| -2.0 + 4.0 * (column as f64 + (i as f64 + 0.5) / STEPS as f64) / COLUMNS as f64;
    (0..STEPS).map(|i| over(at(i))).sum::<f64>() / STEPS as f64
}

fn k4_shutter(effort: Effort) -> Outcome {
    let spp = effort.pick(256, 4_096);
    let samples = (ROWS as u32 * spp) as f64;
    let (mut least, mut impossible, mut tests) = (1f64, Faults::NONE, 0);
    let mut evidence = (Vec::new(), Vec::new());
    for shutter in [[0.0, 1.0], [0.25, 0.5], [0.9, 1.0]] {
        for camera_moves in [false, true] {
            let image = render(&passing_card(shutter, camera_moves, spp));
            let mut covered = vec![0f64; COLUMNS];
            for (i, pixel) in pixels(&image).enumerate() {
                covered[i % COLUMNS] += (1.0 - f64::from(pixel[0])) / ROWS as f64;
            }
            let expected: Vec<f64> = (0..COLUMNS).map(|column| exact_coverage(column, shutter)).collect();
            let (mut statistic, mut freedom) = (0.0, 0.0);
            for (column, (found, expected)) in covered.iter().zip(&expected).enumerate() {
                let variance = expected * (1.0 - expected) / samples;
                if samples * expected.min(1.0 - expected) < 8.0 {
                    impossible.require((found - expected).abs() * samples <= 40.0, || {
                        format!("shutter {shutter:?}, column {column}: {found} in place of {expected}")
                    });
                } else {
                    statistic += (found - expected).powi(2) / variance;
                    freedom += 1.0;
                }
            }
            least = least.min(ChiSquared::new(freedom).map_or(0.0, |law| law.sf(statistic)));
            tests += 1;
            evidence.0.extend(covered);
            evidence.1.extend(expected);
        }
    }
    let times = (0..=1000)
        .map(|i| placed(DAffine3::IDENTITY, Projection::Environment).time((i as f32 / 1000.0).min(1.0f32.next_down())));
    Outcome::new()
        .at_least(format!("smallest p-value of {tests} χ² tests over columns"), least, sidak_level(tests))
        .none("columns that are never or always covered, and hardly so", impossible)
        .none("times of rays outside of [0, 1]", times.filter(|time| !(0.0..=1.0).contains(time)).count())
        .pictures("coverage", COLUMNS, &evidence.0, &evidence.1)
}

/// What must come back from a point on a ray: the film point, by the formulas of each projection.
fn project(projection: &Projection, framing: &Framing, p: DVec3) -> DVec2 {
    let [width, height] = SIZE.map(f64::from);
    let planar = |x: f64, y: f64, half_height: f64| {
        let pixels = height / (2.0 * half_height);
        DVec2::new(
            (0.5 - framing.shift[0]) * width + x * pixels / framing.pixel_aspect,
            (0.5 + framing.shift[1]) * height - y * pixels,
        )
    };
    match projection {
        Projection::Perspective { half_height, .. } => planar(p.x / -p.z, p.y / -p.z, *half_height),
        Projection::Orthographic { half_height } => planar(p.x, p.y, *half_height),
        Projection::Environment => {
            let azimuth = p.x.atan2(-p.z);
            let theta = p.x.hypot(p.z).atan2(p.y);
            DVec2::new((azimuth / TAU + 0.5) * width, theta / PI * height)
        }
    }
}

/// What [`k5_projection`] goes through.
const PROJECTIONS: [&str; 6] = [
    "perspective",
    "perspective with framing",
    "orthographic",
    "orthographic with framing",
    "environment",
    "moving perspective",
];

fn k5_projection(effort: Effort) -> Outcome {
    let mut rng = Rng::new(5);
    let mut worst = [0f64; PROJECTIONS.len()];
    let mut corner = 0f64;
    for _ in 0..effort.pick(2_000, 300_000) {
        let half_height = rng.magnitude(-1.0, 0.3);
        let framing =
            Framing { pixel_aspect: rng.range(0.5, 2.0), shift: [rng.range(-0.5, 0.5), rng.range(-0.5, 0.5)] };
        let (plain, perspective) = (Framing::default(), Projection::Perspective { half_height, lens: None });
        let orthographic = Projection::Orthographic { half_height: 3.0 * half_height };
        let kinds = [
            (perspective, plain),
            (perspective, framing),
            (orthographic, plain),
            (orthographic, framing),
            (Projection::Environment, plain),
            (perspective, framing),
        ];
        for (kind, (projection, framing)) in kinds.into_iter().enumerate() {
            let start = pose(&mut rng, 0.5);
            let near = if kind % 2 == 0 { 0.0 } else { rng.range(0.1, 1.0) };
            let mut camera = placed(start, projection).with_framing(framing).with_near(near);
            let (mut there, mut time) = (start, 0.0);
            if kind == 5 {
                let motion =
                    Motion::keyframed(&[(0.0, start), (1.0, pose(&mut rng, 0.5))]).expect("rotations are regular");
                time = rng.unit_f32();
                there = motion.map_at(f64::from(time));
                camera = camera.with_motion(motion).expect("rotations are regular");
            }
            let film = film_point(&mut rng);
            let ray = camera.ray(film, SIZE, [0.5; 2], time);
            // Rounding of a parallel ray's direction moves its points the more the farther they are.
            let parallel = matches!(projection, Projection::Orthographic { .. });
            let distance = if parallel { 6.0 * half_height * rng.unit() } else { rng.range(2.0, 100.0) };
            let along = ray.origin.as_dvec3() + ray.direction.as_dvec3() * distance;
            let mut back = project(&projection, &framing, there.inverse().transform_point3(along)) - film.as_dvec2();
            if kind == 4 {
                // Around the poles a column is narrow, and the picture's sides are one meridian.
                back.x = (back.x / 200.0 + 0.5).rem_euclid(1.0) * 200.0 - 100.0;
                back.x *= (f64::from(film.y) / 100.0 * PI).sin();
            }
            worst[kind] = worst[kind].max(back.length() / f64::from(SIZE[1]));
        }
        // The corner of an unturned picture against the formula.
        let upright = placed(DAffine3::IDENTITY, perspective).ray(Vec2::ZERO, SIZE, [0.5; 2], 0.0).direction.as_dvec3();
        let exact = DVec3::new(-2.0 * half_height, half_height, -1.0).normalize();
        corner = corner.max(((upright - exact) / exact).abs().max_element() / (2.0 * UNIT_ROUNDOFF));
    }
    let outcome = Outcome::new().at_most("error of the picture's corners, in ulp", corner, 2.0);
    PROJECTIONS.iter().zip(worst).fold(outcome, |outcome, (name, worst)| {
        outcome.at_most(format!("error over the picture's height, {name}"), worst, 1e-6)
    })
}
