//! The layer table, on the syntax trees of the sources.

use std::collections::HashMap;

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{ItemMod, ItemUse, Macro, Path, UseTree};

use super::{Source, assert_holds};

/// Imports narrower than the layer number allows.
const NARROW: &[(&str, &[&str])] = &[
    ("accel", &["geometry", "math", "error", "id"]),
    ("denoise", &["film", "error", "file", "math", "color", "output"]),
    ("output", &["film", "color", "error", "desc", "file", "math"]),
    (
        "scene",
        &[
            "attribute",
            "bsdf",
            "camera",
            "film",
            "geometry",
            "id",
            "light",
            "material",
            "medium",
            "normal_perturbation",
            "texture",
            "math",
            "color",
        ],
    ),
];

/// Modules with their layers, from the table at the top of `src/lib.rs`: a module imports only from lower layers, never
/// sideways.
fn layers() -> HashMap<&'static str, u32> {
    let rows = include_str!("../../src/lib.rs").lines().filter_map(|line| {
        let (layer, modules) = line.strip_prefix("//! | ")?.trim_end_matches(" |").split_once(" | ")?;
        Some((layer.parse().ok()?, modules))
    });
    let modules =
        rows.flat_map(|(layer, modules)| modules.split(", ").map(move |module| (module.trim_matches('`'), layer)));
    modules.collect()
}

#[test]
fn modules_import_only_from_lower_layers() {
    assert_holds(upward_imports, &["src"]);
}

/// Imports that the layer table forbids.
pub fn upward_imports(sources: &[Source]) -> Vec<String> {
    let layers = layers();
    let layer = |module: &str| layers.get(module).copied();
    let mut faults = Vec::new();
    for source in sources {
        let module = source.module();
        if module == "lib" {
            continue;
        }
        let Some(own) = layer(module) else {
            faults.push(format!("{}: module {module} is not in the layer table", source.path));
            continue;
        };
        for target in imported_modules(source).iter().filter(|target| *target != module) {
            // Of what the crate root re-exports, modules import only the error type from there.
            let target = if ["Error", "ErrorKind", "Result"].contains(&target.as_str()) { "error" } else { target };
            let allowed = layer(target).is_some_and(|l| l < own);
            let narrow = NARROW.iter().find(|(m, _)| *m == module).is_none_or(|(_, list)| list.contains(&target));
            if !allowed || !narrow {
                faults.push(format!("{}: {module} imports {target}", source.path));
            }
        }
    }
    faults
}

/// The modules below the crate's root that a file names.
fn imported_modules(source: &Source) -> Vec<String> {
    let path = source.path.trim_start_matches("src/").trim_end_matches(".rs").trim_end_matches("/mod");
    let mut imports = Imports { module: path.split('/').map(str::to_owned).collect(), modules: Vec::new() };
    imports.visit_file(&syn::parse_file(&source.text).unwrap_or_else(|e| panic!("{}: {e}", source.path)));
    imports.modules
}

/// Walks one file.
struct Imports {
    /// The module under way.
    module: Vec<String>,
    modules: Vec<String>,
}

impl Imports {
    /// Resolves a path from the module under way, as far as it leads through modules around that.
    fn add(&mut self, path: &[String]) {
        let mut at = self.module.clone();
        for (i, name) in path.iter().enumerate() {
            match name.as_str() {
                "crate" if i == 0 => at.clear(),
                "self" if i == 0 => {}
                "super" => drop(at.pop()),
                _ if i == 0 => return,
                _ => {
                    if at.is_empty() {
                        self.modules.push(name.clone());
                    }
                    return;
                }
            }
        }
    }

    fn add_tree(&mut self, tree: &UseTree, path: &[String]) {
        let with = |name: &syn::Ident| [path, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(tree) => self.add_tree(&tree.tree, &with(&tree.ident)),
            UseTree::Name(tree) => self.add(&with(&tree.ident)),
            UseTree::Rename(tree) => self.add(&with(&tree.ident)),
            UseTree::Glob(_) => self.add(path),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.add_tree(tree, path)),
        }
    }

    /// Paths from the crate's root in what a macro takes or makes.
    fn add_tokens(&mut self, tokens: &TokenStream) {
        let tokens: Vec<TokenTree> = tokens.clone().into_iter().collect();
        for (i, token) in tokens.iter().enumerate() {
            match token {
                TokenTree::Group(group) => self.add_tokens(&group.stream()),
                TokenTree::Ident(ident) if ident == "crate" => {
                    // Two colons lie between.
                    if let Some(TokenTree::Ident(name)) = tokens.get(i + 3) {
                        self.add(&["crate".to_owned(), name.to_string()]);
                    }
                }
                _ => {}
            }
        }
    }
}

impl<'ast> Visit<'ast> for Imports {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        self.module.push(item.ident.to_string());
        visit::visit_item_mod(self, item);
        self.module.pop();
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.add_tree(&item.tree, &[]);
    }

    fn visit_path(&mut self, path: &'ast Path) {
        self.add(&path.segments.iter().map(|segment| segment.ident.to_string()).collect::<Vec<_>>());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast Macro) {
        self.add_tokens(&item.tokens);
        visit::visit_macro(self, item);
    }
}
