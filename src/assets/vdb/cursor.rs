//! Bytes of a file, of which no more is taken or requested than there are.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use crate::memory::is_available;

/// What the first try to read something of unknown length takes.
const WINDOW: u64 = 1 << 12;

/// Takes values from the front of bytes, little-endian.
pub struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// How many bytes were taken.
    pub fn position(&self) -> usize {
        self.at
    }

    pub fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let rest = &self.bytes[self.at..];
        let taken = rest
            .get(..count)
            .ok_or_else(|| format!("ends early: {count} bytes are expected where there are {}", rest.len()))?;
        self.at += count;
        Ok(taken)
    }

    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub fn u32(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn i32(&mut self) -> Result<i32, String> {
        self.array().map(i32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, String> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn i64(&mut self) -> Result<i64, String> {
        self.array().map(i64::from_le_bytes)
    }

    pub fn doubles<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.array()?);
        }
        Ok(numbers)
    }

    /// A text with its length in front.
    pub fn text(&mut self) -> Result<String, String> {
        let length = self.u32()? as usize;
        self.take(length).map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }
}

/// A file of which parts are read.
pub struct Source {
    file: File,
    length: u64,
}

impl Source {
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = crate::file::open(path)?;
        let length = file.limit();
        Ok(Self { file: file.into_inner(), length })
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    /// The bytes from `start` to before `end`.
    pub fn range(&mut self, start: u64, end: u64) -> Result<Vec<u8>, String> {
        if start > end || end > self.length {
            return Err(format!("bytes {start} to {end} are named, but the file has {}", self.length));
        }
        let count = usize::try_from(end - start).unwrap_or(usize::MAX);
        if !is_available(count) {
            return Err(format!("{count} bytes of the file need more memory than there is"));
        }
        let mut bytes = Vec::with_capacity(count);
        let read = self.file.seek(SeekFrom::Start(start));
        read.and_then(|_| self.file.by_ref().take(end - start).read_to_end(&mut bytes)).map_err(|e| e.to_string())?;
        if bytes.len() != count {
            return Err("the file became shorter while it was read".into());
        }
        Ok(bytes)
    }

    /// What `parse` makes of the bytes from `start`, and where it ended. It is tried with more of them, up to the end
    /// of the file, until it succeeds.
    pub fn parse<T>(
        &mut self,
        start: u64,
        parse: impl Fn(&mut Cursor) -> Result<T, String>,
    ) -> Result<(T, u64), String> {
        let mut window = WINDOW;
        loop {
            let end = start.saturating_add(window).min(self.length);
            let bytes = self.range(start, end)?;
            let mut cursor = Cursor::new(&bytes);
            match parse(&mut cursor) {
                Ok(parsed) => return Ok((parsed, start + cursor.position() as u64)),
                Err(message) if end == self.length => return Err(message),
                Err(_) => window *= 16,
            }
        }
    }
}

/// Bits by number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mask<'a>(pub &'a [u8]);

impl Mask<'_> {
    pub fn is_on(self, i: usize) -> bool {
        self.0[i / 8] >> (i % 8) & 1 == 1
    }

    pub fn count(self) -> usize {
        self.0.iter().map(|byte| byte.count_ones() as usize).sum()
    }

    /// The numbers of all bits that are on.
    pub fn ones(self) -> impl Iterator<Item = usize> {
        self.0.iter().enumerate().flat_map(|(i, &byte)| {
            let mut rest = byte;
            std::iter::from_fn(move || {
                let bit = (rest != 0).then(|| rest.trailing_zeros() as usize)?;
                rest &= rest - 1;
                Some(8 * i + bit)
            })
        })
    }
}
