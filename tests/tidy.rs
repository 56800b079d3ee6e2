//! The layer table and the rules of the house, enforced on the source text.

use std::fs;
use std::path::PathBuf;

use crate::util::root;

/// What goes wrong is found: each rule on a source that breaks it.
mod faults;
/// Functions and public names.
mod functions;
/// Which modules import which.
mod imports;
/// Plain words.
mod phrases;

/// All Rust code that is not generated.
const CODE: &[&str] = &["build.rs", "src", "crates", "tests", "benches", "examples", "fuzz", "python", "xtask"];
/// The library, the benchmarks and the program.
const PRODUCT: &[&str] = &["src", "crates"];
const MAX_LINES: usize = 500;
/// Of comments and strings too, which rustfmt does not wrap.
const MAX_COLUMNS: usize = 120;
const UNSAFE_HOMES: [&str; 5] = [
    "src/accel/embree/",
    "src/denoise/oidn/",
    "src/math/prefetch.rs",
    "src/memory/huge_pages.rs",
    "crates/cli/src/memory.rs",
];

struct Source {
    path: String,
    text: String,
}

impl Source {
    /// The module directly below `src` that the file belongs to.
    fn module(&self) -> &str {
        let inside = self.path.strip_prefix("src/").unwrap_or(&self.path);
        inside.split('/').next().unwrap_or(inside).trim_end_matches(".rs")
    }

    /// Lines of code with their numbers, without line comments; test modules included.
    fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text.lines().enumerate().map(|(i, line)| (i + 1, line.split("//").next().unwrap_or("")))
    }
}

/// Adds a file, or those of a folder.
fn collect(path: PathBuf, out: &mut Vec<PathBuf>) {
    if let Ok(entries) = fs::read_dir(&path) {
        entries.flatten().for_each(|entry| collect(entry.path(), out));
    } else if path.extension().is_some_and(|e| e == "rs") {
        out.push(path);
    }
}

fn sources(places: &[&str]) -> Vec<Source> {
    let root = root();
    let mut paths = Vec::new();
    for place in places {
        collect(root.join(place), &mut paths);
    }
    paths
        .iter()
        .map(|path| Source {
            path: path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/"),
            text: fs::read_to_string(path).unwrap(),
        })
        .collect()
}

/// A rule: the faults that it finds.
type Rule = fn(&[Source]) -> Vec<String>;

