//! Materials of OBJ files with their texture maps.

use std::fmt::Debug;

use super::materials::MaterialBinding;
use super::textures::TextureUse;
use super::{Builder, meshes};
use crate::assets::{ObjMap, ObjMaterial};
use crate::bsdf::{Bsdf, Conductor, Dielectric, Lambert, Mirror, Plastic};
use crate::color::Rgb;
use crate::error::Result;
use crate::id::TextureId;
use crate::light::Emission;
use crate::material::{
    AlphaInput, CoatInput, ColorInput, Facets, Material, PlasticCoat, ScalarInput, TexturedMaterial,
};
use crate::math::Vec2;
use crate::normal_perturbation::NormalPerturbation;
use crate::texture::{Bitmap, Channel, Decoding, Texture, UvTransform, Wrap};

/// What a material of an MTL comes to.
pub struct MtlBinding {
    pub binding: MaterialBinding,
    /// Light emitted, if not black.
    pub emission: Option<Emission>,
}

impl Builder {
    /// The material of the faces with a material of an OBJ file; maps need uv. `path` is the shape, `file` the OBJ.
    pub(super) fn mtl_binding(
        &mut self,
        path: &str,
        file: Option<&str>,
        mtl: &ObjMaterial,
        has_uvs: bool,
    ) -> Result<MtlBinding> {
        let maps = &mtl.maps;
        let every = [&maps.diffuse, &maps.bump, &maps.normal, &maps.opacity, &maps.specular, &maps.emission];
        let has_maps = every.iter().any(|map| map.is_some());
        if has_maps && !has_uvs {
            self.warn_of_mtl(path, mtl, "faces without uv have no maps");
        }
        let with_uvs = |map: &Option<ObjMap>| map.clone().filter(|_| has_uvs);
        let (diffuse, opacity) = (with_uvs(&maps.diffuse), with_uvs(&maps.opacity));
        let (specular, emission) = (with_uvs(&maps.specular), with_uvs(&maps.emission));

        let plain = without_blacks(mtl, [diffuse.is_some(), specular.is_some(), emission.is_some()]);
        let surface = from_mtl(&plain).map_err(|message| meshes::refusal(&self.files, path, file, message))?;

        let is_glass = matches!(surface.material, Material::Constant(Bsdf::Dielectric(_)));
        let mut material = surface.material;
        if let Some(map) = &diffuse {
            let tint = plain.diffuse.map_or(Rgb::WHITE, Rgb::from);
            material = with_albedo(material, ColorInput::Texture(self.reflectance_map(path, map, tint)?));
        }
        let mut unused: Vec<&str> = maps.unused.iter().map(String::as_str).collect();
        if let Some(map) = &specular {
            match specular_tint(&material) {
                Some(tint) => {
                    material = with_specular(material, ColorInput::Texture(self.reflectance_map(path, map, tint)?));
                }
                None => unused.push("map_Ks"),
            }
        }
        if !unused.is_empty() {
            self.warn_of_mtl(path, mtl, &format!("{} not used", unused.join(", ")));
        }
        let mut binding = MaterialBinding::plain(self.materials.push(material));
        // Glass lets through what it does not reflect.
        if !is_glass {
            binding.opacity = self.mtl_opacity(path, mtl.opacity, opacity.as_ref(), diffuse.as_ref())?;
        }
        let normal_perturbation = match (with_uvs(&maps.normal), with_uvs(&maps.bump)) {
            (Some(map), _) => Some(self.normal_or_bump_map(path, &map, true)?),
            (None, Some(map)) => Some(self.normal_or_bump_map(path, &map, false)?),
            (None, None) => None,
        };
        binding.normal_perturbation = normal_perturbation.map(|map| self.materials.push_normal_perturbation(map));
        let texture = emission.map(|map| self.emission_map(path, &map)).transpose()?;
        let emission = surface.radiance.map(|radiance| Emission { texture, ..Emission::constant(radiance) });
        Ok(MtlBinding { binding, emission })
    }

    fn warn_of_mtl(&self, path: &str, mtl: &ObjMaterial, message: &str) {
        tracing::warn!("{}: {path}: material \"{}\": {message}", self.files.source.file.display(), mtl.name);
    }

