//! Rays of a render, traced again by calls of Embree with nothing around them: what the render could not be faster
//! than.

use std::mem::MaybeUninit;

use rayon::prelude::*;

use super::EmbreeAccel;
use super::gate::RayWords;
use super::packet::{ALL_GEOMETRIES, INVALID, LaneMask, Tracer, WIDTH, fill};
use super::sys::{self, RTCHit, RTCHit16, RTCRay, RTCRay16, RTCRayHit, RTCRayHit16};
use crate::accel::Coherence;
use crate::math::{Ray, RayRows};

/// Rays of a task of one thread, about: as many as a tile has.
const CHUNK: usize = 4096;

/// Rays laid out for Embree, in the order and in the packets in which a render handed them over.
pub struct EmbreeReplay<'a, 'g> {
    accel: &'a EmbreeAccel<'g>,
    chunks: Vec<Chunk>,
}

/// What one thread traces in turn.
#[derive(Default)]
struct Chunk {
    steps: Vec<Step>,
    packets: Vec<(LaneMask, RTCRay16)>,
    singles: Vec<RTCRay>,
    rays: usize,
}

/// One call; its rays are the next ones of their kind.
enum Step {
    Packet { any_hit: bool, frustum: bool },
    Single { any_hit: bool },
}

impl<'a, 'g> EmbreeReplay<'a, 'g> {
    /// Without rays yet.
    pub fn new(accel: &'a EmbreeAccel<'g>) -> Self {
        Self { accel, chunks: Vec::new() }
    }

    /// Adds rays that were handed over together; one by one if their coherence is unspecified, or the
    /// accelerator traces all so. Rays that the
    /// accelerator traces without Embree are left out.
    pub fn push(&mut self, rays: &[Ray], any_hit: bool, coherence: Option<Coherence>) {
        if self.chunks.last().is_none_or(|chunk| chunk.rays >= CHUNK) {
            self.chunks.push(Chunk::default());
        }
        let Some(chunk) = self.chunks.last_mut() else { return };
        let tracer = &self.accel.tracer;
        match coherence.filter(|_| !self.accel.one_by_one) {
            None => rays.iter().for_each(|ray| chunk.push_single(tracer, ray, any_hit)),
            Some(coherence) => {
                for run in rays.chunks(WIDTH) {
                    chunk.push_packet(tracer, run, any_hit, coherence);
                }
            }
        }
    }

    /// Rays that Embree is given.
    pub fn rays(&self) -> u64 {
        self.chunks.iter().map(|chunk| chunk.rays as u64).sum()
    }

    /// Traces everything with the threads of the current pool; the result is the number of hits.
    pub fn trace(&self) -> u64 {
        self.chunks.par_iter().with_max_len(1).map(|chunk| chunk.trace(&self.accel.tracer)).sum()
    }
}

impl Chunk {
    fn push_single(&mut self, tracer: &Tracer, ray: &Ray, any_hit: bool) {
        if !tracer.gate.accepts(&RayWords::new(ray)) {
            return;
        }
        let (o, d) = (ray.origin, ray.direction);
        self.singles.push(RTCRay {
            org_x: o.x,
            org_y: o.y,
            org_z: o.z,
            tnear: ray.t_min,
            dir_x: d.x,
            dir_y: d.y,
            dir_z: d.z,
            time: ray.time,
            tfar: ray.t_max,
            mask: ALL_GEOMETRIES,
            id: tracer.cutouts.key(ray),
            flags: 0,
        });
        self.steps.push(Step::Single { any_hit });
        self.rays += 1;
    }

    fn push_packet(&mut self, tracer: &Tracer, run: &[Ray], any_hit: bool, coherence: Coherence) {
        let mut valid = LaneMask([0; WIDTH]);
        let mut rays = RTCRay16 { mask: [ALL_GEOMETRIES; WIDTH], ..RTCRay16::default() };
        fill(&mut rays, &mut valid, tracer, &RayRows::of(run), 0..run.len());
        let (inside, outside): (Vec<usize>, Vec<usize>) = (0..run.len()).partition(|&lane| valid.0[lane] != 0);
        if !inside.is_empty() {
            self.packets.push((valid, rays));
            self.steps.push(Step::Packet { any_hit, frustum: tracer.as_frustum(coherence) });
            self.rays += inside.len();
        }
        for lane in outside {
            self.push_single(tracer, &run[lane], any_hit);
        }
    }

    fn trace(&self, tracer: &Tracer) -> u64 {
        let (mut packets, mut singles) = (self.packets.iter(), self.singles.iter());
        let mut hits = 0;
        for step in &self.steps {
            hits += match *step {
                Step::Packet { any_hit, frustum } => {
                    packets.next().map_or(0, |(valid, rays)| trace_packet(tracer, valid, rays, any_hit, frustum))
                }
                Step::Single { any_hit } => singles.next().map_or(0, |ray| trace_single(tracer, ray, any_hit)),
            };
        }
        hits
    }
}

/// The number of hits of a packet.
fn trace_packet(tracer: &Tracer, valid: &LaneMask, rays: &RTCRay16, any_hit: bool, frustum: bool) -> u64 {
    let lanes = valid.0.as_ptr();
    if any_hit {
        let mut rays = *rays;
        // SAFETY: the scene is committed, both structs are aligned by their types, and every valid lane has passed the
        // gate.
        unsafe { sys::st_occluded16(tracer.scene.handle(), lanes, &mut rays, frustum) };
        return rays.tfar.iter().map(|t_far| u64::from(*t_far == f32::NEG_INFINITY)).sum();
    }
    let hit = RTCHit16 { geomID: [INVALID; WIDTH], instID: [[INVALID; WIDTH]], ..RTCHit16::default() };
    let mut rayhits = RTCRayHit16 { ray: *rays, hit };
    // SAFETY: as above.
    unsafe { sys::st_intersect16(tracer.scene.handle(), lanes, &mut rayhits, frustum) };
    rayhits.hit.geomID.iter().map(|geometry| u64::from(*geometry != INVALID)).sum()
}

/// 1 if the ray hits something.
fn trace_single(tracer: &Tracer, ray: &RTCRay, any_hit: bool) -> u64 {
    let mut query = MaybeUninit::<sys::StQuery>::uninit();
    if any_hit {
        let mut ray = *ray;
        // SAFETY: the scene is committed, the ray has passed the gate, and the query is memory for the shim's own use.
        unsafe { sys::st_occluded1(tracer.scene.handle(), query.as_mut_ptr(), &mut ray) };
        return u64::from(ray.tfar < 0.0);
    }
    let mut rayhit = RTCRayHit { ray: *ray, hit: RTCHit { geomID: INVALID, instID: [INVALID], ..RTCHit::default() } };
    // SAFETY: as above.
    unsafe { sys::st_intersect1(tracer.scene.handle(), query.as_mut_ptr(), &mut rayhit) };
    u64::from(rayhit.hit.geomID != INVALID)
}
