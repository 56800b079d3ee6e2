//! One page with everything, without a single address.

use std::fmt::Write;

use super::Report;
use super::markdown::{self, Table};
use super::plot::{self, Curve, Series};
use crate::printable;
use crate::{Mode, RayKind, SceneReport};
use steradian::Result;

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8884; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13px; }
.wide { overflow-x: auto; margin: .5rem 0 1.5rem; }
th, td { padding: .25rem .6rem; border-bottom: 1px solid var(--line); text-align: left; white-space: nowrap; }
th { position: sticky; top: 0; background: Canvas; }
td:not(:first-child) { font-variant-numeric: tabular-nums; }
figure { margin: 1rem 0; } svg { max-width: 100%; height: auto; border-radius: 6px; } \
figcaption { opacity: .8; font-size: 13px; }
code { overflow-wrap: anywhere; }";

/// Text with the characters of markup, and those that nobody sees, written out.
pub fn escape(text: &str) -> String {
    printable::lines(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// A page down to the line with the machine of the measurement.
pub fn begin(title: &str, header: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<h1>{title}</h1>\n<p>{}</p>\n",
        escape(header)
    )
}

/// What ends a page.
pub const END: &str = "</body>\n</html>\n";

pub fn write(report: &Report) -> Result<String> {
    let mut out = begin("Accelerators", &markdown::header(report));
    for scene in &report.scenes {
        add_scene(&mut out, scene)?;
    }
    if let (Some(scaling), Some(table)) = (&report.scaling, markdown::scaling(report)) {
        let names: Vec<&String> = scaling.slopes.iter().map(|(name, ..)| name).collect();
        let curve = |name: &str, slope: f64, cost: fn(&crate::ScalingPoint) -> f64| Curve {
            name: format!("{name} (slope {slope:.2})"),
            points: scaling.points.iter().filter(|p| p.accel == name).map(|p| (p.triangles as f64, cost(p))).collect(),
        };
        let slope = |name: &str| {
            scaling.slopes.iter().find(|(n, ..)| n == name).map_or((0.0, 0.0), |(_, rays, builds)| (*rays, *builds))
        };
        let of_rays: Vec<_> = names.iter().map(|name| curve(name, slope(name).0, |p| p.nanoseconds_per_ray)).collect();
        let of_builds: Vec<_> = names.iter().map(|name| curve(name, slope(name).1, |p| p.build_milliseconds)).collect();
        out.push_str("<h2>Growth</h2>\n");
        figure(
            &mut out,
            &plot::curves(&of_rays, "triangles", "ns per ray", &[])?,
            "Time per ray, incoherent rays, one thread.",
        );
        figure(
            &mut out,
            &plot::curves(&of_builds, "triangles", "ms to build", &[])?,
            "Time to build with all threads.",
        );
        add_table(&mut out, &table);
    }
    out.push_str(END);
    Ok(out)
}

fn add_scene(out: &mut String, scene: &SceneReport) -> Result<()> {
    let _ = write!(out, "<h2>{}</h2>\n<p>{}</p>\n", escape(&scene.scene), escape(&markdown::scene_line(scene)));
    let kinds: Vec<RayKind> = scene.rays.iter().map(|(kind, _)| *kind).collect();
    let groups: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
    figure(
        out,
        &plot::bars(&groups, &rates(scene, &kinds), "Mrays/s")?,
        "One thread; whiskers from the lowest to the highest round.",
    );
    for kind in [RayKind::FirstBounce, RayKind::Camera] {
        if let Some((svg, caption)) = break_even(scene, kind)? {
            figure(out, &svg, &caption);
            break;
        }
    }
    for table in markdown::tables(scene) {
        add_table(out, &table);
    }
    let lines = markdown::disagreements(scene);
    if !lines.is_empty() {
        out.push_str("<h3>Disagreements</h3>\n<ul>\n");
        for line in lines {
            let _ = writeln!(out, "<li><code>{}</code></li>", escape(&line));
        }
        out.push_str("</ul>\n");
    }
    Ok(())
}

/// Single rays of every accelerator, and batches where there are any.
fn rates(scene: &SceneReport, kinds: &[RayKind]) -> Vec<Series> {
    let mut series = Vec::new();
    for accel in &scene.accels {
        for mode in [Mode::Single, Mode::Batch, Mode::CoherentBatch] {
            let value = |kind: &RayKind| {
                let report = accel.kinds.iter().find(|k| k.kind == *kind)?;
                let rate = report.rates.iter().find(|r| r.mode == mode && r.threads == 1)?;
                Some(rate.mrays_per_second)
            };
            let values: Vec<_> = kinds.iter().map(value).collect();
            if values.iter().any(Option::is_some) {
                let name =
                    if mode == Mode::Single { accel.name.clone() } else { format!("{}, {}", accel.name, mode.name()) };
                series.push(Series { name, values });
            }
        }
    }
    series
}

/// Time to build and then trace a number of rays, on one thread each, with the numbers at which one accelerator
/// overtakes another.
fn break_even(scene: &SceneReport, kind: RayKind) -> Result<Option<(String, String)>> {
    let mut lines = Vec::new();
    for accel in &scene.accels {
        let build = accel.builds.iter().find(|b| b.threads == 1).map(|b| b.milliseconds[0] * 1e-3);
        let report = accel.kinds.iter().find(|k| k.kind == kind);
        let rate = report
            .and_then(|k| k.rates.iter().find(|r| r.mode == Mode::Single && r.threads == 1))
            .map(|r| r.mrays_per_second[0] * 1e6);
        if let (Some(build), Some(rate)) = (build, rate.filter(|r| *r > 0.0)) {
            lines.push((accel.name.clone(), Cost { build, per_ray: 1.0 / rate }));
        }
    }
    if lines.is_empty() {
        return Ok(None);
    }
    let (first, last) = (1e3, 1e10);
    let mut marks = Vec::new();
    let mut crossings = Vec::new();
    for (i, a) in lines.iter().enumerate() {
        for b in &lines[i + 1..] {
            if let Some(n) = crossing(a.1, b.1).filter(|n| (first..last).contains(n)) {
                marks.push((n, a.1.of_rays(n)));
                let (slow, fast) = if a.1.per_ray < b.1.per_ray { (b, a) } else { (a, b) };
                crossings.push(format!("{} overtakes {} at {n:.2e} rays", fast.0, slow.0));
            }
        }
    }
    let curves: Vec<_> = lines
        .iter()
        .map(|(name, cost)| Curve {
            name: name.clone(),
            points: (0..=70).map(|i| first * 10f64.powf(f64::from(i) / 10.0)).map(|n| (n, cost.of_rays(n))).collect(),
        })
        .collect();
    let svg = plot::curves(&curves, "rays", "seconds to build and trace", &marks)?;
    let ends = if crossings.is_empty() { "no lines cross".to_owned() } else { crossings.join("; ") };
    Ok(Some((svg, format!("Build and trace {} rays on one thread: {ends}.", kind.name()))))
}

/// Seconds of an accelerator.
#[derive(Clone, Copy)]
struct Cost {
    build: f64,
    per_ray: f64,
}

impl Cost {
    fn of_rays(self, n: f64) -> f64 {
        self.build + n * self.per_ray
    }
}

/// The number of rays after which `build + rays * per_ray` is the same for both; `None` if it never is.
fn crossing(a: Cost, b: Cost) -> Option<f64> {
    let n = (b.build - a.build) / (a.per_ray - b.per_ray);
    (n.is_finite() && n > 0.0).then_some(n)
}

/// Adds a plot with its caption.
pub fn figure(out: &mut String, svg: &str, caption: &str) {
    let _ = write!(out, "<figure>\n{svg}\n<figcaption>{}</figcaption>\n</figure>\n", escape(caption));
}

/// Adds a table below its title.
pub fn add_table(out: &mut String, table: &Table) {
    let cells = |tag: &str, row: &[String]| {
        row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect::<String>()
    };
    let _ = write!(
        out,
        "<h3>{}</h3>\n<div class=\"wide\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n",
        escape(&table.title),
        cells("th", &table.heads)
    );
    for row in &table.rows {
        let _ = writeln!(out, "<tr>{}</tr>", cells("td", row));
    }
    out.push_str("</tbody>\n</table></div>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_no_markup() {
        let strange = "</title><script>alert('x')</script>\" onload=\"&\u{1b}";
        assert_eq!(
            escape(strange),
            "&lt;/title&gt;&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot; onload=&quot;&amp;\\u001b"
        );
        let mut page = begin(&escape(strange), strange);
        let table = Table { title: strange.into(), heads: vec![strange.into()], rows: vec![vec![strange.into()]] };
        add_table(&mut page, &table);
        figure(
            &mut page,
            &plot::curves(
                &[Curve { name: strange.into(), points: vec![(1.0, 2.0), (2.0, 3.0)] }],
                strange,
                strange,
                &[],
            )
            .unwrap(),
            strange,
        );
        assert!(
            !page.contains("<script") && !page.contains("onload=\"") && page.matches("</title>").count() == 1,
            "{page}"
        );
    }

    #[test]
    fn lines_cross_where_both_have_cost_the_same() {
        let crossing = |a: [f64; 2], b: [f64; 2]| {
            let [a, b] = [a, b].map(|[build, per_ray]| Cost { build, per_ray });
            crossing(a, b)
        };
        assert_eq!(crossing([0.0, 2.0], [10.0, 1.0]), Some(10.0));
        assert_eq!(crossing([0.0, 1.0], [10.0, 2.0]), None);
        assert_eq!(crossing([5.0, 1.0], [10.0, 1.0]), None);
    }
}
