use std::collections::HashMap;

use super::build::{BLOCK, BLOCK_COST, MAX_LEAF};
use super::collapse::Collapse;
use super::lanes::{Portable, SimdIsa, WideRay};
use super::wide::{Block, Entry, Wide, WideNode};
use super::*;
use crate::accel::inspect::{Inspect, Item, StructureStats};
use crate::accel::tree::testing::Sequence;
use crate::accel::tree::{SlabRay, TwoLevel};
use crate::accel::{Accelerator, AnyHitRays, Coherence, HitRows};
use crate::geometry::{
    Analytic, Geometry, Hit, Mesh, Shape, Sphere, TransformedShape, TriangleHit, TrianglePoints, TriangleRay,
};
use crate::id::{PrimId, ShapeId};
use crate::math::rows::BATCH;
use crate::math::{DAffine3, DVec3, Ray, RayRows, Transform, Vec3};

/// Fewer where an interpreter looks for undefined behaviour.
fn many(n: usize) -> usize {
    if cfg!(miri) { n.div_ceil(100) } else { n }
}

/// Points on a coarse grid now and then, so that edges, corners and planes are met exactly.
pub(super) fn corner(random: &mut Sequence) -> Vec3 {
    let p = random.vec();
    if random.below(2) == 0 { (p * 4.0).round() * 0.25 } else { p }
}

fn ray(random: &mut Sequence) -> Ray {
    let origin = corner(random) * 2.0;
    let direction = match random.below(4) {
        0 => [Vec3::X, -Vec3::Y, Vec3::new(0.0, -0.0, 1.0), Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, 1e-38, 1e-42)]
            [random.below(5)],
        1 => corner(random) - origin,
        _ => random.vec(),
    };
    let t_max = if random.below(3) == 0 { random.next().abs() * 3.0 } else { f32::INFINITY };
    Ray { t_max, t_min: if random.below(3) == 0 { t_max.min(0.3) } else { 0.0 }, ..Ray::new(origin, direction) }
}

fn block(triangles: &[TrianglePoints]) -> Block {
    let mut block = Block {
        corners: [[[0.0; BLOCK]; 3]; 3],
        items: [Item::prim(ShapeId(0), PrimId(0)); BLOCK],
        count: triangles.len() as u32,
    };
    for (lane, t) in triangles.iter().enumerate() {
        for (corner, p) in [t.a, t.b, t.c].into_iter().enumerate() {
            for axis in 0..3 {
                block.corners[corner][axis][lane] = p[axis];
            }
        }
    }
    block
}

#[test]
fn lanes_answer_as_the_shared_triangle_test_bit_for_bit() {
    assert_same_triangle_hits(Portable);
}

#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn avx2_answers_as_the_shared_triangle_test_bit_for_bit() {
    assert_same_triangle_hits(V3::try_new().unwrap());
}

fn assert_same_triangle_hits(lanes: impl SimdIsa) {
    let mut random = Sequence(5);
    let mut hits = 0;
    for _ in 0..many(60_000) {
        let triangles: Vec<_> = (0..BLOCK)
            .map(|i| {
                let (a, b) = (corner(&mut random), corner(&mut random));
                let c = if i == 3 && random.below(2) == 0 { a.lerp(b, 0.5) } else { corner(&mut random) };
                TrianglePoints { a, b, c }
            })
            .collect();
        let ray = ray(&mut random);
        if !ray.is_valid() {
            continue;
        }
        let (block, ray) = (block(&triangles), TriangleRay::from(&ray));
        let expected: Vec<_> = triangles.iter().map(|t| ray.intersect(t)).collect();
        let found = lanes.intersect(&block, &ray);
        for (lane, expected) in expected.iter().enumerate() {
            let bits = |h: TriangleHit| [h.t, h.u, h.v].map(f32::to_bits);
            let found = (found.mask >> lane & 1 == 1).then(|| bits(found.get(lane)));
            assert_eq!(found, expected.map(bits), "{ray:?} {:?}", triangles[lane]);
        }
        hits += expected.iter().flatten().count();
    }
    assert!(hits > 5_000, "{hits}");
}

#[test]
fn lanes_open_the_boxes_that_the_scalar_test_opens() {
    assert_same_boxes(Portable);
}

#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn avx2_opens_the_boxes_that_the_scalar_test_opens() {
    assert_same_boxes(V3::try_new().unwrap());
}

