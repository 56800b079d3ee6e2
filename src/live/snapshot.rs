//! A picture on its way to viewers.

use crate::film::{Crop, Image};
use crate::output::{ExrLayers, NamedLayer};

/// A copy of a picture, shared by all that show it.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Samples per pixel in it, if known.
    pub spp: Option<u32>,
    /// What the layers hold.
    crop: Crop,
    overscan: u32,
    pub(super) layers: Vec<NamedLayer>,
}

impl Snapshot {
    /// A copy of a picture with its samples per pixel.
    pub fn new(image: &Image, spp: u32) -> Self {
        // Layers that only files have are here without values. What no name can hold is replaced.
        let layers = image.layers.iter().filter(|layer| !layer.data.is_empty()).map(|layer| NamedLayer {
            names: layer.channel_names().iter().map(|name| name.replace('\0', "_")).collect(),
            data: layer.data.clone(),
        });
        Self { spp: Some(spp), crop: image.crop, overscan: image.overscan, layers: layers.collect() }
    }

    /// The picture of a file.
    pub fn of_file(file: ExrLayers) -> Self {
        Self { spp: None, crop: file.crop, overscan: 0, layers: file.layers }
    }

    /// Every layer, the colour first.
    pub fn layers(&self) -> impl Iterator<Item = &NamedLayer> {
        self.layers.iter()
    }

    /// The first layer as a picture in linear light; gray is red, green and blue at once.
    pub fn color(&self) -> Image {
        let pixels = self.layers.first().map(|layer| layer.data.chunks_exact(layer.names.len()));
        let color = |pixel: &[f32]| match *pixel {
            [r, g, b, ..] => [r, g, b, 1.0],
            [y, ..] => [y, y, y, 1.0],
            [] => [0.0; 4],
        };
        Image::of_color(self.size(), pixels.into_iter().flatten().flat_map(color).collect())
    }

    /// The names of all channels, layer by layer.
    pub fn all_names(&self) -> impl Iterator<Item = &str> {
        self.layers.iter().flat_map(|layer| &layer.names).map(String::as_str)
    }

    /// Width and height of the part that the layers hold, in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.crop.width, self.crop.height]
    }

    /// Where the upper left corner of what the layers hold is in the picture to be shown; negative within the overscan.
    pub fn origin(&self) -> [i64; 2] {
        [self.crop.x, self.crop.y].map(|x| i64::from(x) - i64::from(self.overscan))
    }

    /// Whether another has the same size and channels.
    pub fn is_shaped_like(&self, other: &Self) -> bool {
        self.crop == other.crop && self.all_names().eq(other.all_names())
    }

    /// What to call a layer with these channels: what is before the last dot, or the channel if there is only one;
    /// `color` for the picture itself.
    pub fn title(names: &[String]) -> &str {
        match names {
            [] => "",
            [first, rest @ ..] => match (first.rsplit_once('.'), rest.is_empty()) {
                (Some((title, _)), _) => title,
                (None, true) => first,
                (None, false) => "color",
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Layer, LayerKind};

    #[test]
    fn layers_are_called_by_what_their_channels_share() {
        let title =
            |names: &[&str]| Snapshot::title(&names.iter().map(ToString::to_string).collect::<Vec<_>>()).to_owned();
        assert_eq!(title(&["R", "G", "B", "A"]), "color");
        assert_eq!(
            (title(&["Z"]), title(&["N.X", "N.Y", "N.Z"]), title(&["stats.samples"])),
            ("Z".into(), "N".into(), "stats".into())
        );
        assert_eq!(title(&["View.Combined.R", "View.Combined.G", "View.Combined.B"]), "View.Combined");
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
