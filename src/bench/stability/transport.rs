//! Group I: light transport.

checks! {}
