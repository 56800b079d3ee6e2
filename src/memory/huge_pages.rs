//! Large blocks of memory in huge pages.

use std::alloc::{GlobalAlloc, Layout, System};

use rustix::mm::{Advice, madvise};

/// The size of a huge page of x86-64, in bytes.
const HUGE_PAGE: usize = 2 << 20;

/// The system's allocator, with blocks of at least 2 MiB at multiples of 2 MiB and advised to be in transparent huge
/// pages, where the system has them. Texels, meshes and trees, which are read in no order, then miss the TLB less.
/// Such a block does not grow in place.
pub struct HugePages;

/// The layout of a block in the system's allocator.
fn placed(layout: Layout) -> Layout {
    let aligned = if layout.size() < HUGE_PAGE { None } else { layout.align_to(HUGE_PAGE).ok() };
    aligned.unwrap_or(layout)
}

// SAFETY: blocks are those of the system's allocator, by the same layout when they are freed as when they were
// allocated, which is at least as large and as aligned as the caller's.
unsafe impl GlobalAlloc for HugePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's obligations are those of the same method.
        let memory = unsafe { System.alloc(placed(layout)) };
        if !memory.is_null() && layout.size() >= HUGE_PAGE {
            // SAFETY: the pages belong to the block, and keep what is in them. A system without huge pages refuses,
            // which does no harm.
            let _ = unsafe { madvise(memory.cast(), layout.size(), Advice::LinuxHugepage) };
        }
        memory
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if layout.size() < HUGE_PAGE {
            // SAFETY: as above.
            return unsafe { System.alloc_zeroed(layout) };
        }
        // SAFETY: as above.
        let memory = unsafe { self.alloc(layout) };
        if !memory.is_null() {
            // SAFETY: the block has as many bytes. They are written after the advice, which counts for new pages.
            unsafe { memory.write_bytes(0, layout.size()) };
        }
        memory
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if layout.size().max(size) < HUGE_PAGE {
            // SAFETY: as above.
            return unsafe { System.realloc(memory, layout, size) };
        }
        // SAFETY: the caller ensures that the size does not overflow when rounded up to the alignment.
        let new = unsafe { self.alloc(Layout::from_size_align_unchecked(size, layout.align())) };
        if !new.is_null() {
            // SAFETY: both blocks have as many bytes, and do not overlap; the old one is not used again.
            unsafe {
                new.copy_from_nonoverlapping(memory, layout.size().min(size));
                self.dealloc(memory, layout);
            }
        }
        new
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the layout by which the block was allocated.
        unsafe { System.dealloc(memory, placed(layout)) }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// The flags of the mapping with `address`, of which "hg" is advice for huge pages (`man proc_pid_smaps`).
    fn mapping_flags(address: usize) -> String {
        let smaps = fs::read_to_string("/proc/self/smaps").unwrap();
        let mut is_inside = false;
        for line in smaps.lines() {
            let range = line.split(' ').next().unwrap().split_once('-');
            if let Some((first, end)) = range.filter(|_| !line.contains(": ")) {
                let [first, end] = [first, end].map(|number| usize::from_str_radix(number, 16).unwrap());
                is_inside = (first..end).contains(&address);
            } else if let Some(flags) = line.strip_prefix("VmFlags:").filter(|_| is_inside) {
                return format!("{} ", flags.trim());
            }
        }
        panic!("no mapping has {address:x}");
    }

    #[test]
    fn large_blocks_are_advised_to_be_in_huge_pages() {
        let layout = Layout::from_size_align(3 * HUGE_PAGE + 5, 16).unwrap();
        // SAFETY: the block is freed once, by its layout.
        let memory = unsafe { HugePages.alloc(layout) };
        assert!(!memory.is_null() && memory.addr() % HUGE_PAGE == 0);
        for offset in [0, layout.size() - 1] {
            let is_advised = mapping_flags(memory.addr() + offset).contains("hg ");
            assert_eq!(is_advised, Path::new("/sys/kernel/mm/transparent_hugepage/enabled").exists());
        }
        // SAFETY: as above.
        unsafe { HugePages.dealloc(memory, layout) };
    }

    #[test]
    fn contents_are_kept_when_blocks_grow_and_shrink() {
        let pattern = |index: usize| (index % 251) as u8;
        let mut layout = Layout::from_size_align(64, 8).unwrap();
        // SAFETY: the block is freed once, by its last layout; only bytes inside it are read and written.
        unsafe {
            let mut memory = HugePages.alloc(layout);
            (0..64).for_each(|i| memory.add(i).write(pattern(i)));
            for size in [HUGE_PAGE - 1, HUGE_PAGE, 3 * HUGE_PAGE + 7, HUGE_PAGE + 1, 100] {
                memory = HugePages.realloc(memory, layout, size);
                let kept = layout.size().min(size);
                layout = Layout::from_size_align(size, 8).unwrap();
                assert!((0..kept).all(|i| memory.add(i).read() == pattern(i)), "{size}");
                (kept..size).for_each(|i| memory.add(i).write(pattern(i)));
            }
            HugePages.dealloc(memory, layout);
        }
    }

    #[test]
    fn zeroed_blocks_are_zero_where_other_blocks_were() {
        for size in [100, HUGE_PAGE, 2 * HUGE_PAGE + 3] {
            let layout = Layout::from_size_align(size, 8).unwrap();
            for _ in 0..3 {
                // SAFETY: as above.
                unsafe {
                    let memory = HugePages.alloc_zeroed(layout);
                    assert!((0..size).all(|i| memory.add(i).read() == 0), "{size}");
                    memory.write_bytes(0xff, size);
                    HugePages.dealloc(memory, layout);
                }
            }
        }
    }

    #[test]
    fn more_memory_than_there_is_is_refused() {
        for size in [1 << 60, isize::MAX as usize - 7] {
            // SAFETY: nothing is allocated.
            assert!(unsafe { HugePages.alloc(Layout::from_size_align(size, 8).unwrap()) }.is_null());
        }
    }
}
