//! The files that may be Intel Open Image Denoise, in the order in which they are tried. The build script includes this file, to find out which tests can
//! run; so it uses the standard library alone.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The environment variable that names the library's file, or a folder with it.
pub const VARIABLE: &str = "STERADIAN_OIDN";

/// The library's name on Linux; the number is the major version.
pub const FILE_NAME: &str = "libOpenImageDenoise.so.2";

/// Where a folder may hold the library: itself, a prefix, and PyPI's `pyoidn` from inside out.
const INSIDE: [&str; 4] = ["", "lib", "oidn/lib", "pyoidn/oidn/lib"];

/// What of the process' environment matters.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// [`VARIABLE`]; empty counts as absent.
    pub variable: Option<OsString>,
    /// `VIRTUAL_ENV`: the active environment of Python.
    pub virtual_env: Option<PathBuf>,
    /// The folders of `PATH`.
    pub path: Vec<PathBuf>,
    /// `HOME`.
    pub home: Option<PathBuf>,
}

impl Environment {
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

    /// The folders in which Python's packages may be: of the active environment, of every `python3` on `PATH`, and the user's own.
    pub fn site_packages(&self) -> Vec<PathBuf> {
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
    let mut found: Vec<PathBuf> =
        entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(start)).map(|entry| entry.path()).collect();
    found.sort();
    found
}

/// The library inside a folder, if it is there; the folder may be an environment of Python.
pub fn inside(folder: &Path) -> Option<PathBuf> {
    let folders = std::iter::once(folder.to_owned()).chain(packages_below(folder));
    folders.flat_map(|folder| INSIDE.map(|below| folder.join(below).join(FILE_NAME))).find(|file| file.is_file())
}
