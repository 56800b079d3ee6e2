//! Loading scenes of every kind, with a report of what became of those of other renderers.

use std::path::Path;

use steradian::internal::import::{self, Imported, Outcome, ReportEntry};
use steradian::internal::loading;
use steradian::internal::output::{self, FileUses};
use steradian::{Error, Result};

use crate::args::{ImportArgs, Verbosity};
use crate::log::{self, Level};
use crate::text;
use crate::text::counted;

/// Lines of the summary that are shown without `-v`; more if more elements are ignored as a whole.
const SUMMARY_LINES: usize = 12;

/// Reads a scene and reports on stderr what of it was approximated or ignored.
pub fn load(path: &Path, arguments: &ImportArgs, verbosity: Verbosity) -> Result<Imported> {
    let mut imported = loading::read_scene(path, &arguments.options())?;
    if arguments.allow_missing {
        imported.leave_out_missing(path);
    }
    if let Some(file) = &arguments.report {
        let mut uses = FileUses::default();
        uses.write(file, "--report")?;
        import::files_of_scene(&imported, path).into_iter().try_for_each(|(path, place)| uses.read(&path, place))?;
        write_report(file, &imported)?;
    }
    if !verbosity.quiet {
        for line in lines(path, &imported, verbosity.verbose > 0) {
            log::message(Level::Note, &line);
        }
    }
    if arguments.strict && !imported.report.is_exact() {
        let summary = imported.report.summary();
        let more = if summary.len() > 1 { format!(", and {} more", summary.len() - 1) } else { String::new() };
        let first = summary.first().cloned().unwrap_or_default();
        return Err(Error::Scene { file: path.into(), path: "--strict".into(), message: format!("{first}{more}") });
    }
    Ok(imported)
}

fn write_report(file: &Path, imported: &Imported) -> Result<()> {
    let json = serde_json::to_string_pretty(&imported.report).map_err(|e| Error::Internal(e.to_string()))?;
    if file == Path::new("-") {
        return text::print(&json);
    }
    use std::io::Write;
    output::write_atomically(file, |out| writeln!(out, "{json}").map_err(|e| e.to_string()))
}

/// The messages of an import: every parameter, or those not imported exactly.
fn lines(path: &Path, imported: &Imported, verbose: bool) -> Vec<String> {
    let report = &imported.report;
    if report.entries.is_empty() {
        return Vec::new();
    }
    let counts = [Outcome::Mapped, Outcome::Approximated, Outcome::Ignored].map(|outcome| report.count(outcome));
    let [mapped, approximated, ignored] = counts;
    let head = format!(
        "{}: {} mapped, {approximated} approximated, {ignored} ignored",
        path.display(),
        counted(mapped as u64, "parameter")
    );
    if verbose {
        return std::iter::once(head).chain(report.entries.iter().map(line)).collect();
    }
    // What is missing from the picture as a whole is always shown.
    let (mut summary, others) = report.kinds();
    let shown = others.len().min(SUMMARY_LINES.saturating_sub(summary.len()));
    let rest = others.len() - shown;
    let kinds = if rest == 1 { "kind" } else { "kinds" };
    summary.extend(others.into_iter().take(shown));
    if rest > 0 {
        summary.push(format!("... and {rest} more {kinds} (-v or --report FILE for all)"));
    }
    std::iter::once(head).chain(summary.into_iter().map(|line| format!("  {line}"))).collect()
}

fn line(entry: &ReportEntry) -> String {
    let outcome = match entry.outcome {
        Outcome::Mapped => "mapped",
        Outcome::Approximated => "approximated",
        Outcome::Ignored => "ignored",
    };
    let parameter = if entry.parameter.is_empty() { String::new() } else { format!(": {}", entry.parameter) };
    let note = if entry.note.is_empty() { String::new() } else { format!(": {}", entry.note) };
    format!("  {}: {outcome}: {}{parameter}{note}", entry.place, entry.element)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian::internal::import::Draft;

    #[test]
    fn our_own_scenes_need_no_report_and_others_a_short_one() {
        let mut draft = Draft::default();
        assert!(lines(Path::new("s.json"), &Draft::default().finish(), true).is_empty());
        draft.mapped("s.xml:1:1", "film", "width");
        for i in 0..20 {
            draft.ignored("s.xml:2:1", "film", &format!("p{i}"), "no such thing");
        }
        let imported = draft.finish();
        let short = lines(Path::new("s.xml"), &imported, false);
        assert_eq!(short[0], "s.xml: 1 parameter mapped, 0 approximated, 20 ignored");
        assert_eq!((short.len(), short[13].contains("8 more kinds")), (14, true));
        assert_eq!(lines(Path::new("s.xml"), &imported, true).len(), 22);
    }
}
