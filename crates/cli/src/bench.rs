//! `steradian bench`.

use std::io::IsTerminal;
use std::io::Write;
use std::path::Path;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use steradian::internal::accel::{self, AccelKind};
use steradian::internal::compile;
use steradian::internal::render::{Overrides, Settings};
use steradian::{Error, Result};
use steradian_bench::agreement::{describe, parse_ray};
use steradian_bench::report::{AccelsReport, Report};
use steradian_bench::stability::{self, CheckReport, Effort, StabilityReport};
use steradian_bench::{
    Machine, Options, ReportsOptions, SceneReport, Subject, Watch, bench_reports, bench_scaling, bench_scene, record,
};

use crate::args::{BenchAccelArgs, BenchCommand, BenchReportsArgs, BenchStabilityArgs, Verbosity};
use crate::interrupt::Interrupt;
use crate::{scene, text};

/// Runs a benchmark; the result is the exit code.
pub fn run(command: &BenchCommand) -> Result<u8> {
    match command {
        BenchCommand::Accel(arguments) => accel(arguments),
        BenchCommand::Error(arguments) => crate::bench_error::run(arguments),
        BenchCommand::Reports(arguments) => reports(arguments),
        BenchCommand::Scale(arguments) => crate::bench_scale::run(arguments),
        BenchCommand::ScaleCase => crate::bench_scale::run_one().map(|()| 0),
        BenchCommand::Stability(arguments) => stability(arguments),
    }
}

fn accel(arguments: &BenchAccelArgs) -> Result<u8> {
    if arguments.scenes.is_empty() && arguments.scaling.is_none() {
        return Err(Error::Usage("nothing to measure: name a scene, or give --scaling".into()));
    }
    if let Some(ray) = &arguments.ray {
        return replay(arguments, ray).map(|()| 0);
    }
    if let Some(folder) = &arguments.out {
        check_folder(folder, "accel.json")?;
    }
    let interrupt = Interrupt::listen()?;
    let lines = !arguments.quiet && !std::io::stderr().is_terminal();
    let watch = Steps { bar: spinner(arguments.quiet), interrupt: &interrupt, lines };
    let options = options(arguments);
    let machine = Machine::here();
    let mut scenes: Vec<SceneReport> = Vec::new();
    for path in &arguments.scenes {
        if watch.is_stopped() {
            break;
        }
        watch.step(&format!("{}: loading", path.display()));
        let imported = scene::load(path, &arguments.import, Verbosity { quiet: arguments.quiet, verbose: 0 })?;
        let settings = Settings::new(
            &imported.desc,
            &Overrides { default_outputs: vec!["unused.exr".into()], ..Overrides::default() },
        )?;
        let scene = compile::compile_from(&imported.desc, imported.source(path))?;
        watch.step(&format!("{}: recording rays", path.display()));
        let recorder = accel::build(AccelKind::EMBREE, &scene.geometry, 0)?;
        let rays = record(&scene, &*recorder, &settings, arguments.rays as usize)?;
        drop(recorder);
        let name = path.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned());
        let subject = Subject { name: &name, scene: &scene, size: settings.size };
        scenes.push(bench_scene(&subject, &rays, &options, &watch)?);
    }
    let scaling = match arguments.scaling {
        Some([first, last]) if !watch.is_stopped() => Some(bench_scaling(first, last, &options, &watch)?),
        _ => None,
    };
    watch.bar.finish_and_clear();
    let report = AccelsReport { machine, command: command_line(), scenes, scaling };
    match &arguments.out {
        Some(folder) => {
            report.write_to(folder)?;
            if !arguments.quiet {
                text::print(&format!("accel.html, accel.md, accel.csv and accel.json are in {}", folder.display()))?;
            }
        }
        None if arguments.json => text::print(&report.json()?)?,
        None => text::print(report.markdown().trim_end())?,
    }
    Ok(if watch.is_stopped() { interrupt.exit_code() } else { 0 })
}

/// Makes a folder for results: a slip in its name is found before the work, not after it.
fn check_folder(folder: &Path, file: &str) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.to_owned(), message: e.to_string() })?;
    steradian::internal::output::check_creatable(&folder.join(file))
}

fn reports(arguments: &BenchReportsArgs) -> Result<u8> {
    if let Some(folder) = &arguments.out {
        check_folder(folder, "reports.json")?;
    }
    let interrupt = Interrupt::listen()?;
    let lines = !arguments.quiet && !std::io::stderr().is_terminal();
    let watch = Steps { bar: spinner(arguments.quiet), interrupt: &interrupt, lines };
    let defaults = ReportsOptions::default();
    let tests = if arguments.full { u64::MAX } else { defaults.tests };
    let report =
        bench_reports(&ReportsOptions { size: arguments.size, rounds: arguments.rounds as usize, tests }, &watch)?;
    watch.bar.finish_and_clear();
    match &arguments.out {
        Some(folder) => {
            report.write_to(folder)?;
            if !arguments.quiet {
                let place = format!("reports.html, reports.md and reports.json are in {}", folder.display());
                text::print(&format!("{}\n{place}", report.markdown().trim_end()))?;
            }
        }
        None => text::print(if arguments.json { report.json()? } else { report.markdown() }.trim_end())?,
    }
    Ok(if watch.is_stopped() { interrupt.exit_code() } else { 0 })
}

