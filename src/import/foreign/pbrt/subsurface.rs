//! The material `subsurface`: light that is scattered below a dielectric boundary.

use super::colors::Meaning;
use super::materials::Materials;
use super::params::Params;
use super::textures::Texture;
use crate::desc::{
    CoefficientDesc, ColorDesc, MaterialDesc, PrincipledDesc, RangedDesc, RoughnessDesc, ScalarDesc,
    SubsurfaceMethodDesc,
};
use crate::error::Result;
use crate::medium::half_space_albedo;

/// Coefficients of a medium in 1/mm for red, green and blue.
pub struct Measured {
    name: &'static str,
    /// Reduced scattering.
    pub scattering: [f32; 3],
    /// Absorption.
    pub absorption: [f32; 3],
}

/// What pbrt has where nothing is given.
const MILK: Measured =
    Measured { name: "Wholemilk", scattering: [2.55, 3.21, 3.77], absorption: [0.0011, 0.0024, 0.014] };

/// Jensen, Marschner, Levoy and Hanrahan, "A Practical Model for Subsurface Light Transport", figure 5.
#[rustfmt::skip]
const MEASURED: [Measured; 12] = [
    Measured { name: "Apple", scattering: [2.29, 2.39, 1.97], absorption: [0.0030, 0.0034, 0.046] },
    Measured { name: "Chicken1", scattering: [0.15, 0.21, 0.38], absorption: [0.015, 0.077, 0.19] },
    Measured { name: "Chicken2", scattering: [0.19, 0.25, 0.32], absorption: [0.018, 0.088, 0.20] },
    Measured { name: "Cream", scattering: [7.38, 5.47, 3.15], absorption: [0.0002, 0.0028, 0.0163] },
    Measured { name: "Ketchup", scattering: [0.18, 0.07, 0.03], absorption: [0.061, 0.97, 1.45] },
    Measured { name: "Marble", scattering: [2.19, 2.62, 3.00], absorption: [0.0021, 0.0041, 0.0071] },
    Measured { name: "Potato", scattering: [0.68, 0.70, 0.55], absorption: [0.0024, 0.0090, 0.12] },
    Measured { name: "Skimmilk", scattering: [0.70, 1.22, 1.90], absorption: [0.0014, 0.0025, 0.0142] },
    Measured { name: "Skin1", scattering: [0.74, 0.88, 1.01], absorption: [0.032, 0.17, 0.48] },
    Measured { name: "Skin2", scattering: [1.09, 1.59, 1.79], absorption: [0.013, 0.070, 0.145] },
    Measured { name: "Spectralon", scattering: [11.6, 20.4, 14.9], absorption: [0.0; 3] },
    MILK,
];

/// The medium of this name, if it is known.
pub fn measured(name: &str) -> Option<&'static Measured> {
    MEASURED.iter().find(|medium| medium.name == name)
}

/// The colour of a half-space and its mean free paths.
struct Below {
    color: ColorDesc,
    radius: [f32; 3],
}

impl Below {
    fn of_coefficients(absorption: [f32; 3], reduced_scattering: [f32; 3]) -> Self {
        let of_channel = |i: usize| half_space_albedo(absorption[i], reduced_scattering[i]);
        let radius = |i: usize| 1.0 / (absorption[i] + reduced_scattering[i]);
        Self { color: ColorDesc::Rgb([0, 1, 2].map(of_channel)), radius: [0, 1, 2].map(radius) }
    }
}

impl Materials<'_> {
    /// A random walk below a principled surface.
    pub(super) fn subsurface(&mut self, params: &Params) -> Result<MaterialDesc> {
        let how = "a random walk below a principled surface in place of a profile of diffusion";
        self.draft.approximated(&params.place, &params.element, "", how);
        let (ior, _) = self.colors.index(params, "eta", 1.33)?;
        let g = params.number_or("g", 0.0)?.clamp(-0.9, 0.9) as f32;
        let Below { color, radius } = self.below(params, g)?;
        let roughness = match self.alpha(params, "", 0.0)? {
            None => 0.0,
            Some(RoughnessDesc::Isotropic(alpha)) => alpha.sqrt(),
            Some(RoughnessDesc::Anisotropic([u, v])) => {
                params.approximate("uroughness", "the mean of both axes");
                (u * v).sqrt().sqrt()
            }
            Some(_) => {
                params.approximate("roughness", "0.3, for here it can have no texture");
                0.3
            }
        };
        Ok(MaterialDesc::Principled(Box::new(PrincipledDesc {
            base_color: color,
            roughness: ScalarDesc::Constant(roughness),
            ior: Some(RangedDesc::Constant(ior.clamp(1.0, 10.0))),
            subsurface: ScalarDesc::Constant(1.0),
            subsurface_method: SubsurfaceMethodDesc::RandomWalk,
            subsurface_radius: Some(CoefficientDesc::Rgb(radius.map(|r| r.clamp(1e-12, 1e12)))),
            subsurface_anisotropy: (g != 0.0).then_some(g),
            ..PrincipledDesc::default()
        })))
    }

    /// What is below the surface, in the order of pbrt: a measured medium, coefficients, a reflectance, milk.
    fn below(&mut self, params: &Params, g: f32) -> Result<Below> {
        let scale = params.number_or("scale", 1.0)?.max(0.0) as f32;
        if let Some(name) = params.string("name")? {
            if let Some(medium) = measured(name) {
                return Ok(medium.below(scale));
            }
            params.approximate("name", "whole milk, for no such medium is known");
            return Ok(MILK.below(scale));
        }
        let get = |name: &str| self.textures.get(params, &self.colors, name, Meaning::Number, false);
        match (get("sigma_a")?, get("sigma_s")?) {
            (Some(Texture::Constant(absorption)), Some(Texture::Constant(scattering))) => {
                let scaled = |values: [f32; 3], factor: f32| values.map(|value| value.max(0.0) * factor);
                Ok(Below::of_coefficients(scaled(absorption, scale), scaled(scattering, scale * (1.0 - g))))
            }
            (None, None) if params.has("reflectance") => {
                let path = match get("mfp")? {
                    Some(Texture::Constant(path)) => path,
                    Some(Texture::Named { .. }) => {
                        params.approximate("mfp", "1, for it can have no texture");
                        [1.0; 3]
                    }
                    None => [1.0; 3],
                };
                if g != 0.0 {
                    params.approximate("g", "paths are longer as if nothing was absorbed");
                }
                let radius = path.map(|path| path.max(0.0) * scale / (1.0 - g));
                Ok(Below { color: self.color(params, "reflectance", 0.5)?, radius })
            }
            (None, None) => Ok(MILK.below(scale)),
            _ => {
                for name in ["sigma_a", "sigma_s"] {
                    params.approximate(name, "whole milk, for both are needed, without textures");
                }
                Ok(MILK.below(scale))
            }
        }
    }
}

impl Measured {
    fn below(&self, scale: f32) -> Below {
        let scaled = |values: [f32; 3]| values.map(|value| value * scale);
        Below::of_coefficients(scaled(self.absorption), scaled(self.scattering))
    }
}
