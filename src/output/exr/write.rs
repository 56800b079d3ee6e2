//! Writing of files: layers to channels, channels to parts.

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use exr::meta::attribute::IntegerBounds;
use exr::prelude::{AnyChannel, AnyChannels, Blocks, Encoding, ImageAttributes, LineOrder, Vec2};

use super::blocks::write_image;
use super::channels::{InterleavedLayer, LayerSamples, Region};
use super::coverage::{self, Matte};
use super::metadata::{Common, Mattes, part_attributes, text};
use super::names::{channel_name, motion_channels, plain_word};
use super::plan::{self, PartKind};

use crate::desc::{CryptoManifestDesc, ExrProfileDesc, OutputDesc};
use crate::error::Result;
use crate::film::{Crop, Identities, Image, Layer, LayerInfo, LayerKind, LayerSet};
use crate::output::color_space::REC709;
use crate::output::{RenderInfo, write_atomically};

type Part<'a> = exr::prelude::Layer<AnyChannels<LayerSamples<'a>>>;

/// Writes the picture's colour, those of `output`'s layers that it has, and the [noisy](LayerKind::Noisy) picture if
/// there is one. The display window is the picture without its overscan, the data window what was rendered. Numbers
/// beyond what 16 bits hold become their largest, 65504.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if `output` makes no sense ([`check_output`](super::check_output)),
/// [`Error::Output`](crate::Error::Output) if the file cannot be written.
pub fn write_exr(path: &Path, image: &Image, output: &OutputDesc, info: &RenderInfo) -> Result<()> {
    plan::check_output(output)?;
    let contents = Contents::new(image, output, info);
    let windows = Windows::new(image, output);
    let mattes = Mattes { mattes: &contents.mattes, file: path, manifest: output.crypto_manifest };
    if output.crypto_manifest == CryptoManifestDesc::Sidecar {
        for matte in &contents.mattes {
            let beside = path.with_file_name(mattes.sidecar(matte));
            write_atomically(&beside, |out| out.write_all(matte.manifest.as_bytes()).map_err(|e| e.to_string()))?;
        }
    }
    let common = Common { output, info, mattes, texts: &contents.texts, original: windows.original };
    let parts = parts(&contents, &common, &windows);

    let mut attributes = ImageAttributes::new(windows.display);
    attributes.chromaticities = Some(REC709);
    attributes.pixel_aspect = info.pixel_aspect.unwrap_or(1.0);
    let file = exr::prelude::Image { attributes, layer_data: parts };
    write_atomically(path, |out| write_image(&file, out))
}

/// Windows of a file.
struct Windows {
    display: IntegerBounds,
    data: IntegerBounds,
    /// What was rendered, if the data window is not the same.
    original: Option<IntegerBounds>,
    region: Region,
}

impl Windows {
    fn new(image: &Image, output: &OutputDesc) -> Self {
        let [width, height] = image.size.map(|side| side.saturating_sub(2 * image.overscan).max(1));
        let shown = Crop { x: image.overscan, y: image.overscan, width, height };
        let written = if output.uncropped { shown } else { image.crop };
        // Coordinates of a film fit: memory ends long before.
        let bounds = |crop: Crop| {
            let corner = [crop.x, crop.y].map(|x| x as i32 - image.overscan as i32);
            IntegerBounds::new(Vec2(corner[0], corner[1]), Vec2(crop.width as usize, crop.height as usize))
        };
        let original = (written != image.crop).then(|| bounds(image.crop));
        Self {
            display: bounds(shown),
            data: bounds(written),
            original,
            region: Region { available: image.crop, written },
        }
    }
}

/// What goes into a file.
struct Contents<'a> {
    layers: Vec<InterleavedLayer<'a>>,
    mattes: Vec<Matte>,
    texts: Vec<(String, String)>,
    /// Descriptions of layers, by the part that they go to.
    comments: Vec<(PartKind, &'static str)>,
}

