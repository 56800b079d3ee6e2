//! Rays through media that scatter and emit light.
//!
//! Distances in homogeneous media are sampled for one channel, which is chosen by what the path carries of each, and
//! weighted by the balance heuristic over all channels (Wilkie et al., "Hero Wavelength Spectral Sampling"). Those in
//! volumes are the volumes' own.

use super::World;
use super::media::{MAX_SURFACES, MediaState};
use crate::color::Rgb;
use crate::geometry::{Hit, SpawnPoint};
use crate::id::{MediumId, PrimId, ShapeId};
use crate::light::RaySegment;
use crate::math::{Ray, Rng};
use crate::medium::{FreeFlight, Medium, RelativeIor, transmittance};

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
    /// The way to the first boundary or surface, if it is through a homogeneous medium that scatters.
    pub first: Option<FirstSegment>,
}

/// A path's way through a homogeneous medium from where its ray starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct FirstSegment {
    pub medium: MediumId,
    /// To its first boundary or surface.
    pub way: RaySegment,
    /// The share of each channel in the choice of one.
    shares: [f32; 3],
}

impl FirstSegment {
    /// Density of distances that follow the extinction.
    pub fn pdf(&self, world: &World, distance: f32) -> f32 {
        let extinction = world.scene.media.get(self.medium).extinction();
        let Rgb { r, g, b } = transmittance(extinction, distance) * extinction * Rgb::from(self.shares);
        r + g + b
    }
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
    /// With the optical depth in that channel.
    flight: FreeFlight,
    /// The path's throughput.
    carried: Rgb,
}

impl DistanceSample {
    /// For a path of this throughput, `u` in the unit square; `random` is for what needs more numbers.
    pub fn new(throughput: Rgb, u: [f32; 2], random: Rng) -> Self {
        let carried = throughput.map(|t| t.max(0.0));
        let sum = carried.r + carried.g + carried.b;
        let shares = if sum > 0.0 && sum.is_finite() { (carried / sum).to_array() } else { [1.0 / 3.0; 3] };
        // Rounding must not choose a channel of no share.
        let last = if shares[2] > 0.0 { 2 } else { usize::from(shares[1] > 0.0) };
        let channel = if u[0] < shares[0] { 0 } else { last.min(if u[0] < shares[0] + shares[1] { 1 } else { 2 }) };
        Self { shares, channel, flight: FreeFlight::new(u[1], random), carried: throughput }
    }

    /// The distance to the next scattering by a homogeneous medium, if nothing is in the way.
    pub fn reach(&self, medium: &Medium) -> f32 {
        let of_channel = medium.extinction().to_array()[self.channel];
        if of_channel > 0.0 { self.flight.depth / of_channel } else { f32::INFINITY }
    }
}

/// Contribution and density of a ray so far, by channel.
pub(super) struct Track {
    value: Rgb,
    pdf: Rgb,
    shares: Rgb,
}

impl Track {
    /// At the start of a ray.
    pub fn new(sample: &DistanceSample) -> Self {
        Self { value: Rgb::WHITE, pdf: Rgb::WHITE, shares: sample.shares.into() }
    }

    /// Balance heuristic over the channels.
    pub fn weight(&self) -> Rgb {
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
        let mut track = Track::new(&sample);
        let mut emitted = Rgb::BLACK;
        let mut passed = 0;
        let mut first = None;
        loop {
            let at = self.resolve(ray, hit);
            if let Some(id) = self.scene.media.at(&state.current) {
                let way = Ray { t_max: at.as_ref().map_or(ray.t_max, |at| at.t), ..*ray };
                if passed == 0 {
                    first = self.first_segment(id, &way, &sample);
                }
                let segment = self.travel(id, &way, &mut sample, &mut track);
                emitted += segment.emitted;
                if let Some(t) = segment.t {
                    let hit = Some(scattering_at(id, t));
                    return MediumPath { hit, weight: track.weight(), emitted, passed, ior: None, first };
                }
            }
            let boundary = at.as_ref().and_then(|at| self.boundary(ray, hit, at, state));
            let ior = boundary.as_ref().map(|boundary| boundary.ior);
            let (Some(at), Some(boundary), true) =
                (at, boundary, ior.is_some_and(|ior| ior.is_one()) && passed < MAX_SURFACES)
            else {
                return MediumPath { hit, weight: track.weight(), emitted, passed, ior, first };
            };
            state.current = boundary.sides.beyond(ray.direction.dot(at.n_g) < 0.0);
            *ray = at.spawn(ray.direction);
            hit = self.accel.intersect(ray);
            passed += 1;
        }
    }

