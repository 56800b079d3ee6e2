//! The command line.

#[cfg(feature = "bench")]
mod bench;
#[cfg(feature = "bench")]
mod bench_error;
#[cfg(feature = "bench")]
mod bench_scale;
mod config;
mod denoise;
mod exr;
mod farm;
mod frames;
mod import;
mod live;
mod log;
mod opposites;
mod state;
mod texts;
mod values;
mod view;

use std::path::PathBuf;

use clap::{ArgAction, Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use steradian::desc::{AutoDesc, CausticsDesc, IntegratorDesc, RouletteDesc, SamplerKindDesc, StrategyDesc, ViewDesc};
use steradian::internal::accel::AccelKind;
use steradian::internal::render::{ExrOverrides, Overrides};
use steradian::{Assignment, ExrChanges};

use crate::names::{self, Layers};
use crate::rerender::Repeat;
#[cfg(feature = "bench")]
pub use bench::{BenchAccelArgs, BenchCommand, BenchReportsArgs, BenchStabilityArgs};
#[cfg(feature = "bench")]
pub use bench_error::BenchErrorArgs;
#[cfg(feature = "bench")]
pub use bench_scale::BenchScaleArgs;
pub use config::{ConfigCommand, ConfigShowArgs};
pub use denoise::{DenoiseArgs, RenderDenoiseArgs};
pub use exr::{CheckExrArgs, RerenderArgs};
pub use farm::{FarmCommand, JobArgs, SlurmArgs};
pub use frames::SequenceArgs;
pub use import::{ConvertArgs, ImportArgs};
pub use log::{ColorChoice, LogArgs, LogFormat};
pub use opposites::opposite;
use state::MERGE_EXAMPLES;
pub use state::{MergeArgs, StateArgs};
pub use texts::FIRST_STEPS;
use texts::{EXAMPLES, RENDER_EXAMPLES, RENDER_SHORT_EXAMPLES};
use values::{accel_help, parse_list, parse_size};
pub use view::ViewArgs;

/// Options of `render` that `-h` shows; `--help` shows all.
const COMMON_OPTIONS: [&str; 21] = [
    "scene",
    "output",
    "spp",
    "target_error",
    "size",
    "crop",
    "layers",
    "exposure",
    "denoise",
    "integrator",
    "max_depth",
    "seed",
    "accel",
    "threads",
    "time_limit",
    "stats",
    "checkpoint",
    "resume",
    "preview",
    "frames",
    "overwrite",
];

/// The command line as it is parsed: the options that few need are absent from `-h`, and switches have opposites.
pub fn command_line() -> clap::Command {
    Cli::command().mut_subcommand("render", |render| {
        opposites::added(render).mut_args(|arg| {
            let is_common = ["quiet", "verbose", "help"].iter().chain(&COMMON_OPTIONS).any(|id| arg.get_id() == *id);
            arg.hide_short_help(!is_common)
        })
    })
}

/// A fast, accurate CPU renderer.
#[derive(Debug, Parser)]
#[command(name = "steradian", version, about, after_help = EXAMPLES, max_term_width = 120)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub log: LogArgs,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to files
    #[command(after_help = RENDER_SHORT_EXAMPLES, after_long_help = RENDER_EXAMPLES)]
    Render(Box<RenderArgs>),
    /// Check a scene and print what is in it and what it will cost
    ///
    /// Loads the scene with everything it names and prints size, samples, camera, bounds, counts, features, the number
    /// of camera rays and the memory of geometry, voxels and film. A scene that has info without an error renders
    /// without an error. Of a .vdb or .nvdb file, prints the names and types of its grids.
    Info(InfoArgs),
    /// Turn a scene of another renderer into the JSON format, with its meshes and images beside it
    #[command(after_help = import::CONVERT_EXAMPLES)]
    Convert(ConvertArgs),
    /// Print the JSON Schema of scene files
    ///
    /// Editors check and complete scenes with it: save it and name it in the scene's "$schema".
    #[command(after_help = "Example:\n  steradian schema > scene.schema.json")]
    Schema {
        /// Write Markdown pages into this folder instead: the manual of the scene format
        #[arg(long, value_name = "DIR")]
        markdown: Option<PathBuf>,
    },
    /// Merge shards into the picture
    ///
    /// Shards are what `render --shard` writes. All of them together are the picture of one run bit for bit, in every
    /// layer.
    #[command(after_help = MERGE_EXAMPLES)]
    Merge(MergeArgs),
    /// Check EXR files against what the programs that read them expect
    ///
    /// Names every rule that a file breaks, what reads it wrongly, and how to fix it. docs/exr.md lists the rules.
    #[command(after_help = exr::CHECK_EXAMPLES)]
    CheckExr(CheckExrArgs),
    /// Render the picture of an EXR file again
    ///
    /// The file names its scene with all settings; the picture is the same bit for bit. A scene or file of it that has
    /// changed is an error that names it. No other path or address in the file is loaded, written or connected to.
    #[command(after_help = exr::RERENDER_EXAMPLES)]
    Rerender(RerenderArgs),
    /// Print the values of one sample of one pixel
    ///
    /// The sample is computed as the render with the same options computes it, bit for bit; nothing is written.
    #[command(after_help = "Example:\n  steradian replay cornell.json 120,80 7 --integrator whitted")]
    Replay(ReplayArgs),
    /// Compare a picture with its reference
    ///
    /// Both are EXR files; the linear colour is compared. mse is the mean of (test - reference)², relmse that of
    /// (test - reference)² / (reference² + 0.01), relmse trimmed the same without the worst thousandth of the pixels,
    /// psnr relates mse to the reference's peak, mean ratio is the test's mean over the reference's.
    #[command(after_help = "Example:\n  steradian compare reference.exr test.exr --json | jq .relmse")]
    Compare(CompareArgs),
    /// Show one or two EXR files in the browser
    ///
    /// Serves a page to this machine alone, prints its address, and opens it with xdg-open. The page shows every layer,
    /// with exposure, views, zoom and the exact values of pixels; of two pictures it shows one, the other, both under a
    /// slider, or a map of how much they seem to differ (HDR-FLIP). Ctrl-C ends it.
    #[command(after_help = view::EXAMPLES)]
    View(ViewArgs),
    /// Write jobs for render farms
    #[command(subcommand)]
    Farm(FarmCommand),
    /// Denoise an EXR file with Intel Open Image Denoise
    #[command(long_about = denoise::ABOUT, after_help = denoise::EXAMPLES)]
    Denoise(DenoiseArgs),
    /// Measure speed, error, scaling and numerical stability
    #[cfg(feature = "bench")]
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Benchmarks: unsupported by this program, which was built without the feature `bench`
    #[cfg(not(feature = "bench"))]
    #[command(hide = true)]
    Bench {
        /// Arguments of the benchmark
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
        arguments: Vec<String>,
    },
    /// Show the settings of the environment and of configuration files
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Print the manual page, or write those of all commands into a folder
    #[command(after_help = "Example:\n  steradian man --dir ~/.local/share/man/man1")]
    Man {
        /// Folder to write to: the manual pages of all commands
        #[arg(long, value_name = "DIR")]
        dir: Option<PathBuf>,
        /// Write Markdown pages into this folder instead: the reference of all commands
        #[arg(long, value_name = "DIR", conflicts_with = "dir")]
        markdown: Option<PathBuf>,
    },
    /// Print completions for a shell
    #[command(
        after_help = "Example:\n  steradian completions bash > ~/.local/share/bash-completion/completions/steradian"
    )]
    Completions {
        /// The shell.
        shell: Shell,
    },
}

