//! Whether a JPEG file is whole: decoders silently fill what is missing with grey.

/// Whether the segments of a JPEG file (ISO/IEC 10918-1, annex B) lead to its end mark.
pub fn is_whole_jpeg(bytes: &[u8]) -> bool {
    let mut at = 2;
    loop {
        // A mark is one or more bytes 0xff, then its code. Within entropy-coded data, 0 and the restart marks D0 to D7
        // are no segments.
        let Some(mark) = bytes.get(at..).and_then(|rest| rest.windows(2).position(is_segment)) else {
            return false;
        };
        at += mark;
        match bytes[at + 1] {
            0xd9 => return true,
            // Marks without a length.
            0x01 | 0xd8 => at += 2,
            _ => {
                let Some(&[high, low]) = bytes.get(at + 2..at + 4) else {
                    return false;
                };
                at += 2 + usize::from(u16::from_be_bytes([high, low]));
            }
        }
    }
}

fn is_segment(pair: &[u8]) -> bool {
    pair[0] == 0xff && !matches!(pair[1], 0x00 | 0xff | 0xd0..=0xd7)
}
