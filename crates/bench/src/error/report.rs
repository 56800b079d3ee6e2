//! The report of `bench error`.

use super::{EqualError, ErrorReport, Point, TaxReport};
use crate::report::{
    Curve, Curves, Dots, Drawing, Figure, Page, Report, Section, Table, interrupted, number, or_dash, range,
};

impl Report for ErrorReport {
    const NAME: &'static str = "error";

    fn page(&self) -> Page {
        let mut page = Page::new(format!("Error against time: {}", self.scene), &self.machine, &self.spent);
        page.verdict = self.verdict();
        page.warnings.extend(interrupted(self.interrupted));
        page.facts.push(("Command", format!("`{}`", self.command)));
        page.facts.push(("Repeats", format!("{} in turn", self.repeats)));
        page.notes = self.notes();
        page.sections = vec![self.convergence(), self.budgets()];
        page.sections.extend(self.tax.as_ref().map(of_tax));
        if self.pictures.small.len() > 1 {
            let caption = "The pictures of the first repeat with the largest budget, and how much they seem to differ \
                           from the reference (FLIP): black not at all, white 1.";
            let drawing = Drawing::Pictures(self.pictures.small.clone());
            let figures = vec![Figure { caption: caption.to_owned(), drawing }];
            page.sections.push(Section { title: "Pictures".to_owned(), figures, ..Section::default() });
        }
        page.viewer = self.pictures.viewer(self);
        page
    }

    /// One line a render.
    fn sheet(&self) -> Option<Table> {
        let mut sheet = Table::new(
            "",
            "scene | variant | budget | repeat | seed | spp | seconds | process_seconds | processor_seconds | relmse \
             | relmse_trimmed | mse | flip | mean_ratio_r | mean_ratio_g | mean_ratio_b | not_finite | \
             msamples_per_second | mrays_per_second | efficiency",
        );
        let optional = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        for variant in &self.variants {
            for (point, run) in variant.points.iter().flat_map(|point| point.runs.iter().map(move |run| (point, run))) {
                let [r, g, b] = run.mean_ratio;
                sheet.rows.push(vec![
                    self.scene.clone(),
                    variant.name.clone(),
                    point.budget.to_string(),
                    run.repeat.to_string(),
                    run.seed.to_string(),
                    run.spp.map_or(String::new(), |spp| spp.to_string()),
                    run.seconds.to_string(),
                    optional(run.process_seconds),
                    run.processor_seconds.to_string(),
                    run.relmse.to_string(),
                    run.relmse_trimmed.to_string(),
                    run.mse.to_string(),
                    optional(run.flip),
                    r.to_string(),
                    g.to_string(),
                    b.to_string(),
                    run.not_finite.to_string(),
                    optional(run.msamples_per_second),
                    optional(run.mrays_per_second),
                    optional(run.efficiency),
                ]);
            }
        }
        Some(sheet)
    }
}

/// How many times as fast, with the range of the repeats.
fn times([median, low, high]: [f64; 3]) -> String {
    if low == high { format!("{median:.2}x") } else { format!("{median:.2}x ({low:.2}x to {high:.2}x)") }
}

impl ErrorReport {
    /// Every point that has been measured, with its variant's name.
    fn measured(&self) -> impl Iterator<Item = (&str, &Point)> {
        let points = self.variants.iter().flat_map(|v| v.points.iter().map(|point| (v.name.as_str(), point)));
        points.filter(|(_, point)| !point.runs.is_empty())
    }

    fn verdict(&self) -> String {
        let Some(first) = self.variants.first().filter(|_| self.runs() > 0) else {
            return "Nothing was measured.".to_owned();
        };
        let mut parts = Vec::new();
        for (i, variant) in self.variants.iter().enumerate().skip(1) {
            // By processor time: other work on the machine changes it little.
            let Some(ratio) = self.equal_error.as_ref().and_then(|equal| equal.times_as_fast_by_processor[i]) else {
                continue;
            };
            let (name, first) = (&variant.name, &first.name);
            parts.push(if ratio[1] < 1.0 && ratio[2] > 1.0 {
                format!(
                    "{name}: {} as fast as {first} to equal error by processor time: no difference beyond spread",
                    times(ratio)
                )
            } else {
                format!("{name}: {} as fast as {first} to equal error by processor time", times(ratio))
            });
        }
        if parts.is_empty()
            && let Some((name, point)) = self.measured().last()
        {
            parts.push(format!("{name}: relMSE {} with {}", range(point.relmse), point.budget));
        }
        let biased: Vec<String> = self
            .measured()
            .filter_map(|(name, point)| {
                let bias = point.bias.filter(super::Bias::is_found)?;
                Some(format!("{name}, {} ({:.4} times as bright as the reference)", point.budget, bias.ratio))
            })
            .collect();
        parts.push(match &biased[..] {
            [] => "no bias found".to_owned(),
            [one] => format!("bias found in {one}"),
            [first, ..] => {
                format!("bias found in {} of {} points, such as {first}", biased.len(), self.measured().count())
            }
        });
        format!("{}.", parts.join(", "))
    }

