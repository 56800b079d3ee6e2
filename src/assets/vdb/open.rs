//! OpenVDB files, whose format is that of `openvdb/io/Archive.cc`, versions 222 to 224: a header, metadata of the file,
//! and for each grid a descriptor with the places of its data: compression, metadata, transform, topology and voxels.

use super::codec::Codec;
use super::cursor::{Cursor, Source};
use super::list::{Listed, choose};
use super::open_tree::{OpenLayout, read_tree};
use super::{GridChoice, VdbGrid};
use crate::math::{DAffine3, DMat3, DVec3};

/// The first eight bytes.
pub const MAGIC: [u8; 8] = *b" BDV\0\0\0\0";

/// With masks of nodes, and the latest.
const VERSIONS: [u32; 2] = [222, 224];

/// Bytes of the file's identifier.
const IDENTIFIER: usize = 36;

/// The most grids of a file.
const MAX_GRIDS: i32 = 1 << 12;

/// Grids whose floats are stored in 16 bits have types that end with this.
const HALF: &str = "_HalfFloat";

/// What stands between the name of a grid and its number among those of that name.
const SEPARATOR: char = '\x1e';

/// A grid as the file announces it.
#[derive(Clone, Debug)]
struct Descriptor {
    /// Its name and, if there are more of that name, its number.
    unique: String,
    kind: String,
    is_half: bool,
    /// The unique name of the grid that has its tree; empty if it has its own.
    parent: String,
    start: u64,
    end: u64,
}

impl Descriptor {
    fn listed(&self) -> Listed {
        let (name, number) = self.unique.split_once(SEPARATOR).unwrap_or((&self.unique, ""));
        let unique = if number.is_empty() { name.to_owned() } else { format!("{name}[{number}]") };
        let kind = self.kind.strip_suffix("_5_4_3").and_then(|kind| kind.strip_prefix("Tree_"));
        Listed { name: name.to_owned(), unique, kind: kind.unwrap_or(&self.kind).to_owned() }
    }
}

/// The descriptors of all grids.
fn descriptors(source: &mut Source) -> Result<Vec<Descriptor>, String> {
    let (count, mut at) = source.parse(0, header)?;
    let mut all = Vec::new();
    for _ in 0..count {
        let (descriptor, behind) = source.parse(at, descriptor).map_err(|e| format!("a grid's descriptor {e}"))?;
        let Descriptor { start, end, .. } = descriptor;
        if start < behind || end < start || end > source.length() {
            let message = format!("bytes {start} to {end} of {}", source.length());
            return Err(format!(
                "the file is truncated or damaged: grid \"{}\" has {message}",
                descriptor.listed().name
            ));
        }
        at = end;
        all.push(descriptor);
    }
    Ok(all)
}

/// The number of grids.
fn header(cursor: &mut Cursor) -> Result<i32, String> {
    cursor.take(MAGIC.len())?;
    let version = cursor.u32()?;
    if !(VERSIONS[0]..=VERSIONS[1]).contains(&version) {
        let [first, last] = VERSIONS;
        return Err(format!(
            "version {version} of the OpenVDB format is not supported, only {first} to {last}: write the file again \
             with a current OpenVDB"
        ));
    }
    let in_header = |e| format!("the header {e}");
    cursor.take(8).map_err(in_header)?;
    let [has_offsets] = cursor.array().map_err(in_header)?;
    cursor.take(IDENTIFIER).map_err(in_header)?;
    metadata(cursor, |_, _, _| ()).map_err(in_header)?;
    let count = cursor.i32().map_err(in_header)?;
    if !(0..=MAX_GRIDS).contains(&count) {
        return Err(format!("the file claims {count} grids, at most {MAX_GRIDS} are supported"));
    }
    if has_offsets == 0 && count > 0 {
        return Err("the file was written as a stream, without places of grids: write it as a file".into());
    }
    Ok(count)
}

