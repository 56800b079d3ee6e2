//! The bibliography of the book has the works that comments cite by title, and no others.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::util::root;

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The comments of a source as one line.
fn comments(source: &str) -> String {
    let lines = source.lines().filter_map(|line| line.trim_start().strip_prefix("//"));
    lines.map(|line| line.trim_start_matches(['/', '!']).trim()).collect::<Vec<_>>().join(" ")
}

/// Quoted titles in a text: at least three words, the first capital, and no sentence.
fn titles(text: &str) -> BTreeSet<String> {
    let quoted = text.split('"').skip(1).step_by(2);
    let is_title = |quote: &&str| {
        let first = quote.trim_start_matches('\'').chars().next();
        first.is_some_and(char::is_uppercase) && quote.split(' ').count() >= 3 && !quote.ends_with('.')
    };
    quoted.filter(is_title).map(str::to_owned).collect()
}

#[test]
fn cited_works_and_the_bibliography_are_the_same() {
    let root = root();
    let mut files = Vec::new();
    for folder in ["src", "crates", "xtask/src"] {
        rust_files(&root.join(folder), &mut files);
    }
    let cited: BTreeSet<String> =
        files.iter().flat_map(|file| titles(&comments(&fs::read_to_string(file).unwrap()))).collect();
    let page = fs::read_to_string(root.join("docs/book/src/bibliography.md")).unwrap();
    let listed = titles(&page.split_whitespace().collect::<Vec<_>>().join(" "));
    let missing: Vec<_> = cited.difference(&listed).collect();
    let unused: Vec<_> = listed.difference(&cited).collect();
    assert!(cited.len() > 70, "{} works", cited.len());
    assert!(missing.is_empty() && unused.is_empty(), "not listed: {missing:#?}\nnot cited: {unused:#?}");
}

#[test]
fn titles_of_comments_are_found() {
    let source = "/// A box (Ize, \"Robust BVH\n/// Ray Traversal\").\nlet a = \"No Title At All\";\n// Like \"this\".";
    assert_eq!(titles(&comments(source)), BTreeSet::from(["Robust BVH Ray Traversal".to_owned()]));
}
