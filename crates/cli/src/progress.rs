//! Progress on stderr: a bar on a terminal, whole lines elsewhere, in the format of whoever reads them.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use steradian::internal::farm::{Event, ProgressFormat, Status};
use steradian::internal::render::Progress;

use crate::log::{self, Level};

/// Time between two changes of the bar.
const BAR_PERIOD: Duration = Duration::from_millis(100);
/// Least time between two lines.
const LINE_PERIOD: Duration = Duration::from_secs(1);
/// A line comes after this time even if the percentage stands.
const SIGN_OF_LIFE: Duration = Duration::from_secs(60);
/// The most that is shown before the files are in their places.
const NEARLY: f64 = 0.999_999;

/// Where progress goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sink {
    Nowhere,
    Bar,
    Lines,
}

/// Shows the progress of a render, or of a sequence of them.
pub struct Reporter {
    sink: Sink,
    format: &'static ProgressFormat,
    stop: OnceLock<Arc<AtomicBool>>,
    done: AtomicU64,
    state: Mutex<State>,
}

/// What changes rarely.
struct State {
    /// The present frame of a sequence, how many there are to render, and how many of them are complete.
    frame: Option<i64>,
    frames: usize,
    frames_done: usize,
    time_limit: Option<Duration>,
    /// When the first frame was begun, and the rendering of the present one.
    begin: Instant,
    start: Instant,
    total: u64,
    /// What was there at the start.
    resumed: u64,
    last: Option<Instant>,
    last_percent: Option<u64>,
    /// What the picture's error is and is to be.
    errors: Option<[f64; 2]>,
    stop_reported: bool,
    bar: Option<ProgressBar>,
}

impl Reporter {
    /// Reports progress in `format`, if that is given, in any case; else as fits where stderr goes, or not at all if
    /// `quiet`.
    pub fn new(format: Option<&'static ProgressFormat>, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb");
        let human = format.is_none_or(|format| format.name == "human");
        let sink = match (quiet, human && terminal) {
            (true, _) if human => Sink::Nowhere,
            (false, true) => Sink::Bar,
            _ => Sink::Lines,
        };
        let now = Instant::now();
        let state = State {
            frame: None,
            frames: 1,
            frames_done: 0,
            time_limit: None,
            begin: now,
            start: now,
            total: 0,
            resumed: 0,
            last: None,
            last_percent: None,
            errors: None,
            stop_reported: false,
            bar: None,
        };
        let format =
            format.or_else(|| ProgressFormat::by_name("plain")).unwrap_or(&steradian::internal::farm::FORMATS[0]);
        Self { sink, format, stop: OnceLock::new(), done: AtomicU64::new(0), state: Mutex::new(state) }
    }

    /// `stop` is watched so that the user learns that an interrupt was heard.
    pub fn watch(&self, stop: Arc<AtomicBool>) {
        let _ = self.stop.set(stop);
    }

    /// How many frames there will be.
    pub fn expect(&self, frames: usize) {
        if let Ok(mut state) = self.state.lock() {
            state.frames = frames;
        }
    }

    /// A frame is begun.
    pub fn begin(&self, frame: Option<i64>) {
        if let Ok(mut state) = self.state.lock() {
            state.frame = frame;
        }
        self.emit(&Event::Begin(frame));
    }

    /// The rendering of a frame ends after this time.
    pub fn limit_time(&self, limit: Option<Duration>) {
        if let Ok(mut state) = self.state.lock() {
            state.time_limit = limit;
        }
    }

    /// One line on stderr, clear of the bar; nothing if quiet.
    pub fn say(&self, line: &str) {
        log::message(Level::Note, line);
    }

