//! The lights where light paths start.

use super::distant::{DistantEmitters, DistantRay, DistantStart};
use crate::geometry::SpawnPoint;
use crate::id::LightId;
use crate::integrator::PilotRecords;
use crate::light::{EmittedRay, Light, MisCompensation};
use crate::math::Vec3;
use crate::sampling::AliasTable;
use crate::scene::Scene;

/// Lights that light paths start from: emissive surfaces without textures, chosen by power, and lights at infinity,
/// whose rays are chosen by what a pilot has found of them.
#[derive(Clone, Debug)]
pub struct Emitters {
    /// By light, and then by portal of lights at infinity.
    table: AliasTable,
    lights: usize,
    distant: Option<DistantEmitters>,
}

/// The least part of the light paths that start at surfaces, or at lights at infinity, where a scene has both.
const LEAST_SHARE: f64 = 0.1;

/// Lights at infinity start no paths where more than this part of the pilot's shadow rays is not blocked: what they
/// shine at directly is most of the light.
const OPEN: f64 = 0.5;

impl Emitters {
    /// Whether a scene has lights that paths may start from.
    pub fn may_start(scene: &Scene) -> bool {
        Self::of_surfaces(scene).is_some() || scene.lights.lights().iter().any(Light::is_at_infinity)
    }

    /// Those of a scene, if it has any, with what a pilot has found of lights at infinity.
    pub fn new(scene: &Scene, pilot: &PilotRecords) -> Option<Self> {
        let surfaces = Self::of_surfaces(scene);
        let lights = scene.lights.lights().len();
        let is_open = pilot.unoccluded as f64 > OPEN * pilot.shadow_rays as f64;
        let rays: &[DistantRay] = if is_open { &[] } else { &pilot.distant_rays };
        let distant = DistantEmitters::new(scene, rays, pilot.bounds());
        let mut weights = surfaces.clone().unwrap_or_else(|| vec![0.0; lights]);
        let power: f64 = weights.iter().sum();
        let distant = distant.map(|(distant, portals)| {
            let far: f64 = portals.iter().sum();
            let share = f64::from(pilot.distant_contribution)
                / f64::from(pilot.distant_contribution + pilot.near_contribution).max(f64::MIN_POSITIVE);
            let share = if surfaces.is_some() { share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE) } else { 1.0 };
            weights.iter_mut().for_each(|weight| *weight *= (1.0 - share) / power.max(f64::MIN_POSITIVE));
            weights.extend(portals.iter().map(|weight| share * weight / far));
            distant
        });
        Some(Self { table: AliasTable::new(&weights)?, lights, distant })
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
        let pmf = self.table.pmf(index);
        if index >= self.lights {
            let portal = index - self.lights;
            let start = self.distant.as_ref()?.sample(scene, portal, [u[0], u[1], v[0], v[1]])?;
            let DistantStart { light, p, wi, pdf } = start;
            let radiance = match scene.lights.get(light) {
                Light::Directional(distant) if distant.is_delta() => distant.irradiance(),
                distant => distant.eval_infinite(wi, MisCompensation::Off).radiance,
            };
            let point = SpawnPoint { p, n: -wi, error: 0.0 };
            return Some((light, EmittedRay { point, direction: -wi, radiance, pdf_per_cos: pdf * pmf }));
        }
        let Light::Area(light) = scene.lights.get(LightId::new(index)) else { return None };
        let ray = light.sample_emitted(&scene.geometry, u, v)?;
        let ray = EmittedRay { pdf_per_cos: ray.pdf_per_cos * pmf, ..ray };
        Some((LightId::new(index), ray))
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
        let Some((portal, pdf)) = self.distant.as_ref().and_then(|distant| distant.pdf(scene, id, p, wi)) else {
            return 0.0;
        };
        pdf * self.table.pmf(self.lights + portal)
    }
}
