//! NanoVDB files, whose format is that of `nanovdb/NanoVDB.h` and `nanovdb/io/IO.h`, version 32: segments, each a
//! header, descriptions of grids and their bytes, compressed or not; or nothing but the bytes of grids.

use super::codec::{Codec, Decoder, most_decompressed};
use super::cursor::{Cursor, Source};
use super::list::{Listed, choose};
use super::nano_tree::{NanoLayout, read_tree};
use super::{GridChoice, VdbGrid};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::memory::is_available;

/// The first eight bytes: of files and grids before version 32.7, of grids, and of files.
pub const MAGICS: [[u8; 8]; 3] = [*b"NanoVDB0", *b"NanoVDB1", *b"NanoVDB2"];

/// Versions of other numbers have other layouts.
const MAJOR: u32 = 32;

/// Bytes of a grid before its tree: magic, checksum, version, flags, number of the grid, number of grids, bytes in all,
/// name, transform, boxes, size of voxels, class, type, and places of further data.
pub const GRID_HEAD: usize = 672;

/// Bytes of the name.
const NAME: usize = 256;

/// Bytes of the transform in `f32`, which stands in front of the same in `f64`.
const SINGLE_MAP: usize = 22 * 4;

/// Of signed distances.
const LEVEL_SET: u32 = 1;

/// The types of values, by their numbers.
const KINDS: [&str; 19] = [
    "unknown", "float", "double", "int16", "int32", "int64", "vec3f", "vec3d", "mask", "half", "uint32", "bool",
    "rgba8", "fp4", "fp8", "fp16", "fpN", "vec4f", "vec4d",
];

/// The most bytes that are compressed in one piece by Blosc.
const BLOSC_PIECE: u64 = 1 << 30;

/// The most grids of a file.
const MAX_GRIDS: usize = 1 << 16;

/// A grid and its place.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    kind: u32,
    codec: Codec,
    start: u64,
    end: u64,
    /// Bytes when decompressed.
    length: u64,
}

fn kind_name(kind: u32) -> String {
    KINDS.get(kind as usize).map_or_else(|| format!("type {kind}"), |&name| name.to_owned())
}

