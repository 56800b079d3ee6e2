//! The report of `bench accel`.

use serde::Serialize;

use super::{
    Curve, Curves, DotRow, Dots, Drawing, Figure, Page, Picture, Report, Section, Table, count, heat, interrupted,
    number, or_dash,
};
use crate::{
    AccelReport, BuildReport, Machine, Mode, NodeMap, RayKind, ScalingPoint, ScalingReport, SceneReport, Spent,
};

/// Everything a benchmark of accelerators has found.
#[derive(Clone, Debug, Serialize)]
pub struct AccelsReport {
    /// Where it ran.
    pub machine: Machine,
    /// The command that ran it.
    pub command: String,
    /// One for each scene.
    pub scenes: Vec<SceneReport>,
    /// Cost over the number of triangles, if requested.
    pub scaling: Option<ScalingReport>,
}

const MODES: [Mode; 3] = [Mode::Single, Mode::Batch, Mode::CoherentBatch];

impl Report for AccelsReport {
    const NAME: &'static str = "accel";

    fn page(&self) -> Page {
        let mut spent = Spent::default();
        self.scenes.iter().for_each(|scene| spent.add(scene.spent));
        self.scaling.iter().for_each(|scaling| spent.add(scaling.spent));
        let mut page = Page::new("Accelerators", &self.machine, &spent);
        page.verdict = self.verdict();
        page.warnings.extend(interrupted(self.scenes.iter().any(|scene| scene.interrupted)));
        page.facts.push(("Command", format!("`{}`", self.command)));
        page.notes = vec![
            "Rates are medians of interleaved rounds after a warm-up, in millions of rays per second; whiskers go from \
             the lowest to the highest round. Every accelerator traces the same rays."
                .to_owned(),
            "SAH cost: 1 a node, 1 a primitive. EPO: end-point overlap, the expected work done in vain around a point \
             of a surface. Structures of Embree are closed."
                .to_owned(),
        ];
        page.sections.extend(self.scenes.iter().map(of_scene));
        page.sections.extend(self.scaling.iter().map(of_scaling));
        page
    }

    /// One line for each scene, accelerator, kind of ray, mode and number of threads.
    fn sheet(&self) -> Option<Table> {
        let mut sheet = Table::new(
            "",
            "scene | primitives | accelerator | description | ray_kind | rays | mode | threads | \
             mrays_per_second_median | mrays_per_second_min | mrays_per_second_max | nodes_per_ray | prims_per_ray | \
             build_ms_all_threads | bytes | identical | within_bound | ties | different",
        );
        let digits = |n: Option<f64>| n.map_or(String::new(), |n| format!("{n:.3}"));
        for (scene, accel) in self.scenes.iter().flat_map(|scene| scene.accels.iter().map(move |accel| (scene, accel)))
        {
            let of_accel =
                [&scene.scene, &scene.primitives.to_string(), &accel.name, &accel.description].map(Clone::clone);
            let build = accel.builds.last().map_or(0.0, |b| b.milliseconds[0]);
            for kind in &accel.kinds {
                let a = &kind.agreement;
                let counts = [accel.bytes, a.identical, a.within_bound, a.ties, a.different].map(|n| n.to_string());
                for rate in &kind.rates {
                    let how = [kind.kind.name(), &kind.rays.to_string(), rate.mode.name(), &rate.threads.to_string()]
                        .map(str::to_owned);
                    let work = [digits(kind.nodes_per_ray), digits(kind.prims_per_ray), format!("{build:.3}")];
                    let rates = rate.mrays_per_second.map(|rate| format!("{rate:.4}"));
                    sheet.rows.push([&of_accel[..], &how, &rates, &work, &counts].concat());
                }
            }
        }
        Some(sheet)
    }
}

impl AccelsReport {
    fn verdict(&self) -> String {
        let agreements = || self.scenes.iter().flat_map(|s| &s.accels).flat_map(|a| &a.kinds).map(|k| &k.agreement);
        let (compared, different) =
            (agreements().map(|a| a.rays).sum::<usize>(), agreements().map(|a| a.different).sum());
        let mut parts: Vec<String> = self.scenes.iter().filter_map(fastest).collect();
        if compared > 0 {
            let of = count(compared as f64);
            parts.push(match different {
                0 => format!("all {of} answers agree with the oracle's"),
                1 => format!("1 of {of} answers differs from the oracle's"),
                n => format!("{} of {of} answers differ from the oracle's", count(n as f64)),
            });
        }
        let slopes = self.scaling.iter().flat_map(|scaling| &scaling.slopes);
        if let Some((name, slope, _)) = slopes.min_by(|a, b| a.1.total_cmp(&b.1)) {
            parts.push(format!("the time per ray grows least with {name} (slope {slope:.2})"));
        }
        if parts.is_empty() { "Nothing was measured.".to_owned() } else { format!("{}.", parts.join("; ")) }
    }
}

