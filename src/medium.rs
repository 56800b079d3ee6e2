//! Media that fill closed surfaces, and which of them a point is in.
//!
//! Surfaces of media may overlap. Of the media that contain a point, the one of the highest priority is there (Schmidt
//! and Budge, "Simple Nested Dielectrics in Ray Traced Images"). What is there thus depends on the point alone, not on
//! the way that light took to it: a boundary is where what is there changes, and light finds the same boundaries in
//! either direction.

mod blackbody;
mod blocks;
mod noise;
mod subsurface;
mod volume;
mod voxels;

pub use blackbody::blackbody;
pub use noise::Noise;
pub use subsurface::{Subsurface, half_space_albedo};
pub use volume::{Coefficients, ExtinctionSplit, FreeFlight, Tracked, Volume, VolumeGrids};
pub use voxels::{Border, Voxel, VoxelGrid};

use std::cmp::Ordering;

use crate::bsdf::{Phase, PhaseLobe, WeightedLobe};
use crate::color::Rgb;
use crate::id::{MediumId, VolumeId};
use crate::math::random::hash64;
use crate::math::{DVec3, Ray, RenderSpace, Rng};

/// Wavelengths in nanometres of red, green and blue, as for the indices of metals.
const WAVELENGTHS: [f32; 3] = [650.0, 550.0, 450.0];

/// The green channel, which is used where none is chosen.
const GREEN: usize = 1;

/// What fills closed surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Where media overlap, the one of the highest priority is there.
    pub priority: i32,
    /// Index of refraction for red, green and blue; that of empty space is 1.
    pub ior: [f32; 3],
    /// Coefficients for red, green and blue, per unit of length, finite and not negative: of absorption,
    pub absorption: Rgb,
    /// and of scattering.
    pub scattering: Rgb,
    /// Radiance that it emits per unit of length.
    pub emission: Rgb,
    /// How it scatters.
    pub phase: Phase,
    /// What differs from place to place, if anything does.
    pub volume: Option<VolumeId>,
}

impl Medium {
    /// The order in which media count where they overlap: by priority; at equal priorities the one of the higher index
    /// of refraction, then the one that absorbs more, then the one that scatters more. Media that are equal in all that
    /// are one medium.
    pub fn precedence(&self, other: &Self) -> Ordering {
        let lobe = |&WeightedLobe { weight, lobe }: &WeightedLobe| match lobe {
            PhaseLobe::HenyeyGreenstein { g } => [0.0, g, weight],
            PhaseLobe::Rayleigh => [1.0, 0.0, weight],
        };
        let key = |m: &Self| {
            let [absorption, scattering, emission] = [m.absorption, m.scattering, m.emission].map(Rgb::to_array);
            let volume = [m.volume.map_or(-1.0, |id| id.0 as f32), m.phase.lobes().len() as f32, 0.0];
            let lobes = m.phase.lobes().iter().map(lobe);
            [m.ior, absorption, scattering, emission, volume].into_iter().chain(lobes).flatten().collect::<Vec<_>>()
        };
        let ties = key(self).into_iter().zip(key(other)).map(|(a, b)| b.total_cmp(&a));
        other.priority.cmp(&self.priority).then(ties.fold(Ordering::Equal, Ordering::then))
    }

    /// Clear and of no refraction.
    pub fn clear(priority: i32) -> Self {
        Self {
            priority,
            ior: [1.0; 3],
            absorption: Rgb::BLACK,
            scattering: Rgb::BLACK,
            emission: Rgb::BLACK,
            phase: Phase::ISOTROPIC,
            volume: None,
        }
    }

    /// The coefficient of all that light loses.
    #[inline]
    pub fn extinction(&self) -> Rgb {
        self.absorption + self.scattering
    }

    /// Whether it does more than to absorb.
    #[inline]
    pub fn is_participating(&self) -> bool {
        !self.scattering.is_black() || !self.emission.is_black() || self.volume.is_some()
    }

    /// Radiance that the medium emits along `distance`, as it arrives at one end.
    pub fn emitted(&self, distance: f32) -> Rgb {
        let of = |emission: f32, extinction: f32| {
            let depth = extinction * distance;
            if emission <= 0.0 {
                0.0
            } else if depth > 0.0 {
                emission * (-(-depth).exp_m1() / extinction)
            } else if distance < f32::INFINITY {
                emission * distance
            } else {
                0.0
            }
        };
        let (emission, extinction) = (self.emission, self.extinction());
        Rgb::new(of(emission.r, extinction.r), of(emission.g, extinction.g), of(emission.b, extinction.b))
    }
}

