//! `steradian compare`.

use std::path::Path;

use serde_json::{Value, json};
use steradian::internal::film::Image;
use steradian::internal::output::{self, Format};
use steradian::{Error, Result};

use crate::args::CompareArgs;
use crate::text;

/// Compares two pictures and prints the figures.
pub fn run(arguments: &CompareArgs) -> Result<()> {
    let (reference, test) = (read(&arguments.reference)?, read(&arguments.test)?);
    let comparison = output::compare(&reference, &test)?;
    let value = serde_json::to_value(&comparison).map_err(|e| Error::Internal(e.to_string()))?;
    if arguments.json {
        return text::print_json(&value);
    }
    let psnr =
        comparison.psnr.map_or("infinite".to_owned(), |psnr| format!("{psnr:.2} dB (peak {})", round(comparison.peak)));
    let mut lines = json!({ "size": format!("{}x{}", comparison.width, comparison.height), "psnr": psnr });
    for key in ["mse", "relmse", "relmse_trimmed", "mean_ratio", "nan", "inf"] {
        lines[key] = rounded(&value[key]);
    }
    text::print(&text::outline(&lines))
}

/// Reads a picture in linear light.
pub fn read(path: &Path) -> Result<Image> {
    if Format::from_path(path).is_ok_and(|format| format != Format::Exr) {
        return Err(Error::Usage(format!(
            "{}: only EXR files are compared, since only they hold linear light",
            path.display()
        )));
    }
    output::read_exr(path)
}

/// Five significant digits are what a comparison is read with.
fn rounded(value: &Value) -> Value {
    match value {
        Value::Array(items) => items.iter().map(rounded).collect(),
        Value::Number(number) if number.is_f64() => Value::String(number.as_f64().map_or(String::new(), round)),
        other => other.clone(),
    }
}

fn round(x: f64) -> String {
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) { format!("{x:.4e}") } else { format!("{x:.5}") }
}
