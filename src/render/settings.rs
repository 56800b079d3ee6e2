//! Everything a render needs beside the scene: the values of the scene file, and the overrides of the caller.

use std::fmt::Display;
use std::num::NonZero;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::integrator_overrides::integrator;
use super::outputs::outputs;
use super::{GuidingStage, LightTracing, Overrides, Shard, TrainedGuide};
use crate::accel::AccelKind;
use crate::desc::{
    AutoDesc, CausticsDesc, FilterDesc, IntegratorDesc, LayerKind, MAX_SIDE, OutputDesc, SceneDesc, StrategyDesc,
    ViewDesc,
};
use crate::error::{Error, Result};
use crate::film::{Crop, LayerSet};
use crate::sampling::SamplerKind;

/// Extensions of the files written if neither the scene nor the command line names one.
pub const DEFAULT_EXTENSIONS: [&str; 2] = ["exr", "png"];

/// The most samples of a pixel with a target error, by default.
const MOST_SAMPLES: u32 = 1 << 16;

/// More threads than this are a slip of the keyboard.
const MAX_THREADS: usize = 4096;

/// A pilot decides on photons and light paths only of pictures with at least as many samples per pixel, so that it
/// costs little.
const LEAST_LIGHT_TRACING_SPP: u32 = 16;

/// And with paths of at least as many segments: others have neither connections nor caustics.
const LEAST_LIGHT_TRACING_DEPTH: u32 = 3;

/// A pilot decides on guiding only of pictures with at least as many samples per pixel, so that it costs little,
const LEAST_GUIDED_SPP: u32 = 128;

/// with as many samples in all, so that there is something to learn from,
const LEAST_GUIDED_SAMPLES: u64 = 1 << 20;

/// and with paths of as many segments: one scattering is well served by lights and materials.
const LEAST_GUIDED_DEPTH: u32 = 3;

/// How a scene is rendered.
///
/// Serialized, these are the settings that the picture depends on: EXR files keep them for
/// [`RenderProvenance`](super::RenderProvenance), and a checkpoint or shard belongs to another picture if any differs.
/// Only what can never change a pixel is skipped.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Width and height of the full picture in pixels.
    pub size: [u32; 2],
    /// Pixels that are rendered on each side beyond the picture.
    pub overscan: u32,
    /// The part that is rendered, of the picture with its overscan.
    pub crop: Crop,
    /// The pixel filter.
    pub filter: FilterDesc,
    /// Whether the camera does not see light from infinity, and the picture is transparent there.
    pub transparent: bool,
    /// How samples are chosen.
    pub sampler: SamplerKind,
    /// Samples per pixel; with a target error the most that a pixel gets.
    pub spp: u32,
    /// Those that the picture was to have, if its render ended with fewer: pilots, training and texture filtering go by
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned_spp: Option<u32>,
    /// The relative squared error that the picture is to stay below; samples then go where they are needed.
    pub target_error: Option<f64>,
    /// A different seed gives different noise.
    pub seed: u64,
    /// The algorithm.
    pub integrator: IntegratorDesc,
    /// What is traced from the lights, if a pilot has decided that before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_tracing: Option<LightTracing>,
    /// What guides paths, if a guide was trained before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guide: Option<TrainedGuide>,
    /// What finds hits.
    pub accel: AccelKind,
    /// Whether the camera's lens blurs what is out of focus; if not,
    /// [`Camera::remove_lens`](crate::camera::Camera::remove_lens) belongs before the render.
    pub depth_of_field: bool,
    /// Number of threads, at least 1.
    #[serde(skip)]
    pub threads: usize,
    /// The render ends after this time even if samples are missing.
    #[serde(skip)]
    pub time_limit: Option<Duration>,
    /// The files to write.
    #[serde(skip)]
    pub outputs: Vec<OutputDesc>,
    /// Every layer of an output.
    pub layers: LayerSet,
}

