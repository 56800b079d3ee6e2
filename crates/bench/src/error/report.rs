//! Results as JSON, CSV and Markdown.

use std::fmt::Write;
use std::path::Path;

use super::{ErrorReport, Point, TaxReport};
use crate::report::csv::field;
use crate::report::markdown::{self, Table, number, range};
use crate::report::write_files;
use steradian::{Error, Result};

/// The columns of the CSV file.
const COLUMNS: &str = "scene,variant,budget,repeat,seed,spp,seconds,process_seconds,relmse,relmse_trimmed,mse,flip,\
                       mean_ratio_r,mean_ratio_g,mean_ratio_b,not_finite,msamples_per_second,mrays_per_second,\
                       efficiency";

impl ErrorReport {
    /// As JSON.
    ///
    /// # Errors
    /// None in practice.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// One line a render.
    pub fn csv(&self) -> String {
        let mut out = format!("{COLUMNS}\n");
        let optional = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        for variant in &self.variants {
            for point in &variant.points {
                for run in &point.runs {
                    let [r, g, b] = run.mean_ratio;
                    let cells = [
                        field(&self.scene),
                        field(&variant.name),
                        point.budget.to_string(),
                        run.repeat.to_string(),
                        run.seed.to_string(),
                        run.spp.map_or(String::new(), |spp| spp.to_string()),
                        run.seconds.to_string(),
                        optional(run.process_seconds),
                        run.relmse.to_string(),
                        run.relmse_trimmed.to_string(),
                        run.mse.to_string(),
                        optional(run.flip),
                        r.to_string(),
                        g.to_string(),
                        b.to_string(),
                        run.not_finite.to_string(),
                        optional(run.msamples_per_second),
                        optional(run.mrays_per_second),
                        optional(run.efficiency),
                    ];
                    // Writing to a string cannot fail.
                    let _ = writeln!(out, "{}", cells.join(","));
                }
            }
        }
        out
    }

    /// Tables with what they were measured on.
    pub fn markdown(&self) -> String {
        let mut out = format!("# Error against time: {}\n\n{}\n\n", self.scene, self.header());
        for note in self.notes() {
            let _ = writeln!(out, "- {note}");
        }
        for table in self.tables() {
            markdown::add(&mut out, &table);
        }
        out
    }

