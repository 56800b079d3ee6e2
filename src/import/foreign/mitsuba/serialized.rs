//! Mitsuba's serialized meshes: several of them in a file, each compressed by zlib, with a table of their offsets at
//! the end.

use std::io::{BufReader, Read};
use std::path::Path;

use flate2::read::ZlibDecoder;

use crate::assets::{AssetError, MeshData};

const MAGIC: u16 = 0x041c;

const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const IS_DOUBLE: u32 = 0x2000;

/// No mesh has so little in it that it takes this many times less when compressed.
const MAX_EXPANSION: u64 = 100;

/// Bytes of a mesh that are allocated at once: memory for its counts grows only as its data is read.
const CHUNK: usize = 1 << 16;

/// A mesh of a file by its index.
///
/// # Errors
/// If the file is missing or malformed or has no such mesh.
pub fn read(path: &Path, index: u32) -> Result<MeshData, AssetError> {
    let bytes =
        crate::file::read(path).map_err(|e| AssetError::Missing { file: path.into(), message: e.to_string() })?;
    parse(&bytes, index).map_err(AssetError::Malformed)
}

fn parse(bytes: &[u8], index: u32) -> Result<MeshData, String> {
    let short = || "the serialized file is cut short".to_owned();
    let version = header(bytes).ok_or("not a serialized mesh file")?;
    let count_at = bytes.len().checked_sub(4).ok_or_else(short)?;
    let count = number(bytes, count_at, 4).ok_or_else(short)?;
    if u64::from(index) >= count {
        return Err(format!("the file has {count} meshes: no index {index}"));
    }
    // Offsets of all meshes stand before their number.
    let width = if version >= 4 { 8 } else { 4 };
    let table = usize::try_from(count)
        .ok()
        .and_then(|count| count_at.checked_sub(count.checked_mul(width)?))
        .ok_or_else(short)?;
    let offset = number(bytes, table + index as usize * width, width).and_then(|offset| usize::try_from(offset).ok());
    let mesh = offset
        .and_then(|offset| bytes.get(offset..table))
        .ok_or("an offset in the serialized file lies outside of it")?;
    let version = header(mesh).ok_or("an offset in the serialized file does not lead to a mesh")?;
    let packed = mesh.get(4..).ok_or_else(short)?;
    let limit = MAX_EXPANSION.saturating_mul(packed.len() as u64).saturating_add(CHUNK as u64);
    let mut stream = BufReader::new(ZlibDecoder::new(packed).take(limit));
    decode(&mut stream, version).map_err(|e| format!("the serialized mesh is damaged: {e}"))
}

/// The version of a mesh that begins here.
fn header(bytes: &[u8]) -> Option<u64> {
    let version = number(bytes, 2, 2)?;
    (number(bytes, 0, 2)? == u64::from(MAGIC) && (3..=4).contains(&version)).then_some(version)
}

/// A little-endian number of `width` bytes.
fn number(bytes: &[u8], at: usize, width: usize) -> Option<u64> {
    let part = bytes.get(at..at.checked_add(width)?)?;
    Some(part.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b)))
}

fn decode(stream: &mut impl Read, version: u64) -> Result<MeshData, String> {
    let flags = u32::from_le_bytes(array(stream)?);
    if version >= 4 {
        // A name, up to its zero.
        while array::<1>(stream)? != [0] {}
    }
    let vertices = u64::from_le_bytes(array(stream)?);
    let triangles = u64::from_le_bytes(array(stream)?);
    if vertices > u64::from(u32::MAX) {
        return Err(format!("{vertices} vertices are too many"));
    }
    let is_double = flags & IS_DOUBLE != 0;
    let (positions, origin) = if is_double {
        let mut flat = Vec::new();
        values::<8>(stream, vertices * 3, |bytes| flat.push(f64::from_le_bytes(bytes)))?;
        MeshData::rounded(flat.as_chunks::<3>().0)
    } else {
        (tuples::<3>(stream, vertices, false)?, [0.0; 3])
    };
    let normals = (flags & HAS_NORMALS != 0).then(|| tuples::<3>(stream, vertices, is_double)).transpose()?;
    let uvs = (flags & HAS_UVS != 0).then(|| tuples::<2>(stream, vertices, is_double)).transpose()?;
    let colors = (flags & HAS_COLORS != 0).then(|| tuples::<3>(stream, vertices, is_double)).transpose()?;
    let mut corners = Vec::new();
    let count = triangles.checked_mul(3).ok_or("too many triangles")?;
    values::<4>(stream, count, |bytes| corners.push(u32::from_le_bytes(bytes)))?;
    Ok(MeshData {
        positions,
        triangles: corners.as_chunks::<3>().0.to_vec(),
        normals,
        uvs,
        origin,
        ..MeshData::default()
    }
    .with_colors(colors))
}

