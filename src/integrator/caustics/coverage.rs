//! How much of the disc within which a photon is gathered is covered by surfaces that gather it.

use rayon::prelude::*;

use super::Photon;
use super::photon_map::{is_about_parallel, is_around};
use crate::integrator::world::World;
use crate::math::float::step_past;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampling::warp::concentric_disk;
use crate::sampling::{PixelSeed, Sampler};

/// After a first point of the disc that is not on such a surface, points are tried until so many are.
const FOUND: u32 = 3;

/// Points of a disc that are tried, at most.
const TRIED: u32 = 64;

/// Surfaces between two points, at most.
const CROSSED: u32 = 8;

/// Random numbers for the photons of an epoch, by their index.
#[derive(Clone, Copy, Debug)]
pub struct DiscSamples<'a> {
    /// The sampler.
    pub sampler: &'a Sampler,
    /// Of the epoch.
    pub seed: PixelSeed,
}

/// Multiplies the power of each photon by an estimate of the area of its disc over that of the part which is projected
/// on surfaces that gather the photon, and counts the rays traced. Else what photons carry to edges and into corners
/// would be lost, for beyond an edge nothing gathers.
///
/// The number of points of the disc that have to be tried before one is on such a surface has the expected value wanted
/// ("Unbiased Photon Gathering for Light Transport Simulation", Qin et al. 2015, estimates another probability by it).
/// Most photons need a single point. Where the first is not on such a surface, what is still to be expected is
/// estimated by the mean of several such numbers. A photon keeps its power if none of the points is.
/// Mirrors and glass beside a surface that gathers count as part of it.
pub fn correct_for_coverage(photons: &mut [Photon], world: &World, radius: f32, samples: DiscSamples) -> u64 {
    let correct = |(i, photon): (usize, &mut Photon)| {
        let mut disc =
            Disc { world, p: photon.p, frame: Frame::from_normal(photon.n), radius, height: radius, rays: 0 };
        let mut tries = (0..TRIED / 2).flat_map(|set| {
            let [a, b, c, d] = samples.sampler.sample_4d(samples.seed, i as u32, set);
            [[a, b], [c, d]].map(concentric_disk)
        });
        if tries.next().is_some_and(|point| disc.is_covered(point)) {
            return disc.rays;
        }
        // The first point does not count where it could not be seen.
        let first = if disc.lower_below_obstacle() { 0.0 } else { 1.0 };
        let (mut tried, mut found) = (0, 0);
        for point in tries {
            tried += 1;
            found += u32::from(disc.is_covered(point));
            if found == FOUND {
                break;
            }
        }
        photon.height = disc.height / radius;
        if found > 0 {
            photon.power *= first + tried as f32 / found as f32;
        }
        disc.rays
    };
    photons.par_iter_mut().enumerate().map(correct).sum()
}

/// The disc around a photon, and the apex above it from which it is projected.
struct Disc<'a> {
    world: &'a World<'a>,
    p: Vec3,
    frame: Frame,
    radius: f32,
    height: f32,
    /// Rays traced so far.
    rays: u64,
}

impl Disc<'_> {
    /// Moves the apex below what is above the photon, if anything is.
    fn lower_below_obstacle(&mut self) -> bool {
        self.rays += 1;
        let up = Ray { t_min: 0.05 * self.height, t_max: self.height, ..Ray::new(self.p, self.frame.z) };
        let Some(obstacle) = self.world.closest(&up) else { return false };
        self.height = 0.5 * obstacle.t;
        true
    }

    /// Whether a point of the unit disc is on a surface that gathers the photon. A closed object may be in between,
    /// which the ray enters and leaves; surfaces within it, or beyond the single surface of a wall, are invisible.
    fn is_covered(&mut self, point: Vec2) -> bool {
        let across = (self.frame.x * point.x + self.frame.y * point.y) * self.radius;
        let up = self.frame.z * self.height;
        let deepest = 1.0 + 0.5 * self.radius / self.height;
        let mut ray = Ray { t_max: deepest, ..Ray::new(self.p + up, across - up) };
        for crossed in 0..CROSSED {
            self.rays += 1;
            let Some(at) = self.world.closest(&ray) else { return false };
            if is_around(self.p - at.p.as_vec3(), at.n_g, self.radius) && is_about_parallel(self.frame.z, at.n_g) {
                return crossed % 2 == 0;
            }
            ray.t_min = step_past(at.t);
        }
        false
    }
}
