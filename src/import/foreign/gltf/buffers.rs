//! Bytes: buffers in files, in data URIs and in the chunk of a GLB, and views of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::{Root, buffer};
use percent_encoding::percent_decode_str;

use crate::error::{Error, Result};

/// The bytes of every buffer.
#[derive(Debug)]
pub struct Buffers<'a> {
    list: Vec<Bytes<'a>>,
    /// The files that were read.
    pub files: Vec<PathBuf>,
}

#[derive(Debug)]
enum Bytes<'a> {
    Chunk(&'a [u8]),
    Read(Arc<Vec<u8>>),
    /// No URI: another extension would fill it.
    None,
}

/// A view of a buffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    pub bytes: &'a [u8],
    /// From one element to the next; the size of an element if not given.
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers.
    pub fn load(file: &Path, root: &Root, bin: Option<&'a [u8]>) -> Result<Self> {
        let mut files: BTreeMap<PathBuf, Arc<Vec<u8>>> = BTreeMap::new();
        let mut list = Vec::with_capacity(root.buffers.len());
        for (i, buffer) in root.buffers.iter().enumerate() {
            let fault = |message: String| Error::Scene { file: file.into(), path: format!("buffers[{i}]"), message };
            let length = buffer.byte_length.0;
            let bytes = match (&buffer.uri, bin) {
                (None, Some(bin)) if i == 0 => Bytes::Chunk(bin),
                (None, _) => Bytes::None,
                (Some(uri), _) => match Uri::parse(uri).map_err(fault)? {
                    Uri::Data(data) => Bytes::Read(Arc::new(data)),
                    Uri::File(name) => {
                        let path = file.parent().unwrap_or(Path::new("")).join(name);
                        let read = match files.get(&path) {
                            Some(read) => Arc::clone(read),
                            None => Arc::new(read_file(&path, &format!("{}: buffers[{i}]", file.display()))?),
                        };
                        files.insert(path, Arc::clone(&read));
                        Bytes::Read(read)
                    }
                },
            };
            let there = bytes.get().map_or(length, |bytes| bytes.len() as u64);
            if there < length {
                return Err(fault(format!("has {there} bytes, but `byteLength` is {length}")));
            }
            list.push(bytes);
        }
        Ok(Self { list, files: files.into_keys().collect() })
    }

    /// How many bytes there are.
    pub fn total(&self) -> usize {
        self.list.iter().filter_map(Bytes::get).map(<[u8]>::len).fold(0, usize::saturating_add)
    }

    /// A view, or why there is none.
    pub fn view(&self, view: &buffer::View) -> Result<View<'_>, String> {
        let buffer = view.buffer.value();
        let bytes =
            self.list.get(buffer).and_then(Bytes::get).ok_or_else(|| format!("buffers[{buffer}] has no data"))?;
        let (start, length) = (view.byte_offset.map_or(0, |offset| offset.0), view.byte_length.0);
        let range =
            usize::try_from(start).ok().zip(start.checked_add(length).and_then(|end| usize::try_from(end).ok()));
        let bytes = range.and_then(|(start, end)| bytes.get(start..end)).ok_or_else(|| {
            format!(
                "bytes {start} to {} are not all in buffers[{buffer}], which has {}",
                start.saturating_add(length),
                bytes.len()
            )
        })?;
        Ok(View { bytes, stride: view.byte_stride.map(|stride| stride.0) })
    }
}

impl Bytes<'_> {
    fn get(&self) -> Option<&[u8]> {
        match self {
            Self::Chunk(bytes) => Some(bytes),
            Self::Read(bytes) => Some(bytes),
            Self::None => None,
        }
    }
}

/// Reads a file.
fn read_file(path: &Path, named_by: &str) -> Result<Vec<u8>> {
    let missing =
        |message: String| Error::Missing { file: path.into(), message: format!("{message} (named by {named_by})") };
    crate::file::read(path).map_err(|e| missing(e.to_string()))
}

/// Where bytes are.
#[derive(Debug, PartialEq)]
pub enum Uri {
    /// Within the URI.
    Data(Vec<u8>),
    /// In a file, relative to the scene.
    File(String),
}

impl Uri {
    pub fn parse(uri: &str) -> Result<Self, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (kind, data) = data.split_once(',').ok_or("the data URI has no comma")?;
            if !kind.ends_with(";base64") {
                return Ok(Self::Data(percent_decode_str(data).collect()));
            }
            let bytes = BASE64.decode(data).map_err(|e| format!("the data is not base64: {e}"))?;
            return Ok(Self::Data(bytes));
        }
        if let Some((scheme, _)) = uri.split_once("://") {
            return Err(format!("cannot fetch {scheme} addresses"));
        }
        let name = percent_decode_str(uri).decode_utf8().map_err(|_| "the URI is not UTF-8")?.into_owned();
        if name.is_empty() {
            return Err("the URI is empty".into());
        }
        Ok(Self::File(name))
    }
}

/// Base64 with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_files_or_data() {
        assert_eq!(Uri::parse("a%20b/%C3%A4.bin"), Ok(Uri::File("a b/ä.bin".into())));
        assert_eq!(Uri::parse("50%.bin"), Ok(Uri::File("50%.bin".into())));
        for (text, bytes) in
            [("", &b""[..]), ("TQ==", b"M"), ("TWE", b"Ma"), ("TWFu", b"Man"), ("+/8A", &[0xfb, 0xff, 0])]
        {
            assert_eq!(
                Uri::parse(&format!("data:application/octet-stream;base64,{text}")),
                Ok(Uri::Data(bytes.into()))
            );
        }
        assert_eq!(Uri::parse("data:,a%00"), Ok(Uri::Data(vec![b'a', 0])));
        for bad in ["data:base64", "data:;base64,T", "data:;base64,T*==", "https://a/b.bin", "", "%ff"] {
            assert!(Uri::parse(bad).is_err(), "{bad}");
        }
    }
}
