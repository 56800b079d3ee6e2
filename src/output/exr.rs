//! OpenEXR: the colour as R, G, B, A and every other layer as `layer.channel`, in one part or several.

mod blocks;
mod channels;
mod coverage;
mod header_order;
mod layers;
mod metadata;
mod names;
mod plan;
mod read;
mod write;

pub use blocks::write_image;
pub use coverage::{Matte, matte};
pub use layers::{ExrLayers, NamedLayer, read_exr_layers};
pub use metadata::sidecar_path;
pub use plan::{OutputFault, check_output, find_output_fault};
pub use read::{read_exr, read_settings};
pub use write::write_exr;

#[cfg(test)]
mod tests;
