//! Materials and textures as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lists::{Spread, spread_option};
use super::{AbsorptionDesc, BumpMapDesc, HairDesc, NormalMapDesc, PrincipledDesc};

/// A colour: `[r, g, b]`, one number for grey, or `{ "texture": "name" }`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "expected a colour: [red, green, blue], one number for grey, or { \"texture\": name }"
)]
pub enum ColorDesc {
    /// The same value in every channel.
    Grey(f32),
    /// Linear red, green, blue.
    Rgb([f32; 3]),
    /// A texture by name.
    Texture {
        /// The texture's name.
        texture: String,
    },
}

/// A number within `[0, 1]`, or `{ "texture": "name" }`: the luminance of its colour, clamped.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields, expecting = "expected a number, or { \"texture\": name }")]
pub enum ScalarDesc {
    /// The same everywhere.
    Constant(f32),
    /// A texture by name.
    Texture {
        /// The texture's name.
        texture: String,
    },
}

/// A number, or `{ "texture": "name", "range": [low, high] }`: the number is `low` where the luminance of the texture's
/// colour, clamped to `[0, 1]`, is 0, and `high` where it is 1.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "expected a number, or { \"texture\": name, \"range\": [low, high] }"
)]
pub enum RangedDesc {
    /// The same everywhere.
    Constant(f32),
    /// A texture by name.
    Texture {
        /// The texture's name.
        texture: String,
        /// The number where the texture is 0, and where it is 1; each within the limits of the parameter.
        range: [f32; 2],
    },
}

/// Roughness of microfacets: a number, `[along u, along v]` for an anisotropic surface, `{ "texture": "name" }`, of
/// which the luminance counts, clamped to `[0, 1]`, or `{ "u": ..., "v": ... }` with a number or a texture for each.
/// The distribution's alpha is its square.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "expected a number, [along u, along v], { \"texture\": name }, or { \"u\": ..., \"v\": ... } of \
                 numbers and textures"
)]
pub enum RoughnessDesc {
    /// The same in all directions.
    Isotropic(f32),
    /// Along u, along v.
    Anisotropic([f32; 2]),
    /// A texture by name.
    Texture {
        /// The texture's name.
        texture: String,
    },
    /// Each axis by itself.
    Axes {
        /// Along u.
        u: ScalarDesc,
        /// Along v.
        v: ScalarDesc,
    },
}

/// The highlight of Phong's model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhongLobeDesc {
    /// A GGX lobe of the same width, alpha = sqrt(2 / (exponent + 2)): like a rough surface, longer at an angle.
    #[default]
    Ggx,
    /// Phong's own, `(exponent + 2) / (2 pi) cos^exponent` of the angle to the mirror direction, normalised (the
    /// modified Phong model of Lafortune and Willems): at an angle a part of it is lost below the horizon. An exponent
    /// of 1e6 counts at most.
    Cosine,
}

/// How the normals of microfacets are distributed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DistributionDesc {
    /// GGX, with long tails, as of most real surfaces.
    #[default]
    Ggx,
    /// GGX, for agreement with scenes of Mitsuba: both sides are masked independently of each other, and light that
    /// microfacets scatter several times is lost, whatever `multiscatter` is.
    GgxSeparable,
    /// Beckmann's, for agreement with scenes of other renderers: both sides are masked independently of each other, and
    /// light that microfacets scatter several times is lost, whatever `multiscatter` is.
    Beckmann,
}

impl DistributionDesc {
    /// Whether it is the default.
    pub fn is_ggx(&self) -> bool {
        *self == Self::Ggx
    }
}

