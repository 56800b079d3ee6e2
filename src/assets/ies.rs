//! Photometric files of luminaires: ANSI/IES LM-63 in its versions from 1986 to 2019, type C.

use std::path::Path;

use super::AssetError;

/// Luminous intensity by direction, as measured.
#[derive(Clone, Debug, PartialEq)]
pub struct IesData {
    /// Angles from the nadir in degrees, at least two, strictly increasing within `[0, 180]`.
    pub vertical: Vec<f32>,
    /// Angles of planes about the nadir in degrees, strictly increasing: a single 0, from 0 to 90, 180 or 360, or from
    /// 90 to 270.
    pub horizontal: Vec<f32>,
    /// Candela, all multipliers applied, finite and not negative: for each horizontal angle, one for each vertical
    /// angle.
    pub candela: Vec<f32>,
}

/// No luminaire is measured in more directions.
const MAX_VALUES: usize = 1 << 22;

/// Reads an `.ies` file.
///
/// # Errors
/// If the file is missing or malformed, with the line; or not of type C.
pub fn read_ies(path: &Path) -> Result<IesData, AssetError> {
    let bytes = crate::file::without_mark(crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?);
    // Old files name their makers in whatever encoding.
    parse(&String::from_utf8_lossy(&bytes)).map_err(AssetError::Malformed)
}

/// The `.ies` file of a table.
pub fn ies_bytes(data: &IesData) -> Vec<u8> {
    let IesData { vertical, horizontal, candela } = data;
    let counts = format!("{} {}", vertical.len(), horizontal.len());
    let mut text = format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {counts} 1 2 0 0 0\n1 1 0\n");
    for row in [vertical, horizontal].into_iter().map(Vec::as_slice).chain(candela.chunks(vertical.len().max(1))) {
        // Lines of at most 256 letters, as the standard requires.
        for line in row.chunks(16) {
            let numbers: Vec<String> = line.iter().map(|number| format!("{number:e}")).collect();
            text.push_str(&numbers.join(" "));
            text.push('\n');
        }
    }
    text.into_bytes()
}

/// The numbers behind the TILT line, with their lines.
struct Numbers<'a> {
    words: std::vec::IntoIter<(usize, &'a str)>,
}

impl Numbers<'_> {
    fn next(&mut self, what: &str) -> Result<(usize, f64), String> {
        let (line, word) = self.words.next().ok_or_else(|| format!("the file ends where {what} should be"))?;
        let number = word.parse::<f64>().ok().filter(|n| n.is_finite());
        number
            .map(|number| (line, number))
            .ok_or_else(|| format!("line {line}: {what} should be a number, not \"{word}\""))
    }

    /// Passes over how the lamp's output depends on the luminaire's tilt; at rest the factor is 1.
    fn skip_tilt(&mut self, tilt: &str) -> Result<(), String> {
        if tilt != "INCLUDE" && tilt != "NONE" {
            return Err(format!(
                "TILT={tilt}: data of the tilt cannot be read from a file of its own; give TILT=NONE, or TILT=INCLUDE \
                 and the data"
            ));
        }
        if tilt == "INCLUDE" {
            self.next("the lamp's position (TILT)")?;
            let count = self.count("the number of tilt angles", 0)?;
            for _ in 0..2 * count {
                self.next("a tilt angle or multiplier")?;
            }
        }
        Ok(())
    }

    fn positive(&mut self, what: &str) -> Result<f64, String> {
        let (line, number) = self.next(what)?;
        if number > 0.0 { Ok(number) } else { Err(format!("line {line}: {what} must be above 0, not {number}")) }
    }

    fn count(&mut self, what: &str, least: usize) -> Result<usize, String> {
        let (line, number) = self.next(what)?;
        if number.fract() == 0.0 && number >= least as f64 && number <= MAX_VALUES as f64 {
            Ok(number as usize)
        } else {
            Err(format!("line {line}: {what} must be a whole number from {least} to {MAX_VALUES}, not {number}"))
        }
    }

    /// Strictly increasing angles.
    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f32>, String> {
        let mut angles: Vec<f32> = Vec::new();
        for _ in 0..count {
            let (line, angle) = self.next(what)?;
            let angle = angle as f32;
            if angles.last().is_some_and(|last| *last >= angle) {
                return Err(format!(
                    "line {line}: {what}s must increase; {angle} follows {}",
                    angles[angles.len() - 1]
                ));
            }
            angles.push(angle);
        }
        Ok(angles)
    }

    fn vertical_angles(&mut self, count: usize) -> Result<Vec<f32>, String> {
        let vertical = self.angles(count, "vertical angle")?;
        if vertical[0] < 0.0 || vertical[vertical.len() - 1] > 180.0 {
            return Err("vertical angles of type C must lie within 0 and 180".into());
        }
        Ok(vertical)
    }

    fn horizontal_angles(&mut self, count: usize) -> Result<Vec<f32>, String> {
        let horizontal = self.angles(count, "horizontal angle")?;
        let range = (horizontal[0], horizontal[horizontal.len() - 1]);
        if ![(0.0, 0.0), (0.0, 90.0), (0.0, 180.0), (0.0, 360.0), (90.0, 270.0)].contains(&range) {
            let message = "horizontal angles must be 0 alone, or run from 0 to 90, 180 or 360, or from 90 to 270";
            return Err(format!("{message}, not from {} to {}", range.0, range.1));
        }
        Ok(horizontal)
    }
}

