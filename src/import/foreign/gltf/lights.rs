//! Lights of `KHR_lights_punctual`.

use super::GltfSource;
use super::extensions::{Light, LightIndex, LightKind, Lights, of_root};
use super::nodes::{Pose, Tree, label};
use crate::desc::{DirectionalLightDesc, LightDesc, PointLightDesc, SpotLightDesc};
use crate::error::Result;
use crate::import::Draft;
use crate::math::{DAffine3, DVec3};

const NAME: &str = "KHR_lights_punctual";

/// Adds the lights of the scene's nodes; whether there are any.
pub fn add(source: GltfSource, tree: &Tree, pose: &Pose, draft: &mut Draft) -> Result<bool> {
    let lights: Lights = source.extension("", of_root(source.root), NAME)?.unwrap_or_default();
    let mut found = false;
    for &i in &tree.shown {
        let Some(node) = source.root.nodes.get(i) else { continue };
        let path = format!("nodes[{i}]");
        let extensions = node.extensions.as_ref().map(|extensions| &extensions.others);
        let Some(index) = source.extension::<LightIndex>(&path, extensions, NAME)? else { continue };
        let light = lights.lights.get(index.light);
        let light = light
            .ok_or_else(|| source.fault(&format!("{path}.extensions.{NAME}"), format!("no light {}", index.light)))?;
        if !found {
            let how =
                "1 candela is taken for 1 W/sr, 1 lux for 1 W/m², and 1 nit of what surfaces emit for 1 W/(sr m²)";
            draft.approximated("extensions", NAME, "units", how);
        }
        found = true;
        let element = match &light.name {
            Some(name) => format!("light \"{name}\""),
            None => format!("light of {}", label(node, i)),
        };
        let desc = desc(source, &path, light, &pose.world[i])?;
        draft.mapped(&path, &element, "intensity");
        if light.range.is_some() {
            draft.ignored(&path, &element, "range", "light falls with the square of the distance and nothing else");
        }
        if matches!(desc, LightDesc::Spot(_)) {
            draft.approximated(&path, &element, "spot", "the fall between the cones has a slightly different shape");
        }
        draft.add_light(&path, desc);
    }
    Ok(found)
}

fn desc(source: GltfSource, path: &str, light: &Light, world: &DAffine3) -> Result<LightDesc> {
    let intensity = light.color.map(|c| c * light.intensity);
    if !intensity.iter().all(|i| i.is_finite() && *i >= 0.0) {
        return Err(source.fault(path, "the light's intensity is not finite, or negative"));
    }
    let position = world.translation.to_array();
    let direction = world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
    Ok(match light.kind {
        LightKind::Point => LightDesc::Point(PointLightDesc { position, intensity, group: None }),
        LightKind::Directional => LightDesc::Directional(DirectionalLightDesc {
            direction: direction.to_array(),
            irradiance: intensity,
            angular_diameter_degrees: 0.0,
            group: None,
        }),
        LightKind::Spot => {
            let spot = light.spot.clone().unwrap_or_default();
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            if !(outer > 0.0 && outer <= std::f64::consts::PI && inner >= 0.0 && inner <= outer) {
                return Err(
                    source.fault(path, format!("a spot light cannot have cones of {inner} and {outer} radians"))
                );
            }
            LightDesc::Spot(SpotLightDesc {
                position,
                look_at: (world.translation + direction * world.translation.length().max(1.0)).to_array(),
                intensity,
                cutoff_angle_degrees: outer.to_degrees(),
                beam_angle_degrees: Some(inner.to_degrees()),
                texture: None,
                up: None,
                group: None,
            })
        }
    })
}
