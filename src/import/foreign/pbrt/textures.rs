//! Textures: what they come to in a scene description, a constant or a texture there.

use std::collections::BTreeMap;

use super::colors::{Colors, Meaning};
use super::params::Params;
use crate::assets::read_image;
use crate::desc::{
    ChannelDesc, ColorDesc, ColorSpaceDesc, OpacityDesc, ScalarDesc, TextureDesc, TextureFilterDesc, WrapDesc,
    WrapModeDesc,
};
use crate::error::Result;
use crate::image_data::{ImageData, Samples};
use crate::import::foreign::Draft;

/// A texture, or a colour or number in its place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Texture {
    /// The same everywhere.
    Constant([f32; 3]),
    /// A texture of the scene by its name, times a factor.
    Named {
        /// The name.
        name: String,
        /// The factor.
        factor: [f32; 3],
    },
}

impl Texture {
    /// The same everywhere, grey.
    pub fn grey(value: f32) -> Self {
        Self::Constant([value; 3])
    }

    /// Times a factor.
    #[must_use]
    pub fn times(self, by: [f32; 3]) -> Self {
        let product = |a: [f32; 3]| std::array::from_fn(|i| a[i] * by[i]);
        match self {
            Self::Constant(value) => Self::Constant(product(value)),
            Self::Named { name, factor } => Self::Named { name, factor: product(factor) },
        }
    }

    /// Its name in the scene, with the factor in a texture of its own where it has one.
    pub fn name(self, draft: &mut Draft, place: &str) -> Option<String> {
        match self {
            Self::Constant(_) => None,
            Self::Named { name, factor } if factor == [1.0; 3] => Some(name),
            Self::Named { name, factor } => {
                let scaled = format!("{name}_scaled");
                let factors = vec![ColorDesc::Texture { texture: name }, ColorDesc::Rgb(factor)];
                Some(draft.add_texture(&scaled, place, TextureDesc::Product { factors }))
            }
        }
    }

    /// As a reflectance.
    pub fn color(self, draft: &mut Draft, place: &str) -> ColorDesc {
        match self {
            Self::Constant(value) => ColorDesc::Rgb(value.map(|x| x.clamp(0.0, 1.0))),
            named => named.name(draft, place).map_or(ColorDesc::Grey(0.5), |texture| ColorDesc::Texture { texture }),
        }
    }

    /// As a share.
    pub fn scalar(self, draft: &mut Draft, place: &str) -> ScalarDesc {
        match self {
            Self::Constant(value) => ScalarDesc::Constant(value[0].clamp(0.0, 1.0)),
            named => {
                named.name(draft, place).map_or(ScalarDesc::Constant(0.5), |texture| ScalarDesc::Texture { texture })
            }
        }
    }

    /// As an opacity; `None` if all is there.
    pub fn opacity(self, draft: &mut Draft, place: &str) -> Option<OpacityDesc> {
        match self {
            Self::Constant(value) if value[0] >= 1.0 => None,
            Self::Constant(value) => Some(OpacityDesc::Number(value[0].max(0.0))),
            named => named.name(draft, place).map(|texture| OpacityDesc::Texture { texture, threshold: None }),
        }
    }
}

/// A `Texture` directive.
pub struct TextureDirective<'a> {
    /// The texture's name.
    pub name: &'a str,
    /// Whether its values are numbers, not colours.
    pub of_numbers: bool,
    /// The class, such as `imagemap`.
    pub kind: &'a str,
    /// The parameters.
    pub params: Params,
}

/// The textures of a file by name; those of numbers and those of colours have names of their own.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    numbers: BTreeMap<String, Texture>,
    colors: BTreeMap<String, Texture>,
}

impl Textures {
    /// The value of a parameter: a texture by name, a number or a colour; `None` if it is not given.
    pub fn get(
        &self,
        params: &Params,
        colors: &Colors,
        name: &str,
        meaning: Meaning,
        of_numbers: bool,
    ) -> Result<Option<Texture>> {
        let Some(param) = params.get(name) else { return Ok(None) };
        if param.kind != "texture" {
            return if of_numbers {
                Ok(params.number(name)?.map(|x| Texture::grey(x as f32)))
            } else {
                Ok(colors.get(params, name, meaning)?.map(Texture::Constant))
            };
        }
        let texture = params.string(name)?.unwrap_or_default();
        let known = if of_numbers { &self.numbers } else { &self.colors };
        match known.get(texture) {
            Some(found) => Ok(Some(found.clone())),
            None => {
                let kind = if of_numbers { "float" } else { "spectrum" };
                Err(param.error(format!("no {kind} texture named \"{texture}\"")))
            }
        }
    }

    /// A number or a texture of numbers, or a default.
    pub fn number(&self, params: &Params, colors: &Colors, name: &str, default: f32) -> Result<Texture> {
        Ok(self.get(params, colors, name, Meaning::Number, true)?.unwrap_or(Texture::grey(default)))
    }