/// Arguments of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// The scene file: .json, .xml (Mitsuba 3), .pbrt (pbrt-v4), .gltf or .glb
    pub scene: PathBuf,

    /// File to write, .exr or .png; repeat for several. Replaces the scene's "outputs"
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<String>,

    /// Samples per pixel
    #[arg(short = 's', long, value_name = "N", help_heading = "Picture")]
    pub spp: Option<u32>,
    /// Render until the picture's relative squared error is below this, with samples where they are needed
    ///
    /// The error is the mean of (picture - truth)² / (truth² + 0.01) over pixels and channels, as far as the samples
    /// show it: 0.01 is a rough picture, 0.001 a good one. The render ends when the error is below the target by two
    /// standard deviations; --spp is then the most samples of a pixel. Store the layers "variance" and "samples" to see
    /// where they went.
    #[arg(long, value_name = "ERROR", help_heading = "Picture")]
    pub target_error: Option<f64>,
    /// Width and height in pixels, such as 1920x1080
    #[arg(long, value_name = "WxH", value_parser = parse_size, help_heading = "Picture")]
    pub size: Option<[u32; 2]>,
    /// Render only this part, in pixels from the upper left corner
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_list::<u32, 4>, help_heading = "Picture")]
    pub crop: Option<[u32; 4]>,
    /// Render this many pixels more on each side: EXR files hold them around the picture (their data window), PNG files
    /// do not
    #[arg(long, value_name = "PIXELS", help_heading = "Picture")]
    pub overscan: Option<u32>,
    /// EXR: layers (AOVs) to store beside the picture; `all` for every one
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', value_parser = names::layers(), help_heading = "Picture")]
    pub layers: Vec<Layers>,
    /// EXR: store 32-bit floats instead of 16-bit ones
    #[arg(long, help_heading = "Picture")]
    pub float: bool,
    /// The opposite of --float
    #[arg(long, hide = true)]
    pub no_float: bool,
    /// EXR files: set keys of the scene's outputs, such as profile=nuke,compression=piz; repeat for more
    #[arg(long, value_name = "KEY=VALUE,...", long_help = exr::exr_help(), help_heading = "Picture")]
    pub exr: Vec<ExrChanges>,
    /// PNG: exposure in stops; 1 is twice as bright
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, help_heading = "Picture")]
    pub exposure: Option<f32>,
    /// PNG: how light becomes colours of the display; EXR files stay linear
    ///
    /// agx shows 16.5 stops and lets bright colours tend to white, filmic is the curve of Uncharted 2, srgb is the sRGB
    /// curve alone: 1 is white. Default: the scene's; else agx, or srgb with integrators that show data, such as
    /// normal.
    #[arg(long, value_name = "NAME", value_parser = names::plain::<ViewDesc>(), help_heading = "Picture")]
    pub view: Option<ViewDesc>,

    /// The algorithm
    #[arg(long, value_name = "NAME", value_parser = names::tagged::<IntegratorDesc>(), help_heading = "Algorithm")]
    pub integrator: Option<IntegratorDesc>,
    /// Largest number of segments from the camera; 1 shows only directly visible light
    #[arg(long, value_name = "N", help_heading = "Algorithm")]
    pub max_depth: Option<u32>,
    /// Light sampling: by lights, by materials, or both weighted by multiple importance sampling
    #[arg(long, value_name = "NAME", value_parser = names::plain::<StrategyDesc>(), help_heading = "Algorithm")]
    pub strategy: Option<StrategyDesc>,
    /// Russian roulette: auto, throughput, shadow_rays or off
    ///
    /// auto: paths and shadow rays by expected contribution to the pixel and cost, both estimated from a pilot of 1/8
    /// sample per pixel; shadow_rays: shadow rays alone, by the same estimates; throughput: paths by throughput, from
    /// depth 5 or a smaller rr_depth of the scene; off: none. All are unbiased. Default: the scene's setting; without
    /// one, auto; with rr_depth, throughput, or shadow_rays if rr_depth >= max_depth - 1 and max_depth > 6
    #[arg(long, value_name = "NAME", value_parser = names::plain::<RouletteDesc>(), help_heading = "Algorithm")]
    pub roulette: Option<RouletteDesc>,
    /// Clamp the contribution of a single path of indirect light: less noise, but biased (too dark). Off by default;
    /// inf for no limit
    #[arg(long, value_name = "LIMIT", help_heading = "Algorithm")]
    pub clamp: Option<f32>,
    /// Make surfaces that a path meets after a rough one at least as rough as this alpha, falling with the samples:
    /// less noise of caustics, but biased. Off by default; 0 for off
    #[arg(long, value_name = "ALPHA", help_heading = "Algorithm")]
    pub regularize: Option<f32>,
    /// Caustics, the light that mirrors, metal and glass throw on other surfaces: auto, paths or photons
    ///
    /// Photons blur them a little, less with more samples. auto: if a pilot shows that this pays; from 16 samples on.
    /// photons: of point lights too; not with --guiding, --guide, --target-error or --regularize. Default: auto
    #[arg(long, value_name = "NAME", value_parser = names::plain::<CausticsDesc>(), help_heading = "Algorithm")]
    pub caustics: Option<CausticsDesc>,
    /// Bidirectional path tracing: connect paths to paths from the lights
    ///
    /// Less noise of lamps that shine at walls and shades. auto: if a pilot shows that this outweighs the cost; never
    /// below 16 samples per pixel. Not with --caustics photons or what that excludes. Default: auto; without NAME: on
    #[arg(
        long, value_name = "NAME", num_args = 0..=1, default_missing_value = "on",
        value_parser = names::plain::<AutoDesc>(), help_heading = "Algorithm"
    )]
    pub bidirectional: Option<AutoDesc>,
    /// Path guiding: sample directions by the incident radiance learned from earlier paths
    ///
    /// For scenes whose light comes by few ways, such as through a door ajar. auto: if a pilot, and samples with and
    /// without it, show that it lowers the error by more than it costs; never below 128 samples per pixel, with
    /// --target-error, with --shard or with photons. on: from the second sample on, as long as it pays. Iterations
    /// double; each is guided by the samples of those before, and weighted by its inverse variance. With --checkpoint
    /// and --resume the picture is the same bit for bit. on is unsupported with --shard: each part would have to render
    /// nearly all samples to train the guide; --guide uses a trained one. Without NAME: on. Default: the scene's
    /// setting, or auto
    #[arg(
        long, value_name = "NAME", num_args = 0..=1, default_missing_value = "on",
        value_parser = names::plain::<AutoDesc>(), help_heading = "Algorithm"
    )]
    pub guiding: Option<AutoDesc>,
    /// As --guiding off
    #[arg(long, hide = true, overrides_with = "guiding")]
    pub no_guiding: bool,
    /// Guide paths by what another render has learned: the --checkpoint of one with --guiding
    ///
    /// The guide is not trained further, whatever --guiding says. Samples then depend on it alone, so that --shard,
    /// --pixel, --target-error and --resume with more samples work as without guiding. The scene, the camera and the
    /// settings may be others than those it was trained with: the picture stays right, and is the less noisy the more
    /// alike the light is.
    #[arg(long, value_name = "FILE", help_heading = "Algorithm")]
    pub guide: Option<PathBuf>,
    /// Set a key of the scene's film, sampler or integrator, such as integrator.clamp=10; repeat for several
    ///
    /// Keys and values are those of the scene format (`steradian schema`). The picture's EXR file holds them, for
    /// `steradian rerender`. Options of their own, such as --spp, take precedence.
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Algorithm")]
    pub set: Vec<Assignment>,
    /// Sampler: how samples are chosen
    #[arg(long, value_name = "NAME", value_parser = names::plain::<SamplerKindDesc>(), help_heading = "Algorithm")]
    pub sampler: Option<SamplerKindDesc>,
    /// Seed of the noise
    #[arg(long, value_name = "N", help_heading = "Algorithm")]
    pub seed: Option<u64>,
    /// Render everything in focus, as if the camera had no lens
    #[arg(long, help_heading = "Picture")]
    pub no_depth_of_field: bool,
    /// Do not show the background to the camera: alpha is 0 there
    #[arg(long, help_heading = "Picture")]
    pub transparent: bool,
    /// The opposite of --transparent
    #[arg(long, hide = true)]
    pub no_transparent: bool,
    /// Ray accelerator: auto, embree, packets, hybrid, bvh, kdtree, octree or linear, with options such as embree:high
    #[arg(long, value_name = "NAME", long_help = accel_help(), help_heading = "Algorithm")]
    pub accel: Option<AccelKind>,

    /// Number of threads; 0 means all. The picture does not depend on it
    #[arg(short = 't', long, value_name = "N", help_heading = "Run")]
    pub threads: Option<usize>,
    /// Stop after this time, with the samples so far
    #[arg(long, value_name = "SECONDS", help_heading = "Run")]
    pub time_limit: Option<f64>,
    /// Write statistics as JSON to this file; - for stdout
    // Scripts know it by its earlier name.
    #[arg(long, alias = "json", value_name = "FILE", help_heading = "Run")]
    pub stats: Option<PathBuf>,
    /// Replay samples of this pixel alone and print their values; nothing is written
    #[arg(long, value_name = "X,Y", value_parser = parse_list::<u32, 2>, requires = "sample", hide = true)]
    pub pixel: Option<[u32; 2]>,
    /// The sample to replay, counted from 0
    #[arg(long, value_name = "I", requires = "pixel", hide = true)]
    pub sample: Option<u32>,
    /// A picture to be made again.
    #[arg(skip)]
    pub repeat: Option<Box<Repeat>>,
    #[command(flatten)]
    pub state: StateArgs,
    #[command(flatten)]
    pub live: live::LiveArgs,
    #[command(flatten)]
    pub sequence: SequenceArgs,
    #[command(flatten)]
    pub denoise: RenderDenoiseArgs,
    #[command(flatten)]
    pub import: ImportArgs,
    #[command(flatten)]
    pub verbosity: Verbosity,
}