    /// The frame's files are in their places, or it failed: only now is the work on it complete.
    pub fn complete_frame(&self) {
        if let Ok(mut state) = self.state.lock() {
            state.frames_done += 1;
            let fraction = state.frames_done as f64 / state.frames.max(1) as f64;
            let is_last = state.frames_done >= state.frames;
            if self.sink == Sink::Lines && (is_last || state.last.is_none_or(|last| last.elapsed() >= LINE_PERIOD)) {
                let status = Status { fraction, frame_fraction: 1.0, frame: state.frame, ..Status::default() };
                self.emit(&Event::Progress(&status));
                state.last = Some(Instant::now());
            }
        }
    }

    /// All is done, and well.
    pub fn succeed(&self) {
        self.emit(&Event::Success);
    }

    /// The work has failed.
    pub fn fail(&self, message: &str) {
        self.finish();
        self.emit(&Event::Failure(message));
    }

    fn emit(&self, event: &Event) {
        if self.sink == Sink::Lines {
            (self.format.lines)(event).iter().for_each(|line| log::line(line));
        }
    }

    fn update(&self, state: &mut State) {
        let now = Instant::now();
        let period = if self.sink == Sink::Bar { BAR_PERIOD } else { LINE_PERIOD };
        if state.last.is_some_and(|last| now - last < period) {
            return;
        }
        if !state.stop_reported && self.stop.get().is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            state.stop_reported = true;
            self.say("interrupted: finishing the samples under way; interrupt again to leave at once");
        }
        let mut status = status(state, self.done.load(Ordering::Relaxed), now);
        if let Some([error, target]) = state.errors {
            status.text += &format!(", error {error:.2e} of {target:.2e}");
        }
        let percent = (status.fraction * 100.0) as u64;
        match (&state.bar, self.sink) {
            (Some(bar), Sink::Bar) => {
                bar.set_position((status.fraction * 1000.0) as u64);
                let frame = status.frame.map_or(String::new(), |frame| format!("frame {frame}, "));
                bar.set_message(format!("{percent:3} %  {frame}{}", status.text));
            }
            (_, Sink::Lines) => {
                if state.last_percent == Some(percent) && state.last.is_some_and(|last| now - last < SIGN_OF_LIFE) {
                    return;
                }
                self.emit(&Event::Progress(&status));
            }
            _ => {}
        }
        state.last = Some(now);
        state.last_percent = Some(percent);
    }
}

fn bar() -> ProgressBar {
    let template = if log::is_colored() { "{bar:32.cyan} {msg}" } else { "{bar:32} {msg}" };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr()).with_style(style)
}

/// Where a sequence stands with `done` samples of its present frame. Never complete: the files are still to be written.
fn status(state: &State, done: u64, now: Instant) -> Status {
    let seconds = (now - state.start).as_secs_f64();
    let of_samples = done as f64 / state.total.max(1) as f64;
    let of_time = state.time_limit.map_or(0.0, |limit| seconds / limit.as_secs_f64());
    let frame_fraction = of_samples.max(of_time).clamp(0.0, NEARLY);
    let fraction = (state.frames_done as f64 + frame_fraction) / state.frames.max(1) as f64;
    let rate = if seconds > 0.0 { (done - state.resumed.min(done)) as f64 / seconds } else { 0.0 };
    // A single picture is timed without what comes before its rendering.
    let elapsed = if state.frames > 1 { (now - state.begin).as_secs_f64() } else { seconds };
    let resumed = state.resumed as f64 / (state.total.max(1) * state.frames.max(1) as u64) as f64;
    let gained = fraction - if state.frames > 1 { 0.0 } else { resumed.min(fraction) };
    let seconds_left = (gained > 0.0).then(|| elapsed * (1.0 - fraction) / gained);
    let left = seconds_left.map_or("?".to_owned(), duration);
    let text = format!("{:.2} Msamples/s, {left} left", rate * 1e-6);
    Status { fraction, frame_fraction, frame: state.frame, samples_per_second: rate, seconds_left, text }
}