impl Settings {
    /// The settings of a scene with the changes of the caller.
    ///
    /// # Errors
    /// [`Error::Setting`] if a change is impossible.
    pub fn new(desc: &SceneDesc, overrides: &Overrides) -> Result<Self> {
        let size = size(desc, overrides)?;
        let overscan = overscan(desc, overrides, size)?;
        let integrator = integrator(desc, overrides)?;
        let outputs = outputs(desc, overrides, &integrator)?;
        let layers = outputs.iter().flat_map(|output| &output.layers).collect();
        if overrides.spp == Some(0) {
            return Err(refused("spp", " 0: a picture needs at least one sample per pixel"));
        }
        Ok(Self {
            size,
            overscan,
            crop: crop(desc, overrides, size, overscan)?,
            filter: desc.film.filter,
            transparent: overrides.transparent.unwrap_or(desc.film.transparent),
            sampler: overrides.sampler.unwrap_or(desc.sampler.kind).into(),
            spp: overrides.spp.unwrap_or(if overrides.target_error.is_some() {
                MOST_SAMPLES
            } else {
                desc.sampler.spp
            }),
            planned_spp: None,
            target_error: target_error(overrides)?,
            seed: overrides.seed.unwrap_or(desc.sampler.seed),
            integrator,
            light_tracing: None,
            guide: overrides.guide.clone(),
            accel: overrides.accel.unwrap_or_default(),
            depth_of_field: !overrides.no_depth_of_field,
            threads: threads(overrides.threads)?,
            time_limit: time_limit(overrides)?,
            outputs,
            layers,
        })
    }

    /// Samples per pixel that the picture was to have from the start.
    pub fn planned_spp(&self) -> u32 {
        self.planned_spp.unwrap_or(self.spp)
    }

    /// What is traced from the lights: `None` if a pilot decides.
    pub fn light_tracing(&self) -> Option<LightTracing> {
        let IntegratorDesc::Path { caustics, bidirectional, max_depth, clamp, .. } = self.integrator else {
            return Some(LightTracing::Off);
        };
        // Clamping takes other light from paths than from photons: what a pilot decides would change the picture.
        let has_pilot =
            self.planned_spp() >= LEAST_LIGHT_TRACING_SPP && max_depth >= LEAST_LIGHT_TRACING_DEPTH && clamp.is_none();
        self.light_tracing.or(match (caustics, bidirectional) {
            (CausticsDesc::Photons, _) => Some(LightTracing::Photons),
            (_, AutoDesc::On) => Some(LightTracing::Bidirectional),
            (CausticsDesc::Auto, _) | (_, AutoDesc::Auto) if has_pilot => None,
            _ => Some(LightTracing::Off),
        })
    }

    /// Whether this may be traced from the lights, if only because a pilot decides so.
    pub(super) fn may_trace(&self, what: LightTracing) -> bool {
        let IntegratorDesc::Path { caustics, bidirectional, .. } = self.integrator else { return false };
        self.light_tracing().map_or(
            match what {
                LightTracing::Off => true,
                LightTracing::Photons => caustics != CausticsDesc::Paths,
                LightTracing::Bidirectional => bidirectional != AutoDesc::Off,
            },
            |known| known == what,
        )
    }

    /// Whether photons start at lights too that paths never meet: what a pilot decides must not change the picture.
    pub(super) fn traces_delta_lights(&self) -> bool {
        matches!(self.integrator, IntegratorDesc::Path { caustics: CausticsDesc::Photons, .. })
    }

    /// Whether paths train a guide in any case: a sample then depends on all that were before.
    pub fn is_guided(&self) -> bool {
        matches!(self.integrator, IntegratorDesc::Path { guiding: AutoDesc::On, .. })
    }

    /// For a part of the samples. What a pilot decides would depend on those of other parts: without a trained guide,
    /// shards are not guided.
    #[must_use]
    pub fn of_shard(mut self, shard: Shard) -> Self {
        if let IntegratorDesc::Path { guiding: guiding @ AutoDesc::Auto, .. } = &mut self.integrator
            && shard != Shard::WHOLE
        {
            *guiding = AutoDesc::Off;
        }
        self
    }

    /// Whether a pilot decides if paths are guided.
    pub fn has_guiding_pilot(&self) -> bool {
        let samples = self.crop.area() * u64::from(self.planned_spp());
        self.allows_guiding_pilot() && self.planned_spp() >= LEAST_GUIDED_SPP && samples >= LEAST_GUIDED_SAMPLES
    }

    /// Whether a pilot decides where there are enough samples.
    fn allows_guiding_pilot(&self) -> bool {
        let IntegratorDesc::Path { guiding: AutoDesc::Auto, strategy, max_depth, .. } = self.integrator else {
            return false;
        };
        self.guide.is_none()
            && self.target_error.is_none()
            && matches!(self.light_tracing(), None | Some(LightTracing::Off))
            && strategy == StrategyDesc::Mis
            && max_depth >= LEAST_GUIDED_DEPTH
    }

