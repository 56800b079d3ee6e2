//! Path tracing with next-event estimation and multiple importance sampling, a batch of paths at a time.
//!
//! One round lengthens every living path by a segment: trace, shade (emission, choice of a light, choice of a direction), trace shadow
//! rays, drop dead paths. Each path draws its numbers from its own (pixel, sample, bounce), so a path is the same in any batch.

mod draws;
mod escapes;
mod lanes;
mod side_by_side;
mod sorting;

use std::cell::RefCell;
use std::sync::Arc;

use super::cancel;
use super::guided::{Steered, Steering, Turns};
use super::media::MediaState;
use super::parts::{Way, group_of};
use super::regularization::Regularization;
use super::surface::albedo_at;
use super::vertex::Vertex;
use super::{CameraSample, Integrator, RayCounts, Strategy, SurfaceNeeds, World, dimensions};
use crate::accel::Coherence;
use crate::bsdf::BsdfSample;
use crate::color::Rgb;
use crate::film::{PartNeeds, SampleBatch};
use crate::geometry::{Hit, SurfaceInteraction};
use crate::guiding::Guide;
use crate::id::LightId;
use crate::light::{Light, Receiver};
use crate::math::rows::BATCH;
use crate::math::{DVec3, Ray, RayCone, Vec3};
use crate::medium::RelativeIor;
use crate::sampling::{PixelSeed, Sampler, power_heuristic};
use draws::Draws;
use escapes::Escapes;
use side_by_side::Shaded;
use sorting::{Sorting, seen_through};

/// Path tracing.
#[derive(Clone, Debug)]
pub struct PathIntegrator {
    /// Largest number of segments from the camera; 1 shows only directly visible light.
    pub max_depth: u32,
    /// Segments before Russian roulette may end a path.
    pub rr_depth: u32,
    /// How directions towards lights are found.
    pub strategy: Strategy,
    /// Largest channel that a single contribution of indirect light keeps: less noise for too little light. Infinite for no bias.
    pub clamp: f32,
    /// Path space regularization, if it is enabled.
    pub regularization: Option<Regularization>,
    /// Whether the camera does not see what gives off light.
    pub hide_emitters: bool,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// What the layers need.
    pub needs: SurfaceNeeds,
    /// Which parts of the radiance layers need.
    pub parts: PartNeeds,
    /// Whether diffuse surfaces are shaded side by side where that is possible: faster, with the same result bit for bit.
    pub side_by_side: bool,
    /// What is known of the light, if directions are chosen by it too.
    pub guide: Option<Arc<Guide>>,
}

/// A path under way.
#[derive(Clone, Copy, Debug)]
struct Path {
    /// Product of all weights so far.
    throughput: Rgb,
    /// Density with which the last direction was chosen, or infinity if light sampling could not have found it.
    pdf: f32,
    /// What roulette multiplies the throughput by, lest it mistakes for absorption what is none: the squares of the relative indices of refraction
    /// passed, which scale radiance, and how far a guide has raised densities above those of the surfaces.
    roulette_scale: f32,
    /// Whether any vertex so far has scattered it by a lobe that is no delta.
    any_non_specular_bounce: bool,
    /// Its place in the batch.
    slot: u32,
    seed: PixelSeed,
    sample: u32,
    /// Where the last direction was chosen, for the density of light sampling.
    from: Receiver,
}

/// Light that reaches a path if its shadow ray is free.
#[derive(Clone, Copy, Debug)]
struct Pending {
    contribution: Rgb,
    slot: u32,
}

