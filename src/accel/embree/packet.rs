//! Rays and hits as Embree lays them out: one at a time, and sixteen side by side.
//!
//! A packet is filled row by row; the gate then runs over whole rows, which the compiler turns into vector code.

use std::mem::MaybeUninit;
use std::ops::Range;

use super::gate::{RayLimits, RayWords};
use super::scene::Scene;
use super::sys::{self, RTCHit16, RTCRay, RTCRay16, RTCRayHit, RTCRayHit16, StHit};
use crate::accel::{Coherence, HitRows};
use crate::geometry::AlphaMasks;
use crate::math::rows::Row;
use crate::math::{Ray, RayRows, Vec3, Vec4};

/// Rays of one packet.
pub(super) const WIDTH: usize = 16;

/// The geometry number of a miss, and the instance number of a shape in the world: `RTC_INVALID_GEOMETRY_ID`.
pub(super) const INVALID: u32 = u32::MAX;

/// Embree ignores geometries whose mask has no bit in common with the ray's.
pub(super) const ALL_GEOMETRIES: u32 = u32::MAX;

/// What traces, and what it may be given.
pub(super) struct Tracer {
    pub(super) scene: Scene,
    pub(super) gate: RayLimits,
    /// Whether packets may be traced as frusta: not through instances, since a transform can make a component of the
    /// direction tiny.
    pub(super) frusta: bool,
    /// For the keys of rays, where shapes have holes.
    pub(super) cutouts: AlphaMasks,
}

impl Tracer {
    /// Whether a packet is traced as a frustum.
    pub(super) fn as_frustum(&self, coherence: Coherence) -> bool {
        self.frusta && coherence == Coherence::Coherent
    }

    /// The closest hit of one ray.
    #[inline(always)]
    pub(super) fn intersect(&self, ray: &Ray) -> Option<StHit> {
        let words = RayWords::new(ray);
        if !self.gate.accepts(&words) {
            return None;
        }
        let mut rayhit = MaybeUninit::<RTCRayHit>::uninit();
        let rayhit = rayhit.as_mut_ptr();
        // SAFETY: the pointer is to memory of that type; all that Embree reads is written before it is called, with a
        // ray that has passed the gate and a scene that is committed; all that is read after a hit Embree has written.
        unsafe {
            set_ray(&raw mut (*rayhit).ray, &words, self.cutouts.key(ray));
            (&raw mut (*rayhit).hit.geomID).write(INVALID);
            (&raw mut (*rayhit).hit.instID[0]).write(INVALID);
            let mut query = MaybeUninit::<sys::StQuery>::uninit();
            sys::st_intersect1(self.scene.handle(), query.as_mut_ptr(), rayhit);
            // Embree has just written these one by one; read together they would wait for its stores to reach the
            // cache.
            let hit = &raw const (*rayhit).hit;
            let geometry = (&raw const (*hit).geomID).read_volatile();
            (geometry != INVALID).then(|| StHit {
                t: (&raw const (*rayhit).ray.tfar).read_volatile(),
                u: (&raw const (*hit).u).read_volatile(),
                v: (&raw const (*hit).v).read_volatile(),
                prim: (&raw const (*hit).primID).read_volatile(),
                geometry,
                instance: (&raw const (*hit).instID[0]).read_volatile(),
            })
        }
    }

    /// Whether one ray hits anything.
    #[inline(always)]
    pub(super) fn occluded(&self, ray: &Ray) -> bool {
        let words = RayWords::new(ray);
        if !self.gate.accepts(&words) {
            return false;
        }
        let mut out = MaybeUninit::<RTCRay>::uninit();
        let out = out.as_mut_ptr();
        // SAFETY: as in `intersect`.
        unsafe {
            set_ray(out, &words, self.cutouts.key(ray));
            let mut query = MaybeUninit::<sys::StQuery>::uninit();
            sys::st_occluded1(self.scene.handle(), query.as_mut_ptr(), out);
            (*out).tfar < 0.0
        }
    }
}

/// Writes a ray in pieces of 16 bytes, which Embree reads at once; smaller ones could not be forwarded from the store
/// buffer.
///
/// # Safety
/// `out` points to memory for an `RTCRay`, initialised or not.
#[inline(always)]
unsafe fn set_ray(out: *mut RTCRay, words: &RayWords, key: u32) {
    // SAFETY: by the contract; an `RTCRay` is aligned to 16 bytes and starts with origin and `tnear`, then direction
    // and time.
    unsafe {
        out.cast::<Vec4>().write(words.origin_t_min);
        out.cast::<Vec4>().add(1).write(words.direction_time);
        (&raw mut (*out).tfar).write(words.t_max);
        (&raw mut (*out).mask).write(ALL_GEOMETRIES);
        (&raw mut (*out).id).write(key);
        (&raw mut (*out).flags).write(0);
    }
}

/// The valid lanes for Embree: -1, others 0.
#[repr(C, align(64))]
pub(super) struct LaneMask(pub(super) [i32; WIDTH]);

impl LaneMask {
    #[inline]
    fn is_full(&self) -> bool {
        !self.0.contains(&0)
    }
}

/// Sixteen rays for closest hits, reused from packet to packet.
pub(super) struct HitPacket {
    valid: LaneMask,
    rayhits: RTCRayHit16,
}

impl HitPacket {
    pub(super) fn new() -> Self {
        let ray = RTCRay16 { mask: [ALL_GEOMETRIES; WIDTH], ..RTCRay16::default() };
        Self { valid: LaneMask([0; WIDTH]), rayhits: RTCRayHit16 { ray, hit: RTCHit16::default() } }
    }

