//! Spectra to linear Rec.709 RGB, through the CIE 1931 2-degree standard observer.
//!
//! Two meanings, two conversions. What *reflects* (or transmits, or is an index of refraction) is seen under D65, the
//! white of Rec.709, so that a constant spectrum is grey of the same value: [`Spectrum::reflectance`]. What *emits* is
//! seen as it is: [`Spectrum::emission`], where a constant spectrum of 1 has luminance 1 and the warm colour of equal
//! energy, (1.2048, 0.9484, 0.9088); and D65 is white. Renderers normalise emission in different ways:
//! [`Spectrum::emission_of_luminance_one`] is pbrt's.
//!
//! Colours that Rec.709 cannot show, such as those of single wavelengths, have negative components, which are kept:
//! whether they are cut off is the caller's choice.

mod named;
mod tables;

pub use named::{Named, named};

use tables::{FIRST, LAST, STEP};

/// A value for each wavelength in nanometres.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same for all.
    Constant(f64),
    /// Straight lines between samples, zero outside of them. Made by [`Spectrum::samples`].
    Samples(Vec<[f64; 2]>),
    /// Planck's law at a temperature in kelvin, times a factor that makes the largest value 1.
    Blackbody(f64),
}

impl Spectrum {
    /// Samples `[wavelength in nm, value]` in the order of their wavelengths. Two at the same wavelength are a step.
    ///
    /// # Errors
    /// If there are none, one is not finite, or they are not in order.
    pub fn samples(samples: Vec<[f64; 2]>) -> Result<Self, String> {
        if samples.is_empty() {
            return Err("a spectrum needs at least one sample".into());
        }
        if let Some([wavelength, value]) = samples.iter().find(|sample| !sample.iter().all(|x| x.is_finite())) {
            return Err(format!("the sample {value} at {wavelength} nm is not finite"));
        }
        match samples.windows(2).find(|pair| pair[0][0] > pair[1][0]) {
            Some(pair) => Err(format!("wavelengths must grow, but {} nm follows {} nm", pair[1][0], pair[0][0])),
            None => Ok(Self::Samples(samples)),
        }
    }

    /// Values at even distances, the first at `first` and the last at `last` nanometres.
    ///
    /// # Errors
    /// As [`Spectrum::samples`].
    pub fn regular(first: f64, last: f64, values: &[f64]) -> Result<Self, String> {
        let step = (last - first) / (values.len().max(2) - 1) as f64;
        Self::samples(values.iter().enumerate().map(|(i, &value)| [first + step * i as f64, value]).collect())
    }

    /// The value at a wavelength in nanometres.
    pub fn at(&self, wavelength: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Samples(samples) => {
                let after = samples.partition_point(|sample| sample[0] <= wavelength);
                match (after.checked_sub(1).and_then(|i| samples.get(i)), samples.get(after)) {
                    (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (wavelength - a[0]) / (b[0] - a[0]),
                    (Some(a), None) if a[0] == wavelength => a[1],
                    _ => 0.0,
                }
            }
            Self::Blackbody(kelvin) => {
                // Wien's displacement law gives the peak.
                let peak = 2.897_771_955e6 / kelvin;
                planck(wavelength, *kelvin) / planck(peak, *kelvin)
            }
        }
    }

    /// CIE X, Y and Z of the spectrum as emission; a constant spectrum of 1 has Y = 1.
    pub fn xyz(&self) -> [f64; 3] {
        let white = integrate(&Self::Constant(1.0), false);
        integrate(self, false).map(|x| x / white[1])
    }

    /// Linear RGB of what reflects, seen under D65: a constant spectrum is grey of its value.
    pub fn reflectance(&self) -> [f32; 3] {
        if let Self::Constant(value) = self {
            return [*value as f32; 3];
        }
        let white = rgb_from_xyz(integrate(&Self::Constant(1.0), true));
        let rgb = rgb_from_xyz(integrate(self, true));
        std::array::from_fn(|i| (rgb[i] / white[i]) as f32)
    }

    /// Linear RGB of what emits; a constant spectrum of 1 has luminance 1.
    pub fn emission(&self) -> [f32; 3] {
        rgb_from_xyz(self.xyz()).map(|x| x as f32)
    }

    /// Linear RGB of what emits, times the factor that makes its luminance 1; black if it has none.
    pub fn emission_of_luminance_one(&self) -> [f32; 3] {
        let xyz = self.xyz();
        if xyz[1] > 0.0 { rgb_from_xyz(xyz.map(|x| x / xyz[1])).map(|x| x as f32) } else { [0.0; 3] }
    }

    /// Where straight lines meet, within the range of the observer; the spectrum is zero outside of them.
    fn knots(&self) -> Vec<f64> {
        let (first, last) = match self {
            Self::Samples(samples) => match (samples.first(), samples.last()) {
                (Some(first), Some(last)) => (first[0].max(FIRST), last[0].min(LAST)),
                _ => return Vec::new(),
            },
            _ => (FIRST, LAST),
        };
        let steps = ((LAST - FIRST) / STEP) as usize;
        let mut knots: Vec<f64> = (0..=steps).map(|i| FIRST + STEP * i as f64).chain([first, last]).collect();
        if let Self::Samples(samples) = self {
            knots.extend(samples.iter().map(|sample| sample[0]));
        }
        knots.retain(|x| (first..=last).contains(x));
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        knots
    }
}

