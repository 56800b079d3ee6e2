//! Group F: accelerators against the linear oracle.

checks! {}
