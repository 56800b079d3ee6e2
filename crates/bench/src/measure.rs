//! Builds accelerators, replays recorded rays through them, and counts.

use std::hint::black_box;
use std::time::Instant;

use serde::Serialize;

use super::agreement::{self, Agreement};
use super::machine::{memory_in_use, reset_peak_memory};
use super::{RayKind, RaySet, Spent, Watch, epo, median_and_range};
use crate::accel::inspect::{Inspect, StructureStats, TraversalCounts};
use crate::accel::{self, AccelKind, Accelerator, AnyHitRays, Coherence, HitRows, LinearAccel};
use crate::geometry::Geometry;
use crate::math::rows::BATCH;
use crate::math::{Ray, RayRows, Vec2};
use crate::scene::Scene;
use steradian::{Error, Result};

/// Options of a benchmark.
#[derive(Clone, Debug)]
pub struct Options {
    /// The accelerators.
    pub accels: Vec<AccelKind>,
    /// Thread counts.
    pub threads: Vec<usize>,
    /// Repetitions, interleaved over accelerators.
    pub rounds: usize,
    /// Primitive tests that one pass of a linear accelerator may cost; it gets fewer rays where more would be needed.
    pub linear_tests: u64,
}

impl Default for Options {
    fn default() -> Self {
        let all = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if all > 1 { vec![1, all] } else { vec![1] };
        let accels = AccelKind::ALL.iter().map(|(kind, _)| *kind).collect();
        Self { accels, threads, rounds: 5, linear_tests: 10_000_000 }
    }
}

/// Everything measured on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// The scene's name.
    pub scene: String,
    /// Primitives, those of objects once.
    pub primitives: usize,
    /// Instances.
    pub instances: usize,
    /// Recorded rays by kind.
    pub rays: Vec<(RayKind, usize)>,
    /// Kinds of rays that do not occur in the scene.
    pub absent: Vec<RayKind>,
    /// What answers were compared with.
    pub oracle: String,
    /// One for each accelerator.
    pub accels: Vec<AccelReport>,
    /// What the rounds that were timed took.
    pub spent: Spent,
    /// Whether it was ended early.
    pub interrupted: bool,
}

/// One accelerator on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct AccelReport {
    /// Its name with options.
    pub name: String,
    /// Its own description.
    pub description: String,
    /// Builds, for each number of threads.
    pub builds: Vec<BuildReport>,
    /// Bytes held beside the geometry.
    pub bytes: usize,
    /// The most memory that the process took during a build beyond what it had before, in bytes.
    pub peak_build_bytes: Option<u64>,
    /// The structure, where it is open.
    pub structure: Option<StructureReport>,
    /// By kind of ray.
    pub kinds: Vec<KindReport>,
    /// Nodes opened by the camera rays of a small picture, where the structure is open.
    #[serde(skip)]
    pub node_map: Option<NodeMap>,
}

/// Nodes opened, pixel by pixel.
#[derive(Clone, Debug)]
pub struct NodeMap {
    /// Width and height.
    pub size: [u32; 2],
    /// Of the ray through the middle of each pixel, row by row from the top.
    pub nodes: Vec<u64>,
}

/// Builds with one number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct BuildReport {
    /// Threads.
    pub threads: usize,
    /// Median, lowest and highest time in milliseconds.
    pub milliseconds: [f64; 3],
    /// Millions of primitives per second, at the median.
    pub mprims_per_second: f64,
}

/// Figures of an open structure.
#[derive(Clone, Debug, Serialize)]
pub struct StructureReport {
    /// Nodes, leaves included.
    pub nodes: u64,
    /// Leaves with items.
    pub leaves: u64,
    /// Leaves without.
    pub empty_leaves: u64,
    /// Depth of the deepest node; the root has 0.
    pub depth: u32,
    /// Items in all leaves, repeated ones counted.
    pub references: u64,
    /// Mean number of items of the leaves that have any.
    pub mean_leaf: f64,
    /// The most items in a leaf.
    pub max_leaf: u64,
    /// Cost by the surface area heuristic: 1 for a node, 1 for a primitive.
    pub sah_cost: f64,
    /// End-point overlap, of hierarchies whose items are in one leaf each: expected nodes and primitives opened in vain
    /// around a point of a surface.
    pub epo: Option<f64>,
}

/// One kind of rays through one accelerator.
#[derive(Clone, Debug, Serialize)]
pub struct KindReport {
    /// The kind.
    pub kind: RayKind,
    /// Rays replayed; fewer than recorded where more would take too long.
    pub rays: usize,
    /// Rates by mode and number of threads.
    pub rates: Vec<RateReport>,
    /// Nodes opened per ray, where the structure is open.
    pub nodes_per_ray: Option<f64>,
    /// Primitives tested per ray.
    pub prims_per_ray: Option<f64>,
    /// How the answers compare with the oracle's.
    pub agreement: Agreement,
}

