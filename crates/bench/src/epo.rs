//! End-point overlap of a bounding volume hierarchy (Aila, Karras, Laine, "On Quality Metrics of Bounding Volume
//! Hierarchies").

use std::collections::HashMap;

use crate::accel::inspect::{Inspect, Item, ItemKind, SAH_NODE_COST, SAH_PRIM_COST};
use crate::geometry::{Geometry, Shape};
use crate::math::{Aabb, DVec3, Vec3};

/// More triangles would take longer than the rest of a benchmark.
const MOST_TRIANGLES: usize = 2_000_000;

struct Node {
    bounds: Aabb,
    cost: f64,
    /// Leaves below it, in the order of the leaves.
    leaves: [u32; 2],
    /// The node after its subtree.
    next: usize,
}

/// The sum over all nodes of the area of the surfaces that lie in the node's box but not in its subtree, over the area
/// of all surfaces, times the node's cost. `None` unless the scene is one level of triangles, each in one leaf.
pub fn end_point_overlap(geometry: &Geometry, accel: &dyn Inspect) -> Option<f64> {
    let is_mesh = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if !mesh.is_deforming());
    let count: usize = geometry.shapes.iter().map(Shape::prim_count).sum();
    if !geometry.instances.is_empty() || count > MOST_TRIANGLES || !geometry.shapes.iter().all(is_mesh) {
        return None;
    }
    let (nodes, leaf_of) = flatten(accel)?;
    let (mut overlap, mut total) = (0.0, 0.0);
    for (item, leaf) in &leaf_of {
        let ItemKind::Prim(shape, prim) = item.kind() else { return None };
        let Shape::Mesh(mesh) = geometry.shape(shape) else { return None };
        let points = mesh.triangle_points(prim);
        let corners = [points.a, points.b, points.c].map(Vec3::as_dvec3);
        let bounds = points.bounds();
        total += points.area();
        let mut i = 0;
        while i < nodes.len() {
            let node = &nodes[i];
            let apart = !(node.bounds.min.cmple(bounds.max).all() && bounds.min.cmple(node.bounds.max).all());
            if apart {
                i = node.next;
                continue;
            }
            if !(node.leaves[0] <= *leaf && *leaf < node.leaves[1]) {
                overlap += area_inside(&corners, &node.bounds) * node.cost;
            }
            i += 1;
        }
    }
    (total > 0.0).then(|| overlap / total)
}

/// Nodes in the order of a walk in depth, and the leaf of each item.
fn flatten(accel: &dyn Inspect) -> Option<(Vec<Node>, HashMap<Item, u32>)> {
    let mut nodes: Vec<Node> = Vec::new();
    let mut depths = Vec::new();
    let mut leaf_of = HashMap::new();
    let mut leaves = 0;
    let (mut trees, mut repeated) = (0, false);
    accel.visit_nodes(&mut |node| {
        trees += u32::from(node.depth == 0);
        let cost = SAH_NODE_COST + SAH_PRIM_COST * node.items.len() as f64;
        nodes.push(Node { bounds: node.bounds, cost, leaves: [leaves, leaves], next: 0 });
        depths.push(node.depth);
        if node.children == 0 {
            repeated |= node.items.iter().any(|&item| leaf_of.insert(item, leaves).is_some());
            leaves += 1;
        }
    });
    if trees != 1 || repeated {
        return None;
    }
    // Ends of subtrees, from the back: the next node that is not deeper.
    let mut after: Vec<usize> = Vec::new();
    for i in (0..nodes.len()).rev() {
        while after.last().is_some_and(|&j| depths[j] > depths[i]) {
            after.pop();
        }
        let next = after.last().copied().unwrap_or(nodes.len());
        nodes[i].next = next;
        nodes[i].leaves[1] = nodes.get(next).map_or(leaves, |node| node.leaves[0]);
        after.push(i);
    }
    Some((nodes, leaf_of))
}

/// The area of the part of a triangle inside a box (Sutherland and Hodgman, "Reentrant Polygon Clipping").
fn area_inside(corners: &[DVec3; 3], bounds: &Aabb) -> f64 {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (limit, sign) in [(f64::from(bounds.min[axis]), 1.0), (f64::from(bounds.max[axis]), -1.0)] {
            let inside = |p: &DVec3| (p[axis] - limit) * sign;
            let mut clipped = Vec::with_capacity(polygon.len() + 1);
            for (i, p) in polygon.iter().enumerate() {
                let q = polygon[(i + 1) % polygon.len()];
                let (dp, dq) = (inside(p), inside(&q));
                if dp >= 0.0 {
                    clipped.push(*p);
                }
                if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                    clipped.push(*p + (q - *p) * (dp / (dp - dq)));
                }
            }
            polygon = clipped;
        }
    }
    let fan = polygon.windows(2).skip(1).map(|pair| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]));
    0.5 * fan.sum::<DVec3>().length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::inspect::{NodeInfo, TraversalCounts};
    use crate::geometry::{Hit, Mesh};
    use crate::id::{PrimId, ShapeId};
    use crate::math::Ray;

    /// A root with two leaves of one triangle each.
    struct TwoLeaves {
        boxes: [Aabb; 2],
    }

    impl Inspect for TwoLeaves {
        fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
            let all = self.boxes[0].union(&self.boxes[1]);
            visit(&NodeInfo { bounds: all, depth: 0, children: 2, items: &[] });
            for (i, bounds) in self.boxes.into_iter().enumerate() {
                visit(&NodeInfo { bounds, depth: 1, children: 0, items: &[Item::prim(ShapeId(0), PrimId::new(i))] });
            }
        }

        fn intersect_counted(&self, _: &Ray, _: &mut TraversalCounts) -> Option<Hit> {
            None
        }

        fn occluded_counted(&self, _: &Ray, _: &mut TraversalCounts) -> bool {
            false
        }
    }

    #[test]
    fn surfaces_in_foreign_boxes_count_by_their_area() {
        // Two right triangles side by side in the plane z = 0, with areas 1/2 and 1/2.
        let positions =
            vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
        let mesh = Mesh::new(positions, vec![[0, 1, 2], [3, 4, 5]], None, None).unwrap();
        let geometry = Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() };
        let unit = |x: f32, width: f32| Aabb { min: Vec3::new(x, 0.0, -1.0), max: Vec3::new(x + width, 1.0, 1.0) };
        let apart = TwoLeaves { boxes: [unit(0.0, 1.0), unit(2.0, 1.0)] };
        assert_eq!(end_point_overlap(&geometry, &apart), Some(0.0));
        // The first box also holds the left half of the second triangle's width: 3/8 of area 1, in a leaf of cost 2.
        let overlapping = TwoLeaves { boxes: [unit(0.0, 2.5), unit(2.0, 1.0)] };
        assert!((end_point_overlap(&geometry, &overlapping).unwrap() - 0.375 * 2.0).abs() < 1e-12);
    }
}
