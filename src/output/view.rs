//! Views: how scene-linear light becomes the code values of a display.

use crate::color::{Rgb, srgb_from_linear};
use crate::desc::ViewDesc;

/// The code values in `[0, 1]` that an sRGB display shows for scene-linear Rec.709 light.
pub fn code_values(view: ViewDesc, light: Rgb) -> Rgb {
    match view {
        ViewDesc::Agx => agx(light),
        ViewDesc::Filmic => light.map(filmic).map(srgb_from_linear),
        ViewDesc::Srgb => light.map(|x| srgb_from_linear(x.clamp(0.0, 1.0))),
    }
}

/// X + Y + Z of each Rec.709 primary over that of their white.
const SHARES: Rgb = Rgb::new(0.211_994_6, 0.392_150_8, 0.395_854_6);

/// How far AgX moves the chromaticities of the primaries towards white.
const INSET: f32 = 0.2;

/// Scene-linear light at the curve's pivot.
const MIDDLE_GREY: f32 = 0.18;

/// Stops below and above middle grey that the curve spans.
const STOPS: [f32; 2] = [10.0, 6.5];

/// AgX (Troy Sobotka, github.com/sobotka/AgX), by its definition in place of its lookup tables: bright colours tend to
/// white as on film. After the curve the inset of the primaries is undone, as in "Minimal AgX Implementation" (Benjamin
/// Wrensch).
fn agx(light: Rgb) -> Rgb {
    let grey = |c: Rgb| SHARES.r * c.r + SHARES.g * c.g + SHARES.b * c.b;
    // Primaries inset by a factor: each colour is mixed with the grey of the same X + Y + Z.
    let white = INSET * grey(light);
    let inset = light.map(|x| (1.0 - INSET) * x + white);
    let code = inset.map(|x| {
        let stops = (x.max(f32::MIN_POSITIVE) / MIDDLE_GREY).log2();
        sigmoid(((stops + STOPS[0]) / (STOPS[0] + STOPS[1])).clamp(0.0, 1.0))
    });
    let white = INSET * grey(code);
    code.map(|x| ((x - white) / (1.0 - INSET)).clamp(0.0, 1.0))
}

/// The curve of AgX from and to `[0, 1]`: through (0, 0), (1, 1), and a half at middle grey with a slope of 2; from
/// there a toe of power 3 and a shoulder of power 3.25, each `t / (1 + t^p)^(1/p)` with `t` scaled so that the end is
/// met (the tunable sigmoid of Jed Smith).
fn sigmoid(x: f32) -> f32 {
    const PIVOT: [f32; 2] = [STOPS[0] / (STOPS[0] + STOPS[1]), 0.5];
    const SLOPE: f32 = 2.0;
    let (reach, power) = if x < PIVOT[0] { (PIVOT[0], 3.0) } else { (1.0 - PIVOT[0], 3.25) };
    let end = (SLOPE * reach / 0.5).powf(power) - 1.0;
    let bend = 1.0 + end * ((x - PIVOT[0]).abs() / reach).powf(power);
    PIVOT[1] + SLOPE * (x - PIVOT[0]) / bend.powf(1.0 / power)
}

