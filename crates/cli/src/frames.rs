//! Pictures and sequences of them: which frames are rendered, from which scene, into which files.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use steradian::internal::farm::{FrameList, file_of_frame, is_scene_per_frame, scene_of_frame, with_frame_pattern};
use steradian::internal::import::{self, ImportReport, Imported};
use steradian::internal::output::FileUses;
use steradian::internal::render::Settings;
use steradian::{Error, Result};

use crate::args::RenderArgs;
use crate::interrupt::Interrupt;
use crate::log::{self, Level};
use crate::progress::Reporter;
use crate::{chain, exit_code, render, scene, skipped};

/// What all frames of a run share.
pub struct Session {
    /// Reports progress.
    pub reporter: Reporter,
    /// The files of every command.
    pub uses: FileUses,
    interrupt: Interrupt,
    listens_to_stop: OnceCell<()>,
}

impl Session {
    fn new(arguments: &RenderArgs, uses: FileUses) -> Result<Self> {
        let reporter = Reporter::new(arguments.sequence.progress, arguments.verbosity.quiet);
        Ok(Self { reporter, uses, interrupt: Interrupt::listen_to_requests()?, listens_to_stop: OnceCell::new() })
    }

    /// Listens to signals to stop from the first call on; until then they end the program at once.
    pub fn interrupt(&self) -> Result<&Interrupt> {
        if self.listens_to_stop.set(()).is_ok() {
            self.interrupt.listen_to_stop()?;
            self.reporter.watch(self.interrupt.stop.clone());
        }
        Ok(&self.interrupt)
    }

    /// The exit code requested by a signal.
    fn interrupted(&self) -> Option<u8> {
        self.interrupt.stop.load(std::sync::atomic::Ordering::Relaxed).then(|| self.interrupt.exit_code())
    }
}

/// One picture to render.
pub struct Shot {
    /// The scene's file.
    pub scene: PathBuf,
    /// Its arguments, for this frame.
    pub imported: Imported,
    /// The frame of a sequence.
    pub frame: Option<i64>,
    /// The frames, this one among them, whose files are to be compared before it is rendered.
    pub unchecked: Vec<Option<i64>>,
}

impl Shot {
    /// The settings of this frame: its own files, and noise of its own, so that none stands still while the picture
    /// moves.
    pub fn adapt(&self, settings: &mut Settings) {
        let Some(frame) = self.frame else { return };
        settings.seed = settings.seed.wrapping_add_signed(frame);
        for output in &mut settings.outputs {
            output.file = file_of_frame(&with_frame_pattern(&output.file), frame);
        }
    }

    /// Whether the files of this frame of a sequence are there already and are to stay.
    pub fn is_there(&self, settings: &Settings, overwrite: bool) -> bool {
        self.frame.is_some() && !overwrite && settings.outputs.iter().all(|output| Path::new(&output.file).exists())
    }

    /// The file of this frame of a sequence: its number goes where the name has a place for it, or before the
    /// extension.
    pub fn file_of(&self, name: &Path) -> PathBuf {
        match (self.frame, name.to_str()) {
            (Some(frame), Some(text)) => file_of_frame(&with_frame_pattern(text), frame).into(),
            _ => name.to_owned(),
        }
    }

    /// The file of a name with a place for the frame's number.
    pub fn file(&self, name: &Path) -> PathBuf {
        match (self.frame, name.to_str()) {
            (Some(frame), Some(text)) => file_of_frame(text, frame).into(),
            _ => name.to_owned(),
        }
    }
}

/// Renders a picture or a sequence; the result is the exit code.
pub fn run(arguments: &RenderArgs, uses: FileUses) -> Result<u8> {
    let session = Session::new(arguments, uses)?;
    let result = match &arguments.sequence.frames {
        None => single(arguments, &session),
        Some(_) if arguments.live.preview_hold => Err(Error::Usage(
            "--preview-hold: a sequence goes on with its next frame; leave out one of --frames and --preview-hold"
                .to_owned(),
        )),
        Some(frames) => Sequence::new(arguments, &session).run(frames),
    };
    match &result {
        Ok(0) => session.reporter.succeed(),
        Err(error) => session.reporter.fail(&chain(error)),
        Ok(_) => {}
    }
    result
}

fn single(arguments: &RenderArgs, session: &Session) -> Result<u8> {
    session.reporter.begin(None);
    let start = Instant::now();
    let imported = scene::load(&arguments.scene, &arguments.import, arguments.verbosity)?;
    render::picture(
        arguments,
        Shot { scene: arguments.scene.clone(), imported, frame: None, unchecked: vec![None] },
        session,
        start,
    )
}

/// A sequence under way.
struct Sequence<'a> {
    arguments: &'a RenderArgs,
    session: &'a Session,
    /// The scene, where one file has all frames.
    whole: OnceCell<Imported>,
    /// The same, to compare frames that are there with.
    compared: OnceCell<Option<Imported>>,
}

impl<'a> Sequence<'a> {
    fn new(arguments: &'a RenderArgs, session: &'a Session) -> Self {
        Self { arguments, session, whole: OnceCell::new(), compared: OnceCell::new() }
    }

