//! Checks of anyone's EXR files against the conventions of the programs that read them: one table of rules, each with
//! its reason and its remedy.

mod attributes;
mod crypto;
mod crypto_pixels;
mod file;
mod names;
mod parts;
mod precision;
mod rules;

pub use rules::RULES;

use std::path::Path;

use serde::Serialize;

use crate::desc::ExrProfileDesc;
use crate::error::Result;
use file::ExrFile;

/// How bad a broken rule is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Some program reads the file less well than it could.
    Warning,
    /// Some program reads the file wrongly or not at all.
    Error,
}

impl Severity {
    /// In lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// A rule of the conventions.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// The name it is reported by.
    pub id: &'static str,
    /// What a file has to be.
    pub title: &'static str,
    /// Where the rule comes from.
    pub source: &'static str,
    /// What reads a file wrongly that breaks it, and how.
    pub effect: &'static str,
    /// How to mend such a file.
    pub mend: &'static str,
    /// How bad it is, by the profile; `None` where the rule does not hold.
    pub severity: [Option<Severity>; 4],
    check: fn(&ExrFile) -> Vec<Fault>,
}

impl Rule {
    /// How bad breaking the rule is for files of a profile; `None` where it does not hold.
    pub fn severity(&self, profile: ExrProfileDesc) -> Option<Severity> {
        self.severity[profile as usize]
    }
}

/// Where and how a file breaks a rule.
struct Fault {
    part: Option<usize>,
    channel: Option<String>,
    what: String,
}

impl Fault {
    fn file(what: impl Into<String>) -> Self {
        Self { part: None, channel: None, what: what.into() }
    }

    fn part(part: usize, what: impl Into<String>) -> Self {
        Self { part: Some(part), channel: None, what: what.into() }
    }

    fn channel(part: usize, channel: impl Into<String>, what: impl Into<String>) -> Self {
        Self { part: Some(part), channel: Some(channel.into()), what: what.into() }
    }
}

/// A rule that a file breaks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The rule's name.
    pub rule: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The part, counted from 0.
    pub part: Option<usize>,
    /// The channel's full name.
    pub channel: Option<String>,
    /// What breaks the rule.
    pub what: String,
    /// What reads the file wrongly, and how.
    pub effect: &'static str,
    /// How to mend it.
    pub mend: &'static str,
}

/// Names the rules that a file breaks, those that matter most first.
///
/// # Errors
/// [`Error::Missing`](crate::Error::Missing) if the file cannot be read, [`Error::Malformed`](crate::Error::Malformed)
/// if it is no EXR file.
pub fn check_exr(path: &Path, profile: ExrProfileDesc) -> Result<Vec<Finding>> {
    let file = ExrFile::read(path)?;
    let mut findings = Vec::new();
    for rule in RULES {
        let Some(severity) = rule.severity(profile) else { continue };
        findings.extend((rule.check)(&file).into_iter().map(|Fault { part, channel, what }| Finding {
            rule: rule.id,
            severity,
            part,
            channel,
            what,
            effect: rule.effect,
            mend: rule.mend,
        }));
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    Ok(findings)
}

#[cfg(test)]
mod tests;
