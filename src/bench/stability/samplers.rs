//! Group S: samplers.

checks! {}
