//! Progress on stderr: a bar on a terminal, whole lines elsewhere.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use steradian::render::Progress;

/// Time between two changes of the bar.
const BAR_PERIOD: Duration = Duration::from_millis(100);
/// Least time between two lines.
const LINE_PERIOD: Duration = Duration::from_secs(1);
/// A line comes after this time even if the percentage stands.
const SIGN_OF_LIFE: Duration = Duration::from_secs(60);

/// Where progress goes.
enum Sink {
    Nowhere,
    Bar(ProgressBar),
    Lines,
}

/// Shows a render's progress.
pub struct Reporter {
    sink: Sink,
    stop: Arc<AtomicBool>,
    time_limit: Option<Duration>,
    done: AtomicU64,
    state: Mutex<State>,
}

/// What changes rarely.
struct State {
    start: Instant,
    total: u64,
    /// What was there at the start.
    resumed: u64,
    last: Option<Instant>,
    last_percent: Option<u64>,
    /// What the picture's error is and is to be.
    errors: Option<[f64; 2]>,
    stop_told: bool,
}

impl Reporter {
    /// Says nothing if `quiet`. `stop` is watched so that the user learns that an interrupt was heard.
    pub fn new(quiet: bool, stop: Arc<AtomicBool>, time_limit: Option<Duration>) -> Self {
        let sink = match (quiet, std::io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")) {
            (true, _) => Sink::Nowhere,
            (false, true) => Sink::Bar(bar()),
            (false, false) => Sink::Lines,
        };
        let state = State { start: Instant::now(), total: 0, resumed: 0, last: None, last_percent: None, errors: None, stop_told: false };
        Self { sink, stop, time_limit, done: AtomicU64::new(0), state: Mutex::new(state) }
    }

    /// One line on stderr, clear of the bar; nothing if quiet.
    pub fn say(&self, line: &str) {
        match &self.sink {
            Sink::Nowhere => {}
            Sink::Bar(bar) => bar.suspend(|| print(line)),
            Sink::Lines => print(line),
        }
    }

    /// The files are in their places: only now is the work complete.
    pub fn complete(&self) {
        if matches!(self.sink, Sink::Lines) {
            print("Progress: 100%");
        }
    }

    fn update(&self, state: &mut State) {
        let now = Instant::now();
        let period = if matches!(self.sink, Sink::Bar(_)) { BAR_PERIOD } else { LINE_PERIOD };
        if state.last.is_some_and(|last| now - last < period) {
            return;
        }
        if self.stop.load(Ordering::Relaxed) && !state.stop_told {
            state.stop_told = true;
            self.say("interrupted: finishing the samples under way; interrupt again to leave at once");
        }
        let mut view = view([state.resumed, self.done.load(Ordering::Relaxed)], state.total, now - state.start, self.time_limit);
        if let Some([error, target]) = state.errors {
            view.text += &format!(", error {error:.2e} of {target:.2e}");
        }
        match &self.sink {
            Sink::Nowhere => {}
            Sink::Bar(bar) => {
                bar.set_position((view.fraction * 1000.0) as u64);
                bar.set_message(format!("{:3} %  {}", view.percent, view.text));
            }
            Sink::Lines if state.last_percent == Some(view.percent) && state.last.is_some_and(|last| now - last < SIGN_OF_LIFE) => return,
            Sink::Lines => print(&format!("Progress: {}% ({})", view.percent, view.text)),
        }
        state.last = Some(now);
        state.last_percent = Some(view.percent);
    }
}

/// Stderr may be gone; that is no reason to stop.
fn print(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

fn bar() -> ProgressBar {
    let colored = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let template = if colored { "{bar:32.cyan} {msg}" } else { "{bar:32} {msg}" };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr()).with_style(style)
}

/// What is shown of a render's state.
struct View {
    fraction: f64,
    /// Rounded down, and never 100: the files are still to be written.
    percent: u64,
    text: String,
}

/// Of the samples there were at the start and are now.
fn view([resumed, done]: [u64; 2], total: u64, elapsed: Duration, time_limit: Option<Duration>) -> View {
    let seconds = elapsed.as_secs_f64();
    let of_samples = done as f64 / total.max(1) as f64;
    let of_time = time_limit.map_or(0.0, |limit| seconds / limit.as_secs_f64());
    let fraction = of_samples.max(of_time).clamp(0.0, 1.0);
    let rate = if seconds > 0.0 { (done - resumed) as f64 / seconds * 1e-6 } else { 0.0 };
    let gained = of_time.max(of_samples - resumed as f64 / total.max(1) as f64);
    let left = if gained > 0.0 { duration(seconds * (1.0 - fraction) / gained) } else { "?".to_owned() };
    View { fraction, percent: ((fraction * 100.0) as u64).min(99), text: format!("{rate:.2} Msamples/s, {left} left") }
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
        if let Ok(mut state) = self.state.lock() {
            state.start = Instant::now();
            state.last = Some(state.start);
            state.total = u64::from(samples_per_pixel) * pixels;
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
        if let (false, Ok(mut state)) = (matches!(self.sink, Sink::Nowhere), self.state.try_lock()) {
            self.update(&mut state);
        }
    }

    fn finish(&self) {
        if let Sink::Bar(bar) = &self.sink {
            bar.finish_and_clear();
        }
    }

    fn warn(&self, message: &str) {
        self.say(&format!("warning: {message}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_are_rounded_down_and_stay_below_100() {
        let at = |done, seconds, limit| view([0, done], 1000, Duration::from_secs(seconds), limit);
        assert_eq!(at(429, 10, None).percent, 42);
        assert_eq!(at(1000, 10, None).percent, 99);
        assert_eq!(at(100, 30, Some(Duration::from_secs(60))).percent, 50);
        assert_eq!(at(500, 60, None).text, "0.00 Msamples/s, 1:00 left");
        assert_eq!(at(0, 0, None).text, "0.00 Msamples/s, ? left");
        let resumed = view([800, 900], 1000, Duration::from_secs(10), None);
        assert_eq!((resumed.percent, resumed.text.as_str()), (90, "0.00 Msamples/s, 10 s left"));
    }

    #[test]
    fn durations_read_like_a_clock() {
        assert_eq!([duration(0.2), duration(205.0), duration(3727.0)], ["1 s", "3:25", "1:02:07"]);
    }
}
