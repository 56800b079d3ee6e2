//! Requests for memory that may fail, and an allocator for programs.

mod huge_pages;

use std::cell::Cell;

pub use huge_pages::HugePages;

thread_local! {
    static FALLIBLE: Cell<bool> = const { Cell::new(false) };
}

/// Runs `request`, which copes with memory that cannot be had, as `Vec::try_reserve` reports it. A program whose
/// allocator ends it when memory runs out lets such requests fail instead, by [`is_fallible`].
pub fn fallible<T>(request: impl FnOnce() -> T) -> T {
    let before = FALLIBLE.replace(true);
    let result = request();
    FALLIBLE.set(before);
    result
}

/// Whether `bytes` can be allocated in one piece. Many small requests would be granted long past what the machine has.
pub fn is_available(bytes: usize) -> bool {
    fallible(|| std::hint::black_box(Vec::<u8>::new()).try_reserve_exact(bytes).is_ok())
}

/// Whether this thread is in [`fallible`].
pub fn is_fallible() -> bool {
    FALLIBLE.get()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_machine_has_all_bytes() {
        assert!(is_available(1 << 20) && !is_available(1 << 60) && !is_available(usize::MAX));
    }

    #[test]
    fn only_the_request_is_fallible() {
        assert!(!is_fallible());
        assert!(fallible(|| fallible(is_fallible) && is_fallible()));
        assert!(!is_fallible());
    }
}