/// A material. All are two-sided unless composed by `two_sided`; a dielectric's inside is the side against the normal.
/// Colours are within `[0, 1]`, those of textures too; the numbers of textures are clamped to it.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum MaterialDesc {
    /// Diffuse reflection: ideal, or rough as of plaster and clay (the EON model, an Oren-Nayar model that loses no
    /// light).
    Diffuse {
        /// Fraction of light reflected, each channel within `[0, 1]`. Default: 0.5.
        #[serde(default = "half")]
        albedo: ColorDesc,
        /// Roughness within `[0, 1]`: the rougher, the flatter it looks. Default: 0, ideal diffuse reflection.
        #[serde(default = "zero")]
        roughness: ScalarDesc,
    },
    /// Diffuse reflection and diffuse transmission of a thin sheet: paper, leaves, lampshades.
    DiffuseTransmission {
        /// Fraction of light reflected. Default: 0.5.
        #[serde(default = "half")]
        reflectance: ColorDesc,
        /// Fraction of light that leaves on the other side; with `reflectance` at most 1 in each channel. Default: 0.5.
        #[serde(default = "half")]
        transmittance: ColorDesc,
    },
    /// Ideal specular reflection.
    Mirror {
        /// Fraction of light reflected, each channel within `[0, 1]`. Default: 1.
        #[serde(default = "white")]
        reflectance: ColorDesc,
    },
    /// A metal: give `metal`, or `eta` and `k`. Smooth unless `roughness` or `alpha` is given.
    Conductor {
        /// A metal by name: `gold`, `silver`, `copper`, `aluminium`, `iron`, `chromium`, `titanium`, `tungsten`,
        /// `brass`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        metal: Option<String>,
        /// Real part of the index of refraction for red, green, blue; no texture, which `tint` can be.
        #[serde(default, deserialize_with = "spread_option", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Spread<3>>")]
        eta: Option<[f32; 3]>,
        /// Imaginary part (extinction) for red, green, blue.
        #[serde(default, deserialize_with = "spread_option", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Spread<3>>")]
        k: Option<[f32; 3]>,
        /// Roughness within `[0, 1]`; alpha is its square.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roughness: Option<RoughnessDesc>,
        /// Alpha itself, in place of `roughness`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        alpha: Option<RoughnessDesc>,
        /// How the normals of its microfacets are distributed. Default: `ggx`.
        #[serde(default, skip_serializing_if = "DistributionDesc::is_ggx")]
        distribution: DistributionDesc,
        /// Factor on the reflectance, within `[0, 1]`. Default: 1.
        #[serde(default = "white")]
        tint: ColorDesc,
        /// Whether light that rough microfacets scatter several times is kept. Default: true.
        #[serde(default = "yes")]
        multiscatter: bool,
    },
    /// Glass, water and the like.
    Dielectric(Box<DielectricDesc>),
    /// A clear thin pane: light is reflected or goes straight on, reflections within the pane included.
    ThinDielectric {
        /// Index of refraction of the pane over that of the outside, from 1/10 to 10. Default: 1.5.
        #[serde(default = "glass_ior")]
        ior: RangedDesc,
        /// Factor on what is reflected, within `[0, 1]`. Default: 1.
        #[serde(default = "white", skip_serializing_if = "is_white")]
        reflection_tint: ColorDesc,
        /// Factor on what passes, within `[0, 1]`. Default: 1.
        #[serde(default = "white", skip_serializing_if = "is_white")]
        transmission_tint: ColorDesc,
    },
    /// A diffuse base under a clear dielectric coat.
    Plastic(Box<PlasticDesc>),
    /// A clear dielectric coat over any opaque material: lacquer over metal or wood, a car's paint. It reflects as
    /// `plastic` does and is `plastic` over a diffuse base; over any other the base keeps `1 - max` of what the coat
    /// reflects of the light in and out, so that nothing is gained. Smooth unless `roughness` or `alpha` is given.
    Coated {
        /// The material below, by name: opaque, and without relief.
        base: String,
        /// Index of refraction of the coat over that of the outside, from 1, which leaves the base alone, to 10.
        /// Default: 1.5.
        #[serde(default = "glass_ior")]
        ior: RangedDesc,
        /// GGX roughness of the coat within `[0, 1]`; alpha is its square.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roughness: Option<RoughnessDesc>,
        /// GGX alpha itself, in place of `roughness`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        alpha: Option<RoughnessDesc>,
        /// What light keeps, in each channel, that crosses the coat twice along the normal; at an angle the way is
        /// longer and less is kept. Default: 1.
        #[serde(default = "white")]
        tint: ColorDesc,
    },
    /// Disney's principled model, for most surfaces.
    Principled(Box<PrincipledDesc>),
    /// Hair and fur, on `curves`.
    Hair(Box<HairDesc>),
    /// Reflection as it was measured (Dupuy and Jakob, "An Adaptive Parameterization for Efficient Material Acquisition
    /// and Rendering", 2018), the same on both sides. Diffuse and specular parts are not separate: layers of specular
    /// light have all of it.
    Measured {
        /// A file of the RGL material database or of the same format, with `rgb` or `spectra`.
        file: String,
    },
    /// Phong's model, by its parameters: a diffuse part beside a highlight.
    Phong {
        /// Diffuse reflectance, kd. Default: 0.5.
        #[serde(default = "half")]
        diffuse: ColorDesc,
        /// Reflectance of the highlight, ks; with `diffuse` at most 1 in each channel, the rest is taken from a
        /// textured `diffuse`. Default: 0.
        #[serde(default = "black")]
        specular: ColorDesc,
        /// Exponent of the highlight, at least 0. Default: 32.
        #[serde(default = "phong_exponent")]
        exponent: RangedDesc,
        /// What the highlight is. Default: ggx.
        #[serde(default, skip_serializing_if = "is_ggx_lobe")]
        lobe: PhongLobeDesc,
    },
    /// Cook and Torrance's model, by its parameters: `d albedo / pi + s D F G / (4 |cos wo| |cos wi|)` with the GGX
    /// distribution of alpha `m`, Smith's `G` and Schlick's `F`.
    CookTorrance {
        /// Colour of the diffuse part. Default: 0.5.
        #[serde(default = "half")]
        albedo: ColorDesc,
        /// Weight of the diffuse part within `[0, 1]`. Default: 0.5.
        #[serde(default = "half_scalar")]
        d: ScalarDesc,
        /// Weight of the specular part within `[0, 1]`; with `d` at most 1, where textures exceed it `d` is less.
        /// Default: 0.5.
        #[serde(default = "half_scalar")]
        s: ScalarDesc,
        /// Width of the distribution of slopes within `[0, 1]`; at least 0.001 counts. Default: 0.3.
        #[serde(default = "slope")]
        m: ScalarDesc,
        /// Reflectance of the specular part ahead. Default: 0.04.
        #[serde(default = "plastic_reflectance")]
        f0: ColorDesc,
    },
    /// Two materials mixed: each hit meets one of them.
    Mix {
        /// The two materials, by name.
        materials: [String; 2],
        /// How much of the second, within `[0, 1]`. Default: 0.5.
        #[serde(default = "half_scalar")]
        amount: ScalarDesc,
    },
    /// A material for each side, both opaque. `{ "type": "diffuse", "albedo": 0 }` makes a side black.
    TwoSided {
        /// The material of the side where the normal points, by name.
        front: String,
        /// The material of the other side, by name.
        back: String,
    },
    /// Another material on a surface that looks as if it had relief: give `normal_map` or `bump_map`. The shape itself
    /// stays as it is, and needs uv: every shape has them but a mesh without `uvs`. It may be a part of other
    /// materials.
    Relief {
        /// The material, by name; neither it nor a part of it has a relief of its own.
        material: String,
        /// An image of normals.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        normal_map: Option<NormalMapDesc>,
        /// A texture of heights.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bump_map: Option<BumpMapDesc>,
    },
}

