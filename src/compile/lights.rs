//! Lights that are not shapes, and groups of lights.

use std::sync::Arc;

use super::CompileContext;
use super::textures::TextureTable;
use crate::assets::{AssetError, read_ies, read_rgb_image};
use crate::color::Rgb;
use crate::desc::{EnvironmentLightDesc, IesLightDesc, LightDesc, LightSamplerDesc, ProjectorLightDesc};
use crate::error::Result;
use crate::geometry::Geometry;
use crate::id::{LightGroupId, LightId};
use crate::light::{
    DirectionalLight, Environment, EnvironmentMap, IesLight, IesProfile, Light, LightGroups, LightSelection, LightSet,
    PointLight, Projector, SpotLight, TextureProjection,
};
use crate::math::{DAffine3, DMat3, DVec3, RenderSpace, Vec2};
use crate::texture::Texture;

/// The most letters of a group's name: names of channels have at most 255 in OpenEXR, of which `light_` and the channel
/// take some.
const MOST_LETTERS: usize = 240;

/// The lights of a scene, with how one is chosen.
pub fn light_set(lights: Vec<Light>, geometry: &Geometry, sampler: LightSamplerDesc) -> LightSet {
    match sampler {
        LightSamplerDesc::Tree => LightSet::new(lights, geometry),
        LightSamplerDesc::Power => LightSet::with_selection(lights, geometry, LightSelection::Power),
    }
}

/// All lights so far, with their groups.
#[derive(Default)]
pub struct LightTable {
    pub lights: Vec<Light>,
    /// By light.
    groups: Vec<Option<LightGroupId>>,
    names: Vec<String>,
}

impl LightTable {
    /// The id of a group's name; a new one if it is new.
    pub fn group(&mut self, files: &CompileContext, path: &str, name: Option<&str>) -> Result<Option<LightGroupId>> {
        let Some(name) = name.filter(|name| *name != LightGroups::OF_THE_REST) else { return Ok(None) };
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            let message =
                format!("\"{name}\" must be made of letters, digits and underscores: it becomes the name of a layer");
            return Err(files.error(&format!("{path}.group"), message));
        }
        if name.len() > MOST_LETTERS {
            let message = format!(
                "\"{:.20}...\" has {} letters: at most {MOST_LETTERS} make the name of a layer",
                name,
                name.len()
            );
            return Err(files.error(&format!("{path}.group"), message));
        }
        let index = self.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.names.push(name.into());
            self.names.len() - 1
        });
        Ok(Some(LightGroupId::new(index)))
    }

    /// Adds lights of one group; the id of the first.
    pub fn add(&mut self, lights: impl IntoIterator<Item = Light>, group: Option<LightGroupId>) -> LightId {
        let first = LightId::new(self.lights.len());
        self.lights.extend(lights);
        self.groups.resize(self.lights.len(), group);
        first
    }

    /// The groups of all lights.
    pub fn groups(&mut self) -> LightGroups {
        LightGroups::new(std::mem::take(&mut self.names), self.groups.iter().copied())
    }
}

