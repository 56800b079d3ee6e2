//! Bases of plastics with colours such that ours look like Mitsuba's, images included.

use std::path::Path;

use super::Reader;
use crate::desc::ColorDesc;
use crate::import::foreign::coat::Coat;
use crate::import::foreign::recolor::recolored;

impl Reader<'_> {
    /// The base of our plastic that looks like the base `color` of Mitsuba's.
    pub(super) fn plastic_base(&mut self, color: ColorDesc, ior: f32, alpha: f32, nonlinear: bool) -> ColorDesc {
        if !nonlinear && alpha == 0.0 {
            return color;
        }
        let key = [ior.to_bits(), alpha.to_bits()];
        let coat = *self.coats.entry(key).or_insert_with(|| Coat::new(f64::from(ior), f64::from(alpha)));
        let folder = self.scene.parent().unwrap_or(Path::new("")).to_owned();
        let change = |r: f32| coat.base(r, nonlinear);
        match color {
            ColorDesc::Grey(r) => ColorDesc::Grey(change(r)),
            ColorDesc::Rgb(color) => ColorDesc::Rgb(color.map(change)),
            ColorDesc::Texture { texture } => {
                let key = (texture.clone(), key, nonlinear);
                let done = match self.recolored.get(&key) {
                    Some(done) => done.clone(),
                    // What cannot be changed stays.
                    None => recolored(&mut self.draft, &folder, &texture, [1.0; 3], &change).unwrap_or_else(|| texture.clone()),
                };
                self.recolored.insert(key, done.clone());
                ColorDesc::Texture { texture: done }
            }
        }
    }
}