/// The fastest accelerator of a scene by single rays on one thread, and how far ahead it is.
fn fastest(scene: &SceneReport) -> Option<String> {
    let kind =
        [RayKind::FirstBounce, RayKind::Camera].into_iter().find(|kind| scene.rays.iter().any(|r| r.0 == *kind))?;
    let mut rates: Vec<(f64, &str)> =
        scene.accels.iter().filter_map(|a| Some((rate(a, kind, Mode::Single, 1)?[0], a.name.as_str()))).collect();
    rates.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (best, name) = *rates.first()?;
    let ahead = rates.get(1).map_or(String::new(), |(rate, next)| format!(", {:.2}x {next}", best / rate));
    let kind = kind.name();
    Some(format!(
        "{}: {name} is the fastest by {kind} rays ({} Mrays/s on one thread{ahead})",
        scene.scene,
        number(best)
    ))
}

fn rate(accel: &AccelReport, kind: RayKind, mode: Mode, threads: usize) -> Option<[f64; 3]> {
    let report = accel.kinds.iter().find(|k| k.kind == kind)?;
    Some(report.rates.iter().find(|r| r.mode == mode && r.threads == threads)?.mrays_per_second)
}

fn of_scene(scene: &SceneReport) -> Section {
    let rates = Dots { unit: "Mrays/s, one thread".to_owned(), groups: rates_of_one_thread(scene), mark: None };
    let mut figures = vec![Figure {
        caption: "Rates on one thread; the further right the faster.".to_owned(),
        drawing: Drawing::Dots(rates),
    }];
    figures.extend([RayKind::FirstBounce, RayKind::Camera].into_iter().find_map(|kind| break_even(scene, kind)));
    figures.extend(node_maps(scene));
    Section {
        title: scene.scene.clone(),
        text: vec![scene_line(scene)],
        figures,
        tables: vec![rates_table(scene), work(scene), structures(scene), agreement(scene)],
        remarks: disagreements(scene),
    }
}

/// What the scene is.
fn scene_line(scene: &SceneReport) -> String {
    let rays: Vec<_> = scene.rays.iter().map(|(kind, n)| format!("{} {}", count(*n as f64), kind.name())).collect();
    let absent: Vec<_> = scene.absent.iter().map(|kind| kind.name()).collect();
    let absent =
        if absent.is_empty() { String::new() } else { format!("; the scene has no {} rays", absent.join(" and no ")) };
    format!(
        "{} primitives, {} instances. Rays: {}{absent}. Answers compared with: {}.",
        count(scene.primitives as f64),
        count(scene.instances as f64),
        rays.join(", "),
        scene.oracle
    )
}

/// Single rays of every accelerator, and batches where there are any, by kind of ray.
fn rates_of_one_thread(scene: &SceneReport) -> Vec<(String, Vec<DotRow>)> {
    let rows = |kind: RayKind| {
        let row = |accel: &AccelReport, mode: Mode| {
            let how = if mode == Mode::Single { String::new() } else { format!(", {}", mode.name()) };
            Some((format!("{}{how}", accel.name), rate(accel, kind, mode, 1)?))
        };
        let row = &row;
        scene.accels.iter().flat_map(|accel| MODES.into_iter().filter_map(move |mode| row(accel, mode))).collect()
    };
    scene.rays.iter().map(|(kind, _)| (format!("{} rays", kind.name()), rows(*kind))).collect()
}

/// Nodes visited by camera rays, all accelerators on one scale.
fn node_maps(scene: &SceneReport) -> Option<Figure> {
    let maps: Vec<(&str, &NodeMap)> =
        scene.accels.iter().filter_map(|accel| Some((accel.name.as_str(), accel.node_map.as_ref()?))).collect();
    let mut all: Vec<u64> = maps.iter().flat_map(|(_, map)| map.nodes.iter().copied()).collect();
    all.sort_unstable();
    // A few rays along edges visit many times as many nodes.
    let white = *all.get(all.len().saturating_sub(1).min(all.len() * 995 / 1000)).filter(|most| **most > 0)?;
    let picture = |(name, map): &(&str, &NodeMap)| -> Option<Picture> {
        let mean = map.nodes.iter().sum::<u64>() as f64 / map.nodes.len() as f64;
        let most = map.nodes.iter().max().copied().unwrap_or(0);
        let name = format!("{name}: {mean:.1} nodes per ray, {most} at most");
        heat(name, map.size, u32::MAX, |i| map.nodes[i] as f32 / white as f32).ok()
    };
    let pictures: Vec<Picture> = maps.iter().filter_map(picture).collect();
    let caption = format!(
        "Nodes visited by the camera ray through the middle of each pixel: black none, white {white} or more, on one \
         scale for all."
    );
    Some(Figure { caption, drawing: Drawing::Pictures(pictures) })
}

