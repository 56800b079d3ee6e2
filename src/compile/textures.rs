//! Textures: names to ids, files to images. Each file is read once, however many textures show it.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::CompileContext;
use super::faults::Faults;
use crate::assets::{AssetError, read_image};
use crate::attribute::{VERTEX_COLOR, is_of_faces};
use crate::color::Rgb;
use crate::desc::{
    ChannelDesc, ColorDesc, ColorSpaceDesc, SceneDesc, TextureDesc, TextureFilterDesc, UsedNames, WrapDesc,
    WrapModeDesc,
};
use crate::error::Result;
use crate::id::{AttributeId, TextureId};
use crate::image_data::{ImageData, Samples};
use crate::material::ColorInput;
use crate::math::Vec2;
use crate::texture::{Bitmap, Channel, Checker, Decoding, Texture, TextureFilter, TextureImage, UvTransform, Wrap};

/// Products of textures are nested at most this deep.
const MAX_DEPTH: usize = 64;

/// Textures and colours that a product has at most, those of the products in it counted: each is looked up at every
/// point.
const MAX_LOOKUPS: usize = 256;

/// What a texture is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureUse {
    /// A colour: whole numbers are sRGB unless the texture specifies otherwise.
    Color,
    /// Roughness, normals, heights, opacity: numbers are linear unless the texture specifies otherwise.
    Data,
}

/// All textures, with their names.
#[derive(Default)]
pub struct TextureTable {
    pub textures: Vec<Texture>,
    /// Names of attributes of meshes, by [`AttributeId`].
    pub attributes: Vec<String>,
    names: BTreeMap<String, Entry>,
    images: HashMap<PathBuf, Arc<TextureImage>>,
}

/// A texture for each use; the same one if the use makes no difference.
struct Entry {
    color: TextureId,
    data: TextureId,
}

impl TextureTable {
    /// The textures of a scene; images of those that are not used are not read.
    pub fn new(files: &CompileContext, desc: &SceneDesc, used: &UsedNames, faults: &mut Faults) -> Self {
        let mut table = Self::default();
        let images = read_all(files, desc, used);
        let mut loader = Loader {
            files,
            descs: &desc.textures,
            used: &used.textures,
            images,
            attributes: Vec::new(),
            open: Vec::new(),
            made: HashMap::new(),
        };
        for name in desc.textures.keys() {
            let place = format!("textures.{name}");
            if let Some(TextureDesc::Image { file, .. }) =
                desc.textures.get(name).filter(|_| !used.textures.contains(name))
            {
                files.warn_of_missing(&format!("{place}.file"), file);
            }
            // What uses a faulty one has no fault of its own.
            let made = faults.keep(loader.named(&place, name, TextureUse::Color));
            let depends_on_use = made.as_ref().is_some_and(|made| made.depends_on_use);
            let color = table.push(made.map_or(Texture::Constant(Rgb::splat(0.5)), |made| made.texture));
            let as_data = if depends_on_use { faults.keep(loader.named(&place, name, TextureUse::Data)) } else { None };
            let data = as_data.map_or(color, |made| table.push(made.texture));
            table.names.insert(name.clone(), Entry { color, data });
        }
        (table.images, table.attributes) = (loader.images, loader.attributes);
        table
    }

    /// Adds a texture without a name.
    pub fn push(&mut self, texture: Texture) -> TextureId {
        self.textures.push(texture);
        TextureId::new(self.textures.len() - 1)
    }

    /// The texture with this id.
    pub fn get(&self, id: TextureId) -> &Texture {
        &self.textures[id.index()]
    }

    /// The texture that `path` names.
    pub fn find(&self, files: &CompileContext, path: &str, name: &str, texture_use: TextureUse) -> Result<TextureId> {
        let entry = self
            .names
            .get(name)
            .ok_or_else(|| files.unknown(path, "texture", name, self.names.keys().map(String::as_str)))?;
        Ok(match texture_use {
            TextureUse::Color => entry.color,
            TextureUse::Data => entry.data,
        })
    }

    /// The texture that `path` names, for a use where uv is all there is of a surface.
    pub fn find_by_uv(
        &self,
        files: &CompileContext,
        path: &str,
        name: &str,
        texture_use: TextureUse,
    ) -> Result<TextureId> {
        let id = self.find(files, path, name, texture_use)?;
        if !self.get(id).attributes().is_empty() {
            let message = format!(
                "the texture \"{name}\" takes attributes of meshes, which only parameters of materials, opacity and \
                 emission of shapes can"
            );
            return Err(files.error(path, message));
        }
        Ok(id)
    }

