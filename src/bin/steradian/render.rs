//! `steradian render`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use steradian::Result;
use steradian::accel::{self, Accelerator};
use steradian::compile::CheckedScene;
use steradian::denoise::Denoiser;
use steradian::farm::check_single_name;
use steradian::film::LayerSet;
use steradian::live::{Fan, Live};
use steradian::output::{self, RenderInfo, RenderStatistics};
use steradian::render::{
    self, DEFAULT_EXTENSIONS, Header, Progress, RenderProvenance, RenderResult, RenderSession, Replayed, Settings,
    Stats, TrainedGuide,
};
use steradian::scene::Scene;

use crate::args::RenderArgs;
use crate::denoise;
use crate::frames::{Session, Shot};
use crate::kept::{self, Resumable};
use crate::progress::Reporter;
use crate::rerender;
use crate::set;
use crate::skipped::Skipped;
use crate::stats::{self, Run};
use crate::text::counted;
use crate::{files, text};

/// Renders a picture and writes its outputs; the result is the exit code. `start` is when the scene's reading began.
pub fn picture(arguments: &RenderArgs, shot: Shot, session: &Session, start: Instant) -> Result<u8> {
    let checked = CheckedScene::new(&shot.imported.desc, shot.imported.source(&shot.scene))?;
    let Some(mut plan) = Plan::new(arguments, &shot, session)? else {
        session.reporter.complete_frame();
        return Ok(0);
    };
    let mut scene = checked.compile()?;
    if !plan.settings.depth_of_field {
        scene.camera.remove_lens();
    }
    let header = plan.header(&shot, &scene)?;
    // Descriptions of meshes take as much memory as the meshes.
    drop(shot);
    let load_seconds = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let accel = accel::build(plan.settings.accel, &scene.geometry, plan.settings.threads)?;
    let build_seconds = start.elapsed().as_secs_f64();
    let run = Run { scene: &plan.scene_file.clone(), accel: &*accel, load_seconds, build_seconds };
    tracing::info!("{}; {load_seconds:.3} s to load, {:.3} s to build", accel.description(), run.build_seconds);

    if let (Some(pixel), Some(sample)) = (arguments.pixel, arguments.sample) {
        plan.settings.layers = LayerSet::FULL;
        let value = render::replay(&scene, &*accel, &plan.settings, pixel, sample)?;
        return text::print(&describe_sample(&value)).map(|()| 0);
    }

    let interrupt = session.interrupt()?;
    let live = plan.watch(session)?;
    let result = plan.render(&scene, &*accel, header.as_ref(), session, &live)?;
    let first = load_seconds + run.build_seconds + result.stats.first_pass_seconds;
    tracing::info!("{first:.3} s until every pixel had its first sample");
    warn_of_dropped(&result.stats, &session.reporter);
    let exit_code = if result.stats.interrupted { interrupt.exit_code() } else { 0 };
    if let (Some(frame), true) = (plan.frame, result.stats.interrupted) {
        // A file that is there counts as a complete frame.
        session.reporter.say(&format!("interrupted: frame {frame} is not written"));
        return Ok(exit_code);
    }
    if result.stats.interrupted && result.stats.spp_done == 0 && plan.shard_file.is_none() {
        session.reporter.say("interrupted before every pixel had a sample: nothing is written");
        return Ok(exit_code);
    }
    plan.write(&scene, result, &run, session, &live)?;
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
    provenance: Option<RenderProvenance>,
    denoiser: Option<Denoiser>,
    kept: Option<Resumable<'a>>,
}

