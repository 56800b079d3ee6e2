//! Numbers as bytes and back, exactly: little endian, with its length before every list.

/// Appends numbers to bytes.
#[derive(Default)]
pub struct ByteWriter {
    bytes: Vec<u8>,
}

impl ByteWriter {
    /// All that was appended.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Appends a number without a length.
    pub fn long(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// Appends a list of floats.
    pub fn floats(&mut self, values: impl ExactSizeIterator<Item = f64>) {
        self.long(values.len() as u64);
        let start = self.bytes.len();
        self.bytes.resize(start + values.len() * 8, 0);
        let (places, _) = self.bytes[start..].as_chunks_mut();
        places.iter_mut().zip(values).for_each(|(place, value)| *place = value.to_le_bytes());
    }

    /// Appends a list of whole numbers.
    pub fn integers(&mut self, values: &[u32]) {
        self.long(values.len() as u64);
        self.bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
}

/// Takes numbers from the front of bytes; every method gives `None` if there are too few. A list is never longer than
/// the bytes that are there.
pub struct ByteReader<'a> {
    bytes: &'a [u8],
}

impl<'a> ByteReader<'a> {
    /// Begins at the front.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    /// Whether all bytes were taken.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// A number without a length.
    pub fn long(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    /// A list of floats.
    pub fn floats(&mut self) -> Option<Vec<f64>> {
        Some(self.list()?.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
    }

    /// A list of whole numbers.
    pub fn integers(&mut self) -> Option<Vec<u32>> {
        Some(self.list()?.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect())
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(taken)
    }

    /// The bytes of a list of values of `N` bytes.
    fn list<const N: usize>(&mut self) -> Option<&'a [[u8; N]]> {
        let length = usize::try_from(self.long()?).ok()?;
        Some(self.take(length.checked_mul(N)?)?.as_chunks().0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_and_lengths_are_checked() {
        let mut out = ByteWriter::default();
        out.floats([1.5, f64::NEG_INFINITY].into_iter());
        out.integers(&[7, u32::MAX]);
        out.long(u64::MAX);
        let bytes = out.into_bytes();
        let mut data = ByteReader::new(&bytes);
        assert_eq!(data.floats(), Some(vec![1.5, f64::NEG_INFINITY]));
        assert_eq!((data.integers(), data.long()), (Some(vec![7, u32::MAX]), Some(u64::MAX)));
        assert!(data.is_empty() && data.long().is_none());
        for length in [u64::MAX, 1 << 61, 1] {
            assert!(ByteReader::new(&length.to_le_bytes()).floats().is_none());
        }
    }
}