/// Buffers of one thread, kept between batches.
#[derive(Default)]
struct Scratch {
    paths: Vec<Path>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    shadow_rays: Vec<Ray>,
    occluded: Vec<bool>,
    pending: Vec<Pending>,
    /// Beside `paths`, in scenes with media.
    media: Vec<MediaState>,
    /// Beside `paths`, in pictures of scenes with filtered textures; else empty.
    cones: Vec<RayCone>,
    draws: Draws,
    escapes: Escapes,
    shaded: Shaded,
    sorting: Sorting,
    /// With a guide that learns.
    turns: Turns,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl Integrator for PathIntegrator {
    fn render_batch(&self, world: &World, samples: &[CameraSample], out: &mut SampleBatch, counts: &mut RayCounts) {
        SCRATCH.with_borrow_mut(|scratch| self.render(world, samples, out, counts, scratch));
    }
}

impl PathIntegrator {
    fn render(&self, world: &World, samples: &[CameraSample], out: &mut SampleBatch, counts: &mut RayCounts, scratch: &mut Scratch) {
        scratch.paths.clear();
        scratch.rays.clear();
        scratch.rays.extend(samples.iter().map(|sample| sample.ray));
        scratch.paths.extend((0..).zip(samples).map(|(slot, sample)| Path {
            throughput: Rgb::WHITE,
            pdf: f32::INFINITY,
            roulette_scale: 1.0,
            any_non_specular_bounce: false,
            slot,
            seed: sample.seed,
            sample: sample.sample,
            from: Receiver { p: DVec3::ZERO, n: Vec3::ZERO },
        }));
        out.reset(samples.len(), self.needs != SurfaceNeeds::default(), self.parts);

        let in_media = world.scene.features.media;
        if in_media {
            scratch.media.clear();
            scratch.media.extend(scratch.rays.iter().map(|ray| MediaState { here: world.media_at_start(ray), ..MediaState::default() }));
        }

        scratch.cones.clear();
        scratch.cones.extend(scratch.rays.iter().map_while(|ray| world.camera_cone(ray)));

        scratch.turns.clear();
        scratch.sorting.begin(self, samples.len());

        for bounce in 0..self.max_depth {
            let count = scratch.rays.len();
            if count == 0 || (bounce % cancel::BOUNCES == 0 && world.gives_up()) {
                break;
            }
            let coherence = if bounce == 0 { Coherence::Coherent } else { Coherence::Incoherent };
            *(if bounce == 0 { &mut counts.camera } else { &mut counts.indirect }) += count as u64;
            scratch.hits.clear();
            scratch.hits.resize(count, None);
            world.accel.intersect_batch(&scratch.rays, &mut scratch.hits, coherence);
            if bounce == 0 && self.hide_emitters {
                counts.camera += world.pass_all_emitters(&mut scratch.rays, &mut scratch.hits);
            }
            if in_media {
                counts.indirect += self.arrive_all(world, scratch);
            }

            let layers = self.sorts() || self.needs != SurfaceNeeds::default();
            match (in_media, self.guide.is_some()) {
                (false, false) if !layers => self.shade_all::<false, false, false>(world, bounce, out, scratch),
                (false, false) => self.shade_all::<false, false, true>(world, bounce, out, scratch),
                (true, false) => self.shade_all::<true, false, true>(world, bounce, out, scratch),
                (false, true) => self.shade_all::<false, true, true>(world, bounce, out, scratch),
                (true, true) => self.shade_all::<true, true, true>(world, bounce, out, scratch),
            }

            let shadows = scratch.shadow_rays.len();
            counts.shadow += shadows as u64;
            scratch.occluded.clear();
            scratch.occluded.resize(shadows, false);
            let toward_one_place = bounce == 0 && !world.scene.features.environment;
            let coherence = if toward_one_place { Coherence::Coherent } else { Coherence::Incoherent };
            world.accel.occluded_batch(&scratch.shadow_rays, &mut scratch.occluded, coherence);
            for (pending, occluded) in scratch.pending.iter().zip(&scratch.occluded) {
                if !occluded {
                    out.pixels[pending.slot as usize].radiance += pending.contribution;
                }
            }
            if self.sorts() {
                let pending = scratch.pending.iter().map(|pending| (pending.slot, pending.contribution));
                self.sort_pending(&scratch.sorting, pending.zip(&scratch.occluded), out);
            }
            scratch.turns.settle(out);
        }
        scratch.turns.teach(self, out);
    }

