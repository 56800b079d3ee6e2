//! Participating media.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
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
}

impl PhaseDesc {
    fn is_isotropic(&self) -> bool {
        *self == Self::Isotropic
    }
}
