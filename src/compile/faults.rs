//! The faults of a scene, to be reported together.

use crate::error::{Error, Result};

/// More faults than this are not reported.
const MAX_FAULTS: usize = 20;

/// The faults found so far.
#[derive(Debug, Default)]
pub struct Faults(Vec<Error>);

impl Faults {
    /// The value, unless it is a fault: that is kept, once.
    pub fn keep<T>(&mut self, result: Result<T>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(error) => {
                let message = error.to_string();
                let is_known = self.0.iter().any(|known| known.to_string() == message);
                if !is_known && self.0.len() < MAX_FAULTS {
                    self.0.push(error);
                }
                None
            }
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them as one error.
    pub fn into_result(self) -> Result<()> {
        Error::from_all(self.0).map_or(Ok(()), Err)
    }
}
