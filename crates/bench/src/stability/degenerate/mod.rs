//! Group E: degenerate input.

mod fuzz;
mod lifetime;
mod meshes;
mod rays;
mod scaling;

use fuzz::e10_mutated_files;
use lifetime::{e8_life_of_scenes, e9_memory};
use meshes::{e3_garbage_meshes, e4_identical_triangles};
use rays::{e1_invalid_rays, e2_zero_directions, e5_ends_of_intervals, e6_steps_past_hits};
use scaling::{e7_scenes_of_every_size, e11_scenes_in_every_place};

use super::{Effort, Faults, Outcome};

checks! {
    "E1" e1_invalid_rays "what is not a ray hits nothing":
        "NaN, infinity, 1e19 and the like in every part of a ray, between rays that hit and among rays of random bits; \
         meshes, instances, analytic shapes; every accelerator, every entry point (Embree, verify NaNTest and InfTest; \
         Cycles, intersection_ray_valid)";
    "E2" e2_zero_directions "directions of length zero, or hardly more":
        "from off, on and in surfaces, signs of zero mixed; components down to the smallest denormal; every \
         accelerator, every entry point";
    "E3" e3_garbage_meshes "garbage in meshes":
        "meshes of random bits; points, needles and collinear corners before a proper triangle (Embree, verify \
         GarbageGeometryTest)";
    "E4" e4_identical_triangles "identical triangles":
        "all in one place; work and memory must stay bounded (Embree, verify OverlappingGeometryTest)";
    "E5" e5_ends_of_intervals "intervals are closed at both ends":
        "hits at distances that are powers of two from 2^-20 to 2^20, intervals that end there or one float beside; \
         every accelerator and entry point";
    "E6" e6_steps_past_hits "walks from hit to hit end":
        "17 parallel planes, the first at distance 0, walked through by raising t_min; distances down to denormals \
         (Cycles, intersection_t_offset)";
    "E7" e7_scenes_of_every_size "pictures do not depend on the scene's scale":
        "meshes, analytic shapes, an instance, glass, a lens; lights of the same irradiance; against scale 1 with \
         other random numbers by Welch's test and with the same random numbers pixel by pixel; Embree and the BVH";
    "E8" e8_life_of_scenes "empty, single, large, moved and several scenes":
        "no shape; one shape; a closed mesh seen from inside; 16 moves; three accelerators in turn (Embree, verify \
         EmptySceneTest, UpdateTest, MultipleDevicesTest)";
    "E9" e9_memory "Embree gives back all memory":
        "every scene of group F built, traced and released, with each build quality (Embree, verify MemoryMonitorTest)";
    "E10" e10_mutated_files "mutated files end in errors":
        "scene, OBJ, PLY and IES files with bits, bytes, spans and numbers changed at random, read and compiled; a \
         panic or endless loop ends the check";
    "E11" e11_scenes_in_every_place "pictures do not depend on the scene's place":
        "the scene of E7 moved by up to 1e11 times the size of its shapes, against the scene at the origin with the \
         same random numbers pixel by pixel; Embree and the BVH";
}