impl<'a> Contents<'a> {
    fn new(image: &'a Image, output: &OutputDesc, info: &RenderInfo) -> Self {
        let selected: LayerSet = output.layers.iter().collect();
        let mut contents = Self { layers: Vec::new(), mattes: Vec::new(), texts: Vec::new(), comments: Vec::new() };
        for layer in image.layers.iter().filter(|layer| selected.contains(layer.kind) || layer.kind == LayerKind::Noisy)
        {
            if layer.kind == LayerKind::Motion && motion_channels(output.profile).is_some() {
                contents.add_motion(layer, output);
                continue;
            }
            let group = layer.group.as_ref().map(|group| format!("light_{}.", plain_word(group)));
            let names = match group {
                Some(prefix) => {
                    LayerInfo::of(layer.kind).channels.iter().map(|name| format!("{prefix}{name}")).collect()
                }
                None => layer.channel_names(),
            };
            contents.add(layer.kind, names, Cow::Borrowed(&layer.data), output);
        }
        if let (Some(coverage), Some(identities)) = (&image.coverage, &info.identities) {
            contents.add_covered(selected, coverage, identities, output);
        }
        contents
    }

    /// Motion as the profile's program reads it: in pixels to the right and up.
    fn add_motion(&mut self, layer: &Layer, output: &OutputDesc) {
        let Some((names, comment)) = motion_channels(output.profile) else { return };
        let data = layer.pixels().flat_map(|pixel| {
            let [x, y] = [pixel[0], -pixel[1]];
            // From the middle of the shutter interval back to its begin, and on to its end.
            let halves = [-0.5 * x, -0.5 * y, 0.5 * x, 0.5 * y];
            if names.len() == 2 { vec![x, y] } else { halves.to_vec() }
        });
        self.comments.push((PartKind::Utility, comment));
        self.layers.push(InterleavedLayer {
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            data: data.collect(),
            half: false,
        });
    }

    fn add_covered(
        &mut self,
        selected: LayerSet,
        coverage: &crate::film::Coverage,
        identities: &Identities,
        output: &OutputDesc,
    ) {
        for layer in selected.iter().filter(|layer| matches!(layer.source, crate::film::LayerSource::Coverage)) {
            if let Some(mut matte) = coverage::matte(layer.kind, coverage, identities, plan::crypto_depth(output)) {
                self.add(layer.kind, matte.channels.clone(), Cow::Owned(std::mem::take(&mut matte.data)), output);
                self.mattes.push(matte);
            } else if let Some(numbers) = coverage::numbers(layer.kind, coverage, identities) {
                let names = layer.channels.iter().map(|name| (*name).to_owned()).collect();
                self.add(layer.kind, names, Cow::Owned(numbers.data), output);
                self.texts.push((format!("steradian/{}", layer.name), numbers.names));
            }
        }
    }

    fn add(&mut self, kind: LayerKind, names: Vec<String>, data: Cow<'a, [f32]>, output: &OutputDesc) {
        let part = names.first().map_or(PartKind::Beauty, |name| PartKind::of(crate::output::role::Role::of(name)));
        if !self.comments.contains(&(part, LayerInfo::of(kind).comment)) {
            self.comments.push((part, LayerInfo::of(kind).comment));
        }
        let names = names.iter().map(|name| channel_name(output.profile, name)).collect();
        self.layers.push(InterleavedLayer { names, data, half: plan::is_half(output, kind) });
    }
}

/// The parts of a file, the picture first.
fn parts<'a>(
    contents: &'a Contents,
    common: &Common,
    windows: &Windows,
) -> exr::prelude::Layers<AnyChannels<LayerSamples<'a>>> {
    let several = common.output.profile == ExrProfileDesc::Multipart;
    let mut by_part: [Vec<AnyChannel<LayerSamples>>; 3] = Default::default();
    for channel in contents.layers.iter().flat_map(|layer| layer.channels(windows.region)) {
        let part = if several { PartKind::of(channel.role) } else { PartKind::Beauty };
        by_part[part as usize].push(channel.into());
    }
    let mut parts = exr::prelude::Layers::new();
    for (channels, (kind, name)) in by_part.into_iter().zip(PartKind::ALL).filter(|(channels, _)| !channels.is_empty())
    {
        let comments: Vec<&str> = contents
            .comments
            .iter()
            .filter(|(part, _)| !several || *part == kind)
            .map(|(_, comment)| *comment)
            .collect();
        let mut attributes = part_attributes(common, kind, parts.is_empty(), &comments);
        attributes.layer_position = windows.data.position;
        attributes.layer_name = several.then(|| text(name));
        let compression = plan::compression(common.output, kind);
        let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        parts.push(Part::new(
            windows.data.size,
            attributes,
            encoding,
            AnyChannels::sort(channels.into_iter().collect()),
        ));
    }
    parts
}
