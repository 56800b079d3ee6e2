//! Memory that will be read soon.

use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// Bytes of a line of the caches.
const LINE: usize = 64;

/// Starts to load an element into the caches; nothing where there is none.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], i: usize) {
    if i < slice.len() {
        prefetch_lines(address(slice, i), size_of::<T>().div_ceil(LINE));
    }
}

/// The address of an element, or where it would be.
#[inline(always)]
pub fn address<T>(slice: &[T], i: usize) -> *const i8 {
    slice.as_ptr().wrapping_add(i).cast()
}

/// Starts to load some lines of the caches from an address on, which may be any.
#[inline(always)]
pub fn prefetch_lines(start: *const i8, count: usize) {
    for line in 0..count {
        // SAFETY: every x86-64 processor has the instruction, and it is a hint: no address makes it fail.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(LINE * line)) }
    }
}
