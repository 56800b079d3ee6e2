//! Emitters to lights.

use std::f32::consts::PI;

use super::Reader;
use super::element::Element;
use super::sensor::fov;
use super::textures::{Role, TextureValue, UvOrigin};
use super::tree::{PluginId, Value};
use super::values;
use crate::assets::{RgbImage, read_image};
use crate::color::linear_from_srgb;
use crate::desc::{
    DirectionalLightDesc, EmissionDesc, EnvironmentLightDesc, LightDesc, PointLightDesc, ProjectorLightDesc,
    SpotLightDesc, TextureDesc, TransformDesc, TransformStepDesc,
};
use crate::error::Result;
use crate::image_data::{ImageData, Samples};
use crate::math::{DAffine3, DMat3, DVec3};

impl<'a> Reader<'a> {
    /// Reads an emitter that is no shape.
    pub(super) fn emitter(&mut self, id: PluginId) -> Result<()> {
        let mut element = Element::new(self.document, id);
        self.medium_outside(&mut element)?;
        // Which light is sampled how often does not change the picture.
        element.float("sampling_weight")?;
        let light = match element.kind() {
            "point" => self.point(&mut element)?,
            "spot" => self.spot(&mut element)?,
            "projector" => self.projector(&mut element)?,
            "directional" => self.directional(&mut element)?,
            "constant" => {
                let radiance = self.emitted(&mut element, "radiance")?;
                LightDesc::Environment(EnvironmentLightDesc {
                    radiance: Some(radiance),
                    file: None,
                    scale: 1.0,
                    transform: None,
                    group: None,
                })
            }
            "envmap" => self.environment(&mut element)?,
            "sunsky" | "sky" | "sun" => {
                let place = element.place().to_string();
                for light in self.sunsky(&mut element)? {
                    self.draft.add_light(&place, light);
                }
                element.finish(&mut self.draft);
                return Ok(());
            }
            "area" => return Err(element.place().error("an area emitter can only stand in a shape")),
            _ => {
                self.whole(id, "unsupported emitter: its light is left out");
                return Ok(());
            }
        };
        let place = element.place().to_string();
        element.finish(&mut self.draft);
        self.draft.add_light(&place, light);
        Ok(())
    }

    /// The light that a shape emits.
    pub(super) fn emission(&mut self, id: PluginId, uv: UvOrigin) -> Result<Option<EmissionDesc>> {
        let mut element = Element::new(self.document, id);
        if element.kind() != "area" {
            self.whole(id, "unsupported emitter of a shape: its light is left out");
            return Ok(None);
        }
        element.float("sampling_weight")?;
        let property = element.plugin.properties.iter().find(|property| property.name == "radiance");
        let texture = match property.map(|property| self.document.plugin_of(property)).transpose()?.flatten() {
            Some(id) if self.document.plugins[id.0].class == "texture" => Some(id),
            _ => None,
        };
        let emission = match texture.map(|id| self.texture(id, Role::Color, uv)).transpose()? {
            Some(TextureValue::Named(texture)) => {
                element.take("radiance");
                EmissionDesc {
                    radiance: [1.0; 3],
                    texture: Some(texture),
                    two_sided: false,
                    hidden: false,
                    group: None,
                }
            }
            _ => EmissionDesc {
                radiance: self.emitted(&mut element, "radiance")?,
                texture: None,
                two_sided: false,
                hidden: false,
                group: None,
            },
        };
        element.finish(&mut self.draft);
        Ok(Some(emission))
    }

    /// The colour of light; white if it is not given.
    fn emitted(&mut self, element: &mut Element<'a>, name: &str) -> Result<[f32; 3]> {
        let Some(property) = element.take(name) else {
            return Ok([1.0; 3]);
        };
        let color = match (&property.value, self.document.plugin_of(property)?) {
            (Value::Spectrum(spectrum), _) => self.spectrum_color(spectrum, &property.place, true)?,
            (_, Some(id)) if self.document.plugins[id.0].class == "spectrum" => {
                let mut inner = Element::new(self.document, id);
                let color = self.spectrum_plugin(&mut inner, true)?;
                inner.finish(&mut self.draft);
                color
            }
            _ => match self.texture_value(property, Role::Color, UvOrigin::Mitsuba)? {
                TextureValue::Constant(color) => color,
                TextureValue::Named(_) => {
                    element.approximated(name, "white in place of a texture");
                    [1.0; 3]
                }
            },
        };
        Ok(color)
    }