/// Time to build and then trace a number of rays, on one thread each, with the numbers at which one accelerator
/// overtakes another.
fn break_even(scene: &SceneReport, kind: RayKind) -> Option<Figure> {
    let cost = |accel: &AccelReport| {
        let build = accel.builds.iter().find(|b| b.threads == 1)?.milliseconds[0] * 1e-3;
        let rate = rate(accel, kind, Mode::Single, 1).filter(|rate| rate[0] > 0.0)?;
        Some((accel.name.clone(), Cost { build, per_ray: 1e-6 / rate[0] }))
    };
    let lines: Vec<(String, Cost)> = scene.accels.iter().filter_map(cost).collect();
    if lines.is_empty() {
        return None;
    }
    let (first, last) = (1e3, 1e10);
    let (mut marks, mut crossings) = (Vec::new(), Vec::new());
    for (i, a) in lines.iter().enumerate() {
        for b in &lines[i + 1..] {
            if let Some(n) = crossing(a.1, b.1).filter(|n| (first..last).contains(n)) {
                marks.push((n, a.1.of_rays(n)));
                let (slow, fast) = if a.1.per_ray < b.1.per_ray { (b, a) } else { (a, b) };
                crossings.push(format!("{} overtakes {} at {n:.2e} rays", fast.0, slow.0));
            }
        }
    }
    let curve = |(name, cost): &(String, Cost)| {
        let rays = (0..=70).map(|i| first * 10f64.powf(f64::from(i) / 10.0));
        Curve::new(name.as_str(), rays.map(|n| (n, cost.of_rays(n))))
    };
    let curves = lines.iter().map(curve).collect();
    let ends = if crossings.is_empty() { "no lines cross".to_owned() } else { crossings.join("; ") };
    let drawing = Drawing::Curves(Curves { x: "rays".to_owned(), y: "seconds".to_owned(), curves, marks });
    Some(Figure { caption: format!("Time to build and trace {} rays on one thread: {ends}.", kind.name()), drawing })
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

/// A table with a column for each kind of ray.
fn by_kind(scene: &SceneReport, title: &str, lead: &[&str]) -> Table {
    let heads = lead.iter().copied().chain(scene.rays.iter().map(|(kind, _)| kind.name())).map(str::to_owned).collect();
    Table { title: title.to_owned(), heads, rows: Vec::new() }
}

fn rates_table(scene: &SceneReport) -> Table {
    let title = "Mrays/s: median (lowest to highest)";
    let mut table = by_kind(scene, title, &["accelerator", "rays traced as", "threads"]);
    for accel in &scene.accels {
        for mode in MODES {
            for threads in accel.builds.iter().map(|b| b.threads) {
                let cells = scene.rays.iter().map(|(kind, _)| rate(accel, *kind, mode, threads));
                let cells: Vec<String> = cells.map(|rate| or_dash(rate.map(with_digits))).collect();
                if cells.iter().any(|cell| cell != "-") {
                    let lead = [accel.name.clone(), mode.name().to_owned(), threads.to_string()];
                    table.rows.push(lead.into_iter().chain(cells).collect());
                }
            }
        }
    }
    table
}

/// A rate with two digits after the point, so that rows can be compared; four if it is small.
fn with_digits([median, low, high]: [f64; 3]) -> String {
    let digits = if median < 0.1 { 4 } else { 2 };
    format!("{median:.digits$} ({low:.digits$} to {high:.digits$})")
}

fn work(scene: &SceneReport) -> Table {
    let mut table = by_kind(scene, "Nodes + primitives per ray", &["accelerator"]);
    for accel in &scene.accels {
        let cell = |kind: RayKind| {
            let report = accel.kinds.iter().find(|k| k.kind == kind)?;
            Some(format!("{:.1} + {:.1}", report.nodes_per_ray?, report.prims_per_ray?))
        };
        let cells = scene.rays.iter().map(|(kind, _)| or_dash(cell(*kind)));
        table.rows.push(std::iter::once(accel.name.clone()).chain(cells).collect());
    }
    table
}

fn structures(scene: &SceneReport) -> Table {
    let builds = |accel: &AccelReport, text: &dyn Fn(&BuildReport) -> String| {
        accel.builds.iter().map(text).collect::<Vec<_>>().join(", ")
    };
    let threads = scene.accels.first().map_or(String::new(), |accel| builds(accel, &|b| b.threads.to_string()));
    let mut table = Table::new(
        "Builds and structures",
        &format!(
            "accelerator | what it is | build ms on {threads} threads | million primitives built per second | bytes \
             per primitive | peak of a build, MB | nodes | leaves | depth | items per leaf | SAH cost | EPO"
        ),
    );
    for accel in &scene.accels {
        let mut row = vec![
            accel.name.clone(),
            accel.description.clone(),
            builds(accel, &|b| format!("{:.1}", b.milliseconds[0])),
            builds(accel, &|b| format!("{:.2}", b.mprims_per_second)),
            format!("{:.1}", accel.bytes as f64 / scene.primitives.max(1) as f64),
            or_dash(accel.peak_build_bytes.map(|bytes| format!("{:.1}", bytes as f64 / 1e6))),
        ];
        match &accel.structure {
            None => row.extend(std::iter::repeat_n("-".to_owned(), 6)),
            Some(s) => row.extend([
                count(s.nodes as f64),
                format!("{} ({} empty)", count(s.leaves as f64), count(s.empty_leaves as f64)),
                s.depth.to_string(),
                format!("{:.2} (at most {})", s.mean_leaf, s.max_leaf),
                format!("{:.1}", s.sah_cost),
                or_dash(s.epo.map(|epo| format!("{epo:.2}"))),
            ]),
        }
        table.rows.push(row);
    }
    table
}

fn agreement(scene: &SceneReport) -> Table {
    let mut table = Table::new(
        "Agreement",
        "accelerator | rays | compared | identical | same primitive within the bound | tie within the bound | \
         different",
    );
    for accel in &scene.accels {
        table.rows.extend(accel.kinds.iter().map(|kind| {
            let a = &kind.agreement;
            let counts = [a.rays, a.identical, a.within_bound, a.ties, a.different].map(|n| count(n as f64));
            [accel.name.clone(), kind.kind.name().to_owned()].into_iter().chain(counts).collect()
        }));
    }
    table
}

/// The disagreements kept, one line each.
fn disagreements(scene: &SceneReport) -> Vec<String> {
    let mut lines = Vec::new();
    for accel in &scene.accels {
        for kind in &accel.kinds {
            lines.extend(kind.agreement.first.iter().map(|d| {
                let name = kind.kind.name();
                let [expected, found, ray] = [&d.expected, &d.found, &d.ray];
                format!("{}, {name}: expected {expected}, found {found}; replay with `--ray={ray}`", accel.name)
            }));
        }
    }
    lines
}

/// Cost over the number of triangles.
fn of_scaling(scaling: &ScalingReport) -> Section {
    let figure = |y: &str, caption: &str, cost: fn(&ScalingPoint) -> f64, slope: fn(&(String, f64, f64)) -> f64| {
        let curves = scaling.slopes.iter().map(|law| {
            let points = scaling.points.iter().filter(|p| p.accel == law.0);
            let points = points.map(|p| (p.triangles as f64, cost(p)));
            Curve::new(format!("{} (slope {:.2})", law.0, slope(law)), points)
        });
        let curves = curves.collect();
        let drawing = Drawing::Curves(Curves { x: "triangles".into(), y: y.into(), curves, marks: Vec::new() });
        Figure { caption: caption.to_owned(), drawing }
    };
    let of_rays = "Time per ray, incoherent rays, one thread.";
    let mut figures = Vec::new();
    if !scaling.slopes.is_empty() {
        figures.push(figure("ns per ray", of_rays, |p| p.nanoseconds_per_ray, |law| law.1));
        figures.push(figure("ms to build", "Time to build with all threads.", |p| p.build_milliseconds, |law| law.2));
    }
    let heads = "accelerator | triangles | build ms | ns per ray | bytes per triangle | slope of rays | slope of \
                 builds";
    let mut table = Table::new("Cost over the number of triangles", heads);
    table.rows.extend(scaling.points.iter().map(|p| {
        let law = scaling.slopes.iter().find(|law| law.0 == p.accel);
        vec![
            p.accel.clone(),
            count(p.triangles as f64),
            format!("{:.2}", p.build_milliseconds),
            format!("{:.1}", p.nanoseconds_per_ray),
            format!("{:.1}", p.bytes_per_triangle),
            or_dash(law.map(|law| format!("{:.3}", law.1))),
            or_dash(law.map(|law| format!("{:.3}", law.2))),
        ]
    }));
    Section { title: "Growth".to_owned(), figures, tables: vec![table], ..Section::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

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
