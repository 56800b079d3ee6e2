//! Extensions of materials: index of refraction, specular colour, sheen, anisotropy, transmission, volume and clear
//! coat.

use super::super::extensions as ext;
use super::super::textures::TextureRef;
use super::Builder;
use crate::color::Rgb;
use crate::desc::{
    AbsorptionDesc, ChannelDesc, CoefficientDesc, ColorDesc, DielectricDesc, DistributionDesc, MaterialDesc,
    MediumDesc, PhaseDesc, PrincipledDesc, RangedDesc, RoughnessDesc, ScalarDesc, SubsurfaceMethodDesc,
};
use crate::error::Result;
use crate::medium::Subsurface;

const IOR: &str = "KHR_materials_ior";
const SPECULAR: &str = "KHR_materials_specular";
const SHEEN: &str = "KHR_materials_sheen";
const ANISOTROPY: &str = "KHR_materials_anisotropy";
const TRANSMISSION: &str = "KHR_materials_transmission";
const VOLUME: &str = "KHR_materials_volume";
const VOLUME_SCATTER: &str = "KHR_materials_volume_scatter";
const DIFFUSE_TRANSMISSION: &str = "KHR_materials_diffuse_transmission";
const DISPERSION: &str = "KHR_materials_dispersion";
const CLEARCOAT: &str = "KHR_materials_clearcoat";

impl Builder<'_, '_> {
    /// A texture of an extension.
    fn texture(&self, extension: &str, key: &str, info: Option<&ext::TextureInfo>) -> Result<Option<TextureRef>> {
        TextureRef::of_extension(self.source, &format!("{}.extensions.{extension}.{key}", self.path), info)
    }