    /// Whether a state with these settings can be at this stage, with any number of samples: more may have been added.
    pub(super) fn allows_stage(&self, stage: GuidingStage) -> bool {
        match stage {
            GuidingStage::Off => !self.is_guided(),
            GuidingStage::Pilot => self.allows_guiding_pilot(),
            GuidingStage::On => self.is_guided() || self.allows_guiding_pilot(),
        }
    }

    /// The view of the first PNG file; without one, that which suits the integrator.
    pub fn view(&self) -> ViewDesc {
        self.outputs.iter().find_map(|output| output.view).unwrap_or_else(|| self.integrator.view())
    }

    /// The layers beside the picture, as files are to store them.
    pub fn stored_layers(&self) -> Vec<LayerKind> {
        self.layers.iter().map(|info| info.kind).filter(|kind| *kind != LayerKind::Color).collect()
    }

    /// Width and height of what is rendered: the picture with its overscan.
    pub fn film_size(&self) -> [u32; 2] {
        grown(self.size, self.overscan)
    }
}

/// Width and height of a picture with its overscan.
fn grown(size: [u32; 2], overscan: u32) -> [u32; 2] {
    size.map(|side| side + 2 * overscan)
}

fn overscan(desc: &SceneDesc, overrides: &Overrides, size: [u32; 2]) -> Result<u32> {
    let overscan = overrides.overscan.unwrap_or(desc.film.overscan);
    if overscan > size[0].min(size[1]) {
        return Err(refused(
            "overscan",
            format!(" {overscan}: at most the picture's shorter side, {}", size[0].min(size[1])),
        ));
    }
    Ok(overscan)
}

/// The error of a setting that is impossible; `rest` follows its name.
pub(crate) fn refused(setting: &'static str, rest: impl Display) -> Error {
    Error::Setting { setting, message: format!("`{setting}`{rest}") }
}

fn size(desc: &SceneDesc, overrides: &Overrides) -> Result<[u32; 2]> {
    let Some([width, height]) = overrides.size else { return Ok([desc.film.width, desc.film.height]) };
    if [width, height].iter().any(|side| *side == 0 || *side > MAX_SIDE) {
        return Err(refused("size", format!(" {width}x{height}: width and height range from 1 to {MAX_SIDE}")));
    }
    Ok([width, height])
}

/// A crop that the scene alone is to blame for is left to the scene's own checks, which name its place.
fn crop(desc: &SceneDesc, overrides: &Overrides, size: [u32; 2], overscan: u32) -> Result<Crop> {
    let Some([x, y, width, height]) = overrides.crop.or(desc.film.crop) else {
        return Ok(Crop::full(grown(size, overscan)));
    };
    if overscan > 0 {
        return Err(refused(
            "overscan",
            ": a crop leaves nothing around the picture; give one of them, or `overscan` 0",
        ));
    }
    let crop = Crop { x, y, width, height };
    if !crop.fits(size) {
        let numbers = format!("{x},{y},{width},{height}");
        let picture = format!("a picture of {}x{} pixels", size[0], size[1]);
        if overrides.crop.is_some() {
            return Err(refused("crop", format!(" {numbers} is empty or reaches beyond {picture}")));
        }
        if overrides.size.is_some() {
            return Err(refused(
                "size",
                format!(": the scene's crop {numbers} reaches beyond {picture}; give `crop` too"),
            ));
        }
    }
    Ok(crop)
}

/// The number of threads that is requested; without it, or with 0, all that the process may use.
///
/// # Errors
/// [`Error::Setting`] if there are too many.
pub fn threads(requested: Option<usize>) -> Result<usize> {
    match requested.unwrap_or(0) {
        0 => Ok(std::thread::available_parallelism().map_or(1, NonZero::get)),
        threads if threads > MAX_THREADS => Err(refused("threads", format!(" {threads}: at most {MAX_THREADS}"))),
        threads => Ok(threads),
    }
}

fn target_error(overrides: &Overrides) -> Result<Option<f64>> {
    match overrides.target_error {
        Some(error) if !(error > 0.0 && error < f64::INFINITY) => {
            Err(refused("target_error", format!(" {error}: a relative squared error above 0, such as 0.01")))
        }
        target => Ok(target),
    }
}