    fn map_texture(&mut self, path: &str, map: &ObjMap, texture_use: TextureUse) -> Result<Bitmap> {
        let image = self.materials.textures.image(&self.files, &format!("{path}.file"), &map.file)?;
        let decoding = if texture_use == TextureUse::Color { Decoding::Srgb } else { Decoding::Linear };
        Ok(Bitmap {
            wrap: [if map.clamp { Wrap::Clamp } else { Wrap::Repeat }; 2],
            transform: UvTransform::new(Vec2::from(map.scale), 0.0, Vec2::from(map.offset)),
            channel: map.channel.and_then(channel),
            ..Bitmap::new(image, decoding)
        })
    }

    fn emission_map(&mut self, path: &str, map: &ObjMap) -> Result<TextureId> {
        let bitmap = Bitmap { channel: None, ..self.map_texture(path, map, TextureUse::Color)? };
        let [min, _] = bitmap.range();
        if min < 0.0 {
            let message = format!("{}: goes down to {min}: light is not negative", map.file.display());
            return Err(meshes::refusal(&self.files, path, None, message));
        }
        Ok(self.materials.textures.push(Texture::Bitmap(bitmap)))
    }

    fn reflectance_map(&mut self, path: &str, map: &ObjMap, tint: Rgb) -> Result<TextureId> {
        let bitmap = Texture::Bitmap(Bitmap { channel: None, ..self.map_texture(path, map, TextureUse::Color)? });
        let texture =
            if tint == Rgb::WHITE { bitmap } else { Texture::Product([bitmap, Texture::Constant(tint)].into()) };
        let id = self.materials.textures.push(texture);
        let fault = |message| meshes::refusal(&self.files, path, None, format!("{}: {message}", map.file.display()));
        self.materials.textures.check_reflectance(id).map_err(fault)?;
        Ok(id)
    }

    /// `d` times `map_d` (the channel it names, or the image's alpha, or else its luminance), or times the alpha of
    /// `map_Kd`.
    fn mtl_opacity(
        &mut self,
        path: &str,
        d: Option<f32>,
        map: Option<&ObjMap>,
        diffuse: Option<&ObjMap>,
    ) -> Result<Option<TextureId>> {
        let bitmap = match (map, diffuse) {
            (Some(map), _) => {
                let bitmap = self.map_texture(path, map, TextureUse::Data)?;
                let channel = bitmap.channel.or(bitmap.image.has_alpha().then_some(Channel::A));
                Some(Bitmap { channel, ..bitmap })
            }
            (None, Some(map)) => {
                let bitmap = Bitmap { channel: Some(Channel::A), ..self.map_texture(path, map, TextureUse::Data)? };
                Some(bitmap).filter(|bitmap| bitmap.image.has_alpha() && bitmap.image.least_alpha() < 1.0)
            }
            (None, None) => None,
        };
        let constant = d.filter(|&d| d < 1.0).map(|d| Texture::Constant(Rgb::splat(d)));
        let texture = match (bitmap.map(Texture::Bitmap), constant) {
            // Exporters leave d at 0 where a map gives all of it.
            (Some(bitmap), Some(factor)) if d != Some(0.0) => Texture::Product([bitmap, factor].into()),
            (Some(bitmap), _) => bitmap,
            (None, Some(constant)) => constant,
            (None, None) => return Ok(None),
        };
        Ok(Some(self.materials.textures.push(texture)))
    }

    /// A normal map, which `bump` may name too: then it is one with colours.
    fn normal_or_bump_map(&mut self, path: &str, map: &ObjMap, is_normal_map: bool) -> Result<NormalPerturbation> {
        let bitmap = self.map_texture(path, map, TextureUse::Data)?;
        let holds_normals = is_normal_map || (map.channel.is_none() && !bitmap.image.is_grey());
        let bitmap = if holds_normals { Bitmap { channel: None, ..bitmap } } else { bitmap };
        let id = self.materials.textures.push(Texture::Bitmap(bitmap));
        let textures = &self.materials.textures.textures;
        Ok(if holds_normals {
            NormalPerturbation::normal_map(id, 1.0, false, textures)
        } else {
            NormalPerturbation::bump_map(id, map.height, textures)
        })
    }
}

/// The colour that a map multiplies where a material's reflection has one: of mirrors, and of metals, which have the
/// colour themselves.
fn specular_tint(material: &Material) -> Option<Rgb> {
    match material {
        Material::Constant(Bsdf::Mirror(mirror)) => Some(mirror.reflectance),
        Material::Constant(Bsdf::Conductor(_)) => Some(Rgb::WHITE),
        _ => None,
    }
}

