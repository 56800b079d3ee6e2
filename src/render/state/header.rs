//! The header of a checkpoint or shard, and whether it is compatible.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::container::Reader;
use crate::desc::{MAX_FILTER_RADIUS, OutputDesc};
use crate::error::Result;
use crate::film::{Crop, FilmShape};
use crate::import::SceneFingerprint;
use crate::output::RenderInfo;
use crate::render::{BLOCK_SIZE, FINEST_SPP, LightTracing, Settings};
use crate::scene::Scene;

/// A part of the samples of every pixel: part `index` of `count`, from 1. All of them are part 1 of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Which part, from 1 to `count`.
    pub index: u32,
    /// How many parts there are.
    pub count: u32,
}

impl Shard {
    /// All samples.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// The indices of its samples, of `spp` in all: contiguous, and none missing or double among all parts. Empty if
    /// there are more parts than samples.
    pub fn samples(&self, spp: u32) -> Range<u32> {
        let start = |index: u32| (u64::from(index) * u64::from(spp) / u64::from(self.count)) as u32;
        start(self.index - 1)..start(self.index)
    }
}

impl Default for Shard {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(index, count)| Some((index.trim().parse().ok()?, count.trim().parse().ok()?)));
        let shard = numbers.map(|(index, count)| Self { index, count });
        shard
            .filter(|s| (1..=s.count).contains(&s.index))
            .ok_or_else(|| "expected I/N with I from 1 to N, such as 2/8".to_owned())
    }
}

/// The least that a file holds of a pixel, in bytes: the sums of colour and alpha.
const LEAST_BYTES: u64 = 48;

/// A bound for the width and height of pictures, far above those that can be rendered.
const MOST_PIXELS: u64 = 1 << 30;

/// Whether paths are guided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GuidingStage {
    /// No, or not any longer.
    #[default]
    Off,
    /// A guide learns for the pilot, which has not decided yet.
    Pilot,
    /// Yes.
    On,
}

/// The header of a checkpoint or shard.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Header {
    /// Name and version of the program.
    pub program: String,
    /// The scene's file.
    pub scene_file: String,
    /// What the scene and its files are.
    pub scene: SceneFingerprint,
    /// All settings that the picture depends on but the number of samples, as text by name.
    pub settings: BTreeMap<String, String>,
    /// Samples per pixel of the whole picture; with a target error the most.
    pub spp: u32,
    /// Which of them are here.
    pub shard: Shard,
    /// How many of the shard's samples every pixel has; with a target error their mean, rounded.
    pub done: u32,
    /// How many tiles, the first of the film, have one sample more.
    #[serde(rename = "tiles_ahead")]
    pub tiles_in_partial_pass: u64,
    /// Whether no sample is missing.
    pub complete: bool,
    /// What is traced from the lights, once that is decided.
    #[serde(default)]
    pub light_tracing: Option<LightTracing>,
    /// Whether paths are guided from here on.
    #[serde(default)]
    pub guiding: GuidingStage,
    /// What the film holds.
    pub film: FilmShape,
    /// The files that the picture is to be written to.
    pub outputs: Vec<OutputDesc>,
    /// The metadata of the render that these files hold.
    pub info: RenderInfo,
    /// Rays so far: from the camera, indirect, and to lights.
    pub rays: [u64; 3],
    /// Wall-clock seconds of rendering so far.
    pub render_seconds: f64,
}

