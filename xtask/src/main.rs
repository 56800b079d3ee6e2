//! Tools of the developers: `cargo xtask NAME [ARGUMENT...]`, from anywhere in the repository.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

mod api;
#[cfg(feature = "tools")]
mod bake_energy;
#[cfg(feature = "tools")]
mod bench_scenes;
#[cfg(feature = "tools")]
mod compare_refs;
#[cfg(feature = "tools")]
mod eval_materials;
#[cfg(feature = "tools")]
mod make_meshes;
#[cfg(feature = "tools")]
mod make_textures;
#[cfg(feature = "tools")]
mod make_vectors;
#[cfg(feature = "tools")]
mod mutants;
#[cfg(feature = "tools")]
mod texture_filtering;

type Outcome = Result<(), Box<dyn Error>>;

const USAGE: &str = "\
usage: cargo xtask NAME [ARGUMENT...]

  api                  the library's public interface: api.txt; with --check, whether that is up to date
  bake_energy          tables of microfacet albedos: src/bsdf/energy/tables.bin
  bench_scenes         meshes of benches/scenes
  compare_refs         compare renders with reference images: REFS [--spp N] [SCENE...]
  eval_materials       evaluate materials for pairs of directions, from JSON on standard input
  make_meshes          meshes and sky of scenes/, and scenes/shrine.json
  make_textures        textures of scenes/
  make_vectors         exact test vectors of shapes: crates/bench/src/stability/vectors
  mutants              inject faults, check that tests find them: [NAME...]
  texture_filtering    error and time of texture lookups
";

/// The folder of the main package.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// What needs the library or other crates; nothing if no tool has this name.
#[cfg(feature = "tools")]
fn run_tool(name: &str, words: Vec<String>) -> Option<Outcome> {
    Some(match name {
        "bake_energy" => bake_energy::run(),
        "bench_scenes" => bench_scenes::run(),
        "compare_refs" => compare_refs::run(words),
        "eval_materials" => eval_materials::run(),
        "make_meshes" => make_meshes::run(),
        "make_textures" => make_textures::run(),
        "make_vectors" => make_vectors::run(),
        "mutants" => mutants::run(words),
        "texture_filtering" => {
            texture_filtering::run();
            Ok(())
        }
        _ => return None,
    })
}

#[cfg(not(feature = "tools"))]
fn run_tool(_: &str, _: Vec<String>) -> Option<Outcome> {
    None
}

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let name = words.next().unwrap_or_default();
    let words: Vec<String> = words.collect();
    let outcome = match name.as_str() {
        "api" => Some(api::run(&words)),
        "-h" | "--help" => {
            print!("{USAGE}");
            Some(Ok(()))
        }
        _ => run_tool(&name, words),
    };
    match outcome {
        Some(Ok(())) => ExitCode::SUCCESS,
        Some(Err(error)) => {
            eprintln!("xtask {name}: {error}");
            ExitCode::FAILURE
        }
        None => {
            eprint!("{USAGE}");
            ExitCode::from(2)
        }
    }
}
