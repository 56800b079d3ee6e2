//! The scattering at each vertex: the albedo of diffuse surfaces in rows, a [`Bsdf`] for all others.

use super::Context;
use super::block::{VertexRows, Vertices, vertex_flags};
use super::wave::{BsdfScratch, Wave, path_flags};
use crate::bsdf::{Bsdf, BsdfFlags, BsdfQueryRows, Lambert};
use crate::color::Rgb;
use crate::id::{MediumId, ShapeId};
use crate::integrator::World;
use crate::material::Material;
use crate::math::compact::sort_lanes;
use crate::math::rows::{BATCH, Row, Vec3Rows, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::scene::Scene;
use crate::texture::{Checker, Footprint};

/// A BSDF by vertex: one of the scene's constant materials, or one made for the vertex.
pub(super) struct BsdfTable {
    /// Of constant materials their id, of others [`MADE`] and their place among those, or [`DIFFUSE`].
    ids: Row<u32>,
    /// The same for the vertices of one group; of BSDFs that vary, [`VARYING`] and their material's id.
    groups: Row<u32>,
    made: Vec<Bsdf>,
}

const DIFFUSE: u32 = u32::MAX;
const MADE: u32 = 1 << 31;
const VARYING: u32 = 1 << 30;

impl Default for BsdfTable {
    fn default() -> Self {
        Self { ids: [DIFFUSE; BATCH], groups: [DIFFUSE; BATCH], made: Vec::with_capacity(BATCH) }
    }
}

impl BsdfTable {
    /// The BSDF of a vertex; `None` for diffuse surfaces.
    #[inline]
    pub fn get<'a>(&'a self, scene: &'a Scene, lane: usize) -> Option<&'a Bsdf> {
        let id = self.ids[lane];
        if id == DIFFUSE {
            None
        } else if id & MADE != 0 {
            Some(&self.made[(id & !MADE) as usize])
        } else if let Material::Constant(bsdf) = &scene.materials[id as usize] {
            Some(bsdf)
        } else {
            None
        }
    }

    /// Runs of vertices that can be evaluated together, of sorted vertices.
    pub fn groups<'a>(&'a self, lanes: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        lanes.chunk_by(|&a, &b| self.groups[usize::from(a)] == self.groups[usize::from(b)])
    }

    /// Whether the BSDFs in the group of a vertex differ.
    #[inline]
    pub fn varies(&self, lane: usize) -> bool {
        self.groups[lane] & (MADE | VARYING) == VARYING
    }

    /// Sets the parameters of queries for a group whose BSDFs differ.
    pub fn set_parameters(&self, scene: &Scene, lanes: &[u8], queries: &mut BsdfQueryRows) {
        for (i, &lane) in lanes.iter().enumerate() {
            if let Some(bsdf) = self.get(scene, usize::from(lane)) {
                queries.set_parameters(i, bsdf);
            }
        }
    }

    /// Samples the one BSDF of a group of vertices with these numbers for the lobe and the direction; false for diffuse
    /// surfaces.
    pub fn sample_group(
        &self,
        scene: &Scene,
        wo: &Vec3Rows,
        lanes: &[u8],
        u: impl Fn(usize) -> [f32; 3],
        BsdfScratch { queries, samples, .. }: &mut BsdfScratch,
    ) -> bool {
        let Some(bsdf) = self.get(scene, usize::from(lanes[0])) else { return false };
        let varies = self.varies(usize::from(lanes[0]));
        for (i, &lane) in lanes.iter().enumerate() {
            let lane = usize::from(lane);
            queries.wo.set(i, wo.get(lane));
            [queries.u_lobe[i], queries.u[i], queries.v[i]] = u(lane);
        }
        if varies {
            self.set_parameters(scene, lanes, queries);
        }
        bsdf.sample_rows(queries, varies, lanes.len(), samples);
        true
    }

    fn set_made(&mut self, lane: usize, bsdf: Bsdf) {
        self.ids[lane] = MADE | self.made.len() as u32;
        self.groups[lane] = self.ids[lane];
        self.made.push(bsdf);
    }
}

