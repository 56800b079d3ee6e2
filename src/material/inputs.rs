//! Parameters of materials that are constant or come from textures.

use crate::bsdf::{Beckmann, Bsdf, BsdfFlags, Coat, Plastic, SeparableGgx, SingleScatteringBsdf};
use crate::color::Rgb;
use crate::id::TextureId;
use crate::math::Vec2;
use crate::texture::{Checker, Footprint, Texture};

/// A colour that is constant or comes from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// The same everywhere.
    Constant(Rgb),
    /// Looked up by uv, each channel clamped to `[0, 1]`.
    Texture(TextureId),
}

impl ColorInput {
    /// The colour over `footprint`.
    #[inline]
    pub fn at(&self, textures: &[Texture], footprint: &Footprint) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            Self::Texture(id) => textures[id.index()].color_over(footprint).map(|v| v.clamp(0.0, 1.0)),
        }
    }

    /// The checkerboard that it comes from, if it does.
    #[inline]
    pub(super) fn checker(&self, textures: &[Texture]) -> Option<Checker> {
        match self.texture().map(|id| &textures[id.index()]) {
            Some(Texture::Checker(checker)) => {
                Some(Checker { colors: checker.colors.map(|color| color.map(|v| v.clamp(0.0, 1.0))), ..*checker })
            }
            _ => None,
        }
    }

    /// The texture, if it comes from one.
    pub(super) fn texture(&self) -> Option<TextureId> {
        match self {
            Self::Constant(_) => None,
            Self::Texture(id) => Some(*id),
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
    /// The number over `footprint`.
    #[inline]
    pub fn at(&self, textures: &[Texture], footprint: &Footprint) -> f32 {
        match self {
            Self::Constant(value) => *value,
            Self::Texture(id) => textures[id.index()].scalar_over(footprint).clamp(0.0, 1.0),
        }
    }

    /// Whether it is 0 everywhere.
    pub fn is_zero(&self) -> bool {
        *self == Self::Constant(0.0)
    }

    /// The texture, if it comes from one.
    pub(super) fn texture(&self) -> Option<TextureId> {
        match self {
            Self::Constant(_) => None,
            Self::Texture(id) => Some(*id),
        }
    }
}

/// A number that is constant or comes from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RangedInput {
    /// The same everywhere.
    Constant(f32),
    /// Looked up by uv, clamped to `[0, 1]`.
    Texture {
        /// The texture.
        id: TextureId,
        /// The number where the texture is 0, and where it is 1.
        range: [f32; 2],
    },
}

impl RangedInput {
    /// The number over `footprint`.
    #[inline]
    pub fn at(&self, textures: &[Texture], footprint: &Footprint) -> f32 {
        match *self {
            Self::Constant(value) => value,
            Self::Texture { id, range: [low, high] } => {
                low + (high - low) * ScalarInput::Texture(id).at(textures, footprint)
            }
        }
    }

    /// The texture, if it comes from one.
    pub(super) fn texture(&self) -> Option<TextureId> {
        match self {
            Self::Constant(_) => None,
            Self::Texture { id, .. } => Some(*id),
        }
    }
}

/// How the normals of microfacets are distributed and masked, and what becomes of light that they scatter several
/// times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facets {
    /// GGX; it is kept.
    Ggx,
    /// GGX; it is lost.
    SingleGgx,
    /// GGX, each side masked independently; it is lost.
    SeparableGgx,
    /// Beckmann's, each side masked independently; it is lost.
    Beckmann,
}

/// Alpha along u and v from inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaInput {
    /// Along u and v.
    pub axes: [ScalarInput; 2],
    /// Whether the inputs are roughness, of which alpha is the square.
    pub squared: bool,
}

impl AlphaInput {
    /// Alpha over `footprint`.
    #[inline]
    pub fn at(&self, textures: &[Texture], footprint: &Footprint) -> [f32; 2] {
        self.axes
            .map(|input| input.at(textures, footprint))
            .map(|value| if self.squared { value * value } else { value })
    }

