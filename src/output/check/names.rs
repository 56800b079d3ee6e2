//! Rules about the names of channels.

use std::collections::BTreeMap;

use super::Fault;
use super::file::ExrFile;
use crate::output::role::Role;

/// The longest name that Blender keeps.
const LONGEST: usize = 64;
/// The most channels of a pass in Blender.
const MOST_CHANNELS: usize = 24;
/// Passes that Blender 5 renamed.
const OLD_PASSES: &[(&str, &str)] = &[
    ("DiffDir", "Diffuse Direct"),
    ("DiffInd", "Diffuse Indirect"),
    ("DiffCol", "Diffuse Color"),
    ("GlossDir", "Glossy Direct"),
    ("GlossInd", "Glossy Indirect"),
    ("GlossCol", "Glossy Color"),
    ("TransDir", "Transmission Direct"),
    ("TransInd", "Transmission Indirect"),
    ("TransCol", "Transmission Color"),
    ("VolumeDir", "Volume Direct"),
    ("VolumeInd", "Volume Indirect"),
    ("IndexOB", "Object Index"),
    ("IndexMA", "Material Index"),
    ("Emit", "Emission"),
    ("Env", "Environment"),
    ("AO", "Ambient Occlusion"),
];

/// One fault for each channel whose name `what` finds something in.
fn each(file: &ExrFile, what: impl Fn(&str) -> Option<String>) -> Vec<Fault> {
    file.channels()
        .filter_map(|channel| what(&channel.name).map(|what| Fault::channel(channel.part, channel.name, what)))
        .collect()
}

pub fn dots(file: &ExrFile) -> Vec<Fault> {
    each(file, |name| {
        let dots = name.matches('.').count();
        (dots > 1).then(|| format!("{dots} dots; Nuke makes {} of it", nuke_name(name)))
    })
}

pub fn characters(file: &ExrFile) -> Vec<Fault> {
    each(file, |name| {
        let strange = name.chars().find(|c| !c.is_ascii_alphanumeric() && !"._".contains(*c))?;
        Some(format!("the character {strange:?}; Nuke makes {} of it", nuke_name(name)))
    })
}

pub fn leading_digits(file: &ExrFile) -> Vec<Fault> {
    each(file, |name| {
        let digit = name.split('.').any(|piece| piece.starts_with(|c: char| c.is_ascii_digit()));
        digit.then(|| format!("a piece of the name begins with a digit; Nuke makes {} of it", nuke_name(name)))
    })
}

pub fn main_aliases(file: &ExrFile) -> Vec<Fault> {
    each(file, |name| name.starts_with("Ci.").then(|| "the layer Ci".to_owned()))
}

/// Channels of one name, or that have one name once a reader has changed it.
fn collisions(file: &ExrFile, key: impl Fn(usize, &str) -> String) -> Vec<Fault> {
    let mut seen: BTreeMap<String, String> = BTreeMap::new();
    let mut faults = Vec::new();
    for channel in file.channels() {
        let view =
            file.headers[channel.part].own_attributes.view_name.as_ref().map(ToString::to_string).unwrap_or_default();
        let read = key(channel.part, &channel.name);
        match seen.get(&format!("{view}/{read}")) {
            Some(other) => {
                let what = format!("it falls together with {other}: both are read as {read}");
                faults.push(Fault::channel(channel.part, channel.name, what));
            }
            None => {
                seen.insert(format!("{view}/{read}"), channel.name);
            }
        }
    }
    faults
}

pub fn nuke_collisions(file: &ExrFile) -> Vec<Fault> {
    let dots = file.channels().any(|channel| channel.name.contains('.'));
    collisions(file, |part, name| if dots { nuke_name(name) } else { format!("part {part}: {}", nuke_name(name)) })
}

pub fn blender_collisions(file: &ExrFile) -> Vec<Fault> {
    let one_part = file.headers.len() == 1;
    let lower = |part: usize, name: &str| {
        let name = name.to_lowercase();
        if one_part { name } else { format!("part {part}: {name}") }
    };
    collisions(file, lower)
}

