//! `steradian rerender`, and what files keep for it.

use std::path::{Path, PathBuf};

use clap::Parser;
use steradian::desc::OutputDesc;
use steradian::internal::farm::is_scene_per_frame;
use steradian::internal::import::scene_fingerprint;
use steradian::internal::output::{self, FileUses, Format};
use steradian::internal::render::{RenderProvenance, SequenceFrame, Settings};
use steradian::{Error, Result};

use crate::args::{Cli, Command, RenderArgs, RerenderArgs};
use crate::frames::{self, Shot};

/// A picture to be made again.
#[derive(Clone, Debug)]
pub struct Repeat {
    /// How it was made, with the overrides of the command line.
    pub provenance: RenderProvenance,
    /// The file that holds it.
    pub file: PathBuf,
    /// Whether a changed scene will do.
    pub allow_changed: bool,
}

/// Renders a picture again; the result is the exit code.
pub fn run(arguments: &RerenderArgs, mut uses: FileUses) -> Result<u8> {
    let file = &arguments.file;
    let mut provenance = RenderProvenance::from_value(output::read_settings(file)?, file)?;
    let name = arguments.output.clone();
    let format = Format::from_path(Path::new(&name))?;
    let like = provenance.output.take().filter(|_| format == Format::Exr);
    provenance.output = Some(OutputDesc {
        file: name,
        ..like
            .unwrap_or_else(|| OutputDesc { view: Some(provenance.settings.integrator.view()), ..OutputDesc::new("") })
    });
    if let Some(spp) = arguments.spp {
        (provenance.settings.spp, provenance.settings.planned_spp) = (spp, None);
    } else if provenance.unrepeatable {
        tracing::warn!(
            "{}: its render was ended within a pass or before its target error; the new picture has other samples",
            file.display()
        );
    }
    if provenance.settings.spp == 0 {
        return Err(Error::Usage("--spp 0: a picture needs at least one sample per pixel".into()));
    }
    let mut render = plain()?;
    render.scene = scene_file(arguments, &provenance);
    render.output = vec![arguments.output.clone()];
    render.threads = arguments.threads;
    render.guide.clone_from(&arguments.guide);
    render.verbosity.quiet = arguments.quiet;
    render.denoise.denoise = provenance.denoise;
    render.denoise.oidn.clone_from(&arguments.oidn);
    (render.import.defines, render.import.time) = (provenance.import.defines.clone(), provenance.import.time);
    render.import.allow_missing = provenance.allow_missing;
    if let Some(SequenceFrame { number, per_second }) = provenance.frame {
        let frames = number.to_string().parse();
        render.sequence.frames = Some(frames.map_err(|message| Error::Malformed { file: file.clone(), message })?);
        render.sequence.fps = per_second;
        render.sequence.overwrite = true;
    }
    render.repeat = Some(Box::new(Repeat { provenance, file: file.clone(), allow_changed: arguments.allow_changed }));
    uses.read(file, "the picture to render again")?;
    frames::run(&render, uses)
}

/// The arguments of `render` without any option.
fn plain() -> Result<RenderArgs> {
    match Cli::try_parse_from(["steradian", "render", "scene.json"]) {
        Ok(Cli { command: Command::Render(arguments), .. }) => Ok(*arguments),
        _ => Err(Error::Internal("render needs an option".into())),
    }
}

/// The scene's file: the one given, or its recorded name, relative to here or to where it was rendered.
fn scene_file(arguments: &RerenderArgs, provenance: &RenderProvenance) -> PathBuf {
    let named = arguments.scene.clone().unwrap_or_else(|| provenance.scene_file.clone());
    if arguments.scene.is_some() || named.exists() { named } else { provenance.folder.join(named) }
}

/// How the picture that is about to be rendered is made, if a file keeps it.
pub fn provenance(arguments: &RenderArgs, shot: &Shot, settings: &Settings) -> Result<Option<RenderProvenance>> {
    let keeps = settings
        .outputs
        .iter()
        .any(|output| Format::from_path(Path::new(&output.file)).is_ok_and(|f| f == Format::Exr));
    if arguments.pixel.is_some() || (arguments.repeat.is_none() && !keeps) {
        return Ok(None);
    }
    let scene = scene_fingerprint(&shot.imported, &shot.scene)?;
    if let Some(Repeat { provenance, file, allow_changed }) = arguments.repeat.as_deref() {
        let changed = provenance.scene.differences(&scene);
        if !changed.is_empty() && !allow_changed {
            let message = format!(
                "the picture shows another scene: not the same {} (--allow-changed goes on)",
                changed.join(", ")
            );
            return Err(Error::Checkpoint { file: file.clone(), message });
        }
    }
    let per_second = arguments.sequence.fps;
    Ok(Some(RenderProvenance {
        import: arguments.import.options(),
        allow_missing: arguments.import.allow_missing,
        frame: shot
            .frame
            .filter(|_| !is_scene_per_frame(&arguments.scene))
            .map(|number| SequenceFrame { number, per_second }),
        denoise: arguments.denoise.denoise,
        ..RenderProvenance::new(&shot.scene, scene, settings, std::env::args().skip(1).collect())
    }))
}
