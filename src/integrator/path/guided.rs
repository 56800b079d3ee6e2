//! Path guiding: directions sampled from what was learned of the incident radiance beside those of the BSDF, and the
//! records that it is learned from.

use super::Context;
use super::block::{EvalRows, ScatterRows, VertexRows, Vertices, spawn, vertex_flags};
use super::evals::Surfaces;
use super::radiance::Output;
use super::wave::{BsdfScratch, PathRows};
use crate::color::Rgb;
use crate::film::SampleBatch;
use crate::guiding::{DirectionLookups, Distributions, Guide, GuideSampleRows, Record, TreePoint};
use crate::integrator::SecondMoments;
use crate::light::light_target;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{BATCH, Row, Vec3Rows, soa, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Frame, Vec3};
use crate::sampling::SampleRows;

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
    /// The density of the direction over that without the guide.
    pdf_ratio: f32,
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

soa! {
    /// How directions of a block are mixed.
    struct MixRows {
        /// Whether the guide has sampled the direction.
        is_guide_sample: u32,
        /// The direction that the BSDF has sampled, in the world.
        bsdf_direction: Vec3,
        /// The guide's density for it.
        guide_pdf_of_bsdf: f32,
        /// Whether both densities are known.
        has_pdfs: u32,
        /// The densities of the BSDF and of the guide for the direction that is taken.
        bsdf_pdf: f32,
        guide_pdf: f32,
    }
}

/// The guided vertices of a wave, and how those of one block are sampled.
#[derive(Default)]
pub(super) struct GuideRecorder {
    vertices: Vec<GuideVertex>,
    /// Of the vertices, at the end of the wave.
    records: Vec<Record>,
    /// How many of them have their `radiance_before`.
    marked: usize,
    lookups: DirectionLookups,
    /// Directions that the guide has sampled.
    samples: GuideSampleRows,
    /// For these directions.
    evals: EvalRows,
    mix: MixRows,
}

/// Whether directions at a vertex may be guided: not at mirrors, nor where light crosses, for roulette must know how it
/// was refracted.
fn is_guided(vertices: &Vertices, lane: usize) -> bool {
    vertices.rows.flags[lane] & (vertex_flags::DELTA | vertex_flags::TRANSMITS | vertex_flags::MISS) == 0
}

/// What the guide knows of the light at each vertex of a block, where directions may be guided.
pub(super) struct Regions<'a> {
    distributions: Distributions<'a>,
    /// As in [`GuideRegion`](crate::guiding::GuideRegion); one where there is no distribution.
    bsdf_sampling_fraction: Row,
}

impl<'a> Regions<'a> {
    /// Finds the regions of a block's vertices. Loops begin lookups in one pass and finish them in the next: all lanes
    /// wait for memory together.
    pub fn find(guide: &'a Guide, vertices: &Vertices) -> Self {
        let mut points = [TreePoint::default(); BATCH];
        vectorize!(find_tree_points(guide, vertices, &mut points));
        let mut numbers = [0; BATCH];
        let lanes = || (0..vertices.count.min(BATCH)).filter(|&lane| is_guided(vertices, lane));
        for lane in lanes() {
            numbers[lane] = guide.find_region(points[lane]);
        }
        let mut regions = Self { distributions: [None; BATCH], bsdf_sampling_fraction: [1.0; BATCH] };
        for lane in lanes() {
            if let Some(region) = guide.region(numbers[lane]) {
                region.directions.prefetch();
                regions.distributions[lane] = Some(region.directions);
                regions.bsdf_sampling_fraction[lane] = region.bsdf_sampling_fraction;
            }
        }
        regions
    }

    /// The distributions of the vertices that are wanted.
    fn distributions(&self, is_wanted: impl Fn(usize) -> bool) -> Distributions<'a> {
        let mut wanted = self.distributions;
        for (lane, distribution) in wanted.iter_mut().enumerate() {
            if !is_wanted(lane) {
                *distribution = None;
            }
        }
        wanted
    }
}

#[inline(always)]
fn find_tree_points(guide: &Guide, vertices: &Vertices, points: &mut [TreePoint; BATCH]) {
    for (lane, point) in points.iter_mut().enumerate().take(vertices.count) {
        *point = guide.tree_point(vertices.points.p.get(lane).as_vec3(), vertices.facing_normal(lane));
    }
}

/// The density of a direction that the BSDF and the guide choose with these.
#[inline(always)]
fn mixed(bsdf_sampling_fraction: f32, bsdf_pdf: f32, guide_pdf: f32) -> f32 {
    bsdf_sampling_fraction * bsdf_pdf + (1.0 - bsdf_sampling_fraction) * guide_pdf
}

