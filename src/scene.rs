//! A scene ready to render: tables and ids, no paths, and no names but those of layers (light groups, objects,
//! materials) and of materials that may be replaced.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use crate::bsdf::Bsdf;
use crate::camera::Camera;
use crate::film::Identities;
use crate::geometry::{AlphaMasks, Geometry, SurfaceInteraction};
use crate::id::{LightId, MaterialId, MediumId, NormalPerturbationId, PrimId, ShapeId};
use crate::light::{LightGroups, LightSet};
use crate::material::Material;
use crate::math::Vec3;
use crate::math::random::hash64;
use crate::medium::{Media, Subsurface};
use crate::normal_perturbation::NormalPerturbation;
use crate::texture::{Footprint, Texture};

/// How a shape looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Its material.
    pub material: MaterialId,
    /// Where its shading normals come from, if not from the shape alone or from a part of its material.
    pub normal_perturbation: Option<NormalPerturbationId>,
    /// The medium within it.
    pub medium: Option<MediumId>,
    /// The light of its first primitive if it emits; the others follow.
    pub first_light: Option<LightId>,
    /// Whether all primitives are one light: an analytic shape, or two triangles that make up a parallelogram.
    pub single_light: bool,
    /// Whether it emits and is hidden from the camera.
    pub hidden: bool,
}

impl Surface {
    /// The light of one primitive.
    #[inline]
    pub fn light(&self, prim: PrimId) -> Option<LightId> {
        let offset = if self.single_light { 0 } else { prim.0 };
        self.first_light.map(|first| LightId(first.0 + offset))
    }
}

/// What a scene uses; what it does not use costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Some shape emits or there is a light.
    pub lights: bool,
    /// Some shape emits and is hidden from the camera.
    pub hidden_emitters: bool,
    /// Some light is at infinity and visible to rays that leave the scene.
    pub environment: bool,
    /// Some shape is analytic.
    pub analytic_shapes: bool,
    /// Objects are placed by instances.
    pub instances: bool,
    /// Some material is textured.
    pub textures: bool,
    /// Some mesh has attributes, which a texture takes.
    pub attributes: bool,
    /// Some material has an image that is filtered over the footprint of a ray.
    pub filtered_textures: bool,
    /// Some material may have an image.
    pub image_textures: bool,
    /// Some surface has a normal map or a bump map.
    pub normal_perturbations: bool,
    /// Some surface's shading normal differs from its geometric one.
    pub shading_normals: bool,
    /// Something depends on uv or on tangents.
    pub parameters: bool,
    /// Some material has only delta lobes.
    pub delta_materials: bool,
    /// Some surface has a medium within it, or one is around everything: paths track their media.
    pub media: bool,
    /// Some medium scatters or emits light.
    pub participating_media: bool,
    /// Light enters the surface of some material and is scattered below it.
    pub subsurface: bool,
    /// Some material is anisotropic: shading frames follow the surface's u direction.
    pub anisotropic: bool,
    /// The camera has a lens.
    pub lens: bool,
    /// Something moves while the shutter is open.
    pub motion: bool,
}

impl SceneFeatures {
    /// Sets what depends on materials and textures alone.
    pub fn set_materials(&mut self, materials: &[Material], textures: &[Texture]) {
        self.textures = materials.iter().any(Material::is_textured);
        self.filtered_textures = self.textures && textures.iter().any(Texture::is_filtered);
        self.anisotropic = materials.iter().any(|material| material.flags().is_anisotropic());
        self.parameters = self.anisotropic || !textures.is_empty();
        self.delta_materials = materials.iter().any(|material| material.flags().is_delta());
    }
}

/// A scene ready to render.
#[derive(Clone, Debug)]
pub struct Scene {
    /// All shapes; accelerators are over them.
    pub geometry: Arc<Geometry>,
    /// Holes in surfaces of participating media. Accelerators find hits in these holes too: paths change their medium
    /// there.
    pub boundary_masks: AlphaMasks,
    /// How each shape looks, by [`ShapeId`].
    pub surfaces: Vec<Surface>,
    /// Materials, by [`MaterialId`].
    pub materials: Vec<Material>,
    /// Materials that another one of constants may replace without another change, by name.
    pub plain_materials: HashMap<String, MaterialId>,
    /// Normal maps and bump maps, by [`NormalPerturbationId`].
    pub normal_perturbations: Vec<NormalPerturbation>,
    /// What surfaces have within them, by [`MediumId`].
    pub media: Media,
    /// Those of materials that are parts of others, by [`MaterialId`]; empty if there are none.
    pub part_normal_perturbations: Vec<Option<NormalPerturbationId>>,
    /// How light is scattered below the surfaces of materials, by [`MaterialId`]; empty if it is below none.
    pub subsurface: Vec<Option<Subsurface>>,
    /// Textures, by [`TextureId`](crate::id::TextureId).
    pub textures: Vec<Texture>,
    /// Lights and their choice.
    pub lights: LightSet,
    /// Which lights belong together, by name.
    pub light_groups: LightGroups,
    /// The camera.
    pub camera: Camera,
    /// What the scene uses.
    pub features: SceneFeatures,
    /// What shapes, materials and instances are called.
    pub identities: Identities,
}

