//! A picture on its way to viewers.

use crate::film::{Image, Layer};

/// A copy of a picture, shared by all that show it.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The picture.
    pub image: Image,
    /// Samples per pixel in it.
    pub spp: u32,
    /// The full names of the channels of every layer, as in EXR files.
    names: Vec<Vec<String>>,
}

impl Snapshot {
    /// A copy of a picture with its samples per pixel.
    pub fn new(image: &Image, spp: u32) -> Self {
        // Layers that only files have are here without values.
        let layers: Vec<Layer> = image.layers.iter().filter(|layer| !layer.data.is_empty()).cloned().collect();
        let names = layers.iter().map(channel_names).collect();
        Self {
            image: Image { size: image.size, crop: image.crop, overscan: image.overscan, layers, coverage: None },
            spp,
            names,
        }
    }

    /// Every layer with the full names of its channels.
    pub fn layers(&self) -> impl Iterator<Item = (&Layer, &[String])> {
        self.image.layers.iter().zip(self.names.iter().map(Vec::as_slice))
    }

    /// The names of all channels, layer by layer.
    pub fn all_names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().flatten().map(String::as_str)
    }

    /// Width and height of the part that the layers hold, in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.image.crop.width, self.image.crop.height]
    }

    /// Where the upper left corner of what the layers hold is in the picture to be shown; negative within the overscan.
    pub fn origin(&self) -> [i64; 2] {
        [self.image.crop.x, self.image.crop.y].map(|x| i64::from(x) - i64::from(self.image.overscan))
    }

    /// Whether another has the same size and channels.
    pub fn is_shaped_like(&self, other: &Self) -> bool {
        self.image.crop == other.image.crop && self.names == other.names
    }

    /// What to call a layer with these channels: what is before the dot, or the channel if there is only one; `color`
    /// for the picture itself.
    pub fn title(names: &[String]) -> &str {
        match names {
            [] => "",
            [first, rest @ ..] => match (first.split_once('.'), rest.is_empty()) {
                (Some((title, _)), _) => title,
                (None, true) => first,
                (None, false) => "color",
            },
        }
    }
}

/// The names of a layer's channels; what no name can hold is replaced.
fn channel_names(layer: &Layer) -> Vec<String> {
    layer.channel_names().iter().map(|name| name.replace('\0', "_")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Crop, LayerKind};

    #[test]
    fn layers_are_called_by_what_their_channels_share() {
        let title =
            |names: &[&str]| Snapshot::title(&names.iter().map(ToString::to_string).collect::<Vec<_>>()).to_owned();
        assert_eq!(title(&["R", "G", "B", "A"]), "color");
        assert_eq!(
            (title(&["Z"]), title(&["N.X", "N.Y", "N.Z"]), title(&["stats.samples"])),
            ("Z".into(), "N".into(), "stats".into())
        );
    }

    #[test]
    fn a_copy_has_what_can_be_shown() {
        let layers = vec![
            Layer { kind: LayerKind::LightGroups, group: Some("key\0".to_owned()), data: vec![1.0; 3] },
            Layer::new(LayerKind::CryptoObject, Vec::new()),
        ];
        let crop = Crop { x: 5, y: 1, width: 1, height: 1 };
        let snapshot = Snapshot::new(&Image { size: [8, 8], crop, overscan: 2, layers, ..Image::default() }, 3);
        assert_eq!(snapshot.all_names().collect::<Vec<_>>(), ["light_key_.R", "light_key_.G", "light_key_.B"]);
        assert_eq!((snapshot.origin(), snapshot.size(), snapshot.layers().count()), ([3, -1], [1, 1], 1));
    }
}
