/*
 * Embree called in bare loops over recorded rays: what the shim is measured against. ../bare_embree.sh compiles and runs it.
 *
 * usage: bare_embree trace FILE PASSES
 *
 * FILE is what `shim dump` writes. Every line of output is `set query ns_per_ray hits checksum`; the time is the sum over blocks of rays of the
 * smallest time of all passes, which other load on the machine hardly touches.
 * Nothing is checked: a ray that is not valid would end the process.
 */
#include <embree3/rtcore.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct Ray {
    float origin[3], t_min, direction[3], t_max, time;
};

struct Hit {
    float t, u, v;
    uint32_t prim, geometry, instance;
};

struct Set {
    char name[8];
    uint32_t count;
    struct Ray *rays;
};

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e9 + t.tv_nsec;
}

static void *read_items(FILE *file, size_t size, size_t count, size_t spare) {
    void *items = malloc(size * (count + spare));
    if (!items || fread(items, size, count, file) != count) {
        fprintf(stderr, "bare_embree: the file is cut short\n");
        exit(1);
    }
    return items;
}

static void fill(struct RTCRay *out, const struct Ray *ray) {
    out->org_x = ray->origin[0];
    out->org_y = ray->origin[1];
    out->org_z = ray->origin[2];
    out->tnear = ray->t_min;
    out->dir_x = ray->direction[0];
    out->dir_y = ray->direction[1];
    out->dir_z = ray->direction[2];
    out->time = ray->time;
    out->tfar = ray->t_max;
    out->mask = 0xffffffffu;
    out->id = 0;
    out->flags = 0;
}

static void fill16(struct RTCRay16 *out, const struct Ray *rays) {
    for (int i = 0; i < 16; i++) {
        out->org_x[i] = rays[i].origin[0];
        out->org_y[i] = rays[i].origin[1];
        out->org_z[i] = rays[i].origin[2];
        out->tnear[i] = rays[i].t_min;
        out->dir_x[i] = rays[i].direction[0];
        out->dir_y[i] = rays[i].direction[1];
        out->dir_z[i] = rays[i].direction[2];
        out->time[i] = rays[i].time;
        out->tfar[i] = rays[i].t_max;
    }
}

/* The number of hits, and a sum that depends on every number of every hit and on their order. */
struct Answer {
    uint64_t number, sum;
};

static void take(struct Answer *answer, const struct Hit *hit, uint32_t ray) {
    uint32_t bits[3];
    memcpy(bits, &hit->t, sizeof bits);
    answer->number++;
    answer->sum += ((uint64_t)bits[0] + bits[1] + bits[2] + hit->prim + hit->geometry + hit->instance) * (ray + 1);
}

/* Rays one by one: what is found is used at once. */

static void closest1(RTCScene scene, const struct Ray *rays, uint32_t first, uint32_t count, struct Answer *answer) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (uint32_t i = first; i < first + count; i++) {
        struct RTCRayHit rayhit;
        fill(&rayhit.ray, &rays[i]);
        rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &rayhit);
        if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
        const struct Hit hit = {rayhit.ray.tfar, rayhit.hit.u, rayhit.hit.v, rayhit.hit.primID, rayhit.hit.geomID, rayhit.hit.instID[0]};
        take(answer, &hit, i);
    }
}

static void any1(RTCScene scene, const struct Ray *rays, uint32_t first, uint32_t count, struct Answer *answer) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (uint32_t i = first; i < first + count; i++) {
        struct RTCRay ray;
        fill(&ray, &rays[i]);
        rtcOccluded1(scene, &context, &ray);
        if (ray.tfar >= 0.0f) continue;
        answer->number++;
        answer->sum += i + 1;
    }
}

/* Sixteen rays at a time, whose answers go to arrays. `count` is a multiple of 16. */

static int valid[16] __attribute__((aligned(64)));

static void closest16(RTCScene scene, enum RTCIntersectContextFlags flags, const struct Ray *rays, uint32_t count, struct Hit *hits) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = flags;
    struct RTCRayHit16 packet;
    memset(&packet, 0, sizeof packet);
    memset(packet.ray.mask, 0xff, sizeof packet.ray.mask);
    for (uint32_t first = 0; first < count; first += 16) {
        fill16(&packet.ray, rays + first);
        memset(packet.hit.geomID, 0xff, sizeof packet.hit.geomID);
        memset(packet.hit.instID, 0xff, sizeof packet.hit.instID);
        rtcIntersect16(valid, scene, &context, &packet);
        for (int i = 0; i < 16; i++) {
            const struct Hit hit = {
                packet.ray.tfar[i], packet.hit.u[i], packet.hit.v[i],
                packet.hit.primID[i], packet.hit.geomID[i], packet.hit.instID[0][i],
            };
            hits[first + i] = hit;
        }
    }
}