fn assert_same_boxes(lanes: impl SimdIsa) {
    let mut random = Sequence(6);
    for _ in 0..many(60_000) {
        let boxes: Vec<_> = (0..WIDTH)
            .map(|_| {
                let (a, b) = (corner(&mut random), corner(&mut random));
                Aabb { min: a.min(b), max: a.max(b) }
            })
            .collect();
        let used = random.below(WIDTH + 1);
        let mut node = WideNode::EMPTY;
        for (slot, bounds) in boxes[..used].iter().enumerate() {
            node.set(slot, bounds, wide::Child::NONE);
        }
        let ray = ray(&mut random);
        if !ray.is_valid() {
            continue;
        }
        let slab = SlabRay::new(&ray, &Aabb { min: -Vec3::ONE, max: Vec3::ONE }, 0.0);
        let wide_ray = WideRay::new(slab);
        let (mask, enter) = lanes.enter(&node, &wide_ray, ray.t_min, ray.t_max);
        for (slot, bounds) in boxes.iter().enumerate() {
            let scalar = slab.interval(bounds, ray.t_min, ray.t_max).filter(|_| slot < used);
            assert_eq!(mask >> slot & 1 == 1, scalar.is_some());
            assert!(scalar.is_none_or(|(near, _)| near == enter[slot]));
        }
        // All lanes, those without a hit too, are those of plain code.
        let (portable_mask, portable_enter) = Portable.enter(&node, &wide_ray, ray.t_min, ray.t_max);
        assert_eq!((mask, enter.map(f32::to_bits)), (portable_mask, portable_enter.map(f32::to_bits)));
    }
}

#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn children_are_in_the_order_of_their_octant() {
    let mut random = Sequence(12);
    let simd = V3::try_new().unwrap();
    for _ in 0..many(20_000) {
        let mut node = WideNode::EMPTY;
        for slot in 0..random.below(WIDTH + 1) {
            let (a, b) = (corner(&mut random), corner(&mut random));
            node.set(slot, &Aabb { min: a.min(b), max: a.max(b) }, wide::Child::blocks(slot, 1));
        }
        node.set_orders();
        let ray = ray(&mut random);
        if !ray.is_valid() {
            continue;
        }
        let slab = SlabRay::new(&ray, &Aabb { min: -Vec3::ONE, max: Vec3::ONE }, 0.0);
        let (mask, enter) = Portable.enter(&node, &WideRay::new(slab), ray.t_min, ray.t_max);
        for order in node.orders.into_iter().chain([WideNode::BY_SLOT]) {
            let expected: Vec<_> = (0..WIDTH)
                .map(|i| order as usize >> (3 * i) & 7)
                .filter(|slot| mask >> slot & 1 == 1)
                .map(|slot| Entry::new(enter[slot], node.children[slot]))
                .collect();
            for (entries, count) in
                [Portable.ordered(enter, order, &node.children), simd.ordered(enter, order, &node.children)]
            {
                assert_eq!(entries[..count as usize], expected);
            }
        }
        // Far to near, along the diagonal of the octant.
        let center = |slot: usize| node.get(slot).map(|(bounds, _)| bounds.min + bounds.max);
        for (octant, order) in node.orders.into_iter().enumerate() {
            let sign = |axis: usize| if octant >> axis & 1 != 0 { -1.0 } else { 1.0 };
            let centers = (0..WIDTH).filter_map(|i| center(order as usize >> (3 * i) & 7));
            let distances: Vec<f32> = centers.map(|c| (0..3).map(|axis| sign(axis) * c[axis]).sum()).collect();
            assert!(distances.is_sorted_by(|a, b| a >= b), "{distances:?}");
        }
    }
}

#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn rays_in_rows_have_the_answers_of_single_rays() {
    let mut random = Sequence(13);
    let mut geometry = soup(&mut random, 3_000);
    // Others than triangles at rest have leaves of their own.
    let sphere = Analytic::Sphere(Sphere::new(0.3, -0.3, 0.3, std::f64::consts::TAU).unwrap());
    geometry.world.push(ShapeId(1));
    geometry.shapes.push(Shape::Analytic(TransformedShape::new(sphere, Transform::IDENTITY)));
    let accel = TwoLevel::<Bvh>::new(&geometry, &BvhOptions::default(), 1);
    let mut rays: Vec<_> = (0..20_000).map(|_| ray(&mut random)).collect();
    for i in (0..rays.len()).step_by(7) {
        rays[i].t_max = random.next();
    }
    let mut hits = 0;
    // Every length of a batch.
    for count in (0..=BATCH).chain(std::iter::repeat_n(BATCH, 100)) {
        let rays: Vec<_> = rays.iter().copied().skip(random.below(rays.len() - BATCH)).take(count).collect();
        let rows = RayRows::of(&rays);
        let (mut found, mut occluded) = (HitRows::default(), [true; BATCH]);
        accel.intersect_rows(&rows, count, &mut found, Coherence::Incoherent);
        accel.occluded_rows(AnyHitRays::new(&rows, count), &mut occluded, Coherence::Coherent);
        for (lane, ray) in rays.iter().enumerate() {
            let hit = accel.intersect(ray);
            assert_eq!((found.get(lane), occluded[lane]), (hit, hit.is_some()), "{ray:?}");
            hits += usize::from(hit.is_some());
        }
    }
    assert!(hits > 2_000, "{hits}");
}

