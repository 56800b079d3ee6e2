//! Messages: to stderr, clear of the bar, and to a file; as text or as JSON.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use anstream::AutoStream;
use indicatif::ProgressBar;
use serde_json::json;
use steradian::internal::farm::message_line;
use steradian::{Error, Result};
use tracing::field::{Field, Visit};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime, SystemTime};
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

use crate::args::{ColorChoice, LogArgs, LogFormat, Verbosity};

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Why the program ends.
    Error,
    /// Warnings.
    Warning,
    /// What was done.
    Note,
    /// Shown with `-v`.
    Info,
    /// Shown with `-vv`.
    Debug,
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
            Self::Info => "info",
            Self::Debug => "debug",
        }
    }

    /// The colour of its name on a terminal.
    fn escape(self) -> &'static str {
        match self {
            Self::Error => "\x1b[1;31m",
            Self::Warning => "\x1b[1;33m",
            Self::Note | Self::Info => "\x1b[32m",
            Self::Debug => "\x1b[2m",
        }
    }
}

/// Where messages go and their format.
struct Log {
    shown: Level,
    format: LogFormat,
    colored: bool,
    file: Option<(Mutex<File>, Level)>,
}

static LOG: OnceLock<Log> = OnceLock::new();
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Starts to log; messages before go to stderr as text.
pub fn start(arguments: &LogArgs, verbosity: Verbosity, default_format: LogFormat) -> Result<()> {
    let shown = match (verbosity.quiet, verbosity.verbose) {
        (true, _) => Level::Error,
        (false, 0) => Level::Note,
        (false, 1) => Level::Info,
        (false, _) => Level::Debug,
    };
    let file = match &arguments.log_file {
        None => None,
        Some(path) => {
            let fault = |e: std::io::Error| Error::Output { file: path.clone(), message: e.to_string() };
            if path.is_file() && !is_log(path).map_err(fault)? {
                let message = "is not a log of steradian, to which messages could be added; choose another name";
                return Err(Error::Usage(format!("--log-file: {} {message}", path.display())));
            }
            let file = steradian::internal::file::append(path)?;
            Some((Mutex::new(file), shown.max(Level::Info)))
        }
    };
    let format = arguments.log_format.unwrap_or(default_format);
    let most = file.as_ref().map_or(shown, |(_, level)| *level);
    // Fails only if there is a log already, which then does the work.
    let _ = LOG.set(Log { shown, format, colored: colored(arguments.color), file });
    let filter = match most {
        Level::Error => LevelFilter::ERROR,
        Level::Warning | Level::Note => LevelFilter::WARN,
        Level::Info => LevelFilter::INFO,
        Level::Debug => LevelFilter::DEBUG,
    };
    let _ = tracing_subscriber::registry().with(Events.with_filter(filter)).try_init();
    Ok(())
}

