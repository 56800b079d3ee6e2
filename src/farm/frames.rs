//! Sequences of frames: their numbers, and the names of their files.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::error::{Error, Result};

/// The most frames of a sequence.
const MOST_FRAMES: u64 = 1_000_000;

/// Digits of a frame's number in names that do not give them.
const DEFAULT_DIGITS: usize = 4;

/// Frames in the order in which they are rendered, each once, and at least one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameList(Vec<i64>);

impl FrameList {
    /// These frames; `None` without any.
    pub fn new(numbers: Vec<i64>) -> Option<Self> {
        (!numbers.is_empty()).then_some(Self(numbers))
    }

    /// The frames' numbers.
    pub fn numbers(&self) -> &[i64] {
        &self.0
    }

    /// The shortest text that means the same numbers in ascending order, with `separator` between a range and its step:
    /// `1-10:2,20`.
    pub fn ranges(&self, separator: char) -> String {
        let mut sorted = self.0.clone();
        sorted.sort_unstable();
        let mut parts = Vec::new();
        let mut rest = sorted.as_slice();
        while let [first, tail @ ..] = rest {
            let step = tail.first().map_or(1, |second| second - first);
            let mut count = 1;
            while count < rest.len() && rest[count] - rest[count - 1] == step {
                count += 1;
            }
            // Two numbers are shorter by themselves, unless they are neighbours.
            if count == 2 && step > 1 {
                count = 1;
            }
            parts.push(match (count, step) {
                (1, _) => first.to_string(),
                (_, 1) => format!("{first}-{}", rest[count - 1]),
                _ => format!("{first}-{}{separator}{step}", rest[count - 1]),
            });
            rest = &rest[count..];
        }
        parts.join(",")
    }
}

impl FromStr for FrameList {
    type Err = String;

    /// Reads `7`, `1-100`, `1-100x5` (every fifth), `10-1` (backwards) or several of these with commas between them.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut numbers = Vec::new();
        let mut seen = std::collections::HashSet::new();
        for part in text.split(',') {
            let [from, to, step] = range(part.trim()).ok_or("expected frames such as 7, 1-100, 1-100x5 or 3,7,9-12")?;
            let count = from.abs_diff(to) / step.unsigned_abs() + 1;
            if count > MOST_FRAMES || count + numbers.len() as u64 > MOST_FRAMES {
                return Err(format!("more than {MOST_FRAMES} frames"));
            }
            let step = if to < from { -step } else { step };
            numbers.extend((0..count as i64).map(|i| from + i * step).filter(|number| seen.insert(*number)));
        }
        Ok(Self(numbers))
    }
}

/// First, last and step of `7`, `1-100` or `1-100x5`; numbers may be negative.
fn range(text: &str) -> Option<[i64; 3]> {
    let number = |text: &str| text.parse::<i32>().ok().map(i64::from);
    let (range, step) = match text.split_once('x') {
        Some((range, step)) => (range, number(step).filter(|step| *step > 0)?),
        None => (text, 1),
    };
    if let Some(single) = number(range) {
        return (!text.contains('x')).then_some([single, single, 1]);
    }
    // The dash of a range is not the first character, which may be a sign.
    let dash = range.char_indices().skip(1).find(|(_, c)| *c == '-')?.0;
    Some([number(&range[..dash])?, number(&range[dash + 1..])?, step])
}

/// Where a name holds a frame's number, and its digits.
struct Pattern {
    start: usize,
    end: usize,
    digits: usize,
}

/// The first of `####` (a digit for each), `%d` and `%04d` in `text`. In names of folders, a single `#` is a character
/// like any other.
fn find_pattern(text: &str) -> Option<Pattern> {
    let bytes = text.as_bytes();
    for start in 0..bytes.len() {
        let run = |from: usize, accepted: fn(&u8) -> bool| bytes[from..].iter().take_while(|b| accepted(b)).count();
        if bytes[start] == b'#' {
            let digits = run(start, |b| *b == b'#');
            if digits == 1 && bytes[start..].contains(&b'/') {
                continue;
            }
            return Some(Pattern { start, end: start + digits, digits });
        }
        if bytes[start] == b'%' {
            let width = run(start + 1, u8::is_ascii_digit);
            let end = start + 1 + width;
            let digits = &text[start + 1..end];
            let zeros = digits.is_empty() || digits.starts_with('0');
            if let (Some(b'd'), true, true) = (bytes.get(end), zeros, width <= 3) {
                return Some(Pattern { start, end: end + 1, digits: digits.parse().unwrap_or(1) });
            }
        }
    }
    None
}

/// Whether a name has a place for a frame's number: `####`, with one digit for each `#`, or `%04d`.
pub fn has_frame_pattern(name: &str) -> bool {
    find_pattern(name).is_some()
}

/// Checks the name of a file that is written without frames: one with a place for a frame's number is most likely a
/// slip.
///
/// # Errors
/// [`Error::Usage`] if it has one. A single `#` is a character like any other.
pub fn check_single_name(name: &str) -> Result<()> {
    match find_pattern(name).filter(|pattern| !(pattern.digits == 1 && name[pattern.start..].starts_with('#'))) {
        Some(pattern) => {
            let place = &name[pattern.start..pattern.end];
            Err(Error::Usage(format!(
                "{name}: {place} is the place of a frame's number, but there is no --frames; give that, or another name"
            )))
        }
        None => Ok(()),
    }
}