/// Indices of refraction for red, green and blue of glass with the index `ior` at the helium d line (587.56 nm) and the
/// Abbe number `abbe`, by Cauchy's law `n = a + b / wavelength²`.
pub fn dispersed(ior: f32, abbe: f32) -> [f32; 3] {
    let inverse_square = |nanometres: f32| (1000.0 / nanometres).powi(2);
    // The F and C lines of hydrogen.
    let b = (ior - 1.0) / (abbe * (inverse_square(486.13) - inverse_square(656.27)));
    WAVELENGTHS.map(|wavelength| ior + b * (inverse_square(wavelength) - inverse_square(587.56)))
}

/// What is left of light, of its red, green and blue, after a distance (infinite for a ray that meets nothing).
#[inline]
pub fn transmittance(extinction: Rgb, distance: f32) -> Rgb {
    extinction.map(|a| if a > 0.0 { (-a * distance).exp() } else { 1.0 })
}

/// Random numbers of a ray: the same ones each time.
pub fn random_of_ray(ray: &Ray) -> Rng {
    let words = [ray.origin, ray.direction].map(|v| v.to_array().map(f32::to_bits));
    Rng::new(words.as_flattened().iter().fold(0, |hash, &word| hash64(hash ^ u64::from(word))))
}

/// Different media that may overlap at one point.
const MOST: usize = 8;

/// The media that contain a point, the one that is there first. Of more than eight, those that count least are
/// forgotten.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MediumStack {
    /// Ascending by id; those with a count of 0 are unused and come last.
    entries: [Entry; MOST],
}

/// How many surfaces of a medium contain the point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Entry {
    medium: MediumId,
    count: u32,
}

impl Default for Entry {
    fn default() -> Self {
        Self { medium: MediumId(u32::MAX), count: 0 }
    }
}

impl MediumStack {
    /// The medium of the surfaces around the point that is there; `None` outside of all.
    #[inline]
    pub fn medium(&self) -> Option<MediumId> {
        (self.entries[0].count > 0).then_some(self.entries[0].medium)
    }

    /// Inside of one more surface of a medium.
    #[must_use]
    pub fn pushed(mut self, medium: MediumId) -> Self {
        let at = self.entries.partition_point(|entry| entry.count > 0 && entry.medium < medium);
        match self.entries.get_mut(at) {
            None => {}
            Some(entry) if entry.medium == medium => entry.count = entry.count.saturating_add(1),
            Some(_) => {
                self.entries[at..].rotate_right(1);
                self.entries[at] = Entry { medium, count: 1 };
            }
        }
        self
    }

    /// Outside of one surface of a medium; unchanged where none contains the point.
    #[must_use]
    pub fn popped(mut self, medium: MediumId) -> Self {
        let Some(at) = self.entries.iter().position(|entry| entry.count > 0 && entry.medium == medium) else {
            return self;
        };
        self.entries[at].count -= 1;
        if self.entries[at].count == 0 {
            self.entries[at] = Entry::default();
            self.entries[at..].rotate_left(1);
        }
        self
    }
}

/// The media on both sides of a surface where it is crossed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryMedia {
    /// On the side of the normal.
    pub outside: MediumStack,
    /// On the other side, which is within the surface.
    pub inside: MediumStack,
}

impl BoundaryMedia {
    /// Of a surface of `medium` seen from a point within `here`, on the side of the normal if `is_front`. Where the
    /// stack of the point does not hold the medium that it is about to leave, the side of the surface decides.
    pub fn new(current: MediumStack, medium: MediumId, is_front: bool) -> Self {
        let outside = if is_front { current } else { current.popped(medium) };
        Self { outside, inside: outside.pushed(medium) }
    }

    /// The side beyond the surface for a ray that arrives from the side of the normal, if `is_front`.
    pub fn beyond(&self, is_front: bool) -> MediumStack {
        if is_front { self.inside } else { self.outside }
    }
}

/// Index of refraction of the inside over that of the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RelativeIor {
    /// For all channels.
    Same(f32),
    /// For red, green, blue.
    Dispersed([f32; 3]),
}

