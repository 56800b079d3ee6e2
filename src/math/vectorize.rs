//! Loops over many numbers, compiled for the vector instructions that the machine has.
//!
//! A kernel is plain Rust: loops over arrays, whose bodies are inlined and branch only to choose numbers. The compiler turns them into vector
//! code. No instruction set rounds otherwise (nothing is fused), so the results are the same on every machine, bit for bit.

use pulp::x86::{V3, V4};

/// What is to be compiled for several instruction sets. Its `call`, and whatever that calls, must be inlined (`#[inline(always)]`), or is
/// compiled for none of them.
pub use pulp::NullaryFnOnce as Kernel;

/// Runs a kernel with AVX-512, with AVX2, or with what every processor has.
#[inline]
pub fn vectorize<K: Kernel>(kernel: K) -> K::Output {
    if let Some(simd) = V4::try_new() {
        simd.vectorize(kernel)
    } else if let Some(simd) = V3::try_new() {
        simd.vectorize(kernel)
    } else {
        kernel.call()
    }
}

/// Runs kernels that `make` gives with each instruction set that the machine has; the first result is that of plain code.
#[cfg(test)]
pub fn with_each<K: Kernel>(mut make: impl FnMut() -> K) -> Vec<K::Output> {
    let mut outputs = vec![make().call()];
    outputs.extend(V3::try_new().map(|simd| simd.vectorize(make())));
    outputs.extend(V4::try_new().map(|simd| simd.vectorize(make())));
    outputs
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Three;

    impl Kernel for Three {
        type Output = u32;

        #[inline(always)]
        fn call(self) -> u32 {
            3
        }
    }

    /// Ignored where tests of kernels have fewer instruction sets to compare.
    #[test]
    #[cfg_attr(any(miri, not(avx512)), ignore = "needs AVX-512")]
    fn kernels_are_tested_with_every_instruction_set() {
        assert_eq!(with_each(|| Three), [3, 3, 3]);
    }
}
