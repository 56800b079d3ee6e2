//! Where a benchmark ran.

use std::fs;
use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};
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

    /// For the head of a report.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = vec![
            ("Processor", format!("{} ({}, {} threads)", self.processor, self.instruction_set, self.threads)),
            ("Version", format!("steradian {}", self.version)),
        ];
        facts.extend(self.load.map(|load| ("Load before", format!("{load:.2}"))));
        facts
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

/// Processor seconds of this process so far, of all threads together.
pub fn processor_seconds() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// Below this share of the time that threads could have had, a machine is called loaded.
const LOADED: f64 = 0.8;

/// Seconds from which on shares of processor time are judged.
const JUDGED: f64 = 0.1;

/// Wall time and processor time of work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spent {
    /// Seconds that passed.
    pub seconds: f64,
    /// Processor seconds, of all threads together.
    pub processor_seconds: f64,
    /// Seconds that passed times the number of threads that could run.
    pub thread_seconds: f64,
}

impl Spent {
    /// Times what is done with a number of threads.
    pub(super) fn on<T>(threads: usize, work: impl FnOnce() -> T) -> (T, Self) {
        let (start, before) = (Instant::now(), processor_seconds());
        let result = work();
        (result, Self::new(threads, start.elapsed().as_secs_f64(), processor_seconds() - before))
    }

    /// Of work on a number of threads, not more than the machine has.
    pub(super) fn new(threads: usize, seconds: f64, processor_seconds: f64) -> Self {
        let threads = threads.clamp(1, std::thread::available_parallelism().map_or(1, usize::from));
        Self { seconds, processor_seconds, thread_seconds: seconds * threads as f64 }
    }

    /// Adds other work.
    pub(super) fn add(&mut self, other: Self) {
        self.seconds += other.seconds;
        self.processor_seconds += other.processor_seconds;
        self.thread_seconds += other.thread_seconds;
    }

    /// The share of the time of its threads that was processor time.
    fn share(&self) -> f64 {
        self.processor_seconds / self.thread_seconds
    }

    /// Both times; none if nothing was measured.
    pub(super) fn fact(&self) -> Option<String> {
        (self.thread_seconds > 0.0).then(|| {
            let percent = 100.0 * self.share();
            let Self { seconds, processor_seconds, .. } = self;
            format!("{seconds:.1} s wall, {processor_seconds:.1} s processor ({percent:.0} % of the threads' time)")
        })
    }

    /// What to think of the times if other programs had much of the processor.
    pub(super) fn warning(&self) -> Option<String> {
        (self.seconds > JUDGED && self.share() < LOADED).then(|| {
            format!(
                "The machine was loaded: the measured threads had the processor for {:.0} % of their time. Wall times \
                 are too long; compare processor times, or repeat this on an idle machine.",
                100.0 * self.share()
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loaded_machine_is_reported() {
        let mut spent = Spent::new(1, 10.0, 9.8);
        assert_eq!((spent.warning(), spent.fact().unwrap().contains("98 %")), (None, true));
        spent.add(Spent::new(1, 10.0, 3.0));
        assert!(spent.warning().unwrap().contains("64 %"), "{spent:?}");
        // Too short to be judged.
        assert_eq!((Spent::new(1, 0.01, 0.0).warning(), Spent::default().fact()), (None, None));
        let (sum, spent) = Spent::on(1, || (0..1000u64).sum::<u64>());
        assert!(sum == 499_500 && spent.seconds > 0.0 && spent.thread_seconds == spent.seconds);
    }
}
