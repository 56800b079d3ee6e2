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
pub struct MeasuredMedium {
    name: &'static str,
    /// Reduced scattering.
    pub scattering: [f32; 3],
    /// Absorption.
    pub absorption: [f32; 3],
}

const fn of(name: &'static str, scattering: [f32; 3], absorption: [f32; 3]) -> MeasuredMedium {
    MeasuredMedium { name, scattering, absorption }
}

/// What pbrt has where nothing is given.
const MILK: MeasuredMedium = of("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]);

/// Jensen, Marschner, Levoy and Hanrahan, "A Practical Model for Subsurface Light Transport", figure 5; then Narasimhan
/// et al., "Acquiring Scattering Properties of Participating Media by Dilution", table 1.
#[rustfmt::skip]
const MEASURED: [MeasuredMedium; 47] = [
    of("Apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    of("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    of("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    of("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    of("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    of("Marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    of("Potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    of("Skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    of("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    of("Skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    of("Spectralon", [11.6, 20.4, 14.9], [0.0; 3]),
    MILK,
    of("Lowfat Milk", [0.89187, 1.5136, 2.532], [0.002875, 0.00575, 0.0115]),
    of("Reduced Milk", [2.4858, 3.1669, 4.5214], [0.0025556, 0.0051111, 0.012778]),
    of("Regular Milk", [4.5513, 5.8294, 7.136], [0.0015333, 0.0046, 0.019933]),
    of("Espresso", [0.72378, 0.84557, 1.0247], [4.7984, 6.5751, 8.8493]),
    of("Mint Mocha Coffee", [0.31602, 0.38538, 0.48131], [3.772, 5.8228, 7.82]),
    of("Lowfat Soy Milk", [0.30576, 0.34233, 0.61664], [0.0014375, 0.0071875, 0.035937]),
    of("Regular Soy Milk", [0.59223, 0.73866, 1.4693], [0.0019167, 0.0095833, 0.065167]),
    of("Lowfat Chocolate Milk", [0.64925, 0.83916, 1.1057], [0.0115, 0.0368, 0.1564]),
    of("Regular Chocolate Milk", [1.4585, 2.1289, 2.9527], [0.010063, 0.043125, 0.14375]),
    of("Coke", [8.9053e-05, 8.372e-05, 0.0], [0.10014, 0.16503, 0.2468]),
    of("Pepsi", [6.1697e-05, 4.2564e-05, 0.0], [0.091641, 0.14158, 0.20729]),
    of("Sprite", [6.0306e-06, 6.4139e-06, 6.5504e-06], [0.001886, 0.0018308, 0.0020025]),
    of("Gatorade", [0.0024574, 0.003007, 0.0037325], [0.024794, 0.019289, 0.008878]),
    of("Chardonnay", [1.7982e-05, 1.3758e-05, 1.2023e-05], [0.010782, 0.011855, 0.023997]),
    of("White Zinfandel", [1.7501e-05, 1.9069e-05, 1.288e-05], [0.012072, 0.016184, 0.019843]),
    of("Merlot", [2.1129e-05, 0.0, 0.0], [0.11632, 0.25191, 0.29434]),
    of("Budweiser Beer", [2.4356e-05, 2.4079e-05, 1.0564e-05], [0.011492, 0.024911, 0.057786]),
    of("Coors Light Beer", [5.0922e-05, 4.301e-05, 0.0], [0.006164, 0.013984, 0.034983]),
    of("Clorox", [0.0024035, 0.0031373, 0.003991], [0.0033542, 0.014892, 0.026297]),
    of("Apple Juice", [0.00013612, 0.00015836, 0.000227], [0.012957, 0.023741, 0.052184]),
    of("Cranberry Juice", [0.00010402, 0.00011646, 7.8139e-05], [0.039437, 0.094223, 0.12426]),
    of("Grape Juice", [5.382e-05, 0.0, 0.0], [0.10404, 0.23958, 0.29325]),
    of("Ruby Grapefruit Juice", [0.011002, 0.010927, 0.011036], [0.085867, 0.18314, 0.25262]),
    of("White Grapefruit Juice", [0.22826, 0.23998, 0.32748], [0.0138, 0.018831, 0.056781]),
    of("Shampoo", [0.0007176, 0.0008303, 0.0009016], [0.014107, 0.045693, 0.061717]),
    of("Strawberry Shampoo", [0.00015671, 0.00015947, 1.518e-05], [0.01449, 0.05796, 0.075823]),
    of("Head & Shoulders Shampoo", [0.023805, 0.028804, 0.034306], [0.084621, 0.15688, 0.20365]),
    of("Lemon Tea Powder", [0.040224, 0.045264, 0.051081], [2.4288, 4.5757, 7.2127]),
    of("Orange Powder", [0.00015617, 0.00017482, 0.0001762], [0.001449, 0.003441, 0.007863]),
    of("Pink Lemonade Powder", [0.00012103, 0.00013073, 0.00012528], [0.001165, 0.002366, 0.003195]),
    of("Cappuccino Powder", [1.8436, 2.5851, 2.1662], [35.844, 49.547, 61.084]),
    of("Salt Powder", [0.027333, 0.032451, 0.031979], [0.28415, 0.3257, 0.34148]),
    of("Sugar Powder", [0.00022272, 0.00025513, 0.000271], [0.012638, 0.031051, 0.050124]),
    of("Suisse Mocha Powder", [2.7979, 3.5452, 4.3365], [17.502, 27.004, 35.433]),
    of("Pacific Ocean Surface Water", [0.0001764, 0.00032095, 0.00019617], [0.031845, 0.031324, 0.030147]),
];

/// The medium of this name, if it is known.
pub fn measured(name: &str) -> Option<&'static MeasuredMedium> {
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

impl MeasuredMedium {
    fn below(&self, scale: f32) -> Below {
        let scaled = |values: [f32; 3]| values.map(|value| value * scale);
        Below::of_coefficients(scaled(self.absorption), scaled(self.scattering))
    }
}
