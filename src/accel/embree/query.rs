//! Queries: rays to Embree's structures and back, one at a time and 16 side by side.
//!
//! This is the gate: what is not [valid](Ray::is_valid) never reaches Embree, whose Debian build aborts the process on it.

use super::scene::CommittedScene;
use super::sys;
use crate::geometry::Hit;
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::{Ray, Vec3};

const INVALID: u32 = u32::MAX;

/// Rays in a packet.
pub const LANES: usize = 16;

#[repr(C, align(64))]
struct Aligned<T>(T);

fn ray1(ray: &Ray) -> sys::RTCRay {
    sys::RTCRay {
        org_x: ray.origin.x,
        org_y: ray.origin.y,
        org_z: ray.origin.z,
        tnear: ray.t_min,
        dir_x: ray.direction.x,
        dir_y: ray.direction.y,
        dir_z: ray.direction.z,
        time: ray.time,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// The closest hit of one ray. `first_instance` is the id of the first instance.
#[inline]
pub fn intersect(scene: &CommittedScene, first_instance: u32, ray: &Ray) -> Option<Hit> {
    if !ray.is_valid() {
        return None;
    }
    let hit = sys::RTCHit { Ng_x: 0.0, Ng_y: 0.0, Ng_z: 0.0, u: 0.0, v: 0.0, primID: INVALID, geomID: INVALID, instID: [INVALID] };
    let mut rayhit = Aligned(sys::RTCRayHit { ray: ray1(ray), hit });
    // SAFETY: the scene is committed, the structure initialised and aligned, the ray valid.
    unsafe { sys::st_intersect1(scene.handle(), &raw mut rayhit.0) };
    let sys::RTCRayHit { ray, hit } = rayhit.0;
    (hit.geomID != INVALID).then(|| Hit {
        t: ray.tfar,
        u: hit.u,
        v: hit.v,
        shape: ShapeId(hit.geomID),
        prim: PrimId(hit.primID),
        instance: instance_id(hit.instID[0], first_instance),
    })
}

/// Whether one ray hits anything.
#[inline]
pub fn occluded(scene: &CommittedScene, ray: &Ray) -> bool {
    if !ray.is_valid() {
        return false;
    }
    let mut ray = Aligned(ray1(ray));
    // SAFETY: as in `intersect`.
    unsafe { sys::st_occluded1(scene.handle(), &raw mut ray.0) };
    ray.0.tfar == f32::NEG_INFINITY
}

#[inline]
fn instance_id(id: u32, first_instance: u32) -> InstanceId {
    if id == INVALID { Hit::NO_INSTANCE } else { InstanceId(id - first_instance) }
}

/// Up to 16 rays lane by lane. Lanes without a valid ray are masked and hold a harmless one.
struct Packet {
    valid: Aligned<[i32; LANES]>,
    ray: sys::RTCRay16,
}

impl Packet {
    #[inline]
    fn new(rays: &[Ray]) -> Self {
        let mut valid = [0; LANES];
        let mut packet = sys::RTCRay16 {
            org_x: [0.0; LANES],
            org_y: [0.0; LANES],
            org_z: [0.0; LANES],
            tnear: [0.0; LANES],
            dir_x: [0.0; LANES],
            dir_y: [0.0; LANES],
            dir_z: [1.0; LANES],
            time: [0.0; LANES],
            tfar: [0.0; LANES],
            mask: [u32::MAX; LANES],
            id: [0; LANES],
            flags: [0; LANES],
        };
        for (lane, ray) in rays.iter().enumerate().take(LANES) {
            if !ray.is_valid() {
                continue;
            }
            valid[lane] = -1;
            let Vec3 { x, y, z } = ray.origin;
            (packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]) = (x, y, z);
            let Vec3 { x, y, z } = ray.direction;
            (packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]) = (x, y, z);
            packet.tnear[lane] = ray.t_min;
            packet.tfar[lane] = ray.t_max;
            packet.time[lane] = ray.time;
        }
        Self { valid: Aligned(valid), ray: packet }
    }
}

/// Closest hits of up to 16 rays, traced side by side.
pub fn intersect_packet(scene: &CommittedScene, first_instance: u32, rays: &[Ray], hits: &mut [Option<Hit>], coherent: bool) {
    let packet = Packet::new(rays);
    let hit = sys::RTCHit16 {
        Ng_x: [0.0; LANES],
        Ng_y: [0.0; LANES],
        Ng_z: [0.0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
        primID: [INVALID; LANES],
        geomID: [INVALID; LANES],
        instID: [[INVALID; LANES]],
    };
    let mut rayhit = Aligned(sys::RTCRayHit16 { ray: packet.ray, hit });
    // SAFETY: the scene is committed; mask and packet are initialised and aligned to 64 bytes; every lane holds a valid ray.
    unsafe { sys::st_intersect16(packet.valid.0.as_ptr(), scene.handle(), &raw mut rayhit.0, i32::from(coherent)) };
    let sys::RTCRayHit16 { ray, hit } = &rayhit.0;
    for (lane, out) in hits.iter_mut().enumerate().take(LANES) {
        *out = (hit.geomID[lane] != INVALID).then(|| Hit {
            t: ray.tfar[lane],
            u: hit.u[lane],
            v: hit.v[lane],
            shape: ShapeId(hit.geomID[lane]),
            prim: PrimId(hit.primID[lane]),
            instance: instance_id(hit.instID[0][lane], first_instance),
        });
    }
}

/// Whether each of up to 16 rays hits anything, traced side by side.
pub fn occluded_packet(scene: &CommittedScene, rays: &[Ray], occluded: &mut [bool], coherent: bool) {
    let packet = Packet::new(rays);
    let mut ray = Aligned(packet.ray);
    // SAFETY: as in `intersect_packet`.
    unsafe { sys::st_occluded16(packet.valid.0.as_ptr(), scene.handle(), &raw mut ray.0, i32::from(coherent)) };
    for ((out, &tfar), &valid) in occluded.iter_mut().zip(&ray.0.tfar).zip(&packet.valid.0) {
        *out = valid != 0 && tfar == f32::NEG_INFINITY;
    }
}
