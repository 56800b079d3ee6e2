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
                let cutoff = self.json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
                let cut = match &texture {
                    Some(texture) => self.inputs.cut(self.source, self.draft, texture, factor, cutoff)?,
                    None => None,
                };
                match cut {
                    Some(texture) => {
                        self.approximated("alphaCutoff", "cut off at the image's pixels, not between them");
                        Ok(Some(OpacityDesc::Texture { texture }))
                    }
                    None => {
                        self.mapped("alphaCutoff");
                        Ok((factor < cutoff).then_some(OpacityDesc::Number(0.0)))
                    }
                }
            }
            AlphaMode::Blend => {
                self.mapped("alphaMode");
                let alpha = self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::A, factor)?;
                Ok(match alpha {
                    ScalarDesc::Constant(1.0) => None,
                    ScalarDesc::Constant(alpha) => Some(OpacityDesc::Number(alpha)),
                    ScalarDesc::Texture { texture } => Some(OpacityDesc::Texture { texture }),
                })
            }
        }
    }
}
