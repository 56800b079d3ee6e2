//! Frames of one kind with each accelerator in turn, timed.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use serde_json::json;

use super::{Entry, FrameTiming, ReportsOptions, Subject};
use crate::accel::{self, AccelKind, Accelerator};
use crate::compile;
use crate::desc::SceneDesc;
use crate::film::{Image, LayerKind};
use crate::geometry::Mesh;
use crate::import::parse_scene;
use crate::machine::processor_seconds;
use crate::math::Ray;
use crate::observed::{Call, Observed, Observer};
use crate::render::{self, Overrides, Settings, Silent};
use crate::scene::Scene;
use crate::{Spent, Watch, median_and_range};
use steradian::Result;

/// Rays whose primitive tests are counted, about.
const COUNTED: usize = 20_000;

/// What is rendered.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    /// The mesh's normals.
    Normals,
    /// The mesh on a floor under a sky and a sun, path traced.
    Paths,
}

impl Kind {
    fn name(self) -> &'static str {
        if self == Self::Paths { "path traced" } else { "normals" }
    }

    fn scene(self, mesh: &Mesh) -> serde_json::Value {
        let mut scene = json!({
            "camera": {
                "position": [0.9, -4.2, 0.6], "look_at": [0, 0, 0], "up": [0, 0, 1], "vertical_fov_degrees": 35
            },
            "integrator": { "type": "normal" },
            "sampler": { "type": "independent", "spp": 1 },
            "shapes": [{ "type": "mesh", "positions": mesh.positions(), "triangles": mesh.triangles() }],
        });
        if self == Self::Paths {
            scene["integrator"] = json!({ "type": "path", "max_depth": 5 });
            scene["lights"] = json!([
                { "type": "environment", "radiance": [0.4, 0.45, 0.5] },
                { "type": "directional", "direction": [-0.4, 0.6, -1], "irradiance": [2, 1.9, 1.7] }
            ]);
            // Of two triangles: accelerators of the reports support no other shapes.
            if let Some(shapes) = scene["shapes"].as_array_mut() {
                shapes.push(json!({
                    "type": "mesh", "triangles": [[0, 1, 2], [0, 2, 3]],
                    "positions": [[-6, -6, -1.2], [6, -6, -1.2], [6, 6, -1.2], [-6, 6, -1.2]]
                }));
            }
        }
        scene
    }

    /// Rays of a pixel, about.
    fn rays(self) -> u64 {
        if self == Self::Paths { 5 } else { 1 }
    }
}

/// What was found of one accelerator.
pub struct Found {
    pub build_milliseconds: f64,
    pub timing: FrameTiming,
    pub tests_per_ray: Option<f64>,
    pub different_pixels: usize,
}

/// Renders a frame on one thread; what the render took, and its picture.
fn frame(desc: &SceneDesc, scene: &Scene, size: [u32; 2], accel: &dyn Accelerator) -> Result<(Spent, Image)> {
    let overrides = Overrides {
        size: Some(size),
        threads: Some(1),
        default_outputs: vec!["unused.png".into()],
        ..Overrides::default()
    };
    let before = processor_seconds();
    let result = render::render(scene, accel, &Settings::new(desc, &overrides)?, &Silent, &AtomicBool::new(false))?;
    Ok((Spent::new(1, result.stats.render_seconds, processor_seconds() - before), result.image))
}

/// A comparison of accelerators on a mesh.
#[derive(Clone, Copy)]
pub struct FrameBenchmark<'a> {
    pub title: &'a str,
    pub mesh: &'a Mesh,
    pub entries: &'a [Entry],
    pub options: &'a ReportsOptions,
    pub watch: &'a dyn Watch,
}

