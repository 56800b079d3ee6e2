//! Materials: the metallic-roughness model and its extensions, as principled materials, glass, coats and light.

mod alpha;
mod inputs;
mod layers;

use std::collections::BTreeMap;

use gltf::json::Index;
use gltf::json::material::{AlphaMode, Material};
use gltf::json::validation::Checked;
use serde_json::{Map, Value};

use self::inputs::Inputs;
use super::GltfSource;
use super::extensions as ext;
use super::geometry::VertexColors;
use super::textures::{TextureRef, TextureSet};
use crate::desc::{
    ChannelDesc, ColorDesc, EmissionDesc, MaterialDesc, NormalMapDesc, OpacityDesc, PrincipledDesc, ScalarDesc,
};
use crate::error::Result;
use crate::import::Draft;

const UNLIT: &str = "KHR_materials_unlit";

/// What a shape gets from a material.
#[derive(Clone, Debug, Default)]
pub(crate) struct PrimitiveMaterial {
    pub material: Option<String>,
    pub opacity: Option<OpacityDesc>,
    pub emission: Option<EmissionDesc>,
    /// The set of uv that its textures use, if it has any.
    pub uv_set: Option<u32>,
    /// Whether it shows the colours of vertices.
    pub vertex_colors: bool,
}

/// Materials that have been added, by index and what the vertices' colours do to them.
#[derive(Debug, Default)]
pub struct MaterialSet {
    textures: TextureSet,
    done: BTreeMap<(Option<usize>, [u32; 4], bool, bool), PrimitiveMaterial>,
}

/// A material while it is read.
struct Builder<'a, 'b> {
    source: GltfSource<'a>,
    draft: &'b mut Draft,
    inputs: Inputs<'b>,
    json: &'a Material,
    path: String,
    element: String,
    name: String,
    /// A factor on the base colour, from the vertices' colours.
    tint: [f32; 4],
    /// Whether the vertices' colours themselves are one.
    is_colored: bool,
    /// Whether the tint's alpha has several values.
    mixes_alpha: bool,
    color_factor: [f32; 4],
    color_texture: Option<TextureRef>,
}

impl MaterialSet {
    /// What a material comes to.
    pub fn convert(
        &mut self,
        source: GltfSource,
        draft: &mut Draft,
        index: Option<Index<Material>>,
        colors: Option<VertexColors>,
    ) -> Result<PrimitiveMaterial> {
        let default = Material::default();
        let path = index.map_or_else(|| "materials".into(), |index| format!("materials[{}]", index.value()));
        let json = match index {
            Some(index) => source.root.get(index).ok_or_else(|| source.fault(&path, "no such material"))?,
            None => &default,
        };
        // Light cannot have colours of vertices.
        let is_unlit = json.extensions.as_ref().is_some_and(|all| all.others.contains_key(UNLIT));
        let is_colored = colors.is_some_and(|colors| colors.differ) && !is_unlit;
        let tint = colors.map_or(
            [1.0; 4],
            |VertexColors { mean: [r, g, b, a], .. }| if is_colored { [1.0, 1.0, 1.0, a] } else { [r, g, b, a] },
        );
        let mixes_alpha = colors.is_some_and(|colors| colors.differ_in_alpha);
        let key = (index.map(|index| index.value()), tint.map(f32::to_bits), is_colored, mixes_alpha);
        if let Some(material) = self.done.get(&key) {
            return Ok(material.clone());
        }
        let name = match (&json.name, index) {
            (Some(name), _) => name.clone(),
            (None, Some(index)) => format!("material {}", index.value()),
            (None, None) => "default".into(),
        };
        let pbr = &json.pbr_metallic_roughness;
        let color_path = format!("{path}.pbrMetallicRoughness.baseColorTexture");
        let color_texture = pbr.base_color_texture.as_ref().map(|t| texture_of(source, &color_path, t)).transpose()?;
        let mut builder = Builder {
            source,
            draft,
            inputs: Inputs::new(&mut self.textures),
            json,
            element: format!("material \"{name}\""),
            path,
            name,
            tint,
            is_colored,
            mixes_alpha,
            color_factor: pbr.base_color_factor.0,
            color_texture,
        };
        let material = builder.build()?;
        self.done.insert(key, material.clone());
        Ok(material)
    }
}

/// The factors of the older model.
#[derive(Clone, Copy)]
struct Glossy {
    glossiness: f32,
    /// The mean of the specular colour.
    specular: f32,
}

