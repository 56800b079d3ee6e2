//! The hierarchy: boxes over polygons and analytic shapes.

use super::lanes::BoundingSphere;
use super::primitives::{Polygon, PrimRecord};
use super::shapes::PacketShape;
use crate::accel::bvh::{Binary, BinaryKind, MAX_LEAF, Reference};
use crate::accel::inspect::ItemKind;
use crate::accel::tree::Items;
use crate::geometry::{Geometry, Shape, TrianglePoints};
use crate::id::{PrimId, ShapeId};
use crate::math::{Aabb, DVec3, Vec3};

/// What a leaf refers to.
pub(super) enum Primitive<'g> {
    Triangle(Polygon<3>),
    Quadrilateral(Polygon<4>),
    Shape(PacketShape<'g>),
}

/// A box with what is inside.
pub(super) struct Node {
    pub bounds: Aabb,
    pub content: NodeContent,
}

/// What is in a box.
#[derive(Clone, Copy)]
pub(super) enum NodeContent {
    /// Two nodes, the first of which is nearer to smaller coordinates of an axis.
    Nodes { children: [u32; 2], axis: u32 },
    /// A run of primitives.
    Primitives { first: u32, count: u32 },
}

/// A hierarchy over a static world.
pub(in crate::accel) struct Hierarchy<'g> {
    pub(super) geometry: &'g Geometry,
    pub(super) sphere: BoundingSphere,
    /// The root first.
    pub(super) nodes: Vec<Node>,
    pub(super) primitives: Vec<Primitive<'g>>,
    /// Whether some are analytic shapes.
    pub(super) has_shapes: bool,
    /// By number: triangles of a quadrilateral follow each other.
    pub(super) prims: Vec<PrimRecord>,
}

/// The most entries that wait on the stack: one a level.
pub(super) const STACK: usize = 96;

/// Up to this number of primitives there is one leaf: a packet of incoherent rays enters most boxes anyway.
const SINGLE_LEAF: usize = 20;

/// The most primitives in a leaf.
pub(super) const MAX_PACKET_LEAF: usize = 32;
const _: () = assert!(MAX_PACKET_LEAF >= SINGLE_LEAF && MAX_PACKET_LEAF >= MAX_LEAF);

impl<'g> Hierarchy<'g> {
    /// Over shapes of the world, for rays through the world of these bounds; `None` if there is nothing to hit.
    pub fn new(geometry: &'g Geometry, shapes: &[ShapeId], world: &Aabb) -> Option<Self> {
        let items = Items::of_shapes(geometry, shapes);
        let sphere = BoundingSphere { center: world.center(), radius: (0.5 * world.size()).length() };
        if items.len() == 0 || !(sphere.radius > 0.0) || !sphere.rounding().is_finite() {
            return None;
        }
        let mut builder = Builder {
            geometry,
            items: &items,
            sphere,
            prims: Vec::new(),
            primitives: Vec::new(),
            references: Vec::new(),
        };
        builder.collect();
        let Builder { prims, primitives, references, .. } = builder;
        if references.is_empty() {
            return None;
        }
        let binary = Binary::new(references, |_| false);
        let mut primitives: Vec<_> = primitives.into_iter().map(Some).collect();
        let in_order = binary.references.iter().filter_map(|r| primitives[r.item as usize].take()).collect();
        let mut nodes = nodes(&binary, &sphere);
        if binary.references.len() <= SINGLE_LEAF {
            nodes.truncate(1);
            nodes[0].content = NodeContent::Primitives { first: 0, count: binary.references.len() as u32 };
        }
        let has_shapes = prims.iter().any(|prim| !prim.is_triangle);
        Some(Self { geometry, sphere, nodes, primitives: in_order, has_shapes, prims })
    }

    /// How many polygons and analytic shapes there are.
    pub fn len(&self) -> usize {
        self.primitives.len()
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.primitives.as_slice())
            + size_of_val(self.prims.as_slice())
    }
}

