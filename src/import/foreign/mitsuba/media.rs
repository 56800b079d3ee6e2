//! Participating media: those of shapes, and what is around everything.

use super::Reader;
use super::element::Element;
use super::textures::UvOrigin;
use super::tree::PluginId;
use crate::desc::{CoefficientDesc, DielectricDesc, MaterialDesc, MediumDesc, PhaseDesc};
use crate::error::Result;

/// The largest mean cosine of a phase function.
const MAX_G: f64 = 0.99;

const UNSEEN: &str = "the integrator shows no participating media: left out";

/// The media on both sides of a shape.
pub(super) struct MediumInterface {
    pub inside: Option<String>,
    pub outside: Option<String>,
}

impl<'a> Reader<'a> {
    /// Whether the scene's integrator shows media.
    pub(super) fn shows_media(&self) -> bool {
        let is_volumetric = |kind: &str| matches!(kind, "volpath" | "volpathmis" | "prbvolpath");
        self.document.plugins.iter().any(|plugin| plugin.class == "integrator" && is_volumetric(&plugin.kind))
    }

    /// The name of the medium that is a property of an element, if it is shown.
    pub(super) fn medium(&mut self, element: &mut Element<'a>, name: &str) -> Result<Option<String>> {
        let Some(property) = element.plugin.properties.iter().find(|property| property.name == name) else {
            return Ok(None);
        };
        let Some(id) = self.document.plugin_of(property)?.filter(|id| self.document.plugins[id.0].class == "medium")
        else {
            return Ok(None);
        };
        if !self.shows_media() {
            element.ignored(name, UNSEEN);
            return Ok(None);
        }
        element.take(name);
        self.named_medium(id).map(Some)
    }

    /// The name of what a medium becomes.
    fn named_medium(&mut self, id: PluginId) -> Result<String> {
        if let Some(name) = self.media.get(&id) {
            return Ok(name.clone());
        }
        let mut element = Element::new(self.document, id);
        let scale = element.float("scale")?.unwrap_or(1.0) as f32;
        let grids = if element.kind() == "heterogeneous" { self.grids(&mut element)? } else { None };
        let (has_albedo, has_extinction) = grids.as_ref().map_or((false, false), |g| (g.has_albedo, g.has_extinction));
        let mut coefficient = |name: &str, is_grid: bool, default: f32| {
            let value = if is_grid { Some([1.0; 3]) } else { self.coefficient(&mut element, name)? };
            Ok::<_, crate::Error>(value.unwrap_or([default; 3]))
        };
        let albedo = coefficient("albedo", has_albedo, 0.75)?.map(|a| a.clamp(0.0, 1.0));
        let extinction = coefficient("sigma_t", has_extinction, 1.0)?.map(|t| t * scale);
        let emission = coefficient("emission", false, 0.0)?;
        // Decides how distances are sampled.
        element.boolean("has_spectral_extinction", true)?;
        let has_emission = emission != [0.0; 3];
        // How lights are sampled does not change the picture.
        element.boolean("sample_emitters", true)?;
        let phase = match element.one("phase")? {
            Some(phase) => self.phase(phase)?,
            None => PhaseDesc::Isotropic,
        };
        let of = |f: &dyn Fn(usize) -> f32| CoefficientDesc::Rgb([0, 1, 2].map(f));
        let desc = MediumDesc {
            absorption: of(&|i| extinction[i] * (1.0 - albedo[i])),
            scattering: of(&|i| extinction[i] * albedo[i]),
            emission: if has_emission { of(&|i| emission[i] * scale) } else { CoefficientDesc::default() },
            phase,
            volume: grids.map(|grids| Box::new(grids.volume)),
        };
        let name = if element.plugin.id.is_empty() { "medium" } else { &element.plugin.id };
        let name = self.draft.add_medium(name, &element.place().to_string(), desc);
        element.finish(&mut self.draft);
        self.media.insert(id, name.clone());
        Ok(name)
    }

    /// A number, colour, spectrum or constant volume.
    fn coefficient(&mut self, element: &mut Element<'a>, name: &str) -> Result<Option<[f32; 3]>> {
        let Some(property) = element.plugin.properties.iter().find(|property| property.name == name) else {
            return Ok(None);
        };
        let volume = self.document.plugin_of(property)?.filter(|id| self.document.plugins[id.0].class == "volume");
        let Some(id) = volume else { return self.constant(element, name, UvOrigin::Mitsuba) };
        if self.document.plugins[id.0].kind != "constvolume" {
            element.ignored(name, "unsupported volume: the default in its place");
            return Ok(None);
        }
        let mut volume = Element::new(self.document, id);
        let value = self.constant(&mut volume, "value", UvOrigin::Mitsuba)?;
        volume.finish(&mut self.draft);
        element.take(name);
        Ok(value)
    }

