//! Who may set an option of `render`.

/// Who may set an option beside the command line, the least trusted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trust {
    /// A project's file, which may be anybody's: what the picture is, and how much work it is.
    Project,
    /// The user, by the environment or the user's own file: what is loaded, written, overwritten or connected to, and
    /// how messages look.
    User,
    /// Nobody else: options of a single run.
    CommandLine,
}

/// Every option of `render`, by who may set it.
const OPTIONS: [(Trust, &[&str]); 3] = [
    (
        Trust::Project,
        &[
            "spp",
            "target-error",
            "size",
            "crop",
            "overscan",
            "layers",
            "float",
            "exposure",
            "integrator",
            "max-depth",
            "strategy",
            "roulette",
            "clamp",
            "regularize",
            "caustics",
            "bidirectional",
            "guiding",
            "sampler",
            "seed",
            "accel",
            "threads",
            "time-limit",
            "exr",
            "fps",
            "no-depth-of-field",
            "transparent",
            "view",
            "denoise",
            "define",
            "time",
            "strict",
            "allow-missing",
        ],
    ),
    (
        Trust::User,
        &[
            "output",
            "overwrite",
            "every",
            "keep-going",
            "oidn-library",
            "tev",
            "preview",
            "preview-bind",
            "preview-hold",
            "log-file",
            "log-format",
            "color",
            "progress",
            "quiet",
            "verbose",
        ],
    ),
    (
        Trust::CommandLine,
        &[
            "set",
            "pixel",
            "sample",
            "frames",
            "checkpoint",
            "resume",
            "guide",
            "shard",
            "stats",
            "report",
            "help",
            "version",
        ],
    ),
];

/// Who may set this option; `None` if there is none of the name.
pub fn trust(option: &str) -> Option<Trust> {
    OPTIONS.iter().find(|(_, names)| names.contains(&option)).map(|(trust, _)| *trust)
}

/// The names of all options, without dashes.
pub fn options() -> impl Iterator<Item = &'static str> {
    OPTIONS.iter().flat_map(|(_, names)| names.iter().copied())
}
