use super::*;

use std::process::Command;

use crate::desc::LayerDesc;

const LAYERS: [LayerDesc; 6] = [LayerDesc::Z, LayerDesc::N, LayerDesc::P, LayerDesc::Albedo, LayerDesc::Variance, LayerDesc::Samples];

/// The layers of the pictures below.
const LAYERS_OF_PICTURE: [LayerKind; 7] =
    [LayerKind::Color, LayerKind::Z, LayerKind::N, LayerKind::P, LayerKind::Albedo, LayerKind::Variance, LayerKind::Samples];

/// A cropped picture of several layers with numbers that 16 bits hold, save where a layer is always of 32.
fn picture() -> Image {
    let crop = Crop { x: 3, y: 2, width: 33, height: 21 };
    let layer = |info: &'static crate::film::LayerInfo| {
        let values = crop.area() as usize * info.channels.len();
        let scale = if info.always_float { std::f32::consts::PI } else { 1.0 / 64.0 };
        Layer::new(info.kind, (0..values).map(|i| ((i * 37) % 1999) as f32 * scale - 3.0).collect())
    };
    Image { size: [40, 30], crop, layers: LAYERS_OF_PICTURE.iter().map(|kind| layer(kind.info())).collect(), ..Image::default() }
}

fn info() -> RenderInfo {
    let world_to_camera = Some([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.5, 2.5, 3.5, 1.0]]);
    RenderInfo { samples_per_pixel: 64, render_seconds: 1.5, world_to_camera, pixel_aspect: Some(2.0), ..RenderInfo::default() }
}

fn output(path: &Path, pixel_type: PixelTypeDesc, compression: CompressionDesc) -> OutputDesc {
    OutputDesc { layers: LAYERS.to_vec(), pixel_type, compression, ..OutputDesc::new(path.display().to_string()) }
}

/// All channels of a file through the library, by name.
fn all_channels(path: &Path) -> Vec<(String, FlatSamples)> {
    let file: FlatImage =
        read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes().from_file(path).unwrap();
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
                let expected = if pixel_type == PixelTypeDesc::Half { to_half(*written).to_f32() } else { *written };
                assert!(read.is_finite() && *read == expected, "{read} {written}");
            }
            let channels = all_channels(&path);
            assert_eq!(channels.len(), 18);
            for layer in &image.layers[1..] {
                for (i, name) in layer.kind.info().channels.iter().enumerate() {
                    let samples = &channels.iter().find(|(n, _)| n == name).unwrap().1;
                    assert!(samples.values_as_f32().eq(layer.channel(i)), "{name}");
                    assert!(!layer.kind.info().always_float || matches!(samples, FlatSamples::F32(_)), "{name}");
                }
            }
        }
    }
}

#[test]
fn only_the_layers_asked_for_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let desc = OutputDesc { layers: vec![LayerDesc::Z], ..OutputDesc::new("a.exr") };
    write_exr(&path, &picture(), &desc, &RenderInfo::default()).unwrap();
    let names: Vec<String> = all_channels(&path).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["A", "B", "G", "R", "Z"]);
}

/// The reference implementation reads what is written, metadata included (where its tools are installed).
#[test]
fn the_reference_implementation_agrees() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = picture();
    write_exr(&path, &image, &output(&path, PixelTypeDesc::Half, CompressionDesc::Zip), &info()).unwrap();
    if let Ok(header) = Command::new("exrheader").arg(&path).output() {
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
            "depth along the view axis; 1e10",
            "chromaticities",
        ];
        for text in expected {
            assert!(header.contains(text), "{text} is not in\n{header}");
        }
        let compact: String = header.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(compact.contains("dataWindow (type box2i): (3 2) - (35 22)"), "{compact}");
        assert!(compact.contains("displayWindow (type box2i): (0 0) - (39 29)"), "{compact}");
        assert!(compact.contains("1.5 2.5 3.5 1"), "{compact}");
    }
    // A copy made by another program holds the same picture.
    let copy = folder.path().join("copy.exr");
    if Command::new("oiiotool").arg(&path).args(["-d", "float", "-o"]).arg(&copy).output().is_ok_and(|o| o.status.success()) {
        let (read, written) = (read_exr(&copy).unwrap(), read_exr(&path).unwrap());
        assert_eq!(read, written);
    }
}

#[test]
fn layers_gray_pictures_and_overscan_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let write = |names: &[&str], position: Vec2<i32>| {
        let channels = names.iter().enumerate().map(|(i, name)| AnyChannel::new(*name, FlatSamples::F32(vec![i as f32; 6]))).collect();
        let attributes = LayerAttributes { layer_position: position, ..LayerAttributes::default() };
        let layer = ::exr::prelude::Layer::new(Vec2(3, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(channels));
        let mut file = ::exr::prelude::Image::from_layer(layer);
        file.attributes.display_window = IntegerBounds::new(Vec2(0, 0), Vec2(8, 8));
        file.write().to_file(&path).unwrap();
        read_exr(&path)
    };
    let first = |image: &Image| image.layers[0].data[..4].to_vec();
    let layered =
        write(&["albedo.R", "albedo.G", "albedo.B", "View.Combined.R", "View.Combined.G", "View.Combined.B"], Vec2(1, 1)).unwrap();
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
    let through_files = super::super::compare(&read_exr(&a).unwrap(), &read_exr(&b).unwrap()).unwrap();
    assert_eq!(through_files, super::super::compare(&reference, &test).unwrap());
    assert!(through_files.mse > 0.0);
}
