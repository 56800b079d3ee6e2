//! Materials: textures and parameters that become a [`Bsdf`] at a point.

mod inputs;
mod principled;

pub use inputs::{AlphaInput, CoatInput, ColorInput, Facets, PlasticCoat, RangedInput, ScalarInput};
pub use principled::PrincipledInputs;

use crate::bsdf::{
    Beckmann, Bsdf, BsdfFlags, Conductor, Dielectric, DiffuseTransmission, Eon, Glossy, Hair, Lambert, Mirror, Phong,
    Plastic, Principled, SeparableGgx, SingleScatteringBsdf, ThinDielectric, hair_absorption_of_color,
};
use crate::color::Rgb;
use crate::id::{MaterialId, TextureId};
use crate::math::Vec2;
use crate::texture::{Checker, Footprint, Texture};

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// The same scattering everywhere, prepared once.
    Constant(Bsdf),
    /// Scattering that is evaluated at every hit, and the textures of its parameters.
    Textured(Box<TexturedMaterial>, Box<[TextureId]>),
    /// One of two materials at each point, chosen anew at each hit: the second with the probability `amount`.
    Mix {
        /// Where `amount` is 0.
        first: MaterialId,
        /// Where `amount` is 1.
        second: MaterialId,
        /// How much of the second.
        amount: ScalarInput,
    },
    /// A material for each side.
    TwoSided {
        /// Where the normal points.
        front: MaterialId,
        /// Against the normal.
        back: MaterialId,
    },
}

/// Parameters that may come from textures.
#[derive(Clone, Debug, PartialEq)]
pub enum TexturedMaterial {
    /// Diffuse, rough or not.
    Diffuse {
        /// Fraction of light reflected.
        albedo: ColorInput,
        /// Roughness.
        roughness: ScalarInput,
    },
    /// Diffuse reflection and transmission.
    DiffuseTransmission {
        /// Fraction of light reflected.
        reflectance: ColorInput,
        /// Fraction of light that crosses.
        transmittance: ColorInput,
    },
    /// Ideal specular reflection.
    Mirror {
        /// Fraction of light reflected.
        reflectance: ColorInput,
    },
    /// Metal.
    Conductor {
        /// Its index of refraction.
        metal: Conductor,
        /// Factor on the reflectance.
        tint: ColorInput,
        /// Roughness.
        alpha: AlphaInput,
        /// Its microfacets.
        facets: Facets,
    },
    /// Glass.
    Dielectric {
        /// Index of refraction of the inside over that of the outside.
        ior: f32,
        /// Roughness.
        alpha: AlphaInput,
        /// Its microfacets.
        facets: Facets,
        /// Factors on what is reflected and on what crosses.
        tints: [ColorInput; 2],
    },
    /// Phong's model.
    Phong {
        /// The diffuse part.
        diffuse: ColorInput,
        /// The highlight.
        specular: ColorInput,
        /// Exponent.
        exponent: RangedInput,
        /// Whether the highlight is Phong's own lobe in place of GGX.
        cosine: bool,
    },
    /// Cook and Torrance's model.
    CookTorrance {
        /// Colour of the diffuse part.
        albedo: ColorInput,
        /// Weight of the diffuse part.
        d: ScalarInput,
        /// Weight of the specular part.
        s: ScalarInput,
        /// Alpha.
        m: ScalarInput,
        /// Reflectance of the specular part ahead.
        f0: ColorInput,
    },
    /// A pane of glass.
    ThinDielectric {
        /// Index of refraction over that of the outside.
        ior: RangedInput,
        /// Factors on what is reflected and on what passes.
        tints: [ColorInput; 2],
    },
    /// Plastic.
    Plastic {
        /// The coat.
        coat: PlasticCoat,
        /// Colour of the diffuse base.
        albedo: ColorInput,
        /// Factor on what the coat reflects.
        tint: ColorInput,
        /// As [`Plastic::nonlinear`].
        nonlinear: bool,
    },
    /// A clear coat over another material.
    Coated {
        /// The coat.
        coat: CoatInput,
        /// What light keeps that crosses it twice along the normal.
        tint: ColorInput,
        /// What is below: no material that consists of others.
        base: Material,
    },
    /// The principled model.
    Principled(PrincipledInputs),
    /// Hair.
    Hair {
        /// What it absorbs.
        color: HairColor,
        /// Without absorption.
        hair: Hair,
        /// Its roughness around it.
        azimuthal: f32,
    },
}

/// What hair absorbs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HairColor {
    /// Absorption per radius.
    Absorption(Rgb),
    /// The colour that many strands have together.
    Reflectance(ColorInput),
}

impl HairColor {
    /// The absorption per radius, for a roughness around the hair.
    fn absorption(self, azimuthal: f32, textures: &[Texture], footprint: &Footprint) -> Rgb {
        match self {
            Self::Absorption(sigma_a) => sigma_a,
            Self::Reflectance(color) => hair_absorption_of_color(color.at(textures, footprint), azimuthal),
        }
    }
}

