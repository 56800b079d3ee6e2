use super::*;
use crate::color::{linear_from_srgb, srgb_from_linear};
use crate::image_data::{ImageData, Samples};
use crate::texture::ImageError;
use half::f16;

fn image(width: usize, height: usize, channels: usize, samples: Samples) -> Arc<TextureImage> {
    Arc::new(TextureImage::new(ImageData { width, height, channels, samples }).unwrap())
}

/// A grey image, the bottom row first: what it says of each texel is what uv means.
fn grey(width: usize, rows_from_bottom: &[u8]) -> Arc<TextureImage> {
    let rows: Vec<u8> = rows_from_bottom.chunks(width).rev().flatten().copied().collect();
    image(width, rows_from_bottom.len() / width, 1, Samples::U8(rows))
}

fn nearest(image: Arc<TextureImage>) -> Bitmap {
    Bitmap { filter: TextureFilter::Nearest, ..Bitmap::new(image, Decoding::Linear) }
}

fn code(value: f32) -> u8 {
    (value * 255.0).round() as u8
}

#[test]
fn the_origin_of_uv_is_the_bottom_left_corner() {
    let bitmap = nearest(grey(3, &[1, 2, 3, 4, 5, 6]));
    let at = |u: f32, v: f32| code(bitmap.scalar(vec2(u, v)));
    assert_eq!([at(0.1, 0.1), at(0.5, 0.1), at(0.9, 0.1), at(0.1, 0.9), at(0.9, 0.9)], [1, 2, 3, 4, 6]);
    // The edges of the image belong to it.
    assert_eq!([at(0.0, 0.0), at(0.999_999, 0.0), at(0.0, 0.999_999)], [1, 3, 4]);
}

#[test]
fn beyond_its_edges_an_image_is_repeated_clamped_or_mirrored() {
    let row = grey(4, &[10, 20, 30, 40]);
    let at = |wrap: Wrap, u: f32| code(Bitmap { wrap: [wrap; 2], ..nearest(Arc::clone(&row)) }.scalar(vec2(u, 0.5)));
    let all = |wrap: Wrap| [-0.9, -0.1, 0.1, 0.9, 1.1, 1.9, 2.1].map(|u| at(wrap, u));
    assert_eq!(all(Wrap::Repeat), [10, 40, 10, 40, 10, 40, 10]);
    assert_eq!(all(Wrap::Clamp), [10, 10, 10, 40, 40, 40, 40]);
    assert_eq!(all(Wrap::Mirror), [40, 10, 10, 40, 40, 10, 10]);
}

#[test]
fn texels_have_their_own_colours_at_their_middles_and_blend_between() {
    let image = grey(2, &[0, 100, 200, 40]);
    let bitmap = Bitmap { wrap: [Wrap::Clamp; 2], ..Bitmap::new(image, Decoding::Linear) };
    let at = |u: f32, v: f32| bitmap.scalar(vec2(u, v)) * 255.0;
    for (u, v, expected) in [
        (0.25, 0.25, 0.0),
        (0.75, 0.25, 100.0),
        (0.25, 0.75, 200.0),
        (0.75, 0.75, 40.0),
        (0.5, 0.25, 50.0),
        (0.25, 0.5, 100.0),
        (0.5, 0.5, 85.0),
        (0.0, 0.0, 0.0),
        (1.0, 1.0, 40.0),
    ] {
        assert!((at(u, v) - expected).abs() < 1e-3, "{u} {v}: {}", at(u, v));
    }
}

#[test]
fn a_repeated_image_has_no_seam() {
    let noise: Vec<u8> = (0u32..35).map(|i| (i * 97 % 256) as u8).collect();
    for (wrap, filter) in [(Wrap::Repeat, TextureFilter::Bilinear), (Wrap::Mirror, TextureFilter::Bilinear)] {
        let bitmap = Bitmap { wrap: [wrap; 2], filter, ..Bitmap::new(grey(5, &noise), Decoding::Linear) };
        for i in 0..200 {
            let s = i as f32 / 40.0 - 2.0;
            for edge in [-1.0, 0.0, 1.0, 2.0] {
                let (before, behind) = (edge - 1e-6, edge + 1e-6);
                assert!(
                    (bitmap.scalar(vec2(before, s)) - bitmap.scalar(vec2(behind, s))).abs() < 1e-3,
                    "{wrap:?} u {edge} {s}"
                );
                assert!(
                    (bitmap.scalar(vec2(s, before)) - bitmap.scalar(vec2(s, behind))).abs() < 1e-3,
                    "{wrap:?} v {edge} {s}"
                );
            }
        }
    }
}

