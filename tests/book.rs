//! The book: generated pages are those of the program, its scenes compile, its links lead somewhere.

use std::fs;
use std::path::{Path, PathBuf};

use steradian::internal::{compile, import};

use crate::util::program::run;
use crate::util::root;

/// The files of a folder and those in it with this extension.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn generated_pages_are_those_of_the_program() {
    for (command, name) in [("schema", "format"), ("man", "commands")] {
        let made = tempfile::tempdir().unwrap();
        assert!(run(made.path(), &format!("{command} --markdown pages")).status.success());
        let kept = root().join("docs/book/src").join(name);
        let pages = |folder: &Path| -> Vec<(PathBuf, String)> {
            let page =
                |file: PathBuf| (file.strip_prefix(folder).unwrap().to_owned(), fs::read_to_string(&file).unwrap());
            files(folder, "md").into_iter().map(page).collect()
        };
        let (made, kept) = (pages(&made.path().join("pages")), pages(&kept));
        assert!(made.len() > 9, "{command}: {} pages", made.len());
        let advice = format!("run: steradian {command} --markdown docs/book/src/{name}");
        let names = |pages: &[(PathBuf, String)]| pages.iter().map(|page| page.0.clone()).collect::<Vec<_>>();
        assert_eq!(names(&made), names(&kept), "{advice}");
        for (made, kept) in made.iter().zip(&kept) {
            assert!(made == kept, "{} differs; {advice}", made.0.display());
        }
    }
}

#[test]
fn scenes_of_the_book_compile() {
    let scenes = files(&root().join("docs/book/scenes"), "json");
    assert_eq!(scenes.len(), 8);
    for path in scenes {
        let desc = import::load_scene(&path).unwrap();
        compile::compile(&desc, &path).unwrap();
    }
}

#[test]
fn examples_of_shapes_and_materials_compile() {
    let book = root().join("docs/book");
    let stage = fs::read_to_string(book.join("stage.json")).unwrap();
    let examples = fs::read_to_string(root().join("crates/cli/src/manual/examples.txt")).unwrap();
    let mut count = 0;
    for block in examples.split("\n# ").skip(1) {
        let (head, body) = block.split_once('\n').unwrap();
        let mut scene: serde_json::Value = serde_json::from_str(&stage).unwrap();
        let mut entry: serde_json::Value = serde_json::from_str(body).unwrap();
        match head.split_once(' ').unwrap_or((head, "")).0 {
            "ShapeDesc" | "SubdivisionDesc" | "DisplacementDesc" => {}
            "MaterialDesc" => {
                scene["materials"]["shown"] = entry;
                entry = serde_json::json!({ "type": "sphere", "material": "shown" });
            }
            _ => continue,
        }
        scene["shapes"].as_array_mut().unwrap().push(entry);
        // Paths of the stage are relative to `scenes`.
        let path = root().join("scenes/stage.json");
        let desc = serde_json::from_value(scene).unwrap_or_else(|e| panic!("{head}: {e}"));
        compile::compile(&desc, &path).unwrap_or_else(|e| panic!("{head}: {e}"));
        count += 1;
    }
    assert!(count > 20, "{count}");
}

/// Targets of Markdown's links and pictures, and of mdBook's includes.
fn targets(text: &str) -> Vec<&str> {
    let links = text.split("](").skip(1).filter_map(|rest| rest.split([')', ' ', '\n']).next());
    let includes = text.split("{{#include ").skip(1).filter_map(|rest| rest.split("}}").next());
    links.chain(includes).collect()
}

#[test]
fn links_of_the_book_lead_to_files() {
    let src = root().join("docs/book/src");
    let summary = fs::read_to_string(src.join("SUMMARY.md")).unwrap();
    let (mut faults, mut count) = (Vec::new(), 0);
    for page in files(&src, "md") {
        let name = page.strip_prefix(&src).unwrap().to_string_lossy().into_owned();
        if name != "SUMMARY.md" && !summary.contains(&format!("({name})")) {
            faults.push(format!("{name} is not in SUMMARY.md"));
        }
        let text = fs::read_to_string(&page).unwrap();
        for target in targets(&text).into_iter().filter(|target| !target.contains("://")) {
            count += 1;
            let file = target.split('#').next().unwrap();
            if !file.is_empty() && !page.parent().unwrap().join(file).exists() {
                faults.push(format!("{name}: {target}"));
            }
        }
    }
    assert!(count > 100, "only {count} links");
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn pictures_of_the_book_are_small() {
    let sizes = files(&root().join("docs/book"), "jpg").into_iter().map(|file| {
        let bytes = fs::metadata(&file).unwrap().len();
        let name = file.file_name().unwrap().to_string_lossy();
        // Pictures of the gallery and of whole windows fill a page, all others are thumbnails.
        let is_wide = ["gallery_", "blender", "report_", "view"].iter().any(|prefix| name.starts_with(prefix));
        let limit = if is_wide { 400_000 } else { 30_000 };
        assert!(bytes <= limit, "{}: {bytes} bytes", file.display());
        bytes
    });
    assert!((1..5_000_000).contains(&sizes.sum::<u64>()));
}

#[test]
fn the_gallery_shows_every_picture_of_its_scripts() {
    let book = root().join("docs/book");
    let page = fs::read_to_string(book.join("src/gallery.md")).unwrap();
    let mut count = 0;
    for script in ["glass", "indoors", "outdoors", "studio"] {
        let text = fs::read_to_string(book.join(format!("gallery/{script}.py"))).unwrap();
        let list = text.rsplit("SCENES = [").next().unwrap().trim_end().trim_end_matches(']');
        for name in list.split(", ") {
            assert!(page.contains(&format!("## `{name}`")), "gallery.md lacks {name}");
            assert!(page.contains(&format!("(pictures/gallery_{name}.jpg)")), "gallery.md does not show {name}");
            count += 1;
        }
    }
    assert_eq!(page.matches("(pictures/gallery_").count(), count);
}
