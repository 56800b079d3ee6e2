//! The voxels of a tree's active bounding box, one by one.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::cursor::Mask;
use crate::memory::is_available;

/// Voxels along the edge of a leaf.
pub const LEAF_EDGE: i64 = 8;

/// Values of a leaf.
pub const LEAF_VALUES: usize = 512;

/// Children of nodes along each edge, as powers of two: of those below the root, and of their children, whose children
/// are leaves.
pub const UPPER_LOG2: u32 = 5;
pub const LOWER_LOG2: u32 = 4;

/// Voxels along the edge of a child of the root.
pub const ROOT_EDGE: i64 = LEAF_EDGE << (LOWER_LOG2 + UPPER_LOG2);

/// The most voxels along an edge.
const MAX_EDGE: i64 = 1 << 14;

/// One number for each channel; those of channels that a grid does not have are 0.
pub type VoxelValue = [f32; 3];

/// Index coordinates of voxels, those of both corners included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexBox {
    pub min: [i64; 3],
    pub max: [i64; 3],
}

impl IndexBox {
    const EMPTY: Self = Self { min: [i64::MAX; 3], max: [i64::MIN; 3] };

    /// A cube by its first corner.
    pub fn cube(min: [i64; 3], edge: i64) -> Self {
        Self { min, max: min.map(|x| x + edge - 1) }
    }

    fn is_empty(&self) -> bool {
        self.min[0] > self.max[0]
    }

    fn add(&mut self, other: &Self) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(other.min[axis]);
            self.max[axis] = self.max[axis].max(other.max[axis]);
        }
    }

    /// What two have in common, if anything.
    fn common(&self, other: &Self) -> Option<Self> {
        let min = [0, 1, 2].map(|axis| self.min[axis].max(other.min[axis]));
        let max = [0, 1, 2].map(|axis| self.max[axis].min(other.max[axis]));
        (0..3).all(|axis| min[axis] <= max[axis]).then_some(Self { min, max })
    }
}

/// A cube of one value, whose place in the tree is the root.
pub struct RootTile {
    pub area: IndexBox,
    pub is_active: bool,
    pub value: VoxelValue,
}

/// A node between root and leaves: a cube of children and of cubes of one value, `1 << log2` along each edge.
pub struct TreeNode<'a, B> {
    pub origin: [i64; 3],
    pub log2: u32,
    pub children: Mask<'a>,
    pub active: Mask<'a>,
    pub block: B,
}

impl<B> TreeNode<'_, B> {
    /// The cube of a child, or of one value.
    pub fn area(&self, i: usize) -> IndexBox {
        let edge = if self.log2 == UPPER_LOG2 { LEAF_EDGE << LOWER_LOG2 } else { LEAF_EDGE };
        let place = |shift: u32| (i >> (shift * self.log2) & ((1 << self.log2) - 1)) as i64 * edge;
        let [x, y, z] = self.origin;
        IndexBox::cube([x + place(2), y + place(1), z + place(0)], edge)
    }
}

/// Voxels of a cube of 8 along each edge.
pub struct Leaf<'a, B> {
    pub origin: [i64; 3],
    pub active: Mask<'a>,
    pub block: B,
}

impl<B> Leaf<'_, B> {
    /// The box of its active voxels. They are numbered by x, then y, then z: a word has those of one x.
    fn active_box(&self) -> IndexBox {
        let (words, _) = self.active.0.as_chunks();
        let words = words.iter().map(|word| u64::from_le_bytes(*word)).enumerate().filter(|(_, word)| *word != 0);
        let mut found = IndexBox::EMPTY;
        for (x, word) in words {
            let rows = word.to_le_bytes();
            let z = rows.iter().fold(0, |all, row| all | row);
            let [x0, y0, z0] = self.origin;
            let x = x0 + x as i64;
            let y = [word.trailing_zeros() / 8, 7 - word.leading_zeros() / 8].map(|y| y0 + i64::from(y));
            let z = [z.trailing_zeros(), 7 - z.leading_zeros()].map(|z| z0 + i64::from(z));
            found.add(&IndexBox { min: [x, y[0], z[0]], max: [x, y[1], z[1]] });
        }
        found
    }
}

