//! Rays and hits as Embree lays them out: one at a time, and sixteen side by side.
//!
//! A packet is filled lane by lane; the gate then runs over whole rows, which the compiler turns into vector code.

use super::gate::Gate;
use super::scene::Scene;
use super::sys::{self, RTCHit, RTCHit16, RTCRay, RTCRay16, RTCRayHit, RTCRayHit16};
use crate::accel::Coherence;
use crate::math::{Ray, Vec3};

/// Rays of one packet.
pub(super) const WIDTH: usize = 16;

/// The geometry number of a miss, and the instance number of a shape in the world: `RTC_INVALID_GEOMETRY_ID`.
pub(super) const INVALID: u32 = u32::MAX;

/// Embree ignores geometries whose mask has no bit in common with the ray's.
const ALL_GEOMETRIES: u32 = u32::MAX;

/// The numbers under which Embree reports a hit.
#[derive(Clone, Copy)]
pub(super) struct RawHit {
    pub(super) t: f32,
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) prim: u32,
    pub(super) geometry: u32,
    pub(super) instance: u32,
}

#[inline]
fn single(ray: &Ray) -> RTCRay {
    RTCRay {
        org_x: ray.origin.x,
        org_y: ray.origin.y,
        org_z: ray.origin.z,
        tnear: ray.t_min,
        dir_x: ray.direction.x,
        dir_y: ray.direction.y,
        dir_z: ray.direction.z,
        time: ray.time,
        tfar: ray.t_max,
        mask: ALL_GEOMETRIES,
        id: 0,
        flags: 0,
    }
}

/// The closest hit of one ray.
#[inline]
pub(super) fn intersect1(scene: &Scene, gate: &Gate, ray: &Ray) -> Option<RawHit> {
    if !gate.admits(ray) {
        return None;
    }
    let hit = RTCHit { geomID: INVALID, instID: [INVALID], ..RTCHit::default() };
    let mut rayhit = RTCRayHit { ray: single(ray), hit };
    // SAFETY: the scene is committed, the struct is aligned by its type, and the ray has passed the gate.
    unsafe { sys::st_intersect1(scene.handle(), &mut rayhit) };
    let hit = &rayhit.hit;
    (hit.geomID != INVALID).then(|| RawHit {
        t: rayhit.ray.tfar,
        u: hit.u,
        v: hit.v,
        prim: hit.primID,
        geometry: hit.geomID,
        instance: hit.instID[0],
    })
}

/// Whether one ray hits anything.
#[inline]
pub(super) fn occluded1(scene: &Scene, gate: &Gate, ray: &Ray) -> bool {
    if !gate.admits(ray) {
        return false;
    }
    let mut ray = single(ray);
    // SAFETY: as in `intersect1`.
    unsafe { sys::st_occluded1(scene.handle(), &mut ray) }
}

/// Which lanes Embree may look at: -1, others 0.
#[repr(C, align(64))]
struct Lanes([i32; WIDTH]);

/// Sixteen rays for closest hits, reused from packet to packet.
pub(super) struct HitPacket {
    valid: Lanes,
    rayhits: RTCRayHit16,
}

impl HitPacket {
    pub(super) fn new() -> Self {
        let ray = RTCRay16 { mask: [ALL_GEOMETRIES; WIDTH], ..RTCRay16::default() };
        Self { valid: Lanes([0; WIDTH]), rayhits: RTCRayHit16 { ray, hit: RTCHit16::default() } }
    }

    /// Traces `rays` side by side; [`hit`](Self::hit) tells the results.
    #[inline]
    pub(super) fn intersect(&mut self, scene: &Scene, gate: &Gate, rays: &[Ray; WIDTH], coherence: Coherence) {
        fill(&mut self.rayhits.ray, &mut self.valid, gate, rays);
        self.rayhits.hit.geomID = [INVALID; WIDTH];
        self.rayhits.hit.instID = [[INVALID; WIDTH]];
        // SAFETY: the scene is committed, both structs are aligned by their types, and every valid lane has passed the gate.
        unsafe { sys::st_intersect16(scene.handle(), self.valid.0.as_ptr(), &mut self.rayhits, coherence == Coherence::Coherent) };
    }

    /// The hit of one lane.
    #[inline(always)]
    pub(super) fn hit(&self, lane: usize) -> Option<RawHit> {
        let hit = &self.rayhits.hit;
        (hit.geomID[lane] != INVALID).then(|| RawHit {
            t: self.rayhits.ray.tfar[lane],
            u: hit.u[lane],
            v: hit.v[lane],
            prim: hit.primID[lane],
            geometry: hit.geomID[lane],
            instance: hit.instID[0][lane],
        })
    }
}

/// Sixteen rays for any hit, reused from packet to packet.
pub(super) struct ShadowPacket {
    valid: Lanes,
    rays: RTCRay16,
}

impl ShadowPacket {
    pub(super) fn new() -> Self {
        Self { valid: Lanes([0; WIDTH]), rays: RTCRay16 { mask: [ALL_GEOMETRIES; WIDTH], ..RTCRay16::default() } }
    }

    /// Traces `rays` side by side and tells which of them hit anything.
    #[inline]
    pub(super) fn occluded(&mut self, scene: &Scene, gate: &Gate, rays: &[Ray; WIDTH], coherence: Coherence) -> [bool; WIDTH] {
        fill(&mut self.rays, &mut self.valid, gate, rays);
        // SAFETY: as in `HitPacket::intersect`.
        unsafe { sys::st_occluded16(scene.handle(), self.valid.0.as_ptr(), &mut self.rays, coherence == Coherence::Coherent) };
        // A lane that was not traced keeps the finite end of an inactive ray.
        self.rays.tfar.map(|t_far| t_far == f32::NEG_INFINITY)
    }
}

/// Writes `rays` into the lanes, and for those that do not pass the gate harmless numbers and `valid = 0`.
#[inline(always)]
fn fill(packet: &mut RTCRay16, valid: &mut Lanes, gate: &Gate, rays: &[Ray; WIDTH]) {
    for (lane, ray) in rays.iter().enumerate() {
        put(packet, lane, ray);
    }
    for lane in 0..WIDTH {
        valid.0[lane] = -i32::from(gate.admits(&get(packet, lane)));
    }
    if valid.0.contains(&0) {
        disarm(packet, valid);
    }
}

#[cold]
fn disarm(packet: &mut RTCRay16, valid: &Lanes) {
    for lane in (0..WIDTH).filter(|&lane| valid.0[lane] == 0) {
        put(packet, lane, &Ray::INACTIVE);
    }
}

#[inline(always)]
fn put(packet: &mut RTCRay16, lane: usize, ray: &Ray) {
    packet.org_x[lane] = ray.origin.x;
    packet.org_y[lane] = ray.origin.y;
    packet.org_z[lane] = ray.origin.z;
    packet.tnear[lane] = ray.t_min;
    packet.dir_x[lane] = ray.direction.x;
    packet.dir_y[lane] = ray.direction.y;
    packet.dir_z[lane] = ray.direction.z;
    packet.time[lane] = ray.time;
    packet.tfar[lane] = ray.t_max;
}

#[inline(always)]
fn get(packet: &RTCRay16, lane: usize) -> Ray {
    Ray {
        origin: Vec3::new(packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]),
        t_min: packet.tnear[lane],
        direction: Vec3::new(packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]),
        t_max: packet.tfar[lane],
        time: packet.time[lane],
    }
}
