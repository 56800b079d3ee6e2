//! The catalogue's results as a table, a page with plots, and JSON.

use std::fmt::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Bound, CheckReport, Effort, Measure, Outcome, Plot, Status, catalogue, group};
use crate::Machine;
use crate::desc::{OutputDesc, PixelTypeDesc};
use crate::output::{RenderInfo, write_exr};
use crate::report::html;
use crate::report::markdown::{self, Table};
use crate::report::plot::{self, Curve};
use crate::report::write_files;
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

    /// As JSON.
    ///
    /// # Errors
    /// None in practice.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// A table of each group.
    pub fn markdown(&self) -> String {
        let mut out = format!("# Numerical stability\n\n{}\n", self.header());
        for table in self.tables() {
            markdown::add(&mut out, &table);
        }
        out.push('\n');
        for (id, line) in self.remarks() {
            let _ = writeln!(out, "- **{id}** {line}");
        }
        out
    }

    /// One page with plots.
    ///
    /// # Errors
    /// If a plot cannot be drawn.
    pub fn html(&self) -> Result<String> {
        let mut out = html::begin("Numerical stability", &self.header());
        for check in &self.checks {
            for plot in &check.outcome.plots {
                html::figure(&mut out, &draw(plot)?, &format!("{} {}: {}", check.id, check.name, plot.caption));
            }
        }
        for table in self.tables() {
            html::add_table(&mut out, &table);
        }
        out.push_str("<ul>\n");
        for (id, line) in self.remarks() {
            let _ = writeln!(out, "<li><b>{id}</b> {}</li>", html::escape(&line));
        }
        out.push_str("</ul>\n");
        out.push_str(html::END);
        Ok(out)
    }

    /// Writes `stability.json`, `stability.md` and `stability.html` into a folder, which is made if it does not exist,
    /// and below it `evidence/` with the pictures of checks that failed.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_to(&self, folder: &Path) -> Result<()> {
        write_files(
            folder,
            &[(JSON, self.json()?), ("stability.md", self.markdown()), ("stability.html", self.html()?)],
        )?;
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
        write_files(folder, &[(JSON, self.json()?)])
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
            Some(known.report(outcome, check["seconds"].as_f64()?))
        };
        checks.iter().filter_map(kept).collect()
    }

    fn header(&self) -> String {
        let count = |status| self.checks.iter().filter(|check| check.status == status).count();
        let m = &self.machine;
        let seconds: f64 = self.checks.iter().map(|check| check.seconds).sum();
        let cut = if self.interrupted { " Interrupted: what is missing was not run." } else { "" };
        format!(
            "{} checks: {} passed, {} fell short of what one would wish (causes below), {} failed, in {seconds:.0} s. \
             {} ({}, {} threads), steradian {}; `{}`. False-alarm rate of each statistical check: 1e-6.{cut}",
            self.checks.len(),
            count(Status::Passed),
            count(Status::Short),
            count(Status::Failed),
            m.processor,
            m.instruction_set,
            m.threads,
            m.version,
            self.command
        )
    }

    fn tables(&self) -> Vec<Table> {
        let mut tables: Vec<Table> = Vec::new();
        for check in &self.checks {
            let title = format!("{}. {}", &check.id[..1], group(check.id));
            if tables.last().is_none_or(|table| table.title != title) {
                let heads = ["", "check", "set-up", "criterion", "measured", "", "s"].map(str::to_owned).to_vec();
                tables.push(Table { title, heads, rows: Vec::new() });
            }
            let measures = &check.outcome.measures;
            let row = [
                check.id.to_owned(),
                check.name.to_owned(),
                check.setup.to_owned(),
                measures.iter().filter(|m| m.bound != Bound::Any).map(criterion).collect::<Vec<_>>().join("; "),
                measures.iter().map(|m| format!("{}: {}", m.what, number(m.value))).collect::<Vec<_>>().join("; "),
                word(check.status).to_owned(),
                format!("{:.1}", check.seconds),
            ];
            if let Some(table) = tables.last_mut() {
                table.rows.push(row.to_vec());
            }
        }
        tables
    }

    /// Failures and shortfalls, in order.
    fn remarks(&self) -> Vec<(&str, String)> {
        let mut remarks = Vec::new();
        for check in &self.checks {
            if check.status == Status::Failed {
                remarks.push((check.id, format!("failed: {}", broken(check))));
            }
            remarks.extend(check.outcome.shortfalls.iter().map(|cause| (check.id, format!("falls short: {cause}"))));
        }
        remarks
    }
}

/// The status in a word.
fn word(status: Status) -> &'static str {
    match status {
        Status::Passed => "passed",
        Status::Short => "short",
        Status::Failed => "FAILED",
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

fn draw(plot: &Plot) -> Result<String> {
    let curves: Vec<Curve> = plot
        .curves
        .iter()
        .map(|(name, points)| Curve {
            name: name.clone(),
            points: points.iter().map(|&(x, y)| (x, y.max(plot.floor))).collect(),
        })
        .collect();
    plot::curves(&curves, &plot.x, &plot.y, &[])
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
