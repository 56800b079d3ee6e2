//! Bases of plastics with colours such that ours look like Mitsuba's, images included.

use half::f16;

use super::Reader;
use super::plastics::Coat;
use crate::desc::{ColorDesc, ColorSpaceDesc, TextureDesc};
use crate::import::{ImageData, Samples, read_image};

impl Reader<'_> {
    /// The base of our plastic that looks like the base `color` of Mitsuba's.
    pub(super) fn plastic_base(&mut self, color: ColorDesc, ior: f32, alpha: f32, nonlinear: bool) -> ColorDesc {
        if !nonlinear && alpha == 0.0 {
            return color;
        }
        let key = [ior.to_bits(), alpha.to_bits()];
        let coat = *self.coats.entry(key).or_insert_with(|| Coat::new(f64::from(ior), f64::from(alpha)));
        let change = |r: f32| coat.base(r, nonlinear);
        match color {
            ColorDesc::Grey(r) => ColorDesc::Grey(change(r)),
            ColorDesc::Rgb(color) => ColorDesc::Rgb(color.map(change)),
            ColorDesc::Texture { texture } => {
                let key = (texture.clone(), key, nonlinear);
                let done = match self.recolored.get(&key) {
                    Some(done) => done.clone(),
                    None => self.recolored_texture(&texture, &change),
                };
                self.recolored.insert(key, done.clone());
                ColorDesc::Texture { texture: done }
            }
        }
    }

    /// A texture with its colours changed.
    fn recolored_texture(&mut self, name: &str, change: &dyn Fn(f32) -> f32) -> String {
        let changed = match self.draft.desc.textures.get(name).cloned() {
            Some(TextureDesc::Checker { color0, color1, scale }) => {
                let [color0, color1] = [color0, color1].map(|color| color.map(change));
                Some(TextureDesc::Checker { color0, color1, scale })
            }
            Some(TextureDesc::Image { file, color_space, filter, wrap, scale, rotation_degrees, offset, channel, invert }) => {
                let data = match self.draft.assets.images.get(&file) {
                    Some(data) => Some(data.clone()),
                    // A file that cannot be read is found out when the scene is compiled.
                    None => read_image(&self.scene.parent().unwrap_or(std::path::Path::new("")).join(&file)).ok(),
                };
                data.map(|data| {
                    let stem = format!("{name}_in_coat");
                    let file = self.draft.keep_image(&stem, recolored_image(&data, color_space == ColorSpaceDesc::Srgb, change));
                    let color_space = ColorSpaceDesc::Linear;
                    TextureDesc::Image { file, color_space, filter, wrap, scale, rotation_degrees, offset, channel, invert }
                })
            }
            _ => None,
        };
        let Some(changed) = changed else {
            return name.into();
        };
        self.draft.add_texture(name, &format!("textures.{name}"), changed)
    }
}

/// An image as floats with its colours changed; alpha is left out.
fn recolored_image(image: &ImageData, is_srgb: bool, recolored: &dyn Fn(f32) -> f32) -> ImageData {
    let decode = |x: f32| if is_srgb { linear(x) } else { x };
    let change = |x: f32| f16::from_f32(recolored(decode(x)));
    let colors = if image.channels < 3 { 1 } else { 3 };
    let pick = |i: usize| i % image.channels < colors;
    let samples = match &image.samples {
        Samples::U8(v) => {
            let table: Vec<f16> = (0..=255u8).map(|x| change(f32::from(x) / 255.0)).collect();
            v.iter().enumerate().filter(|(i, _)| pick(*i)).map(|(_, &x)| table[usize::from(x)]).collect()
        }
        Samples::U16(v) => v.iter().enumerate().filter(|(i, _)| pick(*i)).map(|(_, &x)| change(f32::from(x) / 65535.0)).collect(),
        Samples::F16(v) => v.iter().enumerate().filter(|(i, _)| pick(*i)).map(|(_, &x)| change(x.to_f32())).collect(),
        Samples::F32(v) => v.iter().enumerate().filter(|(i, _)| pick(*i)).map(|(_, &x)| change(x)).collect(),
    };
    ImageData { width: image.width, height: image.height, channels: colors, samples: Samples::F16(samples) }
}

/// A value of the sRGB curve as a linear one.
fn linear(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_lose_their_alpha_and_their_curve() {
        let image = ImageData { width: 1, height: 1, channels: 4, samples: Samples::U8(vec![255, 188, 0, 7]) };
        let out = recolored_image(&image, true, &|x| x);
        let Samples::F16(values) = &out.samples else { panic!("not half floats") };
        assert_eq!((out.channels, values.len()), (3, 3));
        assert!((values[1].to_f32() - 0.5).abs() < 5e-3);
    }
}
