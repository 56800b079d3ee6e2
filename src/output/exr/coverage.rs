//! Layers made of what covers pixels: mattes and numbers of objects, materials and instances.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

use rayon::prelude::*;

use crate::film::{Coverage, Identities, LayerKind, ShapeKey};
use crate::output::cryptomatte::{self, fill_ranks};

/// Pixels per piece of work.
const PIXELS: usize = 1 << 14;

/// A matte with its names.
pub struct Matte {
    /// Its type, such as `CryptoObject`.
    pub name: &'static str,
    /// Full names of the channels.
    pub channels: Vec<String>,
    /// Ids and coverages of each pixel in turn.
    pub data: Vec<f32>,
    /// Names to ids, as JSON.
    pub manifest: String,
}

impl Matte {
    /// The attributes of a file that describe the matte, with the names in it.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let mut attributes = self.description();
        attributes.push(self.attribute("manifest", &self.manifest));
        attributes
    }

    /// [`metadata`](Self::metadata) without the names.
    pub fn description(&self) -> Vec<(String, String)> {
        let words = [("name", self.name), ("hash", cryptomatte::HASH), ("conversion", cryptomatte::CONVERSION)];
        words.map(|(word, value)| self.attribute(word, value)).to_vec()
    }

    /// One attribute.
    pub fn attribute(&self, word: &str, value: &str) -> (String, String) {
        (format!("cryptomatte/{}/{word}", cryptomatte::metadata_key(self.name)), value.to_owned())
    }
}

/// The Cryptomatte of a layer with `depth` ranks; `None` for other layers.
pub fn matte(kind: LayerKind, coverage: &Coverage, identities: &Identities, depth: usize) -> Option<Matte> {
    let name = type_name(kind)?;
    let names = names_of(coverage, |key| name_of(kind, identities, key));
    let bits: HashMap<ShapeKey, u32> = names.iter().map(|(key, name)| (*key, cryptomatte::id_bits(name))).collect();
    let mut data = vec![0.0; coverage.pixels() * depth * 2];
    data.par_chunks_mut(PIXELS * depth * 2).enumerate().for_each(|(piece, out)| {
        let mut entries = Vec::new();
        for (i, ranks) in out.chunks_exact_mut(depth * 2).enumerate() {
            let covered = coverage.of(piece * PIXELS + i).iter();
            entries.extend(covered.filter_map(|(key, share)| Some((*bits.get(key)?, *share))));
            fill_ranks(&mut entries, ranks);
        }
    });
    let channels = (0..depth * 2).map(|i| cryptomatte::channel_name(name, i / 4, i % 4)).collect();
    Some(Matte { name, channels, data, manifest: cryptomatte::manifest(names.values().map(String::as_str)) })
}

/// Numbers of things, with their names.
pub struct Numbers {
    /// The number of what covers most of each pixel, 0 for nothing.
    pub data: Vec<f32>,
    /// Names to numbers of what is seen, as JSON.
    pub names: String,
}

/// Numbers of what covers most of each pixel; `None` for layers of another kind.
pub fn numbers(kind: LayerKind, coverage: &Coverage, identities: &Identities) -> Option<Numbers> {
    if !matches!(kind, LayerKind::ObjectId | LayerKind::MaterialId | LayerKind::InstanceId) {
        return None;
    }
    let names = names_of(coverage, |key| name_of(kind, identities, key));
    let table = table(kind, identities);
    let number = |key: ShapeKey, name: &str| match kind {
        LayerKind::InstanceId if [ShapeKey::NO_INSTANCE, ShapeKey::MEDIUM].contains(&key.instance) => 0,
        LayerKind::InstanceId => key.instance + 1,
        _ => table.get(name).copied().unwrap_or(0),
    };
    let numbers: HashMap<ShapeKey, u32> = names.iter().map(|(key, name)| (*key, number(*key, name))).collect();
    let of_pixel = |pixel: usize| {
        let first = coverage.of(pixel).iter().find(|(key, _)| *key != ShapeKey::NONE);
        first.and_then(|(key, _)| numbers.get(key)).map_or(0.0, |number| *number as f32)
    };
    let data = (0..coverage.pixels()).into_par_iter().map(of_pixel).collect();
    let seen: BTreeMap<&str, u32> =
        names.iter().map(|(key, name)| (name.as_str(), numbers[key])).filter(|(_, n)| *n > 0).collect();
    Some(Numbers { data, names: serde_json::to_string(&seen).unwrap_or_default() })
}

fn type_name(kind: LayerKind) -> Option<&'static str> {
    let [object, material, asset] = cryptomatte::TYPES;
    match kind {
        LayerKind::CryptoObject => Some(object),
        LayerKind::CryptoMaterial => Some(material),
        LayerKind::CryptoAsset => Some(asset),
        _ => None,
    }
}

fn name_of(kind: LayerKind, identities: &Identities, key: ShapeKey) -> Cow<'_, str> {
    match kind {
        LayerKind::CryptoMaterial | LayerKind::MaterialId => Cow::Borrowed(identities.material(key)),
        LayerKind::CryptoAsset => identities.asset(key),
        _ => identities.object(key),
    }
}

/// The names of all that is seen; what has none is left out.
fn names_of<'a>(coverage: &Coverage, name: impl Fn(ShapeKey) -> Cow<'a, str>) -> BTreeMap<ShapeKey, String> {
    let mut names = BTreeMap::new();
    let mut last = ShapeKey::NONE;
    for pixel in 0..coverage.pixels() {
        for &(key, _) in coverage.of(pixel) {
            // Neighbours mostly show the same.
            if key != last {
                last = key;
                names.entry(key).or_insert_with(|| name(key).into_owned());
            }
        }
    }
    names.retain(|_, name| !name.is_empty());
    names
}

/// Numbers from 1 for every name of the scene, seen or not, so that they are the same in all its pictures.
fn table(kind: LayerKind, identities: &Identities) -> HashMap<String, u32> {
    let instances = (0..identities.instances()).map(|instance| ShapeKey { instance, shape: u32::MAX });
    let shapes = (0..identities.shapes()).map(|shape| ShapeKey { instance: ShapeKey::NO_INSTANCE, shape });
    let media = (0..identities.media()).map(|medium| ShapeKey { instance: ShapeKey::MEDIUM, shape: medium });
    let mut table = HashMap::new();
    for key in instances.chain(shapes).chain(media) {
        let name = name_of(kind, identities, key);
        let next = table.len() as u32 + 1;
        if !name.is_empty() && !table.contains_key(&*name) {
            table.insert(name.into_owned(), next);
        }
    }
    table
}
