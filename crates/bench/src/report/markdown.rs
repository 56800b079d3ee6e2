//! Pages as Markdown, without figures.

use std::fmt::Write;

use super::{Page, Table};

pub fn write(page: &Page) -> String {
    let mut out = format!("# {}\n\n**{}**\n", page.title, page.verdict);
    for warning in &page.warnings {
        // Writing to a string cannot fail.
        let _ = write!(out, "\n> {warning}\n");
    }
    out.push('\n');
    let facts = page.facts.iter().map(|(name, fact)| format!("{name}: {fact}"));
    add_list(&mut out, facts.chain(page.notes.iter().cloned()));
    for section in &page.sections {
        if !section.title.is_empty() {
            let _ = write!(out, "\n## {}\n", section.title);
        }
        for text in &section.text {
            let _ = write!(out, "\n{text}\n");
        }
        section.tables.iter().for_each(|table| add_table(&mut out, &table.compact()));
        if !section.remarks.is_empty() {
            out.push('\n');
        }
        add_list(&mut out, section.remarks.iter().cloned());
    }
    out
}

fn add_list(out: &mut String, items: impl Iterator<Item = String>) {
    out.extend(items.map(|item| format!("- {item}\n")));
}

/// Adds a table below its title.
fn add_table(out: &mut String, table: &Table) {
    let line = |cells: &[String]| {
        format!("| {} |\n", cells.iter().map(|c| c.replace('|', "\\|")).collect::<Vec<_>>().join(" | "))
    };
    if !table.title.is_empty() {
        let _ = write!(out, "\n{}\n", table.title);
    }
    let _ = write!(out, "\n{}|{}\n", line(&table.heads), "---|".repeat(table.heads.len()));
    table.rows.iter().for_each(|row| out.push_str(&line(row)));
}
