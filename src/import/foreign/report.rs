//! What became of each parameter of an imported file.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

/// What became of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Imported exactly.
    Mapped,
    /// Imported approximately.
    Approximated,
    /// Not imported.
    Ignored,
}

/// Why a parameter is ignored that belongs to an element which is ignored as a whole: reported, but not in the summary.
pub(super) const PART_OF_IGNORED: &str = "its element is ignored";

/// A parameter and what became of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ReportEntry {
    /// Where it stands: `scene.xml:12:5`, or a path inside a JSON file.
    pub place: String,
    /// The element that has it, as `bsdf plastic "floor"`.
    pub element: String,
    /// The parameter; empty for the element as a whole.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub parameter: String,
    /// What became of it.
    pub outcome: Outcome,
    /// How it was approximated, why it was ignored, or a note on how it was mapped.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
}

/// What became of every parameter of an imported file, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ImportReport {
    /// The parameters.
    pub entries: Vec<ReportEntry>,
}

impl ImportReport {
    /// How many parameters had this outcome.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.entries.iter().filter(|entry| entry.outcome == outcome).count()
    }

    /// Whether everything was imported exactly.
    pub fn is_exact(&self) -> bool {
        self.entries.iter().all(|entry| entry.outcome == Outcome::Mapped)
    }

    /// What was not mapped, a line for each kind of it: the same note about the same parameter of many elements is one
    /// line. Elements that are ignored as a whole come first, then parameters that are, then approximations.
    pub fn summary(&self) -> Vec<String> {
        let (whole, rest) = self.kinds();
        whole.into_iter().chain(rest).collect()
    }

    /// The lines of [`summary`](Self::summary) about elements that are ignored as a whole, and the others.
    pub fn kinds(&self) -> (Vec<String>, Vec<String>) {
        let mut kinds: BTreeMap<(Reverse<Outcome>, String), (usize, &str)> = BTreeMap::new();
        let mut whole = BTreeSet::new();
        let is_listed = |entry: &&ReportEntry| entry.outcome != Outcome::Mapped && entry.note != PART_OF_IGNORED;
        for entry in self.entries.iter().filter(is_listed) {
            let kind: Vec<&str> = entry.element.split(" \"").take(1).collect();
            let what = [&kind.concat(), entry.parameter.as_str()]
                .into_iter()
                .filter(|text| !text.is_empty())
                .collect::<Vec<_>>()
                .join(": ");
            let note = if entry.note.is_empty() { what } else { format!("{what}: {}", entry.note) };
            if entry.outcome == Outcome::Ignored && entry.parameter.is_empty() {
                whole.insert(note.clone());
            }
            kinds.entry((Reverse(entry.outcome), note)).or_insert((0, &entry.place)).0 += 1;
        }
        let line = |((Reverse(outcome), what), (count, place)): ((Reverse<Outcome>, String), (usize, &str))| {
            let outcome = if outcome == Outcome::Approximated { "approximated" } else { "ignored" };
            let times = if count > 1 { format!(" ({count} times, first at {place})") } else { format!(" ({place})") };
            format!("{outcome}: {what}{times}")
        };
        let (first, second): (Vec<_>, Vec<_>) = kinds
            .into_iter()
            .partition(|((Reverse(outcome), note), _)| *outcome == Outcome::Ignored && whole.contains(note));
        (first.into_iter().map(line).collect(), second.into_iter().map(line).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(element: &str, outcome: Outcome, note: &str) -> ReportEntry {
        ReportEntry {
            place: "s.xml:1:2".into(),
            element: element.into(),
            parameter: "alpha".into(),
            outcome,
            note: note.into(),
        }
    }

    #[test]
    fn the_same_note_about_many_elements_is_one_line() {
        let mut report = ImportReport::default();
        report.entries.push(entry("bsdf plastic \"a\"", Outcome::Mapped, ""));
        assert!(report.is_exact());
        report.entries.push(entry("bsdf plastic \"b\"", Outcome::Approximated, "GGX in place of Beckmann"));
        report.entries.push(entry("bsdf plastic \"c\"", Outcome::Approximated, "GGX in place of Beckmann"));
        report.entries.push(entry("shape hair", Outcome::Ignored, "curves are unsupported"));
        report.entries.push(ReportEntry {
            parameter: String::new(),
            ..entry("shape sdfgrid", Outcome::Ignored, "unsupported shape")
        });
        report.entries.push(entry("shape sdfgrid", Outcome::Ignored, PART_OF_IGNORED));
        assert!(!report.is_exact());
        assert_eq!((report.count(Outcome::Approximated), report.count(Outcome::Ignored)), (2, 3));
        let expected = [
            "ignored: shape sdfgrid: unsupported shape (s.xml:1:2)",
            "ignored: shape hair: alpha: curves are unsupported (s.xml:1:2)",
            "approximated: bsdf plastic: alpha: GGX in place of Beckmann (2 times, first at s.xml:1:2)",
        ];
        assert_eq!(report.summary(), expected);
        assert_eq!(report.kinds().0, expected[..1]);
    }
}
