use super::channels::to_half;
use super::*;

use std::path::Path;
use std::process::Command;

use exr::meta::attribute::IntegerBounds;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatImage, FlatSamples, LayerAttributes, ReadChannels, ReadLayers, Vec2,
    WritableImage, read,
};

use crate::desc::{CompressionDesc, ExrProfileDesc, LayerKind, OutputDesc, PixelTypeDesc};
use crate::error::Error;
use crate::film::{Coverage, Crop, Identities, Image, Label, Layer, LayerInfo, ShapeIdentity, ShapeKey};
use crate::output::{RenderInfo, check_exr, cryptomatte};

const LAYERS: [LayerKind; 6] =
    [LayerKind::Z, LayerKind::N, LayerKind::P, LayerKind::Albedo, LayerKind::Variance, LayerKind::Samples];

/// The layers of the pictures below.
const LAYERS_OF_PICTURE: [LayerKind; 7] = [
    LayerKind::Color,
    LayerKind::Z,
    LayerKind::N,
    LayerKind::P,
    LayerKind::Albedo,
    LayerKind::Variance,
    LayerKind::Samples,
];

/// A cropped picture of several layers with numbers that 16 bits hold, save where a layer is always of 32.
fn picture() -> Image {
    let crop = Crop { x: 3, y: 2, width: 33, height: 21 };
    let layer = |info: &'static LayerInfo| {
        let values = crop.area() as usize * info.channels.len();
        let scale = if info.always_float { std::f32::consts::PI } else { 1.0 / 64.0 };
        Layer::new(info.kind, (0..values).map(|i| ((i * 37) % 1999) as f32 * scale - 3.0).collect())
    };
    Image {
        size: [40, 30],
        crop,
        layers: LAYERS_OF_PICTURE.iter().map(|kind| layer(LayerInfo::of(*kind))).collect(),
        ..Image::default()
    }
}

fn info() -> RenderInfo {
    let world_to_camera =
        Some([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.5, 2.5, 3.5, 1.0]]);
    RenderInfo {
        samples_per_pixel: 64,
        render_seconds: 1.5,
        world_to_camera,
        pixel_aspect: Some(2.0),
        ..RenderInfo::default()
    }
}

fn output(path: &Path, pixel_type: PixelTypeDesc, compression: CompressionDesc) -> OutputDesc {
    OutputDesc {
        layers: LAYERS.to_vec(),
        pixel_type,
        compression: Some(compression),
        ..OutputDesc::new(path.display().to_string())
    }
}

/// All channels of a file through the library, by name.
fn all_channels(path: &Path) -> Vec<(String, FlatSamples)> {
    let file: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap();
    assert_eq!(file.layer_data.len(), 1);
    file.layer_data[0].channel_data.list.iter().map(|c| (c.name.to_string(), c.sample_data.clone())).collect()
}

/// M7: floats come back exactly, halves as the nearest half, with every compression.
#[test]
fn files_come_back_exactly() {
    use CompressionDesc::{None, Piz, Rle, Zip, Zips};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = picture();
    image.layers[0].data[0] = 0.1;
    image.layers[0].data[5] = 1e9;
    for pixel_type in [PixelTypeDesc::Half, PixelTypeDesc::Float] {
        for compression in [Zip, Zips, Piz, Rle, None] {
            write_exr(&path, &image, &output(&path, pixel_type, compression), &info()).unwrap();
            let read = read_exr(&path).unwrap();
            assert_eq!((read.size, read.crop), (image.size, image.crop));
            for (read, written) in read.layers[0].data.iter().zip(&image.layers[0].data) {
                let expected =
                    if pixel_type == PixelTypeDesc::Half { to_half([*written])[0].to_f32() } else { *written };
                assert!(read.is_finite() && *read == expected, "{read} {written}");
            }
            let channels = all_channels(&path);
            assert_eq!(channels.len(), 18);
            for layer in &image.layers[1..] {
                for (i, name) in LayerInfo::of(layer.kind).channels.iter().enumerate() {
                    let samples = &channels.iter().find(|(n, _)| n == name).unwrap().1;
                    assert!(samples.values_as_f32().eq(layer.channel(i)), "{name}");
                    assert!(
                        !LayerInfo::of(layer.kind).always_float || matches!(samples, FlatSamples::F32(_)),
                        "{name}"
                    );
                }
            }
        }
    }
}