/// What Nuke makes of a name: at most three pieces without leading digits, all but the last joined to the layer's name.
fn nuke_name(name: &str) -> String {
    let clean = |piece: &str| -> String {
        let piece = piece.trim_start_matches(|c: char| c.is_ascii_digit());
        piece.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
    };
    let pieces: Vec<String> = name.splitn(3, '.').map(clean).collect();
    let Some((last, layer)) = pieces.split_last() else { return String::new() };
    let channel = match last.as_str() {
        "R" | "r" | "Red" | "RED" => "red",
        "G" | "g" | "Green" | "GREEN" => "green",
        "B" | "b" | "Blue" | "BLUE" => "blue",
        "A" | "a" | "Alpha" | "ALPHA" => "alpha",
        other => other,
    };
    let layer = layer.join("_");
    let layer = match (layer.as_str(), channel) {
        ("", "red" | "green" | "blue" | "alpha") => "rgba",
        ("", _) => "other",
        (layer, _) => layer,
    };
    format!("{layer}.{channel}")
}

pub fn beauty(file: &ExrFile) -> Vec<Fault> {
    let has = |names: [&str; 2]| file.channels().any(|channel| names.contains(&channel.name.as_str()));
    let color = file.channels().any(|channel| channel.role == Role::Color);
    let bare = [["R", "r"], ["G", "g"], ["B", "b"]].into_iter().all(has) || has(["Y", "y"]);
    if color && !bare { vec![Fault::file("no bare channels R, G and B")] } else { Vec::new() }
}

pub fn length(file: &ExrFile) -> Vec<Fault> {
    each(file, |name| (name.len() > LONGEST).then(|| format!("{} bytes", name.len())))
}

/// The channels of each pass as Blender sees it: all before the last dot. Bare letters are passes of their own.
fn passes(file: &ExrFile) -> BTreeMap<(usize, String), Vec<String>> {
    let mut passes: BTreeMap<(usize, String), Vec<String>> = BTreeMap::new();
    for channel in file.channels() {
        if let Some((pass, suffix)) = channel.name.rsplit_once('.') {
            passes.entry((channel.part, pass.to_owned())).or_default().push(suffix.to_uppercase());
        }
    }
    passes
}

pub fn pass_size(file: &ExrFile) -> Vec<Fault> {
    let large = passes(file).into_iter().filter(|(_, suffixes)| suffixes.len() > MOST_CHANNELS);
    large.map(|((part, pass), suffixes)| Fault::channel(part, pass, format!("{} channels", suffixes.len()))).collect()
}

pub fn pass_channels(file: &ExrFile) -> Vec<Fault> {
    let known = |suffixes: &Vec<String>| {
        let mut sorted = suffixes.clone();
        sorted.sort();
        ["BGR", "ABGR", "XYZ", "WXYZ", "AUV"].contains(&sorted.concat().as_str())
    };
    let odd = passes(file).into_iter().filter(|(_, suffixes)| matches!(suffixes.len(), 3 | 4) && !known(suffixes));
    odd.map(|((part, pass), suffixes)| Fault::channel(part, pass, format!("the channels {}", suffixes.join(", "))))
        .collect()
}

pub fn depth(file: &ExrFile) -> Vec<Fault> {
    let has = |part: usize, name: &str| file.channels().any(|channel| channel.part == part && channel.name == name);
    (0..file.headers.len())
        .filter(|&part| ["X", "Y", "Z"].iter().all(|name| has(part, name)))
        .map(|part| Fault::channel(part, "Z", "bare X, Y and Z side by side"))
        .collect()
}

pub fn old_passes(file: &ExrFile) -> Vec<Fault> {
    each(file, |name| {
        let pass = name.rsplit('.').nth(1)?;
        let (_, new) = OLD_PASSES.iter().find(|(old, _)| *old == pass)?;
        Some(format!("the pass {pass} is called {new} since Blender 5"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_nuke_reads_them() {
        for (name, read) in [
            ("R", "rgba.red"),
            ("Z", "other.Z"),
            ("albedo.R", "albedo.red"),
            ("beauty.lights.key.R", "beauty_lights.key_R"),
            ("1st-hit.2d.X", "st_hit_d.X"),
            ("N.red", "N.red"),
        ] {
            assert_eq!(nuke_name(name), read);
        }
    }
}
