//! Sources that break the rules: a rule that finds nothing in them holds nothing.

use super::functions::{shared_names, unwieldy_functions};
use super::imports::upward_imports;
use super::{MAX_COLUMNS, MAX_LINES, Rule, Source};
use super::{long_files, long_lines, opening, printing, tolerances, unsafe_code};

fn source(path: &str, text: impl Into<String>) -> Source {
    Source { path: path.to_owned(), text: text.into() }
}

/// Asserts that a rule finds as many faults with a text as without it, and one more that has all these words.
#[track_caller]
fn assert_finds(rule: Rule, path: &str, text: impl Into<String>, words: &[&str]) {
    let before = rule(&[]);
    let mut faults = rule(&[source(path, text)]);
    faults.retain(|fault| !before.contains(fault));
    assert!(faults.len() == 1 && words.iter().all(|word| faults[0].contains(word)), "{words:?}: {faults:?}");
}

#[track_caller]
fn assert_accepts(rule: Rule, path: &str, text: impl Into<String>) {
    assert_eq!(rule(&[source(path, text)]), rule(&[]));
}

#[test]
fn long_files_and_lines_are_found() {
    assert_finds(long_files, "src/a.rs", "\n".repeat(MAX_LINES + 1), &["src/a.rs", "501 lines"]);
    assert_accepts(long_files, "src/a.rs", "\n".repeat(MAX_LINES));
    assert_finds(long_lines, "src/a.rs", format!("\n// {}", "ä".repeat(MAX_COLUMNS - 2)), &["src/a.rs:2"]);
    assert_accepts(long_lines, "src/a.rs", "ä".repeat(MAX_COLUMNS));
}

#[test]
fn imports_from_higher_layers_are_found_however_they_are_written() {
    for text in [
        "use crate::integrator::World;",
        "use crate::{id::ShapeId, integrator::World};",
        "use crate::{\n    integrator as other,\n};",
        "use super::super::integrator::World;",
        "mod inner { use super::super::super::integrator::World; }",
        "fn f() -> crate::integrator::World { todo!() }",
        "fn f() { vectorize!(crate::integrator::run()); }",
        "macro_rules! make { () => { $crate::integrator::World }; }",
        "pub(in crate::integrator) struct A;",
    ] {
        assert_finds(upward_imports, "src/film/tile.rs", text, &["film imports integrator"]);
    }
    // Sideways, and narrower than the number of the layer.
    assert_finds(upward_imports, "src/film/tile.rs", "use crate::bsdf::Bsdf;", &["film imports bsdf"]);
    assert_finds(upward_imports, "src/accel/mod.rs", "use crate::texture::Texture;", &["accel imports texture"]);
    assert_finds(upward_imports, "src/unknown.rs", "", &["unknown is not in the layer table"]);
    for text in [
        "use crate::Error;",
        "use super::super::math::Vec3;",
        "use crate::film::Crop;",
        "use super::Film;",
        "/// [`World`](crate::integrator::World)\nstruct A;",
        "make! { /// [`World`](crate::integrator::World)\nstruct A; }",
    ] {
        assert_accepts(upward_imports, "src/film/tile.rs", text);
    }
}

#[test]
fn unsafe_code_away_from_home_or_without_a_reason_is_found() {
    let block = "fn f() { unsafe { g() } }";
    assert_finds(unsafe_code, "src/film/tile.rs", block, &["unsafe outside"]);
    assert_finds(unsafe_code, "src/accel/embree/mod.rs", block, &["no SAFETY comment"]);
    assert_accepts(unsafe_code, "src/accel/embree/mod.rs", format!("// SAFETY: a reason.\n{block}"));
}

#[test]
fn printing_opening_and_tolerances_are_found() {
    assert_finds(printing, "src/film/tile.rs", "fn f() { println!(\"\") }", &["println!"]);
    assert_accepts(printing, "crates/cli/src/main.rs", "fn f() { println!(\"\") }");
    assert_finds(opening, "src/film/tile.rs", "fn f() { File::open(\"a\") }", &["File::open("]);
    assert_accepts(opening, "src/file/input.rs", "fn f() { File::open(\"a\") }");
    assert_finds(tolerances, "src/film/tile.rs", "ray.t_min = 1e-4;", &["t_min = 1e-4"]);
}

#[test]
fn unwieldy_functions_are_found() {
    let body = |lines: usize| format!("fn f() {{{}}}", "\n".repeat(lines - 1));
    let find = |text: &str, what: &str| assert_finds(unwieldy_functions, "src/a.rs", text, &["f:", what]);
    find(&body(61), "61 lines");
    find(&format!("trait A {{ {} }}", body(61)), "61 lines");
    find("fn f(a: A, b: B, c: C, d: D, e: E, g: G) {}", "6 parameters");
    find("impl A { fn f(&self, a: A, b: B, c: C, d: D, e: E, g: G) {} }", "6 parameters");
    find("fn f(a: (usize, usize)) {}", "a tuple");
    find("fn f(a: &(usize, usize)) {}", "a tuple");
    find("fn f(a: &mut Option<A>) {}", "to write to");
    find("fn f(a: &mut usize) {}", "to write to");
    for text in [
        body(60).as_str(),
        "impl A { fn f(&self, a: A, b: B, c: C, d: D, e: E) {} }",
        "impl A for B { fn f(a: A, b: B, c: C, d: D, e: E, g: G) {} }",
        "fn f(a: (), b: Option<&mut A>, c: &Option<A>, d: &mut Vec<usize>) {}",
        "#[cfg(test)] mod tests { fn f(a: (usize, usize)) {} }",
    ] {
        assert_accepts(unwieldy_functions, "src/a.rs", text);
    }
}

#[test]
fn public_names_that_are_shared_are_found() {
    let twice = |second: &str| shared_names(&[source("src/a.rs", "pub struct Node;"), source("src/b.rs", second)]);
    for second in ["pub struct Node;", "pub enum Node {}", "pub trait Node {}", "pub type Node = u32;"] {
        assert_eq!(twice(second), ["Node: src/a.rs, src/b.rs"]);
    }
    for second in ["struct Node;", "#[cfg(test)] mod tests { pub struct Node; }", "pub struct Nodes;"] {
        assert!(twice(second).is_empty(), "{second}");
    }
}