#[test]
fn only_the_requested_layers_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let desc = OutputDesc { layers: vec![LayerKind::Z], ..OutputDesc::new("a.exr") };
    write_exr(&path, &picture(), &desc, &RenderInfo::default()).unwrap();
    let names: Vec<String> = all_channels(&path).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["A", "B", "G", "R", "Z"]);
}

/// The reference implementation reads what is written, metadata included.
#[test]
#[ignore = "needs exrheader, oiiotool and idiff: apt install openexr openimageio-tools"]
fn the_reference_implementation_agrees() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = picture();
    write_exr(&path, &image, &output(&path, PixelTypeDesc::Half, CompressionDesc::Zip), &info()).unwrap();
    let header = Command::new("exrheader").arg(&path).output().unwrap();
    let header = String::from_utf8_lossy(&header.stdout).into_owned();
    let expected = [
        "samplesPerPixel (type int): 64",
        "renderTimeSeconds (type float): 1.5",
        "software (type string): \"Steradian",
        "Z, 32-bit floating-point",
        "N.X, 16-bit floating-point",
        "P.X, 32-bit floating-point",
        "albedo.R, 16-bit floating-point",
        "zip, multi-scanline blocks",
        "worldToCamera (type m44f)",
        "depth along the view axis of the nearest sample; 1e10",
        "chromaticities",
    ];
    for text in expected {
        assert!(header.contains(text), "{text} is not in\n{header}");
    }
    let compact: String = header.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(compact.contains("dataWindow (type box2i): (3 2) - (35 22)"), "{compact}");
    assert!(compact.contains("displayWindow (type box2i): (0 0) - (39 29)"), "{compact}");
    assert!(compact.contains("1.5 2.5 3.5 1"), "{compact}");
    // A copy made by another program holds the same picture.
    let copy = folder.path().join("copy.exr");
    let copied = Command::new("oiiotool").arg(&path).args(["-d", "float", "-o"]).arg(&copy).output().unwrap();
    assert!(copied.status.success(), "{}", String::from_utf8_lossy(&copied.stderr));
    assert_eq!(read_exr(&copy).unwrap(), read_exr(&path).unwrap());
}

#[test]
fn layers_gray_pictures_and_overscan_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let write = |names: &[&str], position: Vec2<i32>| {
        let channels = names
            .iter()
            .enumerate()
            .map(|(i, name)| AnyChannel::new(*name, FlatSamples::F32(vec![i as f32; 6])))
            .collect();
        let attributes = LayerAttributes { layer_position: position, ..LayerAttributes::default() };
        let layer =
            exr::prelude::Layer::new(Vec2(3, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(channels));
        let mut file = exr::prelude::Image::from_layer(layer);
        file.attributes.display_window = IntegerBounds::new(Vec2(0, 0), Vec2(8, 8));
        file.write().to_file(&path).unwrap();
        read_exr(&path)
    };
    let first = |image: &Image| image.layers[0].data[..4].to_vec();
    let layered = write(
        &["albedo.R", "albedo.G", "albedo.B", "View.Combined.R", "View.Combined.G", "View.Combined.B"],
        Vec2(1, 1),
    )
    .unwrap();
    assert_eq!(first(&layered), [3.0, 4.0, 5.0, 1.0]);
    assert_eq!((layered.size, layered.crop), ([8, 8], Crop { x: 1, y: 1, width: 3, height: 2 }));
    assert_eq!(first(&write(&["A", "Y", "x.R"], Vec2(0, 0)).unwrap()), [1.0, 1.0, 1.0, 0.0]);
    let overscan = write(&["R", "G", "B"], Vec2(-1, 0)).unwrap();
    assert_eq!((overscan.size, overscan.crop), ([3, 2], Crop::full([3, 2])));
    let depth = write(&["Z"], Vec2(0, 0)).unwrap_err();
    assert!(matches!(&depth, Error::Malformed { message, .. } if message.ends_with("it has Z")), "{depth}");
}

#[test]
fn failures_say_which_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    assert!(matches!(read_exr(&path), Err(Error::Missing { .. })));
    let lost = folder.path().join("missing/a.exr");
    let failed = write_exr(&lost, &picture(), &OutputDesc::new(""), &RenderInfo::default());
    assert!(matches!(failed, Err(Error::Output { file, .. }) if file == lost));
    write_exr(&path, &picture(), &OutputDesc::new(""), &RenderInfo::default()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for length in [0, 3, 100, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(matches!(read_exr(&path), Err(Error::Malformed { .. })), "{length} of {} bytes", bytes.len());
    }
}

