//! Light that shapes emit.

use super::colors::{Colors, Meaning};
use super::params::Params;
use super::textures::bilinear_image;
use crate::desc::{ColorSpaceDesc, EmissionDesc, WrapDesc, WrapModeDesc};
use crate::error::Result;
use crate::import::foreign::Draft;

/// An `AreaLightSource`.
///
/// pbrt divides each light by what its spectrum measures in nits and the film takes a nit as 1, so that an `rgb L` of 1
/// is a pixel of 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AreaLight {
    radiance: [f32; 3],
    /// The name of a texture that multiplies it.
    texture: Option<String>,
    two_sided: bool,
    /// The power that each shape (each triangle of a mesh) is to have, for which the radiance is scaled.
    power: Option<f64>,
}

/// How large the shapes are that `power` is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// How many.
    pub count: usize,
    /// Their area together.
    pub area: f64,
}

impl AreaLight {
    /// Reads the directive. `exposure` is the film's.
    pub fn read(draft: &mut Draft, kind: &str, params: &Params, colors: &Colors, exposure: f64) -> Result<Self> {
        if kind != "diffuse" {
            return Err(params.error(format!("unknown area light \"{kind}\"")));
        }
        let color = colors.get(params, "L", Meaning::Emission)?.unwrap_or([1.0; 3]);
        let scale = (params.number_or("scale", 1.0)? * exposure) as f32;
        let power = params.number("power")?.filter(|power| *power > 0.0);
        let two_sided = params.bool_or("twosided", false)?;
        let texture = params.string("filename")?.map(|file| {
            let image = bilinear_image(file, ColorSpaceDesc::Srgb, WrapDesc::Both(WrapModeDesc::Clamp));
            draft.add_texture("emission", &params.place, image)
        });
        if texture.is_some() && power.is_some() {
            params.approximate("power", "as if the image were white");
        }
        params.report(draft);
        Ok(Self { radiance: color.map(|x| (x * scale).max(0.0)), texture, two_sided, power })
    }

    /// Whether it needs the areas of shapes.
    pub fn needs_extent(&self) -> bool {
        self.power.is_some()
    }

    /// Whether it needs uv.
    pub fn is_textured(&self) -> bool {
        self.texture.is_some()
    }

    /// The emission of a shape; `None` if it is dark.
    pub fn emission(&self, extent: Option<Extent>) -> Option<EmissionDesc> {
        let factor = match (self.power, extent) {
            (Some(power), Some(Extent { count, area })) if area > 0.0 => {
                let sides = if self.two_sided { 2.0 } else { 1.0 };
                power * count as f64 / (sides * std::f64::consts::PI * area)
            }
            _ => 1.0,
        };
        let radiance = self.radiance.map(|x| (f64::from(x) * factor) as f32);
        let shines = radiance.iter().any(|&x| x > 0.0);
        let texture = self.texture.clone();
        shines.then_some(EmissionDesc { radiance, texture, two_sided: self.two_sided, hidden: false, group: None })
    }
}
