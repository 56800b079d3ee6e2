//! `steradian render`.

use std::path::Path;
use std::time::Instant;

use steradian::accel::{self, Accelerator};
use steradian::film::LayerSet;
use steradian::live::Fan;
use steradian::output::{self, RenderInfo, RenderStatistics};
use steradian::render::{self, DEFAULT_EXTENSIONS, Progress, Recipe, Replayed, Settings, Stats};
use steradian::{Result, compile};

use crate::args::RenderArgs;
use crate::denoise;
use crate::frames::{Session, Shot};
use crate::kept::{self, Kept};
use crate::progress::Reporter;
use crate::rerender;
use crate::stats::{self, Run};
use crate::text;

/// Renders a picture and writes what was asked for; the result is the exit code. `start` is when the scene's reading began.
pub fn picture(arguments: &RenderArgs, shot: Shot, session: &Session, start: Instant) -> Result<u8> {
    let json = arguments.json.as_deref().map(|path| shot.file(path));
    let mut overrides = arguments.overrides(default_outputs(&arguments.scene));
    let shard_file = kept::take_shard_name(&arguments.state, &arguments.scene, &mut overrides)?.map(|name| shot.file_of(&name));
    let mut settings = Settings::new(&shot.imported.desc, &overrides)?;
    shot.adapt(&mut settings);
    let recipe = rerender::prepare(arguments, &shot, &mut settings)?;
    let is_there = match &shard_file {
        Some(file) => shot.frame.is_some() && !arguments.sequence.overwrite && file.exists(),
        None => shot.is_there(&settings, arguments.sequence.overwrite),
    };
    if is_there {
        session.reporter.complete_frame();
        return Ok(0);
    }
    if arguments.pixel.is_none() {
        check_outputs(&settings, shard_file.as_deref(), json.as_deref())?;
    }
    let denoiser = denoise::prepare(&arguments.denoise, &mut settings)?;
    let checkpoint = arguments.state.checkpoint.as_deref().map(|path| shot.file_of(path));
    let kept = match arguments.pixel {
        None => Kept::new(&arguments.state, &settings, shard_file.as_deref(), checkpoint.as_deref())?,
        Some(_) => None,
    };
    let scene = compile::compile_imported(&shot.imported, &shot.scene)?;
    let mut info = RenderInfo {
        world_to_camera: Some(scene.camera.world_to_camera()),
        world_to_ndc: scene.camera.world_to_ndc(settings.size),
        pixel_aspect: Some(scene.camera.framing().pixel_aspect as f32),
        identities: settings.layers.needs_coverage().then(|| scene.identities.clone()),
        settings: recipe.as_ref().map(Recipe::to_value),
        statistics: Some(RenderStatistics { threads: settings.threads, ..RenderStatistics::default() }),
        ..RenderInfo::default()
    };
    let header = match &kept {
        Some(kept) => Some(kept.header(&shot.imported, &shot.scene, &scene, &settings, info.clone())?),
        None => None,
    };
    let (scene_file, frame) = (shot.scene.clone(), shot.frame);
    drop(shot);
    let load_seconds = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let accel = accel::build(settings.accel, &scene.geometry, settings.threads)?;
    let build_seconds = start.elapsed().as_secs_f64();
    tracing::info!("{}; {load_seconds:.3} s to load, {build_seconds:.3} s to build", accel.description());

    if let (Some(pixel), Some(sample)) = (arguments.pixel, arguments.sample) {
        settings.layers = LayerSet::FULL;
        let value = render::replay(&scene, &*accel, &settings, pixel, sample)?;
        return text::print(&describe_sample(&value)).map(|()| 0);
    }

    let (interrupt, reporter) = (session.interrupt()?, &session.reporter);
    reporter.limit_time(settings.time_limit);
    let live = arguments.live.start(&scene_file, settings.time_limit)?;
    if let Some(url) = live.preview_url() {
        reporter.say(&format!("preview: {url}"));
    }
    let fan = Fan::new([reporter as &dyn Progress, &live]);
    let mut result = match (kept, &header) {
        (Some(kept), Some(header)) => kept.render(&scene, &*accel, &settings, header, (reporter, &fan), interrupt)?,
        _ => {
            let result = render::render(&scene, &*accel, &settings, &fan, &interrupt.stop)?;
            kept::warn_of_request(interrupt, reporter);
            result
        }
    };
    let denoised = denoise::finish(denoiser.as_ref().filter(|_| shard_file.is_none()), &mut result.image, reporter);
    let stats = &result.stats;
    let first = load_seconds + build_seconds + stats.first_pass_seconds;
    tracing::info!("{first:.3} s until every pixel had its first sample");
    warn_of_dropped(stats, reporter);
    if let (Some(frame), true) = (frame, stats.interrupted) {
        // A file that is there counts as a complete frame.
        reporter.say(&format!("interrupted: frame {frame} is not written"));
        return Ok(interrupt.exit_code());
    }

    info.samples_per_pixel = stats.spp_done;
    info.render_seconds = stats.render_seconds;
    info.statistics = Some(RenderStatistics { threads: settings.threads, rays: stats.rays.total(), nan_samples: stats.nan_samples });
    info.settings = recipe.map(|recipe| recipe.with_samples(stats.spp_done).to_value());
    info.texts = denoised.texts;
    let written: Vec<String> = match &shard_file {
        Some(_) if stats.interrupted && arguments.state.checkpoint.is_some() => Vec::new(),
        Some(file) => vec![file.display().to_string()],
        None => settings.outputs.iter().map(|output| output.file.clone()).collect(),
    };
    if shard_file.is_none() {
        for desc in &settings.outputs {
            output::write(desc, &result.image, &info)?;
        }
        live.show_final(&result.image, stats.spp_done);
    }
    if let Some(path) = &json {
        let run = Run { scene: &scene_file, load_seconds, build_seconds };
        let mut value = stats::value(&run, &settings, &*accel, stats);
        value["denoise"] = denoised.statistics;
        stats::write(path, &value)?;
    }
    if let Some(failure) = denoised.failure {
        return Err(failure);
    }
    report(reporter, &settings, &*accel, stats, &written);
    if arguments.live.preview_hold {
        interrupt.wait();
    }
    Ok(if stats.interrupted { interrupt.exit_code() } else { 0 })
}

/// Files named after the scene, in the working directory.
fn default_outputs(scene: &Path) -> Vec<String> {
    let stem = scene.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy().into_owned());
    DEFAULT_EXTENSIONS.iter().map(|extension| format!("{stem}.{extension}")).collect()
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
        "{count} {noun} not finite and dropped (this is a bug; --pixel {},{} --sample {} replays the first)",
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
        "{}x{} pixels, {} samples per pixel{ended}, {:.2} s, {:.2} Msamples/s, {:.2} Mrays/s, {} threads, {}",
        settings.crop.width,
        settings.crop.height,
        stats.spp_done,
        stats.render_seconds,
        stats.samples as f64 / seconds * 1e-6,
        stats.rays.total() as f64 / seconds * 1e-6,
        settings.threads,
        accel.description(),
    ));
    if let (Some(error), Some(target)) = (stats.estimated_error, settings.target_error) {
        reporter.say(&format!("relative squared error about {error:.3e}, asked for {target:.3e}"));
    }
    written.iter().for_each(|file| reporter.say(&format!("wrote {file}")));
    if !stats.interrupted {
        reporter.complete_frame();
    }
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