    fn point(&mut self, element: &mut Element<'a>) -> Result<LightDesc> {
        let intensity = self.emitted(element, "intensity")?;
        let position = match element.vector("position")? {
            Some(position) => position,
            None => element.transform("to_world")?.translation.to_array(),
        };
        Ok(LightDesc::Point(PointLightDesc { position, intensity, group: None }))
    }

    fn spot(&mut self, element: &mut Element<'a>) -> Result<LightDesc> {
        let intensity = self.emitted(element, "intensity")?;
        let map = element.transform("to_world")?;
        let cutoff = element.float("cutoff_angle")?.unwrap_or(20.0);
        let beam = element.float("beam_width")?.unwrap_or(0.75 * cutoff);
        let (mut intensity, mut picture) = (intensity, None);
        if let Some(property) = element.take("texture") {
            match self.texture_value(property, Role::Color, UvOrigin::Upward)? {
                TextureValue::Constant(color) => intensity = [0, 1, 2].map(|i| intensity[i] * color[i]),
                TextureValue::Named(texture) => picture = Some(texture),
            }
            if picture.is_some() && map.matrix3.determinant() < 0.0 {
                element.approximated("to_world", "the light's picture is not mirrored");
            }
        }
        Ok(LightDesc::Spot(SpotLightDesc {
            position: map.translation.to_array(),
            look_at: (map.translation + map.matrix3.z_axis.normalize_or_zero()).to_array(),
            intensity,
            cutoff_angle_degrees: cutoff,
            beam_angle_degrees: Some(beam),
            // Mitsuba's u grows to the left and its v, downward in images, upward: the picture stands on its head.
            up: picture.as_ref().map(|_| (-map.matrix3.y_axis).to_array()),
            texture: picture,
            group: None,
        }))
    }

    fn projector(&mut self, element: &mut Element<'a>) -> Result<LightDesc> {
        let map = element.transform("to_world")?;
        // What Mitsuba calls irradiance is the radiance of a white diffuse plane.
        let scale = element.float("scale")?.unwrap_or(1.0) as f32 * PI;
        let picture = match element.take("irradiance") {
            None => TextureValue::Constant([1.0; 3]),
            Some(property) => match (&property.value, self.document.plugin_of(property)?) {
                (_, Some(id)) if self.document.plugins[id.0].class == "texture" => {
                    self.texture(id, Role::Color, UvOrigin::Upward)?
                }
                _ => TextureValue::Constant(self.emitted(element, "irradiance")?),
            },
        };
        let (irradiance, texture) = match picture {
            TextureValue::Constant(color) => (color.map(|c| c * scale), None),
            TextureValue::Named(texture) => ([scale; 3], Some(texture)),
        };
        let aspect = texture.as_ref().map_or(1.0, |texture| self.aspect(texture));
        if map.matrix3.determinant() < 0.0 {
            element.approximated("to_world", "the projector's picture is not mirrored");
        }
        Ok(LightDesc::Projector(ProjectorLightDesc {
            position: map.translation.to_array(),
            look_at: (map.translation + map.matrix3.z_axis.normalize_or_zero()).to_array(),
            up: Some(map.matrix3.y_axis.to_array()),
            texture,
            irradiance,
            vertical_fov_degrees: fov(element, aspect)?,
            aspect: Some(aspect),
            group: None,
        }))
    }

