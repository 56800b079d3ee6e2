//! Tables.

use std::fmt::Write;

use super::Report;
use crate::{AccelReport, Mode, SceneReport};

/// A table by its heads and rows.
pub struct Table {
    pub title: String,
    pub heads: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

pub fn write(report: &Report) -> String {
    let mut out = format!("# Accelerators\n\n{}\n", header(report));
    for scene in &report.scenes {
        let _ = write!(out, "\n## {}\n\n{}\n", scene.scene, scene_line(scene));
        for table in tables(scene) {
            add(&mut out, &table);
        }
        for line in disagreements(scene) {
            let _ = writeln!(out, "- {line}");
        }
    }
    if let Some(table) = scaling(report) {
        out.push_str("\n## Growth\n");
        add(&mut out, &table);
    }
    out
}

/// Where and how it was measured.
pub fn header(report: &Report) -> String {
    format!(
        "{}; `{}`. Rates are medians of interleaved rounds after a warm-up, in millions of rays per \
         second; SAH cost: 1 a node, 1 a primitive; EPO: end-point overlap.",
        report.machine.line(),
        report.command
    )
}

/// What the scene is.
pub fn scene_line(scene: &SceneReport) -> String {
    let rays: Vec<_> = scene.rays.iter().map(|(kind, count)| format!("{count} {}", kind.name())).collect();
    let absent: Vec<_> = scene.absent.iter().map(|kind| kind.name()).collect();
    let absent =
        if absent.is_empty() { String::new() } else { format!("; the scene has no {} rays", absent.join(" and no ")) };
    let cut = if scene.interrupted { " Interrupted: what is missing was not measured." } else { "" };
    format!(
        "{} primitives, {} instances. Rays: {}{absent}. Answers compared with: {}.{cut}",
        scene.primitives,
        scene.instances,
        rays.join(", "),
        scene.oracle
    )
}

/// All tables of a scene.
pub fn tables(scene: &SceneReport) -> Vec<Table> {
    vec![rates(scene), work(scene), structures(scene), agreement(scene)]
}

fn heads(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn rates(scene: &SceneReport) -> Table {
    let kinds: Vec<_> = scene.rays.iter().map(|(kind, _)| *kind).collect();
    let mut rows = Vec::new();
    for accel in &scene.accels {
        for mode in [Mode::Single, Mode::Batch, Mode::CoherentBatch] {
            for threads in accel.builds.iter().map(|b| b.threads) {
                let cells: Vec<Option<String>> = kinds.iter().map(|kind| rate(accel, *kind, mode, threads)).collect();
                if cells.iter().any(Option::is_some) {
                    let lead = [accel.name.clone(), mode.name().to_owned(), threads.to_string()];
                    rows.push(lead.into_iter().chain(cells.into_iter().map(Option::unwrap_or_default)).collect());
                }
            }
        }
    }
    let names = ["accelerator", "handed over as", "threads"].into_iter().chain(kinds.iter().map(|kind| kind.name()));
    Table { title: "Mrays/s: median (lowest to highest)".into(), heads: names.map(str::to_owned).collect(), rows }
}

fn rate(accel: &AccelReport, kind: crate::RayKind, mode: Mode, threads: usize) -> Option<String> {
    let report = accel.kinds.iter().find(|k| k.kind == kind)?;
    let rate = report.rates.iter().find(|r| r.mode == mode && r.threads == threads)?;
    let [median, low, high] = rate.mrays_per_second;
    let digits = if median < 0.1 { 4 } else { 2 };
    Some(format!("{median:.digits$} ({low:.digits$} to {high:.digits$})"))
}

fn work(scene: &SceneReport) -> Table {
    let kinds: Vec<_> = scene.rays.iter().map(|(kind, _)| *kind).collect();
    let cell = |accel: &AccelReport, kind| {
        let report = accel.kinds.iter().find(|k| k.kind == kind);
        let both = report.and_then(|k| Some((k.nodes_per_ray?, k.prims_per_ray?)));
        both.map_or("not open".to_owned(), |(nodes, prims)| format!("{nodes:.1} + {prims:.1}"))
    };
    let rows = scene.accels.iter().map(|accel| {
        let cells = kinds.iter().map(|&kind| cell(accel, kind));
        std::iter::once(accel.name.clone()).chain(cells).collect()
    });
    let names = std::iter::once("accelerator").chain(kinds.iter().map(|kind| kind.name()));
    Table {
        title: "Nodes + primitives per ray".into(),
        heads: names.map(str::to_owned).collect(),
        rows: rows.collect(),
    }
}

fn structures(scene: &SceneReport) -> Table {
    let row = |accel: &AccelReport| {
        let per_prim = |bytes: f64| format!("{:.1}", bytes / scene.primitives.max(1) as f64);
        let builds = accel
            .builds
            .iter()
            .map(|b| format!("{:.1} ({} threads, {:.2} Mprims/s)", b.milliseconds[0], b.threads, b.mprims_per_second));
        let mut cells = vec![
            accel.name.clone(),
            accel.description.clone(),
            builds.collect::<Vec<_>>().join(", "),
            per_prim(accel.bytes as f64),
            accel.peak_build_bytes.map_or_else(|| "unknown".into(), |bytes| format!("{:.1}", bytes as f64 / 1e6)),
        ];
        match &accel.structure {
            None => cells.extend(std::iter::repeat_n("not open".to_owned(), 6)),
            Some(s) => cells.extend([
                s.nodes.to_string(),
                format!("{} ({} empty)", s.leaves, s.empty_leaves),
                s.depth.to_string(),
                format!("{:.2} (at most {})", s.mean_leaf, s.max_leaf),
                format!("{:.1}", s.sah_cost),
                s.epo.map_or_else(|| "undefined".into(), |epo| format!("{epo:.2}")),
            ]),
        }
        cells
    };
    Table {
        title: "Builds and structures".into(),
        heads: heads(&[
            "accelerator",
            "what it is",
            "build ms",
            "bytes per primitive",
            "peak of a build, MB",
            "nodes",
            "leaves",
            "depth",
            "items per leaf",
            "SAH cost",
            "EPO",
        ]),
        rows: scene.accels.iter().map(row).collect(),
    }
}

fn agreement(scene: &SceneReport) -> Table {
    let rows = scene.accels.iter().flat_map(|accel| {
        accel.kinds.iter().map(|kind| {
            let a = &kind.agreement;
            let counts = [a.rays, a.identical, a.within_bound, a.ties, a.different].map(|n| n.to_string());
            [accel.name.clone(), kind.kind.name().to_owned()].into_iter().chain(counts).collect()
        })
    });
    let names = [
        "accelerator",
        "rays",
        "compared",
        "identical",
        "same primitive within the bound",
        "tie within the bound",
        "different",
    ];
    Table { title: "Agreement".into(), heads: heads(&names), rows: rows.collect() }
}

/// The disagreements kept, one line each.
pub fn disagreements(scene: &SceneReport) -> Vec<String> {
    let mut lines = Vec::new();
    for accel in &scene.accels {
        for kind in &accel.kinds {
            for d in &kind.agreement.first {
                let name = kind.kind.name();
                lines.push(format!(
                    "{}, {name}: expected {}, found {}; replay with `--ray={}`",
                    accel.name, d.expected, d.found, d.ray
                ));
            }
        }
    }
    lines
}

/// Cost over the number of triangles.
pub fn scaling(report: &Report) -> Option<Table> {
    let scaling = report.scaling.as_ref()?;
    let slope = |name: &str| scaling.slopes.iter().find(|(n, ..)| n == name);
    let rows = scaling.points.iter().map(|p| {
        let slopes = slope(&p.accel)
            .map_or_else(Default::default, |(_, rays, builds)| [format!("{rays:.3}"), format!("{builds:.3}")]);
        let cells = [
            p.accel.clone(),
            p.triangles.to_string(),
            format!("{:.2}", p.build_milliseconds),
            format!("{:.1}", p.nanoseconds_per_ray),
            format!("{:.1}", p.bytes_per_triangle),
        ];
        cells.into_iter().chain(slopes).collect()
    });
    let names = [
        "accelerator",
        "triangles",
        "build ms",
        "ns per ray",
        "bytes per triangle",
        "slope of rays",
        "slope of builds",
    ];
    Some(Table { title: "Cost over the number of triangles".into(), heads: heads(&names), rows: rows.collect() })
}

/// Adds a table below its title.
pub fn add(out: &mut String, table: &Table) {
    let line = |cells: &[String]| {
        format!("| {} |\n", cells.iter().map(|c| c.replace('|', "\\|")).collect::<Vec<_>>().join(" | "))
    };
    let _ = write!(out, "\n{}\n\n{}|{}\n", table.title, line(&table.heads), "---|".repeat(table.heads.len()));
    for row in &table.rows {
        out.push_str(&line(row));
    }
}

/// The middle, and the ends if they differ from it.
pub fn range([median, low, high]: [f64; 3]) -> String {
    let [median, low, high] = [median, low, high].map(number);
    if low == high { median } else { format!("{median} ({low} to {high})") }
}

/// Three digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (256.0, "256"),
            (1234.6, "1235"),
            (0.012345, "0.0123"),
            (0.5, "0.5"),
            (-2.0, "-2"),
            (3.2e-5, "3.20e-5"),
            (9.999, "10"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!((range([1.0, 1.0, 1.0]), range([1.0, 0.5, 2.0])), ("1".to_owned(), "1 (0.5 to 2)".to_owned()));
    }
}
