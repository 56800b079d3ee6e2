//! Colour out of any EXR file.

use std::io::BufReader;
use std::path::Path;

use exr::meta::attribute::{AttributeValue, ChannelDescription, IntegerBounds};
use exr::meta::header::Header;
use exr::prelude::Vec2;

use super::metadata::{SETTINGS, text};
use crate::error::{Error, Result};
use crate::file;
use crate::file::exr_blocks::{ChannelRow, Place, allocate, read_rows};
use crate::file::exr_headers::read_headers;
use crate::film::{Crop, Image, Layer, LayerKind};

/// Reads the colour of any EXR file: bare channels R, G, B (in upper or lower case), else a layer with such channels
/// (the one with the shortest name, a "Combined" first), else Y as gray. Alpha is that of the same layer, or 1. The
/// picture is the data window; where that reaches beyond the display window, the data window is taken as the full
/// picture.
///
/// Only the channels of the colour are kept in memory.
///
/// # Errors
/// [`Error::Missing`] if the file cannot be read, [`Error::Malformed`] if it is no such picture or too large,
/// [`Error::OutOfMemory`].
pub fn read_exr(path: &Path) -> Result<Image> {
    let source = file::open(path).map_err(|e| Error::Missing { file: path.to_owned(), message: e.to_string() })?;
    let malformed = |message: String| Error::Malformed { file: path.to_owned(), message };
    let headers = read_headers(path).map_err(malformed)?;
    let (part, choice) = choose_channels(path, &headers)?;
    let header = &headers[part];
    let (mut requested, mut components) = (Vec::new(), Vec::new());
    for (component, channel) in
        choice.into_iter().enumerate().filter_map(|(component, channel)| Some((component, channel?)))
    {
        requested.push(Place { part, channel });
        components.push(component);
    }
    let mut data = allocate(path, header, 4, 1.0)?;
    let keep =
        |row: ChannelRow| row.write(data[4 * row.start + components[row.requested]..].iter_mut().step_by(4), |v| v);
    read_rows(BufReader::new(source), &headers, &requested, false, keep).map_err(|e| malformed(e.to_string()))?;
    let (size, crop) =
        windows(&header.shared_attributes.display_window, header.own_attributes.layer_position, header.layer_size);
    Ok(Image { size, crop, layers: vec![Layer::new(LayerKind::Color, data)], ..Image::default() })
}

/// The part that holds the colour, and its red, green, blue and (if there is one) alpha.
///
/// # Errors
/// [`Error::Malformed`] if no part has a colour, or it is subsampled.
pub(super) fn choose_channels(path: &Path, headers: &[Header]) -> Result<(usize, [Option<usize>; 4])> {
    let malformed = |message: String| Error::Malformed { file: path.to_owned(), message };
    let flat = headers.iter().enumerate().filter(|(_, header)| !header.deep);
    let Some((part, choice)) =
        flat.filter_map(|(part, header)| Some((part, choose_in_part(&header.channels.list)?))).next()
    else {
        let deep = if headers.iter().any(|header| header.deep) { " (deep data is unsupported)" } else { "" };
        let names: Vec<String> =
            headers.iter().flat_map(|header| &header.channels.list).map(|c| c.name.to_string()).collect();
        return Err(malformed(format!("no channels R, G and B and no Y{deep}; it has {}", names.join(", "))));
    };
    for channel in choice.into_iter().flatten().map(|channel| &headers[part].channels.list[channel]) {
        if channel.sampling != Vec2(1, 1) {
            return Err(malformed(format!("channel {} is subsampled", channel.name)));
        }
    }
    Ok((part, choice))
}

/// Red, green, blue and (if there is one) alpha.
fn choose_in_part(list: &[ChannelDescription]) -> Option<[Option<usize>; 4]> {
    let find = |name: &str| list.iter().position(|channel| channel.name == *name);
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

pub(super) fn windows(display: &IntegerBounds, position: Vec2<i32>, size: Vec2<usize>) -> ([u32; 2], Crop) {
    let [width, height] = [size.0, size.1].map(|length| u32::try_from(length).unwrap_or(u32::MAX));
    let whole = ([width, height], Crop::full([width, height]));
    let offset = [position.0.checked_sub(display.position.0), position.1.checked_sub(display.position.1)];
    let [Some(Ok(x)), Some(Ok(y))] = offset.map(|o| o.map(u32::try_from)) else { return whole };
    let [Ok(full_width), Ok(full_height)] = [display.size.0, display.size.1].map(u32::try_from) else { return whole };
    let crop = Crop { x, y, width, height };
    if crop.fits([full_width, full_height]) { ([full_width, full_height], crop) } else { whole }
}

/// The settings that a file was rendered with: what [`RenderInfo::settings`](crate::output::RenderInfo::settings) had,
/// and under `output` how it was written.
///
/// # Errors
/// [`Error::Missing`] if the file cannot be read, [`Error::Malformed`] if it is no EXR file or has no settings.
pub fn read_settings(path: &Path) -> Result<serde_json::Value> {
    file::open(path).map_err(|e| Error::Missing { file: path.to_owned(), message: e.to_string() })?;
    let malformed = |message: String| Error::Malformed { file: path.to_owned(), message };
    let headers = read_headers(path).map_err(malformed)?;
    match headers.first().and_then(|header| header.own_attributes.other.get(&text(SETTINGS))) {
        Some(AttributeValue::Text(settings)) => {
            serde_json::from_slice(settings.as_slice()).map_err(|e| malformed(format!("{SETTINGS}: {e}")))
        }
        _ => Err(malformed(format!("no attribute {SETTINGS}: Steradian did not write this file"))),
    }
}
