//! The files that a command reads and writes, compared before it begins.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use steradian::Result;
use steradian::desc::OutputDesc;
use steradian::internal::farm::{file_of_frame, scene_of_frame, with_frame_pattern};
use steradian::internal::import::files_of_scene;
use steradian::internal::output::{FileUses, files_of_output};

#[cfg(feature = "bench")]
use crate::args::BenchCommand;
use crate::args::{Cli, Command, ConfigCommand, FarmCommand, ImportArgs, RenderArgs};
use crate::frames::Shot;

/// The files that a command line names, with what they are for.
#[derive(Default)]
struct NamedFiles<'a> {
    read: Vec<(&'a Path, &'a str)>,
    written: Vec<(PathBuf, &'a str)>,
    import: Option<&'a ImportArgs>,
}

const SCENE: &str = "the scene";

impl<'a> NamedFiles<'a> {
    fn add_outputs(&mut self, names: &[String]) {
        self.written.extend(names.iter().map(|name| (PathBuf::from(name), "--output")));
    }

    fn add(&mut self, command: &'a Command) {
        match command {
            Command::Render(arguments) => {
                self.read.push((&arguments.scene, SCENE));
                self.add_outputs(&arguments.output);
                let named = [(&arguments.stats, "--stats"), (&arguments.state.checkpoint, "--checkpoint")];
                self.written.extend(named.into_iter().filter_map(|(path, option)| Some((path.clone()?, option))));
                self.import = Some(&arguments.import);
            }
            // A valid `replay` has become `render` before the line is parsed.
            Command::Replay(_) => {}
            Command::Rerender(arguments) => {
                self.read.push((&arguments.file, "the picture to render again"));
                self.read.extend(arguments.scene.iter().map(|path| (path.as_path(), SCENE)));
                self.add_outputs(std::slice::from_ref(&arguments.output));
            }
            Command::Info(arguments) => {
                self.read.push((&arguments.scene, SCENE));
                self.import = Some(&arguments.import);
            }
            Command::Convert(arguments) => {
                self.read.push((&arguments.input, SCENE));
                self.written.push((arguments.output.clone(), "the converted scene"));
                self.import = Some(&arguments.import);
            }
            Command::Merge(arguments) => {
                self.read.extend(arguments.shards.iter().map(|path| (path.as_path(), "a shard")));
                self.add_outputs(&arguments.output);
            }
            Command::Denoise(arguments) => {
                self.read.push((&arguments.input, "the noisy picture"));
                self.written.push((arguments.output.clone(), "the denoised picture"));
                self.written.extend(arguments.also.iter().map(|path| (path.clone(), "--output")));
            }
            Command::CheckExr(arguments) => {
                self.read.extend(arguments.files.iter().map(|path| (path.as_path(), "a file to check")));
            }
            Command::View(arguments) => {
                let files = [Some(&arguments.file), arguments.other.as_ref()];
                self.read.extend(files.into_iter().flatten().map(|path| (path.as_path(), "a picture to show")));
            }
            Command::Compare(arguments) => {
                self.read
                    .extend([(arguments.reference.as_path(), "the reference"), (arguments.test.as_path(), "the test")]);
            }
            Command::Farm(FarmCommand::Slurm(arguments)) => self.read.push((&arguments.job.scene, SCENE)),
            Command::Farm(FarmCommand::Openjd(arguments)) => self.read.push((&arguments.job.scene, SCENE)),
            Command::Config(ConfigCommand::Show(arguments)) => {
                self.read.extend(arguments.scene.iter().map(|path| (path.as_path(), SCENE)));
            }
            #[cfg(feature = "bench")]
            Command::Bench(command) => self.add_bench(command),
            #[cfg(not(feature = "bench"))]
            Command::Bench { .. } => {}
            Command::Schema { .. } | Command::Man { .. } | Command::Completions { .. } => {}
        }
    }