impl Facets {
    #[inline(always)]
    fn conductor(self, metal: &Conductor, alpha: [f32; 2], tint: Rgb) -> Bsdf {
        match self {
            Self::Ggx => Bsdf::Conductor(metal.with_surface(alpha, tint)),
            Self::SingleGgx => Bsdf::Conductor(metal.with_surface(alpha, tint).single_scattering()),
            Self::SeparableGgx => {
                Bsdf::SeparableGgx(SingleScatteringBsdf::Conductor(metal.with_facets(SeparableGgx::new(alpha), tint)))
            }
            Self::Beckmann => {
                Bsdf::Beckmann(SingleScatteringBsdf::Conductor(metal.with_facets(Beckmann::new(alpha), tint)))
            }
        }
    }

    #[inline(always)]
    fn dielectric(self, ior: f32, alpha: [f32; 2], [reflection, transmission]: [Rgb; 2]) -> Bsdf {
        match self {
            Self::Ggx => Bsdf::Dielectric(Dielectric::new(ior, alpha).tinted(reflection, transmission)),
            Self::SingleGgx => {
                Bsdf::Dielectric(Dielectric::new(ior, alpha).single_scattering().tinted(reflection, transmission))
            }
            Self::SeparableGgx => {
                let glass = Dielectric::with_facets(ior, alpha, SeparableGgx::new).tinted(reflection, transmission);
                Bsdf::SeparableGgx(SingleScatteringBsdf::Dielectric(glass))
            }
            Self::Beckmann => {
                let glass = Dielectric::with_facets(ior, alpha, Beckmann::new).tinted(reflection, transmission);
                Bsdf::Beckmann(SingleScatteringBsdf::Dielectric(glass))
            }
        }
    }
}

/// What exceeds 1 together with `specular` is taken from `diffuse`.
#[inline]
fn limited(diffuse: Rgb, specular: Rgb) -> Rgb {
    let left = Rgb::WHITE - specular;
    Rgb::new(diffuse.r.min(left.r), diffuse.g.min(left.g), diffuse.b.min(left.b))
}

impl TexturedMaterial {
    /// The scattering over `footprint`.
    pub fn bsdf(&self, textures: &[Texture], footprint: &Footprint) -> Bsdf {
        match self {
            Self::Diffuse { albedo, roughness } => {
                match (self.lambert_albedo(textures, footprint), roughness.at(textures, footprint)) {
                    (Some(albedo), _) => Bsdf::Lambert(Lambert { albedo }),
                    (None, roughness) => Bsdf::Eon(Eon { albedo: albedo.at(textures, footprint), roughness }),
                }
            }
            Self::DiffuseTransmission { reflectance, transmittance } => Bsdf::DiffuseTransmission(
                DiffuseTransmission::new(reflectance.at(textures, footprint), transmittance.at(textures, footprint)),
            ),
            Self::Mirror { reflectance } => Bsdf::Mirror(Mirror { reflectance: reflectance.at(textures, footprint) }),
            Self::Conductor { metal, tint, alpha, facets } => {
                facets.conductor(metal, alpha.at(textures, footprint), tint.at(textures, footprint))
            }
            Self::Dielectric { ior, alpha, facets, tints } => {
                facets.dielectric(*ior, alpha.at(textures, footprint), tints.map(|tint| tint.at(textures, footprint)))
            }
            Self::Phong { diffuse, specular, exponent, cosine } => {
                let specular = specular.at(textures, footprint);
                let diffuse = limited(diffuse.at(textures, footprint), specular);
                let exponent = exponent.at(textures, footprint);
                if *cosine {
                    Bsdf::Phong(Phong::new(diffuse, specular, exponent))
                } else {
                    Bsdf::Glossy(Glossy::phong(diffuse, specular, exponent))
                }
            }
            Self::CookTorrance { albedo, d, s, m, f0 } => {
                // What exceeds 1 together is taken from the diffuse part.
                let s = s.at(textures, footprint);
                let d = d.at(textures, footprint).min(1.0 - s);
                Bsdf::Glossy(Glossy::new(
                    albedo.at(textures, footprint) * d,
                    f0.at(textures, footprint) * s,
                    Rgb::splat(s),
                    m.at(textures, footprint),
                ))
            }
            Self::ThinDielectric { ior, tints } => {
                let [reflection_tint, transmission_tint] = tints.map(|tint| tint.at(textures, footprint));
                let ior = ior.at(textures, footprint);
                Bsdf::ThinDielectric(ThinDielectric { ior, reflection_tint, transmission_tint })
            }
            Self::Plastic { coat, albedo, tint, nonlinear } => {
                let (albedo, tint) = (albedo.at(textures, footprint), tint.at(textures, footprint));
                coat.over(albedo, tint, *nonlinear, textures, footprint)
            }
            Self::Coated { coat, tint, base } => {
                let base = base.bsdf(textures, || *footprint);
                Bsdf::coated(coat.at(textures, footprint), tint.at(textures, footprint), base)
            }
            Self::Principled(inputs) => Bsdf::Principled(Principled::new(&inputs.parameters(textures, footprint))),
            Self::Hair { color, hair, azimuthal } => {
                Bsdf::Hair(hair.with_absorption(color.absorption(*azimuthal, textures, footprint)))
            }
        }
    }

