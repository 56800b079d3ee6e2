//! Cryptomatte 1.2.0 (Friedman and Jones, "Fully automatic ID mattes with support for motion blur and transparency",
//! and the specification that Psyop publishes): for each pixel, what covers it and how much of it, under names that
//! survive compositing.

mod hash;
mod manifest;
mod ranks;

pub use hash::{id, id_bits, is_ordinary, metadata_key};
pub use manifest::{id_fault, manifest, parse_manifest};
pub use ranks::fill_ranks;

/// The kinds of mattes that are written.
pub const TYPES: [&str; 3] = ["CryptoObject", "CryptoMaterial", "CryptoAsset"];
/// The hash that metadata names.
pub const HASH: &str = "MurmurHash3_32";
/// The conversion of hashes to floats that metadata names.
pub const CONVERSION: &str = "uint32_to_float32";

/// The name of a type's channel in layer `layer` (two ranks each): `CryptoObject00.r` and so on.
pub fn channel_name(type_name: &str, layer: usize, channel: usize) -> String {
    format!("{type_name}{layer:02}.{}", ["r", "g", "b", "a"][channel % 4])
}

/// The number of the layer that a channel's name gives, if it is one of this type's.
pub fn layer_of(type_name: &str, channel: &str) -> Option<(usize, String)> {
    let (number, suffix) = channel.strip_prefix(type_name)?.split_once('.')?;
    let digits = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| number.parse().ok()).flatten().map(|number| (number, suffix.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channel_names_come_back() {
        assert_eq!(channel_name("CryptoObject", 0, 0), "CryptoObject00.r");
        assert_eq!(layer_of("CryptoAsset", &channel_name("CryptoAsset", 2, 3)), Some((2, "a".to_owned())));
        assert_eq!(layer_of("CryptoAsset", "CryptoAsset.r"), None);
        assert_eq!(layer_of("CryptoAsset", "CryptoObject00.r"), None);
    }
}
