//! Factors and textures to colours and numbers, and the sets of uv that they use.

use super::super::GltfSource;
use super::super::textures::{TextureRef, TextureSet};
use crate::desc::{ChannelDesc, ColorDesc, ColorSpaceDesc, PrincipledDesc, ScalarDesc, TextureDesc};
use crate::error::Result;
use crate::import::Draft;

/// The inputs of one material.
pub(crate) struct Inputs<'b> {
    textures: &'b mut TextureSet,
    sets: Vec<u32>,
    clamped: bool,
}

impl<'b> Inputs<'b> {
    pub fn new(textures: &'b mut TextureSet) -> Self {
        Self { textures, sets: Vec::new(), clamped: false }
    }

    /// The set of uv of the first texture.
    pub fn uv_set(&self) -> Option<u32> {
        self.sets.first().copied()
    }

    /// Whether textures use different sets of uv.
    pub fn mixes_sets(&self) -> bool {
        self.sets.iter().any(|set| Some(set) != self.sets.first())
    }

    /// Whether a factor was outside of its range.
    pub fn was_clamped(&self) -> bool {
        self.clamped
    }

    /// A factor within `[0, 1]`.
    pub fn share(&mut self, factor: f32) -> f32 {
        let share = if factor.is_nan() { 0.0 } else { factor.clamp(0.0, 1.0) };
        self.clamped |= share != factor;
        share
    }

    /// A texture of colours by name, or of one channel of them.
    pub fn image(
        &mut self,
        source: GltfSource,
        draft: &mut Draft,
        texture: &TextureRef,
        channel: Option<ChannelDesc>,
    ) -> Result<Option<String>> {
        self.sets.push(texture.uv_set);
        self.textures.add(source, draft, texture, ColorSpaceDesc::Srgb, channel)
    }

    /// A texture of linear numbers by name.
    pub fn data(
        &mut self,
        source: GltfSource,
        draft: &mut Draft,
        texture: &TextureRef,
        channel: Option<ChannelDesc>,
    ) -> Result<Option<String>> {
        self.sets.push(texture.uv_set);
        self.textures.add(source, draft, texture, ColorSpaceDesc::Linear, channel)
    }

    /// A colour: a factor, times a texture if there is one.
    pub fn color(
        &mut self,
        source: GltfSource,
        draft: &mut Draft,
        texture: Option<&TextureRef>,
        factor: [f32; 3],
    ) -> Result<ColorDesc> {
        let factor = factor.map(|f| self.share(f));
        let Some(texture) = texture.filter(|_| factor != [0.0; 3]) else { return Ok(ColorDesc::Rgb(factor)) };
        let Some(image) = self.image(source, draft, texture, None)? else { return Ok(ColorDesc::Rgb(factor)) };
        let image = ColorDesc::Texture { texture: image };
        if factor == [1.0; 3] {
            return Ok(image);
        }
        let product = TextureDesc::Product { factors: vec![image, ColorDesc::Rgb(factor)] };
        Ok(ColorDesc::Texture { texture: draft.add_texture("tinted", &texture.place, product) })
    }

    /// A colour times those of vertices.
    pub fn colored(&mut self, draft: &mut Draft, place: &str, color: ColorDesc) -> ColorDesc {
        let colors = self.textures.vertex_colors(draft, place);
        if matches!(color, ColorDesc::Rgb([1.0, 1.0, 1.0])) {
            return colors;
        }
        let product = TextureDesc::Product { factors: vec![colors, color] };
        ColorDesc::Texture { texture: draft.add_texture("tinted", place, product) }
    }

    /// A number: a factor, times a channel of a texture if there is one.
    pub fn scalar(
        &mut self,
        source: GltfSource,
        draft: &mut Draft,
        texture: Option<&TextureRef>,
        channel: ChannelDesc,
        factor: f32,
    ) -> Result<ScalarDesc> {
        let factor = self.share(factor);
        let Some(texture) = texture.filter(|_| factor != 0.0) else { return Ok(ScalarDesc::Constant(factor)) };
        let Some(image) = self.data(source, draft, texture, Some(channel))? else {
            return Ok(ScalarDesc::Constant(factor));
        };
        if factor == 1.0 {
            return Ok(ScalarDesc::Texture { texture: image });
        }
        let product =
            TextureDesc::Product { factors: vec![ColorDesc::Texture { texture: image }, ColorDesc::Grey(factor)] };
        Ok(ScalarDesc::Texture { texture: draft.add_texture("scaled", &texture.place, product) })
    }
}

/// A white principled material with every other default of glTF.
pub fn default_principled() -> PrincipledDesc {
    PrincipledDesc {
        base_color: ColorDesc::Grey(1.0),
        metallic: ScalarDesc::Constant(1.0),
        roughness: ScalarDesc::Constant(1.0),
        sheen_tint: ScalarDesc::Constant(0.0),
        ..PrincipledDesc::default()
    }
}
