//! How a picture was made: all that is needed to make it again.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::integrator_overrides::{unsupported_with_light_paths, unsupported_with_photons};
use super::state::put;
use super::{LightTracing, Settings, Stats};
use crate::compile::check_film_and_integrator;
use crate::desc::{FilmDesc, OutputDesc};
use crate::error::{Error, Result};
use crate::film::Crop;
use crate::import::{ImportOptions, SceneFingerprint};
use crate::output::check_output;

/// The version of the format of recipes.
const VERSION: u64 = 1;

/// How a picture was made. Files keep it, with how they are written, as
/// [`settings`](crate::output::RenderInfo::settings).
///
/// It is data: it names the scene and what the picture depends on, never a file to write, a library to load or an
/// address to connect to.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderProvenance {
    /// The version of this format.
    pub version: u64,
    /// Name and version of the program.
    pub program: String,
    /// What followed the program's name on its command line. Only for the information of people.
    #[serde(default)]
    pub arguments: Vec<String>,
    /// The folder that names of files refer to.
    pub folder: PathBuf,
    /// The scene's file.
    pub scene_file: PathBuf,
    /// What the scene and its files are.
    pub scene: SceneFingerprint,
    /// How the scene was read.
    #[serde(default)]
    pub import: ImportOptions,
    /// Whether the scene was rendered without the files that were missing.
    #[serde(default)]
    pub allow_missing: bool,
    /// The frame of a sequence that a single scene file holds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<SequenceFrame>,
    /// What the picture depends on beside the scene.
    pub settings: Settings,
    /// Whether a repeated render ends with other samples: after one that was ended within a pass, or before its target
    /// error.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unrepeatable: bool,
    /// Whether the picture was denoised, with the denoiser's own defaults.
    #[serde(default)]
    pub denoise: bool,
    /// How the file is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<OutputDesc>,
}

/// A frame of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SequenceFrame {
    /// Its number.
    pub number: i64,
    /// Frames in a second.
    pub per_second: f64,
}

impl RenderProvenance {
    /// That of a render which is about to begin in the working folder.
    pub fn new(scene_file: &Path, scene: SceneFingerprint, settings: &Settings, arguments: Vec<String>) -> Self {
        Self {
            version: VERSION,
            program: concat!("steradian ", env!("CARGO_PKG_VERSION")).to_owned(),
            arguments,
            folder: std::env::current_dir().unwrap_or_default(),
            scene_file: scene_file.to_owned(),
            scene,
            import: ImportOptions::default(),
            allow_missing: false,
            frame: None,
            settings: settings.clone(),
            unrepeatable: false,
            denoise: false,
            output: None,
        }
    }

    /// The same with the samples that the picture has got in the end, and with what a pilot has decided.
    #[must_use]
    pub fn of_render(mut self, stats: &Stats) -> Self {
        if self.settings.light_tracing().is_none() {
            self.settings.light_tracing = Some(stats.light_tracing);
        }
        let has_target = self.settings.target_error.is_some();
        self.unrepeatable = stats.is_uneven || (has_target && (stats.interrupted || stats.time_limited));
        if !has_target && stats.spp_done < self.settings.spp {
            self.settings.planned_spp.get_or_insert(self.settings.spp);
            self.settings.spp = stats.spp_done;
        }
        self
    }

    /// The same but for what makes frames of a sequence different from each other: the number of the frame, and the
    /// seed that grows with it.
    #[must_use]
    pub fn of_frame(&self, number: i64) -> Self {
        let seed = self.settings.seed.wrapping_add_signed(number.wrapping_neg());
        Self { frame: None, settings: Settings { seed, ..self.settings.clone() }, ..self.clone() }
    }

