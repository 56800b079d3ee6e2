//! Photons, found by place.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::color::Rgb;
use crate::id::LightId;
use crate::math::Vec3;
use crate::math::float::floor;
use crate::math::random::hash64;

/// Light that arrives at a surface after one delta lobe or more.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub p: Vec3,
    /// Unit geometric normal there, of either side.
    pub n: Vec3,
    /// Unit direction to where the light comes from.
    pub wi: Vec3,
    /// Power times the number of photons traced.
    pub power: Rgb,
    /// Density with which photons arrive, per area and solid angle, over the cosine of `wi` and `n`; choices between
    /// lobes left out; infinite for delta lights, which paths never meet.
    pub density: f32,
    /// The light that it comes from.
    pub light: LightId,
    /// Delta lobes on its way.
    pub scatterings: u32,
}

/// Photons in the cells of a grid. Blocks of 4 x 4 x 4 cells that hold photons are in a hash table.
#[derive(Debug)]
pub struct PhotonMap {
    /// By block and cell.
    photons: Vec<Photon>,
    /// The same photons' points, apart from what only those that are gathered need.
    points: Vec<Vec3>,
    /// By cell that holds photons, its first one, and the number of photons.
    starts: Vec<u32>,
    /// A hash table with linear probing; at most half of it is in use.
    table: Vec<Block>,
    radius: f32,
    traced: u32,
}

/// 4 x 4 x 4 cells.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    place: [i32; 3],
    /// Index of its first cell in the starts.
    first: u32,
    /// A bit for each cell that holds photons; 0 for an entry that is not in use.
    cells: u64,
}

impl PhotonMap {
    /// The photons that arrived of `traced` ones, to be gathered within a positive `radius`.
    pub fn new(photons: &[Photon], traced: u32, radius: f32) -> Self {
        let mut map =
            Self { photons: Vec::new(), points: Vec::new(), starts: Vec::new(), table: Vec::new(), radius, traced };
        let key = |(i, photon): (usize, &Photon)| {
            let cell = map.cell(photon.p);
            (block_of(cell), bit(cell), i as u32)
        };
        let mut order: Vec<_> = photons.par_iter().enumerate().map(key).collect();
        order.par_sort_unstable();
        let mut blocks: Vec<Block> = Vec::new();
        let mut previous = None;
        for (start, &(place, bit, _)) in order.iter().enumerate() {
            if previous == Some((place, bit)) {
                continue;
            }
            if previous.is_none_or(|(previous, _)| previous != place) {
                blocks.push(Block { place, first: map.starts.len() as u32, cells: 0 });
            }
            if let Some(block) = blocks.last_mut() {
                block.cells |= 1 << bit;
            }
            map.starts.push(start as u32);
            previous = Some((place, bit));
        }
        map.starts.push(order.len() as u32);
        map.photons = order.iter().map(|&(_, _, i)| photons[i as usize]).collect();
        map.points = map.photons.iter().map(|photon| photon.p).collect();
        map.table = vec![Block::default(); (2 * blocks.len()).next_power_of_two()];
        for block in blocks {
            let free = map.entry(block.place);
            map.table[free] = block;
        }
        map
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// The number of photons traced times the area within which they are gathered.
    #[inline]
    pub fn gathered_area(&self) -> f32 {
        self.traced as f32 * PI * self.radius * self.radius
    }

    /// Visits the photons around a point of a surface with the unit geometric normal `n`.
    #[inline]
    pub fn for_each_near(&self, p: Vec3, n: Vec3, mut visit: impl FnMut(&Photon)) {
        let ([x0, y0, z0], [x1, y1, z1]) = (self.cell(p - self.radius), self.cell(p + self.radius));
        let mut block = Block::default();
        // What `block` was found for.
        let mut found = None;
        for z in z0..=z1 {
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let place = block_of([x, y, z]);
                    if found != Some(place) {
                        (block, found) = (self.table[self.entry(place)], Some(place));
                    }
                    let bit = bit([x, y, z]);
                    if block.cells >> bit & 1 != 0 {
                        let cell = block.first + (block.cells & ((1 << bit) - 1)).count_ones();
                        self.visit_cell(cell as usize, p, n, &mut visit);
                    }
                }
            }
        }
    }

    #[inline]
    fn visit_cell(&self, cell: usize, p: Vec3, n: Vec3, visit: &mut impl FnMut(&Photon)) {
        for i in self.starts[cell] as usize..self.starts[cell + 1] as usize {
            let d = self.points[i] - p;
            if d.length_squared() < self.radius * self.radius && self.is_on_surface(i, d, n) {
                visit(&self.photons[i]);
            }
        }
    }

    /// Whether a photon at a distance `d` has arrived on a surface that is about the same.
    #[inline]
    fn is_on_surface(&self, i: usize, d: Vec3, n: Vec3) -> bool {
        d.dot(n).abs() < 0.5 * self.radius && self.photons[i].n.dot(n).abs() > 0.7
    }

    /// Cells are as wide as what is gathered.
    #[inline]
    fn cell(&self, p: Vec3) -> [i32; 3] {
        let scaled = p * (0.5 / self.radius);
        [floor(scaled.x) as i32, floor(scaled.y) as i32, floor(scaled.z) as i32]
    }

    /// The entry of a block's place, in use or not.
    #[inline]
    fn entry(&self, place: [i32; 3]) -> usize {
        let [x, y, z] = place;
        let mask = self.table.len() - 1;
        let mut entry = hash64(hash64(u64::from(x as u32) << 32 | u64::from(y as u32)) ^ z as u64) as usize & mask;
        while self.table[entry].cells != 0 && self.table[entry].place != place {
            entry = (entry + 1) & mask;
        }
        entry
    }
}

/// The block that a cell lies in.
#[inline]
fn block_of([x, y, z]: [i32; 3]) -> [i32; 3] {
    [x >> 2, y >> 2, z >> 2]
}

/// A cell's bit in its block.
#[inline]
fn bit([x, y, z]: [i32; 3]) -> u32 {
    ((z & 3) << 4 | (y & 3) << 2 | (x & 3)) as u32
}
