//! The tree of a NanoVDB grid: as OpenVDB's, with a table of children or values in each node, and leaves that name no
//! others. Nodes are at offsets from those that name them.

use std::collections::BTreeSet;

use super::cursor::{Cursor, Mask};
use super::dense::{
    BlockFormat, IndexBox, LEAF_VALUES, LOWER_LOG2, Leaf, ROOT_EDGE, RootTile, Topology, TreeNode, UPPER_LOG2,
    VoxelValue,
};
use super::nano::GRID_HEAD;

/// Where, behind the beginning of a tree, the offset of its root is.
const ROOT_OFFSET: usize = 24;

/// Bytes before the masks of nodes and before that of leaves.
const NODE_BOX: usize = 32;
const LEAF_BOX: usize = 16;

/// How leaves store values.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LeafKind {
    Whole,
    /// As numbers of so many bits, from which a linear function makes values.
    Bits(u32),
    /// The same with a number of bits that the leaf has in its flags.
    AnyBits,
}

/// Sizes of what a tree consists of.
#[derive(Clone, Copy, Debug)]
pub struct NanoLayout {
    channels: usize,
    number_bytes: usize,
    leaf: LeafKind,
}

/// The values of a node or leaf.
pub struct NanoBlock<'a> {
    /// Of a node: its table; of a leaf: all of it.
    bytes: &'a [u8],
    is_leaf: bool,
}

/// The next multiple.
fn aligned(offset: usize, to: usize) -> usize {
    offset.next_multiple_of(to)
}

impl NanoLayout {
    /// Of the type of a grid, by its number.
    pub fn new(kind: u32) -> Option<Self> {
        let (number_bytes, channels, leaf) = match kind {
            1 => (4, 1, LeafKind::Whole),
            2 => (8, 1, LeafKind::Whole),
            6 => (4, 3, LeafKind::Whole),
            7 => (8, 3, LeafKind::Whole),
            13 => (4, 1, LeafKind::Bits(4)),
            14 => (4, 1, LeafKind::Bits(8)),
            15 => (4, 1, LeafKind::Bits(16)),
            16 => (4, 1, LeafKind::AnyBits),
            _ => return None,
        };
        Some(Self { channels, number_bytes, leaf })
    }

    /// Numbers of each voxel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    fn value_bytes(&self) -> usize {
        self.channels * self.number_bytes
    }

    /// Bytes of an entry of the table of a node: an offset or a value.
    fn entry_bytes(&self) -> usize {
        aligned(self.value_bytes(), 8)
    }

    /// Where values begin behind the extremes, mean and deviation that stand at `offset`.
    fn behind_statistics(&self, offset: usize) -> usize {
        let extremes = aligned(offset, self.number_bytes) + 2 * self.value_bytes();
        aligned(extremes + 2 * self.number_bytes, 32)
    }

    fn value(&self, bytes: &[u8]) -> VoxelValue {
        let mut value = VoxelValue::default();
        self.numbers(bytes, &mut value[..self.channels]);
        value
    }

    fn numbers(&self, bytes: &[u8], out: &mut [f32]) {
        if self.number_bytes == 4 {
            out.iter_mut().zip(bytes.as_chunks().0).for_each(|(x, bytes)| *x = f32::from_le_bytes(*bytes));
        } else {
            out.iter_mut().zip(bytes.as_chunks().0).for_each(|(x, bytes)| *x = f64::from_le_bytes(*bytes) as f32);
        }
    }

    /// Bits of the numbers of a leaf, and how many bytes it has.
    fn leaf_size(&self, flags: u8) -> (u32, usize) {
        let bits = match self.leaf {
            LeafKind::Whole => {
                let values = self.behind_statistics(LEAF_BOX + LEAF_VALUES / 8);
                return (0, values + LEAF_VALUES * self.value_bytes());
            }
            LeafKind::Bits(bits) => bits,
            LeafKind::AnyBits => 1 << (flags >> 5).min(4),
        };
        (bits, CODES + LEAF_VALUES * bits as usize / 8)
    }
}

/// Where the numbers of a leaf begin that stores bits; in front of them stand, behind its mask, the least value, what a
/// number is multiplied with, and statistics.
const CODES: usize = 96;

impl BlockFormat<NanoBlock<'_>> for NanoLayout {
    type Scratch = ();

    fn read(&self, block: &NanoBlock, _: Mask, (): &mut (), out: &mut [f32]) -> Result<(), String> {
        let NanoBlock { bytes, is_leaf } = *block;
        if !is_leaf {
            let entries = bytes.chunks_exact(self.entry_bytes());
            entries.zip(out.chunks_exact_mut(self.channels)).for_each(|(entry, voxel)| self.numbers(entry, voxel));
            return Ok(());
        }
        if self.leaf == LeafKind::Whole {
            self.numbers(&bytes[bytes.len() - LEAF_VALUES * self.value_bytes()..], out);
            return Ok(());
        }
        let mut range = [0.0; 2];
        let at = LEAF_BOX + LEAF_VALUES / 8;
        self.numbers(&bytes[at..at + 8], &mut range);
        let [least, step] = range;
        let (bits, _) = self.leaf_size(bytes[LEAF_BOX - 1]);
        let codes = &bytes[CODES..];
        for (i, value) in out.iter_mut().enumerate() {
            let at = i * bits as usize;
            let code = match bits {
                16 => u32::from(u16::from_le_bytes([codes[at / 8], codes[at / 8 + 1]])),
                _ => u32::from(codes[at / 8]) >> (at % 8) & ((1 << bits) - 1),
            };
            *value = code as f32 * step + least;
        }
        Ok(())
    }
}

