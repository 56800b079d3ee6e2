//! Who may set an option of `render`.

/// Who may set an option beside the command line, the least trusted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trust {
    /// A project's file, which may be anybody's: what the picture is, and how much work it is.
    Project,
    /// The user, by the environment or the user's own file: what is loaded, written, overwritten or connected to, and how messages look.
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
            "clamp",
            "guiding",
            "sampler",
            "seed",
            "accel",
            "threads",
            "time-limit",
            "exr-profile",
            "compression",
            "dwa-level",
            "uncropped",
            "crypto-depth",
            "crypto-manifest",
            "owner",
            "comments",
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
    (Trust::CommandLine, &["pixel", "sample", "frames", "checkpoint", "resume", "shard", "json", "report", "help", "version"]),
];

/// Who may set this option; `None` if there is none of the name.
pub fn trust(option: &str) -> Option<Trust> {
    OPTIONS.iter().find(|(_, names)| names.contains(&option)).map(|(trust, _)| *trust)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::{Arg, CommandFactory};

    #[test]
    fn every_option_of_render_has_its_class() {
        let mut command = Cli::command();
        command.build();
        let render = command.find_subcommand("render").unwrap();
        let mut options: Vec<&str> = render.get_arguments().filter_map(Arg::get_long).collect();
        let mut classified: Vec<&str> =
            OPTIONS.iter().flat_map(|(_, names)| names.iter().copied()).filter(|name| *name != "version").collect();
        options.sort_unstable();
        classified.sort_unstable();
        assert_eq!(options, classified);
        assert_eq!(trust("no-such-option"), None);
    }
}
