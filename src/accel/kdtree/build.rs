//! Building by the surface area heuristic over bins, with the exact bounds of what is left of an item in a cell
//! ("perfect splits": Havran, "Heuristic Ray Shooting Algorithms"; Wald and Havran, "On building fast kd-trees for ray
//! tracing").

use super::{KdTreeOptions, Node};
use crate::accel::inspect::Item;
use crate::accel::tree::Items;
use crate::math::Aabb;

/// Planes tried along each axis of a large cell; small ones try the bounds of all parts.
const BINS: usize = 32;

/// With no more parts all their bounds are tried as planes.
const SMALL: usize = 24;

/// Cost of a step down, in units of a primitive's test.
const STEP_COST: f32 = 0.5;

/// How much cheaper a split is that cuts off empty space.
const EMPTY_BONUS: f32 = 0.8;

/// Successive splits that cost more than they save, at most.
const MAX_BAD_SPLITS: u32 = 3;

/// Levels at most, whatever the number of items.
pub const MAX_DEPTH: u32 = 60;

/// References that the tree may have for each item, on average.
const BUDGET: f64 = 12.0;

/// More cells than this in parallel.
const PARALLEL: usize = 4_096;

struct Part {
    item: u32,
    bounds: Aabb,
}

struct Cell {
    bounds: Aabb,
    parts: Vec<Part>,
    depth: u32,
    bad_splits: u32,
    budget: f64,
}

struct Plane {
    axis: usize,
    at: f32,
    cost: f32,
}

/// A cell cut in two.
struct Halves {
    plane: Plane,
    lower: Cell,
    upper: Cell,
}

/// A subtree with links relative to itself.
struct Subtree {
    nodes: Vec<Node>,
    items: Vec<Item>,
}

pub fn build(items: &Items<'_>, bounds: &Aabb, options: KdTreeOptions) -> (Vec<Node>, Vec<Item>) {
    let parts = items.bounds.iter().zip(0..).map(|(&bounds, item)| Part { item, bounds }).collect();
    let max_depth = (8.0 + 1.3 * (items.len().max(1) as f64).log2()).round() as u32;
    let builder = Builder { items, median: options.median, max_depth: max_depth.min(MAX_DEPTH) };
    let root = Cell { bounds: *bounds, parts, depth: 0, bad_splits: 0, budget: BUDGET * items.len() as f64 };
    let mut tree = builder.build(root);
    tree.nodes.shrink_to_fit();
    tree.items.shrink_to_fit();
    (tree.nodes, tree.items)
}

struct Builder<'a> {
    items: &'a Items<'a>,
    median: bool,
    max_depth: u32,
}

impl Builder<'_> {
    fn build(&self, cell: Cell) -> Subtree {
        let Some(Halves { plane, lower, upper }) = self.split(&cell) else {
            let items: Vec<_> = cell.parts.iter().map(|part| self.items.list[part.item as usize]).collect();
            return Subtree { nodes: vec![Node::leaf(0, items.len())], items };
        };
        let parallel = cell.parts.len() > PARALLEL;
        drop(cell);
        let (lower, upper) = if parallel {
            rayon::join(|| self.build(lower), || self.build(upper))
        } else {
            (self.build(lower), self.build(upper))
        };
        join(&plane, lower, upper)
    }

    /// The cell's halves, if that pays.
    fn split(&self, cell: &Cell) -> Option<Halves> {
        let count = cell.parts.len();
        if cell.depth >= self.max_depth || count <= if self.median { 4 } else { 1 } {
            return None;
        }
        let plane = if self.median { middle(&cell.bounds) } else { best_plane(cell) }?;
        let leaf_cost = count as f32;
        let hopeless = plane.cost > 4.0 * leaf_cost && count < 16;
        if !self.median && hopeless {
            return None;
        }
        let (mut below, mut above) = (cell.bounds, cell.bounds);
        below.max[plane.axis] = plane.at;
        above.min[plane.axis] = plane.at;
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        for &Part { item, bounds } in &cell.parts {
            let (min, max) = (bounds.min[plane.axis], bounds.max[plane.axis]);
            // Primitives in the plane belong to the side below it.
            if max <= plane.at {
                lower.push(Part { item, bounds });
            } else if min >= plane.at {
                upper.push(Part { item, bounds });
            } else {
                for (side, parts) in [(&below, &mut lower), (&above, &mut upper)] {
                    let bounds = self.items.clipped_bounds(item as usize, side);
                    if !bounds.is_empty() {
                        parts.push(Part { item, bounds });
                    }
                }
            }
        }
        let total = lower.len() + upper.len();
        // A half that keeps everything still pays where the other one is cut off with a few large parts, so only the
        // sum of both is judged.
        let is_bad = if self.median { lower.len().min(upper.len()) == count } else { plane.cost > leaf_cost };
        let bad_splits = cell.bad_splits + u32::from(is_bad);
        if bad_splits >= MAX_BAD_SPLITS || total as f64 > cell.budget {
            return None;
        }
        let half = |bounds: Aabb, parts: Vec<Part>| {
            let budget = cell.budget * parts.len() as f64 / total.max(1) as f64;
            Cell { bounds, parts, depth: cell.depth + 1, bad_splits, budget }
        };
        Some(Halves { plane, lower: half(below, lower), upper: half(above, upper) })
    }
}

