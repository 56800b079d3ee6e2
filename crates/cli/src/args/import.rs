//! The command line of what reads scenes of other renderers.

use std::path::PathBuf;

use clap::Args;
use steradian::internal::import::ImportOptions;

use super::Verbosity;

/// How scenes of other renderers are read.
#[derive(Clone, Debug, Default, Args)]
pub struct ImportArgs {
    /// Mitsuba: set $NAME to VALUE; repeat for several
    #[
        arg(
            short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = parse_define,
            help_heading = "Import"
        )
    ]
    pub defines: Vec<(String, String)>,
    /// glTF: seconds into the animations
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true, help_heading = "Import")]
    pub time: f64,
    /// Write a report of every imported parameter as JSON to this file; - for stdout
    #[arg(long, value_name = "FILE", help_heading = "Import")]
    pub report: Option<PathBuf>,
    /// Fail with exit code 3 if anything of the file was approximated or ignored
    #[arg(long, help_heading = "Import")]
    pub strict: bool,
    /// Render without missing files: meshes and lights are left out, images and measured materials are grey, media are
    /// empty
    #[arg(long, help_heading = "Import")]
    pub allow_missing: bool,
}

impl ImportArgs {
    /// What readers need of the command line.
    pub fn options(&self) -> ImportOptions {
        ImportOptions { defines: self.defines.clone(), time: self.time }
    }
}

pub const CONVERT_EXAMPLES: &str = "\
Examples:
  steradian convert scene.pbrt scene.json          Writes scene.json, and its files into scene_files/
  steradian convert scene.glb out.json --report -  Reports every parameter
  steradian convert scene.xml out.json --link      Refers to the original meshes and images in place of copying them";

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// The scene to read: .xml (Mitsuba 3), .pbrt (pbrt-v4), .gltf, .glb, or .json
    pub input: PathBuf,
    /// The scene to write, .json
    pub output: PathBuf,
    /// Refer to the original meshes and images; only what has no file is written
    #[arg(long)]
    pub link: bool,
    #[command(flatten)]
    pub import: ImportArgs,
    #[command(flatten)]
    pub verbosity: Verbosity,
}

fn parse_define(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or_else(|| "expected NAME=VALUE".to_owned())?;
    let name = name.trim().trim_start_matches('$');
    if name.is_empty() { Err("expected NAME=VALUE".into()) } else { Ok((name.to_owned(), value.to_owned())) }
}
