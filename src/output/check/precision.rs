//! Rules about pixel types and compression.

use exr::compression::Compression;
use exr::meta::attribute::SampleType;

use super::Fault;
use super::file::{Channel, ExrFile};
use crate::output::role::Role;

fn each(file: &ExrFile, what: impl Fn(&Channel) -> Option<String>) -> Vec<Fault> {
    file.channels()
        .filter_map(|channel| what(&channel).map(|what| Fault::channel(channel.part, channel.name, what)))
        .collect()
}

pub fn half_data(file: &ExrFile) -> Vec<Fault> {
    each(file, |c| (c.role == Role::Precise && c.sample_type == SampleType::F16).then(|| "stored as half".to_owned()))
}

pub fn half_ids(file: &ExrFile) -> Vec<Fault> {
    each(file, |c| (c.role == Role::Id && c.sample_type == SampleType::F16).then(|| "stored as half".to_owned()))
}

pub fn crypto_type(file: &ExrFile) -> Vec<Fault> {
    each(file, |c| {
        let name = match c.sample_type {
            SampleType::F16 => "half",
            SampleType::U32 => "uint",
            SampleType::F32 => return None,
        };
        (c.role == Role::Crypto).then(|| format!("stored as {name}"))
    })
}

pub fn dwa(file: &ExrFile) -> Vec<Fault> {
    each(file, |c| {
        let lossy = matches!(c.header.compression, Compression::DWAA(_) | Compression::DWAB(_));
        if !lossy || !c.role.is_data() {
            return None;
        }
        let suffix = c.name.rsplit('.').next().unwrap_or_default();
        let exact = ["R", "G", "B", "Y", "BY", "RY"].contains(&suffix);
        let old = ["r", "g", "b", "y"].contains(&suffix);
        Some(match (exact, old) {
            (true, _) => format!("{} rounds it, since its name ends with {suffix}", c.header.compression),
            (_, true) => {
                format!("{} of older programs rounds it, since its name ends with {suffix}", c.header.compression)
            }
            _ => format!("it lies in a part compressed with {}", c.header.compression),
        })
    })
}

pub fn pxr24(file: &ExrFile) -> Vec<Fault> {
    each(file, |c| {
        let cut = c.header.compression == Compression::PXR24 && c.sample_type == SampleType::F32 && c.role.is_data();
        cut.then(|| "cut to 24 bits by pxr24".to_owned())
    })
}

pub fn b44(file: &ExrFile) -> Vec<Fault> {
    each(file, |c| {
        let lossy = matches!(c.header.compression, Compression::B44 | Compression::B44A);
        (lossy && c.sample_type == SampleType::F16 && c.role.is_data())
            .then(|| "rounded in blocks of four by four".to_owned())
    })
}
