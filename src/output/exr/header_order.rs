//! What the library that writes files leaves out of their headers: attributes in the order of their names, as other
//! programs write them, since equal pictures would come in different files; and the mark of files with long names,
//! without which OpenEXR does not read them.

use std::io::{self, Read, Seek, SeekFrom, Write};

/// Magic number and version.
const PREFIX: u64 = 8;
/// The bit of the version for several parts.
const SEVERAL: u32 = 1 << 12;

/// The bit of the version for names of attributes, their types or channels longer than [`SHORT`].
const LONG_NAMES: u32 = 1 << 10;
/// The most bytes of a name in files without that bit.
const SHORT: usize = 31;

/// Sorts the attributes of all headers of a file, and marks long names. The headers' length stays the same, and so does
/// everything behind them.
///
/// # Errors
/// The system's, or if the file is no EXR file.
pub fn finish_headers(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    file.seek(SeekFrom::Start(4))?;
    let mut version = [0; 4];
    file.read_exact(&mut version)?;
    let mut version = u32::from_le_bytes(version);
    let several = version & SEVERAL != 0;
    let mut is_long = false;
    let mut sorted = Vec::new();
    let mut reader = io::BufReader::new(&mut *file);
    loop {
        let mut attributes = Vec::new();
        loop {
            let mut bytes = Vec::new();
            read_word(&mut reader, &mut bytes)?;
            if bytes == [0] {
                break;
            }
            let name = bytes.len();
            read_word(&mut reader, &mut bytes)?;
            let kind = bytes.len();
            is_long |= name > SHORT + 1 || kind - name > SHORT + 1;
            let mut length = [0; 4];
            reader.read_exact(&mut length)?;
            bytes.extend(length);
            let value = bytes.len();
            bytes.resize(value + u32::from_le_bytes(length) as usize, 0);
            reader.read_exact(&mut bytes[value..])?;
            is_long |= &bytes[name..kind] == b"chlist\0" && has_long_channel(&bytes[value..]);
            attributes.push((name, bytes));
        }
        attributes.sort_by(|(a_name, a), (b_name, b)| a[..*a_name].cmp(&b[..*b_name]));
        let empty = attributes.is_empty();
        attributes.iter().for_each(|(_, bytes)| sorted.extend_from_slice(bytes));
        sorted.push(0);
        if !several || empty {
            break;
        }
    }
    drop(reader);
    version |= if is_long { LONG_NAMES } else { 0 };
    file.seek(SeekFrom::Start(4))?;
    file.write_all(&version.to_le_bytes())?;
    debug_assert_eq!(file.stream_position()?, PREFIX);
    file.write_all(&sorted)
}

/// Whether a list of channels, each a word with the zero that ends it and 16 bytes, has a long name.
fn has_long_channel(mut list: &[u8]) -> bool {
    while let Some(length) = list.iter().position(|&byte| byte == 0).filter(|length| *length > 0) {
        if length > SHORT {
            return true;
        }
        list = list.get(length + 17..).unwrap_or_default();
    }
    false
}

/// A word with the zero that ends it.
fn read_word(reader: &mut impl Read, out: &mut Vec<u8>) -> io::Result<()> {
    let mut byte = [0];
    loop {
        reader.read_exact(&mut byte)?;
        out.push(byte[0]);
        if byte[0] == 0 {
            return Ok(());
        }
    }
}