    /// What the columns mean.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let reference = &self.reference;
        notes.push(match (&reference.file, reference.noise_relmse) {
            (Some(file), _) => format!("Reference: {file}. Its own noise is part of every error."),
            (None, Some(noise)) => {
                let spp = reference.halves_spp.map_or(String::new(), |spp| format!(" of {spp} spp each"));
                format!(
                    "No reference was given: the mean of two independent renders{spp} by the first variant is used. \
                     A render like one of them has relMSE {} (half of their squared difference); a quarter, {}, is \
                     their mean's, and is subtracted from every error. A bias that all renders share cannot be seen.",
                    number(2.0 * noise),
                    number(noise)
                )
            }
            (None, None) => "Interrupted before there was a reference.".to_owned(),
        });
        let intervals = self.measured().filter(|(_, point)| point.bias.is_some()).count();
        notes.push(
            "relMSE: mean of (test - reference)² / (reference² + 0.01) over pixels and channels; trimmed: without the \
             worst thousandth of the pixels. FLIP: mean of HDR-FLIP, first repeat. Efficiency: 1 / (relMSE seconds). \
             Values are medians of the repeats (lowest to highest), whiskers go from the lowest to the highest."
                .to_owned(),
        );
        notes.push(format!(
            "Mean ratio: luminance of all repeats over the reference's, with a confidence interval from the \
             differences of blocks of 8 x 8 pixels. The {intervals} intervals hold together with 95 % (Bonferroni): a \
             bias is found where an interval leaves out 1. It may also be the reference's, or that of a few very \
             bright pixels."
        ));
        if self.variants.iter().any(|variant| variant.external) {
            let text = "Other programs: seconds and processor seconds that they report of themselves on standard \
                        output, else those of their whole process.";
            notes.push(text.to_owned());
        }
        notes
    }

    /// Plots of the error, and the times to equal error.
    fn convergence(&self) -> Section {
        let figure =
            |x: &str, caption: &str, at: fn(&Point) -> Option<f64>, slope: fn(&super::VariantReport) -> Option<f64>| {
                let curve = |variant: &super::VariantReport| {
                    let slope = slope(variant).map_or(String::new(), |slope| format!(" (slope {slope:.2})"));
                    let points = variant.points.iter().filter(|point| !point.runs.is_empty());
                    let points = points.filter_map(|point| Some((at(point)?, point.relmse))).collect();
                    Curve { name: format!("{}{slope}", variant.name), points }
                };
                let curves: Vec<Curve> = self.variants.iter().map(curve).filter(|c| !c.points.is_empty()).collect();
                let drawing = Curves { x: x.to_owned(), y: "relMSE".to_owned(), curves, marks: Vec::new() };
                Figure { caption: caption.to_owned(), drawing: Drawing::Curves(drawing) }
            };
        let mut section = Section { title: "Convergence".to_owned(), ..Section::default() };
        if self.runs() > 0 {
            let by_time = "Error against time; the further left and down the better.";
            let by_spp = "Error against samples: what sampling alone does.";
            section.figures.push(figure("seconds", by_time, |point| Some(point.seconds[0]), |v| v.slope_of_time));
            section.figures.push(figure("samples per pixel", by_spp, |point| point.spp, |v| v.slope_of_spp));
        }
        if self.variants.iter().any(|variant| variant.slope_of_time.is_some()) || self.equal_error.is_some() {
            section.tables.push(self.slopes());
        }
        section
    }

    fn slopes(&self) -> Table {
        let equal = self.equal_error.as_ref();
        let mut table = Table::new(
            "Least squares of the logarithms; -1: independent samples",
            "variant | slope of relMSE over time | slope over spp | s to equal relMSE | against the first | processor \
             s | against the first by processor s",
        );
        if let Some(equal) = equal {
            table.heads[3] = format!("s to relMSE {}", number(equal.relmse));
        }
        for (i, variant) in self.variants.iter().enumerate() {
            let slope = |slope: Option<f64>| or_dash(slope.map(|slope| format!("{slope:.2}")));
            let seconds = |all: fn(&EqualError) -> &[Option<f64>]| or_dash(equal.and_then(|e| all(e)[i]).map(number));
            let ratio = |all: fn(&EqualError) -> &[Option<[f64; 3]>]| {
                or_dash(equal.and_then(|e| all(e)[i]).map(|ratio| format!("{} as fast", times(ratio))))
            };
            table.rows.push(vec![
                variant.name.clone(),
                slope(variant.slope_of_time),
                slope(variant.slope_of_spp),
                seconds(|equal| &equal.seconds),
                ratio(|equal| &equal.times_as_fast),
                seconds(|equal| &equal.processor_seconds),
                ratio(|equal| &equal.times_as_fast_by_processor),
            ]);
        }
        table
    }

    /// The table of all points, and their mean ratios.
    fn budgets(&self) -> Section {
        let mut table = Table::new(
            "",
            "variant | budget | bias | mean ratio | spp | s | processor s | relMSE | trimmed | MSE | FLIP | NaN, Inf \
             | Msamples/s | Mrays/s | efficiency",
        );
        let mut groups = Vec::new();
        // Budgets outermost, so that what is compared stands together.
        for budget in 0..self.variants.first().map_or(0, |variant| variant.points.len()) {
            let points = self.variants.iter().filter_map(|v| Some((v.name.as_str(), v.points.get(budget)?)));
            let points: Vec<_> = points.filter(|(_, point)| !point.runs.is_empty()).collect();
            table.rows.extend(points.iter().map(|(name, point)| row(name, point)));
            let ratio = |(name, point): &(&str, &Point)| {
                point.bias.map(|bias| ((*name).to_owned(), [bias.ratio, bias.low, bias.high]))
            };
            let rows: Vec<_> = points.iter().filter_map(ratio).collect();
            if let Some((_, point)) = points.first().filter(|_| !rows.is_empty()) {
                groups.push((point.budget.to_string(), rows));
            }
        }
        let mut section = Section { title: "By budget".to_owned(), tables: vec![table], ..Section::default() };
        if !groups.is_empty() {
            let dots = Dots { unit: "mean ratio".to_owned(), groups, mark: Some(1.0) };
            let caption = "Brightness over the reference's; the intervals hold together with 95 %.".to_owned();
            section.figures.push(Figure { caption, drawing: Drawing::Dots(dots) });
        }
        section
    }
}

