//! Computes `src/bsdf/energy/tables.bin`: what microfacets scatter at once, for the compensation of multiple
//! scattering.
//!
//! `cargo xtask bake_energy` overwrites the file; it changes only if the code of the microfacet distributions does.

use crate::{Outcome, root};

pub fn run() -> Outcome {
    let file = root().join("src/bsdf/energy/tables.bin");
    Ok(std::fs::write(file, steradian::internal::bsdf::bake_energy_tables())?)
}
