//! Measured BRDFs in Mitsuba's tensor files, as of the RGL material database.

use std::collections::BTreeMap;
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use super::AssetError;
use crate::measured::{MeasuredData, MeasuredTable};
use crate::spectrum::Spectrum;

/// What the files begin with.
pub const TENSOR_MAGIC: &[u8; 12] = b"tensor_file\0";

/// The version of the format.
const VERSION: [u8; 2] = [1, 0];

/// Types of numbers, as the format counts them.
const UINT8: u8 = 1;
const FLOAT32: u8 = 10;

/// The most outgoing directions.
const MAX_DIRECTIONS: usize = 4096;

/// The most wavelengths.
const MAX_WAVELENGTHS: usize = 4096;

/// The largest value of a distribution, and of a colour.
const MAX_DENSITY: f32 = 1e9;
const MAX_COLOR: f32 = 1e6;

/// How far from whole, half and quarter circles azimuths may be, in radians.
const ANGLE_TOLERANCE: f32 = 1e-3;

/// Reads a measured BRDF: a file of `tensor_file`, a zero byte and the version 1.0 with the fields `phi_i`, `theta_i`,
/// `ndf`, `sigma`, `vndf`, `luminance`, `jacobian`, and either `rgb` or `spectra` and `wavelengths` in nanometres,
/// which become the colours of what reflects under D65.
///
/// # Errors
/// [`AssetError`] if the file cannot be read, is no such file, or its fields do not fit each other.
pub fn read_measured(path: &Path) -> Result<MeasuredData, AssetError> {
    let bytes = crate::file::read(path).map_err(|e| AssetError::missing(path, &e))?;
    parse(&bytes).map_err(AssetError::Malformed)
}

/// A list of numbers with their shape.
struct Field<'a> {
    name: String,
    kind: u8,
    shape: Vec<usize>,
    /// From the first number to the end of the file.
    bytes: &'a [u8],
}

/// The bytes not read yet.
struct Header<'a>(&'a [u8]);

impl Header<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (bytes, rest) = self.0.split_first_chunk::<N>().ok_or("the file ends in its header")?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn size(&mut self) -> Result<usize, String> {
        usize::try_from(u64::from_le_bytes(self.take()?)).map_err(|_| "a size is too large".into())
    }

    fn name(&mut self) -> Result<String, String> {
        let length = usize::from(u16::from_le_bytes(self.take()?));
        let (name, rest) = self.0.split_at_checked(length).ok_or("the file ends in the name of a field")?;
        self.0 = rest;
        Ok(String::from_utf8_lossy(name).into_owned())
    }
}

fn fields(bytes: &[u8]) -> Result<BTreeMap<String, Field<'_>>, String> {
    let mut header = Header(bytes.strip_prefix(TENSOR_MAGIC).ok_or("this is no tensor file of a measured BRDF")?);
    let version = header.take::<2>()?;
    if version != VERSION {
        return Err(format!("version {}.{} of tensor files is not supported, only 1.0", version[0], version[1]));
    }
    let count = u32::from_le_bytes(header.take()?);
    let mut fields = BTreeMap::new();
    for _ in 0..count {
        let name = header.name()?;
        let dimensions = u16::from_le_bytes(header.take()?);
        let [kind] = header.take()?;
        let offset = header.size()?;
        let shape = (0..dimensions).map(|_| header.size()).collect::<Result<Vec<_>, _>>()?;
        let bytes = bytes.get(offset..).ok_or_else(|| format!("`{name}` begins beyond the end of the file"))?;
        fields.insert(name.clone(), Field { name, kind, shape, bytes });
    }
    Ok(fields)
}

impl<'a> Field<'a> {
    /// The bytes of all numbers, `size` each.
    fn data(&self, kind: u8, size: usize) -> Result<&'a [u8], String> {
        let Self { name, shape, .. } = self;
        if self.kind != kind {
            return Err(format!("`{name}` has numbers of type {}, not {kind}", self.kind));
        }
        let length = shape.iter().try_fold(size, |product, &edge| product.checked_mul(edge));
        length
            .and_then(|length| self.bytes.get(..length))
            .ok_or_else(|| format!("`{name}` of the shape {shape:?} reaches beyond the end of the file"))
    }

    /// Finite numbers.
    fn floats(&self) -> Result<Vec<f32>, String> {
        let (words, _) = self.data(FLOAT32, 4)?.as_chunks();
        let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
        match values.iter().find(|value| !value.is_finite()) {
            Some(bad) => Err(format!("`{}` has the value {bad}", self.name)),
            None => Ok(values),
        }
    }

    /// Increasing numbers within a range.
    fn knots(&self, [low, high]: [f32; 2], most: usize) -> Result<Vec<f32>, String> {
        let Self { name, shape, .. } = self;
        if !matches!(shape[..], [count] if (1..=most).contains(&count)) {
            return Err(format!("`{name}` must have from 1 to {most} numbers, not the shape {shape:?}"));
        }
        let values = self.floats()?;
        if !values.is_sorted_by(|a, b| a < b) {
            return Err(format!("the numbers of `{name}` must increase"));
        }
        let is_within = |value: &f32| (low - ANGLE_TOLERANCE..=high + ANGLE_TOLERANCE).contains(value);
        match values.iter().find(|value| !is_within(value)) {
            Some(bad) => Err(format!("`{name}` must be from {low} to {high}, not {bad}")),
            None => Ok(values),
        }
    }

    /// Numbers from 0 to `limit` whose shape ends with rows and columns and begins with `slices`. Noise of measurements
    /// below 0 is 0.
    fn table(&self, slices: &[usize], limit: f32) -> Result<MeasuredTable<f32>, String> {
        let Self { name, shape, .. } = self;
        let Some((begin, &[height, width])) = shape.split_last_chunk::<2>() else {
            return Err(format!("`{name}` of the shape {shape:?} has no rows and columns"));
        };
        if begin != slices || width < 2 || height < 2 {
            return Err(format!(
                "`{name}` of the shape {shape:?} must begin with {slices:?}, with at least 2 rows and columns"
            ));
        }
        let values: Vec<f32> = self.floats()?.into_iter().map(|value| value.max(0.0)).collect();
        match values.iter().find(|value| **value > limit) {
            Some(bad) => Err(format!("`{name}` has the value {bad}, more than {limit:e}")),
            None => Ok(MeasuredTable { size: [width, height], values }),
        }
    }
}