/// A texture that the core of the format names.
fn texture_of(source: GltfSource, place: &str, info: &gltf::json::texture::Info) -> Result<TextureRef> {
    TextureRef::new(source, place, info.index.value(), info.tex_coord, info.extensions.as_ref().map(|e| &e.others))
}

impl<'a> Builder<'a, '_> {
    fn extensions(&self) -> Option<&'a Map<String, Value>> {
        self.json.extensions.as_ref().map(|extensions| &extensions.others)
    }

    /// An extension of the material.
    fn extension<T: serde::de::DeserializeOwned>(&self, name: &str) -> Result<Option<T>> {
        self.source.extension(&self.path, self.extensions(), name)
    }

    fn mapped(&mut self, parameter: &str) {
        self.draft.mapped(&self.path, &self.element, parameter);
    }

    fn approximated(&mut self, parameter: &str, how: &str) {
        self.draft.approximated(&self.path, &self.element, parameter, how);
    }

    fn ignored(&mut self, parameter: &str, why: &str) {
        self.draft.ignored(&self.path, &self.element, parameter, why);
    }

    fn build(&mut self) -> Result<PrimitiveMaterial> {
        let is_unlit = self.extensions().is_some_and(|all| all.contains_key(UNLIT));
        if is_unlit && self.tint != [1.0; 4] {
            self.approximated("COLOR_0", "the mean of the vertices' colours is a factor on the light emitted");
        } else if self.mixes_alpha && !matches!(self.json.alpha_mode, Checked::Valid(AlphaMode::Opaque)) {
            self.approximated("COLOR_0", "the mean of the vertices' alpha is a factor on alpha");
        } else if self.is_colored || self.tint != [1.0; 4] {
            self.mapped("COLOR_0");
        }
        let glossy = self.specular_glossiness()?;
        self.color_factor = std::array::from_fn(|k| self.color_factor[k] * self.tint[k]);
        let (material, mut emission) = if is_unlit { self.unlit()? } else { (self.surface(glossy)?, self.emission()?) };
        let opacity = self.opacity()?;
        let (material, is_medium) = match material {
            Some(desc) => {
                let is_medium = matches!(&desc, MaterialDesc::Dielectric(glass) if glass.is_medium());
                let material = self.layered(desc)?;
                (Some(self.with_relief(material)?), is_medium)
            }
            None => (None, false),
        };
        if is_medium && emission.take().is_some() {
            self.ignored("emissiveFactor", "what absorbs light within cannot emit light");
        }
        if self.json.occlusion_texture.is_some() {
            self.ignored("occlusionTexture", "paths of light find what is occluded");
        }
        self.mapped("doubleSided");
        let uv_set = self.inputs.uv_set();
        if self.inputs.mixes_sets() {
            self.approximated("texCoord", "all textures use the set of uv of the first");
        }
        if self.inputs.was_clamped() {
            self.approximated("factors", "numbers outside of 0 to 1 became the nearest within");
        }
        Ok(PrimitiveMaterial { material, opacity, emission, uv_set, vertex_colors: self.is_colored && !is_medium })
    }

    /// The material of a surface without coat and relief.
    fn surface(&mut self, glossy: Option<Glossy>) -> Result<Option<MaterialDesc>> {
        let pbr = &self.json.pbr_metallic_roughness;
        let texture = pbr.metallic_roughness_texture.as_ref().filter(|_| glossy.is_none());
        let place = format!("{}.pbrMetallicRoughness.metallicRoughnessTexture", self.path);
        let texture = texture.map(|t| texture_of(self.source, &place, t)).transpose()?;
        let (metallic, roughness) = match glossy {
            Some(Glossy { glossiness, .. }) => (0.0, 1.0 - glossiness),
            None => (pbr.metallic_factor.0, pbr.roughness_factor.0),
        };
        let color = self.base_color()?;
        let mut desc: PrincipledDesc = inputs::default_principled();
        desc.base_color = color;
        desc.metallic = self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::B, metallic)?;
        desc.roughness = self.inputs.scalar(self.source, self.draft, texture.as_ref(), ChannelDesc::G, roughness)?;
        if glossy.is_none() {
            self.mapped("metallicFactor");
            self.mapped("roughnessFactor");
            if texture.is_some() {
                self.mapped("metallicRoughnessTexture");
            }
        }
        self.specular(&mut desc)?;
        if let Some(Glossy { specular, .. }) = glossy {
            layers::reflect_ahead(&mut desc, specular);
        }
        self.sheen(&mut desc)?;
        self.anisotropy(&mut desc, roughness)?;
        self.iridescence();
        self.walk_below(&mut desc)?;
        self.transmission(desc).map(Some)
    }

    /// Colour and texture of the base.
    fn base_color(&mut self) -> Result<ColorDesc> {
        let [r, g, b, _] = self.color_factor;
        let texture = self.color_texture.clone();
        let mut color = self.inputs.color(self.source, self.draft, texture.as_ref(), [r, g, b])?;
        if self.is_colored {
            color = self.inputs.colored(self.draft, &self.path, color);
        }
        self.mapped("baseColorFactor");
        if texture.is_some() {
            self.mapped("baseColorTexture");
        }
        Ok(color)
    }

    /// The older model in place of metallic-roughness.
    fn specular_glossiness(&mut self) -> Result<Option<Glossy>> {
        const NAME: &str = "KHR_materials_pbrSpecularGlossiness";
        let Some(ext) = self.extension::<ext::SpecularGlossiness>(NAME)? else { return Ok(None) };
        self.color_factor = ext.diffuse_factor;
        let place = format!("{}.extensions.{NAME}.diffuseTexture", self.path);
        self.color_texture = TextureRef::of_extension(self.source, &place, ext.diffuse_texture.as_ref())?;
        self.approximated(
            NAME,
            "a principled material of the diffuse colour, with the mean of the specular factor and without their \
             texture",
        );
        let specular = ext.specular_factor.iter().map(|s| s.clamp(0.0, 1.0)).sum::<f32>() / 3.0;
        Ok(Some(Glossy { glossiness: ext.glossiness_factor, specular }))
    }

    /// A surface that looks the same in any light: black, and it emits its colour.
    fn unlit(&mut self) -> Result<(Option<MaterialDesc>, Option<EmissionDesc>)> {
        self.approximated(UNLIT, "emits its colour as light, and so lights what is around it");
        let [r, g, b, _] = self.color_factor;
        let texture = self.color_texture.clone();
        let emission = self.light(texture.as_ref(), [r, g, b])?;
        let black = MaterialDesc::Diffuse { albedo: ColorDesc::Grey(0.0), roughness: ScalarDesc::Constant(0.0) };
        Ok((Some(black), emission))
    }

    /// Light that the surface emits.
    fn emission(&mut self) -> Result<Option<EmissionDesc>> {
        let strength = self.extension::<ext::EmissiveStrength>("KHR_materials_emissive_strength")?;
        let factor = self.json.emissive_factor.0.map(|f| f * strength.as_ref().map_or(1.0, |s| s.emissive_strength));
        let place = format!("{}.emissiveTexture", self.path);
        let texture = self.json.emissive_texture.as_ref().map(|t| texture_of(self.source, &place, t)).transpose()?;
        let emission = self.light(texture.as_ref(), factor)?;
        self.mapped("emissiveFactor");
        if texture.is_some() {
            self.mapped("emissiveTexture");
        }
        if strength.is_some() {
            self.mapped("KHR_materials_emissive_strength");
        }
        Ok(emission)
    }

    fn light(&mut self, texture: Option<&TextureRef>, radiance: [f32; 3]) -> Result<Option<EmissionDesc>> {
        if !radiance.iter().all(|r| r.is_finite() && *r >= 0.0) {
            return Err(self
                .source
                .fault(&format!("{}.emissiveFactor", self.path), "light is finite and not negative"));
        }
        if radiance == [0.0; 3] {
            return Ok(None);
        }
        let texture = match texture {
            Some(texture) => self.inputs.image(self.source, self.draft, texture, None)?,
            None => None,
        };
        Ok(Some(EmissionDesc { radiance, texture, two_sided: self.json.double_sided, hidden: false, group: None }))
    }

    /// The material with its normal map, by name.
    fn with_relief(&mut self, material: String) -> Result<String> {
        let Some(normal) = &self.json.normal_texture else { return Ok(material) };
        let place = format!("{}.normalTexture", self.path);
        let extensions = normal.extensions.as_ref().map(|e| &e.others);
        let texture = TextureRef::new(self.source, &place, normal.index.value(), normal.tex_coord, extensions)?;
        let strength = normal.scale.clamp(0.0, 16.0);
        let Some(image) = self.inputs.data(self.source, self.draft, &texture, None)? else { return Ok(material) };
        if strength == normal.scale {
            self.mapped("normalTexture");
        } else {
            self.approximated("normalTexture", "the scale became the nearest from 0 to 16");
        }
        let map = NormalMapDesc { texture: image, strength, flip_y: false };
        let relief = MaterialDesc::Relief { material, normal_map: Some(map), bump_map: None };
        Ok(self.draft.add_material(&format!("{} with relief", self.name), &self.path, relief))
    }
}