    /// The width over the height of the image that a texture is; 1 for what is none, or cannot be read, which is found
    /// when the scene is compiled.
    fn aspect(&self, texture: &str) -> f64 {
        let Some(TextureDesc::Image { file, .. }) = self.draft.desc.textures.get(texture) else { return 1.0 };
        let ratio = |image: &ImageData| image.width as f64 / image.height as f64;
        match self.draft.assets.images.get(file) {
            Some(image) => ratio(image),
            None => read_image(&self.scene.parent().unwrap_or(std::path::Path::new("")).join(file))
                .map_or(1.0, |image| ratio(&image)),
        }
    }

    fn directional(&mut self, element: &mut Element<'a>) -> Result<LightDesc> {
        let irradiance = self.emitted(element, "irradiance")?;
        let direction = match element.vector("direction")? {
            Some(direction) => direction,
            None => element.transform("to_world")?.matrix3.z_axis.to_array(),
        };
        Ok(LightDesc::Directional(DirectionalLightDesc {
            direction,
            irradiance,
            angular_diameter_degrees: 0.0,
            group: None,
        }))
    }

    fn environment(&mut self, element: &mut Element<'a>) -> Result<LightDesc> {
        let name = element.file("filename", self.scene)?;
        let name = name.ok_or_else(|| element.place().error("an envmap needs \"filename\""))?;
        let scale = element.float("scale")?.unwrap_or(1.0) as f32;
        element.boolean("mis_compensation", true)?;
        let map = element.transform("to_world")?;
        let transform = rotation(element, &map);
        let extension = name.rsplit('.').next().unwrap_or_default().to_lowercase();
        let file = if matches!(extension.as_str(), "exr" | "hdr") {
            name
        } else {
            self.converted_environment(element, &name)?
        };
        Ok(LightDesc::Environment(EnvironmentLightDesc {
            radiance: None,
            file: Some(file),
            scale,
            transform,
            group: None,
        }))
    }

    /// An image of whole numbers as an environment.
    fn converted_environment(&mut self, element: &Element<'a>, name: &str) -> Result<String> {
        let path = self.scene.parent().unwrap_or(std::path::Path::new("")).join(name);
        let image =
            read_image(&path).map_err(|e| e.at(self.scene, &element.place_of("filename").to_string(), &path))?;
        self.draft.files.insert(path);
        Ok(self.draft.keep_environment(name.rsplit('/').next().unwrap_or(name), as_environment(&image)))
    }
}

/// Turns Mitsuba's environment, whose first column is -Z, into Steradian's, whose middle is.
fn rotation(element: &mut Element, map: &DAffine3) -> Option<TransformDesc> {
    let m = map.matrix3;
    let x = m.x_axis.normalize_or(DVec3::X);
    let y = (m.y_axis - x * m.y_axis.dot(x)).normalize_or(x.any_orthonormal_vector());
    let z = x.cross(y);
    if z.dot(m.z_axis) <= 0.0 {
        element.approximated("to_world", "the environment is not mirrored");
    } else if (x - m.x_axis).length() + (y - m.y_axis).length() + (z - m.z_axis).length() > 1e-3 {
        element.approximated("to_world", "only the rotation of the environment is kept");
    }
    let half_turn = DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z);
    let placed = DAffine3 { matrix3: DMat3::from_cols(x, y, z) * half_turn, translation: DVec3::ZERO };
    Some(TransformDesc(vec![TransformStepDesc::Matrix(values::rows(&placed))]))
}

/// The linear colours of an image.
fn as_environment(image: &ImageData) -> RgbImage {
    let at = |i: usize| match &image.samples {
        Samples::U8(v) => linear_from_srgb(f32::from(v[i]) / 255.0),
        Samples::U16(v) => linear_from_srgb(f32::from(v[i]) / 65535.0),
        Samples::F16(v) => v[i].to_f32(),
        Samples::F32(v) => v[i],
    };
    let channels = image.channels;
    let pixel = |p: usize| [0, 1, 2].map(|c| at(p * channels + if channels < 3 { 0 } else { c }));
    RgbImage { width: image.width, height: image.height, pixels: (0..image.width * image.height).map(pixel).collect() }
}