#[test]
fn a_comparison_through_files_equals_one_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
    let reference = picture();
    let mut test = reference.clone();
    test.layers[0].data.iter_mut().enumerate().for_each(|(i, v)| *v += ((i * 7919) % 13) as f32 * 0.01);
    for (path, image) in [(&a, &reference), (&b, &test)] {
        write_exr(path, image, &output(path, PixelTypeDesc::Float, CompressionDesc::Piz), &info()).unwrap();
    }
    let through_files = crate::output::compare(&read_exr(&a).unwrap(), &read_exr(&b).unwrap()).unwrap();
    assert_eq!(through_files, crate::output::compare(&reference, &test).unwrap());
    assert!(through_files.mse > 0.0);
}

/// Shapes `torus` and `bunny` of materials `clay` and `clay`, of no files.
fn identities() -> Identities {
    let mut identities = Identities::default();
    let [torus, bunny, clay] = ["torus", "bunny", "clay"].map(|name| identities.add_name(name));
    for name in [torus, bunny] {
        identities.add_shape(ShapeIdentity { label: Label::plain(name), material: clay, asset: None, placement: None });
    }
    identities
}

/// Every layer of the table, noise and mattes, over a picture of 24x16 with two pixels of overscan.
fn full_picture() -> Image {
    let size = [28, 20];
    let pixels = 28 * 20;
    let key = |shape| ShapeKey { instance: ShapeKey::NO_INSTANCE, shape };
    // A quarter torus, half bunny in every pixel; the rest shows nothing.
    let weights = vec![(key(0), 1.0), (key(1), 2.0), (ShapeKey::NONE, 1.0)];
    let mut layers = Vec::new();
    for info in LayerInfo::ALL.iter().filter(|info| !matches!(info.source, crate::film::LayerSource::Coverage)) {
        let data: Vec<f32> = (0..pixels * info.channels.len()).map(|i| (i % 101) as f32 / 64.0).collect();
        let groups: &[Option<&str>] =
            if info.kind == LayerKind::LightGroups { &[Some("key light"), Some("default")] } else { &[None] };
        layers.extend(groups.iter().map(|group| Layer {
            kind: info.kind,
            group: group.map(str::to_owned),
            data: data.clone(),
        }));
    }
    let mut coverage = Coverage::default();
    std::iter::repeat_n(weights, pixels).for_each(|weights| coverage.push(weights));
    Image { size, crop: Crop::full(size), overscan: 2, layers, coverage: Some(coverage) }
}

fn every_layer() -> Vec<LayerKind> {
    let names = LayerInfo::ALL.iter().map(|info| serde_json::from_value(info.name.into()));
    names.filter_map(Result::ok).collect()
}

/// Every profile and kind of file keeps every rule, and mattes, ids and names arrive.
#[test]
fn files_of_every_profile_are_clean() {
    use CompressionDesc::{Dwaa, Dwab, None, Piz, Rle, Zip, Zips};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let (image, identities) = (full_picture(), identities());
    let info = RenderInfo { identities: Some(identities), ..info() };
    assert!(every_layer().len() >= 24);
    for (profile, name) in ExrProfileDesc::ALL {
        for compression in [Zip, Zips, Piz, Rle, None, Dwaa, Dwab] {
            let compression =
                Some(compression).filter(|c| profile == ExrProfileDesc::Multipart || ![Dwaa, Dwab].contains(c));
            for (uncropped, manifest) in
                [(false, crate::desc::CryptoManifestDesc::Embedded), (true, crate::desc::CryptoManifestDesc::Sidecar)]
            {
                let compression = if profile == ExrProfileDesc::Nuke {
                    compression.filter(|c| *c != Zip && *c != Piz)
                } else {
                    compression
                };
                let layers = every_layer();
                let output = OutputDesc {
                    profile,
                    compression,
                    layers,
                    uncropped,
                    crypto_manifest: manifest,
                    ..OutputDesc::new("a.exr")
                };
                write_exr(&path, &image, &output, &info).unwrap();
                assert_eq!(check_exr(&path, profile).unwrap(), [], "{name} {compression:?}");
            }
        }
    }
}

