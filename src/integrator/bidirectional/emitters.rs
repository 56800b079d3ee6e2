//! The lights where light paths start.

use super::distant::{DistantEmitters, DistantRay};
use crate::id::LightId;
use crate::integrator::PilotRecords;
use crate::light::{EmittedRay, Light};
use crate::math::{Aabb, Vec3};
use crate::sampling::AliasTable;
use crate::scene::Scene;

/// Lights that light paths start from: emissive surfaces without textures, chosen by power, and lights at infinity,
/// whose rays are chosen by what a pilot has found of them.
#[derive(Clone, Debug)]
pub struct Emitters {
    /// By light, and then by face that rays of a light at infinity enter by.
    table: AliasTable,
    lights: usize,
    distant: Option<DistantEmitters>,
}

/// The least part of the light paths that start at surfaces, or at lights at infinity, where a scene has both.
const LEAST_SHARE: f64 = 0.1;

/// Lights at infinity start no paths where the pilot found more of their rays than this, by scattering: what they shine
/// at directly is most of the light.
const OPEN: f64 = 0.5;

impl Emitters {
    /// Whether a scene has lights that paths may start from.
    pub fn may_start(scene: &Scene) -> bool {
        Self::of_surfaces(scene).is_some() || scene.lights.lights().iter().any(Light::is_at_infinity)
    }

    /// Those of a scene, if it has any, with what a pilot has found of lights at infinity around the box `bounds`.
    pub fn new(scene: &Scene, pilot: &PilotRecords, bounds: Aabb) -> Option<Self> {
        let surfaces = Self::of_surfaces(scene);
        let lights = scene.lights.lights().len();
        let openness = pilot.distant_rays.len() as f64 / pilot.continuations.len() as f64;
        tracing::debug!("pilot of light paths: {openness:.2} rays of lights at infinity by scattering");
        let rays: &[DistantRay] = if openness > OPEN { &[] } else { &pilot.distant_rays };
        let mut weights = surfaces.clone().unwrap_or_else(|| vec![0.0; lights]);
        let distant = DistantEmitters::new(scene, rays, bounds).map(|(distant, faces)| {
            let far: f64 = faces.iter().sum();
            let share = far / (far + pilot.near_contribution);
            let share = if surfaces.is_some() { share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE) } else { 1.0 };
            let power: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|weight| *weight *= (1.0 - share) / power.max(f64::MIN_POSITIVE));
            weights.extend(faces.iter().map(|weight| share * weight / far));
            distant
        });
        Some(Self { table: AliasTable::new(&weights)?, lights, distant })
    }

    /// Whether paths start at lights at infinity.
    pub fn has_distant(&self) -> bool {
        self.distant.is_some()
    }

    /// The power of surfaces that paths start from, by light.
    fn of_surfaces(scene: &Scene) -> Option<Vec<f64>> {
        let power = |light: &Light| match light {
            Light::Area(light) => {
                let starts = light.emitted_pdf_per_cos(&scene.geometry, Vec3::Z).is_some();
                Some(light.power()).filter(|power| starts && power.is_finite()).unwrap_or(0.0)
            }
            _ => 0.0,
        };
        let powers: Vec<f64> = scene.lights.lights().iter().map(power).collect();
        powers.iter().any(|&power| power > 0.0).then_some(powers)
    }

    /// A light and a ray that leaves it, with its density per area and solid angle over the cosine of the ray and the
    /// normal.
    pub fn sample(&self, scene: &Scene, choice: f32, u: [f32; 2], v: [f32; 2]) -> Option<(LightId, EmittedRay)> {
        let index = self.table.sample(choice).index;
        let (id, ray) = if let Some(face) = index.checked_sub(self.lights) {
            self.distant.as_ref()?.sample(scene, face, [u[0], u[1], v[0], v[1]])?
        } else {
            let id = LightId::new(index);
            let Light::Area(light) = scene.lights.get(id) else { return None };
            (id, light.sample_emitted(&scene.geometry, u, v)?)
        };
        Some((id, EmittedRay { pdf_per_cos: ray.pdf_per_cos * self.table.pmf(index), ..ray }))
    }

    /// The density of [`sample`](Self::sample) at a point of a surface with the unit normal `n`; 0 where no light path
    /// starts.
    #[inline]
    pub fn pdf_per_cos(&self, scene: &Scene, id: LightId, n: Vec3) -> f32 {
        match scene.lights.get(id) {
            Light::Area(light) => {
                light.emitted_pdf_per_cos(&scene.geometry, n).map_or(0.0, |pdf| pdf * self.table.pmf(id.index()))
            }
            _ => 0.0,
        }
    }

    /// The density of [`sample`](Self::sample) for the ray of a light at infinity through `p` from the unit direction
    /// `wi`, per area perpendicular to it and solid angle, or per area from a single direction.
    #[inline]
    pub fn pdf_from_infinity(&self, scene: &Scene, id: LightId, p: Vec3, wi: Vec3) -> f32 {
        let Some((face, pdf)) = self.distant.as_ref().and_then(|distant| distant.pdf(scene, id, p, wi)) else {
            return 0.0;
        };
        pdf * self.table.pmf(self.lights + face)
    }
}
