//! Checks of OBJ and MTL text before it is parsed: the parser does not check indices and counts of numbers.

use std::str::SplitWhitespace;

use super::AssetError;
use crate::math::{Bounds, DVec3};

/// What an OBJ file uses.
#[derive(Debug)]
pub struct ObjUse {
    /// Lines (from 1) and names of `usemtl`.
    pub materials: Vec<(usize, String)>,
    /// Vertices, and those of them with colours.
    pub vertices: usize,
    pub colors: usize,
    /// Whether there is a `mtllib`.
    pub names_a_library: bool,
    /// Whether there are line elements.
    pub has_lines: bool,
    /// Bounds of the vertices, and the first of them.
    pub bounds: Bounds,
    pub first: Option<[f64; 3]>,
}

/// What the three numbers of a face's corner count.
const ATTRIBUTES: [&str; 3] = ["vertex", "uv", "normal"];

/// Checks every line's numbers and every index.
pub fn check_obj(text: &str) -> Result<ObjUse, AssetError> {
    let mut used = ObjUse {
        materials: Vec::new(),
        vertices: 0,
        colors: 0,
        names_a_library: false,
        has_lines: false,
        bounds: Bounds::EMPTY,
        first: None,
    };
    let mut counts = [0i64; 3];
    // The largest index of each kind and its line: a face may come before what it refers to.
    let mut largest = [(0i64, 0usize); 3];
    for (i, line) in text.lines().enumerate() {
        let at = |message: &str| AssetError::Malformed(format!("line {}: {message}", i + 1));
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                used.vertices += 1;
                used.colors += usize::from(words.clone().count() > 5);
                let position = numbers::<3>(words).ok_or_else(|| at("a vertex needs three numbers"))?;
                used.bounds = used.bounds.extended(DVec3::from(position));
                used.first = used.first.or(Some(position));
                counts[0] += 1;
            }
            Some("vt") => {
                numbers::<2>(words).ok_or_else(|| at("a uv needs two numbers"))?;
                counts[1] += 1;
            }
            Some("vn") => {
                numbers::<3>(words).ok_or_else(|| at("a normal needs three numbers"))?;
                counts[2] += 1;
            }
            Some("f") => {
                words.try_for_each(|corner| check_corner(corner, &counts, &mut largest, i + 1)).map_err(|e| at(&e))?;
            }
            Some("l") => used.has_lines = true,
            Some("mtllib") => used.names_a_library = true,
            Some("usemtl") => {
                used.materials.push((i + 1, line.trim().split_once(' ').unwrap_or_default().1.trim().to_owned()));
            }
            _ => {}
        }
    }
    for ((what, (index, line)), count) in ATTRIBUTES.iter().zip(largest).zip(counts) {
        if index > count {
            return Err(AssetError::Malformed(format!(
                "line {line}: a face refers to {what} {index}, but there are only {count}"
            )));
        }
    }
    Ok(used)
}

fn numbers<const N: usize>(mut words: SplitWhitespace) -> Option<[f64; N]> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = words.next()?.parse().ok()?;
    }
    Some(numbers)
}

/// One corner of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
fn check_corner(corner: &str, counts: &[i64; 3], largest: &mut [(i64, usize); 3], line: usize) -> Result<(), String> {
    for (k, text) in corner.split('/').enumerate() {
        if k > 2 || (text.is_empty() && k == 0) {
            return Err(format!("\"{corner}\" is no corner of a face"));
        }
        if text.is_empty() {
            continue;
        }
        let index: i64 = text.parse().map_err(|_| format!("\"{corner}\" is no corner of a face"))?;
        if index == 0 || index < -counts[k] {
            return Err(format!("a face refers to {} {index}, but they count from 1 (or back from -1)", ATTRIBUTES[k]));
        }
        if index > largest[k].0 {
            largest[k] = (index, line);
        }
    }
    Ok(())
}

/// An MTL with every colour written as three numbers: one number means grey.
pub fn expand_colors(text: &str) -> Result<String, String> {
    let mut out = String::with_capacity(text.len() + 64);
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some(key @ ("Ka" | "Kd" | "Ks" | "Ke")) => {
                let values: Option<Vec<f32>> = words.take(3).map(|word| word.parse().ok()).collect();
                let rgb = match values.as_deref() {
                    Some(&[grey]) => [grey; 3],
                    Some(&[r, g, b]) => [r, g, b],
                    _ => return Err(format!("line {}: {key} needs three numbers (or one for grey)", i + 1)),
                };
                out.push_str(&format!("{key} {} {} {}\n", rgb[0], rgb[1], rgb[2]));
            }
            _ => out.extend([line, "\n"]),
        }
    }
    Ok(out)
}
