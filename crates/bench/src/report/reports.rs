//! The report of `bench reports`.

use super::{Dots, Drawing, Figure, Page, Report, Section, Table, interrupted, or_dash, range};
use crate::{Comparison, ComparisonRow, FrameTiming, ReportsReport};

impl Report for ReportsReport {
    const NAME: &'static str = "reports";

    fn page(&self) -> Page {
        let mut page = Page::new("What reports say of accelerators, repeated", &self.machine, &self.spent);
        page.verdict = self.verdict();
        page.warnings.extend(interrupted(self.interrupted));
        let [width, height] = self.size;
        page.facts.push(("Frames", format!("{width}x{height}, one sample a pixel, one thread")));
        page.notes = vec![
            "Pictures of normals have one camera ray a pixel; path traced ones show the mesh on a floor under a sky \
             and a sun (up to 5 segments, shadow rays). Times are medians of frames in turn (lowest to highest)."
                .to_owned(),
            "Times faster: the first line's time within the accelerator over this one's. Triangles per ray and \
             different pixels are of normals."
                .to_owned(),
        ];
        page.sections.extend(self.comparisons.iter().map(of_comparison));
        page
    }
}

impl ReportsReport {
    /// How many times faster than the linear loop the report's accelerator is here, and what it was said to be.
    fn verdict(&self) -> String {
        let part = |comparison: &Comparison| {
            let ratios = times_faster(comparison, |row| row.normals.accel_seconds);
            let quoted = |(row, ratio): (&ComparisonRow, &f64)| {
                let reported = row.reported.filter(|_| ratio.is_finite())?;
                Some(format!("{} {ratio:.1}x (reported: {reported})", row.name))
            };
            let quoted: Vec<String> = comparison.rows.iter().zip(&ratios).skip(1).filter_map(quoted).collect();
            (!quoted.is_empty()).then(|| format!("{}: {}", comparison.title, quoted.join(", ")))
        };
        let parts: Vec<String> = self.comparisons.iter().filter_map(part).collect();
        if parts.is_empty() {
            return "Nothing was measured.".to_owned();
        }
        format!("Speed over the linear loop, within the accelerator. {}.", parts.join("; "))
    }
}

/// How many times faster than the first accelerator each is, within the accelerator.
fn times_faster(comparison: &Comparison, accel_seconds: fn(&ComparisonRow) -> f64) -> Vec<f64> {
    let first = comparison.rows.first().map_or(f64::NAN, accel_seconds);
    comparison.rows.iter().map(|row| first / accel_seconds(row)).collect()
}

fn of_comparison(comparison: &Comparison) -> Section {
    let [of_normals, of_paths] = [
        times_faster(comparison, |row| row.normals.accel_seconds),
        times_faster(comparison, |row| row.paths.accel_seconds),
    ];
    let group = |name: &str, ratios: &[f64]| {
        let rows = comparison.rows.iter().zip(ratios).filter(|(_, ratio)| ratio.is_finite() && **ratio > 0.0);
        (name.to_owned(), rows.map(|(row, ratio)| (row.name.clone(), [*ratio; 3])).collect())
    };
    let groups = vec![group("normals", &of_normals), group("path traced", &of_paths)];
    let dots = Dots { unit: "times faster".to_owned(), groups, mark: Some(1.0) };
    let caption = "How many times faster than the first accelerator, within the accelerator.".to_owned();
    let text = std::iter::once(format!("Reported: {}", comparison.claim)).chain(comparison.sources.iter().cloned());
    Section {
        title: comparison.title.to_owned(),
        text: text.collect(),
        figures: vec![Figure { caption, drawing: Drawing::Dots(dots) }],
        tables: vec![table(comparison, &of_normals, &of_paths)],
        remarks: comparison.reasons.clone(),
    }
}

fn table(comparison: &Comparison, of_normals: &[f64], of_paths: &[f64]) -> Table {
    let mut table = Table::new(
        format!("{} triangles", comparison.triangles),
        "accelerator | reported | build ms | normals: frame s | processor s | accelerator s | times faster | path \
         traced: frame s | processor s | accelerator s | times faster | triangles per ray | different pixels",
    );
    for ((row, of_normals), of_paths) in comparison.rows.iter().zip(of_normals).zip(of_paths) {
        let cells = |timing: &FrameTiming, ratio: f64| {
            let scaled = timing.scaled_from.map_or(String::new(), |[w, h]| format!(", from {w}x{h}"));
            [
                format!("{}{scaled}", range(timing.frame_seconds)),
                format!("{:.3}", timing.processor_seconds),
                format!("{:.4}", timing.accel_seconds),
                format!("{ratio:.1}"),
            ]
        };
        let lead =
            [row.name.clone(), or_dash(row.reported.map(str::to_owned)), format!("{:.2}", row.build_milliseconds)];
        let tests = or_dash(row.tests_per_ray.map(|tests| format!("{tests:.1}")));
        let end = [tests, row.different_pixels.to_string()];
        table.rows.push([&lead[..], &cells(&row.normals, *of_normals), &cells(&row.paths, *of_paths), &end].concat());
    }
    table
}