/// One entry of `lights`, placed into `space`.
pub fn compile(
    files: &CompileContext,
    path: &str,
    desc: &LightDesc,
    space: &RenderSpace,
    textures: &TextureTable,
) -> Result<Light> {
    let at = |key: &str| format!("{path}.{key}");
    Ok(match desc {
        LightDesc::Point(light) => Light::Point(PointLight {
            position: files.placed(&at("position"), light.position, space)?,
            intensity: files.intensity(&at("intensity"), light.intensity, space)?,
        }),
        LightDesc::Spot(light) => {
            let position = files.placed(&at("position"), light.position, space)?;
            let toward =
                files.position(&at("look_at"), light.look_at)? - files.position(&at("position"), light.position)?;
            let axis =
                toward.try_normalize().ok_or_else(|| files.error(&at("look_at"), "is the light's own position"))?;
            let cutoff = light.cutoff_angle_degrees;
            if !(cutoff > 0.0 && cutoff <= 180.0) {
                return Err(
                    files.error(&at("cutoff_angle_degrees"), format!("must be above 0 and at most 180, not {cutoff}"))
                );
            }
            let beam = light.beam_angle_degrees.unwrap_or(0.75 * cutoff);
            let beam = files.within(&at("beam_angle_degrees"), beam, 0.0, cutoff)?;
            let intensity = files.intensity(&at("intensity"), light.intensity, space)?;
            let spot = SpotLight::new(position, axis, intensity, beam.to_radians(), cutoff.to_radians());
            let Some(name) = &light.texture else { return Ok(Light::Spot(Box::new(spot))) };
            if cutoff >= 90.0 {
                return Err(
                    files.error(&at("cutoff_angle_degrees"), format!("must be below 90 with a texture, not {cutoff}"))
                );
            }
            let texture = textures.of_light(files, &at("texture"), name, intensity)?;
            let half = Vec2::splat(cutoff.to_radians().tan() as f32);
            let projection = TextureProjection::new(Some(texture), axis, files.up(&at("up"), light.up, axis)?, half);
            Light::Spot(Box::new(spot.with_texture(projection, &textures.textures)))
        }
        LightDesc::Projector(light) => Light::Projector(Box::new(projector(files, path, light, space, textures)?)),
        LightDesc::Ies(light) => Light::Ies(Box::new(ies(files, path, light, space)?)),
        LightDesc::Directional(light) => {
            let direction = files.direction(&at("direction"), light.direction)?;
            let irradiance = files.emitted(&at("irradiance"), light.irradiance)?.into();
            let diameter = light.angular_diameter_degrees;
            if !(0.0..180.0).contains(&diameter) {
                return Err(files
                    .error(&at("angular_diameter_degrees"), format!("must be from 0 to below 180, not {diameter}")));
            }
            Light::Directional(Box::new(DirectionalLight::new(direction, irradiance, diameter.to_radians())))
        }
        LightDesc::Environment(light) => Light::Environment(environment(files, path, light)?),
    })
}

impl CompileContext {
    /// A point of the world, placed into `space`.
    fn placed(&self, path: &str, value: [f64; 3], space: &RenderSpace) -> Result<DVec3> {
        let world = self.position(path, value)?;
        self.reachable(path, world, space)?;
        Ok(space.point(world))
    }

    /// A direction that is up across an axis.
    fn up(&self, path: &str, given: Option<[f64; 3]>, axis: DVec3) -> Result<DVec3> {
        let is_across = |up: DVec3| up.cross(axis).length() > 1e-6;
        let Some(given) = given else { return Ok(if is_across(DVec3::Y) { DVec3::Y } else { DVec3::NEG_Z }) };
        let up = self.direction(path, given)?;
        if is_across(up) { Ok(up) } else { Err(self.error(path, "is the direction of the light's axis")) }
    }

    /// Radiant intensity, which grows with the square of lengths.
    fn intensity(&self, path: &str, value: [f32; 3], space: &RenderSpace) -> Result<Rgb> {
        let scale = space.scale() * space.scale();
        let scaled = self.emitted(path, value)?.map(|channel| (f64::from(channel) * scale) as f32);
        if scaled.iter().zip(value).any(|(&scaled, given)| !scaled.is_finite() || (given > 0.0 && !scaled.is_normal()))
        {
            return Err(self.error(path, format!("{value:?} is out of all proportion to a scene of this size")));
        }
        Ok(scaled.into())
    }
}

