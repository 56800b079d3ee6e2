//! Where the library is looked for.

use std::path::Path;

use super::oidn::Unusable;
use super::search::{Environment, FILE_NAME, VARIABLE, inside};
use crate::error::{Error, Result};

/// Opens the library with `open`: the file or folder that the user names, else the one that the environment variable names, else the
/// system's, else that of Python's package `pyoidn`. What is named is used or refused; what is found is passed over if unusable.
///
/// # Errors
/// [`Error::Missing`] if what is named is not there or not the library, or if none is found: with where was looked and how to get it.
pub fn open_first<T>(
    named: Option<&Path>,
    environment: &Environment,
    mut open: impl FnMut(&Path) -> std::result::Result<T, Unusable>,
) -> Result<T> {
    let variable = environment.variable.as_ref().map(Path::new);
    if let Some((path, by)) = named.map(|path| (path, "--oidn-library")).or(variable.map(|path| (path, VARIABLE))) {
        return open_named(path, by, &mut open);
    }
    let mut looked = Vec::new();
    match open(Path::new(FILE_NAME)) {
        Ok(library) => return Ok(library),
        Err(Unusable(why)) if why.contains("No such file") => looked.push("where the system keeps libraries".to_owned()),
        Err(Unusable(why)) => looked.push(format!("where the system keeps libraries ({why})")),
    }
    let folders = environment.site_packages();
    for folder in &folders {
        let Some(file) = inside(folder) else {
            looked.push(format!("in {}", folder.display()));
            continue;
        };
        match open(&file) {
            Ok(library) => return Ok(library),
            Err(Unusable(why)) => looked.push(format!("in {} ({why})", folder.display())),
        }
    }
    if folders.is_empty() {
        looked.push("in Python's packages, of which there are none".to_owned());
    }
    let message = format!(
        "Intel Open Image Denoise 2 is not installed; `pip install pyoidn` brings it, and --oidn-library or {VARIABLE} name its file or folder; looked {}",
        looked.join(", ")
    );
    Err(Error::Missing { file: FILE_NAME.into(), message })
}

fn open_named<T>(path: &Path, by: &str, open: &mut impl FnMut(&Path) -> std::result::Result<T, Unusable>) -> Result<T> {
    let missing = |file: &Path, message: String| Error::Missing { file: file.to_owned(), message: format!("{message} (named by {by})") };
    let file = if path.is_dir() {
        inside(path).ok_or_else(|| missing(path, format!("there is no {FILE_NAME} in the folder; `pip install pyoidn` brings it")))?
    } else if path.is_file() {
        // A bare name would be looked for among the system's libraries.
        path.canonicalize().map_err(|e| missing(path, e.to_string()))?
    } else {
        return Err(missing(path, "there is no such file or folder; `pip install pyoidn` brings the library".to_owned()));
    };
    open(&file).map_err(|Unusable(why)| missing(&file, format!("it cannot serve as Open Image Denoise: {why}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use std::fs;
    use std::path::PathBuf;

    /// Opens nothing, and notes what was tried.
    fn refuse(tried: &mut Vec<PathBuf>) -> impl FnMut(&Path) -> std::result::Result<(), Unusable> + '_ {
        |file| {
            tried.push(file.to_owned());
            Err(Unusable("cannot open shared object file: No such file or directory".to_owned()))
        }
    }

    fn place(folder: &Path) -> PathBuf {
        fs::create_dir_all(folder).unwrap();
        let file = folder.join(FILE_NAME);
        fs::write(&file, "no library").unwrap();
        file
    }

    fn message(result: Result<()>) -> String {
        let error = result.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::AssetMissing, "{error}");
        error.to_string()
    }

    #[test]
    fn the_order_is_system_environment_python_home() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let package = "site-packages/pyoidn/oidn/lib";
        let active = place(&root.join("venv/lib/python3.12").join(package));
        let of_python = place(&root.join("usr/lib/python3.11").join(package));
        let debian = place(&root.join("usr/local/lib/python3.11/dist-packages/pyoidn/oidn/lib"));
        let own = place(&root.join("home/.local/lib/python3.11").join(package));
        let pyenv = place(&root.join("pyenv/versions/3.12.1/lib/python3.12").join(package));
        for folder in ["usr/bin", "pyenv/shims"] {
            fs::create_dir_all(root.join(folder)).unwrap();
            fs::write(root.join(folder).join("python3"), "").unwrap();
        }
        let environment = Environment {
            variable: None,
            virtual_env: Some(root.join("venv")),
            path: ["nowhere", "pyenv/shims", "usr/bin"].map(|folder| root.join(folder)).to_vec(),
            home: Some(root.join("home")),
        };
        let mut tried = Vec::new();
        let text = message(open_first(None, &environment, refuse(&mut tried)));
        assert_eq!(tried, [PathBuf::from(FILE_NAME), active, pyenv, debian, of_python.clone(), own]);
        assert!(text.contains("pip install pyoidn") && text.contains("usr/lib/python3.11/site-packages"), "{text}");
        assert!(!text.contains('\n'));

        let opened = open_first(None, &environment, |file| if file == of_python { Ok(7) } else { Err(Unusable("no".to_owned())) });
        assert_eq!(opened.unwrap(), 7);
    }

    #[test]
    fn what_is_named_is_used_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let one = place(&root.join("one/lib/python3.11/site-packages/pyoidn/oidn/lib"));
        let two = place(&root.join("two"));
        let environment = Environment { variable: Some(two.clone().into()), ..Environment::default() };
        let mut tried = Vec::new();
        let text = message(open_first(Some(&root.join("one")), &environment, refuse(&mut tried)));
        assert_eq!(tried, [one]);
        assert!(text.contains("--oidn-library"), "{text}");
        tried.clear();
        let text = message(open_first(None, &environment, refuse(&mut tried)));
        assert_eq!(tried, [two]);
        assert!(text.contains(VARIABLE), "{text}");
        for absent in ["absent", "one/lib/absent.so"] {
            let text = message(open_first(Some(&root.join(absent)), &environment, |_| Ok(())));
            assert!(text.contains(absent) && text.contains("pip install pyoidn"), "{text}");
        }
        let empty = root.join("empty");
        fs::create_dir(&empty).unwrap();
        assert!(message(open_first(Some(&empty), &environment, |_| Ok(()))).contains("there is no libOpenImageDenoise.so.2 in the folder"));
    }

    #[test]
    fn without_python_the_message_says_so() {
        let text = message(open_first(None, &Environment::default(), refuse(&mut Vec::new())));
        assert!(text.contains("where the system keeps libraries, in Python's packages, of which there are none"), "{text}");
    }
}