impl GuideRecorder {
    /// Starts a wave.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.marked = 0;
    }

    /// Replaces the densities with which scattering finds the lights' directions.
    pub fn mix_light_pdfs(&mut self, regions: &Regions, vertices: &mut Vertices) {
        let Vertices { light_samples, light_evals, count, .. } = vertices;
        let distributions = regions.distributions(|lane| light_samples.target[lane] != light_target::NONE);
        let guide_pdf = &mut self.mix.guide_pdf;
        self.lookups.find_pdfs(&distributions, &light_samples.direction, guide_pdf, *count);
        vectorize!(mix_pdfs(&regions.bsdf_sampling_fraction, guide_pdf, &mut light_evals.pdf));
    }

    /// Chooses between the BSDF and the guide at each vertex; the number for the choice becomes one for the lobe.
    pub fn choose(&mut self, regions: &Regions, vertices: &mut Vertices) {
        let Vertices { u_bsdf, count, .. } = vertices;
        let [choice, u, v, _] = u_bsdf.numbers();
        let distributions = regions.distributions(|lane| choice[lane] >= regions.bsdf_sampling_fraction[lane]);
        for (is_sample, distribution) in self.mix.is_guide_sample.iter_mut().zip(&distributions) {
            *is_sample = u32::from(distribution.is_some());
        }
        self.lookups.sample(&distributions, [u, v], &mut self.samples, *count);
        vectorize!(rescale_choices(&regions.bsdf_sampling_fraction, u_bsdf));
    }

    /// Replaces the BSDF's samples by those of the guide, and all densities by those of both together.
    pub fn mix(&mut self, context: &Context, regions: &Regions, vertices: &mut Vertices, scratch: &mut BsdfScratch) {
        let Self { lookups, samples, evals, mix, .. } = self;
        let Vertices { rows, bsdfs, non_diffuse, scatter, count, .. } = vertices;
        let count = *count;
        let surfaces = Surfaces { scene: context.scene, count, rows, bsdfs, non_diffuse };
        surfaces.eval(&samples.direction, |lane| mix.is_guide_sample[lane] != 0, scratch, evals);
        vectorize!(find_bsdf_directions(rows, scatter, &mut mix.bsdf_direction, count));
        let is_of_bsdf = |i: usize| mix.is_guide_sample[i] == 0 && scatter.is_valid[i] != 0 && scatter.is_delta[i] == 0;
        let distributions = regions.distributions(is_of_bsdf);
        lookups.find_pdfs(&distributions, &mix.bsdf_direction, &mut mix.guide_pdf_of_bsdf, count);
        vectorize!(mix_samples(&regions.bsdf_sampling_fraction, samples, evals, mix, scatter));
    }

    /// Records the directions of the paths that go on; `is_mixed` if the guide was among what chose them.
    pub fn record(&mut self, vertices: &Vertices, paths: &PathRows, is_mixed: bool) {
        let scatter = &vertices.scatter;
        for lane in
            (0..vertices.count).filter(|&lane| scatter.status[lane] == spawn::SPAWNED && scatter.is_delta[lane] == 0)
        {
            if !is_guided(vertices, lane) {
                continue;
            }
            let has_pdfs = is_mixed && self.mix.has_pdfs[lane] != 0;
            let record = Record {
                p: vertices.points.p.get(lane).as_vec3(),
                n: vertices.facing_normal(lane),
                direction: scatter.direction.get(lane),
                light: 0.0,
                densities: has_pdfs.then(|| [self.mix.bsdf_pdf[lane], self.mix.guide_pdf[lane]]),
            };
            let weight = scatter.weight.get(lane);
            let throughput = vertices.rows.throughput.get(lane) * weight;
            let slot = paths.slot[vertices.path(lane)];
            let pdf_ratio = if has_pdfs { scatter.pdf[lane] / self.mix.bsdf_pdf[lane] } else { 1.0 };
            let radiance_before = Rgb::BLACK;
            self.vertices.push(GuideVertex { record, weight, throughput, pdf_ratio, radiance_before, slot });
        }
    }

    /// All that is added to the samples from here on came from the directions that paths took last.
    pub fn mark_radiance(&mut self, out: &Output) {
        for vertex in &mut self.vertices[self.marked..] {
            vertex.radiance_before = out.batch.pixels[vertex.slot as usize].radiance;
        }
        self.marked = self.vertices.len();
    }

    /// Second moments of all samples. A contribution is what a path adds from one of its vertices to the next. Paths
    /// with the density `r` times that without the guide add `r` times less, so that the mean without it of the square
    /// of a contribution `c r` is the mean of `c² r`.
    pub fn second_moments(&self, out: &SampleBatch) -> Vec<SecondMoments> {
        #[derive(Clone, Copy)]
        struct State {
            radiance: Rgb,
            ratio: f64,
        }

        let count = out.pixels.len();
        let mut moments = vec![SecondMoments::default(); count];
        let mut states = vec![State { radiance: Rgb::BLACK, ratio: 1.0 }; count];
        let add = |moments: &mut SecondMoments, state: &State, radiance: Rgb| {
            for (k, c) in (radiance - state.radiance).to_array().into_iter().enumerate() {
                let square = f64::from(c).powi(2);
                moments.guided[k] += square;
                moments.unguided[k] += square * state.ratio;
            }
        };
        for vertex in &self.vertices {
            let slot = vertex.slot as usize;
            add(&mut moments[slot], &states[slot], vertex.radiance_before);
            let ratio = states[slot].ratio * f64::from(vertex.pdf_ratio);
            states[slot] = State { radiance: vertex.radiance_before, ratio };
        }
        for ((moments, state), pixel) in moments.iter_mut().zip(&states).zip(&out.pixels) {
            add(moments, state, pixel.radiance);
        }
        moments
    }

    /// Records what came from all directions.
    pub fn commit(&mut self, learner: Option<&Guide>, out: &Output) {
        let Some(guide) = learner else { return };
        let with_light = |vertex: &GuideVertex| Record { light: vertex.scattered(out), ..vertex.record };
        self.records.clear();
        self.records.extend(self.vertices.iter().map(with_light));
        guide.record(&self.records);
    }
}

