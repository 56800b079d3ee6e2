//! Time and memory as scenes and pictures grow.
//!
//! Every case runs in a process of its own, so that its memory is not that of an earlier one; repeats go over all cases in turn, so that
//! whatever else the machine does falls on all alike.

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
use crate::error::{Error, Result};

/// Measures all sweeps. `program` is started for each case with the case as JSON on its standard input, and answers with what [`run_case`]
/// gives, as JSON. `after` is given what there is after each sweep of each repeat; a run that is ended early gives what there is.
///
/// # Errors
/// If a sweep does not exist, or what `after` says. A case that fails is part of the report.
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
    let Some(Ended { status, said, complained, .. }) = child::run(&mut program, Some(&case), stop).map_err(failed)? else {
        return Ok(None);
    };
    if !status.success() {
        return Err(failed(format!("{status}: {complained}")));
    }
    serde_json::from_str(&said).map(Some).map_err(|e| failed(format!("no answer: {e}")))
}
