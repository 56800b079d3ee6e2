//! What was found, as JSON, CSV, Markdown and a page with plots.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;

use super::plan::{Case, ScaleOptions, Sweep};
use super::quantity::Quantity;
use super::run::Measured;
use crate::report::csv::field;
use crate::report::html;
use crate::report::markdown::{self, Table, number, range};
use crate::report::plot::{self, Curve};
use crate::report::write_files;
use crate::{Fit, Machine, fit, median_and_range};
use steradian::{Error, Result};

/// The columns of the CSV file.
const COLUMNS: &str = "sweep,at,repeat,width,height,spp,depth,threads,accelerator,triangles,instances,lights,\
                       load_seconds,build_seconds,first_pass_seconds,render_seconds,processor_seconds,samples,rays,\
                       mesh_bytes,accelerator_bytes,film_bytes_per_pixel,start_bytes,made_bytes,load_peak_bytes,\
                       build_peak_bytes,before_render_bytes,render_peak_bytes";

/// What the sweep over threads is judged by.
const SPEEDUP: &str = "times one thread";

/// Everything that a run has found.
#[derive(Clone, Debug, Serialize)]
pub struct ScaleReport {
    /// Where it ran.
    pub machine: Machine,
    /// The command that ran it.
    pub command: String,
    /// Repeats requested.
    pub repeats: usize,
    /// Whether it ended before the last of them.
    pub interrupted: bool,
    /// What grows, one after another.
    pub sweeps: Vec<SweepReport>,
}

/// Cases that differ in one thing.
#[derive(Clone, Debug, Serialize)]
pub struct SweepReport {
    /// What grows.
    pub name: &'static str,
    /// What it is counted in.
    pub axis: &'static str,
    /// What is rendered.
    pub what: String,
    /// The cases.
    pub points: Vec<PointReport>,
    /// How costs grow.
    pub slopes: Vec<SlopeReport>,
}

/// One case.
#[derive(Clone, Debug, Serialize)]
pub struct PointReport {
    /// How much of what grows.
    pub at: f64,
    /// A label, where a number is not enough.
    pub label: Option<String>,
    /// What is rendered, and how.
    pub case: Case,
    /// Each repeat.
    pub runs: Vec<Measured>,
    /// What is read off them.
    pub values: Vec<ValueReport>,
    /// Why there are no more runs.
    pub failure: Option<String>,
}

/// A cost, a rate or a size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValueReport {
    /// Its name with its unit.
    pub name: &'static str,
    /// Median, lowest and highest of the repeats.
    pub value: [f64; 3],
}

/// How one cost grows: the exponent of a power law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlopeReport {
    /// The cost.
    pub name: &'static str,
    /// The law, through the medians.
    #[serde(flatten)]
    pub fit: Fit,
}

impl ScaleReport {
    pub(super) fn new(machine: Machine, options: &ScaleOptions, sweeps: &[Sweep]) -> Self {
        let point = |(at, label, case): &(f64, Option<String>, Case)| PointReport {
            at: *at,
            label: label.clone(),
            case: case.clone(),
            runs: Vec::new(),
            values: Vec::new(),
            failure: None,
        };
        let sweeps = sweeps.iter().map(|sweep| SweepReport {
            name: sweep.name,
            axis: sweep.axis,
            what: sweep.what.clone(),
            points: sweep.cases.iter().map(point).collect(),
            slopes: Vec::new(),
        });
        let (command, repeats) = (options.command.clone(), options.repeats);
        Self { machine, command, repeats, interrupted: true, sweeps: sweeps.collect() }
    }

    /// Names a case.
    pub(super) fn place(&self, sweep: usize, point: usize) -> String {
        let sweep = &self.sweeps[sweep];
        format!("{} {}", sweep.name, sweep.points[point].name())
    }

    pub(super) fn has_failed(&self, sweep: usize, point: usize) -> bool {
        self.sweeps[sweep].points[point].failure.is_some()
    }

    pub(super) fn add(&mut self, sweep: usize, point: usize, run: Measured) {
        self.sweeps[sweep].points[point].runs.push(run);
    }

    pub(super) fn fail(&mut self, sweep: usize, point: usize, message: String) {
        self.sweeps[sweep].points[point].failure = Some(message);
    }

    /// Fills in what follows from the runs.
    pub(super) fn summarize(&mut self, sweeps: &[Sweep]) {
        for (report, sweep) in self.sweeps.iter_mut().zip(sweeps) {
            for point in &mut report.points {
                point.values =
                    sweep.columns.iter().chain(sweep.fitted).filter_map(|quantity| point.value(*quantity)).collect();
                let mut seen = Vec::new();
                point.values.retain(|value| {
                    !seen.contains(&value.name) && {
                        seen.push(value.name);
                        true
                    }
                });
            }
            if sweep.name == "threads" {
                report.add_speedups();
            }
            let law = |quantity: &Quantity| {
                let name = quantity.name();
                Some(SlopeReport { name, fit: fit(&report.curve(name))? })
            };
            report.slopes = sweep.fitted.iter().filter_map(law).collect();
        }
        let done = |point: &PointReport| point.failure.is_some() || point.runs.len() == self.repeats;
        self.interrupted = !self.sweeps.iter().flat_map(|sweep| &sweep.points).all(done);
    }

