#include "embree_shim.h"

#include <math.h>
#include <stddef.h>

#if RTC_VERSION_MAJOR != 3 && RTC_VERSION_MAJOR != 4
#error "Embree 3 or 4 is needed"
#endif

_Static_assert(sizeof(struct StRay) == 36, "StRay must match Rust's Ray");
_Static_assert(sizeof(struct RTCRay) == 48 && sizeof(struct RTCRayHit) % 16 == 0, "unexpected ray layout");
_Static_assert(sizeof(struct RTCRay16) == 12 * 64, "unexpected packet layout");

#if RTC_VERSION_MAJOR == 3

#define QUERY(call, flags_value)                                \
    struct RTCIntersectContext context;                         \
    rtcInitIntersectContext(&context);                          \
    context.flags = (flags_value);                              \
    call

#define COHERENCE(coherent) \
    ((coherent) ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT)

void st_intersect1(RTCScene scene, struct RTCRayHit* rayhit) {
    QUERY(rtcIntersect1(scene, &context, rayhit), COHERENCE(0));
}

void st_intersect16(const int* valid, RTCScene scene, struct RTCRayHit16* rayhit, int coherent) {
    QUERY(rtcIntersect16(valid, scene, &context, rayhit), COHERENCE(coherent));
}

void st_occluded1(RTCScene scene, struct RTCRay* ray) {
    QUERY(rtcOccluded1(scene, &context, ray), COHERENCE(0));
}

void st_occluded16(const int* valid, RTCScene scene, struct RTCRay16* ray, int coherent) {
    QUERY(rtcOccluded16(valid, scene, &context, ray), COHERENCE(coherent));
}

#else

#define COHERENCE(coherent) ((coherent) ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT)

void st_intersect1(RTCScene scene, struct RTCRayHit* rayhit) {
    rtcIntersect1(scene, rayhit, NULL);
}

void st_intersect16(const int* valid, RTCScene scene, struct RTCRayHit16* rayhit, int coherent) {
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = COHERENCE(coherent);
    rtcIntersect16(valid, scene, rayhit, &arguments);
}

void st_occluded1(RTCScene scene, struct RTCRay* ray) {
    rtcOccluded1(scene, ray, NULL);
}

void st_occluded16(const int* valid, RTCScene scene, struct RTCRay16* ray, int coherent) {
    struct RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = COHERENCE(coherent);
    rtcOccluded16(valid, scene, ray, &arguments);
}

#endif

/* Packets of n lanes are arrays of fields: field f of lane i is element f * n + i. (Embree's own accessors are C++ only.) The orders are
   those of RTCRay and RTCHit, asserted here. */
enum { ORG_X, ORG_Y, ORG_Z, T_NEAR, DIR_X, DIR_Y, DIR_Z, TIME, T_FAR, RAY_FIELDS = 12 };
enum { NG_X, NG_Y, NG_Z, U, V, PRIM_ID, GEOM_ID, INST_ID };

#define FIELD_OF(type, member) (offsetof(struct type, member) / sizeof(float))
_Static_assert(FIELD_OF(RTCRay, tnear) == T_NEAR && FIELD_OF(RTCRay, dir_x) == DIR_X && FIELD_OF(RTCRay, time) == TIME, "ray fields");
_Static_assert(FIELD_OF(RTCRay, tfar) == T_FAR && sizeof(struct RTCRay) == RAY_FIELDS * sizeof(float), "ray fields");
_Static_assert(FIELD_OF(RTCHit, u) == U && FIELD_OF(RTCHit, primID) == PRIM_ID, "hit fields");
_Static_assert(FIELD_OF(RTCHit, geomID) == GEOM_ID && FIELD_OF(RTCHit, instID) == INST_ID, "hit fields");

/* The hit distance of lane `i`, or a NaN. */
static float intersect_lane(const struct StShape* shape, const float* rays, unsigned int n, unsigned int i) {
    const struct StRay ray = {
        .origin = {rays[ORG_X * n + i], rays[ORG_Y * n + i], rays[ORG_Z * n + i]},
        .t_min = rays[T_NEAR * n + i],
        .direction = {rays[DIR_X * n + i], rays[DIR_Y * n + i], rays[DIR_Z * n + i]},
        .t_max = rays[T_FAR * n + i],
        .time = rays[TIME * n + i],
    };
    return shape->intersect(shape->shape, &ray);
}

static void intersect_user(const struct RTCIntersectFunctionNArguments* args) {
    const struct StShape* shape = args->geometryUserPtr;
    const unsigned int n = args->N;
    float* rays = (float*)args->rayhit;
    float* hits = rays + RAY_FIELDS * n;
    unsigned int* ids = (unsigned int*)hits;
    for (unsigned int i = 0; i < n; i++) {
        if (!args->valid[i]) continue;
        const float t = intersect_lane(shape, rays, n, i);
        /* False for a NaN: a miss. */
        if (!(t <= rays[T_FAR * n + i])) continue;
        rays[T_FAR * n + i] = t;
        hits[NG_X * n + i] = 0.0f;
        hits[NG_Y * n + i] = 0.0f;
        hits[NG_Z * n + i] = 1.0f;
        hits[U * n + i] = 0.0f;
        hits[V * n + i] = 0.0f;
        ids[PRIM_ID * n + i] = args->primID;
        ids[GEOM_ID * n + i] = args->geomID;
        ids[INST_ID * n + i] = args->context->instID[0];
    }
}

static void occluded_user(const struct RTCOccludedFunctionNArguments* args) {
    const struct StShape* shape = args->geometryUserPtr;
    const unsigned int n = args->N;
    float* rays = (float*)args->ray;
    for (unsigned int i = 0; i < n; i++) {
        if (!args->valid[i]) continue;
        const float t = intersect_lane(shape, rays, n, i);
        if (t <= rays[T_FAR * n + i]) rays[T_FAR * n + i] = -INFINITY;
    }
}

void st_set_user_geometry(RTCGeometry geometry, const struct StShape* shape, RTCBoundsFunction bounds) {
    rtcSetGeometryUserPrimitiveCount(geometry, 1);
    rtcSetGeometryUserData(geometry, (void*)shape);
    rtcSetGeometryBoundsFunction(geometry, bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, intersect_user);
    rtcSetGeometryOccludedFunction(geometry, occluded_user);
}

int st_header_version(void) {
    return RTC_VERSION_MAJOR * 10000 + RTC_VERSION_MINOR * 100 + RTC_VERSION_PATCH;
}