/// Against a test of all shapes but that one.
#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn end_shapes_of_any_hit_rays_are_skipped_and_nothing_else_is() {
    let mut random = Sequence(17);
    let mut geometry = soup(&mut random, 60);
    for i in 1..=12 {
        let sphere = Analytic::Sphere(Sphere::full(0.4).unwrap());
        let center = DVec3::from_array([(); 3].map(|()| f64::from(random.next())));
        let place = Transform::new(DAffine3::from_translation(center)).unwrap();
        geometry.world.push(ShapeId(i));
        geometry.shapes.push(Shape::Analytic(TransformedShape::new(sphere, place)));
    }
    let accel = TwoLevel::<Bvh>::new(&geometry, &BvhOptions::default(), 1);
    assert_eq!(geometry.world.iter().filter(|id| accel.skips_end_shape(**id)).count(), 12);
    let hits = |ray: &Ray, id: ShapeId| {
        let shape = geometry.shape(id);
        (0..shape.prim_count()).any(|i| shape.intersect_prim(ray, id, PrimId::new(i)).is_some())
    };
    let mut changed = 0;
    for _ in 0..60 {
        let rays: Vec<_> = (0..BATCH).map(|_| ray(&mut random)).collect();
        let end_shapes = [(); BATCH].map(|()| match random.below(14) as u32 {
            13 => AnyHitRays::NO_SHAPE,
            shape => shape,
        });
        let (rows, mut occluded) = (RayRows::of(&rays), [false; BATCH]);
        let rows = AnyHitRays { end_shapes: Some(&end_shapes), ..AnyHitRays::new(&rows, BATCH) };
        accel.occluded_rows(rows, &mut occluded, Coherence::Incoherent);
        for ((ray, end_shape), occluded) in rays.iter().zip(end_shapes).zip(occluded) {
            // The mesh is not skipped, for it has several primitives.
            let others = geometry.world.iter().filter(|id| id.0 == 0 || id.0 != end_shape);
            let expected = others.into_iter().any(|&id| hits(ray, id));
            assert_eq!(occluded, expected, "{ray:?} {end_shape}");
            changed += usize::from(!expected && accel.occluded(ray));
        }
    }
    assert!(changed > 50, "{changed}");
}

pub(super) fn mesh(triangles: &[[Vec3; 3]]) -> Geometry {
    let positions = triangles.iter().flatten().map(Vec3::to_array).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new(positions, indices, None, None).unwrap();
    Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() }
}

pub(super) fn soup(random: &mut Sequence, count: usize) -> Geometry {
    let triangles: Vec<_> = (0..count)
        .map(|_| {
            let center = corner(random);
            [0, 1, 2].map(|_| center + 0.1 * corner(random))
        })
        .collect();
    mesh(&triangles)
}

#[test]
#[cfg_attr(any(miri, not(avx2)), ignore = "needs AVX2")]
fn without_simd_the_answers_are_the_same() {
    let mut random = Sequence(7);
    let geometry = soup(&mut random, many(3_000));
    let simd = TwoLevel::<Bvh>::new(&geometry, &BvhOptions::default(), 1);
    let portable = TwoLevel::<Bvh>::over_world(&geometry, |items| Bvh::wide(items, None));
    assert!(portable.description().contains("scalar"));
    let mut hits = 0;
    for _ in 0..many(20_000) {
        let ray = ray(&mut random);
        let hit: Option<Hit> = simd.intersect(&ray);
        assert_eq!(portable.intersect(&ray), hit, "{ray:?}");
        assert_eq!(portable.occluded(&ray), hit.is_some(), "{ray:?}");
        hits += usize::from(hit.is_some());
    }
    assert!(hits > 2_000, "{hits}");
}

