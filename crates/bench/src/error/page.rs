//! One page with plots, tables and a viewer of differences, without a single address.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::prelude::{BASE64_STANDARD, Engine};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;
use serde::Serialize;

use super::ErrorReport;
use crate::film::{Image, LayerKind};
use crate::output::RELATIVE_FLOOR;
use crate::report::html;
use crate::report::plot::{self, Curve};
use steradian::{Error, Result};

/// Pixels of all pictures of a page; beyond it only those of the largest budget are in it.
const PIXELS: u64 = 12_000_000;

const VIEWER: &str = include_str!("viewer.js");

const STYLE: &str = "<style>
#views { display: flex; gap: .5rem; } #views figure { flex: 1; min-width: 0; margin: 0; } \
#views canvas { cursor: crosshair; touch-action: none; }
#controls { display: flex; flex-wrap: wrap; gap: .3rem 1rem; align-items: center; margin: .5rem 0; } \
#pixel { white-space: pre-wrap; }
[aria-pressed=true] { font-weight: bold; } [hidden] { display: none; }
</style>\n";

const CONTROLS: &str = "<div id=\"controls\">
<label>Test <select id=\"choice\"></select></label>
<span><button data-show=\"all\">side by side (0)</button> <button data-show=\"reference\">reference (1)</button> \
<button data-show=\"test\">test (2)</button> <button data-show=\"error\">error (3)</button></span>
<label>Exposure <input id=\"exposure\" type=\"range\" min=\"-10\" max=\"10\" step=\"0.1\" value=\"0\"> \
<output id=\"exposure-value\"></output></label>
<label>Error <select id=\"kind\"><option value=\"relative\">relative, squared</option>\
<option value=\"absolute\">absolute</option><option value=\"signed\">signed: red is brighter</option></select></label>
<label>times 2^ <input id=\"gain\" type=\"range\" min=\"-10\" max=\"10\" step=\"0.1\" value=\"0\"> \
<output id=\"gain-value\"></output></label>
<span>Zoom <output id=\"zoom-value\"></output> (wheel, drag, double click)</span>
</div>
<div id=\"views\">
<figure id=\"view-reference\"><canvas></canvas><figcaption>reference</figcaption></figure>
<figure id=\"view-test\"><canvas></canvas><figcaption>test</figcaption></figure>
<figure id=\"view-error\"><canvas></canvas><figcaption>error</figcaption></figure>
</div>
<p><code id=\"pixel\">The pictures need a browser with JavaScript and DecompressionStream.</code></p>\n";

/// Pictures for the viewer, those of the first repeat.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    size: [u32; 2],
    reference: String,
    /// By variant and budget.
    tests: Vec<(usize, usize, String)>,
}

/// What the script reads.
#[derive(Serialize)]
struct Data<'a> {
    size: [u32; 2],
    floor: f64,
    reference: &'a str,
    tests: Vec<Test<'a>>,
}

#[derive(Serialize)]
struct Test<'a> {
    name: String,
    data: &'a str,
}

impl Pictures {
    /// Those of one reference.
    pub(super) fn new(reference: &Image) -> Self {
        Self { size: [reference.crop.width, reference.crop.height], reference: pack(reference), tests: Vec::new() }
    }

    /// Whether `count` pictures of this size fit into a page.
    pub(super) fn fit(&self, count: usize) -> bool {
        u64::from(self.size[0]) * u64::from(self.size[1]) * (count as u64 + 1) <= PIXELS
    }

    /// Adds the picture of a variant and a budget.
    pub(super) fn add(&mut self, variant: usize, budget: usize, image: &Image) {
        self.tests.push((variant, budget, pack(image)));
    }

    /// As JSON for the script.
    fn json(&self, report: &ErrorReport) -> Result<String> {
        let name = |variant: usize, budget: usize| {
            let variant = report.variants.get(variant)?;
            Some(format!("{}, {}", variant.name, variant.points.get(budget)?.budget))
        };
        let tests =
            self.tests.iter().map(|(v, b, data)| Test { name: name(*v, *b).unwrap_or_default(), data }).collect();
        let data = Data { size: self.size, floor: RELATIVE_FLOOR, reference: &self.reference, tests };
        // A name could hold the end of the element that holds the text.
        Ok(serde_json::to_string(&data).map_err(|e| Error::Internal(e.to_string()))?.replace('<', "\\u003c"))
    }
}

/// Red, green and blue in 16 bits, high bytes before low ones, packed by zlib, as text.
fn pack(image: &Image) -> String {
    let Some(layer) = image.layer(LayerKind::Color) else { return String::new() };
    let largest = f16::MAX.to_f32();
    let bits =
        |x: &f32| f16::from_f32(if x.is_finite() { x.clamp(-largest, largest) } else { *x }).to_bits().to_be_bytes();
    let values: Vec<[u8; 2]> = layer.pixels().flat_map(|pixel| pixel.iter().take(3).map(bits)).collect();
    let bytes: Vec<u8> = values.iter().map(|v| v[0]).chain(values.iter().map(|v| v[1])).collect();
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory cannot fail.
    let packed = encoder.write_all(&bytes).and_then(|()| encoder.finish()).unwrap_or_default();
    BASE64_STANDARD.encode(&packed)
}

impl ErrorReport {
    /// One page with plots and a viewer.
    ///
    /// # Errors
    /// If a plot cannot be drawn.
    pub fn html(&self) -> Result<String> {
        let mut out = html::begin(&format!("Error against time: {}", html::escape(&self.scene)), &self.header());
        out.push_str("<ul>\n");
        for note in self.notes() {
            let _ = writeln!(out, "<li>{}</li>", html::escape(&note));
        }
        out.push_str("</ul>\n");
        let by_time: Vec<Curve> = self.variants.iter().map(|v| named(&v.name, v.slope_of_time, v.curve())).collect();
        let by_spp: Vec<Curve> =
            self.variants.iter().map(|v| named(&v.name, v.slope_of_spp, v.curve_of_spp())).collect();
        for (curves, axis, caption) in [
            (by_time, "seconds", "Error against time, medians; the steeper and the further left the better."),
            (by_spp, "samples per pixel", "Error against samples: what sampling alone does."),
        ] {
            let curves: Vec<Curve> = curves.into_iter().filter(|curve| !curve.points.is_empty()).collect();
            if !curves.is_empty() {
                html::figure(&mut out, &plot::curves(&curves, axis, "relMSE", &[])?, caption);
            }
        }
        for table in self.tables() {
            html::add_table(&mut out, &table);
        }
        if !self.pictures.tests.is_empty() {
            let json = self.pictures.json(self)?;
            let _ = write!(
                out,
                "<h2>Differences</h2>\n{STYLE}{CONTROLS}\
                 <script type=\"application/json\" id=\"pictures\">{json}</script>\n<script>\n{VIEWER}</script>\n"
            );
        }
        out.push_str(html::END);
        Ok(out)
    }
}

fn named(name: &str, slope: Option<f64>, points: Vec<(f64, f64)>) -> Curve {
    let slope = slope.map_or(String::new(), |slope| format!(" (slope {slope:.2})"));
    Curve { name: format!("{name}{slope}"), points }
}
