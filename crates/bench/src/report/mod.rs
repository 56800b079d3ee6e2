//! Reports: a page with a verdict, facts, figures and tables, written as JSON, CSV, Markdown and HTML that needs no
//! network.

mod accel;
mod html;
mod markdown;
mod picture;
mod plot;
mod reports;

pub use accel::AccelsReport;
pub(super) use picture::{Picture, base64, heat, thumbnail};
pub(super) use plot::{Curve, Curves, DotRow, Dots};

use std::path::Path;

use serde::Serialize;

use super::{Machine, Spent};
use steradian::{Error, Result};

/// What a report shows, for people.
pub struct Page {
    pub(super) title: String,
    /// What was found, in one sentence.
    pub(super) verdict: String,
    /// What makes the numbers doubtful: a loaded machine, an interrupted run, failures.
    pub(super) warnings: Vec<String>,
    /// Where and how it was measured.
    pub(super) facts: Vec<(&'static str, String)>,
    /// What the columns mean.
    pub(super) notes: Vec<String>,
    pub(super) sections: Vec<Section>,
    /// Markup at the end of the page.
    pub(super) viewer: String,
}

/// A part of a page. Text between backticks is code.
#[derive(Default)]
pub struct Section {
    /// None if empty.
    pub(super) title: String,
    /// Paragraphs.
    pub(super) text: Vec<String>,
    pub(super) figures: Vec<Figure>,
    pub(super) tables: Vec<Table>,
    /// A list.
    pub(super) remarks: Vec<String>,
}

/// Something drawn, with its caption.
pub struct Figure {
    pub(super) caption: String,
    pub(super) drawing: Drawing,
}

/// What is drawn.
pub enum Drawing {
    /// Lines.
    Curves(Curves),
    /// Values with whiskers.
    Dots(Dots),
    /// Pictures side by side.
    Pictures(Vec<Picture>),
}

/// A table by its heads and rows.
#[derive(Clone, Debug, Default)]
pub struct Table {
    pub(super) title: String,
    pub(super) heads: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Page {
    /// An empty page with where and how everything was measured.
    pub(super) fn new(title: impl Into<String>, machine: &Machine, spent: &Spent) -> Self {
        let mut facts = machine.facts();
        facts.extend(spent.fact().map(|fact| ("Time measured", fact)));
        Self {
            title: title.into(),
            verdict: String::new(),
            warnings: spent.warning().into_iter().collect(),
            facts,
            notes: Vec::new(),
            sections: Vec::new(),
            viewer: String::new(),
        }
    }
}

impl Table {
    /// An empty table with heads between vertical lines.
    pub(super) fn new(title: impl Into<String>, heads: &str) -> Self {
        Self { title: title.into(), heads: heads.split(" | ").map(str::to_owned).collect(), rows: Vec::new() }
    }

    /// Without the rows that have nothing but their first cell, and without the columns that have nothing.
    fn compact(&self) -> Self {
        let has = |cell: &String| !matches!(cell.as_str(), "" | "-");
        let rows: Vec<_> = self.rows.iter().filter(|row| row.len() < 2 || row[1..].iter().any(has)).collect();
        let kept: Vec<usize> = (0..self.heads.len())
            .filter(|&i| i == 0 || rows.is_empty() || rows.iter().any(|row| row.get(i).is_some_and(has)))
            .collect();
        let pick = |row: &[String]| kept.iter().filter_map(|&i| row.get(i).cloned()).collect();
        Self {
            title: self.title.clone(),
            heads: pick(&self.heads),
            rows: rows.into_iter().map(|row| pick(row)).collect(),
        }
    }

    /// As comma-separated values (RFC 4180).
    fn csv(&self) -> String {
        let field = |text: &String| {
            if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.clone() }
        };
        let line = |row: &Vec<String>| row.iter().map(field).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.heads).chain(&self.rows).map(line).collect()
    }
}

/// The results of a benchmark.
pub trait Report: Serialize {
    /// The files' name before the dot.
    const NAME: &'static str;

    /// For people.
    fn page(&self) -> Page;

    /// Every single measurement, for other programs.
    fn sheet(&self) -> Option<Table> {
        None
    }

    /// As JSON.
    ///
    /// # Errors
    /// None in practice.
    fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// The page as Markdown, without its figures.
    fn markdown(&self) -> String {
        markdown::write(&self.page())
    }

    /// The page as HTML, all in one file.
    ///
    /// # Errors
    /// If a picture cannot be encoded.
    fn html(&self) -> Result<String> {
        html::write(&self.page())
    }

    /// Writes `NAME.json`, `NAME.md` and, where there is one, `NAME.csv` into a folder, which is made if it does not
    /// exist: what an unfinished run leaves.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    fn write_figures_to(&self, folder: &Path) -> Result<()> {
        write_file(folder, &format!("{}.json", Self::NAME), &self.json()?)?;
        write_file(folder, &format!("{}.md", Self::NAME), &self.markdown())?;
        match self.sheet() {
            Some(sheet) => write_file(folder, &format!("{}.csv", Self::NAME), &sheet.csv()),
            None => Ok(()),
        }
    }

    /// Writes those and `NAME.html`.
    ///
    /// # Errors
    /// [`Error::Output`] naming the file.
    fn write_to(&self, folder: &Path) -> Result<()> {
        self.write_figures_to(folder)?;
        write_file(folder, &format!("{}.html", Self::NAME), &self.html()?)
    }
}

/// Writes a text into a folder, which is made if it does not exist.
pub(super) fn write_file(folder: &Path, name: &str, text: &str) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::Output { file: folder.into(), message: e.to_string() })?;
    crate::output::write_atomically(&folder.join(name), |out| {
        std::io::Write::write_all(out, text.as_bytes()).map_err(|e| e.to_string())
    })
}

/// A sentence about an unfinished run.
pub(super) fn interrupted(is_interrupted: bool) -> Option<String> {
    is_interrupted.then(|| "Interrupted: what is missing was not measured.".to_owned())
}

/// The middle, and the ends if they differ from it.
pub(super) fn range([median, low, high]: [f64; 3]) -> String {
    let [median, low, high] = [median, low, high].map(number);
    if low == high { median } else { format!("{median} ({low} to {high})") }
}

/// A text, or a dash for none.
pub(super) fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "-".to_owned())
}

/// Three digits.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A whole number with its thousands set apart.
pub(super) fn count(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (256.0, "256"),
            (1234.6, "1235"),
            (0.012345, "0.0123"),
            (0.5, "0.5"),
            (-2.0, "-2"),
            (3.2e-5, "3.20e-5"),
            (9.999, "10"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!((range([1.0, 1.0, 1.0]), range([1.0, 0.5, 2.0])), ("1".to_owned(), "1 (0.5 to 2)".to_owned()));
        assert_eq!((count(1234567.0), count(12.0)), ("1,234,567".to_owned(), "12".to_owned()));
    }

    #[test]
    fn empty_rows_and_columns_are_left_out_and_fields_quoted() {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let rows = vec![row(["a", "-", "1,5"]), row(["b", "", "-"]), row(["c\"", "", ""]), row(["d\"", "", "x"])];
        let table = Table { rows, ..Table::new("t", "name | nothing | value") }.compact();
        assert_eq!(table.heads, ["name", "value"]);
        assert_eq!(table.rows, [["a", "1,5"], ["d\"", "x"]]);
        assert_eq!(table.csv(), "name,value\na,\"1,5\"\n\"d\"\"\",x\n");
    }
}
