//! Textures with other colours: images are read, changed and kept.

use std::path::Path;

use half::f16;

use super::Draft;
use crate::assets::read_image;
use crate::color::linear_from_srgb;
use crate::desc::{ChannelDesc, ColorSpaceDesc, TextureDesc};
use crate::image_data::{ImageData, Samples};

/// A texture like the one of this name, whose colours times `factor` are changed; its name. `None` if it is of a kind
/// that cannot be changed, or has no readable image, which is found out when the scene is compiled.
pub fn recolored(
    draft: &mut Draft,
    folder: &Path,
    name: &str,
    factor: [f32; 3],
    change: &dyn Fn(f32) -> f32,
) -> Option<String> {
    let each = |color: [f32; 3]| std::array::from_fn(|i| change(color[i] * factor[i]));
    let texture = match draft.desc.textures.get(name).cloned()? {
        TextureDesc::Constant { color } => TextureDesc::Constant { color: each(color) },
        TextureDesc::Checker { color0, color1, scale } => {
            TextureDesc::Checker { color0: each(color0), color1: each(color1), scale }
        }
        TextureDesc::Image { file, color_space, filter, wrap, scale, rotation_degrees, offset, channel, invert } => {
            if invert || channel == Some(ChannelDesc::A) {
                return None;
            }
            let data = match draft.assets.images.get(&file) {
                Some(data) => data.clone(),
                None => {
                    let path = folder.join(&file);
                    let image = read_image(&path).ok()?;
                    draft.files.insert(path);
                    image
                }
            };
            let data = recolored_image(&data, color_space == ColorSpaceDesc::Srgb, &each);
            let file = draft.keep_image(&format!("{name}_{}", draft.assets.images.len()), data);
            let color_space = ColorSpaceDesc::Linear;
            TextureDesc::Image { file, color_space, filter, wrap, scale, rotation_degrees, offset, channel, invert }
        }
        TextureDesc::VertexColor | TextureDesc::MeshAttribute { .. } | TextureDesc::Product { .. } => return None,
    };
    Some(draft.add_texture(&format!("{name}_changed"), &format!("textures.{name}"), texture))
}

/// An image as floats with its colours changed; alpha is left out.
fn recolored_image(image: &ImageData, is_srgb: bool, change: &dyn Fn([f32; 3]) -> [f32; 3]) -> ImageData {
    let samples = linear_pixels(image, is_srgb).flat_map(|pixel| change(pixel).map(f16::from_f32)).collect();
    ImageData { width: image.width, height: image.height, channels: 3, samples: Samples::F16(samples) }
}

/// The linear colours of an image, whose whole numbers are sRGB or linear; alpha is left out.
pub fn linear_pixels(image: &ImageData, is_srgb: bool) -> impl Iterator<Item = [f32; 3]> {
    let decode = move |x: f32| if is_srgb { linear_from_srgb(x) } else { x };
    let value = move |i: usize| match &image.samples {
        Samples::U8(v) => v.get(i).map_or(0.0, |&x| decode(f32::from(x) / 255.0)),
        Samples::U16(v) => v.get(i).map_or(0.0, |&x| decode(f32::from(x) / 65535.0)),
        Samples::F16(v) => v.get(i).map_or(0.0, |x| x.to_f32()),
        Samples::F32(v) => v.get(i).copied().unwrap_or_default(),
    };
    let is_grey = image.channels < 3;
    (0..image.width * image.height)
        .map(move |i| std::array::from_fn(|k| value(i * image.channels + if is_grey { 0 } else { k })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_lose_their_alpha_and_their_curve() {
        let image = ImageData { width: 1, height: 1, channels: 4, samples: Samples::U8(vec![255, 188, 0, 7]) };
        let out = recolored_image(&image, true, &|color| color.map(|x| 0.5 * x));
        let Samples::F16(values) = &out.samples else { panic!("not half floats") };
        assert_eq!((out.channels, values.len()), (3, 3));
        assert!(values.iter().zip([0.5, 0.25, 0.0]).all(|(a, b)| (a.to_f32() - b).abs() < 3e-3), "{values:?}");
        let grey = ImageData { width: 1, height: 1, channels: 2, samples: Samples::F32(vec![0.5, 0.0]) };
        assert_eq!(recolored_image(&grey, false, &|color| color).samples, Samples::F16(vec![f16::from_f32(0.5); 3]));
    }

    #[test]
    fn constants_and_checkers_are_changed_and_products_are_not() {
        let mut draft = Draft::default();
        draft.add_texture("a", "", TextureDesc::Constant { color: [0.5; 3] });
        draft.add_texture("b", "", TextureDesc::Product { factors: Vec::new() });
        let name = recolored(&mut draft, Path::new(""), "a", [1.0, 0.5, 0.0], &f32::sqrt).unwrap();
        assert!(
            matches!(draft.desc.textures[&name], TextureDesc::Constant { color } if color == [0.5f32.sqrt(), 0.5, 0.0])
        );
        assert!(recolored(&mut draft, Path::new(""), "b", [1.0; 3], &f32::sqrt).is_none());
        assert!(recolored(&mut draft, Path::new(""), "c", [1.0; 3], &f32::sqrt).is_none());
    }
}