/// What a tree consists of; the values of nodes and leaves are in blocks of their file.
pub struct Topology<'a, B> {
    /// Numbers of each voxel: 1 or 3.
    pub channels: usize,
    /// Of a voxel that is nowhere in the tree.
    pub background: VoxelValue,
    pub tiles: Vec<RootTile>,
    pub nodes: Vec<TreeNode<'a, B>>,
    pub leaves: Vec<Leaf<'a, B>>,
}

/// How the values of blocks are read.
pub trait BlockFormat<B>: Sync {
    /// Buffers for its use.
    type Scratch: Default;

    /// Reads the values of all voxels or cubes of a block, which are `active` or not: by their numbers, then channel.
    fn read(&self, block: &B, active: Mask, scratch: &mut Self::Scratch, out: &mut [f32]) -> Result<(), String>;
}

/// Voxels by z, then y, then x, then channel.
#[derive(Debug)]
pub struct Dense {
    /// The index coordinates of the first one.
    pub origin: [i64; 3],
    pub size: [usize; 3],
    pub values: Vec<f32>,
}

impl<B: Sync> Topology<'_, B> {
    fn active_box(&self) -> IndexBox {
        let mut found = IndexBox::EMPTY;
        self.tiles.iter().filter(|tile| tile.is_active).for_each(|tile| found.add(&tile.area));
        for node in &self.nodes {
            let tiles = node.active.ones().filter(|&i| !node.children.is_on(i));
            tiles.for_each(|i| found.add(&node.area(i)));
        }
        self.leaves.iter().map(Leaf::active_box).filter(|leaf| !leaf.is_empty()).for_each(|leaf| found.add(&leaf));
        found
    }

    /// All voxels of the box of those that are active, and one voxel of background around them. Without active voxels,
    /// there is one of background in place of them. They take at most `most_bytes`.
    pub fn densify<F: BlockFormat<B>>(self, format: &F, most_bytes: usize) -> Result<Dense, String> {
        let active = Some(self.active_box()).filter(|active| !active.is_empty());
        let frame = Frame::new(active, self.channels)?;
        let background = &self.background[..self.channels];
        let mut values = frame.background(background, most_bytes)?;
        if let Some(active) = active {
            let mut fill = |area: &IndexBox, value: &[f32]| {
                if value != background
                    && let Some(area) = area.common(&active)
                {
                    frame.fill(&mut values, &area, value);
                }
            };
            self.tiles.iter().for_each(|tile| fill(&tile.area, &tile.value[..self.channels]));
            let (mut out, mut scratch) = (Vec::new(), F::Scratch::default());
            for node in &self.nodes {
                out.resize(frame.channels << (3 * node.log2), 0.0);
                format.read(&node.block, node.active, &mut scratch, &mut out)?;
                let tiles = out.chunks_exact(frame.channels).enumerate().filter(|(i, _)| !node.children.is_on(*i));
                tiles.for_each(|(i, value)| fill(&node.area(i), value));
            }
            frame.put_leaves(&mut values, &active, self.leaves, format)?;
        }
        Ok(Dense { origin: frame.origin, size: frame.size, values })
    }
}

/// Some of the values, which begin at number `start` of all.
struct Planes<'a> {
    start: usize,
    values: &'a mut [f32],
}

/// Where voxels are in a list of their values.
struct Frame {
    origin: [i64; 3],
    size: [usize; 3],
    channels: usize,
}

impl Frame {
    /// Around a box.
    fn new(active: Option<IndexBox>, channels: usize) -> Result<Self, String> {
        let IndexBox { min, max } = active.unwrap_or(IndexBox { min: [0; 3], max: [0; 3] });
        let edges = [0, 1, 2].map(|axis| max[axis] - min[axis] + 3);
        if edges.iter().any(|edge| *edge > MAX_EDGE) {
            return Err(format!(
                "its active voxels span {edges:?} voxels, at most {MAX_EDGE} along each axis are supported"
            ));
        }
        Ok(Self { origin: min.map(|x| x - 1), size: edges.map(|edge| edge as usize), channels })
    }

