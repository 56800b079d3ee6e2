use super::*;

use ::exr::prelude::{AnyChannels, Encoding, ImageAttributes, Layer, LayerAttributes, SmallVec, Vec2};

const SIZE: (usize, usize) = (4, 3);

/// A part with these channels, each of its own constant, or of the numbers given.
fn part(name: Option<&str>, channels: &[(&str, f32)]) -> Layer<AnyChannels<FlatSamples>> {
    let list = channels
        .iter()
        .map(|(name, value)| AnyChannel::new(*name, FlatSamples::F32(vec![*value; SIZE.0 * SIZE.1])))
        .collect();
    let mut attributes = LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
    attributes.layer_position = Vec2(-1, 2);
    Layer::new(Vec2(SIZE.0, SIZE.1), attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(list))
}

fn one(channels: &[(&str, f32)]) -> FlatImage {
    several([part(None, channels)])
}

fn several<const N: usize>(parts: [Layer<AnyChannels<FlatSamples>>; N]) -> FlatImage {
    FlatImage::from_layers(ImageAttributes::with_size(Vec2(SIZE.0, SIZE.1)), SmallVec::from_iter(parts))
}

/// What a plan finds, as the numbers of the channels' first pixels.
fn found(file: &FlatImage, options: &FileOptions) -> Result<[Option<[f32; 3]>; 3], String> {
    let plan = Plan::new(file, options)?;
    let first = |rgb: Rgb| pixels(file, rgb)[0];
    Ok([Some(first(plan.color)), plan.albedo.map(first), plan.normal.map(first)])
}

/// R, G, B or X, Y, Z of a layer, with the numbers n, n + 0.25, n + 0.5.
macro_rules! layer {
    ($name:literal, $n:literal) => {
        [(concat!($name, "R"), $n), (concat!($name, "G"), $n + 0.25), (concat!($name, "B"), $n + 0.5)]
    };
    ($name:literal, xyz, $n:literal) => {
        [(concat!($name, "X"), $n), (concat!($name, "Y"), $n + 0.25), (concat!($name, "Z"), $n + 0.5)]
    };
}

const fn triple(n: f32) -> Option<[f32; 3]> {
    Some([n, n + 0.25, n + 0.5])
}

#[test]
fn layers_of_other_programs_are_recognised() {
    let auto = FileOptions::default();
    let steradian = one(&[
        layer!("", 1.0),
        layer!("albedo.", 2.0),
        layer!("N.", xyz, 3.0),
        layer!("feature_albedo.", 4.0),
        layer!("feature_normal.", xyz, 5.0),
    ]
    .concat());
    assert_eq!(found(&steradian, &auto).unwrap(), [triple(1.0), triple(4.0), triple(5.0)]);
    let pbrt = one(&[
        layer!("", 1.0),
        layer!("Albedo.", 2.0),
        layer!("N.", xyz, 3.0),
        layer!("Ns.", xyz, 4.0),
        layer!("P.", xyz, 5.0),
    ]
    .concat());
    assert_eq!(found(&pbrt, &auto).unwrap(), [triple(1.0), triple(2.0), triple(4.0)]);
    let blender = one(&[
        layer!("ViewLayer.Combined.", 1.0),
        layer!("ViewLayer.Denoising Albedo.", 2.0),
        layer!("ViewLayer.Denoising Normal.", xyz, 3.0),
        layer!("ViewLayer.Normal.", xyz, 4.0),
        layer!("View.DiffCol.", 5.0),
    ]
    .concat());
    assert_eq!(found(&blender, &auto).unwrap(), [triple(1.0), triple(2.0), triple(3.0)]);
    let mitsuba = one(&[layer!("", 1.0), layer!("albedo.", 2.0), layer!("sh_normal.", xyz, 3.0)].concat());
    assert_eq!(found(&mitsuba, &auto).unwrap(), [triple(1.0), triple(2.0), triple(3.0)]);
    let parts = several([
        part(Some("albedo"), &layer!("", 2.0)),
        part(Some("rgba"), &layer!("", 1.0)),
        part(Some("N"), &layer!("", xyz, 3.0)),
    ]);
    assert_eq!(found(&parts, &auto).unwrap(), [triple(1.0), triple(2.0), triple(3.0)]);
}

#[test]
fn layers_may_be_named_and_must_be_there() {
    let file =
        one(&[layer!("", 1.0), layer!("albedo.", 2.0), layer!("diffcolor.", 3.0), layer!("worldNormal.", xyz, 4.0)]
            .concat());
    let named = |albedo: &str| FileOptions {
        albedo: Some(albedo.into()),
        normal: Some("worldNormal".into()),
        ..FileOptions::default()
    };
    assert_eq!(found(&file, &named("diffcolor")).unwrap(), [triple(1.0), triple(3.0), triple(4.0)]);
    let absent = found(&file, &named("diffuse")).unwrap_err();
    assert!(absent.starts_with("no layer diffuse with") && absent.contains("diffcolor.R"), "{absent}");
    let without = FileOptions { without_features: true, ..FileOptions::default() };
    assert_eq!(found(&file, &without).unwrap(), [triple(1.0), None, None]);
    assert!(Plan::new(&file, &without).unwrap().notes.is_empty());
}

#[test]
fn what_cannot_be_denoised_is_said() {
    let auto = FileOptions::default();
    let nothing = found(&one(&[("Z", 1.0), ("N.X", 0.0), ("N.Y", 0.0), ("N.Z", 0.0)]), &auto).unwrap_err();
    assert!(nothing.contains("no channels R, G and B; it has N.X, N.Y, N.Z, Z"), "{nothing}");
    let twice = found(&one(&[layer!("", 1.0), layer!("noisy.", 1.0)].concat()), &auto).unwrap_err();
    assert!(twice.contains("denoised already"), "{twice}");
    let mut parts = one(&layer!("", 1.0));
    parts.layer_data.push(part(Some("albedo"), &layer!("", 2.0)));
    parts.layer_data[1].attributes.layer_position = Vec2(0, 0);
    let window = found(&parts, &auto).unwrap_err();
    assert!(window.contains("another data window"), "{window}");
    let normals = Plan::new(&one(&[layer!("", 1.0), layer!("N.", xyz, 3.0)].concat()), &auto).unwrap();
    assert!(normals.notes[0].contains("no layer of albedo"), "{:?}", normals.notes);
}

#[test]
fn groups_are_those_that_add_up() {
    let plan = |channels: &[[(&str, f32); 3]]| Plan::new(&one(&channels.concat()), &FileOptions::default()).unwrap();
    let sound = plan(&[
        layer!("", 3.0),
        layer!("light_key.", 1.0),
        [("light_fill.R", 2.0), ("light_fill.G", 2.0), ("light_fill.B", 2.0)],
    ]);
    let names: Vec<&str> = sound.sets[0].iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!((names, sound.sets.len()), (vec!["light_fill", "light_key"], 1));
    let unsound = plan(&[layer!("", 3.0), layer!("light_key.", 1.0)]);
    assert!(
        unsound.sets.is_empty() && unsound.notes.iter().any(|note| note.contains("light groups do not add up")),
        "{:?}",
        unsound.notes
    );
}
