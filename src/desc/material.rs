//! Materials and textures as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Another material on a surface that looks as if it had relief: give `normal_map` or `bump_map`. The shape itself stays as it is, and
    /// needs uv: every shape has them but a mesh without `uvs`.
    Relief {
        /// The material, by name; not one with a relief of its own.
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

fn half() -> ColorDesc {
    ColorDesc::Grey(0.5)
}

fn white() -> ColorDesc {
    ColorDesc::Grey(1.0)
}

fn glass_ior() -> f32 {
    1.5
}