fn join(plane: &Plane, lower: Subtree, upper: Subtree) -> Subtree {
    let (shift, first) = (1 + lower.nodes.len(), lower.items.len());
    let mut nodes = Vec::with_capacity(shift + upper.nodes.len());
    nodes.push(Node::inner(plane.axis, plane.at, shift));
    nodes.extend(lower.nodes.iter().map(|node| moved(node, 1, 0)));
    nodes.extend(upper.nodes.iter().map(|node| moved(node, shift, first)));
    let mut items = lower.items;
    items.extend(upper.items);
    Subtree { nodes, items }
}

/// A node of a subtree that starts elsewhere.
fn moved(node: &Node, nodes: usize, items: usize) -> Node {
    let shift = if node.axis() == super::LEAF { items } else { nodes };
    Node { link: node.link + ((shift as u32) << 2), ..*node }
}

/// The middle of the longest axis, if there is a number between the ends.
fn middle(bounds: &Aabb) -> Option<Plane> {
    let size = bounds.size();
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { if size.y >= size.z { 1 } else { 2 } };
    let at = bounds.center()[axis];
    (bounds.min[axis] < at && at < bounds.max[axis]).then_some(Plane { axis, at, cost: 0.0 })
}

/// The plane with the least expected cost.
fn best_plane(cell: &Cell) -> Option<Plane> {
    let mut best: Option<Plane> = None;
    let size = cell.bounds.size();
    let area = cell.bounds.area();
    if !(area > 0.0 && area < f32::INFINITY) {
        return middle(&cell.bounds).map(|plane| Plane { cost: cell.parts.len() as f32, ..plane });
    }
    for axis in 0..3 {
        let (low, high) = (cell.bounds.min[axis], cell.bounds.max[axis]);
        if !(high > low) {
            continue;
        }
        let (a, b) = (size[(axis + 1) % 3], size[(axis + 2) % 3]);
        let mut consider = |at: f32, below: usize, above: usize| {
            if !(low < at && at < high) {
                return;
            }
            let share = |width: f32| 2.0 * (a * b + width * (a + b)) / area;
            let bonus = if below == 0 || above == 0 { EMPTY_BONUS } else { 1.0 };
            let cost = bonus * (STEP_COST + share(at - low) * below as f32 + share(high - at) * above as f32);
            if cost < best.as_ref().map_or(f32::INFINITY, |b| b.cost) {
                best = Some(Plane { axis, at, cost });
            }
        };
        if cell.parts.len() <= SMALL {
            for at in cell.parts.iter().flat_map(|part| [part.bounds.min[axis], part.bounds.max[axis]]) {
                let below = cell.parts.iter().filter(|p| p.bounds.min[axis] < at || p.bounds.max[axis] <= at).count();
                let above = cell.parts.iter().filter(|p| p.bounds.max[axis] > at).count();
                consider(at, below, above);
            }
            continue;
        }
        // Counts of parts that begin and end in each bin.
        let scale = BINS as f32 / (high - low);
        let bin = |x: f32| (((x - low) * scale) as usize).min(BINS - 1);
        let (mut begins, mut ends) = ([0usize; BINS], [0usize; BINS]);
        for part in &cell.parts {
            begins[bin(part.bounds.min[axis])] += 1;
            ends[bin(part.bounds.max[axis])] += 1;
        }
        let (mut below, mut above) = (0, cell.parts.len());
        for i in 1..BINS {
            below += begins[i - 1];
            above -= ends[i - 1];
            consider(low + i as f32 / scale, below, above);
        }
    }
    best
}