/// The material with a texture for the colour of its reflection, where it has one.
fn with_specular(material: Material, color: ColorInput) -> Material {
    match material {
        Material::Constant(Bsdf::Mirror(_)) => TexturedMaterial::Mirror { reflectance: color }.into(),
        Material::Constant(Bsdf::Conductor(metal)) => {
            let alpha = AlphaInput { axes: metal.alpha().map(ScalarInput::Constant), squared: false };
            TexturedMaterial::Conductor { metal, tint: color, alpha, facets: Facets::Ggx }.into()
        }
        other => other,
    }
}

/// The material with a texture for its diffuse colour, where it has one.
fn with_albedo(material: Material, albedo: ColorInput) -> Material {
    match material {
        Material::Constant(Bsdf::Lambert(_)) => {
            TexturedMaterial::Diffuse { albedo, roughness: ScalarInput::Constant(0.0) }.into()
        }
        Material::Constant(Bsdf::Plastic(Plastic { coat, nonlinear, tint, .. })) => {
            let coat = PlasticCoat::Ggx(CoatInput::Constant(coat));
            TexturedMaterial::Plastic { coat, albedo, tint: ColorInput::Constant(tint), nonlinear }.into()
        }
        other => other,
    }
}

fn channel(letter: char) -> Option<Channel> {
    match letter {
        'r' => Some(Channel::R),
        'g' => Some(Channel::G),
        'b' => Some(Channel::B),
        'm' => Some(Channel::A),
        _ => None,
    }
}

/// White in place of black, or of nothing, for each of the colours Kd, Ks and Ke that has a map: exporters leave it so
/// where the map gives all of the colour.
fn without_blacks(mtl: &ObjMaterial, has_map: [bool; 3]) -> ObjMaterial {
    let mut plain = mtl.clone();
    for (color, has_map) in [&mut plain.diffuse, &mut plain.specular, &mut plain.emissive].into_iter().zip(has_map) {
        if has_map {
            *color = Some(color.filter(|color| color.iter().any(|&c| c != 0.0)).unwrap_or([1.0; 3]));
        }
    }
    plain
}

/// What an MTL makes of a surface.
struct MtlSurface {
    material: Material,
    /// Light emitted, if not black.
    radiance: Option<Rgb>,
}

/// The nearest material for an MTL: `illum` 5 is a mirror of colour Ks; 4, 6, 7 and 9 are glass of index Ni; a specular
/// colour with an exponent has alpha = sqrt(2 / (Ns + 2)) and is a metal of that colour if Kd is black, plastic
/// otherwise; everything else is diffuse with Kd.
///
/// The error names the invalid number.
fn from_mtl(mtl: &ObjMaterial) -> Result<MtlSurface, String> {
    let fault = |key: &str, value: &dyn Debug, must: &str| {
        Err(format!("material \"{}\": {key} {value:?} must be {must}", mtl.name))
    };
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
    if let Some(opacity) = mtl.opacity.filter(|d| !(0.0..=1.0).contains(d)) {
        return fault("d", &opacity, "within 0 and 1");
    }
    let diffuse = mtl.diffuse.map_or(Rgb::splat(0.5), Rgb::from);
    let specular = mtl.specular.map_or(Rgb::BLACK, Rgb::from);
    let ior = mtl.ior.filter(|&n| n > 1.0 && n <= 10.0).unwrap_or(1.5);
    let is_glass = matches!(mtl.illumination, Some(4 | 6 | 7 | 9));
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
        assert!(
            [weight.r - color.r, weight.g - color.g, weight.b - color.b].iter().all(|d| d.abs() < 1e-5),
            "{weight:?}"
        );
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        let bad = |mtl: ObjMaterial| from_mtl(&ObjMaterial { name: "m".into(), ..mtl }).err().unwrap();
        let none = ObjMaterial::default;
        assert!(bad(ObjMaterial { diffuse: Some([0.0, 1.5, 0.0]), ..none() }).contains("\"m\": Kd"));
        assert!(bad(ObjMaterial { specular: Some([f32::NAN; 3]), ..none() }).contains("Ks"));
        assert!(bad(ObjMaterial { emissive: Some([-1.0; 3]), ..none() }).contains("Ke"));
        assert!(bad(ObjMaterial { shininess: Some(f32::INFINITY), ..none() }).contains("Ns"));
        assert!(bad(ObjMaterial { opacity: Some(1.5), ..none() }).contains("\"m\": d"));
        assert!(bad(ObjMaterial { opacity: Some(f32::NAN), ..none() }).contains("\"m\": d"));
    }
}
