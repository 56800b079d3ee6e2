//! The headers of a file.

use std::io::BufReader;
use std::path::{Path, PathBuf};

use exr::meta::attribute::{AttributeValue, SampleType, Text};
use exr::meta::header::Header;

use super::crypto_pixels;
use crate::error::{Error, Result};
use crate::file;
use crate::file::exr_blocks::{ChannelRow, Place, allocate, read_rows};
use crate::file::exr_headers::read_headers;
use crate::output::role::Role;

/// A file's headers, and the pixels that rules check.
pub struct ExrFile {
    pub path: PathBuf,
    pub headers: Vec<Header>,
    /// The samples of channels of mattes; empty if the file is deep or of a compression that the library does not
    /// support.
    planes: Vec<(Place, Vec<f32>)>,
}

/// A channel of a file.
pub(crate) struct Channel<'a> {
    pub part: usize,
    pub name: String,
    pub sample_type: SampleType,
    pub role: Role,
    pub header: &'a Header,
}

impl ExrFile {
    /// Reads a file's headers, and its pixels block by block: only those of mattes are kept.
    pub fn read(path: &Path) -> Result<Self> {
        let source = file::open(path).map_err(|e| Error::Missing { file: path.into(), message: e.to_string() })?;
        let malformed = |message: String| Error::Malformed { file: path.into(), message };
        let headers = read_headers(path).map_err(malformed)?;
        if headers.is_empty() {
            return Err(malformed("no parts".into()));
        }
        let mut file = Self { path: path.into(), headers, planes: Vec::new() };
        // Flat files are decoded as a whole, so that a truncated one is not called clean.
        if file.headers.iter().all(|header| !header.deep) {
            let requested = crypto_pixels::places(&file);
            let plane = |place: &Place| allocate(path, &file.headers[place.part], 1, 0.0);
            let mut planes = requested.iter().map(plane).collect::<Result<Vec<Vec<f32>>>>()?;
            let keep = |row: ChannelRow| row.write(planes[row.requested][row.start..].iter_mut(), |v| v);
            match read_rows(BufReader::new(source), &file.headers, &requested, true, keep) {
                // With an unsupported compression, the headers can still be checked.
                Err(exr::error::Error::NotSupported(_)) => {}
                result => {
                    result.map_err(|e| malformed(e.to_string()))?;
                    file.planes = requested.into_iter().zip(planes).collect();
                }
            }
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

    /// The samples of a channel of a matte, row by row.
    pub fn plane(&self, place: Place) -> Option<&[f32]> {
        self.planes.iter().find(|(other, _)| *other == place).map(|(_, plane)| plane.as_slice())
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
