//! The command line of `bench error`.

use std::path::PathBuf;

use clap::Args;
use steradian::desc::{AutoDesc, IntegratorDesc, SamplerKindDesc, StrategyDesc};
use steradian::internal::accel::AccelKind;
use steradian_bench::error::Peer;

use super::import::ImportArgs;
use super::{accel_help, parse_size};
use crate::names;

pub const ABOUT: &str = "\
Measure error against time: variants of a render, and other renderers, beside a reference

Renders the scene with every variant and every number of samples (or seconds), several times in turn, each time with \
another seed, and compares each picture with the reference: relMSE, MSE, FLIP, bias, NaN; samples and rays per second; \
how fast the error falls; the time that each variant takes to the same error.";

pub const EXAMPLES: &str = "\
Examples:
  steradian bench error cornell.json --reference cornell.exr --out report
      1 to 256 samples; report/error.html has plots and a viewer of differences, .md, .csv and .json the figures.
  steradian bench error cornell.json --reference cornell.exr --sampler sobol,independent --strategy mis,light
      Four variants side by side.
  steradian bench error cornell.json --times 1,2,4,8 --integrator path --clamp 10
      By time. Without a reference two renders of Steradian stand in.
  steradian bench error cornell.xml --reference cornell.exr --external 'mitsuba=mitsuba -m llvm_ad_rgb -Dspp={spp} -o \
{out} {scene}'
      Beside another program. {scene} and {out} come quoted for the shell; {seed} is there too, and {seconds} with \
