//! Meshes that are hardly any.

use super::{Effort, Faults, Outcome};
use crate::accel::inspect::{StructureStats, TraversalCounts};
use crate::accel::{AccelKind, Accelerator, LinearAccel};
use crate::geometry::{Mesh, MeshError};
use crate::math::float::EMBREE_LARGE;
use crate::math::{Aabb, DVec3, Ray};
use crate::stability::geometry::{Rng, mesh, meshes, ray, ray_through, soup, triangle};
use crate::stability::scenes::{INEXACT_RECIPROCALS, all, all_answers, build, distance_error, own};

/// A few triangles of random bits, with exponents up to `largest`; every eighth one has an index out of range.
fn garbage(rng: &mut Rng, largest: u32) -> Result<Mesh, MeshError> {
    let mut number = || {
        let bits = rng.bits() as u32;
        f32::from_bits(bits & 0x807f_ffff | ((bits >> 23 & 0xff) % (largest + 1)) << 23)
    };
    let positions: Vec<[f32; 3]> = (0..9).map(|_| [number(), number(), number()]).collect();
    let beyond = u64::from(rng.below(8) == 0);
    let triangles = (0..4).map(|_| [0; 3].map(|_| (rng.bits() % (9 + beyond)) as u32)).collect();
    Mesh::new(positions, triangles, None, None)
}

/// Whether a mesh holds only what it may hold.
fn is_valid(mesh: &Mesh) -> bool {
    let count = mesh.positions().len() as u32;
    mesh.positions().iter().flatten().all(|x| x.abs() < EMBREE_LARGE)
        && mesh.triangles().iter().flatten().all(|&i| i < count)
}

fn is_finite(bounds: &Aabb) -> bool {
    bounds.is_empty() || (bounds.min.is_finite() && bounds.max.is_finite())
}

/// Points, needles and collinear corners, and behind them a proper triangle.
fn degenerate_before_proper() -> Vec<Mesh> {
    let p = DVec3::new(0.25, 0.25, 0.0);
    vec![
        triangle(p, p, p),
        triangle(p, p, p + DVec3::X),
        triangle(DVec3::ZERO, p, 2.0 * p),
        triangle(DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.0, -1.0), DVec3::new(0.0, 1.0, -1.0)),
    ]
}

pub(super) fn e3_garbage_meshes(effort: Effort) -> Outcome {
    let mut rng = Rng::new(31);
    let (mut accepted, mut refused, mut endless) = (0, 0, 0);
    let [mut wrong, mut infinite, mut outside] = [const { Faults::NONE }; 3];
    for _ in 0..effort.pick(40, 1_000) {
        // Exponents up to 187 are below 1.8e18; up to 255 they are infinities and NaNs too.
        let found: Vec<_> = (0..20).map(|i| garbage(&mut rng, if i % 2 == 0 { 187 } else { 255 })).collect();
        refused += found.iter().filter(|mesh| mesh.is_err()).count();
        let good: Vec<Mesh> = found.into_iter().flatten().collect();
        accepted += good.len();
        wrong += Faults::of(
            &good,
            |mesh| usize::from(!is_valid(mesh)),
            |mesh| format!("{:?}, {:?}", mesh.positions(), mesh.triangles()),
        );
        let geometry = meshes(good);
        let rays: Vec<Ray> = (0..32).map(|_| ray_through(rng.cube() * rng.magnitude(-3.0, 9.0), rng.cube())).collect();
        for (name, accel) in all(&geometry) {
            infinite.require(is_finite(&accel.bounds()), || format!("{name}: {:?}", accel.bounds()));
            for hit in all_answers(&*accel, &rays).iter().flat_map(|(hits, _)| hits.iter().flatten()) {
                // Products of edges above 1e12 overflow in f32: Embree then finds hits at infinity.
                let overflown = name == "embree" && hit.t == f32::INFINITY;
                endless += usize::from(overflown);
                outside.require(overflown || (hit.t >= 0.0 && hit.t.is_finite()), || format!("{name}: {hit:?}"));
            }
        }
    }

    let geometry = meshes(degenerate_before_proper());
    let (mut lost, mut disturbed, mut worst) = (Faults::NONE, Faults::NONE, 0.0_f32);
    for (name, accel) in all(&geometry) {
        let tolerance = 2.0 * distance_error(name);
        worst = worst.max(tolerance);
        for i in 0..200 {
            let x = if i < 3 { [0.25, 0.2, 0.3][i] } else { rng.range(0.05, 0.45) };
            let ray = ray(DVec3::new(x, if i < 3 { 0.25 } else { x }, 1.0), -DVec3::Z);
            let found = accel.intersect(&ray);
            let describe = || format!("{name}: {ray:?} has {found:?}");
            lost.require(found.is_some(), describe);
            disturbed.require(found.is_none_or(|hit| hit.shape.0 == 3 && (hit.t - 2.0).abs() <= tolerance), describe);
        }
        infinite.require(is_finite(&accel.bounds()) && !accel.bounds().is_empty(), || {
            format!("{name}: {:?}", accel.bounds())
        });
    }
    let outcome = Outcome::new()
        .record("meshes of random bits accepted", accepted as f64)
        .record("refused, with the vertex or triangle at fault", refused as f64)
        .none("accepted with a number or an index that no mesh may hold", wrong)
        .none("accelerators with bounds that are not finite", infinite)
        .none("hits at distances that are none", outside)
        .record("hits that Embree, whose products overflow, finds at infinity", endless as f64)
        .none("rays through degenerate triangles that lose the proper one", lost)
        .none("rays that hit a degenerate triangle, or at a wrong distance", disturbed);
    if worst == 0.0 { outcome } else { outcome.short(INEXACT_RECIPROCALS) }
}