    /// Index of refraction and specular factors, as what the layer above the base reflects ahead.
    pub(super) fn specular(&mut self, desc: &mut PrincipledDesc) -> Result<()> {
        let given = self.extension::<ext::Ior>(IOR)?;
        let ior = given.as_ref().map_or(1.5, |ior| ior.ior);
        // Zero means a layer that reflects all.
        let kept = if ior == 0.0 {
            10.0
        } else if ior >= 1.0 {
            ior.min(10.0)
        } else {
            1.0
        };
        if given.is_some() {
            if kept == ior { self.mapped(IOR) } else { self.approximated(IOR, "the nearest index from 1 to 10") }
        }
        desc.ior = Some(RangedDesc::Constant(kept));
        let Some(specular) = self.extension::<ext::Specular>(SPECULAR)? else { return Ok(()) };
        if self.has(TRANSMISSION) {
            self.ignored(SPECULAR, "glass reflects by its index of refraction");
            return Ok(());
        }
        let [r, g, b] = specular.specular_color_factor.map(|c| if c.is_nan() { 0.0 } else { c.max(0.0) });
        let ahead = ((kept - 1.0) / (kept + 1.0)).powi(2);
        let mean = (ahead * (r + g + b) / 3.0).min(1.0) * self.inputs.share(specular.specular_factor);
        let texture = self.texture(SPECULAR, "specularTexture", specular.specular_texture.as_ref())?;
        if texture.is_some() {
            // In units of 0.08.
            desc.ior = None;
            desc.specular =
                Some(self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::A, mean / 0.08)?);
        } else {
            reflect_ahead(desc, mean);
        }
        let is_plain = specular.specular_factor == 1.0
            && texture.is_none()
            && specular.specular_color_texture.is_none()
            && r == g
            && g == b;
        if is_plain {
            self.mapped(SPECULAR);
        } else {
            self.approximated(
                SPECULAR,
                "grey reflectance ahead: the mean of the colour; at grazing angles all is reflected",
            );
        }
        Ok(())
    }

    /// Sheen, white or of the base's colour.
    pub(super) fn sheen(&mut self, desc: &mut PrincipledDesc) -> Result<()> {
        let Some(sheen) = self.extension::<ext::Sheen>(SHEEN)? else { return Ok(()) };
        let color = sheen.sheen_color_factor.map(|c| self.inputs.share(c));
        let [least, most] = [color.iter().copied().fold(1.0, f32::min), color.iter().copied().fold(0.0, f32::max)];
        if most > 0.0 {
            desc.sheen = ScalarDesc::Constant(most);
            desc.sheen_tint = ScalarDesc::Constant(1.0 - least / most);
            self.approximated(
                SHEEN,
                "the principled model's sheen: of one width, white or of the base's colour, without textures",
            );
        } else {
            self.mapped(SHEEN);
        }
        Ok(())
    }

    /// Stretched highlights: alpha along the tangent is `mix(alpha, 1, strength²)`, across it `alpha`.
    pub(super) fn anisotropy(&mut self, desc: &mut PrincipledDesc, roughness: f32) -> Result<()> {
        let Some(anisotropy) = self.extension::<ext::Anisotropy>(ANISOTROPY)? else { return Ok(()) };
        let strength = self.inputs.share(anisotropy.anisotropy_strength);
        if strength == 0.0 {
            self.mapped(ANISOTROPY);
            return Ok(());
        }
        let across = self.inputs.share(roughness).powi(2).max(0.001);
        let along = across + (1.0 - across) * strength * strength;
        // Steradian's: alpha over an aspect along u, times it across, with aspect² = 1 - 0.9 anisotropic.
        let anisotropic = ((1.0 - across / along) / 0.9).min(1.0);
        desc.anisotropic = ScalarDesc::Constant(anisotropic);
        let is_constant = matches!(desc.roughness, ScalarDesc::Constant(_));
        if is_constant {
            desc.roughness = ScalarDesc::Constant((along * across).sqrt().sqrt());
        }
        // Half a turn changes nothing.
        let turns = f64::from(anisotropy.anisotropy_rotation) / std::f64::consts::PI;
        let is_straight = (turns - turns.round()).abs() < 1e-3;
        if is_straight && is_constant && anisotropic < 1.0 && anisotropy.anisotropy_texture.is_none() {
            self.mapped(ANISOTROPY);
        } else {
            self.approximated(ANISOTROPY, "stretched along u by the factors alone, at most 3.2 times as long as wide");
        }
        Ok(())
    }

    /// What changes its colour with the angle does not here.
    pub(super) fn iridescence(&mut self) {
        for name in ["KHR_materials_iridescence", "KHR_materials_subsurface"] {
            if self.has(name) {
                self.ignored(name, "not read");
            }
        }
    }

    fn has(&self, extension: &str) -> bool {
        self.extensions().is_some_and(|all| all.contains_key(extension))
    }

    /// What is dense below a surface that transmits diffusely, as a random walk.
    pub(super) fn walk_below(&mut self, desc: &mut PrincipledDesc) -> Result<()> {
        let Some(below) = self.extension::<ext::DiffuseTransmission>(DIFFUSE_TRANSMISSION)? else { return Ok(()) };
        let share = self.inputs.share(below.diffuse_transmission_factor);
        let volume = self.extension::<ext::Volume>(VOLUME)?.as_ref().and_then(absorption);
        let scatter = self.extension::<ext::VolumeScatter>(VOLUME_SCATTER)?;
        let (Some(volume), Some(scatter), false) = (volume, scatter, self.has(TRANSMISSION)) else {
            self.ignored(DIFFUSE_TRANSMISSION, "read only beside a volume that scatters");
            return Ok(());
        };
        let [absorption, scattering] = coefficients(&volume, &scatter);
        let g = scatter.anisotropy();
        desc.base_color = ColorDesc::Rgb(scatter.multiscatter_color.map(|c| self.inputs.share(c)));
        desc.subsurface = ScalarDesc::Constant(share);
        desc.subsurface_method = SubsurfaceMethodDesc::RandomWalk;
        let reduced = [0, 1, 2].map(|i| absorption[i] + (1.0 - g) * scattering[i]);
        desc.subsurface_radius = Some(CoefficientDesc::Rgb(reduced.map(|c| c.recip().clamp(1e-12, 1e12))));
        desc.subsurface_anisotropy = (g != 0.0).then_some(g);
        for name in [VOLUME, VOLUME_SCATTER, DIFFUSE_TRANSMISSION] {
            self.approximated(name, "a random walk below a surface of the colour of multiple scattering");
        }
        Ok(())
    }

    /// Glass: thin without a thickness, a medium if it absorbs or disperses and is glass all over.
    pub(super) fn transmission(&mut self, mut desc: PrincipledDesc) -> Result<MaterialDesc> {
        let volume = self.extension::<ext::Volume>(VOLUME)?;
        let scatter = self.extension::<ext::VolumeScatter>(VOLUME_SCATTER)?;
        let abbe =
            self.extension::<ext::Dispersion>(DISPERSION)?.map(|d| d.dispersion).filter(|d| *d > 0.0).map(|d| 20.0 / d);
        let Some(transmission) = self.extension::<ext::Transmission>(TRANSMISSION)? else {
            if desc.subsurface_radius.is_some() {
                return Ok(MaterialDesc::Principled(Box::new(desc)));
            }
            let given = [(VOLUME, volume.is_some()), (VOLUME_SCATTER, scatter.is_some()), (DISPERSION, abbe.is_some())];
            for (name, is_there) in given {
                if is_there {
                    self.ignored(name, "no light enters the material");
                }
            }
            return Ok(MaterialDesc::Principled(Box::new(desc)));
        };
        let texture = self.texture(TRANSMISSION, "transmissionTexture", transmission.transmission_texture.as_ref())?;
        desc.transmission = self.inputs.scalar(
            self.source,
            self.draft,
            texture.as_ref(),
            ChannelDesc::R,
            transmission.transmission_factor,
        )?;
        self.mapped(TRANSMISSION);
        desc.thin = volume.as_ref().is_none_or(|volume| volume.thickness_factor <= 0.0);
        if matches!(desc.transmission, ScalarDesc::Constant(0.0)) {
            return Ok(MaterialDesc::Principled(Box::new(desc)));
        }
        if desc.thin {
            if abbe.is_some() {
                self.ignored(DISPERSION, "the surface is thin: nothing is bent");
            }
            if scatter.is_some() {
                self.ignored(VOLUME_SCATTER, "the surface is thin");
            }
            return Ok(MaterialDesc::Principled(Box::new(desc)));
        }
        Ok(self.solid_glass(desc, volume.as_ref(), scatter.as_ref(), abbe))
    }

    /// Glass that is not thin: a dielectric if it absorbs or disperses and is glass all over.
    fn solid_glass(
        &mut self,
        mut desc: PrincipledDesc,
        volume: Option<&ext::Volume>,
        scatter: Option<&ext::VolumeScatter>,
        abbe: Option<f32>,
    ) -> MaterialDesc {
        // Glass that is not thin has an index that bends light.
        let ior = match desc.ior {
            Some(RangedDesc::Constant(ior)) => ior.max(1.05),
            _ => 1.5,
        };
        desc.ior = Some(RangedDesc::Constant(ior));
        desc.specular = None;
        let mut absorption = volume.and_then(absorption);
        if absorption.is_none() && abbe.is_none() {
            self.mapped(VOLUME);
            if scatter.is_some() {
                self.mapped(VOLUME_SCATTER);
            }
            return MaterialDesc::Principled(Box::new(desc));
        }
        let is_glass =
            matches!((&desc.transmission, &desc.metallic), (ScalarDesc::Constant(1.0), ScalarDesc::Constant(0.0)));
        if !is_glass {
            self.approximated(VOLUME, "nothing is absorbed within what is glass only in part");
            if scatter.is_some() {
                self.ignored(VOLUME_SCATTER, "the material is glass only in part");
            }
            return MaterialDesc::Principled(Box::new(desc));
        }
        let is_white = matches!(desc.base_color, ColorDesc::Rgb([1.0, 1.0, 1.0]));
        if is_white {
            self.mapped(VOLUME);
        } else {
            self.approximated(VOLUME, "absorbs within; its surface has no colour of its own");
        }
        if abbe.is_some() {
            self.mapped(DISPERSION);
        }
        let medium = scatter.map(|scatter| self.medium_within(absorption.take(), scatter));
        let roughness = match desc.roughness {
            ScalarDesc::Constant(0.0) => None,
            ScalarDesc::Constant(roughness) => Some(RoughnessDesc::Isotropic(roughness)),
            ScalarDesc::Texture { texture } => Some(RoughnessDesc::Texture { texture }),
        };
        MaterialDesc::Dielectric(Box::new(DielectricDesc {
            ior: RangedDesc::Constant(ior),
            roughness,
            alpha: None,
            distribution: DistributionDesc::default(),
            multiscatter: true,
            reflection_tint: ColorDesc::Grey(1.0),
            transmission_tint: ColorDesc::Grey(1.0),
            priority: None,
            absorption,
            medium,
            abbe: abbe.map(|abbe| abbe.clamp(1.0, 1000.0)),
        }))
    }

    /// Adds what scatters within glass, by its extinction; the result is its name.
    fn medium_within(&mut self, extinction: Option<AbsorptionDesc>, scatter: &ext::VolumeScatter) -> String {
        self.mapped(VOLUME_SCATTER);
        let [absorption, scattering] =
            extinction.map_or([[0.0; 3]; 2], |extinction| coefficients(&extinction, scatter));
        let medium = MediumDesc {
            absorption: CoefficientDesc::Rgb(absorption),
            scattering: CoefficientDesc::Rgb(scattering),
            phase: PhaseDesc::HenyeyGreenstein { g: scatter.anisotropy() },
            ..MediumDesc::default()
        };
        self.draft.add_medium(&self.name, &self.path, medium)
    }

    /// Adds the material with its clear coat; the result is its name.
    pub(super) fn layered(&mut self, base: MaterialDesc) -> Result<String> {
        let Some(coat) = self.extension::<ext::Clearcoat>(CLEARCOAT)? else {
            return Ok(self.draft.add_material(&self.name, &self.path, base));
        };
        let texture = self.texture(CLEARCOAT, "clearcoatTexture", coat.clearcoat_texture.as_ref())?;
        let amount =
            self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::R, coat.clearcoat_factor)?;
        if matches!(amount, ScalarDesc::Constant(0.0)) {
            self.mapped(CLEARCOAT);
            return Ok(self.draft.add_material(&self.name, &self.path, base));
        }
        let texture =
            self.texture(CLEARCOAT, "clearcoatRoughnessTexture", coat.clearcoat_roughness_texture.as_ref())?;
        let roughness = self.inputs.scalar(
            self.source,
            self.draft,
            texture.as_ref(),
            ChannelDesc::G,
            coat.clearcoat_roughness_factor,
        )?;
        let is_opaque = !self.has(TRANSMISSION)
            || matches!(&base, MaterialDesc::Principled(p) if matches!(p.transmission, ScalarDesc::Constant(0.0)));
        if !is_opaque {
            return Ok(self.coated_glass(base, amount, &roughness));
        }
        let normal = coat.clearcoat_normal_texture.as_ref().map(|t| t.index);
        if normal == self.json.normal_texture.as_ref().map(|t| t.index.value()) {
            self.mapped(CLEARCOAT);
        } else {
            self.approximated(CLEARCOAT, "the coat has the normals of what is below it");
        }
        let base = self.draft.add_material(&format!("{} without coat", self.name), &self.path, base);
        let roughness = match roughness {
            ScalarDesc::Constant(roughness) => RoughnessDesc::Isotropic(roughness),
            ScalarDesc::Texture { texture } => RoughnessDesc::Texture { texture },
        };
        let coated = MaterialDesc::Coated {
            base: base.clone(),
            ior: RangedDesc::Constant(1.5),
            roughness: Some(roughness),
            alpha: None,
            tint: ColorDesc::Grey(1.0),
        };
        if matches!(amount, ScalarDesc::Constant(1.0)) {
            return Ok(self.draft.add_material(&self.name, &self.path, coated));
        }
        // A coat of a part is there for that part of the light.
        let coated = self.draft.add_material(&format!("{} with coat", self.name), &self.path, coated);
        let mix = MaterialDesc::Mix { materials: [base, coated], amount };
        Ok(self.draft.add_material(&self.name, &self.path, mix))
    }

    /// Glass has only the principled model's own coat.
    fn coated_glass(&mut self, mut base: MaterialDesc, amount: ScalarDesc, roughness: &ScalarDesc) -> String {
        if let MaterialDesc::Principled(desc) = &mut base {
            self.approximated(CLEARCOAT, "on glass a coat reflects a quarter as much");
            desc.clearcoat = amount;
            // The coat's alpha runs from 0.1 to 0.001.
            let alpha = if let ScalarDesc::Constant(roughness) = roughness { roughness * roughness } else { 0.001 };
            desc.clearcoat_gloss = ScalarDesc::Constant(((0.1 - alpha) / 0.099).clamp(0.0, 1.0));
        } else {
            self.ignored(CLEARCOAT, "glass that absorbs has no coat");
        }
        self.draft.add_material(&self.name, &self.path, base)
    }
}

