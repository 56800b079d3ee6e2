//! Denoising of EXR files, anyone's: everything that is not denoised stays as it is.

use std::path::Path;

use ::exr::meta::attribute::{AttributeValue, Text};
use ::exr::prelude::{AnyChannel, FlatImage, FlatSamples, ReadChannels, ReadLayers, f16, read};

use super::layers::{Layers, Rgb};
use super::oidn::Triple;
use super::prepared::Prepared;
use super::{Denoiser, Report};
use crate::error::{Error, Result};
use crate::file::exr_blocks::{Place, check_memory};
use crate::file::exr_headers::read_headers;
use crate::file::{self, write_atomically};
use crate::film::{LayerInfo, LayerSource};
use crate::output::write_image;

/// Names of layers that hold albedo, in lower case, the best first: Steradian's, then those of Blender, pbrt, Mitsuba.
const ALBEDO: [&str; 4] = ["feature_albedo", "denoising albedo", "albedo", "diffuse_albedo"];

/// The same for normals. Where a file has two kinds, the shading normals are the better ones.
const NORMAL: [&str; 7] = ["feature_normal", "denoising normal", "ns", "n", "normal", "sh_normal", "nn"];

/// How names of layers of light groups begin.
const LIGHT_GROUP: &str = "light_";

/// How far the parts' sum may be from the picture for them to be taken for its parts, of the picture's sum: 16-bit
/// numbers round.
const SUM_TOLERANCE: f64 = 0.01;

/// Bytes a pixel for denoising beside the file: albedo, normals, colour before and after, and the original colour, of
/// three floats each.
const WORK_BYTES: usize = 5 * 12;

/// What to do with a file.
#[derive(Clone, Debug, Default)]
pub struct FileOptions {
    /// The layer that holds the albedo, by its name before the dot; found by its name if not given.
    pub albedo: Option<String>,
    /// The layer that holds the normals.
    pub normal: Option<String>,
    /// Use neither.
    pub without_features: bool,
}

/// Denoises the colour of an EXR file and writes all of the file to `output`, with the original colour as layer
/// `noisy`. Layers of light groups (`light_NAME`) and of kinds of light (`diffuse_direct` and so on) that add up to the
/// colour are denoised so that they still do; all other layers and attributes stay as they are.
///
/// # Errors
/// [`Error::Missing`] if the file cannot be read; [`Error::Malformed`] if it has no colour or not the layers named, is
/// denoised already, or cannot be kept whole (deep data); [`Error::Output`] if `output` cannot be written;
/// [`Error::OutOfMemory`].
pub fn denoise_file(denoiser: &Denoiser, input: &Path, output: &Path, options: &FileOptions) -> Result<Report> {
    let source = file::open(input).map_err(|e| Error::Missing { file: input.to_owned(), message: e.to_string() })?;
    let malformed = |message: String| Error::Malformed { file: input.to_owned(), message };
    check_memory(input, &read_headers(input).map_err(malformed)?, WORK_BYTES)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let mut file: FlatImage = reader.from_unbuffered(source).map_err(|e| malformed(e.to_string()))?;
    let plan = Plan::new(&file, options).map_err(malformed)?;
    let report = plan.run(denoiser, &mut file)?;
    write_atomically(output, |out| write_image(&file, out))?;
    Ok(report)
}

/// Which channels are what.
struct Plan {
    /// The picture's colour, and the name before its channels, with the dot.
    color: Rgb,
    prefix: String,
    alpha: Option<Place>,
    albedo: Option<Rgb>,
    normal: Option<Rgb>,
    /// Sets of layers that add up to the colour, with their names.
    sets: Vec<Vec<(String, Rgb)>>,
    notes: Vec<String>,
}

impl Plan {
    fn new(file: &FlatImage, options: &FileOptions) -> Result<Self, String> {
        let layers = Layers::new(file);
        let known: Vec<&str> = ALBEDO.iter().chain(&NORMAL).copied().collect();
        let (prefix, color) = layers.picture(&known)?;
        let alpha = layers.alpha(&prefix, color);
        if layers.all_of(color).any(|(name, _)| name == format!("{prefix}noisy")) {
            return Err("it is denoised already: it has a layer noisy".to_owned());
        }
        let mut notes = Vec::new();
        let feature = |named: &Option<String>, names: &[&str]| match named {
            _ if options.without_features => Ok(None),
            Some(name) => layers.named(&[&name.to_lowercase()], color)?.map(Some).ok_or_else(|| layers.no_layer(name)),
            None => layers.named(names, color),
        };
        let (albedo, normal) = (feature(&options.albedo, &ALBEDO)?, feature(&options.normal, &NORMAL)?);
        match (albedo, normal) {
            (None, _) if options.without_features => {}
            (None, None) => {
                notes.push("no layers of albedo and normals; with them more detail survives".to_owned());
            }
            (None, Some(_)) => notes.push("no layer of albedo; normals without it are not used".to_owned()),
            _ => {}
        }
        let last = |name: &str| name.rsplit('.').next().unwrap_or(name).to_lowercase();
        let groups: Vec<_> = layers.all_of(color).filter(|(name, _)| last(name).starts_with(LIGHT_GROUP)).collect();
        let is_kind = |name: &str| {
            LayerInfo::ALL.iter().any(|info| matches!(info.source, LayerSource::LightAov(_)) && info.name == last(name))
        };
        let kinds: Vec<_> = layers.all_of(color).filter(|(name, _)| is_kind(name)).collect();
        let mut sets = Vec::new();
        for (set, what) in
            [(groups, "light groups"), (kinds, "kinds of light")].into_iter().filter(|(set, _)| !set.is_empty())
        {
            if adds_up(file, color, &set) {
                sets.push(set);
            } else {
                notes.push(format!("the {what} do not add up to the picture and stay as they are"));
            }
        }
        Ok(Self { color, prefix, alpha, albedo, normal, sets, notes })
    }

