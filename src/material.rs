//! Materials: textures and parameters that become a [`Bsdf`] at a point.

use crate::bsdf::{Bsdf, Conductor, Dielectric, Lambert, Mirror, Plastic};
use crate::color::Rgb;
use crate::id::TextureId;
use crate::math::Vec2;
use crate::texture::Texture;

/// A colour that is constant or comes from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// The same everywhere.
    Constant(Rgb),
    /// Looked up by uv.
    Texture(TextureId),
}

impl ColorInput {
    /// The colour at `uv`.
    #[inline]
    pub fn at(&self, textures: &[Texture], uv: Vec2) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            Self::Texture(id) => textures[id.index()].color(uv),
        }
    }
}

/// A material: what is constant is prepared once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// The same scattering everywhere.
    Constant(Bsdf),
    /// Diffuse with a varying albedo.
    Diffuse {
        /// Albedo.
        albedo: ColorInput,
    },
    /// Plastic with a varying diffuse colour.
    Plastic {
        /// Everything else.
        base: Plastic,
        /// Colour of the diffuse base.
        albedo: ColorInput,
    },
}

impl Material {
    /// The scattering at `uv`.
    #[inline]
    pub fn bsdf(&self, textures: &[Texture], uv: Vec2) -> Bsdf {
        match self {
            Self::Constant(bsdf) => *bsdf,
            Self::Diffuse { albedo } => Bsdf::Lambert(Lambert { albedo: albedo.at(textures, uv) }),
            Self::Plastic { base, albedo } => Bsdf::Plastic(Plastic { diffuse: albedo.at(textures, uv), ..*base }),
        }
    }

    /// Whether light sampling is pointless everywhere on the material.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Constant(bsdf) => bsdf.is_delta(),
            Self::Diffuse { .. } | Self::Plastic { .. } => false,
        }
    }
}

impl From<Lambert> for Material {
    fn from(bsdf: Lambert) -> Self {
        Self::Constant(Bsdf::Lambert(bsdf))
    }
}

impl From<Mirror> for Material {
    fn from(bsdf: Mirror) -> Self {
        Self::Constant(Bsdf::Mirror(bsdf))
    }
}

impl From<Conductor> for Material {
    fn from(bsdf: Conductor) -> Self {
        Self::Constant(Bsdf::Conductor(bsdf))
    }
}

impl From<Dielectric> for Material {
    fn from(bsdf: Dielectric) -> Self {
        Self::Constant(Bsdf::Dielectric(bsdf))
    }
}

impl From<Plastic> for Material {
    fn from(bsdf: Plastic) -> Self {
        Self::Constant(Bsdf::Plastic(bsdf))
    }
}