fn time_limit(overrides: &Overrides) -> Result<Option<Duration>> {
    let Some(seconds) = overrides.time_limit else { return Ok(None) };
    let limit = Duration::try_from_secs_f64(seconds).ok().filter(|limit| !limit.is_zero());
    limit.map(Some).ok_or_else(|| refused("time_limit", format!(" {seconds}: a number of seconds above 0")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::desc::{PixelTypeDesc, SamplerKindDesc};

    fn scene(text: &str) -> SceneDesc {
        serde_json::from_str(text).unwrap()
    }

    fn refusal(desc: &SceneDesc, overrides: &Overrides) -> String {
        match Settings::new(desc, overrides) {
            Err(Error::Setting { setting, message }) => {
                assert!(message.starts_with(&format!("`{setting}`")), "{message}");
                setting.to_owned()
            }
            other => panic!("{other:?}"),
        }
    }

    const SCENE: &str = r#"{
        "camera": {},
        "film": { "width": 100, "height": 50, "crop": [10, 20, 30, 30] },
        "sampler": { "type": "independent", "spp": 16, "seed": 3 },
        "integrator": { "type": "path", "max_depth": 9, "rr_depth": 3 },
        "outputs": [{ "file": "a.exr", "layers": ["N"] }, { "file": "b.png", "exposure": 1 }]
    }"#;

    #[test]
    fn without_changes_the_scene_decides() {
        let s = Settings::new(&scene(SCENE), &Overrides::default()).unwrap();
        assert_eq!((s.size, s.crop), ([100, 50], Crop { x: 10, y: 20, width: 30, height: 30 }));
        assert_eq!((s.sampler, s.spp, s.seed), (SamplerKind::Independent, 16, 3));
        assert!(matches!(
            s.integrator,
            IntegratorDesc::Path { max_depth: 9, rr_depth: Some(3), strategy: StrategyDesc::Mis, clamp: None, .. }
        ));
        assert_eq!(s.layers, [LayerKind::N].into_iter().collect());
        assert_eq!((s.accel, s.time_limit, s.outputs.len()), (AccelKind::Auto, None, 2));
        assert!(s.threads >= 1);
    }

    #[test]
    fn the_command_line_wins() {
        let overrides = Overrides {
            spp: Some(7),
            size: Some([200, 80]),
            crop: Some([0, 0, 5, 6]),
            threads: Some(3),
            seed: Some(1),
            integrator: Some(IntegratorDesc::default()),
            accel: Some(AccelKind::Linear),
            sampler: Some(SamplerKindDesc::Sobol),
            no_depth_of_field: true,
            transparent: Some(true),
            max_depth: Some(4),
            strategy: Some(StrategyDesc::Light),
            clamp: Some(2.5),
            time_limit: Some(1.5),
            layers: vec![LayerKind::Z, LayerKind::Albedo],
            float: Some(true),
            exposure: Some(-2.0),
            view: Some(ViewDesc::Filmic),
            ..Overrides::default()
        };
        let s = Settings::new(&scene(SCENE), &overrides).unwrap();
        assert_eq!((s.size, s.crop, s.threads), ([200, 80], Crop { x: 0, y: 0, width: 5, height: 6 }, 3));
        assert_eq!((s.sampler, s.spp, s.seed, s.accel), (SamplerKind::Sobol, 7, 1, AccelKind::Linear));
        assert!(
            s.transparent
                && !s.depth_of_field
                && Settings::new(&scene(SCENE), &Overrides::default()).unwrap().depth_of_field
        );
        // The same integrator: parameters that are not changed stay the scene's.
        let changed = IntegratorDesc::Path {
            max_depth: 4,
            rr_depth: Some(3),
            strategy: StrategyDesc::Light,
            clamp: Some(2.5),
            regularize: None,
            hide_emitters: false,
            guiding: AutoDesc::default(),
            roulette: None,
            light_samples: None,
            splitting: true,
            // Unsupported with such a strategy.
            caustics: CausticsDesc::Paths,
            bidirectional: AutoDesc::Off,
        };
        assert_eq!(s.integrator, changed);
        assert_eq!(s.time_limit, Some(Duration::from_millis(1500)));
        assert_eq!(
            (s.outputs[0].layers.as_slice(), s.outputs[0].pixel_type),
            (&[LayerKind::Z, LayerKind::Albedo][..], PixelTypeDesc::Float)
        );
        assert_eq!(
            (s.outputs[1].exposure, s.outputs[1].view, s.outputs[1].layers.len()),
            (-2.0, Some(ViewDesc::Filmic), 0)
        );
        assert_eq!(s.outputs[0].view, None);
        assert!(s.layers.contains(LayerKind::Albedo) && !s.layers.contains(LayerKind::N));
    }

    #[test]
    fn png_files_have_a_view_that_suits_the_integrator() {
        let view = |png: &str, overrides: &Overrides| {
            let desc = scene(&format!(r#"{{ "camera": {{}}, "outputs": [{{ "file": "b.png" {png} }}] }}"#));
            Settings::new(&desc, overrides).unwrap().outputs[0].view
        };
        let normals = Overrides { integrator: Some(IntegratorDesc::Normal), ..Overrides::default() };
        assert_eq!(view("", &Overrides::default()), Some(ViewDesc::Agx));
        assert_eq!(view("", &normals), Some(ViewDesc::Srgb));
        assert_eq!(view(r#", "view": "filmic""#, &normals), Some(ViewDesc::Filmic));
        assert_eq!(
            view(r#", "view": "filmic""#, &Overrides { view: Some(ViewDesc::Srgb), ..normals }),
            Some(ViewDesc::Srgb)
        );
    }

    #[test]
    fn outputs_come_from_the_command_line_then_the_scene_then_the_default() {
        let default_outputs = vec!["stem.exr".to_owned(), "stem.png".to_owned()];
        let named = Overrides {
            outputs: vec!["c.png".to_owned()],
            default_outputs: default_outputs.clone(),
            ..Overrides::default()
        };
        let files = |desc: &SceneDesc, overrides: &Overrides| -> Vec<String> {
            Settings::new(desc, overrides).unwrap().outputs.into_iter().map(|output| output.file).collect()
        };
        assert_eq!(files(&scene(SCENE), &named), ["c.png"]);
        let unnamed = Overrides { outputs: Vec::new(), ..named };
        assert_eq!(files(&scene(SCENE), &unnamed), ["a.exr", "b.png"]);
        assert_eq!(files(&scene(r#"{ "camera": {} }"#), &unnamed), default_outputs);
    }

    #[test]
    fn impossible_changes_are_refused_by_the_settings_name() {
        let desc = scene(SCENE);
        let d = Overrides::default;
        let cases = [
            ("spp", Overrides { spp: Some(0), ..d() }),
            ("target_error", Overrides { target_error: Some(0.0), ..d() }),
            ("target_error", Overrides { target_error: Some(f64::NAN), ..d() }),
            ("size", Overrides { size: Some([0, 5]), ..d() }),
            ("size", Overrides { size: Some([1 << 20, 5]), ..d() }),
            ("size", Overrides { size: Some([20, 20]), ..d() }),
            ("crop", Overrides { crop: Some([90, 0, 11, 5]), ..d() }),
            ("crop", Overrides { crop: Some([0, 0, 0, 5]), ..d() }),
            ("threads", Overrides { threads: Some(1 << 20), ..d() }),
            ("max_depth", Overrides { max_depth: Some(0), ..d() }),
            ("max_depth", Overrides { max_depth: Some(3), integrator: Some(IntegratorDesc::Normal), ..d() }),
            ("strategy", Overrides { strategy: Some(StrategyDesc::Bsdf), integrator: Some(IntegratorDesc::Uv), ..d() }),
            ("clamp", Overrides { clamp: Some(0.0), ..d() }),
            ("clamp", Overrides { clamp: Some(f32::NAN), ..d() }),
            ("clamp", Overrides { clamp: Some(1.0), integrator: Some(IntegratorDesc::Uv), ..d() }),
            ("regularize", Overrides { regularize: Some(-0.1), ..d() }),
            ("regularize", Overrides { regularize: Some(f32::NAN), ..d() }),
            ("regularize", Overrides { regularize: Some(0.1), integrator: Some(IntegratorDesc::Uv), ..d() }),
            ("time_limit", Overrides { time_limit: Some(0.0), ..d() }),
            ("time_limit", Overrides { time_limit: Some(f64::NAN), ..d() }),
            ("layers", Overrides { layers: vec![LayerKind::Z], outputs: vec!["a.png".to_owned()], ..d() }),
            ("float", Overrides { float: Some(true), outputs: vec!["a.png".to_owned()], ..d() }),
            ("exposure", Overrides { exposure: Some(1.0), outputs: vec!["a.exr".to_owned()], ..d() }),
            ("exposure", Overrides { exposure: Some(f32::INFINITY), ..d() }),
            ("view", Overrides { view: Some(ViewDesc::Agx), outputs: vec!["a.exr".to_owned()], ..d() }),
        ];
        for (setting, overrides) in cases {
            assert_eq!(refusal(&desc, &overrides), setting);
        }
    }
}
