/* What is inline, packed or versioned in Embree, behind functions with one signature for Embree 3 and 4. */
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

/* A ray as plain numbers; the same layout as Rust's `Ray`. */
struct StRay {
    float origin[3];
    float t_min;
    float direction[3];
    float t_max;
    float time;
};

/* The distance of the first hit of `ray` with `shape`, or a NaN on a miss. */
typedef float (*StIntersect)(const void* shape, const struct StRay* ray);

/* The user pointer of user geometry. */
struct StShape {
    StIntersect intersect;
    const void* shape;
};

/* Closest hits of one ray and of 16; `valid` has -1 for lanes that count. */
void st_intersect1(RTCScene scene, struct RTCRayHit* rayhit);
void st_intersect16(const int* valid, RTCScene scene, struct RTCRayHit16* rayhit, int coherent);

/* Any hits: a ray that hits something gets t_far = -inf. */
void st_occluded1(RTCScene scene, struct RTCRay* ray);
void st_occluded16(const int* valid, RTCScene scene, struct RTCRay16* ray, int coherent);

/* Makes `geometry` user geometry of one primitive: `bounds` has the lower and upper corner; `shape` must outlive the geometry. */
void st_set_user_geometry(RTCGeometry geometry, const struct StShape* shape, RTCBoundsFunction bounds);

/* Version as major * 10000 + minor * 100 + patch, of the headers. */
int st_header_version(void);
