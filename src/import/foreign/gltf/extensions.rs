//! Extensions as plain structs: each field with the default of its extension.

use gltf::json::Root;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::GltfSource;
use crate::error::Result;

impl GltfSource<'_> {
    /// The extension `name` of the object at `path`, if it has it.
    pub fn extension<T: DeserializeOwned>(
        &self,
        path: &str,
        extensions: Option<&Map<String, Value>>,
        name: &str,
    ) -> Result<Option<T>> {
        let Some(value) = extensions.and_then(|extensions| extensions.get(name)) else { return Ok(None) };
        let read =
            T::deserialize(value).map_err(|e| self.fault(&format!("{path}.extensions.{name}"), e.to_string()))?;
        Ok(Some(read))
    }
}

/// The extensions of the whole file.
pub fn of_root(root: &Root) -> Option<&Map<String, Value>> {
    root.extensions.as_ref().map(|extensions| &extensions.others)
}

/// A texture as an extension names it.
#[derive(Clone, Debug, Deserialize)]
pub struct TextureInfo {
    pub index: usize,
    #[serde(default, rename = "texCoord")]
    pub tex_coord: u32,
    #[serde(default)]
    pub extensions: Option<Map<String, Value>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct TextureTransform {
    pub offset: [f32; 2],
    pub rotation: f32,
    pub scale: [f32; 2],
    pub tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

/// Declares structs with a default for each field.
macro_rules! extensions {
    ($($name:ident { $($field:ident: $type:ty = $default:expr,)* })*) => {
        $(
            #[derive(Clone, Debug, Deserialize)]
            #[serde(default, rename_all = "camelCase")]
            pub struct $name {
                $(pub $field: $type,)*
            }

            impl Default for $name {
                fn default() -> Self {
                    Self { $($field: $default,)* }
                }
            }
        )*
    };
}

extensions! {
    Ior { ior: f32 = 1.5, }
    EmissiveStrength { emissive_strength: f32 = 1.0, }
    Dispersion { dispersion: f32 = 0.0, }
    Transmission {
        transmission_factor: f32 = 0.0,
        transmission_texture: Option<TextureInfo> = None,
    }
    Volume {
        thickness_factor: f32 = 0.0,
        thickness_texture: Option<TextureInfo> = None,
        attenuation_distance: f32 = f32::INFINITY,
        attenuation_color: [f32; 3] = [1.0; 3],
    }
    VolumeScatter {
        multiscatter_color: [f32; 3] = [0.0; 3],
        scatter_anisotropy: f32 = 0.0,
    }
    DiffuseTransmission { diffuse_transmission_factor: f32 = 0.0, }
    Clearcoat {
        clearcoat_factor: f32 = 0.0,
        clearcoat_texture: Option<TextureInfo> = None,
        clearcoat_roughness_factor: f32 = 0.0,
        clearcoat_roughness_texture: Option<TextureInfo> = None,
        clearcoat_normal_texture: Option<TextureInfo> = None,
    }
    Sheen {
        sheen_color_factor: [f32; 3] = [0.0; 3],
        sheen_color_texture: Option<TextureInfo> = None,
        sheen_roughness_factor: f32 = 0.0,
        sheen_roughness_texture: Option<TextureInfo> = None,
    }
    Specular {
        specular_factor: f32 = 1.0,
        specular_texture: Option<TextureInfo> = None,
        specular_color_factor: [f32; 3] = [1.0; 3],
        specular_color_texture: Option<TextureInfo> = None,
    }
    Anisotropy {
        anisotropy_strength: f32 = 0.0,
        anisotropy_rotation: f32 = 0.0,
        anisotropy_texture: Option<TextureInfo> = None,
    }
    SpecularGlossiness {
        diffuse_factor: [f32; 4] = [1.0; 4],
        diffuse_texture: Option<TextureInfo> = None,
        specular_factor: [f32; 3] = [1.0; 3],
        glossiness_factor: f32 = 1.0,
        specular_glossiness_texture: Option<TextureInfo> = None,
    }
    Lights { lights: Vec<Light> = Vec::new(), }
    Spot {
        inner_cone_angle: f64 = 0.0,
        outer_cone_angle: f64 = std::f64::consts::FRAC_PI_4,
    }
    Instancing { attributes: std::collections::BTreeMap<String, usize> = std::collections::BTreeMap::new(), }
}

/// A light of the list.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Light {
    #[serde(rename = "type")]
    pub kind: LightKind,
    #[serde(default)]
    pub name: Option<String>,
    #[serde(default = "white")]
    pub color: [f32; 3],
    #[serde(default = "one")]
    pub intensity: f32,
    #[serde(default)]
    pub range: Option<f64>,
    #[serde(default)]
    pub spot: Option<Spot>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    Directional,
    Point,
    Spot,
}

/// The light of a node.
#[derive(Clone, Debug, Deserialize)]
pub struct LightIndex {
    pub light: usize,
}

fn one() -> f32 {
    1.0
}

fn white() -> [f32; 3] {
    [1.0; 3]
}
