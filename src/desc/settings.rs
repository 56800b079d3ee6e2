//! Film, sampler and integrator as written.

use std::fmt;

use schemars::JsonSchema;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::lists::{Spread, spread};

use super::ViewDesc;
use super::material::{is_yes, yes};

/// The picture's size and its pixel filter.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilmDesc {
    /// Width in pixels. Default: 640.
    pub width: u32,
    /// Height in pixels. Default: 360.
    pub height: u32,
    /// Render only `[x, y, width, height]`, in pixels from the upper left corner.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop: Option<[u32; 4]>,
    /// Render this many pixels more on each side, for whoever moves or distorts the picture later; at most the shorter
    /// side. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub overscan: u32,
    /// The pixel filter.
    pub filter: FilterDesc,
    /// Do not show light from infinity to the camera: the picture is black with an alpha of 0 there. Otherwise its
    /// alpha is 1 wherever the camera sees a surface or a background. Default: false.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub transparent: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero(x: &u32) -> bool {
    *x == 0
}

impl Default for FilmDesc {
    fn default() -> Self {
        Self { width: 640, height: 360, crop: None, overscan: 0, filter: FilterDesc::default(), transparent: false }
    }
}

/// A pixel filter; radii are in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FilterDesc {
    /// The same weight within the radius.
    Box {
        /// Half the width. Default: 0.5.
        #[serde(default = "box_radius")]
        radius: f32,
        /// `shared` (the default, save for pictures to be denoised) or `importance`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        samples: Option<FilterSamplesDesc>,
    },
    /// Weight falls linearly to zero.
    Tent {
        /// Default: 1.
        #[serde(default = "tent_radius")]
        radius: f32,
        /// `shared` (the default, save for pictures to be denoised) or `importance`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        samples: Option<FilterSamplesDesc>,
    },
    /// A truncated Gaussian that reaches zero at the radius.
    Gaussian {
        /// Default: 1.5.
        #[serde(default = "gaussian_radius")]
        radius: f32,
        /// Standard deviation. Default: 0.5.
        #[serde(default = "gaussian_sigma")]
        sigma: f32,
        /// `shared` (the default, save for pictures to be denoised) or `importance`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        samples: Option<FilterSamplesDesc>,
    },
    /// The Blackman-Harris window.
    BlackmanHarris {
        /// Default: 1.5.
        #[serde(default = "gaussian_radius")]
        radius: f32,
        /// `shared` (the default, save for pictures to be denoised) or `importance`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        samples: Option<FilterSamplesDesc>,
    },
    /// Mitchell and Netravali's cubic; it has negative lobes.
    Mitchell {
        /// Default: 2.
        #[serde(default = "mitchell_radius")]
        radius: f32,
        /// Default: 1/3.
        #[serde(default = "third")]
        b: f32,
        /// Default: 1/3.
        #[serde(default = "third")]
        c: f32,
        /// `shared` (the default, save for pictures to be denoised) or `importance`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        samples: Option<FilterSamplesDesc>,
    },
}

/// The largest width and height of a picture: beyond it, `f32` film coordinates would be coarser than 1/256 of a pixel.
pub const MAX_SIDE: u32 = 65_536;

/// The largest radius of a pixel filter.
pub const MAX_FILTER_RADIUS: f32 = 64.0;

/// How a pixel filter is applied to samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterSamplesDesc {
    /// Each sample counts for all pixels whose filter reaches it: the weighted mean of the samples around a pixel.
    /// Filters with a radius of at most half a pixel or above 4 pixels are importance sampled instead.
    Shared,
    /// The filter is importance sampled: each sample counts for one pixel. Noise is higher, but independent between
    /// pixels.
    Importance,
}

impl FilterDesc {
    /// Half the width of the support in pixels.
    pub fn radius(&self) -> f32 {
        match *self {
            Self::Box { radius, .. }
            | Self::Tent { radius, .. }
            | Self::Gaussian { radius, .. }
            | Self::BlackmanHarris { radius, .. }
            | Self::Mitchell { radius, .. } => radius,
        }
    }

    /// How the filter is applied, if that is set.
    pub fn samples_mut(&mut self) -> &mut Option<FilterSamplesDesc> {
        match self {
            Self::Box { samples, .. }
            | Self::Tent { samples, .. }
            | Self::Gaussian { samples, .. }
            | Self::BlackmanHarris { samples, .. }
            | Self::Mitchell { samples, .. } => samples,
        }
    }
}

impl Default for FilterDesc {
    fn default() -> Self {
        Self::BlackmanHarris { radius: gaussian_radius(), samples: None }
    }
}

fn box_radius() -> f32 {
    0.5
}

fn tent_radius() -> f32 {
    1.0
}

fn gaussian_radius() -> f32 {
    1.5
}

fn gaussian_sigma() -> f32 {
    0.5
}

fn mitchell_radius() -> f32 {
    2.0
}

fn third() -> f32 {
    1.0 / 3.0
}

