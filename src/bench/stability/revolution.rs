//! Group D: surfaces of revolution.

checks! {}