#[test]
fn any_number_of_threads_builds_the_same_tree() {
    let geometry = soup(&mut Sequence(8), many(30_000));
    let nodes = |threads: usize| {
        let accel = TwoLevel::<Bvh>::new(&geometry, &BvhOptions::default(), threads);
        let mut nodes = Vec::new();
        accel.visit_nodes(&mut |node| nodes.push((node.bounds, node.depth, node.children, node.items.to_vec())));
        nodes
    };
    assert_eq!(nodes(1), nodes(2));
}

#[test]
fn garbage_ends_in_a_bounded_tree() {
    let mut random = Sequence(9);
    let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let fan = |i: usize| {
        [Vec3::ZERO, Vec3::new((i as f32).sin(), (i as f32).cos(), 0.1), Vec3::new((i as f32).cos(), 0.2, 1.0)]
    };
    // Each triangle half as large as the one before: the worst for a surface area heuristic.
    let shrinking = |i: usize| one.map(|p| p * 0.5f32.powi(i as i32 % 120) + Vec3::splat(0.5f32.powi(i as i32 % 120)));
    let mixed = |i: usize| {
        let size = if i.is_multiple_of(2) { 1e15 } else { 1e-15 };
        [random.vec() * size, random.vec() * size, random.vec() * size]
    };
    let cases: [(&str, Vec<[Vec3; 3]>); 4] = [
        ("identical", vec![one; 100_000]),
        ("one point", (0..1000).map(fan).collect()),
        ("shrinking", (0..5_000).map(shrinking).collect()),
        ("huge and tiny", (0..2_000).map(mixed).collect()),
    ];
    for (name, triangles) in cases {
        let geometry = mesh(&triangles);
        for binary in [false, true] {
            let accel = TwoLevel::<Bvh>::new(&geometry, &BvhOptions { binary }, 0);
            let stats = StructureStats::of(&accel);
            assert_eq!(stats.references, triangles.len() as u64, "{name}");
            assert!(stats.max_leaf <= MAX_LEAF as u64 && stats.max_depth <= 48 + 17, "{name}: {stats:?}");
            assert!(accel.memory_bytes() <= 400 * triangles.len() + 1024, "{name}: {}", accel.memory_bytes());
            let ray = Ray::new(Vec3::new(0.2, 0.2, -3.0), Vec3::Z);
            assert_eq!(accel.occluded(&ray), accel.intersect(&ray).is_some(), "{name}");
        }
    }
}

#[test]
fn the_stack_holds_the_deepest_tree() {
    // The builder halves below its depth cap; this bounds the levels of the wide form for four billion references.
    let geometry = soup(&mut Sequence(10), many(5_000));
    let items = Items::of_shapes(&geometry, &geometry.world);
    let Layout::Wide(Wide { depth, .. }, _) = Bvh::wide(&items, None).0 else { panic!("a wide tree") };
    assert!(depth * (WIDTH - 1) < STACK, "{depth}");
}

/// Triangles of all sizes and shapes, which binned splits sort badly.
fn sticks(random: &mut Sequence, count: usize) -> Geometry {
    let triangles: Vec<_> = (0..count)
        .map(|_| {
            let (a, length) = (corner(random), random.next().abs().powi(4));
            [a, a + length * random.vec(), a + 0.02 * random.vec()]
        })
        .collect();
    mesh(&triangles)
}

/// The boxes and children of all nodes that are used.
fn used_nodes(binary: &Binary) -> Vec<(usize, Aabb, BinaryKind)> {
    let (mut nodes, mut open) = (Vec::new(), vec![0]);
    while let Some(index) = open.pop() {
        let mut kind = binary.nodes[index].kind();
        if let BinaryKind::Inner(children) = &mut kind {
            children.sort_unstable();
            open.extend(*children);
        }
        nodes.push((index, binary.nodes[index].bounds, kind));
    }
    nodes
}

