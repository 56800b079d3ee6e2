//! Loops over many numbers, compiled for the vector instructions that the machine has.
//!
//! A kernel is a function in plain Rust: loops over arrays, whose bodies are inlined and branch only to choose numbers.
//! The compiler turns them into vector code. No instruction set rounds otherwise (nothing is fused), so the results are
//! the same on every machine, bit for bit.

use pulp::x86::{V3, V4};

/// Evaluates a call of a kernel with AVX-512, with AVX2, or with what every processor has. The function, and whatever
/// it calls, must be inlined (`#[inline(always)]`), or is compiled for none of them.
macro_rules! vectorize {
    ($call:expr) => {
        $crate::math::vectorize::run(
            #[inline(always)]
            || $call,
        )
    };
}

pub(crate) use vectorize;

/// What `vectorize!` does with a closure that is always inlined.
#[inline]
pub fn run<R>(kernel: impl FnOnce() -> R) -> R {
    if let Some(simd) = V4::try_new() {
        simd.vectorize(kernel)
    } else if let Some(simd) = V3::try_new() {
        simd.vectorize(kernel)
    } else {
        kernel()
    }
}

/// Numbers of 32 bits in the vectors that [`run`] uses.
#[inline]
pub fn lanes() -> usize {
    if V4::try_new().is_some() { 16 } else { 8 }
}

/// Evaluates a call of a kernel with each instruction set that the machine has; the first result is that of plain code.
#[cfg(test)]
macro_rules! with_each {
    ($call:expr) => {{
        let mut outputs = vec![$call];
        if let Some(simd) = pulp::x86::V3::try_new() {
            outputs.push(simd.vectorize(
                #[inline(always)]
                || $call,
            ));
        }
        if let Some(simd) = pulp::x86::V4::try_new() {
            outputs.push(simd.vectorize(
                #[inline(always)]
                || $call,
            ));
        }
        outputs
    }};
}

#[cfg(test)]
pub(crate) use with_each;

#[cfg(test)]
mod tests {
    #[inline(always)]
    fn three() -> u32 {
        3
    }

    /// Ignored where tests of kernels have fewer instruction sets to compare.
    #[test]
    #[cfg_attr(any(miri, not(avx512)), ignore = "needs AVX-512")]
    fn kernels_are_tested_with_every_instruction_set() {
        assert_eq!((with_each!(three()), vectorize!(three())), (vec![3; 3], 3));
    }
}
