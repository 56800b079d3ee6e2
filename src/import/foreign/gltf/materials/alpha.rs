//! How much of a surface is there.

use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

use super::Builder;
use crate::desc::{ChannelDesc, OpacityDesc, ScalarDesc};
use crate::error::Result;

impl Builder<'_, '_> {
    /// The opacity of the shapes of the material; `None` if they are whole.
    pub(super) fn opacity(&mut self) -> Result<Option<OpacityDesc>> {
        let factor = self.inputs.share(self.color_factor[3]);
        let texture = self.color_texture.clone();
        let mode = match self.json.alpha_mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => AlphaMode::Opaque,
        };
        match mode {
            AlphaMode::Opaque => {
                self.mapped("alphaMode");
                Ok(None)
            }
            AlphaMode::Mask => {
                self.mapped("alphaCutoff");
                let cutoff = self.json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
                let alpha = self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::A, factor)?;
                Ok(match alpha {
                    // Alpha is at most 1.
                    _ if cutoff > 1.0 => Some(OpacityDesc::Number(0.0)),
                    ScalarDesc::Constant(alpha) => (alpha < cutoff).then_some(OpacityDesc::Number(0.0)),
                    ScalarDesc::Texture { texture } => {
                        Some(OpacityDesc::Texture { texture, threshold: Some(cutoff.max(0.0)) })
                    }
                })
            }
            AlphaMode::Blend => {
                self.mapped("alphaMode");
                let alpha = self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::A, factor)?;
                Ok(match alpha {
                    ScalarDesc::Constant(1.0) => None,
                    ScalarDesc::Constant(alpha) => Some(OpacityDesc::Number(alpha)),
                    ScalarDesc::Texture { texture } => Some(OpacityDesc::Texture { texture, threshold: None }),
                })
            }
        }
    }
}
