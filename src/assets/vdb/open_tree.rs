//! The tree of a grid of an OpenVDB file: a root with nodes of 32³ children, which are nodes of 16³ leaves of 8³
//! voxels. First stand the masks of all, with the values of cubes that are of one value, then the voxels of the leaves.

use std::collections::BTreeSet;

use half::f16;

use super::codec::{Codec, Decoder};
use super::cursor::{Cursor, Mask};
use super::dense::{
    BlockFormat, IndexBox, LEAF_VALUES, LOWER_LOG2, Leaf, ROOT_EDGE, RootTile, Topology, TreeNode, UPPER_LOG2,
    VoxelValue,
};

/// How the values of a grid are stored.
pub struct OpenLayout {
    channels: usize,
    /// Bytes of a number, but in lists of halves.
    number_bytes: usize,
    is_half: bool,
    codec: Codec,
    /// Whether lists of values have active ones alone.
    has_masks: bool,
}

/// Values of a node, of which those of inactive voxels may be left out.
pub struct Stored<'a> {
    codec: Codec,
    bytes: &'a [u8],
    /// How many values there are.
    count: usize,
    /// What inactive voxels have that are left out: those of the mask the second, others the first.
    inactive: [VoxelValue; 2],
    selection: Option<Mask<'a>>,
}

impl OpenLayout {
    /// Of a type of grid.
    pub fn new(kind: &str, is_half: bool, codec: Codec, has_masks: bool) -> Result<Self, String> {
        let (number_bytes, channels) = match kind {
            "Tree_float_5_4_3" => (4, 1),
            "Tree_double_5_4_3" => (8, 1),
            "Tree_vec3s_5_4_3" => (4, 3),
            "Tree_vec3d_5_4_3" => (8, 3),
            _ => return Err(format!("is of type {kind}, only float, double, vec3s and vec3d are supported")),
        };
        Ok(Self { channels, number_bytes, is_half, codec, has_masks })
    }

    /// Numbers of each voxel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// One value in full precision.
    fn value(&self, cursor: &mut Cursor) -> Result<VoxelValue, String> {
        let bytes = cursor.take(self.channels * self.number_bytes)?;
        let mut value = VoxelValue::default();
        numbers(bytes, self.number_bytes, &mut value[..self.channels]);
        Ok(value)
    }

    /// Bytes of a value in a list.
    fn value_bytes(&self) -> usize {
        self.channels * if self.is_half { size_of::<f16>() } else { self.number_bytes }
    }

    /// The values of a node of `count`.
    fn stored<'a>(
        &self,
        cursor: &mut Cursor<'a>,
        active: Mask,
        count: usize,
        background: VoxelValue,
    ) -> Result<Stored<'a>, String> {
        let [kind] = cursor.array()?;
        let negative = background.map(|x| -x);
        // What inactive voxels have, as far as it is not listed, and whether a mask says which.
        let (inactive, has_selection) = match kind {
            0 => ([background; 2], false),
            1 | 6 => ([negative, background], false),
            2 => ([self.value(cursor)?, background], false),
            3 => ([negative, background], true),
            4 => ([self.value(cursor)?, background], true),
            5 => ([self.value(cursor)?, self.value(cursor)?], true),
            _ => return Err(format!("has a node with an unknown way {kind} of leaving out values")),
        };
        let selection = if has_selection { Some(Mask(cursor.take(count / 8)?)) } else { None };
        let count = if self.has_masks && kind != 6 { active.count() } else { count };
        let whole = count * self.value_bytes();
        let (codec, length) = match self.codec {
            Codec::None => (Codec::None, whole),
            // No halves are stored as nothing at all, not even their length.
            _ if self.is_half && count == 0 => (Codec::None, 0),
            // A negative length is that of bytes that are not compressed.
            codec => match cursor.i64()? {
                length @ 1.. => (codec, usize::try_from(length).unwrap_or(usize::MAX)),
                length if length.unsigned_abs() == whole as u64 => (Codec::None, whole),
                length => {
                    return Err(format!("has {} bytes of values where {whole} are expected", length.unsigned_abs()));
                }
            },
        };
        Ok(Stored { codec, bytes: cursor.take(length)?, count, inactive, selection })
    }
}

/// Numbers of so many bytes each as `f32`.
fn numbers(bytes: &[u8], number_bytes: usize, out: &mut [f32]) {
    match number_bytes {
        2 => out.iter_mut().zip(bytes.as_chunks().0).for_each(|(x, bytes)| *x = f16::from_le_bytes(*bytes).to_f32()),
        4 => out.iter_mut().zip(bytes.as_chunks().0).for_each(|(x, bytes)| *x = f32::from_le_bytes(*bytes)),
        _ => out.iter_mut().zip(bytes.as_chunks().0).for_each(|(x, bytes)| *x = f64::from_le_bytes(*bytes) as f32),
    }
}