/// Passes over metadata; `each` is given name, type and value of all.
fn metadata<'a>(cursor: &mut Cursor<'a>, mut each: impl FnMut(&str, &str, &'a [u8])) -> Result<(), String> {
    for _ in 0..cursor.u32()? {
        let (name, kind) = (cursor.text()?, cursor.text()?);
        let length = cursor.u32()? as usize;
        each(&name, &kind, cursor.take(length)?);
    }
    Ok(())
}

fn descriptor(cursor: &mut Cursor) -> Result<Descriptor, String> {
    let (unique, kind, parent) = (cursor.text()?, cursor.text()?, cursor.text()?);
    let mut place = || cursor.i64().map(|at| u64::try_from(at).unwrap_or(u64::MAX));
    let [start, _voxels, end] = [place()?, place()?, place()?];
    let (kind, is_half) = match kind.strip_suffix(HALF) {
        Some(whole) => (whole.to_owned(), true),
        None => (kind, false),
    };
    Ok(Descriptor { unique, kind, is_half, parent, start, end })
}

/// What stands before a grid's tree.
struct GridHead {
    layout: OpenLayout,
    world_from_index: DAffine3,
}

impl GridHead {
    fn read(cursor: &mut Cursor, grid: &Descriptor) -> Result<Self, String> {
        let flags = cursor.u32()?;
        let codec = match flags & !2 {
            0 => Codec::None,
            1 => Codec::Zip,
            4 | 5 => Codec::Blosc,
            _ => return Err(format!("has an unknown compression {flags}")),
        };
        let (mut class, mut is_half) = (Vec::new(), grid.is_half);
        metadata(cursor, |name, kind, value| match (name, kind) {
            ("class", "string") => class = value.to_vec(),
            ("is_saved_as_half_float", "bool") => is_half |= value.first().is_some_and(|byte| *byte != 0),
            _ => (),
        })?;
        if class == b"level set" {
            return Err(super::LEVEL_SET.into());
        }
        let layout = OpenLayout::new(&grid.kind, is_half, codec, flags & 2 != 0)?;
        Ok(Self { layout, world_from_index: transform(cursor)? })
    }
}

/// The place of index coordinates in the world.
fn transform(cursor: &mut Cursor) -> Result<DAffine3, String> {
    let scaled = |scale: [f64; 3], translation: [f64; 3]| DAffine3 {
        matrix3: DMat3::from_diagonal(scale.into()),
        translation: translation.into(),
    };
    let kind = cursor.text()?;
    let map = match kind.as_str() {
        // Behind the scale stand sizes of voxels and powers of the scale.
        "UniformScaleMap" | "ScaleMap" => {
            let [x, y, z, ..] = cursor.doubles::<15>()?;
            scaled([x, y, z], [0.0; 3])
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let [a, b, c, x, y, z, ..] = cursor.doubles::<18>()?;
            scaled([x, y, z], [a, b, c])
        }
        "TranslationMap" => scaled([1.0; 3], cursor.doubles()?),
        "AffineMap" | "UnitaryMap" => {
            // By rows; points are rows that are multiplied from the left.
            let numbers = cursor.doubles::<16>()?;
            let (rows, _) = numbers.as_chunks::<4>();
            if rows.iter().map(|row| row[3]).ne([0.0, 0.0, 0.0, 1.0]) {
                return Err("has a projective transform, which is not supported".into());
            }
            let [x, y, z, translation] = [0, 1, 2, 3].map(|i| DVec3::new(rows[i][0], rows[i][1], rows[i][2]));
            DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation }
        }
        "NonlinearFrustumMap" => {
            return Err("has voxels in the frustum of a camera, which is not supported: resample it to a box".into());
        }
        _ => return Err(format!("has an unknown transform {kind:?}")),
    };
    super::check_transform(&map)?;
    Ok(map)
}

