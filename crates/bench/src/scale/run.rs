//! One case: made, loaded, built, rendered. In a process of its own, for a process never forgets how much memory it
//! once held.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::plan::Case;
use super::scenes;
use crate::accel;
use crate::compile;
use crate::machine::{memory_in_use, processor_seconds, reset_peak_memory};
use crate::render::{self, Overrides, Settings, Silent};
use steradian::{Error, Result};

/// What a case took.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Triangles stored.
    pub triangles: u64,
    /// Instances.
    pub instances: u64,
    /// Lights.
    pub lights: u64,
    /// Seconds to make the scene, which is no part of anything below.
    pub make_seconds: f64,
    /// Seconds from the description to the scene, meshes placed and checked.
    pub load_seconds: f64,
    /// Seconds to build the accelerator.
    pub build_seconds: f64,
    /// Seconds of the render until every pixel had its first sample.
    pub first_pass_seconds: f64,
    /// Seconds of the render.
    pub render_seconds: f64,
    /// Processor seconds of the render, all threads together.
    pub processor_seconds: f64,
    /// Samples in the picture.
    pub samples: u64,
    /// Rays traced.
    pub rays: u64,
    /// Bytes of mesh buffers and tables of shapes.
    pub mesh_bytes: u64,
    /// Bytes of the accelerator beside them.
    pub accelerator_bytes: u64,
    /// Bytes of the film for each pixel.
    pub film_bytes_per_pixel: u64,
    /// Memory of the process; none where the system does not provide it.
    pub memory: Option<Memory>,
}

/// Bytes of memory that the process held.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Memory {
    /// Before anything.
    pub start: u64,
    /// With the scene's description made.
    pub made: u64,
    /// The most while it was loaded.
    pub load: u64,
    /// The most while the accelerator was built.
    pub build: u64,
    /// Before the render.
    pub before_render: u64,
    /// The most while it was rendered.
    pub render: u64,
}

impl Measured {
    /// The most memory that the process held after the scene's description was made.
    pub fn peak_bytes(&self) -> Option<u64> {
        self.memory.map(|memory| memory.load.max(memory.build).max(memory.render))
    }
}

/// What the process holds now, and the most since the last question.
fn memory() -> Option<[u64; 2]> {
    let memory = memory_in_use();
    if reset_peak_memory() { memory } else { None }
}

/// Runs a case here. Its memory is that of this process, which should do nothing else.
///
/// # Errors
/// As loading, building and rendering.
pub fn run_case(case: &Case) -> Result<Measured> {
    let start = memory();
    let clock = Instant::now();
    let imported = scenes::make(case)?;
    let make_seconds = clock.elapsed().as_secs_f64();
    let made = memory();

    let clock = Instant::now();
    let overrides =
        Overrides { threads: Some(case.threads), default_outputs: vec!["unused.exr".into()], ..Overrides::default() };
    let mut settings = Settings::new(&imported.desc, &overrides)?;
    settings.layers = case.layers.iter().collect();
    settings.accel = case.accel.parse().map_err(|e: accel::UnknownAccel| Error::Usage(e.to_string()))?;
    let scene = compile::compile_from(&imported.desc, imported.source("generated".as_ref()))?;
    drop(imported);
    let load_seconds = clock.elapsed().as_secs_f64();
    let loaded = memory();

    let clock = Instant::now();
    let accel = accel::build(settings.accel, &scene.geometry, settings.threads)?;
    let build_seconds = clock.elapsed().as_secs_f64();
    let built = memory();

    let processor = processor_seconds();
    let stats = render::render(&scene, &*accel, &settings, &Silent, &AtomicBool::new(false))?.stats;
    let processor_seconds = processor_seconds() - processor;
    let rendered = memory();
    let memory = (|| {
        let (built, rendered) = (built?, rendered?);
        let [start, _] = start?;
        Some(Memory {
            start,
            made: made?[0],
            load: loaded?[1],
            build: built[1],
            before_render: built[0],
            render: rendered[1],
        })
    })();
    let summary = compile::Summary::new(&scene);
    Ok(Measured {
        triangles: summary.triangles as u64,
        instances: summary.instances as u64,
        lights: scene.lights.lights().len() as u64,
        make_seconds,
        load_seconds,
        build_seconds,
        first_pass_seconds: stats.first_pass_seconds,
        render_seconds: stats.render_seconds,
        processor_seconds,
        samples: stats.samples,
        rays: stats.rays.total(),
        mesh_bytes: summary.geometry_bytes as u64,
        accelerator_bytes: accel.memory_bytes() as u64,
        film_bytes_per_pixel: render::film_bytes_per_pixel(&scene, &settings) as u64,
        memory,
    })
}