/// How rays are handed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// One by one.
    Single,
    /// In batches of which nothing is known.
    Batch,
    /// In batches with the coherence hint; camera rays only.
    CoherentBatch,
}

impl Mode {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single rays",
            Self::Batch => "batches",
            Self::CoherentBatch => "coherent batches",
        }
    }
}

/// Rate of one kind, mode and number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct RateReport {
    /// How rays were handed over.
    pub mode: Mode,
    /// Threads.
    pub threads: usize,
    /// Median, lowest and highest of the rounds, in millions of rays per second.
    pub mrays_per_second: [f64; 3],
}

/// Rays per task of a replay by several threads.
const CHUNK: usize = 4096;

/// Most rays of the counting pass.
const COUNTED: usize = 100_000;

/// Primitive tests that the oracle may cost for each kind of ray.
const ORACLE_TESTS: u64 = 200_000_000;

/// Longer side of maps of nodes, in pixels.
const MAP_SIDE: f64 = 192.0;

/// A scene to measure.
pub struct Subject<'a> {
    /// Its name in the report.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// Width and height of its picture.
    pub size: [u32; 2],
}

impl Subject<'_> {
    /// Nodes that an open structure visits for the camera rays of a small picture.
    fn node_map(&self, inspect: &dyn Inspect) -> NodeMap {
        let longer = f64::from(self.size[0].max(self.size[1]));
        let size = self.size.map(|side| ((f64::from(side) * MAP_SIDE / longer).round() as u32).max(1));
        let camera = &self.scene.camera;
        let nodes = |i: u32| {
            let film = Vec2::new((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5);
            let ray = camera.ray(film, size, [0.5; 2], camera.time(0.5));
            let mut work = TraversalCounts::default();
            inspect.intersect_counted(&ray, &mut work);
            work.nodes
        };
        NodeMap { size, nodes: (0..size[0] * size[1]).map(nodes).collect() }
    }
}

/// Runs everything on one scene, with rays recorded in it.
///
/// # Errors
/// If an accelerator cannot be built.
pub fn bench_scene(subject: &Subject, sets: &[RaySet], options: &Options, watch: &dyn Watch) -> Result<SceneReport> {
    let (name, geometry) = (subject.name, &subject.scene.geometry);
    let primitives: usize = geometry.shapes.iter().map(crate::geometry::Shape::prim_count).sum();
    let mut accels: Vec<Measured> = Vec::new();
    for &kind in &options.accels {
        if watch.is_stopped() {
            break;
        }
        watch.step(&format!("{name}: building {kind}"));
        let (mut report, accel) = build(kind, geometry, primitives, options)?;
        report.node_map = accel.inspect().map(|open| subject.node_map(open));
        accels.push((report, accel));
    }
    let oracle = choose_oracle(&accels);
    let mut report = SceneReport {
        scene: name.to_owned(),
        primitives,
        instances: geometry.instances.len(),
        rays: sets.iter().map(|set| (set.kind, set.rays.len())).collect(),
        absent: RayKind::ALL.into_iter().filter(|kind| sets.iter().all(|set| set.kind != *kind)).collect(),
        oracle: String::new(),
        accels: Vec::new(),
        spent: Spent::default(),
        interrupted: false,
    };
    let replay = Replay { name, geometry, primitives, proxy: oracle, options, watch };
    let mut compared = 0;
    for set in sets {
        if watch.is_stopped() {
            report.interrupted = true;
            break;
        }
        let (checked, spent) = replay.replay(set, &mut accels)?;
        compared += checked;
        report.spent.add(spent);
    }
    report.oracle = match oracle {
        None => format!("linear, on {compared} rays"),
        Some(i) => {
            format!(
                "linear, on {compared} rays; beyond them {}, which gave the same answers bit for bit on those",
                accels[i].0.name
            )
        }
    };
    report.accels = accels.into_iter().map(|(report, _)| report).collect();
    Ok(report)
}

