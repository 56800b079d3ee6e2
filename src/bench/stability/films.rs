//! Group M: films.

checks! {}
