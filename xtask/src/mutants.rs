//! Injects faults, one at a time, and reports whether the tests named for each find it.
//!
//! ```text
//! cargo xtask mutants [NAME...]
//! ```
//!
//! `tests/mutants.json` lists one-line changes of the source with the tests that must fail on them. Each is made in a
//! copy of the tree below `target/mutants`; first the tests must pass there without any. A table goes to stdout,
//! progress to stderr; the exit code is 1 if a fault survives. About a minute a fault on two cores.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Deserialize;

use crate::{Outcome, root};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// A one-line change and who must notice it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mutant {
    /// What is wrong, in a few words.
    name: String,
    /// The source file, from the project's root.
    file: String,
    /// Text that occurs exactly once in it.
    old: String,
    /// What takes its place.
    new: String,
    /// Paths of tests of the libraries, or of `tests/` if they begin with `tests::`; each must fail.
    tests: Vec<String>,
}

/// How the tests of a tree ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    Passed,
    Failed,
    DoesNotCompile,
}

pub fn run(names: Vec<String>) -> Outcome {
    let root = root();
    let mutants: Vec<Mutant> = serde_json::from_str(&fs::read_to_string(root.join("tests/mutants.json"))?)?;
    let chosen: Vec<&Mutant> =
        mutants.iter().filter(|m| names.is_empty() || names.iter().any(|name| m.name.contains(name))).collect();
    if chosen.is_empty() {
        return Err("no mutant has such a name".into());
    }
    let tree = root.join("target/mutants/tree");
    copy_tree(root, &tree)?;

    eprintln!("without faults");
    let mut all: Vec<&str> = chosen.iter().flat_map(|m| m.tests.iter().map(String::as_str)).collect();
    all.sort_unstable();
    all.dedup();
    if run_tests(&tree, &all)? != Ending::Passed {
        return Err("the tests do not pass without faults".into());
    }

    println!("| fault | line | found by |\n|---|---|---|");
    let mut survivors = 0;
    for (i, mutant) in chosen.iter().enumerate() {
        eprintln!("{} of {}: {}", i + 1, chosen.len(), mutant.name);
        let missed = survivals(&tree, mutant)?;
        survivors += usize::from(!missed.is_empty());
        let verdict =
            if missed.is_empty() { mutant.tests.join(", ") } else { format!("**not found** by {}", missed.join(", ")) };
        println!(
            "| {} | `{}`: `{}` → `{}` | {verdict} |",
            mutant.name,
            mutant.file,
            inline(&mutant.old),
            inline(&mutant.new)
        );
    }
    println!("\n{} faults, {} found.", chosen.len(), chosen.len() - survivors);
    if survivors > 0 { Err(format!("{survivors} faults survive").into()) } else { Ok(()) }
}

/// Code on one line of a table.
fn inline(code: &str) -> String {
    code.trim().replace('|', "\\|").replace('\n', " ")
}

/// The tests that pass in spite of the fault.
fn survivals<'a>(tree: &Path, mutant: &'a Mutant) -> Result<Vec<&'a str>> {
    let file = tree.join(&mutant.file);
    let text = fs::read_to_string(&file)?;
    if text.matches(&mutant.old).count() != 1 {
        return Err(format!("{}: {:?} is not there exactly once", mutant.file, mutant.old).into());
    }
    fs::write(&file, text.replacen(&mutant.old, &mutant.new, 1))?;
    let endings: Result<Vec<_>> =
        mutant.tests.iter().map(|test| Ok((test.as_str(), run_tests(tree, &[test])?))).collect();
    fs::write(&file, text)?;
    let endings = endings?;
    if endings.iter().any(|(_, ending)| *ending == Ending::DoesNotCompile) {
        return Err(format!("{} does not compile", mutant.name).into());
    }
    Ok(endings.into_iter().filter(|(_, ending)| *ending == Ending::Passed).map(|(test, _)| test).collect())
}

/// Builds and runs tests by their full paths; a process that dies or does not end in a quarter of an hour counts as a
/// failure.
fn run_tests(tree: &Path, tests: &[&str]) -> Result<Ending> {
    let (of_tests, of_library): (Vec<&str>, Vec<&str>) = tests.iter().partition(|test| test.starts_with("tests::"));
    let mut ending = Ending::Passed;
    for (target, names) in [(&["--lib"][..], of_library), (&["--test", "tests"], of_tests)] {
        if names.is_empty() {
            continue;
        }
        let cargo = |rest: &[&str]| {
            let mut command = Command::new("timeout");
            command
                .args(["900", "cargo", "test"])
                .args(target)
                .args(["--locked", "--quiet"])
                .args(rest)
                .current_dir(tree);
            // Quicker to build, and slow enough for nobody: each fault needs a build of its own.
            command
                .env("CARGO_TARGET_DIR", tree.with_file_name("target"))
                .env("CARGO_PROFILE_DEV_OPT_LEVEL", "1")
                .env("CARGO_PROFILE_DEV_DEBUG", "0")
                .stdout(Stdio::null())
                .stderr(Stdio::null());
            command
        };
        if !cargo(&["--no-run"]).status()?.success() {
            return Ok(Ending::DoesNotCompile);
        }
        let names = names.iter().map(|name| name.strip_prefix("tests::").unwrap_or(name));
        let arguments: Vec<&str> = ["--", "--exact"].into_iter().chain(names).collect();
        if !cargo(&arguments).status()?.success() {
            ending = Ending::Failed;
        }
    }
    Ok(ending)
}

/// Copies the files that a build needs; those that are the same stay untouched, so that what was built stays fresh.
fn copy_tree(root: &Path, tree: &Path) -> Result<()> {
    for name in ["Cargo.toml", "Cargo.lock", "build.rs", "README.md", "fuzz/harness.rs", "fuzz/corpus.tar.gz"] {
        copy_if_changed(&root.join(name), &tree.join(name))?;
    }
    for folder in ["src", "crates", "tests", "benches", "examples", "scenes", "docs", "ffi", "python", "xtask"] {
        let mut folders: Vec<PathBuf> = vec![folder.into()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(root.join(&folder))? {
                let entry = entry?;
                let path = folder.join(entry.file_name());
                if entry.file_type()?.is_dir() {
                    folders.push(path);
                } else {
                    copy_if_changed(&root.join(&path), &tree.join(&path))?;
                }
            }
        }
    }
    Ok(())
}

fn copy_if_changed(from: &Path, to: &Path) -> Result<()> {
    let bytes = fs::read(from).map_err(|e| format!("{}: {e}", from.display()))?;
    if fs::read(to).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    fs::create_dir_all(to.parent().ok_or("a file is in a folder")?)?;
    Ok(fs::write(to, bytes)?)
}
