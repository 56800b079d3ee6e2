//! The report of `bench scale`.

use serde::Serialize;

use super::plan::{Case, ScaleOptions, Sweep};
use super::quantity::Quantity;
use super::run::Measured;
use crate::report::{
    Curve, Curves, Drawing, Figure, Page, Report, Section, Table, count, interrupted, number, or_dash, range,
};
use crate::{Fit, Machine, Spent, fit, median_and_range};

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
                let points: Vec<_> = report.curve(name).into_iter().map(|(x, y)| (x, y[0])).collect();
                Some(SlopeReport { name, fit: fit(&points)? })
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

    /// What all renders took.
    fn spent(&self) -> Spent {
        let mut spent = Spent::default();
        for point in self.sweeps.iter().flat_map(|sweep| &sweep.points) {
            let threads = point.case.threads;
            let of = |run: &Measured| Spent::new(threads, run.render_seconds, run.processor_seconds);
            point.runs.iter().for_each(|run| spent.add(of(run)));
        }
        spent
    }

    fn verdict(&self) -> String {
        let laws = || self.sweeps.iter().flat_map(|sweep| sweep.slopes.iter().map(move |law| (sweep, law)));
        let Some((sweep, steepest)) = laws().max_by(|a, b| a.1.fit.slope.total_cmp(&b.1.fit.slope)) else {
            return "Nothing was measured.".to_owned();
        };
        // Two standard errors are an interval of about 95 %.
        let is_steep = |law: &SlopeReport| law.fit.slope - 2.0 * law.fit.standard_error.unwrap_or(0.0) > 1.0;
        let (steep, all) = (laws().filter(|(_, law)| is_steep(law)).count(), laws().count());
        let (name, axis, text) = (steepest.name, sweep.axis, steepest.text());
        let grows = if steep == 0 {
            format!("None of {all} costs grows faster than in proportion")
        } else {
            format!("{steep} of {all} costs grow faster than in proportion")
        };
        format!("{grows}; the steepest is {name} over {axis}, with slope {text}.")
    }

    /// How costs grow.
    fn laws(&self) -> Table {
        let mut table = Table::new("How costs grow", "over | cost | slope | first | last");
        for sweep in &self.sweeps {
            for law in &sweep.slopes {
                let curve = sweep.curve(law.name);
                let end = |point: Option<&(f64, [f64; 3])>| {
                    or_dash(point.map(|(x, y)| format!("{} at {}", number(y[0]), count(*x))))
                };
                let ends = [end(curve.first()), end(curve.last())];
                let lead = [sweep.name.to_owned(), law.name.to_owned(), law.text()];
                table.rows.push([&lead[..], &ends].concat());
            }
        }
        table
    }
}

impl Report for ScaleReport {
    const NAME: &'static str = "scale";

    fn page(&self) -> Page {
        let mut page = Page::new("Memory and scale", &self.machine, &self.spent());
        page.verdict = self.verdict();
        page.warnings.extend(interrupted(self.interrupted));
        page.warnings.extend(self.failures().iter().map(|failure| format!("Failed: {failure}")));
        page.facts.push(("Command", format!("`{}`", self.command)));
        page.facts.push(("Repeats", format!("{} in turn", self.repeats)));
        page.notes = [
            "Values are medians of the repeats (lowest to highest). Every case runs in a process of its own; scenes \
             are made in memory first, which no time includes. Peak: the most memory that the process held from then \
             on, the made meshes and the program itself included.",
            "Load: from the description to placed and checked meshes and lights. First picture: load, build and the \
             first sample of every pixel. Processor ns: of all threads together.",
            "Slopes: exponents of power laws, by least squares of the logarithms of the medians, with their standard \
             errors. 0 costs nothing more, 1 is in proportion.",
        ]
        .map(str::to_owned)
        .to_vec();
        page.sections.push(Section { tables: vec![self.laws()], ..Section::default() });
        // The sweeps of which anything was measured.
        let measured = self.sweeps.iter().filter(|sweep| sweep.points.iter().any(|point| !point.runs.is_empty()));
        page.sections.extend(measured.map(SweepReport::section));
        page
    }

    /// One line a run.
    fn sheet(&self) -> Option<Table> {
        let heads = "sweep | at | repeat | width | height | spp | depth | threads | accelerator | triangles | \
                     instances | lights | load_seconds | build_seconds | first_pass_seconds | render_seconds | \
                     processor_seconds | samples | rays | mesh_bytes | accelerator_bytes | film_bytes_per_pixel \
                     | start_bytes | made_bytes | load_peak_bytes | build_peak_bytes | before_render_bytes | \
                     render_peak_bytes";
        let mut sheet = Table::new("", heads);
        let points = self.sweeps.iter().flat_map(|sweep| sweep.points.iter().map(move |point| (sweep, point)));
        for (sweep, point) in points {
            let Case { size: [width, height], spp, depth, threads, accel, .. } = &point.case;
            for (repeat, run) in point.runs.iter().enumerate() {
                let lead = [sweep.name.to_owned(), point.at.to_string(), repeat.to_string()];
                let how = [*width, *height, *spp, *depth].map(|n| n.to_string());
                let on = [threads.to_string(), accel.clone()];
                let counts = [run.triangles, run.instances, run.lights].map(|n| n.to_string());
                let seconds = [
                    run.load_seconds,
                    run.build_seconds,
                    run.first_pass_seconds,
                    run.render_seconds,
                    run.processor_seconds,
                ];
                let sizes = [run.samples, run.rays, run.mesh_bytes, run.accelerator_bytes, run.film_bytes_per_pixel];
                let memory = run.memory.map(|m| [m.start, m.made, m.load, m.build, m.before_render, m.render]);
                let memory = memory.map_or([const { String::new() }; 6], |bytes| bytes.map(|n| n.to_string()));
                let (seconds, sizes) = (seconds.map(|s| s.to_string()), sizes.map(|n| n.to_string()));
                sheet.rows.push([&lead[..], &how, &on, &counts, &seconds, &sizes, &memory].concat());
            }
        }
        Some(sheet)
    }
}

impl SweepReport {
    /// Medians with their ranges over the axis.
    fn curve(&self, name: &str) -> Vec<(f64, [f64; 3])> {
        self.points
            .iter()
            .filter_map(|point| Some((point.at, point.values.iter().find(|value| value.name == name)?.value)))
            .collect()
    }

    /// What is fitted, each against its first point, for costs have different units; and the table.
    fn section(&self) -> Section {
        let curve = |law: &SlopeReport| {
            let points = self.curve(law.name);
            let first = points.first().map(|point| point.1[0]).filter(|first| *first > 0.0)?;
            let points = points.into_iter().map(|(x, y)| (x, y.map(|y| y / first))).collect();
            Some(Curve { name: format!("{} (slope {})", law.name, law.text()), points })
        };
        let curves: Vec<Curve> = self.slopes.iter().filter_map(curve).collect();
        let mut section = Section { title: self.name.to_owned(), tables: vec![self.table()], ..Section::default() };
        if !curves.is_empty() {
            let (x, y) = (self.axis.to_owned(), "times the first".to_owned());
            let drawing = Drawing::Curves(Curves { x, y, curves, marks: Vec::new() });
            section.figures.push(Figure { caption: self.what.clone(), drawing });
        }
        section
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
            let cell =
                |name: &&str| or_dash(point.values.iter().find(|value| value.name == *name).map(ValueReport::text));
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