/// `count` tuples of floats or doubles.
fn tuples<const N: usize>(stream: &mut impl Read, count: u64, is_double: bool) -> Result<Vec<[f32; N]>, String> {
    let mut flat = Vec::new();
    let count = count * N as u64;
    if is_double {
        values::<8>(stream, count, |bytes| flat.push(f64::from_le_bytes(bytes) as f32))?;
    } else {
        values::<4>(stream, count, |bytes| flat.push(f32::from_le_bytes(bytes)))?;
    }
    Ok(flat.as_chunks::<N>().0.to_vec())
}

/// `count` values of `W` bytes.
fn values<const W: usize>(stream: &mut impl Read, count: u64, mut push: impl FnMut([u8; W])) -> Result<(), String> {
    let mut left = count.checked_mul(W as u64).ok_or("too many numbers")?;
    let mut chunk = vec![0; CHUNK];
    while left > 0 {
        let part = &mut chunk[..usize::try_from(left).unwrap_or(CHUNK).min(CHUNK)];
        stream.read_exact(part).map_err(|e| e.to_string())?;
        part.as_chunks::<W>().0.iter().for_each(|bytes| push(*bytes));
        left -= part.len() as u64;
    }
    Ok(())
}

fn array<const N: usize>(stream: &mut impl Read) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    stream.read_exact(&mut bytes).map_err(|e| e.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Write;

    use super::*;

    /// A file of one-triangle meshes, each moved along x by its index; with uv.
    pub(in super::super) fn file(count: u32, is_double: bool) -> Vec<u8> {
        let (mut bytes, mut offsets) = (Vec::new(), Vec::new());
        for i in 0..count {
            offsets.push(bytes.len() as u64);
            bytes.extend([0x1c, 0x04, 4, 0]);
            let mut body = Vec::new();
            body.extend((HAS_UVS | if is_double { IS_DOUBLE } else { 0x1000 }).to_le_bytes());
            body.extend(b"name\0");
            body.extend(3u64.to_le_bytes());
            body.extend(1u64.to_le_bytes());
            let x = f64::from(i);
            for v in [x, 0.0, 0.0, x + 1.0, 0.0, 0.0, x, 1.0, 0.0, 0.0, 0.25, 1.0, 0.25, 0.0, 1.0] {
                if is_double { body.extend(v.to_le_bytes()) } else { body.extend((v as f32).to_le_bytes()) }
            }
            [0u32, 1, 2].iter().for_each(|i| body.extend(i.to_le_bytes()));
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            encoder.write_all(&body).unwrap();
            bytes.extend(encoder.finish().unwrap());
        }
        offsets.iter().for_each(|offset| bytes.extend(offset.to_le_bytes()));
        bytes.extend(count.to_le_bytes());
        bytes
    }

    #[test]
    fn meshes_are_found_by_index() {
        for is_double in [false, true] {
            let bytes = file(3, is_double);
            let mesh = parse(&bytes, 2).unwrap();
            assert_eq!(mesh.positions, [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0]]);
            assert_eq!(mesh.uvs.unwrap()[0], [0.0, 0.25]);
            assert_eq!(mesh.triangles, [[0, 1, 2]]);
            assert!(mesh.normals.is_none());
            assert!(parse(&bytes, 3).unwrap_err().contains("3 meshes"));
        }
    }

    #[test]
    fn damaged_files_are_errors() {
        let bytes = file(2, false);
        for end in 0..bytes.len() {
            // The number at the end is then some other one.
            let _ = parse(&bytes[..end], 0);
        }
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 0xff;
            let _ = parse(&damaged, 0);
        }
        assert!(parse(b"", 0).is_err() && parse(b"ply\n0000000000", 0).is_err());
        assert!(parse(&bytes[..20], 0).is_err());
    }
}
