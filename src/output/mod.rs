//! Picture files, and the checks before they are written.

mod check;
mod color_space;
mod compare;
pub mod cryptomatte;
mod exr;
pub mod flip;
mod matrices;
mod png;
mod role;
mod uses;
mod view;

pub use self::exr::{
    ExrLayers, Matte, NamedLayer, OutputFault, check_output, find_output_fault, matte, read_exr, read_exr_layers,
    read_settings, write_exr, write_image,
};
pub use check::{Finding, RULES, Rule, Severity, check_exr};
pub use compare::{Comparison, RELATIVE_FLOOR, compare};
pub use png::{encode_png, write_png};
pub use uses::FileUses;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::desc::{CryptoManifestDesc, OutputDesc};
use crate::error::{Error, Result};
use crate::film::{Identities, Image};

pub use crate::file::{check_creatable, write_atomically};

/// The kinds of files that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: linear, with layers and metadata.
    Exr,
    /// PNG: 8 bits, through a view.
    Png,
}

impl Format {
    /// Every format with its extension.
    pub const ALL: [(Self, &'static str); 2] = [(Self::Exr, "exr"), (Self::Png, "png")];

    /// The format that a file's extension names, in upper or lower case.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is none.
    pub fn from_path(path: &Path) -> Result<Self> {
        let extension =
            path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
        Self::ALL.iter().find(|(_, name)| *name == extension).map(|(format, _)| *format).ok_or_else(|| {
            let known: Vec<String> = Self::ALL.iter().map(|(_, name)| format!(".{name}")).collect();
            let what =
                if extension.is_empty() { "no extension".to_owned() } else { format!("the extension .{extension}") };
            Error::Usage(format!("output {} has {what}; known are {}", path.display(), known.join(" and ")))
        })
    }
}

/// Checks that a picture can be written to `path`: a known extension, an existing folder, and the right to create files
/// there.
///
/// # Errors
/// [`Error::Usage`] for an unknown extension, [`Error::Output`] otherwise.
pub fn check_writable(path: &Path) -> Result<()> {
    Format::from_path(path)?;
    check_creatable(path)
}

/// Metadata of the render in a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderInfo {
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Wall-clock time of the rendering in seconds.
    pub render_seconds: f64,
    /// World to camera, for row vectors (the translation in the last row); camera space has +X right, +Y up, +Z
    /// forward.
    pub world_to_camera: Option<[[f32; 4]; 4]>,
    /// World to the picture, for row vectors: x and y from 0 to 1 over the display window, y down; z grows with the
    /// depth.
    pub world_to_ndc: Option<[[f32; 4]; 4]>,
    /// Width of a pixel over its height; 1 if not given.
    pub pixel_aspect: Option<f32>,
    /// Which parts of the samples are there, of a picture that lacks some, such as `shards 1,3 of 4`.
    pub partial: Option<String>,
    /// Further attributes of text, by name.
    pub texts: Vec<(String, String)>,
    /// Counts of the rendering.
    pub statistics: Option<RenderStatistics>,
    /// What shapes are called: needed for mattes and numbers of objects.
    pub identities: Option<Identities>,
    /// All that is needed to make the picture again, as a JSON object; files add how they are written.
    pub settings: Option<serde_json::Value>,
}

/// Statistics of a render that are stored in files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderStatistics {
    /// Threads that rendered.
    pub threads: usize,
    /// Rays of all kinds.
    pub rays: u64,
    /// Samples that were not finite and therefore left out.
    pub nan_samples: u64,
}

/// The files that writing an output makes: itself, and the names of Cryptomatte beside it.
pub fn files_of_output(output: &OutputDesc) -> Vec<PathBuf> {
    let file = PathBuf::from(&output.file);
    let beside = output.crypto_manifest == CryptoManifestDesc::Sidecar
        && Format::from_path(&file).is_ok_and(|format| format == Format::Exr);
    let sidecars = cryptomatte::TYPES.iter().filter(|_| beside).map(|name| exr::sidecar_path(&file, name));
    std::iter::once(file.clone()).chain(sidecars).collect()
}

/// Writes `image` to the file of `output`, with its settings.
///
/// # Errors
/// [`Error::Usage`] for an unknown extension; [`Error::Output`] if the file cannot be written, in which case nothing is
/// left behind.
pub fn write(output: &OutputDesc, image: &Image, info: &RenderInfo) -> Result<()> {
    let path = Path::new(&output.file);
    match Format::from_path(path)? {
        Format::Exr => write_exr(path, image, output, info),
        Format::Png => write_png(path, image, output.exposure, output.view.unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_have_known_extensions() {
        let folder = tempfile::tempdir().unwrap();
        check_writable(&folder.path().join("a.PNG")).unwrap();
        let unknown = check_writable(&folder.path().join("a.jpg")).unwrap_err();
        assert!(matches!(&unknown, Error::Usage(message) if message.contains(".exr and .png")), "{unknown}");
        assert!(matches!(check_writable(&folder.path().join("a")), Err(Error::Usage(_))));
        assert!(matches!(check_writable(&folder.path().join("missing/a.exr")), Err(Error::Output { .. })));
    }
}
