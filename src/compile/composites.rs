//! Materials that consist of others.

use super::materials::{Compiler, MaterialTable};
use crate::desc::{MaterialDesc, SceneDesc};
use crate::error::Result;
use crate::id::MaterialId;
use crate::material::Material;

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
                        return Err(compiler.files.error(&path, format!("\"{part}\" lets light through: both sides must be opaque")));
                    }
                    Ok(id)
                };
                Material::TwoSided { front: side("front", front)?, back: side("back", back)? }
            }
            MaterialDesc::Relief { material, .. } => {
                outer.push(name);
                let place = format!("{path}.material");
                let base = self.part(compiler, desc, &place, material, outer)?;
                if self.any_part(base, &|id| self.relief_of(id).is_some()) {
                    return Err(compiler.files.error(&place, format!("\"{material}\" has a relief of its own")));
                }
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
            return Err(compiler.files.error(path, format!("the material consists of itself: {} -> {part}", outer.join(" -> "))));
        }
        if outer.len() >= MAX_DEPTH {
            return Err(compiler.files.error(path, format!("materials are nested more than {MAX_DEPTH} deep")));
        }
        if !desc.materials.contains_key(part) {
            return Err(compiler.files.unknown(path, "material", part, desc.materials.keys().map(String::as_str)));
        }
        self.add(compiler, desc, part, outer)
    }

    /// Whether light may cross the material or a part of it.
    fn transmits(&self, id: MaterialId) -> bool {
        self.any_part(id, &|id| self.materials[id.index()].transmits())
    }

    /// Whether something is true of a material or of a part of it.
    pub(super) fn any_part(&self, id: MaterialId, is: &impl Fn(MaterialId) -> bool) -> bool {
        is(id) || self.materials[id.index()].parts().is_some_and(|parts| parts.into_iter().any(|part| self.any_part(part, is)))
    }
}
