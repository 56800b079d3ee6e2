//! Frames whose files are there: whether they were rendered with other settings than this render has.

use std::collections::BTreeMap;
use std::path::Path;

use steradian::desc::OutputDesc;
use steradian::internal::farm::FrameList;
use steradian::internal::output::{self, Format};
use steradian::internal::render::{Progress, RenderProvenance, Settings};
use steradian::{changed_settings, default_outputs};

use crate::args::RenderArgs;
use crate::frames::{Session, Shot};
use crate::{kept, rerender};

/// What frames that are skipped have in their files.
#[derive(Default)]
pub struct Skipped {
    /// Frames by what of their settings is not what this render has.
    changed: BTreeMap<Vec<String>, Vec<i64>>,
    /// Frames whose files have no settings.
    unknown: Vec<i64>,
}

impl Skipped {
    /// Compares the settings in the file of a frame with those that it would be rendered with.
    pub fn compare(&mut self, frame: i64, expected: Option<&RenderProvenance>, outputs: &[OutputDesc]) {
        let found = expected.and_then(|expected| {
            let output = outputs
                .iter()
                .find(|output| Format::from_path(Path::new(&output.file)).is_ok_and(|f| f == Format::Exr))?;
            let file = Path::new(&output.file);
            let found = RenderProvenance::from_value(output::read_settings(file).ok()?, file).ok()?;
            Some(found.of_frame(frame).differences(&expected.of_frame(frame), output))
        });
        match found {
            None => self.unknown.push(frame),
            Some(differences) if differences.is_empty() => {}
            Some(differences) => self.changed.entry(differences).or_default().push(frame),
        }
    }

    /// Warns of those that differ.
    pub fn report(&self, session: &Session) {
        for (differences, frames) in &self.changed {
            let (noun, verb) = if frames.len() == 1 { ("frame", "is") } else { ("frames", "are") };
            let numbers = FrameList::new(frames.clone()).map_or(String::new(), |list| list.ranges('x'));
            let what = differences.join(", ");
            session.reporter.warn(&format!(
                "{noun} {numbers}: skipped, but rendered with other settings than the rest {verb}: {what} (--overwrite \
                 renders such frames again)"
            ));
        }
        if !self.unknown.is_empty() && !self.changed.is_empty() {
            session
                .reporter
                .say(&format!("the files of {} of the frames have no settings to compare", self.unknown.len()));
        }
    }
}

/// Compares the frames of a sequence that are there with what they would be rendered as. `shot` gives a frame of the
/// sequence; a scene that cannot be read leaves nothing to compare, for nothing is rendered from it. The files of a
/// scene that are the same for all frames are read once.
pub fn warn(
    arguments: &RenderArgs,
    frames: &[i64],
    session: &Session,
    shares_files: bool,
    shot: impl Fn(i64) -> Option<Shot>,
) {
    if arguments.state.shard.is_some() || arguments.repeat.is_some() {
        return;
    }
    let mut skipped = Skipped::default();
    let mut first: Option<RenderProvenance> = None;
    for &frame in frames {
        let expected = shot(frame).and_then(|shot| {
            let mut settings = settings(arguments, &shot)?;
            shot.adapt(&mut settings);
            let provenance = match &first {
                Some(first) if shares_files => {
                    let scene = first.scene.with_description(&shot.imported.desc).ok()?;
                    RenderProvenance { scene, settings: settings.clone(), ..first.clone() }
                }
                _ => rerender::provenance(arguments, &shot, &settings).ok()??,
            };
            first.get_or_insert_with(|| provenance.clone());
            Some((provenance, settings.outputs))
        });
        let (provenance, outputs) = expected.unzip();
        skipped.compare(frame, provenance.as_ref(), &outputs.unwrap_or_default());
    }
    skipped.report(session);
}

/// The settings that a frame would be rendered with, as they are for all frames.
fn settings(arguments: &RenderArgs, shot: &Shot) -> Option<Settings> {
    let mut overrides = arguments.overrides(default_outputs(&arguments.scene));
    kept::take_shard_name(&arguments.state, &arguments.scene, &mut overrides).ok()?;
    changed_settings(&shot.imported.desc, &arguments.set, &overrides).ok()
}
