//! `steradian bench scale`.

use std::io::{IsTerminal, Read};
use std::num::NonZero;
use std::process::Command;

use steradian::internal::output;
use steradian::{Error, Result};
use steradian_bench::Watch;
use steradian_bench::report::Report;
use steradian_bench::scale::{Case, ScaleOptions, bench_scale, run_case};

use crate::args::BenchScaleArgs;
use crate::bench::{Steps, command_line, spinner};
use crate::interrupt::Interrupt;
use crate::text;

/// The hidden command by which the benchmark starts itself for one case.
pub const ONE_CASE: &str = "scale-case";

/// Runs the benchmark; the result is the exit code.
pub fn run(arguments: &BenchScaleArgs) -> Result<u8> {
    if let Some(folder) = &arguments.out {
        // A slip in the name is found before the work, not after it.
        std::fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.clone(), message: e.to_string() })?;
        output::check_creatable(&folder.join("scale.json"))?;
    }
    let program =
        std::env::current_exe().map_err(|e| Error::Internal(format!("where this program lies is not known: {e}")))?;
    let program = || {
        let mut command = Command::new(&program);
        command.args(["bench", ONE_CASE]);
        command
    };
    let interrupt = Interrupt::listen()?;
    let lines = !arguments.quiet && !std::io::stderr().is_terminal();
    let watch = Steps { bar: spinner(arguments.quiet), interrupt: &interrupt, lines };
    let report = bench_scale(&options(arguments), program, &watch, &interrupt.stop, |report| match &arguments.out {
        Some(folder) => report.write_figures_to(folder),
        None => Ok(()),
    })?;
    watch.bar.finish_and_clear();
    match &arguments.out {
        Some(folder) => {
            report.write_to(folder)?;
            if !arguments.quiet {
                let place = format!("scale.html, scale.md, scale.csv and scale.json are in {}", folder.display());
                text::print(&format!("{}\n{place}", report.markdown().trim_end()))?;
            }
        }
        None if arguments.json => text::print(&report.json()?)?,
        None => text::print(report.markdown().trim_end())?,
    }
    if watch.is_stopped() {
        return Ok(interrupt.exit_code());
    }
    let failures = report.failures();
    if failures.is_empty() { Ok(0) } else { Err(Error::Internal(failures.join("; "))) }
}

/// One case, as JSON on standard input; what it took goes to standard output.
pub fn run_one() -> Result<()> {
    let mut input = String::new();
    std::io::stdin().read_to_string(&mut input).map_err(|e| Error::Usage(format!("{ONE_CASE}: {e}")))?;
    let case: Case = serde_json::from_str(&input).map_err(|e| Error::Usage(format!("{ONE_CASE}: {e}")))?;
    let measured = run_case(&case)?;
    text::print(&serde_json::to_string(&measured).map_err(|e| Error::Internal(e.to_string()))?)
}

fn options(arguments: &BenchScaleArgs) -> ScaleOptions {
    let quick = arguments.quick;
    let or = |given: Option<usize>, full: usize, small: usize| given.unwrap_or(if quick { small } else { full });
    ScaleOptions {
        command: command_line(),
        sweeps: arguments.sweeps.clone(),
        quick,
        repeats: arguments.repeat as usize,
        size: arguments.size.unwrap_or(if quick { [128; 2] } else { [512; 2] }),
        spp: arguments.spp,
        threads: match arguments.threads {
            0 => std::thread::available_parallelism().map_or(1, NonZero::get),
            threads => threads as usize,
        },
        triangles: or(arguments.triangles, 20_000_000, 1_000_000),
        lights: or(arguments.lights, 100_000, 10_000),
        instances: or(arguments.instances, 100_000, 10_000),
        accel: arguments.accel,
    }
}