/// Reads a grid whose voxels take at most `most_bytes`.
pub fn read(source: &mut Source, choice: GridChoice, most_bytes: usize) -> Result<VdbGrid, String> {
    let all = descriptors(source)?;
    let listed: Vec<Listed> = all.iter().map(Descriptor::listed).collect();
    let chosen = choose(&listed, choice)?;
    let named = |e: String| format!("grid \"{}\" {e}", listed[chosen].unique);
    let grid = &all[chosen];
    let bytes = source.range(grid.start, grid.end)?;
    let mut cursor = Cursor::new(&bytes);
    let head = GridHead::read(&mut cursor, grid).map_err(named)?;
    let dense = if grid.parent.is_empty() {
        read_tree(&head.layout, &mut cursor).and_then(|tree| tree.densify(&head.layout, most_bytes)).map_err(named)?
    } else {
        // The tree is that of another grid, the transform its own.
        let parent = all.iter().find(|other| other.unique == grid.parent && other.parent.is_empty());
        let parent = parent.ok_or_else(|| named(format!("shares the tree of {:?}, which has none", grid.parent)))?;
        let bytes = source.range(parent.start, parent.end)?;
        let mut cursor = Cursor::new(&bytes);
        let GridHead { layout, .. } = GridHead::read(&mut cursor, parent).map_err(named)?;
        read_tree(&layout, &mut cursor).and_then(|tree| tree.densify(&layout, most_bytes)).map_err(named)?
    };
    VdbGrid::new(listed[chosen].unique.clone(), head.layout.channels(), dense, &head.world_from_index)
}

/// The grids of a file.
pub fn list(source: &mut Source) -> Result<Vec<Listed>, String> {
    Ok(descriptors(source)?.iter().map(Descriptor::listed).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(kind: &str, numbers: &[f64]) -> Result<DAffine3, String> {
        let mut bytes = (kind.len() as u32).to_le_bytes().to_vec();
        bytes.extend(kind.as_bytes());
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        transform(&mut Cursor::new(&bytes))
    }

    #[test]
    fn transforms_place_index_coordinates() {
        let scale = [&[2.0, 3.0, 4.0][..], &[0.0; 12]].concat();
        let p = DVec3::new(1.0, 10.0, 100.0);
        assert_eq!(map("ScaleMap", &scale).unwrap().transform_point3(p), DVec3::new(2.0, 30.0, 400.0));
        let both = [&[5.0, 6.0, 7.0][..], &scale].concat();
        assert_eq!(map("ScaleTranslateMap", &both).unwrap().transform_point3(p), DVec3::new(7.0, 36.0, 407.0));
        assert_eq!(map("TranslationMap", &[5.0, 6.0, 7.0]).unwrap().transform_point3(p), DVec3::new(6.0, 16.0, 107.0));
        // x becomes y, and is shifted by 5.
        let rows = [0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 0.0, 0.0, 1.0];
        assert_eq!(map("AffineMap", &rows).unwrap().transform_point3(p), DVec3::new(25.0, 1.0, 100.0));
    }

    #[test]
    fn transforms_that_place_nothing_are_refused() {
        let rows = |i: usize, x: f64| {
            let mut rows = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            rows[i] = x;
            map("AffineMap", &rows).map(|_| String::new()).unwrap_or_else(|e| e)
        };
        assert_eq!(rows(1, 9.0), "");
        for (i, x, expected) in
            [(0, 0.0, "flattens"), (0, f64::NAN, "flattens"), (3, 1.0, "projective"), (12, f64::INFINITY, "flattens")]
        {
            assert!(rows(i, x).contains(expected), "{i}: {}", rows(i, x));
        }
        assert!(map("NonlinearFrustumMap", &[]).unwrap_err().contains("frustum"));
        assert!(map("TwistMap", &[]).unwrap_err().contains("TwistMap"));
        assert!(map("ScaleMap", &[1.0; 14]).unwrap_err().contains("ends early"));
    }
}
