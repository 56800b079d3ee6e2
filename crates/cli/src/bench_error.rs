//! `steradian bench error`.

use std::io::IsTerminal;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use steradian::desc::SceneDesc;
use steradian::internal::render::{Overrides, Settings};
use steradian::internal::{compile, output};
use steradian::{Error, Result};
use steradian_bench::Watch;
use steradian_bench::error::{
    Budget, ErrorOptions, External, Peer, PeerOptions, Standard, Subject, Variant, bench_error,
};
use steradian_bench::report::Report;

use crate::args::{BenchErrorArgs, Verbosity};
use crate::bench::{Steps, command_line, spinner};
use crate::interrupt::Interrupt;
use crate::log::Level;
use crate::{log, scene, text};

/// Runs the benchmark; the result is the exit code.
pub fn run(arguments: &BenchErrorArgs) -> Result<u8> {
    let reference = match &arguments.reference {
        Some(path) => Standard::File(path.clone(), crate::compare::read(path)?),
        None => Standard::Halves,
    };
    if let Some(folder) = &arguments.out {
        // A slip in the name is found before the work, not after it.
        std::fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.clone(), message: e.to_string() })?;
        output::check_creatable(&folder.join("error.json"))?;
    }
    let interrupt = Interrupt::listen()?;
    let lines = !arguments.quiet && !std::io::stderr().is_terminal();
    let watch = Steps { bar: spinner(arguments.quiet), interrupt: &interrupt, lines };
    watch.step(&format!("{}: loading", arguments.scene.display()));
    let imported = scene::load(&arguments.scene, &arguments.import, Verbosity { quiet: arguments.quiet, verbose: 0 })?;
    let options = options(arguments, &imported.desc, reference)?;
    let scene = compile::compile_from(&imported.desc, imported.source(&arguments.scene))?;
    drop(imported);
    let report = bench_error(&scene, &options, &watch, &interrupt.stop, |report| match &arguments.out {
        Some(folder) => report.write_figures_to(folder),
        None => Ok(()),
    })?;
    watch.bar.finish_and_clear();
    match &arguments.out {
        Some(folder) => {
            report.write_to(folder)?;
            if !arguments.quiet {
                text::print(&format!(
                    "{}\nerror.html, error.md, error.csv and error.json are in {}",
                    report.markdown().trim_end(),
                    folder.display()
                ))?;
            }
        }
        None if arguments.json => text::print(&report.json()?)?,
        None => text::print(report.markdown().trim_end())?,
    }
    Ok(if watch.is_stopped() { interrupt.exit_code() } else { 0 })
}

fn options(arguments: &BenchErrorArgs, desc: &SceneDesc, reference: Standard) -> Result<ErrorOptions> {
    let budgets: Vec<Budget> = if arguments.times.is_empty() {
        arguments.spp.iter().copied().map(Budget::Spp).collect()
    } else {
        arguments.times.iter().copied().map(Budget::Seconds).collect()
    };
    let mut variants = if arguments.only_external { Vec::new() } else { variants(arguments, desc)? };
    check_size(arguments, &variants, &reference)?;
    for (name, command) in &arguments.external {
        let external = External::new(name, command, &arguments.scene, &budgets)?;
        variants.push(Variant { name: name.clone(), subject: Subject::External(external) });
    }
    for (name, external) in peers(arguments, desc, &reference, &budgets)? {
        variants.push(Variant { name, subject: Subject::External(external) });
    }
    if variants.is_empty() {
        let message = "--only-external needs --external, --peer, or --peers with a renderer that is installed";
        return Err(Error::Usage(message.to_owned()));
    }
    for (i, variant) in variants.iter().enumerate() {
        if variants[..i].iter().any(|other| other.name == variant.name) {
            return Err(Error::Usage(format!("two variants have the name {}", variant.name)));
        }
    }
    Ok(ErrorOptions {
        scene: arguments.scene.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned()),
        command: command_line(),
        variants,
        budgets,
        repeats: arguments.repeat as usize,
        seed: arguments.seed,
        reference,
        tax: arguments.tax,
    })
}

