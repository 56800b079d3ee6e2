//! Materials: names to ids, parameters to BSDFs.

use std::collections::HashMap;
use std::fmt::Debug;

use super::Files;
use super::textures::TextureTable;
use crate::bsdf::{Conductor, Dielectric, Lambert, Mirror, Plastic};
use crate::color::Rgb;
use crate::desc::{ColorDesc, MaterialDesc, RoughnessDesc, SceneDesc};
use crate::error::Result;
use crate::id::{MaterialId, ReliefId, TextureId};
use crate::import::ObjMaterial;
use crate::material::{ColorInput, Material};
use crate::relief::Relief;

/// Real and imaginary part of the index of refraction for red, green and blue (650, 550 and 450 nm; refractiveindex.info: Johnson and Christy
/// for noble metals, iron, chromium and titanium; Rakic for aluminium and tungsten; Querry for brass).
const METALS: &[(&str, [f32; 3], [f32; 3])] = &[
    ("aluminium", [1.657, 0.880, 0.521], [9.224, 6.270, 4.837]),
    ("brass", [0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
    ("chromium", [3.107, 3.181, 2.323], [3.331, 3.329, 3.135]),
    ("copper", [0.200, 0.924, 1.102], [3.912, 2.452, 2.142]),
    ("gold", [0.143, 0.375, 1.442], [3.983, 2.386, 1.603]),
    ("iron", [2.911, 2.950, 2.585], [3.089, 2.932, 2.767]),
    ("silver", [0.155, 0.116, 0.138], [4.828, 3.122, 2.147]),
    ("titanium", [2.741, 2.542, 2.267], [3.814, 3.435, 3.039]),
    ("tungsten", [4.370, 3.300, 2.999], [3.500, 2.605, 2.731]),
];

/// All materials and textures, with their names.
pub struct MaterialTable {
    pub materials: Vec<Material>,
    pub textures: TextureTable,
    pub reliefs: Vec<Relief>,
    names: HashMap<String, Look>,
}

/// How a shape looks: what a material of the scene file comes to.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    pub material: MaterialId,
    pub relief: Option<ReliefId>,
    /// How much of the surface is there.
    pub alpha: Option<TextureId>,
}

impl Look {
    /// A material alone.
    pub fn plain(material: MaterialId) -> Self {
        Self { material, relief: None, alpha: None }
    }
}

impl MaterialTable {
    /// The id of the material for shapes that name none: diffuse, albedo 1/2.
    pub const DEFAULT: MaterialId = MaterialId(0);

    pub fn new(files: &Files, desc: &SceneDesc) -> Result<Self> {
        let textures = TextureTable::new(files, desc)?;
        let default = Material::from(Lambert { albedo: Rgb::splat(0.5) });
        let mut table = Self { materials: vec![default], textures, reliefs: Vec::new(), names: HashMap::new() };
        for (name, material) in &desc.materials {
            if matches!(material, MaterialDesc::Relief { .. }) {
                continue;
            }
            let compiler = Compiler { files, textures: &table.textures };
            let material = compiler.material(&format!("materials.{name}"), material)?;
            let id = table.push(material);
            table.names.insert(name.clone(), Look::plain(id));
        }
        table.add_reliefs(files, desc)?;
        Ok(table)
    }

    /// Adds a material without a name.
    pub fn push(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId::new(self.materials.len() - 1)
    }

    /// Gives a look a name.
    pub(super) fn insert(&mut self, name: String, look: Look) {
        self.names.insert(name, look);
    }

    /// Whether a surface without uv cannot look so.
    pub fn needs_uv(&self, look: &Look) -> bool {
        look.relief.is_some() || look.alpha.is_some() || !matches!(self.materials[look.material.index()], Material::Constant(_))
    }

    /// Whether a surface's normals come from a normal map.
    pub fn has_normal_map(&self, look: &Look) -> bool {
        look.relief.is_some_and(|id| matches!(self.reliefs[id.index()], Relief::NormalMap { .. }))
    }

    /// What a name stands for, or the default.
    pub fn find(&self, files: &Files, path: &str, name: Option<&str>) -> Result<Look> {
        let Some(name) = name else {
            return Ok(Look::plain(Self::DEFAULT));
        };
        let found = self.names.get(name).copied();
        found.ok_or_else(|| files.unknown(&format!("{path}.material"), "material", name, self.names.keys().map(String::as_str)))
    }
}

struct Compiler<'a> {
    files: &'a Files,
    textures: &'a TextureTable,
}

