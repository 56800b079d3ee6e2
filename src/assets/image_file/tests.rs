use std::path::PathBuf;

use image::{ImageBuffer, Rgb};

use super::*;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Three columns, two rows; each channel of each pixel has its own number.
fn numbers(channels: usize, scale: usize) -> Vec<usize> {
    (0..6 * channels).map(|i| (i + 1) * scale).collect()
}

fn save(image: DynamicImage, folder: &tempfile::TempDir, name: &str) -> PathBuf {
    let path = folder.path().join(name);
    image.save(&path).unwrap();
    path
}

#[test]
fn every_depth_and_number_of_channels_keeps_its_numbers() {
    let folder = folder();
    let bytes = |channels| numbers(channels, 7).iter().map(|&n| n as u8).collect::<Vec<_>>();
    let words = |channels| numbers(channels, 1111).iter().map(|&n| n as u16).collect::<Vec<_>>();
    for (channels, image) in [
        (1, DynamicImage::ImageLuma8(ImageBuffer::from_raw(3, 2, bytes(1)).unwrap())),
        (2, DynamicImage::ImageLumaA8(ImageBuffer::from_raw(3, 2, bytes(2)).unwrap())),
        (3, DynamicImage::ImageRgb8(ImageBuffer::from_raw(3, 2, bytes(3)).unwrap())),
        (4, DynamicImage::ImageRgba8(ImageBuffer::from_raw(3, 2, bytes(4)).unwrap())),
    ] {
        let expected = ImageData { width: 3, height: 2, channels, samples: Samples::U8(bytes(channels)) };
        assert_eq!(read_image(&save(image.clone(), &folder, "a.png")).unwrap(), expected);
        if channels != 2 {
            assert_eq!(read_image(&save(image, &folder, "a.tga")).unwrap(), expected);
        }
    }
    for (channels, image) in [
        (1, DynamicImage::ImageLuma16(ImageBuffer::from_raw(3, 2, words(1)).unwrap())),
        (4, DynamicImage::ImageRgba16(ImageBuffer::from_raw(3, 2, words(4)).unwrap())),
    ] {
        let expected = ImageData { width: 3, height: 2, channels, samples: Samples::U16(words(channels)) };
        assert_eq!(read_image(&save(image, &folder, "w.png")).unwrap(), expected);
    }
}

#[test]
fn the_first_bytes_say_what_a_file_is() {
    let folder = folder();
    let image = DynamicImage::ImageRgb8(ImageBuffer::from_pixel(8, 8, Rgb([90, 120, 200])));
    let jpeg = save(image, &folder, "a.jpg");
    let renamed = folder.path().join("a.png");
    std::fs::rename(&jpeg, &renamed).unwrap();
    let read = read_image(&renamed).unwrap();
    let Samples::U8(samples) = read.samples else { panic!("{:?}", read.samples) };
    assert!(
        samples.chunks(3).all(|p| p[0].abs_diff(90) < 4 && p[1].abs_diff(120) < 4 && p[2].abs_diff(200) < 4),
        "{samples:?}"
    );
}

#[test]
fn floats_stay_floats_and_take_16_bits_only_without_loss() {
    let folder = folder();
    let hdr = folder.path().join("a.hdr");
    let raw: Vec<Rgb<f32>> = (0..6).map(|i| Rgb([i as f32, 0.25, 1000.0])).collect();
    image::codecs::hdr::HdrEncoder::new(std::fs::File::create(&hdr).unwrap()).encode(&raw, 3, 2).unwrap();
    let read = read_image(&hdr).unwrap();
    assert!(matches!(&read.samples, Samples::F16(s) if s[0].to_f32() < 8.0 && s[2].to_f32() == 1000.0), "{read:?}");

    let exr = folder.path().join("a.exr");
    exr::prelude::write_rgba_file(&exr, 3, 2, |x, y| (x as f32, y as f32, 0.1f32, 0.5f32)).unwrap();
    let read = read_image(&exr).unwrap();
    assert_eq!((read.width, read.height, read.channels), (3, 2, 4));
    assert!(matches!(&read.samples, Samples::F32(s) if s[4 * 4..4 * 5] == [1.0, 1.0, 0.1, 0.5]), "{read:?}");

    exr::prelude::write_rgb_file(&exr, 3, 2, |x, y| {
        (f16::from_f32(0.1), f16::from_f32(x as f32), f16::from_f32(y as f32))
    })
    .unwrap();
    let read = read_image(&exr).unwrap();
    assert!(matches!(&read.samples, Samples::F16(s) if read.channels == 3 && s[3] == f16::from_f32(0.1)), "{read:?}");
}