impl Header {
    /// For a render that has not begun.
    pub fn new(
        scene_file: &str,
        fingerprint: SceneFingerprint,
        scene: &Scene,
        settings: &Settings,
        shard: Shard,
    ) -> Self {
        Self {
            program: concat!("steradian ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene_file: scene_file.to_owned(),
            scene: fingerprint,
            settings: compared(settings, scene),
            spp: settings.spp,
            shard,
            outputs: settings.outputs.clone(),
            ..Self::default()
        }
    }

    /// That of a file, without reading the rest of it.
    ///
    /// # Errors
    /// [`Error::Missing`](crate::Error::Missing) if it cannot be read, [`Error::Checkpoint`](crate::Error::Checkpoint)
    /// if it is of another kind or damaged.
    pub fn read(file: &Path) -> Result<Self> {
        Reader::peek(file)
    }

    /// What of it makes no sense in itself, so that no render can have written it; `None` if all does. `bytes` are
    /// those behind the header.
    pub(super) fn fault(&self, bytes: u64) -> Option<String> {
        let Shard { index, count } = self.shard;
        let Crop { x, y, width, height } = self.film.crop;
        let [x, y, width, height] = [x, y, width, height].map(u64::from);
        let [full_width, full_height] = self.film.size.map(u64::from);
        let around = 2 * u64::from(self.film.overscan);
        if !(1..=count).contains(&index) {
            Some(format!("no shard {index} of {count}"))
        } else if self.shard != Shard::WHOLE && self.guiding != GuidingStage::Off {
            Some("a guided render has no shards".to_owned())
        } else if self.done > self.spp {
            Some(format!("{} of {} samples per pixel are done", self.done, self.spp))
        } else if x + width > full_width
            || y + height > full_height
            || (around > 0 && around >= full_width.min(full_height))
        {
            Some("its film is not within its picture".to_owned())
        } else if !(self.film.filter.radius() > 0.0 && self.film.filter.radius() <= MAX_FILTER_RADIUS) {
            Some("its pixel filter has no valid radius".to_owned())
        } else if self.film.block_size.is_some_and(|size| size != BLOCK_SIZE) {
            Some("its blocks of pixels have no valid size".to_owned())
        } else if self.info.identities.as_ref().is_some_and(|identities| !identities.is_ordered()) {
            Some("an instance is placed within itself".to_owned())
        } else if (width * height).saturating_mul(LEAST_BYTES) > bytes {
            Some("a part is missing".to_owned())
        } else if full_width.max(full_height) > MOST_PIXELS {
            Some("its film is larger than any picture".to_owned())
        } else {
            None
        }
    }

    /// In what it belongs to another picture than `other`, in words; empty if it does not. `these` and `those` name the
    /// two.
    pub fn differences(&self, other: &Self, these: &str, those: &str) -> Vec<String> {
        let mut found = Vec::new();
        if self.program != other.program {
            found.push(format!("program: {} {these}, {} {those}", self.program, other.program));
        }
        if self.scene.whole != other.scene.whole {
            let what = self.scene.differences(&other.scene).join(", ");
            let files = if self.scene_file == other.scene_file {
                String::new()
            } else {
                format!(" ({}, {})", self.scene_file, other.scene_file)
            };
            found.push(format!("scene{files}: not the same {what}"));
        }
        let names: BTreeSet<&String> = self.settings.keys().chain(other.settings.keys()).collect();
        for name in names {
            let [a, b] = [self, other].map(|header| header.settings.get(name).map_or("none", String::as_str));
            if a != b {
                found.push(format!("{name}: {a} {these}, {b} {those}"));
            }
        }
        found
    }
}

/// The settings that the picture depends on, by their names. More samples can be added, unless the others depend on
/// their number.
fn compared(settings: &Settings, scene: &Scene) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    put(&mut found, "", &serde_json::to_value(settings).unwrap_or_default());
    if settings.target_error.is_none() && !settings.is_guided() {
        found.remove("spp");
    }
    if scene.features.filtered_textures {
        found.insert(
            "samples per pixel that textures are filtered for".to_owned(),
            settings.planned_spp().min(FINEST_SPP).to_string(),
        );
    }
    found
}

/// A value under a name, or each of an object's values under a name of its own.
pub(in crate::render) fn put(found: &mut BTreeMap<String, String>, name: &str, value: &Value) {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    match value {
        Value::Null => {}
        Value::Object(values) => {
            let dot = if name.is_empty() { "" } else { "." };
            values.iter().for_each(|(key, value)| put(found, &format!("{name}{dot}{key}"), value));
        }
        Value::Array(values) => {
            drop(found.insert(name.to_owned(), values.iter().map(text).collect::<Vec<_>>().join(",")));
        }
        value => drop(found.insert(name.to_owned(), text(value))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_out_all_samples() {
        for spp in [0, 1, 2, 3, 7, 64, 1000, u32::MAX] {
            for count in [1, 2, 3, 8, 100] {
                let ranges: Vec<_> = (1..=count).map(|index| Shard { index, count }.samples(spp)).collect();
                assert_eq!((ranges[0].start, ranges[ranges.len() - 1].end), (0, spp));
                assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
                let lengths = ranges.iter().map(ExactSizeIterator::len);
                assert!(lengths.clone().max().unwrap() - lengths.min().unwrap() <= 1, "{spp} {count}");
            }
        }
    }

    #[test]
    fn shards_are_written_as_fractions() {
        assert_eq!("2/8".parse(), Ok(Shard { index: 2, count: 8 }));
        assert_eq!(Shard { index: 2, count: 8 }.to_string(), "2/8");
        for text in ["0/4", "5/4", "1", "1/0", "1/4/2", "-1/4", "a/b", ""] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }

    #[test]
    fn what_differs_is_named() {
        let mut a = Header { program: "p 1".into(), scene_file: "a.json".into(), ..Header::default() };
        a.settings.insert("seed".into(), "1".into());
        let mut b = a.clone();
        assert!(a.differences(&b, "there", "here").is_empty());
        b.settings.insert("seed".into(), "2".into());
        b.settings.insert("integrator.clamp".into(), "2.5".into());
        b.program = "p 2".into();
        b.scene.whole = "x".into();
        b.scene.assets.insert("m.ply".into(), "x".into());
        let expected = [
            "program: p 1 there, p 2 here",
            "scene: not the same m.ply",
            "integrator.clamp: none there, 2.5 here",
            "seed: 1 there, 2 here",
        ];
        assert_eq!(a.differences(&b, "there", "here"), expected);
    }
}
