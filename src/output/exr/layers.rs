//! All layers of any EXR file, for viewers.

use std::io::BufReader;
use std::path::Path;

use exr::meta::header::Header;
use exr::prelude::Vec2;

use super::read::{choose_channels, windows};
use crate::error::{Error, Result};
use crate::file;
use crate::file::exr_blocks::{ChannelRow, Place, allocate, check_memory, read_rows};
use crate::file::exr_headers::read_headers;
use crate::film::Crop;

/// Channels that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedLayer {
    /// The full names of its channels: red, green and blue, or x, y and z in this order.
    pub names: Vec<String>,
    /// Row by row from the top; a pixel's channels lie side by side.
    pub data: Vec<f32>,
}

/// The layers of a file, which have one size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrLayers {
    /// Width and height of the full picture.
    pub size: [u32; 2],
    /// The part that the layers hold.
    pub crop: Crop,
    /// The first is the colour, as [`read_exr`](super::read_exr) chooses it.
    pub layers: Vec<NamedLayer>,
}

/// Reads every layer of a file that [`read_exr`](super::read_exr) accepts, in 32 bits. Channels are grouped by what
/// their names have before the last dot. Subsampled channels, deep parts, and parts of another data window than the
/// colour's are left out.
///
/// # Errors
/// As [`read_exr`](super::read_exr).
pub fn read_exr_layers(path: &Path) -> Result<ExrLayers> {
    let source = file::open(path).map_err(|e| Error::Missing { file: path.to_owned(), message: e.to_string() })?;
    let malformed = |message: String| Error::Malformed { file: path.to_owned(), message };
    let headers = read_headers(path).map_err(malformed)?;
    let (part, color) = choose_channels(path, &headers)?;
    let header = &headers[part];
    let mut color: Vec<Place> = color.into_iter().flatten().map(|channel| Place { part, channel }).collect();
    // Gray is red, green and blue at once.
    color.dedup();
    let groups = groups(&headers, part, &color);
    let channels: usize = groups.iter().map(Vec::len).sum();
    check_memory(path, std::slice::from_ref(header), channels * size_of::<f32>())?;
    let mut layers = Vec::new();
    for group in &groups {
        let names = group.iter().map(|place| full_name(&headers, part, *place)).collect();
        layers.push(NamedLayer { names, data: allocate(path, header, group.len(), 0.0)? });
    }
    let requested: Vec<Place> = groups.iter().flatten().copied().collect();
    // Where each channel requested goes: its layer and its place there.
    let places: Vec<(usize, usize)> =
        groups.iter().enumerate().flat_map(|(layer, group)| (0..group.len()).map(move |i| (layer, i))).collect();
    let keep = |row: ChannelRow| {
        let (layer, component) = places[row.requested];
        let NamedLayer { names, data } = &mut layers[layer];
        row.write(data[names.len() * row.start + component..].iter_mut().step_by(names.len()), |v| v);
    };
    read_rows(BufReader::new(source), &headers, &requested, false, keep).map_err(|e| malformed(e.to_string()))?;
    let (size, crop) =
        windows(&header.shared_attributes.display_window, header.own_attributes.layer_position, header.layer_size);
    Ok(ExrLayers { size, crop, layers })
}

/// The name of a channel; one of another part than the colour's begins with the part's name.
fn full_name(headers: &[Header], color_part: usize, place: Place) -> String {
    let header = &headers[place.part];
    let name = header.channels.list[place.channel].name.to_string();
    match &header.own_attributes.layer_name {
        Some(part) if place.part != color_part && !name.starts_with(&format!("{part}.")) => format!("{part}.{name}"),
        _ => name,
    }
}

/// The channels that can be shown, those that belong together in one group; the colour is the first group.
fn groups(headers: &[Header], color_part: usize, color: &[Place]) -> Vec<Vec<Place>> {
    let window = |header: &Header| (header.layer_size, header.own_attributes.layer_position);
    let mut groups: Vec<(String, Vec<Place>)> = vec![(String::new(), color.to_vec())];
    for (part, header) in headers.iter().enumerate() {
        if header.deep || window(header) != window(&headers[color_part]) {
            continue;
        }
        for (channel, description) in header.channels.list.iter().enumerate() {
            let place = Place { part, channel };
            if description.sampling != Vec2(1, 1) || color.contains(&place) {
                continue;
            }
            let name = full_name(headers, color_part, place);
            // Without a dot a channel is alone.
            let key = format!("{part}/{}", name.rsplit_once('.').map_or(name.as_str(), |(layer, _)| layer));
            match groups[1..].iter_mut().find(|(known, _)| *known == key) {
                Some((_, group)) => group.push(place),
                None => groups.push((key, vec![place])),
            }
        }
    }
    let rank = |place: &Place| {
        let name = headers[place.part].channels.list[place.channel].name.to_string();
        let last = name.rsplit('.').next().unwrap_or_default().to_ascii_uppercase();
        // Files have the channels in alphabetical order.
        ["R", "G", "B", "A", "X", "Y", "Z", "W"].iter().position(|known| last == *known).unwrap_or(8)
    };
    groups.iter_mut().skip(1).for_each(|(_, group)| group.sort_by_key(rank));
    groups.into_iter().map(|(_, group)| group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    use exr::meta::attribute::IntegerBounds;
    use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, LayerAttributes, WritableImage};

    /// Channels as other programs name them, in two parts and with a window of their own.
    #[test]
    fn all_layers_of_any_file_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let part = |name: &str, size: (usize, usize), names: &[&str]| {
            let channel = |(i, name): (usize, &&str)| {
                let values = (0..size.0 * size.1).map(|pixel| (10 * pixel + i) as f32).collect();
                AnyChannel::new(*name, FlatSamples::F32(values))
            };
            let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
            exr::prelude::Layer::new(size, LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
        };
        let color =
            ["View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Depth.Z", "View.Vector.Y", "View.Vector.X"];
        let parts = [part("main", (2, 1), &color), part("id", (2, 1), &["U"]), part("small", (1, 1), &["V"])];
        let image = exr::prelude::Image::from_layers(
            exr::prelude::ImageAttributes::new(IntegerBounds::from_dimensions((2, 1))),
            exr::prelude::Layers::from_iter(parts),
        );
        image.write().to_file(&path).unwrap();
        let file = read_exr_layers(&path).unwrap();
        assert_eq!((file.size, file.crop), ([2, 1], Crop::full([2, 1])));
        let found: Vec<(String, &[f32])> = file.layers.iter().map(|l| (l.names.join(" "), &l.data[..])).collect();
        let expected: [(&str, &[f32]); 4] = [
            ("View.Combined.R View.Combined.G View.Combined.B", &[0.0, 1.0, 2.0, 10.0, 11.0, 12.0]),
            ("View.Depth.Z", &[3.0, 13.0]),
            ("View.Vector.X View.Vector.Y", &[5.0, 4.0, 15.0, 14.0]),
            ("id.U", &[0.0, 10.0]),
        ];
        assert_eq!(found, expected.map(|(names, data)| (names.to_owned(), data)));
        // Gray is one channel.
        let gray = exr::prelude::Image::from_layer(part("gray", (1, 1), &["A", "Y"]));
        gray.write().to_file(&path).unwrap();
        let file = read_exr_layers(&path).unwrap();
        assert_eq!(
            (&file.layers[0].names[..], &file.layers[0].data[..]),
            (&["Y", "A"].map(str::to_owned)[..], &[1.0, 0.0][..])
        );
    }
}
