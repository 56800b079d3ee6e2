//! Media that differ from place to place: coefficients from grids, and tracking through them.
//!
//! Collisions are tentative ones of a density that is nowhere below the extinction, block by block, of which some are
//! null (Woodcock et al.; Miller, Georgiev and Jarosz, "A Null-Scattering Path Integral Formulation of Light
//! Transport"). That density is one for all channels. Whether a collision scatters is chosen by the mean over the
//! channels of what a path carries: the balance heuristic over channels that were chosen at the start, without choosing
//! one.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::blocks::{BlockWalk, UnitRay};
use super::voxels::{Interval, VoxelGrid, block_box};
use super::{Medium, blackbody, transmittance};
use crate::color::Rgb;
use crate::math::random::Rng;
use crate::math::{DAffine3, DVec3, Ray, RenderSpace, Vec3};

/// Voxels along an edge of a block: smaller ones cost more steps, larger ones more collisions.
const BLOCK: usize = 4;

/// The most blocks along an axis.
const MAX_BLOCKS: usize = 128;

/// Below this share of light a shadow ray goes on by chance alone.
const LEAST_LEFT: f32 = 0.05;

/// What grids make of a medium's coefficients.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeGrids {
    /// Factor on absorption, scattering and emission.
    pub density: Option<VoxelGrid<f32>>,
    /// How extinction is divided into absorption and scattering.
    pub split: ExtinctionSplit,
    /// Factor on emission.
    pub emission: Option<VoxelGrid<Rgb>>,
    /// Kelvin; what black bodies emit there is a further factor on emission.
    pub temperature: Option<VoxelGrid<f32>>,
}

/// How extinction is divided into absorption and scattering.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ExtinctionSplit {
    /// Everywhere alike.
    #[default]
    Even,
    /// By the albedo of a single scattering, at most 1.
    Albedo(VoxelGrid<Rgb>),
    /// Factors on both, or 1.
    Factors {
        /// On absorption.
        absorption: Option<VoxelGrid<Rgb>>,
        /// On scattering.
        scattering: Option<VoxelGrid<Rgb>>,
    },
}

/// A medium's coefficients at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Of absorption,
    pub absorption: Rgb,
    /// and of scattering.
    pub scattering: Rgb,
    /// Radiance emitted per unit of length.
    pub emission: Rgb,
}

/// What differs within a medium; beyond its box, which is the unit cube by a map, the medium is empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    grids: VolumeGrids,
    unit_from_render: DAffine3,
    /// Blocks along x, y and z.
    blocks: [usize; 3],
    /// Extinction within each block, by z, then y, then x.
    extinction: Vec<Interval<Rgb>>,
    /// The density of collisions in each block: the largest channel of the extinction, or more where it emits.
    majorants: Vec<f32>,
}

/// Until the next collision.
#[derive(Clone, Debug)]
pub struct FreeFlight {
    /// Optical depth to it, exponentially distributed.
    pub depth: f32,
    /// What else is left to chance.
    pub random: Rng,
}

impl FreeFlight {
    /// With an optical depth by `u` in `[0, 1)`.
    pub fn new(u: f32, random: Rng) -> Self {
        Self { depth: exponential(u), random }
    }

    fn next(&mut self) {
        self.depth = exponential(self.random.unit_f32());
    }
}

/// Of mean 1.
#[inline]
fn exponential(u: f32) -> f32 {
    -(-u).ln_1p()
}

/// A path's way through a volume.
#[derive(Clone, Copy, Debug)]
pub struct Tracked {
    /// Where on the ray it is scattered, if it is.
    pub t: Option<f32>,
    /// Factor on what the path carries.
    pub weight: Rgb,
    /// Radiance emitted towards its start.
    pub emitted: Rgb,
}

impl Volume {
    /// What fills the box that `world_from_unit` makes of the unit cube with `medium`.
    pub fn new(medium: &Medium, grids: VolumeGrids, world_from_unit: &DAffine3) -> Self {
        let blocks = grids.resolution().map(|n| n.div_ceil(BLOCK).clamp(1, MAX_BLOCKS));
        let diagonal = {
            let size = DVec3::from_array(blocks.map(|n| 1.0 / n as f64));
            world_from_unit.transform_vector3(size).length() as f32
        };
        let bounds = |block: usize| grids.bounds(medium, block_box(block, blocks));
        let bounds: Vec<_> = (0..blocks.iter().product()).into_par_iter().map(bounds).collect();
        let majorant = |bounds: &CoefficientBounds| {
            let extinction = bounds.extinction.max.max_channel();
            // About one collision in a block that emits finds that.
            if bounds.emits { extinction.max(1.0 / diagonal) } else { extinction }
        };
        Self {
            unit_from_render: world_from_unit.inverse(),
            blocks,
            majorants: bounds.iter().map(majorant).collect(),
            extinction: bounds.iter().map(|bounds| bounds.extinction).collect(),
            grids,
        }
    }

