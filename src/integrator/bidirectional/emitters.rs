//! The lights where light paths start.

use crate::id::LightId;
use crate::light::{EmittedRay, Light};
use crate::math::Vec3;
use crate::sampling::AliasTable;
use crate::scene::Scene;

/// Lights that light paths start from, chosen by power: emissive surfaces without textures.
#[derive(Clone, Debug)]
pub struct Emitters {
    table: AliasTable,
}

impl Emitters {
    /// Those of a scene, if it has any.
    pub fn new(scene: &Scene) -> Option<Self> {
        let power = |light: &Light| match light {
            Light::Area(light) => {
                let starts = light.emitted_pdf_per_cos(&scene.geometry, Vec3::Z).is_some();
                Some(light.power()).filter(|power| starts && power.is_finite()).unwrap_or(0.0)
            }
            _ => 0.0,
        };
        let powers: Vec<f64> = scene.lights.lights().iter().map(power).collect();
        Some(Self { table: AliasTable::new(&powers)? })
    }

    /// A light and a ray that leaves it, with its density per area and solid angle over the cosine of the ray and the
    /// normal.
    pub fn sample(&self, scene: &Scene, choice: f32, u: [f32; 2], v: [f32; 2]) -> Option<(LightId, EmittedRay)> {
        let index = self.table.sample(choice).index;
        let Light::Area(light) = scene.lights.get(LightId::new(index)) else { return None };
        let ray = light.sample_emitted(&scene.geometry, u, v)?;
        let pmf = self.table.pmf(index);
        let ray = EmittedRay { pdf_per_cos: ray.pdf_per_cos * pmf, ..ray };
        Some((LightId::new(index), ray))
    }

    /// The density of [`sample`](Self::sample) at a point with the unit normal `n`; 0 where no light path starts.
    #[inline]
    pub fn pdf_per_cos(&self, scene: &Scene, id: LightId, n: Vec3) -> f32 {
        match scene.lights.get(id) {
            Light::Area(light) => {
                light.emitted_pdf_per_cos(&scene.geometry, n).map_or(0.0, |pdf| pdf * self.table.pmf(id.index()))
            }
            _ => 0.0,
        }
    }
}
