//! What all targets do: read the bytes, and count the memory that it takes.

#[path = "harness.rs"]
mod harness;

use std::path::PathBuf;
use std::sync::LazyLock;

use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Memory that a reader may take whatever the size of its file: buffers of the system and of decoders.
const FREE: usize = 4 << 20;

/// Memory for each byte of the file, and of volume files, whose grids may be compressed as a whole.
const FACTOR: usize = 20;
const VDB_FACTOR: usize = 1100;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let shared = PathBuf::from("/dev/shm");
    let base = if shared.is_dir() { shared } else { std::env::temp_dir() };
    let folder = base.join(format!("steradian-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    folder
});

/// Reads the bytes as a file of `kind`.
///
/// # Panics
/// If that takes more memory than such a file explains. Images are compressed and have a limit of their own, a number
/// of pixels; and subdivision surfaces have no bound on their triangles.
pub fn run(kind: &str, data: &[u8]) {
    LazyLock::force(&FOLDER);
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    harness::read(kind, data, &FOLDER);
    let taken = ALLOCATOR.peak_usage().saturating_sub(before);
    let asks_for_more = kind == "image" || data.windows(10).any(|word| word == b"loopsubdiv");
    let factor = if kind == "vdb" { VDB_FACTOR } else { FACTOR };
    assert!(asks_for_more || taken <= FREE + factor * data.len(), "{taken} bytes for a file of {}", data.len());
}

/// Whether a count is more than a few, as levels of subdivision go: a million triangles take their time, which is no
/// finding.
fn asks_for_many(rest: &[u8]) -> bool {
    let digits = rest.iter().skip_while(|c| !c.is_ascii_digit()).take_while(|c| c.is_ascii_digit());
    digits.fold(0u64, |n, c| n.saturating_mul(10).saturating_add(u64::from(c - b'0'))) > 4
}
