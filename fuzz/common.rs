//! What all targets do: read the bytes, and count the memory that it takes.

#[path = "harness.rs"]
mod harness;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::PathBuf;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes in use, and the most since the last reset.
static USED: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call goes to the system's allocator as it came; only numbers are kept beside.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let used = USED.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(used, Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Memory that a reader may take whatever the size of its file: buffers of the system and of decoders.
const FREE: usize = 4 << 20;

/// Memory for each byte of the file.
const FACTOR: usize = 20;

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
/// If that takes more memory than such a file explains. Images are compressed and have a limit of their own, a number of pixels.
pub fn run(kind: &str, data: &[u8]) {
    LazyLock::force(&FOLDER);
    let before = USED.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    harness::read(kind, data, &FOLDER);
    let taken = PEAK.load(Ordering::Relaxed).saturating_sub(before);
    assert!(kind == "image" || taken <= FREE + FACTOR * data.len(), "{taken} bytes for a file of {}", data.len());
}