    /// The cases that failed, with the reason.
    pub fn failures(&self) -> Vec<String> {
        let points = self.sweeps.iter().flat_map(|sweep| sweep.points.iter().map(move |point| (sweep, point)));
        points
            .filter_map(|(sweep, point)| Some(format!("{} {}: {}", sweep.name, point.name(), point.failure.as_ref()?)))
            .collect()
    }

    /// The sweeps of which anything was measured.
    fn measured(&self) -> impl Iterator<Item = &SweepReport> {
        self.sweeps.iter().filter(|sweep| sweep.points.iter().any(|point| !point.runs.is_empty()))
    }

    /// As JSON.
    ///
    /// # Errors
    /// None in practice.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// One line a run.
    pub fn csv(&self) -> String {
        let mut out = format!("{COLUMNS}\n");
        for sweep in &self.sweeps {
            for point in &sweep.points {
                for (repeat, run) in point.runs.iter().enumerate() {
                    let Case { size: [width, height], spp, depth, threads, accel, .. } = &point.case;
                    let lead = [
                        sweep.name.to_owned(),
                        point.at.to_string(),
                        repeat.to_string(),
                        width.to_string(),
                        height.to_string(),
                    ];
                    let how = [spp.to_string(), depth.to_string(), threads.to_string(), field(accel)];
                    let counts = [run.triangles, run.instances, run.lights].map(|n| n.to_string());
                    let seconds = [
                        run.load_seconds,
                        run.build_seconds,
                        run.first_pass_seconds,
                        run.render_seconds,
                        run.processor_seconds,
                    ];
                    let sizes =
                        [run.samples, run.rays, run.mesh_bytes, run.accelerator_bytes, run.film_bytes_per_pixel];
                    let memory = run.memory.map(|m| [m.start, m.made, m.load, m.build, m.before_render, m.render]);
                    let memory = memory.map_or([""; 6].map(str::to_owned), |bytes| bytes.map(|n| n.to_string()));
                    let cells = lead.into_iter().chain(how).chain(counts).chain(seconds.map(|s| s.to_string()));
                    let cells: Vec<String> = cells.chain(sizes.map(|n| n.to_string())).chain(memory).collect();
                    // Writing to a string cannot fail.
                    let _ = writeln!(out, "{}", cells.join(","));
                }
            }
        }
        out
    }

    /// Tables with what they were measured on.
    pub fn markdown(&self) -> String {
        let mut out = format!("# Memory and scale\n\n{}\n\n", self.header());
        for note in self.notes() {
            let _ = writeln!(out, "- {note}");
        }
        markdown::add(&mut out, &self.laws());
        for sweep in self.measured() {
            markdown::add(&mut out, &sweep.table());
        }
        out
    }

    /// One page with plots.
    ///
    /// # Errors
    /// If a plot cannot be drawn.
    pub fn html(&self) -> Result<String> {
        let mut out = html::begin("Memory and scale", &self.header());
        out.push_str("<ul>\n");
        for note in self.notes() {
            let _ = writeln!(out, "<li>{}</li>", html::escape(&note));
        }
        out.push_str("</ul>\n");
        html::add_table(&mut out, &self.laws());
        for sweep in self.measured() {
            let _ = writeln!(out, "<h2>{}</h2>", html::escape(sweep.name));
            let curves = sweep.curves();
            if !curves.is_empty() {
                html::figure(&mut out, &plot::curves(&curves, sweep.axis, "times the first", &[])?, &sweep.what);
            }
            html::add_table(&mut out, &sweep.table());
        }
        out.push_str(html::END);
        Ok(out)
    }

