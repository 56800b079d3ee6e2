//! Group K: cameras.

checks! {}