impl Compiler<'_> {
    fn material(&self, path: &str, desc: &MaterialDesc) -> Result<Material> {
        let files = self.files;
        Ok(match desc {
            MaterialDesc::Diffuse { albedo } => match self.color(&format!("{path}.albedo"), albedo)? {
                ColorInput::Constant(albedo) => Lambert { albedo }.into(),
                albedo @ ColorInput::Texture(_) => Material::Diffuse { albedo },
            },
            MaterialDesc::Relief { .. } => return Err(files.error(path, "a material cannot consist of one with relief")),
            MaterialDesc::Mirror { reflectance } => {
                Mirror { reflectance: self.constant(&format!("{path}.reflectance"), reflectance)? }.into()
            }
            MaterialDesc::Conductor { metal, eta, k, roughness, alpha, tint } => {
                let (eta, k) = self.metal(path, metal.as_deref(), *eta, *k)?;
                let tint = self.constant(&format!("{path}.tint"), tint)?;
                Conductor::new(eta.into(), k.into(), self.alpha(path, *roughness, *alpha)?, tint).into()
            }
            MaterialDesc::Dielectric { ior, roughness, alpha } => {
                files.within(&format!("{path}.ior"), f64::from(*ior), 0.1, 10.0)?;
                Dielectric::new(*ior, self.alpha(path, *roughness, *alpha)?).into()
            }
            MaterialDesc::Plastic { albedo, ior, roughness, alpha } => {
                if !(*ior > 1.0 && *ior <= 10.0) {
                    return Err(files.error(&format!("{path}.ior"), format!("must be above 1 and at most 10, not {ior}")));
                }
                let alpha = self.alpha(path, *roughness, *alpha)?;
                match self.color(&format!("{path}.albedo"), albedo)? {
                    ColorInput::Constant(albedo) => Plastic::new(albedo, *ior, alpha).into(),
                    albedo @ ColorInput::Texture(_) => Material::Plastic { base: Plastic::new(Rgb::BLACK, *ior, alpha), albedo },
                }
            }
        })
    }

    fn color(&self, path: &str, desc: &ColorDesc) -> Result<ColorInput> {
        Ok(match desc {
            ColorDesc::Grey(v) => ColorInput::Constant(self.files.reflectance(path, [*v; 3])?.into()),
            ColorDesc::Rgb(v) => ColorInput::Constant(self.files.reflectance(path, *v)?.into()),
            ColorDesc::Texture { texture } => self.textures.reflectance(self.files, path, texture)?,
        })
    }

    fn constant(&self, path: &str, desc: &ColorDesc) -> Result<Rgb> {
        match self.color(path, desc)? {
            ColorInput::Constant(color) => Ok(color),
            ColorInput::Texture(_) => Err(self.files.error(path, "must be a colour: only `albedo` can vary with a texture")),
        }
    }

    fn metal(&self, path: &str, metal: Option<&str>, eta: Option<[f32; 3]>, k: Option<[f32; 3]>) -> Result<([f32; 3], [f32; 3])> {
        match (metal, eta, k) {
            (Some(name), None, None) => {
                let found = METALS.iter().find(|(metal, ..)| *metal == name).map(|&(_, eta, k)| (eta, k));
                found.ok_or_else(|| self.files.unknown(&format!("{path}.metal"), "metal", name, METALS.iter().map(|m| m.0)))
            }
            (None, Some(eta), Some(k)) => {
                if !eta.iter().all(|&e| e > 0.0 && e.is_finite()) {
                    return Err(self.files.error(&format!("{path}.eta"), format!("{eta:?} must be finite and above 0")));
                }
                Ok((eta, self.files.emitted(&format!("{path}.k"), k)?))
            }
            _ => Err(self.files.error(path, "give either `metal`, or both `eta` and `k`")),
        }
    }

    /// GGX alpha along u and v; zero for a smooth surface.
    fn alpha(&self, path: &str, roughness: Option<RoughnessDesc>, alpha: Option<RoughnessDesc>) -> Result<[f32; 2]> {
        let pair = |desc: RoughnessDesc| match desc {
            RoughnessDesc::Isotropic(a) => [a; 2],
            RoughnessDesc::Anisotropic(a) => a,
        };
        let checked = |key: &str, desc: RoughnessDesc| {
            let values = pair(desc);
            for value in values {
                self.files.within(&format!("{path}.{key}"), f64::from(value), 0.0, 1.0)?;
            }
            Ok(values)
        };
        match (roughness, alpha) {
            (None, None) => Ok([0.0; 2]),
            (Some(roughness), None) => Ok(checked("roughness", roughness)?.map(|r| r * r)),
            (None, Some(alpha)) => checked("alpha", alpha),
            (Some(_), Some(_)) => Err(self.files.error(path, "give either `roughness` or `alpha`")),
        }
    }
}

/// What an MTL makes of a surface.
pub struct MtlSurface {
    pub material: Material,
    /// Light given off, if not black.
    pub radiance: Option<Rgb>,
}

