//! Attributes of files.

use std::path::{Path, PathBuf};

use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{IntegerBounds, LayerAttributes};
use serde_json::Value;

use super::coverage::Matte;
use super::plan::PartKind;
use crate::desc::{CryptoManifestDesc, OutputDesc};
use crate::output::RenderInfo;
use crate::output::color_space::{DATA, INTEROP_ID, SCENE_LINEAR};

/// The attribute with the settings of a render.
pub const SETTINGS: &str = "steradian/settings";

/// Text as the bytes of its UTF-8 form, which is what programs expect.
pub fn text(text: &str) -> Text {
    Text::from_bytes_unchecked(text.bytes().collect())
}

fn put(attributes: &mut LayerAttributes, name: &str, value: AttributeValue) {
    attributes.other.insert(text(name), value);
}

/// The metadata of the mattes of a file.
pub struct Mattes<'a> {
    /// The mattes.
    pub mattes: &'a [Matte],
    /// The picture's file, which files of names lie beside.
    pub file: &'a Path,
    /// Where the names go.
    pub manifest: CryptoManifestDesc,
}

/// The file with the names of a type of mattes, beside the picture's file.
pub fn sidecar_path(file: &Path, type_name: &str) -> PathBuf {
    let stem = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    file.with_file_name(format!("{stem}.{type_name}.json"))
}

impl Mattes<'_> {
    /// The name of the file with a matte's names, beside the picture.
    pub fn sidecar(&self, matte: &Matte) -> String {
        sidecar_path(self.file, matte.name)
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    fn describe(&self, attributes: &mut LayerAttributes) {
        for matte in self.mattes {
            let entries = match self.manifest {
                CryptoManifestDesc::Embedded => matte.metadata(),
                CryptoManifestDesc::Sidecar => {
                    let names = matte.attribute("manif_file", &self.sidecar(matte));
                    matte.description().into_iter().chain([names]).collect()
                }
            };
            for (name, value) in entries {
                put(attributes, &name, AttributeValue::Text(text(&value)));
            }
        }
    }
}

/// What all parts of a file have in common.
pub struct Common<'a> {
    /// How the file is written.
    pub output: &'a OutputDesc,
    /// What is known of the rendering.
    pub info: &'a RenderInfo,
    /// The mattes.
    pub mattes: Mattes<'a>,
    /// Text attributes of layers.
    pub texts: &'a [(String, String)],
    /// The rendered part, if the file stores more around it.
    pub original: Option<IntegerBounds>,
}

/// The attributes of a part: the first has those of the whole file, since some programs read no other; every part
/// describes the mattes.
pub fn part_attributes(common: &Common, part: PartKind, first: bool, comments: &[&str]) -> LayerAttributes {
    let Common { output, info, .. } = common;
    let own = output.comments.iter().map(String::as_str).filter(|_| first);
    let lines: Vec<&str> = own.chain(comments.iter().copied()).filter(|line| !line.is_empty()).collect();
    let mut attributes = LayerAttributes {
        software_name: Some(text(concat!("Steradian ", env!("CARGO_PKG_VERSION")))),
        comments: (!lines.is_empty()).then(|| text(&lines.join("\n"))),
        owner: output.owner.as_deref().map(text),
        frames_per_second: output.frames_per_second.map(rational),
        world_to_camera: info.world_to_camera.map(flat),
        world_to_normalized_device: info.world_to_ndc.map(flat),
        original_data_window: common.original,
        ..LayerAttributes::default()
    };
    let space = if part == PartKind::Beauty { SCENE_LINEAR } else { DATA };
    put(&mut attributes, INTEROP_ID, AttributeValue::Text(text(space)));
    common.mattes.describe(&mut attributes);
    if first {
        let count = |n: u64| AttributeValue::I32(i32::try_from(n).unwrap_or(i32::MAX));
        put(&mut attributes, "samplesPerPixel", count(info.samples_per_pixel.into()));
        put(&mut attributes, "renderTimeSeconds", AttributeValue::F32(info.render_seconds as f32));
        if let Some(statistics) = &info.statistics {
            put(&mut attributes, "steradian/threads", count(statistics.threads as u64));
            put(&mut attributes, "steradian/nanSamples", count(statistics.nan_samples));
            // Rays are more than 32 bits can count.
            put(&mut attributes, "steradian/rays", AttributeValue::F64(statistics.rays as f64));
        }
        if let Some(partial) = &info.partial {
            put(&mut attributes, "steradian/partial", AttributeValue::Text(text(partial)));
        }
        if let Some(Value::Object(settings)) = &info.settings {
            let mut settings = settings.clone();
            settings.insert("output".to_owned(), serde_json::to_value(output).unwrap_or_default());
            put(&mut attributes, SETTINGS, AttributeValue::Text(text(&Value::Object(settings).to_string())));
        }
        for (name, value) in info.texts.iter().chain(common.texts) {
            put(&mut attributes, name, AttributeValue::Text(text(value)));
        }
    }
    attributes
}

fn flat(rows: [[f32; 4]; 4]) -> [f32; 16] {
    let mut flat = [0.0; 16];
    flat.copy_from_slice(rows.as_flattened());
    flat
}

/// Frames per second as OpenEXR has them: whole numbers over 1, those of television over 1001, others over 1000.
fn rational(fps: f64) -> (i32, u32) {
    let television = fps * 1.001;
    let close = |x: f64, tolerance: f64| (x - x.round()).abs() < tolerance;
    if close(fps, 1e-6) {
        (fps.round() as i32, 1)
    } else if close(television, 2e-3) {
        (television.round() as i32 * 1000, 1001)
    } else {
        ((fps * 1000.0).round() as i32, 1000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_rates_are_those_of_film_and_television() {
        assert_eq!(
            [24.0, 23.976, 29.97, 59.94, 12.5].map(rational),
            [(24, 1), (24000, 1001), (30000, 1001), (60000, 1001), (12500, 1000)]
        );
    }
}
