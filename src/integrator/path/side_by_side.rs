//! Which vertices are shaded side by side, and what becomes of them: those on diffuse surfaces.

use std::ops::Range;

use super::lanes::{Found, Lanes, Roulette};
use super::{Path, PathIntegrator, Pending, Scratch};
use crate::bsdf::{Bsdf, Lambert};
use crate::color::Rgb;
use crate::film::SampleBatch;
use crate::geometry::{Hit, Mesh, Shape};
use crate::id::LightId;
use crate::integrator::parts::{Way, group_of};
use crate::integrator::shading::turned_normal;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Strategy, World};
use crate::light::LightSample;
use crate::material::Material;
use crate::math::Ray;
use crate::math::rows::BATCH;

/// No lane.
const ALONE: u8 = u8::MAX;
const _: () = assert!(BATCH < ALONE as usize);

/// A batch of vertices, of which some are shaded side by side.
pub(super) struct Shaded {
    lanes: Box<Lanes>,
    /// By vertex.
    lane_of: [u8; BATCH],
    /// By lane.
    vertex_of: [u8; BATCH],
    /// By lane that looks at a light.
    light_of: [LightId; BATCH],
    /// Vertices on diffuse surfaces of which more is to be found out.
    others: Vec<u8>,
    sky: SkySamples,
}

/// Lanes that look at an image around the scene.
struct SkySamples {
    lanes: Vec<u8>,
    pmfs: Vec<f32>,
    us: Vec<[f32; 2]>,
    samples: [Option<LightSample>; BATCH],
}

impl Default for SkySamples {
    fn default() -> Self {
        Self { lanes: Vec::with_capacity(BATCH), pmfs: Vec::with_capacity(BATCH), us: Vec::with_capacity(BATCH), samples: [None; BATCH] }
    }
}

impl SkySamples {
    fn clear(&mut self) {
        self.lanes.clear();
        self.pmfs.clear();
        self.us.clear();
    }

    #[inline(always)]
    fn push(&mut self, lane: usize, pmf: f32, u: [f32; 2]) {
        self.lanes.push(lane as u8);
        self.pmfs.push(pmf);
        self.us.push(u);
    }
}

impl Default for Shaded {
    fn default() -> Self {
        Self {
            lanes: Box::default(),
            lane_of: [ALONE; BATCH],
            vertex_of: [0; BATCH],
            light_of: [LightId(0); BATCH],
            others: Vec::with_capacity(BATCH),
            sky: SkySamples::default(),
        }
    }
}

impl Shaded {
    pub fn clear(&mut self) {
        self.lanes.clear();
        self.lane_of = [ALONE; BATCH];
        self.others.clear();
    }

    /// The lane of a vertex, if it is not to be shaded alone.
    #[inline(always)]
    pub fn lane(&self, vertex: usize) -> Option<usize> {
        let lane = self.lane_of[vertex];
        (lane != ALONE).then_some(usize::from(lane))
    }

    #[inline(always)]
    fn assign(&mut self, vertex: usize, lane: usize) {
        self.lane_of[vertex] = lane as u8;
        self.vertex_of[lane] = vertex as u8;
    }
}

impl PathIntegrator {
    /// Whether diffuse vertices of this scene are shaded side by side.
    pub(super) fn shades_side_by_side(&self, world: &World) -> bool {
        let features = &world.scene.features;
        self.side_by_side && self.strategy == Strategy::Mis && !features.anisotropic && !features.reliefs
    }

    /// Shades the vertices of a batch that can be shaded side by side, up to [`collect`](Self::collect).
    pub(super) fn shade_side_by_side<const LAYERS: bool>(
        &self,
        world: &World,
        bounce: u32,
        batch: Range<usize>,
        out: &mut SampleBatch,
        scratch: &mut Scratch,
    ) {
        let smooth = world.scene.features.shading_normals;
        self.find_diffuse(world, batch.clone(), scratch);
        scratch.shaded.lanes.place(smooth);
        self.settle::<LAYERS>(world, bounce, batch, out, scratch);
        let Scratch { shaded: Shaded { lanes, vertex_of, .. }, draws, .. } = scratch;
        if lanes.count() == 0 {
            return;
        }
        lanes.face(smooth, turned_normal);

        for (lane, &vertex) in vertex_of[..lanes.count()].iter().enumerate() {
            let u = draws.bsdf.of(usize::from(vertex));
            lanes.set_numbers(lane, [u[1], u[2], u[3]]);
        }
        if !world.scene.lights.is_empty() {
            self.light_lanes(world, scratch);
        }
        let Scratch { shaded: Shaded { lanes, .. }, .. } = scratch;
        lanes.scatter(if bounce + 1 >= self.rr_depth { Roulette::ByThroughput } else { Roulette::Not });
    }

