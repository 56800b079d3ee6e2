//! Lights that are no shapes.

use super::colors::{Colors, Meaning};
use super::octahedral;
use super::params::Params;
use super::state::{Ctm, World, matrix, rotation_and_scale};
use super::textures::bilinear_image;
use crate::assets::{RgbImage, read_image, read_rgb_image};
use crate::desc::{
    ColorSpaceDesc, DirectionalLightDesc, EnvironmentLightDesc, IesLightDesc, LightDesc, PointLightDesc,
    ProjectorLightDesc, SpotLightDesc, WrapDesc,
};
use crate::error::Result;
use crate::import::foreign::Draft;
use crate::import::foreign::recolor::linear_pixels;
use crate::math::{DAffine3, DMat3, DVec3};

/// Reads a `LightSource`. pbrt divides each light by what its spectrum measures in nits, and the film takes a nit as 1.
pub struct Lights<'a> {
    /// How colours are read.
    pub colors: Colors<'a>,
    /// The map from pbrt's world to Steradian's.
    pub world: World,
    /// The film's.
    pub exposure: f64,
    /// The scene file.
    pub scene: &'a std::path::Path,
}

impl Lights<'_> {
    /// A spot light from one point towards another.
    fn spot(&self, params: &Params, from: DVec3, to: DVec3) -> Result<LightDesc> {
        let (outer, delta) = (params.positive_or("coneangle", 30.0)?, params.number_or("conedeltaangle", 5.0)?);
        let (cutoff, beam) = (outer.min(180.0), (outer - delta).clamp(0.0, outer.min(180.0)));
        params.approximate("conedeltaangle", "the fall is even with the angle, not smooth with its cosine");
        let [cos_outer, cos_beam] = [cutoff, beam].map(|angle| angle.to_radians().cos());
        let whole = 2.0 * std::f64::consts::PI * ((1.0 - cos_beam) + (cos_beam - cos_outer) / 2.0);
        Ok(LightDesc::Spot(SpotLightDesc {
            position: from.to_array(),
            look_at: to.to_array(),
            intensity: self.emitted(params, "I", whole)?,
            cutoff_angle_degrees: cutoff,
            beam_angle_degrees: Some(beam),
            texture: None,
            up: None,
            group: None,
        }))
    }

    /// Adds a light.
    pub fn add(&self, draft: &mut Draft, kind: &str, params: &Params, ctm: &Ctm) -> Result<()> {
        if ctm.is_moving() {
            draft.approximated(&params.place, &params.element, "transform", "stands still where it is at first");
        }
        let map = self.world.mirror() * ctm.0[0];
        let point = |name: &str, default: [f64; 3]| -> Result<DVec3> {
            Ok(map.transform_point3(DVec3::from(params.array(name)?.unwrap_or(default))))
        };
        let light = match kind {
            "point" => {
                let intensity = self.emitted(params, "I", 4.0 * std::f64::consts::PI)?;
                LightDesc::Point(PointLightDesc {
                    position: point("from", [0.0; 3])?.to_array(),
                    intensity,
                    group: None,
                })
            }
            "goniometric" => self.goniometric(draft, params, &map)?,
            "spot" => self.spot(params, point("from", [0.0; 3])?, point("to", [0.0, 0.0, 1.0])?)?,
            "distant" => {
                let direction = point("to", [0.0, 0.0, 1.0])? - point("from", [0.0; 3])?;
                let mut scale = params.number_or("scale", 1.0)? * self.exposure;
                scale *= params.number("illuminance")?.filter(|lux| *lux > 0.0).unwrap_or(1.0);
                let color = self.colors.get(params, "L", Meaning::Emission)?.unwrap_or([1.0; 3]);
                let irradiance = color.map(|x| x * scale.max(0.0) as f32);
                LightDesc::Directional(DirectionalLightDesc {
                    direction: direction.to_array(),
                    irradiance,
                    angular_diameter_degrees: 0.0,
                    group: None,
                })
            }
            "infinite" => LightDesc::Environment(self.environment(draft, params, &map.matrix3)?),
            "projection" => self.projection(draft, params, &map)?,
            other => return Err(params.error(format!("unknown light \"{other}\""))),
        };
        params.report(draft);
        draft.add_light(&params.place, light);
        Ok(())
    }

    /// A point light whose intensity is an image by direction.
    fn goniometric(&self, draft: &mut Draft, params: &Params, map: &DAffine3) -> Result<LightDesc> {
        let (position, whole) = (map.translation.to_array(), 4.0 * std::f64::consts::PI);
        let Some(file) = params.string("filename")? else {
            let intensity = self.emitted(params, "I", whole)?;
            return Ok(LightDesc::Point(PointLightDesc { position, intensity, group: None }));
        };
        let asset = self.colors.folder.join(file);
        let image = read_image(&asset)
            .map_err(|error| error.at(self.scene, &format!("{}: {}", params.place, params.element), &asset))?;
        let pixels = linear_pixels(&image, true).collect();
        let image = RgbImage { width: image.width, height: image.height, pixels };
        if image.width != image.height {
            return Err(params.error("the image of a goniometric light must be square: an equal-area map"));
        }
        if rotation_and_scale(&map.matrix3).is_none() {
            return Err(params.error("the transform is singular"));
        }
        let sum: f64 = image.pixels.iter().map(|pixel| f64::from(octahedral::mean(*pixel))).sum();
        let mean = if sum > 0.0 { sum / image.pixels.len() as f64 } else { 1.0 };
        let light_from_world = map.matrix3.inverse();
        // The image's z is the light's y.
        let profile = octahedral::profile(&image, |direction| {
            let local = light_from_world * direction;
            DVec3::new(local.x, local.z, local.y)
        });
        params.approximate("filename", "interpolated between directions");
        let name = std::path::Path::new(file).file_stem().map_or_else(|| "light".into(), |stem| stem.to_string_lossy());
        Ok(LightDesc::Ies(IesLightDesc {
            file: draft.keep_profile(&name, profile),
            position,
            look_at: None,
            rotation_degrees: 0.0,
            intensity: self.emitted(params, "I", whole * mean)?,
            group: None,
        }))
    }

    /// A projector, whose shorter side has the angle `fov`.
    fn projection(&self, draft: &mut Draft, params: &Params, map: &DAffine3) -> Result<LightDesc> {
        let Some(file) = params.string("filename")? else { return Err(params.error("needs a filename")) };
        let asset = self.colors.folder.join(file);
        let image = read_image(&asset)
            .map_err(|error| error.at(self.scene, &format!("{}: {}", params.place, params.element), &asset))?;
        let aspect = image.width as f64 / image.height as f64;
        let half = (params.number_or("fov", 90.0)?.clamp(0.01, 179.0).to_radians() / 2.0).tan();
        let how = "even irradiance of a plane in place of even intensity: brighter away from the middle";
        draft.approximated(&params.place, &params.element, "", how);
        params.ignore("power", "the picture has the scale of the file");
        if map.matrix3.determinant() > 0.0 {
            draft.approximated(&params.place, &params.element, "transform", "the picture is not mirrored");
        }
        let scale = params.number_or("scale", 1.0)? * self.exposure;
        let texture = bilinear_image(file, ColorSpaceDesc::Auto, WrapDesc::default());
        Ok(LightDesc::Projector(ProjectorLightDesc {
            position: map.translation.to_array(),
            look_at: (map.translation + map.matrix3.z_axis.normalize_or_zero()).to_array(),
            up: Some(map.matrix3.y_axis.to_array()),
            texture: Some(draft.add_texture("projection", &params.place, texture)),
            irradiance: [scale.max(0.0) as f32; 3],
            vertical_fov_degrees: 2.0 * (half / aspect.min(1.0)).atan().to_degrees(),
            aspect: Some(aspect),
            group: None,
        }))
    }

    /// The intensity of a light that gives `whole` of power for each unit of it.
    fn emitted(&self, params: &Params, name: &str, whole: f64) -> Result<[f32; 3]> {
        let color = self.colors.get(params, name, Meaning::Emission)?.unwrap_or([1.0; 3]);
        let mut scale = params.number_or("scale", 1.0)? * self.exposure;
        if let Some(power) = params.number("power")?.filter(|power| *power > 0.0) {
            scale *= power / whole;
        }
        Ok(color.map(|x| x * scale.max(0.0) as f32))
    }

    fn environment(&self, draft: &mut Draft, params: &Params, map: &DMat3) -> Result<EnvironmentLightDesc> {
        let mut scale = params.number_or("scale", 1.0)? * self.exposure;
        let lux = params.number("illuminance")?.filter(|lux| *lux > 0.0);
        params.ignore("portal", "it changes the noise only");
        let mut light = EnvironmentLightDesc { radiance: None, file: None, scale: 1.0, transform: None, group: None };
        let Some(file) = params.string("filename")? else {
            let color = self.colors.get(params, "L", Meaning::Emission)?.unwrap_or([1.0; 3]);
            scale *= lux.map_or(1.0, |lux| lux / std::f64::consts::PI);
            light.radiance = Some(color.map(|x| x * scale.max(0.0) as f32));
            return Ok(light);
        };
        let asset = self.colors.folder.join(file);
        let image = read_rgb_image(&asset)
            .map_err(|error| error.at(self.scene, &format!("{}: {}", params.place, params.element), &asset))?;
        if let Some(lux) = lux {
            let found = octahedral::illuminance(&image);
            scale *= if found > 0.0 { lux / found } else { 1.0 };
        }
        let Some((rotation, _)) = rotation_and_scale(map) else {
            return Err(params.error("the transform is singular"));
        };
        // A mirror goes into the image: environments are rotated only.
        let mirrored = rotation.determinant() < 0.0;
        let pbrt_from_ours = DMat3::from_cols(
            octahedral::pbrt_from_ours(DVec3::X, mirrored),
            octahedral::pbrt_from_ours(DVec3::Y, mirrored),
            octahedral::pbrt_from_ours(DVec3::Z, mirrored),
        );
        let sky = self.lat_long(params, &image, mirrored);
        let name = std::path::Path::new(file).file_stem().map_or_else(|| "sky".into(), |stem| stem.to_string_lossy());
        light.file = Some(draft.keep_environment(&name, sky));
        light.scale = scale.max(0.0) as f32;
        light.transform = Some(matrix(&DAffine3::from_mat3(rotation * pbrt_from_ours)));
        Ok(light)
    }

    fn lat_long(&self, params: &Params, image: &RgbImage, mirrored: bool) -> RgbImage {
        if image.width != 2 * image.height {
            if image.width != image.height {
                params.approximate("filename", "not square: taken as if it were");
            }
            return octahedral::lat_long(image, mirrored);
        }
        // Not pbrt-v4's: as its forerunner has it, columns are the angle from x towards y.
        params.approximate("filename", "a lat-long image with z up");
        let (width, height) = (image.width, image.height);
        let pixel = |i: usize| {
            let d = octahedral::pbrt_from_ours(
                octahedral::direction(((i % width) as f64 + 0.5) / width as f64, 0.5),
                mirrored,
            );
            let share = (d.y.atan2(d.x) / std::f64::consts::TAU).rem_euclid(1.0);
            let column = ((share * width as f64) as usize).min(width - 1);
            image.pixels.get((i / width) * width + column).copied().unwrap_or_default()
        };
        RgbImage { width, height, pixels: (0..width * height).map(pixel).collect() }
    }
}