    /// Differences from `expected`, whose file is written with the settings of `output`: settings by name, each with
    /// both values. The command line, the folder and the version of the program do not count.
    pub fn differences(&self, expected: &Self, output: &OutputDesc) -> Vec<String> {
        let flat = |provenance: &Self, output: Option<&OutputDesc>| {
            let mut values = BTreeMap::new();
            put(&mut values, "", &serde_json::to_value(&provenance.settings).unwrap_or_default());
            put(&mut values, "denoise", &Value::Bool(provenance.denoise));
            put(&mut values, "output", &serde_json::to_value(output).unwrap_or_default());
            values.remove("output.file");
            values
        };
        let (own, other) = (flat(self, self.output.as_ref()), flat(expected, Some(output)));
        let names: BTreeSet<&String> = own.keys().chain(other.keys()).collect();
        let mut found = Vec::new();
        if self.scene.whole != expected.scene.whole {
            found.push(format!("another scene: {}", self.scene.differences(&expected.scene).join(", ")));
        }
        found.extend(names.into_iter().filter_map(|name| {
            let [a, b] = [&own, &other].map(|values| values.get(name).map_or("none", String::as_str));
            (a != b).then(|| format!("{name}: {a} in the file, {b} for the rest"))
        }));
        found
    }

    /// As files keep it.
    pub fn to_value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    /// As a file has kept it.
    ///
    /// # Errors
    /// [`Error::Malformed`] if it is of another version, has unknown keys or lacks some; [`Error::Scene`] if a number
    /// makes no sense.
    pub fn from_value(value: Value, file: &Path) -> Result<Self> {
        let malformed = |message: String| Error::Malformed { file: file.to_owned(), message };
        match value.get("version").map(Value::as_u64) {
            Some(Some(VERSION)) => {}
            Some(version) => {
                let found = version.map_or_else(|| "no number".to_owned(), |version| version.to_string());
                return Err(malformed(format!(
                    "its provenance has version {found}, supported is {VERSION}: render the scene itself"
                )));
            }
            None => {
                let message = "its provenance has no version: it was written by an earlier steradian, as a command \
                               line; render the scene itself";
                return Err(malformed(message.to_owned()));
            }
        }
        let provenance: Self =
            serde_path_to_error::deserialize(value).map_err(|e| malformed(format!("its provenance: {e}")))?;
        provenance.check(file)?;
        Ok(provenance)
    }

    /// Whether numbers are such as scenes and the command line may have.
    fn check(&self, file: &Path) -> Result<()> {
        let Settings { size: [width, height], overscan, crop, filter, spp, target_error, ref integrator, .. } =
            self.settings;
        let fault = |path: &str, message: &str| Error::Scene {
            file: file.to_owned(),
            path: path.to_owned(),
            message: message.to_owned(),
        };
        let require = |valid: bool, path: &str, message: &str| if valid { Ok(()) } else { Err(fault(path, message)) };
        check_film_and_integrator(
            &FilmDesc { width, height, overscan, filter, ..FilmDesc::default() },
            integrator,
            file,
        )?;
        let film = self.settings.film_size();
        require(crop.fits(film), "settings.crop", "must have an area and lie within the picture")?;
        require(overscan == 0 || crop == Crop::full(film), "settings.crop", "must be all of a picture with overscan")?;
        require(spp > 0, "settings.spp", "must be at least 1")?;
        require(self.settings.planned_spp() >= spp, "settings.planned_spp", "must be at least spp")?;
        require(
            target_error.is_none_or(|error| error > 0.0 && error.is_finite()),
            "settings.target_error",
            "must be above 0",
        )?;
        let guided = self.settings.is_guided() && target_error.is_some();
        require(!guided, "settings.target_error", "must be null with guiding")?;
        let has_guide = self.settings.guide.is_some();
        let unsupported = match self.settings.light_tracing() {
            Some(LightTracing::Off) => None,
            Some(LightTracing::Photons) => unsupported_with_photons(integrator, has_guide, target_error.is_some()),
            _ => unsupported_with_light_paths(integrator, has_guide, target_error.is_some()),
        };
        require(unsupported.is_none(), "settings.integrator", "must not have light tracing with what excludes it")?;
        require(self.import.time.is_finite(), "import.time", "must be finite")?;
        require(
            self.frame.is_none_or(|frame| i32::try_from(frame.number).is_ok()),
            "frame.number",
            "must fit 32 bits",
        )?;
        require(
            self.frame.is_none_or(|frame| frame.per_second > 0.0 && frame.per_second.is_finite()),
            "frame.per_second",
            "must be above 0",
        )?;
        self.output.as_ref().map_or(Ok(()), |output| {
            require(output.exposure.is_finite(), "output.exposure", "must be finite")?;
            check_output(output).map_err(|e| fault("output", &e.to_string()))
        })
    }

