//! Memory that will be read soon.

use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// Starts to load an element into the caches; nothing where there is none.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], i: usize) {
    if let Some(element) = slice.get(i) {
        // SAFETY: every x86-64 processor has the instruction, and it is a hint: no address makes it fail.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(element).cast()) }
    }
}
