//! `steradian render`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;
use steradian::internal::compile::CheckedScene;
use steradian::internal::farm::check_single_name;
use steradian::internal::live::{Fan, Live};
use steradian::internal::output;
use steradian::internal::render::{
    self, LightTracing, Progress, RenderProvenance, Replayed, Settings, Stats, TrainedGuide,
};
use steradian::{
    PreparedRender, Renderer, Rendering, Result, StateOptions, StopHandle, Watch, changed_settings, default_outputs,
};

use crate::args::RenderArgs;
use crate::denoise;
use crate::frames::{Session, Shot};
use crate::kept;
use crate::progress::Reporter;
use crate::rerender;
use crate::skipped::Skipped;
use crate::text::counted;
use crate::{files, text};

/// Renders a picture and writes its outputs; the result is the exit code. `start` is when the scene's reading began.
pub fn picture(arguments: &RenderArgs, shot: Shot, session: &Session, start: Instant) -> Result<u8> {
    CheckedScene::new(&shot.imported.desc, shot.imported.source(&shot.scene))?;
    let Some(plan) = Plan::new(arguments, &shot, session)? else {
        session.reporter.complete_frame();
        return Ok(0);
    };
    let Shot { imported, scene, .. } = shot;
    let mut renderer = plan.renderer(Renderer::from_imported(imported, scene).started_at(start));
    if let (Some(pixel), Some(sample)) = (arguments.pixel, arguments.sample) {
        let value = renderer.replay(pixel, sample)?;
        return text::print(&describe_sample(&value)).map(|()| 0);
    }
    let mut prepared = renderer.prepare()?;
    let [load_seconds, build_seconds] = prepared.seconds();
    let accel = prepared.accel().description();
    tracing::info!("{accel}; {load_seconds:.3} s to load, {build_seconds:.3} s to build");

    let interrupt = session.interrupt()?;
    let live = plan.watch(prepared.settings(), session)?;
    let rendering = plan.render(&mut prepared, session, &live)?;
    let stats = rendering.stats();
    tracing::info!("{:.3} s until every pixel had its first sample", rendering.first_pass_seconds());
    warn_of_dropped(stats, &session.reporter);
    let exit_code = if stats.interrupted { interrupt.exit_code() } else { 0 };
    if let (Some(frame), true) = (plan.frame, stats.interrupted) {
        // A file that is there counts as a complete frame.
        session.reporter.say(&format!("interrupted: frame {frame} is not written"));
        return Ok(exit_code);
    }
    if stats.interrupted && stats.spp_done == 0 && plan.shard_file.is_none() {
        session.reporter.say("interrupted before every pixel had a sample: nothing is written");
        return Ok(exit_code);
    }
    plan.write(&prepared, rendering, session, &live)?;
    if arguments.live.preview_hold {
        interrupt.wait();
    }
    Ok(exit_code)
}

/// What is to be done for one picture.
struct Plan<'a> {
    arguments: &'a RenderArgs,
    settings: Settings,
    scene_file: PathBuf,
    frame: Option<i64>,
    /// Where statistics go.
    json: Option<PathBuf>,
    /// Where the shard goes, if the render is of one.
    shard_file: Option<PathBuf>,
    checkpoint: Option<PathBuf>,
    provenance: Option<RenderProvenance>,
}

