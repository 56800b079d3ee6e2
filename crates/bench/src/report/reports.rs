//! The comparisons of reports, as Markdown and as a page.

use std::fmt::Write;
use std::path::Path;

use super::html::{self, add_table, escape, figure};
use super::markdown::{self, Table, range};
use super::plot::{self, Series};
use super::write_files;
use crate::{Comparison, ComparisonRow, ReportsReport};
use steradian::{Error, Result};

const TITLE: &str = "What reports say of accelerators, repeated";

impl ReportsReport {
    /// As JSON.
    ///
    /// # Errors
    /// None in practice.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// Tables, each with where the figures are from and the sentences that explain its ratios.
    pub fn markdown(&self) -> String {
        let mut out = format!("# {TITLE}\n\n{}\n", header(self));
        for comparison in &self.comparisons {
            let _ = writeln!(out, "\n## {}\n\nReported: {}\n", comparison.title, comparison.claim);
            for source in &comparison.sources {
                let _ = writeln!(out, "- {source}");
            }
            markdown::add(&mut out, &table(comparison));
            out.push('\n');
            for reason in &comparison.reasons {
                let _ = writeln!(out, "- {reason}");
            }
        }
        out
    }

    /// One page with plots.
    ///
    /// # Errors
    /// If a plot cannot be drawn.
    pub fn html(&self) -> Result<String> {
        let mut out = html::begin(TITLE, &header(self));
        for comparison in &self.comparisons {
            let _ =
                write!(out, "<h2>{}</h2>\n<p>Reported: {}</p>\n", escape(comparison.title), escape(comparison.claim));
            add_list(&mut out, &comparison.sources);
            let caption =
                "How many times faster than the first accelerator, within the accelerator, on a logarithmic axis.";
            figure(&mut out, &ratios(comparison)?, caption);
            add_table(&mut out, &table(comparison));
            add_list(&mut out, &comparison.reasons);
        }
        out.push_str(html::END);
        Ok(out)
    }

    /// Writes `reports.json`, `reports.md` and `reports.html` into a folder, which is made if it does not exist.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    pub fn write_to(&self, folder: &Path) -> Result<()> {
        write_files(
            folder,
            &[("reports.json", self.json()?), ("reports.md", self.markdown()), ("reports.html", self.html()?)],
        )
    }
}

fn header(report: &ReportsReport) -> String {
    let m = &report.machine;
    let load = m.load.map_or(String::new(), |load| format!(", load {load:.2} before"));
    let [width, height] = report.size;
    format!(
        "{} ({}{load}), steradian {}. Frames of {width}x{height}, one sample a pixel, one thread: pictures of normals \
         (one camera ray a pixel), and path tracing of the mesh on a floor under a sky and a sun (up to 5 segments, \
         shadow rays). Medians of frames in turn.",
        m.processor, m.instruction_set, m.version
    )
}

fn add_list(out: &mut String, lines: &[String]) {
    let items: String = lines.iter().map(|line| format!("<li>{}</li>\n", escape(line))).collect();
    let _ = write!(out, "<ul>\n{items}</ul>\n");
}

/// How many times faster than the first accelerator each is, within the accelerator.
fn times_faster(comparison: &Comparison, accel_seconds: fn(&ComparisonRow) -> f64) -> Vec<f64> {
    let first = comparison.rows.first().map_or(f64::NAN, accel_seconds);
    comparison.rows.iter().map(|row| first / accel_seconds(row)).collect()
}

fn ratios(comparison: &Comparison) -> Result<String> {
    let kinds = [
        times_faster(comparison, |row| row.normals.accel_seconds),
        times_faster(comparison, |row| row.paths.accel_seconds),
    ];
    let bar = |ratio: f64| Some([ratio; 3]).filter(|_| ratio.is_finite() && ratio > 0.0);
    let series = |(i, row): (usize, &ComparisonRow)| Series {
        name: row.name.clone(),
        values: kinds.iter().map(|kind| bar(kind[i])).collect(),
    };
    let series: Vec<_> = comparison.rows.iter().enumerate().map(series).collect();
    plot::log_bars(&["normals", "path traced"], &series, "times faster")
}

fn table(comparison: &Comparison) -> Table {
    let heads = [
        "accelerator",
        "reported",
        "build ms",
        "normals: frame s",
        "accelerator s",
        "times faster",
        "path traced: frame s",
        "accelerator s",
        "times faster",
        "triangles per ray",
        "different pixels",
    ];
    let [of_normals, of_paths] = [
        times_faster(comparison, |row| row.normals.accel_seconds),
        times_faster(comparison, |row| row.paths.accel_seconds),
    ];
    let rows = comparison.rows.iter().enumerate().map(|(i, row)| {
        let frame = |timing: &crate::FrameTiming| {
            let scaled = timing.scaled_from.map_or(String::new(), |[w, h]| format!(", from {w}x{h}"));
            format!("{}{scaled}", range(timing.frame_seconds))
        };
        vec![
            row.name.clone(),
            row.reported.unwrap_or("").to_owned(),
            format!("{:.2}", row.build_milliseconds),
            frame(&row.normals),
            format!("{:.4}", row.normals.accel_seconds),
            format!("{:.1}", of_normals[i]),
            frame(&row.paths),
            format!("{:.4}", row.paths.accel_seconds),
            format!("{:.1}", of_paths[i]),
            row.tests_per_ray.map_or("-".to_owned(), |tests| format!("{tests:.1}")),
            row.different_pixels.to_string(),
        ]
    });
    let title = format!(
        "{} triangles; times faster: the first line's time within the accelerator over this one's; triangles per ray \
         and different pixels are of normals.",
        comparison.triangles
    );
    Table { title, heads: heads.map(str::to_owned).to_vec(), rows: rows.collect() }
}