/// What reading values takes.
#[derive(Default)]
pub struct Scratch {
    decoder: Decoder,
    bytes: Vec<u8>,
    values: Vec<f32>,
}

impl BlockFormat<Stored<'_>> for OpenLayout {
    type Scratch = Scratch;

    fn read(&self, block: &Stored, active: Mask, scratch: &mut Scratch, out: &mut [f32]) -> Result<(), String> {
        let Scratch { decoder, bytes, values } = scratch;
        let bytes = if block.codec == Codec::None {
            block.bytes
        } else {
            bytes.resize(block.count * self.value_bytes(), 0);
            decoder.decompress(block.codec, block.bytes, bytes)?;
            bytes
        };
        let number_bytes = self.value_bytes() / self.channels;
        if block.count * self.channels == out.len() {
            numbers(bytes, number_bytes, out);
            return Ok(());
        }
        values.resize(block.count * self.channels, 0.0);
        numbers(bytes, number_bytes, values);
        let [first, second] = &block.inactive;
        let mut listed = values.chunks_exact(self.channels);
        for (i, voxel) in out.chunks_exact_mut(self.channels).enumerate() {
            let omitted = if block.selection.is_some_and(|mask| mask.is_on(i)) { second } else { first };
            let omitted = &omitted[..self.channels];
            let value = if active.is_on(i) { listed.next().unwrap_or(omitted) } else { omitted };
            voxel.copy_from_slice(value);
        }
        Ok(())
    }
}

/// Reads a tree.
pub fn read_tree<'a>(layout: &OpenLayout, cursor: &mut Cursor<'a>) -> Result<Topology<'a, Stored<'a>>, String> {
    let buffers = cursor.u32()?;
    if buffers != 1 {
        return Err(format!("has {buffers} buffers a voxel, only 1 is supported"));
    }
    let background = layout.value(cursor)?;
    let (tile_count, child_count) = (cursor.u32()?, cursor.u32()?);
    let mut places = BTreeSet::new();
    let mut tree =
        Topology { channels: layout.channels, background, tiles: Vec::new(), nodes: Vec::new(), leaves: Vec::new() };
    for _ in 0..tile_count {
        let area = IndexBox::cube(root_place(cursor, &mut places)?, ROOT_EDGE);
        let value = layout.value(cursor)?;
        let [state] = cursor.array()?;
        tree.tiles.push(RootTile { area, is_active: state != 0, value });
    }
    let mut masks = Vec::new();
    for _ in 0..child_count {
        let origin = root_place(cursor, &mut places)?;
        let upper = node(layout, cursor, background, origin, UPPER_LOG2)?;
        let children: Vec<_> = upper.children.ones().map(|i| upper.area(i).min).collect();
        tree.nodes.push(upper);
        for origin in children {
            let lower = node(layout, cursor, background, origin, LOWER_LOG2)?;
            for i in lower.children.ones() {
                masks.push((lower.area(i).min, Mask(cursor.take(LEAF_VALUES / 8)?)));
            }
            tree.nodes.push(lower);
        }
    }
    for (origin, active) in masks {
        if cursor.take(LEAF_VALUES / 8)? != active.0 {
            return Err(format!("has two masks of the leaf at {origin:?}, which differ"));
        }
        let block = layout.stored(cursor, active, LEAF_VALUES, background)?;
        tree.leaves.push(Leaf { origin, active, block });
    }
    Ok(tree)
}

/// The place of a tile or child of the root: no other has it.
fn root_place(cursor: &mut Cursor, places: &mut BTreeSet<[i64; 3]>) -> Result<[i64; 3], String> {
    let place = [cursor.i32()?, cursor.i32()?, cursor.i32()?].map(i64::from);
    if place.iter().any(|x| x.rem_euclid(ROOT_EDGE) != 0) || !places.insert(place) {
        return Err(format!("has a node at {place:?}, where there can be none or is another"));
    }
    Ok(place)
}

/// A node by its first voxel and its children along each edge.
fn node<'a>(
    layout: &OpenLayout,
    cursor: &mut Cursor<'a>,
    background: VoxelValue,
    origin: [i64; 3],
    log2: u32,
) -> Result<TreeNode<'a, Stored<'a>>, String> {
    let count = 1 << (3 * log2);
    let (children, active) = (Mask(cursor.take(count / 8)?), Mask(cursor.take(count / 8)?));
    let block = layout.stored(cursor, active, count, background)?;
    Ok(TreeNode { origin, log2, children, active, block })
}
