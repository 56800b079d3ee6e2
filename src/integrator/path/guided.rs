//! Path guiding: directions sampled from what was learned of the incident radiance beside those of the BSDF, and the
//! records that it is learned from.

use super::Context;
use super::block::{Vertices, spawn, vertex_flags};
use super::radiance::Output;
use super::wave::PathRows;
use crate::color::Rgb;
use crate::guiding::{Guide, GuideRegion, Record};
use crate::light::light_target;
use crate::math::Vec3;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::BATCH;

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

/// The guided vertices of a wave, and how those of one block are sampled.
pub(super) struct GuideRecorder {
    vertices: Vec<GuideVertex>,
    /// How many of them have their `radiance_before`.
    marked: usize,
    /// By vertex of the block: the direction that the guide has sampled, with its density.
    sampled: [Option<(Vec3, f32)>; BATCH],
    /// By vertex of the block: the densities of the BSDF and of the guide.
    densities: [Option<[f32; 2]>; BATCH],
}

impl Default for GuideRecorder {
    fn default() -> Self {
        Self { vertices: Vec::new(), marked: 0, sampled: [None; BATCH], densities: [None; BATCH] }
    }
}

/// Whether directions at a vertex may be guided: not at mirrors, nor where light crosses, for roulette must know how it
/// was refracted.
fn is_guided(vertices: &Vertices, lane: usize) -> bool {
    vertices.rows.flags[lane] & (vertex_flags::DELTA | vertex_flags::TRANSMITS | vertex_flags::MISS) == 0
}

/// The guide's region of each vertex of a block, where directions may be guided.
pub(super) type Regions<'a> = [Option<GuideRegion<'a>>; BATCH];

/// Finds the regions of a block's vertices.
pub(super) fn find_regions<'a>(guide: &'a Guide, vertices: &Vertices) -> Regions<'a> {
    let mut regions = [None; BATCH];
    for (lane, region) in
        regions.iter_mut().enumerate().take(vertices.count).filter(|&(lane, _)| is_guided(vertices, lane))
    {
        *region = guide.at(vertices.points.p.get(lane).as_vec3(), vertices.facing_normal(lane));
    }
    regions
}

/// The density of a direction that the BSDF and the guide choose with these.
#[inline]
fn mixed(region: &GuideRegion, [bsdf, guide]: [f32; 2]) -> f32 {
    region.bsdf_sampling_fraction * bsdf + (1.0 - region.bsdf_sampling_fraction) * guide
}

/// Replaces the densities with which scattering finds the lights' directions.
pub(super) fn mix_scatter_pdfs(regions: &Regions, vertices: &mut Vertices) {
    let Vertices { light_samples, direct, .. } = vertices;
    for (lane, region) in regions.iter().enumerate().take(vertices.count) {
        if let (Some(region), true) = (region, light_samples.target[lane] != light_target::NONE) {
            direct.scatter_pdf[lane] =
                mixed(region, [direct.scatter_pdf[lane], region.directions.pdf(light_samples.direction.get(lane))]);
        }
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
        for (lane, region) in regions.iter().enumerate().take(vertices.count) {
            self.sampled[lane] = None;
            let Some(region) = region else { continue };
            let (u, share) = (vertices.u_bsdf.of(lane), region.bsdf_sampling_fraction);
            if u[0] < share {
                vertices.u_bsdf.set_first(lane, (u[0] / share).min(ONE_MINUS_EPSILON));
            } else {
                let sample = region.directions.sample([u[1], u[2]]);
                self.sampled[lane] = Some((sample.direction, sample.pdf));
            }
        }
    }

    /// Replaces the BSDF's samples by those of the guide, and all densities by those of both together.
    pub fn mix(&mut self, context: &Context, regions: &Regions, vertices: &mut Vertices) {
        for (lane, region) in regions.iter().enumerate().take(vertices.count) {
            self.densities[lane] = None;
            let Some(region) = region else { continue };
            if let Some((direction, guide_pdf)) = self.sampled[lane] {
                let wi = vertices.frame(lane).to_local(direction);
                let eval = vertices.eval(context.scene, lane, wi);
                let densities = [eval.pdf, guide_pdf];
                let pdf = mixed(region, densities);
                let scatter = &mut vertices.scatter;
                scatter.wi.set(lane, wi);
                scatter.weight.set(lane, eval.value * (1.0 / pdf));
                scatter.pdf[lane] = pdf;
                scatter.rr_factor[lane] = (pdf / eval.pdf).min(MAX_PDF_RATIO);
                scatter.is_valid[lane] = u32::from(!eval.value.is_black());
                (scatter.is_delta[lane], scatter.is_transmission[lane]) = (0, 0);
                self.densities[lane] = Some(densities);
            } else if vertices.scatter.is_valid[lane] != 0 {
                let direction = vertices.frame(lane).to_world(vertices.scatter.wi.get(lane));
                let scatter = &mut vertices.scatter;
                let weight = scatter.weight.get(lane);
                if scatter.is_delta[lane] != 0 {
                    scatter.weight.set(lane, weight * (1.0 / region.bsdf_sampling_fraction));
                    scatter.rr_factor[lane] *= region.bsdf_sampling_fraction;
                } else {
                    let densities = [scatter.pdf[lane], region.directions.pdf(direction)];
                    let pdf = mixed(region, densities);
                    let ratio = pdf / scatter.pdf[lane];
                    scatter.weight.set(lane, weight * (1.0 / ratio));
                    scatter.pdf[lane] = pdf;
                    scatter.rr_factor[lane] *= ratio.min(MAX_PDF_RATIO);
                    self.densities[lane] = Some(densities);
                }
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
        for vertex in &mut self.vertices {
            let incident = out.batch.pixels[vertex.slot as usize].radiance - vertex.radiance_before;
            // What a channel has gained whose throughput is zero is rounding.
            let of_channel = |incident: f32, weight: f32, all: f32| {
                if all > 0.0 { (incident * (weight / all)).max(0.0) } else { 0.0 }
            };
            let (w, t) = (vertex.weight, vertex.throughput);
            let channels =
                [of_channel(incident.r, w.r, t.r), of_channel(incident.g, w.g, t.g), of_channel(incident.b, w.b, t.b)];
            vertex.record.light = Rgb::from(channels).mean();
            guide.record(&vertex.record);
        }
    }
}
