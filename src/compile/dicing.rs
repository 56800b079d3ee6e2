//! How long the edges of a mesh look, for subdivision by their length in pixels.

use std::collections::BTreeMap;

use crate::assets::MeshData;
use crate::camera::Camera;
use crate::math::{DAffine3, DVec3};

/// Instances of an object that count at most.
const MAX_PLACES: usize = 64;

/// The camera, and where the instances of objects with such meshes are.
pub struct Dicing {
    pub camera: Camera,
    /// Width and height of the picture.
    pub size: [u32; 2],
    pub instances: BTreeMap<String, Vec<DAffine3>>,
}

impl Dicing {
    /// Where a shape stands in the world that stands at `map` in it or in its object.
    pub fn places(&self, path: &str, map: DAffine3) -> Vec<DAffine3> {
        match path.strip_prefix("objects.").and_then(|path| path.rsplit_once(".shapes[")) {
            Some((object, _)) => self.instances.get(object).into_iter().flatten().map(|outer| *outer * map).collect(),
            None => vec![map],
        }
    }

    /// Whether an edge looks longer than `length` pixels in one of the places of a mesh: from the nearer end, face-on.
    pub fn limit(
        &self,
        length: f64,
        places: &[DAffine3],
        data: &MeshData,
    ) -> impl Fn(DVec3, DVec3) -> bool + Sync + use<'_> {
        let bounds = data.bounds();
        let center = 0.5 * (bounds.min + bounds.max);
        let scale = |place: &DAffine3| {
            let stretch = place.matrix3.determinant().abs().cbrt();
            stretch * self.camera.pixels_per_length(place.transform_point3(center), self.size)
        };
        let mut nearest: Vec<DAffine3> = places.to_vec();
        nearest.sort_by(|a, b| scale(b).total_cmp(&scale(a)));
        nearest.truncate(MAX_PLACES);
        let origin = DAffine3::from_translation(DVec3::from(data.origin));
        nearest.iter_mut().for_each(|place| *place *= origin);
        move |a, b| {
            nearest.iter().any(|place| {
                let [a, b] = [a, b].map(|p| place.transform_point3(p));
                let [at_a, at_b] = [a, b].map(|p| self.camera.pixels_per_length(p, self.size));
                // Symmetric in both ends, so that the faces at an edge agree.
                (b - a).length() * at_a.max(at_b) > length
            })
        }
    }
}
