//! Files of OpenVDB and NanoVDB that others wrote (`tools/vdb_files.py`): every voxel as they read it; damaged files;
//! scenes with them.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::ZlibDecoder;
use steradian::internal::assets::{GridChoice, VdbGrid, list_vdb, read_vdb, read_vdb_within};
use steradian::internal::math::Rng;

use crate::util::root;

/// A choice that any file with one grid fulfils.
const ONLY: GridChoice = GridChoice { name: None, default: "density" };

/// No voxels of these files take more.
const MOST_BYTES: usize = 32 << 20;

fn file(name: &str) -> PathBuf {
    root().join("tests/regressions/vdb").join(name)
}

fn grid(name: &str, choice: GridChoice) -> VdbGrid {
    read_vdb(&file(name), choice).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn error(name: &str, choice: GridChoice) -> String {
    read_vdb(&file(name), choice).map(|_| String::new()).unwrap_or_else(|e| e.to_string())
}

/// A multiple of 1/64.
fn value([x, y, z]: [i64; 3]) -> f32 {
    (7 * x + 13 * y + 29 * z).rem_euclid(64) as f32 / 64.0
}

/// The octahedron of most files.
fn smoke([x, y, z]: [i64; 3]) -> f32 {
    if (x + 12).abs() + (y + 20).abs() + (z + 11).abs() <= 9 { value([x, y, z]) } else { 0.0 }
}

fn is_within(p: [i64; 3], min: [i64; 3], max: [i64; 3]) -> bool {
    (0..3).all(|axis| (min[axis]..=max[axis]).contains(&p[axis]))
}

fn tiles(p: [i64; 3]) -> f32 {
    match p {
        [110, 9, 17] => 1.0,
        _ if is_within(p, [128, 0, 0], [255, 127, 127]) => 0.25,
        _ if is_within(p, [112, 8, 16], [119, 15, 23]) => 0.5,
        _ if is_within(p, [120, 8, 16], [127, 15, 23]) => 0.75,
        _ => 0.0,
    }
}

/// Inactive voxels of a leaf have one, two or more values: its background, its negative, and others.
fn masks(p: [i64; 3]) -> f32 {
    const INACTIVE: [&[f32]; 7] =
        [&[0.25], &[-0.25], &[0.5], &[0.25, -0.25], &[0.25, 0.5], &[0.5, 0.75], &[0.5, 0.75, 1.0]];
    let sum: i64 = p.iter().sum();
    if !is_within(p, [0; 3], [55, 7, 7]) {
        0.25
    } else if sum % 3 == 0 {
        value(p)
    } else {
        let inactive = INACTIVE[p[0] as usize / 8];
        inactive[sum as usize % inactive.len()]
    }
}

/// The index coordinates of all voxels, in the order of their values.
fn places(grid: &VdbGrid) -> impl Iterator<Item = [i64; 3]> {
    let ([x0, y0, z0], [nx, ny, nz]) = (grid.origin, grid.voxels.resolution.map(i64::from));
    let at = move |i: i64| [x0 + i % nx, y0 + i / nx % ny, z0 + i / nx / ny];
    (0..nx * ny * nz).map(at)
}

/// The box of the smoke and one voxel around it, whose voxels are at most `tolerance` away from what is expected.
#[track_caller]
fn assert_smoke(name: &str, grid: &VdbGrid, tolerance: f32) {
    assert_eq!((grid.origin, grid.voxels.resolution, grid.voxels.channels), ([-22, -30, -21], [21; 3], 1), "{name}");
    for (p, &found) in places(grid).zip(&grid.voxels.values) {
        assert!((found - smoke(p)).abs() <= tolerance, "{name} {p:?}: {found}");
    }
}

#[test]
fn voxels_of_every_compression_are_those_that_openvdb_reads() {
    for name in ["none", "active", "zip", "zip_all", "blosc", "blosc_all", "half", "half_zip", "double", "turned"] {
        assert_smoke(name, &grid(&format!("{name}.vdb"), ONLY), 0.0);
    }
    assert_smoke("Blender", &grid("blender.vdb", ONLY), 0.0);
    for name in ["blosc.nvdb", "blosc_zip.nvdb", "turned_zip.nvdb"] {
        assert_smoke(name, &grid(name, ONLY), 0.0);
    }
}

#[test]
fn quantized_voxels_are_as_close_as_their_bits_allow() {
    // A leaf has values from 0 to 63/64 at most, in steps of a code; those of any number of bits are within 0.004.
    for (name, tolerance) in [("fp4", 0.5 / 15.0), ("fp8", 0.5 / 255.0), ("fp16", 0.5 / 65535.0), ("fpN", 0.004)] {
        assert_smoke(name, &grid(&format!("{name}.nvdb"), ONLY), tolerance + 1e-6);
    }
}

#[test]
fn cubes_of_one_value_and_inactive_voxels_have_their_values() {
    for (name, origin, resolution) in [("tiles", [109, -1, -1], [148, 130, 130]), ("masks", [-1; 3], [58, 10, 10])] {
        for file in [format!("{name}.vdb"), format!("{name}_zip.nvdb")] {
            let grid = grid(&file, ONLY);
            let expected = if name == "tiles" { tiles } else { masks };
            assert_eq!((grid.origin, grid.voxels.resolution), (origin, resolution), "{file}");
            for (p, &found) in places(&grid).zip(&grid.voxels.values) {
                assert_eq!(found, expected(p), "{file} {p:?}");
            }
        }
    }
}

#[test]
fn colours_have_three_numbers() {
    for name in ["colours.vdb", "vec3d.vdb", "colours_zip.nvdb"] {
        let grid = grid(name, ONLY);
        assert_eq!((grid.origin, grid.voxels.channels), ([-22, -30, -21], 3), "{name}");
        for (p, found) in places(&grid).zip(grid.voxels.values.as_chunks::<3>().0) {
            let value = smoke(p);
            let is_inside = (p[0] + 12).abs() + (p[1] + 20).abs() + (p[2] + 11).abs() <= 9;
            assert_eq!(*found, [value, value / 2.0, f32::from(u8::from(is_inside))], "{name} {p:?}");
        }
    }
}

#[test]
fn voxels_are_where_the_transform_places_them() {
    // The middle of voxel (-22, -30, -21) is half a voxel from the first corner.
    for (name, middle, end) in [
        ("blosc.vdb", [-10.0, -13.0, -7.5], [-10.0 + 10.5, -13.0 + 10.5, -7.5 + 10.5]),
        ("blosc_zip.nvdb", [-10.0, -13.0, -7.5], [0.5, -2.5, 3.0]),
        ("blender.vdb", [-5.5, -7.5, -5.25], [-0.25, -2.25, 0.0]),
        ("turned.vdb", [-22.0, -5.5, -13.0], [-1.0, -0.25, -2.5]),
        ("turned_zip.nvdb", [-22.0, -5.5, -13.0], [-1.0, -0.25, -2.5]),
    ] {
        let map = grid(name, ONLY).world_from_voxels;
        let [found, opposite] = [0.5, 21.5].map(|x| map.transform_point3([x; 3].into()).to_array());
        for axis in 0..3 {
            assert!((found[axis] - middle[axis]).abs() < 1e-9, "{name}: {found:?}");
            assert!((opposite[axis] - end[axis]).abs() < 1e-9, "{name}: {opposite:?}");
        }
    }
}

#[test]
fn grids_are_found_by_name_and_share_trees() {
    let named = |name| GridChoice { name, default: "density" };
    for file in ["several.vdb", "several_zip.nvdb"] {
        let kinds = list_vdb(&self::file(file)).unwrap();
        let names: Vec<&str> = kinds.iter().map(|(name, kind)| (name.as_str(), assert_eq!(kind, "float")).0).collect();
        assert_eq!(names, ["density[0]", "density[1]", "temperature"]);
        let [first, second] = ["density[0]", "density[1]"].map(|name| grid(file, named(Some(name))));
        assert_smoke(file, &first, 0.0);
        assert_smoke(file, &second, 0.0);
        let scale = |grid: &VdbGrid| grid.world_from_voxels.matrix3.determinant();
        assert!((scale(&first) - 0.125).abs() < 1e-12 && (scale(&second) - 8.0).abs() < 1e-12);
        let heat = grid(file, GridChoice { name: None, default: "temperature" });
        assert_eq!((heat.origin, heat.voxels.resolution), ([-14, -22, -13], [9; 3]));
        assert!(error(file, named(None)).contains("several grids named \"density\""));
        assert!(error(file, named(Some("heat"))).contains("no grid named \"heat\", but \"density[0]\" (float)"));
    }
    let empty = grid("empty.vdb", ONLY);
    assert_eq!((empty.origin, empty.voxels.values), ([-1; 3], vec![0.0; 27]));
}

#[test]
fn what_is_not_supported_is_said() {
    for (name, expected) in [
        ("level_set.vdb", "grid \"surface\" is a level set"),
        ("bool.vdb", "grid \"flags\" is of type Tree_bool_5_4_3, only float"),
        ("frustum.vdb", "frustum of a camera"),
        ("stream.vdb", "written as a stream"),
    ] {
        assert!(error(name, ONLY).contains(expected), "{}", error(name, ONLY));
    }
    let few = read_vdb_within(&file("blosc.vdb"), ONLY, 1000).unwrap_err().to_string();
    assert!(few.contains("21 x 21 x 21, takes 37044 bytes, more memory than there is"), "{few}");
    let gone = read_vdb(Path::new("gone.vdb"), ONLY).unwrap_err().to_string();
    assert!(gone.contains("gone.vdb: No such file"), "{gone}");
}

/// The bytes of the first grid of a NanoVDB file of one segment that is compressed by zlib.
fn bare_grid(bytes: &[u8]) -> Vec<u8> {
    let name_length = u32::from_le_bytes(bytes[16 + 136..16 + 140].try_into().unwrap()) as usize;
    let mut grid = Vec::new();
    ZlibDecoder::new(&bytes[16 + 176 + name_length + 8..]).read_to_end(&mut grid).unwrap();
    grid
}

#[test]
fn nanovdb_files_may_be_uncompressed_bare_and_of_the_later_magic_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let zipped = std::fs::read(file("blosc_zip.nvdb")).unwrap();
    let bare = bare_grid(&zipped);
    let head = 16 + 176 + "density\0".len();
    let mut whole = [&zipped[..head], &bare].concat();
    // No compression, and as many bytes in the file as of the grid.
    whole[14] = 0;
    whole.copy_within(16..24, 24);
    let with = |bytes: &[u8], at: usize, magic: &[u8]| [&bytes[..at], magic, &bytes[at + 8..]].concat();
    for (i, bytes) in [
        whole.clone(),
        with(&with(&whole, 0, b"NanoVDB2"), head, b"NanoVDB1"),
        bare.clone(),
        with(&bare, 0, b"NanoVDB1"),
        [zipped.clone(), zipped].concat(),
    ]
    .iter()
    .enumerate()
    {
        let path = folder.path().join(format!("{i}.nvdb"));
        std::fs::write(&path, bytes).unwrap();
        let name = if i == 4 { Some("density[1]") } else { None };
        assert_smoke(&i.to_string(), &read_vdb(&path, GridChoice { name, ..ONLY }).unwrap(), 0.0);
    }
    let mut old = whole;
    old[8..12].copy_from_slice(&(28u32 << 21).to_le_bytes());
    std::fs::write(folder.path().join("old.nvdb"), &old).unwrap();
    let message = read_vdb(&folder.path().join("old.nvdb"), ONLY).unwrap_err().to_string();
    assert!(message.contains("version 28.0.0 of the NanoVDB format"), "{message}");
}