static void any16(RTCScene scene, enum RTCIntersectContextFlags flags, const struct Ray *rays, uint32_t count, bool *found) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = flags;
    struct RTCRay16 packet;
    memset(&packet, 0, sizeof packet);
    memset(packet.mask, 0xff, sizeof packet.mask);
    for (uint32_t first = 0; first < count; first += 16) {
        fill16(&packet, rays + first);
        rtcOccluded16(valid, scene, &context, &packet);
        for (int i = 0; i < 16; i++) found[first + i] = packet.tfar[i] < 0.0f;
    }
}

enum Query { CLOSEST_1, CLOSEST_16, CLOSEST_16_COHERENT, ANY_1, ANY_16, ANY_16_COHERENT, QUERIES };
static const char *const query_names[QUERIES] = {"closest_1", "closest_16", "closest_16_coherent", "any_1", "any_16", "any_16_coherent"};

#define BLOCK 1024

/* Rays that are timed together, and what is found of them. */
struct Block {
    const struct Ray *rays;
    uint32_t first;
    struct Hit hits[BLOCK];
    bool found[BLOCK];
};

static void run(enum Query query, RTCScene scene, struct Block *block, struct Answer *answer) {
    const enum RTCIntersectContextFlags coherent = RTC_INTERSECT_CONTEXT_FLAG_COHERENT, incoherent = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    const struct Ray *rays = block->rays + block->first;
    switch (query) {
    case CLOSEST_1: closest1(scene, block->rays, block->first, BLOCK, answer); break;
    case CLOSEST_16: closest16(scene, incoherent, rays, BLOCK, block->hits); break;
    case CLOSEST_16_COHERENT: closest16(scene, coherent, rays, BLOCK, block->hits); break;
    case ANY_1: any1(scene, block->rays, block->first, BLOCK, answer); break;
    case ANY_16: any16(scene, incoherent, rays, BLOCK, block->found); break;
    default: any16(scene, coherent, rays, BLOCK, block->found); break;
    }
}

/* The answers of a block that went to arrays. */
static void gather(enum Query query, const struct Block *block, struct Answer *answer) {
    for (uint32_t i = 0; i < BLOCK; i++) {
        if (query == CLOSEST_16 || query == CLOSEST_16_COHERENT) {
            if (block->hits[i].geometry != RTC_INVALID_GEOMETRY_ID) take(answer, &block->hits[i], block->first + i);
        } else if (query != CLOSEST_1 && query != ANY_1 && block->found[i]) {
            answer->number++;
            answer->sum += block->first + i + 1;
        }
    }
}

static void measure(RTCScene scene, const struct Set *set, int passes) {
    static struct Block block;
    const uint32_t blocks = set->count / BLOCK;
    double *best = calloc(blocks, sizeof(double[QUERIES]));
    struct Answer answers[QUERIES];
    block.rays = set->rays;
    for (int pass = 0; pass <= passes; pass++) {
        memset(answers, 0, sizeof answers);
        for (int query = 0; query < QUERIES; query++) {
            for (uint32_t i = 0; i < blocks; i++) {
                block.first = i * BLOCK;
                const double start = now();
                run(query, scene, &block, &answers[query]);
                const double time = now() - start;
                double *smallest = best + query * blocks + i;
                /* The first pass warms up. */
                if (pass <= 1 || time < *smallest) *smallest = time;
                gather(query, &block, &answers[query]);
            }
        }
    }
    for (int query = 0; query < QUERIES; query++) {
        double total = 0;
        for (uint32_t i = 0; i < blocks; i++) total += best[query * blocks + i];
        const unsigned long long number = answers[query].number, sum = answers[query].sum;
        printf("%s %s %.2f %llu %llu\n", set->name, query_names[query], total / (blocks * BLOCK), number, sum);
    }
    free(best);
}

int main(int argc, char **argv) {
    if (argc != 4 || strcmp(argv[1], "trace") != 0) {
        fprintf(stderr, "usage: bare_embree trace FILE PASSES\n");
        return 2;
    }
    memset(valid, 0xff, sizeof valid);
    FILE *file = fopen(argv[2], "rb");
    if (!file) {
        perror(argv[2]);
        return 1;
    }
    uint32_t *counts = read_items(file, sizeof *counts, 3, 0);
    /* 16 bytes of the last vertex may be read. */
    float(*positions)[3] = read_items(file, sizeof *positions, counts[0], 1);
    uint32_t(*triangles)[3] = read_items(file, sizeof *triangles, counts[1], 0);

    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, 12, counts[0]);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles, 0, 12, counts[1]);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcCommitScene(scene);

    for (uint32_t i = 0; i < counts[2]; i++) {
        struct Set set;
        if (fread(&set, 12, 1, file) != 1) return 1;
        set.rays = read_items(file, sizeof *set.rays, set.count, 0);
        measure(scene, &set, atoi(argv[3]));
        free(set.rays);
    }
    rtcReleaseGeometry(mesh);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return 0;
}
