//! Volumes of heterogeneous media.

use super::Reader;
use super::element::Element;
use super::shapes::steps;
use super::tree::PluginId;
use crate::assets::{AssetError, VolHeader, read_vol_header};
use crate::desc::{BorderDesc, MediumVolumeDesc, VolumeDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};

/// A grid with the box that it fills.
struct Grid {
    desc: VolumeDesc,
    channels: u32,
    world_from_unit: DAffine3,
}

/// What differs within a medium, and which of its parameters that replaces.
pub(super) struct Grids {
    pub volume: MediumVolumeDesc,
    pub has_extinction: bool,
    pub has_albedo: bool,
}

impl<'a> Reader<'a> {
    /// The grids of a heterogeneous medium; `None` if it has none.
    pub(super) fn grids(&mut self, element: &mut Element<'a>) -> Result<Option<Grids>> {
        let (extinction, albedo) = (self.grid(element, "sigma_t")?, self.grid(element, "albedo")?);
        let Some(map) = extinction.as_ref().or(albedo.as_ref()).map(|grid| grid.world_from_unit) else {
            return Ok(None);
        };
        if extinction.is_some() && albedo.as_ref().is_some_and(|albedo| albedo.world_from_unit != map) {
            element.approximated("albedo", "fills the box of sigma_t");
        }
        let mut grids = Grids {
            volume: MediumVolumeDesc { transform: steps(&map), ..MediumVolumeDesc::default() },
            has_extinction: extinction.is_some(),
            has_albedo: false,
        };
        match extinction {
            Some(Grid { desc, channels: 3, .. }) => {
                (grids.volume.absorption, grids.volume.scattering) = (Some(desc.clone()), Some(desc));
                if albedo.is_some() {
                    element.ignored("albedo", "a grid beside a sigma_t of colours is not supported: 0.75");
                }
                return Ok(Some(grids));
            }
            extinction => grids.volume.density = extinction.map(|grid| grid.desc),
        }
        grids.has_albedo = albedo.is_some();
        grids.volume.albedo = albedo.map(|grid| grid.desc);
        Ok(Some(grids))
    }

    /// The grid that is a parameter of a medium.
    fn grid(&mut self, element: &mut Element<'a>, name: &str) -> Result<Option<Grid>> {
        let Some(property) = element.plugin.properties.iter().find(|property| property.name == name) else {
            return Ok(None);
        };
        let is_grid = |id: &PluginId| {
            let plugin = &self.document.plugins[id.0];
            plugin.class == "volume" && plugin.kind == "gridvolume"
        };
        let Some(id) = self.document.plugin_of(property)?.filter(is_grid) else { return Ok(None) };
        element.take(name);
        let mut volume = Element::new(self.document, id);
        let file = volume.file("filename", self.scene)?;
        let file = file.ok_or_else(|| volume.place().error("a gridvolume needs \"filename\""))?;
        let path = self.scene.parent().unwrap_or(std::path::Path::new("")).join(&file);
        let VolHeader { channels, bounds, .. } = match read_vol_header(&path) {
            // An error when the scene is compiled, unless the medium is left out.
            Err(AssetError::Missing { .. }) => {
                VolHeader { resolution: [1; 3], channels: 1, bounds: [[0.0; 3], [1.0; 3]] }
            }
            header => header.map_err(|e| e.at(self.scene, &volume.place_of("filename").to_string(), &path))?,
        };
        let mut map = volume.transform("to_world")?;
        if volume.boolean("use_grid_bbox", false)? {
            let [min, max] = bounds.map(|corner| DVec3::from(corner.map(f64::from)));
            map *= DAffine3 { matrix3: DMat3::from_diagonal(max - min), translation: min };
        }
        // Numbers of voxels are linear.
        volume.boolean("raw", false)?;
        volume.boolean("accel", true)?;
        if volume.text("filter_type")?.is_some_and(|filter| filter != "trilinear") {
            volume.approximated("filter_type", "trilinear");
        }
        if volume.text("wrap_mode")?.is_some_and(|mode| mode != "clamp") {
            volume.approximated("wrap_mode", "clamp");
        }
        volume.finish(&mut self.draft);
        let desc = VolumeDesc::of_file(file, BorderDesc::Clamp);
        Ok(Some(Grid { desc, channels, world_from_unit: map }))
    }
}