    /// The settings of this picture, to be written with the settings of [`output`](Self::output), with `threads`
    /// threads.
    pub fn settings(&self, threads: usize) -> Settings {
        let layers = self.output.iter().flat_map(|output| &output.layers).collect();
        let outputs = self.output.iter().cloned().collect();
        Settings { layers, outputs, threads, time_limit: None, ..self.settings.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Overrides;

    fn provenance() -> Value {
        let desc = serde_json::from_str(r#"{ "camera": {}, "film": { "width": 40, "height": 30 } }"#).unwrap();
        let settings = Settings::new(&desc, &Overrides::default()).unwrap();
        let provenance = RenderProvenance::new(Path::new("s.json"), SceneFingerprint::default(), &settings, Vec::new());
        RenderProvenance {
            output: Some(OutputDesc::new("a.exr")),
            frame: Some(SequenceFrame { number: 3, per_second: 24.0 }),
            ..provenance
        }
        .to_value()
    }

    fn refusal(value: Value) -> String {
        let error = RenderProvenance::from_value(value, Path::new("a.exr")).unwrap_err();
        assert_eq!(error.kind(), crate::ErrorKind::Scene, "{error}");
        error.to_string()
    }

    #[test]
    fn a_recipe_comes_back_as_it_was() {
        let value = provenance();
        assert_eq!(RenderProvenance::from_value(value.clone(), Path::new("a.exr")).unwrap().to_value(), value);
        let settings = RenderProvenance::from_value(value.clone(), Path::new("a.exr")).unwrap().settings(3);
        assert_eq!((serde_json::to_value(&settings).unwrap(), settings.threads), (value["settings"].clone(), 3));
        assert_eq!(settings.outputs[0].file, "a.exr");
    }

    #[test]
    fn frames_of_a_sequence_differ_in_their_seed_alone() {
        let provenance = RenderProvenance::from_value(provenance(), Path::new("a.exr")).unwrap();
        let of_frame = |number: i64| {
            let settings = Settings { seed: 5u64.wrapping_add_signed(number), ..provenance.settings.clone() };
            RenderProvenance { frame: Some(SequenceFrame { number, per_second: 24.0 }), settings, ..provenance.clone() }
                .of_frame(number)
        };
        let differences = |own: &RenderProvenance, output: &OutputDesc| own.differences(&of_frame(-7), output);
        let output = OutputDesc::new("b.exr");
        assert_eq!(differences(&of_frame(3), &output), Vec::<String>::new());
        let mut other = of_frame(9);
        (other.settings.spp, other.denoise, other.scene.whole) = (provenance.settings.spp + 1, true, "x".into());
        other.scene.scene = "x".into();
        let spp = format!("spp: {} in the file, {} for the rest", other.settings.spp, provenance.settings.spp);
        let expected =
            ["another scene: the scene's description", "denoise: true in the file, false for the rest", &spp];
        assert_eq!(differences(&other, &output), expected);
        let commented = OutputDesc { comments: Some("other".into()), ..output };
        assert_eq!(differences(&of_frame(3), &commented), ["output.comments: none in the file, other for the rest"]);
    }

    #[test]
    fn recipes_of_other_versions_are_refused() {
        for (version, message) in
            [(Value::Null, "version no number"), (2.into(), "version 2"), ("1".into(), "version no number")]
        {
            let mut value = provenance();
            value["version"] = version;
            assert!(refusal(value).contains(message));
        }
        let mut value = provenance();
        value.as_object_mut().unwrap().remove("version");
        assert!(refusal(value).contains("a.exr: its provenance has no version"));
        assert!(refusal(Value::Null).contains("no version"));
    }

    /// No object in a recipe takes an unknown key, and no required key may be missing.
    #[test]
    fn unknown_keys_are_refused_at_every_level() {
        for place in
            ["", "/scene", "/import", "/frame", "/settings", "/settings/filter", "/settings/integrator", "/output"]
        {
            let mut value = provenance();
            value.pointer_mut(place).unwrap()["oidn_library"] = "evil.so".into();
            let message = refusal(value);
            assert!(
                message.contains("a.exr") && message.contains("unknown field `oidn_library`"),
                "{place}: {message}"
            );
        }
        for key in provenance()["settings"].as_object().unwrap().keys().filter(|key| *key != "target_error") {
            let mut value = provenance();
            value["settings"].as_object_mut().unwrap().remove(key);
            assert!(refusal(value).contains(&format!("missing field `{key}`")), "{key}");
        }
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused() {
        use serde_json::json;
        let cases = [
            ("/settings/size", json!([0, 30]), "film.width"),
            ("/settings/size", json!([1_000_000, 30]), "film.width"),
            ("/settings/size", json!([40, -1]), "settings.size[1]"),
            ("/settings/crop", json!([0, 0, 41, 30]), "settings.crop"),
            ("/settings/crop", json!([4_294_967_295u32, 0, 2, 2]), "settings.crop"),
            ("/settings/crop", json!([0, 0, 0, 0]), "settings.crop"),
            ("/settings/overscan", json!(31), "film.overscan"),
            ("/settings/overscan", json!(4_294_967_295u32), "film.overscan"),
            ("/settings/overscan", json!(2), "settings.crop"),
            ("/settings/filter/radius", json!(-1), "filter.radius"),
            ("/settings/filter/type", json!("none"), "settings.filter"),
            ("/settings/spp", json!(0), "settings.spp"),
            ("/settings/seed", json!(1.5), "settings.seed"),
            ("/settings/target_error", json!(0), "settings.target_error"),
            ("/settings/integrator/max_depth", json!(0), "integrator.max_depth"),
            ("/settings/sampler", json!("none"), "settings.sampler"),
            ("/settings/accel", json!("gpu"), "settings.accel"),
            ("/settings/layers", json!(["none"]), "settings.layers"),
            ("/frame/number", json!(1i64 << 40), "frame.number"),
            ("/frame/per_second", json!(0), "frame.per_second"),
            ("/output/crypto_depth", json!(5), "Cryptomatte"),
            ("/output/exposure", json!(1e300), "output.exposure"),
            ("/denoise", json!("evil.so"), "denoise"),
        ];
        for (place, value, message) in cases {
            let mut changed = provenance();
            let (object, key) = place.rsplit_once('/').unwrap();
            changed.pointer_mut(object).unwrap()[key] = value;
            let refused = refusal(changed);
            assert!(refused.contains("a.exr") && refused.contains(message), "{place}: {refused}");
        }
    }

    /// Whatever has ended the render, with too few samples for a pilot.
    #[test]
    fn what_a_pilot_has_decided_is_repeated() {
        let mut recipe = RenderProvenance::from_value(provenance(), Path::new("a.exr")).unwrap();
        recipe.settings.spp = 64;
        for light_tracing in [LightTracing::Off, LightTracing::Photons, LightTracing::Bidirectional] {
            let stats = Stats { spp_done: 3, light_tracing, ..Stats::default() };
            let value = recipe.clone().of_render(&stats).to_value();
            let settings = RenderProvenance::from_value(value.clone(), Path::new("a.exr")).unwrap().settings(1);
            assert_eq!((settings.spp, settings.light_tracing()), (3, Some(light_tracing)));
            let mut unsupported = value;
            unsupported["settings"]["integrator"]["guiding"] = "on".into();
            let is_refused = RenderProvenance::from_value(unsupported, Path::new("a.exr")).is_err();
            assert_eq!(is_refused, light_tracing != LightTracing::Off);
        }
    }

    #[test]
    fn what_cannot_be_repeated_is_marked() {
        let recipe = RenderProvenance::from_value(provenance(), Path::new("a.exr")).unwrap();
        let unrepeatable = |stats: Stats, target_error| {
            let settings = Settings { target_error, ..recipe.settings.clone() };
            let value = RenderProvenance { settings, ..recipe.clone() }.of_render(&stats).to_value();
            RenderProvenance::from_value(value, Path::new("a.exr")).unwrap().unrepeatable
        };
        let stats = Stats { spp_done: 3, ..Stats::default() };
        assert!(!unrepeatable(Stats { time_limited: true, ..stats.clone() }, None));
        assert!(unrepeatable(Stats { is_uneven: true, ..stats.clone() }, None));
        assert!(
            !unrepeatable(stats.clone(), Some(0.1)) && unrepeatable(Stats { interrupted: true, ..stats }, Some(0.1))
        );
    }
}
