//! Manual pages in roff, from the definition of the command line.

use clap::Command;
use clap_mangen::Man;
use steradian::{Error, Result};

use super::Page;

/// A page for the program and each of its commands, the program's first.
///
/// # Errors
///
/// [`Error::Internal`] if a page cannot be written to memory.
pub fn pages(program: Command) -> Result<Vec<Page>> {
    let mut program = with_all_options(program.disable_help_subcommand(true));
    program.build();
    let mut pages = Vec::new();
    add_pages(&program, &mut pages)?;
    Ok(pages)
}

/// Options that `-h` leaves out are explained too.
fn with_all_options(command: Command) -> Command {
    command.mut_args(|argument| argument.hide_short_help(false)).mut_subcommands(with_all_options)
}

fn add_pages(command: &Command, pages: &mut Vec<Page>) -> Result<()> {
    let man = Man::new(command.clone()).source(concat!("steradian ", env!("CARGO_PKG_VERSION"))).manual("Steradian");
    let mut roff = Vec::new();
    man.render(&mut roff).map_err(|e| Error::Internal(e.to_string()))?;
    pages.push(Page { name: man.get_filename(), text: with_examples(&String::from_utf8_lossy(&roff)) });
    command.get_subcommands().filter(|inner| !inner.is_hide_set()).try_for_each(|inner| add_pages(inner, pages))
}

/// A page whose closing section has examples, line by line, and notes, in place of `EXTRA`.
fn with_examples(page: &str) -> String {
    let Some((before, extra)) = page.split_once(".SH EXTRA\n") else { return page.to_owned() };
    let (extra, after) = extra.split_at(extra.find("\n.SH ").map_or(extra.len(), |end| end + 1));
    let examples = ["Examples:\n", "Example:\n"].iter().find_map(|heading| extra.strip_prefix(heading));
    let Some(examples) = examples else { return format!("{before}.SH NOTES\n{extra}{after}") };
    let (examples, notes) = examples.split_once("\n\n").unwrap_or((examples.trim_end(), ""));
    let notes = if notes.is_empty() { String::new() } else { format!(".SH NOTES\n{notes}") };
    format!("{before}.SH EXAMPLES\n.nf\n{examples}\n.fi\n{notes}{after}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_keep_their_lines() {
        let page = "a\n.SH EXTRA\nExamples:\n  b\n  c\n\nd\n.SH VERSION\ne\n";
        assert_eq!(with_examples(page), "a\n.SH EXAMPLES\n.nf\n  b\n  c\n.fi\n.SH NOTES\nd\n.SH VERSION\ne\n");
        assert_eq!(with_examples("a\n.SH EXTRA\nExample:\n  b\n"), "a\n.SH EXAMPLES\n.nf\n  b\n.fi\n");
        assert_eq!(with_examples("a\n.SH EXTRA\nb\n"), "a\n.SH NOTES\nb\n");
    }

    #[test]
    fn every_option_is_explained() {
        for page in pages(crate::args::command_line()).unwrap() {
            for option in page.text.split("\n.TP\n").skip(1) {
                let explanation = option.lines().nth(1).unwrap_or_default();
                assert!(!explanation.is_empty() && !explanation.starts_with(".SH"), "{}: {option}", page.name);
            }
        }
    }
}
