//! `steradian convert`.

use steradian::Result;
use steradian::internal::convert::{self, Originals};
use steradian::internal::output::FileUses;

use crate::args::ConvertArgs;
use crate::log::{self, Level};
use crate::text::counted;
use crate::{files, scene};

/// Reads a scene of any format and writes it as JSON.
pub fn run(arguments: &ConvertArgs, mut uses: FileUses) -> Result<()> {
    let imported = scene::load(&arguments.input, &arguments.import, arguments.verbosity)?;
    let originals = if arguments.link { Originals::Link } else { Originals::Copy };
    arguments
        .import
        .report
        .iter()
        .filter(|path| !files::is_stdout(path))
        .try_for_each(|path| uses.write(path, "--report"))?;
    let count = convert::write_scene(&imported, &arguments.input, &arguments.output, originals, uses)?;
    if !arguments.verbosity.quiet {
        let files =
            if count == 0 { String::new() } else { format!(" and {} beside it", counted(count as u64, "file")) };
        log::message(Level::Note, &format!("wrote {}{files}", arguments.output.display()));
    }
    Ok(())
}
