//! Plots as SVG, with names beside the data and in the page's colours: lines over logarithmic axes, and rows of dots
//! with whiskers.

use svg::Document;
use svg::node::element::{Circle, Group, Line, Polyline, Text, Title};

use crate::color::{Rgb, srgb_from_linear};
use crate::printable;

/// Units of the drawing; text has a height of 13.
const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 340.0;

/// Between two lines of text.
const LINE: f64 = 15.0;

/// Mean width of a character.
const CHARACTER: f64 = 7.0;
/// Of bold ones.
const BOLD: f64 = 7.8;

/// Characters of a line of a name at the end of a curve.
const NAME: usize = 22;

/// Characters of the name of a row.
const NAMES: usize = 34;

/// Colours of the first series: apart for colour-blind readers, and at least 3 : 1 in contrast with both papers.
const COLORS: [[u8; 3]; 8] = [
    [30, 120, 220],
    [213, 94, 0],
    [0, 148, 108],
    [204, 84, 150],
    [165, 117, 0],
    [125, 125, 125],
    [140, 100, 220],
    [0, 145, 172],
];

/// A line on logarithmic axes.
pub struct Curve {
    pub name: String,
    /// Place, and median with the ends of the whisker.
    pub points: Vec<(f64, [f64; 3])>,
}

impl Curve {
    /// Without whiskers.
    pub fn new(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), points: points.into_iter().map(|(x, y)| (x, [y; 3])).collect() }
    }
}

/// Lines with the labels of the axes, and circles at special places. Only positive values are drawn.
pub struct Curves {
    pub x: String,
    pub y: String,
    pub curves: Vec<Curve>,
    pub marks: Vec<(f64, f64)>,
}

/// The name of a row, and its value with the ends of its whisker.
pub type DotRow = (String, [f64; 3]);

/// Values by group and row.
pub struct Dots {
    pub unit: String,
    pub groups: Vec<(String, Vec<DotRow>)>,
    /// A value of interest.
    pub mark: Option<f64>,
}

/// The colour of the `nth` series.
fn color(nth: usize) -> String {
    let [r, g, b] = COLORS.get(nth).copied().unwrap_or_else(|| {
        // Hues apart by the golden ratio, in turn lighter and darker, as saturated as their luminance permits.
        let hue = (nth as f32 * 0.618_034).fract() * 6.0;
        let pure = [5.0, 3.0, 1.0].map(|k| {
            let x = (k + hue) % 6.0;
            1.0 - x.min(4.0 - x).clamp(0.0, 1.0)
        });
        let level = if nth.is_multiple_of(2) { 0.26 } else { 0.16 };
        let away = pure.map(|c| c - Rgb::from(pure).luminance());
        let room = away.map(|d| if d > 0.0 { (1.0 - level) / d } else { -level / d });
        let saturation = room.into_iter().fold(1.0, f32::min);
        away.map(|d| (255.0 * srgb_from_linear(level + saturation * d).clamp(0.0, 1.0)) as u8)
    });
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Values to places from 0 to 1.
struct Axis {
    is_log: bool,
    low: f64,
    high: f64,
}

impl Axis {
    /// Over all values, with a little room at the ends.
    fn over(values: impl Iterator<Item = f64>, is_log: bool) -> Self {
        let usable = values.filter(|v| v.is_finite() && (!is_log || *v > 0.0));
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (v.min(a), v.max(b)));
        let (low, high) = if low <= high { (low, high) } else { (1.0, 1.0) };
        if is_log {
            let room = (high / low).powf(0.04).max(1.05);
            Self { is_log, low: low / room, high: high * room }
        } else {
            let room = (0.04 * (high - low)).max(0.01 * high.abs()).max(1e-9);
            Self { is_log, low: low - room, high: high + room }
        }
    }

    /// Logarithmic if the values, all above 0, span a decade.
    fn fitting(values: &[f64]) -> Self {
        let (low, high) = values.iter().fold((f64::INFINITY, 0.0f64), |(a, b), v| (v.min(a), v.max(b)));
        Self::over(values.iter().copied(), low > 0.0 && high > 10.0 * low)
    }

    /// A value with as many digits as the axis shows differences.
    fn number(&self, value: f64) -> String {
        if self.is_log {
            return super::number(value);
        }
        let digits = (2.0 - (self.high - self.low).log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.digits$}")
    }

    /// Where a value is; beyond the ends, the end.
    fn at(&self, value: f64) -> f64 {
        let place = if self.is_log {
            (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        place.clamp(0.0, 1.0)
    }

    /// Round values for lines and labels, at most about `most`.
    fn ticks(&self, most: usize) -> Vec<f64> {
        let inside = |v: &f64| (self.low..=self.high).contains(v);
        if self.is_log {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            let of = |digits: &'static [f64]| -> Vec<f64> {
                let all = decades.clone().flat_map(|power| digits.iter().map(move |digit| digit * 10f64.powi(power)));
                all.filter(inside).collect()
            };
            if let Some(fit) = [&[1.0, 2.0, 5.0][..], &[1.0, 3.0], &[1.0]]
                .map(of)
                .into_iter()
                .find(|ticks| (3..=most).contains(&ticks.len()))
            {
                return fit;
            }
            let powers = of(&[1.0]);
            if powers.len() > most {
                return powers.iter().copied().step_by(powers.len().div_ceil(most)).collect();
            }
        }
        let step = round_step((self.high - self.low) / most.min(6) as f64);
        let first = (self.low / step).ceil() as i64;
        (first..).map(|i| i as f64 * step).take_while(|v| *v <= self.high).collect()
    }
}

/// The next of 1, 2 and 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|round| *round >= 0.999 * step).unwrap_or(10.0 * power)
}

