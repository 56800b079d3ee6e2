//! What a file says of itself.

use std::cell::OnceCell;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use exr::meta::attribute::{AttributeValue, SampleType, Text};
use exr::meta::header::Header;
use exr::prelude::{FlatImage, ReadChannels, ReadLayers, read};

use crate::error::{Error, Result};
use crate::file;
use crate::file::exr_headers::read_headers;
use crate::output::role::Role;

/// A file's headers, and its pixels if a rule asks for them.
pub struct ExrFile {
    pub path: PathBuf,
    pub headers: Vec<Header>,
    pixels: OnceCell<Option<FlatImage>>,
}

/// A channel of a file.
pub struct Channel<'a> {
    pub part: usize,
    pub name: String,
    pub sample_type: SampleType,
    pub role: Role,
    pub header: &'a Header,
}

impl ExrFile {
    pub fn read(path: &Path) -> Result<Self> {
        let open = || file::open(path).map_err(|e| Error::Missing { file: path.into(), message: e.to_string() });
        let malformed = |e: exr::error::Error| Error::Malformed { file: path.into(), message: e.to_string() };
        open()?;
        let headers = read_headers(path).map_err(|message| Error::Malformed { file: path.into(), message })?;
        if headers.is_empty() {
            return Err(Error::Malformed { file: path.into(), message: "there are no parts".into() });
        }
        let file = Self { path: path.into(), headers, pixels: OnceCell::new() };
        // Flat files are read as a whole, so that a truncated one is not called clean.
        if file.headers.iter().all(|header| !header.deep) {
            let image = match read_pixels(open()?) {
                // Of a compression that the library does not know, the headers can still be checked.
                Err(exr::error::Error::NotSupported(_)) => None,
                image => Some(image.map_err(malformed)?),
            };
            let _ = file.pixels.set(image);
        }
        Ok(file)
    }

    /// The channels of all parts.
    pub fn channels(&self) -> impl Iterator<Item = Channel<'_>> {
        self.headers.iter().enumerate().flat_map(|(part, header)| {
            header.channels.list.iter().map(move |channel| {
                let name = channel.name.to_string();
                Channel { part, role: Role::of(&name), name, sample_type: channel.sample_type, header }
            })
        })
    }

    /// All pixels, if the file is flat and its compression known.
    pub fn pixels(&self) -> Option<&FlatImage> {
        self.pixels.get_or_init(|| None).as_ref()
    }

    /// An attribute of a part that the format gives no fixed place.
    pub fn attribute(&self, part: usize, name: &str) -> Option<&AttributeValue> {
        let header = self.headers.get(part)?;
        let name = Text::from_bytes_unchecked(name.bytes().collect());
        header.own_attributes.other.get(&name).or_else(|| header.shared_attributes.other.get(&name))
    }

    /// As [`Self::attribute`], for text.
    pub fn text(&self, part: usize, name: &str) -> Option<String> {
        match self.attribute(part, name) {
            Some(AttributeValue::Text(text)) => Some(utf8(text)),
            _ => None,
        }
    }
}

/// Text as UTF-8, which the format does not demand but readers expect.
pub fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn read_pixels(source: impl Read + Seek) -> Result<FlatImage, exr::error::Error> {
    read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes().from_unbuffered(source)
}
