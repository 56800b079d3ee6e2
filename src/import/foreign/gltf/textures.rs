//! Textures, samplers and images, and how an extension moves them.

use std::collections::BTreeMap;

use gltf::json::texture::{MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use serde_json::{Map, Value};

use super::GltfSource;
use super::buffers::Uri;
use super::extensions::{TextureInfo, TextureTransform};
use crate::assets::read_image_bytes;
use crate::desc::{ChannelDesc, ColorDesc, ColorSpaceDesc, TextureDesc, TextureFilterDesc, WrapDesc, WrapModeDesc};
use crate::error::Result;
use crate::image_data::ImageData;
use crate::import::Draft;

/// A texture as a material names it.
#[derive(Clone, Debug)]
pub struct TextureRef {
    /// Where the material names it.
    pub place: String,
    index: usize,
    /// The set of uv that it uses.
    pub uv_set: u32,
    transform: TextureTransform,
}

/// Textures and images that have been added.
#[derive(Debug, Default)]
pub struct TextureSet {
    files: BTreeMap<usize, String>,
    names: BTreeMap<String, String>,
    /// That of the vertices' colours.
    vertex_colors: Option<String>,
}

impl TextureRef {
    /// A texture with its extensions.
    pub fn new(
        source: GltfSource,
        place: &str,
        index: usize,
        uv_set: u32,
        extensions: Option<&Map<String, Value>>,
    ) -> Result<Self> {
        let transform: TextureTransform =
            source.extension(place, extensions, "KHR_texture_transform")?.unwrap_or_default();
        let numbers = [transform.offset, transform.scale].concat();
        if !numbers.iter().all(|x| x.is_finite()) || !transform.rotation.is_finite() {
            return Err(source.fault(&format!("{place}.extensions.KHR_texture_transform"), "is not finite"));
        }
        Ok(Self { place: place.into(), index, uv_set: transform.tex_coord.unwrap_or(uv_set), transform })
    }

    /// A texture that an extension names.
    pub fn of_extension(source: GltfSource, place: &str, info: Option<&TextureInfo>) -> Result<Option<Self>> {
        info.map(|info| Self::new(source, place, info.index, info.tex_coord, info.extensions.as_ref())).transpose()
    }
}

impl TextureSet {
    /// Adds a texture: one channel of it, or its colour. `None` if there is no image that can be read, which is
    /// reported.
    pub fn add(
        &mut self,
        source: GltfSource,
        draft: &mut Draft,
        texture: &TextureRef,
        color_space: ColorSpaceDesc,
        channel: Option<ChannelDesc>,
    ) -> Result<Option<String>> {
        let json = source.root.textures.get(texture.index);
        let json = json.ok_or_else(|| source.fault(&texture.place, format!("no textures[{}]", texture.index)))?;
        let path = format!("textures[{}]", texture.index);
        // An index of all ones means none.
        let Some(image) = source.root.images.get(json.source.value()).map(|_| json.source.value()) else {
            draft.ignored(&path, "texture", "source", "the image is in a format of an extension that is not read");
            return Ok(None);
        };
        let file = self.image(source, draft, image)?;
        let sampler = json.sampler.and_then(|index| source.root.samplers.get(index.value()));
        let (filter, wrap) = sampler.map_or((TextureFilterDesc::Trilinear, WrapDesc::default()), lookup);
        let (offset, scale, rotation) = flipped(&texture.transform);
        let desc = TextureDesc::Image {
            file,
            color_space,
            filter,
            wrap,
            scale,
            rotation_degrees: rotation.to_degrees(),
            offset,
            channel,
            invert: false,
        };
        let key = format!("{desc:?}");
        if let Some(name) = self.names.get(&key) {
            return Ok(Some(name.clone()));
        }
        let label = json.name.as_deref().or(source.root.images.get(image).and_then(|image| image.name.as_deref()));
        let label = label.map_or_else(|| format!("texture {}", texture.index), str::to_owned);
        let label = match channel {
            Some(channel) => format!("{label} {channel:?}").to_lowercase(),
            None => label,
        };
        draft.mapped(&path, "texture", "source");
        if json.sampler.is_some() {
            draft.mapped(&path, "texture", "sampler");
        }
        let name = draft.add_texture(&label, &path, desc);
        self.names.insert(key, name.clone());
        Ok(Some(name))
    }

    /// The texture of the vertices' colours.
    pub fn vertex_colors(&mut self, draft: &mut Draft, place: &str) -> ColorDesc {
        let add = || draft.add_texture("vertex_color", place, TextureDesc::VertexColor);
        ColorDesc::Texture { texture: self.vertex_colors.get_or_insert_with(add).clone() }
    }

    /// The file of an image.
    fn image(&mut self, source: GltfSource, draft: &mut Draft, index: usize) -> Result<String> {
        if let Some(file) = self.files.get(&index) {
            return Ok(file.clone());
        }
        let file = match location(source, index)? {
            Location::File(file) => file,
            Location::Bytes(bytes) => draft.keep_image(&format!("image_{index}"), decode(source, index, &bytes)?),
        };
        self.files.insert(index, file.clone());
        Ok(file)
    }
}

enum Location {
    File(String),
    Bytes(Vec<u8>),
}

fn location(source: GltfSource, index: usize) -> Result<Location> {
    let path = format!("images[{index}]");
    let image = source.root.images.get(index).ok_or_else(|| source.fault(&path, "no such image"))?;
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => match Uri::parse(uri).map_err(|message| source.fault(&path, message))? {
            Uri::File(file) => Ok(Location::File(file)),
            Uri::Data(bytes) => Ok(Location::Bytes(bytes)),
        },
        (None, Some(view)) => {
            let json = source.root.get(view).ok_or_else(|| source.fault(&path, "no such view"))?;
            let view = source.buffers.view(json).map_err(|message| source.fault(&path, message))?;
            Ok(Location::Bytes(view.bytes.to_vec()))
        }
        (None, None) => Err(source.fault(&path, "has neither `uri` nor `bufferView`")),
    }
}

