//! Plastics: Mitsuba's base that changes its colour in the coat, and ours that does not.

use half::f16;

use super::Reader;
use crate::desc::{ColorDesc, ColorSpaceDesc, TextureDesc};
use crate::import::{ImageData, Samples, read_image};

/// The share of diffuse light inside of a smooth coat of index `ior` that it throws back inside.
pub fn internal_reflectance(ior: f64) -> f64 {
    // Midpoints in the squared cosine, by which diffuse light is uniform.
    const STEPS: usize = 4096;
    let outside: f64 = (0..STEPS).map(|i| fresnel(((i as f64 + 0.5) / STEPS as f64).sqrt(), ior)).sum::<f64>() / STEPS as f64;
    1.0 - (1.0 - outside) / (ior * ior)
}

/// Fresnel's reflectance of unpolarised light from outside.
fn fresnel(cosine: f64, ior: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (ior * ior)).max(0.0).sqrt();
    let s = (cosine - ior * inside) / (cosine + ior * inside);
    let p = (ior * cosine - inside) / (ior * cosine + inside);
    0.5 * (s * s + p * p)
}

/// What a base of reflectance `r` looks like whose light takes its colour again at each reflection within the coat: the base of one that does not.
fn recolored(r: f32, internal: f64) -> f32 {
    let r = f64::from(r);
    (r * (1.0 - internal) / (1.0 - r * internal)) as f32
}

impl Reader<'_> {
    /// The base of our plastic that looks like the base `color` of Mitsuba's with `nonlinear` set.
    pub(super) fn nonlinear(&mut self, color: ColorDesc, ior: f64) -> ColorDesc {
        let internal = internal_reflectance(ior);
        match color {
            ColorDesc::Grey(r) => ColorDesc::Grey(recolored(r, internal)),
            ColorDesc::Rgb(color) => ColorDesc::Rgb(color.map(|r| recolored(r, internal))),
            ColorDesc::Texture { texture } => ColorDesc::Texture { texture: self.recolored_texture(texture, internal) },
        }
    }

    fn recolored_texture(&mut self, name: String, internal: f64) -> String {
        let key = (name.clone(), internal.to_bits());
        if let Some(done) = self.baked.get(&key) {
            return done.clone();
        }
        let changed = match self.draft.desc.textures.get(&name).cloned() {
            Some(TextureDesc::Checker { color0, color1, scale }) => {
                let [color0, color1] = [color0, color1].map(|color| color.map(|r| recolored(r, internal)));
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
                    let file = self.draft.keep_image(&stem, recolored_image(&data, color_space == ColorSpaceDesc::Srgb, internal));
                    let color_space = ColorSpaceDesc::Linear;
                    TextureDesc::Image { file, color_space, filter, wrap, scale, rotation_degrees, offset, channel, invert }
                })
            }
            _ => None,
        };
        let Some(changed) = changed else {
            return name;
        };
        let done = self.draft.add_texture(&name, &format!("textures.{name}"), changed);
        self.baked.insert(key, done.clone());
        done
    }
}

/// An image as floats with its colours changed; alpha is left out.
fn recolored_image(image: &ImageData, is_srgb: bool, internal: f64) -> ImageData {
    let decode = |x: f32| if is_srgb { linear(x) } else { x };
    let change = |x: f32| f16::from_f32(recolored(decode(x), internal));
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
    fn glass_throws_most_diffuse_light_back_inside() {
        // Known value of the internal diffuse Fresnel reflectance at 1.5.
        assert!((internal_reflectance(1.5) - 0.5963).abs() < 2e-4, "{}", internal_reflectance(1.5));
        assert!(internal_reflectance(1.0).abs() < 1e-9);
    }

    #[test]
    fn a_white_base_stays_white_and_a_grey_one_gets_darker() {
        let internal = internal_reflectance(1.5);
        assert_eq!(recolored(1.0, internal), 1.0);
        assert_eq!(recolored(0.0, internal), 0.0);
        assert!((recolored(0.5, internal) - 0.2876).abs() < 1e-3);
    }

    #[test]
    fn images_lose_their_alpha_and_their_curve() {
        let image = ImageData { width: 1, height: 1, channels: 4, samples: Samples::U8(vec![255, 188, 0, 7]) };
        let out = recolored_image(&image, true, 0.0);
        let Samples::F16(values) = &out.samples else { panic!("not half floats") };
        assert_eq!((out.channels, values.len()), (3, 3));
        assert!((values[1].to_f32() - 0.5).abs() < 5e-3);
    }
}
