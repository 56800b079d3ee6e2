//! Normal maps and bump maps.

use crate::geometry::{Geometry, Shape, SurfaceInteraction};
use crate::id::TextureId;
use crate::math::{Vec2, Vec3, vec2};
use crate::texture::Texture;

/// Where the shading normals of a surface come from, other than from the surface itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalPerturbation {
    /// An image of normals `2 rgb - 1` in the frame of u, v and the normal.
    NormalMap {
        /// The image.
        texture: TextureId,
        /// The tilt along u and along v for tilts along red and green: turned and mirrored as the image is, times a
        /// strength.
        axes: [Vec2; 2],
    },
    /// A texture of heights along the normal.
    BumpMap {
        /// The texture.
        texture: TextureId,
        /// Units of length for a value of 1.
        height: f32,
        /// Distance in uv over which slopes are measured.
        step: Vec2,
    },
}

/// The least cosine between a shading normal and the surface's own.
const LEAST_COSINE: f32 = 0.01;

impl NormalPerturbation {
    /// A normal map; x and y of its normals are multiplied by `strength`. With `flip_y`, green grows downward in the
    /// image.
    pub fn normal_map(texture: TextureId, strength: f32, flip_y: bool, textures: &[Texture]) -> Self {
        let green = vec2(1.0, if flip_y { -1.0 } else { 1.0 });
        let axes = textures[texture.index()].axes().map(|axis| axis.normalize_or_zero() * green * strength);
        Self::NormalMap { texture, axes }
    }

    /// A bump map of a texture; slopes are measured from half a texel before a point to half a texel behind it.
    pub fn bump_map(texture: TextureId, height: f32, textures: &[Texture]) -> Self {
        let texel = textures[texture.index()].texel();
        Self::BumpMap { texture, height, step: texel.unwrap_or(Vec2::splat(1.0 / 1024.0)) }
    }

    /// The same where lengths are `factor` times what they were.
    pub fn rescale(&mut self, factor: f64) {
        if let Self::BumpMap { height, .. } = self {
            *height = (f64::from(*height) * factor) as f32;
        }
    }

    /// The shading normal at a point with its change with v: unit, in the hemisphere of the geometric normal.
    pub fn normal(&self, geometry: &Geometry, textures: &[Texture], at: &SurfaceInteraction, dp_dv: Vec3) -> Vec3 {
        let n = match self {
            Self::NormalMap { texture, axes } => {
                let rgb = textures[texture.index()].color(at.uv);
                let tilt = vec2(2.0 * rgb.r - 1.0, 2.0 * rgb.g - 1.0);
                let [tangent, bitangent] = tangents(geometry, at, dp_dv);
                tangent * axes[0].dot(tilt) + bitangent * axes[1].dot(tilt) + at.n_s * (2.0 * rgb.b - 1.0)
            }
            Self::BumpMap { texture, height, step } => {
                let texture = &textures[texture.index()];
                let rise = |step: Vec2| texture.scalar(at.uv + 0.5 * step) - texture.scalar(at.uv - 0.5 * step);
                let slope_u = rise(vec2(step.x, 0.0)) / step.x;
                let slope_v = rise(vec2(0.0, step.y)) / step.y;
                at.n_s - surface_gradient(at, dp_dv, slope_u, slope_v) * *height
            }
        };
        above_surface(n.normalize_or_zero(), at)
    }
}

/// Tangent and bitangent that normal maps refer to. Those of meshes made for normal maps are as baked; others are unit
/// and perpendicular.
fn tangents(geometry: &Geometry, at: &SurfaceInteraction, dp_dv: Vec3) -> [Vec3; 2] {
    if let Shape::Mesh(mesh) = geometry.shape(at.shape)
        && mesh.has_tangents()
    {
        if !at.is_instanced() {
            return [at.dp_du, dp_dv];
        }
        // An instance turns tangents, but must not make the relief steeper by its scale.
        let baked = geometry.instance(at.instance).transform_at(at.time).inverse_vector(at.dp_du.as_dvec3());
        return right_angled(at, at.dp_du.normalize_or_zero() * baked.length() as f32, dp_dv);
    }
    right_angled(at, (at.dp_du - at.n_s * at.n_s.dot(at.dp_du)).normalize_or_zero(), dp_dv)
}

/// A tangent, and the bitangent across it and the normal on the side of v.
fn right_angled(at: &SurfaceInteraction, tangent: Vec3, dp_dv: Vec3) -> [Vec3; 2] {
    let bitangent = at.n_s.cross(tangent);
    [tangent, if bitangent.dot(dp_dv) < 0.0 { -bitangent } else { bitangent }]
}

/// The gradient on the surface of a function with these slopes along u and v (Mikkelsen, "Bump Mapping Unparametrized
/// Surfaces on the GPU"); zero where u and v have no directions.
fn surface_gradient(at: &SurfaceInteraction, dp_dv: Vec3, slope_u: f32, slope_v: f32) -> Vec3 {
    let (across_u, across_v) = (dp_dv.cross(at.n_s), at.n_s.cross(at.dp_du));
    let gradient = (across_u * slope_u + across_v * slope_v) / at.dp_du.dot(across_u);
    if gradient.is_finite() { gradient } else { Vec3::ZERO }
}

/// A unit normal (or zero, which means none) raised to the hemisphere of the surface's own normal.
fn above_surface(n: Vec3, at: &SurfaceInteraction) -> Vec3 {
    let cos = n.dot(at.n_g);
    if n == Vec3::ZERO {
        at.n_s
    } else if cos < LEAST_COSINE {
        (n + at.n_g * (LEAST_COSINE - cos)).normalize()
    } else {
        n
    }
}