fn decode(source: GltfSource, index: usize, bytes: &[u8]) -> Result<ImageData> {
    read_image_bytes(bytes).map_err(|e| source.fault(&format!("images[{index}]"), e.to_string()))
}

/// Filter and wrap modes of a sampler. A viewer that shows pixels enlarged with `NEAREST` shows them as they are.
fn lookup(sampler: &Sampler) -> (TextureFilterDesc, WrapDesc) {
    let filter = match (sampler.mag_filter, sampler.min_filter) {
        (Some(Checked::Valid(MagFilter::Nearest)), _) => TextureFilterDesc::Nearest,
        (_, Some(Checked::Valid(MinFilter::Nearest | MinFilter::Linear))) => TextureFilterDesc::Bilinear,
        _ => TextureFilterDesc::Trilinear,
    };
    let mode = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => WrapModeDesc::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => WrapModeDesc::Mirror,
        _ => WrapModeDesc::Repeat,
    };
    let (u, v) = (mode(sampler.wrap_s), mode(sampler.wrap_t));
    (filter, if u == v { WrapDesc::Both(u) } else { WrapDesc::Each([u, v]) })
}

/// A transform of uv whose v runs down, for uv whose v runs up: offset, scale and rotation (radians).
///
/// With v down the lookup is `offset + M (scale * uv)`, where M turns counter-clockwise as the image is seen: from u
/// against v. Putting `1 - v` for v before and after turns that rotation into one from u towards v by the same angle
/// and moves the offset.
fn flipped(transform: &TextureTransform) -> ([f32; 2], [f32; 2], f64) {
    let rotation = f64::from(transform.rotation);
    let (sin, cos) = rotation.sin_cos();
    let ([offset_u, offset_v], [scale_u, scale_v]) = (transform.offset.map(f64::from), transform.scale.map(f64::from));
    let offset = [offset_u + sin * scale_v, 1.0 - offset_v - cos * scale_v];
    (offset.map(|x| x as f32), [scale_u as f32, scale_v as f32], rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the image lookup does.
    fn looked_up([u, v]: [f64; 2], (offset, scale, rotation): ([f32; 2], [f32; 2], f64)) -> [f64; 2] {
        let (sin, cos) = rotation.sin_cos();
        let [u, v] = [u * f64::from(scale[0]), v * f64::from(scale[1])];
        [f64::from(offset[0]) + cos * u - sin * v, f64::from(offset[1]) + sin * u + cos * v]
    }

    #[test]
    fn transforms_mean_the_same_with_v_upward() {
        let quarter = std::f32::consts::FRAC_PI_2;
        // Points of uv with v down, by hand: the first is looked up where the second is without a transform.
        let cases = [
            (TextureTransform::default(), [0.25, 0.75], [0.25, 0.75]),
            (TextureTransform { offset: [0.5, 0.25], ..TextureTransform::default() }, [0.1, 0.2], [0.6, 0.45]),
            (TextureTransform { scale: [2.0, 3.0], ..TextureTransform::default() }, [0.1, 0.2], [0.2, 0.6]),
            // A quarter turn counter-clockwise as the image is seen takes the u axis up, where v is negative.
            (TextureTransform { rotation: quarter, ..TextureTransform::default() }, [1.0, 0.0], [0.0, -1.0]),
            (TextureTransform { rotation: quarter, ..TextureTransform::default() }, [0.0, 1.0], [1.0, 0.0]),
            (
                TextureTransform { offset: [0.5, 0.25], rotation: quarter, scale: [2.0, 4.0], tex_coord: None },
                [1.0, 0.5],
                [2.5, -1.75],
            ),
        ];
        for (transform, [u, v], [to_u, to_v]) in cases {
            let found = looked_up([u, 1.0 - v], flipped(&transform));
            let error = (found[0] - to_u).abs() + (1.0 - found[1] - to_v).abs();
            assert!(error < 1e-6, "{transform:?}: {u} {v} to {found:?}");
        }
    }
}
