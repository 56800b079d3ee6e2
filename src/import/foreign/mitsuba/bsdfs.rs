//! BSDFs to materials.

use super::element::Element;
use super::textures::{Role, TextureValue, UvOrigin};
use super::tree::PluginId;
use super::{Reader, names};
use crate::desc::{
    BumpMapDesc, ColorDesc, ColorSpaceDesc, DielectricDesc, DistributionDesc, MaterialDesc, NormalMapDesc, OpacityDesc,
    PlasticDesc, RangedDesc, RoughnessDesc, ScalarDesc, TextureDesc,
};
use crate::error::Result;
use crate::metal::{Metal, MetalNames};
use crate::suggestion::did_you_mean;

/// What a BSDF has become.
#[derive(Clone, Debug)]
pub(crate) struct BsdfBinding {
    /// The material by name.
    pub material: String,
    /// Whether Mitsuba's is black from behind and Steradian's is not.
    pub one_sided: bool,
    /// How much of a surface with it is there.
    pub opacity: Option<OpacityDesc>,
}

impl<'a> Reader<'a> {
    /// The material of a shape, and its opacity. Without a BSDF, Mitsuba's default: a grey diffuse front.
    pub(super) fn surface(
        &mut self,
        id: Option<PluginId>,
        place: &str,
        uv: UvOrigin,
    ) -> Result<(String, Option<OpacityDesc>)> {
        let Some(id) = id else {
            let name = "default_front_only";
            if !self.draft.desc.materials.contains_key(name) {
                let front =
                    MaterialDesc::Diffuse { albedo: ColorDesc::Grey(0.5), roughness: ScalarDesc::Constant(0.0) };
                let front = self.draft.add_material("default", place, front);
                let back = self.black(place);
                self.draft.add_material(name, place, MaterialDesc::TwoSided { front, back });
            }
            return Ok((name.into(), None));
        };
        let binding = self.convert(id, uv)?;
        if !binding.one_sided {
            return Ok((binding.material, binding.opacity));
        }
        if let Some(name) = self.surfaces.get(&(id, uv)) {
            return Ok((name.clone(), binding.opacity));
        }
        let name = self.front_only(&binding, place);
        self.surfaces.insert((id, uv), name.clone());
        Ok((name, binding.opacity))
    }

    /// A material with a black back.
    fn front_only(&mut self, binding: &BsdfBinding, place: &str) -> String {
        let back = self.black(place);
        let sides = MaterialDesc::TwoSided { front: binding.material.clone(), back };
        self.draft.add_material(&format!("{}_front_only", binding.material), place, sides)
    }

    /// The material that reflects nothing.
    pub(super) fn black(&mut self, place: &str) -> String {
        if let Some(name) = &self.black {
            return name.clone();
        }
        let black = MaterialDesc::Diffuse { albedo: ColorDesc::Grey(0.0), roughness: ScalarDesc::Constant(0.0) };
        let name = self.draft.add_material("black_back", place, black);
        self.black = Some(name.clone());
        name
    }

    /// What a BSDF becomes.
    pub(super) fn convert(&mut self, id: PluginId, uv: UvOrigin) -> Result<BsdfBinding> {
        if let Some(binding) = self.bindings.get(&(id, uv)) {
            return Ok(binding.clone());
        }
        self.guard(id)?;
        let mut element = Element::new(self.document, id);
        if element.plugin.class != "bsdf" {
            return Err(element.place().error(format!("a {} is no bsdf", element.plugin.class)));
        }
        let binding = match element.kind() {
            "twosided" => self.two_sided(&mut element, uv)?,
            "mask" => self.mask(&mut element, uv)?,
            "blendbsdf" => self.blend(&mut element, uv)?,
            "normalmap" | "bumpmap" => self.relief(&mut element, uv)?,
            "principledthin" => self.principled_thin(&mut element, uv)?,
            "null" => BsdfBinding {
                opacity: Some(OpacityDesc::Number(0.0)),
                material: self.black(&element.place().to_string()),
                one_sided: false,
            },
            _ => {
                let (material, one_sided) = self.material(&mut element, uv)?;
                self.add(&element, material, one_sided)
            }
        };
        element.finish(&mut self.draft);
        self.open.pop();
        self.bindings.insert((id, uv), binding.clone());
        Ok(binding)
    }