#[test]
fn reinsertion_makes_boxes_smaller_and_keeps_all_references() {
    let geometry = sticks(&mut Sequence(11), many(6_000));
    let items = Items::of_shapes(&geometry, &geometry.world);
    let before = Binary::new(references(&items), |_| false);
    let area = |binary: &Binary| -> f64 { used_nodes(binary).iter().map(|node| f64::from(node.1.area())).sum() };

    let mut after = Binary { nodes: before.nodes.clone(), references: before.references.clone() };
    reinsertion::optimize(&mut after);
    if !cfg!(miri) {
        assert!(area(&after) < 0.97 * area(&before), "{} {}", area(&after), area(&before));
    }
    let mut found: Vec<u32> = Vec::new();
    for (_, bounds, kind) in used_nodes(&after) {
        let exact = match kind {
            BinaryKind::Inner(children) => children.map(|child| after.nodes[child].bounds).into_iter().collect(),
            BinaryKind::Leaf(range) => {
                found.extend(after.references[range.clone()].iter().map(|r| r.item));
                after.references[range].iter().map(|r| r.bounds).collect::<Vec<_>>()
            }
        };
        assert_eq!(exact.iter().fold(Aabb::EMPTY, |all, b| all.union(b)), bounds);
    }
    found.sort_unstable();
    assert_eq!(found, (0..items.len() as u32).collect::<Vec<_>>());

    let mut unchanged = Binary { nodes: before.nodes.clone(), references: before.references.clone() };
    reinsertion::optimize_up_to(&mut unchanged, 1);
    assert_eq!(used_nodes(&unchanged), used_nodes(&before), "too deep");
}

/// The least cost of a subtree as at most `count` children of a wide node, by trying all ways to split it.
struct LeastCosts<'b> {
    binary: &'b Binary,
    known: HashMap<(usize, usize), f32>,
}

impl LeastCosts<'_> {
    fn triangles(&self, index: usize) -> usize {
        match self.binary.nodes[index].kind() {
            BinaryKind::Leaf(range) => range.len(),
            BinaryKind::Inner([first, second]) => self.triangles(first) + self.triangles(second),
        }
    }

    fn get(&mut self, index: usize, count: usize) -> f32 {
        if let Some(&cost) = self.known.get(&(index, count)) {
            return cost;
        }
        let area = self.binary.nodes[index].bounds.area();
        let mut least = if self.triangles(index) <= BLOCK { area * BLOCK_COST } else { f32::INFINITY };
        if let BinaryKind::Inner(children) = self.binary.nodes[index].kind() {
            least = least.min(self.wide_node(index, children));
            for parts in 2..=count {
                least = least.min(self.parts(children, parts));
            }
        }
        self.known.insert((index, count), least);
        least
    }

    fn parts(&mut self, [first, second]: [usize; 2], count: usize) -> f32 {
        (1..count).map(|k| self.get(first, k) + self.get(second, count - k)).fold(f32::INFINITY, f32::min)
    }

    /// An inner node as a wide node.
    fn wide_node(&mut self, index: usize, children: [usize; 2]) -> f32 {
        self.binary.nodes[index].bounds.area() + self.parts(children, WIDTH)
    }
}

/// The cost of the wide node that a subtree becomes, and of all below.
fn cost(binary: &Binary, collapse: &Collapse<'_>, index: usize) -> f32 {
    let area = |index: usize| binary.nodes[index].bounds.area();
    let below = |child: usize| {
        if collapse.is_leaf(child) { area(child) * BLOCK_COST } else { cost(binary, collapse, child) }
    };
    area(index) + collapse.children(index).into_iter().map(below).sum::<f32>()
}

#[test]
fn wide_nodes_have_the_children_that_cost_least() {
    let mut random = Sequence(12);
    for count in [1, 2, 5, 9, 17, 40, 100, 300] {
        let geometry = sticks(&mut random, count);
        let items = Items::of_shapes(&geometry, &geometry.world);
        let binary = Binary::new(references(&items), |_| false);
        let found = cost(&binary, &Collapse::new(&binary, &items), 0);
        let root = binary.nodes[0].bounds.area();
        let least = match binary.nodes[0].kind() {
            BinaryKind::Leaf(_) => root + root * BLOCK_COST,
            BinaryKind::Inner(children) => LeastCosts { binary: &binary, known: HashMap::new() }.wide_node(0, children),
        };
        assert!((found - least).abs() <= 1e-5 * least, "{count}: {found} {least}");
    }
}

#[test]
fn children_that_occlude_most_for_their_cost_come_last() {
    // A large triangle fills its box better than a strip of thin ones, which fill more leaves.
    let large = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let thin = |i: usize| [4.0, 4.02, 4.0].map(|x| Vec3::new(x, i as f32 * 0.1, 0.0) + Vec3::Y * (x - 4.0) * 5.0);
    let triangles: Vec<_> = std::iter::once(large).chain((0..11).map(thin)).collect();
    let geometry = mesh(&triangles);
    let items = Items::of_shapes(&geometry, &geometry.world);
    let binary = Binary::new(references(&items), |_| false);
    let collapse = Collapse::new(&binary, &items);
    let last = *collapse.children(0).last().unwrap();
    assert_eq!(collapse.references(last).as_slice(), [0]);
}