    /// The texture that `path` names, for a fraction of light: no channel is below 0 or above 1.
    pub fn reflectance(&self, files: &CompileContext, path: &str, name: &str) -> Result<ColorInput> {
        let id = self.find(files, path, name, TextureUse::Color)?;
        self.check_reflectance(id).map_err(|message| files.error(path, format!("the texture \"{name}\" {message}")))?;
        Ok(match self.get(id) {
            Texture::Constant(color) => ColorInput::Constant(*color),
            _ => ColorInput::Texture(id),
        })
    }

    /// The texture that `path` names, for light emitted: no channel is below 0.
    pub fn radiance(&self, files: &CompileContext, path: &str, name: &str) -> Result<ColorInput> {
        let id = self.find(files, path, name, TextureUse::Color)?;
        let [min, _] = self.get(id).range();
        if min < 0.0 {
            return Err(files.error(path, format!("the texture \"{name}\" goes down to {min}: light is not negative")));
        }
        Ok(match self.get(id) {
            Texture::Constant(color) => ColorInput::Constant(*color),
            _ => ColorInput::Texture(id),
        })
    }

    /// The texture that `path` names, for a light that is no shape, of which it multiplies `radiance`.
    pub fn of_light(&self, files: &CompileContext, path: &str, name: &str, radiance: Rgb) -> Result<TextureId> {
        let id = self.find_by_uv(files, path, name, TextureUse::Color)?;
        let [min, max] = self.get(id).range();
        if min < 0.0 {
            return Err(files.error(path, format!("the texture \"{name}\" goes down to {min}: light is not negative")));
        }
        files.emitted(path, (radiance * max).to_array())?;
        Ok(id)
    }

    /// Rejects a texture with colours that a surface cannot reflect; the error names the fault.
    pub fn check_reflectance(&self, id: TextureId) -> Result<(), String> {
        let [min, max] = self.get(id).range();
        if min >= 0.0 && max <= 1.0 {
            return Ok(());
        }
        Err(format!("reaches from {min} to {max}: a surface can only reflect from 0 to 1"))
    }

    /// The image in a file that is no texture of the scene's own, read unless it has been; `place` is where the scene
    /// leads to it.
    pub fn image(&mut self, files: &CompileContext, place: &str, asset: &Path) -> Result<Arc<TextureImage>> {
        load_image(&mut self.images, files, place, asset)
    }
}

struct Loader<'a> {
    files: &'a CompileContext,
    descs: &'a BTreeMap<String, TextureDesc>,
    used: &'a BTreeSet<String>,
    images: HashMap<PathBuf, Arc<TextureImage>>,
    attributes: Vec<String>,
    /// The textures on the way to the one being made.
    open: Vec<String>,
    /// Textures made so far, by name and use.
    made: HashMap<(String, TextureUse), Made>,
}

/// A texture with what it is made of.
#[derive(Clone)]
struct Made {
    texture: Texture,
    /// Levels of products, and textures that are no product, counted as often as they are looked up.
    depth: usize,
    lookups: usize,
    depends_on_use: bool,
}

