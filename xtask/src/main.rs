//! Tools of the developers: `cargo xtask NAME [ARGUMENT...]`, from anywhere in the repository.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

mod api;
mod bake_energy;
mod bench_scenes;
mod compare_refs;
mod eval_materials;
mod light_choice;
mod make_meshes;
mod make_textures;
mod make_vectors;
mod mutants;
mod texture_filtering;

type Outcome = Result<(), Box<dyn Error>>;

const USAGE: &str = "\
usage: cargo xtask NAME [ARGUMENT...]

  api                  the library's public interface: api.txt; with --check, whether that is up to date
  bake_energy          tables of microfacet albedos: src/bsdf/energy/tables.bin
  bench_scenes         meshes of benches/scenes
  compare_refs         compare renders with reference images: REFS [--spp N] [SCENE...]
  eval_materials       evaluate materials for pairs of directions, from JSON on standard input
  light_choice         compare light tree and power sampling at equal time: [SCENE.json] [--spp N] [--rounds N]
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

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let name = words.next().unwrap_or_default();
    let words: Vec<String> = words.collect();
    let outcome = match name.as_str() {
        "api" => api::run(&words),
        "bake_energy" => bake_energy::run(),
        "bench_scenes" => bench_scenes::run(),
        "compare_refs" => compare_refs::run(words),
        "eval_materials" => eval_materials::run(),
        "light_choice" => light_choice::run(words),
        "make_meshes" => make_meshes::run(),
        "make_textures" => make_textures::run(),
        "make_vectors" => make_vectors::run(),
        "mutants" => mutants::run(words),
        "texture_filtering" => {
            texture_filtering::run();
            Ok(())
        }
        "-h" | "--help" => {
            print!("{USAGE}");
            Ok(())
        }
        _ => {
            eprint!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask {name}: {error}");
            ExitCode::FAILURE
        }
    }
}
