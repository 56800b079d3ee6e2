#include "embree_shim.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

_Static_assert(RTC_VERSION_MAJOR == 3 || RTC_VERSION_MAJOR == 4, "written for Embree 3 and 4");
_Static_assert(RTC_VERSION_MAJOR != 3 || RTC_VERSION >= 31200, "user callbacks get geomID since Embree 3.12");
_Static_assert(sizeof(struct StRay) == 36, "Ray is nine floats");
_Static_assert(offsetof(struct RTCRay, tnear) == 12 && offsetof(struct RTCRay, time) == 28, "origin and tnear, direction and time");
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

static uint32_t key_of_lane(const float *rays, unsigned n, unsigned lane) {
    return ((const uint32_t *)rays)[ID * n + lane];
}

static void set_bounds(struct RTCBounds *bounds, const float *lower, const float *upper) {
    bounds->lower_x = lower[0];
    bounds->lower_y = lower[1];
    bounds->lower_z = lower[2];
    bounds->upper_x = upper[0];
    bounds->upper_y = upper[1];
    bounds->upper_z = upper[2];
}

static void user_bounds(const struct RTCBoundsFunctionArguments *args) {
    const struct StUserShape *shape = args->geometryUserPtr;
    set_bounds(args->bounds_o, shape->lower, shape->upper);
}

/* Fewer rays are intersected one by one. */
enum { MIN_PACKET_RAYS = 3 };

/* The distances at which valid lanes hit a shape, negative on a miss; Embree's packets have at most 16 lanes. */
static void intersect_lanes(const struct StUserShape *shape, const float *rays, unsigned n, const int *valid, unsigned instance, float *t) {
    unsigned count = 0;
    for (unsigned lane = 0; lane < n; lane++) count += valid[lane] == -1;
    if (shape->intersect_packet && count >= MIN_PACKET_RAYS) {
        shape->intersect_packet(shape->shape, rays, n, valid, t);
        return;
    }
    for (unsigned lane = 0; lane < n; lane++) {
        if (valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, n, lane);
        t[lane] = shape->intersect(shape->shape, &ray, key_of_lane(rays, n, lane), instance);
    }
}

/* Sets the hits of the valid lanes whose distance is not negative. */
static void set_hits(const struct RTCIntersectFunctionNArguments *args, const float *t) {
    const unsigned n = args->N;
    float *rays = (float *)args->rayhit;
    float *reals = rays + HIT * n;
    unsigned *ids = (unsigned *)reals;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] != -1 || !(t[lane] >= 0.0f)) continue;
        rays[TFAR * n + lane] = t[lane];
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

/* Marks the valid lanes whose distance is not negative as occluded. */
static void set_occluded(const struct RTCOccludedFunctionNArguments *args, const float *t) {
    const unsigned n = args->N;
    float *rays = (float *)args->ray;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] == -1 && t[lane] >= 0.0f) rays[TFAR * n + lane] = -INFINITY;
    }
}

static void user_intersect(const struct RTCIntersectFunctionNArguments *args) {
    float t[16];
    intersect_lanes(args->geometryUserPtr, (const float *)args->rayhit, args->N, args->valid, args->context->instID[0], t);
    set_hits(args, t);
}

static void user_occluded(const struct RTCOccludedFunctionNArguments *args) {
    float t[16];
    intersect_lanes(args->geometryUserPtr, (const float *)args->ray, args->N, args->valid, args->context->instID[0], t);
    set_occluded(args, t);
}

/* Of rays and a primitive. */
struct Lanes {
    const struct StUserPrimitives *primitives;
    unsigned prim, n, instance;
};

static void intersect_primitive(struct Lanes lanes, const float *rays, const int *valid, float *t) {
    const struct StUserPrimitives *primitives = lanes.primitives;
    for (unsigned lane = 0; lane < lanes.n; lane++) {
        if (valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, lanes.n, lane);
        t[lane] = primitives->intersect(primitives->shape, lanes.prim, &ray, key_of_lane(rays, lanes.n, lane), lanes.instance);
    }
}

static void primitive_intersect(const struct RTCIntersectFunctionNArguments *args) {
    float t[16];
    const struct Lanes lanes = {args->geometryUserPtr, args->primID, args->N, args->context->instID[0]};
    intersect_primitive(lanes, (const float *)args->rayhit, args->valid, t);
    set_hits(args, t);
}

static void primitive_occluded(const struct RTCOccludedFunctionNArguments *args) {
    float t[16];
    const struct Lanes lanes = {args->geometryUserPtr, args->primID, args->N, args->context->instID[0]};
    intersect_primitive(lanes, (const float *)args->ray, args->valid, t);
    set_occluded(args, t);
}

static void primitive_bounds(const struct RTCBoundsFunctionArguments *args) {
    const struct StUserPrimitives *primitives = args->geometryUserPtr;
    float lower[3], upper[3];
    primitives->bounds(primitives->shape, args->primID, lower, upper);
    set_bounds(args->bounds_o, lower, upper);
}

