//! Files of strands of hair: text as Mitsuba 3 reads it, and a binary form.

use std::path::Path;

use super::AssetError;

/// What a binary file begins with.
const MAGIC: &[u8; 8] = b"STRANDS1";

/// Control points of strands, which nobody has checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrandData {
    /// x, y, z and the radius of each point.
    pub points: Vec<[f32; 4]>,
    /// How many points each strand has.
    pub counts: Vec<u32>,
}

/// Reads a file of strands: as text, a line `x y z radius` for each control point with empty lines between strands; in
/// binary form `STRANDS1`, the numbers of strands and of points, the number of points of each strand as `u32`, and four
/// `f32` for each point, little-endian.
///
/// # Errors
/// If the file is missing or malformed, with the line.
pub fn read_strands(path: &Path) -> Result<StrandData, AssetError> {
    let bytes = crate::file::without_mark(crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?);
    parse_strands(&bytes).map_err(AssetError::Malformed)
}

pub(super) fn parse_strands(bytes: &[u8]) -> Result<StrandData, String> {
    match bytes.strip_prefix(MAGIC) {
        Some(rest) => binary(rest),
        None => text(std::str::from_utf8(bytes).map_err(|_| "neither text nor a file that begins with STRANDS1")?),
    }
}

fn text(text: &str) -> Result<StrandData, String> {
    let mut strands = StrandData::default();
    let mut count = 0;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            strands.counts.extend((count > 0).then_some(count));
            count = 0;
            continue;
        }
        let mut point = [0f32; 4];
        let mut words = line.split_ascii_whitespace();
        for value in &mut point {
            let word = words.next().ok_or_else(|| format!("line {number}: expected four numbers: x y z radius"))?;
            *value = word.parse().map_err(|_| format!("line {number}: \"{word}\" is no number"))?;
        }
        if words.next().is_some() {
            return Err(format!("line {number}: more than four numbers: x y z radius"));
        }
        strands.points.push(point);
        count += 1;
    }
    strands.counts.extend((count > 0).then_some(count));
    Ok(strands)
}

fn binary(bytes: &[u8]) -> Result<StrandData, String> {
    let (words, rest) = bytes.as_chunks::<4>();
    let word = |i: usize| words.get(i).map(|word| u32::from_le_bytes(*word));
    let (Some(strands), Some(points)) = (word(0), word(1)) else { return Err("the file ends in its header".into()) };
    let expected = 2 + u64::from(strands) + 4 * u64::from(points);
    if !rest.is_empty() || words.len() as u64 != expected {
        let bytes = bytes.len() + MAGIC.len();
        let expected = 4 * expected + MAGIC.len() as u64;
        return Err(format!("{strands} strands of {points} points take {expected} bytes, but the file has {bytes}"));
    }
    let (counts, points) = words[2..].split_at(strands as usize);
    let point = |words: &[[u8; 4]; 4]| words.map(f32::from_le_bytes);
    Ok(StrandData {
        points: points.as_chunks::<4>().0.iter().map(point).collect(),
        counts: counts.iter().map(|word| u32::from_le_bytes(*word)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_binary_files_are_read() {
        let text = b"# roots\n0 0 0 0.1\n1 0 0 5e-2 # tip\n\n\n0 1 0 .1\n0 2 0 .1\n0 3 0 0\n";
        let expected = StrandData {
            points: vec![[0., 0., 0., 0.1], [1., 0., 0., 0.05], [0., 1., 0., 0.1], [0., 2., 0., 0.1], [0., 3., 0., 0.]],
            counts: vec![2, 3],
        };
        assert_eq!(parse_strands(text), Ok(expected.clone()));
        let mut bytes = MAGIC.to_vec();
        [2u32, 5, 2, 3].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        expected.points.as_flattened().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        assert_eq!(parse_strands(&bytes), Ok(expected));
        for end in [8, 12, 16, 20, bytes.len() - 1] {
            assert!(parse_strands(&bytes[..end]).is_err(), "{end}");
        }
        bytes[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse_strands(&bytes).is_err());
    }

    #[test]
    fn malformed_text_is_refused_with_its_line() {
        for (text, line) in [("0 0 0", 1), ("0 0 0 1\n0 0 x 1", 2), ("0 0 0 1 2", 1), ("\n\n1,2,3,4", 3)] {
            let error = parse_strands(text.as_bytes()).unwrap_err();
            assert!(error.contains(&format!("line {line}")), "{error}");
        }
        assert!(parse_strands(b"\xff\xfe").is_err());
        assert_eq!(parse_strands(b""), Ok(StrandData::default()));
    }
}