/// All media of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Media {
    /// By [`MediumId`], in the order of precedence.
    list: Vec<Medium>,
    /// By [`VolumeId`].
    volumes: Vec<Volume>,
    /// What is where no surface of a medium is around a point.
    around: Option<MediumId>,
}

impl Media {
    /// Those that are different, in their order, and what is `around` them.
    pub fn new(media: impl IntoIterator<Item = Medium>, around: Option<Medium>) -> Self {
        let mut list: Vec<Medium> = media.into_iter().chain(around).collect();
        list.sort_by(Medium::precedence);
        list.dedup();
        let mut media = Self { list, volumes: Vec::new(), around: None };
        media.around = around.and_then(|around| media.id(&around));
        media
    }

    /// With what differs within them, by [`VolumeId`].
    #[must_use]
    pub fn with_volumes(self, volumes: Vec<Volume>) -> Self {
        Self { volumes, ..self }
    }

    /// Bytes of the voxels of all volumes.
    pub fn voxel_bytes(&self) -> usize {
        self.volumes.iter().map(Volume::voxel_bytes).sum()
    }

    /// What differs within a medium, if anything does.
    #[inline]
    pub fn volume(&self, medium: &Medium) -> Option<&Volume> {
        medium.volume.map(|id| &self.volumes[id.index()])
    }

    /// What a medium scatters at a point of the light that it takes there.
    pub fn albedo(&self, id: MediumId, p: DVec3) -> Rgb {
        let medium = self.get(id);
        let of = |scattering: f32, absorption: f32| {
            if scattering > 0.0 { scattering / (scattering + absorption) } else { 0.0 }
        };
        let (scattering, absorption) = match self.volume(medium) {
            None => (medium.scattering, medium.absorption),
            Some(volume) => {
                let at = volume.coefficients(medium, p);
                (at.scattering, at.absorption)
            }
        };
        Rgb::new(of(scattering.r, absorption.r), of(scattering.g, absorption.g), of(scattering.b, absorption.b))
    }

    /// Whether something is where no surface of a medium is around a point.
    pub fn has_surroundings(&self) -> bool {
        self.around.is_some()
    }

    /// What is around everything, if anything is.
    pub fn surroundings(&self) -> Option<&Medium> {
        self.around.map(|id| &self.list[id.index()])
    }

    /// All, by [`MediumId`].
    pub fn iter(&self) -> impl Iterator<Item = &Medium> {
        self.list.iter()
    }

    /// The medium with this id.
    #[inline]
    pub fn get(&self, id: MediumId) -> &Medium {
        &self.list[id.index()]
    }

    /// What is at a point within `current`; `None` in empty space.
    #[inline]
    pub fn at(&self, current: &MediumStack) -> Option<MediumId> {
        current.medium().or(self.around)
    }