/// The curve of Uncharted 2 ("Filmic Tonemapping Operators", John Hable 2010) with its exposure of 2 and 11.2 as white,
/// from light to `[0, 1]`.
fn filmic(light: f32) -> f32 {
    const WHITE: f32 = 11.2;
    // Shoulder strength, linear strength, linear angle, toe strength, toe numerator, toe denominator.
    let [a, b, c, d, e, f] = [0.15, 0.5, 0.1, 0.2, 0.02, 0.3];
    // The quotient less its value at 0, on one fraction so that nothing cancels.
    let curve = |x: f32| x * (a * (f - e) * x + b * (c * f - e)) / (f * ((a * x + b) * x + d * f));
    curve((2.0 * light.max(0.0)).min(WHITE)) / curve(WHITE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWS: [ViewDesc; 3] = [ViewDesc::Agx, ViewDesc::Filmic, ViewDesc::Srgb];

    fn close(a: f32, b: f32) -> bool {
        (a - b).abs() < 2e-5
    }

    #[test]
    fn agx_is_the_published_curve_and_matrix() {
        // Middle grey is a half; the ends are 10 stops below and 6.5 above it.
        for (stops, code) in [(0.0, 0.5), (-10.0, 0.0), (-20.0, 0.0), (6.5, 1.0), (9.0, 1.0)] {
            let grey = agx(Rgb::splat(0.18 * f32::exp2(stops)));
            assert!(close(grey.r, code) && close(grey.g, code) && close(grey.b, code), "{stops}: {grey:?}");
        }
        // One stop up at the pivot: a slope of 2 per 16.5 stops, bent by the shoulder as in the closed form with its
        // published constant.
        let x: f32 = 1.0 / 16.5;
        let expected = 0.5 + 2.0 * x / (1.0 + 69.862_79 * x.powf(3.25)).powf(1.0 / 3.25);
        assert!(close(agx(Rgb::splat(0.36)).g, expected));
        let toe = 0.5 - 2.0 * x / (1.0 + 59.507_875 * x.powi(3)).powf(1.0 / 3.0);
        assert!(close(agx(Rgb::splat(0.09)).g, toe));
        // Red of 0.18 by the matrices as they are published, rounded to four digits.
        let inset = [0.8424, 0.0424, 0.0424].map(|m: f32| sigmoid(((0.18 * m / 0.18).log2() + 10.0) / 16.5));
        let outset = [[1.197, -0.098, -0.099], [-0.053, 1.152, -0.099], [-0.053, -0.098, 1.151]];
        let expected = outset.map(|row: [f32; 3]| (0..3).map(|i| row[i] * inset[i]).sum::<f32>());
        let found = agx(Rgb::new(0.18, 0.0, 0.0)).to_array();
        assert!((0..3).all(|i| (found[i] - expected[i].clamp(0.0, 1.0)).abs() < 1e-3), "{found:?} {expected:?}");
    }

    #[test]
    fn filmic_is_hables_curve() {
        let hable = |x: f64| (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
        for light in [0.0f32, 0.01, 0.18, 1.0, 3.0, 5.6] {
            let expected = hable(2.0 * f64::from(light)) / hable(11.2);
            assert!((f64::from(filmic(light)) - expected).abs() < 1e-6, "{light}");
        }
    }

    #[test]
    fn every_view_is_monotone_in_range_and_keeps_greys_grey() {
        for view in VIEWS {
            let mut last = [0.0; 3];
            for i in 0..4000 {
                let light = (-30.0 + 0.015 * i as f32).exp2();
                let grey = code_values(view, Rgb::splat(light)).to_array();
                assert!(close(grey[0], grey[1]) && close(grey[1], grey[2]), "{view:?} {light}: {grey:?}");
                assert!(
                    (0..3).all(|c| grey[c] >= last[c] - 1e-6 && (0.0..=1.0).contains(&grey[c])),
                    "{view:?} {light}"
                );
                last = grey;
            }
            for light in [
                Rgb::new(-1.0, 2.0, 0.0),
                Rgb::new(f32::MAX, 0.0, 1.0),
                Rgb::splat(f32::INFINITY),
                Rgb::splat(-f32::INFINITY),
            ] {
                let code = code_values(view, light).to_array();
                assert!(code.iter().all(|c| (0.0..=1.0).contains(c)), "{view:?} {light:?}: {code:?}");
            }
        }
    }

    #[test]
    fn bright_colours_tend_to_white_in_agx_alone() {
        let blue = Rgb::new(0.2, 0.4, 40.0);
        assert!(code_values(ViewDesc::Agx, blue).r > 0.5);
        assert!(code_values(ViewDesc::Srgb, blue).r < 0.5 && code_values(ViewDesc::Filmic, blue).r < 0.7);
    }
}