/// The nearest material for what an MTL says: `illum` 5 is a mirror of colour Ks; 4, 6, 7 and 9, or `d` below 1/2, is glass of index Ni; a
/// specular colour with an exponent has alpha = sqrt(2 / (Ns + 2)) and is a metal of that colour if Kd is black, plastic otherwise;
/// everything else is diffuse with Kd.
///
/// The error says which number makes no sense.
pub fn from_mtl(mtl: &ObjMaterial) -> Result<MtlSurface, String> {
    let fault = |key: &str, value: &dyn Debug, must: &str| Err(format!("material \"{}\": {key} {value:?} must be {must}", mtl.name));
    for (key, color) in [("Kd", mtl.diffuse), ("Ks", mtl.specular)] {
        if let Some(color) = color.filter(|c| !c.iter().all(|v| (0.0..=1.0).contains(v))) {
            return fault(key, &color, "within 0 and 1");
        }
    }
    if let Some(radiance) = mtl.emissive.filter(|c| !c.iter().all(|&v| v >= 0.0 && v.is_finite())) {
        return fault("Ke", &radiance, "finite and not negative");
    }
    if let Some(exponent) = mtl.shininess.filter(|&n| !(n >= 0.0 && n.is_finite())) {
        return fault("Ns", &exponent, "finite and not negative");
    }
    let diffuse = mtl.diffuse.map_or(Rgb::splat(0.5), Rgb::from);
    let specular = mtl.specular.map_or(Rgb::BLACK, Rgb::from);
    let ior = mtl.ior.filter(|&n| n > 1.0 && n <= 10.0).unwrap_or(1.5);
    let is_glass = matches!(mtl.illumination, Some(4 | 6 | 7 | 9)) || mtl.opacity.is_some_and(|d| d < 0.5);
    let material = if mtl.illumination == Some(5) {
        Mirror { reflectance: if specular.is_black() { Rgb::WHITE } else { specular } }.into()
    } else if is_glass {
        Dielectric::new(ior, [0.0; 2]).into()
    } else if let Some(exponent) = mtl.shininess.filter(|_| !specular.is_black()) {
        let alpha = [(2.0 / (exponent + 2.0)).sqrt(); 2];
        if diffuse.is_black() { metal_of_color(specular, alpha) } else { Plastic::new(diffuse, ior, alpha).into() }
    } else {
        Lambert { albedo: diffuse }.into()
    };
    Ok(MtlSurface { material, radiance: mtl.emissive.map(Rgb::from).filter(|radiance| !radiance.is_black()) })
}

/// A metal with the given reflectance at normal incidence: with a real part of 1, `r = k² / (4 + k²)`.
fn metal_of_color(reflectance: Rgb, alpha: [f32; 2]) -> Material {
    let k = reflectance.map(|r| {
        let r = r.min(0.9999);
        2.0 * (r / (1.0 - r)).sqrt()
    });
    Conductor::new(Rgb::WHITE, k, alpha, Rgb::WHITE).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Bsdf;
    use crate::math::Vec3;

    fn bsdf(mtl: ObjMaterial) -> Bsdf {
        match from_mtl(&mtl).unwrap().material {
            Material::Constant(bsdf) => bsdf,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_mtl_becomes_the_nearest_material() {
        let plain = ObjMaterial { diffuse: Some([0.1, 0.2, 0.3]), ..ObjMaterial::default() };
        assert_eq!(bsdf(plain.clone()), Bsdf::Lambert(Lambert { albedo: Rgb::new(0.1, 0.2, 0.3) }));
        assert_eq!(bsdf(ObjMaterial::default()), Bsdf::Lambert(Lambert { albedo: Rgb::splat(0.5) }));
        let mirror = ObjMaterial { illumination: Some(5), specular: Some([0.9; 3]), ..plain.clone() };
        assert_eq!(bsdf(mirror), Bsdf::Mirror(Mirror { reflectance: Rgb::splat(0.9) }));
        let glass = ObjMaterial { illumination: Some(7), ior: Some(1.33), ..plain.clone() };
        assert_eq!(bsdf(glass), Bsdf::Dielectric(Dielectric::new(1.33, [0.0; 2])));
        let shiny = ObjMaterial { specular: Some([0.5; 3]), shininess: Some(48.0), ..plain.clone() };
        assert_eq!(bsdf(shiny), Bsdf::Plastic(Plastic::new(Rgb::new(0.1, 0.2, 0.3), 1.5, [0.2; 2])));
        let glowing = from_mtl(&ObjMaterial { emissive: Some([1.0, 2.0, 3.0]), ..plain }).unwrap();
        assert_eq!(glowing.radiance, Some(Rgb::new(1.0, 2.0, 3.0)));
    }

    #[test]
    fn a_metal_has_the_colour_it_was_given() {
        let color = Rgb::new(0.9, 0.5, 0.1);
        let Material::Constant(metal) = metal_of_color(color, [0.0; 2]) else { panic!("varies") };
        let weight = metal.sample(Vec3::Z, 0.5, [0.5; 2]).unwrap().weight;
        assert!([weight.r - color.r, weight.g - color.g, weight.b - color.b].iter().all(|d| d.abs() < 1e-5), "{weight:?}");
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        let bad = |mtl: ObjMaterial| from_mtl(&ObjMaterial { name: "m".into(), ..mtl }).err().unwrap();
        let none = ObjMaterial::default;
        assert!(bad(ObjMaterial { diffuse: Some([0.0, 1.5, 0.0]), ..none() }).contains("\"m\": Kd"));
        assert!(bad(ObjMaterial { specular: Some([f32::NAN; 3]), ..none() }).contains("Ks"));
        assert!(bad(ObjMaterial { emissive: Some([-1.0; 3]), ..none() }).contains("Ke"));
        assert!(bad(ObjMaterial { shininess: Some(f32::INFINITY), ..none() }).contains("Ns"));
    }
}