fn projector(
    files: &CompileContext,
    path: &str,
    desc: &ProjectorLightDesc,
    space: &RenderSpace,
    textures: &TextureTable,
) -> Result<Projector> {
    let at = |key: &str| format!("{path}.{key}");
    let position = files.placed(&at("position"), desc.position, space)?;
    let toward = files.position(&at("look_at"), desc.look_at)? - files.position(&at("position"), desc.position)?;
    let axis = toward.try_normalize().ok_or_else(|| files.error(&at("look_at"), "is the light's own position"))?;
    let irradiance = files.intensity(&at("irradiance"), desc.irradiance, space)?;
    let fov = desc.vertical_fov_degrees;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(files.error(&at("vertical_fov_degrees"), format!("must be above 0 and below 180, not {fov}")));
    }
    let texture =
        desc.texture.as_ref().map(|name| textures.of_light(files, &at("texture"), name, irradiance)).transpose()?;
    let of_image = match texture.map(|id| textures.get(id)) {
        Some(Texture::Bitmap(bitmap)) => bitmap.image.width() as f64 / bitmap.image.height() as f64,
        _ => 1.0,
    };
    let aspect = desc.aspect.unwrap_or(of_image);
    let half = (0.5 * fov.to_radians()).tan();
    let half = Vec2::new((half * aspect) as f32, half as f32);
    if !(aspect > 0.0 && half.min_element() > 0.0 && half.is_finite()) {
        return Err(
            files.error(&at("aspect"), format!("must be above 0 and of a picture that can be thrown, not {aspect}"))
        );
    }
    let projection = TextureProjection::new(texture, axis, files.up(&at("up"), desc.up, axis)?, half);
    Ok(Projector::new(position, irradiance, projection, &textures.textures))
}

fn ies(files: &CompileContext, path: &str, desc: &IesLightDesc, space: &RenderSpace) -> Result<IesLight> {
    let at = format!("{path}.position");
    let (world, position) = (files.position(&at, desc.position)?, files.placed(&at, desc.position, space)?);
    let nadir = match desc.look_at {
        None => -DVec3::Y,
        Some(target) => {
            let place = format!("{path}.look_at");
            let toward = files.position(&place, target)? - world;
            toward.try_normalize().ok_or_else(|| files.error(&place, "is the light's own position"))?
        }
    };
    if !desc.rotation_degrees.is_finite() {
        return Err(files.error(&format!("{path}.rotation_degrees"), "the angle is not finite"));
    }
    let intensity = files.intensity(&format!("{path}.intensity"), desc.intensity, space)?;
    let place = format!("{path}.file");
    let asset = files.source.asset(&desc.file);
    let data = match files.source.assets.profiles.get(&desc.file) {
        Some(profile) => profile.clone(),
        None => read_ies(&asset).map_err(|e| files.asset_error(&place, &asset, e))?,
    };
    let profile = IesProfile::new(data.vertical, data.horizontal, data.candela);
    let profile = profile
        .ok_or_else(|| files.asset_error(&place, &asset, AssetError::Malformed("no table of intensities".into())))?;
    Ok(IesLight::new(position, nadir, desc.rotation_degrees.to_radians(), intensity, Arc::new(profile)))
}

fn environment(files: &CompileContext, path: &str, desc: &EnvironmentLightDesc) -> Result<Environment> {
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
        (Some(radiance), None) => {
            let place = format!("{path}.radiance");
            let radiance = Rgb::from(files.emitted(&place, *radiance)?) * scale;
            Ok(Environment::Constant(files.emitted(&place, radiance.to_array())?.into()))
        }
        (None, Some(file)) => {
            let place = format!("{path}.file");
            let asset = files.source.asset(file);
            let image = match files.source.assets.environments.get(file) {
                Some(image) => image.clone(),
                None => read_rgb_image(&asset).map_err(|e| files.asset_error(&place, &asset, e))?,
            };
            let brightest = image.pixels.as_flattened().iter().copied().fold(0.0, f32::max);
            files.emitted(&place, [brightest * scale; 3])?;
            let pixels = image.pixels.into_iter().map(Rgb::from).collect();
            let map = EnvironmentMap::new(image.width, image.height, pixels, rotation, scale);
            let map = map.map_err(|e| files.asset_error(&place, &asset, AssetError::Malformed(e.to_string())))?;
            Ok(Environment::Map(Box::new(map)))
        }
        _ => Err(files.error(path, "give either `radiance` or `file`")),
    }
}
