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

/// GGX roughness: a number, or `[along u, along v]` for an anisotropic surface. The distribution's alpha is its square.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or [along u, along v]")]
pub enum RoughnessDesc {
    /// The same in all directions.
    Isotropic(f32),
    /// Along u, along v.
    Anisotropic([f32; 2]),
}

/// A material. All are two-sided; a dielectric's inside is the side against the normal.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum MaterialDesc {
    /// Ideal diffuse reflection.
    Diffuse {
        /// Fraction of light reflected, each channel within `[0, 1]`. Default: 0.5.
        #[serde(default = "half")]
        albedo: ColorDesc,
    },
    /// Ideal specular reflection.
    Mirror {
        /// Fraction of light reflected, each channel within `[0, 1]`, not a checkerboard. Default: 1.
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
        /// Factor on the reflectance, within `[0, 1]`, not a checkerboard. Default: 1.
        #[serde(default = "white")]
        tint: ColorDesc,
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
    },
    /// A diffuse base under a clear dielectric coat. Smooth unless `roughness` or `alpha` is given.
    Plastic {
        /// Colour of the base, each channel within `[0, 1]`. Default: 0.5.
        #[serde(default = "half")]
        albedo: ColorDesc,
        /// Index of refraction of the coat over that of the outside, above 1 and at most 10. Default: 1.5.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// GGX roughness of the coat within `[0, 1]`; alpha is its square.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roughness: Option<RoughnessDesc>,
        /// GGX alpha itself, in place of `roughness`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        alpha: Option<RoughnessDesc>,
    },
    /// Disney's principled model, for most surfaces.
    Principled(Box<PrincipledDesc>),
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

/// A texture.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum TextureDesc {
    /// A checkerboard in uv.
    Checker {
        /// Colour of the square at the origin of uv. Default: 0.4.
        #[serde(default = "dark")]
        color0: [f32; 3],
        /// Colour of its neighbours. Default: 0.2.
        #[serde(default = "darker")]
        color1: [f32; 3],
        /// Repetitions of a pair of squares along u and v. Default: 1, 1.
        #[serde(default = "unit_scale")]
        scale: [f32; 2],
    },
    /// The same colour everywhere.
    Constant {
        /// The colour.
        color: [f32; 3],
    },
}

fn dark() -> [f32; 3] {
    [0.4; 3]
}

fn darker() -> [f32; 3] {
    [0.2; 3]
}

fn unit_scale() -> [f32; 2] {
    [1.0; 2]
}
