//! Rules about parts and windows.

use exr::compression::Compression;

use super::Fault;
use super::file::ExrFile;

pub fn windows(file: &ExrFile) -> Vec<Fault> {
    let mut faults = Vec::new();
    let first = &file.headers[0];
    for (i, header) in file.headers.iter().enumerate().skip(1) {
        let (own, shared) = (&header.own_attributes, &header.shared_attributes);
        let different = [
            (
                "data window",
                own.layer_position != first.own_attributes.layer_position || header.layer_size != first.layer_size,
            ),
            ("display window", shared.display_window != first.shared_attributes.display_window),
            ("pixel aspect ratio", shared.pixel_aspect != first.shared_attributes.pixel_aspect),
            ("line order", header.line_order != first.line_order),
        ];
        let what: Vec<&str> = different.into_iter().filter(|(_, different)| *different).map(|(what, _)| what).collect();
        if !what.is_empty() {
            faults.push(Fault::part(i, format!("another {} than part 0", what.join(" and "))));
        }
    }
    faults
}

pub fn part_names(file: &ExrFile) -> Vec<Fault> {
    let dots = file.channels().any(|channel| channel.name.contains('.'));
    if file.headers.len() < 2 || !dots {
        return Vec::new();
    }
    let view = |part: usize| &file.headers[part].own_attributes.view_name;
    let home = file.channels().find(|channel| !channel.name.contains('.')).map_or(0, |channel| channel.part);
    // A bare Z is the depth of the main layer wherever it stands.
    let bare = |name: &str| !name.contains('.') && name != "Z";
    let lost = file
        .channels()
        .filter(|channel| bare(&channel.name) && channel.part != home && view(channel.part) == view(home));
    let what = |part: usize| {
        let name = file.headers[part].own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
        format!("a bare name in the part \"{name}\", while other channels have dots")
    };
    lost.map(|channel| Fault::channel(channel.part, channel.name, what(channel.part))).collect()
}

pub fn metadata(file: &ExrFile) -> Vec<Fault> {
    let keys = |part: usize| -> Vec<String> {
        let names = file.headers[part].own_attributes.other.keys().map(ToString::to_string);
        names.filter(|name| name.starts_with("cryptomatte/") && name.ends_with("/name")).collect()
    };
    let first = keys(0);
    let mut faults = Vec::new();
    for part in 1..file.headers.len() {
        let lost = keys(part).into_iter().filter(|key| !first.contains(key));
        faults.extend(lost.map(|key| Fault::part(part, format!("{key} is not in part 0"))));
    }
    faults
}

pub fn scanline_compression(file: &ExrFile) -> Vec<Fault> {
    let slow = |compression: Compression| {
        !matches!(compression, Compression::ZIP1 | Compression::RLE | Compression::Uncompressed)
    };
    let parts = file.headers.iter().enumerate().filter(|(_, header)| slow(header.compression));
    parts.map(|(i, header)| Fault::part(i, format!("the compression is {}", header.compression))).collect()
}

pub fn several(file: &ExrFile) -> Vec<Fault> {
    let data = file.channels().any(|channel| channel.role.is_data());
    let color = file.channels().any(|channel| !channel.role.is_data());
    if file.headers.len() == 1 && data && color { vec![Fault::file("colour and data in one part")] } else { Vec::new() }
}

pub fn windows_apart(file: &ExrFile) -> Vec<Fault> {
    let apart = |position: [i32; 2], size: [usize; 2], other: [i32; 2], other_size: [usize; 2]| {
        (0..2).any(|i| {
            let [start, end] = [i64::from(position[i]), i64::from(position[i]) + size[i] as i64];
            let [other_start, other_end] = [i64::from(other[i]), i64::from(other[i]) + other_size[i] as i64];
            start >= other_end || other_start >= end
        })
    };
    let mut faults = Vec::new();
    for (i, header) in file.headers.iter().enumerate() {
        let (data, display) = (header.data_window(), header.shared_attributes.display_window);
        let pair = |v: exr::math::Vec2<i32>| [v.0, v.1];
        let size = |v: exr::math::Vec2<usize>| [v.0, v.1];
        if apart(pair(data.position), size(data.size), pair(display.position), size(display.size)) {
            faults.push(Fault::part(i, "the data window lies beside the display window"));
        }
    }
    faults
}
