//! The file format of checkpoints and shards: a header as JSON, blocks of bytes, and a checksum of all of it.
//!
//! ```text
//! 8 bytes   "STERFILM"
//! u32       version of the format, 7
//! u32       bytes of the header
//!           the header, JSON
//!           blocks, each a u64 with its length in bytes and then the bytes
//! 8 bytes   "STEREND\n"
//! 32 bytes  BLAKE3 of everything before
//! ```
//!
//! Numbers are little endian. The checksum is verified before anything else is read.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Take, Write};
use std::path::{Path, PathBuf};

use super::Header;
use crate::error::{Error, Result};
use crate::file;

const MAGIC: [u8; 8] = *b"STERFILM";
const END: [u8; 8] = *b"STEREND\n";
const VERSION: u32 = 7;
const BUFFER: usize = 1 << 20;
/// The marks at the beginning.
const START: u64 = 12;
/// The end mark and the checksum.
const TRAILER: u64 = 40;

/// Writes the parts of a file one after another.
pub struct Writer<W: Write> {
    out: W,
    hasher: blake3::Hasher,
}

impl<W: Write> Writer<W> {
    /// Writes the beginning.
    ///
    /// # Errors
    /// The system's.
    pub fn new(out: W, header: &Header) -> io::Result<Self> {
        let mut writer = Self { out, hasher: blake3::Hasher::new() };
        let header = serde_json::to_vec(header)?;
        writer.put(&MAGIC)?;
        writer.put(&VERSION.to_le_bytes())?;
        writer.put(&u32::try_from(header.len()).map_err(io::Error::other)?.to_le_bytes())?;
        writer.put(&header)?;
        Ok(writer)
    }

    /// Writes a block.
    ///
    /// # Errors
    /// The system's.
    pub fn block(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.put(&(bytes.len() as u64).to_le_bytes())?;
        self.put(bytes)
    }

    /// Writes the end.
    ///
    /// # Errors
    /// The system's.
    pub fn finish(mut self) -> io::Result<()> {
        self.put(&END)?;
        let hash = self.hasher.finalize();
        self.out.write_all(hash.as_bytes())?;
        self.out.flush()
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.out.write_all(bytes)
    }
}

/// Reads a file whose checksum is right, block by block.
pub struct Reader {
    path: PathBuf,
    file: BufReader<Take<File>>,
    header: Header,
    /// Whether the marks at the beginning are right.
    is_ours: bool,
    /// Bytes before the end mark that have not been read yet.
    left: u64,
}

impl Reader {
    /// Opens a file and checks that it is whole.
    ///
    /// # Errors
    /// [`Error::Missing`] if it cannot be read, [`Error::Checkpoint`] if it is of another kind, cut short or altered.
    pub fn open(path: &Path) -> Result<Self> {
        let missing = |e: io::Error| Error::Missing { file: path.to_owned(), message: e.to_string() };
        let mut file = file::open(path).map_err(missing)?;
        let length = file.limit();
        check(path, &mut file, length)?;
        Self::begin(path, file, length)
    }

    /// The header of a file, read without the rest; of one that is damaged it may be wrong.
    ///
    /// # Errors
    /// As [`open`](Self::open), as far as the damage shows.
    pub fn peek(path: &Path) -> Result<Header> {
        let missing = |e: io::Error| Error::Missing { file: path.to_owned(), message: e.to_string() };
        let file = file::open(path).map_err(missing)?;
        let length = file.limit();
        let known = length > START + TRAILER;
        match if known { Self::begin(path, file, length).ok() } else { None } {
            Some(reader) if reader.is_ours => Ok(reader.header),
            // Reading the whole file gives the most precise error.
            _ => Self::open(path).map(|reader| reader.header),
        }
    }

    /// Reads the header.
    fn begin(path: &Path, mut file: Take<File>, length: u64) -> Result<Self> {
        let missing = |e: io::Error| Error::Missing { file: path.to_owned(), message: e.to_string() };
        file.seek(SeekFrom::Start(0)).map_err(missing)?;
        let file = BufReader::with_capacity(BUFFER, file);
        let mut reader =
            Self { path: path.to_owned(), file, header: Header::default(), is_ours: false, left: length - TRAILER };
        reader.is_ours = reader.array()? == MAGIC && u32::from_le_bytes(reader.array()?) == VERSION;
        let header_length = u32::from_le_bytes(reader.array()?);
        let header = reader.bytes(u64::from(header_length))?;
        reader.header = serde_json::from_slice(&header)
            .map_err(|e| reader.fault(format!("the header cannot be understood: {e}")))?;
        if let Some(fault) = reader.header.fault(reader.left) {
            return Err(reader.fault(fault));
        }
        Ok(reader)
    }

    /// The file's header.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The next block.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if there is none.
    pub fn block(&mut self) -> Result<Vec<u8>> {
        let length = u64::from_le_bytes(self.array()?);
        self.bytes(length)
    }

