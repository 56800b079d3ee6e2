//! The reference of the command line, from its definition.

use std::fmt::Write as _;

use clap::builder::StyledStr;
use clap::{Arg, Command};

use super::{Page, cell};

/// A page for each command, and `README.md`, which lists them.
pub fn pages(mut program: Command) -> Vec<Page> {
    program.build();
    let mut pages = Vec::new();
    let mut list = "# Command line reference\n\n| command | |\n|---|---|\n".to_owned();
    add_pages(&program, "steradian", &mut list, &mut pages);
    pages.insert(0, page("README", list));
    pages
}

fn page(name: &str, text: String) -> Page {
    let note = "<!-- Written by `steradian man --markdown`. -->\n";
    Page { name: format!("{name}.md"), text: format!("{note}\n{}\n", text.trim_end()) }
}

fn add_pages(command: &Command, path: &str, list: &mut String, pages: &mut Vec<Page>) {
    let shown = |command: &&Command| !command.is_hide_set() && command.get_name() != "help";
    let mut commands: Vec<&Command> = command.get_subcommands().filter(shown).collect();
    // As in the help; options of its own may have moved it to the end.
    commands.sort_by_key(|command| command.get_name() != "render");
    for command in commands {
        let path = format!("{path} {}", command.get_name());
        if command.has_subcommands() {
            add_pages(command, &path, list, pages);
            continue;
        }
        let file = path.trim_start_matches("steradian ").replace(' ', "-");
        let about = text(command.get_about());
        let _ = writeln!(list, "| [`{path}`]({file}.md) | {} |", cell(&about));
        pages.push(page(&file, describe(command, &path)));
    }
}

fn describe(command: &Command, path: &str) -> String {
    let about = text(command.get_long_about().or(command.get_about()));
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    let mut page = format!("# `{path}`\n\n{}\n\n```text\n{usage}\n```\n\n", escaped(&about));
    let visible: Vec<&Arg> = command.get_arguments().filter(|argument| !argument.is_hide_set()).collect();
    let mut headings: Vec<&str> = Vec::new();
    for argument in &visible {
        let heading = heading(argument);
        if !headings.contains(&heading) {
            headings.push(heading);
        }
    }
    for title in headings {
        let _ = write!(page, "## {title}\n\n| | meaning |\n|---|---|\n");
        for argument in visible.iter().filter(|argument| heading(argument) == title) {
            let _ = writeln!(page, "| {} | {} |", cell(&name(argument)), cell(&meaning(argument)));
        }
        page.push('\n');
    }
    let examples = text(command.get_after_long_help().or(command.get_after_help()));
    if !examples.is_empty() {
        let _ = write!(page, "```text\n{}\n```\n", examples.trim_end());
    }
    page
}

fn heading(argument: &Arg) -> &str {
    argument.get_help_heading().unwrap_or(if argument.is_positional() { "Arguments" } else { "Options" })
}

/// How an argument is written: "`-s`, `--spp N`".
fn name(argument: &Arg) -> String {
    let values = argument.get_value_names().unwrap_or_default();
    let takes_values = argument.get_num_args().is_some_and(|number| number.takes_values());
    let values = if takes_values { values.iter().map(|value| format!(" {value}")).collect() } else { String::new() };
    match (argument.get_short(), argument.get_long()) {
        (Some(short), Some(long)) => format!("`-{short}`, `--{long}{values}`"),
        (None, Some(long)) => format!("`--{long}{values}`"),
        (Some(short), None) => format!("`-{short}{values}`"),
        (None, None) => format!("`{}`", values.trim()),
    }
}

fn meaning(argument: &Arg) -> String {
    let mut meaning = in_cell(&text(argument.get_long_help().or(argument.get_help())));
    let values: Vec<String> = argument
        .get_possible_values()
        .iter()
        .filter(|value| !value.is_hide_set())
        .map(|value| {
            let help = value.get_help().map_or_else(String::new, |help| format!(": {}", escaped(&help.to_string())));
            format!("`{}`{help}", value.get_name())
        })
        .collect();
    let is_switch = !argument.get_num_args().is_some_and(|number| number.takes_values());
    if !values.is_empty() && !is_switch {
        let end = if meaning.ends_with('.') { "" } else { "." };
        let _ = write!(meaning, "{end} Values: {}.", values.join("; "));
    }
    if let [default] = argument.get_default_values()
        && !is_switch
    {
        let end = if meaning.ends_with('.') { "" } else { "." };
        let _ = write!(meaning, "{end} Default: `{}`.", default.to_string_lossy());
    }
    meaning
}

/// Help as the cell of a table: paragraphs follow one another, and lists, whose lines are indented, have lines.
fn in_cell(help: &str) -> String {
    let mut cell = String::new();
    for line in help.lines().filter(|line| !line.trim().is_empty()) {
        let (name, about) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
        let about = escaped(about.trim());
        if line.starts_with("    ") {
            let _ = write!(cell, "<br>&emsp;`{name}`: {about}");
        } else if line.starts_with("  ") {
            let _ = write!(cell, "<br>`{name}`: {about}");
        } else {
            let ends = cell.is_empty() || cell.ends_with(['.', ':', '?', '!']);
            cell.push_str(if cell.is_empty() {
                ""
            } else if ends {
                " "
            } else {
                ". "
            });
            cell.push_str(&escaped(line.trim()));
        }
    }
    cell
}

fn text(styled: Option<&StyledStr>) -> String {
    styled.map(ToString::to_string).unwrap_or_default()
}

/// Text of help as Markdown: what HTML or a table would take for its own is escaped.
fn escaped(text: &str) -> String {
    text.replace('<', "&lt;").replace('*', "\\*")
}