static RTCGeometry new_user_geometry(
    RTCDevice device, const void *user, uint32_t count, RTCBoundsFunction bounds, RTCIntersectFunctionN intersect, RTCOccludedFunctionN occluded
) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    if (!geometry) return NULL;
    rtcSetGeometryUserPrimitiveCount(geometry, count);
    rtcSetGeometryUserData(geometry, (void *)user);
    rtcSetGeometryBoundsFunction(geometry, bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, intersect);
    rtcSetGeometryOccludedFunction(geometry, occluded);
    rtcCommitGeometry(geometry);
    return geometry;
}

RTCGeometry st_new_user_geometry(RTCDevice device, const struct StUserShape *shape) {
    return new_user_geometry(device, shape, 1, user_bounds, user_intersect, user_occluded);
}

RTCGeometry st_new_user_primitives(RTCDevice device, const struct StUserPrimitives *primitives) {
    return new_user_geometry(device, primitives, primitives->count, primitive_bounds, primitive_intersect, primitive_occluded);
}

static void filter(const struct RTCFilterFunctionNArguments *args) {
    const struct StFilter *filter_data = args->geometryUserPtr;
    const unsigned n = args->N;
    const float *rays = (const float *)args->ray;
    const float *reals = (const float *)args->hit;
    const unsigned *ids = (const unsigned *)reals;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, n, lane);
        const struct StHit hit = {
            ray.t_max, reals[U * n + lane], reals[V * n + lane],
            ids[PRIM_ID * n + lane], ids[GEOM_ID * n + lane], ids[INST_ID * n + lane],
        };
        if (!filter_data->counts(filter_data->user, &ray, key_of_lane(rays, n, lane), &hit)) args->valid[lane] = 0;
    }
}

void st_set_filter(RTCGeometry triangles, const struct StFilter *filter_data) {
    rtcSetGeometryUserData(triangles, (void *)filter_data);
    if (!filter_data->any_hit_only) rtcSetGeometryIntersectFilterFunction(triangles, filter);
    rtcSetGeometryOccludedFilterFunction(triangles, filter);
}

/* Distances of Embree may be this part of the reach too small. */
static const float CURVE_SLACK = 0.25f;

/*
 * A ray that starts this part of the reach or more above the tangent plane of its hit, a quarter of the largest radius, does not leave the curve there:
 * curves bend away from the plane, and Embree's surface is closer to that of the shape.
 */
static const float CURVE_HEIGHT = 0.0625f;

static bool curve_counts(const struct StCurves *curves, const struct RTCFilterFunctionNArguments *args, unsigned lane) {
    const unsigned n = args->N;
    const float *rays = (const float *)args->ray, *reals = (const float *)args->hit;
    struct StRay ray = ray_of_lane(rays, n, lane);
    const float *d = ray.direction;
    const float g[3] = {reals[NG_X * n + lane], reals[NG_Y * n + lane], reals[NG_Z * n + lane]};
    const float facing = g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
    /* False for a NaN. */
    if (!(facing < 0.0f)) return false;
    const float length = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (ray.t_max * length > curves->reach) return true;
    const float square = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
    /* Not where the square underflows or, for which this is false, overflows. */
    if (square > 1e-30f && ray.t_max * -facing > CURVE_HEIGHT * curves->reach * sqrtf(square)) return true;
    const unsigned *ids = (const unsigned *)reals;
    ray.t_max += CURVE_SLACK * curves->reach / length;
    const struct StUserPrimitives *primitives = &curves->primitives;
    return primitives->intersect(primitives->shape, ids[PRIM_ID * n + lane], &ray, key_of_lane(rays, n, lane), ids[INST_ID * n + lane]) >= 0.0f;
}

static void curve_filter(const struct RTCFilterFunctionNArguments *args) {
    for (unsigned lane = 0; lane < args->N; lane++) {
        if (args->valid[lane] == -1 && !curve_counts(args->geometryUserPtr, args, lane)) args->valid[lane] = 0;
    }
}

void st_set_curve_filter(RTCGeometry geometry, const struct StCurves *curves) {
    rtcSetGeometryUserData(geometry, (void *)curves);
    rtcSetGeometryIntersectFilterFunction(geometry, curve_filter);
    rtcSetGeometryOccludedFilterFunction(geometry, curve_filter);
}

typedef float Float4 __attribute__((vector_size(16), may_alias));

/* Written in pieces of 16 bytes, which Embree reads at once; smaller ones could not be forwarded from the store buffer. */
static inline void set_ray(struct RTCRay *out, const struct StRay *ray, uint32_t key) {
    Float4 direction_time;
    memcpy(&direction_time, ray->direction, sizeof direction_time);
    direction_time[3] = ray->time;
    memcpy(&out->org_x, ray->origin, sizeof(Float4));
    memcpy(&out->dir_x, &direction_time, sizeof direction_time);
    out->tfar = ray->t_max;
    out->mask = 0xffffffffu;
    out->id = key;
    out->flags = 0;
}

