//! Directions chosen by what was learned of the light, beside those that the surface prefers, and what paths teach.

use super::vertex::Vertex;
use super::{PathIntegrator, World};
use crate::bsdf::{BsdfEval, BsdfSample};
use crate::color::Rgb;
use crate::film::SampleBatch;
use crate::guiding::{GuideSample, Known, Record};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Ray, Vec3};

/// Roulette forgets at most that a direction was chosen so many times as often as the surface would have.
const LARGEST_GAIN: f32 = 1e6;

/// How the next direction is chosen at a vertex.
#[derive(Clone, Copy)]
pub(super) struct Steering<'a> {
    known: Option<Known<'a>>,
}

/// A chosen direction.
pub(super) struct Steered {
    pub sample: BsdfSample,
    pub ray: Ray,
    /// Its density over that of the surface alone, which roulette had better not see.
    pub gain: f32,
    /// The densities of the surface and of the guide, if that knows anything.
    pub densities: Option<[f32; 2]>,
}

/// A direction that a path took.
#[derive(Clone, Copy, Debug)]
struct Turn {
    /// All but the light.
    record: Record,
    /// What light from the direction becomes at the vertex, over the density, and at the camera, roulette here left out.
    weight: Rgb,
    throughput: Rgb,
    /// What the path had brought before it went there.
    before: Rgb,
    slot: u32,
}

/// The turns of a batch's paths.
#[derive(Default)]
pub(super) struct Turns {
    turns: Vec<Turn>,
    /// How many of them know what was before.
    settled: usize,
}

impl<'a> Steering<'a> {
    /// At a vertex; `None` where light does not choose: at mirrors and where light passes, for which roulette must know how it was refracted.
    #[inline]
    pub fn new(integrator: &'a PathIntegrator, vertex: &Vertex) -> Option<Self> {
        let guide = integrator.guide.as_deref()?;
        if vertex.bsdf.is_delta() || vertex.bsdf.transmits() {
            return None;
        }
        Some(Self { known: guide.at(vertex.at.p.as_vec3(), facing(vertex)) })
    }

    /// The density of a direction that the surface chooses with density `pdf`.
    #[inline]
    pub fn pdf(&self, direction: Vec3, pdf: f32) -> f32 {
        match &self.known {
            Some(known) => mixed(known, [pdf, known.directions.pdf(direction)]),
            None => pdf,
        }
    }

    /// A direction with the ray that follows it.
    #[inline]
    pub fn sample(&self, world: &World, vertex: &Vertex, u_lobe: f32, u: [f32; 2]) -> Option<Steered> {
        let Some(known) = &self.known else {
            let (sample, ray) = vertex.sample(world, u_lobe, u)?;
            return Some(Steered { sample, ray, gain: 1.0, densities: None });
        };
        let share = known.surface_share;
        if u_lobe < share {
            let (mut sample, ray) = vertex.sample(world, (u_lobe / share).min(ONE_MINUS_EPSILON), u)?;
            if sample.is_delta {
                sample.weight *= 1.0 / share;
                return Some(Steered { sample, ray, gain: share, densities: None });
            }
            let densities = [sample.pdf, known.directions.pdf(ray.direction)];
            let pdf = mixed(known, densities);
            let gain = pdf / sample.pdf;
            sample.weight *= 1.0 / gain;
            sample.pdf = pdf;
            return Some(Steered { sample, ray, gain: gain.min(LARGEST_GAIN), densities: Some(densities) });
        }
        let GuideSample { direction, pdf } = known.directions.sample(u);
        let mut raised = None;
        let (BsdfEval { value, pdf: of_surface }, start) = vertex.eval_toward(world, direction, &mut raised)?;
        let densities = [of_surface, pdf];
        let pdf = mixed(known, densities);
        let sample = BsdfSample {
            wi: vertex.frame.to_local(direction),
            weight: value * (1.0 / pdf),
            pdf,
            is_delta: false,
            is_transmission: false,
            eta: 1.0,
        };
        let gain = (pdf / of_surface).min(LARGEST_GAIN);
        Some(Steered { sample, ray: start.spawn(direction), gain, densities: Some(densities) })
    }
}

/// The density of a direction that the surface and the guide choose with these.
#[inline]
fn mixed(known: &Known, [surface, guide]: [f32; 2]) -> f32 {
    known.surface_share * surface + (1.0 - known.surface_share) * guide
}

/// The normal on the side of the path.
#[inline]
fn facing(vertex: &Vertex) -> Vec3 {
    vertex.frame.z * 1f32.copysign(vertex.wo.z)
}

impl Turns {
    pub fn clear(&mut self) {
        self.turns.clear();
        self.settled = 0;
    }

    /// A path goes on from a vertex; `throughput` is without roulette there.
    #[inline]
    pub fn push(&mut self, vertex: &Vertex, steered: &Steered, throughput: Rgb, slot: u32) {
        if steered.sample.is_delta {
            return;
        }
        let record = Record {
            p: vertex.at.p.as_vec3(),
            n: facing(vertex),
            direction: steered.ray.direction,
            light: 0.0,
            densities: steered.densities,
        };
        self.turns.push(Turn { record, weight: steered.sample.weight, throughput, before: Rgb::BLACK, slot });
    }

    /// All that the paths bring from here on comes from the directions they took.
    pub fn settle(&mut self, out: &SampleBatch) {
        for turn in &mut self.turns[self.settled..] {
            turn.before = out.pixels[turn.slot as usize].radiance;
        }
        self.settled = self.turns.len();
    }

    /// Tells the guide what came from all directions taken.
    pub fn teach(&mut self, integrator: &PathIntegrator, out: &SampleBatch) {
        let Some(guide) = integrator.guide.as_deref().filter(|guide| guide.learns()) else { return };
        for turn in &mut self.turns {
            let brought = out.pixels[turn.slot as usize].radiance - turn.before;
            // What a channel brings that nothing is left of is rounding.
            let of_channel = |brought: f32, weight: f32, all: f32| if all > 0.0 { (brought * (weight / all)).max(0.0) } else { 0.0 };
            let (w, t) = (turn.weight, turn.throughput);
            let channels = [of_channel(brought.r, w.r, t.r), of_channel(brought.g, w.g, t.g), of_channel(brought.b, w.b, t.b)];
            turn.record.light = Rgb::from(channels).mean();
            guide.record(&turn.record);
        }
    }
}