pub(super) fn e4_identical_triangles(effort: Effort) -> Outcome {
    let count = effort.pick(20_000, 100_000);
    let one = soup(&mut Rng::new(9), 1, 1.0);
    let positions: Vec<DVec3> = one.positions().iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let geometry = meshes(vec![mesh(&positions, vec![[0, 1, 2]; count])]);
    let center = (positions[0] + positions[1] + positions[2]) / 3.0;
    let ray = ray_through(center + DVec3::new(0.1, 0.2, 3.0), center);
    let first = |accel: &dyn Accelerator| accel.intersect(&ray).map(|hit| hit.prim.0);
    let mut others = Faults::NONE;
    let mut judge = |name: &str, found: Option<u32>| {
        others.require(found == Some(0), || format!("{name}: {ray:?} hits triangle {found:?}"));
    };
    judge("linear", first(&LinearAccel::new(&geometry)));
    let (mut depth, mut memory, mut work) = (0, 0, 0);
    for (name, accel) in own(&geometry) {
        judge(name, first(&*accel));
        memory = memory.max(accel.memory_bytes());
        let Some(inspect) = accel.inspect() else { continue };
        depth = depth.max(StructureStats::of(inspect).max_depth);
        let mut counts = TraversalCounts::default();
        inspect.intersect_counted(&ray, &mut counts);
        work = work.max(counts.nodes + counts.prims);
    }
    let embree: Vec<_> = (0..3).map(|_| first(&*build(AccelKind::EMBREE, &geometry))).collect();
    let is_first = |found: &Option<u32>| found.is_some() && *found == embree[0];
    let unstable =
        Faults::of(&embree, |found| usize::from(!is_first(found)), |_| format!("{ray:?} hits triangles {embree:?}"));
    Outcome::new()
        .record("triangles", count as f64)
        .none("accelerators other than Embree, with the oracle, that do not hit the first", others)
        .none("builds of Embree with a miss, or another triangle than the first build", unstable)
        .at_most("levels of the deepest tree", f64::from(depth), 65.0)
        .at_most("bytes for a triangle", memory as f64 / count as f64, 400.0)
        // Every triangle must be tested, and some twice where cells share them; the nodes on the way are fewer.
        .at_most("nodes and tests of a ray for a triangle", work as f64 / count as f64, 3.0)
}
