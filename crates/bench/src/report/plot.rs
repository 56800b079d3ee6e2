//! Plots as SVG.

use plotters::coord::CoordTranslate;
use plotters::prelude::*;

use crate::accel::AccelKind;
use steradian::{Error, Result};

const SIZE: (u32, u32) = (960, 420);

/// Colours that stay apart for colour-blind readers (Okabe and Ito, "Color Universal Design").
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(148, 103, 30),
];

/// Values by group, with the lowest and highest of each as a whisker.
pub struct Series {
    pub name: String,
    /// Median, lowest, highest for each group.
    pub values: Vec<Option<[f64; 3]>>,
}

/// A curve on logarithmic axes.
pub struct Curve {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

fn failed(error: impl std::fmt::Display) -> Error {
    Error::Internal(format!("a plot cannot be drawn: {error}"))
}

/// Bars side by side in groups.
pub fn bars(groups: &[&str], series: &[Series], unit: &str) -> Result<String> {
    bars_over(groups, series, unit, |v| v)
}

/// The same for positive values on a logarithmic axis, with bars from 1.
pub fn log_bars(groups: &[&str], series: &[Series], unit: &str) -> Result<String> {
    let log = |s: &Series| {
        let values = s.values.iter().map(|value| value.map(|v| v.map(f64::log10))).collect();
        Series { name: s.name.clone(), values }
    };
    bars_over(groups, &series.iter().map(log).collect::<Vec<_>>(), unit, |v| 10f64.powf(v))
}

/// The name of the group in whose middle `x` is; nothing beside the middles.
fn group_at(groups: &[&str], x: f64) -> String {
    let is_middle = (x - x.round()).abs() < 1e-6 && x > -0.25;
    let name = if is_middle { groups.get(x.round() as usize) } else { None };
    name.map_or(String::new(), |name| (*name).to_owned())
}

/// Bars whose axis is labelled by a function of their values.
fn bars_over(groups: &[&str], series: &[Series], unit: &str, label: fn(f64) -> f64) -> Result<String> {
    let ends = || series.iter().flat_map(|s| s.values.iter().flatten());
    let top = ends().map(|v| v[2]).fold(0.0, f64::max).max(1e-9) * 1.05;
    let bottom = ends().map(|v| v[1]).fold(0.0, f64::min) * 1.05;
    let last = groups.len() as f64 - 0.5;
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .margin_right(20)
            .x_label_area_size(34)
            .y_label_area_size(64)
            .build_cartesian_2d(-0.5..last, bottom..top)
            .map_err(failed)?;
        let labels = 2 * groups.len() + 1;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(labels)
            .x_label_formatter(&|x| group_at(groups, *x))
            .y_label_formatter(&|y| short(label(*y)))
            .y_desc(unit)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 14))
            .draw()
            .map_err(failed)?;
        let width = 0.84 / series.len().max(1) as f64;
        for (i, s) in series.iter().enumerate() {
            let color = color(&s.name, i);
            let left = |group: usize| group as f64 - 0.42 + width * i as f64;
            let present = || s.values.iter().enumerate().filter_map(|(group, value)| value.map(|v| (left(group), v)));
            chart
                .draw_series(
                    present().map(|(x, v)| {
                        Rectangle::new([(x + 0.06 * width, 0.0), (x + 0.94 * width, v[0])], color.filled())
                    }),
                )
                .map_err(failed)?
                .label(&s.name)
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], color.filled()));
            chart
                .draw_series(present().map(|(x, v)| {
                    let middle = x + 0.5 * width;
                    PathElement::new(vec![(middle, v[1]), (middle, v[2])], BLACK.stroke_width(1))
                }))
                .map_err(failed)?;
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)?;
        root.present().map_err(failed)?;
    }
    Ok(svg)
}

/// The colour of an accelerator in every plot, paler for its batches, if `name` begins with one; of the `nth` curve
/// otherwise.
fn color(name: &str, nth: usize) -> RGBAColor {
    let accel = name.split([',', ' ']).next().unwrap_or(name);
    let index = AccelKind::CHOICES.iter().position(|(choice, _)| *choice == accel).unwrap_or(nth);
    let strength = if name.contains("coherent") { 0.35 } else { if name.contains("batches") { 0.65 } else { 1.0 } };
    COLORS[index % COLORS.len()].mix(strength)
}

/// Curves on logarithmic axes, with dots at the points if there are few.
pub fn curves(curves: &[Curve], x_label: &str, y_label: &str, marks: &[(f64, f64)]) -> Result<String> {
    let all = || curves.iter().flat_map(|c| &c.points);
    let range = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) =
            all().map(of).filter(|v| *v > 0.0).fold((f64::INFINITY, 0.0), |(low, high), v| (v.min(low), v.max(high)));
        if low < high { labelled(low * 0.9, high * 1.1) } else { 0.1..10.0 }
    };
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .margin_right(28)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d(range(|p| p.0).log_scale(), range(|p| p.1).log_scale())
            .map_err(failed)?;
        chart
            .configure_mesh()
            .light_line_style(RGBColor(235, 235, 235))
            .x_desc(x_label)
            .y_desc(y_label)
            .x_label_formatter(&|x| short(*x))
            .y_label_formatter(&|y| short(*y))
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 14))
            .draw()
            .map_err(failed)?;
        for (i, curve) in curves.iter().enumerate() {
            let color = color(&curve.name, i);
            chart
                .draw_series(LineSeries::new(curve.points.iter().copied(), color.stroke_width(2)))
                .map_err(failed)?
                .label(&curve.name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(3)));
            if curve.points.len() <= 12 {
                chart.draw_series(curve.points.iter().map(|p| Circle::new(*p, 3, color.filled()))).map_err(failed)?;
            }
        }
        chart.draw_series(marks.iter().map(|p| Circle::new(*p, 5, BLACK.stroke_width(2)))).map_err(failed)?;
        let falling = |c: &&Curve| c.points.first().zip(c.points.last()).is_some_and(|(first, last)| first.1 > last.1);
        let free = if 2 * curves.iter().filter(falling).count() > curves.len() {
            SeriesLabelPosition::UpperRight
        } else {
            SeriesLabelPosition::UpperLeft
        };
        legend(&mut chart, free)?;
        root.present().map_err(failed)?;
    }
    Ok(svg)
}

/// A range, widened to powers of ten if fewer than two of them lie in it: short logarithmic axes have no other labels.
fn labelled(low: f64, high: f64) -> std::ops::Range<f64> {
    if high.log10().floor() - low.log10().ceil() >= 1.0 {
        return low..high;
    }
    10f64.powf(low.log10().floor())..10f64.powf(high.log10().ceil())
}

fn legend<'a, CT>(chart: &mut ChartContext<'a, SVGBackend<'a>, CT>, position: SeriesLabelPosition) -> Result<()>
where
    CT: CoordTranslate,
{
    chart
        .configure_series_labels()
        .position(position)
        .margin(8)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 14))
        .draw()
        .map_err(failed)
}

/// A number in few characters: `1000000` is `1e6`.
fn short(value: f64) -> String {
    if (0.01..10_000.0).contains(&value) {
        let text = format!("{value:.3}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.0e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_axes_reach_from_power_to_power_of_ten() {
        assert_eq!((labelled(0.9, 300.0), labelled(1.8, 7.3), labelled(0.02, 0.2)), (0.9..300.0, 1.0..10.0, 0.01..1.0));
    }
}
