//! Path guiding: directions sampled from what was learned of the incident radiance beside those of the BSDF, and the
//! records that it is learned from.

use super::Context;
use super::block::{EvalRows, Vertices, spawn, vertex_flags};
use super::evals::Surfaces;
use super::radiance::Output;
use super::wave::{BsdfScratch, PathRows};
use crate::color::Rgb;
use crate::guiding::{Guide, GuideRegion, PdfLookup, Record, RecordLeaf, TreePoint};
use crate::light::light_target;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{BATCH, Row, Vec3Rows};
use crate::math::vectorize::vectorize;

/// Largest ratio of the density of a direction to that of the BSDF alone which roulette disregards.
const MAX_PDF_RATIO: f32 = 1e6;

/// A scattered direction, to be learned from.
#[derive(Clone, Copy, Debug)]
struct GuideVertex {
    /// All but the radiance.
    record: Record,
    /// The weight of the scattering, and the path's throughput after it, without roulette.
    weight: Rgb,
    throughput: Rgb,
    /// The sample's radiance before the path went on.
    radiance_before: Rgb,
    slot: u32,
}

impl GuideVertex {
    /// The light that the vertex has scattered, over the density of its direction.
    fn scattered(&self, out: &Output) -> f32 {
        let incident = out.batch.pixels[self.slot as usize].radiance - self.radiance_before;
        // What a channel has gained whose throughput is zero is rounding.
        let of_channel = |incident: f32, weight: f32, all: f32| {
            if all > 0.0 { (incident * (weight / all)).max(0.0) } else { 0.0 }
        };
        let (w, t) = (self.weight, self.throughput);
        let channels =
            [of_channel(incident.r, w.r, t.r), of_channel(incident.g, w.g, t.g), of_channel(incident.b, w.b, t.b)];
        Rgb::from(channels).mean()
    }
}

/// The guided vertices of a wave, and how those of one block are sampled.
pub(super) struct GuideRecorder {
    vertices: Vec<GuideVertex>,
    /// How many of them have their `radiance_before`.
    marked: usize,
    /// By vertex of the block: whether the guide has sampled the direction, the direction, and its density.
    is_sampled: Row<bool>,
    directions: Vec3Rows,
    guide_pdf: Row,
    /// For these directions.
    evals: EvalRows,
    /// By vertex of the block: the densities of the BSDF and of the guide.
    densities: [Option<[f32; 2]>; BATCH],
}

impl Default for GuideRecorder {
    fn default() -> Self {
        Self {
            vertices: Vec::new(),
            marked: 0,
            is_sampled: [false; BATCH],
            directions: Vec3Rows::ZERO,
            guide_pdf: [0.0; BATCH],
            evals: EvalRows::default(),
            densities: [None; BATCH],
        }
    }
}

/// Whether directions at a vertex may be guided: not at mirrors, nor where light crosses, for roulette must know how it
/// was refracted.
fn is_guided(vertices: &Vertices, lane: usize) -> bool {
    vertices.rows.flags[lane] & (vertex_flags::DELTA | vertex_flags::TRANSMITS | vertex_flags::MISS) == 0
}

/// The guide's region of each vertex of a block, where directions may be guided.
pub(super) type Regions<'a> = [Option<GuideRegion<'a>>; BATCH];

/// Finds the regions of a block's vertices. Here and below, loops begin lookups in one pass and finish them in the
/// next: all lanes wait for memory together.
pub(super) fn find_regions<'a>(guide: &'a Guide, vertices: &Vertices) -> Regions<'a> {
    let mut points = [TreePoint::default(); BATCH];
    vectorize!(find_tree_points(guide, vertices, &mut points));
    let mut numbers = [0; BATCH];
    let lanes = || (0..vertices.count.min(BATCH)).filter(|&lane| is_guided(vertices, lane));
    for lane in lanes() {
        numbers[lane] = guide.find_region(points[lane]);
    }
    let mut regions = [None; BATCH];
    for lane in lanes() {
        regions[lane] = guide.region(numbers[lane]);
        if let Some(region) = &regions[lane] {
            region.directions.prefetch();
        }
    }
    regions
}

