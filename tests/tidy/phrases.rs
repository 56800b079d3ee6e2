//! Help, errors and documents are in the field's plain English: phrases that are not.

use std::fs;

use proc_macro2::{TokenStream, TokenTree};

use super::{PRODUCT, Source, assert_holds, sources};
use crate::util::root;

/// Phrases that neither messages, nor help, nor the manual of the scene format, nor documents have.
const BANNED: &[&str] = &[
    // Personified programs and things.
    "is told",
    "are told",
    "is said in",
    "and said so",
    "it says so",
    "the program thinks",
    "the program knows",
    "the program wants",
    "is refused by the name",
    // Words that no manual of the field has.
    "whom ",
    " anew",
    " of ours",
    "mend it",
    "mend: ",
    "begin anew",
    "is passed over",
    "does no harm",
    "when it is there",
    "those that are there",
    "though the scene",
    "is there for",
    "what became of",
    "what shall ",
    "what finds hits",
    "if it does not lie",
    "go on though",
    "goes without saying",
    "course renderer",
    "there is such a",
];

/// Beginnings of messages that have a shorter and plainer form: "no file ...", "... are unsupported".
const BANNED_BEGINNINGS: &[&str] = &["there is no ", "there are no "];

/// Sources whose comments users read: help of the command line, and the manual of the scene format.
const MANUALS: [&str; 2] = ["crates/cli/src/args/", "src/desc/"];

/// Documents for users.
const DOCUMENTS: [&str; 4] = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"];

#[test]
fn messages_and_help_are_in_plain_words() {
    assert_holds(phrases, PRODUCT);
}

#[test]
fn documents_are_in_plain_words() {
    let root = root();
    let folders = ["docs", "docs/book/src"].map(|folder| fs::read_dir(root.join(folder)).unwrap());
    let docs = folders.into_iter().flatten().map(|entry| entry.unwrap().path());
    let documents = docs.chain(DOCUMENTS.map(|name| root.join(name))).filter(|path| path.extension().is_some());
    let mut faults = Vec::new();
    let mut read = 0;
    for path in documents {
        let text = fs::read_to_string(&path).unwrap();
        // Lines of a paragraph are one text.
        faults.extend(banned_in(&text.replace('\n', " ")).map(|phrase| format!("{}: {phrase}", path.display())));
        read += 1;
    }
    assert!(read > 20, "only {read} documents");
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// Messages and manuals that have a banned phrase.
pub fn phrases(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources {
        let tokens: TokenStream = source.text.parse().unwrap();
        let mut texts = Vec::new();
        texts_of(tokens, MANUALS.iter().any(|manual| source.path.starts_with(manual)), &mut texts);
        for text in texts {
            let beginning = BANNED_BEGINNINGS.iter().find(|beginning| text.starts_with(**beginning));
            let found = banned_in(&text).chain(beginning.copied());
            faults.extend(found.map(|phrase| format!("{}: \"{phrase}\" in: {text}", source.path)));
        }
    }
    faults
}

fn banned_in(text: &str) -> impl Iterator<Item = &'static str> {
    let text = text.to_lowercase();
    BANNED.iter().copied().filter(move |phrase| text.contains(phrase))
}

/// The string literals of a source; comments only if these are for users.
fn texts_of(tokens: TokenStream, with_comments: bool, texts: &mut Vec<String>) {
    let mut before = " ".to_owned();
    for token in tokens {
        match &token {
            TokenTree::Group(group) => {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                let is_comment =
                    matches!(&inner[..], [TokenTree::Ident(name), ..] if *name == "doc") && "#!".contains(&before);
                if !is_comment || with_comments {
                    texts_of(group.stream(), with_comments, texts);
                }
            }
            TokenTree::Literal(literal) => {
                if let Ok(text) = syn::parse_str::<syn::LitStr>(&literal.to_string()) {
                    texts.push(text.value().trim().to_owned());
                }
            }
            _ => {}
        }
        before = token.to_string();
    }
}

#[test]
fn banned_phrases_are_found_in_messages_help_and_manuals() {
    let source = |path: &str, text: &str| Source { path: path.to_owned(), text: text.to_owned() };
    let count = |path: &str, text: &str| phrases(&[source(path, text)]).len();
    assert_eq!(count("src/a.rs", "fn f() { g(format!(\"there is no file {a}\")) }"), 1);
    assert_eq!(count("src/a.rs", "fn f() { g(\"Whom it is for\") }"), 1);
    assert_eq!(count("src/a.rs", "/// What finds hits.\nfn f() {}"), 0);
    assert_eq!(count("src/desc/a.rs", "/// What finds hits.\nfn f() {}"), 1);
    assert_eq!(count("crates/cli/src/args/a.rs", "struct A { /// Whom it is for\n a: u8 }"), 1);
    assert_eq!(count("src/a.rs", "fn f() { g(\"no file {a}\") }"), 0);
    assert!(sources(PRODUCT).len() > 300);
}
