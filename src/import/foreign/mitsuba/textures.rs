//! Textures and spectra to colours, numbers and textures.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use super::Reader;
use super::element::Element;
use super::tree::{PluginId, Property, Value};
use crate::attribute::is_of_faces;
use crate::desc::{
    ChannelDesc, ColorDesc, ColorSpaceDesc, RangedDesc, ScalarDesc, TextureDesc, TextureFilterDesc, WrapDesc,
    WrapModeDesc,
};
use crate::error::Result;
use crate::image_data::{ImageData, Samples};
use crate::math::{DAffine3, DMat3, DVec3, dvec3};

/// How the uv of a shape differs from that in Mitsuba, whose images have their origin at the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum UvOrigin {
    /// The same numbers: v grows downward in images.
    Mitsuba,
    /// It is one minus Mitsuba's: v grows upward in images.
    Upward,
    /// u is Mitsuba's v and the other way round, as on disks.
    Swapped,
}

/// The use of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    /// A colour.
    Color,
    /// A number.
    Number,
}

/// What a texture has become.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureValue {
    /// One colour.
    Constant([f32; 3]),
    /// A texture by name.
    Named(String),
}

/// How to mirror v.
const MIRROR: DAffine3 =
    DAffine3 { matrix3: DMat3 { x_axis: DVec3::X, y_axis: DVec3::NEG_Y, z_axis: DVec3::Z }, translation: DVec3::Y };

impl UvOrigin {
    /// Mitsuba's uv from Steradian's.
    fn to_mitsuba(self) -> DAffine3 {
        match self {
            Self::Mitsuba => DAffine3::IDENTITY,
            Self::Upward => MIRROR,
            Self::Swapped => {
                DAffine3 { matrix3: DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::Z), translation: DVec3::ZERO }
            }
        }
    }
}

/// The luminance of a linear colour.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.212671 * r + 0.715160 * g + 0.072169 * b
}

/// A colour, as a grey if it is one.
pub fn plain(color: [f32; 3]) -> ColorDesc {
    if color == [color[0]; 3] { ColorDesc::Grey(color[0]) } else { ColorDesc::Rgb(color) }
}

impl<'a> Reader<'a> {
    /// A colour of a surface by name.
    pub(super) fn color(
        &mut self,
        element: &mut Element<'a>,
        name: &str,
        default: f32,
        uv: UvOrigin,
    ) -> Result<ColorDesc> {
        let Some(property) = element.take(name) else {
            return Ok(ColorDesc::Grey(default));
        };
        Ok(match self.texture_value(property, Role::Color, uv)? {
            TextureValue::Constant(color) => plain(color),
            TextureValue::Named(texture) => ColorDesc::Texture { texture },
        })
    }

    /// A number of a surface by name, times `factor`.
    pub(super) fn scalar(
        &mut self,
        element: &mut Element<'a>,
        name: &str,
        default: f32,
        factor: f32,
        uv: UvOrigin,
    ) -> Result<ScalarDesc> {
        let Some(property) = element.take(name) else {
            return Ok(ScalarDesc::Constant(default * factor));
        };
        Ok(match self.texture_value(property, Role::Number, uv)? {
            TextureValue::Constant(color) => ScalarDesc::Constant(luminance_of(color) * factor),
            TextureValue::Named(texture) if factor == 1.0 => ScalarDesc::Texture { texture },
            TextureValue::Named(texture) => {
                let grey = |color: [f32; 3]| color.map(|c| c * factor);
                let product = || TextureDesc::Product {
                    factors: vec![ColorDesc::Grey(factor), ColorDesc::Texture { texture: texture.clone() }],
                };
                let (scaled, is_usable) = match self.draft.desc.textures.get(&texture) {
                    Some(TextureDesc::Checker { color0, color1, scale }) => {
                        let scaled =
                            TextureDesc::Checker { color0: grey(*color0), color1: grey(*color1), scale: *scale };
                        (scaled, [color0, color1].iter().all(|color| color.iter().all(|&c| c <= 1.0)))
                    }
                    _ => (product(), true),
                };
                // Colours above 1 are good for nothing else.
                if !is_usable {
                    self.draft.desc.textures.insert(texture.clone(), scaled);
                    return Ok(ScalarDesc::Texture { texture });
                }
                ScalarDesc::Texture { texture: self.draft.add_texture(&texture, &property.place.to_string(), scaled) }
            }
        })
    }

    /// As [`Self::scalar`], where one number is needed: of a texture its first one.
    pub(super) fn constant(&mut self, element: &mut Element<'a>, name: &str, uv: UvOrigin) -> Result<Option<[f32; 3]>> {
        let Some(property) = element.take(name) else {
            return Ok(None);
        };
        match self.texture_value(property, Role::Color, uv)? {
            TextureValue::Constant(color) => Ok(Some(color)),
            TextureValue::Named(_) => {
                element.approximated(name, "one value in place of a texture: 1");
                Ok(Some([1.0; 3]))
            }
        }
    }