/// Channels of all parts by name.
fn channels_of_parts(path: &Path) -> Vec<(usize, String, FlatSamples)> {
    let file: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let parts = file.layer_data.into_iter().enumerate();
    parts
        .flat_map(|(part, layer)| {
            layer.channel_data.list.into_iter().map(move |c| (part, c.name.to_string(), c.sample_data))
        })
        .collect()
}

#[test]
fn mattes_and_numbers_hold_what_covers_the_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let identities = identities();
    let info = RenderInfo { identities: Some(identities), ..info() };
    let layers = vec![LayerKind::CryptoObject, LayerKind::CryptoMaterial, LayerKind::ObjectId, LayerKind::InstanceId];
    let output = OutputDesc { layers, crypto_depth: Some(4), ..OutputDesc::new("a.exr") };
    write_exr(&path, &full_picture(), &output, &info).unwrap();
    let channels = channels_of_parts(&path);
    let first = |name: &str| {
        let samples = &channels.iter().find(|(_, n, _)| n == name).unwrap_or_else(|| panic!("{name}")).2;
        assert!(matches!(samples, FlatSamples::F32(_)));
        samples.values_as_f32().next().unwrap()
    };
    let rank = |kind: &str| ["00.r", "00.g", "00.b", "00.a", "01.r"].map(|suffix| first(&format!("{kind}{suffix}")));
    assert_eq!(rank("CryptoObject"), [cryptomatte::id("bunny"), 0.5, cryptomatte::id("torus"), 0.25, 0.0]);
    // Both shapes have one material.
    assert_eq!(rank("CryptoMaterial"), [cryptomatte::id("clay"), 0.75, 0.0, 0.0, 0.0]);
    assert_eq!((first("object_id.id"), first("instance_id.id")), (2.0, 0.0));
    assert_eq!(channels.iter().filter(|(_, name, _)| name.starts_with("CryptoObject")).count(), 8);
    let header = exr::meta::MetaData::read_from_file(&path, false).unwrap().headers.remove(0);
    let text = |name: &str| format!("{:?}", header.own_attributes.other.iter().find(|(n, _)| **n == *name).unwrap().1);
    assert!(text("cryptomatte/3ae39a5/manifest").contains("f19c73fd"));
    assert!(text("steradian/object_id").contains("torus"));
    assert!(text("cryptomatte/be359d6/name").contains("CryptoMaterial"));
}

#[test]
fn parts_hold_colour_data_and_mattes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let identities = identities();
    let info = RenderInfo { identities: Some(identities), ..info() };
    let output = OutputDesc { profile: ExrProfileDesc::Multipart, layers: every_layer(), ..OutputDesc::new("a.exr") };
    write_exr(&path, &full_picture(), &output, &info).unwrap();
    for (part, name, samples) in channels_of_parts(&path) {
        let expected = match name.as_str() {
            name if name.starts_with("Crypto") => 2,
            name if name.starts_with("variance")
                || name.contains("normal")
                || name.contains("_id.")
                || name.contains("stats") =>
            {
                1
            }
            name if name.ends_with(['X', 'Y', 'Z', 'U', 'V']) => 1,
            _ => 0,
        };
        assert_eq!(part, expected, "{name}");
        assert!(part == 0 || part == 1 || matches!(samples, FlatSamples::F32(_)), "{name}");
    }
    let parts = exr::meta::MetaData::read_from_file(&path, false).unwrap().headers;
    for header in &parts {
        assert!(header.own_attributes.other.keys().any(|name| *name == *"cryptomatte/3ae39a5/name"));
        let bounds = IntegerBounds::new(Vec2(-2, -2), Vec2(28, 20));
        assert_eq!((header.data_window(), header.shared_attributes.display_window.size), (bounds, Vec2(24, 16)));
    }
}

