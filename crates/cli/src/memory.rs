//! The end of the program when memory runs out, in its own code or a library's: one line on stderr and exit code 33.
//!
//! Rust ends with SIGABRT and a backtrace, C++ by an exception that nobody catches. What is done here takes no memory,
//! and runs no destructors, which other threads may be in the way of.

use std::alloc::{GlobalAlloc, Layout};
use std::ffi::{CStr, c_char, c_int};
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::mem::ManuallyDrop;
use std::os::fd::FromRawFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};
use signal_hook::consts::SIGABRT;
use signal_hook::low_level::{emulate_default_handler, register};
use steradian::internal::accel::on_uncaught_exception;
use steradian::internal::memory::{HugePages, is_fallible};

use crate::log;

/// Exit codes, as in `main`.
const OUT_OF_MEMORY: c_int = 33;
const INTERNAL: c_int = 1;

unsafe extern "C" {
    fn _exit(code: c_int) -> !;
}

/// The library's allocator, but it ends the program where it has no memory.
struct Allocator;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

/// What the allocator returns, if that is memory, or the caller copes without.
fn checked(memory: *mut u8, size: usize) -> *mut u8 {
    if memory.is_null() && !is_fallible() {
        end(OUT_OF_MEMORY, format_args!("out of memory: {size} bytes could not be allocated"));
    }
    memory
}

// SAFETY: every method is that of the library's allocator with the same arguments; what it returns is returned.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's obligations are those of the same method.
        checked(unsafe { HugePages.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { HugePages.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { HugePages.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { HugePages.dealloc(memory, layout) }
    }
}

/// Grows the main thread's stack to what a command needs. Without memory it would end the program later, by SIGSEGV.
#[inline(never)]
pub fn grow_stack() {
    std::hint::black_box([1_u8; 1 << 20]);
}

/// Panics of the standard library for lack of memory end the program as other failures of memory do.
pub fn end_if_out_of_memory(panic: &str) {
    // ENOMEM, as `std::io::Error` displays it.
    if panic.contains("(os error 12)") {
        end(OUT_OF_MEMORY, format_args!("out of memory: {panic}"));
    }
}

/// Uncaught C++ exceptions, and aborts of the C library without memory, end the program in the same way from here on.
pub fn handle_library_failures() {
    on_uncaught_exception(uncaught);
    // SAFETY: the handler makes system calls only.
    let registered = unsafe { register(SIGABRT, aborted) };
    // Without a handler, such aborts have the exit code of other aborts.
    drop(registered);
}

/// glibc aborts where it cannot register the destructor of a thread's variable.
fn aborted() {
    const PROBE: usize = 1 << 20;
    // SAFETY: a new mapping at any place is in the way of no other.
    match unsafe { mmap_anonymous(std::ptr::null_mut(), PROBE, ProtFlags::READ | ProtFlags::WRITE, MapFlags::PRIVATE) }
    {
        Err(_) => end(OUT_OF_MEMORY, format_args!("out of memory in the C library")),
        Ok(probe) => {
            // SAFETY: the mapping made above, which nothing refers to.
            let _ = unsafe { munmap(probe, PROBE) };
            drop(emulate_default_handler(SIGABRT));
        }
    }
}

extern "C" fn uncaught(out_of_memory: bool, what: *const c_char) {
    // SAFETY: the handler gets a C string that lives during the call.
    let what = unsafe { CStr::from_ptr(what) }.to_str().unwrap_or("unknown");
    if out_of_memory {
        end(OUT_OF_MEMORY, format_args!("out of memory in Embree, or no more threads ({what})"));
    }
    end(
        INTERNAL,
        format_args!("internal error in a C++ library: {what} (this is a bug; please report it with the scene)"),
    );
}

/// A line on the stack.
struct Line {
    bytes: [u8; 512],
    length: usize,
}

impl std::fmt::Write for Line {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        let count = text.len().min(self.bytes.len() - self.length);
        self.bytes[self.length..self.length + count].copy_from_slice(&text.as_bytes()[..count]);
        self.length += count;
        Ok(())
    }
}

/// Prints an error, without quotes and backslashes in it, and ends the program.
fn end(code: c_int, message: std::fmt::Arguments) -> ! {
    static ENDING: AtomicBool = AtomicBool::new(false);
    if ENDING.swap(true, Ordering::SeqCst) {
        // Another thread has begun to.
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut line = Line { bytes: [0; 512], length: 0 };
    let _ = if log::is_json() {
        writeln!(line, "{{\"level\":\"error\",\"message\":\"{message}\"}}")
    } else {
        writeln!(line, "error: {message}")
    };
    // SAFETY: stderr is open, or writing fails; it is never closed here. Its own writer might wait for a thread that
    // waits above.
    let mut stderr = ManuallyDrop::new(unsafe { File::from_raw_fd(2) });
    let _ = stderr.write_all(&line.bytes[..line.length]);
    // SAFETY: the function may be called at any time.
    unsafe { _exit(code) }
}
