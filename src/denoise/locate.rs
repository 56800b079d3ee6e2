//! Where the library is looked for.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::oidn::Unusable;
use crate::error::{Error, Result};

/// The environment variable that names the library's file, or a folder with it.
pub const VARIABLE: &str = "STERADIAN_OIDN";

/// The library's name on Linux; the number is the major version.
pub const FILE_NAME: &str = "libOpenImageDenoise.so.2";

/// Where a folder may hold the library: itself, a prefix, and PyPI's `pyoidn` from inside out.
const INSIDE: [&str; 4] = ["", "lib", "oidn/lib", "pyoidn/oidn/lib"];

/// What of the process' environment matters.
#[derive(Clone, Debug, Default)]
pub struct ProcessEnvironment {
    /// [`VARIABLE`]; empty counts as absent.
    pub variable: Option<OsString>,
    /// `VIRTUAL_ENV`: the active environment of Python.
    pub virtual_env: Option<PathBuf>,
    /// The folders of `PATH`.
    pub path: Vec<PathBuf>,
    /// `HOME`.
    pub home: Option<PathBuf>,
}

impl ProcessEnvironment {
    /// That of the process.
    pub fn of_process() -> Self {
        let given = |name| env::var_os(name).filter(|value| !value.is_empty());
        Self {
            variable: given(VARIABLE),
            virtual_env: given("VIRTUAL_ENV").map(PathBuf::from),
            path: given("PATH").map(|path| env::split_paths(&path).collect()).unwrap_or_default(),
            home: given("HOME").map(PathBuf::from),
        }
    }

    /// The folders in which Python's packages may be: of the active environment, of every `python3` on `PATH`, and the
    /// user's own.
    fn site_packages(&self) -> Vec<PathBuf> {
        let mut prefixes: Vec<PathBuf> = self.virtual_env.iter().cloned().collect();
        for python in self.path.iter().map(|folder| folder.join("python3")).filter(|file| file.is_file()) {
            let prefix = |file: &Path| file.parent().and_then(Path::parent).map(Path::to_owned);
            let own = prefix(&python);
            let behind = python.canonicalize().ok().and_then(|file| prefix(&file));
            // Debian keeps what pip installs apart from what apt installs.
            prefixes.extend(own.iter().chain(&behind).flat_map(|prefix| [prefix.join("local"), prefix.clone()]));
            // The commands of pyenv stand beside the Pythons that they run.
            prefixes.extend(own.iter().flat_map(|root| sorted(&root.join("versions"), "")));
        }
        prefixes.extend(self.home.as_ref().map(|home| home.join(".local")));
        let mut folders = Vec::new();
        for folder in prefixes.iter().flat_map(|prefix| packages_below(prefix)) {
            if !folders.contains(&folder) {
                folders.push(folder);
            }
        }
        folders
    }
}

/// The folders of packages of every Python 3 below a prefix, in a fixed order.
fn packages_below(prefix: &Path) -> Vec<PathBuf> {
    let pythons = ["lib", "lib64"].into_iter().flat_map(|lib| sorted(&prefix.join(lib), "python3"));
    let packages = pythons.flat_map(|python| ["site-packages", "dist-packages"].map(|name| python.join(name)));
    packages.filter(|folder| folder.is_dir()).collect()
}

/// What is in a folder and has a name that begins so, in order.
fn sorted(folder: &Path, start: &str) -> Vec<PathBuf> {
    let entries = folder.read_dir().into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(start))
        .map(|entry| entry.path())
        .collect();
    found.sort();
    found
}

/// The library inside a folder, if it is there; the folder may be an environment of Python.
fn inside(folder: &Path) -> Option<PathBuf> {
    let folders = std::iter::once(folder.to_owned()).chain(packages_below(folder));
    folders.flat_map(|folder| INSIDE.map(|below| folder.join(below).join(FILE_NAME))).find(|file| file.is_file())
}

/// Opens the library with `open`: the file or folder that the user names, else the one that the environment variable
/// names, else the system's, else that of Python's package `pyoidn`. What is named is used or rejected; what is found
/// is passed over if unusable.
///
/// # Errors
/// [`Error::Missing`] if what is named is not there or not the library, or if none is found: with where was looked and
/// how to get it.
pub fn open_first<T>(
    named: Option<&Path>,
    environment: &ProcessEnvironment,
    mut open: impl FnMut(&Path) -> std::result::Result<T, Unusable>,
) -> Result<T> {
    let variable = environment.variable.as_ref().map(Path::new);
    if let Some((path, by)) = named.map(|path| (path, "--oidn-library")).or(variable.map(|path| (path, VARIABLE))) {
        return open_named(path, by, &mut open);
    }
    let mut looked = Vec::new();
    match open(Path::new(FILE_NAME)) {
        Ok(library) => return Ok(library),
        Err(Unusable(why)) if why.contains("No such file") => {
            looked.push("where the system keeps libraries".to_owned());
        }
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
        "Intel Open Image Denoise 2 is not installed; `pip install pyoidn` installs it, and --oidn-library or \
         {VARIABLE} name its file or folder; looked {}",
        looked.join(", ")
    );
    Err(Error::Missing { file: FILE_NAME.into(), message })
}

fn open_named<T>(path: &Path, by: &str, open: &mut impl FnMut(&Path) -> std::result::Result<T, Unusable>) -> Result<T> {
    let missing = |file: &Path, message: String| Error::Missing {
        file: file.to_owned(),
        message: format!("{message} (named by {by})"),
    };
    let file = if path.is_dir() {
        inside(path)
            .ok_or_else(|| missing(path, format!("no {FILE_NAME} in the folder; `pip install pyoidn` installs it")))?
    } else if path.is_file() {
        // A bare name would be looked for among the system's libraries.
        path.canonicalize().map_err(|e| missing(path, e.to_string()))?
    } else {
        return Err(missing(path, "no such file or folder; `pip install pyoidn` installs the library".to_owned()));
    };
    open(&file).map_err(|Unusable(why)| missing(&file, format!("it cannot serve as Open Image Denoise: {why}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use std::fs;

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
        let environment = ProcessEnvironment {
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

        let opened =
            open_first(
                None,
                &environment,
                |file| if file == of_python { Ok(7) } else { Err(Unusable("no".to_owned())) },
            );
        assert_eq!(opened.unwrap(), 7);
    }

    #[test]
    fn what_is_named_is_used_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let one = place(&root.join("one/lib/python3.11/site-packages/pyoidn/oidn/lib"));
        let two = place(&root.join("two"));
        let environment = ProcessEnvironment { variable: Some(two.clone().into()), ..ProcessEnvironment::default() };
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
        assert!(
            message(open_first(Some(&empty), &environment, |_| Ok(())))
                .contains("no libOpenImageDenoise.so.2 in the folder")
        );
    }

    #[test]
    fn without_python_the_message_names_it() {
        let text = message(open_first(None, &ProcessEnvironment::default(), refuse(&mut Vec::new())));
        assert!(
            text.contains("where the system keeps libraries, in Python's packages, of which there are none"),
            "{text}"
        );
    }
}
