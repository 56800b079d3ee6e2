//! Declarations that bindgen makes from `ffi/wrapper.h`.

#![allow(missing_docs, non_camel_case_types, non_snake_case, non_upper_case_globals, dead_code)]
#![allow(clippy::all, clippy::undocumented_unsafe_blocks, unused_qualifications)]

include!(concat!(env!("OUT_DIR"), "/embree.rs"));