fn of_tax(tax: &TaxReport) -> Section {
    let [width, height] = tax.size;
    let mut table =
        Table::new("", "variant | picture | rays | hits | threads | render s | bare replay s | render / replay");
    table.rows.push(vec![
        tax.variant.clone(),
        format!("{width}x{height}, {} spp", tax.spp),
        tax.rays.to_string(),
        tax.hits.to_string(),
        tax.threads.to_string(),
        range(tax.render_seconds),
        range(tax.replay_seconds),
        range(tax.ratio),
    ]);
    let text = format!("The render beside bare calls of {} with its own rays, in the same packets.", tax.accelerator);
    let other = (!tax.same_hits).then(|| "The replay found other hits than the render.".to_owned());
    let text = std::iter::once(text).chain(other).collect();
    Section { title: "Shading tax".to_owned(), text, tables: vec![table], ..Section::default() }
}

fn row(name: &str, point: &Point) -> Vec<String> {
    let optional = |values: Option<[f64; 3]>| or_dash(values.map(range));
    let verdict = |bias: super::Bias| if bias.is_found() { "found" } else { "none found" };
    let interval = |bias: super::Bias| format!("{:.4} ({:.4} to {:.4})", bias.ratio, bias.low, bias.high);
    vec![
        name.to_owned(),
        point.budget.to_string(),
        or_dash(point.bias.map(|bias| verdict(bias).to_owned())),
        or_dash(point.bias.map(interval)),
        or_dash(point.spp.map(number)),
        range(point.seconds),
        range(point.processor_seconds),
        range(point.relmse),
        number(point.relmse_trimmed[0]),
        number(point.mse[0]),
        or_dash(point.flip.map(number)),
        point.not_finite.to_string(),
        optional(point.msamples_per_second),
        optional(point.mrays_per_second),
        optional(point.efficiency),
    ]
}