/// Seconds in the form `12 s`, `3:25` or `1:02:07`.
fn duration(seconds: f64) -> String {
    let whole = seconds.ceil() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    match (hours, minutes) {
        (0, 0) => format!("{rest} s"),
        (0, _) => format!("{minutes}:{rest:02}"),
        _ => format!("{hours}:{minutes:02}:{rest:02}"),
    }
}

impl Progress for Reporter {
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        self.done.store(0, Ordering::Relaxed);
        if let Ok(mut state) = self.state.lock() {
            state.start = Instant::now();
            state.last = state.last.or(Some(state.start));
            state.total = u64::from(samples_per_pixel) * pixels;
            state.errors = None;
            if self.sink == Sink::Bar {
                state.bar = Some(bar());
                log::keep_clear_of(state.bar.clone());
            }
        }
    }

    fn plan(&self, samples: u64, error: f64, target: f64) {
        if let Ok(mut state) = self.state.lock() {
            state.total = samples;
            state.errors = Some([error, target]);
        }
    }

    fn resumed(&self, samples: u64) {
        self.done.fetch_add(samples, Ordering::Relaxed);
        if let Ok(mut state) = self.state.lock() {
            state.resumed = samples;
        }
    }

    fn tile_done(&self, samples: u64) {
        self.done.fetch_add(samples, Ordering::Relaxed);
        // Whoever finds the door closed goes on working: another thread is showing the numbers.
        if let (true, Ok(mut state)) = (self.sink != Sink::Nowhere, self.state.try_lock()) {
            self.update(&mut state);
        }
    }

    fn finish(&self) {
        if let Ok(mut state) = self.state.lock()
            && let Some(bar) = state.bar.take()
        {
            log::keep_clear_of(None);
            bar.finish_and_clear();
        }
    }

    fn note(&self, message: &str) {
        self.say(message);
    }

    fn warn(&self, message: &str) {
        log::message(Level::Warning, message);
        self.emit(&Event::Warning(message));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(frames_done: usize, frames: usize, done: u64, seconds: u64, limit: Option<u64>) -> Status {
        let reporter = Reporter::new(ProgressFormat::by_name("plain"), false);
        let mut state = reporter.state.into_inner().unwrap();
        let now = state.begin + Duration::from_secs(1000);
        state.start = now - Duration::from_secs(seconds);
        (state.frames, state.frames_done, state.total) = (frames, frames_done, 1000);
        state.time_limit = limit.map(Duration::from_secs);
        status(&state, done, now)
    }

    #[test]
    fn fractions_stay_below_one_until_the_files_are_written() {
        assert_eq!(at(0, 1, 429, 10, None).fraction, 0.429);
        assert_eq!(at(0, 1, 1000, 10, None).fraction, NEARLY);
        assert_eq!(at(0, 1, 100, 30, Some(60)).fraction, 0.5);
        assert_eq!(at(0, 1, 500, 60, None).text, "0.00 Msamples/s, 1:00 left");
        assert_eq!(at(0, 1, 0, 0, None).text, "0.00 Msamples/s, ? left");
    }

    #[test]
    fn what_was_there_at_the_start_took_no_time() {
        let reporter = Reporter::new(ProgressFormat::by_name("plain"), false);
        let mut state = reporter.state.into_inner().unwrap();
        let now = state.begin + Duration::from_secs(1000);
        (state.start, state.total, state.resumed) = (now - Duration::from_secs(10), 1000, 800);
        let resumed = status(&state, 900, now);
        assert_eq!((resumed.fraction, resumed.samples_per_second), (0.9, 10.0));
        assert!((resumed.seconds_left.unwrap() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn frames_count_alike() {
        let midway = at(2, 4, 500, 10, None);
        assert_eq!((midway.fraction, midway.frame_fraction, midway.samples_per_second), (0.625, 0.5, 50.0));
        assert_eq!(midway.seconds_left, Some(600.0));
    }

    #[test]
    fn durations_read_like_a_clock() {
        assert_eq!([duration(0.2), duration(205.0), duration(3727.0)], ["1 s", "3:25", "1:02:07"]);
    }
}
