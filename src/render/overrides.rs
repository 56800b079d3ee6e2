//! What the caller changes about a render.

use serde::Deserialize;

use super::{ExrOverrides, TrainedGuide};
use crate::accel::AccelKind;
use crate::desc::{
    AutoDesc, CausticsDesc, IntegratorDesc, LayerKind, RouletteDesc, SamplerKindDesc, StrategyDesc, ViewDesc,
};

/// Settings of a render that replace the scene's; `None` keeps the value of the scene.
///
/// The options of the command line have the same names, with hyphens in place of underscores.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Overrides {
    /// Samples per pixel; with a target error the most that a pixel gets.
    pub spp: Option<u32>,
    /// Render until the picture's relative squared error is below this.
    pub target_error: Option<f64>,
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// The part to render: x, y, width, height in pixels from the upper left corner.
    pub crop: Option<[u32; 4]>,
    /// Pixels that are rendered on each side beyond the picture.
    pub overscan: Option<u32>,
    /// Threads; 0 means all.
    pub threads: Option<usize>,
    /// Seed of the noise.
    pub seed: Option<u64>,
    /// The algorithm, with default parameters; those of the scene are kept if it has the same one.
    pub integrator: Option<IntegratorDesc>,
    /// The accelerator.
    pub accel: Option<AccelKind>,
    /// Render everything in focus, as if the camera had no lens.
    pub no_depth_of_field: bool,
    /// The camera does not see light from infinity; alpha is 0 there.
    pub transparent: Option<bool>,
    /// How samples are chosen.
    pub sampler: Option<SamplerKindDesc>,
    /// Most segments of a path, from 1: directly visible light.
    pub max_depth: Option<u32>,
    /// How direct light is sampled.
    pub strategy: Option<StrategyDesc>,
    /// Limit of the contribution of a single path; infinity means no limit.
    pub clamp: Option<f32>,
    /// Least roughness behind rough surfaces, as alpha from 0 to 1; 0 means none.
    pub regularize: Option<f32>,
    /// Russian roulette.
    pub roulette: Option<RouletteDesc>,
    /// How caustics are found.
    pub caustics: Option<CausticsDesc>,
    /// Whether paths are connected to paths from the lights.
    pub bidirectional: Option<AutoDesc>,
    /// Whether paths are guided by what earlier ones have learned.
    pub guiding: Option<AutoDesc>,
    /// Paths are guided by it, and do not train it.
    #[serde(skip)]
    pub guide: Option<TrainedGuide>,
    /// The render ends after this many seconds.
    pub time_limit: Option<f64>,
    /// These files in place of the scene's.
    pub outputs: Vec<String>,
    /// The files if neither the scene nor `outputs` names one.
    #[serde(skip)]
    pub default_outputs: Vec<String>,
    /// The layers of every EXR output, beside the picture.
    pub layers: Vec<LayerKind>,
    /// 32-bit floats in every EXR output, or 16-bit ones.
    pub float: Option<bool>,
    /// Of every EXR output.
    pub exr: ExrOverrides,
    /// Exposure of every PNG output, in stops.
    pub exposure: Option<f32>,
    /// The tone curve of every PNG output.
    pub view: Option<ViewDesc>,
}
