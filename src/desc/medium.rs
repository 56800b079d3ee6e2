//! Participating media.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TransformDesc;
use super::lists::{Spread, spread};

/// What fills closed surfaces, or everything: smoke, fog, milk. Light that goes through it is absorbed, scattered and
/// emitted.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MediumDesc {
    /// Coefficient of absorption, per world unit: after a distance `d`, `exp(-absorption d)` is left of light. Default:
    /// 0.
    #[serde(default, skip_serializing_if = "CoefficientDesc::is_zero")]
    pub absorption: CoefficientDesc,
    /// Coefficient of scattering, per world unit. Absorption and scattering together are the extinction, scattering
    /// over extinction is the albedo of a single scattering. Default: 0.
    #[serde(default, skip_serializing_if = "CoefficientDesc::is_zero")]
    pub scattering: CoefficientDesc,
    /// Radiance emitted per world unit. Default: 0.
    #[serde(default, skip_serializing_if = "CoefficientDesc::is_zero")]
    pub emission: CoefficientDesc,
    /// The directions into which light is scattered. Default: all alike.
    #[serde(default, skip_serializing_if = "PhaseDesc::is_isotropic")]
    pub phase: PhaseDesc,
    /// What differs from place to place: smoke, clouds, fire. Default: nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<Box<MediumVolumeDesc>>,
}

/// How a medium differs from place to place within a box; outside of the box it is empty. Surfaces with the medium may
/// be larger or smaller than the box.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MediumVolumeDesc {
    /// Two opposite corners of the box, `[[x, y, z], [x, y, z]]`. Default: of grids of `.vdb` and `.nvdb` files, the
    /// smallest box around them where these files place them; else the unit cube, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Where the box is placed. Default: where its bounds are.
    #[serde(default, skip_serializing_if = "TransformDesc::is_empty")]
    pub transform: TransformDesc,
    /// Factor on absorption, scattering and emission, one number a voxel, at least 0. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<VolumeDesc>,
    /// Albedo of a single scattering, from 0 to 1: how the extinction (absorption and scattering of the medium
    /// together) is divided. Not together with the next two. Default: that of the medium.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub albedo: Option<VolumeDesc>,
    /// Factor on absorption, beside that of `density`; at least 0. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorption: Option<VolumeDesc>,
    /// Factor on scattering, beside that of `density`; at least 0. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scattering: Option<VolumeDesc>,
    /// Factor on emission, beside that of `density`; at least 0. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub emission: Option<VolumeDesc>,
    /// Kelvin, one number a voxel, from 0 to 1e5 with `temperature_scale`: a further factor on emission is what black
    /// bodies of this temperature radiate, as in Blender: their colour at luminance 1 times Stefan and Boltzmann's
    /// power in MW/(m² sr). Default: no such factor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<VolumeDesc>,
    /// Factor on `temperature`, above 0. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_scale: Option<f32>,
}

impl MediumVolumeDesc {
    /// The volumes that are there, each with its key.
    pub fn parts_mut(&mut self) -> impl Iterator<Item = (&'static str, &mut VolumeDesc)> {
        let Self { density, albedo, absorption, scattering, emission, temperature, .. } = self;
        [
            ("density", density),
            ("albedo", albedo),
            ("absorption", absorption),
            ("scattering", scattering),
            ("emission", emission),
            ("temperature", temperature),
        ]
        .into_iter()
        .filter_map(|(key, part)| part.as_mut().map(|part| (key, part)))
    }
}

