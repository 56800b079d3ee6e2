//! Materials.

use super::colors::{Colors, Meaning};
use super::params::Params;
use super::textures::bilinear_image;
use super::textures::{Texture, Textures};
use crate::desc::{
    BumpMapDesc, ColorDesc, ColorSpaceDesc, DielectricDesc, DistributionDesc, HairDesc, HairIor, HairRoughness,
    HairTilt, MaterialDesc, NormalMapDesc, PlasticDesc, RangedDesc, RoughnessDesc, WrapDesc,
};
use crate::error::Result;
use crate::import::foreign::Draft;
use crate::import::foreign::recolor::recolored;
use crate::spectrum::{Named, named};

/// A surface is smooth below this alpha, along both axes.
const SMOOTH_ALPHA: f32 = 1e-3;

/// Reads a material.
pub struct Materials<'a> {
    /// Textures that it may name.
    pub textures: &'a Textures,
    /// How colours are read.
    pub colors: Colors<'a>,
    /// The scene.
    pub draft: &'a mut Draft,
}

impl Materials<'_> {
    /// Adds a material of a kind under a name like `name`; the result is its name. `find` gives materials by pbrt's
    /// names.
    pub fn add(
        &mut self,
        name: &str,
        kind: &str,
        params: &Params,
        find: impl Fn(&str) -> Option<String>,
    ) -> Result<String> {
        let desc = self.desc(name, kind, params, find)?;
        let desc = self.with_relief(name, params, desc)?;
        params.report(self.draft);
        Ok(self.draft.add_material(name, &params.place, desc))
    }

    fn desc(
        &mut self,
        name: &str,
        kind: &str,
        params: &Params,
        find: impl Fn(&str) -> Option<String>,
    ) -> Result<MaterialDesc> {
        Ok(match kind {
            "diffuse" => MaterialDesc::Diffuse { albedo: self.color(params, "reflectance", 0.5)?, roughness: zero() },
            "coateddiffuse" => {
                self.note_layers(params);
                self.plastic(params, 1.5)?
            }
            "conductor" => self.conductor(params, "", 0.0, 1.0)?,
            "coatedconductor" => self.coated_conductor(name, params)?,
            "dielectric" => self.dielectric(params)?,
            "thindielectric" => {
                let (ior, _) = self.colors.index(params, "eta", 1.5)?;
                MaterialDesc::ThinDielectric {
                    ior: RangedDesc::Constant(ior.clamp(0.1, 10.0)),
                    reflection_tint: ColorDesc::Grey(1.0),
                    transmission_tint: ColorDesc::Grey(1.0),
                }
            }
            "diffusetransmission" => self.diffuse_transmission(params)?,
            "mix" => self.mix(params, find)?,
            "subsurface" => self.subsurface(params)?,
            "hair" => self.hair(params)?,
            "measured" => {
                let file = params.string("filename")?.ok_or_else(|| params.error("needs a filename"))?;
                MaterialDesc::Measured { file: file.to_owned() }
            }
            other => return Err(params.error(format!("unknown material \"{other}\""))),
        })
    }

    fn dielectric(&mut self, params: &Params) -> Result<MaterialDesc> {
        let (ior, abbe) = self.colors.index(params, "eta", 1.5)?;
        Ok(MaterialDesc::Dielectric(Box::new(DielectricDesc {
            ior: RangedDesc::Constant(ior.clamp(0.1, 10.0)),
            roughness: None,
            alpha: self.alpha(params, "", 0.0)?,
            distribution: DistributionDesc::default(),
            multiscatter: false,
            reflection_tint: ColorDesc::Grey(1.0),
            transmission_tint: ColorDesc::Grey(1.0),
            priority: None,
            absorption: None,
            medium: None,
            abbe,
        })))
    }

    fn hair(&mut self, params: &Params) -> Result<MaterialDesc> {
        let number = |name: &str, default: f32| -> Result<f32> {
            Ok(match self.textures.get(params, &self.colors, name, Meaning::Number, true)? {
                Some(Texture::Constant([value, ..])) => value,
                Some(Texture::Named { .. }) => {
                    params.approximate(name, "the default, for it can have no texture");
                    default
                }
                None => default,
            })
        };
        let mut hair = HairDesc {
            longitudinal_roughness: HairRoughness(number("beta_m", 0.3)?.clamp(0.0, 1.0)),
            azimuthal_roughness: HairRoughness(number("beta_n", 0.3)?.clamp(0.0, 1.0)),
            scale_tilt_degrees: HairTilt(number("alpha", 2.0)?.clamp(-45.0, 45.0)),
            ior: HairIor(number("eta", 1.55)?.clamp(1.0 + 1e-4, 10.0)),
            ..HairDesc::default()
        };
        let pigments = [number("eumelanin", 0.0)?.max(0.0), number("pheomelanin", 0.0)?.max(0.0)];
        let has_pigments = params.has("eumelanin") || params.has("pheomelanin");
        let color = ["reflectance", "color"].into_iter().find(|name| params.has(name));
        // In the order of pbrt.
        match self.textures.get(params, &self.colors, "sigma_a", Meaning::Number, false)? {
            Some(Texture::Constant(sigma_a)) => hair.sigma_a = Some(sigma_a.map(|sigma| sigma.max(0.0))),
            Some(Texture::Named { .. }) => params.approximate("sigma_a", "brown hair, for it can have no texture"),
            None if let Some(name) = color => hair.color = Some(self.color(params, name, 0.5)?),
            None if has_pigments => [hair.eumelanin, hair.pheomelanin] = pigments.map(Some),
            None => {}
        }
        Ok(MaterialDesc::Hair(Box::new(hair)))
    }

    fn coated_conductor(&mut self, name: &str, params: &Params) -> Result<MaterialDesc> {
        let (ior, _) = self.colors.index(params, "interface.eta", 1.5)?;
        let base = self.conductor(params, "conductor.", 0.0, ior)?;
        let base = self.draft.add_material(&format!("{name}_base"), &params.place, base);
        let alpha = self.alpha(params, "interface.", 0.0)?;
        self.note_layers(params);
        let (ior, tint) = (RangedDesc::Constant(ior.clamp(1.0, 10.0)), ColorDesc::Grey(1.0));
        Ok(MaterialDesc::Coated { base, ior, roughness: None, alpha, tint })
    }

    pub(super) fn color(&mut self, params: &Params, name: &str, default: f32) -> Result<ColorDesc> {
        Ok(self.textures.reflectance(params, &self.colors, name, default)?.color(self.draft, &params.place))
    }

    /// A diffuse base below a coat.
    fn plastic(&mut self, params: &Params, index: f32) -> Result<MaterialDesc> {
        let (ior, _) = self.colors.index(params, "eta", index)?;
        let ior = ior.clamp(1.0 + 1e-4, 10.0);
        let alpha = self.alpha(params, "", 0.0)?;
        // The means of its walk through layers: nothing is added for light that microfacets lose.
        let multiscatter = !matches!(alpha, None | Some(RoughnessDesc::Isotropic(_)));
        Ok(MaterialDesc::Plastic(Box::new(PlasticDesc {
            albedo: self.color(params, "reflectance", 0.5)?,
            ior: RangedDesc::Constant(ior),
            roughness: None,
            alpha,
            distribution: DistributionDesc::default(),
            coat_tint: ColorDesc::Grey(1.0),
            nonlinear: true,
            multiscatter,
        })))
    }

    /// What pbrt's walk through layers has and Steradian's lacks.
    fn note_layers(&mut self, params: &Params) {
        self.draft.approximated(
            &params.place,
            &params.element,
            "",
            "a closed form in place of a random walk between layers",
        );
        for parameter in ["thickness", "albedo", "g", "maxdepth", "nsamples"] {
            params.ignore(parameter, "there is nothing between the layers");
        }
    }

    /// The GGX alpha of the parameters with a prefix; `None` if the surface is smooth.
    pub(super) fn alpha(&mut self, params: &Params, prefix: &str, default: f32) -> Result<Option<RoughnessDesc>> {
        let remap = params.bool_or("remaproughness", true)?;
        let key = |name: &str| format!("{prefix}{name}");
        let both = self.textures.number(params, &self.colors, &key("roughness"), default)?;
        let along = |name: &str| -> Result<Texture> {
            Ok(self.textures.get(params, &self.colors, name, Meaning::Number, true)?.unwrap_or(both.clone()))
        };
        let (u, v) = (along(&key("uroughness"))?, along(&key("vroughness"))?);
        if let (Texture::Constant(u), Texture::Constant(v)) = (&u, &v) {
            let alpha = [u[0], v[0]].map(|x| if remap { x.max(0.0).sqrt() } else { x }).map(|x| x.clamp(0.0, 1.0));
            return Ok(match alpha {
                _ if alpha[0].max(alpha[1]) < SMOOTH_ALPHA => None,
                [u, v] if u == v => Some(RoughnessDesc::Isotropic(u)),
                _ => Some(RoughnessDesc::Anisotropic(alpha)),
            });
        }
        if u == v {
            let both = self.remapped(u, remap, params, key);
            return Ok(both.name(self.draft, &params.place).map(|texture| RoughnessDesc::Texture { texture }));
        }
        let [u, v] = [u, v].map(|along| {
            let along = self.remapped(along, remap, params, key);
            along.scalar(self.draft, &params.place)
        });
        Ok(Some(RoughnessDesc::Axes { u, v }))
    }

    /// The alpha of a roughness, which is its root if it is to be remapped.
    fn remapped(&mut self, roughness: Texture, remap: bool, params: &Params, key: impl Fn(&str) -> String) -> Texture {
        let root = |x: f32| x.max(0.0).sqrt();
        match roughness {
            roughness if !remap => roughness,
            Texture::Constant(value) => Texture::Constant(value.map(root)),
            Texture::Named { name, factor } => match recolored(self.draft, self.colors.folder, &name, factor, &root) {
                Some(name) => Texture::Named { name, factor: [1.0; 3] },
                None => {
                    for name in ["roughness", "uroughness", "vroughness"].map(key) {
                        params.approximate(&name, "the texture itself is alpha, not its root");
                    }
                    Texture::Named { name, factor }
                }
            },
        }
    }

    /// A metal in a medium of index `outside`.
    fn conductor(&mut self, params: &Params, prefix: &str, default: f32, outside: f32) -> Result<MaterialDesc> {
        let alpha = self.alpha(params, prefix, default)?;
        let reflectance = self.textures.get(params, &self.colors, "reflectance", Meaning::Reflectance, false)?;
        let (eta, k, tint) = match reflectance {
            // Of all metals with this reflectance, that whose index is 1.
            Some(Texture::Constant(color)) => {
                let k = color.map(|r| 2.0 * r.clamp(0.0, 0.9999).sqrt() / (1.0 - r.clamp(0.0, 0.9999)).sqrt());
                ([1.0; 3], k, ColorDesc::Grey(1.0))
            }
            Some(texture) => {
                params.approximate("reflectance", "the same at all angles");
                ([1.0; 3], [100.0; 3], texture.color(self.draft, &params.place))
            }
            None => {
                let copper = |part: &str| named(&format!("metal-Cu-{part}")).map_or([1.0; 3], Named::rgb);
                let part = |name: &str| -> Result<[f32; 3]> {
                    let key = format!("{prefix}{name}");
                    match self.textures.get(params, &self.colors, &key, Meaning::Number, false)? {
                        Some(Texture::Constant(value)) => Ok(value),
                        Some(Texture::Named { .. }) => {
                            params.approximate(&key, "copper, for the index can have no texture");
                            Ok(copper(name))
                        }
                        None => Ok(copper(name)),
                    }
                };
                (part("eta")?.map(|x| x / outside), part("k")?.map(|x| x / outside), ColorDesc::Grey(1.0))
            }
        };
        let distribution = DistributionDesc::default();
        Ok(MaterialDesc::Conductor {
            metal: None,
            eta: Some(eta),
            k: Some(k),
            roughness: None,
            alpha,
            distribution,
            tint,
            multiscatter: false,
        })
    }

    fn diffuse_transmission(&mut self, params: &Params) -> Result<MaterialDesc> {
        let scale = params.number_or("scale", 1.0)? as f32;
        let part = |name: &str| -> Result<Texture> {
            Ok(self.textures.reflectance(params, &self.colors, name, 0.25)?.times([scale; 3]))
        };
        let (mut reflectance, mut transmittance) = (part("reflectance")?, part("transmittance")?);
        if let (Texture::Constant(r), Texture::Constant(t)) = (&mut reflectance, &mut transmittance) {
            let sum = (0..3).map(|i| r[i] + t[i]).fold(0.0, f32::max);
            if sum > 1.0 {
                params.approximate("transmittance", "both are scaled so that no light is gained");
                params.approximate("reflectance", "both are scaled so that no light is gained");
                (*r, *t) = (r.map(|x| x / sum), t.map(|x| x / sum));
            }
        }
        let reflectance = reflectance.color(self.draft, &params.place);
        let transmittance = transmittance.color(self.draft, &params.place);
        Ok(MaterialDesc::DiffuseTransmission { reflectance, transmittance })
    }

    fn mix(&mut self, params: &Params, find: impl Fn(&str) -> Option<String>) -> Result<MaterialDesc> {
        let names = params.get("materials").map(|param| (param, &param.values));
        let Some((param, super::params::Values::Strings(names))) = names else {
            return Err(params.error("needs the names of two materials"));
        };
        let [first, second] = names.as_slice() else {
            return Err(param.error(format!("needs the names of two materials, not {}", names.len())));
        };
        let known = |name: &str| find(name).ok_or_else(|| param.error(format!("no material named \"{name}\"")));
        let materials = [known(first)?, known(second)?];
        let amount = self.textures.number(params, &self.colors, "amount", 0.5)?.scalar(self.draft, &params.place);
        Ok(MaterialDesc::Mix { materials, amount })
    }

    /// The material under its normal or displacement map, if it has one.
    fn with_relief(&mut self, name: &str, params: &Params, desc: MaterialDesc) -> Result<MaterialDesc> {
        let normal_map = match params.string("normalmap")? {
            None => None,
            Some(file) => {
                params.approximate("normalmap", "in the frame of MikkTSpace on meshes");
                let image = bilinear_image(file, ColorSpaceDesc::Linear, WrapDesc::default());
                let texture = self.draft.add_texture(&format!("{name}_normals"), &params.place, image);
                Some(NormalMapDesc { texture, strength: 1.0, flip_y: false })
            }
        };
        let heights = self.textures.get(params, &self.colors, "displacement", Meaning::Number, true)?;
        let bump_map = match heights {
            Some(Texture::Named { name: texture, factor }) if normal_map.is_none() => {
                params.approximate("displacement", "heights are cut off at 0 and 1 before they are scaled");
                Some(BumpMapDesc { texture, height: factor[0] })
            }
            // Level ground, or one relief too many.
            Some(Texture::Named { .. }) => {
                params.ignore("displacement", "there is a normal map");
                None
            }
            _ => None,
        };
        if normal_map.is_none() && bump_map.is_none() {
            return Ok(desc);
        }
        let material = self.draft.add_material(&format!("{name}_flat"), &params.place, desc);
        Ok(MaterialDesc::Relief { material, normal_map, bump_map })
    }
}

fn zero() -> crate::desc::ScalarDesc {
    crate::desc::ScalarDesc::Constant(0.0)
}