/// Whether a file is empty or begins as logs do: with a time, or with an object in JSON. Any other may be one that
/// somebody needs.
fn is_log(path: &Path) -> std::io::Result<bool> {
    let mut start = Vec::new();
    steradian::internal::file::open(path)?.take(64).read_to_end(&mut start)?;
    let separator = |i: usize| {
        [(4, b'-'), (7, b'-'), (10, b'T'), (13, b':'), (16, b':')].into_iter().find(|(place, _)| *place == i)
    };
    let fits = |(i, byte): (usize, &u8)| separator(i).map_or(byte.is_ascii_digit(), |(_, expected)| *byte == expected);
    let is_dated = start.len() >= 19 && start.iter().take(19).enumerate().all(fits);
    Ok(start.is_empty() || is_dated || start.starts_with(br#"{"level":""#))
}

/// Whether stderr has colours. If that is not chosen, `NO_COLOR` takes precedence over `CLICOLOR_FORCE`, and that over
/// the terminal.
pub fn colored(choice: ColorChoice) -> bool {
    match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => AutoStream::choice(&std::io::stderr()) != anstream::ColorChoice::Never,
    }
}

/// Whether messages of this level are shown on stderr.
pub fn shows(level: Level) -> bool {
    LOG.get().map_or(Level::Note, |log| log.shown) >= level
}

/// Whether the bar and messages have colours.
pub fn is_colored() -> bool {
    LOG.get().map_or_else(|| colored(ColorChoice::Auto), |log| log.colored)
}

/// Whether messages are JSON.
pub fn is_json() -> bool {
    LOG.get().is_some_and(|log| log.format == LogFormat::Json)
}

/// A message.
pub fn message(level: Level, text: &str) {
    let log = LOG.get();
    let format = log.map_or(LogFormat::Text, |log| log.format);
    if shows(level) {
        line(&rendered(format, level, text, is_colored(), false));
    }
    if let Some((file, most)) = log.and_then(|log| log.file.as_ref())
        && level <= *most
        && let Ok(mut file) = file.lock()
    {
        // One write, so that lines of several processes do not mix. A full disk is no reason to stop.
        let _ = file.write_all(format!("{}\n", rendered(format, level, text, false, true)).as_bytes());
    }
}

/// A line on stderr as it is, clear of the bar. Stderr may be gone; that is no reason to stop.
pub fn line(text: &str) {
    let print = || {
        let mut stderr = std::io::stderr().lock();
        let _ = stderr.write_all(format!("{text}\n").as_bytes()).and_then(|()| stderr.flush());
    };
    match BAR.lock() {
        Ok(bar) if bar.is_some() => bar.iter().for_each(|bar| bar.suspend(print)),
        _ => print(),
    }
}

/// Messages keep clear of this bar from here on.
pub fn keep_clear_of(bar: Option<ProgressBar>) {
    if let Ok(mut place) = BAR.lock() {
        *place = bar;
    }
}

/// Names in the text may be those of strangers: it is one line, steers no terminal and no farm.
fn rendered(format: LogFormat, level: Level, text: &str, colored: bool, dated: bool) -> String {
    if format == LogFormat::Json {
        return message_line(&json!({ "time": now(), "level": level.name(), "message": text }).to_string());
    }
    let text = message_line(text);
    match format {
        _ if dated => format!("{} {}: {text}", now(), level.name()),
        _ if level == Level::Note => text,
        _ if colored => format!("{}{}:\x1b[0m {text}", level.escape(), level.name()),
        _ => format!("{}: {text}", level.name()),
    }
}

/// The time of day in UTC, as RFC 3339 has it.
fn now() -> String {
    let mut text = String::new();
    let _ = SystemTime.format_time(&mut Writer::new(&mut text));
    text
}

/// Messages of the library.
struct Events;

impl<S: tracing::Subscriber> Layer<S> for Events {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        let level = match *event.metadata().level() {
            tracing::Level::ERROR => Level::Error,
            tracing::Level::WARN => Level::Warning,
            tracing::Level::INFO => Level::Info,
            _ => Level::Debug,
        };
        let mut text = Text(String::new());
        event.record(&mut text);
        message(level, &text.0);
    }
}

/// An event's message, and its fields as `name=value`.
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        let _ = if field.name() == "message" {
            write!(self.0, "{value:?}")
        } else {
            write!(self.0, " {}={value:?}", field.name())
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_text_or_json() {
        assert_eq!(rendered(LogFormat::Text, Level::Warning, "w", false, false), "warning: w");
        assert_eq!(rendered(LogFormat::Text, Level::Note, "n", true, false), "n");
        assert_eq!(rendered(LogFormat::Text, Level::Error, "e", true, false), "\x1b[1;31merror:\x1b[0m e");
        let value: serde_json::Value =
            serde_json::from_str(&rendered(LogFormat::Json, Level::Info, "a \"b\"", true, true)).unwrap();
        assert_eq!((&value["level"], &value["message"]), (&"info".into(), &"a \"b\"".into()));
        let value: serde_json::Value =
            serde_json::from_str(&rendered(LogFormat::Json, Level::Info, "\u{9b}\nopenjd_env: a", true, true)).unwrap();
        assert_eq!(value["message"], "\u{9b}\nopenjd_env: a");
        assert_eq!(
            rendered(LogFormat::Text, Level::Note, "a\u{1b}[2J\nProgress: 100%", false, false),
            "a\\u001b[2J\\n\\u0050rogress: 100%"
        );
        let dated = rendered(LogFormat::Text, Level::Info, "i", false, true);
        assert!(dated.ends_with("Z info: i") && dated.starts_with("20") && dated.as_bytes()[10] == b'T', "{dated}");
    }
}
