//! Group B: rays that leave a surface.

checks! {}