/// Times every accelerator on frames of a kind; fewer if it is stopped. Also what all frames took.
pub fn measure(comparison: FrameBenchmark, kind: Kind) -> Result<(Vec<Found>, Spent)> {
    let FrameBenchmark { title, mesh, entries, options, watch } = comparison;
    let full = u64::from(options.size[0]) * u64::from(options.size[1]);
    // The smallest divisor of the sides that keeps a linear frame within its budget.
    let tests = mesh.triangles().len() as u64 * kind.rays();
    let divisor = (1..256).find(|d| full / (d * d) * tests <= options.tests).unwrap_or(256) as u32;
    let sizes = [1, divisor].map(|d| options.size.map(|side| (side / d).max(1)));
    let file = Path::new("bench reports");
    let desc = parse_scene(&kind.scene(mesh).to_string(), file)?;
    let scene = compile::compile(&desc, file)?;
    let frame = |size: [u32; 2], accel: &dyn Accelerator| frame(&desc, &scene, size, accel);

    let name = kind.name();
    let mut subjects = Vec::new();
    for Entry(accel, _, _, build) in entries {
        watch.step(&format!("{title}, {name}: building {accel}"));
        let start = Instant::now();
        let subject = build(&scene.geometry)?;
        subjects.push((subject, start.elapsed().as_secs_f64() * 1e3));
    }
    // The BVH answers as the linear loop does, which would take too long for full frames.
    let oracle = accel::build(AccelKind::Bvh(accel::BvhOptions::default()), &scene.geometry, 1)?;
    let pictures = [frame(sizes[0], &*oracle)?.1, frame(sizes[1], &*oracle)?.1];
    let mut times = vec![[const { Vec::new() }; 3]; entries.len()];
    let mut all = Spent::default();
    let (mut different, mut tests) = (vec![0; entries.len()], vec![None; entries.len()]);
    for round in 0..options.rounds.max(1) {
        for (i, (Entry(accel, _, is_linear, _), (subject, _))) in entries.iter().zip(&subjects).enumerate() {
            if watch.is_stopped() {
                break;
            }
            watch.step(&format!("{title}, {name}: {accel}, round {} of {}", round + 1, options.rounds));
            let observed = Observed { inner: &*subject.accel, observer: Timer::default() };
            let which = usize::from(*is_linear);
            let (spent, image) = frame(sizes[which], &observed)?;
            all.add(spent);
            let timed = observed.observer.0.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
            let scale = full as f64 / (f64::from(sizes[which][0]) * f64::from(sizes[which][1]));
            for (times, seconds) in times[i].iter_mut().zip([spent.seconds, spent.processor_seconds, timed.seconds]) {
                times.push(seconds * scale);
            }
            if round == 0 {
                different[i] = different_pixels(&image, &pictures[which]);
                tests[i] = tests_per_ray(subject, &timed.rays);
            }
        }
    }
    let found = |i: usize| Found {
        build_milliseconds: subjects[i].1,
        timing: FrameTiming {
            frame_seconds: median_and_range(&times[i][0]),
            processor_seconds: median_and_range(&times[i][1])[0],
            accel_seconds: median_and_range(&times[i][2])[0],
            scaled_from: (entries[i].2 && divisor > 1).then_some(sizes[1]),
        },
        tests_per_ray: tests[i],
        different_pixels: different[i],
    };
    Ok(((0..entries.len()).take_while(|i| !times[*i][0].is_empty()).map(found).collect(), all))
}

/// The mean number of triangles tested for some of these rays, if that is known.
fn tests_per_ray(subject: &Subject, rays: &[Ray]) -> Option<f64> {
    let some = rays.iter().step_by((rays.len() / COUNTED).max(1));
    let counts: Option<Vec<f64>> = some.map(|ray| (subject.tests)(&*subject.accel, ray)).collect();
    counts.map(|counts| counts.iter().sum::<f64>() / counts.len().max(1) as f64)
}

fn different_pixels(a: &Image, b: &Image) -> usize {
    match (a.layer(LayerKind::Color), b.layer(LayerKind::Color)) {
        (Some(a), Some(b)) => a.pixels().zip(b.pixels()).filter(|(a, b)| a != b).count(),
        _ => 0,
    }
}

/// Takes the time of tracing, and keeps the rays.
#[derive(Default)]
struct Timer(Mutex<Timed>);

#[derive(Default)]
struct Timed {
    seconds: f64,
    rays: Vec<Ray>,
}

impl Observer for Timer {
    fn observe(&self, call: &Call, trace: &mut dyn FnMut()) {
        let start = Instant::now();
        trace();
        let seconds = start.elapsed().as_secs_f64();
        let mut timed = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        timed.seconds += seconds;
        timed.rays.extend_from_slice(call.rays);
    }
}