    fn run(&self, frames: &FrameList) -> Result<u8> {
        let reporter = &self.session.reporter;
        let (skipped, todo): (Vec<i64>, Vec<i64>) = frames.numbers().iter().partition(|frame| self.is_done(**frame));
        if !skipped.is_empty() {
            let count = if skipped.len() == 1 {
                "1 frame exists and is".to_owned()
            } else {
                format!("{} frames exist and are", skipped.len())
            };
            reporter.say(&format!("{count} skipped (--overwrite renders them again)"));
            let shares_files = !is_scene_per_frame(&self.arguments.scene) && !is_gltf(&self.arguments.scene);
            skipped::warn(self.arguments, &skipped, self.session, shares_files, |frame| self.shot_to_compare(frame));
        }
        reporter.expect(todo.len());
        let mut failures = Vec::new();
        let mut unchecked: Vec<Option<i64>> = todo.iter().copied().map(Some).collect();
        for frame in todo.iter().copied() {
            reporter.begin(Some(frame));
            let start = Instant::now();
            let result = self
                .shot(frame, &mut unchecked)
                .and_then(|shot| render::picture(self.arguments, shot, self.session, start));
            match result {
                Ok(0) => {}
                Ok(code) => return Ok(code),
                Err(error) => {
                    let text = format!("frame {frame}: {}", chain(&error));
                    log::message(Level::Error, &text);
                    failures.push(exit_code(error.kind()));
                    if !self.arguments.sequence.keep_going {
                        reporter.fail(&text);
                        break;
                    }
                    reporter.complete_frame();
                }
            }
            if let Some(code) = self.session.interrupted() {
                return Ok(code);
            }
        }
        if todo.is_empty() {
            reporter.complete_frame();
        }
        if self.arguments.sequence.keep_going && !failures.is_empty() {
            reporter.fail(&format!("{} of {} frames failed", failures.len(), todo.len()));
        }
        Ok(failures.first().copied().unwrap_or(0))
    }

    /// Whether a frame's files, as far as the command line names them, are there already.
    fn is_done(&self, frame: i64) -> bool {
        let (outputs, overwrite) = (&self.arguments.output, self.arguments.sequence.overwrite);
        let exists = |name: &String| Path::new(&file_of_frame(&with_frame_pattern(name), frame)).exists();
        !overwrite && !outputs.is_empty() && outputs.iter().all(exists)
    }

    /// A frame that is not rendered; none if its scene cannot be read.
    fn shot_to_compare(&self, frame: i64) -> Option<Shot> {
        let arguments = self.arguments;
        let scene = scene_of_frame(&arguments.scene, frame);
        let read = |seconds: f64| {
            let mut options = arguments.import.options();
            options.time += seconds;
            let mut imported = import::read_scene(&scene, &options).ok()?;
            if arguments.import.allow_missing {
                imported.leave_out_missing(&scene);
            }
            Some(imported)
        };
        let imported = if is_scene_per_frame(&arguments.scene) {
            read(0.0)?
        } else if is_gltf(&scene) {
            read(frame as f64 / arguments.sequence.fps)?
        } else {
            at_frame(self.compared.get_or_init(|| read(0.0)).as_ref()?, frame)
        };
        Some(Shot { scene, imported, frame: Some(frame), unchecked: Vec::new() })
    }

    /// The picture of a frame; takes the frames whose files are to be compared with those of its scene.
    fn shot(&self, frame: i64, unchecked: &mut Vec<Option<i64>>) -> Result<Shot> {
        let arguments = self.arguments;
        let scene = scene_of_frame(&arguments.scene, frame);
        let load = |seconds: f64| {
            let mut import = arguments.import.clone();
            import.time += seconds;
            scene::load(&scene, &import, arguments.verbosity)
        };
        let imported = if is_scene_per_frame(&arguments.scene) {
            load(0.0)?
        } else if is_gltf(&scene) {
            load(frame as f64 / arguments.sequence.fps)?
        } else {
            if self.whole.get().is_none() {
                let _ = self.whole.set(load(0.0)?);
            }
            let whole = self.whole.get().ok_or_else(|| Error::Internal("no scene".to_owned()))?;
            at_frame(whole, frame)
        };
        let unchecked = if is_scene_per_frame(&self.arguments.scene) && unchecked.is_empty() {
            vec![Some(frame)]
        } else {
            std::mem::take(unchecked)
        };
        Ok(Shot { scene, imported, frame: Some(frame), unchecked })
    }
}

/// Whether a file is glTF, whose animations have a time of their own.
fn is_gltf(scene: &Path) -> bool {
    scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
}

/// A frame of a scene whose file holds a whole sequence: its shutter opens that much later.
fn at_frame(whole: &Imported, frame: i64) -> Imported {
    let (assets, places, files) = (Arc::clone(&whole.assets), Arc::clone(&whole.places), Arc::clone(&whole.files));
    let mut desc = whole.desc.clone();
    desc.camera.shutter = desc.camera.shutter.map(|time| time + frame as f64);
    Imported { desc, assets, report: ImportReport::default(), files, places }
}