/// Reads what may be damaged: an error, or a grid as large as it claims.
fn read_damaged(path: &Path) -> Option<String> {
    let _ = list_vdb(path);
    match read_vdb_within(path, ONLY, MOST_BYTES) {
        Ok(grid) => {
            let voxels: usize = grid.voxels.resolution.iter().map(|&edge| edge as usize).product();
            assert_eq!(grid.voxels.values.len(), voxels * grid.voxels.channels as usize);
            assert!(grid.world_from_voxels.is_finite());
            None
        }
        Err(error) => Some(error.to_string()),
    }
}

#[test]
fn truncated_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short");
    for name in ["blosc.vdb", "half_zip.vdb", "blosc.nvdb", "blosc_zip.nvdb", "fpN.nvdb"] {
        let bytes = std::fs::read(file(name)).unwrap();
        let lengths = (0..400).chain((400..bytes.len()).step_by(97)).chain([bytes.len() - 1]);
        for length in lengths.filter(|&length| length < bytes.len()) {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let error = read_damaged(&path).unwrap_or_else(|| panic!("{name}: {length}"));
            assert!(!error.is_empty());
        }
    }
}

#[test]
fn changed_bytes_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed");
    let mut rng = Rng::new(8);
    let mut refused = 0;
    for name in ["active.vdb", "zip.vdb", "blosc_all.vdb", "masks.vdb", "several.vdb", "tiles.vdb", "blosc.nvdb"] {
        let good = std::fs::read(file(name)).unwrap();
        for _ in 0..150 {
            let mut bytes = good.clone();
            // Where most of what has a meaning is: the first bytes, and anywhere.
            for _ in 0..1 + rng.below(3) {
                let within = if rng.below(2) == 0 { bytes.len().min(1200) } else { bytes.len() };
                let at = rng.below(within);
                bytes[at] = [0, 1, 0x7f, 0x80, 0xff, rng.below(256) as u8][rng.below(6)];
            }
            std::fs::write(&path, &bytes).unwrap();
            refused += usize::from(read_damaged(&path).is_some());
        }
    }
    assert!(refused > 200, "{refused}");
}

#[test]
fn changed_nodes_of_nanovdb_trees_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed");
    let mut rng = Rng::new(9);
    let mut refused = 0;
    for name in ["blosc_zip.nvdb", "fp8.nvdb", "fpN.nvdb", "colours_zip.nvdb"] {
        let good = bare_grid(&std::fs::read(file(name)).unwrap());
        // Nodes begin behind the heads of grid, tree and root; most of their bytes are zero.
        let used: Vec<usize> = (640..good.len()).filter(|&at| good[at] != 0 || at < 1200).collect();
        for _ in 0..150 {
            let mut bytes = good.clone();
            let at = used[rng.below(used.len())];
            bytes[at] = [0, 1, 0x7f, 0x80, 0xff, rng.below(256) as u8][rng.below(6)];
            std::fs::write(&path, &bytes).unwrap();
            refused += usize::from(read_damaged(&path).is_some());
        }
    }
    assert!(refused > 20, "{refused}");
}
