//! Spectra of parameters as linear Rec.709 colours.

use std::path::Path;

use super::params::{Param, Params, Values};
use crate::error::{Error, Result};
use crate::spectrum::{Named, Spectrum, named};

/// The colour space of `rgb` parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorSpace {
    /// Rec.709's primaries and white.
    #[default]
    Srgb,
    /// P3's primaries with D65.
    DciP3,
    /// Rec.2020.
    Rec2020,
    /// ACES AP0, whose white is D60; adapted to D65.
    Aces,
}

impl ColorSpace {
    /// By its name in the scene language.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "srgb" => Some(Self::Srgb),
            "dci-p3" => Some(Self::DciP3),
            "rec2020" => Some(Self::Rec2020),
            "aces2065-1" => Some(Self::Aces),
            _ => None,
        }
    }

    /// A colour in linear Rec.709.
    fn to_rec709(self, c: [f64; 3]) -> [f64; 3] {
        let rows: [[f64; 3]; 3] = match self {
            Self::Srgb => return c,
            Self::DciP3 => {
                [[1.224_940, -0.224_940, 0.0], [-0.042_057, 1.042_057, 0.0], [-0.019_638, -0.078_636, 1.098_274]]
            }
            Self::Rec2020 => [
                [1.660_491, -0.587_641, -0.072_850],
                [-0.124_550, 1.132_900, -0.008_349],
                [-0.018_151, -0.100_579, 1.118_730],
            ],
            Self::Aces => [
                [2.521_686, -1.134_131, -0.387_555],
                [-0.276_480, 1.372_719, -0.096_239],
                [-0.015_378, -0.152_975, 1.168_353],
            ],
        };
        rows.map(|row| row.iter().zip(c).map(|(a, b)| a * b).sum())
    }
}

/// What a spectrum is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Reflected or transmitted light: within `[0, 1]`.
    Reflectance,
    /// A number that is no light, such as an index of refraction.
    Number,
    /// Emission: spectra other than `rgb` have luminance 1 after pbrt has divided them by what they measure in nits.
    Emission,
}

/// Reads the colours of a directive's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Colors<'a> {
    /// The folder of the scene, for files of spectra.
    pub folder: &'a Path,
    /// The colour space in force.
    pub space: ColorSpace,
}

impl Colors<'_> {
    /// The colour of a parameter, or `None` if it is not given (or names a texture).
    pub fn get(&self, params: &Params, name: &str, meaning: Meaning) -> Result<Option<[f32; 3]>> {
        let Some(param) = params.get(name).filter(|param| param.kind != "texture") else { return Ok(None) };
        let color = match (param.kind.as_str(), &param.values) {
            ("rgb", Values::Numbers(numbers)) => {
                let Ok(rgb) = <[f64; 3]>::try_from(numbers.as_slice()) else {
                    return Err(param.error(format!("needs 3 numbers, not {}", numbers.len())));
                };
                if self.space == ColorSpace::Aces {
                    params.approximate(name, "the white of ACES is adapted to D65");
                }
                self.space.to_rec709(rgb)
            }
            ("blackbody", Values::Numbers(numbers)) => match numbers.as_slice() {
                [kelvin] if *kelvin > 0.0 && kelvin.is_finite() => {
                    params.approximate(name, "reduced to red, green and blue");
                    reduce(&Spectrum::Blackbody(*kelvin), meaning)
                }
                _ => return Err(param.error("needs one temperature above 0 K")),
            },
            ("spectrum", Values::Numbers(numbers)) => {
                params.approximate(name, "reduced to red, green and blue");
                reduce(&sampled(param, numbers)?, meaning)
            }
            ("spectrum", Values::Strings(names)) => match names.as_slice() {
                [spectrum] => {
                    params.approximate(name, "reduced to red, green and blue");
                    self.by_name(param, spectrum, meaning)?
                }
                _ => return Err(param.error("needs one name, or pairs of wavelengths and values")),
            },
            ("float", Values::Numbers(numbers)) if numbers.len() == 1 => [numbers[0]; 3],
            _ => return Err(param.error("is not a colour or spectrum")),
        };
        if !color.iter().all(|x| x.is_finite()) {
            return Err(param.error("is not finite"));
        }
        let fits = match meaning {
            Meaning::Reflectance => color.iter().all(|x| (0.0..=1.0).contains(x)),
            Meaning::Number | Meaning::Emission => color.iter().all(|x| *x >= 0.0),
        };
        if !fits {
            params.approximate(name, "cut off at the limits of what is possible");
        }
        let highest = if meaning == Meaning::Reflectance { 1.0 } else { f64::INFINITY };
        Ok(Some(color.map(|x| x.clamp(0.0, highest) as f32)))
    }

    /// The index of refraction of a parameter, with its Abbe number if it is a known glass.
    pub fn index(&self, params: &Params, name: &str, default: f32) -> Result<(f32, Option<f32>)> {
        let Some(param) = params.get(name) else { return Ok((default, None)) };
        if let Values::Strings(names) = &param.values
            && let [glass] = names.as_slice()
            && let Some(Named::Glass { ior, abbe }) = named(glass)
        {
            params.approximate(name, "as an index and an Abbe number");
            return Ok((ior, Some(abbe)));
        }
        let rgb = self.get(params, name, Meaning::Number)?.unwrap_or([default; 3]);
        if rgb[0] != rgb[2] {
            params.approximate(name, "the same index for all colours");
        }
        Ok((rgb[1], None))
    }

    fn by_name(&self, param: &Param, name: &str, meaning: Meaning) -> Result<[f64; 3]> {
        if let Some(known) = named(name) {
            return Ok(known.rgb().map(f64::from));
        }
        let file = self.folder.join(name);
        let text = crate::file::read_to_string(&file).map_err(|e| Error::Missing {
            file: file.clone(),
            message: format!("{e} (\"{} {}\" names neither a known spectrum nor a file)", param.kind, param.name),
        })?;
        let mut numbers = Vec::new();
        for (i, line) in text.lines().enumerate() {
            for word in line.split('#').next().unwrap_or_default().split_ascii_whitespace() {
                let number = word.parse::<f64>();
                numbers.push(number.map_err(|_| Error::Parse {
                    file: file.clone(),
                    line: i + 1,
                    column: 1,
                    message: format!("expected wavelengths and values, not {word}"),
                })?);
            }
        }
        Ok(reduce(&sampled(param, &numbers)?, meaning))
    }
}

fn sampled(param: &Param, numbers: &[f64]) -> Result<Spectrum> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() {
        return Err(param.error("needs pairs of wavelengths and values"));
    }
    Spectrum::samples(pairs.to_vec()).map_err(|message| param.error(message))
}

fn reduce(spectrum: &Spectrum, meaning: Meaning) -> [f64; 3] {
    let rgb = match meaning {
        Meaning::Emission => spectrum.emission_of_luminance_one(),
        Meaning::Reflectance | Meaning::Number => spectrum.reflectance(),
    };
    rgb.map(f64::from)
}