    #[cfg(feature = "bench")]
    fn add_bench(&mut self, command: &'a BenchCommand) {
        let (folder, stem) = match command {
            BenchCommand::Accel(arguments) => {
                self.read.extend(arguments.scenes.iter().map(|path| (path.as_path(), SCENE)));
                self.import = Some(&arguments.import);
                (&arguments.out, "accel")
            }
            BenchCommand::Error(arguments) => {
                self.read.push((&arguments.scene, SCENE));
                self.read.extend(arguments.reference.iter().map(|path| (path.as_path(), "--reference")));
                self.import = Some(&arguments.import);
                (&arguments.out, "error")
            }
            BenchCommand::Scale(arguments) => (&arguments.out, "scale"),
            BenchCommand::Stability(arguments) => (&arguments.out, "stability"),
            BenchCommand::Reports(arguments) => (&arguments.out, "reports"),
            BenchCommand::ScaleCase => return,
        };
        let files = folder
            .iter()
            .flat_map(|folder| ["html", "md", "csv", "json"].map(|kind| folder.join(format!("{stem}.{kind}"))));
        self.written.extend(files.map(|path| (path, "--out")));
    }
}

/// Compares the files that the command line itself names; `uses` are those of every command.
pub fn of_command(cli: &Cli, mut uses: FileUses) -> Result<()> {
    let mut named = NamedFiles::default();
    named.add(&cli.command);
    let NamedFiles { read, mut written, import } = named;
    written.extend(import.and_then(|import| import.report.clone()).map(|path| (path, "--report")));
    read.into_iter().try_for_each(|(path, purpose)| uses.read(path, purpose))?;
    written.iter().filter(|(path, _)| !is_stdout(path)).try_for_each(|(path, purpose)| uses.write(path, *purpose))
}

/// Compares the files of a render, with those that the scene names; `outputs` and `shard` have names for all frames of
/// a sequence.
pub fn of_render(
    arguments: &RenderArgs,
    shot: &Shot,
    outputs: &[OutputDesc],
    shard: Option<&Path>,
    mut uses: FileUses,
) -> Result<()> {
    if shot.unchecked.is_empty() {
        return Ok(());
    }
    let mut written: Vec<(PathBuf, &str)> = Vec::new();
    let mut statistics = BTreeSet::new();
    for frame in &shot.unchecked {
        let scene = frame.map_or_else(|| shot.scene.clone(), |frame| scene_of_frame(&arguments.scene, frame));
        uses.read(&scene, "the scene")?;
        let numbered =
            |name: &str| frame.map_or_else(|| name.to_owned(), |frame| file_of_frame(&with_frame_pattern(name), frame));
        let state = [(shard, "--output"), (arguments.state.checkpoint.as_deref(), "--checkpoint")];
        let state =
            state.into_iter().filter_map(|(path, purpose)| Some((numbered(&path?.to_string_lossy()).into(), purpose)));
        written.extend(state);
        if shard.is_none() {
            for output in outputs {
                let output = OutputDesc {
                    file: if arguments.repeat.is_some() { output.file.clone() } else { numbered(&output.file) },
                    ..output.clone()
                };
                written.extend(files_of_output(&output).into_iter().map(|path| (path, "output")));
            }
        }
        // Those of frames without a number in the name follow each other in one file.
        let statistics_of = |path: &PathBuf| {
            frame.map_or_else(|| path.clone(), |frame| file_of_frame(&path.to_string_lossy(), frame).into())
        };
        statistics.extend(arguments.stats.iter().filter(|path| !is_stdout(path)).map(statistics_of));
    }
    if let Some(guide) = &arguments.guide {
        uses.read(guide, "--guide")?;
    }
    written.extend(statistics.into_iter().map(|path| (path, "--stats")));
    written
        .extend(arguments.import.report.iter().filter(|path| !is_stdout(path)).map(|path| (path.clone(), "--report")));
    written.iter().try_for_each(|(path, purpose)| uses.write(path, *purpose))?;
    // A file that the scene names is there: it can only be overwritten by one that is.
    if !written.iter().any(|(path, _)| path.exists()) {
        return Ok(());
    }
    files_of_scene(&shot.imported, &shot.scene).into_iter().try_for_each(|(path, place)| uses.read(&path, place))
}

/// Whether a name means the standard output.
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}