/// The bytes of a grid, and how many of them nodes may still take.
struct Walk<'a> {
    layout: NanoLayout,
    bytes: &'a [u8],
    left: usize,
}

/// Reads the tree of a grid.
pub fn read_tree<'a>(layout: &NanoLayout, bytes: &'a [u8]) -> Result<Topology<'a, NanoBlock<'a>>, String> {
    let mut walk = Walk { layout: *layout, bytes, left: bytes.len() };
    let mut root_offset = Cursor::new(bytes.get(GRID_HEAD + ROOT_OFFSET..).ok_or("ends before its tree")?);
    let root = walk.offset(GRID_HEAD, root_offset.i64()?)?;
    // Behind the root's box and number of tiles stand the background and statistics.
    let background = aligned(28, layout.number_bytes);
    let tiles = layout.behind_statistics(background + layout.value_bytes());
    let head = walk.take(root, tiles)?;
    let count = Cursor::new(&head[24..]).u32()? as usize;
    let value_at = aligned(20, layout.number_bytes);
    let tile_bytes = aligned(value_at + layout.value_bytes(), 32);
    let background = layout.value(&head[background..]);
    let mut tree =
        Topology { channels: layout.channels, background, tiles: Vec::new(), nodes: Vec::new(), leaves: Vec::new() };
    let mut places = BTreeSet::new();
    for i in 0..count {
        let tile = walk.take(root + tiles + i * tile_bytes, tile_bytes)?;
        let mut cursor = Cursor::new(tile);
        let (key, child, state) = (cursor.u64()?, cursor.i64()?, cursor.u32()?);
        // 21 bits for each axis, of which the upper 20 bits of a coordinate are used; z is in the lowest.
        let origin = [42, 21, 0].map(|shift| i64::from((((key >> shift) as u32) << 12) as i32));
        if !places.insert(origin) {
            return Err(format!("has two nodes at {origin:?}"));
        }
        if child == 0 {
            let area = IndexBox::cube(origin, ROOT_EDGE);
            tree.tiles.push(RootTile { area, is_active: state != 0, value: layout.value(&tile[value_at..]) });
        } else {
            let at = walk.offset(root, child)?;
            walk.upper(&mut tree, at, origin)?;
        }
    }
    Ok(tree)
}

impl<'a> Walk<'a> {
    /// The place that is so far from another.
    fn offset(&self, from: usize, offset: i64) -> Result<usize, String> {
        let at = i64::try_from(from).ok().and_then(|from| from.checked_add(offset));
        let at = at.and_then(|at| usize::try_from(at).ok()).filter(|at| *at >= GRID_HEAD && *at < self.bytes.len());
        at.ok_or_else(|| format!("has a node {offset} bytes from byte {from}, but {} bytes", self.bytes.len()))
    }

    /// Bytes that no other node has taken, by their number.
    fn take(&mut self, at: usize, count: usize) -> Result<&'a [u8], String> {
        let end = at.saturating_add(count);
        let bytes = self.bytes.get(at..end);
        let bytes = bytes.ok_or_else(|| format!("ends early: byte {end} of {} is named", self.bytes.len()))?;
        self.left = self.left.checked_sub(count).ok_or("has nodes that overlap")?;
        Ok(bytes)
    }

    /// A node without its children, and the places of these.
    fn node(
        &mut self,
        at: usize,
        origin: [i64; 3],
        log2: u32,
    ) -> Result<(TreeNode<'a, NanoBlock<'a>>, Vec<usize>), String> {
        let count = 1 << (3 * log2);
        let entry = self.layout.entry_bytes();
        let table = self.layout.behind_statistics(NODE_BOX + 2 * count / 8);
        let bytes = self.take(at, table + count * entry)?;
        let mask = |i: usize| Mask(&bytes[NODE_BOX + i * count / 8..NODE_BOX + (i + 1) * count / 8]);
        let (active, children) = (mask(0), mask(1));
        let table = &bytes[table..];
        let places = children.ones().map(|i| {
            let offset = Cursor::new(&table[i * entry..]).i64()?;
            self.offset(at, offset)
        });
        let places = places.collect::<Result<_, _>>()?;
        Ok((TreeNode { origin, log2, children, active, block: NanoBlock { bytes: table, is_leaf: false } }, places))
    }

    fn upper(&mut self, tree: &mut Topology<'a, NanoBlock<'a>>, at: usize, origin: [i64; 3]) -> Result<(), String> {
        let (upper, places) = self.node(at, origin, UPPER_LOG2)?;
        for (i, at) in upper.children.ones().zip(places) {
            let (lower, places) = self.node(at, upper.area(i).min, LOWER_LOG2)?;
            for (i, at) in lower.children.ones().zip(places) {
                let leaf = self.leaf(at, lower.area(i).min)?;
                tree.leaves.push(leaf);
            }
            tree.nodes.push(lower);
        }
        tree.nodes.push(upper);
        Ok(())
    }

    fn leaf(&mut self, at: usize, origin: [i64; 3]) -> Result<Leaf<'a, NanoBlock<'a>>, String> {
        let flags = self.bytes.get(at + LEAF_BOX - 1).ok_or("ends early in a leaf")?;
        let (_, size) = self.layout.leaf_size(*flags);
        let bytes = self.take(at, size)?;
        let active = Mask(&bytes[LEAF_BOX..LEAF_BOX + LEAF_VALUES / 8]);
        Ok(Leaf { origin, active, block: NanoBlock { bytes, is_leaf: true } })
    }
}