/// The name with a place for the frame's number: its own, or `.####` before the extension.
pub fn with_frame_pattern(name: &str) -> String {
    if has_frame_pattern(name) {
        return name.to_owned();
    }
    let place = format!(".{}", "#".repeat(DEFAULT_DIGITS));
    let path = Path::new(name);
    match (path.extension().and_then(|e| e.to_str()), path.file_stem()) {
        (Some(extension), Some(_)) => format!("{}{place}.{extension}", &name[..name.len() - extension.len() - 1]),
        _ => format!("{name}{place}"),
    }
}

/// The name of a frame's file: every pattern replaced by the number, with zeros before it to the pattern's width.
pub fn file_of_frame(name: &str, frame: i64) -> String {
    let mut rest = name;
    let mut out = String::new();
    while let Some(pattern) = find_pattern(rest) {
        out.push_str(&rest[..pattern.start]);
        // The sign comes before the zeros and beside the width, so that -7 and 7 are as long but for it.
        let sign = if frame < 0 { "-" } else { "" };
        out.push_str(&format!("{sign}{:0width$}", frame.unsigned_abs(), width = pattern.digits));
        rest = &rest[pattern.end..];
    }
    out + rest
}

/// Whether a scene's path is a pattern for a file of each frame: it has a pattern, and no file of that very name
/// exists.
pub fn is_scene_per_frame(scene: &Path) -> bool {
    scene.to_str().is_some_and(has_frame_pattern) && !scene.exists()
}

/// The scene's file of a frame.
pub fn scene_of_frame(scene: &Path, frame: i64) -> PathBuf {
    if is_scene_per_frame(scene) { file_of_frame(&scene.to_string_lossy(), frame).into() } else { scene.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Vec<i64> {
        text.parse::<FrameList>().unwrap().0
    }

    #[test]
    fn lists_and_ranges_are_read_in_their_order() {
        assert_eq!(frames("7"), [7]);
        assert_eq!(frames("1-4"), [1, 2, 3, 4]);
        assert_eq!(frames("1-12x5"), [1, 6, 11]);
        assert_eq!(frames("3,7,9-12"), [3, 7, 9, 10, 11, 12]);
        assert_eq!(frames("3-1"), [3, 2, 1]);
        assert_eq!(frames("-2-1"), [-2, -1, 0, 1]);
        assert_eq!(frames("-3--2, 5"), [-3, -2, 5]);
        assert_eq!(frames("1-3,2-5"), [1, 2, 3, 4, 5]);
        for wrong in ["", "a", "1-", "1-3x0", "1-3x-1", "1x2", "1,,2", "1-2-3", "0-1000000", "1.5", "1-3x"] {
            assert!(wrong.parse::<FrameList>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn ranges_are_short_and_mean_the_same() {
        for (text, short) in [
            ("1-10", "1-10"),
            ("1-9x2", "1-9:2"),
            ("3,1,2,7,20", "1-3,7,20"),
            ("5,6", "5-6"),
            ("4", "4"),
            ("-3-0", "-3-0"),
        ] {
            assert_eq!(text.parse::<FrameList>().unwrap().ranges(':'), short);
            let mut sorted = frames(text);
            sorted.sort_unstable();
            assert_eq!(frames(&short.replace(':', "x")), sorted);
        }
    }

    #[test]
    fn patterns_become_numbers() {
        for (name, file) in [
            ("a.####.exr", "a.0007.exr"),
            ("a#.exr", "a7.exr"),
            ("a.%04d.exr", "a.0007.exr"),
            ("a_%d.exr", "a_7.exr"),
            ("####/a.##.exr", "0007/a.07.exr"),
            ("100%.exr", "100%.exr"),
            ("shot#3/a.####.exr", "shot#3/a.0007.exr"),
            ("shot#3/a.exr", "shot#3/a.exr"),
            ("%4d", "%4d"),
            ("a.exr", "a.exr"),
        ] {
            assert_eq!(file_of_frame(name, 7), file);
            assert_eq!(has_frame_pattern(name), name != file, "{name}");
        }
        assert_eq!(file_of_frame("a.##.exr", 12345), "a.12345.exr");
        assert_eq!(file_of_frame("a.####.exr", -7), "a.-0007.exr");
    }

    #[test]
    fn places_for_numbers_need_frames() {
        for name in ["a.####.exr", "a##.exr", "a.%04d.exr", "####/a.exr"] {
            assert!(
                matches!(check_single_name(name), Err(Error::Usage(message)) if message.contains("--frames")),
                "{name}"
            );
        }
        for name in ["a.exr", "a#1.exr", "shot#3/a.exr", "100%.exr"] {
            check_single_name(name).unwrap();
        }
    }

    #[test]
    fn names_without_a_pattern_get_one() {
        for (name, with) in [
            ("a.exr", "a.####.exr"),
            ("b.c/a", "b.c/a.####"),
            ("b#2/a.exr", "b#2/a.####.exr"),
            ("b.c/a.b.png", "b.c/a.b.####.png"),
            ("a.%03d.exr", "a.%03d.exr"),
            (".exr", ".exr.####"),
        ] {
            assert_eq!(with_frame_pattern(name), with);
        }
    }
}