#[test]
fn an_exr_image_of_one_channel_is_grey() {
    use exr::prelude::*;
    let folder = folder();
    let path = folder.path().join("z.exr");
    let write = |names: &[&str]| {
        let channel = |name: &&str| AnyChannel::new(*name, FlatSamples::F32(vec![0.5, 1.0, 1.5, 2.0]));
        let channels = AnyChannels::sort(names.iter().map(channel).collect());
        Image::from_channels((2, 2), channels).write().to_file(&path).unwrap();
        read_image(&path)
    };
    for names in [&["height"][..], &["Y", "normal.X"]] {
        let read = write(names).unwrap();
        assert_eq!(
            (read.channels, &read.samples),
            (1, &Samples::F16([0.5, 1.0, 1.5, 2.0].map(f16::from_f32).to_vec()))
        );
    }
    assert!(matches!(write(&["U", "V"]), Err(AssetError::Malformed(m)) if m.contains("neither R, G and B nor Y")));
}

#[test]
fn files_that_are_cut_short_are_errors() {
    let folder = folder();
    let noise = |x: u32, y: u32| Rgb([(x * 7 + y * 13) as u8, (x * 31) as u8, (y * 29 + x * y) as u8]);
    let image = DynamicImage::ImageRgb8(ImageBuffer::from_fn(33, 21, noise));
    let exr = folder.path().join("a.exr");
    exr::prelude::write_rgb_file(&exr, 33, 21, |x, y| (x as f32, y as f32, 0.5f32)).unwrap();
    let hdr = folder.path().join("a.hdr");
    image.to_rgb32f().save(&hdr).unwrap();
    let names = ["a.png", "a.jpg", "a.tga"].map(|name| save(image.clone(), &folder, name));
    for path in names.iter().chain(&[exr, hdr]) {
        let whole = std::fs::read(path).unwrap();
        assert!(read_image(path).is_ok(), "{}", path.display());
        for length in [0, 1, 3, 17, whole.len() / 4, whole.len() / 2, whole.len() - 20] {
            std::fs::write(path, &whole[..length]).unwrap();
            assert!(matches!(read_image(path), Err(AssetError::Malformed(_))), "{length} bytes of {}", path.display());
        }
    }
}

#[test]
fn sizes_that_no_image_has_are_rejected_before_memory_is_allocated() {
    let folder = folder();
    let path = folder.path().join("big.hdr");
    std::fs::write(&path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n").unwrap();
    assert!(matches!(read_image(&path), Err(AssetError::Malformed(m)) if m.contains("too many")));

    // A TGA header: uncompressed true colour, 24 bits.
    let tga = |width: u16, height: u16| {
        let (w, h) = (width.to_le_bytes(), height.to_le_bytes());
        let path = folder.path().join("size.tga");
        std::fs::write(&path, [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, w[0], w[1], h[0], h[1], 24, 0, 0, 0]).unwrap();
        read_image(&path)
    };
    assert!(matches!(tga(65_535, 65_535), Err(AssetError::Malformed(m)) if m.contains("too many")));
    assert!(matches!(tga(0, 4), Err(AssetError::Malformed(_))));
    assert!(
        check_size(0, 5).is_err()
            && check_size(1 << 14, 1 << 14).is_ok()
            && check_size(usize::MAX, usize::MAX).is_err()
    );
}

#[test]
fn what_is_no_image_is_named_so() {
    let folder = folder();
    for (name, content) in
        [("a.png", &b"not an image"[..]), ("a.exr", b"GIF89a......"), ("a.tga", b"text"), ("a", b"\0\0\0\0")]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        assert!(matches!(read_image(&path), Err(AssetError::Malformed(_))), "{name}");
    }
    assert!(matches!(read_image(&folder.path().join("none.png")), Err(AssetError::Missing { .. })));
    assert!(matches!(read_image(folder.path()), Err(AssetError::Missing { .. })));
}

#[test]
fn a_header_that_claims_more_than_the_file_can_hold_is_refused_and_flat_images_are_not() {
    let folder = folder();
    for name in ["flat.png", "flat.jpg", "flat.tga"] {
        let path =
            save(DynamicImage::ImageLuma8(ImageBuffer::from_pixel(3000, 2000, image::Luma([40]))), &folder, name);
        assert_eq!(read_image(&path).unwrap().width, 3000, "{name}");
    }
    let small =
        save(DynamicImage::ImageLuma8(ImageBuffer::from_pixel(30, 20, image::Luma([40]))), &folder, "small.png");
    let mut bytes = std::fs::read(small).unwrap();
    bytes[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 0, 12, 0]);
    // The checksum of the header: this is no damaged file.
    let checksum = {
        let mut crc = flate2::Crc::new();
        crc.update(&bytes[12..29]);
        crc.sum()
    };
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    let path = folder.path().join("claims.png");
    std::fs::write(&path, &bytes).unwrap();
    let error = format!("{:?}", read_image(&path).unwrap_err());
    assert!(error.contains("65536 x 3072 pixels, more than"), "{error}");
}
