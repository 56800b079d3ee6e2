//! Numbers, vectors, colours and transforms as attributes have them.

use crate::math::{DAffine3, DMat3, DVec3, dvec3};

/// What is wrong with a value; the caller adds its place.
pub type Fault = String;

/// A finite number.
pub fn number(text: &str) -> Result<f64, Fault> {
    let value: f64 = text.trim().parse().map_err(|_| format!("\"{}\" is not a number", shortened(text)))?;
    if value.is_finite() { Ok(value) } else { Err(format!("{value} is not finite")) }
}

/// A whole number.
pub fn integer(text: &str) -> Result<i64, Fault> {
    text.trim().parse().map_err(|_| format!("\"{}\" is not a whole number", shortened(text)))
}

/// `true` or `false`.
pub fn boolean(text: &str) -> Result<bool, Fault> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err(format!("\"{}\" is neither true nor false", shortened(text))),
    }
}

/// Numbers between commas and spaces.
pub fn numbers(text: &str) -> Result<Vec<f64>, Fault> {
    text.split([',', ' ', '\t', '\n', '\r']).filter(|part| !part.is_empty()).map(number).collect()
}

/// Three numbers, or one for all three.
pub fn vector(text: &str) -> Result<[f64; 3], Fault> {
    match numbers(text)?[..] {
        [x] => Ok([x; 3]),
        [x, y, z] => Ok([x, y, z]),
        ref other => Err(format!("expected one number or three, found {}", other.len())),
    }
}

/// A colour: three numbers, or one for all.
pub fn rgb(text: &str) -> Result<[f32; 3], Fault> {
    vector(text).map(|v| v.map(|x| x as f32))
}

/// Samples of a spectrum as `wavelength:value, ...`.
pub fn samples(text: &str) -> Result<Vec<[f64; 2]>, Fault> {
    let mut samples = Vec::new();
    for part in text.split([',', ' ', '\t', '\n', '\r']).filter(|part| !part.is_empty()) {
        let (wavelength, value) =
            part.split_once(':').ok_or_else(|| format!("\"{}\" is not wavelength:value", shortened(part)))?;
        samples.push([number(wavelength)?, number(value)?]);
    }
    if !samples.windows(2).all(|pair| pair[0][0] < pair[1][0]) {
        return Err("the wavelengths must grow".into());
    }
    Ok(samples)
}

/// A matrix by rows: 16 numbers, or 9 for its upper left part.
pub fn matrix(text: &str) -> Result<DAffine3, Fault> {
    let m = numbers(text)?;
    let (n, rows) = match m.len() {
        16 => (4, 3),
        9 => (3, 3),
        other => return Err(format!("a matrix has 16 numbers (or 9), not {other}")),
    };
    if n == 4 && (m[12] != 0.0 || m[13] != 0.0 || m[14] != 0.0 || (m[15] - 1.0).abs() > 1e-6) {
        return Err("the last row of the matrix must be 0 0 0 1".into());
    }
    let column = |c: usize| if c < n { [0, 1, 2].map(|r| if r < rows { m[r * n + c] } else { 0.0 }) } else { [0.0; 3] };
    let [x, y, z, t] = [0, 1, 2, 3].map(|c| DVec3::from(column(c)));
    Ok(DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: t })
}

/// A rotation about an axis through the origin.
pub fn rotation(axis: DVec3, degrees: f64) -> Result<DAffine3, Fault> {
    let axis = axis.try_normalize().ok_or("the axis of the rotation is zero")?;
    Ok(DAffine3::from_axis_angle(axis, degrees.to_radians()))
}

/// What maps the origin to `origin` and +Z towards `target`, with +Y towards `up`: +X is to the left.
pub fn look_at(origin: DVec3, target: DVec3, up: Option<DVec3>) -> Result<DAffine3, Fault> {
    let z = (target - origin).try_normalize().ok_or("lookat: origin and target are the same")?;
    let given = up.and_then(|up| up.cross(z).try_normalize());
    // Without a usable up, any one will do.
    let x = given.unwrap_or_else(|| z.any_orthonormal_vector());
    Ok(DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: origin })
}

/// The rows of a map as the scene description has them.
pub fn rows(map: &DAffine3) -> [[f64; 4]; 4] {
    let (m, t) = (&map.matrix3, &map.translation);
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// A frame about a unit normal: Mitsuba's choice of two tangents (Duff et al., "Building an Orthonormal Basis,
/// Revisited").
pub fn tangents(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1.0f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (dvec3(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), dvec3(b, sign + n.y * n.y * a, -n.y))
}

/// The beginning of a text, for messages.
fn shortened(text: &str) -> String {
    let text = text.trim();
    if text.chars().count() <= 40 { text.into() } else { text.chars().take(40).chain("...".chars()).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_between_commas_and_spaces() {
        assert_eq!(numbers(" 1, 2,3 \n 4e-1 ").unwrap(), [1.0, 2.0, 3.0, 0.4]);
        assert!(numbers("1, x").unwrap_err().contains("\"x\""));
        assert!(number("nan").is_err() && number("1e999").is_err() && number("").is_err());
        assert_eq!(vector("2").unwrap(), [2.0; 3]);
        assert!(vector("1 2").is_err());
        assert_eq!(rgb("1, 0.5 0").unwrap(), [1.0, 0.5, 0.0]);
        assert_eq!(samples("400:1, 500:2").unwrap(), [[400.0, 1.0], [500.0, 2.0]]);
        assert!(samples("500:1 400:2").is_err() && samples("400").is_err());
    }

    #[test]
    fn a_matrix_is_by_rows() {
        let map = matrix("1 2 3 4  5 6 7 8  9 10 11 12  0 0 0 1").unwrap();
        assert_eq!(map.transform_point3(dvec3(1.0, 0.0, 0.0)), dvec3(5.0, 13.0, 21.0));
        assert_eq!(rows(&map)[1], [5.0, 6.0, 7.0, 8.0]);
        assert!(matrix("1 2 3").is_err());
        assert!(matrix("1 0 0 0  0 1 0 0  0 0 1 0  0 0 1 1").unwrap_err().contains("last row"));
    }

    #[test]
    fn lookat_has_x_to_the_left() {
        let map = look_at(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, Some(DVec3::Y)).unwrap();
        assert!((map.transform_vector3(DVec3::Z) + DVec3::Z).length() < 1e-12);
        assert!((map.transform_vector3(DVec3::X) + DVec3::X).length() < 1e-12);
        assert!(look_at(DVec3::ZERO, DVec3::ZERO, None).is_err());
    }

    #[test]
    fn tangents_are_orthonormal() {
        for n in [DVec3::Z, -DVec3::Z, dvec3(0.6, 0.0, -0.8), dvec3(0.48, 0.6, 0.64)] {
            let (s, t) = tangents(n);
            assert!((s.cross(t) - n).length() < 1e-12, "{n}");
        }
    }
}
