//! Shows progress and stops a render early: `cargo run --release --example progress -- scenes/cornell.json`.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use steradian::import::{self, ImportOptions};
use steradian::render::{self, Overrides, Progress, Settings};
use steradian::{accel, compile};

/// Counts samples, and stops the render at half of them. Threads call it concurrently.
#[derive(Default)]
struct Half {
    total: AtomicU64,
    done: AtomicU64,
    stop: AtomicBool,
}

impl Progress for Half {
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        self.total.store(u64::from(samples_per_pixel) * pixels, Ordering::Relaxed);
    }

    fn tile_done(&self, samples: u64) {
        let done = self.done.fetch_add(samples, Ordering::Relaxed) + samples;
        let total = self.total.load(Ordering::Relaxed);
        eprint!("\r{:3} %", 100 * done / total.max(1));
        if 2 * done >= total {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn finish(&self) {
        eprintln!();
    }

    fn warn(&self, message: &str) {
        eprintln!("warning: {message}");
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene_file = std::env::args().nth(1).ok_or("usage: progress SCENE")?;
    let scene_file = Path::new(&scene_file);
    let imported = import::read_scene(scene_file, &ImportOptions::default())?;
    let overrides = Overrides { spp: Some(64), default_outputs: vec!["progress.exr".into()], ..Overrides::default() };
    let settings = Settings::new(&imported.desc, &overrides)?;
    let scene = compile::compile_from(&imported.desc, imported.source(scene_file))?;
    let accel = accel::build(settings.accel, &scene.geometry, settings.threads)?;

    let progress = Half::default();
    // The pass under way is finished; the picture has the samples taken so far.
    let image = render::render(&scene, &*accel, &settings, &progress, &progress.stop)?.image;
    println!("{} x {} pixels, {} samples", image.size[0], image.size[1], progress.done.load(Ordering::Relaxed));
    Ok(())
}
