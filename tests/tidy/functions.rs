//! Rules for functions and public names, on the syntax trees of the sources.

use std::collections::BTreeMap;

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{
    Attribute, Block, FnArg, ImplItemFn, ItemEnum, ItemFn, ItemImpl, ItemMod, ItemStruct, ItemTrait, ItemType,
    TraitItemFn,
};
use syn::{Ident, Item, Signature, Type, Visibility};

use super::{PRODUCT, Source, assert_holds};

const MAX_FUNCTION_LINES: usize = 60;
/// Beside `self`.
const MAX_PARAMETERS: usize = 5;

/// Why a kernel has many parameters.
const ROWS: &str = "rows are separate parameters, so that the compiler can assume that they do not overlap";

/// Functions that break a rule of [`Rule`], by file and name, with the reason.
const EXCEPTIONS: &[(Rule, &str, &str, &str)] = &[
    (Rule::Parameters, "src/geometry/placed/points.rs", "resolve", ROWS),
    (Rule::Parameters, "src/geometry/placed/points.rs", "resolve_on", ROWS),
    (Rule::Parameters, "src/integrator/path/direct.rs", "illuminate", ROWS),
    (Rule::Parameters, "src/integrator/path/scatter.rs", "spawn_rays", ROWS),
    (Rule::Parameters, "src/light/area/queue.rs", "set_samples", ROWS),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    Length,
    Parameters,
    TupleParameter,
    OutParameter,
}

/// Whether an item is only compiled for tests.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| {
        a.path().is_ident("test")
            || a.path().is_ident("cfg") && a.meta.require_list().is_ok_and(|list| list.tokens.to_string() == "test")
    })
}

fn is_tuple(ty: &Type) -> bool {
    match ty {
        Type::Tuple(tuple) => tuple.elems.len() > 1,
        Type::Reference(reference) => is_tuple(&reference.elem),
        _ => false,
    }
}

/// Whether a type is `&mut` of an `Option` or of a number.
fn is_out_parameter(ty: &Type) -> bool {
    const NUMBERS: [&str; 12] =
        ["bool", "f32", "f64", "i32", "i64", "isize", "u8", "u32", "u64", "usize", "Rgb", "Vec3"];
    let Type::Reference(reference) = ty else { return false };
    let Type::Path(path) = &*reference.elem else { return false };
    let last = path.path.segments.last().unwrap();
    let is_option = last.ident == "Option" && !last.arguments.is_none();
    reference.mutability.is_some() && (is_option || NUMBERS.iter().any(|number| last.ident == number))
}

/// Walks one file.
struct Checker<'a> {
    path: &'a str,
    /// Functions within `impl Trait for ..`, whose parameters the trait decides.
    in_trait_impl: bool,
    faults: Vec<(Rule, String, String)>,
}

impl Checker<'_> {
    fn add(&mut self, rule: Rule, signature: &Signature, what: &str) {
        let line = signature.span().start().line;
        self.faults.push((
            rule,
            signature.ident.to_string(),
            format!("{}:{line}: {}: {what}", self.path, signature.ident),
        ));
    }

    fn check(&mut self, signature: &Signature, body: Option<&Block>) {
        if let Some(body) = body {
            let close: Span = body.brace_token.span.close();
            let lines = close.end().line - signature.span().start().line + 1;
            if lines > MAX_FUNCTION_LINES {
                self.add(Rule::Length, signature, &format!("{lines} lines"));
            }
        }
        if self.in_trait_impl {
            return;
        }
        let parameters = || {
            signature
                .inputs
                .iter()
                .filter_map(|input| if let FnArg::Typed(typed) = input { Some(&*typed.ty) } else { None })
        };
        if parameters().count() > MAX_PARAMETERS {
            self.add(Rule::Parameters, signature, &format!("{} parameters", parameters().count()));
        }
        if parameters().any(is_tuple) {
            self.add(Rule::TupleParameter, signature, "a tuple as parameter");
        }
        if parameters().any(is_out_parameter) {
            self.add(Rule::OutParameter, signature, "an `Option` or a number to write to");
        }
    }
}

impl<'ast> Visit<'ast> for Checker<'_> {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast ItemImpl) {
        let outer = std::mem::replace(&mut self.in_trait_impl, item.trait_.is_some());
        if !is_test(&item.attrs) {
            visit::visit_item_impl(self, item);
        }
        self.in_trait_impl = outer;
    }

    fn visit_item_fn(&mut self, item: &'ast ItemFn) {
        let outer = std::mem::replace(&mut self.in_trait_impl, false);
        if !is_test(&item.attrs) {
            self.check(&item.sig, Some(&item.block));
            visit::visit_item_fn(self, item);
        }
        self.in_trait_impl = outer;
    }

    fn visit_impl_item_fn(&mut self, item: &'ast ImplItemFn) {
        if !is_test(&item.attrs) {
            self.check(&item.sig, Some(&item.block));
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_trait_item_fn(&mut self, item: &'ast TraitItemFn) {
        self.check(&item.sig, item.default.as_ref());
        visit::visit_trait_item_fn(self, item);
    }
}

/// The files of the crate without their tests, as syntax trees.
fn trees(sources: &[Source]) -> impl Iterator<Item = (&str, syn::File)> {
    let files = sources.iter().filter(|s| !s.path.contains("/tests/") && !s.path.ends_with("tests.rs"));
    files.map(|s| (s.path.as_str(), syn::parse_file(&s.text).unwrap_or_else(|e| panic!("{}: {e}", s.path))))
}

#[test]
fn functions_are_short_with_few_plain_parameters() {
    assert_holds(unwieldy_functions, PRODUCT);
}

/// Functions that break a rule of [`Rule`] without an exception, and exceptions that are not needed.
pub fn unwieldy_functions(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    let mut used = vec![false; EXCEPTIONS.len()];
    for (path, tree) in trees(sources) {
        let mut checker = Checker { path, in_trait_impl: false, faults: Vec::new() };
        checker.visit_file(&tree);
        for (rule, function, text) in checker.faults {
            match EXCEPTIONS.iter().position(|(r, p, f, _)| (r, *p, *f) == (&rule, path, &function)) {
                Some(i) => used[i] = true,
                None => faults.push(text),
            }
        }
    }
    let needless = EXCEPTIONS.iter().zip(used).filter(|(_, used)| !used).map(|(exception, _)| exception);
    faults.extend(needless.map(|exception| format!("needless exception: {exception:?}")));
    faults
}

/// A type of a module with its visibility.
fn defined_type(item: &Item) -> Option<(&Visibility, &Ident)> {
    match item {
        Item::Struct(ItemStruct { vis, ident, .. })
        | Item::Enum(ItemEnum { vis, ident, .. })
        | Item::Trait(ItemTrait { vis, ident, .. })
        | Item::Type(ItemType { vis, ident, .. }) => Some((vis, ident)),
        _ => None,
    }
}

#[test]
fn public_types_have_names_of_their_own() {
    assert_holds(shared_names, &["src"]);
}

/// Names that more than one public type has.
pub fn shared_names(sources: &[Source]) -> Vec<String> {
    let mut files: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (path, tree) in trees(sources) {
        for (visibility, name) in tree.items.iter().filter_map(defined_type) {
            if matches!(visibility, Visibility::Public(_)) {
                files.entry(name.to_string()).or_default().push(path.to_owned());
            }
        }
    }
    files.retain(|_, files| files.len() > 1);
    files.iter().map(|(name, files)| format!("{name}: {}", files.join(", "))).collect()
}