    /// Moves media of the world to a render space.
    pub fn place(&mut self, space: &RenderSpace) {
        let factor = 1.0 / space.scale();
        self.volumes.iter_mut().for_each(|volume| volume.place(space));
        for medium in &mut self.list {
            let coefficients = [&mut medium.absorption, &mut medium.scattering, &mut medium.emission];
            coefficients.into_iter().for_each(|c| *c = c.map(|c| (f64::from(c) * factor) as f32));
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The id of a medium among those it was made of.
    pub fn id(&self, medium: &Medium) -> Option<MediumId> {
        self.list.iter().position(|m| m == medium).map(MediumId::new)
    }

    /// What is left of light along a ray within `current`: of what differs from place to place an unbiased estimate,
    /// by chance.
    pub fn transmittance(&self, current: &MediumStack, ray: &Ray, random: impl FnOnce() -> Rng) -> Rgb {
        let Some(id) = self.at(current) else { return Rgb::WHITE };
        let medium = self.get(id);
        match self.volume(medium) {
            None => transmittance(medium.extinction(), (ray.t_max - ray.t_min) * ray.direction.length()),
            Some(volume) => volume.transmittance(medium, ray, &mut random()),
        }
    }

    /// The relative index of refraction between the two sides of a surface, for one channel if it is chosen.
    pub fn relative_ior(&self, sides: &BoundaryMedia, channel: Option<usize>) -> RelativeIor {
        let ior = |current: &MediumStack| self.at(current).map_or([1.0; 3], |id| self.get(id).ior);
        let (inside, outside) = (ior(&sides.inside), ior(&sides.outside));
        let relative = [0, 1, 2].map(|i| inside[i] / outside[i]);
        match channel {
            Some(channel) => RelativeIor::Same(relative[channel]),
            None if relative == [relative[GREEN]; 3] => RelativeIor::Same(relative[GREEN]),
            None => RelativeIor::Dispersed(relative),
        }
    }
}

impl RelativeIor {
    /// Whether light passes as if there were no surface.
    pub fn is_one(&self) -> bool {
        *self == Self::Same(1.0)
    }

    /// For a channel where it matters, else for green.
    pub fn of(&self, channel: Option<usize>) -> f32 {
        match *self {
            Self::Same(ior) => ior,
            Self::Dispersed(iors) => iors[channel.unwrap_or(GREEN)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(priority: i32, ior: f32) -> Medium {
        Medium { ior: [ior; 3], ..Medium::clear(priority) }
    }

    #[test]
    fn media_come_in_the_order_of_priority_and_then_of_density() {
        let dark = Medium { absorption: Rgb::new(0.0, 1.0, 0.0), ..medium(1, 1.5) };
        let media =
            Media::new([medium(1, 1.3), medium(-5, 2.0), medium(1, 1.5), dark, medium(2, 1.1), medium(1, 1.3)], None);
        let expected = [medium(2, 1.1), dark, medium(1, 1.5), medium(1, 1.3), medium(-5, 2.0)];
        assert_eq!(media.list, expected);
        for (i, m) in expected.iter().enumerate() {
            assert_eq!(media.id(m), Some(MediumId::new(i)));
        }
    }

    #[test]
    fn what_is_there_does_not_depend_on_the_way() {
        // Every order of entering three media, one of them twice, and every order of leaving them.
        let all = [0, 1, 1, 2].map(MediumId);
        let orders =
            || (0..256).map(|i| [i & 3, i >> 2 & 3, i >> 4 & 3, i >> 6 & 3]).filter(|o| (0..4).all(|k| o.contains(&k)));
        let full = all.into_iter().fold(MediumStack::default(), MediumStack::pushed);
        assert_eq!(full.medium(), Some(MediumId(0)));
        for order in orders() {
            assert_eq!(order.iter().fold(MediumStack::default(), |current, &k| current.pushed(all[k])), full);
            let mut rest: Vec<MediumId> = all.to_vec();
            let mut current = full;
            for k in order {
                current = current.popped(all[k]);
                rest.remove(rest.iter().position(|m| *m == all[k]).unwrap());
                assert_eq!(current.medium(), rest.iter().min().copied());
            }
            assert_eq!(current, MediumStack::default());
        }
    }

    #[test]
    fn leaving_what_does_not_contain_the_point_changes_nothing() {
        let current = MediumStack::default().pushed(MediumId(3));
        assert_eq!(current.popped(MediumId(2)), current);
        assert_eq!(MediumStack::default().popped(MediumId(0)), MediumStack::default());
        // But the surface is still one between the medium and what lies outside.
        let sides = BoundaryMedia::new(MediumStack::default(), MediumId(2), false);
        assert_eq!((sides.inside.medium(), sides.outside.medium()), (Some(MediumId(2)), None));
    }

    #[test]
    fn of_too_many_media_the_least_are_forgotten() {
        let mut current = (0..12).rev().map(MediumId).fold(MediumStack::default(), MediumStack::pushed);
        for i in 0..MOST as u32 {
            assert_eq!(current.medium(), Some(MediumId(i)));
            current = current.popped(MediumId(i));
        }
        assert_eq!(current, MediumStack::default());
    }

    #[test]
    fn dispersion_gives_the_abbe_number_back() {
        // Flint glass SF10; its index at 587.56 nm lies between those of red and green light.
        let [red, green, blue] = dispersed(1.728_28, 28.53);
        assert!(red < 1.728_28 && 1.728_28 < green && green < blue, "{red} {green} {blue}");
        // Measured (Schott): 1.7209 at 650 nm, 1.7342 at 550 nm, 1.7624 at 450 nm; Cauchy's law with two terms is not
        // exact.
        assert!(
            (red - 1.7209).abs() < 3e-3 && (green - 1.7342).abs() < 3e-3 && (blue - 1.7624).abs() < 8e-3,
            "{red} {green} {blue}"
        );
    }
}
