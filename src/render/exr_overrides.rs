//! What the caller changes of EXR outputs.

use serde::Deserialize;

use crate::desc::{CompressionDesc, CryptoManifestDesc, ExrProfileDesc, OutputDesc};

/// Changes of every EXR output; `None` keeps the value of the scene.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExrOverrides {
    /// For which program the file is written.
    pub profile: Option<ExrProfileDesc>,
    /// The compression.
    pub compression: Option<CompressionDesc>,
    /// The loss of DWA compression.
    pub dwa_level: Option<f32>,
    /// Whether a crop is written as the whole picture.
    pub uncropped: bool,
    /// Shapes of a pixel in Cryptomatte layers.
    pub crypto_depth: Option<u32>,
    /// Where the names of Cryptomatte are.
    pub crypto_manifest: Option<CryptoManifestDesc>,
    /// The owner of the picture.
    pub owner: Option<String>,
    /// Free text.
    pub comments: Option<String>,
    /// Of a sequence of frames.
    pub frames_per_second: Option<f64>,
}

impl ExrOverrides {
    /// The name of a setting that was given, if any was.
    pub fn given(&self) -> Option<&'static str> {
        let given = [
            ("exr_profile", self.profile.is_some()),
            ("compression", self.compression.is_some()),
            ("dwa_level", self.dwa_level.is_some()),
            ("uncropped", self.uncropped),
            ("crypto_depth", self.crypto_depth.is_some()),
            ("crypto_manifest", self.crypto_manifest.is_some()),
            ("owner", self.owner.is_some()),
            ("comments", self.comments.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }

    /// Changes an output.
    pub fn apply(&self, output: &mut OutputDesc) {
        output.profile = self.profile.unwrap_or(output.profile);
        output.compression = self.compression.or(output.compression);
        output.dwa_level = self.dwa_level.or(output.dwa_level);
        output.uncropped |= self.uncropped;
        output.crypto_depth = self.crypto_depth.or(output.crypto_depth);
        output.crypto_manifest = self.crypto_manifest.unwrap_or(output.crypto_manifest);
        output.owner = self.owner.clone().or(output.owner.take());
        output.comments = self.comments.clone().or(output.comments.take());
        output.frames_per_second = output.frames_per_second.or(self.frames_per_second);
    }
}
