//! Time and memory as scenes and pictures grow.
//!
//! Every case runs in a process of its own, so that its memory is not that of an earlier one; repeats go over all cases
//! in turn, so that whatever else the machine does falls on all alike.

mod plan;
mod quantity;
mod report;
mod run;
mod scenes;

pub use plan::{Case, SWEEPS, ScaleOptions, Subject};
pub use report::{PointReport, ScaleReport, SlopeReport, SweepReport};
pub use run::{Measured, Memory, run_case};

use std::process::Command;
use std::sync::atomic::AtomicBool;

use super::child::{self, Ended};
use super::{Machine, Watch};
use steradian::{Error, Result};

/// Measures all sweeps. `program` is started for each case with the case as JSON on its standard input, and answers
/// with what [`run_case`] gives, as JSON. `after` is given what there is after each sweep of each repeat; a run that is
/// ended early gives what there is.
///
/// # Errors
/// If a sweep does not exist, or the error of `after`. A case that fails is part of the report.
pub fn bench_scale(
    options: &ScaleOptions,
    program: impl Fn() -> Command,
    watch: &dyn Watch,
    stop: &AtomicBool,
    mut after: impl FnMut(&ScaleReport) -> Result<()>,
) -> Result<ScaleReport> {
    let sweeps = plan::sweeps(options)?;
    let mut report = ScaleReport::new(Machine::here(), options, &sweeps);
    'all: for repeat in 0..options.repeats {
        for (s, sweep) in sweeps.iter().enumerate() {
            for (p, (_, _, case)) in sweep.cases.iter().enumerate() {
                let place = report.place(s, p);
                if report.has_failed(s, p) {
                    continue;
                }
                watch.step(&format!("repeat {} of {}: {place}", repeat + 1, options.repeats));
                match in_a_process(program(), case, stop) {
                    _ if watch.is_stopped() => break 'all,
                    Ok(None) => break 'all,
                    Ok(Some(run)) => report.add(s, p, run),
                    Err(error) => report.fail(s, p, error.to_string()),
                }
            }
            report.summarize(&sweeps);
            after(&report)?;
        }
    }
    report.summarize(&sweeps);
    Ok(report)
}

/// A case in a process of its own; `None` if interrupted.
fn in_a_process(mut program: Command, case: &Case, stop: &AtomicBool) -> Result<Option<Measured>> {
    let failed = |message: String| Error::Internal(message);
    let case = serde_json::to_string(case).map_err(|e| failed(e.to_string()))?;
    let Some(Ended { status, stdout, stderr, .. }) = child::run(&mut program, Some(&case), stop).map_err(failed)?
    else {
        return Ok(None);
    };
    if !status.success() {
        return Err(failed(format!("{status}: {stderr}")));
    }
    serde_json::from_str(&stdout).map(Some).map_err(|e| failed(format!("no result: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unwatched;
    use crate::accel::AccelKind;
    use crate::report::Report;

    fn options(sweep: &str) -> ScaleOptions {
        ScaleOptions {
            command: String::new(),
            sweeps: vec![sweep.to_owned()],
            quick: true,
            repeats: 2,
            size: [16; 2],
            spp: 1,
            threads: 1,
            triangles: 1_000,
            lights: 1,
            instances: 1,
            accel: AccelKind::EMBREE,
        }
    }

    #[test]
    fn a_case_that_fails_is_named_once_and_the_others_are_measured() {
        let case = r#"{ "triangles": 1, "instances": 0, "lights": 1, "make_seconds": 1, "load_seconds": 1,
            "build_seconds": 1, "first_pass_seconds": 1, "render_seconds": 2, "processor_seconds": 3,
            "samples": 1000, "rays": 5000, "mesh_bytes": 1, "accelerator_bytes": 1, "film_bytes_per_pixel": 36,
            "memory": null }"#;
        // In the place of the program: it fails with four segments.
        let script = format!("if grep -q '\"depth\":4'; then echo no memory >&2; exit 33; fi; echo '{case}'");
        let program = || {
            let mut shell = Command::new("sh");
            shell.args(["-c", &script]);
            shell
        };
        let report = bench_scale(&options("depth"), program, &Unwatched, &AtomicBool::new(false), |_| Ok(())).unwrap();
        let failures = report.failures();
        assert!(
            failures.len() == 1 && failures[0].starts_with("depth 4: ") && failures[0].ends_with("no memory"),
            "{failures:?}"
        );
        assert!(!report.interrupted && report.markdown().contains("Failed: depth 4"));
        let runs: Vec<usize> = report.sweeps[0].points.iter().map(|point| point.runs.len()).collect();
        assert_eq!(runs, [2, 2, 0, 2, 2, 2]);
        assert!(
            report.sweeps[0].slopes.iter().all(|law| law.fit.slope.abs() < 1e-12 && law.fit.standard_error.is_some())
        );
    }

    #[test]
    fn scenes_of_every_kind_render() {
        for (sweep, _) in SWEEPS {
            let (_, _, case) = plan::sweeps(&options(sweep)).unwrap()[0].cases[0].clone();
            let run = run_case(&case).unwrap();
            assert!(run.samples > 0 && run.rays >= run.samples && run.mesh_bytes > 0, "{sweep}: {run:?}");
        }
        assert!(plan::sweeps(&options("colour")).is_err());
    }
}
