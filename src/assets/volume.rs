//! Volumes: numbers or colours of the voxels of a box, in Mitsuba's format and as plain floats.

use std::io::Read;
use std::path::Path;

use super::AssetError;

/// The most voxels along an edge.
const MAX_EDGE: u32 = 1 << 14;

/// Bytes before the values of a `.vol` file.
const HEADER: usize = 48;

/// The version of `.vol` files that is read and written.
const VERSION: u8 = 3;

/// The encoding of values as 32-bit floats.
const FLOAT_32: i32 = 1;

/// Numbers or colours of voxels, that nobody has checked.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeData {
    /// Voxels along x, y and z, each above 0.
    pub resolution: [u32; 3],
    /// Numbers of each voxel: 1 or 3.
    pub channels: u32,
    /// By z, then y, then x, then channel.
    pub values: Vec<f32>,
}

impl VolumeData {
    /// A volume of these values.
    ///
    /// # Errors
    /// What is wrong with the resolution, the channels or the number of values.
    pub fn new(resolution: [u32; 3], channels: u32, values: Vec<f32>) -> Result<Self, String> {
        let needed = count(resolution, channels)?;
        if needed != values.len() {
            let found = values.len();
            return Err(format!("{resolution:?} voxels of {channels} numbers are {needed} values, not {found}"));
        }
        Ok(Self { resolution, channels, values })
    }
}

/// How many values a volume has.
fn count(resolution: [u32; 3], channels: u32) -> Result<usize, String> {
    if !resolution.iter().all(|edge| (1..=MAX_EDGE).contains(edge)) {
        return Err(format!("the resolution {resolution:?} must be from 1 to {MAX_EDGE} along each axis"));
    }
    if channels != 1 && channels != 3 {
        return Err(format!("voxels have 1 number or 3 (red, green and blue), not {channels}"));
    }
    // At most 2^44, and on 64 bits thus no overflow.
    Ok(resolution.iter().map(|&edge| edge as usize).product::<usize>() * channels as usize)
}

/// Reads Mitsuba's volume format: a header of 48 bytes (`VOL`, the version 3 in one byte, then little-endian `i32`: the
/// encoding 1, voxels along x, y and z, channels; then six `f32` of a box, which is not used), and little-endian `f32`.
///
/// # Errors
/// [`AssetError`] if the file cannot be read, is no such file, or its length does not fit its header.
pub fn read_vol(path: &Path) -> Result<VolumeData, AssetError> {
    let bytes = crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?;
    parse_vol(&bytes).map_err(AssetError::Malformed)
}

/// What the header of a `.vol` file has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolHeader {
    /// Voxels along x, y and z.
    pub resolution: [u32; 3],
    /// Numbers of each voxel.
    pub channels: u32,
    /// Two corners of a box.
    pub bounds: [[f32; 3]; 2],
}

/// Reads the header of a `.vol` file.
///
/// # Errors
/// As [`read_vol`], but for the length of the file.
pub fn read_vol_header(path: &Path) -> Result<VolHeader, AssetError> {
    let mut start = [0; HEADER];
    let mut file = crate::file::open(path).map_err(|e| AssetError::missing(path, &e))?;
    file.read_exact(&mut start).map_err(|_| AssetError::Malformed("this is no .vol file".into()))?;
    VolHeader::parse(&start).map_err(AssetError::Malformed)
}

impl VolHeader {
    fn parse(header: &[u8; HEADER]) -> Result<Self, String> {
        if !header.starts_with(b"VOL") {
            return Err("this is no .vol file".into());
        }
        if header[3] != VERSION {
            return Err(format!("version {} of the format is not supported, only {VERSION}", header[3]));
        }
        let (words, _) = header[4..].as_chunks();
        let word = |i: usize| i32::from_le_bytes(words[i]);
        if word(0) != FLOAT_32 {
            return Err(format!("values of encoding {} are not supported, only {FLOAT_32} (32-bit floats)", word(0)));
        }
        let size =
            |i: usize| u32::try_from(word(i)).map_err(|_| format!("the header has a negative size: {}", word(i)));
        let float = |i: usize| f32::from_le_bytes(words[i]);
        Ok(Self {
            resolution: [size(1)?, size(2)?, size(3)?],
            channels: size(4)?,
            bounds: [[float(5), float(6), float(7)], [float(8), float(9), float(10)]],
        })
    }
}

