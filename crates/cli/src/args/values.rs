//! Values of options that several commands have.

use steradian::internal::accel::AccelKind;

/// Width and height.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parse = || {
        let (width, height) = text.split_once(['x', 'X'])?;
        Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
    };
    parse().ok_or_else(|| "expected WIDTHxHEIGHT, such as 1920x1080".to_owned())
}

/// Whole numbers with commas between them.
pub fn parse_list<T: std::str::FromStr, const N: usize>(text: &str) -> Result<[T; N], String> {
    let numbers: Option<Vec<T>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("expected {N} whole numbers, separated by commas"))
}

/// The help of `--accel`: every accelerator.
pub fn accel_help() -> String {
    let line = |(name, what): &(&str, &str)| format!("  {name:<16}{what}");
    let lines: Vec<_> = AccelKind::CHOICES.iter().map(line).collect();
    format!(
        "Ray accelerator; all give the same picture within rounding. Options combine, as in embree:low+compact\n\n{}",
        lines.join("\n")
    )
}
