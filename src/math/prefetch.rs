//! Memory that will be read soon.

use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// Bytes of a line of the caches.
const LINE: usize = 64;

/// Starts to load an element into the caches; nothing where there is none.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], i: usize) {
    if let Some(element) = slice.get(i) {
        let start = std::ptr::from_ref(element).cast::<i8>();
        for line in 0..size_of::<T>().div_ceil(LINE) {
            // SAFETY: every x86-64 processor has the instruction, and it is a hint: no address makes it fail.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(LINE * line)) }
        }
    }
}