    /// Traces at most sixteen `lanes` of `rays`, the first of which is a multiple of 16; [`read`](Self::read) gives the
    /// results.
    #[inline]
    pub(super) fn intersect(&mut self, tracer: &Tracer, rays: &RayRows, lanes: Range<usize>, coherence: Coherence) {
        fill(&mut self.rayhits.ray, &mut self.valid, tracer, rays, lanes.clone());
        self.rayhits.hit.geomID = [INVALID; WIDTH];
        self.rayhits.hit.instID = [[INVALID; WIDTH]];
        // SAFETY: the scene is committed, both structs are aligned by their types, and every valid lane has passed the
        // gate.
        unsafe {
            sys::st_intersect16(
                tracer.scene.handle(),
                self.valid.0.as_ptr(),
                &mut self.rayhits,
                tracer.as_frustum(coherence),
            );
        };
        if !self.valid.is_full() {
            self.intersect_left_out(tracer, rays, lanes);
        }
    }

    /// Traces the rays that were not fit for the packet, one by one.
    #[cold]
    fn intersect_left_out(&mut self, tracer: &Tracer, rays: &RayRows, lanes: Range<usize>) {
        for (lane, ray) in lanes.enumerate().filter(|&(lane, _)| self.valid.0[lane] == 0) {
            let Some(found) = tracer.intersect(&rays.get(ray)) else { continue };
            let hit = &mut self.rayhits.hit;
            (hit.u[lane], hit.v[lane], self.rayhits.ray.tfar[lane]) = (found.u, found.v, found.t);
            (hit.primID[lane], hit.geomID[lane], hit.instID[0][lane]) = (found.prim, found.geometry, found.instance);
        }
    }

    /// Writes the hits to sixteen lanes from `first` on, with Embree's numbers: a miss is [`INVALID`] as a shape, which
    /// is [`HitRows::MISS`].
    #[inline(always)]
    pub(super) fn read(&self, hits: &mut HitRows, first: usize) {
        const { assert!(INVALID == HitRows::MISS) };
        let hit = &self.rayhits.hit;
        *lanes_mut(&mut hits.t, first) = self.rayhits.ray.tfar;
        *lanes_mut(&mut hits.u, first) = hit.u;
        *lanes_mut(&mut hits.v, first) = hit.v;
        *lanes_mut(&mut hits.prim, first) = hit.primID;
        *lanes_mut(&mut hits.shape, first) = hit.geomID;
        *lanes_mut(&mut hits.instance, first) = hit.instID[0];
    }
}

/// Sixteen rays for any hit, reused from packet to packet.
pub(super) struct ShadowPacket {
    valid: LaneMask,
    rays: RTCRay16,
}

impl ShadowPacket {
    pub(super) fn new() -> Self {
        Self { valid: LaneMask([0; WIDTH]), rays: RTCRay16 { mask: [ALL_GEOMETRIES; WIDTH], ..RTCRay16::default() } }
    }

    /// Traces at most sixteen `lanes` of `rays`, the first of which is a multiple of 16: which of them hit anything.
    #[inline]
    pub(super) fn occluded(
        &mut self,
        tracer: &Tracer,
        rays: &RayRows,
        lanes: Range<usize>,
        coherence: Coherence,
    ) -> [bool; WIDTH] {
        fill(&mut self.rays, &mut self.valid, tracer, rays, lanes.clone());
        // SAFETY: as in `HitPacket::intersect`.
        unsafe {
            sys::st_occluded16(
                tracer.scene.handle(),
                self.valid.0.as_ptr(),
                &mut self.rays,
                tracer.as_frustum(coherence),
            );
        };
        // A lane that was not traced keeps the finite end of an inactive ray.
        let mut found = self.rays.tfar.map(|t_far| t_far == f32::NEG_INFINITY);
        if !self.valid.is_full() {
            for (lane, ray) in lanes.enumerate().filter(|&(lane, _)| self.valid.0[lane] == 0) {
                found[lane] = tracer.occluded(&rays.get(ray));
            }
        }
        found
    }
}

#[inline(always)]
fn lanes<T>(row: &Row<T>, first: usize) -> &[T; WIDTH] {
    &row.as_chunks::<WIDTH>().0[first / WIDTH]
}

#[inline(always)]
fn lanes_mut<T>(row: &mut Row<T>, first: usize) -> &mut [T; WIDTH] {
    &mut row.as_chunks_mut::<WIDTH>().0[first / WIDTH]
}

/// Writes `rays` into the packet, and for those that are not fit for one harmless numbers and `valid = 0`.
#[inline(always)]
pub(super) fn fill(packet: &mut RTCRay16, valid: &mut LaneMask, tracer: &Tracer, rays: &RayRows, range: Range<usize>) {
    let first = range.start;
    let (o, d) = (&rays.origin.0, &rays.direction.0);
    (packet.org_x, packet.org_y, packet.org_z) = (*lanes(&o[0], first), *lanes(&o[1], first), *lanes(&o[2], first));
    (packet.dir_x, packet.dir_y, packet.dir_z) = (*lanes(&d[0], first), *lanes(&d[1], first), *lanes(&d[2], first));
    (packet.tnear, packet.tfar, packet.time) =
        (*lanes(&rays.t_min, first), *lanes(&rays.t_max, first), *lanes(&rays.time, first));
    for lane in 0..WIDTH {
        valid.0[lane] = -i32::from(tracer.gate.admits_to_packet(&get(packet, lane)) & (lane < range.len()));
    }
    if !valid.is_full() {
        deactivate(packet, valid);
    }
    tracer.cutouts.set_keys(rays, first, &mut packet.id);
}

#[cold]
fn deactivate(packet: &mut RTCRay16, valid: &LaneMask) {
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
