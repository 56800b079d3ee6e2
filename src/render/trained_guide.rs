//! Guides that one render has trained and others use.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::settings::refused;
use super::state::read_guide;
use crate::bytes::ByteWriter;
use crate::error::{Error, Result};
use crate::guiding::Guide;
use crate::math::Aabb;

/// A guide that is no longer trained. Samples depend on it, and not on other samples: renders with it can be split.
///
/// Serialized it is its digest; deserialized, it has no guide until one is [read](Self::read).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainedGuide {
    /// BLAKE3 of the guide, in hexadecimal digits.
    digest: String,
    #[serde(skip)]
    guide: Option<Arc<Guide>>,
}

impl TrainedGuide {
    /// The guide in the checkpoint of a render with `guiding`.
    ///
    /// # Errors
    /// [`Error::Missing`] if the file cannot be read; [`Error::Checkpoint`] if it is damaged, of a render without
    /// guiding, or of one whose guiding ended.
    pub fn read(checkpoint: &Path) -> Result<Self> {
        let guide = read_guide(checkpoint)?;
        let mut bytes = ByteWriter::default();
        guide.write(&mut bytes);
        let digest = blake3::hash(&bytes.into_bytes()).to_hex().to_string();
        Ok(Self { digest, guide: Some(Arc::new(guide.into_trained())) })
    }

    /// This guide, read from the checkpoint of this name.
    ///
    /// # Errors
    /// As [`read`](Self::read); [`Error::Setting`] if no file is named; [`Error::Checkpoint`] if it holds another
    /// guide.
    pub fn reload(&self, checkpoint: Option<&Path>) -> Result<Self> {
        let checkpoint = checkpoint.ok_or_else(|| {
            refused("guide", ": the picture was rendered with a guide; give the checkpoint that holds it")
        })?;
        let read = Self::read(checkpoint)?;
        if read.digest != self.digest {
            let message = "it holds another guide than that of the picture".to_owned();
            return Err(Error::Checkpoint { file: checkpoint.to_owned(), message });
        }
        Ok(read)
    }

    /// The guide for a scene with these bounds; `None` if it was not read.
    pub(super) fn of_scene(&self, bounds: Aabb) -> Option<Guide> {
        let mut guide = Guide::clone(self.guide.as_deref()?);
        guide.set_bounds(bounds);
        Some(guide)
    }
}
