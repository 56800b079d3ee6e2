//! The sky and the sun of a clear day, for `sunsky`: an image and a directional light.
//!
//! The sky is that of Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight". Mitsuba's is that of
//! Hosek and Wilkie, which is darker: Preetham's times 0.6 gives about the same light on the ground for turbidities of
//! 2 to 4. The sun is one exponential for each colour, fitted to Mitsuba's within a twentieth.

use std::f64::consts::{PI, TAU};

use super::Reader;
use super::element::Element;
use super::values;
use crate::assets::RgbImage;
use crate::desc::{DirectionalLightDesc, EnvironmentLightDesc, LightDesc, TransformDesc, TransformStepDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3, dvec3};

const WIDTH: usize = 512;
const HEIGHT: usize = 256;

/// From Preetham's sky to one as bright as Hosek and Wilkie's.
const BRIGHTNESS: f64 = 0.6;

/// Radiance of the sun without air for red, green and blue, and how much of it is lost in the air: without turbidity,
/// and by it.
const SUN: [[f64; 3]; 3] = [[24_470.0, 0.0247, 0.0242], [22_070.0, 0.0874, 0.0264], [21_520.0, 0.2801, 0.0251]];

impl<'a> Reader<'a> {
    /// The lights of a sky, with the direction of the sun by itself or by place and time.
    pub(super) fn sunsky(&mut self, element: &mut Element<'a>) -> Result<Vec<LightDesc>> {
        let kind = element.kind();
        let turbidity = element.float("turbidity")?.unwrap_or(3.0).clamp(1.7, 10.0);
        let scale = element.float("scale")?.unwrap_or(1.0);
        let sun_scale = element.float("sun_scale")?.unwrap_or(1.0) * scale * if kind == "sky" { 0.0 } else { 1.0 };
        let sky_scale = element.float("sky_scale")?.unwrap_or(1.0) * scale * if kind == "sun" { 0.0 } else { 1.0 };
        let aperture = element.float("sun_aperture")?.unwrap_or(0.5358);
        let sun = sun_direction(element)?;
        let map = element.transform("to_world")?.matrix3;
        if element.take("albedo").is_some() {
            element.approximated("albedo", "the sky does not depend on the ground");
        }
        element.boolean("complex_sun", false)?;
        element.approximated(
            "",
            "Preetham's sky, 0.6 times as bright, in place of Hosek and Wilkie's, as an image; the sun as a \
             directional light",
        );
        let mut lights = Vec::new();
        if sky_scale > 0.0 {
            let file = self.draft.keep_environment("sky", sky(turbidity, sun, sky_scale));
            // The image has the zenith at +Y, Mitsuba's sky at +Z.
            let upright = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
            let rows = values::rows(&DAffine3 { matrix3: map * upright, translation: DVec3::ZERO });
            let transform = Some(TransformDesc(vec![TransformStepDesc::Matrix(rows)]));
            lights.push(LightDesc::Environment(EnvironmentLightDesc {
                radiance: None,
                file: Some(file),
                scale: 1.0,
                transform,
                group: None,
            }));
        }
        let solid_angle = TAU * (1.0 - (0.5 * aperture.to_radians()).cos());
        let irradiance = sun_radiance(turbidity, sun.z).map(|radiance| (radiance * solid_angle * sun_scale) as f32);
        if irradiance.iter().any(|&e| e > 0.0) {
            let direction = (map * -sun).to_array();
            lights.push(LightDesc::Directional(DirectionalLightDesc {
                direction,
                irradiance,
                angular_diameter_degrees: aperture,
                group: None,
            }));
        }
        Ok(lights)
    }
}

/// Towards the sun, with +Z up, +X south and +Y west.
fn sun_direction(element: &mut Element) -> Result<DVec3> {
    let given = element.vector("sun_direction")?;
    let mut number = |name: &str, default: f64| element.float(name).map(|value| value.unwrap_or(default));
    let (latitude, longitude) = (number("latitude", 35.6894)?, number("longitude", 139.6917)?);
    let (timezone, year, month, day) =
        (number("timezone", 9.0)?, number("year", 2010.0)?, number("month", 7.0)?, number("day", 10.0)?);
    let hours = number("hour", 15.0)? + number("minute", 0.0)? / 60.0 + number("second", 0.0)? / 3600.0 - timezone;
    if let Some(direction) = given {
        let direction = DVec3::from(direction).try_normalize();
        return direction.ok_or_else(|| element.place_of("sun_direction").error("\"sun_direction\" is zero"));
    }
    Ok(sun_at(latitude, longitude, days_since_2000(year, month, day, hours)))
}