impl<'a> Plan<'a> {
    /// Checks all that can be checked before the scene is made; `None` if the frame is there already.
    fn new(arguments: &'a RenderArgs, shot: &Shot, session: &Session) -> Result<Option<Self>> {
        let json = arguments.stats.as_deref().map(|path| shot.file(path));
        let mut overrides = arguments.overrides(default_outputs(&arguments.scene));
        let shard_name = kept::take_shard_name(&arguments.state, &arguments.scene, &mut overrides)?;
        let shard_file = shard_name.as_deref().map(|name| shot.file_of(name));
        let mut settings = match &arguments.repeat {
            Some(repeat) => {
                let settings = repeat.provenance.settings(render::threads(arguments.threads)?);
                let guide = settings.guide.map(|guide| guide.reload(arguments.guide.as_deref())).transpose()?;
                Settings { guide, ..settings }
            }
            None => {
                overrides.guide = arguments.guide.as_deref().map(TrainedGuide::read).transpose()?;
                changed_settings(&shot.imported.desc, &arguments.set, &overrides)?
            }
        };
        settings = settings.of_shard(arguments.state.shard.unwrap_or_default());
        if arguments.pixel.is_none() {
            files::of_render(arguments, shot, &settings.outputs, shard_name.as_deref(), session.uses.clone())?;
        }
        if arguments.repeat.is_none() {
            shot.adapt(&mut settings);
        }
        let provenance = rerender::provenance(arguments, shot, &settings)?;
        let is_there = match &shard_file {
            Some(file) => shot.frame.is_some() && !arguments.sequence.overwrite && file.exists(),
            None => shot.is_there(&settings, arguments.sequence.overwrite),
        };
        if is_there {
            if let Some(frame) = shot.frame.filter(|_| shard_file.is_none()) {
                let mut skipped = Skipped::default();
                skipped.compare(frame, provenance.as_ref(), &settings.outputs);
                skipped.report(session);
            }
            return Ok(None);
        }
        if arguments.pixel.is_none() {
            if shot.frame.is_none() && arguments.repeat.is_none() {
                check_names(arguments, &settings)?;
            }
            check_outputs(&settings, shard_file.as_deref(), json.as_deref())?;
        }
        let checkpoint = arguments.state.checkpoint.as_deref().map(|path| shot.file_of(path));
        let (scene_file, frame) = (shot.scene.clone(), shot.frame);
        Ok(Some(Self { arguments, settings, scene_file, frame, json, shard_file, checkpoint, provenance }))
    }

    /// The renderer of the scene, as the command line has it.
    fn renderer(&self, renderer: Renderer) -> Renderer {
        let state = &self.arguments.state;
        let renderer =
            renderer.with_settings(self.settings.clone()).with_recipe(self.provenance.clone()).state(StateOptions {
                checkpoint: self.checkpoint.clone(),
                every: state.every,
                resume: state.resume,
                shard: state.shard.unwrap_or_default(),
                shard_file: self.shard_file.clone(),
            });
        let denoise = &self.arguments.denoise;
        if denoise.denoise { renderer.denoise(denoise.oidn.oidn_library.clone()) } else { renderer }
    }

    /// Starts what shows the picture on its way.
    fn watch(&self, settings: &Settings, session: &Session) -> Result<Live> {
        session.reporter.limit_time(settings.time_limit);
        let live = self.arguments.live.start(&self.scene_file, settings)?;
        if let Some(url) = live.preview_url() {
            session.reporter.say(&format!("preview: {url}"));
        }
        Ok(live)
    }

    fn render(&self, prepared: &mut PreparedRender, session: &Session, live: &Live) -> Result<Rendering> {
        let (reporter, interrupt) = (&session.reporter, session.interrupt()?);
        let fan = Fan::new([reporter as &dyn Progress, live]);
        let stop = StopHandle::from(Arc::clone(&interrupt.stop));
        let rendering = prepared.render(&Watch { progress: &fan, stop: &stop, checkpoint: &interrupt.checkpoint })?;
        if self.checkpoint.is_none() && self.shard_file.is_none() {
            kept::warn_of_request(interrupt, reporter);
        }
        Ok(rendering)
    }

    /// Denoises the picture, and writes all files. One that cannot be written is no reason to lose the others.
    fn write(&self, prepared: &PreparedRender, mut rendering: Rendering, session: &Session, live: &Live) -> Result<()> {
        let mut failure = prepared.denoise(&mut rendering).err();
        if let Some(report) = rendering.denoised() {
            denoise::warnings(report).iter().for_each(|warning| session.reporter.warn(warning));
            session.reporter.say(&format!("denoised: {}", denoise::summary(report)));
        }
        let mut written = Vec::new();
        if let Some(file) = &self.shard_file {
            // One that is to be taken up again is not written.
            if !(rendering.stats().interrupted && self.checkpoint.is_some()) {
                written.push(file.display().to_string());
            }
        } else {
            for (file, result) in rendering.save_outputs() {
                match result {
                    Ok(()) => written.push(file),
                    Err(error) => failure = failure.or(Some(error)),
                }
            }
            live.show_final(rendering.image(), rendering.stats().spp_done);
        }
        if let Some(path) = &self.json {
            write_statistics(path, &rendering.statistics())?;
        }
        report(&session.reporter, &rendering, &written);
        if failure.is_none() && !rendering.stats().interrupted {
            session.reporter.complete_frame();
        }
        failure.map_or(Ok(()), Err)
    }
}