    /// Takes every path through media to the next surface where something happens to it; says how many rays that took.
    #[inline(never)]
    fn arrive_all(&self, world: &World, scratch: &mut Scratch) -> u64 {
        let Scratch { paths, rays, hits, media, cones, sorting, .. } = scratch;
        let mut passed = 0;
        for (i, path) in paths.iter_mut().enumerate() {
            let start = rays[i].origin;
            let arrival = world.arrive(&mut rays[i], hits[i], &mut media[i]);
            hits[i] = arrival.hit;
            path.throughput *= arrival.transmittance;
            sorting.absorb(i, arrival.transmittance);
            if arrival.passed > 0 {
                // No shadow ray would have come so far.
                path.pdf = f32::INFINITY;
                passed += u64::from(arrival.passed);
                if let Some(cone) = cones.get_mut(i) {
                    *cone = cone.moved((rays[i].origin - start).length());
                }
            }
            if matches!(arrival.ior, Some(RelativeIor::Dispersed(_))) {
                // Each colour goes its own way: the path follows one of them.
                let channel = ((3.0 * self.sampler.sample_4d(path.seed, path.sample, dimensions::COLOR)[0]) as usize).min(2);
                let mut only = [0.0; 3];
                only[channel] = 3.0;
                path.throughput *= Rgb::from(only);
                media[i].channel = Some(channel);
            }
            media[i].ior = arrival.ior.map(|ior| ior.of(media[i].channel));
        }
        passed
    }

    /// Shades every living path's hit; afterwards the scratch holds the paths that go on, their rays, and the shadow rays to trace.
    ///
    /// Large results stay where they were returned and are read through references: a copy would have to wait for them.
    /// `MEDIA` is whether the scene has media, `GUIDED` whether there is a guide, `LAYERS` whether any layer needs more than the picture.
    fn shade_all<const MEDIA: bool, const GUIDED: bool, const LAYERS: bool>(
        &self,
        world: &World,
        bounce: u32,
        out: &mut SampleBatch,
        scratch: &mut Scratch,
    ) {
        scratch.shadow_rays.clear();
        scratch.pending.clear();
        scratch.sorting.clear_pending();
        let count = scratch.paths.len();
        let is_last = bounce + 1 >= self.max_depth;
        let side_by_side = !MEDIA && !GUIDED && !is_last && self.shades_side_by_side(world);
        let mut alive = 0;
        for first in (0..count).step_by(BATCH) {
            let last = count.min(first + BATCH);
            if !is_last {
                scratch.draws.draw(&self.sampler, &scratch.paths[first..last], bounce, !world.scene.lights.is_empty());
            }
            scratch.escapes.look(world, self.strategy.found_by(), &scratch.rays[first..last], &scratch.hits[first..last]);
            scratch.shaded.clear();
            if side_by_side {
                self.shade_side_by_side::<LAYERS>(world, bounce, first..last, out, scratch);
            }
            for i in first..last {
                if let Some(lane) = scratch.shaded.lane(i - first) {
                    self.collect::<LAYERS>(world, bounce, [i, first], lane, out, scratch, &mut alive);
                } else {
                    self.shade::<MEDIA, GUIDED, LAYERS>(world, bounce, [i, first], out, scratch, &mut alive);
                }
            }
        }
        scratch.paths.truncate(alive);
        scratch.rays.truncate(alive);
    }