/// The renderers of `--peer` and `--peers`, with their names.
fn peers(
    arguments: &BenchErrorArgs,
    desc: &SceneDesc,
    reference: &Standard,
    budgets: &[Budget],
) -> Result<Vec<(String, External)>> {
    let mut peers: Vec<(Peer, &Path)> = Vec::new();
    for (peer, file) in &arguments.peers {
        peers.push((*peer, file.as_deref().unwrap_or(&arguments.scene)));
    }
    for peer in Peer::ALL.into_iter().filter(|_| arguments.all_peers) {
        let is_named = peers.iter().any(|(other, _)| *other == peer);
        if !is_named && peer.reads(&arguments.scene) && peer.is_installed(&arguments.python)? {
            peers.push((peer, &arguments.scene));
        }
    }
    if arguments.all_peers && peers.is_empty() {
        let python = arguments.python.display();
        let message = format!("--peers: {python} has no renderer that reads {}", arguments.scene.display());
        log::message(Level::Warning, &message);
    }
    let size = match reference {
        Standard::File(_, image) => [image.crop.width, image.crop.height],
        Standard::Halves => arguments.size.unwrap_or([desc.film.width, desc.film.height]),
    };
    let options = PeerOptions {
        python: arguments.python.clone(),
        size,
        threads: arguments.threads.unwrap_or(0),
        defines: arguments.import.defines.clone(),
    };
    let named = |(peer, scene): (Peer, &Path)| Ok((peer.name().to_owned(), peer.command(scene, &options, budgets)?));
    peers.into_iter().map(named).collect()
}

/// Every combination of what was given, named by what differs.
fn variants(arguments: &BenchErrorArgs, desc: &SceneDesc) -> Result<Vec<Variant>> {
    let mut variants = Vec::new();
    for integrator in choices(&arguments.integrator) {
        for sampler in choices(&arguments.sampler) {
            for strategy in choices(&arguments.strategy) {
                for guiding in choices(&arguments.guiding) {
                    for accel in choices(&arguments.accel) {
                        let overrides = Overrides {
                            integrator,
                            sampler,
                            strategy,
                            guiding,
                            accel,
                            size: arguments.size,
                            max_depth: arguments.max_depth,
                            clamp: arguments.clamp,
                            threads: arguments.threads,
                            outputs: vec!["unused.exr".into()],
                            ..Overrides::default()
                        };
                        let parts = [
                            part(&arguments.integrator, integrator.and_then(name)),
                            part(&arguments.sampler, sampler.and_then(name)),
                            part(&arguments.strategy, strategy.and_then(name)),
                            part(&arguments.guiding, guiding.and_then(name).map(|name| format!("guiding {name}"))),
                            part(&arguments.accel, accel.map(|accel| accel.to_string())),
                        ];
                        let parts: Vec<String> = parts.into_iter().flatten().collect();
                        let name = if parts.is_empty() { "steradian".to_owned() } else { parts.join(", ") };
                        variants.push(Variant {
                            name,
                            subject: Subject::Steradian(Box::new(Settings::new(desc, &overrides)?)),
                        });
                    }
                }
            }
        }
    }
    Ok(variants)
}

/// The values given, or else that of the scene.
fn choices<T: Copy>(given: &[T]) -> Vec<Option<T>> {
    if given.is_empty() { vec![None] } else { given.iter().copied().map(Some).collect() }
}

/// A part of a name, if there is a choice.
fn part<T>(given: &[T], name: Option<String>) -> Option<String> {
    name.filter(|_| given.len() > 1)
}

/// The name of a value in the scene format.
fn name(value: impl Serialize) -> Option<String> {
    match serde_json::to_value(value).ok()? {
        Value::String(name) => Some(name),
        Value::Object(map) => map.get("type").and_then(Value::as_str).map(str::to_owned),
        _ => None,
    }
}

/// A reference of another size is found before the first render.
fn check_size(arguments: &BenchErrorArgs, variants: &[Variant], reference: &Standard) -> Result<()> {
    let (Standard::File(file, image), Some(Variant { subject: Subject::Steradian(settings), .. })) =
        (reference, variants.first())
    else {
        return Ok(());
    };
    let [r, s] = [image.crop, settings.crop];
    if [r.width, r.height] == [s.width, s.height] {
        return Ok(());
    }
    let hint = if s.width * r.height == s.height * r.width {
        format!(" (--size {}x{} would fit)", r.width, r.height)
    } else {
        String::new()
    };
    let scene = Path::new(&arguments.scene).display();
    Err(Error::Usage(format!(
        "{}: the reference has {}x{} pixels, {scene} {}x{}{hint}",
        file.display(),
        r.width,
        r.height,
        s.width,
        s.height
    )))
}
