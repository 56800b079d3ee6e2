//! Caustic photons: light that mirrors, metal and glass throw on other surfaces, traced from the lights.
//!
//! Paths from the camera find such light only if they happen to be scattered towards what throws it. Photons start
//! where the light arrives at a mirror, metal or glass, are scattered by delta and near-specular lobes, and are stored
//! where they arrive at anything else. There paths gather those that are near ("vertex merging" of Georgiev et al.
//! 2012, for these paths alone), and multiple importance sampling weighs all ways to find the same light.
//!
//! The sample index of a path decides on the photons that it gathers: each epoch of [`EPOCH`] samples has its own,
//! which depend on the seed and on the epoch alone. The radius shrinks from epoch to epoch, so that the blur vanishes
//! as samples are added (Knaus and Zwicker 2011).

mod casters;
mod coverage;
mod photon_map;

pub use casters::{CausticCasters, CausticPoint};
pub use coverage::{DiscSamples, correct_for_coverage};
pub use photon_map::{Photon, PhotonMap};

/// Samples of a pixel that gather the same photons.
pub const EPOCH: u32 = 8;

/// What paths of an epoch read.
#[derive(Debug)]
pub struct Caustics<'a> {
    /// The surfaces where photons start.
    pub casters: &'a CausticCasters,
    /// The photons.
    pub photons: &'a PhotonMap,
    /// Whether [`Workspace::pilot_moments`](super::Workspace::pilot_moments) are wanted.
    pub has_moments: bool,
}