/// Evaluates the materials of a block's vertices, and finds those on emitters.
pub(super) fn evaluate(context: &Context, wave: &mut Wave, block: usize) {
    let vertices = &mut wave.vertices;
    vertices.emitters.clear();
    vertices.non_diffuse.clear();
    vertices.bsdfs.made.clear();
    vertices.textured.clear();
    let scene = context.scene;
    for lane in 0..vertices.count.min(BATCH) {
        if vertices.rows.flags[lane] & (vertex_flags::MISS | vertex_flags::MEDIUM) != 0 {
            evaluate_without_surface(context.world, vertices, lane);
            continue;
        }
        let surface = scene.surface(ShapeId(vertices.rows.shape[lane]));
        if surface.first_light.is_some() {
            vertices.emitters.push(lane as u8);
        }
        let mut id = surface.material;
        if scene.materials[id.index()].parts().is_some() {
            id = scene.met_material_id(&vertices.interaction(lane), vertices.rows.direction.get(lane));
        }
        (vertices.bsdfs.ids[lane], vertices.bsdfs.groups[lane]) = (id.0, id.0);
        match &scene.materials[id.index()] {
            Material::Constant(Bsdf::Lambert(Lambert { albedo })) => set_diffuse(vertices, lane, *albedo),
            Material::Constant(bsdf) => set_non_diffuse(&mut vertices.rows, &mut vertices.non_diffuse, lane, bsdf),
            Material::Textured(..) => vertices.textured.push(lane as u8),
            // Met materials do not consist of others.
            Material::Mix { .. } | Material::TwoSided { .. } => set_diffuse(vertices, lane, Rgb::BLACK),
        }
    }
    find_footprints(context, wave, block);
    evaluate_textured(context, &mut wave.vertices);
}

/// Sets the scattering of a medium, or nothing where the ray met nothing.
#[inline(never)]
fn evaluate_without_surface(world: &World, vertices: &mut Vertices, lane: usize) {
    if vertices.is_miss(lane) {
        set_diffuse(vertices, lane, Rgb::BLACK);
        return;
    }
    let id = MediumId(vertices.rows.shape[lane]);
    let phase = world.scene.media.get(id).phase;
    set_non_diffuse(&mut vertices.rows, &mut vertices.non_diffuse, lane, &Bsdf::Phase(phase));
    let enclosed = if world.enclosed_media[id.index()] { vertex_flags::ENCLOSED } else { 0 };
    vertices.rows.flags[lane] |= vertex_flags::MEDIUM | enclosed;
    vertices.bsdfs.set_made(lane, Bsdf::Phase(phase));
}

/// Finds the footprints of vertices with textures, and starts to load the texels below them: they then wait for memory
/// together.
fn find_footprints(context: &Context, wave: &mut Wave, block: usize) {
    let Wave { vertices, rays, hits, cones, .. } = wave;
    if !context.scene.features.image_textures {
        vertices.rows.texture_area = [0.0; BATCH];
        return;
    }
    for i in 0..vertices.textured.len() {
        let lane = usize::from(vertices.textured[i]);
        let path = vertices.path(lane);
        let (at, ray) = (vertices.interaction(lane), rays[block].get(path));
        let footprint = match (cones.get(block * BATCH + path), vertices.rows.uv_density[lane]) {
            (Some(cone), density) if density > 0.0 => context.world.covered(cone, ray.direction, &at, density),
            (cone, _) => context.world.footprint(cone, &ray, hits[block].get(path).as_ref(), &at),
        };
        vertices.rows.texture_area[lane] = footprint.area;
        if let Material::Textured(_, textures) = &context.scene.materials[vertices.bsdfs.ids[lane] as usize] {
            textures.iter().for_each(|id| context.scene.textures[id.index()].prefetch(&footprint));
        }
    }
}

/// Evaluates the materials with textures.
fn evaluate_textured(context: &Context, vertices: &mut Vertices) {
    let scene = context.scene;
    for i in 0..vertices.textured.len() {
        let lane = usize::from(vertices.textured[i]);
        let id = vertices.bsdfs.ids[lane];
        // All vertices on a checkerboard are set with its first.
        let Some(Material::Textured(textured, _)) = scene.materials.get(id as usize) else { continue };
        if let Some(checker) = textured.lambert_checker(&scene.textures) {
            let Vertices { rows, bsdfs, count, .. } = &mut *vertices;
            vectorize!(set_checkerboard(checker, id, &mut bsdfs.ids, rows, *count));
            continue;
        }
        let (uv, area) = (vertices.rows.uv.get(lane), vertices.rows.texture_area[lane]);
        let footprint = scene.with_attributes(&vertices.interaction(lane), Footprint { uv, area, attributes: None });
        // Without a BSDF, which would be copied.
        if let Some(albedo) = textured.lambert_albedo(&scene.textures, &footprint) {
            set_diffuse(vertices, lane, albedo);
            continue;
        }
        let bsdf = textured.bsdf(&scene.textures, &footprint);
        set_non_diffuse(&mut vertices.rows, &mut vertices.non_diffuse, lane, &bsdf);
        let group =
            if textured.can_be_grouped() && bsdf.can_vary() { Some(VARYING | vertices.bsdfs.ids[lane]) } else { None };
        vertices.bsdfs.set_made(lane, bsdf);
        if let Some(group) = group {
            vertices.bsdfs.groups[lane] = group;
        }
    }
}