impl Scene {
    /// How a shape looks.
    #[inline]
    pub fn surface(&self, shape: ShapeId) -> &Surface {
        &self.surfaces[shape.index()]
    }

    /// The material of a shape.
    #[inline]
    pub fn material(&self, shape: ShapeId) -> &Material {
        &self.materials[self.surface(shape).material.index()]
    }

    /// A point of a surface for textures.
    #[inline]
    pub fn texture_point(&self, at: &SurfaceInteraction) -> Footprint<'_> {
        self.with_attributes(at, Footprint::point(at.uv))
    }

    /// A footprint at a point of a surface, with the attributes of the mesh there.
    #[inline]
    pub fn with_attributes<'a>(&'a self, at: &SurfaceInteraction, footprint: Footprint<'a>) -> Footprint<'a> {
        if self.features.attributes {
            Footprint { attributes: self.geometry.attributes(at), ..footprint }
        } else {
            footprint
        }
    }

    /// The BSDF at a point for a ray that arrives in `direction` with `footprint`.
    #[inline(always)]
    pub fn bsdf<'a, 'f>(
        &'a self,
        at: &SurfaceInteraction,
        direction: Vec3,
        footprint: impl FnOnce() -> Footprint<'f>,
    ) -> Cow<'a, Bsdf> {
        let mut material = self.material(at.shape);
        if material.parts().is_some() {
            material = self.met_material(at, direction);
        }
        if let Material::Constant(bsdf) = material {
            Cow::Borrowed(bsdf)
        } else {
            Cow::Owned(material.bsdf(&self.textures, footprint))
        }
    }

    /// The material that a ray meets at a point, of those that the shape's material consists of.
    pub fn met_material(&self, at: &SurfaceInteraction, direction: Vec3) -> &Material {
        &self.materials[self.met_material_id(at, direction).index()]
    }

    /// The id of [`met_material`](Self::met_material).
    pub fn met_material_id(&self, at: &SurfaceInteraction, direction: Vec3) -> MaterialId {
        self.descend(self.surface(at.shape).material, at, direction, |_| ())
    }

    /// The normal or bump map at a point for a ray that arrives in `direction`.
    pub fn normal_perturbation(&self, at: &SurfaceInteraction, direction: Vec3) -> Option<NormalPerturbationId> {
        let surface = self.surface(at.shape);
        if surface.normal_perturbation.is_some() || self.part_normal_perturbations.is_empty() {
            return surface.normal_perturbation;
        }
        let mut found = None;
        self.descend(surface.material, at, direction, |id| {
            found = self.part_normal_perturbations[id.index()].or(found);
        });
        found
    }

    /// The part of a material that a ray meets, which consists of no others; `visit` is called with the parts on the
    /// way to it.
    fn descend(
        &self,
        mut id: MaterialId,
        at: &SurfaceInteraction,
        direction: Vec3,
        mut visit: impl FnMut(MaterialId),
    ) -> MaterialId {
        let is_front = direction.dot(at.n_g) < 0.0;
        loop {
            let material = &self.materials[id.index()];
            match material.part(&self.textures, || self.texture_point(at), is_front, || choice(at, direction, id)) {
                Some(part) => id = part,
                None => return id,
            }
            visit(id);
        }
    }
}

/// A number in `[0, 1)` hashed from a point, a direction and a material: the choice between the parts of a mix is the
/// same for any number of threads, and another for every sample of a pixel.
fn choice(at: &SurfaceInteraction, direction: Vec3, id: MaterialId) -> f32 {
    let words =
        at.p.to_array().map(f64::to_bits).into_iter().chain(direction.to_array().map(|x| u64::from(x.to_bits())));
    let hash = words.fold(hash64(u64::from(id.0)), |hash, word| hash64(hash ^ word));
    (hash >> 40) as f32 * (1.0 / 16_777_216.0)
}
