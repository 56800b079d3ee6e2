//! Opacity: from the key of shapes to the test of accelerators.

use std::sync::Arc;

use super::Builder;
use super::textures::{TextureTable, TextureUse};
use crate::color::Rgb;
use crate::desc::{OpacityDesc, ShapeCommon};
use crate::error::Result;
use crate::geometry::{AlphaMasks, Shape};
use crate::id::TextureId;
use crate::opacity::Opacity;
use crate::texture::{Bitmap, Channel, Texture};

impl Builder {
    /// The value of a shape's own key, if the shape has holes at all.
    pub(super) fn opacity(&mut self, path: &str, common: &ShapeCommon) -> Result<Option<TextureId>> {
        let Some(desc) = common.opacity else {
            return Ok(None);
        };
        let path = format!("{path}.opacity");
        let textures = &mut self.materials.textures;
        Ok(match desc {
            OpacityDesc::Number(value) => {
                let value = self.files.within(&path, f64::from(*value), 0.0, 1.0)? as f32;
                (value < 1.0).then(|| textures.push(Texture::Constant(Rgb::splat(value))))
            }
            OpacityDesc::Texture { texture: name, threshold } => {
                let place = format!("{path}.texture");
                let named = textures.find(&self.files, &place, name, TextureUse::Data)?;
                let alpha = match textures.get(named) {
                    Texture::Bitmap(bitmap) if bitmap.channel.is_none() && bitmap.image.has_alpha() => {
                        Some(Bitmap { channel: Some(Channel::A), ..bitmap.clone() })
                    }
                    _ => None,
                };
                let id = alpha.map_or(named, |bitmap| textures.push(Texture::Bitmap(bitmap)));
                let [min, max] = textures.get(id).range();
                if !(min >= 0.0 && max <= 1.0) {
                    return Err(self.files.error(
                        &place,
                        format!("the texture \"{name}\" reaches from {min} to {max}, opacity from 0 to 1"),
                    ));
                }
                let Some(threshold) = threshold else { return Ok(Some(id)) };
                let threshold =
                    self.files.within(&format!("{path}.threshold"), f64::from(*threshold), 0.0, 1.0)? as f32;
                let step = Texture::Step(Box::new(textures.get(id).clone()), threshold);
                Some(textures.push(step))
            }
        })
    }
}

/// The holes of shapes with these opacities.
pub(super) fn cutouts(shapes: &[Shape], opacities: &[Option<TextureId>], textures: &TextureTable) -> AlphaMasks {
    if opacities.iter().all(Option::is_none) {
        return AlphaMasks::default();
    }
    let by_shape = opacities.iter().map(|id| id.map(|id| textures.get(id).clone())).collect();
    AlphaMasks::new(Arc::new(Opacity::new(shapes, by_shape)))
}
