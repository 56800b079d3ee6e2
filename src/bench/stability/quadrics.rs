//! Group C: quadrics and flat shapes.

checks! {}