/* Through `instance`, whose number hits then have; RTC_INVALID_GEOMETRY_ID in the world. */
static void trace_closest(RTCScene scene, struct RTCRayHit *rayhit, unsigned instance);
static void trace_any(RTCScene scene, struct RTCRay *ray, unsigned instance);

static void entered_bounds(const struct RTCBoundsFunctionArguments *args) {
    const struct StEnteredInstance *instance = args->geometryUserPtr;
    set_bounds(args->bounds_o, instance->lower, instance->upper);
}

static void entered_intersect(const struct RTCIntersectFunctionNArguments *args) {
    const struct StEnteredInstance *instance = args->geometryUserPtr;
    const unsigned n = args->N;
    float *rays = (float *)args->rayhit;
    float *reals = rays + HIT * n;
    unsigned *ids = (unsigned *)reals;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, n, lane);
        struct StRay inside;
        if (!instance->enter(instance->instance, &ray, &inside)) continue;
        struct RTCRayHit rayhit;
        set_ray(&rayhit.ray, &inside, key_of_lane(rays, n, lane));
        rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        trace_closest(instance->object, &rayhit, args->geomID);
        if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
        rays[TFAR * n + lane] = rayhit.ray.tfar;
        reals[NG_X * n + lane] = rayhit.hit.Ng_x;
        reals[NG_Y * n + lane] = rayhit.hit.Ng_y;
        reals[NG_Z * n + lane] = rayhit.hit.Ng_z;
        reals[U * n + lane] = rayhit.hit.u;
        reals[V * n + lane] = rayhit.hit.v;
        ids[PRIM_ID * n + lane] = rayhit.hit.primID;
        ids[GEOM_ID * n + lane] = rayhit.hit.geomID;
        ids[INST_ID * n + lane] = args->geomID;
    }
}

static void entered_occluded(const struct RTCOccludedFunctionNArguments *args) {
    const struct StEnteredInstance *instance = args->geometryUserPtr;
    const unsigned n = args->N;
    float *rays = (float *)args->ray;
    for (unsigned lane = 0; lane < n; lane++) {
        if (args->valid[lane] != -1) continue;
        const struct StRay ray = ray_of_lane(rays, n, lane);
        struct StRay inside;
        if (!instance->enter(instance->instance, &ray, &inside)) continue;
        struct RTCRay traced;
        set_ray(&traced, &inside, key_of_lane(rays, n, lane));
        trace_any(instance->object, &traced, args->geomID);
        if (traced.tfar < 0.0f) rays[TFAR * n + lane] = -INFINITY;
    }
}

RTCGeometry st_new_entered_instance(RTCDevice device, const struct StEnteredInstance *instance) {
    return new_user_geometry(device, instance, 1, entered_bounds, entered_intersect, entered_occluded);
}

#if RTC_VERSION_MAJOR == 3

void st_intersect1(RTCScene scene, struct StQuery *query, struct RTCRayHit *rayhit) {
    rtcInitIntersectContext(&query->context);
    rtcIntersect1(scene, &query->context, rayhit);
}

void st_occluded1(RTCScene scene, struct StQuery *query, struct RTCRay *ray) {
    rtcInitIntersectContext(&query->context);
    rtcOccluded1(scene, &query->context, ray);
}

static void trace_closest(RTCScene scene, struct RTCRayHit *rayhit, unsigned instance) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.instID[0] = instance;
    rtcIntersect1(scene, &context, rayhit);
}

static void trace_any(RTCScene scene, struct RTCRay *ray, unsigned instance) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.instID[0] = instance;
    rtcOccluded1(scene, &context, ray);
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

void st_intersect1(RTCScene scene, struct StQuery *query, struct RTCRayHit *rayhit) {
    rtcInitRayQueryContext(&query->context);
    rtcInitIntersectArguments(&query->intersect);
    query->intersect.context = &query->context;
    rtcIntersect1(scene, rayhit, &query->intersect);
}

void st_occluded1(RTCScene scene, struct StQuery *query, struct RTCRay *ray) {
    rtcInitRayQueryContext(&query->context);
    rtcInitOccludedArguments(&query->occluded);
    query->occluded.context = &query->context;
    rtcOccluded1(scene, ray, &query->occluded);
}

static void trace_closest(RTCScene scene, struct RTCRayHit *rayhit, unsigned instance) {
    struct RTCRayQueryContext context;
    struct RTCIntersectArguments args;
    rtcInitRayQueryContext(&context);
    rtcInitIntersectArguments(&args);
    context.instID[0] = instance;
    args.context = &context;
    rtcIntersect1(scene, rayhit, &args);
}

static void trace_any(RTCScene scene, struct RTCRay *ray, unsigned instance) {
    struct RTCRayQueryContext context;
    struct RTCOccludedArguments args;
    rtcInitRayQueryContext(&context);
    rtcInitOccludedArguments(&args);
    context.instID[0] = instance;
    args.context = &context;
    rtcOccluded1(scene, ray, &args);
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
