//! Computes `src/bsdf/energy/tables.bin`: what microfacets scatter at once, for the compensation of multiple scattering.
//!
//! `cargo run --release --example bake_energy` writes the file anew; without a change of the code around it nothing changes.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bsdf/energy/tables.bin");
    std::fs::write(file, steradian::bsdf::bake_energy_tables())
}
