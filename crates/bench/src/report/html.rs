//! Pages as HTML: one file, without a single address.

use std::fmt::Write;

use super::{Drawing, Page, Section, Table, base64, plot};
use crate::printable;
use steradian::Result;

const STYLE: &str = include_str!("page.css");
const SORT: &str = include_str!("sort.js");

/// Characters from which on a cell is wrapped.
const LONG: usize = 36;

/// Text with the characters of markup, and those that nobody sees, written out.
pub fn escape(text: &str) -> String {
    printable::lines(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// Text in which what is between backticks is code.
fn inline(text: &str) -> String {
    let parts = text.split('`').enumerate();
    parts.map(|(i, part)| if i % 2 == 1 { format!("<code>{}</code>", escape(part)) } else { escape(part) }).collect()
}

pub fn write(page: &Page) -> Result<String> {
    let title = escape(&page.title);
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n\
         <p class=\"verdict\">{}</p>\n",
        inline(&page.verdict)
    );
    // Writing to a string cannot fail.
    for warning in &page.warnings {
        let _ = writeln!(out, "<p class=\"warning\">{}</p>", inline(warning));
    }
    out.push_str("<dl class=\"facts\">\n");
    for (name, fact) in &page.facts {
        let _ = writeln!(out, "<div><dt>{name}</dt><dd>{}</dd></div>", inline(fact));
    }
    out.push_str("</dl>\n");
    for section in &page.sections {
        add_section(&mut out, section)?;
    }
    out.push_str(&page.viewer);
    if !page.notes.is_empty() {
        out.push_str("<h2>How to read it</h2>\n");
        add_list(&mut out, &page.notes);
    }
    let _ = write!(out, "<script>\n{SORT}</script>\n</body>\n</html>\n");
    Ok(out)
}

fn add_section(out: &mut String, section: &Section) -> Result<()> {
    if !section.title.is_empty() {
        let _ = writeln!(out, "<h2>{}</h2>", inline(&section.title));
    }
    for text in &section.text {
        let _ = writeln!(out, "<p>{}</p>", inline(text));
    }
    out.push_str("<div class=\"figures\">\n");
    for figure in &section.figures {
        let (class, drawn) = match &figure.drawing {
            Drawing::Curves(curves) => ("plot", plot::curves(curves)),
            Drawing::Dots(dots) => ("plot", plot::dots(dots)),
            Drawing::Pictures(pictures) => {
                let picture = |p: &super::Picture| {
                    let (name, data) = (inline(&p.name), base64(&p.png));
                    let alt = escape(&p.name);
                    format!(
                        "<figure><img alt=\"{alt}\" src=\"data:image/png;base64,{data}\">\
                         <figcaption>{name}</figcaption></figure>\n"
                    )
                };
                ("pictures", pictures.iter().map(picture).collect())
            }
        };
        let caption = inline(&figure.caption);
        let _ = write!(
            out,
            "<figure class=\"{class}\"><div>\n{drawn}\n</div><figcaption>{caption}</figcaption></figure>\n"
        );
    }
    out.push_str("</div>\n");
    section.tables.iter().for_each(|table| add_table(out, &table.compact()));
    add_list(out, &section.remarks);
    Ok(())
}

fn add_list(out: &mut String, items: &[String]) {
    if !items.is_empty() {
        let items: String = items.iter().map(|item| format!("<li>{}</li>\n", inline(item))).collect();
        let _ = write!(out, "<ul>\n{items}</ul>\n");
    }
}

fn is_of_number(c: char) -> bool {
    c.is_ascii_digit() || matches!(c, '-' | '+')
}

/// The text of a cell; the range behind a number, `1.5 (1 to 2)`, has a line of its own.
fn value(text: &str) -> String {
    match text.split_once(" (") {
        Some((number, range))
            if range.contains(" to ") && number.starts_with(is_of_number) && !number.contains(' ') =>
        {
            format!("{} <small>({}</small>", inline(number), inline(range))
        }
        _ => inline(text),
    }
}

/// Adds a table below its title. Columns of numbers are set flush right; a cell that is a verdict has its class.
fn add_table(out: &mut String, table: &Table) {
    let is_numeric =
        |text: &str| text == "-" || text.trim_start_matches(['-', '+']).starts_with(|c: char| c.is_ascii_digit());
    let numeric: Vec<bool> = (0..table.heads.len())
        .map(|i| table.rows.iter().filter_map(|row| row.get(i)).all(|cell| cell.is_empty() || is_numeric(cell)))
        .collect();
    let cell = |tag: &str, i: usize, text: &String| {
        let mut class = Vec::new();
        if numeric.get(i) == Some(&true) {
            class.push("n");
        }
        if text.chars().count() > LONG {
            class.push("long");
        }
        class.extend(match text.as_str() {
            "passed" | "none found" => Some("good"),
            "short" => Some("mild"),
            "failed" | "found" => Some("bad"),
            _ => None,
        });
        let class = if class.is_empty() { String::new() } else { format!(" class=\"{}\"", class.join(" ")) };
        format!("<{tag}{class}>{}</{tag}>", value(text))
    };
    let cells =
        |tag: &str, row: &[String]| row.iter().enumerate().map(|(i, text)| cell(tag, i, text)).collect::<String>();
    let title = if table.title.is_empty() { String::new() } else { format!("<h3>{}</h3>\n", inline(&table.title)) };
    let _ = write!(
        out,
        "{title}<div class=\"wide\" tabindex=\"0\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n",
        cells("th", &table.heads)
    );
    for row in &table.rows {
        let _ = writeln!(out, "<tr>{}</tr>", cells("td", row));
    }
    out.push_str("</tbody>\n</table></div>\n");
}

#[cfg(test)]
mod tests {
    use super::super::{Curve, Curves, Dots, Figure, Picture};
    use super::*;
    use crate::{Machine, Spent};

    #[test]
    fn text_is_no_markup() {
        let strange = "</title><script>alert('x')</script>\" onload=\"&\u{1b}";
        assert_eq!(
            escape(strange),
            "&lt;/title&gt;&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot; onload=&quot;&amp;\\u001b"
        );
        let mut page = Page::new(strange, &Machine::here(), &Spent::default());
        (page.verdict, page.warnings, page.notes) = (strange.into(), vec![strange.into()], vec![strange.into()]);
        let curve = Curve::new(strange, [(1.0, 2.0), (2.0, 3.0)]);
        let curves = Curves { x: strange.into(), y: strange.into(), curves: vec![curve], marks: Vec::new() };
        let rows = vec![(strange.to_owned(), [1.0, 0.5, 2.0])];
        let dots = Dots { unit: strange.into(), groups: vec![(strange.into(), rows)], mark: None };
        let pictures = vec![Picture { name: strange.into(), png: Vec::new() }];
        let drawings = [Drawing::Curves(curves), Drawing::Dots(dots), Drawing::Pictures(pictures)];
        page.sections.push(Section {
            title: strange.into(),
            text: vec![strange.into()],
            figures: drawings.map(|drawing| Figure { caption: strange.into(), drawing }).into(),
            tables: vec![Table {
                title: strange.into(),
                heads: vec![strange.into()],
                rows: vec![vec![strange.into()]],
            }],
            remarks: vec![strange.into()],
        });
        let text = write(&page).unwrap();
        assert!(
            text.matches("<script").count() == 1 && !text.contains("</title><") && !text.contains('\u{1b}'),
            "{text}"
        );
        // As text, and as values of attributes.
        let escaped = "&lt;/title&gt;&lt;script&gt;alert(";
        for place in [
            "<title>",
            "<h1>",
            "<figcaption>",
            "<th class",
            "<td class",
            "<li>",
            "alt=\"",
            "aria-label=\"",
            "class=\"row\"",
        ] {
            assert!(text.contains(place), "{place}");
        }
        assert!(
            text.matches(escaped).count() > 12 && !text.contains("alt=\"<") && !text.contains("label=\"<"),
            "{text}"
        );
    }

    #[test]
    fn code_has_no_backticks_and_numbers_are_flush_right() {
        assert_eq!(inline("run `a < b` now"), "run <code>a &lt; b</code> now");
        let mut out = String::new();
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let rows = vec![row(["passed", "-1.5 (-2 to 1)", "x"]), row(["failed", "-", "3"])];
        add_table(&mut out, &Table { rows, ..Table::new("", "verdict | value | text") });
        assert!(
            out.contains("<td class=\"good\">passed</td><td class=\"n\">-1.5 <small>(-2 to 1)</small></td><td>x</td>"),
            "{out}"
        );
    }
}
