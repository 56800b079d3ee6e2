//! Statistics of a render for scripts.

use serde_json::{Value, json};

use super::rendering::{Denoised, Rendering};

impl Rendering {
    /// Time, rays, samples and memory as one JSON object: what `steradian render --stats` writes.
    pub fn statistics(&self) -> Value {
        let (settings, stats, rays) = (&self.settings, &self.stats, self.stats.rays);
        let millions_per_second =
            |count: u64| if stats.render_seconds > 0.0 { count as f64 / stats.render_seconds * 1e-6 } else { 0.0 };
        json!({
            "scene": self.scene_file.display().to_string(),
            "width": settings.crop.width,
            "height": settings.crop.height,
            "spp": stats.spp_done,
            "estimated_error": stats.estimated_error,
            "threads": settings.threads,
            "accelerator": self.accelerator,
            "embree": embree(&self.accelerator),
            "load_seconds": self.load_seconds,
            "build_seconds": self.build_seconds,
            "first_pass_seconds": self.first_pass_seconds(),
            "render_seconds": stats.render_seconds,
            "samples": stats.samples,
            "rays": { "camera": rays.camera, "indirect": rays.indirect, "shadow": rays.shadow },
            "mrays_per_second": millions_per_second(rays.total()),
            "msamples_per_second": millions_per_second(stats.samples),
            "accelerator_bytes": self.accelerator_bytes,
            "peak_memory_bytes": peak_memory(),
            "nan_samples": stats.nan_samples,
            "interrupted": stats.interrupted,
            "time_limited": stats.time_limited,
            "light_tracing": stats.light_tracing,
            "outputs": settings.outputs.iter().map(|output| output.file.as_str()).collect::<Vec<_>>(),
            "denoise": self.denoised.as_ref().map_or(Value::Null, Denoised::statistics),
        })
    }
}

/// Version and instruction set out of Embree's description, `Embree VERSION (ISA, ...)`; null for other accelerators.
fn embree(description: &str) -> Value {
    let parts = description.strip_prefix("Embree ").and_then(|rest| rest.split_once(" ("));
    parts.map_or(Value::Null, |(version, rest)| json!({ "version": version, "isa": rest.split([',', ')']).next() }))
}

/// The most memory that the process has held, in bytes; `None` where the system does not show it.
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