    /// Writes `error.json`, `error.csv` and `error.md` into a folder, which is made if it does not exist.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_figures_to(&self, folder: &Path) -> Result<()> {
        write_files(folder, &[("error.json", self.json()?), ("error.csv", self.csv()), ("error.md", self.markdown())])
    }

    /// Writes everything: those, and `error.html`.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_to(&self, folder: &Path) -> Result<()> {
        self.write_figures_to(folder)?;
        write_files(folder, &[("error.html", self.html()?)])
    }

    /// Where and how it was measured.
    pub(super) fn header(&self) -> String {
        let cut = if self.interrupted { " Interrupted: what is missing was not measured." } else { "" };
        format!(
            "{}; `{}`. Medians of {} repeats in turn (lowest to highest).{cut}",
            self.machine.line(),
            self.command,
            self.repeats
        )
    }

    /// What the columns mean.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let reference = &self.reference;
        notes.push(match (&reference.file, reference.noise_relmse) {
            (Some(file), _) => format!("Reference: {file}. Its own noise is part of every error."),
            (None, Some(noise)) => {
                let spp = reference.halves_spp.map_or(String::new(), |spp| format!(" of {spp} spp each"));
                format!(
                    "No reference was given: the mean of two independent renders{spp} by the first variant stands in. \
                     A render like one of them has relMSE {} (half of their squared difference); a quarter, {}, is \
                     their mean's, and is subtracted from every error. A bias that all renders share cannot be seen.",
                    number(2.0 * noise),
                    number(noise)
                )
            }
            (None, None) => "Interrupted before there was a reference.".to_owned(),
        });
        notes.push(
            "relMSE: mean of (test - reference)² / (reference² + 0.01) over pixels and channels; trimmed: without the \
             worst thousandth of the pixels. FLIP: mean of HDR-FLIP, first repeat. Mean ratio: luminance of all \
             repeats over the reference's, with a 95 % confidence interval from the differences of blocks of 8 x 8 \
             pixels. Efficiency: 1 / (relMSE seconds)."
                .to_owned(),
        );
        if self.variants.iter().any(|variant| variant.external) {
            let text = "Other programs: the time that they report of themselves on standard output, else that of their \
                        whole process.";
            notes.push(text.to_owned());
        }
        notes
    }

    /// All tables.
    pub(super) fn tables(&self) -> Vec<Table> {
        let mut tables = vec![self.points()];
        if self.variants.iter().any(|variant| variant.slope_of_time.is_some()) || self.equal_error.is_some() {
            tables.push(self.slopes());
        }
        tables.extend(self.tax.as_ref().map(tax));
        tables
    }

    fn points(&self) -> Table {
        let heads = [
            "variant",
            "budget",
            "spp",
            "s",
            "relMSE",
            "trimmed",
            "MSE",
            "FLIP",
            "mean ratio",
            "NaN, Inf",
            "Msamples/s",
            "Mrays/s",
            "efficiency",
        ];
        let mut rows = Vec::new();
        // Budgets outermost, so that what is compared stands together.
        let budgets = self.variants.first().map_or(0, |variant| variant.points.len());
        for budget in 0..budgets {
            for variant in &self.variants {
                if let Some(point) = variant.points.get(budget).filter(|point| !point.runs.is_empty()) {
                    rows.push(row(&variant.name, point));
                }
            }
        }
        Table { title: "By budget".into(), heads: heads.map(str::to_owned).to_vec(), rows }
    }

    fn slopes(&self) -> Table {
        let equal = self.equal_error.as_ref();
        let mut heads = ["variant", "slope of relMSE over time", "slope over spp"].map(str::to_owned).to_vec();
        if let Some(equal) = equal {
            heads.extend([format!("s to relMSE {}", number(equal.relmse)), "against the first".into()]);
        }
        let slope = |slope: Option<f64>| slope.map_or_else(|| "-".into(), |slope| format!("{slope:.2}"));
        let rows = self.variants.iter().enumerate().map(|(i, variant)| {
            let mut row = vec![variant.name.clone(), slope(variant.slope_of_time), slope(variant.slope_of_spp)];
            if let Some(equal) = equal {
                let seconds = |i: usize| equal.seconds.get(i).copied().flatten();
                row.push(seconds(i).map_or_else(|| "-".into(), number));
                let ratio = seconds(0).zip(seconds(i)).map(|(first, own)| format!("{:.2}x as fast", first / own));
                row.push(ratio.unwrap_or_else(|| "-".into()));
            }
            row
        });
        Table {
            title: "Convergence (least squares of the logarithms; -1: independent samples)".into(),
            heads,
            rows: rows.collect(),
        }
    }
}

fn tax(tax: &TaxReport) -> Table {
    let heads = ["variant", "picture", "rays", "threads", "render s", "bare replay s", "render / replay"]
        .map(str::to_owned)
        .to_vec();
    let [width, height] = tax.size;
    let same = if tax.same_hits { "" } else { " (the replay found other hits)" };
    let row = vec![
        tax.variant.clone(),
        format!("{width}x{height}, {} spp", tax.spp),
        format!("{}, of which {} hit{same}", tax.rays, tax.hits),
        tax.threads.to_string(),
        range(tax.render_seconds),
        range(tax.replay_seconds),
        range(tax.ratio),
    ];
    let title = format!(
        "Shading tax: the render beside bare calls of {} with its own rays, in the same packets",
        tax.accelerator
    );
    Table { title, heads, rows: vec![row] }
}

fn row(name: &str, point: &Point) -> Vec<String> {
    let optional = |values: Option<[f64; 3]>| values.map_or_else(|| "-".into(), range);
    vec![
        name.to_owned(),
        point.budget.to_string(),
        point.spp.map_or_else(|| "-".into(), number),
        range(point.seconds),
        range(point.relmse),
        number(point.relmse_trimmed[0]),
        number(point.mse[0]),
        point.flip.map_or_else(|| "-".into(), number),
        point
            .bias
            .map_or_else(|| "-".into(), |bias| format!("{:.4} ({:.4} to {:.4})", bias.ratio, bias.low, bias.high)),
        point.not_finite.to_string(),
        optional(point.msamples_per_second),
        optional(point.mrays_per_second),
        optional(point.efficiency),
    ]
}