#[track_caller]
fn assert_holds(rule: Rule, places: &[&str]) {
    let faults = rule(&sources(places));
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn files_stay_below_the_line_limit() {
    assert_holds(long_files, CODE);
}

fn long_files(sources: &[Source]) -> Vec<String> {
    let lines = sources.iter().map(|source| (&source.path, source.text.lines().count()));
    lines.filter(|(_, lines)| *lines > MAX_LINES).map(|(path, lines)| format!("{path}: {lines} lines")).collect()
}

#[test]
fn lines_fit_in_their_columns() {
    assert_holds(long_lines, CODE);
}

fn long_lines(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources {
        let lines = source.text.lines().enumerate().filter(|(_, line)| line.chars().count() > MAX_COLUMNS);
        faults.extend(lines.map(|(i, _)| format!("{}:{}: over {MAX_COLUMNS} columns", source.path, i + 1)));
    }
    faults
}

#[test]
fn unsafe_stays_in_its_home_with_a_reason() {
    assert_holds(unsafe_code, PRODUCT);
}

fn unsafe_code(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources {
        let lines: Vec<&str> = source.text.lines().collect();
        for (line, code) in source.code() {
            let blocks = code.contains("unsafe {") || code.contains("unsafe impl");
            if !(blocks || code.contains("unsafe fn") || code.contains("unsafe extern")) {
                continue;
            }
            if !UNSAFE_HOMES.iter().any(|home| source.path.starts_with(home)) {
                faults.push(format!("{}:{line}: unsafe outside {UNSAFE_HOMES:?}", source.path));
            } else if blocks && !lines[line.saturating_sub(8)..line].iter().any(|l| l.contains("// SAFETY:")) {
                faults.push(format!("{}:{line}: no SAFETY comment", source.path));
            }
        }
    }
    faults
}

#[test]
fn the_library_neither_prints_nor_exits() {
    assert_holds(printing, PRODUCT);
}

fn printing(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources.iter().filter(|s| !s.path.starts_with("crates/cli/")) {
        for (line, code) in source.code() {
            let words = [
                "println!",
                "eprintln!",
                "print!(",
                "eprint!(",
                "process::exit",
                "process::abort",
                "todo!(",
                "unimplemented!(",
            ];
            if let Some(word) = words.iter().find(|word| code.contains(*word)) {
                faults.push(format!("{}:{line}: {word}", source.path));
            }
        }
    }
    faults
}

#[test]
fn files_are_opened_in_one_place() {
    assert_holds(opening, PRODUCT);
}

fn opening(sources: &[Source]) -> Vec<String> {
    // The system's own files, tests, and benchmarks with their children are exempt.
    let exempt = ["src/file/", "crates/bench/", "src/renderer/statistics.rs", "/tests/"];
    let mut faults = Vec::new();
    for source in sources.iter().filter(|s| !exempt.iter().any(|e| s.path.contains(e)) && !s.path.ends_with("tests.rs"))
    {
        for (line, code) in source.code().take_while(|(_, code)| !code.contains("#[cfg(test)]")) {
            let words = [
                "File::open(",
                "File::create",
                "File::options(",
                "OpenOptions",
                "fs::read(",
                "fs::read_to_string(",
                "fs::write(",
                "tempfile",
            ];
            let readers = ["read_from_file(", ".from_file(path", "ImageReader::open("];
            if let Some(word) = words.iter().chain(&readers).find(|word| code.contains(*word)) {
                faults.push(format!("{}:{line}: {word} outside src/file", source.path));
            }
        }
    }
    faults
}

#[test]
fn tolerances_live_in_one_place() {
    assert_holds(tolerances, PRODUCT);
}

fn tolerances(sources: &[Source]) -> Vec<String> {
    // Powers of ten that look like distances: `1e-4` and the like next to an origin, a t_min or an offset.
    let mut faults = Vec::new();
    for source in sources.iter().filter(|s| s.path != "src/math/float.rs") {
        for (line, code) in source.code() {
            let small = ["1e-3", "1e-4", "1e-5", "0.001", "0.0001"].iter().any(|n| code.contains(n));
            let place = ["t_min", "origin", "offset", "epsilon", "EPSILON"].iter().any(|n| code.contains(n));
            if small && place {
                faults.push(format!("{}:{line}: {}", source.path, code.trim()));
            }
        }
    }
    faults
}

#[test]
fn every_known_flaw_has_its_tests() {
    let text = fs::read_to_string(root().join("docs/flaws.md")).unwrap();
    let files = sources(&["src", "crates", "tests"]);
    let is_test = |name: &str| {
        files.iter().any(|file| {
            // A test, or a check of the catalogue of stability, of which each has one.
            let forms = [format!("#[test]\n    fn {name}()"), format!("#[test]\nfn {name}()"), format!("\" {name} \"")];
            forms.iter().any(|form| file.text.contains(form))
        })
    };
    let rows: Vec<&str> = text
        .lines()
        .filter(|line| line.starts_with("| A") || line.starts_with("| B") || line.starts_with("| C"))
        .collect();
    assert!(rows.len() >= 40, "{}", rows.len());
    let mut faults = Vec::new();
    for row in rows {
        let names: Vec<&str> =
            row.rsplit('|').nth(1).unwrap().split(',').map(|name| name.trim().trim_matches('`')).collect();
        faults.extend(names.into_iter().filter(|name| !is_test(name)).map(|name| format!("{name}: {row}")));
    }
    assert!(faults.is_empty(), "no such test:\n{}", faults.join("\n"));
}

#[test]
fn every_deliberate_fault_has_its_place() {
    let root = root();
    let faults: Vec<serde_json::Value> = serde_json::from_str(include_str!("mutants.json")).unwrap();
    assert!(faults.len() >= 50);
    for fault in &faults {
        let text = fs::read_to_string(root.join(fault["file"].as_str().unwrap())).unwrap();
        let places = text.matches(fault["old"].as_str().unwrap()).count();
        assert_eq!(places, 1, "{}", fault["name"]);
    }
}