/// A diffuse base under a clear dielectric coat. Smooth unless `roughness` or `alpha` is given.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlasticDesc {
    /// Colour of the base, each channel within `[0, 1]`. Default: 0.5.
    #[serde(default = "half")]
    pub albedo: ColorDesc,
    /// Index of refraction of the coat over that of the outside, above 1 and at most 10. Default: 1.5.
    #[serde(default = "glass_ior")]
    pub ior: RangedDesc,
    /// GGX roughness of the coat within `[0, 1]`; alpha is its square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<RoughnessDesc>,
    /// GGX alpha itself, in place of `roughness`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<RoughnessDesc>,
    /// How the normals of the coat's microfacets are distributed; with another than `ggx`, `ior`, `roughness` and
    /// `alpha` are numbers, one for both axes. Default: `ggx`.
    #[serde(default, skip_serializing_if = "DistributionDesc::is_ggx")]
    pub distribution: DistributionDesc,
    /// Factor on what the coat reflects, within `[0, 1]`. Default: 1.
    #[serde(default = "white", skip_serializing_if = "is_white")]
    pub coat_tint: ColorDesc,
    /// Whether the base's colour deepens each time that the coat throws light back onto it. Default: false, light keeps
    /// the colour of one reflection.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub nonlinear: bool,
    /// Whether light that a rough coat's microfacets scatter several times is kept. If not, `ior`, `roughness` and
    /// `alpha` are numbers, one for both axes. Default: true.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub multiscatter: bool,
}

