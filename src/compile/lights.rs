//! Lights that are not shapes.

use super::Files;
use crate::color::Rgb;
use crate::desc::{EnvironmentLightDesc, LightDesc};
use crate::error::Result;
use crate::import::{AssetError, read_rgb_image};
use crate::light::{DirectionalLight, Environment, EnvironmentMap, Light, PointLight, SpotLight};
use crate::math::{DAffine3, DMat3};

/// One entry of `lights`.
pub fn compile(files: &Files, path: &str, desc: &LightDesc) -> Result<Light> {
    let at = |key: &str| format!("{path}.{key}");
    Ok(match desc {
        LightDesc::Point(light) => Light::Point(PointLight {
            position: files.vector(&at("position"), light.position)?,
            intensity: files.emitted(&at("intensity"), light.intensity)?.into(),
        }),
        LightDesc::Spot(light) => {
            let position = files.vector(&at("position"), light.position)?;
            let toward = files.vector(&at("look_at"), light.look_at)? - position;
            let axis = toward.try_normalize().ok_or_else(|| files.error(&at("look_at"), "is the light's own position"))?;
            let cutoff = light.cutoff_angle_degrees;
            if !(cutoff > 0.0 && cutoff <= 180.0) {
                return Err(files.error(&at("cutoff_angle_degrees"), format!("must be above 0 and at most 180, not {cutoff}")));
            }
            let beam = light.beam_angle_degrees.unwrap_or(0.75 * cutoff);
            let beam = files.within(&at("beam_angle_degrees"), beam, 0.0, cutoff)?;
            let intensity = files.emitted(&at("intensity"), light.intensity)?.into();
            Light::Spot(SpotLight::new(position, axis, intensity, beam.to_radians(), cutoff.to_radians()))
        }
        LightDesc::Directional(light) => {
            let direction = files.direction(&at("direction"), light.direction)?;
            let irradiance = files.emitted(&at("irradiance"), light.irradiance)?.into();
            let diameter = light.angular_diameter_degrees;
            if !(0.0..180.0).contains(&diameter) {
                return Err(files.error(&at("angular_diameter_degrees"), format!("must be from 0 to below 180, not {diameter}")));
            }
            Light::Directional(DirectionalLight::new(direction, irradiance, diameter.to_radians()))
        }
        LightDesc::Environment(light) => Light::Environment(environment(files, path, light)?),
    })
}

fn environment(files: &Files, path: &str, desc: &EnvironmentLightDesc) -> Result<Environment> {
    let scale = files.emitted(&format!("{path}.scale"), [desc.scale; 3])?[0];
    let rotation = match &desc.transform {
        None => DMat3::IDENTITY,
        Some(transform) => {
            let place = format!("{path}.transform");
            let map = files.transform(&place, transform, &DAffine3::IDENTITY)?;
            let is_rotation = map.uniform_scale().is_some_and(|s| (s - 1.0).abs() < 1e-9) && !map.swaps_handedness();
            if !is_rotation {
                return Err(files.error(&place, "an environment can only be rotated"));
            }
            map.world_from_object.matrix3
        }
    };
    match (&desc.radiance, &desc.file) {
        (Some(radiance), None) => Ok(Environment::Constant(Rgb::from(files.emitted(&format!("{path}.radiance"), *radiance)?) * scale)),
        (None, Some(file)) => {
            let place = format!("{path}.file");
            let asset = files.asset(file);
            let image = read_rgb_image(&asset).map_err(|e| files.asset_error(&place, &asset, e))?;
            let pixels = image.pixels.into_iter().map(Rgb::from).collect();
            let map = EnvironmentMap::new(image.width, image.height, pixels, rotation, scale);
            let map = map.map_err(|e| files.asset_error(&place, &asset, AssetError::Malformed(e.to_string())))?;
            Ok(Environment::Map(Box::new(map)))
        }
        _ => Err(files.error(path, "give either `radiance` or `file`")),
    }
}
