//! Materials: names to ids, parameters to BSDFs.

use std::collections::HashMap;

use super::CompileContext;
use super::faults::Faults;
use super::media::NamedMedia;
use super::textures::{TextureTable, TextureUse};
use crate::bsdf::{BsdfFlags, Conductor, Lambert};
use crate::color::Rgb;
use crate::desc::{
    ColorDesc, DielectricDesc, DistributionDesc, MaterialDesc, PhongLobeDesc, RangedDesc, RoughnessDesc, ScalarDesc,
    SceneDesc, UsedNames,
};
use crate::error::Result;
use crate::id::{MaterialId, NormalPerturbationId, TextureId};
use crate::material::{AlphaInput, ColorInput, Facets, Material, RangedInput, ScalarInput, TexturedMaterial};
use crate::math::RenderSpace;
use crate::medium::{Media, Medium, Subsurface};
use crate::metal::{Metal, MetalNames};
use crate::normal_perturbation::NormalPerturbation;
use crate::suggestion::did_you_mean;
use crate::texture::Texture;

/// All materials and textures, with their names.
#[derive(Default)]
pub struct MaterialTable {
    pub materials: Vec<Material>,
    pub textures: TextureTable,
    pub normal_perturbations: Vec<NormalPerturbation>,
    /// What is within surfaces of these materials.
    pub media: Media,
    /// What the scene calls them, if it does, by medium.
    pub media_names: Vec<Option<String>>,
    /// Reliefs of materials of the scene file that have one.
    pub(super) by_material: HashMap<MaterialId, NormalPerturbationId>,
    names: HashMap<String, MaterialBinding>,
    /// The medium of each material that has one.
    pub(super) medium_of: HashMap<MaterialId, Medium>,
    /// How light is scattered below the surface of each material where it is.
    subsurface_of: HashMap<MaterialId, Subsurface>,
}

/// The compiled material of a shape.
#[derive(Clone, Copy, Debug)]
pub struct MaterialBinding {
    pub material: MaterialId,
    pub normal_perturbation: Option<NormalPerturbationId>,
    /// How much of the surface is there, if not all of it.
    pub opacity: Option<TextureId>,
}

impl MaterialBinding {
    /// A material alone.
    pub fn plain(material: MaterialId) -> Self {
        Self { material, normal_perturbation: None, opacity: None }
    }
}

impl MaterialTable {
    /// The id of the material for shapes that name none: diffuse, albedo 1/2.
    pub const DEFAULT: MaterialId = MaterialId(0);

    /// All materials of a scene; for each that has a fault, which is kept, there is the default one.
    pub fn new(files: &CompileContext, desc: &SceneDesc, used: &UsedNames, faults: &mut Faults) -> Self {
        let textures = TextureTable::new(files, desc, used, faults);
        let default = Material::from(Lambert { albedo: Rgb::splat(0.5) });
        let mut table = Self { materials: vec![default], ..Self::default() };
        let media = NamedMedia::new(files, desc, used, faults);
        let compiler = Compiler { files, textures: &textures, media: &media, used };
        for name in desc.materials.keys() {
            let mut outer = Vec::new();
            let added = table.add(&compiler, desc, name, &mut outer);
            if faults.keep(added).is_none() {
                // Those that consist of a faulty one have no fault of their own.
                for name in outer.into_iter().chain([name.as_str()]) {
                    table.names.insert(name.to_owned(), MaterialBinding::plain(Self::DEFAULT));
                }
            }
        }
        let within = Media::new(table.medium_of.values().copied(), faults.keep(media.around(files, desc)).flatten());
        table.media_names = within.iter().map(|medium| media.name_of(medium).map(str::to_owned)).collect();
        table.media = within.with_volumes(media.volumes);
        table.textures = textures;
        table
    }