    fn phase(&mut self, id: PluginId) -> Result<PhaseDesc> {
        self.guard(id)?;
        let mut element = Element::new(self.document, id);
        let phase = match element.kind() {
            "isotropic" => PhaseDesc::Isotropic,
            "rayleigh" => PhaseDesc::Rayleigh,
            "blendphase" => self.blend_phases(&mut element)?,
            "hg" => {
                let g = element.float("g")?.unwrap_or(0.8);
                if g.abs() > MAX_G {
                    element.approximated("g", format!("at most {MAX_G}"));
                }
                PhaseDesc::HenyeyGreenstein { g: g.clamp(-MAX_G, MAX_G) as f32 }
            }
            _ => {
                element.ignored("", "unsupported phase function: an isotropic one in its place");
                PhaseDesc::Isotropic
            }
        };
        element.finish(&mut self.draft);
        self.open.pop();
        Ok(phase)
    }

    /// The mean of two phase functions by a weight, which is that of the second.
    fn blend_phases(&mut self, element: &mut Element<'a>) -> Result<PhaseDesc> {
        let phases = element.all("phase")?;
        if phases.len() != 2 {
            let found = phases.len();
            return Err(element.place().error(format!("a blendphase needs two phase functions, not {found}")));
        }
        let weight = match self.coefficient(element, "weight")? {
            Some([r, g, b]) => ((r + g + b) / 3.0).clamp(0.0, 1.0),
            None if element.take("weight").is_some() => {
                element.approximated("weight", "0.5 everywhere");
                0.5
            }
            None => return Err(element.place().error("a blendphase needs \"weight\"")),
        };
        let phases = phases.into_iter().map(|(id, _)| self.phase(id)).collect::<Result<_>>()?;
        Ok(PhaseDesc::Mix { phases, weights: vec![1.0 - weight, weight] })
    }

    /// The material of a surface between media, whose BSDF has become `material`; `None` where media change nothing.
    pub(super) fn container(
        &mut self,
        bsdf: Option<PluginId>,
        material: &str,
        interface: &MediumInterface,
    ) -> Option<String> {
        let MediumInterface { inside, outside } = interface;
        let is_null = bsdf.is_some_and(|id| self.document.plugins[id.0].kind == "null");
        let desc = match self.draft.desc.materials.get(material) {
            _ if inside.is_none() && outside.is_none() => return None,
            _ if is_null => DielectricDesc::invisible(),
            Some(MaterialDesc::Dielectric(glass)) => (**glass).clone(),
            _ => return None,
        };
        let key = (material.to_owned(), inside.clone(), outside.is_some());
        if let Some(name) = self.containers.get(&key) {
            return Some(name.clone());
        }
        // What lies in another medium displaces it.
        let priority = Some(i32::from(outside.is_some()));
        let desc = MaterialDesc::Dielectric(Box::new(DielectricDesc { priority, medium: inside.clone(), ..desc }));
        let name = format!("{}_surface", inside.as_deref().unwrap_or(material));
        let name = self.draft.add_material(&name, "", desc);
        self.containers.insert(key, name.clone());
        Some(name)
    }

    /// The media inside and outside of a shape.
    pub(super) fn medium_interface(&mut self, element: &mut Element<'a>) -> Result<MediumInterface> {
        let inside = self.medium(element, "interior")?;
        let outside = self.medium(element, "exterior")?;
        self.media_outside.extend(outside.clone());
        element.ignored_other_plugins("medium", "media have the names \"interior\" and \"exterior\"")?;
        Ok(MediumInterface { inside, outside })
    }

    /// Notes the medium around the camera or a light, whatever its name.
    pub(super) fn medium_outside(&mut self, element: &mut Element<'a>) -> Result<()> {
        for property in &element.plugin.properties {
            let medium = self.medium(element, &property.name)?;
            self.media_outside.extend(medium);
        }
        Ok(())
    }

    /// What is outside of some shape and inside of none is around everything.
    pub(super) fn surround(&mut self) {
        let mut around = self.media_outside.difference(&self.media_inside).cloned();
        let first = around.next();
        if let (Some(first), Some(second)) = (&first, around.next()) {
            let why = format!("only one medium can be around everything: {first}, not {second}");
            self.draft.ignored("", "scene", "", why);
        }
        self.draft.desc.medium = first;
    }
}