impl<'a> Plan<'a> {
    /// Checks all that can be checked before the scene is made; `None` if the frame is there already.
    fn new(arguments: &'a RenderArgs, shot: &Shot, session: &Session) -> Result<Option<Self>> {
        let json = arguments.json.as_deref().map(|path| shot.file(path));
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
                let desc = &shot.imported.desc;
                if arguments.set.is_empty() {
                    Settings::new(desc, &overrides)?
                } else {
                    Settings::new(&set::changed(desc, &arguments.set)?, &overrides)?
                }
            }
        };
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
        let denoiser = denoise::prepare(&arguments.denoise, &mut settings)?;
        let checkpoint = arguments.state.checkpoint.as_deref().map(|path| shot.file_of(path));
        let kept = match arguments.pixel {
            None => Resumable::new(&arguments.state, &settings, shard_file.as_deref(), checkpoint.as_deref())?,
            Some(_) => None,
        };
        let (scene_file, frame) = (shot.scene.clone(), shot.frame);
        Ok(Some(Self { arguments, settings, scene_file, frame, json, shard_file, provenance, denoiser, kept }))
    }

    /// The metadata of files that is known before the render.
    fn info(&self, scene: &Scene) -> RenderInfo {
        RenderInfo {
            world_to_camera: Some(scene.camera.world_to_camera()),
            world_to_ndc: scene.camera.world_to_ndc(self.settings.size),
            pixel_aspect: Some(scene.camera.framing().pixel_aspect as f32),
            identities: self.settings.layers.needs_coverage().then(|| scene.identities.clone()),
            settings: self.provenance.as_ref().map(RenderProvenance::to_value),
            statistics: Some(RenderStatistics { threads: self.settings.threads, ..RenderStatistics::default() }),
            ..RenderInfo::default()
        }
    }

    /// The header of the render's state, if it is kept.
    fn header(&self, shot: &Shot, scene: &Scene) -> Result<Option<Header>> {
        let header =
            |kept: &Resumable| kept.header(&shot.imported, &shot.scene, scene, &self.settings, self.info(scene));
        self.kept.as_ref().map(header).transpose()
    }

    /// Starts what shows the picture on its way.
    fn watch(&self, session: &Session) -> Result<Live> {
        session.reporter.limit_time(self.settings.time_limit);
        let live = self.arguments.live.start(&self.scene_file, &self.settings)?;
        if let Some(url) = live.preview_url() {
            session.reporter.say(&format!("preview: {url}"));
        }
        Ok(live)
    }

    fn render(
        &mut self,
        scene: &Scene,
        accel: &dyn Accelerator,
        header: Option<&Header>,
        session: &Session,
        live: &Live,
    ) -> Result<RenderResult> {
        let (reporter, interrupt) = (&session.reporter, session.interrupt()?);
        let fan = Fan::new([reporter as &dyn Progress, live]);
        if let (Some(kept), Some(header)) = (self.kept.take(), header) {
            let session =
                RenderSession { scene, accel, settings: &self.settings, progress: &fan, stop: &interrupt.stop };
            return kept.render(&session, header, reporter, interrupt);
        }
        let result = render::render(scene, accel, &self.settings, &fan, &interrupt.stop)?;
        kept::warn_of_request(interrupt, reporter);
        Ok(result)
    }

    /// Denoises the picture, and writes all files. One that cannot be written is no reason to lose the others.
    fn write(
        &self,
        scene: &Scene,
        RenderResult { mut image, stats }: RenderResult,
        run: &Run,
        session: &Session,
        live: &Live,
    ) -> Result<()> {
        let accel = run.accel;
        let denoised = denoise::finish(
            self.denoiser.as_ref().filter(|_| self.shard_file.is_none()),
            &mut image,
            &session.reporter,
        );
        let info = RenderInfo {
            samples_per_pixel: stats.spp_done,
            render_seconds: stats.render_seconds,
            statistics: Some(RenderStatistics {
                threads: self.settings.threads,
                rays: stats.rays.total(),
                nan_samples: stats.nan_samples,
            }),
            settings: self.provenance.clone().map(|provenance| provenance.with_samples(stats.spp_done).to_value()),
            texts: denoised.texts,
            ..self.info(scene)
        };
        let mut failure = denoised.failure;
        let mut written = Vec::new();
        if let Some(file) = &self.shard_file {
            // One that is to be taken up again is not written.
            if !(stats.interrupted && self.arguments.state.checkpoint.is_some()) {
                written.push(file.display().to_string());
            }
        } else {
            for desc in &self.settings.outputs {
                match output::write(desc, &image, &info) {
                    Ok(()) => written.push(desc.file.clone()),
                    Err(error) => failure = failure.or(Some(error)),
                }
            }
            live.show_final(&image, stats.spp_done);
        }
        if let Some(path) = &self.json {
            let mut value = stats::value(run, &self.settings, &stats);
            value["denoise"] = denoised.statistics;
            stats::write(path, &value)?;
        }
        report(&session.reporter, &self.settings, accel, &stats, &written);
        if failure.is_none() && !stats.interrupted {
            session.reporter.complete_frame();
        }
        failure.map_or(Ok(()), Err)
    }
}

/// Files named after the scene, in the working directory.
pub fn default_outputs(scene: &Path) -> Vec<String> {
    let stem = scene.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy().into_owned());
    DEFAULT_EXTENSIONS.iter().map(|extension| format!("{stem}.{extension}")).collect()
}

/// Names that are given, and not after the scene, have no place for a frame's number.
fn check_names(arguments: &RenderArgs, settings: &Settings) -> Result<()> {
    let state = [&arguments.state.checkpoint, &arguments.json].into_iter().flatten().filter_map(|path| path.to_str());
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

fn report(reporter: &Reporter, settings: &Settings, accel: &dyn Accelerator, stats: &Stats, written: &[String]) {
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
        accel.description(),
    ));
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
