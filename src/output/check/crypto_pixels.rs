//! Rules about the pixels of Cryptomatte's channels.

use std::collections::BTreeSet;

use super::Fault;
use super::crypto::{Matte, distinct};
use super::file::ExrFile;
use crate::file::exr_blocks::Place;
use crate::output::cryptomatte::{self, is_ordinary, layer_of};

/// How far the coverage of a pixel may exceed 1 by rounding.
const SLACK: f32 = 1e-3;

/// A matte's ranks, layer by layer.
struct Ranks<'f> {
    part: usize,
    name: String,
    /// Ids and coverages in turn, each a picture.
    planes: Vec<&'f [f32]>,
    /// The ids of the manifest, if there is one.
    known: Option<BTreeSet<u32>>,
}

impl Ranks<'_> {
    fn pixels(&self) -> usize {
        self.planes.iter().map(|plane| plane.len()).min().unwrap_or(0)
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

/// The channels of a matte, by layer and component: its ranks in order.
fn places_of(file: &ExrFile, name: &str) -> Vec<((usize, usize), Place)> {
    let mut places = Vec::new();
    for (part, header) in file.headers.iter().enumerate() {
        for (channel, description) in header.channels.list.iter().enumerate() {
            let Some((number, suffix)) = layer_of(name, &description.name.to_string()) else { continue };
            let Some(component) = ["r", "g", "b", "a"].iter().position(|s| suffix.eq_ignore_ascii_case(s)) else {
                continue;
            };
            places.push(((number, component), Place { part, channel }));
        }
    }
    places.sort_by_key(|(rank, _)| *rank);
    places
}

/// The channels whose pixels are read, each once.
pub fn places(file: &ExrFile) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    for (_, place) in distinct(file).iter().filter_map(Matte::name).flat_map(|name| places_of(file, name)) {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places
}

fn ranks(file: &ExrFile) -> Vec<Ranks<'_>> {
    let read = |matte: Matte| {
        let name = matte.name()?.to_owned();
        let places = places_of(file, &name);
        let part = places.first()?.1.part;
        let whole = places.iter().enumerate().all(|(i, (rank, _))| *rank == (i / 4, i % 4));
        let planes: Option<Vec<&[f32]>> = places.iter().map(|(_, place)| file.plane(*place)).collect();
        let known = matte.manifest(file).and_then(|text| cryptomatte::parse_manifest(&text).ok());
        let known = known.map(|names| names.into_values().collect());
        planes.filter(|_| whole).map(|planes| Ranks { part, name, planes, known })
    };
    distinct(file).into_iter().filter_map(read).collect()
}

fn each(file: &ExrFile, check: impl Fn(&Ranks) -> Option<Fault>) -> Vec<Fault> {
    ranks(file).iter().filter_map(check).collect()
}

pub fn ids(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| {
        ranks.fault("ids that are no ordinary floats", |pairs| {
            pairs.iter().any(|&(id, _)| id != 0.0 && !is_ordinary(id.to_bits()))
        })
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
    each(file, |ranks| {
        ranks.fault("coverage of the id 0", |pairs| pairs.iter().any(|&(id, coverage)| id == 0.0 && coverage > 0.0))
    })
}

pub fn unknown(file: &ExrFile) -> Vec<Fault> {
    each(file, |ranks| {
        let known = ranks.known.as_ref()?;
        let strange = |id: f32| id != 0.0 && is_ordinary(id.to_bits()) && !known.contains(&id.to_bits());
        ranks.fault("ids that the manifest does not have", |pairs| {
            pairs.iter().any(|&(id, coverage)| coverage > 0.0 && strange(id))
        })
    })
}
