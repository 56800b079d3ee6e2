//! The library's public interface as text: `cargo xtask api` writes `api.txt` from the pages that `cargo doc` makes,
//! and `cargo xtask api --check` fails if the file is not up to date, so that no change of the interface goes unseen.
//! With `--documented` the pages are those of the last `cargo doc`, which must have left out private items.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Outcome, root};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

pub fn run(arguments: &[String]) -> Outcome {
    let file = root().join("api.txt");
    let has = |option: &str| arguments.iter().any(|argument| argument == option);
    let found = interface(&pages(has("--documented"))?)?;
    if !has("--check") {
        return Ok(fs::write(&file, found)?);
    }
    let kept = fs::read_to_string(&file)?;
    if kept == found {
        return Ok(());
    }
    let only_in = |text: &str, other: &str, mark| -> String {
        let lines = text.lines().filter(|line| !other.lines().any(|other| other == *line));
        lines.map(|line| format!("{mark} {line}\n")).collect()
    };
    let (lost, added) = (only_in(&kept, &found, '-'), only_in(&found, &kept, '+'));
    Err(format!("the library's interface has changed; if it should, write it with `cargo xtask api`:\n{lost}{added}")
        .into())
}

/// Makes the documentation of what is public, unless it is there; the result is its folder.
fn pages(is_made: bool) -> Result<PathBuf> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    let folder = target.join("doc/steradian");
    if is_made {
        return Ok(folder);
    }
    // It may be that of private items.
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    let mut command = Command::new(env!("CARGO"));
    command.args(["doc", "--quiet", "--locked", "--no-deps", "--lib", "--package", "steradian"]).current_dir(root());
    if command.status()?.success() { Ok(folder) } else { Err("cargo doc failed".into()) }
}

/// Every item by its path: its declaration, then its constants and functions.
fn interface(folder: &Path) -> Result<String> {
    let index = fs::read_to_string(folder.join("all.html"))?;
    let mut items = BTreeMap::new();
    for link in index
        .split("<li><a href=\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .filter(|link| link.ends_with(".html"))
    {
        let page = fs::read_to_string(folder.join(link))?;
        let Some((module, name)) = Path::new(link).parent().zip(Path::new(link).file_stem()) else { continue };
        // `struct.Renderer` in the folder of its module.
        let name = name.to_string_lossy();
        let name = name.split_once('.').map_or(&*name, |(_, name)| name);
        let path = module.join(name).to_string_lossy().replace('/', "::");
        let mut lines: Vec<String> = between(&page, "<pre class=\"rust item-decl\">", "</pre>")
            .flat_map(|text| plain(text).lines().map(str::to_owned).collect::<Vec<_>>())
            .collect();
        for section in between(&page, "<section id=\"method.", "</section>")
            .chain(between(&page, "<section id=\"associatedconstant.", "</section>"))
            .filter(|section| !section.contains("trait-impl\""))
        {
            let header = between(section, "<h4 class=\"code-header\">", "</h4>").map(plain);
            lines.extend(header.map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")));
        }
        items.insert(path, lines);
    }
    let text = |(path, lines): (&String, &Vec<String>)| format!("{path}\n    {}\n", lines.join("\n    "));
    Ok(items.iter().map(text).collect())
}

/// The texts between two marks.
fn between<'a>(text: &'a str, start: &'a str, end: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(start).skip(1).filter_map(move |rest| rest.split(end).next())
}

/// Without tags, and without what only a browser shows.
fn plain(html: &str) -> String {
    let mut out = String::new();
    let mut rest = html;
    while let Some((before, tag)) = rest.split_once('<') {
        out.push_str(before);
        let skipped = if tag.starts_with("summary") { "</summary>" } else { ">" };
        rest = tag.split_once(skipped).map_or("", |(_, after)| after);
    }
    out.push_str(rest);
    [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")]
        .iter()
        .fold(out, |text, (from, to)| text.replace(from, to))
}
