//! `steradian check-exr`.

use serde_json::{Value, json};
use steradian::internal::output::{self, Finding, Severity};
use steradian::{Error, Result};

use crate::args::CheckExrArgs;
use crate::text;

/// The exit code for files that break rules.
const BROKEN: u8 = 1;

/// Places that are named for each rule without `-v`.
const EXAMPLES: usize = 3;

/// Checks files and prints what is wrong with them; the result is the exit code.
pub fn run(arguments: &CheckExrArgs) -> Result<u8> {
    let mut values = Vec::new();
    let mut clean = Vec::new();
    let mut broken: Vec<(String, Finding)> = Vec::new();
    for file in &arguments.files {
        let findings = output::check_exr(file, arguments.profile)?;
        let name = file.display().to_string();
        if arguments.json {
            let findings = serde_json::to_value(&findings).map_err(|e| Error::Internal(e.to_string()))?;
            values.push(json!({ "file": name, "profile": arguments.profile.name(), "findings": findings }));
        }
        if findings.is_empty() {
            clean.push(name.clone());
        }
        broken.extend(findings.into_iter().map(|finding| (name.clone(), finding)));
    }
    let worst = broken.iter().map(|(_, finding)| finding.severity).max();
    if arguments.json {
        text::print_json(&Value::Array(values))?;
    } else {
        let rules = by_rule(&broken);
        let found = rules.iter().flat_map(|findings| describe(findings, arguments.files.len(), arguments.verbose > 0));
        text::print(&clean_lines(&clean, arguments).into_iter().chain(found).collect::<Vec<_>>().join("\n"))?;
    }
    let fails = worst == Some(Severity::Error) || (arguments.fail_on_warning && worst.is_some());
    Ok(if fails { BROKEN } else { 0 })
}

/// The lines about files that keep all rules.
fn clean_lines(clean: &[String], arguments: &CheckExrArgs) -> Vec<String> {
    let profile = arguments.profile.name();
    match clean {
        [_, _, ..] if arguments.verbose == 0 => vec![format!("{} files: clean for the profile {profile}", clean.len())],
        _ => clean.iter().map(|name| format!("{name}: clean for the profile {profile}")).collect(),
    }
}

/// Findings by rule, the worst first, then those of the first file.
fn by_rule(broken: &[(String, Finding)]) -> Vec<Vec<&(String, Finding)>> {
    let mut rules: Vec<Vec<&(String, Finding)>> = Vec::new();
    for found in broken {
        match rules.iter_mut().find(|rule| rule[0].1.rule == found.1.rule) {
            Some(rule) => rule.push(found),
            None => rules.push(vec![found]),
        }
    }
    rules.sort_by_key(|rule| std::cmp::Reverse(rule[0].1.severity));
    rules
}

/// The lines about one rule: with the only place that breaks it, or with their number and the first of them.
fn describe(findings: &[&(String, Finding)], files: usize, all: bool) -> Vec<String> {
    let place = |(file, finding): &(String, Finding)| {
        let part = finding.part.map_or(String::new(), |part| format!(" part {part}"));
        let channel = finding.channel.as_ref().map_or(String::new(), |channel| format!(" {channel}"));
        format!("{file}:{part}{channel}")
    };
    let Some((_, Finding { rule, severity, effect, mend, what, .. })) = findings.first() else { return Vec::new() };
    let severity = severity.name();
    let mut lines = match findings {
        [one] => vec![format!("{}: {severity} {rule}: {what}", place(one))],
        _ => {
            let mut names: Vec<&str> = findings.iter().map(|(file, _)| file.as_str()).collect();
            names.dedup();
            let of_files = if files > 1 { format!(" in {} of {files} files", names.len()) } else { String::new() };
            let shown = if all { findings.len() } else { EXAMPLES.min(findings.len()) };
            let rest = findings.len() - shown;
            let examples = findings[..shown].iter().map(|found| format!("    {}: {}", place(found), found.1.what));
            let more = (rest > 0).then(|| format!("    ... and {rest} more (-v for all)"));
            std::iter::once(format!("{severity} {rule}: {} times{of_files}", findings.len()))
                .chain(examples)
                .chain(more)
                .collect()
        }
    };
    lines.extend([format!("    {effect}"), format!("    fix: {mend}")]);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(rule: &'static str, severity: Severity, channel: &str) -> Finding {
        let (part, channel, what) = (Some(0), Some(channel.to_owned()), format!("{channel} is half"));
        Finding { rule, severity, part, channel, what, effect: "It is read wrongly", mend: "Store floats" }
    }

    #[test]
    fn a_rule_has_one_line_with_a_count_and_examples() {
        let mut broken = vec![("a.exr".to_owned(), finding("one", Severity::Error, "Z"))];
        for file in ["a.exr", "b.exr"] {
            broken.extend((0..20).map(|i| (file.to_owned(), finding("many", Severity::Error, &format!("c{i}")))));
        }
        broken.insert(0, ("a.exr".to_owned(), finding("mild", Severity::Warning, "x")));
        let lines = |all: bool| by_rule(&broken).iter().map(|rule| describe(rule, 5, all)).collect::<Vec<_>>();
        let [one, many, mild] = &lines(false)[..] else { panic!() };
        assert_eq!(one[0], "a.exr: part 0 Z: error one: Z is half");
        let expected = [
            "error many: 40 times in 2 of 5 files",
            "    a.exr: part 0 c0: c0 is half",
            "    a.exr: part 0 c1: c1 is half",
            "    a.exr: part 0 c2: c2 is half",
            "    ... and 37 more (-v for all)",
            "    It is read wrongly",
            "    fix: Store floats",
        ];
        assert_eq!(
            (&many[..], &mild[0][..]),
            (&expected.map(str::to_owned)[..], "a.exr: part 0 x: warning mild: x is half")
        );
        assert_eq!(lines(true)[1].len(), 43);
    }
}