/// Days since noon of the first of January 2000, by the Gregorian calendar.
fn days_since_2000(year: f64, month: f64, day: f64, hours: f64) -> f64 {
    let months = 12.0 * year + month - 3.0;
    // Years that begin in March have the leap day at their end.
    let (y, m) = ((months / 12.0).floor(), months - 12.0 * (months / 12.0).floor());
    let days = 365.0 * y + (y / 4.0).floor() - (y / 100.0).floor()
        + (y / 400.0).floor()
        + ((153.0 * m + 2.0) / 5.0).floor()
        + day;
    days - 730_426.0 + hours / 24.0 - 0.5
}

/// Where the sun stands, to a hundredth of a degree (the low-precision formulas of The Astronomical Almanac).
fn sun_at(latitude: f64, longitude: f64, days: f64) -> DVec3 {
    let anomaly = (357.529 + 0.985_600_28 * days).to_radians();
    let mean = 280.459 + 0.985_647_36 * days;
    let ecliptic = (mean + 1.915 * anomaly.sin() + 0.020 * (2.0 * anomaly).sin()).to_radians();
    let tilt = (23.439 - 3.6e-7 * days).to_radians();
    let ascension = (tilt.cos() * ecliptic.sin()).atan2(ecliptic.cos());
    let declination = (tilt.sin() * ecliptic.sin()).asin();
    let sidereal = (15.0 * (18.697_374_558 + 24.065_709_824_419_08 * days) + longitude).to_radians();
    let (hour, latitude) = (sidereal - ascension, latitude.to_radians());
    let up = latitude.sin() * declination.sin() + latitude.cos() * declination.cos() * hour.cos();
    let south = latitude.sin() * declination.cos() * hour.cos() - latitude.cos() * declination.sin();
    dvec3(south, declination.cos() * hour.sin(), up)
}

/// Radiance of the sun in watts per square metre, steradian and nanometre, by the cosine from the zenith.
fn sun_radiance(turbidity: f64, cosine: f64) -> [f64; 3] {
    if cosine <= 0.0 {
        return [0.0; 3];
    }
    // Kasten's formula for the length of the way through the air.
    let degrees = cosine.min(1.0).acos().to_degrees();
    let way = 1.0 / (cosine + 0.15 * (93.885 - degrees).powf(-1.253));
    SUN.map(|[radiance, clear, haze]| radiance * (-way * (clear + haze * turbidity)).exp())
}

/// The image of a sky whose zenith is +Y, with the sun towards `sun` where the zenith is +Z.
fn sky(turbidity: f64, sun: DVec3, scale: f64) -> RgbImage {
    let model = Preetham::new(turbidity, sun.z.clamp(0.0, 1.0).acos());
    let mut pixels = Vec::with_capacity(WIDTH * HEIGHT);
    for row in 0..HEIGHT {
        let (sine, cosine) = (PI * (row as f64 + 0.5) / HEIGHT as f64).sin_cos();
        for column in 0..WIDTH {
            let phi = TAU * (column as f64 + 0.5) / WIDTH as f64;
            // In the image's own axes, as environments have them; then with +Z up.
            let (x, y, z) = (-phi.sin() * sine, cosine, phi.cos() * sine);
            let gamma = dvec3(x, -z, y).dot(sun).clamp(-1.0, 1.0).acos();
            pixels.push(if y > 0.0 { model.radiance(y, gamma).map(|c| (c * scale).max(0.0) as f32) } else { [0.0; 3] });
        }
    }
    RgbImage { width: WIDTH, height: HEIGHT, pixels }
}

/// The five coefficients of Perez's function.
type Perez = [f64; 5];

/// The sky of a turbidity and a height of the sun.
struct Preetham {
    /// For luminance and the chromaticities x and y.
    coefficients: [Perez; 3],
    /// What the functions are multiplied by.
    factors: [f64; 3],
}

