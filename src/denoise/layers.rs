//! Layers of an EXR file by name, whoever wrote it.

use ::exr::prelude::{FlatImage, Vec2};

use crate::file::exr_blocks::Place;

/// Three channels of one part.
pub(crate) type Rgb = [Place; 3];

/// How three channels may be called.
const TRIPLES: [[&str; 3]; 3] = [["r", "g", "b"], ["x", "y", "z"], ["red", "green", "blue"]];

/// The layers of a file that have three channels.
pub struct Layers<'f> {
    file: &'f FlatImage,
    /// Name before the last dot (empty for bare channels) and place.
    triples: Vec<(String, Rgb)>,
}

impl<'f> Layers<'f> {
    pub fn new(file: &'f FlatImage) -> Self {
        let mut triples: Vec<(String, Rgb)> = Vec::new();
        for (part, layer) in file.layer_data.iter().enumerate() {
            let names: Vec<String> = layer.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
            let find = |prefix: &str, name: &str| {
                names
                    .iter()
                    .position(|full| split(full).0 == prefix && split(full).1.eq_ignore_ascii_case(name))
                    .map(|channel| Place { part, channel })
            };
            let mut prefixes: Vec<&str> = names.iter().map(|name| split(name).0).collect();
            prefixes.sort_unstable();
            prefixes.dedup();
            for prefix in prefixes {
                for triple in TRIPLES {
                    let [r, g, b] = triple.map(|name| find(prefix, name));
                    if let (Some(r), Some(g), Some(b)) = (r, g, b) {
                        triples.push((prefix.to_owned(), [r, g, b]));
                    }
                }
            }
        }
        Self { file, triples }
    }

    /// The picture and what its channels' names begin with, the dot included: bare channels, else a layer "Combined",
    /// else the first with the shortest name; parts and layers with a name among `others` are something else.
    pub fn picture(&self, others: &[&str]) -> Result<(String, Rgb), String> {
        let is_other = |name: &str| others.iter().any(|other| ends_with_layer(&name.to_lowercase(), other));
        let is_color = |rgb: &Rgb| !matches!(self.letter(rgb[0]).as_str(), "x");
        let mut found: Vec<&(String, Rgb)> = self
            .triples
            .iter()
            .filter(|(name, rgb)| {
                is_color(rgb) && !is_other(name) && !(name.is_empty() && is_other(&self.part_name(rgb[0].part)))
            })
            .collect();
        // The sort is stable: of equals the first in the file.
        found.sort_by_key(|(name, _)| (!name.is_empty(), !name.contains("ombined"), name.len()));
        let (name, rgb) =
            found.first().ok_or_else(|| format!("no channels R, G and B; it has {}", self.channel_names()))?;
        for place in rgb {
            let channel = &self.file.layer_data[place.part].channel_data.list[place.channel];
            if channel.sampling != Vec2(1, 1) {
                return Err(format!("channel {} is subsampled", channel.name));
            }
        }
        Ok((if name.is_empty() { String::new() } else { format!("{name}.") }, *rgb))
    }

    /// The alpha beside a picture.
    pub fn alpha(&self, prefix: &str, color: Rgb) -> Option<Place> {
        let part = color[0].part;
        let list = &self.file.layer_data[part].channel_data.list;
        let is_alpha = |name: &str| {
            name.strip_prefix(prefix)
                .is_some_and(|rest| rest.eq_ignore_ascii_case("a") || rest.eq_ignore_ascii_case("alpha"))
        };
        let channel = list.iter().position(|channel| is_alpha(&channel.name.to_string()))?;
        (list[channel].sampling == Vec2(1, 1)).then_some(Place { part, channel })
    }

    /// The layers of the same part as the picture, with their names, but not the picture itself.
    pub fn all_of(&self, color: Rgb) -> impl Iterator<Item = (String, Rgb)> + '_ {
        self.triples.iter().filter(move |(_, rgb)| rgb[0].part == color[0].part && *rgb != color).cloned()
    }

    /// The layer with the first of these names, in lower case, that there is: of channels, or of a part with bare
    /// channels. A name may follow others and a dot.
    ///
    /// # Errors
    /// If its window is not that of the picture.
    pub fn named(&self, names: &[&str], color: Rgb) -> Result<Option<Rgb>, String> {
        let full = |name: &str, rgb: &Rgb| if name.is_empty() { self.part_name(rgb[0].part) } else { name.to_owned() };
        let matches = |requested: &str| {
            self.triples
                .iter()
                .find(|(name, rgb)| *rgb != color && ends_with_layer(&full(name, rgb).to_lowercase(), requested))
        };
        let Some((name, rgb)) = names.iter().find_map(|requested| matches(requested)) else { return Ok(None) };
        let [own, picture] = [rgb[0].part, color[0].part].map(|part| &self.file.layer_data[part]);
        if own.size != picture.size || own.attributes.layer_position != picture.attributes.layer_position {
            return Err(format!("layer {} has another data window than the picture", full(name, rgb)));
        }
        let subsampled = rgb
            .iter()
            .any(|place| self.file.layer_data[place.part].channel_data.list[place.channel].sampling != Vec2(1, 1));
        if subsampled { Err(format!("layer {} is subsampled", full(name, rgb))) } else { Ok(Some(*rgb)) }
    }

    /// The message for a layer that is not there.
    pub fn no_layer(&self, name: &str) -> String {
        format!("no layer {name} with channels R, G, B or X, Y, Z; it has {}", self.channel_names())
    }

    fn channel_names(&self) -> String {
        let names: Vec<String> =
            self.file.layer_data.iter().flat_map(|part| &part.channel_data.list).map(|c| c.name.to_string()).collect();
        names.join(", ")
    }

    fn part_name(&self, part: usize) -> String {
        self.file.layer_data[part].attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default()
    }

    fn letter(&self, place: Place) -> String {
        let name = self.file.layer_data[place.part].channel_data.list[place.channel].name.to_string();
        split(&name).1.to_lowercase()
    }
}

/// The name before the last dot and that after it.
fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// Whether a name is that of a layer, alone or after others and a dot.
fn ends_with_layer(name: &str, layer: &str) -> bool {
    name == layer || name.strip_suffix(layer).is_some_and(|rest| rest.ends_with('.'))
}