/// A name that ends where the first zero is.
fn name(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Whether a version is supported.
fn check_version(version: u32) -> Result<(), String> {
    let [major, minor, patch] = [version >> 21, version >> 10 & 0x7ff, version & 0x3ff];
    if major == MAJOR {
        return Ok(());
    }
    Err(format!(
        "version {major}.{minor}.{patch} of the NanoVDB format is not supported, only {MAJOR}: convert it again"
    ))
}

/// All grids.
fn entries(source: &mut Source) -> Result<Vec<Entry>, String> {
    let mut all = Vec::new();
    let mut at = 0;
    while at < source.length() {
        let end = if is_bare(source, at)? {
            let (entry, _) = source.parse(at, |cursor| bare_entry(cursor, at))?;
            let end = entry.end;
            all.push(entry);
            end
        } else {
            let (mut entries, mut end) = source.parse(at, segment).map_err(|e| format!("a segment {e}"))?;
            for entry in &mut entries {
                entry.start = end;
                end = end.saturating_add(entry.end);
                entry.end = end;
            }
            all.append(&mut entries);
            end
        };
        if end > source.length() {
            let message = format!("grids are up to byte {end} of {}", source.length());
            return Err(format!("the file is truncated or damaged: {message}"));
        }
        if all.len() > MAX_GRIDS {
            return Err(format!("the file has more than {MAX_GRIDS} grids"));
        }
        at = end;
    }
    Ok(all)
}

/// Whether a grid stands there without a segment around it. Older ones begin like segments, but have the version
/// elsewhere.
fn is_bare(source: &mut Source, at: u64) -> Result<bool, String> {
    let end = at.saturating_add(20).min(source.length());
    let bytes = source.range(at, end)?;
    let mut cursor = Cursor::new(&bytes);
    let magic = cursor.array::<8>()?;
    if magic != MAGICS[0] {
        return Ok(magic == MAGICS[1]);
    }
    let [of_segment, _, of_grid] = [cursor.u32()?, cursor.u32()?, cursor.u32().unwrap_or(0)];
    Ok(of_segment >> 21 != MAJOR && of_grid >> 21 == MAJOR)
}

/// The grids of a segment, whose `end` is the number of their bytes.
fn segment(cursor: &mut Cursor) -> Result<Vec<Entry>, String> {
    if !MAGICS.contains(&cursor.array()?) {
        return Err("has no header".into());
    }
    check_version(cursor.u32()?)?;
    let [count, codec] = [(); 2].map(|()| cursor.array().map(u16::from_le_bytes));
    let codec = match codec? {
        0 => Codec::None,
        1 => Codec::Zip,
        2 => Codec::Blosc,
        other => return Err(format!("has an unknown compression {other}")),
    };
    let mut entries = Vec::new();
    for _ in 0..count? {
        let (length, end) = (cursor.u64()?, cursor.u64()?);
        // A hash of the name, the number of active voxels.
        cursor.take(16)?;
        let kind = cursor.u32()?;
        // Class, boxes, size of voxels.
        cursor.take(4 + 48 + 24 + 24)?;
        let name_length = cursor.u32()? as usize;
        // Numbers of nodes and tiles, the same compression, the same version.
        cursor.take(16 + 12 + 2 + 2 + 4)?;
        entries.push(Entry { name: name(cursor.take(name_length)?), kind, codec, start: 0, end, length });
    }
    Ok(entries)
}

/// A grid that has no segment around it.
fn bare_entry(cursor: &mut Cursor, start: u64) -> Result<Entry, String> {
    let head = GridHead::read(cursor)?;
    let GridHead { name, kind, length, .. } = head;
    if length < GRID_HEAD as u64 {
        return Err(format!("a grid claims {length} bytes, fewer than its head has"));
    }
    Ok(Entry { name, kind, codec: Codec::None, start, end: start.saturating_add(length), length })
}

/// What stands in front of a tree.
struct GridHead {
    name: String,
    length: u64,
    class: u32,
    kind: u32,
    world_from_index: DAffine3,
}

impl GridHead {
    fn read(cursor: &mut Cursor) -> Result<Self, String> {
        let magic = cursor.array()?;
        if magic != MAGICS[0] && magic != MAGICS[1] {
            return Err("has no magic number of a grid".into());
        }
        // A checksum.
        cursor.take(8)?;
        check_version(cursor.u32()?)?;
        // Flags, number of the grid, number of grids.
        cursor.take(12)?;
        let length = cursor.u64()?;
        let name = name(cursor.take(NAME)?);
        cursor.take(SINGLE_MAP)?;
        let rows: [[f64; 3]; 3] = [cursor.doubles()?, cursor.doubles()?, cursor.doubles()?];
        // The inverse.
        cursor.doubles::<9>()?;
        let translation = DVec3::from(cursor.doubles::<3>()?);
        // A taper that has no use, boxes, the size of voxels.
        cursor.take(8 + 48 + 24)?;
        let (class, kind) = (cursor.u32()?, cursor.u32()?);
        // Places of further data.
        cursor.take(GRID_HEAD - 640)?;
        let matrix3 = DMat3::from_cols_array_2d(&rows).transpose();
        Ok(Self { name, length, class, kind, world_from_index: DAffine3 { matrix3, translation } })
    }
}

/// The bytes of a grid.
fn decompressed(source: &mut Source, entry: &Entry) -> Result<Vec<u8>, String> {
    let Entry { codec, start, end, length, .. } = *entry;
    if length > most_decompressed(codec, end - start) {
        return Err(format!("claims {length} bytes, more than can be compressed to {}", end - start));
    }
    let stored = source.range(start, end)?;
    if codec == Codec::None {
        return Ok(stored);
    }
    let count = usize::try_from(length).unwrap_or(usize::MAX);
    if !is_available(count) {
        return Err(format!("takes {length} bytes, more memory than there is"));
    }
    let mut bytes = vec![0; count];
    let piece = if codec == Codec::Blosc { BLOSC_PIECE as usize } else { usize::MAX };
    let (mut cursor, mut decoder) = (Cursor::new(&stored), Decoder::default());
    for out in bytes.chunks_mut(piece) {
        let size = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
        decoder.decompress(codec, cursor.take(size)?, out)?;
    }
    Ok(bytes)
}

/// Reads a grid whose voxels take at most `most_bytes`.
pub fn read(source: &mut Source, choice: GridChoice, most_bytes: usize) -> Result<VdbGrid, String> {
    let all = entries(source)?;
    let listed = listed(&all);
    let chosen = choose(&listed, choice)?;
    let unique = &listed[chosen].unique;
    let named = |e: String| format!("grid \"{unique}\" {e}");
    let bytes = decompressed(source, &all[chosen]).map_err(named)?;
    let mut cursor = Cursor::new(&bytes);
    let head = GridHead::read(&mut cursor).map_err(named)?;
    if head.class == LEVEL_SET {
        return Err(named(super::LEVEL_SET.into()));
    }
    super::check_transform(&head.world_from_index).map_err(named)?;
    let layout = NanoLayout::new(head.kind).ok_or_else(|| {
        let kind = kind_name(head.kind);
        named(format!("is of type {kind}, only float, double, vec3f, vec3d, fp4, fp8, fp16 and fpN are supported"))
    })?;
    let dense = read_tree(&layout, &bytes).and_then(|tree| tree.densify(&layout, most_bytes)).map_err(named)?;
    VdbGrid::new(unique.clone(), layout.channels(), dense, &head.world_from_index)
}

/// The grids; those of one name have numbers, too.
fn listed(entries: &[Entry]) -> Vec<Listed> {
    let mut counts = std::collections::BTreeMap::new();
    entries.iter().for_each(|entry| *counts.entry(&entry.name).or_insert(0) += 1);
    let mut seen = std::collections::BTreeMap::new();
    let of = |Entry { name, kind, .. }: &Entry| {
        let number = seen.entry(name.clone()).or_insert(0);
        let unique = if counts[name] > 1 { format!("{name}[{number}]") } else { name.clone() };
        *number += 1;
        Listed { name: name.clone(), unique, kind: kind_name(*kind) }
    };
    entries.iter().map(of).collect()
}

/// The grids of a file.
pub fn list(source: &mut Source) -> Result<Vec<Listed>, String> {
    Ok(listed(&entries(source)?))
}
