//! Group C: quadrics and flat shapes.

mod accuracy;
mod equations;
mod properties;

pub use accuracy::compare_with_oracle;
use accuracy::{c1_hit_accuracy, c7_partial_shapes, c13_stored_vectors};
use equations::c10_quadratic_solver;
use properties::{
    c2_choice_of_root, c3_grid_of_rays, c4_derivatives, c5_parameters_round_trip, c6_singularities, c8_bounds,
    c9_both_queries_agree, c11_capped_solids, c12_nudged_points,
};

checks! {
    "C1" c1_hit_accuracy "accuracy of hits":
        "whole shapes, distances of 3 to 1e6 sizes, offsets of 0 and 1000, sizes of 1e-6 to 1e6, turned and stretched; \
         half of the rays within 1e-1 to 1e-6 of the silhouette; also as user geometry of Embree, alone and among \
         others; against 106 bits. The bound is rounding to f32 (one unit), plus 64 roundings of f64 relative to the \
         shape's coordinates";
    "C2" c2_choice_of_root "choice of the root":
        "origins outside, inside, on and past sphere, cylinder and cone, intervals that begin and end at the hits: \
         exact answers; exact tangents: any number; origins within 1e-6 to 2 of every shape, against 106 bits (pbrt, \
         Quadric tests)";
    "C3" c3_grid_of_rays "grid of parallel rays":
        "21 x 21 rays on turned spheres of radius 1 and 3; hit exactly where x² + y² <= r², 1e-8 from equality \
         (Mitsuba, test_sphere.py test03)";
    "C4" c4_derivatives "derivatives by finite differences":
        "rays moved by 1e-5 of the derivatives by u and v; u and v change by (1, 0) and (0, 1) (Mitsuba, \
         test_sphere.py, test_cylinder.py, test_disk.py)";
    "C5" c5_parameters_round_trip "parameters to points and back":
        "the point of u and v by the documented formula, seen by a ray of f32 on a turned and moved shape (Mitsuba, \
         test20_eval_param_consistency)";
    "C6" c6_singularities "singular points":
        "rays through poles, centres, apices and along axes; finite derivatives, orthonormal frames (Mitsuba, \
         test09_si_singularity)";
    "C7" c7_partial_shapes "parts of shapes":
        "spheres, cylinders, cones, frusta and rings cut by heights and by angles below, at and above half a turn; \
         three of four rays within 1e-1 to 1e-7 of a cut or a silhouette; against 106 bits (normals: pbrt, \
         PartialSphere.Normal)";
    "C8" c8_bounds "bounds":
        "exact box of each shape against extremes by formula; samples of placed shapes inside the box for accelerators \
         (Mitsuba, test02_bbox)";
    "C9" c9_both_queries_agree "closest hit and any hit":
        "all shapes, by the linear accelerator and Embree, one by one and in batches, intervals that end or begin at \
         the hit, one float before and one after";
    "C10" c10_quadratic_solver "quadratic equations":
        "coefficients of 1e-8 to 1e8, three of four with a discriminant of 1e-16 to 1 relative to its terms, against \
         106 bits; vanishing coefficients (pbrt, math_test DifferenceOfProducts)";
    "C11" c11_capped_solids "capped solids are closed":
        "cylinder, cone and frustum with disks for caps, turned and not; rays from inside, one in ten at a rim, and \
         rays exactly through points of a rim, through Embree and the linear accelerator";
    "C12" c12_nudged_points "points nudged off the surface":
        "rays to the centre of turned shapes; 1e-3 along the normal is outside, against it inside, and the way back is \
         free (parry, cuboid_ray_cast)";
    "C13" c13_stored_vectors "stored rays with exact hits":
        "500 rays at each shape from 3 to 1e6 away, half of them within 1e-1 to 1e-6 of a silhouette or an edge, with \
         hits of 256 bits in the sources; both for the program and for the oracle of the other checks";
}