/// The verbosity of messages on stderr.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct Verbosity {
    /// Print only errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Run")]
    pub quiet: bool,
    /// Print more messages; repeat for even more
    #[arg(short, long, action = ArgAction::Count, help_heading = "Run")]
    pub verbose: u8,
}

/// Arguments of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The scene file: .json, .xml (Mitsuba 3), .pbrt (pbrt-v4), .gltf or .glb; or a .vdb or .nvdb file
    pub scene: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub import: ImportArgs,
    #[command(flatten)]
    pub verbosity: Verbosity,
}

/// Arguments of `replay`, which is `render` with `--pixel` and `--sample`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The scene file
    pub scene: PathBuf,
    /// The pixel, from the upper left corner
    #[arg(value_name = "X,Y")]
    pub pixel: String,
    /// The sample, counted from 0
    #[arg(value_name = "I")]
    pub sample: u32,
    /// Options of the render, as of `steradian render`
    #[arg(value_name = "OPTIONS", trailing_var_arg = true, allow_hyphen_values = true)]
    pub options: Vec<String>,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The reference, an EXR file
    pub reference: PathBuf,
    /// The picture to judge, an EXR file of the same size
    pub test: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

impl Command {
    /// The verbosity, where a command has options for it.
    pub fn verbosity(&self) -> Verbosity {
        let only = |quiet: bool| Verbosity { quiet, verbose: 0 };
        match self {
            Self::Render(arguments) => arguments.verbosity,
            Self::Info(arguments) => arguments.verbosity,
            Self::Merge(arguments) => only(arguments.quiet),
            Self::Rerender(arguments) => only(arguments.quiet),
            Self::Denoise(arguments) => only(arguments.quiet),
            Self::Convert(arguments) => arguments.verbosity,
            _ => Verbosity::default(),
        }
    }