#[inline(always)]
fn find_tree_points(guide: &Guide, vertices: &Vertices, points: &mut [TreePoint; BATCH]) {
    for (lane, point) in points.iter_mut().enumerate().take(vertices.count) {
        *point = guide.tree_point(vertices.points.p.get(lane).as_vec3(), vertices.facing_normal(lane));
    }
}

/// The density of a direction that the BSDF and the guide choose with these.
#[inline]
fn mixed(region: &GuideRegion, [bsdf, guide]: [f32; 2]) -> f32 {
    region.bsdf_sampling_fraction * bsdf + (1.0 - region.bsdf_sampling_fraction) * guide
}

/// Replaces the densities with which scattering finds the lights' directions.
pub(super) fn mix_scatter_pdfs(regions: &Regions, vertices: &mut Vertices) {
    let Vertices { light_samples, light_evals, count, .. } = vertices;
    let chosen = || (0..*count).filter_map(|lane| Some((lane, regions[lane].as_ref()?)));
    let mut lookups = [PdfLookup::default(); BATCH];
    for (lane, region) in chosen().filter(|&(lane, _)| light_samples.target[lane] != light_target::NONE) {
        lookups[lane] = region.directions.begin_pdf(light_samples.direction.get(lane));
    }
    for (lane, region) in chosen().filter(|&(lane, _)| light_samples.target[lane] != light_target::NONE) {
        let guide_pdf = region.directions.finish_pdf(&lookups[lane]);
        light_evals.pdf[lane] = mixed(region, [light_evals.pdf[lane], guide_pdf]);
    }
}

