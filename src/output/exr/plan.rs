//! What of an output can be written, and how: decided before anything is rendered.

use exr::compression::Compression;

use crate::desc::{CompressionDesc, ExrProfileDesc, LayerDesc, OutputDesc, PixelTypeDesc};
use crate::error::{Error, Result};
use crate::film::{LayerKind, Source};
use crate::output::role::Role;

/// Ranks of Cryptomatte if nothing is said.
const DEFAULT_DEPTH: u32 = 6;
/// The most ranks: what two digits of a layer's number allow would be 200, what anyone uses is 16.
const MAX_DEPTH: u32 = 64;

/// A part of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PartKind {
    /// The picture and layers of colour.
    Beauty,
    /// Data.
    Utility,
    /// Ranks of Cryptomatte.
    Crypto,
}

impl PartKind {
    /// All parts, in the order of files.
    pub const ALL: [(Self, &'static str); 3] = [(Self::Beauty, "beauty"), (Self::Utility, "utility"), (Self::Crypto, "crypto")];

    /// The part that a channel goes to.
    pub fn of(role: Role) -> Self {
        match role {
            Role::Color | Role::Alpha => Self::Beauty,
            Role::Crypto => Self::Crypto,
            Role::Direction | Role::Precise | Role::Id => Self::Utility,
        }
    }
}

/// Checks that an EXR output makes sense: no lossy compression of data, no 16 bits where 32 are needed, an even number of ranks.
///
/// # Errors
/// [`Error::Usage`] naming the output and the layer.
pub fn check_output(output: &OutputDesc) -> Result<()> {
    let fault = |message: String| Err(Error::Usage(format!("output {}: {message}", output.file)));
    let data = output.layers.iter().find(|layer| is_data(**layer));
    if let (Some(compression), Some(layer)) = (output.compression.filter(|c| is_lossy(*c)), data)
        && output.profile != ExrProfileDesc::Multipart
    {
        let (compression, layer) = (compression_name(compression), layer_name(*layer));
        return fault(format!(
            "the compression {compression} would spoil the layer {layer}, which holds data; the profile multipart gives data a part of its own"
        ));
    }
    let spoiled = output
        .pixel_types
        .iter()
        .find(|(layer, pixel_type)| **pixel_type == PixelTypeDesc::Half && LayerKind::from(**layer).info().always_float);
    if let Some((layer, _)) = spoiled {
        return fault(format!("the layer {} needs 32 bits: its pixel type cannot be half", layer_name(*layer)));
    }
    match output.crypto_depth {
        Some(depth) if depth == 0 || depth % 2 == 1 || depth > MAX_DEPTH => {
            return fault(format!("{depth} ranks of Cryptomatte: an even number from 2 to {MAX_DEPTH}"));
        }
        _ => {}
    }
    match output.dwa_level {
        Some(level) if !(0.0..=100_000.0).contains(&level) => fault(format!("a DWA level of {level}: a number from 0 to 100000")),
        Some(_) if !output.compression.is_some_and(is_lossy) => fault("a DWA level without the compression dwaa or dwab".to_owned()),
        _ if output.frames_per_second.is_some_and(|fps| !(fps > 0.0 && fps <= 1e6)) => {
            fault("frames per second: a number above 0".to_owned())
        }
        _ => Ok(()),
    }
}

/// The ranks of Cryptomatte that an output stores.
pub fn crypto_depth(output: &OutputDesc) -> usize {
    output.crypto_depth.unwrap_or(DEFAULT_DEPTH) as usize
}

/// Whether a layer is stored in 16 bits.
pub fn is_half(output: &OutputDesc, kind: LayerKind) -> bool {
    let own = output.pixel_types.iter().find(|(layer, _)| LayerKind::from(**layer) == kind).map(|(_, pixel_type)| *pixel_type);
    !kind.info().always_float && own.unwrap_or(output.pixel_type) == PixelTypeDesc::Half
}

/// How a part is compressed.
pub fn compression(output: &OutputDesc, part: PartKind) -> Compression {
    let default = if output.profile == ExrProfileDesc::Nuke { CompressionDesc::Zips } else { CompressionDesc::Zip };
    match output.compression.unwrap_or(default) {
        CompressionDesc::Dwaa | CompressionDesc::Dwab if part != PartKind::Beauty => Compression::ZIP16,
        CompressionDesc::Zip => Compression::ZIP16,
        CompressionDesc::Zips => Compression::ZIP1,
        CompressionDesc::Piz => Compression::PIZ,
        CompressionDesc::Rle => Compression::RLE,
        CompressionDesc::None => Compression::Uncompressed,
        CompressionDesc::Dwaa => Compression::DWAA(output.dwa_level),
        CompressionDesc::Dwab => Compression::DWAB(output.dwa_level),
    }
}

fn is_lossy(compression: CompressionDesc) -> bool {
    matches!(compression, CompressionDesc::Dwaa | CompressionDesc::Dwab)
}

fn is_data(layer: LayerDesc) -> bool {
    let info = LayerKind::from(layer).info();
    matches!(info.source, Source::Coverage) || info.channels.iter().any(|name| Role::of(name).is_data())
}

fn layer_name(layer: LayerDesc) -> &'static str {
    LayerKind::from(layer).info().name
}

fn compression_name(compression: CompressionDesc) -> &'static str {
    if compression == CompressionDesc::Dwaa { "dwaa" } else { "dwab" }
}