    /// What is left of the light along a shadow ray within the media `state`, which only boundaries within one medium
    /// do not block; with the number of rays traced.
    pub(super) fn light_transmittance(
        &self,
        ray: &Ray,
        end: &ShadowEnd,
        mut state: MediaState,
        random: &mut Rng,
    ) -> (Rgb, u64) {
        let mut ray = *ray;
        let mut left = Rgb::WHITE;
        for passed in 0..=MAX_SURFACES {
            let hit = self.accel.intersect(&ray);
            let at = self.resolve(&ray, hit);
            let way = Ray { t_max: at.as_ref().map_or(ray.t_max, |at| at.t), ..ray };
            left *= self.scene.media.transmittance(&state.current, &way, || Rng::new(random.bits()));
            let traced = u64::from(passed) + 1;
            let Some(at) = at.filter(|_| !left.is_black()) else { return (left, traced) };
            let boundary = self.boundary(&ray, hit, &at, &state).filter(|boundary| boundary.ior.is_one());
            let Some(boundary) = boundary else { return (Rgb::BLACK, traced) };
            state.current = boundary.sides.beyond(ray.direction.dot(at.n_g) < 0.0);
            ray = match end {
                ShadowEnd::Point(target) => at.spawn_to(target),
                ShadowEnd::Infinity => at.spawn(ray.direction),
            };
        }
        (Rgb::BLACK, u64::from(MAX_SURFACES) + 1)
    }

    fn first_segment(&self, id: MediumId, ray: &Ray, sample: &DistanceSample) -> Option<FirstSegment> {
        let medium = self.scene.media.get(id);
        if medium.scattering.is_black() || medium.volume.is_some() || self.enclosed_media[id.index()] {
            return None;
        }
        let (direction, length) = (ray.direction, ray.direction.length());
        let way = RaySegment {
            origin: ray.origin.as_dvec3() + direction.as_dvec3() * f64::from(ray.t_min),
            direction: direction / length,
            length: (ray.t_max - ray.t_min) * length,
        };
        Some(FirstSegment { medium: id, way, shares: sample.shares })
    }

    /// Goes through a medium to the end of a ray, or to where it scatters.
    fn travel(&self, id: MediumId, ray: &Ray, sample: &mut DistanceSample, track: &mut Track) -> Segment {
        let medium = self.scene.media.get(id);
        let before = track.weight();
        if let Some(volume) = self.scene.media.volume(medium) {
            let tracked = volume.track(medium, ray, sample.carried * before, &mut sample.flight);
            track.value *= tracked.weight;
            return Segment { t: tracked.t, emitted: before * tracked.emitted };
        }
        let distance = (ray.t_max - ray.t_min) * ray.direction.length();
        let emitted = if medium.emission.is_black() { Rgb::BLACK } else { before * medium.emitted(distance) };
        let scattered = travel(medium, distance, sample, track);
        Segment { t: scattered.map(|distance| ray.t_min + distance / ray.direction.length()), emitted }
    }
}

/// A path's way through one medium.
struct Segment {
    /// Where on the ray it is scattered, if it is.
    t: Option<f32>,
    /// Radiance emitted towards the start of the path's ray.
    emitted: Rgb,
}

/// A point of a medium in place of a surface's.
fn scattering_at(id: MediumId, t: f32) -> Hit {
    Hit { t, u: 0.0, v: 0.0, shape: ShapeId(id.0), prim: PrimId(0), instance: Hit::MEDIUM }
}

/// Goes up to `distance` through a medium; the distance to where it scatters, if it does.
pub(super) fn travel(medium: &Medium, distance: f32, sample: &mut DistanceSample, track: &mut Track) -> Option<f32> {
    let extinction = medium.extinction();
    if medium.scattering.is_black() {
        track.value *= transmittance(extinction, distance);
        return None;
    }
    let of_channel = extinction.to_array()[sample.channel];
    let free = sample.reach(medium);
    if free < distance {
        let left = transmittance(extinction, free);
        track.value *= left * medium.scattering;
        track.pdf *= left * extinction;
        return Some(free);
    }
    if of_channel > 0.0 {
        sample.flight.depth = (sample.flight.depth - of_channel * distance).max(0.0);
    }
    let left = transmittance(extinction, distance);
    track.value *= left;
    track.pdf *= left;
    None
}
