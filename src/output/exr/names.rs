//! Names of channels for the programs that read them.

use crate::desc::ExrProfileDesc;

/// Steradian's layers and Blender's passes. Others keep their names, since Blender has none for them.
const BLENDER_PASSES: &[(&str, &str)] = &[
    ("N", "Normal"),
    ("P", "Position"),
    ("uv", "UV"),
    ("diffuse_direct", "Diffuse Direct"),
    ("diffuse_indirect", "Diffuse Indirect"),
    ("specular_direct", "Glossy Direct"),
    ("specular_indirect", "Glossy Indirect"),
    ("transmission_direct", "Transmission Direct"),
    ("transmission_indirect", "Transmission Indirect"),
    ("volume_direct", "Volume Direct"),
    ("volume_indirect", "Volume Indirect"),
    ("emission", "Emission"),
    ("background", "Environment"),
    ("noisy", "Noisy Image"),
    ("feature_albedo", "Denoising Albedo"),
    ("feature_normal", "Denoising Normal"),
];

/// Single channels whose suffix differs too.
const BLENDER_CHANNELS: &[(&str, &str)] = &[
    ("Z", "Depth.Z"),
    ("stats.samples", "Debug Sample Count.X"),
    ("object_id.id", "Object Index.X"),
    ("material_id.id", "Material Index.X"),
    ("instance_id.id", "instance_id.X"),
];

/// A channel's name in a file of this profile.
pub fn channel_name(profile: ExrProfileDesc, name: &str) -> String {
    if profile != ExrProfileDesc::Blender {
        return name.to_owned();
    }
    if let Some((_, new)) = BLENDER_CHANNELS.iter().find(|(own, _)| *own == name) {
        return (*new).to_owned();
    }
    let Some((layer, suffix)) = name.split_once('.') else { return name.to_owned() };
    if let Some(group) = layer.strip_prefix("light_") {
        return format!("Combined_{group}.{suffix}");
    }
    let pass = BLENDER_PASSES.iter().find(|(own, _)| *own == layer).map_or(layer, |(_, pass)| pass);
    format!("{pass}.{suffix}")
}

/// A word that every reader keeps as it is: letters, digits and underscores, the first no digit.
pub fn plain_word(word: &str) -> String {
    let plain: String = word.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| c.is_ascii_digit()) { format!("_{plain}") } else { plain }
}

/// The channels of the layer `motion` and their description, where a profile's program expects others than the default:
/// in pixels to the right and up, either from the begin of the shutter interval to its end, or from its middle to its
/// begin and to its end.
pub fn motion_channels(profile: ExrProfileDesc) -> Option<(&'static [&'static str], &'static str)> {
    match profile {
        ExrProfileDesc::Nuke => Some((
            &["forward.u", "forward.v"],
            "forward: motion of the nearest sample while the shutter is open, in pixels to the right and up; for \
             VectorBlur with a shutter of 1",
        )),
        ExrProfileDesc::Blender => Some((
            &["Vector.X", "Vector.Y", "Vector.Z", "Vector.W"],
            "Vector: motion of the nearest sample in pixels to the right and up, from the middle of the shutter \
             interval to its begin (X, Y) and to its end (Z, W); for Vector Blur with a shutter of 1",
        )),
        ExrProfileDesc::Default | ExrProfileDesc::Multipart => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blender_gets_the_names_of_its_passes() {
        let names = [
            "R",
            "A",
            "Z",
            "N.X",
            "specular_indirect.G",
            "light_key.R",
            "object_id.id",
            "CryptoObject00.r",
            "variance.R",
            "uv.U",
        ];
        let passes = [
            "R",
            "A",
            "Depth.Z",
            "Normal.X",
            "Glossy Indirect.G",
            "Combined_key.R",
            "Object Index.X",
            "CryptoObject00.r",
            "variance.R",
            "UV.U",
        ];
        assert_eq!(names.map(|name| channel_name(ExrProfileDesc::Blender, name)), passes);
        assert_eq!(names.map(|name| channel_name(ExrProfileDesc::Nuke, name)), names);
    }

    #[test]
    fn words_are_plain() {
        assert_eq!(["key light", "2nd", "a.b-c", "ü"].map(plain_word), ["key_light", "_2nd", "a_b_c", "_"]);
    }
}
