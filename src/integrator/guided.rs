//! Directions chosen by what was learned of the light, beside those that the surface prefers, and what paths teach.

use super::vertex::Vertex;
use super::{PathIntegrator, World};
use crate::bsdf::{BsdfEval, BsdfSample};
use crate::color::Rgb;
use crate::film::PixelSample;
use crate::guiding::{Directions, GuideSample};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Ray, Vec3};

/// How many directions the surface chooses where something is known of the light; the light chooses the rest.
#[allow(dead_code)]
const BSDF_SHARE: f32 = 0.5;

/// Roulette forgets at most that a direction was chosen so many times as often as the surface would have.
const LARGEST_GAIN: f32 = 1e6;

/// How the next direction is chosen at a vertex.
#[derive(Clone, Copy)]
pub(super) struct Steering<'a> {
    directions: Option<&'a Directions>,
    share: f32,
    gain: bool,
}

static BOUNCES: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| crate::guiding::knob("GB", 1000.0) as u32);
static GAIN: std::sync::LazyLock<bool> = std::sync::LazyLock::new(|| crate::guiding::knob("GR", 1.0) > 0.0);

/// A direction that a path took.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    p: Vec3,
    n: Vec3,
    weight: Rgb,
    pdfs: [f32; 2],
    direction: Vec3,
    /// Density of the direction.
    pdf: f32,
    /// What scattering here and before makes of light from the direction, roulette left out.
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
    pub fn new(integrator: &'a PathIntegrator, vertex: &Vertex, bounce: u32) -> Option<Self> {
        let guide = integrator.guide.as_deref()?;
        if bounce >= *BOUNCES || vertex.bsdf.is_delta() || vertex.bsdf.transmits() {
            return None;
        }
        let known = guide.at(vertex.at.p.as_vec3(), vertex.frame.z * 1f32.copysign(vertex.wo.z));
        Some(Self { directions: known.map(|k| k.0), share: known.map_or(1.0, |k| k.1), gain: *GAIN })
    }

    /// The density of a direction that the surface chooses with density `pdf`.
    #[inline]
    pub fn pdf(&self, direction: Vec3, pdf: f32) -> f32 {
        match self.directions {
            Some(directions) => self.share * pdf + (1.0 - self.share) * directions.pdf(direction),
            None => pdf,
        }
    }

    /// A direction with the ray that follows it, and the density over that of the surface alone, which roulette had better not see.
    #[inline]
    pub fn sample(&self, world: &World, vertex: &Vertex, u_lobe: f32, u: [f32; 2]) -> Option<(BsdfSample, Ray, f32, [f32; 2])> {
        self.sample_(world, vertex, u_lobe, u).map(|(a, b, c, d)| (a, b, if self.gain { c } else { 1.0 }, d))
    }

    #[inline]
    pub fn sample_(&self, world: &World, vertex: &Vertex, mut u_lobe: f32, u: [f32; 2]) -> Option<(BsdfSample, Ray, f32, [f32; 2])> {
        let Some(directions) = self.directions else {
            return vertex.sample(world, u_lobe, u).map(|(sample, ray)| (sample, ray, 1.0, [0.0, -1.0]));
        };
        if u_lobe < self.share {
            u_lobe = (u_lobe / self.share).min(ONE_MINUS_EPSILON);
            let (mut sample, ray) = vertex.sample(world, u_lobe, u)?;
            if sample.is_delta {
                sample.weight *= 1.0 / self.share;
                return Some((sample, ray, self.share, [0.0, -1.0]));
            }
            let pdfs = [sample.pdf, directions.pdf(ray.direction)];
            let pdf = self.share * pdfs[0] + (1.0 - self.share) * pdfs[1];
            let gain = pdf / sample.pdf;
            sample.weight *= 1.0 / gain;
            sample.pdf = pdf;
            return Some((sample, ray, gain.min(LARGEST_GAIN), pdfs));
        }
        let GuideSample { direction, pdf } = directions.sample(u);
        let mut raised = None;
        let (BsdfEval { value, pdf: of_surface }, start) = vertex.eval_toward(world, direction, &mut raised)?;
        let pdfs = [of_surface, pdf];
        let pdf = self.share * of_surface + (1.0 - self.share) * pdf;
        let sample = BsdfSample {
            wi: vertex.frame.to_local(direction),
            weight: value * (1.0 / pdf),
            pdf,
            is_delta: false,
            is_transmission: false,
            eta: 1.0,
        };
        Some((sample, start.spawn(direction), (pdf / of_surface).min(LARGEST_GAIN), pdfs))
    }
}

impl Turns {
    pub fn clear(&mut self) {
        self.turns.clear();
        self.settled = 0;
    }

    /// A path goes on from `p`; `throughput` is without roulette.
    #[inline]
    pub fn push(&mut self, p: Vec3, n: Vec3, weight: Rgb, pdfs: [f32; 2], direction: Vec3, pdf: f32, throughput: Rgb, slot: u32) {
        self.turns.push(Turn { p, n, weight, pdfs, direction, pdf, throughput, before: Rgb::BLACK, slot });
    }

    /// All that the paths bring from here on comes from the directions they took.
    pub fn settle(&mut self, out: &[PixelSample]) {
        for turn in &mut self.turns[self.settled..] {
            turn.before = out[turn.slot as usize].radiance;
        }
        self.settled = self.turns.len();
    }

    /// Tells the guide what came from all directions taken.
    pub fn record(&self, integrator: &PathIntegrator, out: &[PixelSample]) {
        let Some(guide) = integrator.guide.as_deref().filter(|guide| guide.learns()) else { return };
        for turn in &self.turns {
            let brought = out[turn.slot as usize].radiance - turn.before;
            // What a channel brings that nothing is left of is rounding.
            let light = |brought: f32, throughput: f32| if throughput > 0.0 { (brought / throughput).max(0.0) } else { 0.0 };
            let t = turn.throughput;
            let light = (light(brought.r, t.r) + light(brought.g, t.g) + light(brought.b, t.b)) * (1.0 / 3.0);
            let w = turn.weight;
            let light = match guide.mode {
                0 => light / turn.pdf,
                1 => light * w.mean(),
                _ => (light * w.mean()) * (light * w.mean()) * turn.pdf,
            };
            guide.record(turn.p, turn.n, turn.direction, light, turn.pdfs);
        }
    }
}