fn parse_vol(bytes: &[u8]) -> Result<VolumeData, String> {
    let (header, values) = bytes.split_first_chunk().ok_or("this is no .vol file")?;
    let VolHeader { resolution, channels, .. } = VolHeader::parse(header)?;
    floats(values, resolution, channels)
}

/// Reads a file of nothing but little-endian `f32`: by z, then y, then x, then channel.
///
/// # Errors
/// [`AssetError`] if the file cannot be read or has another length than these numbers need.
pub fn read_raw_volume(path: &Path, resolution: [u32; 3], channels: u32) -> Result<VolumeData, AssetError> {
    let bytes = crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?;
    floats(&bytes, resolution, channels).map_err(AssetError::Malformed)
}

fn floats(bytes: &[u8], resolution: [u32; 3], channels: u32) -> Result<VolumeData, String> {
    let needed = 4 * count(resolution, channels)?;
    if bytes.len() != needed {
        let found = bytes.len();
        return Err(format!(
            "{resolution:?} voxels of {channels} numbers need {needed} bytes of values; the file has {found}"
        ));
    }
    let (words, _) = bytes.as_chunks();
    VolumeData::new(resolution, channels, words.iter().map(|word| f32::from_le_bytes(*word)).collect())
}

/// The bytes of a `.vol` file.
pub fn vol_bytes(volume: &VolumeData) -> Vec<u8> {
    let [x, y, z] = volume.resolution;
    let mut bytes = [b"VOL".as_slice(), &[VERSION]].concat();
    bytes.extend([FLOAT_32 as u32, x, y, z, volume.channels].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend([0.0, 0.0, 0.0, 1.0, 1.0, 1.0f32].into_iter().flat_map(f32::to_le_bytes));
    bytes.extend(volume.values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume() -> VolumeData {
        VolumeData::new([2, 1, 3], 1, vec![0.0, 1.0, 2.5, 3.0, -4.0, f32::INFINITY]).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let colors = VolumeData::new([1, 1, 2], 3, (0..6u8).map(f32::from).collect()).unwrap();
        for volume in [volume(), colors] {
            assert_eq!(parse_vol(&vol_bytes(&volume)).unwrap(), volume);
        }
    }

    #[test]
    fn damaged_files_are_refused() {
        let good = vol_bytes(&volume());
        for length in 0..good.len() {
            assert!(parse_vol(&good[..length]).is_err(), "{length}");
        }
        let changed = |at: usize, byte: u8, expected: &str| {
            let mut bytes = good.clone();
            bytes[at] = byte;
            let error = parse_vol(&bytes).unwrap_err();
            assert!(error.contains(expected), "{error}");
        };
        changed(0, b'W', "no .vol");
        changed(3, 2, "version 2");
        changed(4, 2, "encoding 2");
        changed(11, 0x80, "negative");
        changed(11, 0x7f, "from 1 to 16384");
        changed(8, 0, "from 1 to 16384");
        changed(9, 1, "need");
        changed(20, 4, "not 4");
    }

    #[test]
    fn sizes_must_fit() {
        assert!(floats(&[0; 8], [2, 1, 1], 1).is_ok());
        assert!(floats(&[0; 7], [2, 1, 1], 1).unwrap_err().contains("8 bytes"));
        assert!(floats(&[], [u32::MAX; 3], 3).is_err() && floats(&[], [1 << 14; 3], 3).is_err());
        assert!(VolumeData::new([2, 2, 2], 3, vec![0.0; 8]).unwrap_err().contains("24 values"));
    }
}
