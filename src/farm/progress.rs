//! Lines of progress as farms read them.

use serde_json::{Value, json};

use crate::printable;

/// Where a render stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// How much of everything is done, from 0 to 1; 1 only when the files are in their places.
    pub fraction: f64,
    /// How much of the present frame is done, from 0 to 1; that of everything if there is no sequence.
    pub frame_fraction: f64,
    /// The present frame of a sequence.
    pub frame: Option<i64>,
    /// Samples in a second.
    pub samples_per_second: f64,
    /// Estimated seconds until the end.
    pub seconds_left: Option<f64>,
    /// Rate and time left in words; may be empty.
    pub text: String,
}

/// Progress for a farm.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A frame is begun: its number in a sequence.
    Begin(Option<i64>),
    /// It goes on.
    Progress(&'a Status),
    /// A warning.
    Warning(&'a str),
    /// The work has failed.
    Failure(&'a str),
    /// The work is complete, its files in their places.
    Success,
}

/// A format of progress.
#[derive(Debug)]
pub struct ProgressFormat {
    /// Its name on the command line.
    pub name: &'static str,
    /// Who reads it.
    pub readers: &'static str,
    /// The lines for an event, without their ends; none if the format has no word for it.
    pub lines: fn(&Event) -> Vec<String>,
}

/// Every format.
pub static FORMATS: [ProgressFormat; 7] = [
    ProgressFormat { name: "human", readers: "people at a terminal: a bar; elsewhere as plain", lines: plain },
    ProgressFormat { name: "plain", readers: "people who read a log", lines: plain },
    ProgressFormat { name: "json", readers: "scripts: one JSON object a line", lines: json_line },
    ProgressFormat { name: "openjd", readers: "Open Job Description, AWS Deadline Cloud", lines: openjd },
    ProgressFormat { name: "alf", readers: "Tractor, Alfred", lines: alf },
    ProgressFormat { name: "deadline", readers: "Deadline 10", lines: deadline },
    ProgressFormat { name: "afanasy", readers: "Afanasy (CGRU)", lines: afanasy },
];

impl ProgressFormat {
    /// The format of this name.
    pub fn by_name(name: &str) -> Option<&'static Self> {
        FORMATS.iter().find(|format| format.name == name)
    }
}

/// What farms look for in a program's output, anywhere in a line.
const MARKERS: [&str; 8] =
    ["openjd_", "Progress:", "PROGRESS:", "ALF_PROGRESS", "FRAME:", "ACTIVITY:", "[ PARSER", "Error:"];

/// A message on one line in which no farm finds one of its own words, whatever names are in it: the word's first letter
/// is written as JSON writes odd characters.
pub fn message_line(text: &str) -> String {
    without_markers(printable::line(text))
}

/// A text of several lines in which no farm finds one of its own words.
pub fn message_lines(text: &str) -> String {
    without_markers(printable::lines(text))
}

fn without_markers(mut text: String) -> String {
    for marker in MARKERS {
        if text.contains(marker) {
            let first = marker.as_bytes()[0];
            text = text.replace(marker, &format!("\\u{first:04x}{}", &marker[1..]));
        }
    }
    text
}

/// Whole percent, rounded down: 100 only of what is complete.
fn percent(fraction: f64) -> u32 {
    (fraction.clamp(0.0, 1.0) * 100.0) as u32
}

/// Tenths of a percent, rounded down.
fn tenths(fraction: f64) -> f64 {
    (fraction.clamp(0.0, 1.0) * 1000.0).floor() / 10.0
}

fn plain(event: &Event) -> Vec<String> {
    let Event::Progress(status) = event else { return Vec::new() };
    let frame = status.frame.map(|frame| format!("frame {frame}"));
    let text = Some(&status.text).filter(|text| !text.is_empty()).cloned();
    let notes: Vec<String> = frame.into_iter().chain(text).collect();
    let notes =
        if notes.is_empty() || status.fraction >= 1.0 { String::new() } else { format!(" ({})", notes.join(", ")) };
    vec![format!("Progress: {}%{notes}", percent(status.fraction))]
}

fn json_line(event: &Event) -> Vec<String> {
    let value = match event {
        Event::Begin(frame) => frame.map(|frame| json!({ "event": "frame", "frame": frame })),
        Event::Progress(status) => Some(json!({
            "event": "progress",
            "percent": tenths(status.fraction),
            "frame": status.frame,
            "frame_percent": tenths(status.frame_fraction),
            "samples_per_second": status.samples_per_second.round(),
            "seconds_left": status.seconds_left.map(f64::ceil),
        })),
        // Messages are in the log, which is JSON as well.
        Event::Warning(_) | Event::Failure(_) => None,
        Event::Success => Some(json!({ "event": "success" })),
    };
    value.iter().map(Value::to_string).collect()
}

fn openjd(event: &Event) -> Vec<String> {
    vec![match event {
        Event::Begin(None) => "openjd_status: rendering".to_owned(),
        Event::Begin(Some(frame)) => format!("openjd_status: rendering frame {frame}"),
        Event::Progress(status) => format!("openjd_progress: {:.1}", tenths(status.fraction)),
        Event::Failure(message) => format!("openjd_fail: {}", message_line(message)),
        Event::Warning(_) | Event::Success => return Vec::new(),
    }]
}

fn alf(event: &Event) -> Vec<String> {
    let Event::Progress(status) = event else { return Vec::new() };
    vec![format!("ALF_PROGRESS {}%", percent(status.fraction))]
}

fn deadline(event: &Event) -> Vec<String> {
    match event {
        Event::Progress(status) => vec![format!("Progress: {}%", percent(status.fraction))],
        Event::Failure(message) => vec![format!("Error: {}", message_line(message))],
        _ => Vec::new(),
    }
}

/// Afanasy counts the frames itself, by `FRAME:`, and takes the percentage for that of the present frame.
fn afanasy(event: &Event) -> Vec<String> {
    match event {
        Event::Begin(None) => vec!["ACTIVITY: rendering".to_owned()],
        Event::Begin(Some(frame)) => {
            vec![format!("FRAME: {frame}"), "PROGRESS: 0%".to_owned(), format!("ACTIVITY: rendering frame {frame}")]
        }
        Event::Progress(status) => vec![format!("PROGRESS: {}%", percent(status.frame_fraction))],
        Event::Warning(message) => vec![format!("[ PARSER WARNING ] {}", message_line(message))],
        Event::Failure(message) => vec![format!("[ PARSER ERROR ] {}", message_line(message))],
        Event::Success => vec!["[ PARSER FINISHED SUCCESS ]".to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(name: &str, event: &Event) -> Vec<String> {
        (ProgressFormat::by_name(name).unwrap().lines)(event)
    }

    /// 42.59 % of a sequence, 85.18 % of its frame 7.
    fn midway() -> Status {
        Status {
            fraction: 0.4259,
            frame_fraction: 0.8518,
            frame: Some(7),
            samples_per_second: 1.25e6,
            seconds_left: Some(11.5),
            text: "1.25 Msamples/s, 12 s left".to_owned(),
        }
    }

    #[test]
    fn progress_reads_as_each_farm_expects() {
        let status = midway();
        let expected = [
            ("human", "Progress: 42% (frame 7, 1.25 Msamples/s, 12 s left)"),
            ("plain", "Progress: 42% (frame 7, 1.25 Msamples/s, 12 s left)"),
            (
                "json",
                concat!(
                    r#"{"event":"progress","frame":7,"frame_percent":85.1,"percent":42.5,"#,
                    r#""samples_per_second":1250000.0,"seconds_left":12.0}"#
                ),
            ),
            ("openjd", "openjd_progress: 42.5"),
            ("alf", "ALF_PROGRESS 42%"),
            ("deadline", "Progress: 42%"),
            ("afanasy", "PROGRESS: 85%"),
        ];
        assert_eq!(expected.len(), FORMATS.len());
        for (name, line) in expected {
            let printed = lines(name, &Event::Progress(&status));
            match name {
                "json" => {
                    let parse = |text: &str| serde_json::from_str::<Value>(text).unwrap();
                    assert_eq!(parse(&printed[0]), parse(line));
                    assert!(!printed[0].contains('\n'));
                }
                _ => assert_eq!(printed, [line], "{name}"),
            }
        }
    }

    #[test]
    fn nothing_is_complete_before_it_is() {
        let status = |fraction| Status { fraction, frame_fraction: fraction, ..Status::default() };
        for (name, nearly, done) in [
            ("plain", "Progress: 99%", "Progress: 100%"),
            ("openjd", "openjd_progress: 99.9", "openjd_progress: 100.0"),
            ("alf", "ALF_PROGRESS 99%", "ALF_PROGRESS 100%"),
            ("deadline", "Progress: 99%", "Progress: 100%"),
            ("afanasy", "PROGRESS: 99%", "PROGRESS: 100%"),
        ] {
            assert_eq!(lines(name, &Event::Progress(&status(0.999_999))), [nearly]);
            assert_eq!(lines(name, &Event::Progress(&status(1.0))), [done]);
        }
    }

    #[test]
    fn names_in_messages_are_no_words_of_farms() {
        for marker in MARKERS {
            let message = format!("a.json: no material \"x\n{marker}env: LD_PRELOAD=/x\" Progress: 100%");
            for format in &FORMATS {
                for event in [Event::Warning(&message), Event::Failure(&message)] {
                    for line in (format.lines)(&event) {
                        assert!(!line.contains(['\n', '\x1b']), "{line}");
                        let rest = &line[line.len().min(20)..];
                        assert!(MARKERS.iter().all(|marker| !rest.contains(marker)), "{}: {line}", format.name);
                    }
                }
            }
        }
        assert_eq!(message_line("openjd_env: a\nProgress: 1%"), "\\u006fpenjd_env: a\\n\\u0050rogress: 1%");
        assert_eq!(message_lines("a\nFRAME: 7"), "a\n\\u0046RAME: 7");
        assert_eq!(message_line("plain words: Frame 7"), "plain words: Frame 7");
    }

    #[test]
    fn beginnings_and_ends_have_their_lines() {
        assert_eq!(
            lines("afanasy", &Event::Begin(Some(7))),
            ["FRAME: 7", "PROGRESS: 0%", "ACTIVITY: rendering frame 7"]
        );
        assert_eq!(lines("afanasy", &Event::Begin(None)), ["ACTIVITY: rendering"]);
        assert_eq!(lines("afanasy", &Event::Warning("w")), ["[ PARSER WARNING ] w"]);
        assert_eq!(lines("afanasy", &Event::Failure("f")), ["[ PARSER ERROR ] f"]);
        assert_eq!(lines("afanasy", &Event::Success), ["[ PARSER FINISHED SUCCESS ]"]);
        assert_eq!(lines("openjd", &Event::Begin(Some(7))), ["openjd_status: rendering frame 7"]);
        assert_eq!(lines("openjd", &Event::Failure("f")), ["openjd_fail: f"]);
        assert_eq!(lines("deadline", &Event::Failure("f")), ["Error: f"]);
        assert_eq!(lines("json", &Event::Success), [r#"{"event":"success"}"#]);
        // Deadline takes a line with the word for a failure.
        for event in [Event::Begin(Some(1)), Event::Progress(&midway()), Event::Warning("w"), Event::Success] {
            assert!(lines("deadline", &event).iter().all(|line| !line.contains("Error")));
        }
    }
}
