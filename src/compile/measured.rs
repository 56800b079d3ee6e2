//! Measured materials.

use super::materials::Compiler;
use crate::assets::read_measured;
use crate::bsdf::{Bsdf, Lambert, Measured};
use crate::color::Rgb;
use crate::error::Result;
use crate::material::Material;

impl Compiler<'_> {
    /// The BRDF of a file; of a material that nothing uses, it is not read.
    pub(super) fn measured(&self, path: &str, file: &str) -> Result<Material> {
        let name = path.strip_prefix("materials.").unwrap_or(path);
        let path = format!("{path}.file");
        if !self.used.materials.contains(name) {
            self.files.warn_of_missing(&path, file);
            return Ok(Lambert { albedo: Rgb::splat(0.5) }.into());
        }
        let asset = self.files.source.asset(file);
        let data = read_measured(&asset).map_err(|e| self.files.asset_error(&path, &asset, e))?;
        Ok(Material::Constant(Bsdf::Measured(Measured::new(data))))
    }
}
