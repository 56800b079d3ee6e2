//! OpenEXR: one part, the colour as R, G, B, A and every other layer as `layer.channel`.

use std::path::Path;

use ::exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, Text};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatImage, FlatSamples, ImageAttributes, LayerAttributes, LineOrder,
    ReadChannels, ReadLayers, Vec2, WritableImage, f16, read,
};

use super::{RenderInfo, write_atomically};
use crate::desc::{CompressionDesc, OutputDesc, PixelTypeDesc};
use crate::error::{Error, Result};
use crate::film::{Crop, Image, Layer, LayerKind, LayerSet};

/// Rec.709 primaries and white, as OpenEXR assumes without the attribute.
const REC709: Chromaticities =
    Chromaticities { red: Vec2(0.64, 0.33), green: Vec2(0.30, 0.60), blue: Vec2(0.15, 0.06), white: Vec2(0.3127, 0.3290) };

/// Writes the picture's colour, those of `output`'s layers that it has, and the [noisy](LayerKind::Noisy) picture if there is one. The display window is the full picture, the data window the
/// crop. Numbers beyond what 16 bits hold become their largest, 65504.
///
/// # Errors
/// [`Error::Output`] if the file cannot be written.
pub fn write_exr(path: &Path, image: &Image, output: &OutputDesc, info: &RenderInfo) -> Result<()> {
    let wanted: LayerSet = output.layers.iter().collect();
    let layers: Vec<&Layer> = image.layers.iter().filter(|layer| wanted.contains(layer.kind) || layer.kind == LayerKind::Noisy).collect();
    let channels = layers.iter().flat_map(|layer| channels(layer, output.pixel_type)).collect();

    let encoding = Encoding { compression: compression(output.compression), blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = Vec2(image.crop.width as usize, image.crop.height as usize);
    let attributes = layer_attributes(image, &layers, info);
    let layer = ::exr::prelude::Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let mut file = ::exr::prelude::Image::from_layer(layer);
    let full = Vec2(image.size[0] as usize, image.size[1] as usize);
    file.attributes = ImageAttributes::new(IntegerBounds::new(Vec2(0, 0), full));
    file.attributes.chromaticities = Some(REC709);
    file.attributes.pixel_aspect = info.pixel_aspect.unwrap_or(1.0);
    write_atomically(path, |out| file.write().to_buffered(out).map_err(|e| e.to_string()))
}

fn channels(layer: &Layer, pixel_type: PixelTypeDesc) -> impl Iterator<Item = AnyChannel<FlatSamples>> + '_ {
    let half = pixel_type == PixelTypeDesc::Half && !layer.kind.info().always_float;
    layer.channel_names().into_iter().enumerate().map(move |(i, name)| {
        let samples =
            if half { FlatSamples::F16(layer.channel(i).map(to_half).collect()) } else { FlatSamples::F32(layer.channel(i).collect()) };
        AnyChannel::new(name.as_str(), samples)
    })
}