    /// Compiles a material and what it consists of, unless that is done. `outer` are the materials that consist of it.
    pub(super) fn add<'a>(
        &mut self,
        compiler: &Compiler,
        desc: &'a SceneDesc,
        name: &'a str,
        outer: &mut Vec<&'a str>,
    ) -> Result<MaterialId> {
        if let Some(binding) = self.names.get(name) {
            return Ok(binding.material);
        }
        let path = format!("materials.{name}");
        let material = match self.composite(compiler, desc, name, outer)? {
            Some(material) => material,
            None => compiler.material(&path, &desc.materials[name])?,
        };
        let medium = match &desc.materials[name] {
            MaterialDesc::Relief { material, .. } => {
                self.names.get(material).and_then(|binding| self.medium_of.get(&binding.material)).copied()
            }
            plain => self.medium_within(compiler.files, &path, &material)?.or(compiler.medium(&path, plain)?),
        };
        let subsurface = match &desc.materials[name] {
            MaterialDesc::Principled(desc) => compiler.subsurface(&path, desc)?,
            MaterialDesc::Relief { material, .. } => {
                self.names.get(material).and_then(|binding| self.subsurface_of.get(&binding.material)).copied()
            }
            _ => None,
        };
        let id = self.push(material);
        self.subsurface_of.extend(subsurface.map(|subsurface| (id, subsurface)));
        self.medium_of.extend(medium.map(|medium| (id, medium)));
        let normal_perturbation = compiler
            .normal_perturbation(desc, &path, &desc.materials[name])?
            .map(|normal_perturbation| self.push_normal_perturbation(normal_perturbation));
        self.by_material.extend(normal_perturbation.map(|normal_perturbation| (id, normal_perturbation)));
        self.names.insert(name.to_owned(), MaterialBinding { normal_perturbation, ..MaterialBinding::plain(id) });
        Ok(id)
    }

    /// Adds a material without a name.
    pub fn push(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId::new(self.materials.len() - 1)
    }

    /// Whether a surface with it needs uv.
    pub fn needs_uv(&self, binding: &MaterialBinding) -> bool {
        let cut_out = binding.opacity.is_some_and(|id| self.textures.get(id).uses_uv());
        let needs =
            |id: MaterialId| self.has_texture(id, Texture::uses_uv) || self.normal_perturbation_of(id).is_some();
        cut_out || binding.normal_perturbation.is_some() || self.any_part(binding.material, &needs)
    }

    fn has_texture(&self, id: MaterialId, is: impl Fn(&Texture) -> bool) -> bool {
        self.materials[id.index()].textures().into_iter().any(|texture| is(self.textures.get(texture)))
    }

    /// Whether a surface's normals come from a normal map.
    pub fn has_normal_map(&self, binding: &MaterialBinding) -> bool {
        let is_map = |normal_perturbation: Option<NormalPerturbationId>| {
            normal_perturbation
                .is_some_and(|id| matches!(self.normal_perturbations[id.index()], NormalPerturbation::NormalMap { .. }))
        };
        is_map(binding.normal_perturbation)
            || self.any_part(binding.material, &|id| is_map(self.normal_perturbation_of(id)))
    }

    /// Whether light is scattered below the surface of a material, not of its parts.
    pub(super) fn has_subsurface(&self, id: MaterialId) -> bool {
        self.subsurface_of.contains_key(&id)
    }

    /// How light is scattered below the surfaces of materials, by [`MaterialId`]; empty if it is below none.
    pub fn subsurface(&self, space: &RenderSpace) -> Vec<Option<Subsurface>> {
        let placed = |id: MaterialId| {
            let scale = space.scale() as f32;
            let place = |subsurface: &Subsurface| Subsurface { radius: subsurface.radius * scale, ..*subsurface };
            self.subsurface_of.get(&id).map(place)
        };
        let count = if self.subsurface_of.is_empty() { 0 } else { self.materials.len() };
        (0..count).map(|i| placed(MaterialId::new(i))).collect()
    }

    /// Whether a material is made of constants alone, has nothing within or below its surface, and is for any shape.
    pub(super) fn is_plain(&self, id: MaterialId) -> bool {
        let is_constant =
            matches!(&self.materials[id.index()], Material::Constant(bsdf) if !bsdf.flags().contains(BsdfFlags::FIBER));
        is_constant
            && !self.medium_of.contains_key(&id)
            && !self.has_subsurface(id)
            && self.normal_perturbation_of(id).is_none()
    }

    /// The [plain](Self::is_plain) materials that have names.
    pub(super) fn plain(&self) -> HashMap<String, MaterialId> {
        let named = self.names.iter().map(|(name, binding)| (name.clone(), binding.material));
        named.filter(|&(_, id)| self.is_plain(id)).collect()
    }

    /// The material of a name, or the default.
    pub fn find(&self, files: &CompileContext, path: &str, name: Option<&str>) -> Result<MaterialBinding> {
        let Some(name) = name else {
            return Ok(MaterialBinding::plain(Self::DEFAULT));
        };
        let found = self.names.get(name).copied();
        found.ok_or_else(|| {
            files.unknown(&format!("{path}.material"), "material", name, self.names.keys().map(String::as_str))
        })
    }
}