    /// All voxels, of the same value.
    fn background(&self, value: &[f32], most_bytes: usize) -> Result<Vec<f32>, String> {
        // At most 2^42 of 3 channels.
        let count = self.size.iter().product::<usize>() * self.channels;
        let bytes = count * size_of::<f32>();
        if bytes > most_bytes || !is_available(bytes) {
            let [x, y, z] = self.size;
            return Err(format!(
                "the box of its active voxels, {x} x {y} x {z}, takes {bytes} bytes, more memory than there is: \
                 resample the grid to larger voxels, or clip it"
            ));
        }
        let mut values = vec![value[0]; count];
        if self.channels > 1 {
            values.chunks_exact_mut(self.channels).for_each(|voxel| voxel.copy_from_slice(value));
        }
        Ok(values)
    }

    /// Where a row of voxels along x begins.
    fn row(&self, [x, y, z]: [i64; 3]) -> usize {
        let [x, y, z] = [x - self.origin[0], y - self.origin[1], z - self.origin[2]].map(|x| x as usize);
        ((z * self.size[1] + y) * self.size[0] + x) * self.channels
    }

    fn fill(&self, values: &mut [f32], area: &IndexBox, value: &[f32]) {
        let length = (area.max[0] - area.min[0] + 1) as usize * self.channels;
        for z in area.min[2]..=area.max[2] {
            for y in area.min[1]..=area.max[1] {
                let start = self.row([area.min[0], y, z]);
                let row = &mut values[start..start + length];
                row.chunks_exact_mut(self.channels).for_each(|voxel| voxel.copy_from_slice(value));
            }
        }
    }

    /// Reads all leaves, those of the same z after each other and others at the same time.
    fn put_leaves<B: Sync, F: BlockFormat<B>>(
        &self,
        values: &mut [f32],
        active: &IndexBox,
        mut leaves: Vec<Leaf<B>>,
        format: &F,
    ) -> Result<(), String> {
        leaves.sort_by_key(|leaf| leaf.origin[2]);
        let plane = self.size[0] * self.size[1] * self.channels;
        let (mut layers, mut rest, mut next) = (Vec::new(), values, self.origin[2]);
        for layer in leaves.chunk_by(|a, b| a.origin[2] == b.origin[2]) {
            let IndexBox { min, max } = IndexBox::cube(layer[0].origin, LEAF_EDGE);
            let (first, last) = (min[2].max(active.min[2]), max[2].min(active.max[2]));
            if first > last {
                continue;
            }
            let (_, from) = rest.split_at_mut((first - next) as usize * plane);
            let (values, behind) = from.split_at_mut((last + 1 - first) as usize * plane);
            (rest, next) = (behind, last + 1);
            layers.push((Planes { start: self.row([self.origin[0], self.origin[1], first]), values }, layer));
        }
        layers.into_par_iter().try_for_each(|(mut planes, layer)| {
            let (mut out, mut scratch) = (vec![0.0; LEAF_VALUES * self.channels], F::Scratch::default());
            for leaf in layer {
                let Some(area) = IndexBox::cube(leaf.origin, LEAF_EDGE).common(active) else { continue };
                format.read(&leaf.block, leaf.active, &mut scratch, &mut out)?;
                self.put_leaf(&mut planes, &area, leaf.origin, &out);
            }
            Ok(())
        })
    }

    /// Copies the values of a leaf within `area`.
    fn put_leaf(&self, planes: &mut Planes, area: &IndexBox, origin: [i64; 3], leaf: &[f32]) {
        let [x0, y0, z0] = origin;
        for z in area.min[2]..=area.max[2] {
            for y in area.min[1]..=area.max[1] {
                let mut to = self.row([area.min[0], y, z]) - planes.start;
                for x in area.min[0]..=area.max[0] {
                    let number = (((x - x0) * LEAF_EDGE + y - y0) * LEAF_EDGE + z - z0) as usize * self.channels;
                    planes.values[to..to + self.channels].copy_from_slice(&leaf[number..number + self.channels]);
                    to += self.channels;
                }
            }
        }
    }
}