    /// An index of refraction of a principled surface by name.
    pub(super) fn ranged(&mut self, element: &mut Element<'a>, name: &str, uv: UvOrigin) -> Result<Option<RangedDesc>> {
        Ok(self.constant(element, name, uv)?.map(|color| RangedDesc::Constant(luminance_of(color))))
    }

    /// A colour, a number, a spectrum or a texture.
    pub(super) fn texture_value(&mut self, property: &Property, role: Role, uv: UvOrigin) -> Result<TextureValue> {
        if let Some(id) = self.document.plugin_of(property)? {
            return self.texture(id, role, uv);
        }
        Ok(TextureValue::Constant(match &property.value {
            Value::Float(v) => [*v as f32; 3],
            Value::Integer(v) => [*v as f32; 3],
            Value::Rgb(color) => *color,
            Value::Spectrum(spectrum) => self.spectrum_color(spectrum, &property.place, false)?,
            _ => {
                return Err(property
                    .place
                    .error(format!("\"{}\" must be a colour, a number or a texture", property.name)));
            }
        }))
    }

    /// What a texture becomes.
    pub(super) fn texture(&mut self, id: PluginId, role: Role, uv: UvOrigin) -> Result<TextureValue> {
        if let Some(value) = self.textures.get(&(id, role, uv)) {
            return Ok(value.clone());
        }
        if self.document.plugins[id.0].kind != "checkerboard" && role == Role::Number {
            return self.texture(id, Role::Color, uv);
        }
        self.guard(id)?;
        let mut element = Element::new(self.document, id);
        let value = match (element.plugin.class.as_str(), element.kind()) {
            ("texture", "bitmap") => TextureValue::Named(self.bitmap(&mut element, uv)?),
            ("texture", "checkerboard") => self.checkerboard(&mut element, role, uv)?,
            ("texture", "mesh_attribute") => self.mesh_attribute(&mut element)?,
            ("texture" | "spectrum", "rawconstant") => TextureValue::Constant(raw_constant(&mut element)?),
            ("spectrum", _) => TextureValue::Constant(self.spectrum_plugin(&mut element, false)?),
            ("texture", _) => {
                element.ignored("", "unsupported texture: a grey of 0.5 in its place");
                TextureValue::Constant([0.5; 3])
            }
            (class, _) => return Err(element.place().error(format!("a {class} is no texture"))),
        };
        element.finish(&mut self.draft);
        self.open.pop();
        self.textures.insert((id, role, uv), value.clone());
        Ok(value)
    }

    /// An attribute of meshes. Whether a mesh has it is found when the scene is compiled.
    fn mesh_attribute(&mut self, element: &mut Element<'a>) -> Result<TextureValue> {
        let attribute =
            element.text("name")?.ok_or_else(|| element.place().error("a mesh_attribute needs \"name\""))?;
        if is_of_faces(attribute).is_none() {
            return Err(element
                .place_of("name")
                .error(format!("\"{attribute}\" is no name of an attribute: it begins with vertex_ or face_")));
        }
        let scale = element.float("scale")?.unwrap_or(1.0) as f32;
        if !(scale.is_finite() && scale >= 0.0) {
            return Err(element
                .place_of("scale")
                .error(format!("\"scale\" must be finite and not below 0, not {scale}")));
        }
        let name = if element.plugin.id.is_empty() { attribute } else { &element.plugin.id };
        let texture = TextureDesc::MeshAttribute { name: attribute.into(), scale };
        Ok(TextureValue::Named(self.draft.add_texture(name, &element.place().to_string(), texture)))
    }