#[test]
fn every_uv_finds_a_number() {
    let odd = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        1e-45,
        1e9,
        -1e9,
        f32::MAX,
        f32::MIN,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        1.0 - 6e-8,
    ];
    for (width, height) in [(1, 1), (1, 3), (7, 1), (5, 3)] {
        let bitmap = Bitmap::new(grey(width, &vec![51; width * height]), Decoding::Linear);
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
                let bitmap = Bitmap { wrap: [wrap; 2], filter, ..bitmap.clone() };
                for u in odd {
                    for v in odd {
                        assert!(
                            (bitmap.scalar(vec2(u, v)) - 0.2).abs() < 1e-6,
                            "{width}x{height} {wrap:?} {filter:?} {u} {v}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn colours_of_8_and_16_bits_are_srgb_and_floats_and_alpha_are_linear() {
    let at = |image: Arc<TextureImage>, decoding| nearest_color(image, decoding);
    let bytes = image(1, 1, 4, Samples::U8(vec![188, 10, 255, 128]));
    let words = image(1, 1, 4, Samples::U16(vec![188 * 257, 10 * 257, 65_535, 128 * 257]));
    let floats = image(1, 1, 4, Samples::F32(vec![0.5, 3.0, -0.25, 0.5]));
    let halves = image(1, 1, 3, Samples::F16([0.5, 3.0, -0.25].map(f16::from_f32).to_vec()));
    for image in [&bytes, &words] {
        let color = at(Arc::clone(image), Decoding::Srgb);
        for (value, code) in color.to_array().into_iter().zip([188.0, 10.0, 255.0]) {
            assert!((srgb_from_linear(value) * 255.0 - code).abs() < 1e-3, "{color:?}");
        }
        assert!((color.r - linear_from_srgb(188.0 / 255.0)).abs() < 1e-6);
        let color = at(Arc::clone(image), Decoding::Linear);
        assert!((color.r - 188.0 / 255.0).abs() < 1e-6 && color.b == 1.0, "{color:?}");
        for decoding in [Decoding::Srgb, Decoding::Linear] {
            let alpha =
                Bitmap { channel: Some(Channel::A), ..Bitmap::new(Arc::clone(image), decoding) }.scalar(Vec2::ZERO);
            assert!((alpha - 128.0 / 255.0).abs() < 1e-6, "{alpha}");
        }
    }
    for image in [floats, halves] {
        assert_eq!(at(Arc::clone(&image), Decoding::Srgb), Rgb::new(0.5, 3.0, -0.25));
        assert_eq!(image.range(false), [-0.25, 3.0]);
    }
}

fn nearest_color(image: Arc<TextureImage>, decoding: Decoding) -> Rgb {
    let color =
        Bitmap { filter: TextureFilter::Nearest, ..Bitmap::new(Arc::clone(&image), decoding) }.color(Vec2::ZERO);
    let blended = Bitmap::new(image, decoding).color(Vec2::ZERO);
    assert!(
        (color.r - blended.r).abs() < 1e-6 && (color.g - blended.g).abs() < 1e-6 && (color.b - blended.b).abs() < 1e-6
    );
    color
}

#[test]
fn numbers_are_channels_grey_or_luminance() {
    let color = image(1, 1, 4, Samples::U8(vec![51, 102, 153, 204]));
    let of =
        |image: &Arc<TextureImage>, channel| Bitmap { channel, ..Bitmap::new(Arc::clone(image), Decoding::Linear) };
    for (channel, expected) in [(Channel::R, 0.2), (Channel::G, 0.4), (Channel::B, 0.6), (Channel::A, 0.8)] {
        let bitmap = of(&color, Some(channel));
        assert!((bitmap.scalar(Vec2::ZERO) - expected).abs() < 1e-6);
        assert!((bitmap.color(Vec2::ZERO).b - expected).abs() < 1e-6);
        let inverted = Bitmap { invert: true, ..bitmap };
        assert!(
            (inverted.scalar(Vec2::ZERO) - (1.0 - expected)).abs() < 1e-6
                && (inverted.color(Vec2::ZERO).r - (1.0 - expected)).abs() < 1e-6
        );
    }
    let luminance = Rgb::new(0.2, 0.4, 0.6).luminance();
    assert!((of(&color, None).scalar(Vec2::ZERO) - luminance).abs() < 1e-6);
    let opaque = image(1, 1, 1, Samples::U8(vec![51]));
    assert!((of(&opaque, None).scalar(Vec2::ZERO) - 0.2).abs() < 1e-6);
    assert_eq!(of(&opaque, Some(Channel::A)).scalar(Vec2::ZERO), 1.0);
    assert!((of(&opaque, Some(Channel::B)).scalar(Vec2::ZERO) - 0.2).abs() < 1e-6);
}

#[test]
fn scale_turn_and_offset_move_the_image() {
    let bitmap = |scale: Vec2, degrees: f64, offset: Vec2| Bitmap {
        transform: UvTransform::new(scale, degrees.to_radians(), offset),
        ..nearest(grey(2, &[1, 2, 3, 4]))
    };
    let at = |bitmap: &Bitmap, u: f32, v: f32| code(bitmap.scalar(vec2(u, v)));
    let twice = bitmap(vec2(2.0, 1.0), 0.0, Vec2::ZERO);
    assert_eq!([0.1, 0.3, 0.6, 0.8].map(|u| at(&twice, u, 0.1)), [1, 2, 1, 2]);
    let mirrored = bitmap(vec2(-1.0, 1.0), 0.0, Vec2::ZERO);
    assert_eq!([0.1, 0.9].map(|u| at(&mirrored, u, 0.1)), [2, 1]);
    let moved = bitmap(Vec2::ONE, 0.0, vec2(0.5, 0.0));
    assert_eq!([0.1, 0.9].map(|u| at(&moved, u, 0.1)), [2, 1]);
    // uv (0.1, 0.2) turned a quarter from u to v is (-0.2, 0.1), which repeats as (0.8, 0.1).
    let turned = bitmap(Vec2::ONE, 90.0, Vec2::ZERO);
    assert_eq!(at(&turned, 0.1, 0.2), 2);
}

#[test]
fn what_is_no_image_is_refused() {
    let new = |width, height, channels, samples| TextureImage::new(ImageData { width, height, channels, samples });
    assert!(matches!(new(2, 2, 1, Samples::U8(vec![0; 3])), Err(ImageError::Count { count: 3, .. })));
    assert!(matches!(new(0, 2, 1, Samples::U8(vec![])), Err(ImageError::Count { .. })));
    assert!(matches!(new(1, 1, 5, Samples::U8(vec![0; 5])), Err(ImageError::Count { .. })));
    let mut floats = vec![0.0; 18];
    floats[13] = f32::NAN;
    assert_eq!(new(3, 2, 3, Samples::F32(floats)).unwrap_err(), ImageError::NotFinite { x: 1, y: 1 });
    assert_eq!(new(1, 1, 1, Samples::F16(vec![f16::INFINITY])).unwrap_err(), ImageError::NotFinite { x: 0, y: 0 });
}

/// A square of uv in which as many texels lie of an image that fills the unit square.
fn over(uv: Vec2, texels: f32, count: usize) -> Footprint<'static> {
    Footprint { area: texels / count as f32, ..Footprint::point(uv) }
}

#[test]
fn footprints_choose_the_level_of_their_texels() {
    let noise: Vec<u8> = (0u32..16 * 8).map(|i| (i * i * 97 % 251) as u8).collect();
    let bitmap = Bitmap::new(grey(16, &noise), Decoding::Srgb);
    let level = |level: usize| Bitmap {
        image: Arc::new(bitmap.image.pyramid(Decoding::Srgb).level(level).unwrap().clone()),
        ..bitmap.clone()
    };
    let levels = [1, 2].map(|i| Bitmap { decoding: Decoding::Linear, ..level(i) });
    let mean = noise.iter().map(|&v| linear_from_srgb(f32::from(v) / 255.0)).sum::<f32>() / 128.0;
    for i in 0..50 {
        let uv = vec2(i as f32 * 0.617, i as f32 * 0.378);
        // No larger than a texel: the image itself, to the last bit.
        for texels in [0.0, 0.3, 1.0, f32::NAN] {
            assert_eq!(bitmap.color_over(&over(uv, texels, 128)), bitmap.color(uv));
            assert_eq!(bitmap.scalar_over(&over(uv, texels, 128)), bitmap.scalar(uv));
        }
        let at = |texels: f32| bitmap.scalar_over(&over(uv, texels, 128));
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{uv}: {a} {b}");
        close(at(4.0), levels[0].scalar(uv));
        close(at(8.0), 0.5 * (levels[0].scalar(uv) + levels[1].scalar(uv)));
        close(at(2.0), 0.5 * (bitmap.scalar(uv) + levels[0].scalar(uv)));
        close(at(1e4), mean);
        close(at(f32::INFINITY), mean);
        close(bitmap.color_over(&over(uv, 1e4, 128)).g, mean);
        // An image that is shown four times has four times as many texels there; an inverted one has their means
        // the same way.
        let scaled =
            Bitmap { transform: UvTransform::new(vec2(4.0, -1.0), 0.4, Vec2::ZERO), invert: true, ..bitmap.clone() };
        let upright = Bitmap { transform: scaled.transform, invert: true, ..levels[0].clone() };
        close(scaled.scalar_over(&over(uv, 1.0, 128)), upright.scalar(uv));
    }
}

#[test]
fn without_a_pyramid_a_footprint_is_a_point() {
    let noise: Vec<u8> = (0u32..35).map(|i| (i * 97 % 256) as u8).collect();
    for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
        let bitmap = Bitmap { filter, ..Bitmap::new(grey(5, &noise), Decoding::Linear) };
        let uv = vec2(0.3, 0.8);
        assert_eq!(bitmap.color_over(&over(uv, 20.0, 35)), bitmap.color(uv));
    }
}
