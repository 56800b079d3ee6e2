//! Rules about the pixels of Cryptomatte's channels.

use std::collections::BTreeSet;

use super::Fault;
use super::crypto::distinct;
use super::file::ExrFile;
use crate::output::cryptomatte::{self, is_ordinary, layer_of};

/// How far the coverage of a pixel may exceed 1 by rounding.
const SLACK: f32 = 1e-3;

/// A matte's ranks, layer by layer.
struct Ranks {
    part: usize,
    name: String,
    /// Ids and coverages in turn, each a picture.
    planes: Vec<Vec<f32>>,
    /// The ids of the manifest, if there is one.
    known: Option<BTreeSet<u32>>,
}

impl Ranks {
    fn pixels(&self) -> usize {
        self.planes.iter().map(Vec::len).min().unwrap_or(0)
    }

    /// The pairs of id and coverage of a pixel.
    fn at(&self, pixel: usize) -> impl Iterator<Item = (f32, f32)> + '_ {
        self.planes.chunks_exact(2).map(move |pair| (pair[0][pixel], pair[1][pixel]))
    }

    /// How many pixels break a rule, as a fault with the first one's place.
    fn fault(&self, what: &str, breaks: impl Fn(&[(f32, f32)]) -> bool) -> Option<Fault> {
        let mut pairs = Vec::new();
        let mut bad = (0..self.pixels()).filter(|&pixel| {
            pairs.clear();
            pairs.extend(self.at(pixel));
            breaks(&pairs)
        });
        let first = bad.next()?;
        let count = 1 + bad.count();
        let noun = if count == 1 { "pixel" } else { "pixels" };
        Some(Fault::channel(self.part, self.name.clone(), format!("{what} in {count} {noun}, first in number {first}")))
    }
}

fn ranks(file: &ExrFile) -> Vec<Ranks> {
    let Some(image) = file.pixels() else { return Vec::new() };
    let read = |matte: super::crypto::Matte| {
        let name = matte.name()?.to_owned();
        let mut planes = Vec::new();
        for (part, layer) in image.layer_data.iter().enumerate() {
            for channel in &layer.channel_data.list {
                let Some((number, suffix)) = layer_of(&name, &channel.name.to_string()) else { continue };
                let Some(place) = ["r", "g", "b", "a"].iter().position(|s| suffix.eq_ignore_ascii_case(s)) else { continue };
                planes.push((number, place, part, channel.sample_data.values_as_f32().collect::<Vec<f32>>()));
            }
        }
        planes.sort_by_key(|(number, place, ..)| (*number, *place));
        let part = planes.first()?.2;
        let whole = planes.iter().enumerate().all(|(i, (number, place, ..))| (*number, *place) == (i / 4, i % 4));
        let known = matte.manifest(file).and_then(|text| cryptomatte::parse_manifest(&text).ok());
        let known = known.map(|names| names.into_values().collect());
        whole.then(|| Ranks { part, name, planes: planes.into_iter().map(|(.., values)| values).collect(), known })
    };
    distinct(file).into_iter().filter_map(read).collect()
}

fn each(file: &ExrFile, check: impl Fn(&Ranks) -> Option<Fault>) -> Vec<Fault> {
    ranks(file).iter().filter_map(check).collect()
}

pub fn ids(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| {
        ranks.fault("ids that are no ordinary floats", |pairs| pairs.iter().any(|&(id, _)| id != 0.0 && !is_ordinary(id.to_bits())))
    })
}

pub fn coverage(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| {
        ranks.fault("coverage below 0 or above 1", |pairs| {
            let mut sum = 0.0;
            pairs.iter().any(|&(_, coverage)| {
                sum += coverage;
                !(coverage >= 0.0 && sum <= 1.0 + SLACK)
            })
        })
    })
}

pub fn order(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| {
        ranks.fault("coverage that grows with the rank", |pairs| {
            let mut last = f32::INFINITY;
            pairs.iter().any(|&(_, coverage)| std::mem::replace(&mut last, coverage) < coverage)
        })
    })
}

pub fn background(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| ranks.fault("coverage of the id 0", |pairs| pairs.iter().any(|&(id, coverage)| id == 0.0 && coverage > 0.0)))
}

pub fn unknown(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| {
        let known = ranks.known.as_ref()?;
        let strange = |id: f32| id != 0.0 && is_ordinary(id.to_bits()) && !known.contains(&id.to_bits());
        ranks.fault("ids that the manifest does not have", |pairs| pairs.iter().any(|&(id, coverage)| coverage > 0.0 && strange(id)))
    })
}
