//! Participating media.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::colors::{Colors, Meaning};
use super::directives::quoted;
use super::params::Params;
use super::subsurface::measured;
use super::tokens::{Lexer, Position, TokenKind};
use crate::desc::{CoefficientDesc, DielectricDesc, KeyframeDesc, MaterialDesc, MediumDesc, PhaseDesc, TransformDesc};
use crate::error::Result;
use crate::import::foreign::Draft;

/// The largest mean cosine of a phase function.
const MAX_G: f64 = 0.99;

/// The media inside and outside of shapes, by pbrt's names; empty for none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MediumInterface {
    /// Behind the normal.
    pub inside: String,
    /// On the side of the normal.
    pub outside: String,
}

impl MediumInterface {
    /// Reads what follows `MediumInterface`: one name for both sides, or two.
    pub fn read(lexer: &mut Lexer, at: Position) -> Result<Self> {
        let inside = quoted(lexer, at, "a medium")?;
        let has_two = lexer.peek()?.is_some_and(|token| token.kind == TokenKind::Quoted);
        let outside = if has_two { quoted(lexer, at, "a medium")? } else { inside.clone() };
        Ok(Self { inside, outside })
    }
}

/// A medium's name, parameters and place.
#[derive(Debug)]
pub struct MediumDirective<'a> {
    pub name: &'a str,
    pub params: &'a Params,
    pub colors: &'a Colors<'a>,
    /// The file of the scene.
    pub scene: &'a Path,
    /// Of the medium's own space.
    pub transform: TransformDesc,
    pub motion: Vec<KeyframeDesc>,
}

/// The media of a scene.
#[derive(Debug, Default)]
pub struct MediumTable {
    /// Names in the scene by pbrt's; `None` of media that are left out.
    names: BTreeMap<String, Option<String>>,
    /// Materials of surfaces of media, by those of the surface (empty for none), the names of the media inside, and
    /// whether another is outside.
    containers: BTreeMap<(String, Option<String>, bool), String>,
    inside: BTreeSet<String>,
    outside: BTreeSet<String>,
    /// Whether the integrator shows none.
    pub are_hidden: bool,
}

impl MediumTable {
    /// Reads a medium.
    pub fn define(&mut self, draft: &mut Draft, medium: &MediumDirective) -> Result<()> {
        let MediumDirective { name, params, colors, .. } = *medium;
        let kind = params.string("type")?.unwrap_or("homogeneous");
        if !matches!(kind, "homogeneous" | "uniformgrid" | "rgbgrid" | "nanovdb") {
            let why = "only homogeneous media, uniformgrid, rgbgrid and nanovdb are supported: left out";
            draft.ignored(&params.place, &params.element, "", why);
            self.names.insert(name.into(), None);
            return Ok(());
        }
        let scale = params.number_or("scale", 1.0)? as f32;
        let is_rgb_grid = kind == "rgbgrid";
        let preset = params.string("preset")?.filter(|_| !is_rgb_grid).and_then(measured);
        let coefficient = |name: &str, preset: Option<[f32; 3]>| -> Result<[f32; 3]> {
            let given = if is_rgb_grid { None } else { colors.get(params, name, Meaning::Number)? };
            Ok(preset.or(given).unwrap_or([1.0; 3]).map(|c| c.max(0.0) * scale))
        };
        let absorption = coefficient("sigma_a", preset.map(|preset| preset.absorption))?;
        let scattering = coefficient("sigma_s", preset.map(|preset| preset.scattering))?;
        let volume = match kind {
            "uniformgrid" => Some(medium.uniform_grid(draft)?),
            "rgbgrid" => Some(medium.rgb_grid(draft)?),
            "nanovdb" => Some(medium.nano_grid(draft)?),
            _ => None,
        };
        if preset.is_none() {
            params.ignore("preset", "no such medium is known: the coefficients of the file or 1");
        }
        let is_grid = volume.is_some();
        let brightness = if is_grid { 1.0 } else { params.number_or("Lescale", 1.0)? as f32 };
        let radiance = if is_rgb_grid { None } else { colors.get(params, "Le", Meaning::Emission)? };
        // Black bodies have a colour of their own.
        let has_volume_emission = volume.as_ref().is_some_and(|volume| volume.emission.is_some());
        let is_blackbody =
            kind == "uniformgrid" && params.has("temperature") || kind == "nanovdb" && has_volume_emission;
        let radiance = if is_blackbody { [1.0; 3] } else { radiance.unwrap_or([0.0; 3]) };
        let emission = [0, 1, 2].map(|i| radiance[i].max(0.0) * brightness * absorption[i]);
        let g = params.number_or("g", 0.0)?;
        if g.abs() > MAX_G {
            params.approximate("g", format!("at most {MAX_G}"));
        }
        let phase = if g == 0.0 {
            PhaseDesc::Isotropic
        } else {
            PhaseDesc::HenyeyGreenstein { g: g.clamp(-MAX_G, MAX_G) as f32 }
        };
        let [absorption, scattering, emission] = [absorption, scattering, emission].map(CoefficientDesc::Rgb);
        let emission = if emission == CoefficientDesc::Rgb([0.0; 3]) { CoefficientDesc::default() } else { emission };
        let desc = MediumDesc { absorption, scattering, emission, phase, volume: volume.map(Box::new) };
        params.report(draft);
        let added = draft.add_medium(name, &params.place, desc);
        self.names.insert(name.into(), Some(added));
        Ok(())
    }

