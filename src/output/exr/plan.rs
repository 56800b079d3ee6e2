//! What of an output can be written, and how: decided before anything is rendered.

use exr::compression::Compression;

use crate::desc::{CompressionDesc, ExrProfileDesc, LayerKind, OutputDesc, PixelTypeDesc};
use crate::error::{Error, Result};
use crate::film::{LayerInfo, LayerSource};
use crate::output::role::Role;

/// Ranks of Cryptomatte by default.
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
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Beauty, "beauty"), (Self::Utility, "utility"), (Self::Crypto, "crypto")];

    /// The part that a channel goes to.
    pub fn of(role: Role) -> Self {
        match role {
            Role::Color | Role::Alpha => Self::Beauty,
            Role::Crypto => Self::Crypto,
            Role::Direction | Role::Precise | Role::Id => Self::Utility,
        }
    }
}

/// What of an output makes no sense.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputFault {
    /// The key of the scene file.
    pub key: &'static str,
    /// What is wrong with it.
    pub message: String,
}

/// Checks that an EXR output makes sense: no lossy compression of data, no 16 bits where 32 are needed, an even number
/// of ranks.
///
/// # Errors
/// [`Error::Usage`] naming the output and the layer.
pub fn check_output(output: &OutputDesc) -> Result<()> {
    let refuse = |fault: OutputFault| Err(Error::Usage(format!("output {}: {}", output.file, fault.message)));
    find_output_fault(output).map_or(Ok(()), refuse)
}

/// What of an output makes no sense, if anything does not; see [`check_output`].
pub fn find_output_fault(output: &OutputDesc) -> Option<OutputFault> {
    let fault = |key: &'static str, message: String| Some(OutputFault { key, message });
    let data = output.layers.iter().find(|layer| is_data(**layer));
    if let (Some(compression), Some(layer)) = (output.compression.filter(|c| is_lossy(*c)), data)
        && output.profile != ExrProfileDesc::Multipart
    {
        let (compression, layer) = (compression_name(compression), layer_name(*layer));
        let message = format!(
            "the compression {compression} would spoil the layer {layer}, which holds data; the profile multipart \
             gives data a part of its own"
        );
        return fault("compression", message);
    }
    let spoiled = output
        .pixel_types
        .iter()
        .find(|(layer, pixel_type)| **pixel_type == PixelTypeDesc::Half && LayerInfo::of(**layer).always_float);
    if let Some((layer, _)) = spoiled {
        return fault(
            "pixel_types",
            format!("the layer {} needs 32 bits: its pixel type cannot be half", layer_name(*layer)),
        );
    }
    if let Some(depth) = output.crypto_depth.filter(|depth| *depth == 0 || depth % 2 == 1 || *depth > MAX_DEPTH) {
        return fault("crypto_depth", format!("{depth} ranks of Cryptomatte: an even number from 2 to {MAX_DEPTH}"));
    }
    match output.dwa_level {
        Some(level) if !(0.0..=100_000.0).contains(&level) => {
            return fault("dwa_level", format!("a DWA level of {level}: a number from 0 to 100000"));
        }
        Some(_) if !output.compression.is_some_and(is_lossy) => {
            return fault("dwa_level", "a DWA level without the compression dwaa or dwab".to_owned());
        }
        _ => {}
    }
    match output.frames_per_second {
        Some(fps) if !(fps > 0.0 && fps <= 1e6) => {
            fault("frames_per_second", format!("{fps} frames per second: a number above 0"))
        }
        _ => None,
    }
}

/// The ranks of Cryptomatte that an output stores.
pub fn crypto_depth(output: &OutputDesc) -> usize {
    output.crypto_depth.unwrap_or(DEFAULT_DEPTH) as usize
}

/// Whether a layer is stored in 16 bits.
pub fn is_half(output: &OutputDesc, kind: LayerKind) -> bool {
    let own = output.pixel_types.iter().find(|(layer, _)| **layer == kind).map(|(_, pixel_type)| *pixel_type);
    !LayerInfo::of(kind).always_float && own.unwrap_or(output.pixel_type) == PixelTypeDesc::Half
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

fn is_data(layer: LayerKind) -> bool {
    let info = LayerInfo::of(layer);
    matches!(info.source, LayerSource::Coverage) || info.channels.iter().any(|name| Role::of(name).is_data())
}

fn layer_name(layer: LayerKind) -> &'static str {
    LayerInfo::of(layer).name
}

fn compression_name(compression: CompressionDesc) -> &'static str {
    if compression == CompressionDesc::Dwaa { "dwaa" } else { "dwab" }
}
