//! Materials: textures and parameters that become a [`Bsdf`] at a point.

use crate::bsdf::{Bsdf, Conductor, Dielectric, Lambert, Mirror, Plastic, Principled, PrincipledParameters};
use crate::color::Rgb;
use crate::id::TextureId;
use crate::math::Vec2;
use crate::texture::Texture;

/// A colour that is constant or comes from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// The same everywhere.
    Constant(Rgb),
    /// Looked up by uv, each channel clamped to `[0, 1]`.
    Texture(TextureId),
}

impl ColorInput {
    /// The colour at `uv`.
    #[inline]
    pub fn at(&self, textures: &[Texture], uv: Vec2) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            Self::Texture(id) => textures[id.index()].color(uv).map(|v| v.clamp(0.0, 1.0)),
        }
    }
}

/// A number within `[0, 1]` that is constant or comes from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarInput {
    /// The same everywhere.
    Constant(f32),
    /// Looked up by uv, clamped to `[0, 1]`.
    Texture(TextureId),
}

impl ScalarInput {
    /// The number at `uv`.
    #[inline]
    pub fn at(&self, textures: &[Texture], uv: Vec2) -> f32 {
        match self {
            Self::Constant(value) => *value,
            Self::Texture(id) => textures[id.index()].scalar(uv).clamp(0.0, 1.0),
        }
    }

    /// Whether it is 0 everywhere.
    pub fn is_zero(&self) -> bool {
        *self == Self::Constant(0.0)
    }

    fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// The same scattering everywhere, prepared once.
    Constant(Bsdf),
    /// Scattering that textures change.
    Varying(Box<Varying>),
}

/// Parameters that may come from textures.
#[derive(Clone, Debug, PartialEq)]
pub enum Varying {
    /// Diffuse.
    Diffuse {
        /// Fraction of light reflected.
        albedo: ColorInput,
    },
    /// Plastic.
    Plastic {
        /// Everything else.
        base: Plastic,
        /// Colour of the diffuse base.
        albedo: ColorInput,
    },
    /// The principled model.
    Principled(PrincipledInputs),
}

/// What [`PrincipledParameters`] are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledInputs {
    /// What no texture changes, or a number below would replace.
    pub rest: PrincipledParameters,
    /// The base's colour.
    pub base_color: ColorInput,
    /// How much is metal.
    pub metallic: ScalarInput,
    /// Roughness.
    pub roughness: ScalarInput,
    /// Anisotropy.
    pub anisotropic: ScalarInput,
    /// Reflectance ahead in units of 0.08, in place of the index of refraction in `rest`.
    pub specular: Option<ScalarInput>,
    /// Tint of the dielectric layer.
    pub specular_tint: ScalarInput,
    /// Strength of the sheen.
    pub sheen: ScalarInput,
    /// Tint of the sheen.
    pub sheen_tint: ScalarInput,
    /// Strength of the clear coat.
    pub clearcoat: ScalarInput,
    /// Gloss of the clear coat.
    pub clearcoat_gloss: ScalarInput,
    /// From the diffuse to the flat lobe.
    pub subsurface: ScalarInput,
    /// How much is glass.
    pub transmission: ScalarInput,
    /// How much the diffuse base of a thin sheet lets through.
    pub diffuse_transmission: ScalarInput,
}

impl PrincipledInputs {
    fn parameters(&self, textures: &[Texture], uv: Vec2) -> PrincipledParameters {
        let at = |input: &ScalarInput| input.at(textures, uv);
        PrincipledParameters {
            base_color: self.base_color.at(textures, uv),
            metallic: at(&self.metallic),
            roughness: at(&self.roughness),
            anisotropic: at(&self.anisotropic),
            ior: self.specular.as_ref().map_or(self.rest.ior, |specular| PrincipledParameters::ior_of_specular(at(specular))),
            specular_tint: at(&self.specular_tint),
            sheen: at(&self.sheen),
            sheen_tint: at(&self.sheen_tint),
            clearcoat: at(&self.clearcoat),
            clearcoat_gloss: at(&self.clearcoat_gloss),
            subsurface: at(&self.subsurface),
            transmission: at(&self.transmission),
            diffuse_transmission: at(&self.diffuse_transmission),
            ..self.rest
        }
    }

    fn is_constant(&self) -> bool {
        let scalars = [
            &self.metallic,
            &self.roughness,
            &self.anisotropic,
            &self.specular_tint,
            &self.sheen,
            &self.sheen_tint,
            &self.clearcoat,
            &self.clearcoat_gloss,
            &self.subsurface,
            &self.transmission,
            &self.diffuse_transmission,
        ];
        matches!(self.base_color, ColorInput::Constant(_)) && scalars.into_iter().chain(&self.specular).all(ScalarInput::is_constant)
    }
}

impl Varying {
    /// The scattering at `uv`.
    fn bsdf(&self, textures: &[Texture], uv: Vec2) -> Bsdf {
        match self {
            Self::Diffuse { albedo } => Bsdf::Lambert(Lambert { albedo: albedo.at(textures, uv) }),
            Self::Plastic { base, albedo } => Bsdf::Plastic(Plastic { diffuse: albedo.at(textures, uv), ..*base }),
            Self::Principled(inputs) => Bsdf::Principled(Principled::new(&inputs.parameters(textures, uv))),
        }
    }

    fn is_constant(&self) -> bool {
        match self {
            Self::Diffuse { albedo } | Self::Plastic { albedo, .. } => matches!(albedo, ColorInput::Constant(_)),
            Self::Principled(inputs) => inputs.is_constant(),
        }
    }

    /// Whether scattering may depend on the direction of the tangents.
    fn is_anisotropic(&self) -> bool {
        match self {
            Self::Diffuse { .. } => false,
            Self::Plastic { base, .. } => base.is_anisotropic(),
            Self::Principled(inputs) => !inputs.anisotropic.is_zero(),
        }
    }
}

impl Material {
    /// The scattering at `uv`.
    #[inline]
    pub fn bsdf(&self, textures: &[Texture], uv: Vec2) -> Bsdf {
        match self {
            Self::Constant(bsdf) => *bsdf,
            Self::Varying(varying) => varying.bsdf(textures, uv),
        }
    }

    /// Whether light sampling is pointless everywhere on the material.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Constant(bsdf) => bsdf.is_delta(),
            Self::Varying(_) => false,
        }
    }

    /// Whether scattering may depend on the direction of the surface's tangents.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Self::Constant(bsdf) => bsdf.is_anisotropic(),
            Self::Varying(varying) => varying.is_anisotropic(),
        }
    }
}

impl From<Varying> for Material {
    /// What no texture changes is prepared once.
    fn from(varying: Varying) -> Self {
        if varying.is_constant() { Self::Constant(varying.bsdf(&[], Vec2::ZERO)) } else { Self::Varying(Box::new(varying)) }
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