    fn find(&self, draft: &mut Draft, params: &Params, name: &str) -> Option<String> {
        if name.is_empty() {
            return None;
        }
        let known = self.names.get(name).cloned();
        if known.is_none() {
            let why = format!("no medium named \"{name}\"");
            draft.ignored(&params.place, &params.element, "MediumInterface", why);
        }
        known.flatten().filter(|_| !self.are_hidden)
    }

    /// Notes a medium around something that is no surface.
    pub fn surround(&mut self, draft: &mut Draft, params: &Params, name: &str) {
        let found = self.find(draft, params, name);
        self.outside.extend(found);
    }

    /// The material of a shape between media, whose own is `material` or nothing; `None` where the media change
    /// nothing.
    pub fn container(
        &mut self,
        draft: &mut Draft,
        params: &Params,
        interface: &MediumInterface,
        material: Option<&str>,
    ) -> Option<String> {
        if interface.inside == interface.outside {
            self.surround(draft, params, &interface.outside);
            return None;
        }
        let inside = self.find(draft, params, &interface.inside);
        let outside = self.find(draft, params, &interface.outside);
        self.outside.extend(outside.clone());
        let desc = match material.map(|name| draft.desc.materials.get(name)) {
            _ if inside.is_none() && outside.is_none() => return None,
            None => DielectricDesc::invisible(),
            Some(Some(MaterialDesc::Dielectric(glass))) => (**glass).clone(),
            Some(_) => return None,
        };
        self.inside.extend(inside.clone());
        let key = (material.unwrap_or_default().to_owned(), inside.clone(), outside.is_some());
        if let Some(name) = self.containers.get(&key) {
            return Some(name.clone());
        }
        let name = format!("{}_surface", inside.as_deref().or(material).unwrap_or("interface"));
        // What lies in another medium displaces it.
        let priority = Some(i32::from(outside.is_some()));
        let desc = MaterialDesc::Dielectric(Box::new(DielectricDesc { priority, medium: inside, ..desc }));
        let name = draft.add_material(&name, &params.place, desc);
        self.containers.insert(key, name.clone());
        Some(name)
    }

    /// What is outside of some shape, or around the camera, and inside of none is around everything.
    pub fn finish(&self, draft: &mut Draft) {
        if self.are_hidden {
            if !self.names.is_empty() {
                draft.ignored("", "MakeNamedMedium", "", "the integrator shows no participating media");
            }
            return;
        }
        let mut around = self.outside.difference(&self.inside).cloned();
        let first = around.next();
        if let (Some(first), Some(second)) = (&first, around.next()) {
            let why = format!("only one medium can be around everything: {first}, not {second}");
            draft.ignored("", "MediumInterface", "", why);
        }
        draft.desc.medium = first;
    }
}
