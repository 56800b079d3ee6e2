//! Bounds over the whole shutter interval.

use crate::geometry::{Instance, Shape};
use crate::id::{ObjectId, PrimId};
use crate::math::{Aabb, Bounds, DVec3};
use crate::stability::geometry::Rng;
use crate::stability::scenes::{deforming, motion};
use crate::stability::{Effort, Faults, Outcome};

fn holds(bounds: &Aabb, p: DVec3) -> bool {
    bounds.min.as_dvec3().cmple(p).all() && p.cmple(bounds.max.as_dvec3()).all()
}

pub(super) fn f8_motion_bounds(effort: Effort) -> Outcome {
    const TIMES: usize = 200;
    let mut rng = Rng::new(38);
    let (mut pairs, mut outside, mut looseness) = (0, Faults::NONE, Vec::new());
    for _ in 0..effort.pick(100, 4_000) {
        let (p, q) = (rng.cube(), rng.cube());
        let object = Bounds::EMPTY.extended(p).extended(q).padded();
        let Some(instance) = Instance::moving(ObjectId(0), motion(&mut rng)) else { continue };
        let bounds = instance.bounds(&object);
        let mut reached = Bounds::EMPTY;
        for i in 0..TIMES {
            let time = if i < 2 { i as f32 } else { rng.unit_f32() };
            let corner = DVec3::new([p.x, q.x][rng.below(2)], [p.y, q.y][rng.below(2)], [p.z, q.z][rng.below(2)]);
            let there = instance.transform_at(time).point(corner);
            outside.require(holds(&bounds, there), || format!("{instance:?}: {corner} at {time}"));
            reached = reached.extended(there);
            pairs += 1;
        }
        looseness.push(f64::from(bounds.area()) / f64::from(reached.padded().area()));
    }
    let mut crossed = Faults::NONE;
    for _ in 0..effort.pick(10, 100) {
        let mesh = deforming(&mut rng, 20);
        let shape = Shape::Mesh(mesh.clone());
        for _ in 0..1_000 {
            let (prim, time) = (PrimId::new(rng.below(20)), rng.unit_f32());
            let (points, bounds) = (mesh.triangle_points_at(prim, time), shape.prim_bounds(prim));
            crossed.add([points.a, points.b, points.c].iter().filter(|p| !bounds.contains(**p)).count(), || {
                format!("{points:?} at {time} in {bounds:?}")
            });
            pairs += 1;
        }
    }
    looseness.sort_by(f64::total_cmp);
    Outcome::new()
        .record("pairs of point and time", pairs as f64)
        .none("points outside of their instance's bounds", outside)
        .none("corners outside of their triangle's bounds", crossed)
        .record(
            "area of the bounds over that of the box reached, median",
            looseness.get(looseness.len() / 2).copied().unwrap_or(f64::NAN),
        )
}
