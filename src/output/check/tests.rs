use super::*;

use exr::compression::Compression;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, Text};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes, Layers,
    LineOrder, Vec2, WritableImage, f16,
};

use crate::output::cryptomatte::id_bits;

/// A file to be written, of 2x1 pixels.
#[derive(Clone)]
struct Draft {
    parts: Vec<DraftPart>,
    chromaticities: Option<Chromaticities>,
    display: IntegerBounds,
}

#[derive(Clone)]
struct DraftPart {
    channels: Vec<(String, FlatSamples)>,
    compression: Compression,
    attributes: LayerAttributes,
}

fn half() -> FlatSamples {
    FlatSamples::F16(vec![f16::ONE; 2])
}

fn float() -> FlatSamples {
    FlatSamples::F32(vec![1.0; 2])
}

impl DraftPart {
    /// `name:h` for half, else float.
    fn new(names: &str) -> Self {
        let channel = |name: &str| match name.strip_suffix(":h") {
            Some(name) => (name.replace('_', " ").replace("~", "_"), half()),
            None => (name.replace('_', " ").replace("~", "_"), float()),
        };
        let attributes = LayerAttributes::default();
        Self { channels: names.split_whitespace().map(channel).collect(), compression: Compression::ZIP16, attributes }
    }

    fn text(mut self, name: &str, value: &str) -> Self {
        self.attributes
            .other
            .insert(Text::from(name), AttributeValue::Text(Text::from_bytes_unchecked(value.bytes().collect())));
        self
    }

    fn value(mut self, name: &str, value: AttributeValue) -> Self {
        self.attributes.other.insert(Text::from(name), value);
        self
    }

    fn named(mut self, name: &str) -> Self {
        self.attributes.layer_name = Some(Text::from(name));
        self
    }

    fn compressed(mut self, compression: Compression) -> Self {
        self.compression = compression;
        self
    }

    fn set(mut self, change: impl FnOnce(&mut LayerAttributes)) -> Self {
        change(&mut self.attributes);
        self
    }
}

/// A part with a matte of one layer. Both pixels have the same four values.
fn matte(values: [f32; 4], entries: &[(&str, &str)]) -> DraftPart {
    let mut part = DraftPart::new("R:h G:h B:h");
    for (i, suffix) in ["r", "g", "b", "a"].iter().enumerate() {
        part.channels.push((format!("CryptoObject00.{suffix}"), FlatSamples::F32(vec![values[i]; 2])));
    }
    entries.iter().fold(part, |part, (word, value)| part.text(&format!("cryptomatte/3ae39a5/{word}"), value))
}

const DESCRIPTION: [(&str, &str); 4] = [
    ("name", "CryptoObject"),
    ("hash", "MurmurHash3_32"),
    ("conversion", "uint32_to_float32"),
    ("manifest", r#"{"torus":"f19c73fd","bunny":"13851a76"}"#),
];

fn torus() -> f32 {
    f32::from_bits(id_bits("torus"))
}

fn good_matte() -> DraftPart {
    matte([torus(), 0.75, f32::from_bits(id_bits("bunny")), 0.25], &DESCRIPTION)
}

/// A good matte with one entry of its description replaced, or taken away.
fn described(word: &str, value: Option<&str>) -> DraftPart {
    let mut part = good_matte();
    part.attributes.other.remove(&Text::from(format!("cryptomatte/3ae39a5/{word}").as_str()));
    match value {
        Some(value) => part.text(&format!("cryptomatte/3ae39a5/{word}"), value),
        None => part,
    }
}

fn one(part: DraftPart) -> Draft {
    Draft { parts: vec![part], chromaticities: Some(crate::output::color_space::REC709), display: window(0) }
}

fn several(parts: [DraftPart; 2]) -> Draft {
    let [first, second] = parts;
    Draft { parts: vec![first.named("a"), second.named("b")], ..one(DraftPart::new("R")) }
}

fn window(x: i32) -> IntegerBounds {
    IntegerBounds::new(Vec2(x, 0), Vec2(2, 1))
}

impl Draft {
    fn write(&self, path: &Path) {
        let layers: Layers<AnyChannels<FlatSamples>> = self.parts.iter().map(layer).collect();
        let mut attributes = ImageAttributes::new(self.display);
        attributes.chromaticities = self.chromaticities;
        let image = Image { attributes, layer_data: layers };
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().skip_compatibility_checks().to_buffered(&mut bytes).unwrap();
        std::fs::write(path, bytes.into_inner()).unwrap();
    }

    fn findings(&self, profile: ExrProfileDesc) -> Vec<Finding> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        self.write(&path);
        check_exr(&path, profile).unwrap()
    }
}