/// Gives the layer above the base this reflectance ahead, at most 0.66.
pub(super) fn reflect_ahead(desc: &mut PrincipledDesc, reflectance: f32) {
    let root = if reflectance.is_nan() { 0.0 } else { reflectance.clamp(0.0, 0.66).sqrt() };
    desc.specular = None;
    desc.ior = Some(RangedDesc::Constant(((1.0 + root) / (1.0 - root)).clamp(1.0, 10.0)));
}

/// What a volume absorbs, if anything.
fn absorption(volume: &ext::Volume) -> Option<AbsorptionDesc> {
    let (color, distance) = (volume.attenuation_color, volume.attenuation_distance);
    let absorbs = distance > 0.0 && distance.is_finite() && color != [1.0; 3];
    absorbs
        .then(|| AbsorptionDesc { color: color.map(|c| if c.is_nan() { 1.0 } else { c.clamp(1e-4, 1.0) }), distance })
}

impl ext::VolumeScatter {
    fn anisotropy(&self) -> f32 {
        if self.scatter_anisotropy.is_nan() { 0.0 } else { self.scatter_anisotropy.clamp(-0.99, 0.99) }
    }
}

/// Coefficients of absorption and scattering of a medium whose extinction is that of `AbsorptionDesc`, and whose
/// half-space has a colour.
fn coefficients(extinction: &AbsorptionDesc, scatter: &ext::VolumeScatter) -> [[f32; 3]; 2] {
    let color = scatter.multiscatter_color.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) });
    // The extension's formula is that of isotropic scattering, whatever the anisotropy.
    let unit = Subsurface { radius: Rgb::WHITE, anisotropy: 0.0 }.medium(color.into(), 0.0);
    let extinction = extinction.color.map(|c| -c.ln() / extinction.distance);
    [unit.absorption, unit.scattering].map(|share| {
        let share = share.to_array();
        [0, 1, 2].map(|i| share[i] * extinction[i])
    })
}