    /// Bytes of the voxels.
    pub fn voxel_bytes(&self) -> usize {
        let VolumeGrids { density, split, emission, temperature } = &self.grids;
        let numbers = density.iter().chain(temperature).map(VoxelGrid::bytes);
        let split = match split {
            ExtinctionSplit::Even => [None, None],
            ExtinctionSplit::Albedo(albedo) => [Some(albedo), None],
            ExtinctionSplit::Factors { absorption, scattering } => [absorption.as_ref(), scattering.as_ref()],
        };
        let colors = split.into_iter().flatten().chain(emission).map(VoxelGrid::bytes);
        numbers.chain(colors).sum()
    }

    /// Moves a volume of the world to a render space.
    pub fn place(&mut self, space: &RenderSpace) {
        let factor = (1.0 / space.scale()) as f32;
        self.unit_from_render *= space.to_world();
        self.majorants.iter_mut().for_each(|majorant| *majorant *= factor);
        for Interval { min, max } in &mut self.extinction {
            (*min, *max) = (*min * factor, *max * factor);
        }
    }

    /// The coefficients of `medium` at a point.
    pub fn coefficients(&self, medium: &Medium, p: DVec3) -> Coefficients {
        let p = self.unit_from_render.transform_point3(p);
        self.grids.at(medium, p.as_vec3())
    }

    /// Follows a path that carries these channels along a ray to its end or to where `medium` scatters it.
    pub fn track(&self, medium: &Medium, ray: &Ray, carried: Rgb, flight: &mut FreeFlight) -> Tracked {
        let mut tracked = Tracked { t: None, weight: Rgb::WHITE, emitted: Rgb::BLACK };
        let Some(ray) = UnitRay::new(ray, &self.unit_from_render) else { return tracked };
        for segment in BlockWalk::new(&ray, self.blocks) {
            let majorant = self.majorants[segment.block];
            let [mut t, end] = segment.t;
            let depth_per_t = majorant * ray.length;
            // Where the density is zero, at infinity.
            let next = |t: f32, depth: f32| t + depth / depth_per_t;
            while next(t, flight.depth) < end {
                t = next(t, flight.depth);
                flight.next();
                let at = self.grids.at(medium, ray.at(t));
                if self.grids.emission.is_some() || !medium.emission.is_black() {
                    tracked.emitted += tracked.weight * at.emission * majorant.recip();
                }
                let collision = Collision::new(&at, majorant, carried * tracked.weight);
                if flight.random.unit_f32() < collision.scatter_probability {
                    tracked.weight *= at.scattering * (majorant * collision.scatter_probability).recip();
                    tracked.t = Some(ray.start + t);
                    return tracked;
                }
                tracked.weight *= collision.null * (majorant * (1.0 - collision.scatter_probability)).recip();
                if tracked.weight.is_black() {
                    return tracked;
                }
            }
            flight.depth = (flight.depth - (end - t) * depth_per_t).max(0.0);
        }
        tracked
    }

    /// An unbiased estimate of what is left of light along a ray: what the least extinction of a block leaves, times
    /// what ratio tracking through the rest does (Novák et al., "Residual Ratio Tracking for Estimating Attenuation in
    /// Participating Media").
    pub fn transmittance(&self, medium: &Medium, ray: &Ray, random: &mut Rng) -> Rgb {
        let mut left = Rgb::WHITE;
        let Some(ray) = UnitRay::new(ray, &self.unit_from_render) else { return left };
        let mut depth = exponential(random.unit_f32());
        for segment in BlockWalk::new(&ray, self.blocks) {
            let Interval { min, max } = self.extinction[segment.block];
            let [mut t, end] = segment.t;
            left *= transmittance(min, (end - t) * ray.length);
            let residual = (max - min).max_channel();
            let depth_per_t = residual * ray.length;
            let next = |t: f32, depth: f32| t + depth / depth_per_t;
            while next(t, depth) < end {
                t = next(t, depth);
                depth = exponential(random.unit_f32());
                let at = self.grids.at(medium, ray.at(t));
                let rest = (at.absorption + at.scattering - min) * residual.recip();
                left *= rest.map(|rest| (1.0 - rest).clamp(0.0, 1.0));
            }
            depth = (depth - (end - t) * depth_per_t).max(0.0);
            let most = left.max_channel();
            if most < LEAST_LEFT {
                if random.unit_f32() * LEAST_LEFT >= most {
                    return Rgb::BLACK;
                }
                left *= LEAST_LEFT / most;
            }
        }
        left
    }
}