/// Numbers or colours of the voxels of a box. Between the middles of voxels they are interpolated linearly along each
/// axis.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum VolumeDesc {
    /// A grid of voxels.
    Grid {
        /// A file, relative to the scene file: of OpenVDB if its name ends with `.vdb`, of NanoVDB with `.nvdb`, one of
        /// Mitsuba's volumes with `.vol` (the box in its header does not count), else nothing but little-endian 32-bit
        /// floats, by z, then y, then x, then channel: the x of the voxel changes fastest. Either `file` or `values`
        /// must be given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// The name of a grid of a `.vdb` or `.nvdb` file. Default: that of the key, such as
        /// `density`, if the file has such a grid; else its only one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        grid: Option<String>,
        /// The values themselves, in the same order.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        values: Option<Vec<f32>>,
        /// Voxels along x, y and z, each from 1 to 16384. Required but for files that have their own.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        resolution: Option<[u32; 3]>,
        /// 1 number a voxel, or 3: red, green and blue. Default: 1, or what the file has.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        channels: Option<u32>,
        /// What is between the middles of the outermost voxels and the faces of the box. Grids of `.vdb` and `.nvdb`
        /// files have their background there. Default: `clamp`.
        #[serde(default, skip_serializing_if = "BorderDesc::is_clamp")]
        border: BorderDesc,
    },
    /// Fractional Brownian motion, one number a voxel: `base + amplitude n - fade r²`, cut off below 0 and above 1,
    /// where `n` is noise from about -1 to 1 and `r` the distance from the middle of the box, 1 on the ellipsoid that
    /// touches its faces.
    Noise {
        /// Voxels along x, y and z, at most 2^27 together. Default: 64, 64, 64.
        #[serde(default = "noise_resolution")]
        resolution: [u32; 3],
        /// Lumps of the coarsest noise along x, y and z, above 0. Default: 4, 4, 4.
        #[serde(default = "noise_frequency")]
        frequency: [f32; 3],
        /// Noises, each of twice the frequency and half the amplitude of the one before, from 1 to 16. Default: 5.
        #[serde(default = "noise_octaves")]
        octaves: u32,
        /// Which of all noises. Default: 0.
        #[serde(default)]
        seed: u32,
        /// See above. Default: 0.5.
        #[serde(default = "half")]
        base: f32,
        /// See above. Default: 1.
        #[serde(default = "one")]
        amplitude: f32,
        /// See above. Default: 0.
        #[serde(default)]
        fade: f32,
    },
}

impl VolumeDesc {
    /// The grid of a file that has its own resolution.
    pub fn of_file(file: String, border: BorderDesc) -> Self {
        Self::Grid { file: Some(file), grid: None, values: None, resolution: None, channels: None, border }
    }

    /// A grid of a file of OpenVDB or NanoVDB.
    pub fn of_vdb(file: String, grid: &str) -> Self {
        Self::Grid {
            file: Some(file),
            grid: Some(grid.to_owned()),
            values: None,
            resolution: None,
            channels: None,
            border: BorderDesc::Clamp,
        }
    }

    /// The same value everywhere.
    pub fn constant(value: f32) -> Self {
        Self::Grid {
            file: None,
            grid: None,
            values: Some(vec![value]),
            resolution: Some([1; 3]),
            channels: None,
            border: BorderDesc::Clamp,
        }
    }
}

fn noise_resolution() -> [u32; 3] {
    [64; 3]
}

fn noise_frequency() -> [f32; 3] {
    [4.0; 3]
}

fn noise_octaves() -> u32 {
    5
}

fn half() -> f32 {
    0.5
}

fn one() -> f32 {
    1.0
}

/// What is between the middles of the outermost voxels and the faces of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BorderDesc {
    /// The values of those voxels.
    #[default]
    Clamp,
    /// Values that fall towards 0, as if there were empty voxels outside of the box.
    Zero,
}

impl BorderDesc {
    #[allow(clippy::trivially_copy_pass_by_ref)]
    fn is_clamp(&self) -> bool {
        *self == Self::Clamp
    }
}

/// Absorption by Beer and Lambert's law: what is left of white light is `color` to the power of the way over
/// `distance`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AbsorptionDesc {
    /// What is left of red, green and blue after `distance`, each above 0 and at most 1.
    #[serde(deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub color: [f32; 3],
    /// In world units, above 0. Default: 1.
    #[serde(default = "unit_distance")]
    pub distance: f32,
}

fn unit_distance() -> f32 {
    1.0
}

/// A coefficient of a medium, at least 0: one number, or one for each of red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CoefficientDesc {
    /// For all channels.
    Grey(f32),
    /// For red, green and blue.
    Rgb([f32; 3]),
}

impl Default for CoefficientDesc {
    fn default() -> Self {
        Self::Grey(0.0)
    }
}

impl CoefficientDesc {
    fn is_zero(&self) -> bool {
        self.to_array() == [0.0; 3]
    }

    /// For red, green and blue.
    pub fn to_array(self) -> [f32; 3] {
        match self {
            Self::Grey(value) => [value; 3],
            Self::Rgb(values) => values,
        }
    }
}

/// A phase function: the directions into which a medium scatters light.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum PhaseDesc {
    /// All directions alike.
    #[default]
    Isotropic,
    /// Henyey and Greenstein's function.
    HenyeyGreenstein {
        /// Mean cosine of the angle by which light is deflected, from -0.99 (back) to 0.99 (on).
        g: f32,
    },
    /// Rayleigh's function, of particles much smaller than the wavelength: air.
    Rayleigh,
    /// The mean of several.
    Mix {
        /// What is mixed: together at most 4 that are no mixes.
        phases: Vec<PhaseDesc>,
        /// The weight of each, at least 0; only their ratios matter.
        weights: Vec<f32>,
    },
}

impl PhaseDesc {
    fn is_isotropic(&self) -> bool {
        *self == Self::Isotropic
    }
}