    /// Lets vertices look at lights.
    fn light_lanes(&self, world: &World, scratch: &mut Scratch) {
        let Scratch { shaded: Shaded { lanes, vertex_of, lane_of, light_of, sky, .. }, draws, .. } = scratch;
        let lights = &world.scene.lights;
        let found_by = self.strategy.found_by();
        let image = lights.image_at_infinity();
        sky.clear();
        for (lane, &vertex) in vertex_of[..lanes.count()].iter().enumerate() {
            let vertex = usize::from(vertex);
            if usize::from(lane_of[vertex]) != lane {
                continue;
            }
            let u = draws.light.of(vertex);
            let receiver = lanes.receiver(lane);
            let Some(choice) = lights.choose(&receiver, [u[0], u[3]], found_by) else { continue };
            light_of[lane] = choice.id;
            if image.is_some_and(|(id, _)| id == choice.id) {
                sky.push(lane, choice.pmf, [u[1], u[2]]);
                continue;
            }
            let sample = lights.get(choice.id).sample(&world.scene.geometry, &world.scene.textures, receiver.p, [u[1], u[2]], found_by);
            if let Some(sample) = &sample {
                lanes.set_light(lane, sample, choice.pmf);
            }
        }
        if let Some((_, image)) = image {
            let count = sky.lanes.len();
            image.sample_batch(&sky.us, found_by, &mut sky.samples[..count]);
            for ((&lane, &pmf), sample) in sky.lanes.iter().zip(&sky.pmfs).zip(&sky.samples) {
                if let Some(sample) = sample {
                    lanes.set_light(usize::from(lane), sample, pmf);
                }
            }
        }
        lanes.illuminate();
    }

    /// Looks for vertices on diffuse surfaces: on triangles of which nothing but their place is to be found out, and others.
    fn find_diffuse(&self, world: &World, batch: Range<usize>, scratch: &mut Scratch) {
        let Scratch { paths, rays, hits, shaded, .. } = scratch;
        let scene = world.scene;
        let places_suffice = world.finds_places_only();
        for (vertex, i) in batch.enumerate() {
            let Some(hit) = &hits[i] else { continue };
            let surface = scene.surface(hit.shape);
            let material = &scene.materials[surface.material.index()];
            let (is_diffuse, albedo) = match material {
                Material::Constant(Bsdf::Lambert(lambert)) => (true, surface.first_light.is_none().then_some(lambert.albedo)),
                Material::Varying(varying) => (varying.is_diffuse(), None),
                Material::Constant(_) | Material::Mix { .. } | Material::TwoSided { .. } => (false, None),
            };
            match (albedo, still_mesh(world, hit)) {
                (Some(albedo), Some(mesh)) if places_suffice => {
                    let lane = push_triangle(world, &mut shaded.lanes, mesh, hit, (&rays[i], &paths[i]), albedo);
                    shaded.assign(vertex, lane);
                }
                _ if is_diffuse => shaded.others.push(vertex as u8),
                _ => {}
            }
        }
    }

    /// Leaves those that turn out to be elsewhere, and adds other vertices on diffuse surfaces.
    fn settle<const LAYERS: bool>(&self, world: &World, bounce: u32, batch: Range<usize>, out: &mut SampleBatch, scratch: &mut Scratch) {
        let Scratch { paths, rays, hits, cones, shaded, sorting, .. } = scratch;
        let first = batch.start;
        let smooth = world.scene.features.shading_normals;
        for lane in 0..shaded.lanes.count() {
            let vertex = usize::from(shaded.vertex_of[lane]);
            if !shaded.lanes.is_ahead(lane) {
                shaded.lane_of[vertex] = ALONE;
                continue;
            }
            let i = first + vertex;
            if LAYERS
                && let Some(clear) = self.notes_surface(bounce, sorting.clear_of(i))
                && let Some(hit) = &hits[i]
            {
                let at = shaded.lanes.interaction(lane, hit, rays[i].time, smooth);
                self.note_surface(world, (bounce, clear, paths[i].slot), (&at, Some(hit)), || shaded.lanes.albedo(lane), out);
            }
        }
        for k in 0..shaded.others.len() {
            let vertex = usize::from(shaded.others[k]);
            let i = first + vertex;
            let (path, ray) = (&paths[i], &rays[i]);
            let found = world.resolve(ray, hits[i]);
            let Some(at) = &found else { continue };
            let cone = cones.get(i).copied();
            let footprint = || world.footprint(cone.as_ref(), ray, hits[i].as_ref(), at);
            let mut place = None;
            let Bsdf::Lambert(Lambert { albedo }) = *world.scene.bsdf(at, ray.direction, footprint, &mut place) else { continue };
            if let (true, Some(clear)) = (LAYERS, self.notes_surface(bounce, sorting.clear_of(i))) {
                self.note_surface(world, (bounce, clear, path.slot), (at, hits[i].as_ref()), || albedo, out);
            }
            let light = self.clamped(path.throughput * self.emitted(world, path, ray, at), bounce);
            out.pixels[path.slot as usize].radiance += light;
            if LAYERS && self.sorts() && !light.is_black() {
                self.sort_emitted(world, (sorting, i), at, (path.slot, bounce), light, out);
            }
            let lane = shaded.lanes.push_known(ray, at, path.throughput, path.roulette_scale, albedo);
            shaded.assign(vertex, lane);
        }
    }

