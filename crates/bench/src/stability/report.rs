//! The report of `bench stability`.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Bound, CheckReport, Effort, Measure, Outcome, Plot, Status, catalogue, group};
use crate::desc::{OutputDesc, PixelTypeDesc};
use crate::output::{RenderInfo, write_exr};
use crate::report::{Curve, Curves, Drawing, Figure, Page, Report, Section, Table, interrupted, write_file};
use crate::{Machine, Spent};
use steradian::{Error, Result};

/// Name of the file that a run can be taken up from.
const JSON: &str = "stability.json";

/// Everything a run of the catalogue has found.
#[derive(Clone, Debug, Serialize)]
pub struct StabilityReport {
    /// Where it ran.
    pub machine: Machine,
    /// The command that ran it.
    pub command: String,
    /// How long each check was allowed to take.
    pub effort: Effort,
    /// Whether it ended before its last check.
    pub interrupted: bool,
    /// One for each check.
    pub checks: Vec<CheckReport>,
}

impl StabilityReport {
    /// Checks that failed.
    pub fn failures(&self) -> impl Iterator<Item = &CheckReport> {
        self.checks.iter().filter(|check| check.status == Status::Failed)
    }

    /// Writes everything into a folder, and below it `evidence/` with the pictures of checks that failed.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_with_evidence_to(&self, folder: &Path) -> Result<()> {
        self.write_to(folder)?;
        for failure in self.failures() {
            write_evidence(&folder.join("evidence"), failure)?;
        }
        Ok(())
    }

    /// Writes `stability.json` alone into a folder: what [`kept`](Self::kept) needs.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_json_to(&self, folder: &Path) -> Result<()> {
        write_file(folder, JSON, &self.json()?)
    }

    /// A line for each check: id, how it ended, name.
    pub fn lines(&self) -> Vec<String> {
        let line = |check: &CheckReport| {
            format!("{:<4} {:<7} {:7.1} s  {}", check.id, word(check.status), check.seconds, check.name)
        };
        self.checks.iter().map(line).collect()
    }

    /// The checks of an earlier run of this version that left `stability.json` in a folder, those that failed excepted;
    /// none if there is no such file.
    pub fn kept(folder: &Path, effort: Effort) -> Vec<CheckReport> {
        let report =
            std::fs::read(folder.join(JSON)).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
        let Some(report) = report else { return Vec::new() };
        let is_same = report["machine"]["version"] == env!("CARGO_PKG_VERSION")
            && serde_json::to_value(effort).is_ok_and(|effort| report["effort"] == effort);
        let checks = report["checks"].as_array().filter(|_| is_same).map_or(&[][..], Vec::as_slice);
        let kept = |check: &Value| {
            let known = catalogue().find(|known| check["id"] == known.id)?;
            let outcome =
                Outcome::deserialize(&check["outcome"]).ok().filter(|outcome| outcome.status() != Status::Failed)?;
            let processor_seconds = check["processor_seconds"].as_f64()?;
            Some(known.report(outcome, check["seconds"].as_f64()?, processor_seconds))
        };
        checks.iter().filter_map(kept).collect()
    }

    fn verdict(&self) -> String {
        let count = |status| self.checks.iter().filter(|check| check.status == status).count();
        let short = match count(Status::Short) {
            0 => String::new(),
            n => format!("{n} passed by a weaker bound than desired (reasons below), "),
        };
        let (all, passed, failed) = (self.checks.len(), count(Status::Passed), count(Status::Failed));
        format!("{all} checks: {passed} passed, {short}{failed} failed.")
    }

    /// A section for each group of checks.
    fn groups(&self) -> Vec<Section> {
        let mut sections: Vec<Section> = Vec::new();
        for check in &self.checks {
            let title = format!("{}. {}", &check.id[..1], group(check.id));
            if sections.last().is_none_or(|section| section.title != title) {
                let heads = "check | verdict | what | measured | criterion | set-up | s | processor s";
                sections.push(Section { title, tables: vec![Table::new("", heads)], ..Section::default() });
            }
            let Some(Section { tables, figures, .. }) = sections.last_mut() else { continue };
            tables[0].rows.push(row(check));
            figures.extend(check.outcome.plots.iter().map(|plot| Figure {
                caption: format!("{} {}: {}", check.id, check.name, plot.caption),
                drawing: Drawing::Curves(curves(plot)),
            }));
        }
        sections
    }

    /// Failures and shortfalls, in order.
    fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        for check in &self.checks {
            if check.status == Status::Failed {
                remarks.push(format!("{} failed: {}", check.id, broken(check)));
            }
            let shortfalls = check.outcome.shortfalls.iter();
            remarks.extend(shortfalls.map(|cause| format!("{} falls short: {cause}", check.id)));
        }
        remarks
    }
}