/// Writes statistics to a file, whole or not at all, or to stdout for `-`.
fn write_statistics(path: &Path, value: &Value) -> Result<()> {
    if path == Path::new("-") {
        return text::print_json(value);
    }
    output::write_atomically(path, |out| writeln!(out, "{value:#}").map_err(|e| e.to_string()))
}

/// Names that are given, and not after the scene, have no place for a frame's number.
fn check_names(arguments: &RenderArgs, settings: &Settings) -> Result<()> {
    let state = [&arguments.state.checkpoint, &arguments.stats].into_iter().flatten().filter_map(|path| path.to_str());
    let defaults = default_outputs(&arguments.scene);
    let outputs = settings
        .outputs
        .iter()
        .map(|output| output.file.as_str())
        .filter(|name| !defaults.iter().any(|other| other == name));
    state.chain(arguments.output.iter().map(String::as_str)).chain(outputs).try_for_each(check_single_name)
}

/// A slip in a name is found before the render, not after it.
fn check_outputs(settings: &Settings, shard: Option<&Path>, stats: Option<&Path>) -> Result<()> {
    if shard.is_none() {
        for output in &settings.outputs {
            output::check_writable(Path::new(&output.file))?;
        }
    }
    match stats {
        Some(path) if path != Path::new("-") => output::check_creatable(path),
        _ => Ok(()),
    }
}

fn warn_of_dropped(stats: &Stats, reporter: &Reporter) {
    let Some(first) = stats.dropped.first() else { return };
    let (count, noun) = (stats.nan_samples, if stats.nan_samples == 1 { "sample was" } else { "samples were" });
    reporter.warn(&format!(
        "{count} {noun} not finite and dropped (this is a bug; `steradian replay SCENE {},{} {}` replays the first)",
        first.x, first.y, first.sample
    ));
}

fn report(reporter: &Reporter, rendering: &Rendering, written: &[String]) {
    let (settings, stats) = (rendering.settings(), rendering.stats());
    let seconds = stats.render_seconds.max(1e-9);
    let ended = match (stats.interrupted, stats.time_limited) {
        (true, _) => " (interrupted)",
        (_, true) => " (time limit)",
        _ => "",
    };
    reporter.say(&format!(
        "{}x{} pixels, {} per pixel{ended}, {:.2} s, {:.2} Msamples/s, {:.2} Mrays/s, {}, {}",
        settings.crop.width,
        settings.crop.height,
        counted(u64::from(stats.spp_done), "sample"),
        stats.render_seconds,
        stats.samples as f64 / seconds * 1e-6,
        stats.rays.total() as f64 / seconds * 1e-6,
        counted(settings.threads as u64, "thread"),
        rendering.accelerator(),
    ));
    match stats.light_tracing {
        LightTracing::Off => {}
        LightTracing::Photons => reporter.say("caustics by photons"),
        LightTracing::Bidirectional => reporter.say("bidirectional paths"),
    }
    if let (Some(error), Some(target)) = (stats.estimated_error, settings.target_error) {
        reporter.say(&format!("relative squared error about {error:.3e}, target {target:.3e}"));
    }
    written.iter().for_each(|file| reporter.say(&format!("wrote {file}")));
}

fn describe_sample(sample: &Replayed) -> String {
    let triple = |values: [f32; 3]| format!("{} {} {}", values[0], values[1], values[2]);
    let (pixel, surface) = (&sample.pixel, &sample.surface);
    [
        format!("radiance  {}", triple(pixel.radiance.to_array())),
        format!("alpha     {}", pixel.alpha),
        format!("depth     {}", surface.depth),
        format!("normal    {}", triple(surface.normal.to_array())),
        format!("position  {}", triple(surface.position.to_array())),
        format!("albedo    {}", triple(surface.albedo.to_array())),
    ]
    .join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_outputs_are_named_after_the_scene() {
        assert_eq!(default_outputs(Path::new("a/b/cornell.json")), ["cornell.exr", "cornell.png"]);
    }
}
