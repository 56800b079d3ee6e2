//! Numerical stability: a catalogue of checks with criteria, which `steradian bench stability` and the tests run alike.
//!
//! Each group has its file: a `checks!` list of ids, names and set-ups, and below it one function for each check, which
//! measures numbers and sets their bounds.

pub mod geometry;
pub mod oracle;
mod outcome;
pub mod render;
mod report;
pub mod scenes;
pub mod statistics;

use serde::Serialize;

pub use outcome::{Bound, Faults, Measure, Outcome, Plot, Status};
pub use report::StabilityReport;

use super::{Spent, Watch};
use steradian::{Error, Result};

/// How long a check may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Effort {
    /// About a second.
    Quick,
    /// Up to a minute.
    Full,
}

impl Effort {
    /// One of two values by the effort.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

/// One entry of the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Letter of the group and number within it.
    pub id: &'static str,
    /// What is checked, in a few words.
    pub name: &'static str,
    /// Scenes, rays, samples; and whose test it is, if known.
    pub setup: &'static str,
    run: fn(Effort) -> Outcome,
}

/// A check with what it found.
#[derive(Clone, Debug, Serialize)]
pub struct CheckReport {
    /// Letter of the group and number within it.
    pub id: &'static str,
    /// What is checked.
    pub name: &'static str,
    /// Scenes, rays, samples.
    pub setup: &'static str,
    /// Whether it is good enough.
    pub status: Status,
    /// What was measured.
    pub outcome: Outcome,
    /// How long it took.
    pub seconds: f64,
    /// Processor seconds, of all threads together.
    pub processor_seconds: f64,
}

/// Lists checks, and makes a test of each that runs it quickly.
macro_rules! checks {
    ($($id:literal $run:ident $name:literal: $setup:literal;)*) => {
        /// The checks of this group, in order.
        pub(super) const CHECKS: &[$crate::stability::Check] =
            &[$($crate::stability::Check { id: $id, name: $name, setup: $setup, run: $run }),*];

        #[cfg(test)]
        mod quick {
            $(
                #[test]
                fn $run() {
                    $crate::stability::testing::assert_passes($id);
                }
            )*
        }
    };
}
mod accelerators;
mod cameras;
mod degenerate;
mod films;
mod lights;
mod pictures;
mod quadrics;
mod revolution;
mod samplers;
mod scattering;
mod spawning;
mod transport;
mod triangles;
mod vectors;
mod verdict;

/// Letter and name of each group with its checks.
const GROUPS: &[(&str, &str, &[Check])] = &[
    ("A", "Triangles and watertightness", triangles::CHECKS),
    ("B", "Rays that leave a surface", spawning::CHECKS),
    ("C", "Quadrics and flat shapes", quadrics::CHECKS),
    ("D", "Surfaces of revolution", revolution::CHECKS),
    ("E", "Degenerate input", degenerate::CHECKS),
    ("F", "Accelerators against the linear oracle", accelerators::CHECKS),
    ("G", "Scattering at surfaces", scattering::CHECKS),
    ("I", "Light transport", transport::CHECKS),
    ("K", "Cameras", cameras::CHECKS),
    ("L", "Lights", lights::CHECKS),
    ("M", "Films", films::CHECKS),
    ("R", "Pictures", pictures::CHECKS),
    ("S", "Samplers", samplers::CHECKS),
];

/// Every check, in order.
pub fn catalogue() -> impl Iterator<Item = &'static Check> {
    GROUPS.iter().flat_map(|(.., checks)| *checks)
}

/// The name of the group that a check's id begins with.
pub fn group(id: &str) -> &'static str {
    GROUPS.iter().find(|(letter, ..)| id.starts_with(letter)).map_or("", |(_, name, _)| *name)
}

/// The checks with these ids, or of the groups with these letters, in the catalogue's order; all if there are none.
///
/// # Errors
/// [`Error::Usage`] for a name that is neither.
pub fn choose(names: &[String]) -> Result<Vec<&'static Check>> {
    for name in names {
        if !GROUPS.iter().any(|(letter, ..)| name == letter) && !catalogue().any(|check| check.id == name) {
            let groups: Vec<String> = GROUPS.iter().map(|(letter, name, _)| format!("{letter} ({name})")).collect();
            return Err(Error::Usage(format!(
                "no check is called {name:?}; --list shows them; groups are {}",
                groups.join(", ")
            )));
        }
    }
    let selected = |check: &&Check| {
        names.is_empty()
            || names.iter().any(|name| check.id == name || check.id.trim_end_matches(char::is_numeric) == name)
    };
    Ok(catalogue().filter(selected).collect())
}