    /// A reflectance or a texture of such, or a default.
    pub fn reflectance(&self, params: &Params, colors: &Colors, name: &str, default: f32) -> Result<Texture> {
        Ok(self.get(params, colors, name, Meaning::Reflectance, false)?.unwrap_or(Texture::grey(default)))
    }

    /// Reads a `Texture` directive.
    pub fn define(&mut self, draft: &mut Draft, directive: &TextureDirective, colors: &Colors) -> Result<()> {
        let &TextureDirective { name, of_numbers, kind, ref params } = directive;
        let read = |key: &str, default: f32| -> Result<Texture> {
            let found = self.get(params, colors, key, Meaning::Number, of_numbers)?;
            Ok(found.unwrap_or(Texture::grey(default)))
        };
        let texture = match kind {
            "constant" => read("value", 1.0)?,
            "scale" => {
                let tex = read("tex", 1.0)?;
                // The factor is a number even where colours are scaled.
                let scale = match self.get(params, colors, "scale", Meaning::Number, true)? {
                    Some(scale) => scale,
                    None => Texture::grey(1.0),
                };
                self.product(draft, name, params, tex, scale)
            }
            "mix" => {
                let (first, second) = (read("tex1", 0.0)?, read("tex2", 1.0)?);
                let amount = self.number(params, colors, "amount", 0.5)?;
                mix(params, first, second, &amount)
            }
            "directionmix" => {
                params.approximate("dir", "the mean of both");
                mix(params, read("tex1", 0.0)?, read("tex2", 1.0)?, &Texture::grey(0.5))
            }
            "imagemap" => image(draft, name, of_numbers, params, colors)?,
            "checkerboard" => {
                let (first, second) = (read("tex1", 1.0)?, read("tex2", 0.0)?);
                checkerboard(draft, name, params, &first, &second)?
            }
            "dots" => {
                params.approximate("inside", "the outside everywhere");
                read("outside", 0.0)?
            }
            "fbm" | "wrinkled" | "windy" | "marble" | "bilerp" | "ptex" => {
                draft.approximated(&params.place, &params.element, "", "the same grey of 0.5 everywhere");
                Texture::grey(0.5)
            }
            other => return Err(params.error(format!("unknown texture \"{other}\""))),
        };
        params.report(draft);
        let known = if of_numbers { &mut self.numbers } else { &mut self.colors };
        if known.insert(name.to_owned(), texture).is_some() {
            return Err(params.error(format!("the texture \"{name}\" is defined twice")));
        }
        Ok(())
    }

    fn product(&self, draft: &mut Draft, name: &str, params: &Params, a: Texture, b: Texture) -> Texture {
        match (a, b) {
            (Texture::Constant(value), other) | (other, Texture::Constant(value)) => other.times(value),
            (Texture::Named { name: a, factor: fa }, Texture::Named { name: b, factor: fb }) => {
                let factors = vec![ColorDesc::Texture { texture: a }, ColorDesc::Texture { texture: b }];
                let name = draft.add_texture(name, &params.place, TextureDesc::Product { factors });
                Texture::Named { name, factor: std::array::from_fn(|i| fa[i] * fb[i]) }
            }
        }
    }
}

/// Textures cannot be mixed, constants can.
fn mix(params: &Params, first: Texture, second: Texture, amount: &Texture) -> Texture {
    let share = match amount {
        Texture::Constant(value) => value[0].clamp(0.0, 1.0),
        Texture::Named { .. } => {
            params.approximate("amount", "a half everywhere");
            0.5
        }
    };
    match (&first, &second) {
        (Texture::Constant(a), Texture::Constant(b)) => {
            Texture::Constant(std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share))
        }
        _ if share == 0.0 => first,
        _ if share == 1.0 => second,
        _ => {
            let how = "the one of which there is more, for textures cannot be mixed";
            params.approximate(if share > 0.5 { "tex1" } else { "tex2" }, how);
            if share > 0.5 { second } else { first }
        }
    }
}

fn checkerboard(draft: &mut Draft, name: &str, params: &Params, first: &Texture, second: &Texture) -> Result<Texture> {
    let color = |key: &str, texture: &Texture| match texture {
        Texture::Constant(value) => *value,
        Texture::Named { factor, .. } => {
            params.approximate(key, "grey in place of a texture within a texture");
            factor.map(|x| 0.5 * x)
        }
    };
    let (color0, color1) = (color("tex1", first), color("tex2", second));
    if params.integer_or("dimension", 2)? != 2 {
        params.approximate("dimension", "in uv, not in space");
    }
    note_mapping(params)?;
    for key in ["udelta", "vdelta"] {
        if params.number_or(key, 0.0)?.rem_euclid(2.0) != 0.0 {
            params.ignore(key, "a checkerboard begins at the origin of uv");
        }
    }
    // A square of pbrt's is one unit wide, Steradian's half a repetition.
    let scale = [0.5 * params.number_or("uscale", 1.0)? as f32, 0.5 * params.number_or("vscale", 1.0)? as f32];
    let name = draft.add_texture(name, &params.place, TextureDesc::Checker { color0, color1, scale });
    Ok(Texture::Named { name, factor: [1.0; 3] })
}