fn build<'g>(kind: AccelKind, geometry: &'g Geometry, primitives: usize, options: &Options) -> Result<Measured<'g>> {
    let can_reset = reset_peak_memory();
    let before = memory_in_use();
    let first = Instant::now();
    let accel = accel::build(kind, geometry, 0)?;
    let once = first.elapsed().as_secs_f64();
    let peak = match (can_reset, before, memory_in_use()) {
        (true, Some([before, _]), Some([_, most])) => Some(most.saturating_sub(before)),
        _ => None,
    };
    // What takes long is steady enough to be done once.
    let repeats = if once > 2.0 { 1 } else { 3 };
    let mut builds = Vec::new();
    for &threads in &options.threads {
        let mut times = Vec::new();
        for _ in 0..repeats {
            let start = Instant::now();
            let again = accel::build(kind, geometry, threads)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
            black_box(again.memory_bytes());
        }
        let milliseconds = median_and_range(&times);
        builds.push(BuildReport {
            threads,
            milliseconds,
            mprims_per_second: primitives as f64 / milliseconds[0].max(1e-9) * 1e-3,
        });
    }
    let structure = accel.inspect().map(|inspect| {
        let stats = StructureStats::of(inspect);
        StructureReport {
            nodes: stats.nodes,
            leaves: stats.leaves,
            empty_leaves: stats.empty_leaves,
            depth: stats.max_depth,
            references: stats.references,
            mean_leaf: stats.mean_leaf(),
            max_leaf: stats.max_leaf,
            sah_cost: stats.sah_cost,
            epo: epo::end_point_overlap(geometry, inspect),
        }
    });
    let report = AccelReport {
        name: kind.to_string(),
        description: accel.description(),
        builds,
        bytes: accel.memory_bytes(),
        peak_build_bytes: peak,
        structure,
        kinds: Vec::new(),
        node_map: None,
    };
    Ok((report, accel))
}

/// The accelerator that stands in for the oracle on rays that would take the oracle too long: one of the own
/// accelerators, which is checked against it.
fn choose_oracle(accels: &[Measured]) -> Option<usize> {
    accels.iter().position(|(report, accel)| accel.inspect().is_some() && report.name.starts_with("bvh"))
}

/// An accelerator with what is known of it.
type Measured<'g> = (AccelReport, Box<dyn Accelerator + 'g>);

/// Rates of an accelerator by mode and threads, one for each round.
type Rates = Vec<(Mode, usize, Vec<f64>)>;

/// Replays rays in a scene.
struct Replay<'a> {
    name: &'a str,
    geometry: &'a Geometry,
    primitives: usize,
    /// The accelerator that stands in for the oracle, see [`choose_oracle`].
    proxy: Option<usize>,
    options: &'a Options,
    watch: &'a dyn Watch,
}

impl Replay<'_> {
    /// The number of rays of a set that a linear loop traces with `tests` primitive tests.
    fn affordable(&self, set: &RaySet, tests: u64) -> usize {
        ((tests / self.primitives.max(1) as u64) as usize).clamp(16, set.rays.len().max(16)).min(set.rays.len())
    }

    /// Replays one kind of ray; gives the number of rays that were compared with the oracle itself, and the time.
    fn replay(&self, set: &RaySet, accels: &mut [Measured]) -> Result<(usize, Spent)> {
        let checked = self.affordable(set, ORACLE_TESTS);
        let agreements = self.agreements(set, accels, checked);
        let rays_of = |report: &AccelReport| {
            if report.name == "linear" { self.affordable(set, self.options.linear_tests) } else { set.rays.len() }
        };
        let counts: Vec<usize> = accels.iter().map(|(report, _)| rays_of(report)).collect();
        let (rates, spent) = self.rates(set, accels, &counts)?;
        for ((((report, accel), agreement), rates), rays) in accels.iter_mut().zip(agreements).zip(rates).zip(counts) {
            let counted = accel
                .inspect()
                .map(|inspect| work_per_ray(inspect, &set.rays[..rays.min(COUNTED)], set.kind.is_any_hit()));
            let rates = rates.iter().map(|(mode, threads, rates)| RateReport {
                mode: *mode,
                threads: *threads,
                mrays_per_second: median_and_range(rates),
            });
            report.kinds.push(KindReport {
                kind: set.kind,
                rays,
                rates: rates.collect(),
                nodes_per_ray: counted.map(|c| c[0]),
                prims_per_ray: counted.map(|c| c[1]),
                agreement,
            });
        }
        Ok((checked, spent))
    }

    /// Compares the hits of the first `checked` rays with the oracle's, of the others with the proxy's.
    fn agreements(&self, set: &RaySet, accels: &[Measured], checked: usize) -> Vec<Agreement> {
        let (geometry, any_hit) = (self.geometry, set.kind.is_any_hit());
        self.watch.step(&format!("{}: {} rays, agreement", self.name, set.kind.name()));
        let (checked, rest) = set.rays.split_at(checked);
        let expected = agreement::answers(&LinearAccel::new(geometry), checked, any_hit);
        let mut agreements: Vec<Agreement> =
            accels.iter().map(|(_, accel)| agreement::compare(geometry, &expected, &**accel, checked)).collect();
        if let Some(proxy) = self.proxy.filter(|&i| agreements[i].identical == checked.len() && !rest.is_empty()) {
            let expected = agreement::answers(&*accels[proxy].1, rest, any_hit);
            for (i, (report, accel)) in accels.iter().enumerate() {
                if i != proxy && report.name != "linear" {
                    agreements[i].add(agreement::compare(geometry, &expected, &**accel, rest));
                }
            }
        }
        agreements
    }

    /// Times every accelerator in turn, again and again, so that whatever else the machine does falls on all alike.
    fn rates(&self, set: &RaySet, accels: &[Measured], counts: &[usize]) -> Result<(Vec<Rates>, Spent)> {
        let mut spent = Spent::default();
        let Self { name, options, watch, .. } = self;
        let of_threads = |mode: Mode| options.threads.iter().map(move |&threads| (mode, threads, Vec::new()));
        let mut times: Vec<Rates> = accels
            .iter()
            .map(|(report, _)| modes(set.kind, &report.name).iter().flat_map(|&mode| of_threads(mode)).collect())
            .collect();
        for round in 0..=options.rounds {
            watch.step(&format!("{name}: {} rays, round {round} of {}", set.kind.name(), options.rounds));
            for (i, (_, accel)) in accels.iter().enumerate() {
                for (mode, threads, rates) in &mut times[i] {
                    if watch.is_stopped() && round > 1 {
                        continue;
                    }
                    let rays = &set.rays[..counts[i]];
                    let once = replay(&**accel, rays, *mode, set.kind.is_any_hit(), *threads)?;
                    spent.add(once);
                    // The first round warms caches and page tables up.
                    if round > 0 {
                        rates.push(rays.len() as f64 / once.seconds * 1e-6);
                    }
                }
            }
        }
        Ok((times, spent))
    }
}

