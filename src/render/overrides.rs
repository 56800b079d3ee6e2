//! What the command line changes about a render.

use super::{ExrOverrides, TrainedGuide};
use crate::accel::AccelKind;
use crate::desc::{CausticsDesc, IntegratorDesc, LayerKind, RouletteDesc, SamplerKindDesc, StrategyDesc, ViewDesc};

/// Overrides of the command line; `None` keeps the value of the scene.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// `--spp`.
    pub spp: Option<u32>,
    /// `--target-error`.
    pub target_error: Option<f64>,
    /// `--size`: width and height.
    pub size: Option<[u32; 2]>,
    /// `--crop`: x, y, width, height.
    pub crop: Option<[u32; 4]>,
    /// `--overscan`, in pixels.
    pub overscan: Option<u32>,
    /// `--threads`; 0 means all.
    pub threads: Option<usize>,
    /// `--seed`.
    pub seed: Option<u64>,
    /// `--integrator`, with default parameters; those of the scene are kept if it has the same one.
    pub integrator: Option<IntegratorDesc>,
    /// `--accel`.
    pub accel: Option<AccelKind>,
    /// `--no-depth-of-field`.
    pub no_depth_of_field: bool,
    /// `--transparent`.
    pub transparent: bool,
    /// `--sampler`.
    pub sampler: Option<SamplerKindDesc>,
    /// `--max-depth`.
    pub max_depth: Option<u32>,
    /// `--strategy`.
    pub strategy: Option<StrategyDesc>,
    /// `--clamp`; infinity means no limit.
    pub clamp: Option<f32>,
    /// `--regularize`; 0 means none.
    pub regularize: Option<f32>,
    /// `--roulette`.
    pub roulette: Option<RouletteDesc>,
    /// `--caustics`.
    pub caustics: Option<CausticsDesc>,
    /// `--guiding`.
    pub guiding: Option<bool>,
    /// `--guide`: paths are guided by it, and do not train it.
    pub guide: Option<TrainedGuide>,
    /// `--time-limit`, in seconds.
    pub time_limit: Option<f64>,
    /// `--output`: these files in place of the scene's.
    pub outputs: Vec<String>,
    /// The files if neither the scene nor the command line names one.
    pub default_outputs: Vec<String>,
    /// `--layers`: for every EXR output.
    pub layers: Vec<LayerKind>,
    /// `--float`: for every EXR output.
    pub float: bool,
    /// Of every EXR output.
    pub exr: ExrOverrides,
    /// `--exposure`: for every PNG output.
    pub exposure: Option<f32>,
    /// `--view`: for every PNG output.
    pub view: Option<ViewDesc>,
}