/// Planck's law: spectral radiance at a wavelength in nm and a temperature in kelvin, up to a constant factor.
fn planck(wavelength: f64, kelvin: f64) -> f64 {
    // h c / k, in nm kelvin.
    const SECOND_CONSTANT: f64 = 1.438_776_877e7;
    let x = wavelength / 1000.0;
    1.0 / (x.powi(5) * (SECOND_CONSTANT / (wavelength * kelvin)).exp_m1())
}

/// The integral of the spectrum times the observer, and optionally D65. All are straight lines between knots, so that
/// three points of each (Simpson's rule) give it exactly; Planck's law is smooth.
fn integrate(spectrum: &Spectrum, under_d65: bool) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pair in spectrum.knots().windows(2) {
        let [a, b] = [pair[0], pair[1]];
        // Just inside, where a step at a knot has only one value.
        let inset = 1e-9 * (b - a);
        for (x, weight) in [(a + inset, 1.0), (0.5 * (a + b), 4.0), (b - inset, 1.0)] {
            let light = if under_d65 { tables::at(&tables::D65, x) } else { 1.0 };
            let value = spectrum.at(x) * light * weight * (b - a) / 6.0;
            sum.iter_mut().zip(tables::observer(x)).for_each(|(sum, c)| *sum += value * c);
        }
    }
    sum
}

/// Rec.709's primaries and white (IEC 61966-2-1).
fn rgb_from_xyz([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_479 * x - 1.537_150 * y - 0.498_535 * z,
        -0.969_256 * x + 1.875_991 * y + 0.041_556 * z,
        0.055_648 * x - 0.204_043 * y + 1.057_311 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f32; 3], b: [f32; 3], tolerance: f32) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?} is not {b:?}");
    }

    #[test]
    fn what_reflects_all_alike_is_grey_of_the_same_value() {
        close(Spectrum::Constant(0.5).reflectance(), [0.5; 3], 0.0);
        close(Spectrum::samples(vec![[300.0, 0.25], [900.0, 0.25]]).unwrap().reflectance(), [0.25; 3], 1e-6);
        close(Spectrum::regular(300.0, 900.0, &[1.0, 1.0, 1.0]).unwrap().reflectance(), [1.0; 3], 1e-6);
    }

    #[test]
    fn daylight_is_white_and_equal_energy_warm() {
        let d65 = Spectrum::regular(360.0, 780.0, &tables::D65).unwrap();
        close(d65.emission_of_luminance_one(), [1.0; 3], 2e-3);
        // x = y = z = 1/3 in Rec.709.
        close(Spectrum::Constant(1.0).emission(), [1.2048, 0.9484, 0.9088], 1e-3);
        assert!((Spectrum::Constant(2.0).xyz()[1] - 2.0).abs() < 1e-9);
    }

    #[test]
    fn bodies_glow_red_first_and_white_at_the_temperature_of_daylight() {
        close(Spectrum::Blackbody(6504.0).emission_of_luminance_one(), [1.03, 0.99, 1.01], 0.06);
        // 2856 K is standard illuminant A: x = 0.44757, y = 0.40745.
        close(Spectrum::Blackbody(2856.0).emission_of_luminance_one(), [1.845, 0.826, 0.233], 4e-3);
        let peak = Spectrum::Blackbody(5000.0).at(579.554);
        assert!((peak - 1.0).abs() < 1e-6);
    }

    #[test]
    fn single_wavelengths_lie_outside_of_the_gamut_and_are_not_lost() {
        let line = Spectrum::samples(vec![[519.9, 0.0], [520.0, 1.0], [520.1, 0.0]]).unwrap().emission();
        assert!(line[0] < 0.0 && line[1] > 0.0 && line[2] < 0.0, "{line:?}");
        let xyz = Spectrum::samples(vec![[549.9, 1.0], [550.1, 1.0]]).unwrap().xyz();
        // y(550) = 0.99495 over the integral of y, 106.857.
        assert!((xyz[1] - 0.2 * 0.994_95 / 106.857).abs() < 1e-6);
    }

    #[test]
    fn samples_are_lines_with_nothing_beyond() {
        let spectrum = Spectrum::samples(vec![[400.0, 1.0], [500.0, 3.0], [500.0, 0.0], [600.0, 1.0]]).unwrap();
        let values = [399.0, 400.0, 450.0, 550.0, 600.0, 601.0].map(|x| spectrum.at(x));
        assert_eq!(values, [0.0, 1.0, 2.0, 0.5, 1.0, 0.0]);
        for bad in [vec![], vec![[500.0, 1.0], [400.0, 1.0]], vec![[f64::NAN, 1.0]], vec![[400.0, f64::INFINITY]]] {
            assert!(Spectrum::samples(bad).is_err());
        }
    }
}
