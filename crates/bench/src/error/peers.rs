//! Renderers that `bench error` runs by itself: by their Python modules.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{Budget, External};
use steradian::{Error, Result};

/// Another renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peer {
    /// Mitsuba 3 with the variant `llvm_ad_rgb`.
    Mitsuba,
    /// Blender's Cycles on the CPU.
    Cycles,
    /// LuxCore on the CPU.
    LuxCore,
}

/// How peers are started.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerOptions {
    /// The Python interpreter that has their modules.
    pub python: PathBuf,
    /// Width and height of their pictures in pixels.
    pub size: [u32; 2],
    /// Number of threads; 0 means all.
    pub threads: usize,
    /// Mitsuba: values of the scene's parameters.
    pub defines: Vec<(String, String)>,
}

impl Peer {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Mitsuba, Self::Cycles, Self::LuxCore];

    /// Its name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mitsuba => "mitsuba",
            Self::Cycles => "cycles",
            Self::LuxCore => "luxcore",
        }
    }

    /// Its Python module, which is also its package on PyPI.
    fn module(self) -> &'static str {
        match self {
            Self::Mitsuba => "mitsuba",
            Self::Cycles => "bpy",
            Self::LuxCore => "pyluxcore",
        }
    }

    /// Extensions of the scenes that it reads.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Mitsuba => &["xml"],
            Self::Cycles => &["blend", "gltf", "glb"],
            Self::LuxCore => &["cfg"],
        }
    }

    fn script(self) -> &'static str {
        match self {
            Self::Mitsuba => concat!(include_str!("peers/common.py"), include_str!("peers/mitsuba.py")),
            Self::Cycles => concat!(include_str!("peers/common.py"), include_str!("peers/cycles.py")),
            Self::LuxCore => concat!(include_str!("peers/common.py"), include_str!("peers/luxcore.py")),
        }
    }

    /// Whether it reads files with the extension of this one.
    pub fn reads(self, scene: &Path) -> bool {
        let extension = scene.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        extension.is_some_and(|extension| self.extensions().contains(&extension.as_str()))
    }

    /// Whether the interpreter has its module.
    ///
    /// # Errors
    /// [`Error::Usage`] if the interpreter cannot be started.
    pub fn is_installed(self, python: &Path) -> Result<bool> {
        let code = format!("import importlib.util as u, sys; sys.exit(not u.find_spec('{}'))", self.module());
        let status = Command::new(python).args(["-c", &code]).stdin(Stdio::null()).stderr(Stdio::null()).status();
        status.map(|status| status.success()).map_err(|e| {
            let python = python.display();
            Error::Usage(format!("--python {python}: it cannot be started: {e}; other renderers need Python"))
        })
    }

    /// Its command for a scene.
    ///
    /// # Errors
    /// [`Error::Usage`] if it does not read such files, the scene does not exist, its module is missing or the
    /// budgets are seconds.
    pub fn command(self, scene: &Path, options: &PeerOptions, budgets: &[Budget]) -> Result<External> {
        let name = self.name();
        let fault = |message: String| Err(Error::Usage(format!("--peer {name}: {message}")));
        if !self.reads(scene) {
            let extensions = self.extensions().join(", .");
            return fault(format!(
                "{} is not a scene that it reads (.{extensions}); name one: --peer {name}=FILE",
                scene.display()
            ));
        }
        if !scene.exists() {
            return fault(format!("{}: file not found", scene.display()));
        }
        if !self.is_installed(&options.python)? {
            let (python, module) = (options.python.display(), self.module());
            return fault(format!(
                "{python} has no module {module}; install it ({python} -m pip install {module}) or choose another \
                 interpreter with --python"
            ));
        }
        if matches!(budgets.first(), Some(Budget::Seconds(_))) {
            return fault("it renders a number of samples: use --spp in place of --times".to_owned());
        }
        let mut words = vec![options.python.to_string_lossy().into_owned(), "-".to_owned()];
        let [width, height] = options.size.map(|side| side.to_string());
        words.extend(["--size".to_owned(), width, height]);
        words.extend(["--threads".to_owned(), options.threads.to_string()]);
        words.extend(
            options.defines.iter().flat_map(|(name, value)| ["--define".to_owned(), format!("{name}={value}")]),
        );
        Ok(External::script(name, &words, self.script(), scene))
    }
}