/// A label of an axis: `1000000` is `1e6`.
fn short(value: f64) -> String {
    if value != 0.0 && !(0.01..10_000.0).contains(&value.abs()) {
        return format!("{:e}", (value * 1e12).round() / 1e12).replace(".0e", "e");
    }
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A name in lines of about [`NAME`] characters, three at most; what is in parentheses is in a line of its own.
fn wrap(name: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in printable::line(name).split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < NAME && !word.starts_with('(') => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(cut(word, NAME)),
        }
    }
    lines.truncate(3);
    lines
}

/// At most this many characters.
fn cut(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars().take(most - 1).chain(['…']).collect()
}

/// Of the bold lines of a name.
fn width(lines: &[String]) -> f64 {
    lines.iter().map(|line| line.chars().count()).max().unwrap_or(0) as f64 * BOLD
}

fn text(content: &str, [x, y]: [f64; 2], anchor: &str, class: &str) -> Text {
    let text = Text::new(printable::line(content)).set("x", round(x)).set("y", round(y)).set("text-anchor", anchor);
    text.set("class", class)
}

fn line([x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) -> Line {
    Line::new().set("x1", round(x1)).set("y1", round(y1)).set("x2", round(x2)).set("y2", round(y2)).set("class", class)
}

fn circle([x, y]: [f64; 2], radius: f64) -> Circle {
    Circle::new().set("cx", round(x)).set("cy", round(y)).set("r", radius)
}

/// To a tenth of a unit.
fn round(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}

fn document(height: f64, label: &str) -> Document {
    Document::new()
        .set("viewBox", format!("0 0 {WIDTH} {height}"))
        .set("role", "img")
        .set("aria-label", printable::line(label))
}

/// Lines, each with its name at its end.
pub fn curves(figure: &Curves) -> String {
    let points = || figure.curves.iter().flat_map(|curve| &curve.points).filter(|(x, y)| *x > 0.0 && y[0] > 0.0);
    let x_axis = Axis::over(points().map(|p| p.0), true);
    let y_axis = Axis::over(points().flat_map(|p| p.1), true);
    let names: Vec<Vec<String>> = figure.curves.iter().map(|curve| wrap(&curve.name)).collect();
    let right = WIDTH - 22.0 - names.iter().map(|name| width(name)).fold(0.0, f64::max);
    let [left, top, bottom] = [52.0, 26.0, HEIGHT - 42.0];
    let x_at = |v: f64| left + x_axis.at(v) * (right - left);
    let y_at = |v: f64| bottom - y_axis.at(v) * (bottom - top);
    let mut svg = document(HEIGHT, &format!("{} over {}", figure.y, figure.x));
    for tick in x_axis.ticks(((right - left) / 48.0) as usize) {
        let x = x_at(tick);
        svg = svg.add(line([x, top], [x, bottom], "grid"));
        svg = svg.add(text(&short(tick), [x, bottom + 17.0], "middle", "soft"));
    }
    for tick in y_axis.ticks(9) {
        let y = y_at(tick);
        svg = svg.add(line([left, y], [right, y], "grid"));
        svg = svg.add(text(&short(tick), [left - 6.0, y + 4.5], "end", "soft"));
    }
    svg = svg.add(line([left, bottom], [right, bottom], "axis")).add(text(&figure.y, [4.0, 14.0], "start", "soft"));
    svg = svg.add(text(&figure.x, [0.5 * (left + right), HEIGHT - 6.0], "middle", "soft"));
    let mut ends = Vec::new();
    for (i, curve) in figure.curves.iter().enumerate() {
        let usable: Vec<_> = curve.points.iter().filter(|(x, y)| *x > 0.0 && y[0] > 0.0).collect();
        let color = color(i);
        let mut group = Group::new().set("stroke", color.as_str()).add(Title::new(printable::line(&curve.name)));
        let places: Vec<String> =
            usable.iter().map(|(x, y)| format!("{},{}", round(x_at(*x)), round(y_at(y[0])))).collect();
        let path = Polyline::new().set("points", places.join(" ")).set("fill", "none").set("stroke-width", 2);
        group = group.add(path);
        for (x, [y, low, high]) in usable.iter().filter(|_| usable.len() <= 16) {
            let x = x_at(*x);
            if low < high {
                group = group.add(line([x, y_at(*low)], [x, y_at(*high)], "whisker"));
            }
            group = group.add(circle([x, y_at(*y)], 3.0).set("fill", color.as_str()));
        }
        svg = svg.add(group);
        ends.extend(usable.last().map(|(x, y)| (i, [x_at(*x), y_at(y[0])])));
    }
    for (x, y) in &figure.marks {
        svg = svg.add(circle([x_at(*x), y_at(*y)], 4.5).set("class", "mark"));
    }
    let heights: Vec<f64> = ends.iter().map(|(i, _)| LINE * names[*i].len() as f64).collect();
    let wanted: Vec<f64> = ends.iter().map(|(_, [_, y])| *y).collect();
    for (((i, end), height), y) in ends.iter().zip(&heights).zip(spread(&wanted, &heights, [4.0, HEIGHT - 4.0])) {
        let color = color(*i);
        svg = svg.add(line(*end, [right + 5.0, y], "leader").set("stroke", color.as_str()));
        for (k, part) in names[*i].iter().enumerate() {
            let baseline = y - 0.5 * height + LINE * (k as f64 + 0.8);
            let label = text(part, [right + 9.0, baseline], "start", "series");
            svg = svg.add(label.set("style", format!("fill:{color}")));
        }
    }
    svg.to_string()
}

/// Middles of labels of these heights, near the places wanted and clear of one another.
fn spread(wanted: &[f64], heights: &[f64], [top, bottom]: [f64; 2]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    let mut places = wanted.to_vec();
    let mut free = top;
    for &i in &order {
        places[i] = places[i].max(free + 0.5 * heights[i]);
        free = places[i] + 0.5 * heights[i];
    }
    free = bottom;
    for &i in order.iter().rev() {
        places[i] = places[i].min(free - 0.5 * heights[i]);
        free = places[i] - 0.5 * heights[i];
    }
    places
}

/// Rows of dots with whiskers, below the names of their groups; a name has the same colour in every group.
pub fn dots(figure: &Dots) -> String {
    let rows = || figure.groups.iter().flat_map(|(_, rows)| rows);
    let values: Vec<f64> = rows().flat_map(|(_, value)| *value).chain(figure.mark).collect();
    let axis = Axis::fitting(&values);
    let mut names: Vec<&str> = Vec::new();
    rows().for_each(|(name, _)| {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    });
    // What is a way of using another, "embree, batches", has a colour after those of all others, which curves share.
    names.sort_by_key(|name| name.contains(", "));
    let groups = figure.groups.iter().map(|(name, _)| name.as_str());
    let longest =
        names.iter().copied().chain(groups).map(|name| name.chars().count().min(NAMES)).max().unwrap_or(0) as f64;
    let [left, right, top] = [16.0 + longest * CHARACTER, WIDTH - 62.0, 22.0];
    let step = 19.0;
    let lines = rows().count() + figure.groups.len();
    let bottom = top + step * lines as f64 + 4.0;
    let x_at = |v: f64| left + axis.at(v) * (right - left);
    let mut svg = document(bottom + 26.0, &figure.unit);
    for tick in axis.ticks(((right - left) / 52.0) as usize) {
        let x = x_at(tick);
        svg = svg.add(line([x, top], [x, bottom], "grid"));
        svg = svg.add(text(&short(tick), [x, bottom + 17.0], "middle", "soft"));
    }
    if let Some(mark) = figure.mark {
        svg = svg.add(line([x_at(mark), top], [x_at(mark), bottom], "mark"));
    }
    svg = svg.add(text(&figure.unit, [WIDTH - 4.0, 14.0], "end", "soft"));
    let mut y = top;
    for (name, rows) in &figure.groups {
        y += step;
        svg = svg.add(text(name, [4.0, y - 5.0], "start", "group"));
        for (name, [value, low, high]) in rows {
            y += step;
            let color = color(names.iter().position(|known| known == name).unwrap_or(0));
            let middle = y - 0.5 * step;
            let described = format!("{name}: {}", super::range([*value, *low, *high]));
            let row = Group::new()
                .set("stroke", color.as_str())
                .set("stroke-width", 2)
                .add(Title::new(printable::line(&described)))
                .add(line([x_at(*low), middle], [x_at(*high), middle], "whisker"))
                .add(circle([x_at(*value), middle], 4.0).set("fill", color.as_str()));
            svg = svg.add(row).add(text(&cut(name, NAMES), [left - 8.0, y - 5.0], "end", "row"));
            svg = svg.add(text(&axis.number(*value), [right + 8.0, y - 5.0], "start", "row"));
        }
    }
    svg.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let ticks = |low: f64, high: f64| Axis { is_log: true, low, high }.ticks(8);
        assert_eq!(ticks(0.9, 12.0), [1.0, 2.0, 5.0, 10.0]);
        assert_eq!(ticks(0.9, 1200.0), [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0]);
        assert_eq!(ticks(1e-12, 1e12).len(), 7);
        assert_eq!(ticks(2.1, 3.05).len(), 5);
        let linear = Axis::fitting(&[0.98, 1.02]);
        let shown: Vec<String> = linear.ticks(8).into_iter().map(short).collect();
        assert_eq!((linear.is_log, &shown[0][..], linear.at(1.0)), (false, "0.98", 0.5));
        assert_eq!((&linear.number(0.999)[..], &Axis::fitting(&[1.0, 20.0]).number(9.31)[..]), ("0.9990", "9.31"));
        assert_eq!([short(1e6), short(2e-5), short(0.5), short(300.0)], ["1e6", "2e-5", "0.5", "300"]);
    }

    #[test]
    fn labels_are_clear_of_one_another() {
        let places = spread(&[100.0, 100.0, 98.0, 300.0], &[15.0, 30.0, 15.0, 15.0], [0.0, 310.0]);
        assert_eq!(places, [113.0, 135.5, 98.0, 300.0]);
        assert_eq!(spread(&[50.0, 50.0], &[15.0; 2], [0.0, 50.0]), [27.5, 42.5]);
        assert_eq!(wrap("independent, light sampling, guided")[..], ["independent, light", "sampling, guided"]);
        assert_eq!(wrap("sobol (slope -1.20)")[..], ["sobol", "(slope -1.20)"]);
    }

    /// Contrast as the Web Content Accessibility Guidelines define it.
    #[test]
    fn colours_are_different_and_seen_on_light_and_dark_paper() {
        let channel = |text: &str| f64::from(u8::from_str_radix(text, 16).unwrap()) / 255.0;
        let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        let luminance = |color: &str| {
            let [r, g, b] = [1, 3, 5].map(|i| linear(channel(&color[i..i + 2])));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let colors: Vec<String> = (0..24).map(color).collect();
        for (i, color) in colors.iter().enumerate() {
            assert!(!colors[..i].contains(color), "{color}");
            let contrasts = ["#ffffff", "#16181d"].map(|paper| {
                let [a, b] = [luminance(paper), luminance(color)].map(|l| l + 0.05);
                (a / b).max(b / a)
            });
            assert!(contrasts.iter().all(|c| *c >= 3.0), "{color}: {contrasts:?}");
        }
    }
}