/// Nodes visited and primitives tested per ray.
fn work_per_ray(inspect: &dyn Inspect, rays: &[Ray], any_hit: bool) -> [f64; 2] {
    let mut work = TraversalCounts::default();
    for ray in rays {
        if any_hit {
            inspect.occluded_counted(ray, &mut work);
        } else {
            inspect.intersect_counted(ray, &mut work);
        }
    }
    [work.nodes, work.prims].map(|n| n as f64 / rays.len().max(1) as f64)
}

/// The queries of an accelerator: batches where it traces rays together, coherent ones where it has packets for them.
fn modes(kind: RayKind, accel: &str) -> &'static [Mode] {
    match (accel.split(':').next(), kind == RayKind::Camera) {
        (Some("auto" | "embree" | "hybrid" | "bvh"), true) => &[Mode::Single, Mode::Batch, Mode::CoherentBatch],
        (Some("auto" | "embree" | "hybrid" | "packets" | "bvh"), _) => &[Mode::Single, Mode::Batch],
        _ => &[Mode::Single],
    }
}

/// Traces all rays.
fn replay(accel: &dyn Accelerator, rays: &[Ray], mode: Mode, any_hit: bool, threads: usize) -> Result<Spent> {
    let singles = |rays: &[Ray]| {
        if any_hit {
            black_box(rays.iter().filter(|ray| accel.occluded(ray)).count());
        } else {
            black_box(rays.iter().filter_map(|ray| accel.intersect(ray)).fold(0u32, |sum, hit| sum ^ hit.prim.0));
        }
    };
    let coherence = if mode == Mode::CoherentBatch { Coherence::Coherent } else { Coherence::Incoherent };
    let batches = |blocks: &[(RayRows, usize)]| {
        let (mut hits, mut occluded) = (HitRows::default(), [false; BATCH]);
        for (rays, count) in blocks {
            if any_hit {
                accel.occluded_rows(AnyHitRays::new(rays, *count), &mut occluded, coherence);
                black_box(&occluded);
            } else {
                accel.intersect_rows(rays, *count, &mut hits, coherence);
                black_box(&hits);
            }
        }
    };
    let blocks = if mode == Mode::Single { Vec::new() } else { RayRows::blocks(rays) };
    if threads == 1 {
        let all = || if mode == Mode::Single { singles(rays) } else { batches(&blocks) };
        return Ok(Spent::on(1, all).1);
    }
    use rayon::prelude::*;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Internal(format!("cannot start {threads} threads: {e}")))?;
    let all = || {
        if mode == Mode::Single {
            rays.par_chunks(CHUNK).for_each(singles);
        } else {
            blocks.par_chunks(CHUNK / BATCH).for_each(batches);
        }
    };
    Ok(pool.install(|| Spent::on(threads, all).1))
}
