//! Building a light tree from the top: the group of greatest cost is split until a node is full.

use super::node::{Node, WIDTH};
use super::{LEAF, LightTree, NONE, Place};
use crate::light::bounds::LightBounds;
use crate::math::Aabb;
use std::ops::Range;

/// Bins along an axis.
const BINS: usize = 12;

/// Levels below which groups are split evenly: then the depth is bounded, wherever the lights are.
const MAX_COSTED_DEPTH: u32 = 16;

/// A light on its way into the tree.
#[derive(Clone, Copy)]
struct Item {
    light: u32,
    bounds: LightBounds,
}

/// A range of items.
struct Group {
    start: usize,
    end: usize,
    bounds: LightBounds,
}

impl Group {
    fn new(items: &[Item], start: usize, end: usize) -> Option<Self> {
        let bounds = items[start..end].iter().map(|item| item.bounds).reduce(|a, b| a.union(&b))?;
        Some(Self { start, end, bounds })
    }

    fn len(&self) -> usize {
        self.end - self.start
    }
}

/// Power times extent in space and directions: how badly one estimate represents the group.
fn cost(bounds: &LightBounds) -> f32 {
    // Squared diagonals separate lights on a line, whose box has no area.
    bounds.intensity * bounds.bounds.size().length_squared() * bounds.cone.measure()
}

impl LightTree {
    /// A tree over those of the lights that have bounds; `None` if there are none.
    pub fn new(lights: &[Option<LightBounds>]) -> Option<Self> {
        let mut items: Vec<Item> = lights
            .iter()
            .enumerate()
            .filter_map(|(i, bounds)| bounds.map(|bounds| Item { light: i as u32, bounds }))
            .collect();
        if items.is_empty() {
            return None;
        }
        let nowhere = Place { node: NONE, slot: 0 };
        let mut tree = Self { nodes: Vec::new(), node_places: Vec::new(), light_places: vec![nowhere; lights.len()] };
        let count = items.len();
        let root = tree.add_node(nowhere);
        tree.set_node(root, &mut items, 0..count, 0);
        tree.nodes.shrink_to_fit();
        tree.node_places.shrink_to_fit();
        Some(tree)
    }

    /// Adds an empty node; its index.
    fn add_node(&mut self, place: Place) -> u32 {
        self.nodes.push(Node::EMPTY);
        self.node_places.push(place);
        self.nodes.len() as u32 - 1
    }

    /// Sets the node over a range of items, and adds all below.
    fn set_node(&mut self, id: u32, items: &mut [Item], range: Range<usize>, depth: u32) {
        let mut groups = split_into_children(items, range.start, range.end, depth);
        // Nodes come first, one after the other.
        groups.sort_by_key(|group| group.len() == 1);
        for (slot, group) in groups.iter().enumerate() {
            let place = Place { node: id, slot: slot as u32 };
            let child = if group.len() == 1 {
                let light = items[group.start].light;
                self.light_places[light as usize] = place;
                light | LEAF
            } else {
                self.add_node(place)
            };
            self.nodes[id as usize].set(slot, &group.bounds, child);
        }
        for (slot, group) in groups.iter().enumerate().take_while(|(_, group)| group.len() > 1) {
            let child = self.nodes[id as usize].child(slot);
            self.set_node(child, items, group.start..group.end, depth + 1);
        }
    }
}

/// Up to [`WIDTH`] groups that make up the range.
fn split_into_children(items: &mut [Item], start: usize, end: usize, depth: u32) -> Vec<Group> {
    let mut groups: Vec<Group> = Group::new(items, start, end).into_iter().collect();
    while groups.len() < WIDTH {
        let rank = |group: &Group| if depth < MAX_COSTED_DEPTH { cost(&group.bounds) } else { group.len() as f32 };
        let splittable = (0..groups.len()).filter(|&i| groups[i].len() > 1);
        let Some(worst) = splittable.max_by(|&a, &b| rank(&groups[a]).total_cmp(&rank(&groups[b]))) else { break };
        let group = groups.swap_remove(worst);
        let middle = split(items, &group, depth);
        groups.extend(Group::new(items, group.start, middle));
        groups.extend(Group::new(items, middle, group.end));
    }
    groups
}

/// Reorders a group of at least two into two; where the second begins.
fn split(items: &mut [Item], group: &Group, depth: u32) -> usize {
    let items = &mut items[group.start..group.end];
    let center = |item: &Item| item.bounds.bounds.center();
    let centers = items.iter().fold(Aabb::EMPTY, |b, item| b.extended(center(item)));
    let size = centers.size();
    let best = if depth < MAX_COSTED_DEPTH { best_plane(items, &centers) } else { None };
    if let Some(plane) = best {
        let middle = partition(items, |item| bin(center(item)[plane.axis], &centers, plane.axis) < plane.bin);
        if middle > 0 && middle < items.len() {
            return group.start + middle;
        }
    }
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let middle = items.len() / 2;
    items
        .select_nth_unstable_by(middle, |a, b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.light.cmp(&b.light)));
    group.start + middle
}

#[inline]
fn bin(x: f32, centers: &Aabb, axis: usize) -> usize {
    let share = (x - centers.min[axis]) / (centers.max[axis] - centers.min[axis]);
    ((share * BINS as f32) as usize).min(BINS - 1)
}

/// Items of lower bins than `bin` along `axis` go to the first group.
struct Plane {
    axis: usize,
    bin: usize,
}

/// The plane of least cost, costs along short axes counted higher; `None` if no plane parts the centres.
fn best_plane(items: &[Item], centers: &Aabb) -> Option<Plane> {
    let size = centers.size();
    let mut best: Option<(f32, Plane)> = None;
    for axis in 0..3 {
        if size[axis].is_nan() || size[axis] <= 0.0 {
            continue;
        }
        let mut bins: [Option<LightBounds>; BINS] = [None; BINS];
        for item in items {
            let b = &mut bins[bin(item.bounds.bounds.center()[axis], centers, axis)];
            *b = Some(b.map_or(item.bounds, |b| b.union(&item.bounds)));
        }
        let join = |a: Option<LightBounds>, b: Option<LightBounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(&b)),
            (a, b) => a.or(b),
        };
        let mut above = [None; BINS];
        let mut sum = None;
        for i in (0..BINS).rev() {
            sum = join(sum, bins[i]);
            above[i] = sum;
        }
        let thinness = size.max_element() / size[axis];
        let mut below = None;
        for i in 1..BINS {
            below = join(below, bins[i - 1]);
            if let (Some(a), Some(b)) = (&below, &above[i]) {
                let total = thinness * (cost(a) + cost(b));
                if best.as_ref().is_none_or(|(least, _)| total < *least) {
                    best = Some((total, Plane { axis, bin: i }));
                }
            }
        }
    }
    best.map(|(_, plane)| plane)
}

/// Moves the items that pass to the front; how many they are.
fn partition(items: &mut [Item], passes: impl Fn(&Item) -> bool) -> usize {
    let mut count = 0;
    for i in 0..items.len() {
        if passes(&items[i]) {
            items.swap(i, count);
            count += 1;
        }
    }
    count
}
