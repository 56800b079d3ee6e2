//! `steradian check-exr`.

use serde_json::{Value, json};
use steradian::output::{self, Finding, Severity};
use steradian::{Error, Result};

use crate::args::CheckExrArgs;
use crate::text;

/// The exit code for files that break rules.
const BROKEN: u8 = 1;

/// Checks files and prints what is wrong with them; the result is the exit code.
pub fn run(arguments: &CheckExrArgs) -> Result<u8> {
    let mut values = Vec::new();
    let mut lines = Vec::new();
    let mut worst = None;
    for file in &arguments.files {
        let findings = output::check_exr(file, arguments.profile)?;
        worst = worst.max(findings.iter().map(|finding| finding.severity).max());
        let name = file.display().to_string();
        if findings.is_empty() {
            lines.push(format!("{name}: clean for the profile {}", arguments.profile.name()));
        }
        lines.extend(findings.iter().map(|finding| describe(&name, finding)));
        let findings = serde_json::to_value(&findings).map_err(|e| Error::Internal(e.to_string()))?;
        values.push(json!({ "file": name, "profile": arguments.profile.name(), "findings": findings }));
    }
    if arguments.json {
        text::print_json(&Value::Array(values))?;
    } else {
        text::print(&lines.join("\n"))?;
    }
    let fails = worst == Some(Severity::Error) || (arguments.strict && worst.is_some());
    Ok(if fails { BROKEN } else { 0 })
}

fn describe(file: &str, finding: &Finding) -> String {
    let part = finding.part.map_or(String::new(), |part| format!(" part {part}"));
    let channel = finding.channel.as_ref().map_or(String::new(), |channel| format!(" {channel}"));
    let Finding { rule, what, effect, mend, .. } = finding;
    format!("{file}:{part}{channel}: {} {rule}: {what}\n    {effect}\n    mend: {mend}", finding.severity.name())
}
