//! Rays through media that scatter and emit light.
//!
//! Distances are sampled for one channel, which is chosen by what the path carries of each, and weighted by the balance
//! heuristic over all channels (Wilkie et al., "Hero Wavelength Spectral Sampling").

use super::World;
use super::media::{MAX_SURFACES, MediaState};
use crate::color::Rgb;
use crate::geometry::{Hit, SpawnPoint, SurfaceInteraction};
use crate::id::{MediumId, PrimId, ShapeId};
use crate::math::Ray;
use crate::medium::{Medium, RelativeIor, transmittance};

/// What a path's ray meets first of media that scatter and of surfaces that are no mere boundaries within one medium.
pub(super) struct MediumPath {
    /// On the ray, which starts at the last boundary that it has passed; of a medium with [`Hit::MEDIUM`].
    pub hit: Option<Hit>,
    /// Factor on the path's throughput.
    pub weight: Rgb,
    /// Radiance that media emit along the ray, before the throughput.
    pub emitted: Rgb,
    /// Surfaces passed.
    pub passed: u32,
    /// At a boundary between media, the relative index of refraction.
    pub ior: Option<RelativeIor>,
}

/// Where a shadow ray goes.
pub(super) enum ShadowEnd<'a> {
    /// To a point.
    Point(&'a SpawnPoint),
    /// To infinity.
    Infinity,
}

/// Chosen by chance for the distance to the next scattering.
pub(super) struct DistanceSample {
    /// The share of each channel in the choice.
    shares: [f32; 3],
    channel: usize,
    /// Optical depth in that channel.
    depth: f32,
}

impl DistanceSample {
    /// For a path of this throughput, `u` in the unit square.
    pub fn new(throughput: Rgb, u: [f32; 2]) -> Self {
        let carried = throughput.map(|t| t.max(0.0));
        let sum = carried.r + carried.g + carried.b;
        let shares = if sum > 0.0 && sum.is_finite() { (carried / sum).to_array() } else { [1.0 / 3.0; 3] };
        // Rounding must not choose a channel of no share.
        let last = if shares[2] > 0.0 { 2 } else { usize::from(shares[1] > 0.0) };
        let channel = if u[0] < shares[0] { 0 } else { last.min(if u[0] < shares[0] + shares[1] { 1 } else { 2 }) };
        Self { shares, channel, depth: -(-u[1]).ln_1p() }
    }
}

/// Contribution and density of a ray so far, by channel.
struct Track {
    value: Rgb,
    pdf: Rgb,
    shares: Rgb,
}

impl Track {
    /// Balance heuristic over the channels.
    fn weight(&self) -> Rgb {
        let Rgb { r, g, b } = self.pdf * self.shares;
        self.value / (r + g + b)
    }
}

impl World<'_> {
    /// Follows a path's `ray`, which has found `hit`, to the next point that scatters it.
    pub(super) fn trace_through_media(
        &self,
        ray: &mut Ray,
        mut hit: Option<Hit>,
        state: &mut MediaState,
        mut sample: DistanceSample,
    ) -> MediumPath {
        let mut track = Track { value: Rgb::WHITE, pdf: Rgb::WHITE, shares: sample.shares.into() };
        let mut emitted = Rgb::BLACK;
        let mut passed = 0;
        loop {
            let at = self.resolve(ray, hit);
            let distance = self.distance(ray, at.as_ref());
            if let Some(id) = self.scene.media.at(&state.current) {
                let medium = self.scene.media.get(id);
                if !medium.emission.is_black() {
                    emitted += track.weight() * medium.emitted(distance);
                }
                if let Some(distance) = travel(medium, distance, &mut sample, &mut track) {
                    let hit = Some(scattering_at(id, ray.t_min + distance / ray.direction.length()));
                    return MediumPath { hit, weight: track.weight(), emitted, passed, ior: None };
                }
            }
            let boundary = at.as_ref().and_then(|at| self.boundary(at, ray.direction, state));
            let ior = boundary.as_ref().map(|boundary| boundary.ior);
            let (Some(at), Some(boundary), true) =
                (at, boundary, ior.is_some_and(|ior| ior.is_one()) && passed < MAX_SURFACES)
            else {
                return MediumPath { hit, weight: track.weight(), emitted, passed, ior };
            };
            state.current = boundary.sides.beyond(ray.direction.dot(at.n_g) < 0.0);
            *ray = at.spawn(ray.direction);
            hit = self.accel.intersect(ray);
            passed += 1;
        }
    }

    /// What is left of the light along a shadow ray within the media `state`, which only boundaries within one medium
    /// do not block; with the number of rays traced.
    pub(super) fn light_transmittance(&self, ray: &Ray, end: &ShadowEnd, mut state: MediaState) -> (Rgb, u64) {
        let mut ray = *ray;
        let mut left = Rgb::WHITE;
        for passed in 0..=MAX_SURFACES {
            let at = self.closest(&ray);
            left *= self.scene.media.transmittance(&state.current, self.distance(&ray, at.as_ref()));
            let traced = u64::from(passed) + 1;
            let Some(at) = at.filter(|_| !left.is_black()) else { return (left, traced) };
            let boundary = self.boundary(&at, ray.direction, &state).filter(|boundary| boundary.ior.is_one());
            let Some(boundary) = boundary else { return (Rgb::BLACK, traced) };
            state.current = boundary.sides.beyond(ray.direction.dot(at.n_g) < 0.0);
            ray = match end {
                ShadowEnd::Point(target) => at.spawn_to(target),
                ShadowEnd::Infinity => at.spawn(ray.direction),
            };
        }
        (Rgb::BLACK, u64::from(MAX_SURFACES) + 1)
    }

    /// From the start of a ray to a surface that it meets, or to its end.
    fn distance(&self, ray: &Ray, at: Option<&SurfaceInteraction>) -> f32 {
        (at.map_or(ray.t_max, |at| at.t) - ray.t_min) * ray.direction.length()
    }
}

/// A point of a medium in place of a surface's.
fn scattering_at(id: MediumId, t: f32) -> Hit {
    Hit { t, u: 0.0, v: 0.0, shape: ShapeId(id.0), prim: PrimId(0), instance: Hit::MEDIUM }
}

/// Goes up to `distance` through a medium; the distance to where it scatters, if it does.
fn travel(medium: &Medium, distance: f32, sample: &mut DistanceSample, track: &mut Track) -> Option<f32> {
    let extinction = medium.extinction();
    if medium.scattering.is_black() {
        track.value *= transmittance(extinction, distance);
        return None;
    }
    let of_channel = extinction.to_array()[sample.channel];
    let free = if of_channel > 0.0 { sample.depth / of_channel } else { f32::INFINITY };
    if free < distance {
        let left = transmittance(extinction, free);
        track.value *= left * medium.scattering;
        track.pdf *= left * extinction;
        return Some(free);
    }
    if of_channel > 0.0 {
        sample.depth = (sample.depth - of_channel * distance).max(0.0);
    }
    let left = transmittance(extinction, distance);
    track.value *= left;
    track.pdf *= left;
    None
}