impl Preetham {
    /// `theta` is the sun's angle from the zenith.
    fn new(turbidity: f64, theta: f64) -> Self {
        let t = turbidity;
        let coefficients = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * theta);
        let polynomial = |rows: [[f64; 4]; 3]| -> f64 {
            let powers = [theta.powi(3), theta.powi(2), theta, 1.0];
            let row = |row: [f64; 4]| row.iter().zip(powers).map(|(c, p)| c * p).sum::<f64>();
            t * t * row(rows[0]) + t * row(rows[1]) + row(rows[2])
        };
        let zenith = [
            (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192,
            polynomial([
                [0.00166, -0.00375, 0.00209, 0.0],
                [-0.02903, 0.06377, -0.03202, 0.00394],
                [0.11693, -0.21196, 0.06052, 0.25886],
            ]),
            polynomial([
                [0.00275, -0.00610, 0.00317, 0.0],
                [-0.04214, 0.08970, -0.04153, 0.00516],
                [0.15346, -0.26756, 0.06670, 0.26688],
            ]),
        ];
        let factors = std::array::from_fn(|i| zenith[i] / perez(&coefficients[i], 1.0, theta));
        Self { coefficients, factors }
    }

    /// Linear RGB at a cosine from the zenith and an angle from the sun.
    fn radiance(&self, cosine: f64, gamma: f64) -> [f64; 3] {
        let [luminance, x, y] =
            std::array::from_fn(|i| self.factors[i] * perez(&self.coefficients[i], cosine.max(0.01), gamma));
        // Kilocandela per square metre in watts per square metre, steradian and nanometre.
        let luminance = luminance * BRIGHTNESS * 1000.0 / (683.0 * 106.856);
        let (cx, cz) = (luminance * x / y, luminance * (1.0 - x - y) / y);
        [
            3.240_454 * cx - 1.537_139 * luminance - 0.498_531 * cz,
            -0.969_266 * cx + 1.876_011 * luminance + 0.041_556 * cz,
            0.055_643 * cx - 0.204_026 * luminance + 1.057_225 * cz,
        ]
    }
}

/// Perez's function of the sky at a cosine from the zenith and an angle from the sun.
fn perez([a, b, c, d, e]: &Perez, cosine: f64, gamma: f64) -> f64 {
    (1.0 + a * (b / cosine).exp()) * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_in_the_west_in_the_afternoon() {
        // As Mitsuba has it for its default place and time.
        let sun = sun_at(35.6894, 139.6917, days_since_2000(2010.0, 7.0, 10.0, 6.0));
        assert!((sun - dvec3(0.0513854, 0.691748, 0.720308)).length() < 3e-3, "{sun}");
        assert_eq!(days_since_2000(2000.0, 1.0, 1.0, 12.0), 0.0);
        assert_eq!(days_since_2000(2000.0, 3.0, 1.0, 12.0), 60.0);
    }

    #[test]
    fn the_sky_is_brightest_around_the_sun_and_black_below() {
        let sun = dvec3(0.6, 0.0, 0.8);
        let image = sky(3.0, sun, 1.0);
        let luminance = |i: usize| image.pixels[i][1];
        let brightest = (0..image.pixels.len()).max_by(|&a, &b| luminance(a).total_cmp(&luminance(b))).unwrap();
        let (row, column) = (brightest / WIDTH, brightest % WIDTH);
        // +X is at three quarters of the width.
        assert!(column.abs_diff(3 * WIDTH / 4) < 3, "{column}");
        assert!((PI * row as f64 / HEIGHT as f64 - 0.8f64.acos()).abs() < 0.05, "{row}");
        assert_eq!(image.pixels[WIDTH * HEIGHT - 1], [0.0; 3]);
        assert!(image.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0));
    }

    #[test]
    fn the_sun_is_redder_and_darker_near_the_horizon() {
        // Mitsuba's at turbidity 3 and 45 degrees.
        let high = sun_radiance(3.0, 0.5f64.sqrt());
        for (a, b) in high.into_iter().zip([21369.0, 17551.0, 12928.0]) {
            assert!((a / b - 1.0).abs() < 0.06, "{high:?}");
        }
        let low = sun_radiance(3.0, 0.05);
        assert!(low[0] < high[0] && low[2] / low[0] < high[2] / high[0] && sun_radiance(3.0, -0.1) == [0.0; 3]);
    }
}
