//! Group L: lights.

checks! {}
