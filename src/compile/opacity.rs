//! Opacity: from the key of shapes to the test of accelerators.

use std::sync::Arc;

use super::Builder;
use super::textures::TextureUse;
use crate::color::Rgb;
use crate::desc::{OpacityDesc, ShapeCommon};
use crate::error::Result;
use crate::geometry::AlphaMasks;
use crate::id::TextureId;
use crate::medium::Medium;
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

    /// The holes of surfaces of participating media, or of all others.
    pub(super) fn alpha_masks(&self, of_participating_media: bool) -> AlphaMasks {
        let (media, textures) = (&self.materials.media, &self.materials.textures);
        let is_chosen = |i: usize| {
            let medium = self.surfaces[i].medium.map(|id| media.get(id));
            medium.is_some_and(Medium::is_participating) == of_participating_media
        };
        let of_shape =
            |(i, id): (usize, &Option<TextureId>)| id.filter(|_| is_chosen(i)).map(|id| textures.get(id).clone());
        let by_shape: Vec<Option<Texture>> = self.opacities.iter().enumerate().map(of_shape).collect();
        if by_shape.iter().all(Option::is_none) {
            return AlphaMasks::default();
        }
        AlphaMasks::new(Arc::new(Opacity::new(&self.geometry.shapes, by_shape)))
    }
}