impl Report for StabilityReport {
    const NAME: &'static str = "stability";

    fn page(&self) -> Page {
        let mut spent = Spent::default();
        // How many threads a check uses is not known: at least one.
        self.checks.iter().for_each(|check| spent.add(Spent::new(1, check.seconds, check.processor_seconds)));
        let mut page = Page::new("Numerical stability", &self.machine, &spent);
        page.verdict = self.verdict();
        page.warnings.extend(interrupted(self.interrupted));
        page.facts.push(("Command", format!("`{}`", self.command)));
        page.facts.push(("False-alarm rate", "1e-6 for each statistical check".to_owned()));
        let remarks = self.remarks();
        if !remarks.is_empty() {
            let title = "What failed or falls short".to_owned();
            page.sections.push(Section { title, remarks, ..Section::default() });
        }
        page.sections.extend(self.groups());
        page
    }
}

fn row(check: &CheckReport) -> Vec<String> {
    let measures = &check.outcome.measures;
    let join = |parts: Vec<String>| parts.join("; ");
    vec![
        check.id.to_owned(),
        word(check.status).to_owned(),
        check.name.to_owned(),
        join(measures.iter().map(|m| format!("{}: {}", m.what, number(m.value))).collect()),
        join(measures.iter().filter(|m| m.bound != Bound::Any).map(criterion).collect()),
        check.setup.to_owned(),
        format!("{:.1}", check.seconds),
        format!("{:.1}", check.processor_seconds),
    ]
}

/// The status in a word.
fn word(status: Status) -> &'static str {
    match status {
        Status::Passed => "passed",
        Status::Short => "short",
        Status::Failed => "failed",
    }
}

fn criterion(measure: &Measure) -> String {
    let what = &measure.what;
    match measure.bound {
        Bound::AtMost(0.0) => format!("{what}: 0"),
        Bound::AtMost(limit) => format!("{what} ≤ {}", number(limit)),
        Bound::AtLeast(limit) => format!("{what} ≥ {}", number(limit)),
        Bound::Within(low, high) => format!("{what} in [{}, {}]", number(low), number(high)),
        Bound::Any => what.clone(),
    }
}

/// The numbers that break their bounds.
pub fn broken(report: &CheckReport) -> String {
    let measures = &report.outcome.measures;
    if measures.is_empty() {
        return "nothing was measured".into();
    }
    let lines = measures.iter().filter(|m| !m.bound.holds(m.value)).map(|m| {
        let must = match m.bound {
            Bound::AtMost(limit) => format!("≤ {}", number(limit)),
            Bound::AtLeast(limit) => format!("≥ {}", number(limit)),
            Bound::Within(low, high) => format!("in [{}, {}]", number(low), number(high)),
            Bound::Any => "a number".into(),
        };
        let example = m.counterexample.as_ref().map_or(String::new(), |text| format!(" (the first: {text})"));
        format!("{} is {}, must be {must}{example}", m.what, number(m.value))
    });
    lines.collect::<Vec<_>>().join("; ")
}

/// Writes the pictures of a check into a folder; the result is their names.
pub fn write_evidence(folder: &Path, report: &CheckReport) -> Result<Vec<String>> {
    std::fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.into(), message: e.to_string() })?;
    let mut names = Vec::new();
    for (name, image) in &report.outcome.evidence {
        let name = format!("{}-{}.exr", report.id, name.replace(|c: char| !c.is_ascii_alphanumeric(), "-"));
        let output = OutputDesc { pixel_type: PixelTypeDesc::Float, ..OutputDesc::new(name.clone()) };
        write_exr(&folder.join(&name), image, &output, &RenderInfo::default())?;
        names.push(name);
    }
    Ok(names)
}

/// What is drawn of a plot: zeros at its floor.
fn curves(plot: &Plot) -> Curves {
    let curve = |(name, points): &(String, Vec<(f64, f64)>)| {
        Curve::new(name.as_str(), points.iter().map(|&(x, y)| (x, y.max(plot.floor))))
    };
    let curves = plot.curves.iter().map(curve).collect();
    Curves { x: plot.x.clone(), y: plot.y.clone(), curves, marks: Vec::new() }
}

/// A number with four digits, as an integer if it is one.
fn number(value: f64) -> String {
    if value == value.trunc() && value.abs() < 1e7 {
        return format!("{value:.0}");
    }
    if (1e-3..1e5).contains(&value.abs()) {
        let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{value:.digits$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    format!("{value:.3e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_right() {
        for (value, text) in
            [(0.0, "0"), (12.0, "12"), (1e-6, "1.000e-6"), (0.998, "0.998"), (1234.56, "1235"), (-0.5, "-0.5")]
        {
            assert_eq!(number(value), text);
        }
    }
}