impl Check {
    /// Measures.
    pub fn run(&self, effort: Effort) -> CheckReport {
        let (outcome, spent) = Spent::on(1, || (self.run)(effort));
        self.report(outcome, spent.seconds, spent.processor_seconds)
    }

    fn report(&self, outcome: Outcome, seconds: f64, processor_seconds: f64) -> CheckReport {
        let (status, Self { id, name, setup, .. }) = (outcome.status(), *self);
        CheckReport { id, name, setup, status, outcome, seconds, processor_seconds }
    }
}

/// Runs checks one after the other, all but those in `kept`, whose results are reused; ends early if `watch` is
/// stopped. `after` is given what there is after each.
///
/// # Errors
/// Those of `after`.
pub fn run(
    checks: &[&Check],
    effort: Effort,
    mut kept: Vec<CheckReport>,
    watch: &dyn Watch,
    mut after: impl FnMut(&[CheckReport]) -> Result<()>,
) -> Result<Vec<CheckReport>> {
    let mut reports = Vec::with_capacity(checks.len());
    for (i, check) in checks.iter().enumerate() {
        if watch.is_stopped() {
            break;
        }
        if let Some(k) = kept.iter().position(|report| report.id == check.id) {
            reports.push(kept.swap_remove(k));
            continue;
        }
        watch.step(&format!("{} of {}: {} {}", i + 1, checks.len(), check.id, check.name));
        reports.push(check.run(effort));
        after(&reports)?;
    }
    Ok(reports)
}

/// The probability that a correct program fails a check: what each of `tests` independent p-values must reach for the
/// whole to stay below one in a million (Šidák, "Rectangular confidence regions for the means of multivariate normal
/// distributions").
pub fn sidak_level(tests: usize) -> f64 {
    // 1 - (1 - a)^(1/n) without cancellation.
    -((-1e-6f64).ln_1p() / tests.max(1) as f64).exp_m1()
}

#[cfg(test)]
pub(crate) mod testing {
    use std::path::Path;

    use super::*;

    /// Runs a check quickly; if it fails, leaves its pictures in `target/stability` and panics with its numbers.
    #[track_caller]
    pub fn assert_passes(id: &str) {
        let check = catalogue().find(|check| check.id == id).expect("the check is in the catalogue");
        let report = check.run(Effort::Quick);
        if report.status != Status::Failed {
            return;
        }
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/stability");
        let written = report::write_evidence(&folder, &report).map_or_else(|e| e.to_string(), |files| files.join(", "));
        panic!("{id} {}: {}; evidence: {written}", check.name, report::broken(&report));
    }

    #[test]
    fn ids_are_unique_and_belong_to_their_groups() {
        let mut seen = std::collections::HashSet::new();
        for (letter, _, checks) in GROUPS {
            for check in *checks {
                assert!(seen.insert(check.id), "{} is there twice", check.id);
                assert!(
                    check.id.starts_with(letter) && check.id[1..].parse::<u32>().is_ok(),
                    "{} in group {letter}",
                    check.id
                );
            }
        }
    }

    #[test]
    fn the_level_of_many_tests_is_that_of_one_divided() {
        assert!((sidak_level(1) / 1e-6 - 1.0).abs() < 1e-9);
        assert!((sidak_level(1000) / 1e-9 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn failures_leave_pictures_and_say_what_broke() {
        let lost = Faults::of(&[1, 8, 9], |&ray| usize::from(ray > 7), |ray| format!("ray {ray}"));
        let outcome = Outcome::new().at_most("error", 2.0, 1.0).none("lost", lost).pictures("grid", 1, &[1.0], &[3.0]);
        let check = Check { id: "Z1", name: "n", setup: "s", run: |_| Outcome::new() };
        let report = check.report(outcome, 0.0, 0.0);
        assert_eq!(report::broken(&report), "error is 2, must be ≤ 1; lost is 2, must be ≤ 0 (the first: ray 8)");
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(
            report::write_evidence(folder.path(), &report).unwrap(),
            ["Z1-grid-result.exr", "Z1-grid-reference.exr", "Z1-grid-error.exr"]
        );
        assert_eq!(
            crate::output::read_exr(&folder.path().join("Z1-grid-error.exr")).unwrap().rgb(0, 0),
            Some([-2.0; 3])
        );
    }
}