fn parse(text: &str) -> Result<IesData, String> {
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line));
    let tilt = lines.find_map(|(_, line)| {
        line.trim().to_ascii_uppercase().strip_prefix("TILT=").map(|tilt| tilt.trim().to_owned())
    });
    let tilt = tilt.ok_or("no line with TILT=: not an LM-63 file")?;
    let words = lines
        .flat_map(|(i, line)| line.split([' ', '\t', ',']).filter(|word| !word.is_empty()).map(move |word| (i, word)));
    let mut numbers = Numbers { words: words.collect::<Vec<_>>().into_iter() };

    numbers.skip_tilt(&tilt)?;
    let _lamps = numbers.next("the number of lamps")?;
    let _lumens = numbers.next("the lumens of a lamp")?;
    let multiplier = numbers.positive("the candela multiplier")?;
    let vertical_count = numbers.count("the number of vertical angles", 2)?;
    let horizontal_count = numbers.count("the number of horizontal angles", 1)?;
    let (line, kind) = numbers.next("the photometric type")?;
    if kind != 1.0 {
        return Err(format!("line {line}: the photometric type is {kind}: only type C (1) can be read"));
    }
    for what in ["the unit of length", "the width", "the length", "the height"] {
        numbers.next(what)?;
    }
    let ballast = numbers.positive("the ballast factor")?;
    let photometric = numbers.positive("the ballast-lamp photometric factor")?;
    let _watts = numbers.next("the input watts")?;

    if vertical_count.saturating_mul(horizontal_count) > MAX_VALUES {
        return Err(format!("{vertical_count} x {horizontal_count} directions are too many"));
    }
    let (vertical, horizontal) =
        (numbers.vertical_angles(vertical_count)?, numbers.horizontal_angles(horizontal_count)?);
    let scale = multiplier * ballast * photometric;
    let mut candela = Vec::new();
    for _ in 0..vertical_count * horizontal_count {
        let (line, value) = numbers.next("a candela value")?;
        let value = (value * scale) as f32;
        if !(value >= 0.0 && value.is_finite()) {
            return Err(format!("line {line}: the candela value {value} must be finite and not negative"));
        }
        candela.push(value);
    }
    if let Some((line, word)) = numbers.words.next() {
        return Err(format!("line {line}: \"{word}\" is beyond the number of values that the angles require"));
    }
    Ok(IesData { vertical, horizontal, candela })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "IESNA:LM-63-2002\n[TEST] none\n[MANUFAC] Steradian\nTILT=NONE\n\
                         1 1000 2.0 3 2 1 2 0.1 0.1 0.0\n\
                         0.5 1.0 10\n0 45 90\n0 90\n10 8 0\n10, 6, 0\n";

    #[test]
    fn a_file_is_read_with_its_multipliers() {
        let data = parse(SMALL).unwrap();
        assert_eq!((data.vertical, data.horizontal), (vec![0.0, 45.0, 90.0], vec![0.0, 90.0]));
        assert_eq!(data.candela, [10.0, 8.0, 0.0, 10.0, 6.0, 0.0]);
    }

    #[test]
    fn what_is_written_is_read() {
        let candela: Vec<f32> = (0..60).map(|i| (i as f32).powi(7) * 1.234_567_9e-9).collect();
        let vertical = (0..20).map(|i| i as f32 * 90.0 / 19.0).collect();
        let data = IesData { vertical, horizontal: vec![0.0, 33.3, 90.0], candela };
        let text = String::from_utf8(ies_bytes(&data)).unwrap();
        assert_eq!(parse(&text), Ok(data));
        assert!(text.lines().all(|line| line.len() <= 256));
    }

    #[test]
    fn tilt_tables_and_old_headers_are_passed_over() {
        let included = SMALL.replace("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 45 90\n1.0 0.95 0.9");
        assert_eq!(parse(&included), parse(SMALL));
        let old = SMALL.replace("IESNA:LM-63-2002\n", "").replace("TILT=NONE", "tilt=none");
        assert_eq!(parse(&old), parse(SMALL));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (from, to, words) in [
            ("TILT=NONE\n", "", "no line with TILT="),
            ("TILT=NONE\n", "TILT=lamp.tlt\n", "TILT=LAMP.TLT: data of the tilt cannot be read from a file of its own"),
            ("1 1000 2.0", "1 1000 two", "line 5: the candela multiplier should be a number, not \"two\""),
            ("1 1000 2.0", "1 1000 0", "line 5: the candela multiplier must be above 0"),
            ("2.0 3 2 1", "2.0 1 2 1", "line 5: the number of vertical angles"),
            ("2.0 3 2 1", "2.0 2.5 2 1", "line 5: the number of vertical angles"),
            ("2.0 3 2 1", "2.0 3 0 1", "line 5: the number of horizontal angles"),
            ("2.0 3 2 1", "2.0 3 2 2", "only type C"),
            ("2.0 3 2 1", "2.0 4000000 4000000 1", "too many"),
            ("0 45 90\n", "0 90 45\n", "line 7: vertical angles must increase; 45 follows 90"),
            ("0 45 90\n", "0 45 181\n", "within 0 and 180"),
            ("0 90\n10", "0 100\n10", "not from 0 to 100"),
            ("10 8 0", "10 -8 0", "line 9"),
            ("10 8 0", "10 nan 0", "line 9: a candela value should be a number, not \"nan\""),
            ("10, 6, 0\n", "10, 6\n", "the file ends where a candela value should be"),
            ("10, 6, 0\n", "10, 6, 0, 1\n", "line 10: \"1\" is beyond the number of values"),
        ] {
            let message = parse(&SMALL.replacen(from, to, 1)).unwrap_err();
            assert!(message.contains(words), "{to:?}: {message}");
        }
        // Every prefix is an error, none a panic.
        for end in (0..SMALL.len() - 3).step_by(3) {
            assert!(parse(&SMALL[..end]).is_err(), "{end}");
        }
    }
}