/// Samples per pixel and how they are chosen.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SamplerDesc {
    /// How samples are chosen.
    #[serde(rename = "type")]
    pub kind: SamplerKindDesc,
    /// Samples per pixel. Default: 64.
    pub spp: u32,
    /// A different seed gives different noise.
    pub seed: u64,
}

impl Default for SamplerDesc {
    fn default() -> Self {
        Self { kind: SamplerKindDesc::Sobol, spp: 64, seed: 0 }
    }
}

/// How samples are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SamplerKindDesc {
    /// Owen-scrambled Sobol points, decorrelated between pixels.
    #[default]
    Sobol,
    /// Independent random numbers.
    Independent,
}

/// The algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum IntegratorDesc {
    /// Path tracing: all light that arrives over any number of bounces.
    Path {
        /// Largest number of segments from the camera; 1 shows only directly visible light. Default: 64.
        #[serde(default = "default_max_depth")]
        max_depth: u32,
        /// Segments before Russian roulette by throughput may end a path. Default: 5.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rr_depth: Option<u32>,
        /// Which paths and shadow rays Russian roulette terminates. Default: auto; where `rr_depth` is given
        /// throughput, or shadow_rays if it is at least `max_depth` - 1 and `max_depth` is above 6.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roulette: Option<RouletteDesc>,
        /// How many lights are sampled at the first surface or point in a medium that a path meets, from 1 to 64.
        /// Default: with roulette auto or shadow_rays, 1 to 4, as its pilot finds the least error for the time; else 1.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        light_samples: Option<u32>,
        /// Whether paths are split at smooth glass whose reflection may show an emitter, into one path that is
        /// reflected and one that is not: less noise, at some cost in time. Default: true.
        #[serde(default = "yes", skip_serializing_if = "is_yes")]
        splitting: bool,
        /// How directions towards lights are found.
        #[serde(default)]
        strategy: StrategyDesc,
        /// Takes the noise of rare bright paths, and some light with it: biased. No single path that was scattered more
        /// than once adds to a channel more than this, above 0. Default: no limit, no bias.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        clamp: Option<f32>,
        /// Takes the noise of caustics that paths find by rare chance, and some of their sharpness with it: the least
        /// alpha of microfacets, within `(0, 1]`, at surfaces that a path meets after one that is not ideally smooth,
        /// for a pixel's first sample. It falls with the sixth root of the sample's number, so that the bias vanishes
        /// as samples are added. Default: none, no bias.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        regularize: Option<f32>,
        /// Whether what emits light is hidden from the camera: its rays pass through emitting shapes, both sides of
        /// them, and show no light from infinity, where alpha is 0. Light, mirror images and what is seen through glass
        /// stay. Default: false.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        hide_emitters: bool,
        /// Whether paths learn from earlier ones where light comes from: less noise where most of it comes by few ways,
        /// such as through a door ajar, for some time of learning. on: from the second sample of each pixel on, as long
        /// as it pays. auto: from the ninth sample on, as long as it lowers the error by more than it costs, which a
        /// pilot and samples with and without it show; never with fewer than 128 samples of each, with a target error
        /// or photons, or in shards. Default: auto.
        #[serde(default, skip_serializing_if = "AutoDesc::is_default")]
        guiding: AutoDesc,
        /// How caustics are found: light that mirrors, metal and glass throw on other surfaces. auto is paths with
        /// fewer than 16 samples of each pixel, and with options that photons do not support. Default: auto.
        #[serde(default, skip_serializing_if = "CausticsDesc::is_default")]
        caustics: CausticsDesc,
        /// Whether paths are also connected to paths from the lights: less noise where lamps shine at walls, ceilings
        /// and lampshades rather than at what is seen, for one and a half to twice the time. auto: if a pilot shows
        /// that it lowers the error by more than it costs; never with fewer than 16 samples of each pixel, or with
        /// options that it does not support. Default: auto.
        #[serde(default, skip_serializing_if = "AutoDesc::is_default")]
        bidirectional: AutoDesc,
    },
    /// Whitted's ray tracing: mirror reflection, refraction, direct illumination by every light, and an ambient term.
    Whitted {
        /// Largest number of segments from the camera. Default: 8.
        #[serde(default = "whitted_depth")]
        max_depth: u32,
        /// Radiance of the ambient light that every diffuse surface reflects. Default: 0.
        #[serde(default, deserialize_with = "spread")]
        #[schemars(with = "Spread<3>")]
        ambient: [f32; 3],
        /// As of `path`. Default: false.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        hide_emitters: bool,
    },
    /// The geometric normal as a colour, `(n + 1) / 2`.
    #[serde(deserialize_with = "no_keys")]
    Normal,
    /// The shading normal as a colour, `(n + 1) / 2`.
    #[serde(deserialize_with = "no_keys")]
    ShadingNormal,
    /// Surface parameters as red and green.
    #[serde(deserialize_with = "no_keys")]
    Uv,
    /// Depth along the view axis, in world units.
    #[serde(deserialize_with = "no_keys")]
    Depth,
    /// A colour for each primitive.
    #[serde(deserialize_with = "no_keys")]
    PrimitiveId,
    /// The fraction of a cosine-weighted hemisphere that is free.
    AmbientOcclusion {
        /// Only what is nearer than this counts, in world units; unlimited if not given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        distance: Option<f32>,
    },
}

