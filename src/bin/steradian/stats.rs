//! Statistics of a run for scripts.

use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};
use steradian::accel::Accelerator;
use steradian::render::{Settings, Stats};
use steradian::{Result, output};

use crate::text;

/// What a run took beside the render loop.
pub struct Run<'a> {
    /// The scene file.
    pub scene: &'a Path,
    /// The accelerator.
    pub accel: &'a dyn Accelerator,
    /// Seconds to read and compile the scene.
    pub load_seconds: f64,
    /// Seconds to build the accelerator.
    pub build_seconds: f64,
}

/// The statistics as one JSON object.
pub fn value(run: &Run, settings: &Settings, stats: &Stats) -> Value {
    let accel = run.accel;
    let rays = stats.rays;
    let millions_per_second =
        |count: u64| if stats.render_seconds > 0.0 { count as f64 / stats.render_seconds * 1e-6 } else { 0.0 };
    let description = accel.description();
    json!({
        "scene": run.scene.display().to_string(),
        "width": settings.crop.width,
        "height": settings.crop.height,
        "spp": stats.spp_done,
        "estimated_error": stats.estimated_error,
        "threads": settings.threads,
        "accelerator": description,
        "embree": embree(&description),
        "load_seconds": run.load_seconds,
        "build_seconds": run.build_seconds,
        "first_pass_seconds": run.load_seconds + run.build_seconds + stats.first_pass_seconds,
        "render_seconds": stats.render_seconds,
        "samples": stats.samples,
        "rays": { "camera": rays.camera, "indirect": rays.indirect, "shadow": rays.shadow },
        "mrays_per_second": millions_per_second(rays.total()),
        "msamples_per_second": millions_per_second(stats.samples),
        "accelerator_bytes": accel.memory_bytes(),
        "peak_memory_bytes": peak_memory(),
        "nan_samples": stats.nan_samples,
        "interrupted": stats.interrupted,
        "time_limited": stats.time_limited,
        "outputs": settings.outputs.iter().map(|output| output.file.as_str()).collect::<Vec<_>>(),
    })
}

/// Writes statistics to a file, whole or not at all, or to stdout for `-`.
pub fn write(path: &Path, value: &Value) -> Result<()> {
    if path == Path::new("-") {
        return text::print_json(value);
    }
    output::write_atomically(path, |out| writeln!(out, "{value:#}").map_err(|e| e.to_string()))
}

/// Version and instruction set out of Embree's description, `Embree VERSION (ISA, ...)`; null for other accelerators.
fn embree(description: &str) -> Value {
    let parts = description.strip_prefix("Embree ").and_then(|rest| rest.split_once(" ("));
    parts.map_or(Value::Null, |(version, rest)| json!({ "version": version, "isa": rest.split([',', ')']).next() }))
}

/// The most memory that the process has held, in bytes.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_description_of_embree_is_taken_apart() {
        assert_eq!(
            embree("Embree 3.13.5 (AVX-512, single rays and packets of 16)"),
            json!({ "version": "3.13.5", "isa": "AVX-512" })
        );
        assert_eq!(embree("linear search"), Value::Null);
    }

    #[test]
    fn the_process_holds_some_memory() {
        assert!(peak_memory().is_some_and(|bytes| bytes > 100_000));
    }
}