    /// The albedo over `footprint` where the scattering is Lambert's.
    #[inline]
    pub fn lambert_albedo(&self, textures: &[Texture], footprint: &Footprint) -> Option<Rgb> {
        match self {
            Self::Diffuse { albedo, roughness } if roughness.at(textures, footprint) == 0.0 => {
                Some(albedo.at(textures, footprint))
            }
            _ => None,
        }
    }

    /// The albedo where the scattering is Lambert's and the albedo a checkerboard, each channel within `[0, 1]`.
    #[inline]
    pub fn lambert_checker(&self, textures: &[Texture]) -> Option<Checker> {
        match self {
            Self::Diffuse { albedo, roughness } if roughness.is_zero() => albedo.checker(textures),
            _ => None,
        }
    }

    /// Whether those of its BSDFs that [can vary](Bsdf::can_vary) can be one group of queries.
    #[inline]
    pub fn can_be_grouped(&self) -> bool {
        match self {
            Self::Plastic { coat, .. } => coat.is_constant(),
            Self::Coated { coat, tint, .. } => coat.is_constant() && tint.texture().is_none(),
            Self::Principled(_) | Self::Hair { .. } => true,
            _ => false,
        }
    }

    /// Whether it is diffuse reflection, rough or not.
    pub fn is_diffuse(&self) -> bool {
        matches!(self, Self::Diffuse { .. })
    }

    /// The textures of all inputs.
    fn textures(&self) -> Vec<TextureId> {
        let mut found = Vec::new();
        match self {
            Self::Diffuse { albedo, roughness } => {
                found.extend(albedo.texture().into_iter().chain(roughness.texture()));
            }
            Self::DiffuseTransmission { reflectance: a, transmittance: b } => {
                found.extend(a.texture().into_iter().chain(b.texture()));
            }
            Self::Phong { diffuse, specular, exponent, .. } => {
                found.extend([diffuse.texture(), specular.texture(), exponent.texture()].into_iter().flatten());
            }
            Self::CookTorrance { albedo, d, s, m, f0 } => {
                found.extend([albedo, f0].into_iter().filter_map(ColorInput::texture));
                found.extend([d, s, m].into_iter().filter_map(ScalarInput::texture));
            }
            Self::ThinDielectric { ior, tints } => {
                found.extend(ior.texture().into_iter().chain(tints.iter().filter_map(ColorInput::texture)));
            }
            Self::Conductor { tint, alpha, .. } => found.extend(tint.texture().into_iter().chain(alpha.textures())),
            Self::Dielectric { alpha, tints, .. } => {
                found.extend(alpha.textures().into_iter().chain(tints.iter().filter_map(ColorInput::texture)));
            }
            Self::Mirror { reflectance } => found.extend(reflectance.texture()),
            Self::Plastic { coat, albedo, tint, .. } => {
                found.extend(coat.textures().into_iter().chain(albedo.texture()).chain(tint.texture()));
            }
            Self::Coated { coat, tint, base } => {
                found.extend(coat.textures().into_iter().chain(tint.texture()));
                found.extend(base.textures());
            }
            Self::Principled(inputs) => found = inputs.textures(),
            Self::Hair { color: HairColor::Reflectance(color), .. } => found.extend(color.texture()),
            Self::Hair { .. } => {}
        }
        found
    }

    /// The lobes that it has for some values of its textures.
    fn flags(&self) -> BsdfFlags {
        type F = BsdfFlags;
        let both_sides = F::REFLECTION | F::TRANSMISSION;
        match self {
            Self::Diffuse { .. } => F::DIFFUSE | F::REFLECTION,
            Self::DiffuseTransmission { .. } => F::DIFFUSE | both_sides,
            Self::Mirror { .. } => F::SPECULAR | F::REFLECTION,
            Self::Conductor { alpha, .. } => alpha.flags() | F::REFLECTION,
            Self::Dielectric { alpha, .. } => alpha.flags() | both_sides,
            Self::Phong { .. } | Self::CookTorrance { .. } => F::DIFFUSE | F::GLOSSY | F::REFLECTION,
            Self::ThinDielectric { .. } => F::SPECULAR | both_sides,
            Self::Plastic { coat, .. } => coat.flags() | F::DIFFUSE,
            Self::Coated { coat, base, .. } => coat.flags() | base.flags(),
            Self::Principled(inputs) => inputs.flags(),
            Self::Hair { .. } => F::GLOSSY | both_sides | F::ANISOTROPIC | F::FIBER,
        }
    }
}

