//! Where a benchmark ran.

use std::fs;

use serde::Serialize;

/// The machine as far as it bears on speed.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The processor's name.
    pub processor: String,
    /// Widest of the instruction sets that the processor has and that matter here.
    pub instruction_set: &'static str,
    /// Threads that run at once.
    pub threads: usize,
    /// Load average over a minute before the benchmark; the benchmark itself adds to it.
    pub load: Option<f64>,
    /// Version of this program.
    pub version: &'static str,
}

impl Machine {
    /// This machine, now.
    pub fn here() -> Self {
        let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor =
            info.lines().find_map(|line| line.strip_prefix("model name")).and_then(|line| line.split_once(':'));
        let load = fs::read_to_string("/proc/loadavg").ok().and_then(|text| text.split(' ').next()?.parse().ok());
        Self {
            processor: processor.map_or("unknown", |(_, name)| name.trim()).to_owned(),
            instruction_set: instruction_set(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            load,
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// In one line, with the version.
    pub fn line(&self) -> String {
        let load = self.load.map_or(String::new(), |load| format!(", load {load:.2} before"));
        format!(
            "{} ({}, {} threads{load}), steradian {}",
            self.processor, self.instruction_set, self.threads, self.version
        )
    }
}

#[cfg(target_arch = "x86_64")]
fn instruction_set() -> &'static str {
    if std::is_x86_feature_detected!("avx512f") {
        "AVX-512"
    } else if std::is_x86_feature_detected!("avx2") {
        "AVX2"
    } else {
        "SSE2"
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn instruction_set() -> &'static str {
    std::env::consts::ARCH
}

/// Forgets the highest memory use so far, so that [`memory_in_use`] gives the highest since now. False where the system
/// cannot.
pub fn reset_peak_memory() -> bool {
    fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// Bytes of memory in use now, and the most since the last reset.
pub fn memory_in_use() -> Option<[u64; 2]> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let field = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
    };
    Some([field("VmRSS:")?, field("VmHWM:")?])
}
