//! The command line of `bench scale`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use steradian::internal::accel::AccelKind;
use steradian_bench::scale::SWEEPS;

use super::{accel_help, parse_size};

pub const ABOUT: &str = "\
Measure time and memory as pictures and scenes grow

Renders scenes that it makes itself, with more and more pixels, samples, triangles (up to 20 million, all different), \
instances, lights, segments of paths, layers and threads: seconds to load, to build and to the first picture, samples \
per second, bytes of meshes, accelerator and film, and the most memory that the process held. The exponent of a power \
law is fitted to each cost.";

pub const EXAMPLES: &str = "\
Examples:
  steradian bench scale --out scale              Everything: scale.html with plots, scale.md, scale.csv, scale.json; \
about 5 minutes of two cores, 3 GB
  steradian bench scale --quick                  Up to 1 million triangles: a minute or two
  steradian bench scale threads --repeat 5       One sweep

Every case runs in a process of its \
own, so that the most memory it held
is its own. Ctrl-C ends the case under way and reports what there is.";

/// Arguments of `bench scale`.
#[derive(Debug, Args)]
pub struct BenchScaleArgs {
    /// The sweeps to run. Default: all, one after another
    #[arg(value_name = "SWEEP", value_parser = sweeps())]
    pub sweeps: Vec<String>,
    /// Take less time: smaller scenes and pictures
    #[arg(long)]
    pub quick: bool,
    /// Repetitions, all cases in turn
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
    /// Width and height in pixels. Default: 512x512, 128x128 with --quick
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub spp: u32,
    /// Number of threads; 0 means all
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub threads: u32,
    /// The most triangles. Default: 20e6, 1e6 with --quick
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub triangles: Option<usize>,
    /// The most lights. Default: 1e5, 1e4 with --quick
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub lights: Option<usize>,
    /// The most instances. Default: 1e5, 1e4 with --quick
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub instances: Option<usize>,
    /// Ray accelerator
    #[arg(long, value_name = "NAME", default_value = "embree", long_help = accel_help())]
    pub accel: AccelKind,
    /// Folder for the report: scale.html, scale.md, scale.csv and scale.json; without it tables go to stdout
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON instead of tables; without --out
    #[arg(long)]
    pub json: bool,
    /// Print only errors; results go to stdout
    #[arg(short, long)]
    pub quiet: bool,
}

/// The names of all sweeps, each with what it is over.
fn sweeps() -> PossibleValuesParser {
    PossibleValuesParser::new(SWEEPS.iter().map(|(name, over)| PossibleValue::new(*name).help(*over)))
}

fn parse_count(text: &str) -> Result<usize, String> {
    let number = text.trim().parse::<f64>().ok().filter(|n| (1.0..=1e9).contains(n));
    number.map(|n| n as usize).ok_or_else(|| "expected a number from 1 to 1e9, such as 20000 or 2e4".to_owned())
}
