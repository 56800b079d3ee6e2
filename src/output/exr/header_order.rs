//! Attributes in the order of their names, as other programs write them: the library that writes files keeps them in no order, so that equal
//! pictures would come in different files.

use std::io::{self, Read, Seek, SeekFrom, Write};

/// Magic number and version.
const PREFIX: u64 = 8;
/// The bit of the version that says that there are several parts.
const SEVERAL: u32 = 1 << 12;

/// Sorts the attributes of all headers of a file. Their length stays the same, and so does everything behind them.
pub fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    file.seek(SeekFrom::Start(4))?;
    let mut version = [0; 4];
    file.read_exact(&mut version)?;
    let several = u32::from_le_bytes(version) & SEVERAL != 0;
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
            let mut length = [0; 4];
            reader.read_exact(&mut length)?;
            bytes.extend(length);
            let value = bytes.len();
            bytes.resize(value + u32::from_le_bytes(length) as usize, 0);
            reader.read_exact(&mut bytes[value..])?;
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
    file.seek(SeekFrom::Start(PREFIX))?;
    file.write_all(&sorted)
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
