//! The pictures of a page: small ones, and a viewer of differences.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;
use serde_json::json;

use super::ErrorReport;
use crate::film::{Image, LayerKind};
use crate::output::RELATIVE_FLOOR;
use crate::output::flip::{hdr_flip, mean};
use crate::report::{Picture, base64, heat, thumbnail};
use steradian::Result;

/// Pixels of all pictures of the viewer; beyond it only those of the largest budget are in it.
const PIXELS: u64 = 12_000_000;

/// Longer side of small pictures.
const SIDE: u32 = 320;

const SCRIPT: &str = include_str!("viewer.js");
const CONTROLS: &str = include_str!("viewer.html");

/// Pictures of the first repeat.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    size: [u32; 2],
    reference: String,
    /// By variant and budget.
    tests: Vec<(usize, usize, String)>,
    /// The reference, and of every variant the picture and its FLIP map with the largest budget.
    pub(super) small: Vec<Picture>,
}

impl Pictures {
    /// Those of one reference.
    pub(super) fn new(reference: &Image) -> Result<Self> {
        Ok(Self {
            size: [reference.crop.width, reference.crop.height],
            reference: pack(reference),
            tests: Vec::new(),
            small: vec![thumbnail("reference".to_owned(), reference, SIDE)?],
        })
    }

    /// Whether `count` pictures of this size fit into the viewer.
    pub(super) fn fit(&self, count: usize) -> bool {
        u64::from(self.size[0]) * u64::from(self.size[1]) * (count as u64 + 1) <= PIXELS
    }

    /// Adds the picture of a variant and a budget to the viewer.
    pub(super) fn add(&mut self, variant: usize, budget: usize, image: &Image) {
        self.tests.push((variant, budget, pack(image)));
    }

    /// The mean FLIP of a picture. With a name it is shown small, and so are the differences.
    pub(super) fn flip(&mut self, reference: &Image, image: &Image, name: Option<&str>) -> Result<f64> {
        let flip = hdr_flip(reference, image)?;
        let mean = mean(&flip);
        if let Some(name) = name {
            self.small.push(thumbnail(name.to_owned(), image, SIDE)?);
            self.small.push(heat(format!("{name}: FLIP, mean {mean:.3}"), self.size, SIDE, |i| flip[i])?);
        }
        Ok(mean)
    }

    /// The viewer's markup, which its script makes visible.
    pub(super) fn viewer(&self, report: &ErrorReport) -> String {
        if self.tests.is_empty() {
            return String::new();
        }
        let name = |variant: usize, budget: usize| {
            let variant = report.variants.get(variant)?;
            Some(format!("{}, {}", variant.name, variant.points.get(budget)?.budget))
        };
        let tests = self.tests.iter().map(|(v, b, data)| json!({ "name": name(*v, *b), "data": data }));
        let data = json!({
            "size": self.size, "floor": RELATIVE_FLOOR, "reference": self.reference, "tests": tests.collect::<Vec<_>>()
        });
        // A name could hold the end of the element that holds the text.
        let data = data.to_string().replace('<', "\\u003c");
        format!(
            "{CONTROLS}<script type=\"application/json\" id=\"pictures\">{data}</script>\n<script>\n{SCRIPT}</script>\n"
        )
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
    base64(&packed)
}
