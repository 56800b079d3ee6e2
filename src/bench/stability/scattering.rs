//! Group G: scattering at surfaces.

checks! {}