    /// Shades the hit of the path `i`, of the batch that starts with `first`.
    #[inline(always)]
    fn shade<const MEDIA: bool, const GUIDED: bool, const LAYERS: bool>(
        &self,
        world: &World,
        bounce: u32,
        [i, first]: [usize; 2],
        out: &mut SampleBatch,
        scratch: &mut Scratch,
        alive: &mut usize,
    ) {
        let Scratch { paths, rays, hits, shadow_rays, pending, media, cones, draws, escapes, turns, sorting, .. } = scratch;
        let (path, ray) = (&paths[i], &rays[i]);
        let sample = &mut out.pixels[path.slot as usize];
        let found = world.resolve(ray, hits[i]);
        let Some(at) = &found else {
            let known = escapes.of(i - first, hits[i]);
            let visible = bounce > 0 || (!self.hide_emitters && world.shows_background);
            if visible {
                sample.alpha = if bounce == 0 { world.background_alpha() } else { sample.alpha };
                let light = self.clamped(path.throughput * self.escaped(world, path, ray.direction, known), bounce);
                sample.radiance += light;
                if LAYERS && self.sorts() {
                    self.sort_escaped(world, (sorting, i), (path, bounce), (ray.direction, known), light, out);
                }
            }
            if let (true, Some(clear)) = (LAYERS, self.notes_surface(bounce, sorting.clear_of(i))) {
                self.note_escape(world, clear, (path, bounce), (ray.direction, known), out);
            }
            return;
        };
        let cone = cones.get(i).copied();
        let footprint = || world.footprint(cone.as_ref(), ray, hits[i].as_ref(), at);
        if bounce == 0 {
            sample.alpha = 1.0;
        }
        if let (true, Some(clear)) = (LAYERS, self.notes_surface(bounce, sorting.clear_of(i))) {
            let albedo = || albedo_at(world, at, ray, footprint);
            self.note_surface(world, (bounce, clear, path.slot), (at, hits[i].as_ref()), albedo, out);
        }
        let light = self.clamped(path.throughput * self.emitted(world, path, ray, at), bounce);
        out.pixels[path.slot as usize].radiance += light;
        if LAYERS && self.sorts() && !light.is_black() {
            self.sort_emitted(world, (sorting, i), at, (path.slot, bounce), light, out);
        }
        if bounce + 1 >= self.max_depth {
            return;
        }

        let mut bsdf = None;
        let boundary = if MEDIA { world.boundary_bsdf(at, ray.direction, &media[i]) } else { None };
        let mut vertex = Vertex::new(world, at, ray, footprint, &mut bsdf);
        if let Some(boundary) = &boundary {
            vertex.bsdf = boundary;
        }
        let rougher =
            self.regularization.filter(|_| path.any_non_specular_bounce).and_then(|r| vertex.bsdf.with_min_alpha(r.alpha(path.sample)));
        if let Some(rougher) = &rougher {
            vertex.bsdf = rougher;
        }
        let steering = if GUIDED { Steering::new(self, &vertex) } else { None };
        if let Some(mut shadow) = self.sample_light(world, path, &vertex, steering, draws.light.of(i - first)) {
            if MEDIA {
                let here = world.media_toward(at, ray.direction, shadow.ray.direction, &media[i].here);
                shadow.contribution *= world.transmittance(&here, &shadow.ray);
            }
            shadow_rays.push(shadow.ray);
            pending.push(Pending { contribution: self.clamped(shadow.contribution, bounce + 1), slot: path.slot });
            if LAYERS && self.sorts() {
                let way = || Way::between(vertex.bsdf, vertex.wo, vertex.frame.to_local(shadow.toward));
                sorting.push_pending(self.parts, bounce, [i, group_of(world.scene, shadow.light)], way);
            }
        }
        let note = |sample: &BsdfSample| {
            if LAYERS {
                let way = || Way::of_sample(vertex.bsdf, vertex.wo, sample);
                sorting.follow(self.parts, bounce, [i, *alive], way, || seen_through(vertex.bsdf, sample));
            }
        };
        if let Some((path, next)) = self.scatter(world, path, &vertex, bounce, (steering, turns), draws.bsdf.of(i - first), note) {
            if MEDIA {
                let here = world.media_toward(at, ray.direction, next.direction, &media[i].here);
                media[*alive] = MediaState { here, ..media[i] };
            }
            if let Some(cone) = cone {
                cones[*alive] = world.scattered_cone(cone, at.t, path.pdf);
            }
            paths[*alive] = path;
            rays[*alive] = next;
            *alive += 1;
        }
    }

    /// What a contribution brings that was scattered so many times between the light and the camera.
    #[inline]
    fn clamped(&self, contribution: Rgb, scatterings: u32) -> Rgb {
        if self.clamp == f32::INFINITY || scatterings <= 1 {
            return contribution;
        }
        let largest = contribution.max_channel();
        if largest > self.clamp { contribution * (self.clamp / largest) } else { contribution }
    }

    /// Weight of light that was found by following `direction`, against finding it by sampling the light with density `light_pdf`.
    #[inline]
    fn found_by_chance(&self, path: &Path, light_pdf: f32) -> f32 {
        if path.pdf == f32::INFINITY {
            return 1.0;
        }
        match self.strategy {
            Strategy::Mis => power_heuristic(path.pdf, light_pdf),
            Strategy::Light => 0.0,
            Strategy::Bsdf => 1.0,
        }
    }

