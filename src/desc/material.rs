//! Materials and textures as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PrincipledDesc;

/// A colour: `[r, g, b]`, one number for grey, or `{ "texture": "name" }`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields, expecting = "expected a colour: [red, green, blue], one number for grey, or { \"texture\": name }")]
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

/// GGX roughness: a number, `[along u, along v]` for an anisotropic surface, or `{ "texture": "name" }`, of which the luminance counts, clamped to
/// `[0, 1]`. The distribution's alpha is its square.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields, expecting = "expected a number, [along u, along v], or { \"texture\": name }")]
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
}

/// A material. All are two-sided unless composed by `two_sided`; a dielectric's inside is the side against the normal. Colours are within
/// `[0, 1]`, those of textures too; the numbers of textures are clamped to it.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum MaterialDesc {
    /// Diffuse reflection: ideal, or rough as of plaster and clay (the EON model, an Oren-Nayar model that loses no light).
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
        /// A metal by name: `gold`, `silver`, `copper`, `aluminium`, `iron`, `chromium`, `titanium`, `tungsten`, `brass`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        metal: Option<String>,
        /// Real part of the index of refraction for red, green, blue.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        eta: Option<[f32; 3]>,
        /// Imaginary part (extinction) for red, green, blue.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        k: Option<[f32; 3]>,
        /// GGX roughness within `[0, 1]`; alpha is its square.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roughness: Option<RoughnessDesc>,
        /// GGX alpha itself, in place of `roughness`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        alpha: Option<RoughnessDesc>,
        /// Factor on the reflectance, within `[0, 1]`. Default: 1.
        #[serde(default = "white")]
        tint: ColorDesc,
        /// Whether light that rough microfacets scatter several times is kept. Default: true.
        #[serde(default = "yes")]
        multiscatter: bool,
    },
    /// Glass, water and the like. Smooth unless `roughness` or `alpha` is given.
    Dielectric {
        /// Index of refraction of the inside over that of the outside, at least 1/10 and at most 10. Default: 1.5.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// GGX roughness within `[0, 1]`; alpha is its square.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roughness: Option<RoughnessDesc>,
        /// GGX alpha itself, in place of `roughness`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        alpha: Option<RoughnessDesc>,
        /// Whether light that rough microfacets scatter several times is kept. Default: true.
        #[serde(default = "yes")]
        multiscatter: bool,
    },
    /// A clear thin pane: light is reflected or goes straight on, reflections within the pane included.
    ThinDielectric {
        /// Index of refraction of the pane over that of the outside, at least 1/10 and at most 10. Default: 1.5.
        #[serde(default = "glass_ior")]
        ior: f32,
    },
    /// A diffuse base under a clear dielectric coat. Smooth unless `roughness` or `alpha` is given.
    Plastic {
        /// Colour of the base, each channel within `[0, 1]`. Default: 0.5.
        #[serde(default = "half")]
        albedo: ColorDesc,
        /// Index of refraction of the coat over that of the outside, above 1 and at most 10. Default: 1.5.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// GGX roughness of the coat within `[0, 1]`, not a texture; alpha is its square.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roughness: Option<RoughnessDesc>,
        /// GGX alpha itself, in place of `roughness`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        alpha: Option<RoughnessDesc>,
    },
    /// Disney's principled model, for most surfaces.
    Principled(Box<PrincipledDesc>),
    /// Phong's model, by its parameters: the highlight becomes a GGX lobe of the same width, alpha = sqrt(2 / (exponent + 2)).
    Phong {
        /// Diffuse reflectance, kd. Default: 0.5.
        #[serde(default = "half")]
        diffuse: ColorDesc,
        /// Reflectance of the highlight, ks; with `diffuse` at most 1 in each channel, the rest is taken from a textured `diffuse`. Default: 0.
        #[serde(default = "black")]
        specular: ColorDesc,
        /// Exponent of the highlight, at least 0. Default: 32.
        #[serde(default = "phong_exponent")]
        exponent: f32,
    },
    /// Cook and Torrance's model, by its parameters: `d albedo / pi + s D F G / (4 |cos wo| |cos wi|)` with the GGX distribution of alpha `m`,
    /// Smith's `G` and Schlick's `F`.
    CookTorrance {
        /// Colour of the diffuse part. Default: 0.5.
        #[serde(default = "half_color")]
        albedo: [f32; 3],
        /// Weight of the diffuse part within `[0, 1]`. Default: 0.5.
        #[serde(default = "half_number")]
        d: f32,
        /// Weight of the specular part within `[0, 1]`; with `d` at most 1. Default: 0.5.
        #[serde(default = "half_number")]
        s: f32,
        /// Width of the distribution of slopes within `[0, 1]`; at least 0.001 counts. Default: 0.3.
        #[serde(default = "slope")]
        m: f32,
        /// Reflectance of the specular part ahead, for red, green, blue. Default: 0.04.
        #[serde(default = "plastic_reflectance")]
        f0: [f32; 3],
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
    /// Another material on a surface that looks as if it had relief: give `normal_map` or `bump_map`. The shape itself stays as it is, and
    /// needs uv: every shape has them but a mesh without `uvs`. It may be a part of other materials.
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

/// An image of normals in tangent space: red along u, green along v (upward in the image), blue along the normal, each as `2 x - 1` of a linear
/// value. On meshes the frame is MikkTSpace's, with the mesh's normals; on other shapes it is that of u and v.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalMapDesc {
    /// The texture's name. Its `color_space` must not be `srgb`.
    pub texture: String,
    /// Factor on the tilt, from 0 to 16. Default: 1.
    #[serde(default = "one")]
    pub strength: f32,
    /// Whether green grows downward in the image, as in maps made for DirectX. Default: false.
    #[serde(default)]
    pub flip_y: bool,
}

/// A texture of heights along the normal.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BumpMapDesc {
    /// The texture's name.
    pub texture: String,
    /// Height in world units where the texture is 1; below 0 turns bumps into dents. Default: 1.
    #[serde(default = "one")]
    pub height: f32,
}

fn one() -> f32 {
    1.0
}

fn zero() -> ScalarDesc {
    ScalarDesc::Constant(0.0)
}

fn half_scalar() -> ScalarDesc {
    ScalarDesc::Constant(0.5)
}

fn half_number() -> f32 {
    0.5
}

fn half_color() -> [f32; 3] {
    [0.5; 3]
}

fn black() -> ColorDesc {
    ColorDesc::Grey(0.0)
}

fn phong_exponent() -> f32 {
    32.0
}

fn slope() -> f32 {
    0.3
}

fn plastic_reflectance() -> [f32; 3] {
    [0.04; 3]
}

fn yes() -> bool {
    true
}

fn half() -> ColorDesc {
    ColorDesc::Grey(0.5)
}

fn white() -> ColorDesc {
    ColorDesc::Grey(1.0)
}

fn glass_ior() -> f32 {
    1.5
}
