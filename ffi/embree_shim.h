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

/* A hit under Embree's numbers. */
struct StHit {
    float t, u, v;
    uint32_t prim, geometry, instance;
};

/* The distance at which `ray` hits `shape`, within the ray's interval; negative on a miss. `key` is the ray's id, `instance` Embree's. */
typedef float (*StIntersect)(const void *shape, const struct StRay *ray, uint32_t key, uint32_t instance);

/*
 * The distances at which `n` (at most 16) rays hit `shape`, negative on a miss: `t` has room for 16. `rays` are the rows of Embree's packets; lanes
 * with `valid` 0 may be anything, and so may their distances.
 */
typedef void (*StIntersectPacket)(const void *shape, const float *rays, uint32_t n, const int *valid, float *t);

/* Whether a hit of `ray` (in the space of `instance`) with the shape behind `user` counts. */
typedef bool (*StCounts)(const void *user, const struct StRay *ray, uint32_t key, const struct StHit *hit);

/* The user data of a user geometry: one primitive. It must outlive the geometry. */
struct StUserShape {
    const void *shape;
    StIntersect intersect;
    /* For several rays at once; may be null. */
    StIntersectPacket intersect_packet;
    float lower[3];
    float upper[3];
};

/*
 * Writes `ray` in the space of an instance, at the ray's time; false if it cannot be traced there.
 */
typedef bool (*StEnter)(const void *instance, const struct StRay *ray, struct StRay *inside);

/* The user data of an instance whose rays we map ourselves: it moves, or stretches unevenly. It must outlive the geometry. */
struct StEnteredInstance {
    const void *instance;
    StEnter enter;
    RTCScene object;
    float lower[3];
    float upper[3];
};

/* A new, committed geometry of one such instance; null on an error. Its hits name the geometry's number as their instance. */
RTCGeometry st_new_entered_instance(RTCDevice device, const struct StEnteredInstance *instance);

/* A new, committed geometry of one user primitive; null on an error. */
RTCGeometry st_new_user_geometry(RTCDevice device, const struct StUserShape *shape);

/* As StIntersect, for one of many primitives. */
typedef float (*StIntersectPrimitive)(const void *shape, uint32_t prim, const struct StRay *ray, uint32_t key, uint32_t instance);

/* Writes the lower and the upper corner of the bounds of a primitive. */
typedef void (*StPrimitiveBounds)(const void *shape, uint32_t prim, float *lower, float *upper);

/* The user data of a user geometry of many primitives. It must outlive the geometry. */
struct StUserPrimitives {
    const void *shape;
    uint32_t count;
    StIntersectPrimitive intersect;
    StPrimitiveBounds bounds;
};

/* A new, committed geometry of user primitives; null on an error. */
RTCGeometry st_new_user_primitives(RTCDevice device, const struct StUserPrimitives *primitives);

/*
 * The user data of curves that Embree intersects itself. Their `primitives` decide on hits closer than `reach` to the origin of a ray, among which
 * are those of the curve that the ray leaves. It must outlive the geometry.
 */
struct StCurves {
    struct StUserPrimitives primitives;
    float reach;
};

/* Lets hits with curves count only from outside and where `curves` says so. To be called before the geometry is committed. */
void st_set_curve_filter(RTCGeometry geometry, const struct StCurves *curves);

/* The user data of triangles with holes or slivers. It must outlive the geometry. */
struct StFilter {
    const void *user;
    StCounts counts;
    bool any_hit_only;
};

/* Lets hits of triangles (or only those of any-hit queries) count only where `filter_data` says so. To be called before the geometry is committed. */
void st_set_filter(RTCGeometry triangles, const struct StFilter *filter_data);

/* Room for what Embree is called with. The caller owns it, so that the calls below are jumps and cost no frame of their own. */
struct StQuery {
#if STERADIAN_EMBREE == 4
    struct RTCRayQueryContext context;
    struct RTCIntersectArguments intersect;
    struct RTCOccludedArguments occluded;
#else
    struct RTCIntersectContext context;
#endif
};

/* The closest hit of a ray; its geometry number and its instance number are set to RTC_INVALID_GEOMETRY_ID before. */
void st_intersect1(RTCScene scene, struct StQuery *query, struct RTCRayHit *rayhit);

/* Whether there is any hit: then `tfar` is negative infinity. */
void st_occluded1(RTCScene scene, struct StQuery *query, struct RTCRay *ray);

/*
 * Closest hits of the lanes whose `valid` is -1; lanes of 0 are left alone. `valid` is aligned to 64 bytes. With `coherent` the packet is
 * traced as a frustum; no direction of a valid lane may then have a component between zero and 1e-18 in magnitude, in the space of an
 * instance neither.
 */
void st_intersect16(RTCScene scene, const int32_t *valid, struct RTCRayHit16 *rayhits, bool coherent);

/* Any hits, as above; `tfar` of an occluded lane becomes -inf. */
void st_occluded16(RTCScene scene, const int32_t *valid, struct RTCRay16 *rays, bool coherent);

#endif