    /// Writes `scale.json`, `scale.csv` and `scale.md` into a folder, which is made if it does not exist.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_figures_to(&self, folder: &Path) -> Result<()> {
        write_files(folder, &[("scale.json", self.json()?), ("scale.csv", self.csv()), ("scale.md", self.markdown())])
    }

    /// Writes everything: those, and `scale.html`.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_to(&self, folder: &Path) -> Result<()> {
        self.write_figures_to(folder)?;
        write_files(folder, &[("scale.html", self.html()?)])
    }

    fn header(&self) -> String {
        let cut = if self.interrupted { " Interrupted: what is missing was not measured." } else { "" };
        format!(
            "{}; `{}`. Medians of {} repeats in turn (lowest to highest).{cut}",
            self.machine.line(),
            self.command,
            self.repeats
        )
    }

    /// What the columns mean.
    fn notes(&self) -> Vec<String> {
        let fixed = [
            "Every case runs in a process of its own; scenes are made in memory first, which no time includes. Peak: \
             the most memory that the process held from then on, the made meshes and the program itself included.",
            "Load: from the description to placed and checked meshes and lights. First picture: load, build and the \
             first sample of every pixel. Processor ns: of all threads together.",
            "Slopes: exponents of power laws, by least squares of the logarithms of the medians, with their standard \
             errors. 0 costs nothing more, 1 is in proportion.",
        ];
        fixed
            .iter()
            .map(|note| (*note).to_owned())
            .chain(self.failures().iter().map(|failure| format!("Failed: {failure}")))
            .collect()
    }

    /// How costs grow.
    fn laws(&self) -> Table {
        let mut rows = Vec::new();
        for sweep in &self.sweeps {
            for law in &sweep.slopes {
                let curve = sweep.curve(law.name);
                let end = |point: Option<&(f64, f64)>| {
                    point.map_or_else(String::new, |(x, y)| format!("{} at {}", number(*y), count(*x)))
                };
                rows.push(vec![
                    sweep.name.to_owned(),
                    law.name.to_owned(),
                    law.text(),
                    end(curve.first()),
                    end(curve.last()),
                ]);
            }
        }
        let heads = ["over", "cost", "slope", "first", "last"].map(str::to_owned).to_vec();
        Table { title: "How costs grow".into(), heads, rows }
    }
}

impl SweepReport {
    /// Medians over the axis.
    fn curve(&self, name: &str) -> Vec<(f64, f64)> {
        self.points
            .iter()
            .filter_map(|point| Some((point.at, point.values.iter().find(|value| value.name == name)?.value[0])))
            .collect()
    }

    /// What is fitted, each against its first point, for costs have different units.
    fn curves(&self) -> Vec<Curve> {
        let curve = |law: &SlopeReport| {
            let points = self.curve(law.name);
            let first = points.first().map(|point| point.1).filter(|first| *first > 0.0)?;
            let points = points.into_iter().map(|(x, y)| (x, y / first)).collect();
            Some(Curve { name: format!("{} (slope {})", law.name, law.text()), points })
        };
        self.slopes.iter().filter_map(curve).collect()
    }

    /// Rates of several threads over those of one, repeat by repeat.
    fn add_speedups(&mut self) {
        let rate = |point: &PointReport, run: &Measured| Quantity::Rate.of(&point.case, run);
        let ones: Vec<Option<f64>> =
            self.points.first().map_or_else(Vec::new, |first| first.runs.iter().map(|run| rate(first, run)).collect());
        for point in &mut self.points {
            let pairs = point.runs.iter().zip(&ones);
            let ratios: Vec<f64> = pairs.filter_map(|(run, one)| Some(rate(point, run)? / (*one)?)).collect();
            if !ratios.is_empty() {
                point.values.push(ValueReport { name: SPEEDUP, value: median_and_range(&ratios) });
            }
        }
    }

    fn table(&self) -> Table {
        let names: Vec<&str> = self
            .points
            .iter()
            .find_map(|point| (!point.values.is_empty()).then(|| point.values.iter().map(|v| v.name).collect()))
            .unwrap_or_default();
        let row = |point: &PointReport| {
            let cell = |name: &&str| {
                point.values.iter().find(|value| value.name == *name).map_or_else(|| "-".into(), ValueReport::text)
            };
            std::iter::once(point.name()).chain(names.iter().map(cell)).collect()
        };
        let heads = std::iter::once(self.axis).chain(names.iter().copied()).map(str::to_owned).collect();
        Table {
            title: self.what.clone(),
            heads,
            rows: self.points.iter().filter(|point| !point.runs.is_empty()).map(row).collect(),
        }
    }
}

impl PointReport {
    fn name(&self) -> String {
        self.label.clone().unwrap_or_else(|| count(self.at))
    }

    fn value(&self, quantity: Quantity) -> Option<ValueReport> {
        let values: Vec<f64> = self.runs.iter().filter_map(|run| quantity.of(&self.case, run)).collect();
        (!values.is_empty()).then(|| ValueReport { name: quantity.name(), value: median_and_range(&values) })
    }
}

impl ValueReport {
    /// With the range where there is one that matters.
    fn text(&self) -> String {
        let [median, low, high] = self.value;
        if high - low < 0.02 * median { number(median) } else { range(self.value) }
    }
}

impl SlopeReport {
    fn text(&self) -> String {
        let error = self.fit.standard_error.map_or(String::new(), |error| format!(" ± {error:.2}"));
        format!("{:.2}{error}", self.fit.slope)
    }
}

/// A whole number with its thousands set apart.
fn count(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}
