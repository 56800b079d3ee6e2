//! Materials that consist of others.

use std::collections::{HashMap, HashSet};

use super::materials::{Compiler, MaterialTable};
use crate::desc::{MaterialDesc, SceneDesc};
use crate::error::Result;
use crate::id::MaterialId;
use crate::material::{CoatInput, ColorInput, Material, TexturedMaterial};

/// A coat and its colour.
struct Coating {
    coat: CoatInput,
    tint: ColorInput,
}

/// Materials within materials, at most.
const MAX_DEPTH: usize = 32;

impl MaterialTable {
    /// The material `name` if it consists of others, which are compiled first.
    pub(super) fn composite<'a>(
        &mut self,
        compiler: &Compiler,
        desc: &'a SceneDesc,
        name: &'a str,
        outer: &mut Vec<&'a str>,
    ) -> Result<Option<Material>> {
        let path = format!("materials.{name}");
        let material = match &desc.materials[name] {
            MaterialDesc::Mix { materials: [first, second], amount } => {
                outer.push(name);
                let first = self.part(compiler, desc, &format!("{path}.materials[0]"), first, outer)?;
                let second = self.part(compiler, desc, &format!("{path}.materials[1]"), second, outer)?;
                Material::Mix { first, second, amount: compiler.scalar(&format!("{path}.amount"), amount)? }
            }
            MaterialDesc::TwoSided { front, back } => {
                outer.push(name);
                let mut side = |key: &str, part: &'a str| {
                    let path = format!("{path}.{key}");
                    let id = self.part(compiler, desc, &path, part, outer)?;
                    if self.transmits(id) {
                        return Err(compiler
                            .files
                            .error(&path, format!("\"{part}\" lets light through: both sides must be opaque")));
                    }
                    Ok(id)
                };
                Material::TwoSided { front: side("front", front)?, back: side("back", back)? }
            }
            MaterialDesc::Coated { base, ior, roughness, alpha, tint } => {
                outer.push(name);
                let place = format!("{path}.base");
                let base_id = self.part(compiler, desc, &place, base, outer)?;
                self.check_base(compiler, &place, base, base_id)?;
                let coating = Coating {
                    coat: CoatInput::new(
                        compiler.ior(&path, ior, 1.0)?,
                        compiler.alpha(&path, roughness.as_ref(), alpha.as_ref())?,
                    ),
                    tint: compiler.color(&format!("{path}.tint"), tint)?,
                };
                self.coated(base_id, &coating, &mut HashMap::new())
            }
            MaterialDesc::Relief { material, .. } => {
                outer.push(name);
                let place = format!("{path}.material");
                let base = self.part(compiler, desc, &place, material, outer)?;
                self.check_no_relief(compiler, &place, material, base)?;
                self.materials[base.index()].clone()
            }
            _ => return Ok(None),
        };
        outer.pop();
        Ok(Some(material))
    }

    fn part<'a>(
        &mut self,
        compiler: &Compiler,
        desc: &'a SceneDesc,
        path: &str,
        part: &'a str,
        outer: &mut Vec<&'a str>,
    ) -> Result<MaterialId> {
        if outer.contains(&part) {
            return Err(compiler
                .files
                .error(path, format!("the material consists of itself: {} -> {part}", outer.join(" -> "))));
        }
        if outer.len() >= MAX_DEPTH {
            return Err(compiler.files.error(path, format!("materials are nested more than {MAX_DEPTH} deep")));
        }
        if !desc.materials.contains_key(part) {
            return Err(compiler.files.unknown(path, "material", part, desc.materials.keys().map(String::as_str)));
        }
        self.add(compiler, desc, part, outer)
    }

    /// A material below a coat: one that consists of others becomes one that consists of coated others, each coated
    /// once.
    fn coated(&mut self, id: MaterialId, coating: &Coating, done: &mut HashMap<MaterialId, MaterialId>) -> Material {
        match self.materials[id.index()].clone() {
            Material::Mix { first, second, amount } => {
                let [first, second] = [first, second].map(|part| self.coated_part(part, coating, done));
                Material::Mix { first, second, amount }
            }
            Material::TwoSided { front, back } => {
                let [front, back] = [front, back].map(|part| self.coated_part(part, coating, done));
                Material::TwoSided { front, back }
            }
            base => TexturedMaterial::Coated { coat: coating.coat.clone(), tint: coating.tint, base }.into(),
        }
    }

    fn coated_part(
        &mut self,
        id: MaterialId,
        coating: &Coating,
        done: &mut HashMap<MaterialId, MaterialId>,
    ) -> MaterialId {
        if let Some(coated) = done.get(&id) {
            return *coated;
        }
        let material = self.coated(id, coating, done);
        let coated = self.push(material);
        done.insert(id, coated);
        coated
    }

    /// Whether light may cross the material or a part of it.
    pub(super) fn transmits(&self, id: MaterialId) -> bool {
        self.any_part(id, &|id| self.materials[id.index()].flags().transmits())
    }

    /// That a material can be below a coat.
    fn check_base(&self, compiler: &Compiler, place: &str, name: &str, id: MaterialId) -> Result<()> {
        let fault = |why: &str| Err(compiler.files.error(place, format!("\"{name}\" {why}")));
        if self.transmits(id) {
            return fault("lets light through: what is below a coat must be opaque");
        }
        if self.any_part(id, &|id| self.has_subsurface(id)) {
            return fault("has a random walk below its surface: use its `clearcoat`");
        }
        self.check_no_relief(compiler, place, name, id)
    }

    /// That neither a material nor a part of it has a relief.
    fn check_no_relief(&self, compiler: &Compiler, place: &str, name: &str, id: MaterialId) -> Result<()> {
        if self.any_part(id, &|id| self.normal_perturbation_of(id).is_some()) {
            return Err(compiler.files.error(place, format!("\"{name}\" has a relief of its own")));
        }
        Ok(())
    }

    /// Whether something is true of a material or of a part of it.
    pub(super) fn any_part(&self, id: MaterialId, is: &impl Fn(MaterialId) -> bool) -> bool {
        // Parts of several parts are visited once.
        let (mut open, mut seen) = (vec![id], HashSet::from([id]));
        while let Some(id) = open.pop() {
            if is(id) {
                return true;
            }
            open.extend(self.materials[id.index()].parts().into_iter().flatten().filter(|&part| seen.insert(part)));
        }
        false
    }
}