/// The nodes of a binary hierarchy, with boxes that rays do not miss by rounding.
fn nodes(binary: &Binary, sphere: &BoundingSphere) -> Vec<Node> {
    let mut nodes = Vec::new();
    let mut open = vec![(0, None)];
    while let Some((source, parent)) = open.pop() {
        let from = &binary.nodes[source];
        if let Some((parent, side)) = parent {
            let count = nodes.len() as u32;
            let Node { content: NodeContent::Nodes { children, .. }, .. } = &mut nodes[parent as usize] else {
                continue;
            };
            let children: &mut [u32; 2] = children;
            children[side as usize] = count;
        }
        let content = match from.kind() {
            BinaryKind::Leaf(range) => NodeContent::Primitives { first: range.start as u32, count: range.len() as u32 },
            BinaryKind::Inner(pair) => {
                let [a, b] = pair.map(|child| binary.nodes[child].bounds.center());
                let apart = (b - a).abs();
                let axis = (0..3).max_by(|&i, &j| apart[i].total_cmp(&apart[j])).unwrap_or(0);
                let [low, high] = if a[axis] <= b[axis] { pair } else { [pair[1], pair[0]] };
                let this = nodes.len();
                open.extend([(low, Some((this as u32, 0u32))), (high, Some((this as u32, 1)))]);
                NodeContent::Nodes { children: [0; 2], axis: axis as u32 }
            }
        };
        nodes.push(Node { bounds: sphere.widened(&from.bounds), content });
    }
    nodes
}

struct Builder<'a, 'g> {
    geometry: &'g Geometry,
    items: &'a Items<'g>,
    sphere: BoundingSphere,
    prims: Vec<PrimRecord>,
    primitives: Vec<Primitive<'g>>,
    references: Vec<Reference>,
}

impl<'g> Builder<'_, 'g> {
    /// Collects all primitives that rays can hit.
    fn collect(&mut self) {
        let mut index = 0;
        while index < self.items.len() {
            index += self.add_at(index);
        }
    }

    /// Adds the primitive at an index; returns the number of items added.
    fn add_at(&mut self, index: usize) -> usize {
        let ItemKind::Prim(shape, id) = self.items.list[index].kind() else { return 1 };
        let (number, bounds) = (self.prims.len() as u32, self.items.bounds[index]);
        let Some(points) = self.items.triangle(index) else {
            if let Shape::Analytic(placed) = self.geometry.shape(shape) {
                self.prims.push(PrimRecord::analytic(shape, id));
                self.add(Primitive::Shape(PacketShape::new(placed, number, self.sphere.widened(&bounds))), bounds);
            }
            return 1;
        };
        let n = points.cross();
        if !(n.length_squared() > 0.0) {
            return 1;
        }
        let triangle = PrimRecord::triangle(shape, id, &points);
        let Some((next, corners)) =
            self.neighbor(index + 1, shape).and_then(|next| Some((next, quadrilateral(&points, &next)?)))
        else {
            self.prims.push(triangle);
            self.add(
                Primitive::Triangle(Polygon::new(&self.sphere, [points.a, points.b, points.c], n, number)),
                bounds,
            );
            return 1;
        };
        let [a, b, c, _] = corners;
        self.prims.extend([triangle.with_neighbor([a, c], b), PrimRecord::triangle(shape, PrimId(id.0 + 1), &next)]);
        self.add(
            Primitive::Quadrilateral(Polygon::new(&self.sphere, corners, n, number)),
            bounds.union(&self.items.bounds[index + 1]),
        );
        2
    }

    /// The triangle at an index, if it belongs to a shape.
    fn neighbor(&self, index: usize, shape: ShapeId) -> Option<TrianglePoints> {
        let ItemKind::Prim(of, _) = self.items.list.get(index)?.kind() else { return None };
        (of == shape).then(|| self.items.triangle(index)).flatten()
    }

    fn add(&mut self, primitive: Primitive<'g>, bounds: Aabb) {
        self.references.push(Reference { bounds, item: self.primitives.len() as u32 });
        self.primitives.push(primitive);
    }
}

/// The corners of the flat convex quadrilateral that two triangles make, if they do: `a`, `b`, `c` are those of the
/// first, and `a`, `c`, `d` of the second, each in its order.
fn quadrilateral(first: &TrianglePoints, second: &TrianglePoints) -> Option<[Vec3; 4]> {
    let turned = |p: &TrianglePoints| [[p.a, p.b, p.c], [p.b, p.c, p.a], [p.c, p.a, p.b]];
    let pairs = turned(first).into_iter().flat_map(|p| turned(second).map(|q| (p, q)));
    let (p, q) = pairs.into_iter().find(|(p, q)| (p[0], p[2]) == (q[0], q[1]))?;
    let corners = [p[0], p[1], p[2], q[2]];
    let [a, b, c, d] = corners.map(Vec3::as_dvec3);
    let n = first.cross();
    let is_flat = n.dot(d - a) == 0.0;
    let turn = |from: DVec3, at: DVec3, to: DVec3| (at - from).cross(to - at).dot(n) > 0.0;
    (is_flat && turn(a, b, c) && turn(b, c, d) && turn(c, d, a) && turn(d, a, b)).then_some(corners)
}
