//! The mirrors, metals and glass of a scene, where caustics start.

use crate::bsdf::BsdfFlags;
use crate::geometry::{Geometry, Hit, Shape, SpawnPoint, SurfacePoint};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::integrator::world::has_part;
use crate::light::{Light, placed_area, triangle_point};
use crate::material::Material;
use crate::math::{DVec3, Vec3};
use crate::sampling::AliasTable;
use crate::scene::Scene;

/// Surfaces with delta lobes or near-specular ones alone, chosen by area. Those that instances place are left out, as
/// are emitters: paths find what they throw by chance.
#[derive(Debug)]
pub struct CausticCasters {
    prims: Vec<(ShapeId, PrimId)>,
    /// Chooses one of them.
    table: AliasTable,
    /// By shape, one over the area of all casters; 0 for shapes that are none.
    pdf_area: Vec<f32>,
    /// Whether photons of lights that paths never meet go through delta lobes first.
    pub traces_delta_lights: bool,
}

/// A point of such a surface.
#[derive(Clone, Copy, Debug)]
pub struct CausticPoint {
    /// The shape.
    pub shape: ShapeId,
    /// The point.
    pub point: SpawnPoint,
    /// Density per area.
    pub pdf_area: f64,
}

impl CausticCasters {
    /// Those of a scene; `None` if it has none, if no photons can start there, or if something moves while the shutter
    /// is open.
    pub fn new(scene: &Scene, traces_delta_lights: bool) -> Option<Self> {
        if scene.features.motion {
            return None;
        }
        let mut has_near_specular = false;
        let (mut prims, mut areas, mut is_caster) = (Vec::new(), Vec::new(), vec![false; scene.surfaces.len()]);
        for &shape in &scene.geometry.world {
            let surface = scene.surface(shape);
            let is_specular = has_part(scene, surface.material, |part| part.flags().contains(BsdfFlags::SPECULAR));
            let is_near_specular = has_part(scene, surface.material, may_be_near_specular);
            if !(is_specular || is_near_specular) || surface.first_light.is_some() {
                continue;
            }
            has_near_specular |= is_near_specular;
            is_caster[shape.index()] = true;
            for i in 0..scene.geometry.shape(shape).prim_count() {
                prims.push((shape, PrimId::new(i)));
                areas.push(area(&scene.geometry, shape, PrimId::new(i)));
            }
        }
        let has_photons = |light: &Light| has_near_specular || traces_delta_lights || !light.is_delta();
        if !scene.lights.lights().iter().any(has_photons) {
            return None;
        }
        let density = 1.0 / areas.iter().sum::<f64>();
        let pdf_area = is_caster.into_iter().map(|is_caster| if is_caster { density as f32 } else { 0.0 }).collect();
        Some(Self { prims, table: AliasTable::new(&areas)?, pdf_area, traces_delta_lights })
    }

    /// The density per area with which points of a shape are chosen, up to differences within an analytic shape whose
    /// transform does not keep angles.
    #[inline]
    pub fn pdf_area(&self, shape: ShapeId, instance: InstanceId) -> f32 {
        if instance == Hit::NO_INSTANCE { self.pdf_area[shape.index()] } else { 0.0 }
    }

    /// A point of a caster.
    pub fn sample(&self, geometry: &Geometry, [u, v, w]: [f32; 3]) -> CausticPoint {
        let index = self.table.sample(u).index;
        let ((shape, prim), pmf) = (self.prims[index], f64::from(self.table.pmf(index)));
        match geometry.shape(shape) {
            Shape::Mesh(mesh) => {
                let points = mesh.triangle_points(prim);
                let point = triangle_point(&points, [v, w]);
                CausticPoint { shape, point, pdf_area: pmf / points.area() }
            }
            Shape::Analytic(placed) => {
                let SurfacePoint { p, n, pdf_area } = placed.sample_area([v, w]);
                let point = SpawnPoint { p, n, error: placed.error() };
                CausticPoint { shape, point, pdf_area: pmf * pdf_area }
            }
            // Never chosen: they count no area.
            Shape::Curves(_) | Shape::Points(_) => {
                let point = SpawnPoint { p: DVec3::ZERO, n: Vec3::ZERO, error: 0.0 };
                CausticPoint { shape, point, pdf_area: 0.0 }
            }
        }
    }
}

/// Whether all lobes of a material may be near specular.
fn may_be_near_specular(material: &Material) -> bool {
    let flags = material.flags();
    match material {
        Material::Constant(bsdf) => bsdf.is_near_specular(),
        _ => flags.contains(BsdfFlags::GLOSSY) && !flags.contains(BsdfFlags::DIFFUSE),
    }
}

/// The area of a primitive in the world.
fn area(geometry: &Geometry, shape: ShapeId, prim: PrimId) -> f64 {
    match geometry.shape(shape) {
        Shape::Mesh(mesh) => mesh.triangle_points(prim).area(),
        Shape::Analytic(placed) => placed_area(placed),
        Shape::Curves(_) | Shape::Points(_) => 0.0,
    }
}