pub(super) struct Compiler<'a> {
    pub(super) files: &'a CompileContext,
    pub(super) textures: &'a TextureTable,
    pub(super) media: &'a NamedMedia<'a>,
    pub(super) used: &'a UsedNames,
}

impl Compiler<'_> {
    fn material(&self, path: &str, desc: &MaterialDesc) -> Result<Material> {
        let files = self.files;
        Ok(match desc {
            MaterialDesc::Diffuse { albedo, roughness } => TexturedMaterial::Diffuse {
                albedo: self.color(&format!("{path}.albedo"), albedo)?,
                roughness: self.scalar(&format!("{path}.roughness"), roughness)?,
            }
            .into(),
            MaterialDesc::DiffuseTransmission { reflectance, transmittance } => {
                let [reflectance, transmittance] =
                    self.sum_to_one(path, ["reflectance", "transmittance"], [reflectance, transmittance])?;
                TexturedMaterial::DiffuseTransmission { reflectance, transmittance }.into()
            }
            MaterialDesc::Mirror { reflectance } => {
                TexturedMaterial::Mirror { reflectance: self.color(&format!("{path}.reflectance"), reflectance)? }
                    .into()
            }
            MaterialDesc::Conductor { metal, eta, k, roughness, alpha, distribution, tint, multiscatter } => {
                let (eta, k) = self.metal(path, metal.as_deref(), *eta, *k)?;
                let metal = Conductor::new(eta.into(), k.into(), [0.0; 2], Rgb::WHITE);
                let tint = self.color(&format!("{path}.tint"), tint)?;
                let alpha = self.alpha(path, roughness.as_ref(), alpha.as_ref())?;
                TexturedMaterial::Conductor { metal, tint, alpha, facets: facets(*distribution, *multiscatter) }.into()
            }
            MaterialDesc::Dielectric(desc) => self.dielectric(path, desc)?,
            MaterialDesc::ThinDielectric { ior, reflection_tint, transmission_tint } => {
                let tints = self.tints(path, reflection_tint, transmission_tint)?;
                TexturedMaterial::ThinDielectric { ior: self.ior(path, ior, 0.1)?, tints }.into()
            }
            MaterialDesc::Phong { diffuse, specular, exponent, lobe } => {
                self.phong(path, [diffuse, specular], exponent, *lobe)?.into()
            }
            MaterialDesc::CookTorrance { albedo, d, s, m, f0 } => {
                let albedo = self.color(&format!("{path}.albedo"), albedo)?;
                let f0 = self.color(&format!("{path}.f0"), f0)?;
                let scalar = |key: &str, desc: &ScalarDesc| self.scalar(&format!("{path}.{key}"), desc);
                let (d, s, m) = (scalar("d", d)?, scalar("s", s)?, scalar("m", m)?);
                if let (ScalarInput::Constant(d), ScalarInput::Constant(s)) = (d, s)
                    && d + s > 1.0 + 1e-6
                {
                    return Err(
                        files.error(path, format!("`d` and `s` must not exceed 1 together, but are {d} and {s}"))
                    );
                }
                TexturedMaterial::CookTorrance { albedo, d, s, m, f0 }.into()
            }
            MaterialDesc::Mix { .. }
            | MaterialDesc::TwoSided { .. }
            | MaterialDesc::Coated { .. }
            | MaterialDesc::Relief { .. } => {
                return Err(files.error(path, "cannot be part of a material"));
            }
            MaterialDesc::Hair(desc) => self.hair(path, desc)?.into(),
            MaterialDesc::Measured { file } => self.measured(path, file)?,
            MaterialDesc::Plastic(desc) => self.plastic(path, desc)?.into(),
            MaterialDesc::Principled(desc) => TexturedMaterial::Principled(self.principled(path, desc)?).into(),
        })
    }

    fn dielectric(&self, path: &str, desc: &DielectricDesc) -> Result<Material> {
        let ior = self.glass_ior(path, &desc.ior)?;
        let alpha = self.alpha(path, desc.roughness.as_ref(), desc.alpha.as_ref())?;
        let tints = self.tints(path, &desc.reflection_tint, &desc.transmission_tint)?;
        let boundary =
            TexturedMaterial::Dielectric { ior, alpha, facets: facets(desc.distribution, desc.multiscatter), tints };
        // The relative index at a medium's surface depends on what is around it.
        Ok(if desc.is_medium() { Material::varying(boundary) } else { boundary.into() })
    }

    fn phong(
        &self,
        path: &str,
        colors: [&ColorDesc; 2],
        exponent: &RangedDesc,
        lobe: PhongLobeDesc,
    ) -> Result<TexturedMaterial> {
        let exponent = self.ranged(&format!("{path}.exponent"), exponent, |path, exponent| {
            let is_sound = exponent >= 0.0 && exponent.is_finite();
            if is_sound {
                Ok(())
            } else {
                Err(self.files.error(path, format!("must be finite and not negative, not {exponent}")))
            }
        })?;
        let [diffuse, specular] = self.sum_to_one(path, ["diffuse", "specular"], colors)?;
        Ok(TexturedMaterial::Phong { diffuse, specular, exponent, cosine: lobe == PhongLobeDesc::Cosine })
    }

    /// Factors on what glass reflects and on what crosses it.
    fn tints(&self, path: &str, reflection: &ColorDesc, transmission: &ColorDesc) -> Result<[ColorInput; 2]> {
        Ok([
            self.color(&format!("{path}.reflection_tint"), reflection)?,
            self.color(&format!("{path}.transmission_tint"), transmission)?,
        ])
    }

    pub(super) fn color(&self, path: &str, desc: &ColorDesc) -> Result<ColorInput> {
        Ok(match desc {
            ColorDesc::Grey(v) => ColorInput::Constant(self.files.reflectance(path, [*v; 3])?.into()),
            ColorDesc::Rgb(v) => ColorInput::Constant(self.files.reflectance(path, *v)?.into()),
            ColorDesc::Texture { texture } => self.textures.reflectance(self.files, path, texture)?,
        })
    }

    /// A number within `[0, 1]`.
    pub(super) fn scalar(&self, path: &str, desc: &ScalarDesc) -> Result<ScalarInput> {
        Ok(match desc {
            ScalarDesc::Constant(value) => {
                ScalarInput::Constant(self.files.within(path, f64::from(*value), 0.0, 1.0)? as f32)
            }
            ScalarDesc::Texture { texture } => {
                let id = self.textures.find(self.files, path, texture, TextureUse::Data)?;
                match self.textures.get(id) {
                    Texture::Constant(color) => ScalarInput::Constant(color.luminance().clamp(0.0, 1.0)),
                    _ => ScalarInput::Texture(id),
                }
            }
        })
    }

    /// Two colours that do not exceed 1 together; textures are checked only when they are looked up.
    fn sum_to_one(&self, path: &str, [a, b]: [&str; 2], [x, y]: [&ColorDesc; 2]) -> Result<[ColorInput; 2]> {
        let inputs = [self.color(&format!("{path}.{a}"), x)?, self.color(&format!("{path}.{b}"), y)?];
        if let [ColorInput::Constant(x), ColorInput::Constant(y)] = inputs
            && (x + y).max_channel() > 1.0 + 1e-6
        {
            let message = format!(
                "`{a}` and `{b}` must not exceed 1 together in any channel: a surface cannot scatter more than it \
                 receives"
            );
            return Err(self.files.error(path, message));
        }
        Ok(inputs)
    }

    fn metal(
        &self,
        path: &str,
        metal: Option<&str>,
        eta: Option<[f32; 3]>,
        k: Option<[f32; 3]>,
    ) -> Result<([f32; 3], [f32; 3])> {
        match (metal, eta, k) {
            (Some(name), None, None) => {
                let metals: Vec<&str> = Metal::names(MetalNames::Steradian).collect();
                let unknown = || {
                    let hint = did_you_mean(name, metals.iter().copied(), ["\"", "\""]);
                    let list = metals.join(", ");
                    let message = format!("no metal named \"{name}\"{hint}: use one of {list}, or `eta` and `k`");
                    self.files.error(&format!("{path}.metal"), message)
                };
                Metal::find(MetalNames::Steradian, name).map(|metal| (metal.eta, metal.k)).ok_or_else(unknown)
            }
            (None, Some(eta), Some(k)) => {
                if !eta.iter().all(|&e| e > 0.0 && e.is_finite()) {
                    return Err(self
                        .files
                        .error(&format!("{path}.eta"), format!("{eta:?} must be finite and above 0")));
                }
                Ok((eta, self.files.emitted(&format!("{path}.k"), k)?))
            }
            _ => Err(self.files.error(path, "give either `metal`, or both `eta` and `k`")),
        }
    }

    /// GGX alpha along u and v; zero for a smooth surface.
    pub(super) fn alpha(
        &self,
        path: &str,
        roughness: Option<&RoughnessDesc>,
        alpha: Option<&RoughnessDesc>,
    ) -> Result<AlphaInput> {
        let (key, desc, squared) = match (roughness, alpha) {
            (None, None) => return Ok(AlphaInput { axes: [ScalarInput::Constant(0.0); 2], squared: false }),
            (Some(roughness), None) => ("roughness", roughness, true),
            (None, Some(alpha)) => ("alpha", alpha, false),
            (Some(_), Some(_)) => return Err(self.files.error(path, "give either `roughness` or `alpha`")),
        };
        let path = format!("{path}.{key}");
        let constant = |value: f32| {
            self.files.within(&path, f64::from(value), 0.0, 1.0).map(|value| ScalarInput::Constant(value as f32))
        };
        let axes = match desc {
            RoughnessDesc::Isotropic(a) => [constant(*a)?; 2],
            RoughnessDesc::Anisotropic([u, v]) => [constant(*u)?, constant(*v)?],
            RoughnessDesc::Texture { texture } => {
                [self.scalar(&path, &ScalarDesc::Texture { texture: texture.clone() })?; 2]
            }
            RoughnessDesc::Axes { u, v } => {
                [self.scalar(&format!("{path}.u"), u)?, self.scalar(&format!("{path}.v"), v)?]
            }
        };
        Ok(AlphaInput { axes, squared })
    }

    /// The parameter `ior`, from `least` to 10.
    pub(super) fn ior(&self, path: &str, desc: &RangedDesc, least: f64) -> Result<RangedInput> {
        self.ranged(&format!("{path}.ior"), desc, |path, ior| {
            self.files.within(path, f64::from(ior), least, 10.0).map(|_| ())
        })
    }

    /// The index of refraction of what is inside of a dielectric.
    pub(super) fn glass_ior(&self, path: &str, desc: &RangedDesc) -> Result<f32> {
        match self.ior(path, desc, 0.1)? {
            RangedInput::Constant(ior) => Ok(ior),
            RangedInput::Texture { .. } => Err(self.files.error(
                &format!("{path}.ior"),
                "cannot come from a texture: what is inside has one index of refraction",
            )),
        }
    }

    /// A number, or both ends of a texture's range, that pass `check`.
    pub(super) fn ranged(
        &self,
        path: &str,
        desc: &RangedDesc,
        check: impl Fn(&str, f32) -> Result<()>,
    ) -> Result<RangedInput> {
        Ok(match desc {
            RangedDesc::Constant(value) => {
                check(path, *value)?;
                RangedInput::Constant(*value)
            }
            RangedDesc::Texture { texture, range } => {
                for (i, end) in range.iter().enumerate() {
                    check(&format!("{path}.range[{i}]"), *end)?;
                }
                let range = *range;
                match self.scalar(path, &ScalarDesc::Texture { texture: texture.clone() })? {
                    ScalarInput::Texture(id) => RangedInput::Texture { id, range },
                    ScalarInput::Constant(value) => RangedInput::Constant(range[0] + (range[1] - range[0]) * value),
                }
            }
        })
    }
}

pub(super) fn facets(distribution: DistributionDesc, multiscatter: bool) -> Facets {
    match distribution {
        DistributionDesc::Beckmann => Facets::Beckmann,
        DistributionDesc::GgxSeparable => Facets::SeparableGgx,
        DistributionDesc::Ggx if multiscatter => Facets::Ggx,
        DistributionDesc::Ggx => Facets::SingleGgx,
    }
}
