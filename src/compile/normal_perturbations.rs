//! Normal maps and bump maps: materials of the type `relief`.

use super::materials::{Compiler, MaterialTable};
use super::textures::TextureUse;
use crate::desc::{BumpMapDesc, ColorSpaceDesc, MaterialDesc, NormalMapDesc, SceneDesc, TextureDesc};
use crate::error::Result;
use crate::id::{MaterialId, NormalPerturbationId};
use crate::material::Material;
use crate::normal_perturbation::NormalPerturbation;

impl MaterialTable {
    /// Adds a normal or bump map.
    pub(super) fn push_normal_perturbation(&mut self, normal_perturbation: NormalPerturbation) -> NormalPerturbationId {
        self.normal_perturbations.push(normal_perturbation);
        NormalPerturbationId::new(self.normal_perturbations.len() - 1)
    }

    /// The normal or bump map of a material by itself.
    pub(super) fn normal_perturbation_of(&self, id: MaterialId) -> Option<NormalPerturbationId> {
        self.by_material.get(&id).copied()
    }

    /// Normal and bump maps by material if some material has a part with one; none otherwise.
    pub(super) fn part_normal_perturbations(&self) -> Vec<Option<NormalPerturbationId>> {
        let mut parts = self.materials.iter().filter_map(Material::parts).flatten();
        if !parts.any(|part| self.normal_perturbation_of(part).is_some()) {
            return Vec::new();
        }
        (0..self.materials.len()).map(|i| self.normal_perturbation_of(MaterialId::new(i))).collect()
    }
}

impl Compiler<'_> {
    /// The normal or bump map of a material of the type `relief`.
    pub(super) fn normal_perturbation(
        &self,
        desc: &SceneDesc,
        path: &str,
        material: &MaterialDesc,
    ) -> Result<Option<NormalPerturbation>> {
        let MaterialDesc::Relief { normal_map, bump_map, .. } = material else { return Ok(None) };
        Ok(Some(match (normal_map, bump_map) {
            (Some(map), None) => self.normal_map(desc, &format!("{path}.normal_map"), map)?,
            (None, Some(map)) => self.bump_map(&format!("{path}.bump_map"), map)?,
            _ => return Err(self.files.error(path, "a relief needs either `normal_map` or `bump_map`")),
        }))
    }

    fn normal_map(&self, desc: &SceneDesc, path: &str, map: &NormalMapDesc) -> Result<NormalPerturbation> {
        let place = format!("{path}.texture");
        let texture = self.textures.find_by_uv(self.files, &place, &map.texture, TextureUse::Data)?;
        if let Some(TextureDesc::Image { color_space: ColorSpaceDesc::Srgb, .. }) = desc.textures.get(&map.texture) {
            return Err(self
                .files
                .error(&place, format!("the `color_space` of \"{}\" is `srgb`, but normals are data", map.texture)));
        }
        self.files.within(&format!("{path}.strength"), f64::from(map.strength), 0.0, 16.0)?;
        Ok(NormalPerturbation::normal_map(texture, map.strength, map.flip_y, &self.textures.textures))
    }

    fn bump_map(&self, path: &str, map: &BumpMapDesc) -> Result<NormalPerturbation> {
        let texture =
            self.textures.find_by_uv(self.files, &format!("{path}.texture"), &map.texture, TextureUse::Data)?;
        if !map.height.is_finite() {
            return Err(self.files.error(&format!("{path}.height"), "is not finite"));
        }
        Ok(NormalPerturbation::bump_map(texture, map.height, &self.textures.textures))
    }
}