#[inline(always)]
fn mix_pdfs(bsdf_sampling_fraction: &Row, guide_pdf: &Row, pdf: &mut Row) {
    for ((pdf, &fraction), &guide_pdf) in pdf.iter_mut().zip(bsdf_sampling_fraction).zip(guide_pdf) {
        *pdf = mixed(fraction, *pdf, guide_pdf);
    }
}

#[inline(always)]
fn rescale_choices(bsdf_sampling_fraction: &Row, u: &mut SampleRows) {
    for (i, fraction) in bsdf_sampling_fraction.iter().enumerate() {
        u.set_first(i, (u.of(i)[0] / fraction).min(ONE_MINUS_EPSILON));
    }
}

#[inline(always)]
fn find_bsdf_directions(rows: &VertexRows, scatter: &ScatterRows, directions: &mut Vec3Rows, count: usize) {
    for i in 0..whole_vectors(count) {
        let frame = Frame { x: rows.frame_x.get(i), y: rows.frame_y.get(i), z: rows.n.get(i) };
        directions.set(i, frame.to_world(scatter.wi.get(i)));
    }
}

#[inline(always)]
fn mix_samples(
    bsdf_sampling_fraction: &Row,
    samples: &GuideSampleRows,
    evals: &EvalRows,
    mix: &mut MixRows,
    scatter: &mut ScatterRows,
) {
    for (i, &fraction) in bsdf_sampling_fraction.iter().enumerate() {
        let is_guide_sample = mix.is_guide_sample[i] != 0;
        let (bsdf_pdf, guide_pdf) =
            if is_guide_sample { (evals.pdf[i], samples.pdf[i]) } else { (scatter.pdf[i], mix.guide_pdf_of_bsdf[i]) };
        let pdf = mixed(fraction, bsdf_pdf, guide_pdf);
        let ratio = pdf / bsdf_pdf;
        let is_known = (fraction < 1.0) & (is_guide_sample | (scatter.is_valid[i] != 0));
        let is_delta = !is_guide_sample & (scatter.is_delta[i] != 0);
        // What only the BSDF samples has its fraction as density.
        let (factor, rr_factor) =
            if is_delta { (1.0 / fraction, fraction) } else { (1.0 / ratio, ratio.min(MAX_PDF_RATIO)) };
        let (weight, old_rr_factor) = (scatter.weight.get(i), scatter.rr_factor[i]);
        let guided_weight = evals.value.get(i) * (1.0 / pdf);
        let mixed_weight = if is_guide_sample { guided_weight } else { weight * factor };
        let mixed_rr_factor = if is_guide_sample { rr_factor } else { old_rr_factor * rr_factor };
        scatter.weight.set(i, if is_known { mixed_weight } else { weight });
        scatter.rr_factor[i] = if is_known { mixed_rr_factor } else { old_rr_factor };
        let wi = if is_guide_sample { evals.wi.get(i) } else { scatter.wi.get(i) };
        scatter.wi.set(i, wi);
        scatter.pdf[i] = if is_known & !is_delta { pdf } else { scatter.pdf[i] };
        let is_lit = u32::from(!evals.value.get(i).is_black());
        scatter.is_valid[i] = if is_guide_sample { is_lit } else { scatter.is_valid[i] };
        scatter.is_delta[i] = if is_guide_sample { 0 } else { scatter.is_delta[i] };
        scatter.is_transmission[i] = if is_guide_sample { 0 } else { scatter.is_transmission[i] };
        (mix.bsdf_pdf[i], mix.guide_pdf[i]) = (bsdf_pdf, guide_pdf);
        mix.has_pdfs[i] = u32::from(is_known & !is_delta);
    }
}