impl GuideRecorder {
    /// Starts a wave.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.marked = 0;
    }

    /// Chooses between the BSDF and the guide at each vertex; the number for the choice becomes one for the lobe.
    pub fn choose(&mut self, regions: &Regions, vertices: &mut Vertices) {
        let mut lookups = [None; BATCH];
        for (lane, region) in regions.iter().enumerate().take(vertices.count) {
            let Some(region) = region else { continue };
            let (u, share) = (vertices.u_bsdf.of(lane), region.bsdf_sampling_fraction);
            if u[0] < share {
                vertices.u_bsdf.set_first(lane, (u[0] / share).min(ONE_MINUS_EPSILON));
            } else {
                lookups[lane] = Some(region.directions.begin_sample([u[1], u[2]]));
            }
        }
        for (lane, lookup) in lookups.iter().enumerate().take(vertices.count) {
            self.is_sampled[lane] = false;
            let Some((lookup, region)) = lookup.as_ref().zip(regions[lane].as_ref()) else { continue };
            let sample = region.directions.finish_sample(lookup);
            self.is_sampled[lane] = true;
            self.directions.set(lane, sample.direction);
            self.guide_pdf[lane] = sample.pdf;
        }
    }

    /// Replaces the BSDF's samples by those of the guide, and all densities by those of both together.
    pub fn mix(&mut self, context: &Context, regions: &Regions, vertices: &mut Vertices, scratch: &mut BsdfScratch) {
        let Vertices { rows, bsdfs, non_diffuse, count, .. } = &*vertices;
        let surfaces = Surfaces { scene: context.scene, count: *count, rows, bsdfs, non_diffuse };
        surfaces.eval(&self.directions, |lane| self.is_sampled[lane], scratch, &mut self.evals);
        let mut lookups = [None; BATCH];
        for (lane, region) in regions.iter().enumerate().take(vertices.count) {
            let scatter = &vertices.scatter;
            let is_of_bsdf = !self.is_sampled[lane] && scatter.is_valid[lane] != 0 && scatter.is_delta[lane] == 0;
            if let (Some(region), true) = (region, is_of_bsdf) {
                let direction = vertices.frame(lane).to_world(scatter.wi.get(lane));
                lookups[lane] = Some(region.directions.begin_pdf(direction));
            }
        }
        for (lane, region) in regions.iter().enumerate().take(vertices.count) {
            self.densities[lane] = None;
            let Some(region) = region else { continue };
            if self.is_sampled[lane] {
                let (value, bsdf_pdf) = (self.evals.value.get(lane), self.evals.pdf[lane]);
                let densities = [bsdf_pdf, self.guide_pdf[lane]];
                let pdf = mixed(region, densities);
                let scatter = &mut vertices.scatter;
                scatter.wi.set(lane, self.evals.wi.get(lane));
                scatter.weight.set(lane, value * (1.0 / pdf));
                scatter.pdf[lane] = pdf;
                scatter.rr_factor[lane] = (pdf / bsdf_pdf).min(MAX_PDF_RATIO);
                scatter.is_valid[lane] = u32::from(!value.is_black());
                (scatter.is_delta[lane], scatter.is_transmission[lane]) = (0, 0);
                self.densities[lane] = Some(densities);
                continue;
            }
            let scatter = &mut vertices.scatter;
            let weight = scatter.weight.get(lane);
            if let Some(lookup) = &lookups[lane] {
                let densities = [scatter.pdf[lane], region.directions.finish_pdf(lookup)];
                let pdf = mixed(region, densities);
                let ratio = pdf / scatter.pdf[lane];
                scatter.weight.set(lane, weight * (1.0 / ratio));
                scatter.pdf[lane] = pdf;
                scatter.rr_factor[lane] *= ratio.min(MAX_PDF_RATIO);
                self.densities[lane] = Some(densities);
            } else if scatter.is_valid[lane] != 0 {
                scatter.weight.set(lane, weight * (1.0 / region.bsdf_sampling_fraction));
                scatter.rr_factor[lane] *= region.bsdf_sampling_fraction;
            }
        }
    }

    /// Records the directions of the paths that go on.
    pub fn record(&mut self, vertices: &Vertices, paths: &PathRows) {
        let scatter = &vertices.scatter;
        for lane in
            (0..vertices.count).filter(|&lane| scatter.status[lane] == spawn::SPAWNED && scatter.is_delta[lane] == 0)
        {
            if !is_guided(vertices, lane) {
                continue;
            }
            let record = Record {
                p: vertices.points.p.get(lane).as_vec3(),
                n: vertices.facing_normal(lane),
                direction: scatter.direction.get(lane),
                light: 0.0,
                densities: self.densities[lane],
            };
            let weight = scatter.weight.get(lane);
            let throughput = vertices.rows.throughput.get(lane) * weight;
            let slot = paths.slot[vertices.path(lane)];
            self.vertices.push(GuideVertex { record, weight, throughput, radiance_before: Rgb::BLACK, slot });
        }
    }

    /// All that is added to the samples from here on came from the directions that paths took last.
    pub fn mark_radiance(&mut self, out: &Output) {
        for vertex in &mut self.vertices[self.marked..] {
            vertex.radiance_before = out.batch.pixels[vertex.slot as usize].radiance;
        }
        self.marked = self.vertices.len();
    }

    /// Records what came from all directions.
    pub fn commit(&mut self, guide: Option<&Guide>, out: &Output) {
        let Some(guide) = guide.filter(|guide| guide.learns()) else { return };
        let mut leaves = [RecordLeaf::default(); BATCH];
        for vertices in self.vertices.chunks_mut(BATCH) {
            for (vertex, leaf) in vertices.iter_mut().zip(&mut leaves) {
                vertex.record.light = vertex.scattered(out);
                *leaf = guide.find_leaf(&vertex.record);
            }
            leaves[..vertices.len()].iter().for_each(|leaf| guide.prefetch_records(leaf));
            vertices.iter().zip(&leaves).for_each(|(vertex, leaf)| guide.record_in(leaf, &vertex.record));
        }
    }
}