#[test]
fn pixels_around_a_crop_are_black_if_uncropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = picture();
    let desc = OutputDesc { uncropped: true, pixel_type: PixelTypeDesc::Float, ..OutputDesc::new("a.exr") };
    write_exr(&path, &image, &desc, &info()).unwrap();
    let read = read_exr(&path).unwrap();
    assert_eq!((read.size, read.crop), (image.size, Crop::full(image.size)));
    for y in 0..image.size[1] {
        for x in 0..image.size[0] {
            let expected = image.pixel(LayerKind::Color, x, y).unwrap_or(&[0.0; 4]);
            assert_eq!(read.pixel(LayerKind::Color, x, y), Some(expected), "{x} {y}");
        }
    }
    let header = exr::meta::MetaData::read_from_file(&path, false).unwrap().headers.remove(0);
    assert_eq!(header.own_attributes.original_data_window, Some(IntegerBounds::new(Vec2(3, 2), Vec2(33, 21))));
}

#[test]
fn types_of_single_layers_and_impossible_outputs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let layers = vec![LayerKind::Albedo, LayerKind::N, LayerKind::Z];
    let mut output = OutputDesc { layers, ..OutputDesc::new("a.exr") };
    output.pixel_types.insert(LayerKind::Albedo, PixelTypeDesc::Float);
    write_exr(&path, &picture(), &output, &info()).unwrap();
    for (_, name, samples) in channels_of_parts(&path) {
        let float = name.starts_with("albedo") || name == "Z";
        assert_eq!(matches!(samples, FlatSamples::F32(_)), float, "{name}");
    }
    let refusal = |change: fn(&mut OutputDesc)| {
        let mut output = output.clone();
        change(&mut output);
        match check_output(&output) {
            Err(Error::Usage(message)) => message,
            other => panic!("{other:?}"),
        }
    };
    let dwa = refusal(|o| o.compression = Some(CompressionDesc::Dwaa));
    assert!(dwa.contains("layer N") && dwa.contains("multipart") && dwa.contains("dwaa"), "{dwa}");
    assert!(
        refusal(|o| {
            o.pixel_types.insert(LayerKind::Z, PixelTypeDesc::Half);
        })
        .contains("Z needs 32 bits")
    );
    assert!(refusal(|o| o.crypto_depth = Some(3)).contains("even"));
    assert!(refusal(|o| o.dwa_level = Some(10.0)).contains("dwaa"));
    assert!(refusal(|o| o.frames_per_second = Some(0.0)).contains("above 0"));
}

/// Compression with loss stays near the picture, and the nearer the lower its level.
#[test]
fn dwa_loses_little() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = picture();
    image.layers.truncate(1);
    image.layers[0].data.iter_mut().enumerate().for_each(|(i, v)| *v = 0.5 + 0.4 * ((i / 4) as f32 * 0.05).sin());
    let mut errors = Vec::new();
    for (compression, level) in
        [(CompressionDesc::Dwaa, 1.0), (CompressionDesc::Dwaa, 200.0), (CompressionDesc::Dwab, 45.0)]
    {
        let output = OutputDesc { compression: Some(compression), dwa_level: Some(level), ..OutputDesc::new("a.exr") };
        write_exr(&path, &image, &output, &info()).unwrap();
        let read = read_exr(&path).unwrap();
        let error =
            read.layers[0].data.iter().zip(&image.layers[0].data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(error < 0.1, "{error}");
        errors.push(error);
        assert!(check_exr(&path, ExrProfileDesc::Default).unwrap().is_empty());
    }
    assert!(errors[0] < errors[1], "{errors:?}");
}

/// The same picture comes in the same file, to the byte.
#[test]
fn equal_pictures_come_in_equal_files() {
    let folder = tempfile::tempdir().unwrap();
    for profile in [ExrProfileDesc::Default, ExrProfileDesc::Multipart] {
        let bytes = [0, 1, 2].map(|i| {
            let path = folder.path().join(format!("{i}.exr"));
            let info = RenderInfo { identities: Some(identities()), ..info() };
            let output = OutputDesc { profile, layers: every_layer(), ..OutputDesc::new("a.exr") };
            write_exr(&path, &full_picture(), &output, &info).unwrap();
            std::fs::read(&path).unwrap()
        });
        assert!(bytes[0] == bytes[1] && bytes[1] == bytes[2]);
        // In the order of their names.
        let place = |name: &str| bytes[0].windows(name.len()).position(|window| window == name.as_bytes()).unwrap();
        let names = [
            "channels\0",
            "comments\0",
            "cryptomatte/3ae39a5/name\0",
            "dataWindow\0",
            "steradian/object_id\0",
            "worldToCamera\0",
        ];
        assert!(names.windows(2).all(|pair| place(pair[0]) < place(pair[1])));
    }
}