fn parse(bytes: &[u8]) -> Result<MeasuredData, String> {
    let fields = fields(bytes)?;
    let field = |name: &str| fields.get(name).ok_or_else(|| format!("the file has no field `{name}`"));
    let phi = field("phi_i")?.knots([-PI, PI], MAX_DIRECTIONS)?;
    let theta = field("theta_i")?.knots([0.0, FRAC_PI_2], MAX_DIRECTIONS)?;
    let directions = [phi.len(), theta.len()];
    if phi.len() * theta.len() > MAX_DIRECTIONS {
        return Err(format!("the file has {directions:?} outgoing directions, more than {MAX_DIRECTIONS}"));
    }
    let data = MeasuredData {
        ndf: field("ndf")?.table(&[], MAX_DENSITY)?,
        sigma: field("sigma")?.table(&[], MAX_DENSITY)?,
        vndf: field("vndf")?.table(&directions, MAX_DENSITY)?,
        luminance: field("luminance")?.table(&directions, MAX_DENSITY)?,
        colors: match fields.get("rgb") {
            Some(rgb) => colors(rgb, directions, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])?,
            None => {
                let wavelengths = field("wavelengths")?.knots([0.0, 1e5], MAX_WAVELENGTHS)?;
                colors(field("spectra")?, directions, &weights(&wavelengths)?)?
            }
        },
        jacobian: field("jacobian")?.data(UINT8, 1)?.first().is_some_and(|flag| *flag != 0),
        phi,
        theta,
    };
    check_circle(&data)?;
    Ok(data)
}

/// Azimuths that matter are those of which others are reflections.
fn check_circle(data: &MeasuredData) -> Result<(), String> {
    let (first, last) = (data.phi[0], data.phi[data.phi.len() - 1]);
    let is_part = |parts: f32| (last - first - TAU / parts).abs() < ANGLE_TOLERANCE;
    if data.is_isotropic() || ((first + PI).abs() < ANGLE_TOLERANCE && [1.0, 2.0, 4.0].into_iter().any(is_part)) {
        return Ok(());
    }
    Err(format!("`phi_i` must go from -pi on a whole circle, half or a quarter, not from {first} to {last}"))
}

/// What each wavelength adds to red, green and blue.
fn weights(wavelengths: &[f32]) -> Result<Vec<[f32; 3]>, String> {
    let at = |i: usize| wavelengths.get(i).map(|&w| f64::from(w));
    let weight = |i: usize| {
        let neighbours =
            [i.checked_sub(1).and_then(at).map(|w| [w, 0.0]), at(i).map(|w| [w, 1.0]), at(i + 1).map(|w| [w, 0.0])];
        Spectrum::samples(neighbours.into_iter().flatten().collect()).map(|hat| hat.reflectance())
    };
    (0..wavelengths.len()).map(weight).collect()
}

/// Colours of a table with a slice for each direction and weight. What Rec.709 cannot show is cut off.
fn colors(field: &Field, directions: [usize; 2], weights: &[[f32; 3]]) -> Result<MeasuredTable<[f32; 3]>, String> {
    let [phi, theta] = directions;
    let MeasuredTable { size, values } = field.table(&[phi, theta, weights.len()], MAX_COLOR)?;
    let pixels = size[0] * size[1];
    let color = |slices: &[f32], i: usize| {
        let of_channel =
            |c: usize| weights.iter().zip(slices[i..].iter().step_by(pixels)).map(move |(w, v)| w[c] * v).sum();
        [0, 1, 2].map(|c| f32::max(of_channel(c), 0.0))
    };
    let values =
        values.chunks_exact(pixels * weights.len()).flat_map(|slices| (0..pixels).map(move |i| color(slices, i)));
    Ok(MeasuredTable { size, values: values.collect() })
}

#[cfg(test)]
#[path = "tensors_tests.rs"]
mod tests;