/// What can come of a tentative collision.
struct Collision {
    /// The density of null collisions by channel.
    null: Rgb,
    scatter_probability: f32,
}

impl Collision {
    /// For a path that carries these channels.
    #[inline]
    fn new(at: &Coefficients, majorant: f32, carried: Rgb) -> Self {
        let null = (at.absorption + at.scattering).map(|extinction| (majorant - extinction).max(0.0));
        let sum = |density: Rgb| {
            let Rgb { r, g, b } = carried.map(|c| c.max(0.0)) * density;
            r + g + b
        };
        let (scatters, passes) = (sum(at.scattering), sum(null));
        let scatter_probability = if scatters > 0.0 { scatters / (scatters + passes) } else { 0.0 };
        Self { null, scatter_probability }
    }
}

/// What the coefficients in a block cannot exceed.
struct CoefficientBounds {
    extinction: Interval<Rgb>,
    emits: bool,
}

impl VolumeGrids {
    /// The finest along each axis.
    fn resolution(&self) -> [usize; 3] {
        let colors = match &self.split {
            ExtinctionSplit::Even => [None, None],
            ExtinctionSplit::Albedo(albedo) => [Some(albedo), None],
            ExtinctionSplit::Factors { absorption, scattering } => [absorption.as_ref(), scattering.as_ref()],
        };
        let colors = colors.into_iter().chain([self.emission.as_ref()]).flatten().map(VoxelGrid::resolution);
        let all = colors.chain([&self.density, &self.temperature].into_iter().flatten().map(VoxelGrid::resolution));
        all.fold([1; 3], |most, n| [0, 1, 2].map(|axis| most[axis].max(n[axis])))
    }

    /// The coefficients of `medium` at a point of the unit cube.
    #[inline]
    fn at(&self, medium: &Medium, p: Vec3) -> Coefficients {
        let density = self.density.as_ref().map_or(1.0, |grid| grid.at(p));
        let factor = |grid: &Option<VoxelGrid<Rgb>>| grid.as_ref().map_or(Rgb::WHITE, |grid| grid.at(p));
        let (absorption, scattering) = match &self.split {
            ExtinctionSplit::Even => (medium.absorption, medium.scattering),
            ExtinctionSplit::Albedo(albedo) => {
                let (extinction, albedo) = (medium.extinction(), albedo.at(p));
                (extinction * (Rgb::WHITE - albedo), extinction * albedo)
            }
            ExtinctionSplit::Factors { absorption, scattering } => {
                (medium.absorption * factor(absorption), medium.scattering * factor(scattering))
            }
        };
        let glow = self.temperature.as_ref().map_or(Rgb::WHITE, |kelvin| blackbody(kelvin.at(p)));
        let emission = medium.emission * factor(&self.emission) * glow;
        Coefficients {
            absorption: absorption * density,
            scattering: scattering * density,
            emission: emission * density,
        }
    }

    fn bounds(&self, medium: &Medium, [min, max]: [Vec3; 2]) -> CoefficientBounds {
        let one = Interval { min: Rgb::WHITE, max: Rgb::WHITE };
        let of = |grid: &Option<VoxelGrid<Rgb>>| grid.as_ref().map_or(one, |grid| grid.bounds(min, max));
        let number = |grid: &Option<VoxelGrid<f32>>| {
            grid.as_ref().map_or(Interval { min: 1.0, max: 1.0 }, |grid| grid.bounds(min, max))
        };
        let density = number(&self.density);
        let extinction = match &self.split {
            ExtinctionSplit::Even | ExtinctionSplit::Albedo(_) => {
                Interval { min: medium.extinction(), max: medium.extinction() }
            }
            ExtinctionSplit::Factors { absorption, scattering } => {
                let (a, s) = (of(absorption), of(scattering));
                let sum = |a: Rgb, s: Rgb| medium.absorption * a + medium.scattering * s;
                Interval { min: sum(a.min, s.min), max: sum(a.max, s.max) }
            }
        };
        CoefficientBounds {
            extinction: Interval { min: extinction.min * density.min, max: extinction.max * density.max },
            emits: number(&self.temperature).max > 0.0
                && !(medium.emission * of(&self.emission).max * density.max).is_black(),
        }
    }
}