impl Loader<'_> {
    /// The texture that `place` names, made at its first use.
    fn named(&mut self, place: &str, name: &str, texture_use: TextureUse) -> Result<Made> {
        let key = (name.to_owned(), texture_use);
        if let Some(made) = self.made.get(&key) {
            return Ok(made.clone());
        }
        let descs = self.descs;
        let desc = descs
            .get(name)
            .ok_or_else(|| self.files.unknown(place, "texture", name, descs.keys().map(String::as_str)))?;
        if let Some(first) = self.open.iter().position(|open| open == name) {
            let cycle = format!("{} > {name}", self.open[first..].join(" > "));
            return Err(self.files.error(place, format!("a texture cannot be a part of itself: {cycle}")));
        }
        if self.open.len() >= MAX_DEPTH {
            return Err(self.files.error(place, format!("products of textures are nested more than {MAX_DEPTH} deep")));
        }
        self.open.push(name.to_owned());
        let made = self.texture(name, desc, texture_use);
        self.open.pop();
        let made = made?;
        self.made.insert(key, made.clone());
        Ok(made)
    }

    /// The id of an attribute's name.
    fn attribute(&mut self, name: &str) -> AttributeId {
        let at = self.attributes.iter().position(|known| known == name).unwrap_or_else(|| {
            self.attributes.push(name.to_owned());
            self.attributes.len() - 1
        });
        AttributeId::new(at)
    }

    fn mesh_attribute(&mut self, path: &str, name: &str, scale: f32) -> Result<Texture> {
        if is_of_faces(name).is_none() {
            let message = format!("\"{name}\" is no name of an attribute: it begins with vertex_ or face_");
            return Err(self.files.error(&format!("{path}.name"), message));
        }
        if !(scale.is_finite() && scale >= 0.0) {
            return Err(self
                .files
                .error(&format!("{path}.scale"), format!("must be finite and not below 0, not {scale}")));
        }
        Ok(Texture::Attribute(self.attribute(name), scale))
    }

    /// The product of these factors.
    fn product(&mut self, path: &str, factors: &[ColorDesc], texture_use: TextureUse) -> Result<Made> {
        let files = self.files;
        let place = format!("{path}.factors");
        if factors.is_empty() {
            return Err(files.error(&place, "a product needs at least one factor"));
        }
        let mut product = Vec::with_capacity(factors.len());
        let mut made = Made { texture: Texture::Constant(Rgb::WHITE), depth: 1, lookups: 0, depends_on_use: false };
        for (i, factor) in factors.iter().enumerate() {
            let key = format!("{place}[{i}]");
            let constant = |value: [f32; 3]| files.reflectance(&key, value).map(|v| Texture::Constant(Rgb::from(v)));
            let texture = match factor {
                ColorDesc::Grey(v) => constant([*v; 3])?,
                ColorDesc::Rgb(v) => constant(*v)?,
                ColorDesc::Texture { texture } => {
                    let factor = self.named(&key, texture, texture_use)?;
                    made.depth = made.depth.max(factor.depth + 1);
                    made.lookups += factor.lookups - 1;
                    made.depends_on_use |= factor.depends_on_use;
                    factor.texture
                }
            };
            made.lookups += 1;
            if made.lookups > MAX_LOOKUPS {
                let message = format!(
                    "with the factors of its factors, a product has more than {MAX_LOOKUPS} textures and colours"
                );
                return Err(files.error(&place, message));
            }
            product.push(texture);
        }
        if made.depth > MAX_DEPTH {
            return Err(files.error(&place, format!("products of textures are nested more than {MAX_DEPTH} deep")));
        }
        Ok(Made { texture: Texture::Product(product.into()), ..made })
    }

    fn texture(&mut self, name: &str, desc: &TextureDesc, texture_use: TextureUse) -> Result<Made> {
        let (files, path) = (self.files, &format!("textures.{name}"));
        let color = |key: &str, value: [f32; 3]| files.reflectance(&format!("{path}.{key}"), value).map(Rgb::from);
        let depends_on_use = matches!(desc, TextureDesc::Image { color_space: ColorSpaceDesc::Auto, .. });
        let texture = match desc {
            TextureDesc::Constant { color: value } => Texture::Constant(color("color", *value)?),
            TextureDesc::Checker { color0, color1, scale } => {
                let colors = [color("color0", *color0)?, color("color1", *color1)?];
                Texture::Checker(Checker { colors, scale: files.uv(&format!("{path}.scale"), *scale)? })
            }
            TextureDesc::VertexColor => Texture::Attribute(self.attribute(VERTEX_COLOR), 1.0),
            TextureDesc::MeshAttribute { name, scale } => self.mesh_attribute(path, name, *scale)?,
            TextureDesc::Product { factors } => return self.product(path, factors, texture_use),
            TextureDesc::Image {
                file,
                color_space,
                filter,
                wrap,
                scale,
                rotation_degrees,
                offset,
                channel,
                invert,
            } => {
                let scale = files.uv(&format!("{path}.scale"), *scale)?;
                let offset = files.uv(&format!("{path}.offset"), *offset)?;
                if !rotation_degrees.is_finite() {
                    return Err(files.error(&format!("{path}.rotation_degrees"), "is not finite"));
                }
                let place = format!("{path}.file");
                let image = match files.source.assets.images.get(file) {
                    _ if !self.used.contains(name) => kept_image(&mut self.images, files, &place, "", &blank())?,
                    Some(data) => kept_image(&mut self.images, files, &place, file, data)?,
                    None => load_image(&mut self.images, files, &place, &files.source.asset(file))?,
                };
                if *color_space == ColorSpaceDesc::Srgb && image.is_float() {
                    return Err(files.error(&format!("{path}.color_space"), "the image has floats, which are linear"));
                }
                Texture::Bitmap(Bitmap {
                    decoding: match (color_space, texture_use) {
                        (ColorSpaceDesc::Srgb, _) | (ColorSpaceDesc::Auto, TextureUse::Color) => Decoding::Srgb,
                        (ColorSpaceDesc::Linear, _) | (ColorSpaceDesc::Auto, TextureUse::Data) => Decoding::Linear,
                    },
                    image,
                    filter: texture_filter(*filter),
                    wrap: match wrap {
                        WrapDesc::Both(mode) => [wrap_mode(*mode); 2],
                        WrapDesc::Each(modes) => modes.map(wrap_mode),
                    },
                    transform: UvTransform::new(scale, rotation_degrees.to_radians(), offset),
                    channel: channel.map(single_channel),
                    invert: *invert,
                })
            }
        };
        Ok(Made { texture, depth: 0, lookups: 1, depends_on_use })
    }
}