    /// Glossy or specular lobes, and whether they may be anisotropic.
    pub(super) fn flags(&self) -> BsdfFlags {
        let lobes = BsdfFlags::GLOSSY | BsdfFlags::SPECULAR;
        if self.axes[0] == self.axes[1] { lobes } else { lobes | BsdfFlags::ANISOTROPIC }
    }

    /// Whether no texture changes it.
    pub fn is_constant(&self) -> bool {
        self.textures().is_empty()
    }

    pub(super) fn textures(&self) -> Vec<TextureId> {
        self.axes.iter().filter_map(ScalarInput::texture).collect()
    }
}

/// A clear coat that is prepared once, or has parameters from textures.
#[derive(Clone, Debug, PartialEq)]
pub enum CoatInput {
    /// The same everywhere.
    Constant(Coat),
    /// From textures.
    Textured {
        /// Index of refraction over that of the outside.
        ior: RangedInput,
        /// Roughness.
        alpha: AlphaInput,
    },
}

impl CoatInput {
    /// A coat with these inputs.
    pub fn new(ior: RangedInput, alpha: AlphaInput) -> Self {
        match ior {
            RangedInput::Constant(ior) if alpha.is_constant() => {
                Self::Constant(Coat::new(ior, alpha.at(&[], &Footprint::point(Vec2::ZERO))))
            }
            ior => Self::Textured { ior, alpha },
        }
    }

    /// The coat over `footprint`.
    #[inline]
    pub(super) fn at(&self, textures: &[Texture], footprint: &Footprint) -> Coat {
        match self {
            Self::Constant(coat) => *coat,
            Self::Textured { ior, alpha } => {
                Coat::looked_up(ior.at(textures, footprint), alpha.at(textures, footprint))
            }
        }
    }

    /// Whether no texture changes it.
    pub(super) fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    pub(super) fn textures(&self) -> Vec<TextureId> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Textured { ior, alpha } => ior.texture().into_iter().chain(alpha.textures()).collect(),
        }
    }

    pub(super) fn flags(&self) -> BsdfFlags {
        match self {
            Self::Constant(coat) => coat.flags(),
            Self::Textured { alpha, .. } => alpha.flags() | BsdfFlags::REFLECTION,
        }
    }
}

/// The coat of plastic.
#[derive(Clone, Debug, PartialEq)]
pub enum PlasticCoat {
    /// GGX.
    Ggx(CoatInput),
    /// GGX, each side masked independently.
    SeparableGgx(Coat<SeparableGgx>),
    /// Beckmann's microfacets.
    Beckmann(Coat<Beckmann>),
}

impl PlasticCoat {
    /// The coat over `footprint` with a base of colour `diffuse`, a factor `tint` on what the coat reflects, and
    /// whether the base is [nonlinear](Plastic::nonlinear).
    #[inline]
    pub(super) fn over(
        &self,
        diffuse: Rgb,
        tint: Rgb,
        nonlinear: bool,
        textures: &[Texture],
        footprint: &Footprint,
    ) -> Bsdf {
        match self {
            Self::Ggx(coat) => Bsdf::Plastic(Plastic { diffuse, coat: coat.at(textures, footprint), tint, nonlinear }),
            Self::SeparableGgx(coat) => {
                Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(Plastic { diffuse, coat: *coat, tint, nonlinear }))
            }
            Self::Beckmann(coat) => {
                Bsdf::Beckmann(SingleScatteringBsdf::Plastic(Plastic { diffuse, coat: *coat, tint, nonlinear }))
            }
        }
    }

    /// Whether no texture changes it.
    pub(super) fn is_constant(&self) -> bool {
        !matches!(self, Self::Ggx(coat) if !coat.is_constant())
    }

    pub(super) fn textures(&self) -> Vec<TextureId> {
        match self {
            Self::Ggx(coat) => coat.textures(),
            Self::SeparableGgx(_) | Self::Beckmann(_) => Vec::new(),
        }
    }

    pub(super) fn flags(&self) -> BsdfFlags {
        match self {
            Self::Ggx(coat) => coat.flags(),
            Self::SeparableGgx(coat) => coat.flags(),
            Self::Beckmann(coat) => coat.flags(),
        }
    }
}