/// Glass, water and the like. Smooth unless `roughness` or `alpha` is given.
///
/// With none of `priority`, `absorption`, `medium` and `abbe` it is a boundary alone, whose `ior` is relative to
/// whatever lies outside.
///
/// With any of them it is a medium, which fills the closed surfaces that have the material (or a mix of it with opaque
/// materials, such as a label). Surfaces of media may overlap, as that of a drink must overlap the inner side of its
/// glass: each point belongs to the medium of the highest `priority` among those around it, at equal priorities to the
/// one of the higher `ior`, then to the one that absorbs more. Light is reflected and refracted only where the medium
/// changes, by the ratio of both indices; elsewhere it passes as if no surface were there, which then does not show in
/// the layers either. Materials with the same `ior`, `priority`, `absorption`, `medium` and `abbe` are one medium,
/// rough or not. Up to eight different media overlap. A hollow is a surface with `reverse_normal`, or one of a medium
/// of `ior` 1 and a higher priority. The camera may stand in a medium; `near` belongs to what is not seen, and absorbs
/// nothing.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DielectricDesc {
    /// Index of refraction of the inside over that of the outside, from 1/10 to 10; that of a medium is over that of
    /// empty space. No texture, for what is inside has one index. Default: 1.5.
    #[serde(default = "glass_ior")]
    pub ior: RangedDesc,
    /// Roughness within `[0, 1]`; alpha is its square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<RoughnessDesc>,
    /// Alpha itself, in place of `roughness`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<RoughnessDesc>,
    /// How the normals of its microfacets are distributed. Default: `ggx`.
    #[serde(default, skip_serializing_if = "DistributionDesc::is_ggx")]
    pub distribution: DistributionDesc,
    /// Whether light that rough microfacets scatter several times is kept. Default: true.
    #[serde(default = "yes")]
    pub multiscatter: bool,
    /// Factor on what is reflected, within `[0, 1]`. Default: 1.
    #[serde(default = "white", skip_serializing_if = "is_white")]
    pub reflection_tint: ColorDesc,
    /// Factor on what crosses the surface, within `[0, 1]`. Default: 1.
    #[serde(default = "white", skip_serializing_if = "is_white")]
    pub transmission_tint: ColorDesc,
    /// Which medium is there where several overlap: the one of the highest priority, a whole number. Default for a
    /// medium: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<i32>,
    /// What the medium absorbs. Default: nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorption: Option<AbsorptionDesc>,
    /// The participating medium within, by its name in the scene's `media`, in place of `absorption`; with an `ior` of
    /// 1 its surface is invisible. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub medium: Option<String>,
    /// Dispersion: the Abbe number, from 1 to 1000 (60 for window glass, 30 for flint glass, 55 for diamond), the lower
    /// the more colours part; `ior` is then that of yellow light (587.6 nm). `path` follows one of red, green and blue
    /// from the first such boundary on, which takes more samples; `whitted` shows no dispersion. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub abbe: Option<f32>,
}

impl DielectricDesc {
    /// A smooth boundary that light does not notice, unless there is a medium.
    pub fn invisible() -> Self {
        Self {
            ior: RangedDesc::Constant(1.0),
            roughness: None,
            alpha: None,
            distribution: DistributionDesc::default(),
            multiscatter: true,
            reflection_tint: white(),
            transmission_tint: white(),
            priority: None,
            absorption: None,
            medium: None,
            abbe: None,
        }
    }

    /// Whether it is a medium, not a boundary alone.
    pub fn is_medium(&self) -> bool {
        self.priority.is_some() || self.absorption.is_some() || self.medium.is_some() || self.abbe.is_some()
    }
}

impl MaterialDesc {
    /// The names of the materials that it consists of.
    pub(crate) fn part_names(&self) -> Vec<&str> {
        match self {
            Self::Mix { materials: [first, second], .. } => vec![first, second],
            Self::TwoSided { front, back } => vec![front, back],
            Self::Coated { base: part, .. } | Self::Relief { material: part, .. } => vec![part],
            _ => Vec::new(),
        }
    }
}

fn zero() -> ScalarDesc {
    ScalarDesc::Constant(0.0)
}

fn half_scalar() -> ScalarDesc {
    ScalarDesc::Constant(0.5)
}

fn black() -> ColorDesc {
    ColorDesc::Grey(0.0)
}

fn is_ggx_lobe(lobe: &PhongLobeDesc) -> bool {
    *lobe == PhongLobeDesc::Ggx
}

fn phong_exponent() -> RangedDesc {
    RangedDesc::Constant(32.0)
}

fn slope() -> ScalarDesc {
    ScalarDesc::Constant(0.3)
}

fn plastic_reflectance() -> ColorDesc {
    ColorDesc::Grey(0.04)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde expects")]
pub(super) fn is_yes(value: &bool) -> bool {
    *value
}

fn is_white(color: &ColorDesc) -> bool {
    match color {
        ColorDesc::Grey(value) => *value == 1.0,
        ColorDesc::Rgb(color) => *color == [1.0; 3],
        ColorDesc::Texture { .. } => false,
    }
}

pub(super) fn yes() -> bool {
    true
}

fn half() -> ColorDesc {
    ColorDesc::Grey(0.5)
}

fn white() -> ColorDesc {
    ColorDesc::Grey(1.0)
}

fn glass_ior() -> RangedDesc {
    RangedDesc::Constant(1.5)
}
