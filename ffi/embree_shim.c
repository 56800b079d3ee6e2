#include "embree_shim.h"

#include <math.h>
#include <stddef.h>

_Static_assert(RTC_VERSION_MAJOR == 3 || RTC_VERSION_MAJOR == 4, "written for Embree 3 and 4");
_Static_assert(RTC_VERSION_MAJOR != 3 || RTC_VERSION >= 31200, "user callbacks get geomID since Embree 3.12");
_Static_assert(sizeof(struct StRay) == 36, "Ray is nine floats");
_Static_assert(sizeof(struct RTCRay) == 48 && sizeof(struct RTCRay16) == 16 * 48, "twelve words for each ray");
_Static_assert(offsetof(struct RTCRayHit, hit) == 48 && offsetof(struct RTCRayHit16, hit) == 16 * 48, "hits follow rays");

/* Rows of a packet of N rays and N hits: word `row * N + lane`. In C++ Embree has accessors for this, in C it has none. */
enum { ORG_X, ORG_Y, ORG_Z, TNEAR, DIR_X, DIR_Y, DIR_Z, TIME, TFAR, MASK, ID, FLAGS, HIT };
enum { NG_X, NG_Y, NG_Z, U, V, PRIM_ID, GEOM_ID, INST_ID };
#define LANES (16 * sizeof(float))
_Static_assert(offsetof(struct RTCRay16, tnear) == TNEAR * LANES && offsetof(struct RTCRay16, dir_x) == DIR_X * LANES, "rows");
_Static_assert(offsetof(struct RTCRay16, time) == TIME * LANES && offsetof(struct RTCRay16, tfar) == TFAR * LANES, "rows");
_Static_assert(offsetof(struct RTCHit16, u) == U * LANES && offsetof(struct RTCHit16, primID) == PRIM_ID * LANES, "rows");
_Static_assert(offsetof(struct RTCHit16, geomID) == GEOM_ID * LANES && offsetof(struct RTCHit16, instID) == INST_ID * LANES, "rows");

static struct StRay ray_of_lane(const float *rays, unsigned n, unsigned lane) {
    const float *row = rays + lane;
    struct StRay ray = {
        {row[ORG_X * n], row[ORG_Y * n], row[ORG_Z * n]}, row[TNEAR * n],
        {row[DIR_X * n], row[DIR_Y * n], row[DIR_Z * n]}, row[TFAR * n],
        row[TIME * n],
    };
    return ray;
}

static void user_bounds(const struct RTCBoundsFunctionArguments *args) {
    const struct StUserShape *shape = args->geometryUserPtr;
    struct RTCBounds *bounds = args->bounds_o;
    bounds->lower_x = shape->lower[0];
    bounds->lower_y = shape->lower[1];
    bounds->lower_z = shape->lower[2];
    bounds->upper_x = shape->upper[0];
    bounds->upper_y = shape->upper[1];
    bounds->upper_z = shape->upper[2];
}

static void user_intersect(const struct RTCIntersectFunctionNArguments *args) {
    const struct StUserShape *shape = args->geometryUserPtr;
    const unsigned n = args->N;
    float *rays = (float *)args->rayhit;
    float *reals = rays + HIT * n;
    unsigned *ids = (unsigned *)reals;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, n, lane);
        const float t = shape->intersect(shape->shape, &ray);
        if (!(t >= 0.0f)) continue;
        rays[TFAR * n + lane] = t;
        reals[NG_X * n + lane] = 0.0f;
        reals[NG_Y * n + lane] = 0.0f;
        reals[NG_Z * n + lane] = 0.0f;
        reals[U * n + lane] = 0.0f;
        reals[V * n + lane] = 0.0f;
        ids[PRIM_ID * n + lane] = args->primID;
        ids[GEOM_ID * n + lane] = args->geomID;
        ids[INST_ID * n + lane] = args->context->instID[0];
    }
}

static void user_occluded(const struct RTCOccludedFunctionNArguments *args) {
    const struct StUserShape *shape = args->geometryUserPtr;
    const unsigned n = args->N;
    float *rays = (float *)args->ray;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, n, lane);
        if (shape->intersect(shape->shape, &ray) >= 0.0f) rays[TFAR * n + lane] = -INFINITY;
    }
}

RTCGeometry st_new_user_geometry(RTCDevice device, const struct StUserShape *shape) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    if (!geometry) return NULL;
    rtcSetGeometryUserPrimitiveCount(geometry, 1);
    rtcSetGeometryUserData(geometry, (void *)shape);
    rtcSetGeometryBoundsFunction(geometry, user_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, user_intersect);
    rtcSetGeometryOccludedFunction(geometry, user_occluded);
    rtcCommitGeometry(geometry);
    return geometry;
}

#if RTC_VERSION_MAJOR == 3

void st_intersect1(RTCScene scene, struct RTCRayHit *rayhit) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, rayhit);
}

bool st_occluded1(RTCScene scene, struct RTCRay *ray) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, ray);
    return ray->tfar < 0.0f;
}

void st_intersect16(RTCScene scene, const int32_t *valid, struct RTCRayHit16 *rayhits, bool coherent) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect16(valid, scene, &context, rayhits);
}

void st_occluded16(RTCScene scene, const int32_t *valid, struct RTCRay16 *rays, bool coherent) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcOccluded16(valid, scene, &context, rays);
}

#else

void st_intersect1(RTCScene scene, struct RTCRayHit *rayhit) {
    rtcIntersect1(scene, rayhit, NULL);
}

bool st_occluded1(RTCScene scene, struct RTCRay *ray) {
    rtcOccluded1(scene, ray, NULL);
    return ray->tfar < 0.0f;
}

void st_intersect16(RTCScene scene, const int32_t *valid, struct RTCRayHit16 *rayhits, bool coherent) {
    struct RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    rtcIntersect16(valid, scene, rayhits, &args);
}

void st_occluded16(RTCScene scene, const int32_t *valid, struct RTCRay16 *rays, bool coherent) {
    struct RTCOccludedArguments args;
    rtcInitOccludedArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    rtcOccluded16(valid, scene, rays, &args);
}

#endif
