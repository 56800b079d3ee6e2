//! The command line of `bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use steradian::internal::accel::AccelKind;

use super::import::ImportArgs;
use super::{accel_help, bench_error, bench_scale, parse_size};

const BENCH_REPORTS_ABOUT: &str = "\
Reproduce the comparisons of linear loops, octree, kd-tree and BVH in course reports, and explain the ratios

Three pictures of normals on one thread: a head of 968 triangles (\"120 s linear, 3.5 s octree, 0.5 s Embree\"), a \
mesh of 1,000 triangles (\"kd-tree about 10 times faster\"), one of 70,000 (\"BVH 17.61 times faster\"). Each is drawn \
with the accelerators as the reports wrote them, with Steradian's and with Embree. Where every triangle is tested, a \
smaller picture is timed and its time scaled up, unless --full is given.";

const BENCH_ACCEL_EXAMPLES: &str = "\
Examples:
  steradian bench accel scenes/cornell.json
      All accelerators on the scene's own rays, as tables on stdout.
  steradian bench accel scenes/*.json --accel embree,embree:high,bvh,kdtree --out report
      Several scenes; report/accel.html has plots, .md, .csv and .json the same figures.
  steradian bench accel --scaling 1e3..1e7 --accel embree,bvh,kdtree,octree --out growth
      Cost over the number of triangles of a generated mesh.
  steradian bench accel scene.json --accel linear,embree --ray=0,0,5,0,0,-1
      The hit of each accelerator for one ray: origin, direction, and optionally t_min, t_max, time.

Rays are recorded once from a render of the scene with one sample a pixel: camera, shadow (any hit), first bounce, \
deep bounce, ambient occlusion
(any hit). Every accelerator traces the very same rays, in turn, round after round. Hits are compared with those of \
linear.
Ctrl-C ends after the present step and reports what there is.";

/// What to measure.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Compare accelerators on the same rays
    #[command(after_help = BENCH_ACCEL_EXAMPLES)]
    Accel(BenchAccelArgs),
    /// Measure error against time: variants of a render, and other renderers, beside a reference
    #[command(long_about = bench_error::ABOUT, after_help = bench_error::EXAMPLES)]
    Error(Box<bench_error::BenchErrorArgs>),
    /// Reproduce the comparisons of linear loops, octree, kd-tree and BVH in course reports, and explain the ratios
    #[command(long_about = BENCH_REPORTS_ABOUT)]
    Reports(BenchReportsArgs),
    /// Measure time and memory as pictures and scenes grow
    #[command(long_about = bench_scale::ABOUT, after_help = bench_scale::EXAMPLES)]
    Scale(bench_scale::BenchScaleArgs),
    /// One case of `scale`, as JSON on standard input
    #[command(hide = true, name = crate::bench_scale::ONE_CASE)]
    ScaleCase,
    /// Check numerical stability: every check with its criterion and what was measured
    #[command(long_about = BENCH_STABILITY_ABOUT, after_help = BENCH_STABILITY_EXAMPLES)]
    Stability(BenchStabilityArgs),
}

const BENCH_STABILITY_ABOUT: &str = "\
Check numerical stability: every check with its criterion and what was measured.

Shapes from a thousandth to a million radii away, rays that leave surfaces of every size anywhere, closed meshes that \
must not leak, accelerators against testing everything, sampled directions against their densities, lights, cameras \
and films against closed forms. A check that falls short gives the reason; one that fails ends the run with exit code \
1 and leaves pictures of what it found in DIR/evidence.";

const BENCH_STABILITY_EXAMPLES: &str = "\
Examples:
  steradian bench stability --out stability      All checks: stability.html with plots, stability.md, stability.json
  steradian bench stability --quick              The same checks with fewer samples, as the tests run them
  steradian bench stability A3 B                 One check and one group

Ctrl-C ends after the present check and reports what there is; with --resume the next run takes it up.";

/// Arguments of `bench stability`.
#[derive(Debug, Args)]
pub struct BenchStabilityArgs {
    /// Checks (A3) or groups of checks (B). Default: all
    #[arg(value_name = "ID")]
    pub checks: Vec<String>,
    /// Take less time: fewer rays and samples, about a second a check
    #[arg(long)]
    pub quick: bool,
    /// List the checks and run none
    #[arg(long)]
    pub list: bool,
    /// Folder for the report: stability.html, stability.md and stability.json; without it the table goes to stdout
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Continue an interrupted run: keep what it left in DIR, if it was of the same program
    #[arg(long, requires = "out")]
    pub resume: bool,
    /// Print JSON instead of a table; without --out
    #[arg(long)]
    pub json: bool,
    /// Print only errors; results go to stdout
    #[arg(short, long)]
    pub quiet: bool,
}

/// Arguments of `bench reports`.
#[derive(Debug, Args)]
pub struct BenchReportsArgs {
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1200x800", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Rounds of measurement: frames of each accelerator
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Render full frames even where every triangle is tested: hours in place of seconds
    #[arg(long)]
    pub full: bool,
    /// Folder for the report: reports.html, reports.md and reports.json; without it tables go to stdout
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON instead of tables; without --out
    #[arg(long)]
    pub json: bool,
    /// Print only errors; results go to stdout
    #[arg(short, long)]
    pub quiet: bool,
}

/// Arguments of `bench accel`.
#[derive(Debug, Args)]
pub struct BenchAccelArgs {
    /// Scene files
    pub scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub import: ImportArgs,
    /// Ray accelerator, with options such as embree:high. Default: all, with their default options
    #[arg(long, value_name = "LIST", value_delimiter = ',', long_help = accel_help())]
    pub accel: Vec<AccelKind>,
    /// Rays of each kind, about
    #[
        arg(
            long, value_name = "N", default_value_t = 250_000,
            value_parser = clap::value_parser!(u32).range(16..=100_000_000)
        )
    ]
    pub rays: u32,
    /// Number of threads; several one after another. Default: 1 and all
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Vec<u32>,
    /// Rounds of measurement, after one that warms up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Also measure a generated mesh with growing numbers of triangles, such as 1e3..1e7
    #[arg(long, value_name = "FROM..TO", value_parser = parse_range)]
    pub scaling: Option<[usize; 2]>,
    /// Folder for the report: accel.html, accel.md, accel.csv and accel.json; without it tables go to stdout
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON instead of tables; without --out
    #[arg(long)]
    pub json: bool,
    /// Trace only this ray and print each accelerator's hit
    #[arg(long, value_name = "OX,OY,OZ,DX,DY,DZ[,TMIN[,TMAX[,TIME]]]", allow_hyphen_values = true)]
    pub ray: Option<String>,
    /// Print only errors; results go to stdout
    #[arg(short, long)]
    pub quiet: bool,
}

fn parse_range(text: &str) -> Result<[usize; 2], String> {
    let number = |word: &str| word.trim().parse::<f64>().ok().filter(|n| (100.0..=1e9).contains(n)).map(|n| n as usize);
    let ends = text.split_once("..").and_then(|(from, to)| Some([number(from)?, number(to)?]));
    ends.filter(|[from, to]| from <= to)
        .ok_or_else(|| "expected two numbers of triangles from 100 to 1e9, such as 1e3..1e7".to_owned())
}