    /// Light that the surface itself gives off against `ray`.
    #[inline(always)]
    fn emitted(&self, world: &World, path: &Path, ray: &Ray, at: &SurfaceInteraction) -> Rgb {
        let Some(id) = world.scene.surface(at.shape).light(at.prim) else {
            return Rgb::BLACK;
        };
        let Light::Area(light) = world.scene.lights.get(id) else {
            return Rgb::BLACK;
        };
        let radiance = light.radiance(&world.scene.geometry, &world.scene.textures, at, -ray.direction);
        if radiance.is_black() || path.pdf == f32::INFINITY || self.strategy != Strategy::Mis {
            return radiance * self.found_by_chance(path, 0.0);
        }
        let light_pdf =
            light.pdf(&world.scene.geometry, path.from.p, ray, at) * world.scene.lights.pmf(id, &path.from, self.strategy.found_by());
        radiance * self.found_by_chance(path, light_pdf)
    }

    /// A shadow ray towards a light, with what it brings if it is free.
    #[inline(always)]
    fn sample_light(&self, world: &World, path: &Path, vertex: &Vertex, steering: Option<Steering>, u: [f32; 4]) -> Option<ShadowRay> {
        if vertex.bsdf.is_delta() || world.scene.lights.is_empty() {
            return None;
        }
        let choice = world.scene.lights.choose(&vertex.receiver(), [u[0], u[3]], self.strategy.found_by())?;
        let light = world.scene.lights.get(choice.id);
        let sample = light.sample(&world.scene.geometry, &world.scene.textures, vertex.at.p, [u[1], u[2]], self.strategy.found_by());
        let sample = sample.as_ref()?;
        if self.strategy == Strategy::Bsdf && !sample.is_delta {
            return None;
        }
        let mut raised = None;
        let (eval, start) = vertex.eval_toward(world, sample.wi, &mut raised)?;
        let pdf = sample.pdf * choice.pmf;
        let weight = match self.strategy {
            Strategy::Mis if !sample.is_delta => {
                power_heuristic(pdf, steering.map_or(eval.pdf, |steering| steering.pdf(sample.wi, eval.pdf)))
            }
            _ => 1.0,
        };
        let contribution = path.throughput * eval.value * sample.radiance * (weight / pdf);
        if contribution.is_black() {
            return None;
        }
        Some(ShadowRay { ray: sample.shadow_ray(start), contribution, light: choice.id, toward: sample.wi })
    }

    /// The path after its next scattering with its next ray, unless it ends here; `note` learns how it is scattered.
    #[allow(clippy::too_many_arguments)]
    #[inline(always)]
    fn scatter(
        &self,
        world: &World,
        path: &Path,
        vertex: &Vertex,
        bounce: u32,
        (steering, turns): (Option<Steering>, &mut Turns),
        u: [f32; 4],
        note: impl FnOnce(&BsdfSample),
    ) -> Option<(Path, Ray)> {
        let steered = match steering {
            None => {
                let (sample, ray) = vertex.sample(world, u[0], [u[1], u[2]])?;
                Steered { sample, ray, gain: 1.0, densities: None }
            }
            Some(steering) => steering.sample(world, vertex, u[0], [u[1], u[2]])?,
        };
        let Steered { sample, ray, gain, .. } = &steered;
        let mut throughput = path.throughput * sample.weight;
        let roulette_scale = path.roulette_scale * (sample.eta * sample.eta) * gain;

        // Russian roulette: the survivors carry the weight of the dead. The chance is not capped, so a path that lost nothing goes on.
        if bounce + 1 >= self.rr_depth {
            let survival = throughput.max_channel() * roulette_scale;
            if survival < 1.0 {
                if u[3] >= survival {
                    return None;
                }
                throughput *= 1.0 / survival;
            }
        }
        if throughput.is_black() {
            return None;
        }

        if steering.is_some() {
            turns.push(vertex, &steered, path.throughput * sample.weight, path.slot);
        }
        let light_sampling = !sample.is_delta && !world.scene.lights.is_empty();
        let pdf = if light_sampling { sample.pdf } else { f32::INFINITY };
        note(sample);
        let any_non_specular_bounce = path.any_non_specular_bounce || !sample.is_delta;
        Some((Path { throughput, pdf, roulette_scale, any_non_specular_bounce, from: vertex.receiver(), ..*path }, *ray))
    }
}

/// A shadow ray and what it brings if it is free.
struct ShadowRay {
    ray: Ray,
    contribution: Rgb,
    light: LightId,
    /// The unit direction for which the surface was evaluated.
    toward: Vec3,
}
