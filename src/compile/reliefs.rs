//! Materials with relief: normal maps and bump maps.

use super::Files;
use super::materials::{Look, MaterialTable};
use super::textures::TextureUse;
use crate::desc::{BumpMapDesc, ColorSpaceDesc, MaterialDesc, NormalMapDesc, SceneDesc, TextureDesc};
use crate::error::Result;
use crate::id::ReliefId;
use crate::relief::Relief;

impl MaterialTable {
    /// Adds the materials with relief, once all others are there.
    pub(super) fn add_reliefs(&mut self, files: &Files, desc: &SceneDesc) -> Result<()> {
        let mut looks = Vec::new();
        for (name, material) in &desc.materials {
            let MaterialDesc::Relief { material, normal_map, bump_map } = material else { continue };
            let path = format!("materials.{name}");
            if matches!(desc.materials.get(material), Some(MaterialDesc::Relief { .. })) {
                return Err(files.error(&format!("{path}.material"), format!("\"{material}\" has a relief of its own")));
            }
            let base = self.find(files, &path, Some(material))?;
            let relief = match (normal_map, bump_map) {
                (Some(map), None) => self.normal_map(files, desc, &format!("{path}.normal_map"), map)?,
                (None, Some(map)) => self.bump_map(files, &format!("{path}.bump_map"), map)?,
                _ => return Err(files.error(&path, "a relief needs either `normal_map` or `bump_map`")),
            };
            looks.push((name.clone(), Look { relief: Some(self.push_relief(relief)), ..base }));
        }
        for (name, look) in looks {
            self.insert(name, look);
        }
        Ok(())
    }

    /// Adds a relief.
    pub(super) fn push_relief(&mut self, relief: Relief) -> ReliefId {
        self.reliefs.push(relief);
        ReliefId::new(self.reliefs.len() - 1)
    }

    fn normal_map(&self, files: &Files, desc: &SceneDesc, path: &str, map: &NormalMapDesc) -> Result<Relief> {
        let place = format!("{path}.texture");
        let texture = self.textures.find(files, &place, &map.texture, TextureUse::Data)?;
        if let Some(TextureDesc::Image { color_space: ColorSpaceDesc::Srgb, .. }) = desc.textures.get(&map.texture) {
            return Err(files.error(&place, format!("the `color_space` of \"{}\" is `srgb`, but normals are data", map.texture)));
        }
        files.within(&format!("{path}.strength"), f64::from(map.strength), 0.0, 16.0)?;
        Ok(Relief::normal_map(texture, map.strength, map.flip_y, &self.textures.textures))
    }

    fn bump_map(&self, files: &Files, path: &str, map: &BumpMapDesc) -> Result<Relief> {
        let texture = self.textures.find(files, &format!("{path}.texture"), &map.texture, TextureUse::Data)?;
        if !map.height.is_finite() {
            return Err(files.error(&format!("{path}.height"), "is not finite"));
        }
        Ok(Relief::bump_map(texture, map.height, &self.textures.textures))
    }
}
