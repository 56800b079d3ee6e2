/*
 * What of Embree's interface is inline, packed or differs between versions 3 and 4, as plain functions.
 *
 * Every ray must be valid: Debian builds Embree with assertions, and an invalid ray aborts the process. The caller sees to that.
 */
#ifndef STERADIAN_EMBREE_SHIM_H
#define STERADIAN_EMBREE_SHIM_H

#include <stdbool.h>
#include <stdint.h>

#if STERADIAN_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

/* A ray as it stands in Rust. */
struct StRay {
    float origin[3];
    float t_min;
    float direction[3];
    float t_max;
    float time;
};

/* The distance at which `ray` hits `shape`, within the ray's interval; negative on a miss. */
typedef float (*StIntersect)(const void *shape, const struct StRay *ray);

/* The user data of a user geometry: one primitive. It must outlive the geometry. */
struct StUserShape {
    const void *shape;
    StIntersect intersect;
    float lower[3];
    float upper[3];
};

/* A new, committed geometry of one user primitive; null on an error. */
RTCGeometry st_new_user_geometry(RTCDevice device, const struct StUserShape *shape);

/* Closest hit. `rayhit->hit.geomID` must be invalid on entry, and stays so on a miss. */
void st_intersect1(RTCScene scene, struct RTCRayHit *rayhit);

/* Whether there is any hit. */
bool st_occluded1(RTCScene scene, struct RTCRay *ray);

/* Closest hits of the lanes whose `valid` is -1; lanes of 0 are left alone. `valid` is aligned to 64 bytes. `coherent` promises that the
   lanes start near each other and point nearly the same way. */
void st_intersect16(RTCScene scene, const int32_t *valid, struct RTCRayHit16 *rayhits, bool coherent);

/* Any hits; `tfar` of an occluded lane becomes -inf. */
void st_occluded16(RTCScene scene, const int32_t *valid, struct RTCRay16 *rays, bool coherent);

#endif