fn to_half(x: f32) -> f16 {
    f16::from_f32(x.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

fn compression(desc: CompressionDesc) -> Compression {
    match desc {
        CompressionDesc::Zip => Compression::ZIP16,
        CompressionDesc::Zips => Compression::ZIP1,
        CompressionDesc::Piz => Compression::PIZ,
        CompressionDesc::Rle => Compression::RLE,
        CompressionDesc::None => Compression::Uncompressed,
    }
}

fn layer_attributes(image: &Image, layers: &[&Layer], info: &RenderInfo) -> LayerAttributes {
    let comments: Vec<&str> = layers.iter().map(|layer| layer.kind.info().comment).filter(|comment| !comment.is_empty()).collect();
    // Coordinates of a film fit: memory ends long before.
    let layer_position = Vec2(image.crop.x as i32, image.crop.y as i32);
    let mut attributes = LayerAttributes { layer_position, ..LayerAttributes::default() };
    attributes.software_name = Some(Text::from(concat!("Steradian ", env!("CARGO_PKG_VERSION"))));
    attributes.comments = if comments.is_empty() { None } else { Text::new_or_none(comments.join("\n")) };
    attributes.world_to_camera = info.world_to_camera.map(|rows| {
        let mut flat = [0.0; 16];
        flat.iter_mut().zip(rows.as_flattened()).for_each(|(to, from)| *to = *from);
        flat
    });
    let samples = i32::try_from(info.samples_per_pixel).unwrap_or(i32::MAX);
    attributes.other.insert(Text::from("samplesPerPixel"), AttributeValue::I32(samples));
    attributes.other.insert(Text::from("renderTimeSeconds"), AttributeValue::F32(info.render_seconds as f32));
    if let Some(partial) = &info.partial {
        attributes.other.insert(Text::from("steradian/partial"), AttributeValue::Text(Text::from(partial.as_str())));
    }
    for (name, value) in &info.texts {
        if let (Some(name), Some(value)) = (Text::new_or_none(name), Text::new_or_none(value)) {
            attributes.other.insert(name, AttributeValue::Text(value));
        }
    }
    attributes
}

/// Reads the colour of any EXR file: bare channels R, G, B (in upper or lower case), else a layer with such channels (the one with the
/// shortest name, a "Combined" first), else Y as gray. Alpha is that of the same layer, or 1. The picture is the data window; where that
/// reaches beyond the display window, the data window stands for the full picture.
///
/// # Errors
/// [`Error::Missing`] if the file cannot be read, [`Error::Malformed`] if it is no such picture.
pub fn read_exr(path: &Path) -> Result<Image> {
    std::fs::File::open(path).map_err(|e| Error::Missing { file: path.to_owned(), message: e.to_string() })?;
    let malformed = |message: String| Error::Malformed { file: path.to_owned(), message };
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let file: FlatImage = reader.from_file(path).map_err(|e| malformed(e.to_string()))?;
    for part in &file.layer_data {
        let Some(choice) = choose_channels(&part.channel_data.list) else { continue };
        let pixels = part.size.0 * part.size.1;
        let mut data = vec![1.0; pixels * 4];
        for (i, channel) in choice.iter().enumerate() {
            let Some(channel) = channel else { continue };
            if channel.sampling != Vec2(1, 1) {
                return Err(malformed(format!("channel {} is subsampled", channel.name)));
            }
            for (to, value) in data.iter_mut().skip(i).step_by(4).zip(channel.sample_data.values_as_f32()) {
                *to = value;
            }
        }
        let (size, crop) = windows(&file.attributes.display_window, part.attributes.layer_position, part.size);
        return Ok(Image { size, crop, layers: vec![Layer::new(LayerKind::Color, data)], ..Image::default() });
    }
    let names: Vec<String> = file.layer_data.iter().flat_map(|part| &part.channel_data.list).map(|c| c.name.to_string()).collect();
    Err(malformed(format!("there are no channels R, G and B and no Y; it has {}", names.join(", "))))
}

type Channel = AnyChannel<FlatSamples>;

/// Red, green, blue and (if there is one) alpha.
fn choose_channels(list: &[Channel]) -> Option<[Option<&Channel>; 4]> {
    let find = |name: &str| list.iter().find(|channel| channel.name == *name);
    let layer = |prefix: &str, names: [&str; 4]| {
        let [r, g, b, a] = names.map(|name| find(&format!("{prefix}{name}")));
        (r.is_some() && g.is_some() && b.is_some()).then_some([r, g, b, a])
    };
    let mut prefixes: Vec<String> =
        list.iter().filter_map(|c| c.name.to_string().strip_suffix(".R").map(|prefix| format!("{prefix}."))).collect();
    prefixes.sort_by_key(|prefix| (!prefix.contains("ombined"), prefix.len()));
    layer("", ["R", "G", "B", "A"])
        .or_else(|| layer("", ["r", "g", "b", "a"]))
        .or_else(|| prefixes.iter().find_map(|prefix| layer(prefix, ["R", "G", "B", "A"])))
        .or_else(|| find("Y").map(|y| [Some(y), Some(y), Some(y), find("A")]))
}

fn windows(display: &IntegerBounds, position: Vec2<i32>, size: Vec2<usize>) -> ([u32; 2], Crop) {
    let [width, height] = [size.0, size.1].map(|length| u32::try_from(length).unwrap_or(u32::MAX));
    let whole = ([width, height], Crop::full([width, height]));
    let offset = [position.0.checked_sub(display.position.0), position.1.checked_sub(display.position.1)];
    let [Some(Ok(x)), Some(Ok(y))] = offset.map(|o| o.map(u32::try_from)) else { return whole };
    let [Ok(full_width), Ok(full_height)] = [display.size.0, display.size.1].map(u32::try_from) else { return whole };
    let crop = Crop { x, y, width, height };
    if crop.fits([full_width, full_height]) { ([full_width, full_height], crop) } else { whole }
}

#[cfg(test)]
#[path = "exr_tests.rs"]
mod tests;
