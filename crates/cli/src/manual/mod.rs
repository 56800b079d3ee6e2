//! Pages of the manual: the scene format from its JSON Schema, the command line from its definition, for the book and
//! for `man`.

mod commands;
mod format;
mod man;
mod words;

use std::fs;
use std::io::Write as _;
use std::path::Path;

use steradian::internal::output;
use steradian::{Error, Result};

pub use commands::pages as command_pages;
pub use format::pages as format_pages;
pub use man::pages as man_pages;

/// A page: the name of its file and its Markdown or roff.
pub struct Page {
    name: String,
    /// All of it.
    pub text: String,
}

/// Writes pages into a folder, which is made if needed.
///
/// # Errors
///
/// [`Error::Output`] for a file or folder that cannot be written.
pub fn write(pages: &[Page], folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.to_owned(), message: e.to_string() })?;
    for page in pages {
        let file = folder.join(&page.name);
        output::write_atomically(&file, |out| out.write_all(page.text.as_bytes()).map_err(|e| e.to_string()))?;
    }
    Ok(())
}

/// Text for a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