    /// Checks that no block is left.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] otherwise.
    pub fn finish(&self) -> Result<()> {
        if self.left == 0 { Ok(()) } else { Err(self.fault("the file is longer than its header states")) }
    }

    /// The error for a file that is whole but makes no sense.
    pub fn fault(&self, message: impl Into<String>) -> Error {
        Error::Checkpoint { file: self.path.clone(), message: message.into() }
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let bytes = self.bytes(N as u64)?;
        bytes.try_into().map_err(|_| self.fault("a part is missing"))
    }

    fn bytes(&mut self, count: u64) -> Result<Vec<u8>> {
        if count > self.left {
            return Err(self.fault("a part is missing"));
        }
        self.left -= count;
        let mut bytes = vec![0; usize::try_from(count).map_err(|_| self.fault("a part is too large"))?];
        let missing = |e: io::Error| Error::Missing { file: self.path.clone(), message: e.to_string() };
        self.file.read_exact(&mut bytes).map_err(missing)?;
        Ok(bytes)
    }
}

/// Checks the marks at both ends and the checksum.
fn check(path: &Path, file: &mut Take<File>, length: u64) -> Result<()> {
    let fault = |message: &str| Error::Checkpoint { file: path.to_owned(), message: message.to_owned() };
    let missing = |e: io::Error| Error::Missing { file: path.to_owned(), message: e.to_string() };
    let mut start = Vec::new();
    Read::by_ref(file).take(START).read_to_end(&mut start).map_err(missing)?;
    let (magic, version) = start.split_at(start.len().min(MAGIC.len()));
    if magic != &MAGIC[..magic.len()] || magic.is_empty() {
        return Err(fault("this is not a checkpoint or shard of steradian"));
    }
    let cut = || fault("the file is cut short");
    let version = u32::from_le_bytes(version.try_into().map_err(|_| cut())?);
    if version != VERSION {
        return Err(fault(&format!("the format has the version {version}; this program reads version {VERSION}")));
    }
    if length < start.len() as u64 + 4 + TRAILER {
        return Err(cut());
    }
    let mut hasher = blake3::Hasher::new();
    hasher.update(&start);
    let mut rest = file.take(length - start.len() as u64 - 32);
    let mut buffer = vec![0; BUFFER];
    // The last eight bytes that went into the hash.
    let mut last = [0; 8];
    loop {
        let count = rest.read(&mut buffer).map_err(missing)?;
        if count == 0 {
            break;
        }
        hasher.update(&buffer[..count]);
        let kept = count.min(8);
        last.copy_within(kept.., 0);
        last[8 - kept..].copy_from_slice(&buffer[count - kept..count]);
    }
    let mut hash = [0; 32];
    rest.into_inner().read_exact(&mut hash).map_err(missing)?;
    match (last == END, hasher.finalize() == blake3::Hash::from_bytes(hash)) {
        (true, true) => Ok(()),
        (true, false) => Err(fault("the file was altered: its checksum is wrong")),
        _ => Err(fault("the file is cut short or was altered: its end is missing")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(blocks: &[&[u8]]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = Writer::new(&mut bytes, &Header::default()).unwrap();
        blocks.iter().for_each(|block| writer.block(block).unwrap());
        writer.finish().unwrap();
        bytes
    }

    fn open(bytes: &[u8]) -> (tempfile::TempDir, Result<Reader>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.shard");
        std::fs::write(&path, bytes).unwrap();
        (folder, Reader::open(&path))
    }

    #[test]
    fn blocks_come_back() {
        let large = vec![7; 3 * BUFFER + 5];
        for blocks in [vec![], vec![&[][..]], vec![&[1, 2, 3][..], &[], &large]] {
            let (_folder, reader) = open(&written(&blocks));
            let mut reader = reader.unwrap();
            assert_eq!(reader.header().shard, Header::default().shard);
            for block in &blocks {
                assert_eq!(reader.block().unwrap(), *block);
            }
            reader.finish().unwrap();
            assert!(matches!(reader.block(), Err(Error::Checkpoint { .. })));
        }
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_found() {
        let bytes = written(&[&[1, 2, 3], b"STEREND\n"]);
        for end in 0..bytes.len() {
            let (_folder, reader) = open(&bytes[..end]);
            assert!(matches!(reader, Err(Error::Checkpoint { .. })), "{end}");
        }
        for i in 0..bytes.len() {
            for bit in [1, 128] {
                let mut other = bytes.clone();
                other[i] ^= bit;
                let (_folder, reader) = open(&other);
                let message = reader.map(drop).unwrap_err().to_string();
                assert!(message.contains("a.shard: "), "{i}: {message}");
            }
        }
        let (_folder, reader) = open(&[&bytes[..], b"more"].concat());
        assert!(matches!(reader, Err(Error::Checkpoint { .. })));
        let (_folder, reader) = open(b"{ \"camera\": {} }");
        assert!(reader.map(drop).unwrap_err().to_string().ends_with("this is not a checkpoint or shard of steradian"));
    }
}
