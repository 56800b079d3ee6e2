//! Group E: degenerate input.

checks! {}
