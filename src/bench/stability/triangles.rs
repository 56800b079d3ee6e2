//! Group A: triangles and watertightness.

use super::geometry::{Rng, meshes, ray_through, triangle};
use super::{Effort, Outcome};
use crate::accel::{self, AccelKind, LinearAccel};
use crate::geometry::Geometry;
use crate::math::DVec3;

checks! {
    "A1" a1_triangle_hits "accuracy of triangle hits":
        "unit triangle, rays from one unit away to points with barycentrics of at least 1e-3 (Embree, verify TriangleHitTest)";
}

fn embree(geometry: &Geometry) -> Box<dyn accel::Accelerator + '_> {
    accel::build(AccelKind::EMBREE, geometry, 1).expect("Embree builds")
}

fn a1_triangle_hits(effort: Effort) -> Outcome {
    // 16 units in the last place of one.
    const BOUND: f64 = 16.0 * f32::EPSILON as f64;
    let geometry = meshes(vec![triangle(DVec3::ZERO, DVec3::X, DVec3::Y)]);
    let (embree, linear) = (embree(&geometry), LinearAccel::new(&geometry));
    let mut rng = Rng::new(1);
    let (mut missed, mut parameters, mut place, mut normal) = (0, 0f64, 0f64, 0f64);
    for _ in 0..effort.pick(10_000, 1_000_000) {
        let [_, u, v] = rng.barycentric().map(|b| 1e-3 + 0.997 * b);
        let target = DVec3::new(u, v, 0.0);
        let ray = ray_through(-DVec3::Z, target);
        for accel in [&*embree, &linear] {
            let hit = accel.intersect(&ray);
            let Some((hit, si)) = hit.and_then(|hit| Some((hit, geometry.interaction(&ray, &hit)?))) else {
                missed += 1;
                continue;
            };
            let errors = [f64::from(hit.u) - u, f64::from(hit.v) - v, f64::from(hit.t) - 1.0];
            parameters = errors.iter().fold(parameters, |worst, e| worst.max(e.abs()));
            place = place.max((si.p - target).abs().max_element());
            normal = normal.max((si.n_g.as_dvec3() - DVec3::Z).length());
        }
    }
    Outcome::new()
        .none("missed", missed)
        .at_most("error of u, v, t", parameters, BOUND)
        .at_most("error of the point", place, BOUND)
        .at_most("error of the normal", normal, BOUND)
}