fn stability(arguments: &BenchStabilityArgs) -> Result<u8> {
    let checks = stability::choose(&arguments.checks)?;
    if arguments.list {
        for check in checks {
            text::print(&format!("{:<5}{}: {}", check.id, check.name, check.setup))?;
        }
        return Ok(0);
    }
    if let Some(folder) = &arguments.out {
        check_folder(folder, "stability.json")?;
    }
    let interrupt = Interrupt::listen()?;
    let lines = !arguments.quiet && !std::io::stderr().is_terminal();
    let watch = Steps { bar: spinner(arguments.quiet), interrupt: &interrupt, lines };
    let machine = Machine::here();
    let effort = if arguments.quick { Effort::Quick } else { Effort::Full };
    let kept = match &arguments.out {
        Some(folder) if arguments.resume => StabilityReport::kept(folder, effort),
        _ => Vec::new(),
    };
    let report = |checks: Vec<CheckReport>, interrupted| {
        let (machine, command) = (machine.clone(), command_line());
        StabilityReport { machine, command, effort, interrupted, checks }
    };
    // A run that is killed leaves what there was after its last check.
    let results = stability::run(&checks, effort, kept, &watch, |results| match &arguments.out {
        Some(folder) => report(results.to_vec(), true).write_json_to(folder),
        None => Ok(()),
    })?;
    watch.bar.finish_and_clear();
    let interrupted = results.len() < checks.len();
    let report = report(results, interrupted);
    match &arguments.out {
        Some(folder) => {
            report.write_with_evidence_to(folder)?;
            if !arguments.quiet {
                let place = format!("stability.html, stability.md and stability.json are in {}", folder.display());
                text::print(&[report.lines(), vec![place]].concat().join("\n"))?;
            }
        }
        None if arguments.json => text::print(&report.json()?)?,
        None => text::print(report.markdown().trim_end())?,
    }
    let failed: Vec<_> = report.failures().map(|check| check.id).collect();
    if interrupted {
        return Ok(interrupt.exit_code());
    }
    if failed.is_empty() { Ok(0) } else { Err(Error::Internal(format!("failed checks: {}", failed.join(", ")))) }
}

/// The command as it was given, without the folder of the program.
pub fn command_line() -> String {
    let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    std::iter::once("steradian".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

fn options(arguments: &BenchAccelArgs) -> Options {
    let defaults = Options::default();
    Options {
        accels: if arguments.accel.is_empty() { defaults.accels } else { arguments.accel.clone() },
        threads: if arguments.threads.is_empty() {
            defaults.threads
        } else {
            arguments.threads.iter().map(|&n| n as usize).collect()
        },
        rounds: arguments.rounds as usize,
        ..defaults
    }
}

/// The hit of each accelerator for one ray.
fn replay(arguments: &BenchAccelArgs, ray: &str) -> Result<()> {
    let ray = parse_ray(ray).map_err(|message| Error::Usage(format!("--ray: {message}")))?;
    for path in &arguments.scenes {
        let imported = scene::load(path, &arguments.import, Verbosity { quiet: arguments.quiet, verbose: 0 })?;
        let scene = compile::compile_from(&imported.desc, imported.source(path))?;
        for kind in options(arguments).accels {
            let accel = accel::build(kind, &scene.geometry, 0)?;
            let any = if accel.occluded(&ray) { "occluded" } else { "free" };
            text::print(&format!("{}: {kind:<16}{any}, {}", show(path), describe(accel.intersect(&ray).as_ref())))?;
        }
    }
    Ok(())
}

fn show(path: &Path) -> String {
    path.display().to_string()
}

/// The present step on stderr.
pub struct Steps<'a> {
    /// The line.
    pub bar: ProgressBar,
    /// Requests the end.
    pub interrupt: &'a Interrupt,
    /// Whether steps are lines, where there is no terminal.
    pub lines: bool,
}

impl Watch for Steps<'_> {
    fn step(&self, what: &str) {
        let what = steradian::internal::farm::message_line(what);
        if self.lines {
            // Stderr may be gone; that is no reason to stop.
            let _ = writeln!(std::io::stderr(), "{what}");
        }
        self.bar.set_message(what);
        self.bar.tick();
    }

    fn is_stopped(&self) -> bool {
        self.interrupt.stop.load(std::sync::atomic::Ordering::Relaxed)
    }
}

/// A line on stderr; none if `quiet`.
pub fn spinner(quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let style = ProgressStyle::with_template("{elapsed} {msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
    ProgressBar::with_draw_target(None, target).with_style(style)
}