fn layer(part: &DraftPart) -> Layer<AnyChannels<FlatSamples>> {
    let channels =
        part.channels.iter().map(|(name, samples)| AnyChannel::new(name.as_str(), samples.clone())).collect();
    let encoding =
        Encoding { compression: part.compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    Layer::new(Vec2(2, 1), part.attributes.clone(), encoding, AnyChannels::sort(channels))
}

/// Camera space seen by a camera at the origin that looks along the world's -Z.
const CAMERA: [f32; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 3.0, 2.0, 1.0, 1.0];

/// World to picture for it with scales along x and y and the axis at `centre`, without perspective.
fn ndc(x: f32, y: f32, centre: f32) -> [f32; 16] {
    [x, 0.0, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, centre + 3.0 * x, centre + 2.0 * y, 1.0, 1.0]
}

fn placed(ndc: [f32; 16]) -> DraftPart {
    DraftPart::new("R:h G:h B:h").set(|a| (a.world_to_camera, a.world_to_normalized_device) = (Some(CAMERA), Some(ndc)))
}

/// A file that breaks a rule, for every rule.
fn example(rule: &str) -> Draft {
    use crate::output::color_space::COLOR_SPACES;
    let rgb = || DraftPart::new("R:h G:h B:h A:h");
    let with = |names: &str| one(DraftPart::new(&format!("R:h G:h B:h {names}")));
    let dwa = || Compression::DWAA(None);
    match rule {
        "nuke-dots" => with("beauty.lights.key.R:h"),
        "nuke-characters" => with("light-key.R:h"),
        "nuke-leading-digit" => with("key.2nd:h"),
        "nuke-collision" => with("key.R:h key.red:h"),
        "nuke-main-alias" => with("Ci.R:h"),
        "nuke-parts-windows" => several([rgb(), DraftPart::new("N.X N.Y N.Z").set(|a| a.layer_position = Vec2(1, 0))]),
        "nuke-part-names" => several([DraftPart::new("R:h G:h B:h N.X N.Y N.Z"), DraftPart::new("Y:h")]),
        "nuke-beauty" => one(DraftPart::new("View.Combined.R:h View.Combined.G:h View.Combined.B:h")),
        "nuke-metadata" => several([rgb(), DraftPart { channels: good_matte().channels.split_off(3), ..good_matte() }]),
        "nuke-scanlines" => one(rgb()),
        "multipart-several" => with("Z"),
        "blender-name-length" => with(&format!("{}.R:h", "a".repeat(70))),
        "blender-pass-size" => with(&(0..25).map(|i| format!("pass.c{i}:h ")).collect::<String>()),
        "blender-pass-channels" => with("pass.R:h pass.G:h pass.X:h"),
        "blender-case" => with("key.R:h Key.R:h"),
        "blender-depth" => with("X Y Z"),
        "blender-pass-names" => with("DiffDir.R:h DiffDir.G:h DiffDir.B:h"),
        "half-data" => with("Z:h"),
        "half-ids" => with("object~id.id:h"),
        "crypto-float" => with("CryptoObject00.r:h CryptoObject00.g:h CryptoObject00.b:h CryptoObject00.a:h"),
        "dwa-data" => one(DraftPart::new("R:h G:h B:h N.X:h N.Y:h N.Z:h").compressed(dwa())),
        "pxr24-data" => one(DraftPart::new("R:h G:h B:h P.X P.Y P.Z").compressed(Compression::PXR24)),
        "b44-data" => one(DraftPart::new("R:h G:h B:h N.X:h N.Y:h N.Z:h").compressed(Compression::B44)),
        "windows-apart" => Draft { display: window(10), ..one(rgb()) },
        "color-unknown" => Draft { chromaticities: None, ..one(rgb()) },
        "color-contradiction" => {
            Draft { chromaticities: Some(COLOR_SPACES[1].1), ..one(rgb().text("colorInteropID", "lin_rec709_scene")) }
        }
        "color-id" => one(rgb().text("colorInteropID", "lin_rec709")),
        "color-of-data" => one(rgb().text("colorInteropID", "data")),
        "attribute-type" => one(rgb().value("owner", AttributeValue::F32(1.0))),
        "capture-date" => one(rgb().set(|a| a.capture_date = Some(Text::from("2026-11-22 06:00:00")))),
        "matrix-rows" => {
            let transposed = std::array::from_fn(|i| CAMERA[i % 4 * 4 + i / 4]);
            one(rgb().set(|a| a.world_to_camera = Some(transposed)))
        }
        "ndc-axes" => one(placed(ndc(0.5, 0.5, 0.5))),
        "crypto-described" => described_as("hash", None),
        "crypto-channels" => {
            let mut part = good_matte();
            part.channels.pop();
            one(part)
        }
        "crypto-suffixes" => {
            let mut part = good_matte();
            part.channels
                .iter_mut()
                .skip(3)
                .for_each(|(name, _)| *name = format!("CryptoObject00.{}", name[15..].to_uppercase()));
            one(part)
        }
        "crypto-key" => {
            let part = matte([torus(), 1.0, 0.0, 0.0], &[]);
            one(DESCRIPTION
                .iter()
                .fold(part, |part, (word, value)| part.text(&format!("cryptomatte/0000001/{word}"), value)))
        }
        "crypto-method" => described_as("hash", Some("SHA1")),
        "crypto-manifest" => described_as("manifest", None),
        "crypto-manifest-form" => described_as("manifest", Some(r#"["torus"]"#)),
        "crypto-manifest-ids" => {
            described_as("manifest", Some(r#"{"torus":"f19c73fd","bunny":"13851a76","obj520":"7fbb01ed"}"#))
        }
        "crypto-sidecar-path" => described_as("manif_file", Some("../names.json")),
        "crypto-sidecar" => {
            let part = described("manifest", None);
            one(part.text("cryptomatte/3ae39a5/manif_file", "names.json"))
        }
        "crypto-ids" => one(matte([f32::NAN, 1.0, 0.0, 0.0], &DESCRIPTION)),
        "crypto-coverage" => one(matte([torus(), 1.25, 0.0, 0.0], &DESCRIPTION)),
        "crypto-order" => one(matte([torus(), 0.25, f32::from_bits(id_bits("bunny")), 0.5], &DESCRIPTION)),
        "crypto-background" => one(matte([torus(), 0.5, 0.0, 0.5], &DESCRIPTION)),
        "crypto-unknown-ids" => one(matte([f32::from_bits(id_bits("hello")), 0.5, 0.0, 0.0], &DESCRIPTION)),
        _ => panic!("no example for {rule}"),
    }
}

fn described_as(word: &str, value: Option<&str>) -> Draft {
    one(described(word, value))
}

/// Every rule finds the file made to break it, in every profile that it holds for, and nothing else does in the profile
/// for which it is worst.
#[test]
fn every_rule_has_a_file_that_breaks_it() {
    for rule in RULES {
        for (profile, name) in ExrProfileDesc::ALL {
            let findings = example(rule.id).findings(profile);
            let found = findings.iter().find(|finding| finding.rule == rule.id);
            assert_eq!(
                found.map(|finding| finding.severity),
                rule.severity(profile),
                "{} in {name}: {findings:#?}",
                rule.id
            );
            assert!(found.is_none_or(|finding| !finding.what.is_empty()
                && !finding.effect.is_empty()
                && !finding.mend.is_empty()));
        }
    }
}

#[test]
fn good_files_are_clean() {
    let data = DraftPart::new("N.X N.Y N.Z Z P.X P.Y P.Z uv.U uv.V").text("colorInteropID", "data");
    let good = [
        one(DraftPart::new("R:h G:h B:h A:h albedo.R:h albedo.G:h albedo.B:h Z")),
        one(DraftPart::new("Y:h")),
        one(good_matte()),
        several([
            DraftPart::new("R:h G:h B:h")
                .compressed(Compression::DWAA(None))
                .text("colorInteropID", "lin_rec709_scene"),
            data,
        ]),
        one(placed(ndc(0.5, -0.5, 0.5))),
        one(DraftPart::new("R:h G:h B:h").set(|a| a.capture_date = Some(Text::from("2026:11:22 06:00:00")))),
    ];
    for draft in &good {
        assert_eq!(draft.findings(ExrProfileDesc::Default), []);
    }
    assert_eq!(
        one(DraftPart::new("R:h G:h B:h Diffuse_Direct.R:h Diffuse_Direct.G:h Diffuse_Direct.B:h"))
            .findings(ExrProfileDesc::Blender),
        []
    );
}

#[test]
fn the_matrices_of_other_conventions_are_recognised() {
    let what = |ndc| {
        let findings = one(placed(ndc)).findings(ExrProfileDesc::Default);
        findings.iter().map(|finding| finding.what.clone()).collect::<Vec<_>>().join(";")
    };
    assert!(what(ndc(0.5, 0.5, 0.5)).contains("y up"));
    assert!(what(ndc(-0.5, -0.5, 0.5)).contains("mirrored"));
    assert!(what(ndc(1.0, -1.0, 0.0)).contains("upper left corner"));
}

#[test]
fn faults_of_reading_have_their_kinds() {
    use crate::error::Error;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    assert!(matches!(check_exr(&path, ExrProfileDesc::Default), Err(Error::Missing { .. })));
    one(good_matte()).write(&path);
    let bytes = std::fs::read(&path).unwrap();
    for length in [0, 3, 100, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(matches!(check_exr(&path, ExrProfileDesc::Default), Err(Error::Malformed { .. })), "{length}");
    }
}

/// The manual lists the rules as they are.
#[test]
fn the_manual_lists_every_rule() {
    let manual = include_str!("../../../docs/exr.md");
    let cell = |severity: Option<Severity>| severity.map_or("-", Severity::name);
    let mut rows: Vec<&str> =
        manual.lines().filter(|line| line.starts_with("| `") && line.matches('|').count() == 8).collect();
    for rule in RULES {
        let severities: Vec<&str> =
            ExrProfileDesc::ALL.iter().map(|(profile, _)| cell(rule.severity(*profile))).collect();
        let row = format!("| `{}` | {} | {} | {} |", rule.id, rule.title, rule.source, severities.join(" | "));
        assert!(rows.contains(&row.as_str()), "docs/exr.md lacks\n{row}");
        rows.retain(|other| *other != row);
    }
    assert!(rows.is_empty(), "docs/exr.md lists what is no rule: {rows:?}");
}
