//! Spectra to RGB, as Mitsuba sees them when it renders in RGB: what reflects under D65, what emits as it is.

use super::Reader;
use super::element::Element;
use super::tree::{Place, Property, Spectrum, Value};
use super::values;
use crate::error::{Error, Result};
use crate::spectrum;

/// More samples than any spectrum has.
const MAX_SAMPLES: usize = 100_000;

impl<'a> Reader<'a> {
    /// The colour of `<spectrum>`; that of light if it is `emitted`.
    pub(super) fn spectrum_color(&mut self, spectrum: &Spectrum, place: &Place, emitted: bool) -> Result<[f32; 3]> {
        let spectrum = match spectrum {
            Spectrum::Uniform(value) => spectrum::Spectrum::Constant(*value),
            Spectrum::Samples(samples) => sampled(samples.clone(), place)?,
            Spectrum::File(name) => {
                let path = self
                    .scene
                    .parent()
                    .unwrap_or(std::path::Path::new(""))
                    .join(self.document.find_file(self.scene, name));
                let text = crate::file::read_to_string(&path)
                    .map_err(|e| Error::Missing { file: path.clone(), message: format!("{e} (named at {place})") })?;
                self.draft.files.insert(path.clone());
                sampled(
                    file_samples(&text).map_err(|message| place.error(format!("{}: {message}", path.display())))?,
                    place,
                )?
            }
        };
        Ok(color(&spectrum, emitted))
    }

    /// The colour of a nested spectrum; that of light if it is `emitted`.
    pub(super) fn spectrum_plugin(&mut self, element: &mut Element<'a>, emitted: bool) -> Result<[f32; 3]> {
        let place = element.place();
        let spectrum = match element.kind() {
            // Unlike <spectrum value="1"/>, this is white where it emits.
            "uniform" => return Ok([element.float("value")?.unwrap_or(1.0) as f32; 3]),
            "srgb" => return constant_color(element, "color", [1.0; 3]),
            // The white of Rec.709.
            "d65" => {
                let scale = element.float("scale")?.unwrap_or(1.0) as f32;
                return Ok(constant_color(element, "color", [1.0; 3])?.map(|c| c * scale));
            }
            "regular" => {
                let needed = |value: Option<f64>, name: &str| {
                    value.ok_or_else(|| place.error(format!("a regular spectrum needs \"{name}\"")))
                };
                let first = needed(element.float("wavelength_min")?, "wavelength_min")?;
                let last = needed(element.float("wavelength_max")?, "wavelength_max")?;
                let values = list(element, "values")?;
                spectrum::Spectrum::regular(first, last, &values).map_err(|message| place.error(message))?
            }
            "irregular" => {
                let (wavelengths, values) = (list(element, "wavelengths")?, list(element, "values")?);
                if wavelengths.len() != values.len() {
                    return Err(place.error(format!("{} wavelengths, but {} values", wavelengths.len(), values.len())));
                }
                sampled(wavelengths.into_iter().zip(values).map(|(x, y)| [x, y]).collect(), place)?
            }
            "blackbody" => {
                let kelvin =
                    element.float("temperature")?.ok_or_else(|| place.error("a blackbody needs \"temperature\""))?;
                if kelvin <= 0.0 {
                    return Err(element
                        .place_of("temperature")
                        .error(format!("\"temperature\" must be above 0, not {kelvin}")));
                }
                let scale = element.float("scale")?.unwrap_or(1.0);
                let peak = peak_radiance(kelvin) * scale;
                return Ok(color(&spectrum::Spectrum::Blackbody(kelvin), emitted).map(|c| (f64::from(c) * peak) as f32));
            }
            other => {
                element.ignored("", format!("unsupported spectrum {other}: 1 in its place"));
                spectrum::Spectrum::Constant(1.0)
            }
        };
        Ok(color(&spectrum, emitted))
    }
}

/// The colour; what Rec.709 cannot show is cut off.
fn color(spectrum: &spectrum::Spectrum, emitted: bool) -> [f32; 3] {
    let rgb = if emitted { spectrum.emission() } else { spectrum.reflectance() };
    rgb.map(|c| c.max(0.0))
}

fn sampled(samples: Vec<[f64; 2]>, place: &Place) -> Result<spectrum::Spectrum> {
    if samples.len() > MAX_SAMPLES {
        return Err(place.error(format!("a spectrum of more than {MAX_SAMPLES} samples")));
    }
    spectrum::Spectrum::samples(samples).map_err(|message| place.error(message))
}

fn constant_color(element: &mut Element, name: &str, default: [f32; 3]) -> Result<[f32; 3]> {
    match element.take(name).map(|Property { value, place, .. }| (value, place)) {
        None => Ok(default),
        Some((Value::Rgb(color), _)) => Ok(*color),
        Some((Value::Float(v), _)) => Ok([*v as f32; 3]),
        Some((_, place)) => Err(place.error(format!("\"{name}\" must be a colour"))),
    }
}

/// Numbers in a string.
fn list(element: &mut Element, name: &str) -> Result<Vec<f64>> {
    let text = element.text(name)?.ok_or_else(|| element.place().error(format!("the spectrum needs \"{name}\"")))?;
    values::numbers(text).map_err(|message| element.place_of(name).error(message))
}

/// Lines of a wavelength and a value, and comments.
fn file_samples(text: &str) -> Result<Vec<[f64; 2]>, String> {
    let mut samples = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        match values::numbers(line).map_err(|message| format!("line {}: {message}", i + 1))?[..] {
            [] => {}
            [wavelength, value] => samples.push([wavelength, value]),
            _ => return Err(format!("line {}: expected a wavelength and a value", i + 1)),
        }
    }
    Ok(samples)
}

/// The largest spectral radiance of a black body, in watts per square metre, steradian and nanometre (Planck's law
/// where Wien's has its peak).
fn peak_radiance(kelvin: f64) -> f64 {
    // 2 h c², in W m², and the wavelength of the peak times the temperature and h c / (k of it).
    const FIRST: f64 = 1.191_042_972e-16;
    const WIEN: f64 = 2.897_771_955e-3;
    const EXPONENT: f64 = 4.965_114_231_744;
    let peak = WIEN / kelvin;
    1e-9 * FIRST / (peak.powi(5) * EXPONENT.exp_m1())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_black_body_has_the_radiance_of_plancks_law() {
        // 5772 K, the sun: 26.2 kW per square metre, steradian and nanometre at its peak.
        assert!((peak_radiance(5772.0) - 26_240.0).abs() < 20.0, "{}", peak_radiance(5772.0));
    }

    #[test]
    fn files_have_comments_and_pairs() {
        assert_eq!(file_samples("# a\n400 0.5 # b\n\n500,1\n").unwrap(), [[400.0, 0.5], [500.0, 1.0]]);
        assert!(file_samples("400\n").unwrap_err().starts_with("line 1"));
    }
}
