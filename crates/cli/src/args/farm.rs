//! The command line of `farm`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use steradian::internal::farm::FrameList;

const SLURM_ABOUT: &str = "\
Write a job for Slurm: an array of shards for every frame, and a job that merges them

The folder gets render.sh (one task of the array renders one shard), merge.sh and submit.sh, which submits both for \
each frame; all may be edited. Scene, folder and outputs have to mean the same on every node. Every shard has samples \
of its own of every pixel; merged, they are the picture of one machine bit for bit. A task whose node is lost, which \
is preempted or reaches its time limit is queued again and goes on from its checkpoint; one that fails is rendered \
again up to --retries times, unless the exit code is that of a permanent failure (2, 3, 4, 6). submit.sh, run again, \
submits what is missing.";

const SLURM_EXAMPLES: &str = "\
Examples:
  steradian farm slurm room.json --shards 16 --cpus 32 --submit
      One picture on 16 nodes with 32 processors each.
  steradian farm slurm room.json --shards 4 --frames 1-100 -o out/room.####.exr --partition night --walltime 4:00:00
      100 frames of 4 shards each; look at room.farm/*.sh, then run room.farm/submit.sh.
  steradian farm slurm room.json --shards 8 -- --spp 4096 --layers Z,N
      Options of render follow the two dashes.";

const OPENJD_EXAMPLES: &str = "\
Examples:
  steradian farm openjd room.json --shards 16 > room.template.json
  openjd check room.template.json
  openjd run room.template.json --step Merge --run-dependencies -p Shards=4
  deadline bundle submit ...         (a folder with the template as template.json)";

/// Jobs for render farms.
#[derive(Debug, Subcommand)]
pub enum FarmCommand {
    /// Write a job for Slurm: an array of shards for every frame, and a job that merges them
    #[command(long_about = SLURM_ABOUT, after_help = SLURM_EXAMPLES)]
    Slurm(SlurmArgs),
    /// Print a job template of Open Job Description 2023-09 (AWS Deadline Cloud, openjd): shards, and their merge
    #[command(after_help = OPENJD_EXAMPLES)]
    Openjd(OpenjdArgs),
}

/// What both kinds of jobs have.
#[derive(Clone, Debug, Args)]
pub struct JobArgs {
    /// The scene file; with a place for the frame's number, such as room.####.json, one for each frame
    pub scene: PathBuf,
    /// Into how many shards a picture is split
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub shards: u32,
    /// Render these frames, as `render --frames` has them
    #[arg(long, value_name = "FRAMES", allow_hyphen_values = true)]
    pub frames: Option<FrameList>,
    /// File to write, .exr or .png; repeat for several. With --frames, .#### is put before the extension unless the
    /// name has a place for the number. Default: SCENE.exr in the working directory
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Samples per pixel, all shards together
    #[arg(long, value_name = "N")]
    pub spp: Option<u32>,
    /// Folder to write to: shards and checkpoints. It has to be the same for all machines. Default: SCENE.farm in the
    /// working directory
    #[arg(long, value_name = "DIR")]
    pub dir: Option<PathBuf>,
    /// Write the checkpoint at least this often
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    pub every: u32,
    /// The program's path on the machines. Default: this one
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
    /// Overwrite existing frames; default: skip them
    #[arg(long)]
    pub overwrite: bool,
    /// Options of `steradian render` for every shard
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

/// Arguments of `farm slurm`.
#[derive(Clone, Debug, Args)]
pub struct SlurmArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// Partition
    #[arg(long, value_name = "NAME", help_heading = "Slurm")]
    pub partition: Option<String>,
    /// Time limit of a shard, as sbatch has it: 2:00:00. At the limit it writes its checkpoint and is queued again
    #[arg(long, value_name = "TIME", help_heading = "Slurm")]
    pub walltime: Option<String>,
    /// Processors of a shard; render has as many threads
    #[arg(long, value_name = "N", help_heading = "Slurm")]
    pub cpus: Option<u32>,
    /// Memory of a shard, as sbatch has it: 16G
    #[arg(long, value_name = "SIZE", help_heading = "Slurm")]
    pub mem: Option<String>,
    /// A further option of sbatch, such as --sbatch=--account=show; repeat for several
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true, help_heading = "Slurm")]
    pub sbatch: Vec<String>,
    /// How often a shard that fails is rendered again
    #[arg(long, value_name = "K", default_value_t = 2, help_heading = "Slurm")]
    pub retries: u32,
    /// Submit the job and print the ids of its arrays and merges
    #[arg(long, help_heading = "Slurm")]
    pub submit: bool,
}

/// Arguments of `farm openjd`.
#[derive(Clone, Debug, Args)]
pub struct OpenjdArgs {
    #[command(flatten)]
    pub job: JobArgs,
}