    /// Messages are JSON where progress is, unless --log-format selects another form.
    pub fn log_format(&self) -> LogFormat {
        let progress = if let Self::Render(arguments) = self { arguments.sequence.progress } else { None };
        if progress.is_some_and(|format| format.name == "json") { LogFormat::Json } else { LogFormat::Text }
    }
}

impl RenderArgs {
    /// What the settings need of the command line.
    pub fn overrides(&self, default_outputs: Vec<String>) -> Overrides {
        Overrides {
            spp: self.spp,
            target_error: self.target_error,
            size: self.size,
            crop: self.crop,
            overscan: self.overscan,
            threads: self.threads,
            seed: self.seed,
            integrator: self.integrator,
            accel: self.accel,
            sampler: self.sampler,
            no_depth_of_field: self.no_depth_of_field,
            transparent: switch(self.transparent, self.no_transparent),
            max_depth: self.max_depth,
            strategy: self.strategy,
            roulette: self.roulette,
            clamp: self.clamp,
            regularize: self.regularize,
            caustics: self.caustics,
            bidirectional: self.bidirectional,
            guiding: if self.no_guiding { Some(AutoDesc::Off) } else { self.guiding },
            guide: None,
            time_limit: self.time_limit,
            outputs: self.output.clone(),
            default_outputs,
            layers: self.layers.iter().flat_map(|layers| layers.list()).collect(),
            float: switch(self.float, self.no_float),
            exr: ExrOverrides {
                frames_per_second: self.sequence.frames.is_some().then_some(self.sequence.fps),
                ..ExrChanges::merged(&self.exr)
            },
            exposure: self.exposure,
            view: self.view,
        }
    }
}

/// What a switch and its opposite set: nothing if neither was given.
fn switch(on: bool, off: bool) -> Option<bool> {
    (on || off).then_some(on)
}

#[cfg(test)]
mod tests;