    fn run(&self, denoiser: &Denoiser, file: &mut FlatImage) -> Result<Report> {
        let size = file.layer_data[self.color[0].part].size;
        let [albedo, normal] = [self.albedo, self.normal].map(|layer| layer.map(|layer| pixels(file, layer)));
        let mut prepared = Prepared::new(denoiser, [size.0, size.1], albedo, normal)?;
        let total = prepared.picture("color", pixels(file, self.color))?;
        let mut results = Vec::new();
        for set in &self.sets {
            let names: Vec<String> = set.iter().map(|(name, _)| name.clone()).collect();
            let parts = prepared.parts(&total, &names, set.iter().map(|(_, layer)| pixels(file, *layer)).collect())?;
            results.extend(set.iter().map(|(_, layer)| *layer).zip(parts));
        }
        let alpha = self.alpha.map(|place| Ok((place, prepared.alpha(&values(file, place))?))).transpose()?;

        let original = self.original(file);
        results.push((self.color, total));
        for (layer, pixels) in results {
            for (channel, place) in layer.into_iter().enumerate() {
                set_values(file, place, pixels.iter().map(|pixel| pixel[channel]));
            }
        }
        if let Some((place, alpha)) = alpha {
            set_values(file, place, alpha.into_iter());
        }
        // Channels are in order of their names in every file; until here their places had to stay.
        let channels = &mut file.layer_data[self.color[0].part].channel_data.list;
        channels.extend(original);
        channels.sort_by(|a, b| a.name.as_slice().cmp(b.name.as_slice()));
        let mut report = prepared.finish();
        report.notes.clone_from(&self.notes);
        let attributes = &mut file.layer_data[self.color[0].part].attributes;
        attributes
            .other
            .insert(Text::from(Report::ATTRIBUTE), AttributeValue::Text(Text::from(report.attribute().as_str())));
        Ok(report)
    }

    /// The colour and alpha as they are, as layer `noisy`.
    fn original(&self, file: &FlatImage) -> Vec<AnyChannel<FlatSamples>> {
        let channels = &file.layer_data[self.color[0].part].channel_data.list;
        let places = self.color.iter().chain(&self.alpha).zip(["R", "G", "B", "A"]);
        let name = |letter| Text::from(format!("{}noisy.{letter}", self.prefix).as_str());
        places.map(|(place, letter)| AnyChannel { name: name(letter), ..channels[place.channel].clone() }).collect()
    }
}

/// Whether layers add up to the picture, but for rounding; pixels that are not finite are passed over.
fn adds_up(file: &FlatImage, color: Rgb, parts: &[(String, Rgb)]) -> bool {
    let mut difference = pixels(file, color);
    let size: f64 = difference.as_flattened().iter().filter(|v| v.is_finite()).map(|v| f64::from(v.abs())).sum();
    for (_, part) in parts {
        for (difference, part) in difference.as_flattened_mut().iter_mut().zip(pixels(file, *part).as_flattened()) {
            *difference -= part;
        }
    }
    let left: f64 = difference.as_flattened().iter().filter(|v| v.is_finite()).map(|v| f64::from(v.abs())).sum();
    left <= SUM_TOLERANCE * size
}

fn values(file: &FlatImage, place: Place) -> Vec<f32> {
    file.layer_data[place.part].channel_data.list[place.channel].sample_data.values_as_f32().collect()
}

fn pixels(file: &FlatImage, layer: Rgb) -> Vec<Triple> {
    let [r, g, b] =
        layer.map(|place| file.layer_data[place.part].channel_data.list[place.channel].sample_data.values_as_f32());
    r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect()
}

/// Replaces a channel's numbers and keeps their type.
fn set_values(file: &mut FlatImage, place: Place, values: impl Iterator<Item = f32>) {
    let samples = &mut file.layer_data[place.part].channel_data.list[place.channel].sample_data;
    *samples = match samples {
        FlatSamples::F16(_) => {
            FlatSamples::F16(values.map(|v| f16::from_f32(v.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))).collect())
        }
        FlatSamples::F32(_) | FlatSamples::U32(_) => FlatSamples::F32(values.collect()),
    };
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
