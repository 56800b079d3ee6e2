//! An accelerator of one's own: a wrapper that counts the rays of a render.
//! `cargo run --release --example custom_accelerator -- scenes/cornell.json`.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use steradian::internal::accel::{self, AccelKind, Accelerator};
use steradian::internal::compile;
use steradian::internal::geometry::Hit;
use steradian::internal::import::{self, ImportOptions};
use steradian::internal::math::{Aabb, Ray};
use steradian::internal::render::{self, Overrides, Settings, Silent};

/// Passes every ray to another accelerator. A new structure implements the same methods over a
/// [`steradian::internal::geometry::Geometry`]; see [`accel::LinearAccel`] for the shortest one.
struct Counting<'g> {
    inner: Box<dyn Accelerator + 'g>,
    closest: AtomicU64,
    any: AtomicU64,
}

impl Accelerator for Counting<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.closest.fetch_add(1, Ordering::Relaxed);
        self.inner.intersect(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.any.fetch_add(1, Ordering::Relaxed);
        self.inner.occluded(ray)
    }

    // Batches of rays come to the two methods above, one ray at a time, by default.

    fn bounds(&self) -> Aabb {
        self.inner.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.inner.memory_bytes()
    }

    fn description(&self) -> String {
        format!("counting {}", self.inner.description())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene_file = std::env::args().nth(1).ok_or("usage: custom_accelerator SCENE")?;
    let scene_file = Path::new(&scene_file);
    let imported = import::read_scene(scene_file, &ImportOptions::default())?;
    let overrides = Overrides { spp: Some(4), default_outputs: vec!["counted.exr".into()], ..Overrides::default() };
    let settings = Settings::new(&imported.desc, &overrides)?;
    let scene = compile::compile_from(&imported.desc, imported.source(scene_file))?;
    let inner = accel::build(AccelKind::EMBREE, &scene.geometry, settings.threads)?;
    let counting = Counting { inner, closest: AtomicU64::new(0), any: AtomicU64::new(0) };
    render::render(&scene, &counting, &settings, &Silent, &AtomicBool::new(false))?;
    let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
    println!(
        "{}: {} closest-hit rays, {} shadow rays",
        counting.description(),
        count(&counting.closest),
        count(&counting.any)
    );
    Ok(())
}