--times. Its time is what it
      prints as JSON, as {\"render_seconds\": 1.5, \"processor_seconds\": 2.9}, else that of its whole process.
  steradian bench error scene.xml --reference scene.exr --peers --peer cycles=scene.blend --out report
      Beside Mitsuba, if it is installed, and Cycles, through their Python modules: time to equal error on one page.
  steradian bench error cornell.json --reference cornell.exr --spp 16 --tax
      How much of the time is tracing: the render's own rays, traced by bare calls of Embree.

How to read it: of two variants with slopes of about -1 the one with the higher efficiency is the better, by the ratio \
of the two; a mean ratio whose
interval leaves out 1 is a bias, or the reference's. Ctrl-C leaves what there is.";

/// Arguments of `bench error`.
#[derive(Debug, Args)]
pub struct BenchErrorArgs {
    /// The scene file: .json, .xml (Mitsuba 3), .pbrt (pbrt-v4), .gltf or .glb
    pub scene: PathBuf,
    /// The converged picture, an EXR file. Without it two renders by the first variant, with other seeds, stand in
    #[arg(long, value_name = "REF")]
    pub reference: Option<PathBuf>,
    /// Samples per pixel
    #[
        arg(
            long, value_name = "LIST", value_delimiter = ',', default_value = "1,4,16,64,256",
            value_parser = clap::value_parser!(u32).range(1..)
        )
    ]
    pub spp: Vec<u32>,
    /// Seconds, in place of samples per pixel
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse_seconds, conflicts_with = "spp")]
    pub times: Vec<f64>,
    /// Repetitions, each with another seed
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
    /// Also record all rays of a short render and trace them again by bare calls of Embree: how much of the time is
    /// tracing
    #[arg(long)]
    pub tax: bool,

    /// The algorithm; several for as many variants
    #[
        arg(
            long, value_name = "LIST", value_delimiter = ',', value_parser = names::tagged::<IntegratorDesc>(),
            help_heading = "Variants"
        )
    ]
    pub integrator: Vec<IntegratorDesc>,
    /// Sampler: how samples are chosen
    #[
        arg(
            long, value_name = "LIST", value_delimiter = ',', value_parser = names::plain::<SamplerKindDesc>(),
            help_heading = "Variants"
        )
    ]
    pub sampler: Vec<SamplerKindDesc>,
    /// Light sampling: by lights, by materials, or both weighted by multiple importance sampling
    #[
        arg(
            long, value_name = "LIST", value_delimiter = ',', value_parser = names::plain::<StrategyDesc>(),
            help_heading = "Variants"
        )
    ]
    pub strategy: Vec<StrategyDesc>,
    /// Path guiding: sample directions by the incident radiance learned from earlier paths
    #[
        arg(
            long, value_name = "LIST", value_delimiter = ',', value_parser = names::plain::<AutoDesc>(),
            help_heading = "Variants"
        )
    ]
    pub guiding: Vec<AutoDesc>,
    /// Ray accelerator
    #[arg(long, value_name = "LIST", value_delimiter = ',', long_help = accel_help(), help_heading = "Variants")]
    pub accel: Vec<AccelKind>,
    /// Another program, by a command that writes {out}; repeat for several
    #[arg(long, value_name = "NAME=COMMAND", value_parser = parse_external, help_heading = "Variants")]
    pub external: Vec<(String, String)>,
    /// Only other programs: those of --external, --peer and --peers
    #[arg(long, requires = "reference", help_heading = "Variants")]
    pub only_external: bool,
    /// Another renderer: mitsuba, cycles or luxcore; repeat for several
    ///
    /// It runs through its Python module (`pip install mitsuba`, `bpy` or `pyluxcore`) on FILE, its own form of the
    /// scene: mitsuba reads .xml, cycles .blend, .gltf and .glb, luxcore .cfg. FILE defaults to the scene. Times are
    /// those of the render alone, without loading and compiling.
    #[arg(long = "peer", value_name = "NAME[=FILE]", value_parser = parse_peer, help_heading = "Variants")]
    pub peers: Vec<(Peer, Option<PathBuf>)>,
    /// Every renderer of --peer that is installed and reads the scene
    #[arg(long = "peers", help_heading = "Variants")]
    pub all_peers: bool,
    /// The Python interpreter that has their modules
    #[arg(long, value_name = "PROGRAM", default_value = "python3", help_heading = "Variants")]
    pub python: PathBuf,

    /// Width and height in pixels, such as 1920x1080
    #[arg(long, value_name = "WxH", value_parser = parse_size, help_heading = "Render")]
    pub size: Option<[u32; 2]>,
    /// Largest number of segments from the camera
    #[arg(long, value_name = "N", help_heading = "Render")]
    pub max_depth: Option<u32>,
    /// Clamp the contribution of a single path of indirect light
    #[arg(long, value_name = "LIMIT", help_heading = "Render")]
    pub clamp: Option<f32>,
    /// Number of threads; 0 means all
    #[arg(long, value_name = "N", help_heading = "Render")]
    pub threads: Option<usize>,
    /// Seed of the noise, in the first repetition
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Render")]
    pub seed: u64,

    /// Folder for the report: error.html, error.md, error.csv and error.json; without it tables go to stdout
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Print JSON instead of tables; without --out
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Print only errors; results go to stdout
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,
    #[command(flatten)]
    pub import: ImportArgs,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.trim().parse::<f64>().ok().filter(|seconds| (1e-3..=1e6).contains(seconds));
    seconds.ok_or_else(|| "expected seconds, from 0.001 to 1e6".to_owned())
}

fn parse_peer(text: &str) -> Result<(Peer, Option<PathBuf>), String> {
    let (name, file) = text.split_once('=').map_or((text, None), |(name, file)| (name, Some(PathBuf::from(file))));
    match Peer::ALL.into_iter().find(|peer| peer.name() == name.trim()) {
        Some(peer) => Ok((peer, file)),
        None => Err("expected mitsuba, cycles or luxcore, as NAME or NAME=FILE".to_owned()),
    }
}

fn parse_external(text: &str) -> Result<(String, String), String> {
    let (name, command) = text.split_once('=').ok_or_else(|| "expected NAME=COMMAND".to_owned())?;
    let (name, command) = (name.trim(), command.trim());
    if name.is_empty() || command.is_empty() {
        Err("expected NAME=COMMAND".into())
    } else {
        Ok((name.to_owned(), command.to_owned()))
    }
}
