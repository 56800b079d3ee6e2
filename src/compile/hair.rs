//! Hair: its parameters checked.

use super::materials::Compiler;
use crate::bsdf::{Hair, hair_absorption};
use crate::color::Rgb;
use crate::desc::HairDesc;
use crate::error::Result;
use crate::material::{HairColor, TexturedMaterial};

/// The eumelanin of hair of which nothing is said: brown.
const BROWN: f32 = 1.3;

impl Compiler<'_> {
    pub(super) fn hair(&self, path: &str, desc: &HairDesc) -> Result<TexturedMaterial> {
        let within = |key: &str, value: f32, low: f64, high: f64| {
            self.files.within(&format!("{path}.{key}"), f64::from(value), low, high).map(|value| value as f32)
        };
        let roughness = [
            within("longitudinal_roughness", desc.longitudinal_roughness.0, 0.0, 1.0)?,
            within("azimuthal_roughness", desc.azimuthal_roughness.0, 0.0, 1.0)?,
        ];
        let tilt = within("scale_tilt_degrees", desc.scale_tilt_degrees.0, -45.0, 45.0)?.to_radians();
        let ior = within("ior", desc.ior.0, 1.0, 10.0)?;
        if ior == 1.0 {
            return Err(self.files.error(&format!("{path}.ior"), "must be above 1"));
        }
        let pigments = [("eumelanin", desc.eumelanin), ("pheomelanin", desc.pheomelanin)];
        let has_pigments = pigments.iter().any(|(_, pigment)| pigment.is_some());
        let color = match (&desc.color, desc.sigma_a, has_pigments) {
            (Some(color), None, false) => HairColor::Reflectance(self.color(&format!("{path}.color"), color)?),
            (None, Some(sigma_a), false) => {
                HairColor::Absorption(Rgb::from(self.files.emitted(&format!("{path}.sigma_a"), sigma_a)?))
            }
            (None, None, true) => {
                for (key, value) in pigments {
                    within(key, value.unwrap_or(0.0), 0.0, 1e6)?;
                }
                let [eumelanin, pheomelanin] = pigments.map(|(_, pigment)| pigment.unwrap_or(0.0));
                HairColor::Absorption(hair_absorption(eumelanin, pheomelanin))
            }
            (None, None, false) => HairColor::Absorption(hair_absorption(BROWN, 0.0)),
            _ => {
                let message = "give one of `color`, `sigma_a`, or `eumelanin` and `pheomelanin`";
                return Err(self.files.error(path, message));
            }
        };
        Ok(TexturedMaterial::Hair { color, hair: Hair::new(Rgb::BLACK, ior, roughness, tilt), azimuthal: roughness[1] })
    }
}
