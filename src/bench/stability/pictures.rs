//! Group R: pictures.

checks! {}