    /// Takes up what became of the path `i`, of the batch that starts with `first`.
    #[allow(clippy::too_many_arguments)]
    #[inline(always)]
    pub(super) fn collect<const LAYERS: bool>(
        &self,
        world: &World,
        bounce: u32,
        [i, first]: [usize; 2],
        lane: usize,
        out: &mut SampleBatch,
        scratch: &mut Scratch,
        alive: &mut usize,
    ) {
        let Scratch { paths, rays, hits, shadow_rays, pending, cones, draws, shaded, turns, sorting, .. } = scratch;
        let lanes = &shaded.lanes;
        let (path, time) = (paths[i], rays[i].time);
        if bounce == 0 {
            out.pixels[path.slot as usize].alpha = 1.0;
        }
        let (shadow, shadow_ray) = lanes.shadow_ray(lane);
        let (next, next_ray) = lanes.next_ray(lane);
        let mut bsdf = None;
        let hidden = shadow == Found::Hidden || next == Found::Hidden;
        let found = if hidden { world.resolve(&rays[i], hits[i]) } else { None };
        let cone = cones.get(i).copied();
        let vertex = found.as_ref().map(|at| {
            let footprint = || world.footprint(cone.as_ref(), &rays[i], hits[i].as_ref(), at);
            Vertex::new(world, at, &rays[i], footprint, &mut bsdf)
        });

        let shadow = match (shadow, &vertex) {
            (Found::Ray, _) => Some((Ray { time, ..shadow_ray }, lanes.contribution(lane))),
            (Found::Hidden, Some(vertex)) => {
                self.sample_light(world, &path, vertex, None, draws.light.of(i - first)).map(|shadow| (shadow.ray, shadow.contribution))
            }
            _ => None,
        };
        if let Some((ray, contribution)) = shadow {
            shadow_rays.push(ray);
            pending.push(Pending { contribution: self.clamped(contribution, bounce + 1), slot: path.slot });
            if LAYERS && self.sorts() {
                sorting.push_pending(self.parts, bounce, [i, group_of(world.scene, shaded.light_of[lane])], || Way::DIFFUSE);
            }
        }

        let next = match (next, &vertex) {
            (Found::Ray, _) => {
                let pdf = if world.scene.lights.is_empty() { f32::INFINITY } else { lanes.next_pdf(lane) };
                let path =
                    Path { throughput: lanes.throughput(lane), pdf, any_non_specular_bounce: true, from: lanes.receiver(lane), ..path };
                Some((path, Ray { time, ..next_ray }))
            }
            (Found::Hidden, Some(vertex)) => self.scatter(world, &path, vertex, bounce, (None, turns), draws.bsdf.of(i - first), |_| ()),
            _ => None,
        };
        if let Some((path, ray)) = next {
            if let Some(cone) = cone {
                cones[*alive] = world.scattered_cone(cone, lanes.t(lane), path.pdf);
            }
            if LAYERS {
                sorting.follow(self.parts, bounce, [i, *alive], || Way::DIFFUSE, || None);
            }
            paths[*alive] = path;
            rays[*alive] = ray;
            *alive += 1;
        }
    }
}

/// A vertex where a ray meets a triangle of a mesh.
#[inline(always)]
fn push_triangle(world: &World, lanes: &mut Lanes, mesh: &Mesh, hit: &Hit, (ray, path): (&Ray, &Path), albedo: Rgb) -> usize {
    let normals = if world.scene.features.shading_normals { Some(mesh.corner_normals(hit.prim, 0.0)) } else { None };
    // Without normals of its own, a triangle is flat.
    let smooth = normals.map(|normals| (normals.unwrap_or_default(), [hit.u, hit.v]));
    lanes.push_triangle(ray, &mesh.triangle_points(hit.prim), smooth, path.throughput, path.roulette_scale, albedo)
}

/// The mesh of a hit that neither moves nor stands elsewhere than its vertices say.
#[inline(always)]
fn still_mesh<'a>(world: &'a World, hit: &Hit) -> Option<&'a Mesh> {
    match world.scene.geometry.shape(hit.shape) {
        Shape::Mesh(mesh) if hit.instance == Hit::NO_INSTANCE && !mesh.is_deforming() => Some(mesh),
        _ => None,
    }
}