impl IntegratorDesc {
    /// The view that suits what is shown: light, or data that a tone curve would falsify.
    pub fn view(&self) -> ViewDesc {
        match self {
            Self::Path { .. } | Self::Whitted { .. } => ViewDesc::default(),
            _ => ViewDesc::Srgb,
        }
    }
}

impl IntegratorDesc {
    /// Path tracing by its largest depth and where roulette begins, all else by default.
    pub fn path(max_depth: u32, rr_depth: Option<u32>) -> Self {
        let strategy = StrategyDesc::default();
        Self::Path {
            max_depth,
            rr_depth,
            roulette: None,
            light_samples: None,
            splitting: true,
            strategy,
            clamp: None,
            regularize: None,
            hide_emitters: false,
            guiding: AutoDesc::default(),
            caustics: CausticsDesc::default(),
            bidirectional: AutoDesc::default(),
        }
    }

    /// Which paths and shadow rays Russian roulette terminates; `None` where there are no paths.
    pub fn roulette(&self) -> Option<RouletteDesc> {
        let Self::Path { max_depth, roulette, rr_depth, .. } = *self else { return None };
        let default = match rr_depth {
            None => RouletteDesc::Auto,
            Some(from) if from.saturating_add(1) >= max_depth && max_depth > DEFAULT_RR_DEPTH + 1 => {
                RouletteDesc::ShadowRays
            }
            Some(_) => RouletteDesc::Throughput,
        };
        Some(roulette.unwrap_or(default))
    }
}

impl Default for IntegratorDesc {
    fn default() -> Self {
        Self::path(default_max_depth(), None)
    }
}

/// For variants without parameters, whose unknown keys serde would ignore.
fn no_keys<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct NoKeys {}

    NoKeys::deserialize(deserializer).map(|NoKeys {}| ())
}

fn default_max_depth() -> u32 {
    64
}

/// Segments before Russian roulette by throughput may end a path, by default.
pub const DEFAULT_RR_DEPTH: u32 = 5;

fn whitted_depth() -> u32 {
    8
}

/// How directions towards lights are found. All give the same picture; they differ in noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StrategyDesc {
    /// Both of the below, combined by multiple importance sampling.
    #[default]
    Mis,
    /// By sampling lights, wherever that is possible.
    Light,
    /// By chance, when a scattered ray meets a light. (Point, spot and sharp directional lights are still sampled:
    /// nothing else finds them.)
    Bsdf,
}

/// How caustics are found: light that mirrors, metal and glass throw on other surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CausticsDesc {
    /// By photons too if a pilot shows that they lower the error by more than they cost. What is missing with `paths`
    /// is missing in any case.
    #[default]
    Auto,
    /// By chance, where a scattered ray meets a light by way of mirrors, metal and glass: unbiased, with much noise.
    /// Those of point, spot, projector and distant lights by mirrors and clear glass are missing.
    Paths,
    /// Also by photons traced from all lights: little noise. They blur caustics by up to two pixels; the blur vanishes
    /// as samples are added.
    Photons,
}

/// Which paths and shadow rays Russian roulette terminates. All give the same picture; they differ in noise and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RouletteDesc {
    /// From `rr_depth` segments on, by the throughput of the path.
    Throughput,
    /// From the second scattering on, by what a path may add to its pixel and by what it costs, as a pilot of an eighth
    /// of a sample of each pixel finds both; shadow rays by what they carry. `rr_depth` is ignored.
    Auto,
    /// Shadow rays by what they carry, as with auto; no paths. `rr_depth` is ignored.
    ShadowRays,
    /// None.
    Off,
}

/// Whether something is used that changes noise and time, but not the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AutoDesc {
    /// Never.
    Off,
    /// Where it lowers the error by more than it costs.
    #[default]
    Auto,
    /// Wherever it can be.
    On,
}

impl AutoDesc {
    const NAMES: [&str; 3] = ["off", "auto", "on"];

    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl From<bool> for AutoDesc {
    fn from(is_on: bool) -> Self {
        if is_on { Self::On } else { Self::Off }
    }
}

/// By name; `true` is `on`, `false` is `off`.
impl<'de> Deserialize<'de> for AutoDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrSwitch;

        impl Visitor<'_> for NameOrSwitch {
            type Value = AutoDesc;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("off, auto or on")
            }

            fn visit_bool<E: Error>(self, is_on: bool) -> Result<AutoDesc, E> {
                Ok(is_on.into())
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<AutoDesc, E> {
                match name {
                    "off" => Ok(AutoDesc::Off),
                    "auto" => Ok(AutoDesc::Auto),
                    "on" => Ok(AutoDesc::On),
                    _ => Err(E::unknown_variant(name, &AutoDesc::NAMES)),
                }
            }
        }

        deserializer.deserialize_any(NameOrSwitch)
    }
}

impl CausticsDesc {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
