//! What black bodies emit, by temperature, as Blender's principled volume has it.

use std::sync::LazyLock;

use crate::color::Rgb;
use crate::spectrum::Spectrum;

/// Colours of the ends of the table in kelvin: below and beyond they hardly change.
const COLDEST: f64 = 800.0;
const HOTTEST: f64 = 40_000.0;

/// Entries of the table, at even distances of 1 over the temperature.
const ENTRIES: usize = 512;

/// The constant of Stefan and Boltzmann's law, in W/(m² K⁴).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// Linear Rec.709 of luminance 1 by the inverse of temperature, through the CIE 1931 observer; what Rec.709 cannot show
/// is cut off.
static COLORS: LazyLock<Vec<Rgb>> = LazyLock::new(|| {
    let color = |i: usize| {
        let inverse = HOTTEST.recip() + (COLDEST.recip() - HOTTEST.recip()) * i as f64 / (ENTRIES - 1) as f64;
        Rgb::from(Spectrum::Blackbody(inverse.recip()).emission_of_luminance_one()).map(|c| c.max(0.0))
    };
    (0..ENTRIES).map(color).collect()
});

/// The colour of luminance 1 that black bodies of this temperature in kelvin have, times the power that they radiate in
/// all wavelengths by Stefan and Boltzmann's law, in MW/(m² sr).
pub fn blackbody(kelvin: f32) -> Rgb {
    let range = COLDEST.recip() - HOTTEST.recip();
    let x = (f64::from(kelvin).max(COLDEST).recip() - HOTTEST.recip()).max(0.0) / range * (ENTRIES - 1) as f64;
    let below = (x as usize).min(ENTRIES - 2);
    let (a, b, f) = (COLORS[below], COLORS[below + 1], x as f32 - below as f32);
    let power = 1e-6 * STEFAN_BOLTZMANN / std::f64::consts::PI * f64::from(kelvin).powi(4);
    (a * (1.0 - f) + b * f) * power as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE x and y of linear Rec.709, and the luminance.
    fn chromaticity(Rgb { r, g, b }: Rgb) -> ([f32; 2], f32) {
        let xyz = [
            0.412_456 * r + 0.357_576 * g + 0.180_438 * b,
            0.212_673 * r + 0.715_152 * g + 0.072_175 * b,
            0.019_334 * r + 0.119_192 * g + 0.950_304 * b,
        ];
        let sum: f32 = xyz.iter().sum();
        ([xyz[0] / sum, xyz[1] / sum], xyz[1])
    }

    #[test]
    fn colours_lie_on_the_planckian_locus() {
        // Wyszecki and Stiles, "Color Science", table 1(3.11), where Rec.709 can show it.
        for (kelvin, x, y) in
            [(2500.0, 0.4770, 0.4137), (4000.0, 0.3805, 0.3768), (6500.0, 0.3135, 0.3237), (10_000.0, 0.2807, 0.2884)]
        {
            let (found, _) = chromaticity(blackbody(kelvin));
            assert!((found[0] - x).abs() < 1e-3 && (found[1] - y).abs() < 1e-3, "{kelvin}: {found:?}");
        }
    }

    #[test]
    fn brightness_follows_stefan_and_boltzmann() {
        // 5.670374e-8 T⁴ / pi, in MW.
        for (kelvin, expected) in [(2000.0, 0.288_789), (4000.0, 4.620_62), (20_000.0, 2887.89)] {
            let (_, luminance) = chromaticity(blackbody(kelvin));
            assert!((luminance / expected - 1.0).abs() < 2e-3, "{kelvin}: {luminance} {expected}");
        }
        // Colder ones are red, and what is at zero is dark.
        let cold = blackbody(600.0);
        assert!(cold.r > 0.0 && cold.g < 0.05 * cold.r && cold.b == 0.0, "{cold:?}");
        assert_eq!(blackbody(0.0), Rgb::BLACK);
        assert!(blackbody(1e6).is_finite());
    }
}