/// The channel that pbrt takes for a number: alpha if not all of the image is opaque, else the mean of the colours.
fn number_channel(image: &ImageData, params: &Params) -> Option<ChannelDesc> {
    let has_alpha = image.channels.is_multiple_of(2);
    let pixels = image.width * image.height;
    let opaque = |i: usize| match &image.samples {
        Samples::U8(v) => v.get(i) == Some(&u8::MAX),
        Samples::U16(v) => v.get(i) == Some(&u16::MAX),
        Samples::F16(v) => v.get(i).is_some_and(|x| x.to_f32() == 1.0),
        Samples::F32(v) => v.get(i) == Some(&1.0),
    };
    if has_alpha && !(0..pixels).all(|i| opaque(i * image.channels + image.channels - 1)) {
        params.approximate("filename", "alpha as it is stored, not through a curve");
        return Some(ChannelDesc::A);
    }
    let same = |i: usize, j: usize| match &image.samples {
        Samples::U8(v) => v.get(i) == v.get(j),
        Samples::U16(v) => v.get(i) == v.get(j),
        Samples::F16(v) => v.get(i) == v.get(j),
        Samples::F32(v) => v.get(i) == v.get(j),
    };
    let is_grey =
        image.channels < 3 || (0..pixels).map(|i| i * image.channels).all(|i| same(i, i + 1) && same(i, i + 2));
    if is_grey {
        return Some(ChannelDesc::R);
    }
    let how = if has_alpha { "the green channel" } else { "the luminance" };
    params.approximate("filename", format!("{how} in place of the mean of the channels"));
    has_alpha.then_some(ChannelDesc::G)
}

fn note_mapping(params: &Params) -> Result<()> {
    if params.string("mapping")?.is_some_and(|mapping| mapping != "uv") {
        params.approximate("mapping", "by the uv of the surface");
    }
    Ok(())
}

fn image(draft: &mut Draft, name: &str, of_numbers: bool, params: &Params, colors: &Colors) -> Result<Texture> {
    let Some(file) = params.string("filename")? else { return Err(params.error("needs a filename")) };
    note_mapping(params)?;
    let filter = match params.string("filter")?.unwrap_or("bilinear") {
        "point" => TextureFilterDesc::Nearest,
        "bilinear" => TextureFilterDesc::Bilinear,
        _ => TextureFilterDesc::Trilinear,
    };
    let wrap = match params.string("wrap")?.unwrap_or("repeat") {
        "repeat" => WrapModeDesc::Repeat,
        "clamp" => WrapModeDesc::Clamp,
        other => {
            params.approximate("wrap", format!("the colours of the edge beyond it, in place of {other}"));
            WrapModeDesc::Clamp
        }
    };
    params.ignore("maxanisotropy", "filters are isotropic");
    let color_space = match params.string("encoding")?.unwrap_or("sRGB") {
        "linear" => ColorSpaceDesc::Linear,
        "sRGB" => ColorSpaceDesc::Srgb,
        other => {
            params.approximate("encoding", format!("sRGB in place of {other}"));
            ColorSpaceDesc::Srgb
        }
    };
    let scale = params.number_or("scale", 1.0)? as f32;
    let invert = params.bool_or("invert", false)?;
    if invert && scale != 1.0 {
        params.approximate("scale", "after the inversion, not before it");
    }
    // What cannot be read is found out when the scene is compiled.
    let data = if of_numbers { read_image(&colors.folder.join(file)).ok() } else { None };
    let channel = data.and_then(|data| number_channel(&data, params));
    let at = |u: &str, v: &str, default: f64| -> Result<[f32; 2]> {
        Ok([params.number_or(u, default)? as f32, params.number_or(v, default)? as f32])
    };
    let texture = TextureDesc::Image {
        file: file.into(),
        color_space,
        filter,
        wrap: WrapDesc::Both(wrap),
        scale: at("uscale", "vscale", 1.0)?,
        rotation_degrees: 0.0,
        offset: at("udelta", "vdelta", 0.0)?,
        channel,
        invert,
    };
    let name = draft.add_texture(name, &params.place, texture);
    Ok(Texture::Named { name, factor: [scale; 3] })
}

/// An image that a light or a material names itself, without a texture.
pub fn bilinear_image(file: &str, color_space: ColorSpaceDesc, wrap: WrapDesc) -> TextureDesc {
    TextureDesc::Image {
        file: file.into(),
        color_space,
        filter: TextureFilterDesc::Bilinear,
        wrap,
        scale: [1.0; 2],
        rotation_degrees: 0.0,
        offset: [0.0; 2],
        channel: None,
        invert: false,
    }
}