    pub(super) fn add(&mut self, element: &Element, material: MaterialDesc, one_sided: bool) -> BsdfBinding {
        let has_relief = match &material {
            MaterialDesc::Relief { .. } => true,
            MaterialDesc::TwoSided { front, back } => self.reliefs.contains(front) || self.reliefs.contains(back),
            MaterialDesc::Mix { materials, .. } => materials.iter().any(|part| self.reliefs.contains(part)),
            _ => false,
        };
        let name = if element.plugin.id.is_empty() { element.kind() } else { &element.plugin.id };
        let name = self.draft.add_material(name, &element.place().to_string(), material);
        if has_relief {
            self.reliefs.insert(name.clone());
        }
        BsdfBinding { material: name, one_sided, opacity: None }
    }

    /// A BSDF that does not consist of others, and whether its back is black.
    fn material(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<(MaterialDesc, bool)> {
        Ok(match element.kind() {
            "diffuse" => {
                let albedo = self.color(element, "reflectance", 0.5, uv)?;
                (MaterialDesc::Diffuse { albedo, roughness: ScalarDesc::Constant(0.0) }, true)
            }
            "conductor" | "roughconductor" => (self.conductor(element, uv)?, true),
            "dielectric" | "roughdielectric" => {
                let ior = relative_index(element, "bk7")?;
                let (alpha, distribution) = self.microfacets(element, "roughdielectric", uv)?;
                let glass = DielectricDesc {
                    ior: RangedDesc::Constant(ior),
                    roughness: None,
                    alpha,
                    distribution,
                    multiscatter: false,
                    reflection_tint: self.color(element, "specular_reflectance", 1.0, uv)?,
                    transmission_tint: self.color(element, "specular_transmittance", 1.0, uv)?,
                    priority: None,
                    absorption: None,
                    medium: None,
                    abbe: None,
                };
                (MaterialDesc::Dielectric(Box::new(glass)), false)
            }
            "thindielectric" => {
                let ior = RangedDesc::Constant(relative_index(element, "bk7")?);
                let reflection_tint = self.color(element, "specular_reflectance", 1.0, uv)?;
                let transmission_tint = self.color(element, "specular_transmittance", 1.0, uv)?;
                (MaterialDesc::ThinDielectric { ior, reflection_tint, transmission_tint }, false)
            }
            "plastic" | "roughplastic" => {
                let ior = relative_index(element, "polypropylene")?;
                let (alpha, distribution) = self.microfacets(element, "roughplastic", uv)?;
                let plastic = PlasticDesc {
                    albedo: self.color(element, "diffuse_reflectance", 0.5, uv)?,
                    ior: RangedDesc::Constant(ior),
                    roughness: None,
                    alpha,
                    distribution,
                    coat_tint: self.color(element, "specular_reflectance", 1.0, uv)?,
                    nonlinear: element.boolean("nonlinear", false)?,
                    multiscatter: false,
                };
                (MaterialDesc::Plastic(Box::new(plastic)), true)
            }
            "principled" => self.principled(element, uv)?,
            "hair" => (self.hair(element, uv)?, false),
            "measured" => {
                let file = element.file("filename", self.scene)?;
                let file = file.ok_or_else(|| element.place().error("a measured bsdf needs \"filename\""))?;
                (MaterialDesc::Measured { file }, true)
            }
            _ => {
                element.ignored("", "unsupported BSDF: a grey diffuse surface in its place");
                (MaterialDesc::Diffuse { albedo: ColorDesc::Grey(0.5), roughness: ScalarDesc::Constant(0.0) }, true)
            }
        })
    }

    fn conductor(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<MaterialDesc> {
        let (alpha, distribution) = self.microfacets(element, "roughconductor", uv)?;
        let tint = self.color(element, "specular_reflectance", 1.0, uv)?;
        let (eta, k) = (self.constant(element, "eta", uv)?, self.constant(element, "k", uv)?);
        // Without any of them, Mitsuba's is an ideal mirror.
        let name = element.text("material")?.or((eta.is_none() && k.is_none()).then_some("none"));
        let (eta, k) = match (name, eta, k) {
            (None, Some(eta), k) => (eta, k.unwrap_or([0.0; 3])),
            (None, None, Some(k)) => ([0.0; 3], k),
            (Some("none"), None, None) if alpha.is_none() => return Ok(MaterialDesc::Mirror { reflectance: tint }),
            (Some("none"), None, None) => ([0.0; 3], [1.0; 3]),
            (Some(name), None, None) => {
                let unknown = || {
                    let hint = did_you_mean(name, Metal::names(MetalNames::Mitsuba).chain(["none"]), ["\"", "\""]);
                    element.place_of("material").error(format!("no material named \"{name}\"{hint}"))
                };
                let find = |name: &str| Metal::find(MetalNames::Mitsuba, name);
                let found = find(name).or_else(|| find(name.strip_suffix("_palik")?));
                found.map(|metal| (metal.eta, metal.k)).ok_or_else(unknown)?
            }
            (None, None, None) | (Some(_), ..) => {
                return Err(element.place_of("material").error("give either \"material\" or \"eta\" and \"k\""));
            }
        };
        // An index of zero is that of an ideal mirror, which the smallest one comes to.
        let eta = eta.map(|eta| eta.max(1e-6));
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

    /// The distribution of the normals of a surface's microfacets and its width, if the surface is of a `rough` kind.
    fn microfacets(
        &mut self,
        element: &mut Element<'a>,
        rough: &str,
        uv: UvOrigin,
    ) -> Result<(Option<RoughnessDesc>, DistributionDesc)> {
        if element.kind() != rough {
            return Ok((None, DistributionDesc::default()));
        }
        let distribution = match element.text("distribution")?.unwrap_or("beckmann") {
            "ggx" => DistributionDesc::GgxSeparable,
            "beckmann" => DistributionDesc::Beckmann,
            other => {
                return Err(element.place_of("distribution").error(format!("\"{other}\" is neither beckmann nor ggx")));
            }
        };
        element.boolean("sample_visible", true)?;
        Ok((Some(self.alpha(element, uv)?), distribution))
    }

    /// The width of the distribution of normals.
    fn alpha(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<RoughnessDesc> {
        if element.take("alpha_u").is_none() && element.take("alpha_v").is_none() {
            return Ok(match self.scalar(element, "alpha", 0.1, 1.0, uv)? {
                ScalarDesc::Constant(alpha) => RoughnessDesc::Isotropic(unit(element, "alpha", alpha)),
                ScalarDesc::Texture { texture } => RoughnessDesc::Texture { texture },
            });
        }
        let mut along = |name: &str| -> Result<ScalarDesc> {
            Ok(match self.scalar(element, name, 0.1, 1.0, uv)? {
                ScalarDesc::Constant(alpha) => ScalarDesc::Constant(unit(element, name, alpha)),
                texture => texture,
            })
        };
        Ok(match (along("alpha_u")?, along("alpha_v")?) {
            (ScalarDesc::Constant(u), ScalarDesc::Constant(v)) => RoughnessDesc::Anisotropic([u, v]),
            (u, v) => RoughnessDesc::Axes { u, v },
        })
    }

    /// The BSDFs inside of one.
    fn parts(
        &mut self,
        element: &mut Element<'a>,
        counts: std::ops::RangeInclusive<usize>,
        uv: UvOrigin,
    ) -> Result<Vec<BsdfBinding>> {
        let parts = element.all("bsdf")?;
        if !counts.contains(&parts.len()) {
            let message = format!("{} needs {} bsdfs inside, not {}", element.kind(), counts.end(), parts.len());
            return Err(element.place().error(message));
        }
        parts.into_iter().map(|(id, _)| self.convert(id, uv)).collect()
    }

    fn two_sided(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<BsdfBinding> {
        let parts = self.parts(element, 1..=2, uv)?;
        let [front, back] = match &parts[..] {
            [one] => return Ok(BsdfBinding { one_sided: false, ..one.clone() }),
            [front, back] => [front.clone(), back.clone()],
            _ => return Err(element.place().error("twosided needs one or two bsdfs inside")),
        };
        if front.opacity.is_some() || back.opacity.is_some() {
            element.ignored("", "holes of one side are left out");
        }
        Ok(self.add(element, MaterialDesc::TwoSided { front: front.material, back: back.material }, false))
    }

    fn mask(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<BsdfBinding> {
        let inner = self.one_part(element, uv)?;
        let opacity = match self.scalar(element, "opacity", 0.5, 1.0, uv)? {
            ScalarDesc::Constant(v) => OpacityDesc::Number(v),
            ScalarDesc::Texture { texture } => {
                OpacityDesc::Texture { texture: self.without_alpha(&texture, element), threshold: None }
            }
        };
        if inner.opacity.is_some() {
            element.ignored("", "the holes of the bsdf inside are left out");
        }
        Ok(BsdfBinding { opacity: Some(opacity), ..inner })
    }

    fn one_part(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<BsdfBinding> {
        let parts = self.parts(element, 1..=1, uv)?;
        parts.into_iter().next().ok_or_else(|| element.place().error(format!("{} needs a bsdf inside", element.kind())))
    }

    /// A texture whose luminance counts as opacity, even where it is an image with alpha.
    fn without_alpha(&mut self, name: &str, element: &Element) -> String {
        let has_none = |file: &str| [".jpg", ".jpeg", ".hdr"].iter().any(|end| file.to_lowercase().ends_with(end));
        match self.draft.desc.textures.get(name) {
            Some(TextureDesc::Image { file, .. }) if !has_none(file) => {
                let colors = TextureDesc::Product { factors: vec![ColorDesc::Texture { texture: name.into() }] };
                self.draft.add_texture(&format!("{name}_colors"), &element.place().to_string(), colors)
            }
            _ => name.into(),
        }
    }

    fn blend(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<BsdfBinding> {
        let parts = self.parts(element, 2..=2, uv)?;
        let amount = self.scalar(element, "weight", 0.5, 1.0, uv)?;
        let place = element.place().to_string();
        let one_sided = parts.iter().all(|part| part.one_sided);
        if parts.iter().any(|part| part.opacity.is_some()) {
            element.ignored("", "holes of a part are left out");
        }
        let materials = parts.iter().map(|part| {
            if part.one_sided && !one_sided { self.front_only(part, &place) } else { part.material.clone() }
        });
        let materials: Vec<String> = materials.collect();
        let Ok(materials) = <[String; 2]>::try_from(materials) else {
            return Err(element.place().error("blendbsdf needs two bsdfs inside"));
        };
        Ok(self.add(element, MaterialDesc::Mix { materials, amount }, one_sided))
    }

    fn relief(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<BsdfBinding> {
        let inner = self.one_part(element, uv)?;
        let is_normal_map = element.kind() == "normalmap";
        let textures = element.all("texture")?;
        let Some(&(texture, texture_place)) = textures.first() else {
            return Err(element.place().error(format!("{} needs a texture inside", element.kind())));
        };
        let height = if is_normal_map { 1.0 } else { element.float("scale")?.unwrap_or(1.0) };
        if is_normal_map {
            element.boolean("flip_invalid_normals", true)?;
            element.boolean("use_shadowing_function", true)?;
        }
        let TextureValue::Named(texture) = self.texture(texture, Role::Number, uv)? else {
            // The same everywhere: no relief.
            return Ok(inner);
        };
        if self.reliefs.contains(&inner.material) {
            element.ignored("", "a relief on a relief is left out");
            return Ok(inner);
        }
        if is_normal_map
            && let Some(TextureDesc::Image { color_space: color_space @ ColorSpaceDesc::Srgb, .. }) =
                self.draft.desc.textures.get_mut(&texture)
        {
            *color_space = ColorSpaceDesc::Linear;
            self.draft.approximated(
                &texture_place.to_string(),
                &element.plugin.title(),
                "raw",
                "normals are taken as they are stored",
            );
        }
        let (normal_map, bump_map) = if is_normal_map {
            // Steradian's turn with the image, Mitsuba's do not: on v that grows downward green is the other way round.
            let flip_y = match self.draft.desc.textures.get(&texture) {
                Some(TextureDesc::Image { scale, rotation_degrees, .. }) => {
                    if *rotation_degrees != 0.0 || scale[0] < 0.0 {
                        element.approximated("", "the normals turn with their image");
                    }
                    scale[0] * scale[1] < 0.0
                }
                _ => false,
            };
            (Some(NormalMapDesc { texture, strength: 1.0, flip_y }), None)
        } else {
            (None, Some(BumpMapDesc { texture, height: height as f32 }))
        };
        let binding =
            self.add(element, MaterialDesc::Relief { material: inner.material, normal_map, bump_map }, inner.one_sided);
        Ok(BsdfBinding { opacity: inner.opacity, ..binding })
    }
}

/// The index of the inside over that of the outside.
pub(super) fn relative_index(element: &mut Element, inside: &str) -> Result<f32> {
    debug_assert!(names::index(inside).is_ok());
    Ok((element.index("int_ior", inside)? / element.index("ext_ior", "air")?) as f32)
}

/// A number that cannot exceed 1 here.
fn unit(element: &mut Element, name: &str, value: f32) -> f32 {
    if value > 1.0 {
        element.approximated(name, "1, the largest alpha");
    }
    value.min(1.0)
}