fn wrap_mode(desc: WrapModeDesc) -> Wrap {
    match desc {
        WrapModeDesc::Repeat => Wrap::Repeat,
        WrapModeDesc::Clamp => Wrap::Clamp,
        WrapModeDesc::Mirror => Wrap::Mirror,
    }
}

fn texture_filter(desc: TextureFilterDesc) -> TextureFilter {
    match desc {
        TextureFilterDesc::Nearest => TextureFilter::Nearest,
        TextureFilterDesc::Bilinear => TextureFilter::Bilinear,
        TextureFilterDesc::Trilinear => TextureFilter::Trilinear,
    }
}

fn single_channel(desc: ChannelDesc) -> Channel {
    match desc {
        ChannelDesc::R => Channel::R,
        ChannelDesc::G => Channel::G,
        ChannelDesc::B => Channel::B,
        ChannelDesc::A => Channel::A,
    }
}

/// What an unused texture has in place of its image.
fn blank() -> ImageData {
    ImageData { width: 1, height: 1, channels: 1, samples: Samples::U8(vec![0]) }
}

/// The images of all used files that can be read, in parallel; the others are reported when they are used.
fn read_all(files: &CompileContext, desc: &SceneDesc, used: &UsedNames) -> HashMap<PathBuf, Arc<TextureImage>> {
    let file = |texture: &TextureDesc| match texture {
        TextureDesc::Image { file, .. } if !files.source.assets.images.contains_key(file) => {
            files.source.asset(file).canonicalize().ok()
        }
        _ => None,
    };
    let names: BTreeSet<PathBuf> = desc
        .textures
        .iter()
        .filter(|(name, _)| used.textures.contains(*name))
        .filter_map(|(_, texture)| file(texture))
        .collect();
    let read = |asset: PathBuf| {
        if let Some(kept) = files.cache.as_ref().and_then(|cache| cache.image(&asset)) {
            return Some((asset, kept));
        }
        let image = TextureImage::new(read_image(&asset).ok()?).ok()?;
        let image = Arc::new(image);
        if let Some(cache) = &files.cache {
            cache.keep_image(&asset, &image);
        }
        Some((asset, image))
    };
    names.into_par_iter().filter_map(read).collect()
}

/// An image that has no file, from `images` if it has been used before.
fn kept_image(
    images: &mut HashMap<PathBuf, Arc<TextureImage>>,
    files: &CompileContext,
    place: &str,
    name: &str,
    data: &ImageData,
) -> Result<Arc<TextureImage>> {
    let asset = PathBuf::from(name);
    if let Some(image) = images.get(&asset) {
        return Ok(Arc::clone(image));
    }
    let image = TextureImage::new(data.clone())
        .map_err(|e| files.asset_error(place, &asset, AssetError::Malformed(e.to_string())))?;
    Ok(Arc::clone(images.entry(asset).or_insert(Arc::new(image))))
}

/// The image in a file, from `images` if it has been read before.
fn load_image(
    images: &mut HashMap<PathBuf, Arc<TextureImage>>,
    files: &CompileContext,
    place: &str,
    asset: &Path,
) -> Result<Arc<TextureImage>> {
    let key = asset.canonicalize().unwrap_or_else(|_| asset.into());
    if let Some(image) = images.get(&key) {
        return Ok(Arc::clone(image));
    }
    let fault = |e| files.asset_error(place, asset, e);
    let data = read_image(asset).map_err(fault)?;
    let image = Arc::new(TextureImage::new(data).map_err(|e| fault(AssetError::Malformed(e.to_string())))?);
    images.insert(key, Arc::clone(&image));
    Ok(image)
}

impl CompileContext {
    /// Two finite numbers along u and v.
    fn uv(&self, path: &str, value: [f32; 2]) -> Result<Vec2> {
        let uv = Vec2::from(value);
        if uv.is_finite() { Ok(uv) } else { Err(self.error(path, format!("{value:?} is not finite"))) }
    }
}
