//! What a compiled scene consists of, for people and programs.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::geometry::{Analytic, Shape};
use crate::light::{Light, LightSelection};
use crate::scene::Scene;
use crate::texture::Texture;

/// Counts, bounds and features of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Triangles stored.
    pub triangles: usize,
    /// Triangles as seen, those of objects counted once for each instance.
    pub triangles_instanced: u64,
    /// Triangle meshes.
    pub meshes: usize,
    /// Analytic shapes by kind.
    pub shapes: BTreeMap<&'static str, usize>,
    /// Objects that instances share.
    pub objects: usize,
    /// Instances.
    pub instances: usize,
    /// Lights by kind; each emissive triangle counts.
    pub lights: BTreeMap<&'static str, usize>,
    /// How a light is chosen among them: by its power, or by a light tree over positions and emission directions.
    pub light_selection: &'static str,
    /// Names of light groups.
    pub light_groups: Vec<String>,
    /// Materials, the default one included.
    pub materials: usize,
    /// Textures that vary; constant ones are colours.
    pub textures: usize,
    /// Smallest and largest coordinates, in world units; absent if there is no shape.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Bytes of mesh buffers and tables.
    pub geometry_bytes: usize,
    /// What the scene uses.
    pub features: Vec<&'static str>,
}

impl Summary {
    /// Of a compiled scene.
    pub fn new(scene: &Scene) -> Self {
        let geometry = &scene.geometry;
        let mut shapes = BTreeMap::new();
        let (mut triangles, mut meshes) = (0, 0);
        for shape in &geometry.shapes {
            match shape {
                Shape::Mesh(mesh) => {
                    triangles += mesh.triangles().len();
                    meshes += 1;
                }
                Shape::Analytic(placed) => *shapes.entry(kind_of(&placed.shape)).or_default() += 1,
                Shape::Curves(curves) => *shapes.entry("curve").or_default() += curves.strand_count(),
                Shape::Points(points) => *shapes.entry("point").or_default() += points.prim_count(),
            }
        }
        let mut lights = BTreeMap::new();
        for light in scene.lights.lights() {
            let kind = match light {
                Light::Area(_) => "area",
                Light::Point(_) => "point",
                Light::Spot(_) => "spot",
                Light::Projector(_) => "projector",
                Light::Ies(_) => "ies",
                Light::Directional(_) => "directional",
                Light::Environment(_) => "environment",
            };
            *lights.entry(kind).or_default() += 1;
        }
        let bounds = geometry.bounds();
        Self {
            triangles,
            triangles_instanced: seen_triangles(scene),
            meshes,
            shapes,
            objects: geometry.objects.len(),
            instances: geometry.instances.len(),
            lights,
            light_selection: match scene.lights.selection() {
                LightSelection::Power => "power",
                LightSelection::Tree => "tree",
            },
            light_groups: scene.light_groups.names().to_vec(),
            materials: scene.materials.len(),
            textures: scene.textures.iter().filter(|texture| !matches!(texture, Texture::Constant(_))).count(),
            bounds: (!bounds.is_empty()).then(|| {
                [bounds.min, bounds.max]
                    .map(|p| scene.camera.render_space().world_point(p.as_dvec3()).as_vec3().to_array())
            }),
            geometry_bytes: geometry.memory_bytes(),
            features: features(scene),
        }
    }
}

fn kind_of(shape: &Analytic) -> &'static str {
    match shape {
        Analytic::Sphere(_) => "sphere",
        Analytic::Quad(_) => "quad",
        Analytic::Disk(_) => "disk",
        Analytic::Frustum(_) => "cylinder or cone",
        Analytic::Revolution(_) => "revolution",
    }
}

fn seen_triangles(scene: &Scene) -> u64 {
    let geometry = &scene.geometry;
    let count = |ids: &[crate::id::ShapeId]| -> u64 {
        let triangles = |id: &crate::id::ShapeId| match geometry.shape(*id) {
            Shape::Mesh(mesh) => mesh.triangles().len() as u64,
            Shape::Analytic(_) | Shape::Curves(_) | Shape::Points(_) => 0,
        };
        ids.iter().map(triangles).sum()
    };
    let objects: Vec<u64> = geometry.objects.iter().map(|object| count(&object.shapes)).collect();
    count(&geometry.world) + geometry.instances.iter().map(|instance| objects[instance.object.index()]).sum::<u64>()
}

fn features(scene: &Scene) -> Vec<&'static str> {
    let f = &scene.features;
    [
        (f.lights, "lights"),
        (f.environment, "environment"),
        (f.analytic_shapes, "analytic shapes"),
        (f.instances, "instances"),
        (f.textures, "textures"),
        (f.normal_perturbations, "normal or bump maps"),
        (!scene.geometry.cutouts.is_empty() || !scene.boundary_masks.is_empty(), "holes"),
        (f.delta_materials, "mirror or glass"),
        (f.media, "media"),
        (f.participating_media, "participating media"),
        (f.subsurface, "subsurface scattering"),
        (f.anisotropic, "anisotropic materials"),
        (f.lens, "lens"),
        (f.motion, "motion"),
    ]
    .into_iter()
    .filter(|(used, _)| *used)
    .map(|(_, name)| name)
    .collect()
}