    fn bitmap(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<String> {
        let file = element.file("filename", self.scene)?;
        let file = file.ok_or_else(|| element.place().error("a bitmap needs \"filename\""))?;
        let is_raw = element.boolean("raw", false)?;
        let filter = match element.text("filter_type")?.unwrap_or("bilinear") {
            "nearest" => TextureFilterDesc::Nearest,
            "bilinear" => TextureFilterDesc::Bilinear,
            other => {
                return Err(element
                    .place_of("filter_type")
                    .error(format!("\"{other}\" is neither bilinear nor nearest")));
            }
        };
        let wrap = match element.text("wrap_mode")?.unwrap_or("repeat") {
            "repeat" => WrapModeDesc::Repeat,
            "mirror" => WrapModeDesc::Mirror,
            "clamp" => WrapModeDesc::Clamp,
            other => {
                return Err(element
                    .place_of("wrap_mode")
                    .error(format!("\"{other}\" is neither repeat, mirror nor clamp")));
            }
        };
        // How Mitsuba keeps it in memory, not what it looks like.
        element.text("format")?;
        element.boolean("accel", true)?;
        let color_space = if is_raw || is_float(&file) { ColorSpaceDesc::Linear } else { ColorSpaceDesc::Srgb };
        let map = MIRROR * element.transform("to_uv")? * uv.to_mitsuba();
        let (scale, rotation_degrees, offset) = uv_steps(element, &map);
        let texture = TextureDesc::Image {
            color_space,
            filter,
            wrap: WrapDesc::Both(wrap),
            scale,
            rotation_degrees,
            offset,
            channel: None,
            invert: false,
            file: file.clone(),
        };
        let stem = Path::new(&file).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let name = if element.plugin.id.is_empty() { stem } else { element.plugin.id.clone() };
        Ok(self.draft.add_texture(&name, &element.place().to_string(), texture))
    }

    fn checkerboard(&mut self, element: &mut Element<'a>, role: Role, uv: UvOrigin) -> Result<TextureValue> {
        let mut colors = [[0.4; 3], [0.2; 3]];
        for (color, name) in colors.iter_mut().zip(["color0", "color1"]) {
            *color = self.constant(element, name, uv)?.unwrap_or(*color);
        }
        if role == Role::Number {
            // Where a number is needed, Mitsuba (3.9) takes the other colour.
            colors.swap(0, 1);
        }
        let map = element.transform("to_uv")? * uv.to_mitsuba();
        let [x, y] = [map.matrix3.x_axis, map.matrix3.y_axis];
        // Half a period along an axis swaps the colours.
        let halves = [map.translation.x, map.translation.y].map(|t| 2.0 * (t - t.floor()));
        let is_plain = x.y.abs() < 1e-9 && y.x.abs() < 1e-9 && halves.iter().all(|h| (h - h.round()).abs() < 1e-9);
        let texture = if is_plain {
            if halves.iter().filter(|h| h.round() == 1.0).count() == 1 {
                colors.swap(0, 1);
            }
            TextureDesc::Checker { color0: colors[0], color1: colors[1], scale: [x.x as f32, y.y as f32] }
        } else {
            // An image of four pixels takes any transform.
            let pixels = [colors[0], colors[1], colors[1], colors[0]].concat();
            let image = ImageData { width: 2, height: 2, channels: 3, samples: Samples::F32(pixels) };
            let file = self.draft.keep_image("checkerboard", image);
            let (scale, rotation_degrees, offset) = uv_steps(element, &(MIRROR * map));
            TextureDesc::Image {
                file,
                color_space: ColorSpaceDesc::Linear,
                filter: TextureFilterDesc::Nearest,
                wrap: WrapDesc::default(),
                scale,
                rotation_degrees,
                offset,
                channel: None::<ChannelDesc>,
                invert: false,
            }
        };
        let name = if element.plugin.id.is_empty() { "checkerboard" } else { &element.plugin.id };
        Ok(TextureValue::Named(self.draft.add_texture(name, &element.place().to_string(), texture)))
    }
}

/// The luminance, exact for greys.
fn luminance_of(color: [f32; 3]) -> f32 {
    if color == [color[0]; 3] { color[0] } else { luminance(color) }
}

fn raw_constant(element: &mut Element) -> Result<[f32; 3]> {
    let property = element.take("value").ok_or_else(|| element.place().error("a rawconstant needs \"value\""))?;
    match &property.value {
        Value::Float(v) => Ok([*v as f32; 3]),
        Value::Vector(v) => Ok(v.map(|v| v as f32)),
        Value::Rgb(v) => Ok(*v),
        _ => Err(property.place.error("\"value\" must be a number or a vector")),
    }
}

/// Whether the numbers of an image file are linear floats.
fn is_float(file: &str) -> bool {
    let extension = Path::new(file).extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    ["exr", "hdr", "rgbe", "pfm"].contains(&extension.as_str())
}

/// An affine map of uv as a scale, a rotation in degrees and an offset.
fn uv_steps(element: &mut Element, map: &DAffine3) -> ([f32; 2], f64, [f32; 2]) {
    let flat = |v: DVec3| dvec3(v.x, v.y, 0.0);
    let (x, y) = (flat(map.matrix3.x_axis), flat(map.matrix3.y_axis));
    let length = x.length();
    if x.dot(y).abs() > 1e-6 * (length * y.length()).max(1e-12) {
        element.approximated("to_uv", "the transform shears the image, which is left out");
    }
    let mut angle = x.y.atan2(x.x);
    let mut scale = [length, if length > 0.0 { x.cross(y).z / length } else { y.length() }];
    if angle.abs() > FRAC_PI_2 + 1e-9 {
        angle -= std::f64::consts::PI.copysign(angle);
        scale = scale.map(|s| -s);
    }
    (scale.map(|s| s as f32), angle.to_degrees(), [map.translation.x as f32, map.translation.y as f32])
}