/// Sets the albedos of the vertices whose material has this id.
#[inline(always)]
fn set_checkerboard(checker: Checker, id: u32, ids: &mut Row<u32>, rows: &mut VertexRows, count: usize) {
    for (i, own_id) in ids[..whole_vectors(count)].iter_mut().enumerate() {
        let is_on_it = *own_id == id;
        let (color, albedo) = (checker.color(rows.uv.get(i)).to_array(), rows.albedo.get(i).to_array());
        let channel = |k: usize| if is_on_it { color[k] } else { albedo[k] };
        rows.albedo.set(i, Rgb::new(channel(0), channel(1), channel(2)));
        *own_id = if is_on_it { DIFFUSE } else { *own_id };
    }
}

#[inline(always)]
pub(super) fn set_diffuse(vertices: &mut Vertices, lane: usize, albedo: Rgb) {
    vertices.bsdfs.ids[lane] = DIFFUSE;
    vertices.rows.albedo.set(lane, albedo);
}

#[inline(always)]
fn set_non_diffuse(rows: &mut VertexRows, non_diffuse: &mut Vec<u8>, lane: usize, bsdf: &Bsdf) {
    non_diffuse.push(lane as u8);
    rows.albedo.set(lane, Rgb::BLACK);
    rows.flags[lane] = flags(bsdf);
}

#[inline]
fn flags(bsdf: &Bsdf) -> u32 {
    let lobes = bsdf.flags();
    let delta = if lobes.is_delta() { vertex_flags::DELTA } else { 0 };
    let transmits = if lobes.transmits() { vertex_flags::TRANSMITS } else { 0 };
    let is_mixed = lobes.contains(BsdfFlags::SPECULAR) && bsdf.has_mixed_specular_reflection();
    let near_specular = if bsdf.is_near_specular() { vertex_flags::NEAR_SPECULAR } else { 0 };
    delta | transmits | near_specular | if is_mixed { vertex_flags::MIXED_SPECULAR } else { 0 }
}

/// Sorts the vertices that are not diffuse by their groups.
pub(super) fn sort_by_bsdf(vertices: &mut Vertices) {
    let Vertices { non_diffuse, bsdfs, .. } = vertices;
    sort_lanes(non_diffuse, &bsdfs.groups);
}

/// Replaces the BSDFs of boundaries between media, and of rough surfaces under path space regularization.
pub(super) fn replace_bsdfs(context: &Context, wave: &mut Wave, block: usize) {
    let regularization = context.config.regularization;
    if !context.scene.features.media && regularization.is_none() {
        return;
    }
    let Wave { vertices, paths, media, .. } = wave;
    for k in 0..vertices.non_diffuse.len() {
        let lane = usize::from(vertices.non_diffuse[k]);
        let path = vertices.path(lane);
        if let Some(media) = media.get(block * BATCH + path) {
            let at = vertices.interaction(lane);
            if let Some(bsdf) = context.world.boundary_bsdf(&at, vertices.rows.direction.get(lane), media) {
                replace(vertices, lane, bsdf);
            }
        }
        let paths = &paths[block];
        if let Some(regularization) = regularization.filter(|_| paths.flags[path] & path_flags::ANY_NON_SPECULAR != 0)
            && let Some(rougher) = vertices
                .bsdfs
                .get(context.scene, lane)
                .and_then(|bsdf| bsdf.with_min_alpha(regularization.alpha(paths.sample[path])))
        {
            replace(vertices, lane, rougher);
        }
    }
}

fn replace(vertices: &mut Vertices, lane: usize, bsdf: Bsdf) {
    vertices.rows.flags[lane] = flags(&bsdf);
    vertices.bsdfs.set_made(lane, bsdf);
}
