//! Rules about Cryptomatte's channels and metadata.

use std::collections::{BTreeMap, BTreeSet};

use super::Fault;
use super::file::{ExrFile, utf8};
use crate::output::cryptomatte::{self, layer_of};
use crate::output::role::Role;

/// A matte that metadata describes.
pub(crate) struct Matte {
    pub part: usize,
    pub key: String,
    /// By the attribute's last word.
    pub entries: BTreeMap<String, String>,
}

impl Matte {
    pub fn name(&self) -> Option<&str> {
        self.entries.get("name").map(String::as_str)
    }

    /// The manifest's text: embedded, or from the file beside the picture.
    pub fn manifest(&self, file: &ExrFile) -> Option<String> {
        self.entries.get("manifest").cloned().or_else(|| {
            let beside = file.path.parent()?.join(self.entries.get("manif_file")?);
            crate::file::read_to_string(&beside).ok()
        })
    }
}

/// What metadata describes, once for each part that has it.
pub fn mattes(file: &ExrFile) -> Vec<Matte> {
    let mut mattes: BTreeMap<(usize, String), BTreeMap<String, String>> = BTreeMap::new();
    for (part, header) in file.headers.iter().enumerate() {
        for (name, value) in &header.own_attributes.other {
            let name = utf8(name);
            let Some((key, word)) = name.strip_prefix("cryptomatte/").and_then(|rest| rest.split_once('/')) else {
                continue;
            };
            let exr::meta::attribute::AttributeValue::Text(text) = value else { continue };
            mattes.entry((part, key.to_owned())).or_default().insert(word.to_owned(), utf8(text));
        }
    }
    mattes.into_iter().map(|((part, key), entries)| Matte { part, key, entries }).collect()
}

/// Each matte once, whichever parts describe it.
pub fn distinct(file: &ExrFile) -> Vec<Matte> {
    let mut seen = BTreeSet::new();
    mattes(file).into_iter().filter(|matte| seen.insert(matte.entries.clone())).collect()
}

fn each(mattes: Vec<Matte>, what: impl Fn(&Matte) -> Option<String>) -> Vec<Fault> {
    let fault =
        |matte: &Matte| what(matte).map(|what| Fault::part(matte.part, format!("cryptomatte/{}: {what}", matte.key)));
    mattes.iter().filter_map(fault).collect()
}

pub fn described(file: &ExrFile) -> Vec<Fault> {
    let mattes = mattes(file);
    let lacking = each(mattes, |matte| {
        let lacks: Vec<&str> =
            ["name", "hash", "conversion"].into_iter().filter(|word| !matte.entries.contains_key(*word)).collect();
        (!lacks.is_empty()).then(|| format!("it lacks {}", lacks.join(" and ")))
    });
    let described: BTreeSet<String> =
        distinct(file).iter().filter_map(|matte| matte.name().map(str::to_owned)).collect();
    let mut passes = BTreeMap::new();
    for channel in file.channels().filter(|channel| channel.role == Role::Crypto) {
        let pass = channel.name.rsplit_once('.').map_or("", |(pass, _)| pass);
        let name = pass.trim_end_matches(|c: char| c.is_ascii_digit());
        if !described.contains(name) {
            passes.entry(name.to_owned()).or_insert(channel.part);
        }
    }
    let undescribed =
        passes.into_iter().map(|(name, part)| Fault::channel(part, name, "no metadata describes these channels"));
    lacking.into_iter().chain(undescribed).collect()
}

pub fn channels(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let name = matte.name()?;
        let mut layers: BTreeMap<usize, BTreeSet<String>> = BTreeMap::new();
        for (layer, suffix) in file.channels().filter_map(|channel| layer_of(name, &channel.name)) {
            layers.entry(layer).or_default().insert(suffix.to_lowercase());
        }
        if layers.is_empty() {
            return Some(format!("no channels {name}00.r and so on"));
        }
        if let Some(lost) = (0..layers.len()).find(|layer| !layers.contains_key(layer)) {
            return Some(format!("the layer {name}{lost:02} is missing"));
        }
        let poor = layers
            .into_iter()
            .find(|(_, suffixes)| !["r", "g", "b", "a"].iter().all(|suffix| suffixes.contains(*suffix)));
        poor.map(|(layer, suffixes)| {
            format!("{name}{layer:02} has only the channels {}", suffixes.into_iter().collect::<Vec<_>>().join(", "))
        })
    })
}

pub fn suffixes(file: &ExrFile) -> Vec<Fault> {
    let odd = file.channels().filter(|channel| channel.role == Role::Crypto).filter_map(|channel| {
        let suffix = channel.name.rsplit('.').next().unwrap_or_default().to_owned();
        let known = ["r", "g", "b", "a"].contains(&suffix.as_str());
        (!known).then(|| Fault::channel(channel.part, channel.name, format!("the suffix is {suffix}")))
    });
    odd.collect()
}

pub fn key(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let expected = cryptomatte::metadata_key(matte.name()?);
        (matte.key != expected).then(|| format!("the key of {} is {expected}", matte.name().unwrap_or_default()))
    })
}

pub fn method(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let wrong = |word: &str, expected: &str| {
            let value = matte.entries.get(word)?;
            (value != expected).then(|| format!("{word} is {value}"))
        };
        wrong("hash", cryptomatte::HASH).or_else(|| wrong("conversion", cryptomatte::CONVERSION))
    })
}

pub fn manifest_there(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let there = ["manifest", "manif_file"].iter().any(|word| matte.entries.contains_key(*word));
        (!there).then(|| "no manifest".to_owned())
    })
}

pub fn manifest_form(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| cryptomatte::parse_manifest(&matte.manifest(file)?).err())
}

pub fn manifest_ids(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let names = cryptomatte::parse_manifest(&matte.manifest(file)?).ok()?;
        let faults: Vec<String> = names.iter().filter_map(|(name, bits)| cryptomatte::id_fault(name, *bits)).collect();
        let more = if faults.len() > 1 { format!(" (and {} more)", faults.len() - 1) } else { String::new() };
        faults.first().map(|first| format!("{first}{more}"))
    })
}

pub fn sidecar_path(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let path = matte.entries.get("manif_file")?;
        let steps = path.split('/').any(|step| [".", ".."].contains(&step));
        let fits = !path.starts_with('/') && !path.contains(['\\', ':']) && !steps && path.ends_with(".json");
        (!fits).then(|| format!("manif_file is \"{path}\""))
    })
}

pub fn sidecar_there(file: &ExrFile) -> Vec<Fault> {
    each(distinct(file), |matte| {
        let path = matte.entries.get("manif_file")?;
        let lost = !matte.entries.contains_key("manifest") && matte.manifest(file).is_none();
        lost.then(|| format!("the file \"{path}\" cannot be read"))
    })
}