impl Material {
    /// Scattering that is evaluated at every hit, with or without textures.
    pub fn varying(textured: TexturedMaterial) -> Self {
        let textures = textured.textures().into();
        Self::Textured(Box::new(textured), textures)
    }

    /// The scattering over a footprint; nothing for what consists of other materials, which [`Material::part`] resolves
    /// first.
    #[inline]
    pub fn bsdf<'f>(&self, textures: &[Texture], footprint: impl FnOnce() -> Footprint<'f>) -> Bsdf {
        match self {
            Self::Constant(bsdf) => bsdf.clone(),
            Self::Textured(textured, _) => textured.bsdf(textures, &footprint()),
            Self::Mix { .. } | Self::TwoSided { .. } => Bsdf::Lambert(Lambert { albedo: Rgb::BLACK }),
        }
    }

    /// The scattering over a footprint of a dielectric as a boundary with another relative index of refraction, inside
    /// over outside; `None` for all other materials.
    pub fn boundary<'f>(
        &self,
        textures: &[Texture],
        footprint: impl FnOnce() -> Footprint<'f>,
        ior: f32,
    ) -> Option<Bsdf> {
        match self {
            Self::Textured(textured, _) => match **textured {
                TexturedMaterial::Dielectric { alpha, facets, tints, .. } => {
                    Some(TexturedMaterial::Dielectric { ior, alpha, facets, tints }.bsdf(textures, &footprint()))
                }
                _ => None,
            },
            Self::Constant(_) | Self::Mix { .. } | Self::TwoSided { .. } => None,
        }
    }

    /// The leaf material on one side at a point, if this one consists of others; `u` within `[0, 1)` chooses.
    #[inline]
    pub fn part<'f>(
        &self,
        textures: &[Texture],
        point: impl FnOnce() -> Footprint<'f>,
        is_front: bool,
        u: impl FnOnce() -> f32,
    ) -> Option<MaterialId> {
        match self {
            Self::Constant(_) | Self::Textured(..) => None,
            Self::Mix { first, second, amount } => {
                Some(if u() < amount.at(textures, &point()) { *second } else { *first })
            }
            Self::TwoSided { front, back } => Some(if is_front { *front } else { *back }),
        }
    }

    /// The materials that this one consists of.
    pub fn parts(&self) -> Option<[MaterialId; 2]> {
        match *self {
            Self::Constant(_) | Self::Textured(..) => None,
            Self::Mix { first, second, .. } => Some([first, second]),
            Self::TwoSided { front, back } => Some([front, back]),
        }
    }

    /// The lobes that it may have; none of its own where it consists of other materials.
    pub fn flags(&self) -> BsdfFlags {
        match self {
            Self::Constant(bsdf) => bsdf.flags(),
            Self::Textured(textured, _) => textured.flags(),
            Self::Mix { .. } | Self::TwoSided { .. } => BsdfFlags::empty(),
        }
    }

    /// Whether light enters its surface for a random walk; not of materials that it consists of.
    pub fn has_walk(&self) -> bool {
        match self {
            Self::Constant(Bsdf::Principled(bsdf)) => bsdf.has_walk(),
            Self::Textured(textured, _) => {
                matches!(&**textured, TexturedMaterial::Principled(inputs) if inputs.has_walk())
            }
            _ => false,
        }
    }

    /// Whether any input is textured.
    pub fn is_textured(&self) -> bool {
        !self.textures().is_empty()
    }

    /// The textures of its own inputs, not those of materials that it consists of.
    pub fn textures(&self) -> Vec<TextureId> {
        match self {
            Self::Constant(_) | Self::TwoSided { .. } => Vec::new(),
            Self::Textured(_, textures) => textures.to_vec(),
            Self::Mix { amount, .. } => amount.texture().into_iter().collect(),
        }
    }
}

impl From<TexturedMaterial> for Material {
    /// What no texture changes is prepared once.
    fn from(textured: TexturedMaterial) -> Self {
        if textured.textures().is_empty() {
            Self::Constant(textured.bsdf(&[], &Footprint::point(Vec2::ZERO)))
        } else {
            Self::varying(textured)
        }
    }
}

macro_rules! from_bsdf {
    ($($bsdf:ident),*) => {$(
        impl From<$bsdf> for Material {
            fn from(bsdf: $bsdf) -> Self {
                Self::Constant(Bsdf::$bsdf(bsdf))
            }
        }
    )*};
}
from_bsdf!(Lambert, Mirror, Conductor, Dielectric, Plastic);
