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
    pub uncropped: Option<bool>,
    /// Shapes of a pixel in Cryptomatte layers.
    pub crypto_depth: Option<u32>,
    /// Where the names of Cryptomatte are.
    pub crypto_manifest: Option<CryptoManifestDesc>,
    /// The owner of the picture.
    pub owner: Option<String>,
    /// Free text.
    pub comments: Option<String>,
    /// Of a sequence of frames, for outputs that have none of their own.
    #[serde(skip)]
    pub frames_per_second: Option<f64>,
}

impl ExrOverrides {
    /// These changes, and those of `others` where these have none.
    pub fn or(self, others: Self) -> Self {
        Self {
            profile: self.profile.or(others.profile),
            compression: self.compression.or(others.compression),
            dwa_level: self.dwa_level.or(others.dwa_level),
            uncropped: self.uncropped.or(others.uncropped),
            crypto_depth: self.crypto_depth.or(others.crypto_depth),
            crypto_manifest: self.crypto_manifest.or(others.crypto_manifest),
            owner: self.owner.or(others.owner),
            comments: self.comments.or(others.comments),
            frames_per_second: self.frames_per_second.or(others.frames_per_second),
        }
    }

    /// Changes an output.
    pub fn apply(&self, output: &mut OutputDesc) {
        output.profile = self.profile.unwrap_or(output.profile);
        output.compression = self.compression.or(output.compression);
        output.dwa_level = self.dwa_level.or(output.dwa_level);
        output.uncropped = self.uncropped.unwrap_or(output.uncropped);
        output.crypto_depth = self.crypto_depth.or(output.crypto_depth);
        output.crypto_manifest = self.crypto_manifest.unwrap_or(output.crypto_manifest);
        output.owner = self.owner.clone().or(output.owner.take());
        output.comments = self.comments.clone().or(output.comments.take());
        output.frames_per_second = output.frames_per_second.or(self.frames_per_second);
    }
}
