//! pbrt's named spectra, as constants.

use super::Spectrum;
use crate::metal::{Metal, MetalNames};

/// The spectrum of a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Named {
    /// A part of a metal's index of refraction, for red, green and blue.
    Metal([f32; 3]),
    /// A glass: the index of refraction for yellow light (587.6 nm) and the Abbe number.
    Glass {
        /// The index.
        ior: f32,
        /// The Abbe number.
        abbe: f32,
    },
    /// A light's colour at luminance 1, linear RGB.
    Illuminant([f32; 3]),
}

/// Glasses of Schott's catalogue; pbrt's names F5, F10 and F11 are SF5, SF10 and SF11.
const GLASSES: &[(&str, f32, f32)] = &[
    ("BK7", 1.5168, 64.17),
    ("BAF10", 1.6700, 47.11),
    ("FK51A", 1.4866, 84.47),
    ("LASF9", 1.8503, 32.17),
    ("F5", 1.6727, 32.21),
    ("F10", 1.7283, 28.41),
    ("F11", 1.7847, 25.76),
];

/// Illuminants at luminance 1 (CIE 15, Colorimetry; D60 of ACES).
const ILLUMINANTS: &[(&str, [f32; 3])] = &[
    ("stdillum-A", [1.8450, 0.8261, 0.2334]),
    ("stdillum-D50", [1.1761, 0.9757, 0.7220]),
    ("stdillum-D65", [1.0, 1.0, 1.0]),
    ("stdillum-F1", [0.9543, 1.0193, 0.9437]),
    ("stdillum-F2", [1.3401, 0.9430, 0.5629]),
    ("stdillum-F3", [1.5764, 0.8911, 0.3809]),
    ("stdillum-F4", [1.8063, 0.8342, 0.2671]),
    ("stdillum-F5", [0.9154, 1.0362, 0.8903]),
    ("stdillum-F6", [1.3160, 0.9578, 0.4865]),
    ("stdillum-F7", [1.0003, 1.0002, 0.9974]),
    ("stdillum-F8", [1.1767, 0.9757, 0.7201]),
    ("stdillum-F9", [1.3767, 0.9314, 0.5693]),
    ("stdillum-F10", [1.1744, 0.9765, 0.7192]),
    ("stdillum-F11", [1.4121, 0.9247, 0.5316]),
    ("stdillum-F12", [1.7684, 0.8451, 0.2708]),
    ("illum-acesD60", [1.0466, 0.9946, 0.9159]),
];

/// The spectrum of a name in pbrt, if it has one.
pub fn named(name: &str) -> Option<Named> {
    if let Some((metal, part)) = name.strip_prefix("metal-").and_then(|rest| rest.split_once('-')) {
        let metal = Metal::find(MetalNames::Pbrt, metal)?;
        return match part {
            "eta" => Some(Named::Metal(metal.eta)),
            "k" => Some(Named::Metal(metal.k)),
            _ => None,
        };
    }
    if let Some(glass) = name.strip_prefix("glass-") {
        return GLASSES.iter().find(|(name, ..)| *name == glass).map(|&(_, ior, abbe)| Named::Glass { ior, abbe });
    }
    ILLUMINANTS.iter().find(|(illuminant, _)| *illuminant == name).map(|(_, rgb)| Named::Illuminant(*rgb))
}

impl Named {
    /// As a colour: a metal's number for red, green and blue, a light's colour, a glass's index.
    pub fn rgb(self) -> [f32; 3] {
        match self {
            Self::Metal(rgb) | Self::Illuminant(rgb) => rgb,
            Self::Glass { ior, .. } => Spectrum::Constant(f64::from(ior)).reflectance(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_and_others_are_not() {
        assert_eq!(named("metal-Cu-eta").unwrap().rgb(), [0.1337, 0.9552, 1.2142]);
        assert_eq!(named("metal-Cu-k").unwrap().rgb()[0], 3.2734);
        assert_eq!(named("glass-BK7"), Some(Named::Glass { ior: 1.5168, abbe: 64.17 }));
        assert_eq!(named("stdillum-D65").unwrap().rgb(), [1.0; 3]);
        assert!(["metal-Cu", "metal-Xx-eta", "glass-", "", "stdillum-D"].iter().all(|name| named(name).is_none()));
    }

    #[test]
    fn metals_reflect_as_their_spectra() {
        // Under D65, from the tables of luxpop.com.
        for (metal, expected) in
            [("Ag", [0.9715, 0.9599, 0.9153]), ("Al", [0.9132, 0.9215, 0.9245]), ("Cu", [0.9554, 0.6376, 0.5382])]
        {
            let part = |part: &str| named(&format!("metal-{metal}-{part}")).unwrap().rgb();
            let (eta, k) = (part("eta"), part("k"));
            for i in 0..3 {
                let reflectance = ((eta[i] - 1.0).powi(2) + k[i] * k[i]) / ((eta[i] + 1.0).powi(2) + k[i] * k[i]);
                assert!((reflectance - expected[i]).abs() < 1e-3, "{metal}: {reflectance}");
            }
        }
    }
}
